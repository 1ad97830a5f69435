//! Growing buffers, and the textures that depend on a target's size.
//!
//! In: bytes, sizes. Out: buffers and views. Never here: their contents' meaning.

use crate::seen::view::Size;

/// A buffer of vertices or indices that is rewritten every frame and only ever grows.
#[derive(Debug)]
pub struct Growing {
    label: &'static str,
    stride: usize,
    buffer: Option<wgpu::Buffer>,
}

impl Growing {
    /// An empty buffer of items of `stride` bytes.
    pub fn new(label: &'static str, stride: usize) -> Self {
        Self { label, stride, buffer: None }
    }

    /// Uploads `bytes`, into a larger buffer if needed.
    pub fn write(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        let wanted = bytes.len() as u64;
        if self.buffer.as_ref().is_none_or(|buffer| buffer.size() < wanted) {
            self.buffer = Some(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(self.label),
                size: wanted.next_power_of_two().max(64 * self.stride as u64),
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
        }
        if let Some(buffer) = &self.buffer {
            queue.write_buffer(buffer, 0, bytes);
        }
    }

    /// The buffer; `None` before anything was written.
    pub fn buffer(&self) -> Option<&wgpu::Buffer> {
        self.buffer.as_ref()
    }
}

/// Attachments of a target in addition to its own view.
#[derive(Debug)]
pub struct Targets {
    /// The size it is for.
    pub size: Size,
    /// Depths, reversed.
    pub depth: wgpu::TextureView,
    /// Multisampled colour before it is resolved; `None` with one sample per pixel.
    samples: Option<wgpu::TextureView>,
}

impl Targets {
    /// Depth and, with more than one sample a pixel, colour of `size`.
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat, size: Size, samples: u32) -> Self {
        let texture = |label, format, more| {
            device
                .create_texture(&wgpu::TextureDescriptor {
                    label: Some(label),
                    size: wgpu::Extent3d { width: size.width, height: size.height, depth_or_array_layers: 1 },
                    mip_level_count: 1,
                    sample_count: samples,
                    dimension: wgpu::TextureDimension::D2,
                    format,
                    usage: wgpu::TextureUsages::RENDER_ATTACHMENT | more,
                    view_formats: &[],
                })
                .create_view(&wgpu::TextureViewDescriptor::default())
        };
        Self {
            size,
            depth: texture(
                "depth",
                super::bindings::DEPTH,
                wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC,
            ),
            samples: (samples > 1).then(|| texture("samples", format, wgpu::TextureUsages::empty())),
        }
    }

    /// The colour attachment of the pass that draws into `view`.
    pub fn colour<'a>(&'a self, view: &'a wgpu::TextureView) -> wgpu::RenderPassColorAttachment<'a> {
        let (view, resolve_target, store) = match &self.samples {
            Some(samples) => (samples, Some(view), wgpu::StoreOp::Discard),
            None => (view, None, wgpu::StoreOp::Store),
        };
        let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store };
        wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target, ops }
    }
}
