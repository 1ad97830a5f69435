//! Solids, tools, static solids and scenery in the picture: one instance each, in runs of a kind.
//!
//! In: posed objects, levels. Out: instances of a [`Picture`]. Never here: tubes, skins, the choice of levels.

use super::compose::{Paint, TEXTURE_ACROSS, instance, level, tint};
use super::lod_transition::{Allowance, Geomorph};
use super::picture::{FloorDraw, MeshKey, Picture, SolidInstance, SolidKind, SolidRun};
use crate::seen::level::{Level, Shading};
use crate::seen::view::{Camera, Size};
use crate::states::scene_view::{Actor, Appearance, Form, Material, SceneView, StaticShape, Track};
use glam::{DVec3, Vec3};
use metachron_core::{Body, ToolState};
use metachron_drawable::{Cut, Foliage, Model};
use metachron_geometry::{Primitive, Rounding, Solid, ToolShape};

/// Level at which fixed solids are drawn.
const STATIC_LEVEL: u8 = 4;
/// Cells of a fixed box are at most this fraction of the light's radius long: light is close to linear across one.
const CELL_SHARE: f64 = 0.125;
/// Most cells along a side of a fixed box; a larger box is lit per pixel everywhere.
const CELLS_MAX: f64 = 24.0;
/// Triangles by which coarsening meshes may exceed their request in total, as a fraction of all triangles requested.
const GEOMORPH_SHARE: f64 = 0.05;

/// A picture in the making, and the camera that it was surveyed for.
#[derive(Clone, Copy)]
pub(super) struct Framed<'a> {
    pub picture: &'a Picture,
    pub eye: Option<(Camera, Size)>,
}

impl Framed<'_> {
    /// Pixels that a metre at a point is large.
    fn pixels_per_m(&self, point: DVec3) -> f64 {
        self.eye
            .map_or(0.0, |(camera, size)| camera.pixels_per_metre((point - camera.eye()).dot(camera.forward()), size))
    }
}

/// Solids by kind, before sorting.
pub(super) type Solids = Vec<(SolidKind, SolidInstance)>;

impl SceneView {
    /// Lets meshes change their cut over this many frames from now on; 0 (the initial value) and 1 are immediate.
    ///
    /// A coarsening mesh then has more triangles than requested until its morph ends; the excess is at most a twentieth of all meshes'
    /// triangles.
    pub const fn set_geomorph_frames(&mut self, frames: u8) {
        self.geomorph_frames = frames;
    }

    /// Limits on morphs in the next picture.
    pub(super) fn allowance(&self, levels: &[Level], shown: &[usize]) -> Allowance {
        if self.geomorph_frames < 2 {
            return Allowance { step: 1.0, triangles: 0.0 };
        }
        let asked = shown.iter().map(|&number| match &self.tracks[number] {
            Track { actor: Actor { form: Form::Scenery(Model::Mesh(progressive), _), .. }, seen: true, .. } => {
                level(levels, number).triangles.min(progressive.range().1)
            }
            _ => 0,
        });
        let triangles = GEOMORPH_SHARE * asked.map(f64::from).sum::<f64>();
        Allowance { step: 1.0 / f32::from(self.geomorph_frames), triangles }
    }
}

/// The kind of a mesh without its own texture.
pub(crate) fn kind(shading: Shading, mesh: MeshKey) -> SolidKind {
    let shading = if shading == Shading::Textured { Shading::PerPixel } else { shading };
    SolidKind { shading, texture: 0, tissue: false, mesh, shadowless: false }
}

/// The mesh and size of a solid at level `n`; `None` for one that has neither a given mesh nor a primitive.
fn mesh_of(solid: &Solid, mesh_index: Option<u32>, n: u8) -> Option<(MeshKey, Rounding)> {
    if let Some(number) = mesh_index {
        return Some((MeshKey::Custom(number), Rounding { extents: Vec3::ONE, radius_m: 0.0 }));
    }
    Primitive::of(solid, n).map(|(primitive, size)| (MeshKey::Primitive(primitive, n), size))
}

