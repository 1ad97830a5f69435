//! Geoms and the meshes that they name.
//!
//! In: `geom` and `mesh` elements. Out: [`Geom`]s. Never here: the mass of a body.

use super::bodies::{BodyReader, Placed, z_to};
use super::compiler::Compiler;
use super::height_fields::{Ground, Heights};
use crate::imported::ImportError;
use crate::model::{Masks, Part, Shape, Surface};
use crate::pose::Pose;
use crate::weight::Weight;
use crate::xml::Element;
use glam::DVec3;
use metachron_geometry::Solid;
use std::collections::BTreeMap;

/// Density of a geom that says none, kg/m³.
const DENSITY_DEFAULT_KG_M3: f64 = 1000.0;
/// Friction of a geom that says none.
const FRICTION_DEFAULT: f64 = 1.0;

/// A solid of a body, with its properties beside its shape.
#[derive(Debug)]
pub(super) struct Geom {
    pub(super) part: Part,
    /// Whether it is ground, which never moves and weighs nothing.
    pub(super) stays: bool,
    /// `None` of a mesh or ellipsoid that says a mass.
    pub(super) density_kg_m3: Option<f64>,
    pub(super) mass_kg: Option<f64>,
    pub(super) colour: Option<[u8; 3]>,
    pub(super) surface: Surface,
}

/// A mesh of the file.
#[derive(Debug)]
pub(super) struct Mesh<'a> {
    element: &'a Element,
    points: MeshPoints,
    scale: [f64; 3],
}

/// Where the points of a mesh are.
#[derive(Debug)]
enum MeshPoints {
    File(String),
    Here(Vec<DVec3>),
}

/// The meshes of a file by name.
pub(super) fn meshes<'a>(root: &'a Element, compiler: &Compiler) -> Result<BTreeMap<String, Mesh<'a>>, ImportError> {
    let mut found = BTreeMap::new();
    for (name, element) in assets(root, "mesh")? {
        let scale = element.numbers("scale")?.unwrap_or([1.0; 3]);
        let points = if let Some(file) = element.text("file") {
            MeshPoints::File(compiler.in_mesh_folder(file))
        } else if let Some(all) = element.list("vertex")? {
            let scaled = |point: &[f64]| DVec3::from_slice(point) * DVec3::from_array(scale);
            MeshPoints::Here(all.chunks_exact(3).map(scaled).collect())
        } else {
            continue;
        };
        found.insert(name, Mesh { element, points, scale });
    }
    Ok(found)
}

/// The assets of a kind by name: that of their file where they have none.
///
/// # Errors
/// For two of one name.
pub(super) fn assets<'a>(root: &'a Element, tag: &'static str) -> Result<BTreeMap<String, &'a Element>, ImportError> {
    let mut found = BTreeMap::new();
    for element in root.children("asset").flat_map(|asset| asset.children(tag)) {
        let stem = |file| std::path::Path::new(file).file_stem()?.to_str();
        let name = element.text("name").or_else(|| element.text("file").and_then(stem)).unwrap_or(tag);
        if found.insert(name.to_owned(), element).is_some() {
            return Err(
                element.wrong(format!("is the second {tag} that is called `{name}`; expected names of one each"))
            );
        }
    }
    Ok(found)
}

/// The part of a scene that an element is, or why there is none.
type Found<T> = Result<Result<T, String>, ImportError>;

