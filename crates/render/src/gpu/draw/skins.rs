//! The skins of soft bodies on the GPU: one mesh, rewritten every frame.
//!
//! In: corners and triangles. Out: draws. Never here: pipelines, instances.

use super::resources::buffers::Growing;
use crate::composition::mesh_corner::MeshCorner;
use crate::composition::skin::{SkinRun, Skins};

/// Corners, triangles and sides of all skins.
#[derive(Debug)]
pub struct SkinBuffers {
    corners: Growing,
    rest: Growing,
    triangles: Growing,
    sides: Growing,
}

impl Default for SkinBuffers {
    fn default() -> Self {
        Self {
            corners: Growing::new("skin corners", size_of::<MeshCorner>()),
            rest: Growing::new("skin corners at rest", size_of::<MeshCorner>()),
            triangles: Growing::new("skin triangles", size_of::<[u32; 3]>()),
            sides: Growing::new("skin sides", size_of::<[u32; 2]>()),
        }
    }
}

impl SkinBuffers {
    /// Uploads the skins of a picture.
    pub fn write(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, skins: &Skins) {
        self.corners.write(device, queue, bytemuck::cast_slice(&skins.corners));
        self.rest.write(device, queue, bytemuck::cast_slice(&skins.rest));
        self.triangles.write(device, queue, bytemuck::cast_slice(&skins.triangles));
        self.sides.write(device, queue, bytemuck::cast_slice(&skins.sides));
    }

    /// Draws one skin, as triangles or as their sides; returns the number of draws.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, run: &SkinRun, edges: bool) -> u32 {
        let indices = if edges { &self.sides } else { &self.triangles };
        let (Some(corners), Some(indices)) = (self.corners.buffer(), indices.buffer()) else { return 0 };
        let Some(rest) = self.rest.buffer() else { return 0 };
        // indices per triangle: three corners, or three sides with two ends each
        let each = if edges { 6 } else { 3 };
        let (from, count) = run.triangles;
        pass.set_vertex_buffer(0, corners.slice(..));
        // a skin is not morphing: the end of a geomorph is where its texture lies
        pass.set_vertex_buffer(2, rest.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(each * from..each * (from + count), 0, 0..1);
        1
    }
}
