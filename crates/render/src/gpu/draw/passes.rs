//! The passes of a frame: the shadow map, then the picture.
//!
//! In: a picture whose meshes and uniforms are uploaded. Out: draws. Never here: uploads, pipelines, submission.

use super::cuts::MorphedCut;
use super::meshes::Mesh;
use super::timing::Timing;
use super::{Renderer, Target};
use crate::composition::environment::EnvironmentLight;
use crate::composition::picture::{Colouring, MeshKey, Picture, SkinSample, SolidInstance, SolidRun, TubeRun};
use crate::composition::skin::SkinRun;
use std::ops::Range;

/// Finest patch level in the shadow map: its texels are coarser than finer patches.
pub(super) const SHADOW_LEVEL: u8 = 2;

impl Renderer {
    /// Draws the shadow map; returns the number of draws.
    pub(super) fn draw_shadows(&self, encoder: &mut wgpu::CommandEncoder, picture: &Picture) -> u32 {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            depth_stencil_attachment: Some(depth(&self.bindings.shadow, 1.0, wgpu::StoreOp::Store)),
            timestamp_writes: self.timing.as_ref().map(Timing::first_pass),
            ..Default::default()
        });
        pass.set_bind_group(0, &self.bindings.light, &[]);
        // the outermost texels stay empty: everything past the map is lit
        let inner = self.setup.options.shadow_px - 2;
        pass.set_scissor_rect(1, 1, inner, inner);
        let mut draws = 0;
        if !(picture.shadows && EnvironmentLight::of(picture.environment).throws_shadows()) {
            return draws;
        }
        pass.set_pipeline(&self.pipelines.skin_shadow);
        for tube in &picture.tubes {
            let mesh = self.meshes.patch(tube.n.min(SHADOW_LEVEL));
            draws += self.draw_tube(&mut pass, tube, mesh, false);
        }
        for strokes in [false, true] {
            pass.set_pipeline(if strokes { &self.pipelines.stroke_shadow } else { &self.pipelines.solid_shadow });
            let runs = picture.solids.iter().filter(|run| !run.kind.shadowless);
            for run in runs.filter(|run| self.meshes.turns(run.kind.mesh) == strokes) {
                draws += self.draw_solids(&mut pass, run, false);
            }
        }
        draws + self.draw_skins(&mut pass, picture, |_| &self.pipelines.solid_shadow, false)
    }

    /// Draws the picture, nearest kinds first so that hidden pixels are not lit; returns the number of draws.
    pub(super) fn draw_picture(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        picture: &Picture,
        target: Target<'_>,
        room: bool,
    ) -> u32 {
        let Some(targets) = &self.targets else { return 0 };
        let shown = picture.style.colouring == Colouring::Depth;
        let depths = if shown { wgpu::StoreOp::Store } else { wgpu::StoreOp::Discard };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(targets.colour(target.view))],
            depth_stencil_attachment: Some(depth(&targets.depth, 0.0, depths)),
            timestamp_writes: self.timing.as_ref().map(Timing::last_pass),
            ..Default::default()
        });
        pass.set_bind_group(0, &self.bindings.picture, &[]);
        let mut draws = 0;
        for tissue in [true, false] {
            for tube in picture.tubes.iter().filter(|t| t.tissue == tissue && t.shown) {
                pass.set_pipeline(self.pipelines.skin_of(tissue, tube.shading));
                draws += self.draw_tube(&mut pass, tube, self.meshes.patch(tube.n), false);
            }
        }
        for slab in [false, true] {
            for run in picture.solids.iter().filter(|run| matches!(run.kind.mesh, MeshKey::Slab(_)) == slab) {
                pass.set_pipeline(self.pipeline_of(run));
                if let Some(texture) = self.textures.group(run.kind.texture) {
                    pass.set_bind_group(1, texture, &[]);
                }
                draws += self.draw_solids(&mut pass, run, false);
            }
        }
        draws += self.draw_skins(&mut pass, picture, |run| self.pipelines.hide_of(run.tissue, run.shading), false);
        if picture.style.wireframe {
            draws += self.draw_edges(&mut pass, picture);
        }
        let floor: &[_] = if picture.floor.is_some() { &self.pipelines.floor } else { &[] };
        for (part, corners) in floor {
            pass.set_pipeline(part);
            pass.draw(0..*corners, 0..1);
            draws += 1;
        }
        if room {
            pass.set_pipeline(&self.pipelines.room);
            pass.draw(0..3, 0..1);
            draws += 1;
        }
        draws
    }

    fn draw_edges(&self, pass: &mut wgpu::RenderPass<'_>, picture: &Picture) -> u32 {
        let mut draws = 0;
        pass.set_pipeline(&self.pipelines.skin_edges);
        for tube in picture.tubes.iter().filter(|t| t.shown) {
            draws += self.draw_tube(pass, tube, self.meshes.patch(tube.n), true);
        }
        pass.set_pipeline(&self.pipelines.solid_edges);
        for run in picture.solids.iter().filter(|run| !self.meshes.turns(run.kind.mesh)) {
            draws += self.draw_solids(pass, run, true);
        }
        draws + self.draw_skins(pass, picture, |_| &self.pipelines.solid_edges, true)
    }

    /// The skins of soft bodies, each a mesh drawn once with the pipeline of its shading.
    fn draw_skins<'a>(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        picture: &Picture,
        pipeline: impl Fn(&SkinRun) -> &'a wgpu::RenderPipeline,
        edges: bool,
    ) -> u32 {
        let Some(instances) = self.instances.buffer() else { return 0 };
        let stride = size_of::<SolidInstance>() as u64;
        let drawn = picture.skins.runs.iter().map(|run| {
            let from = u64::from(run.instance) * stride;
            pass.set_pipeline(pipeline(run));
            pass.set_vertex_buffer(1, instances.slice(from..from + stride));
            self.skins.draw(pass, run, edges)
        });
        drawn.sum()
    }

    /// The pipeline of a run of solids: points, lines and slabs are lit per vertex.
    fn pipeline_of(&self, run: &SolidRun) -> &wgpu::RenderPipeline {
        match (run.kind.mesh, run.kind.shading) {
            (MeshKey::Slab(_), _) => &self.pipelines.slab,
            _ if self.meshes.turns(run.kind.mesh) => &self.pipelines.stroke,
            (_, shading) if run.kind.tissue => self.pipelines.hide_of(true, shading),
            (_, shading) => self.pipelines.solid_of(shading, run.kind.texture > 0),
        }
    }

    /// One tube: the patch instanced once per interval, between consecutive samples of the buffer shared by all tubes.
    fn draw_tube(&self, pass: &mut wgpu::RenderPass<'_>, tube: &TubeRun, mesh: Option<&Mesh>, edges: bool) -> u32 {
        let (Some(mesh), Some(samples)) = (mesh, self.samples.buffer()) else { return 0 };
        let stride = size_of::<SkinSample>() as u64;
        let (from, count) = (u64::from(tube.first) * stride, u64::from(tube.intervals) * stride);
        pass.set_vertex_buffer(1, samples.slice(from..from + count));
        pass.set_vertex_buffer(2, samples.slice(from + stride..from + stride + count));
        mesh.draw(pass, edges, tube.intervals)
    }

    fn draw_solids(&self, pass: &mut wgpu::RenderPass<'_>, run: &SolidRun, edges: bool) -> u32 {
        let Some(instances) = self.instances.buffer() else { return 0 };
        let stride = size_of::<SolidInstance>() as u64;
        let from = u64::from(run.first) * stride;
        pass.set_vertex_buffer(1, instances.slice(from..from + u64::from(run.count) * stride));
        match run.kind.mesh {
            MeshKey::Cut(model, cut) => {
                self.cuts.draw(pass, MorphedCut { model, cut, coarser: None }, edges, run.count)
            }
            MeshKey::Geomorph(model, cut, to) => {
                self.cuts.draw(pass, MorphedCut { model, cut, coarser: Some(to) }, edges, run.count)
            }
            MeshKey::Pieces(model, triangles) => {
                let part = StillPart { triangles: 0..triangles, edges };
                self.meshes.pieces(model).map_or(0, |mesh| draw_still(pass, mesh, part, run.count))
            }
            MeshKey::Strokes(model, first, triangles) => {
                let part = StillPart { triangles: first..first + triangles, edges };
                self.meshes.strokes(model).map_or(0, |mesh| draw_still(pass, mesh, part, run.count))
            }
            key => {
                let part = StillPart { triangles: 0..u32::MAX, edges };
                self.meshes.solid(key).map_or(0, |mesh| draw_still(pass, mesh, part, run.count))
            }
        }
    }
}

/// The part of a mesh that is not morphing which is drawn.
struct StillPart {
    triangles: Range<u32>,
    edges: bool,
}

/// Draws a mesh that is not morphing: both ends of its geomorph are the mesh itself.
fn draw_still(pass: &mut wgpu::RenderPass<'_>, mesh: &Mesh, part: StillPart, count: u32) -> u32 {
    pass.set_vertex_buffer(2, mesh.vertices());
    mesh.draw_part(pass, part.edges, part.triangles, count)
}

fn depth(view: &wgpu::TextureView, clear: f32, store: wgpu::StoreOp) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(clear), store };
    wgpu::RenderPassDepthStencilAttachment { view, depth_ops: Some(ops), stencil_ops: None }
}
