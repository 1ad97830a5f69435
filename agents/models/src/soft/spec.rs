//! Specification of a soft body: its properties and initial state, the numbers a scene gives, and their checks.

use super::grid::Side;
use super::material::Lame;
use glam::{DQuat, DVec3};
use metachron_core::{NumberRange, OutOfRange, Ranges, ResolutionRange, unit_rotation};
use metachron_geometry::{
    ContactTraits, FRICTION, Halving, Tetrahedra, TetrahedraFault, Triangles, branch, cage_counts, is_closed, opposed,
};
use std::sync::Arc;

/// Ranges of the numbers of [`SoftMaterial`]. At a Poisson's ratio of 0.5 a material is incompressible, which its elements cannot be.
pub const MATERIAL: Ranges = Ranges(&[
    ("young_pa", NumberRange::new(1.0, 1e11, "Pa")),
    ("poisson", NumberRange::new(0.0, 0.499, "")),
    ("density_kg_m3", NumberRange::new(1.0, 1e5, "kg/m³")),
    ("damping_per_s", NumberRange::new(0.0, 1e4, "1/s")),
    ("damping_s", NumberRange::new(0.0, 10.0, "s")),
]);
/// Range of lengths, radii, thicknesses and spacings.
pub const LENGTH: NumberRange = NumberRange::new(1e-6, 1e4, "m");
/// Range of the number of cells along an axis; of a ball from 2 on.
pub const SEGMENTS: NumberRange = NumberRange::new(1.0, 2047.0, "");

/// A soft body before it is built.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct SoftSpec {
    /// Its shape at rest, and how finely it is divided.
    pub shape: SoftShape,
    /// The spacing of the nodes of a sheet or rope whose ε may change: its skin is then the lattice that its shape names, which moves with
    /// coarser nodes. `None`: the vertices of the shape's lattice are the nodes.
    pub nodes: Option<NodeSpacing>,
    /// Cells of a cage longer than this are halved where something touches the body, metres, within [`LENGTH`]; `None`: nowhere.
    pub eps_touched_m: Option<f64>,
    /// Its material.
    pub material: SoftMaterial,
    /// Position of its first corner, or of a ball's centre, at the start, metres.
    pub position: DVec3,
    /// Rotation from its own axes to the world's.
    pub rotation: DQuat,
    /// Velocity of all of it at the start, m/s.
    pub velocity: DVec3,
    /// The sides whose vertices never move.
    pub held: Vec<Side>,
    /// Coulomb friction coefficient of its skin, within [`FRICTION`].
    pub friction: f64,
    /// Its groups, combine rules, spin friction, and whether it is a sensor.
    pub traits: ContactTraits,
    /// Gravity, m/s².
    pub gravity: DVec3,
    /// Whether it touches itself.
    pub self_contact: bool,
    /// Whether it may report that it is at rest.
    pub sleep: bool,
}

/// The material of a soft body; [`MATERIAL`] has the ranges of its numbers.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SoftMaterial {
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, kg/m³.
    pub density_kg_m3: f64,
    /// Mass-proportional damping, 1/s: dv/dt = … − c v.
    pub damping_per_s: f64,
    /// Stiffness-proportional damping of Rayleigh, s: stresses lag behind strains by this time.
    pub damping_s: f64,
    /// How stress follows from strain; sheets and ropes have laws of their own.
    pub law: MaterialLaw,
}

/// How the stress of a solid follows from its strain. Near rest all are the law of Hooke with the same E and ν.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub enum MaterialLaw {
    /// Linear in strains that turn with the body: cheapest, for strains of some 20 %.
    #[default]
    Corotational,
    /// Stable Neo-Hookean (SGK18): rubber-like, and it comes back from inside out.
    NeoHookean,
    /// The law of Ogden (Ogd72) of one term: with a large exponent it stiffens as tissue does.
    Ogden {
        /// The exponent, 1 … 20 or −20 … −1; 2 is Neo-Hookean.
        exponent: f64,
    },
}

/// The material of a region of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RegionMaterial {
    /// The number of the region in the mesh.
    pub region: i64,
    /// Its material. The damping of a body is that of all of it.
    pub material: SoftMaterial,
}

/// How far apart the nodes are that carry a skin.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct NodeSpacing {
    /// Largest length of a cell at the start, metres, within [`LENGTH`].
    pub eps_m: f64,
    /// The finest and the coarsest one that it may take, metres.
    pub range_m: (f64, f64),
}

