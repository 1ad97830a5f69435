//! Passes over a whole target: one triangle that covers it, and fragments that read the bound resources.
//!
//! In: fragment shaders, their bindings, the format of targets. Out: pipelines with their layout; a draw. Never here:
//! the shaders' code.

use wgpu::{BindGroupLayout, BindingType, Device, RenderPipeline, TextureFormat};

const VERTEX: &str = include_str!("full_screen.wgsl");

/// Shaders of fragments that fill a target.
#[derive(Debug, Clone, Copy)]
pub struct FullScreen<'a> {
    /// The name of all that is made of it.
    pub label: &'a str,
    /// WGSL of the fragments; they may take the `Corner` of `full_screen.wgsl`.
    pub fragments: &'a str,
    /// Their bindings in group 0, from binding 0 on.
    pub bindings: &'a [BindingType],
    /// The format of targets, of one sample a pixel.
    pub target: TextureFormat,
}

impl FullScreen<'_> {
    /// The layout of the bindings.
    pub fn layout(&self, device: &Device) -> BindGroupLayout {
        let entry = |(binding, ty): (u32, &BindingType)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: *ty,
            count: None,
        };
        let entries: Vec<_> = (0..).zip(self.bindings).map(entry).collect();
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(self.label), entries: &entries })
    }

    /// A pipeline for each of these entry points.
    pub fn pipelines<const N: usize>(
        &self,
        device: &Device,
        layout: &BindGroupLayout,
        entry_points: [&str; N],
    ) -> [RenderPipeline; N] {
        let label = Some(self.label);
        let source = wgpu::ShaderSource::Wgsl([VERTEX, self.fragments].concat().into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label,
            bind_group_layouts: &[Some(layout)],
            immediate_size: 0,
        });
        entry_points.map(|fragment| {
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label,
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("vs_full_screen"),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: None,
                multisample: wgpu::MultisampleState::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(fragment),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    targets: &[Some(self.target.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
        })
    }
}

/// Covers the viewport of `pass` by a pipeline of [`FullScreen`] with the bound resources.
pub fn cover(pass: &mut wgpu::RenderPass<'_>, pipeline: &RenderPipeline, group: &wgpu::BindGroup) {
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.draw(0..3, 0..1);
}
