//! Reads meshes and trees of a scene file as scenery.
//!
//! In: entries of these models. Out: [`Scenery`], copies sharing one model. Never here: groups, drawing.

use super::common::{appearance, pace, painted_appearance, parse_colour, point, rotation};
use super::contact;
use super::mesh;
use super::objects::{Entry, ModelFile};
use super::texture;
use super::texture::Textures;
use crate::check::{Checker, Place};
use crate::demand::Cost;
use crate::format::{MeshFile, MotionFile, Point, TreeFile, TreeLod};
use crate::source::Source;
use glam::{DQuat, DVec3};
use metachron_drawable::{
    Generator, Model, Motion, Placement, ProgressiveMesh, TreeSpec, generate, geodesic_edges, tree,
};
use metachron_geometry::painted_mesh;
use metachron_world::kinds::Material;
use metachron_world::{Appearance, Scenery};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Default triangles of a generated mesh.
const TRIANGLES_DEFAULT: u32 = 1000;
/// Default boughs and leaves of a tree: the first of (RH05, §6).
const TREE_DEFAULT: (u32, u32) = (62, 240);
/// Leaves are less important than the trunk (RH05, §6 gives no number).
const LEAVES_IMPORTANCE: f64 = 0.5;
/// Default swings of a motion, Hz.
const SWING_HZ: f64 = 0.1;
/// Default colours.
const BARK: [u8; 3] = [0x6e, 0x50, 0x3a];
const LEAF: [u8; 3] = [0x5a, 0x8a, 0x42];

/// Meshes already made, by their sources: equal ones are shared.
struct Meshes<'s> {
    /// Where their files are.
    source: &'s Source,
    /// Each with its greatest coordinate in its own unit.
    /// `None` in a draft.
    made: BTreeMap<MeshKey, Option<(Arc<ProgressiveMesh>, f64)>>,
}

/// The source of a mesh: a file or generator, a seed, and the greatest and least number of triangles.
type MeshKey = (String, u32, [Option<u32>; 2]);

impl<'s> Meshes<'s> {
    fn new(source: &'s Source) -> Self {
        Self { source, made: BTreeMap::new() }
    }
}

/// Reads every mesh and tree.
pub(super) fn read(c: &mut Checker<'_, '_>, entries: &[Entry], source: &Source) -> Vec<Scenery> {
    let (mut scenery, mut meshes, mut textures) = (Vec::new(), Meshes::new(source), Textures::new(source));
    for entry in entries {
        let before = c.count();
        c.begin_object(entry.copies.len());
        if matches!(entry.model, ModelFile::Mesh(_) | ModelFile::Tree(_)) {
            contact::refuse(c, &entry.place, entry.common.contact.as_ref());
        }
        let parts = match &entry.model {
            ModelFile::Mesh(file) => {
                let parts = mesh_parts(c, entry, file, &mut meshes);
                texture::apply(c, entry, file, parts, &mut textures)
            }
            ModelFile::Tree(file) => tree_parts(c, entry, file),
            _ => continue,
        };
        if c.count() > before {
            continue;
        }
        for (copy, name) in entry.copies.places(&entry.common.name) {
            scenery.extend(parts.iter().map(|(suffix, part)| Scenery {
                name: format!("{name}{suffix}"),
                at: Placement { position: part.at.position + copy.offset_m, ..part.at },
                motion: part.motion.map(|motion| Motion { about_m: motion.about_m + copy.offset_m, ..motion }),
                ..part.clone()
            }));
        }
    }
    scenery
}

/// The mesh of a file or a generator, as the table at `place` requests it.
pub(super) fn mesh_model(
    c: &mut Checker<'_, '_>,
    place: &Place,
    file: &MeshFile,
    source: &Source,
) -> Option<(Arc<ProgressiveMesh>, Placement)> {
    if file.dome_m.is_some() {
        c.wrong(place, "dome_m", "makes many meshes of one proxy", "expected a single mesh");
    }
    if file.motion.is_some() {
        c.wrong(place, "motion", "moves a proxy by itself", "expected a proxy without it: it moves as its group does");
    }
    mesh_of(c, place, file, &mut Meshes::new(source))
}