/// The shapes of soft bodies in their own axes.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum SoftShape {
    /// A flat rectangle in the plane z = 0, from its first corner on.
    Sheet {
        /// Length along x and y, metres.
        size_m: [f64; 2],
        /// Thickness, metres.
        thickness_m: f64,
        /// Cells along x and y.
        segments: [u32; 2],
    },
    /// A box, from its first corner on.
    Box {
        /// Length along x, y and z, metres.
        size_m: DVec3,
        /// Cells along x, y and z.
        segments: [u32; 3],
    },
    /// A ball about its position.
    Ball {
        /// Radius, metres.
        radius_m: f64,
        /// Cells across it.
        segments: u32,
    },
    /// The inside of a closed surface, divided into a cage of cells around it. The surface moves with the cage: others touch, grasp
    /// and draw it, and it stays the same when the cage is made anew at another ε.
    Embedded {
        /// The surface in the body's own axes, metres, its triangles counter-clockwise seen from outside.
        surface: Arc<Triangles>,
        /// Largest length of a cell at the start, metres.
        eps_m: f64,
        /// The finest and the coarsest one that it may take, metres.
        range_m: (f64, f64),
    },
    /// Tetrahedra as a mesh gives them, linear in each.
    Tetrahedra {
        /// The mesh in the body's own axes.
        mesh: Arc<Tetrahedra>,
        /// Regions of another material than the body's.
        regions: Vec<RegionMaterial>,
    },
    /// A sheet of a triangle mesh, of whatever shape at rest.
    Shell {
        /// The mesh in the body's own axes, metres; it may be open.
        surface: Arc<Triangles>,
        /// Thickness, metres.
        thickness_m: f64,
    },
    /// A rope along a path.
    Rope {
        /// Points, metres, in the rope's own axes; vertices divide it into equal lengths.
        path_m: Vec<DVec3>,
        /// Radius, metres.
        radius_m: f64,
        /// Pieces.
        segments: u32,
    },
}

/// Why a soft body cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SoftError {
    /// A number is outside its range.
    #[error(transparent)]
    BadNumber(#[from] OutOfRange),
    /// A vector or rotation is not finite, or a rotation is zero.
    #[error("{what} is not finite")]
    BadVector {
        /// Which one.
        what: &'static str,
    },
    /// A rope's path has no length.
    #[error("the path of a rope needs at least two different points")]
    NoPath,
    /// There are more vertices than a step can take.
    #[error("the soft body has {vertices} vertices; at most {VERTICES_MAX} are supported: use fewer segments")]
    TooFine {
        /// How many it would have.
        vertices: u64,
    },
    /// A surface has no inside.
    #[error("the surface of the soft body {why}")]
    NoInside {
        /// The fault of the surface, as the rest of a sentence.
        why: &'static str,
    },
    /// Tetrahedra that make no solid.
    #[error("the mesh cannot be a solid: {0}")]
    BadTetrahedra(#[from] TetrahedraFault),
    /// A surface that makes no sheet.
    #[error("the surface of the sheet {why}")]
    BadSheet {
        /// The fault of the surface, as the rest of a sentence.
        why: &'static str,
    },
    /// The law of Ogden with this exponent pushes back less the more it is compressed.
    #[error("the exponent {exponent} of Ogden needs a larger Poisson's ratio: λ + 2 μ/exponent must be positive")]
    Unstable {
        /// The exponent.
        exponent: f64,
    },
    /// A shape whose cells cannot change has an ε.
    #[error("a lattice of a {model} has no spacing of nodes beside its segments: only sheets and ropes have")]
    NoSpacing {
        /// The model.
        model: &'static str,
    },
    /// A body without a cage has an ε where it is touched.
    #[error("a {model} without a cage has no ε where it is touched: only the inside of a closed surface has one")]
    NoCage {
        /// The model.
        model: &'static str,
    },
    /// A number that no cell has.
    #[error("there is no cell {cell}: the body has {cells}")]
    NoCell {
        /// The number.
        cell: usize,
        /// How many cells there are.
        cells: usize,
    },
    /// All cells, or all of no cells, cannot be removed.
    #[error("no cell would be left")]
    AllCells,
    /// A cage has more vertices than a step can take.
    #[error(
        "a cage of cells of {eps_m} m has more than the {VERTICES_MAX} vertices that are supported: use a larger ε"
    )]
    FineCage {
        /// The spacing asked for, metres.
        eps_m: f64,
    },
    /// A side that its shape does not have.
    #[error("a {model} has no side `{side}`")]
    NoSide {
        /// The model.
        model: &'static str,
        /// The side's name.
        side: &'static str,
    },
}