pub(super) fn add_solid(
    track: &mut Track,
    at: Level,
    framed: Framed<'_>,
    solids: &mut Solids,
    allowance: &mut Allowance,
) {
    let picture = framed.picture;
    if matches!(track.actor.form, Form::Scenery(..)) {
        return add_scenery(track, at, framed, solids, allowance);
    }
    let paint = Paint::of(track.actor.appearance, tint(picture.style, at, track.age_s));
    match (&track.actor.form, &track.pose) {
        (Form::Solid(solid), Body::Rigid(rigid)) => {
            let Some((mesh, size)) = mesh_of(solid, track.body.mesh_index, at.resolution.n) else { return };
            let place = rigid.position - picture.origin;
            let body = instance(place, rigid.rotation, size, paint);
            solids.push(clad(kind(at.shading, mesh), body, track.actor.appearance, track.body.radius_m));
        }
        (Form::Tool(shape), Body::Tool(tool)) => {
            solids.extend(tool_parts(shape, tool, at, paint, picture.origin));
        }
        _ => {}
    }
}

/// Adds visible scenery with the triangles that its level gives.
fn add_scenery(track: &mut Track, level: Level, framed: Framed<'_>, solids: &mut Solids, allowance: &mut Allowance) {
    let mut paint = Paint::of(track.actor.appearance, tint(framed.picture.style, level, track.age_s));
    let (Form::Scenery(model, at), Body::Rigid(pose), Some(number), true) =
        (&track.actor.form, &track.pose, track.body.mesh_index, track.seen)
    else {
        return;
    };
    let place = pose.position - framed.picture.origin;
    match model {
        Model::Mesh(progressive) => {
            let (mesh, share) = if level.triangles < progressive.range().0 {
                // a part of the coarsest cut, with gaps (RH05, §7.2)
                track.geomorph = None;
                (MeshKey::Cut(number, Cut { triangles: level.triangles, ..progressive.cut(0) }), 0.0)
            } else {
                let geomorph = track.geomorph.get_or_insert_with(|| Geomorph::at(progressive, level.triangles));
                geomorph.advance(progressive, level.triangles, allowance);
                geomorph.drawn(number)
            };
            let painted = track.painting.as_ref().map(|painting| painting.apply(&mut paint, level.shading));
            let (kind, wrap) = match painted.flatten() {
                Some((texture, wrap)) => {
                    (SolidKind { shading: level.shading, texture, ..kind(level.shading, mesh) }, wrap)
                }
                None => (kind(level.shading, mesh), 0.0),
            };
            let size = Rounding { extents: Vec3::splat(at.scale as f32), radius_m: 0.0 };
            let still = instance(place, pose.rotation, size, paint);
            solids.push((kind, SolidInstance { geomorph: share, wrap: [wrap, 0.0], ..still }));
        }
        Model::Foliage(foliage) => {
            let pixels = framed.pixels_per_m(track.bounds.centre) * at.scale;
            for (mesh, growth) in foliage_runs(foliage, number, level.triangles, pixels) {
                let size = Rounding { extents: Vec3::splat(at.scale as f32), radius_m: growth };
                let still = instance(place, pose.rotation, size, paint);
                solids.push((kind(level.shading, mesh), still));
            }
        }
    }
}

/// The meshes of foliage for a number of triangles where one of its units is `pixels` large, and the growth of its points: a mesh is not
/// swept.
fn foliage_runs(foliage: &Foliage, number: u32, triangles: u32, pixels: f64) -> impl Iterator<Item = (MeshKey, f32)> {
    let cut = foliage.cut(triangles, pixels);
    let stroke = foliage.kind().stroke_triangles();
    let strokes = MeshKey::Strokes(number, stroke * cut.strokes.start, stroke * cut.strokes.len() as u32);
    let full = (cut.triangles > 0).then_some((MeshKey::Pieces(number, cut.triangles), 0.0));
    full.into_iter().chain((!cut.strokes.is_empty()).then_some((strokes, cut.growth)))
}

