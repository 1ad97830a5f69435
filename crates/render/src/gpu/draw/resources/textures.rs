//! Textures on the GPU: images on meshes, uploaded once.
//!
//! In: the textures of a picture. Out: bind groups of the painted pipeline. Never here: texture coordinates.

use crate::composition::picture::Picture;
use metachron_drawable::Texture;
use std::sync::Arc;
use wgpu::util::DeviceExt;

/// Largest width and height in pixels that are uploaded; a larger texture is halved until it fits.
const SIDE_MAX: u32 = 2048;

/// GPU data made from the textures of a picture.
#[derive(Debug)]
pub struct Textures {
    layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    known: Arc<[Arc<Texture>]>,
    groups: Vec<wgpu::BindGroup>,
}

impl Textures {
    /// No textures yet.
    pub fn new(device: &wgpu::Device, layout: wgpu::BindGroupLayout) -> Self {
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("texture"),
            address_mode_u: wgpu::AddressMode::Repeat,
            address_mode_v: wgpu::AddressMode::Repeat,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            ..Default::default()
        });
        Self { layout, sampler, known: Arc::default(), groups: Vec::new() }
    }

    /// Uploads the textures of `picture` if they differ from the last ones.
    pub fn prepare(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, picture: &Picture) {
        if Arc::ptr_eq(&self.known, &picture.textures) {
            return;
        }
        self.known = Arc::clone(&picture.textures);
        self.groups = self.known.iter().map(|texture| self.group_of(device, queue, texture)).collect();
    }

    /// The bind group for a run with this [`SolidKind::texture`](crate::composition::picture::SolidKind::texture).
    pub fn group(&self, number: u32) -> Option<&wgpu::BindGroup> {
        self.groups.get(number.checked_sub(1)? as usize)
    }

    fn group_of(&self, device: &wgpu::Device, queue: &wgpu::Queue, texture: &Texture) -> wgpu::BindGroup {
        let view = upload(device, queue, texture);
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("texture"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&self.sampler) },
            ],
        })
    }
}

/// Uploads a texture with its mipmaps.
fn upload(device: &wgpu::Device, queue: &wgpu::Queue, texture: &Texture) -> wgpu::TextureView {
    let larger = |texture: &Texture, side: u32| texture.size().0.max(texture.size().1) > side;
    let mut level = texture.clone();
    while larger(&level, SIDE_MAX) {
        level = level.halved();
    }
    let (width, height) = level.size();
    let (mut texels, mut count) = (bytemuck::cast_slice::<_, u8>(level.texels()).to_vec(), 1);
    while larger(&level, 1) {
        level = level.halved();
        texels.extend_from_slice(bytemuck::cast_slice(level.texels()));
        count += 1;
    }
    let descriptor = wgpu::TextureDescriptor {
        label: Some("texture"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: count,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let order = wgpu::util::TextureDataOrder::MipMajor;
    let uploaded = device.create_texture_with_data(queue, &descriptor, order, &texels);
    uploaded.create_view(&wgpu::TextureViewDescriptor::default())
}