/// The most vertices of a soft body: a step of a cube of as many takes some 15 ms alone, and seconds where it lands.
pub const VERTICES_MAX: u64 = 10_000;

impl SoftShape {
    /// The model's name as scenes write it.
    #[must_use]
    pub const fn model(&self) -> &'static str {
        match self {
            Self::Sheet { .. } | Self::Shell { .. } => "sheet",
            Self::Box { .. } | Self::Ball { .. } | Self::Embedded { .. } | Self::Tetrahedra { .. } => "solid",
            Self::Rope { .. } => "rope",
        }
    }

    /// How many vertices its lattice has; for a cage, of a box around it.
    #[must_use]
    pub fn vertices(&self) -> u64 {
        let along = |segments: u32| u64::from(segments) + 1;
        match self {
            Self::Sheet { segments: [x, y], .. } => along(*x).saturating_mul(along(*y)),
            Self::Box { segments: [x, y, z], .. } => along(*x).saturating_mul(along(*y)).saturating_mul(along(*z)),
            Self::Ball { segments, .. } => along(*segments).saturating_pow(3),
            Self::Embedded { surface, eps_m, .. } => {
                let along = cage_counts(surface, *eps_m).map(|count| count as u64 + 1);
                along.into_iter().fold(1, u64::saturating_mul)
            }
            Self::Tetrahedra { mesh, .. } => mesh.points.len() as u64,
            Self::Shell { surface, .. } => surface.points.len() as u64,
            Self::Rope { segments, .. } => along(*segments),
        }
    }

    fn check(&self) -> Result<(), SoftError> {
        let count = |what, value: u32| SEGMENTS.check(what, f64::from(value));
        match self {
            Self::Sheet { size_m, thickness_m, segments } => {
                size_m.iter().try_for_each(|size| LENGTH.check("the size", *size))?;
                LENGTH.check("the thickness", *thickness_m)?;
                segments.iter().try_for_each(|n| count("the number of segments", *n))?;
            }
            Self::Box { size_m, segments } => {
                size_m.to_array().into_iter().try_for_each(|size| LENGTH.check("the size", size))?;
                segments.iter().try_for_each(|n| count("the number of segments", *n))?;
            }
            Self::Ball { radius_m, segments } => {
                LENGTH.check("the radius", *radius_m)?;
                NumberRange { least: 2.0, ..SEGMENTS }.check("the number of segments", f64::from(*segments))?;
            }
            // how many vertices a cage has is known when it is made
            Self::Embedded { surface, eps_m, range_m } => {
                NodeSpacing { eps_m: *eps_m, range_m: *range_m }.check()?;
                return check_surface(surface);
            }
            Self::Tetrahedra { mesh, regions } => {
                mesh.check()?;
                regions.iter().try_for_each(|region| region.material.check())?;
            }
            Self::Shell { surface, thickness_m } => {
                LENGTH.check("the thickness", *thickness_m)?;
                check_sheet(surface)?;
            }
            Self::Rope { path_m, radius_m, segments } => {
                LENGTH.check("the radius", *radius_m)?;
                count("the number of segments", *segments)?;
                path_m.iter().try_for_each(|point| vector("a point of the path", *point))?;
                let length_m: f64 = path_m.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
                if length_m.is_nan() || length_m < 1e-6 {
                    return Err(SoftError::NoPath);
                }
            }
        }
        let vertices = self.vertices();
        if vertices > VERTICES_MAX { Err(SoftError::TooFine { vertices }) } else { Ok(()) }
    }
}

/// Most vertices of the lattice whose skin becomes that of a box or ball with an ε.
const SKIN_LATTICE_MAX: u64 = 1_000_000;

