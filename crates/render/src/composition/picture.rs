//! A picture before drawing: flat arrays that a renderer uploads unchanged.
//!
//! In: the output of [`crate::SceneView`]. Out: the input of [`crate::Renderer`]. Never here: snapshots, the GPU.
//! Positions are `f32` metres relative to [`Picture::origin`], so that a scene far from the world's origin keeps its precision.

use super::environment::Environment;
use super::skin::Skins;
use crate::seen::level::Shading;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use metachron_core::Resolution;
use metachron_drawable::{Cut, Model, Texture};
use metachron_geometry::{Primitive, PrimitiveMesh, patch};
use std::sync::Arc;

/// Meaning of the colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Colouring {
    /// The objects' own materials.
    #[default]
    Material,
    /// The resolution (ε, n) that objects are drawn at: the hue is n, stripes are the intervals ε.
    Resolution,
    /// The age of the displayed state: from blue (now) to red (0.1 s and older).
    Age,
    /// The fraction of its detail that an object is drawn with, from white (its coarsest) to nearly black (its finest), as in (FS93, fig. 8).
    Detail,
    /// The distance along the view, in greys: white is at the eye, middle grey as far as the camera's target, black nothing.
    Depth,
}

/// Drawing options of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Style {
    /// Meaning of the colours.
    pub colouring: Colouring,
    /// Whether every edge is drawn as a line.
    pub wireframe: bool,
    /// Whether contact points and forces are drawn.
    pub forces: bool,
}

/// One end of an interval of a tube, in the GPU's layout: 72 bytes.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct SkinSample {
    /// Position.
    pub position: [f32; 3],
    /// Outer radius, metres.
    pub radius_m: f32,
    /// Derivative of the position by arc length.
    pub slope: [f32; 3],
    /// Derivative of the radius by arc length.
    pub radius_slope: f32,
    /// Unit vector across the curve.
    pub normal: [f32; 3],
    /// Angle of the material past the normal, radians.
    pub twist_rad: f32,
    /// Rest arc length, metres.
    pub arc_m: f32,
    /// Repeats of the skin's texture per metre.
    pub texture_per_m: f32,
    /// Colour, sRGB, and material number.
    pub colour: [u8; 4],
    /// Tint over everything (sRGB), and its opacity.
    pub tint: [u8; 4],
    /// By how much the radius is larger along cos 2φ and sin 2φ, φ from the normal, metres.
    pub flattening_m: [f32; 2],
}

/// One solid, in the GPU's layout: 64 bytes.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct SolidInstance {
    /// Rotation, a unit quaternion (x, y, z, w).
    pub rotation: [f32; 4],
    /// Position.
    pub position: [f32; 3],
    /// Radius of the ball swept over the core, metres; for points the factor by which they are enlarged.
    pub radius_m: f32,
    /// Half extents of the core, metres; for models their scale.
    pub extents: [f32; 3],
    /// Morph fraction of a [`MeshKey::Geomorph`], 0 … 1; else 0.
    pub geomorph: f32,
    /// Colour, sRGB, and material number.
    pub colour: [u8; 4],
    /// Tint over everything (sRGB), and its opacity.
    pub tint: [u8; 4],
    /// Repeats per metre of a texture projected on sides, 0 for one with texture coordinates; the second is unused.
    pub wrap: [f32; 2],
}

/// The mesh of a run of solids.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MeshKey {
    /// A primitive at a level n.
    Primitive(Primitive, u8),
    /// Index of a mesh in [`Picture::meshes`].
    Custom(u32),
    /// A cut of the mesh with this index in [`Picture::models`].
    Cut(u32, Cut),
    /// The same, morphing to a coarser cut: model, cut, vertex count of the coarser cut.
    Geomorph(u32, Cut, u32),
    /// The first pieces of the foliage with this index in [`Picture::models`], in full: their triangles.
    Pieces(u32, u32),
    /// Pieces of foliage as strokes: model, the first of their triangles, and how many.
    Strokes(u32, u32, u32),
    /// A sharp box whose sides are divided into this many cells along x, y and z, each at least 1.
    Slab([u8; 3]),
}