fn mesh_of(
    c: &mut Checker<'_, '_>,
    place: &Place,
    file: &MeshFile,
    meshes: &mut Meshes<'_>,
) -> Option<(Arc<ProgressiveMesh>, Placement)> {
    let (triangles, least, scale) = (file.triangles, file.least_triangles, file.scale.unwrap_or(1.0));
    let at = Placement { scale, ..placement(file.position_m, file.rotation_deg) };
    if file.seed.is_some() && file.generate.is_none() {
        c.wrong(place, "seed", "has no effect alone", "expected `generate` beside it");
    }
    let made_from = match surface_source(c, place, file.file.as_deref(), file.generate)? {
        SurfaceSource::File(name) => name.to_owned(),
        SurfaceSource::Generated(kind) => format!("{kind:?}"),
    };
    let key = (made_from, file.seed.unwrap_or(0), [triangles, least]);
    if let Some(known) = meshes.made.get(&key) {
        let (mesh, reach) = known.as_ref()?;
        return in_bounds(c, place, "scale", scale, *reach).then(|| (Arc::clone(mesh), at));
    }
    let may_make = match &file.file {
        Some(name) => c.may_read(place, "file", meshes.source.head(name), Cost::mesh_of_file),
        None => c.may_make(place, "triangles", Cost::mesh(u64::from(triangles.unwrap_or(TRIANGLES_DEFAULT)))),
    };
    if !may_make {
        meshes.made.insert(key, None);
        return None;
    }
    let built = match (&file.file, file.generate) {
        (Some(name), _) => from_file(name, meshes.source, scale),
        (None, kind) => {
            ProgressiveMesh::new(&generate(kind?, u64::from(key.1), triangles.unwrap_or(TRIANGLES_DEFAULT)))
                .map_err(|why| why.to_string())
        }
    };
    match built {
        Ok(mesh) => {
            let wanted = triangles.or(file.generate.map(|_| TRIANGLES_DEFAULT));
            let mesh = match wanted {
                Some(most) => mesh.truncated(most),
                None => mesh,
            };
            let mesh = Arc::new(mesh.no_coarser(least.unwrap_or(0)));
            let reach = reach(&mesh);
            meshes.made.insert(key, Some((Arc::clone(&mesh), reach)));
            in_bounds(c, place, "scale", scale, reach).then_some((mesh, at))
        }
        Err(why) => {
            let what = format!("cannot be used: {}: {why}", key.0);
            c.wrong(place, "file", what, "expected a .glb, STL or OBJ file beside the scene");
            None
        }
    }
}

fn from_file(name: &str, source: &Source, scale: f64) -> Result<ProgressiveMesh, String> {
    let mesh = mesh::read(&source.sibling(name)?, scale)?;
    ProgressiveMesh::new(&painted_mesh(&mesh.points, &mesh.uvs, &mesh.triangles)).map_err(|why| why.to_string())
}

/// The greatest coordinate of a mesh, in its own unit.
fn reach(mesh: &ProgressiveMesh) -> f64 {
    mesh.vertices().iter().map(|v| f64::from(v.core.abs().max_element())).fold(0.0, f64::max)
}

/// Whether a mesh whose coordinates go up to `reach` in its own unit is within the bounds of a scene at this scale; reports it if not.
fn in_bounds(c: &mut Checker<'_, '_>, place: &Place, key: &str, scale: f64, reach: f64) -> bool {
    let within = mesh::within(reach, scale);
    if let Err(why) = &within {
        c.wrong(place, key, format_args!("makes it too large: {why}"), "expected a mesh within the bounds of a scene");
    }
    within.is_ok()
}

/// Where the triangles of a surface come from.
pub(super) enum SurfaceSource<'a> {
    /// A file, by its path relative to the scene's.
    File(&'a str),
    /// A generator.
    Generated(Generator),
}

/// The one of `file` and `generate` that a table has; `None` where it has both or neither, which is reported.
pub(super) fn surface_source<'a>(
    c: &mut Checker<'_, '_>,
    place: &Place,
    file: Option<&'a str>,
    generate: Option<Generator>,
) -> Option<SurfaceSource<'a>> {
    match (file, generate) {
        (Some(name), None) => return Some(SurfaceSource::File(name)),
        (None, Some(kind)) => return Some(SurfaceSource::Generated(kind)),
        (Some(_), Some(_)) => c.wrong(place, "generate", "contradicts `file`", "expected one of them"),
        (None, None) => c.wrong(place, "file", "is missing", "expected `file` or `generate` in this table"),
    }
    None
}

fn placement(position: Option<Point>, rotation_deg: Option<Point>) -> Placement {
    Placement { position: point(position), rotation: rotation(rotation_deg).normalize(), scale: 1.0 }
}