impl SoftSpec {
    /// The length of the finest cells that a cage may have, metres, of its ε, finest and coarsest, and what longer ones are halved: its skin is as
    /// fine, as a contact on a coarser one would press on some of the nodes under it alone.
    #[must_use]
    pub fn finest_m(range_m: (f64, f64), eps_touched_m: Option<f64>) -> f64 {
        let halved_m = eps_touched_m.filter(|longest_m| *longest_m < range_m.1);
        halved_m.map_or(range_m.0, |longest_m| range_m.0.min(0.5 * longest_m.max(range_m.0)))
    }

    /// The same body with nodes that are spaced by its ε, finest and coarsest, metres, instead of by the cells of its lattice: it begins with the
    /// finest, and its skin is as fine as its finest cells. A box or ball becomes the inside of its skin. `None` where the finest is too fine for its
    /// size; other shapes stay as they are.
    #[must_use]
    pub fn spaced(self, range_m: (f64, f64)) -> Option<Self> {
        let finest_m = Self::finest_m(range_m, self.eps_touched_m);
        let fitted = |size: f64| SEGMENTS.nearest((size / finest_m).ceil()) as u32;
        let lattice = match &self.shape {
            SoftShape::Sheet { .. } | SoftShape::Rope { .. } => {
                let most = |shape: &SoftShape| match *shape {
                    SoftShape::Sheet { segments: [x, y], .. } => x.max(y),
                    SoftShape::Rope { segments, .. } => segments,
                    _ => 0,
                };
                let fits = |finest: &SoftShape| {
                    finest.vertices() <= VERTICES_MAX && SEGMENTS.contains(f64::from(most(finest)))
                };
                let shape = self.shape.divided_by(range_m.0).filter(fits)?;
                return Some(Self { shape, nodes: Some(NodeSpacing { eps_m: range_m.0, range_m }), ..self });
            }
            SoftShape::Box { size_m, .. } => {
                SoftShape::Box { size_m: *size_m, segments: size_m.to_array().map(fitted) }
            }
            SoftShape::Ball { radius_m, .. } => {
                SoftShape::Ball { radius_m: *radius_m, segments: fitted(2.0 * radius_m).max(2) }
            }
            SoftShape::Embedded { .. } | SoftShape::Tetrahedra { .. } | SoftShape::Shell { .. } => return Some(self),
        };
        let half_m = if let SoftShape::Box { size_m, .. } = lattice { 0.5 * size_m } else { DVec3::ZERO };
        let position = self.position + self.rotation.normalize() * half_m;
        Some(Self { shape: lattice.embedded(range_m)?, position, ..self })
    }
}

impl SoftShape {
    /// The inside of the skin of a box or ball, about its middle, in a cage of cells within a range; `None` where its lattice is too fine, and
    /// for other shapes.
    #[must_use]
    pub fn embedded(&self, range_m: (f64, f64)) -> Option<Self> {
        if self.vertices() > SKIN_LATTICE_MAX {
            return None;
        }
        let mut surface = self.skin()?;
        if let Self::Box { size_m, .. } = self {
            // about its middle, as a mesh is about its origin
            surface.points.iter_mut().for_each(|point| *point -= 0.5 * *size_m);
        }
        Some(Self::Embedded { surface: Arc::new(surface), eps_m: range_m.0, range_m })
    }
}

impl NodeSpacing {
    fn check(&self) -> Result<(), SoftError> {
        let all = [("ε", self.eps_m), ("the finest ε", self.range_m.0), ("the coarsest ε", self.range_m.1)];
        all.into_iter().try_for_each(|(what, value)| LENGTH.check(what, value))?;
        let (finest, coarsest) = self.range_m;
        Ok(OutOfRange::unless(finest <= coarsest, "the coarsest ε", coarsest, "one no finer than the finest")?)
    }
}

/// Whether a surface encloses a volume.
fn check_surface(surface: &Triangles) -> Result<(), SoftError> {
    let no = |why| Err(SoftError::NoInside { why });
    let count = surface.points.len();
    surface.points.iter().try_for_each(|point| vector("a point of the surface", *point))?;
    if surface.triangles.is_empty() || surface.triangles.iter().flatten().any(|corner| *corner as usize >= count) {
        return no("has no triangles, or corners that do not exist");
    }
    if !is_closed(surface) {
        return no("is not closed: an edge has not equally many triangles in either direction");
    }
    let volume_m3 = surface.volume_m3();
    if volume_m3 < 0.0 {
        return no("is turned inside out: its triangles face inwards");
    }
    if volume_m3 > 0.0 { Ok(()) } else { no("encloses no volume") }
}