/// Intervals of one tube: samples `first ..= first + intervals`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TubeRun {
    /// Its first sample.
    pub first: u32,
    /// Number of intervals.
    pub intervals: u32,
    /// Level of the patch.
    pub n: u8,
    /// Whether the skin is tissue, with a texture where it is lit per pixel.
    pub tissue: bool,
    /// Shading.
    pub shading: Shading,
    /// Whether it is visible; otherwise it is drawn into the shadow map only.
    pub shown: bool,
}

/// Properties that the solids of a run share: runs follow each other in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SolidKind {
    /// Shading.
    pub shading: Shading,
    /// Number of their texture in [`Picture::textures`], from 1; 0 for none.
    pub texture: u32,
    /// Whether they are meshes of tissue, which has a texture of its own where it is lit per pixel.
    pub tissue: bool,
    /// Their mesh.
    pub mesh: MeshKey,
    /// Whether they throw no shadow.
    pub shadowless: bool,
}

/// Solids of one kind: instances `first .. first + count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SolidRun {
    /// Shared properties.
    pub kind: SolidKind,
    /// The first instance.
    pub first: u32,
    /// Number of instances.
    pub count: u32,
}

/// The floor: a plane that fades out around the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FloorDraw {
    /// A point of it, metres, relative to the picture's origin.
    pub point: DVec3,
    /// Its unit normal.
    pub normal: DVec3,
    /// Colour, sRGB.
    pub colour: [u8; 3],
}

/// All data that a renderer needs for one frame; storage is reused.
#[derive(Debug, Clone)]
pub struct Picture {
    /// The point that positions are relative to, metres.
    pub origin: DVec3,
    /// Centre of the region that the light is fitted to, metres, world axes.
    pub focus_m: DVec3,
    /// Radius of that region, metres.
    pub focus_radius_m: f64,
    /// Lower and upper corner of the box around all objects whose shadows are drawn, metres, world axes.
    pub shadowed_m: (DVec3, DVec3),
    /// Its light.
    pub environment: Environment,
    /// Drawing options.
    pub style: Style,
    /// Width and height to draw it with as a fraction of the target's, > 0, at most 1; below 1 it is enlarged to the target.
    pub scale: f64,
    /// Metres that the arrow of one newton has, where forces are drawn; 0 before any was.
    pub force_scale: f64,
    /// Whether objects throw shadows, where the light does.
    pub shadows: bool,
    /// All tubes' samples.
    pub samples: Vec<SkinSample>,
    /// The tubes, sorted by level.
    pub tubes: Vec<TubeRun>,
    /// All solids.
    pub instances: Vec<SolidInstance>,
    /// The solids by mesh.
    pub solids: Vec<SolidRun>,
    /// The skins of soft bodies: one mesh of the frame.
    pub skins: Skins,
    /// The floor, if there is one.
    pub floor: Option<FloorDraw>,
    /// Which of the meshes is the head of an arrow, once one was drawn.
    pub(crate) arrow_head: Option<u32>,
    /// Meshes that are not primitives.
    pub meshes: Arc<[PrimitiveMesh]>,
    /// Models that can be drawn with any number of triangles.
    pub models: Arc<[Model]>,
    /// Their textures.
    pub textures: Arc<[Arc<Texture>]>,
}

impl Default for Picture {
    fn default() -> Self {
        Self {
            origin: DVec3::ZERO,
            focus_m: DVec3::ZERO,
            focus_radius_m: 1.0,
            shadowed_m: (DVec3::NEG_ONE, DVec3::ONE),
            environment: Environment::default(),
            style: Style::default(),
            scale: 1.0,
            force_scale: 0.0,
            shadows: true,
            samples: Vec::new(),
            tubes: Vec::new(),
            instances: Vec::new(),
            solids: Vec::new(),
            skins: Skins::default(),
            floor: None,
            arrow_head: None,
            meshes: Arc::default(),
            models: Arc::default(),
            textures: Arc::default(),
        }
    }
}

