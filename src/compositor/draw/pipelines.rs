//! Pipelines and what they are bound to: shaders, layouts, the shadow map, the tissue texture.
//!
//! In: a device and a format. Out: everything that does not change from frame to frame. Never here: a frame.

use super::RendererOptions;
use super::globals::Globals;
use super::tissue;
use wgpu::util::DeviceExt;
use wgpu::{BindGroupLayout, Device, RenderPipeline, ShaderModule, TextureFormat, VertexBufferLayout};

/// Format of depths.
pub const DEPTH: TextureFormat = TextureFormat::Depth32Float;

const COMMON: &str = include_str!("shaders/common.wgsl");
const SKIN: &str = include_str!("shaders/skin.wgsl");
const SOLID: &str = include_str!("shaders/solid.wgsl");
const STROKE: &str = include_str!("shaders/stroke.wgsl");
const FLOOR: &str = include_str!("shaders/floor.wgsl");

/// What passes may read: the light's pass the numbers only, the picture's pass the light's depths too.
#[derive(Debug)]
pub struct Layouts {
    light: BindGroupLayout,
    picture: BindGroupLayout,
}

impl Layouts {
    /// The two layouts.
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
        }
    }
}

/// The things bound, and the views that passes draw into.
#[derive(Debug)]
pub struct Bindings {
    /// The frame's numbers.
    pub globals: wgpu::Buffer,
    /// Bound while the light's depths are drawn.
    pub light: wgpu::BindGroup,
    /// Bound while the picture is drawn.
    pub picture: wgpu::BindGroup,
    /// The light's depths.
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
    let texture = device.create_texture_with_data(queue, &descriptor, order, &tissue::levels());
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// Every pipeline of a renderer.
#[derive(Debug)]
pub struct Pipelines {
    /// Tubes of tissue.
    pub tissue: RenderPipeline,
    /// Other tubes.
    pub skin: RenderPipeline,
    /// Solids.
    pub solid: RenderPipeline,
    /// Solids of one colour a triangle.
    pub solid_flat: RenderPipeline,
    /// Solids lit at their corners.
    pub solid_gouraud: RenderPipeline,
    /// Points and lines that turn to the eye.
    pub stroke: RenderPipeline,
    /// Points and lines as the light sees them.
    pub stroke_shadow: RenderPipeline,
    /// Boxes in cells.
    pub slab: RenderPipeline,
    /// The floor in its parts, and how many vertices each has.
    pub floor: Vec<(RenderPipeline, u32)>,
    /// What lies behind everything.
    pub room: RenderPipeline,
    /// Tubes as lines.
    pub skin_edges: RenderPipeline,
    /// Solids as lines.
    pub solid_edges: RenderPipeline,
    /// Tubes as the light sees them.
    pub skin_shadow: RenderPipeline,
    /// Solids as the light sees them.
    pub solid_shadow: RenderPipeline,
}

/// What distinguishes one pipeline from another.
struct Recipe<'a> {
    label: &'a str,
    vertex: &'a str,
    /// `None` draws depths only.
    fragment: Option<&'a str>,
    buffers: &'a [Option<VertexBufferLayout<'a>>],
    topology: wgpu::PrimitiveTopology,
    module: &'a ShaderModule,
}

/// What pipelines of a renderer have in common.
struct Kitchen<'a> {
    device: &'a Device,
    layouts: [wgpu::PipelineLayout; 2],
    format: TextureFormat,
    samples: u32,
    shadow_taps: u32,
}

const SAMPLE_STRIDE: u64 = 64;

/// Cells along a side of the floor's shadowed patch, and rings around it; the shader has the same numbers.
const FLOOR_CELLS: u32 = 8;
const FLOOR_RINGS: u32 = 8;
const FLOOR_PATCH_CORNERS: u32 = 6 * FLOOR_CELLS * FLOOR_CELLS;
const FLOOR_RING_CORNERS: u32 = 6 * 4 * FLOOR_CELLS * FLOOR_RINGS;

