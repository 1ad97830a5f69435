//! Draws the picture's texture under the panels inside egui's own render pass.
//!
//! In: a texture. Out: a shape for egui. Never here: drawing the picture.
//! egui's shader can draw the texture too, but costs about 100 ns per pixel on a software rasteriser (which runs every branch of its
//! filtering); a plain load of one texel costs a twentieth of that.

use egui_wgpu::wgpu;
use std::sync::Arc;

const SHADER: &str = "
@group(0) @binding(0) var picture: texture_2d<f32>;

struct Corner { @builtin(position) at: vec4<f32>, @location(0) texel: vec2<f32> }

@vertex
fn corner(@builtin(vertex_index) i: u32) -> Corner {
    let uv = vec2<f32>(f32((i << 1u) & 2u), f32(i & 2u));
    let size = vec2<f32>(textureDimensions(picture));
    return Corner(vec4<f32>(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, 0.0, 1.0), uv * size);
}

@fragment
fn texel(in: Corner) -> @location(0) vec4<f32> {
    let last = vec2<i32>(textureDimensions(picture)) - 1;
    return vec4<f32>(textureLoad(picture, min(vec2<i32>(in.texel), last), 0).rgb, 1.0);
}
";

/// The pipeline that draws textures under the panels, for one device.
pub struct Blit {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
}

impl Blit {
    /// A pipeline into egui's render pass, whose target has this format.
    pub fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("blit"),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("blit"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("texel"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(target.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let layout = pipeline.get_bind_group_layout(0);
        Self { pipeline, layout }
    }

    /// A drawable for `view`; it keeps the texture alive.
    pub fn show(&self, device: &wgpu::Device, view: &wgpu::TextureView) -> Arc<BlitShape> {
        let entry = wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(view) };
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("blit"),
            layout: &self.layout,
            entries: &[entry],
        });
        Arc::new(BlitShape { pipeline: self.pipeline.clone(), group })
    }
}

/// A texture drawn in egui's render pass.
pub struct BlitShape {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

impl BlitShape {
    /// The shape that draws it in `rect`.
    pub fn shape(self: &Arc<Self>, rect: egui::Rect) -> egui::Shape {
        egui_wgpu::Callback::new_paint_callback(rect, PaintCallback(Arc::clone(self))).into()
    }
}

struct PaintCallback(Arc<BlitShape>);

impl egui_wgpu::CallbackTrait for PaintCallback {
    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        _resources: &egui_wgpu::CallbackResources,
    ) {
        pass.set_pipeline(&self.0.pipeline);
        pass.set_bind_group(0, &self.0.group, &[]);
        pass.draw(0..3, 0..1);
    }
}