/// Whether a surface can be a sheet: triangles with areas that face one way, at most two at an edge, every point in one of them.
fn check_sheet(surface: &Triangles) -> Result<(), SoftError> {
    let no = |why| Err(SoftError::BadSheet { why });
    let Triangles { points, triangles } = surface;
    points.iter().try_for_each(|point| vector("a point of the surface", *point))?;
    if triangles.is_empty() || triangles.iter().flatten().any(|corner| *corner as usize >= points.len()) {
        return no("has no triangles, or corners that do not exist");
    }
    let flat = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|corner| points[corner as usize]);
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        (b - a).cross(c - a).length() <= 1e-9 * longest
    };
    if triangles.iter().any(flat) {
        return no("has a triangle without an area");
    }
    let mut used = vec![false; points.len()];
    triangles.iter().flatten().for_each(|corner| used[*corner as usize] = true);
    if used.contains(&false) {
        return no("has a point that no triangle has");
    }
    if branch(points, triangles, |_| 0).is_some() {
        return no("is not manifold: more than two triangles share an edge");
    }
    if opposed(surface).is_some() {
        return no("has neighbours that face opposite ways");
    }
    Ok(())
}

impl SoftMaterial {
    fn check(&self) -> Result<(), SoftError> {
        let Self { young_pa, poisson, density_kg_m3, damping_per_s, damping_s, law } = *self;
        MATERIAL.check([young_pa, poisson, density_kg_m3, damping_per_s, damping_s])?;
        let MaterialLaw::Ogden { exponent } = law else { return Ok(()) };
        let is_good = (1.0..=20.0).contains(&exponent.abs());
        OutOfRange::unless(is_good, "the exponent of Ogden", exponent, "a number from 1 to 20, or from −20 to −1")?;
        let Lame { mu, lambda } = Lame::of(self);
        if lambda + 2.0 * mu / exponent > 0.0 { Ok(()) } else { Err(SoftError::Unstable { exponent }) }
    }
}

impl SoftSpec {
    /// The resolutions that it may take; none where its division never changes.
    pub(super) fn resolutions(&self) -> Option<ResolutionRange> {
        let range_m = self.spacing()?.range_m;
        (range_m.0 < range_m.1).then_some(ResolutionRange { eps_m: range_m, n: (0, metachron_core::N_MAX) })
    }

    /// The spacing of the nodes that carry its skin; `None` where its vertices are its skin.
    #[must_use]
    pub fn spacing(&self) -> Option<NodeSpacing> {
        match self.shape {
            SoftShape::Embedded { eps_m, range_m, .. } => Some(NodeSpacing { eps_m, range_m }),
            _ => self.nodes,
        }
    }

    /// Where the cells of its cage are halved that was touched at these points.
    pub(super) fn halving<'a>(&self, about_m: &'a [DVec3]) -> Halving<'a> {
        self.eps_touched_m.map_or(Halving::NONE, |longer_than_m| Halving { about_m, longer_than_m })
    }

    /// Whether every number is in its range.
    pub(super) fn check_numbers(&self) -> Result<(), SoftError> {
        self.shape.check()?;
        if let Some(nodes) = &self.nodes {
            nodes.check()?;
            let finest = self.shape.divided_by(nodes.eps_m.min(nodes.range_m.0));
            finest.ok_or(SoftError::NoSpacing { model: self.shape.model() })?.check()?;
        }
        if let Some(eps_m) = self.eps_touched_m {
            LENGTH.check("ε where it is touched", eps_m)?;
            if !matches!(self.shape, SoftShape::Embedded { .. }) {
                return Err(SoftError::NoCage { model: self.shape.model() });
            }
        }
        self.material.check()?;
        FRICTION.check("friction", self.friction)?;
        vector("the position", self.position)?;
        vector("the velocity", self.velocity)?;
        vector("the gravity", self.gravity)?;
        unit_rotation(self.rotation).ok_or(SoftError::BadVector { what: "the rotation" })?;
        let model = self.shape.model();
        self.held.iter().try_for_each(|side| match side.of(&self.shape) {
            true => Ok(()),
            false => Err(SoftError::NoSide { model, side: side.name() }),
        })
    }
}

fn vector(what: &'static str, value: DVec3) -> Result<(), SoftError> {
    if value.is_finite() { Ok(()) } else { Err(SoftError::BadVector { what }) }
}