impl BodyReader<'_> {
    /// A geom; nothing for one that scenes cannot have, which is noted.
    pub(super) fn geom(&mut self, placed: Placed<'_>) -> Result<Option<Geom>, ImportError> {
        let element = placed.element.read();
        let own = self.compiler.pose(element)?;
        let masks = Masks { types: mask(element, "contype")?, partners: mask(element, "conaffinity")? };
        let touches = masks.types != 0 || masks.partners != 0;
        element.read_zeros(&["margin", "gap", "priority"]);
        element.read_if("condim", "3");
        if !touches {
            element.read_all(&["condim", "solref", "solimp", "solmix", "margin", "gap", "priority"]);
        }
        let kind = element.text("type").unwrap_or("sphere");
        let stays = ["plane", "hfield"].contains(&kind);
        let (shape, pose) = match self.shape(element, kind, own)? {
            Ok(found) => found,
            Err(why) => {
                self.notes.push(element.note(format!("is left out: {why}")));
                return Ok(None);
            }
        };
        let [friction, ..] = element.numbers_or("friction", [FRICTION_DEFAULT, 0.0, 0.0])?;
        if !(0.0..=10.0).contains(&friction) {
            return Err(element.wrong(format!("`friction` is {friction}; expected 0 to 10")));
        }
        let (given, mass_kg) = (element.number("density")?.unwrap_or(DENSITY_DEFAULT_KG_M3), element.number("mass")?);
        if given < 0.0 || mass_kg.is_some_and(|mass| mass < 0.0) {
            return Err(element.wrong("has a mass or density below zero"));
        }
        let density_kg_m3 = match (mass_kg, &shape) {
            _ if stays || mass_kg == Some(0.0) => Some(0.0),
            (None, _) => Some(given),
            (Some(mass), Shape::Solid(solid)) => {
                Some(mass / solid.volume_m3().map_err(|why| element.wrong(why.to_string()))?)
            }
            (Some(_), Shape::Hull { .. } | Shape::Ellipsoid { .. } | Shape::Ground { .. }) => None,
        };
        let colour = element.numbers::<4>("rgba")?;
        let colour = colour.map(|[r, g, b, _]| [r, g, b].map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8));
        let place = element.place.clone();
        let part = Part { place, shape, pose: placed.frame.then(pose), density_kg_m3: None, touches };
        Ok(Some(Geom { part, stays, density_kg_m3, mass_kg, colour, surface: Surface { friction, masks } }))
    }

    /// The shape of a geom of a `kind` and where it is, which `fromto` says otherwise than `own`.
    /// Or why scenes have none such.
    fn shape(&mut self, element: &Element, kind: &str, own: Pose) -> Found<(Shape, Pose)> {
        let size = element.numbers_or("size", [0.0; 3])?;
        let edge = |i: usize| {
            let value = size[i];
            let least = format!("`size` has {value} at place {}; expected more than zero", i + 1);
            if value > 0.0 { Ok(value) } else { Err(element.wrong(least)) }
        };
        let line = Line::of(element)?;
        let pose = line.map_or(own, |line| line.pose);
        let half = |at: usize| line.map_or_else(|| edge(at), |line| Ok(line.half_m));
        let solid = match kind {
            "sphere" => Solid::Ball { radius_m: edge(0)? },
            "capsule" => Solid::Capsule { radius_m: edge(0)?, half_height_m: half(1)? },
            "cylinder" => Solid::Cylinder { radius_m: edge(0)?, half_height_m: half(1)? },
            "box" => {
                let across = edge(if line.is_some() { 0 } else { 1 })?;
                Solid::Box { half_extents_m: DVec3::new(edge(0)?, across, half(2)?) }
            }
            "plane" => Solid::Plane,
            "ellipsoid" => {
                let along = half(2)?;
                let across = edge(if line.is_some() { 0 } else { 1 })?;
                return Ok(self.files.ellipsoid(DVec3::new(edge(0)?, across, along)).map(|shape| (shape, pose)));
            }
            "mesh" => return Ok(self.mesh(element)?.map(|shape| (shape, pose))),
            "hfield" => return Ok(self.height_field(element)?.map(|(shape, own)| (shape, pose.then(own)))),
            other => return Ok(Err(format!("scenes have no {other}"))),
        };
        Ok(Ok((Shape::Solid(solid), pose)))
    }

    /// The hull of a mesh, or why there is none.
    fn mesh(&mut self, element: &Element) -> Found<Shape> {
        let name = element.needed("mesh")?;
        let Some(Mesh { element: mesh, points, scale }) = self.meshes.get(name) else {
            return Err(element.wrong(format!("names the mesh `{name}`, and there is none of that name with points")));
        };
        let hull = match points {
            MeshPoints::File(file) => self.files.hull(mesh, file, *scale)?.map_err(|why| format!("`{file}`: {why}")),
            MeshPoints::Here(points) => self.files.hull_of(name, points.clone()),
        };
        Ok(hull)
    }

    /// The ground of a height field and where that is, or why there is none.
    fn height_field(&mut self, element: &Element) -> Found<(Shape, Pose)> {
        let name = element.needed("hfield")?;
        let Some(field) = self.height_fields.get(name).copied() else {
            return Err(element.wrong(format!("names the height field `{name}`, and there is none of that name")));
        };
        field.needed("size")?;
        let size = field.numbers::<4>("size")?.unwrap_or_default();
        if size.iter().any(|value| *value <= 0.0) {
            return Err(field.wrong(format!("`size` is {size:?}; expected four lengths of more than zero")));
        }
        let heights = match field.text("file") {
            None => Heights::here(field)?,
            Some(file) => {
                // its first bytes say what it is
                field.read_all(&["content_type"]);
                let bytes = self.files.bytes(field, &self.compiler.in_mesh_folder(file))?;
                match bytes.and_then(|bytes| Heights::read(&bytes)) {
                    Ok(heights) => heights,
                    Err(why) => return Ok(Err(format!("`{file}`: {why}"))),
                }
            }
        };
        Ok(match heights.ground(size) {
            Ground::Even { solid, below_m } => {
                Ok((Shape::Solid(solid), Pose { position: DVec3::NEG_Z * below_m, ..Pose::IDENTITY }))
            }
            Ground::Uneven(surface) => self.files.ground(name, surface).map(|shape| (shape, Pose::IDENTITY)),
        })
    }

    /// The weight of a geom in the axes of its body; `None` where its mesh cannot be read.
    pub(super) fn weight(&self, geom: &Geom) -> Option<Weight> {
        let density_kg_m3 = geom.density_kg_m3.unwrap_or(DENSITY_DEFAULT_KG_M3);
        let own = match &geom.part.shape {
            Shape::Solid(solid) => Weight::of_solid(solid, density_kg_m3)?,
            Shape::Ellipsoid { semi_axes_m, .. } => Weight::of_ellipsoid(*semi_axes_m, density_kg_m3),
            Shape::Ground { .. } => Weight::NONE,
            Shape::Hull { file, scale } => Weight::of_surface(&self.files.surface(file, *scale)?, density_kg_m3)?,
        };
        Some(geom.mass_kg.map_or(own, |mass_kg| own.with_mass(mass_kg)).at(geom.part.pose))
    }
}

/// The bits of a mask of contacts.
fn mask(element: &Element, name: &str) -> Result<u32, ImportError> {
    let Some(value) = element.number(name)? else { return Ok(1) };
    let bits = value as u32;
    if f64::from(bits) == value {
        Ok(bits)
    } else {
        Err(element.wrong(format!("`{name}` is {value}; expected 32 bits")))
    }
}

/// The line from end to end that `fromto` gives.
#[derive(Clone, Copy)]
struct Line {
    pose: Pose,
    half_m: f64,
}

impl Line {
    fn of(element: &Element) -> Result<Option<Self>, ImportError> {
        let Some([a, b, c, d, e, f]) = element.numbers("fromto")? else { return Ok(None) };
        let (from, to) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
        let Some(along) = (to - from).try_normalize() else {
            return Err(element.wrong("`fromto` has both ends at one point"));
        };
        let pose = Pose { position: (from + to) / 2.0, rotation: z_to(along) };
        Ok(Some(Self { pose, half_m: from.distance(to) / 2.0 }))
    }
}