/// A solid's instance.
const BODY: [wgpu::VertexAttribute; 5] =
    wgpu::vertex_attr_array![2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Unorm8x4, 6 => Unorm8x4];

fn layout(
    array_stride: u64,
    step_mode: wgpu::VertexStepMode,
    attributes: &[wgpu::VertexAttribute],
) -> Option<VertexBufferLayout<'_>> {
    Some(VertexBufferLayout { array_stride, step_mode, attributes })
}

impl Pipelines {
    /// All pipelines for targets of `format`.
    pub fn new(device: &Device, layouts: &Layouts, format: TextureFormat, options: RendererOptions) -> Self {
        let light = super::globals::light_source();
        let module = |label, source: &str| {
            let source = wgpu::ShaderSource::Wgsl(format!("{light}{COMMON}\n{source}").into());
            device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source })
        };
        let (skin, solid, floor) = (module("skin", SKIN), module("solid", SOLID), module("floor", FLOOR));
        let kitchen = Kitchen::new(device, layouts, format, options);
        let begin = wgpu::vertex_attr_array![1 => Float32x4, 2 => Float32x4, 3 => Float32x4, 4 => Float32x2, 5 => Unorm8x4, 6 => Unorm8x4];
        let end = wgpu::vertex_attr_array![7 => Float32x4, 8 => Float32x4, 9 => Float32x4, 10 => Float32x2];
        let corner = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];
        let (vertex, instance) = (wgpu::VertexStepMode::Vertex, wgpu::VertexStepMode::Instance);
        let tubes = [
            layout(16, vertex, &wgpu::vertex_attr_array![0 => Float32x4]),
            layout(SAMPLE_STRIDE, instance, &begin),
            layout(SAMPLE_STRIDE, instance, &end),
        ];
        let solids = [layout(24, vertex, &corner), layout(SAMPLE_STRIDE, instance, &BODY)];
        use wgpu::PrimitiveTopology::{LineList, TriangleList, TriangleStrip};
        let tube = |label, vertex, fragment, topology| {
            kitchen.cook(&Recipe { label, vertex, fragment, buffers: &tubes, topology, module: &skin })
        };
        let solid = |label, vertex, fragment, topology| {
            kitchen.cook(&Recipe { label, vertex, fragment, buffers: &solids, topology, module: &solid })
        };
        let plain = |label, vertex, fragment, topology| {
            kitchen.cook(&Recipe { label, vertex, fragment: Some(fragment), buffers: &[], topology, module: &floor })
        };
        let [stroke, stroke_shadow] = kitchen.strokes(&module("stroke", &[SOLID, STROKE].concat()));
        let lean = |entry: [&'static str; 2]| entry[usize::from(options.lean)];
        let skin_vertex = lean(["vs_skin", "vs_skin_lean"]);
        Self {
            tissue: tube("tissue", skin_vertex, Some(lean(["fs_tissue", "fs_tissue_lean"])), TriangleList),
            skin: tube("skin", skin_vertex, Some(lean(["fs_skin", "fs_skin_lean"])), TriangleList),
            skin_edges: tube("skin edges", "vs_skin", Some("fs_edge"), LineList),
            skin_shadow: tube("skin shadow", "vs_skin_shadow", None, TriangleList),
            solid: solid(
                "solid",
                lean(["vs_solid", "vs_solid_lean"]),
                Some(lean(["fs_solid", "fs_solid_lean"])),
                TriangleList,
            ),
            solid_flat: solid("flat solid", "vs_flat", Some("fs_flat"), TriangleList),
            solid_gouraud: solid("gouraud solid", "vs_slab", Some("fs_slab"), TriangleList),
            stroke,
            stroke_shadow,
            slab: solid("slab", lean(["vs_solid", "vs_slab"]), Some(lean(["fs_solid", "fs_slab"])), TriangleList),
            solid_edges: solid("solid edges", "vs_solid", Some("fs_solid_edge"), LineList),
            solid_shadow: solid("solid shadow", "vs_solid_shadow", None, TriangleList),
            floor: if options.lean {
                vec![
                    (plain("floor patch", "vs_floor_patch", "fs_floor_patch", TriangleList), FLOOR_PATCH_CORNERS),
                    (plain("floor rings", "vs_floor_rings", "fs_floor_rings", TriangleList), FLOOR_RING_CORNERS),
                ]
            } else {
                vec![(plain("floor", "vs_floor", "fs_floor", TriangleStrip), 4)]
            },
            room: plain("room", "vs_room", "fs_room", TriangleList),
        }
    }
}