impl Picture {
    /// Clears the picture; storage is kept.
    pub(crate) fn clear(&mut self) {
        self.samples.clear();
        self.tubes.clear();
        self.instances.clear();
        self.solids.clear();
        self.skins.clear();
        self.floor = None;
    }

    /// Triangles of the picture, without the shadow map's.
    #[must_use]
    pub fn triangles(&self) -> u64 {
        let tubes =
            self.tubes.iter().filter(|t| t.shown).map(|t| u64::from(t.intervals) * u64::from(patch::triangles(t.n)));
        let solids = self.solids.iter().map(|s| u64::from(s.count) * self.mesh_triangles(s.kind.mesh));
        let skins = self.skins.triangles.len() as u64;
        tubes.sum::<u64>() + solids.sum::<u64>() + skins + if self.floor.is_some() { 2 } else { 0 }
    }

    pub(super) fn mesh_triangles(&self, key: MeshKey) -> u64 {
        match key {
            MeshKey::Primitive(primitive, n) => u64::from(primitive.triangles(n)),
            MeshKey::Slab([x, y, z]) => {
                let [x, y, z] = [x, y, z].map(u64::from);
                4 * (x * y + y * z + z * x)
            }
            MeshKey::Cut(_, cut) | MeshKey::Geomorph(_, cut, _) => u64::from(cut.triangles),
            MeshKey::Pieces(_, triangles) | MeshKey::Strokes(_, _, triangles) => u64::from(triangles),
            MeshKey::Custom(i) => self.meshes.get(i as usize).map_or(0, |mesh| mesh.triangles.len() as u64),
        }
    }
}

/// The colour of a resolution: its hue steps with n from violet (0) over green to yellow (6 and finer).
#[must_use]
pub fn resolution_colour(at: Resolution) -> [u8; 3] {
    const HUES: [[u8; 3]; 7] =
        [[84, 39, 128], [64, 82, 150], [44, 120, 152], [32, 158, 140], [88, 192, 100], [172, 214, 60], [250, 226, 60]];
    HUES[usize::from(at.n).min(HUES.len() - 1)]
}

/// The shade of a level: white is the coarsest an object has, dark grey its finest (FS93, fig. 8).
#[must_use]
pub fn detail_colour(detail: f32) -> [u8; 3] {
    // a cast of floats saturates, and maps NaN to 0
    [255 - (227.0 * detail.clamp(0.0, 1.0)) as u8; 3]
}

/// Ages beyond this are drawn fully red, seconds.
const AGE_RED_S: f64 = 0.1;

/// The colour of an age: blue is now, red is 0.1 s and older.
#[must_use]
pub fn age_colour(age_s: f64) -> [u8; 3] {
    const HEAT: [[f64; 3]; 4] = [[48.0, 96.0, 208.0], [56.0, 176.0, 136.0], [240.0, 196.0, 64.0], [214.0, 48.0, 40.0]];
    let age_s = if age_s.is_nan() { AGE_RED_S } else { age_s };
    let heat = (age_s / AGE_RED_S).clamp(0.0, 1.0) * (HEAT.len() - 1) as f64;
    let left = (heat as usize).min(HEAT.len() - 2);
    let w = heat - left as f64;
    std::array::from_fn(|i| (HEAT[left][i] * (1.0 - w) + HEAT[left + 1][i] * w) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn detail_runs_from_white_to_dark_and_takes_any_number() {
        assert_eq!([0.0, 0.5, 1.0, 7.0].map(|d| detail_colour(d)[0]), [255, 142, 28, 28]);
        assert_eq!(detail_colour(f32::NAN), [255; 3]);
    }

    #[test]
    fn age_runs_from_blue_to_red_and_takes_any_number() {
        assert_eq!(age_colour(0.0), [48, 96, 208]);
        assert_eq!(age_colour(5.0), [214, 48, 40]);
        assert_eq!(age_colour(f64::NAN), [214, 48, 40]);
    }
}
