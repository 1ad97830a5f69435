//! `model = "sheet"`, `"solid"` and `"rope"`: soft bodies of finite elements.

use super::Point;
use super::ranges::within;
use super::tube::End;
use super::value::OneOrRange;
use metachron_drawable::Generator;
use metachron_models::soft::{MATERIAL, Side};
use schemars::JsonSchema;
use serde::Deserialize;

/// The keys of a sheet, solid or rope alike.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = within(MATERIAL))]
pub struct SoftFile {
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Density, kg/m³. Default 1050.
    pub density_kg_m3: Option<f64>,
    /// Mass-proportional damping, 1/s. Default 0.
    pub damping_per_s: Option<f64>,
    /// Stiffness-proportional damping (Rayleigh), s: high frequencies fade first. Default 0.
    pub damping_s: Option<f64>,
    /// Velocity of all of it at the start, m/s. Default: none.
    pub velocity_m_s: Option<Point>,
    /// Coulomb friction coefficient; a pair takes the geometric mean. Default 0.3.
    pub friction: Option<f64>,
    /// Whether it touches itself. Default: a sheet and a rope do, a solid does not.
    pub self_contact: Option<bool>,
}

/// A soft sheet that stretches and bends: flat, or of the shape of a mesh.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = within(MATERIAL))]
pub struct SheetFile {
    /// Length along its x and y axes, metres. Needed without `file`.
    pub size_m: Option<[f64; 2]>,
    /// Cells along x and y, which never change; at most 10,000 vertices in all. Either this, `eps_m` or `file`.
    pub segments: Option<[u32; 2]>,
    /// Largest length ε of a cell, metres: one number, or `[finest, coarsest]`, of which the controllers choose while
    /// it runs. Its surface in contacts, grasps and pictures is the lattice of the finest. At most 10,000 vertices at
    /// the finest.
    pub eps_m: Option<OneOrRange<f64>>,
    /// A surface as a file of triangles, STL, binary glTF (.glb, +y up) or OBJ, its path relative to the scene file: at rest the sheet has its
    /// shape and its vertices. It may be open.
    pub file: Option<String>,
    /// Factor that converts the file's coordinates to metres. Default 1.
    pub scale: Option<f64>,
    /// Thickness, metres.
    pub thickness_m: f64,
    /// Poisson's ratio. Default 0.4.
    pub poisson: Option<f64>,
    /// Position of its middle, metres. Default: the origin.
    pub position_m: Option<Point>,
    /// Rotation about its middle by angles about the world's x, then y, then z axis, degrees. Default none.
    pub rotation_deg: Option<Point>,
    /// Sides whose vertices never move; `bottom` and `top` of a mesh alone. Default none.
    pub hold: Option<Vec<Side>>,
}