impl<'a> Kitchen<'a> {
    fn new(device: &'a Device, layouts: &Layouts, format: TextureFormat, options: RendererOptions) -> Self {
        let layouts = [&layouts.light, &layouts.picture].map(|group| {
            device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: None,
                bind_group_layouts: &[Some(group)],
                immediate_size: 0,
            })
        });
        Self { device, layouts, format, samples: options.samples, shadow_taps: options.shadow_taps }
    }

    /// Points and lines, as the eye and as the light sees them.
    fn strokes(&self, module: &ShaderModule) -> [RenderPipeline; 2] {
        let tip = wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x4];
        let buffers = [
            layout(32, wgpu::VertexStepMode::Vertex, &tip),
            layout(SAMPLE_STRIDE, wgpu::VertexStepMode::Instance, &BODY),
        ];
        let topology = wgpu::PrimitiveTopology::TriangleList;
        [("vs_stroke", Some("fs_slab")), ("vs_stroke_shadow", None)].map(|(vertex, fragment)| {
            self.cook(&Recipe { label: "stroke", vertex, fragment, buffers: &buffers, topology, module })
        })
    }

    fn cook(&self, recipe: &Recipe<'_>) -> RenderPipeline {
        let lines = recipe.topology == wgpu::PrimitiveTopology::LineList;
        let shadow = recipe.fragment.is_none();
        let flag = |on: bool| f64::from(u8::from(on));
        let taps = f64::from(self.shadow_taps);
        let encode = ("ENCODE_SRGB", flag(!self.format.is_srgb()));
        let constants = [encode, ("SHADOW_TAPS", taps)];
        // lines lie a little nearer than what they outline: a millimetre and a half at a metre
        let nudge = [encode, ("NUDGE", if lines { 1.5e-3 } else { 0.0 })];
        let options = |constants| wgpu::PipelineCompilationOptions { constants, ..Default::default() };
        let targets =
            [Some(wgpu::ColorTargetState { format: self.format, blend: None, write_mask: wgpu::ColorWrites::ALL })];
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(recipe.label),
            layout: Some(&self.layouts[usize::from(!shadow)]),
            vertex: wgpu::VertexState {
                module: recipe.module,
                entry_point: Some(recipe.vertex),
                compilation_options: options(&nudge),
                buffers: recipe.buffers,
            },
            primitive: wgpu::PrimitiveState {
                topology: recipe.topology,
                cull_mode: (!lines).then_some(wgpu::Face::Back).filter(|_| !recipe.buffers.is_empty()),
                ..Default::default()
            },
            depth_stencil: Some(depth_state(shadow)),
            multisample: wgpu::MultisampleState { count: if shadow { 1 } else { self.samples }, ..Default::default() },
            fragment: recipe.fragment.map(|entry| wgpu::FragmentState {
                module: recipe.module,
                entry_point: Some(entry),
                compilation_options: options(&constants),
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// Depths are reversed in the picture (nearer is greater) and plain in the shadow, where they are pushed back a little.
fn depth_state(shadow: bool) -> wgpu::DepthStencilState {
    let bias = wgpu::DepthBiasState { constant: 2, slope_scale: 2.0, clamp: 0.0 };
    wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(true),
        depth_compare: Some(if shadow { wgpu::CompareFunction::Less } else { wgpu::CompareFunction::GreaterEqual }),
        stencil: wgpu::StencilState::default(),
        bias: if shadow { bias } else { wgpu::DepthBiasState::default() },
    }
}
