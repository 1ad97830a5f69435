//! A corner of a mesh, in the GPU's layout.
//!
//! In: a vertex. Out: the same as the renderer uploads it. Never here: which corners a mesh has.

use bytemuck::{Pod, Zeroable};
use metachron_geometry::PrimitiveVertex;

/// One corner of a mesh, in the GPU's layout: 32 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MeshCorner {
    /// Position on the core.
    pub core: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Texture coordinates.
    pub uv: [f32; 2],
}

impl MeshCorner {
    /// A corner without a place, for a mesh that has none.
    pub(super) const NOWHERE: Self = Self { core: [0.0; 3], normal: [0.0, 0.0, 1.0], uv: [0.0; 2] };
}

impl From<&PrimitiveVertex> for MeshCorner {
    fn from(v: &PrimitiveVertex) -> Self {
        Self { core: v.core.to_array(), normal: v.normal.to_array(), uv: v.uv.to_array() }
    }
}