/// A soft solid: a box, a ball, or the volume within a closed surface.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = within(MATERIAL))]
pub struct SolidFile {
    /// Its shape. `box`: `size_m`. `ball`: `radius_m`. `mesh`: `file` or `generate`.
    pub shape: SoftShapeKind,
    /// Length of a box along its x, y and z axes, metres.
    pub size_m: Option<Point>,
    /// Radius of a ball, metres.
    pub radius_m: Option<f64>,
    /// Cells along x, y and z of a box, or of a ball (three equal numbers of at least 2), which never change; at most 10,000 vertices in all.
    /// Not together with `eps_m`.
    pub segments: Option<[u32; 3]>,
    /// Largest length ε of a cell of the cage that is laid around its surface, metres: one number, or `[finest, coarsest]`, of which the
    /// controllers choose while it runs. At most 10,000 vertices at the finest.
    pub eps_m: Option<OneOrRange<f64>>,
    /// Where something touches, grasps or pulls it, cells of the cage longer than this are halved, and their neighbours, until a second after,
    /// metres. Default: nowhere.
    pub eps_touched_m: Option<f64>,
    /// A closed surface as a file of triangles, STL (binary or text, +z up), binary glTF (.glb, +y up) or OBJ (+z up), its path relative to
    /// the scene file: one piece, triangles counter-clockwise seen from outside, with `eps_m`. Or a mesh of tetrahedra, gmsh (.msh 2.2 or 4.1,
    /// text), legacy VTK (.vtk) or VTK's XML (.vtu), which is taken as it is.
    pub file: Option<String>,
    /// A generated closed surface, about a metre large; not with `file`.
    pub generate: Option<Generator>,
    /// Seed of a generated surface. Default 0.
    pub seed: Option<u32>,
    /// Triangles of a generated surface. Default 4000.
    pub triangles: Option<u32>,
    /// Factor that converts the surface's coordinates to metres. Default 1.
    pub scale: Option<f64>,
    /// Poisson's ratio. Default 0.4. Tetrahedra lock near 0.5: above 0.45 a cage (`eps_m`) bends more truly.
    pub poisson: Option<f64>,
    /// How stress follows from strain. Default `corotational`.
    pub law: Option<LawKind>,
    /// The exponent of `law = "ogden"`, 1 … 20 or -20 … -1: tissue stiffens with large ones.
    pub exponent: Option<f64>,
    /// Regions of a mesh of tetrahedra that are of another material.
    pub regions: Option<Vec<RegionFile>>,
    /// Position of its middle, of a mesh that of the origin of its axes, metres. Default: the origin.
    pub position_m: Option<Point>,
    /// Rotation about that point by angles about the world's x, then y, then z axis, degrees. Default none.
    pub rotation_deg: Option<Point>,
    /// Faces of a box whose vertices never move; of a mesh, sides of the box around it: the vertices of its cage there,
    /// of tetrahedra the vertices within half a mean edge. Default none.
    pub hold: Option<Vec<Side>>,
}

/// A rope: it stretches, and has no stiffness against bending or twisting.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RopeFile {
    /// Points of its centre line at rest, metres: at least two.
    #[schemars(length(min = 2))]
    pub path_m: Vec<Point>,
    /// Radius, metres.
    pub radius_m: f64,
    /// Number of segments. It never changes. Either this or `eps_m`.
    pub segments: Option<u32>,
    /// Largest length ε of a segment, metres: one number, or `[finest, coarsest]`, of which the controllers choose
    /// while it runs. Its line in contacts, grasps and pictures is the line of the finest. At most 2047 segments at the
    /// finest.
    pub eps_m: Option<OneOrRange<f64>>,
    /// Ends that never move. Default none.
    pub hold: Option<Vec<End>>,
}

metachron_core::choices! {
    /// How the stress of a solid follows from its strain; near rest all are the law of Hooke.
    #[derive(JsonSchema)]
    pub enum LawKind {
        /// Linear in strains that turn with the body.
        Corotational = "corotational",
        /// Stable Neo-Hookean: rubber-like under large strains.
        NeoHookean = "neo-hookean",
        /// The law of Ogden of one term, with `exponent`.
        Ogden = "ogden",
    }
}

/// A region of a mesh of tetrahedra.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = within(MATERIAL))]
pub struct RegionFile {
    /// Its number: of gmsh the physical group, or the volume's own where it has none; of VTK the cell data `region`, `gmsh:physical`,
    /// `medit:ref`, `material` or `CellEntityIds`, the first of these that there is.
    pub region: i64,
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Poisson's ratio. Default: that of the solid.
    pub poisson: Option<f64>,
    /// Density, kg/m³. Default: that of the solid.
    pub density_kg_m3: Option<f64>,
    /// How stress follows from strain. Default: as in the solid.
    pub law: Option<LawKind>,
    /// The exponent of `law = "ogden"`.
    pub exponent: Option<f64>,
}

/// The shape of a soft solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SoftShapeKind {
    /// A box.
    Box,
    /// A ball.
    Ball,
    /// The volume within a closed surface, or tetrahedra.
    Mesh,
}
