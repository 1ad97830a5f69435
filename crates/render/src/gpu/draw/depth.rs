//! Depths of a drawn picture: as greys in its place, or read back as metres.
//!
//! In: the depths that a picture left. Out: a pass into the picture's target; numbers. Never here: the picture.

use super::super::full_screen::{FullScreen, cover};
use super::super::offscreen::{DeviceLoss, Gpu, GpuError, read_bytes};
use super::Renderer;
use crate::seen::view::Camera;
use wgpu::util::DeviceExt;

const SHADER: &str = include_str!("shaders/depth.wgsl");

/// The pass that shows depths.
#[derive(Debug)]
pub struct DepthPass {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
}

impl DepthPass {
    /// Into targets of a format, of depths with so many samples a pixel.
    fn new(device: &wgpu::Device, format: wgpu::TextureFormat, samples: u32) -> Self {
        let source = if samples > 1 {
            SHADER.replace("texture_depth_2d", "texture_depth_multisampled_2d")
        } else {
            SHADER.to_owned()
        };
        let depths = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Depth,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: samples > 1,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let bindings = [depths, uniform];
        let pass = FullScreen { label: "depth", fragments: &source, bindings: &bindings, target: format };
        let layout = pass.layout(device);
        let [pipeline] = pass.pipelines(device, &layout, ["fs_depth"]);
        Self { pipeline, layout }
    }
}

impl Renderer {
    /// Replaces the picture in `target` by greys of its depths; returns the number of draws.
    pub(super) fn show_depths(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
        target: &wgpu::TextureView,
    ) -> u32 {
        let Some(targets) = &self.targets else { return 0 };
        let (format, samples) = (self.setup.format, self.setup.options.samples);
        let pass = self.depth_pass.get_or_insert_with(|| DepthPass::new(&self.device, format, samples));
        let at_target = [(camera.distance_m / camera.near_m()) as f32, 0.0, 0.0, 0.0];
        let uniform = self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("depth"),
            contents: bytemuck::cast_slice(&at_target),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("depth"),
            layout: &pass.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&targets.depth) },
                wgpu::BindGroupEntry { binding: 1, resource: uniform.as_entire_binding() },
            ],
        });
        let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store };
        let attachment = wgpu::RenderPassColorAttachment { view: target, depth_slice: None, resolve_target: None, ops };
        let mut drawn = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("depth"),
            color_attachments: &[Some(attachment)],
            ..Default::default()
        });
        cover(&mut drawn, &pass.pipeline, &group);
        1
    }

    /// Depths along the view of the picture drawn last, metres, row by row from the top; infinite where there is nothing. The picture must have
    /// been coloured by depth, with one sample a pixel, and seen by `camera`.
    pub(crate) fn read_depths(&self, gpu: &Gpu, camera: &Camera, lost: &DeviceLoss) -> Result<Vec<f32>, GpuError> {
        let Some(targets) = &self.targets else { return Ok(Vec::new()) };
        let near_m = camera.near_m() as f32;
        let bytes = read_bytes(gpu, targets.depth.texture(), lost)?;
        // reversed, without a far plane: near over depth
        Ok(bytes
            .chunks_exact(4)
            .map(|four| near_m / f32::from_le_bytes([four[0], four[1], four[2], four[3]]))
            .collect())
    }
}
