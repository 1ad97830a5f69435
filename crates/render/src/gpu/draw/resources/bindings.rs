//! Resources that shaders are bound to: layouts, the frame's uniforms, the shadow map, the tissue texture.
//!
//! In: a device. Out: all bindings that do not change from frame to frame. Never here: a frame, pipelines.

use super::globals::Globals;
use super::tissue;
use wgpu::util::DeviceExt;
use wgpu::{BindGroupLayout, Device, TextureFormat};

/// Format of depths.
pub const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// Bind group layouts: the light's pass reads the uniforms only, the picture's pass the shadow map too, and painted meshes a texture.
#[derive(Debug)]
pub struct Layouts {
    pub(crate) light: BindGroupLayout,
    pub(crate) picture: BindGroupLayout,
    pub(crate) texture: BindGroupLayout,
}

impl Layouts {
    /// The three layouts.
    pub fn new(device: &Device) -> Self {
        use wgpu::{BindingType, SamplerBindingType, TextureSampleType, TextureViewDimension};
        let texture = |sample_type| BindingType::Texture {
            sample_type,
            view_dimension: TextureViewDimension::D2,
            multisampled: false,
        };
        let block = BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let layout = |label, types: &[BindingType]| {
            let entries: Vec<_> = (0..)
                .zip(types)
                .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry {
                    binding,
                    visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                    ty,
                    count: None,
                })
                .collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
        };
        Self {
            light: layout("light", &[block]),
            picture: layout(
                "picture",
                &[
                    block,
                    texture(TextureSampleType::Depth),
                    BindingType::Sampler(SamplerBindingType::Comparison),
                    texture(TextureSampleType::Float { filterable: true }),
                    BindingType::Sampler(SamplerBindingType::Filtering),
                    texture(TextureSampleType::Float { filterable: false }),
                ],
            ),
            texture: layout(
                "texture",
                &[
                    texture(TextureSampleType::Float { filterable: true }),
                    BindingType::Sampler(SamplerBindingType::Filtering),
                ],
            ),
        }
    }
}

/// The bind groups, and the views that passes draw into.
#[derive(Debug)]
pub struct Bindings {
    /// The frame's uniforms.
    pub globals: wgpu::Buffer,
    /// Bound while the shadow map is drawn.
    pub light: wgpu::BindGroup,
    /// Bound while the picture is drawn.
    pub picture: wgpu::BindGroup,
    /// The shadow map.
    pub shadow: wgpu::TextureView,
}

impl Bindings {
    /// Buffers and textures of a renderer.
    pub fn new(device: &Device, queue: &wgpu::Queue, layouts: &Layouts, shadow_px: u32) -> Self {
        let globals = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("globals"),
            size: size_of::<Globals>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let shadow = shadow_map(device, shadow_px);
        let tissue = tissue_map(device, queue);
        let filter = wgpu::FilterMode::Linear;
        let compare = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow"),
            mag_filter: filter,
            min_filter: filter,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        let repeat = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("tissue"),
            address_mode_u: wgpu::AddressMode::Repeat,
            address_mode_v: wgpu::AddressMode::Repeat,
            mag_filter: filter,
            min_filter: filter,
            ..Default::default()
        });
        let group = |label, layout, resources: Vec<wgpu::BindingResource<'_>>| {
            let entries: Vec<_> =
                (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
        };
        use wgpu::BindingResource::{Sampler, TextureView};
        let light = group("light", &layouts.light, vec![globals.as_entire_binding()]);
        let all = vec![
            globals.as_entire_binding(),
            TextureView(&shadow),
            Sampler(&compare),
            TextureView(&tissue),
            Sampler(&repeat),
            TextureView(&shadow),
        ];
        let picture = group("picture", &layouts.picture, all);
        Self { globals, light, picture, shadow }
    }
}

fn extent(side: u32) -> wgpu::Extent3d {
    wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 }
}

fn shadow_map(device: &Device, side: u32) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("shadow map"),
        size: extent(side),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: DEPTH,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn tissue_map(device: &Device, queue: &wgpu::Queue) -> wgpu::TextureView {
    let descriptor = wgpu::TextureDescriptor {
        label: Some("tissue"),
        size: extent(tissue::TEXELS),
        mip_level_count: tissue::TEXELS.ilog2() + 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let order = wgpu::util::TextureDataOrder::MipMajor;
    let texture = device.create_texture_with_data(queue, &descriptor, order, &tissue::LEVELS);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
