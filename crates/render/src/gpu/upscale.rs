//! Shows a drawn picture on a target: texel by texel where their sizes are equal, else enlarged.
//!
//! In: the texture of a picture, a pass into the target. Out: a draw that covers the pass's viewport. Never here: the
//! choice of how many pixels a picture is drawn with; the target.
//!
//! Enlarging is by the cubic (KEY81) with the slopes of Catmull and Rom, which keeps edges sharp and is exact for parabolas. In software its
//! nine filtered samples take as long as shading a pixel; there one filtered sample (bilinear) has to do, at a third of that.

use super::full_screen::{FullScreen, cover};
use crate::seen::view::Size;
use wgpu::{Device, TextureFormat, TextureView};

const SHADER: &str = include_str!("upscale.wgsl");

/// The pipelines for one device and one format of targets.
#[derive(Debug)]
pub struct Upscaler {
    /// For pictures of the target's size, and for smaller ones.
    pipelines: [wgpu::RenderPipeline; 2],
    layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
}

/// A picture to show. It keeps the texture alive.
#[derive(Debug, Clone)]
pub struct Upscaled {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

impl Upscaler {
    /// Pipelines into passes whose target has this format; `lean` enlarges bilinearly.
    #[must_use]
    pub fn new(device: &Device, target: TextureFormat, lean: bool) -> Self {
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let bindings = [texture, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)];
        let pass = FullScreen { label: "upscale", fragments: SHADER, bindings: &bindings, target };
        let layout = pass.layout(device);
        let pipelines = pass.pipelines(device, &layout, ["fs_same", if lean { "fs_linear" } else { "fs_cubic" }]);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("upscale"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self { pipelines, layout, sampler }
    }

    /// The picture in `view`, drawn with `drawn` pixels, to be shown with `shown`.
    #[must_use]
    pub fn show(&self, device: &Device, view: &TextureView, drawn: Size, shown: Size) -> Upscaled {
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("upscale"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(view) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&self.sampler) },
            ],
        });
        Upscaled { pipeline: self.pipelines[usize::from(drawn != shown)].clone(), group }
    }
}

impl Upscaled {
    /// Covers the viewport of `pass` with it.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        cover(pass, &self.pipeline, &self.group);
    }
}