/// The parts of a tool at a level, relative to `origin`.
fn tool_parts(
    shape: &ToolShape,
    tool: &ToolState,
    level: Level,
    paint: Paint,
    origin: DVec3,
) -> impl Iterator<Item = (SolidKind, SolidInstance)> {
    shape.parts(tool.jaw).into_iter().map(move |part| {
        let position = tool.tip + tool.rotation * part.position - origin;
        let mesh = MeshKey::Primitive(part.primitive, level.resolution.n);
        (kind(level.shading, mesh), instance(position, tool.rotation * part.rotation, part.size, paint))
    })
}

pub(super) fn add_static(prop: &StaticShape, picture: &mut Picture, solids: &mut Solids) {
    if matches!(prop.solid, Solid::Plane) {
        let point = prop.position - picture.origin;
        let floor = FloorDraw { point, normal: prop.rotation * DVec3::Z, colour: prop.appearance.colour };
        picture.floor.get_or_insert(floor);
        return;
    }
    let slab = slab_of(prop, picture.focus_radius_m);
    let Some((mesh, size)) = slab.or_else(|| mesh_of(&prop.solid, prop.body.mesh_index, STATIC_LEVEL)) else { return };
    let paint = Paint::of(prop.appearance, [0; 4]);
    let still = instance(prop.position - picture.origin, prop.rotation, size, paint);
    let kind = SolidKind { shadowless: !prop.throws_shadow, ..kind(Shading::PerPixel, mesh) };
    solids.push(clad(kind, still, prop.appearance, prop.body.radius_m));
}

/// The same with the texture of tissue where it is a mesh of it, of this radius.
fn clad(kind: SolidKind, body: SolidInstance, look: Appearance, radius_m: f64) -> (SolidKind, SolidInstance) {
    let tissue = look.material == Material::Tissue && matches!(kind.mesh, MeshKey::Custom(_));
    let repeats_per_m = if tissue { TEXTURE_ACROSS / radius_m.max(1e-6) } else { 0.0 };
    (SolidKind { tissue, ..kind }, SolidInstance { wrap: [repeats_per_m as f32, 0.0], ..body })
}

/// A fixed box as a slab: sharp, since boxes are joined to trays and tables, and divided into cells small enough to be lit per vertex.
/// Excluded are brushed metal, and boxes far larger than the light's region.
fn slab_of(prop: &StaticShape, light_radius_m: f64) -> Option<(MeshKey, Rounding)> {
    let Solid::Box { half_extents_m } = prop.solid else { return None };
    let cells = (2.0 * half_extents_m / (CELL_SHARE * light_radius_m)).ceil().max(DVec3::ONE);
    let fits = cells.max_element() <= CELLS_MAX && prop.appearance.material != Material::Metal;
    let size = Rounding { extents: half_extents_m.as_vec3(), radius_m: 0.0 };
    fits.then(|| (MeshKey::Slab(cells.to_array().map(|count| count as u8)), size))
}

/// Sorts solids by shading and mesh and cuts them into runs.
pub(super) fn sort_solids(solids: &mut Solids, picture: &mut Picture) {
    // the order among equal keys does not show, so an unstable sort, which does not allocate, suffices
    solids.sort_unstable_by_key(|(key, _)| *key);
    for (kind, solid) in solids.iter() {
        let first = picture.instances.len() as u32;
        picture.instances.push(*solid);
        match picture.solids.last_mut() {
            Some(run) if run.kind == *kind => run.count += 1,
            _ => picture.solids.push(SolidRun { kind: *kind, first, count: 1 }),
        }
    }
}