/// The parts of one copy, each with the suffix of its name.
pub(super) type Parts = Vec<(String, Scenery)>;

fn mesh_parts(c: &mut Checker<'_, '_>, entry: &Entry, file: &MeshFile, meshes: &mut Meshes<'_>) -> Parts {
    // scenery has no steps, but a wrong rate is still wrong
    pace(c, &entry.place, &entry.common);
    let appearance = painted_appearance(c, &entry.place, &entry.common, Material::Plastic);
    if file.dome_m.is_some() && file.scale.is_some() {
        c.wrong(&entry.place, "scale", "contradicts `dome_m`", "expected one of them");
    }
    let motion = file.motion.as_ref().map(|file| motion(c, &entry.place.table("motion"), file));
    let Some((mesh, at)) = mesh_of(c, &entry.place, file, meshes) else { return Parts::new() };
    let motion = motion.map(|motion| Motion { about_m: at.position, ..motion });
    let model = Model::Mesh(Arc::clone(&mesh));
    let part = |at| Scenery { name: String::new(), model: model.clone(), at, appearance, texture: None, motion };
    match file.dome_m {
        None => vec![(String::new(), part(at))],
        Some(radius_m) => {
            let places: Vec<Placement> = dome_places(at, radius_m).collect();
            let scale = places.iter().map(|at| at.scale).fold(0.0, f64::max);
            in_bounds(c, &entry.place, "dome_m", scale, reach(&mesh));
            places.into_iter().enumerate().map(|(k, at)| (format!("-{k}"), part(at))).collect()
        }
    }
}

/// The motion of a mesh at the world's origin.
fn motion(c: &mut Checker<'_, '_>, place: &Place, file: &MotionFile) -> Motion {
    if file.swing_hz.is_some() && file.swing_m.is_none() {
        c.wrong(place, "swing_hz", "has no effect alone", "expected `swing_m` beside it");
    }
    Motion {
        about_m: DVec3::ZERO,
        spin_rad_s: point(file.spin_rad_s),
        swing_m: point(file.swing_m),
        swing_hz: file.swing_hz.unwrap_or(SWING_HZ),
    }
}

fn tree_parts(c: &mut Checker<'_, '_>, entry: &Entry, file: &TreeFile) -> Parts {
    let place = &entry.place;
    pace(c, place, &entry.common);
    let bark = appearance(c, place, &entry.common, Material::Skin);
    let spec = TreeSpec {
        seed: u64::from(file.seed.unwrap_or(0)),
        height_m: file.height_m,
        branches: file.branches.unwrap_or(TREE_DEFAULT.0),
        leaves: file.leaves.unwrap_or(TREE_DEFAULT.1),
        prefix: file.lod == Some(TreeLod::Prefix),
    };
    let share = file.leaves_importance.unwrap_or(LEAVES_IMPORTANCE);
    let colour = file.leaves_colour.as_deref().map_or(Some(LEAF), parse_colour).unwrap_or_else(|| {
        c.wrong(place, "leaves_colour", "is not a colour", "expected `#rrggbb`, such as `#5a8a42`");
        LEAF
    });
    let leaf = Appearance { colour, importance: bark.importance * share, ..bark };
    let bark = Appearance { colour: if entry.common.colour.is_some() { bark.colour } else { BARK }, ..bark };
    let at = placement(file.position_m, file.rotation_deg);
    if !c.may_make(place, "leaves", Cost::tree(u64::from(spec.branches), u64::from(spec.leaves))) {
        return Parts::new();
    }
    let [trunk, crown] = tree(&spec).map(|foliage| Model::Foliage(Arc::new(foliage)));
    let part = |model, appearance| Scenery { name: String::new(), model, at, appearance, texture: None, motion: None };
    vec![(String::new(), part(trunk, bark)), (".leaves".to_owned(), part(crown, leaf))]
}

/// Placements along every edge of a geodesic sphere about `at`: −1 … 1 on a copy's z axis spans its edge from end to end.
fn dome_places(at: Placement, radius_m: f64) -> impl Iterator<Item = Placement> {
    geodesic_edges().into_iter().map(move |[a, b]| {
        let along = b - a;
        Placement {
            position: at.position + at.rotation * (0.5 * radius_m * (a + b)),
            rotation: at.rotation * DQuat::from_rotation_arc(DVec3::Z, along.normalize()),
            scale: 0.5 * radius_m * along.length(),
        }
    })
}
