//! Render pipelines: shaders, vertex layouts and states of everything that is drawn.
//!
//! In: a device and a format. Out: pipelines. Never here: a frame, bind groups.

use super::RendererOptions;
use super::resources::bindings::{DEPTH, Layouts};
use crate::composition::environment::Environment;
use crate::seen::level::Shading;
use wgpu::PrimitiveTopology::{LineList, TriangleList};
use wgpu::{Device, RenderPipeline, ShaderModule, TextureFormat, VertexBufferLayout};

const COMMON: &str = include_str!("shaders/common.wgsl");
const SKIN: &str = include_str!("shaders/skin.wgsl");
const SOLID: &str = include_str!("shaders/solid.wgsl");
const PAINTED: &str = include_str!("shaders/painted.wgsl");
const TISSUE: &str = include_str!("shaders/tissue.wgsl");
const HIDE: &str = include_str!("shaders/hide.wgsl");
const STROKE: &str = include_str!("shaders/stroke.wgsl");
const FLOOR: &str = include_str!("shaders/floor.wgsl");

/// The settings that pipelines are made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Setup {
    /// The format of targets.
    pub format: TextureFormat,
    /// Quality settings.
    pub options: RendererOptions,
    /// The light, which is written into the shaders.
    pub environment: Environment,
}

/// Every pipeline of a renderer.
#[derive(Debug)]
pub struct Pipelines {
    /// Tubes of tissue.
    pub tissue: RenderPipeline,
    /// Other tubes.
    pub skin: RenderPipeline,
    /// Tubes, flat shaded.
    pub skin_flat: RenderPipeline,
    /// Tubes, lit per vertex.
    pub skin_gouraud: RenderPipeline,
    /// Solids.
    pub solid: RenderPipeline,
    /// Solids, flat shaded.
    pub solid_flat: RenderPipeline,
    /// Solids, lit per vertex.
    pub solid_gouraud: RenderPipeline,
    /// Textured solids.
    pub painted: RenderPipeline,
    /// Tubes in soft shadow: of any other material, of tissue.
    pub skins_shadowed: [RenderPipeline; 2],
    /// Solids in soft shadow: plain, textured.
    pub solids_shadowed: [RenderPipeline; 2],
    /// Skins of soft bodies that are tissue, plain and in soft shadow.
    pub hides: [RenderPipeline; 2],
    /// Points, lines and leaves, which turn to the camera.
    pub stroke: RenderPipeline,
    /// The same in the shadow map.
    pub stroke_shadow: RenderPipeline,
    /// Boxes in cells.
    pub slab: RenderPipeline,
    /// The floor in its parts, and how many vertices each has.
    pub floor: Vec<(RenderPipeline, u32)>,
    /// The background.
    pub room: RenderPipeline,
    /// Tubes as lines.
    pub skin_edges: RenderPipeline,
    /// Solids as lines.
    pub solid_edges: RenderPipeline,
    /// Tubes in the shadow map.
    pub skin_shadow: RenderPipeline,
    /// Solids in the shadow map.
    pub solid_shadow: RenderPipeline,
}

/// The settings in which pipelines differ.
struct PipelineDesc<'a> {
    label: &'a str,
    vertex: &'a str,
    /// `None` draws depths only.
    fragment: Option<&'a str>,
    buffers: &'a [Option<VertexBufferLayout<'a>>],
    topology: wgpu::PrimitiveTopology,
    module: &'a ShaderModule,
}

/// The settings that the pipelines of a renderer share.
struct PipelineBuilder<'a> {
    device: &'a Device,
    layouts: [wgpu::PipelineLayout; 2],
    /// Layout of the picture's bind group and a texture's.
    with_texture: wgpu::PipelineLayout,
    format: TextureFormat,
    samples: u32,
    shadow_taps: u32,
}

const SAMPLE_STRIDE: u64 = 72;
const BODY_STRIDE: u64 = 64;
const CORNER_STRIDE: u64 = 32;

/// Cells along a side of the floor's shadowed patch, and rings around it; the shader uses the same numbers.
const FLOOR_CELLS: u32 = 8;
const FLOOR_RINGS: u32 = 12;
const FLOOR_PATCH_CORNERS: u32 = 6 * FLOOR_CELLS * FLOOR_CELLS;
const FLOOR_RING_CORNERS: u32 = 6 * 4 * FLOOR_CELLS * FLOOR_RINGS;

/// The sample at which an interval of a tube begins.
const BEGIN: [wgpu::VertexAttribute; 7] = wgpu::vertex_attr_array![1 => Float32x4, 2 => Float32x4, 3 => Float32x4, 4 => Float32x2, 5 => Unorm8x4, 6 => Unorm8x4, 11 => Float32x2];
/// The one at which it ends.
const END: [wgpu::VertexAttribute; 5] = [
    wgpu::VertexAttribute { format: wgpu::VertexFormat::Float32x4, offset: 0, shader_location: 7 },
    wgpu::VertexAttribute { format: wgpu::VertexFormat::Float32x4, offset: 16, shader_location: 8 },
    wgpu::VertexAttribute { format: wgpu::VertexFormat::Float32x4, offset: 32, shader_location: 9 },
    wgpu::VertexAttribute { format: wgpu::VertexFormat::Float32x2, offset: 48, shader_location: 10 },
    // past the colours, which are the same as at the beginning
    wgpu::VertexAttribute { format: wgpu::VertexFormat::Float32x2, offset: 64, shader_location: 12 },
];
/// A mesh's corner.
const CORNER: [wgpu::VertexAttribute; 3] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 9 => Float32x2];
/// The corner at the end of its geomorph.
const CORNER_TO: [wgpu::VertexAttribute; 3] = wgpu::vertex_attr_array![7 => Float32x3, 8 => Float32x3, 11 => Float32x2];
/// A solid's instance.
const BODY: [wgpu::VertexAttribute; 6] = wgpu::vertex_attr_array![2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Unorm8x4, 6 => Unorm8x4, 10 => Float32x2];

fn layout(
    array_stride: u64,
    step_mode: wgpu::VertexStepMode,
    attributes: &[wgpu::VertexAttribute],
) -> Option<VertexBufferLayout<'_>> {
    Some(VertexBufferLayout { array_stride, step_mode, attributes })
}

impl Pipelines {
    /// All pipelines of a renderer in an environment.
    pub fn new(device: &Device, layouts: &Layouts, setup: Setup) -> Self {
        let Setup { format, options, environment } = setup;
        let light = super::resources::globals::light_source(environment);
        let module = |label, source: &str| {
            let source = wgpu::ShaderSource::Wgsl(format!("{light}{COMMON}\n{source}").into());
            device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source })
        };
        let (solid, floor) = (module("solid", SOLID), module("floor", FLOOR));
        let (skin, painted) = (module("skin", &[TISSUE, SKIN].concat()), module("painted", &[SOLID, PAINTED].concat()));
        let builder = PipelineBuilder::new(device, layouts, format, options);
        let (vertex, instance) = (wgpu::VertexStepMode::Vertex, wgpu::VertexStepMode::Instance);
        let tubes = [
            layout(16, vertex, &wgpu::vertex_attr_array![0 => Float32x4]),
            layout(SAMPLE_STRIDE, instance, &BEGIN),
            layout(SAMPLE_STRIDE, instance, &END),
        ];
        let solids = [
            layout(CORNER_STRIDE, vertex, &CORNER),
            layout(BODY_STRIDE, instance, &BODY),
            layout(CORNER_STRIDE, vertex, &CORNER_TO),
        ];
        let tube = |label, vertex, fragment, topology| {
            builder.create(&PipelineDesc { label, vertex, fragment, buffers: &tubes, topology, module: &skin })
        };
        let solid = |label, vertex, fragment, topology| {
            builder.create(&PipelineDesc { label, vertex, fragment, buffers: &solids, topology, module: &solid })
        };
        let [stroke, stroke_shadow] = builder.strokes(&module("stroke", &[SOLID, STROKE].concat()));
        let lean = |entry: [&'static str; 2]| entry[usize::from(options.lean)];
        let skin_vertex = lean(["vs_skin", "vs_skin_lean"]);
        Self {
            tissue: tube("tissue", skin_vertex, Some(lean(["fs_tissue", "fs_tissue_lean"])), TriangleList),
            skin: tube("skin", skin_vertex, Some(lean(["fs_skin", "fs_skin_lean"])), TriangleList),
            skin_flat: tube("flat skin", "vs_skin_flat", Some("fs_skin_flat"), TriangleList),
            skin_gouraud: tube("gouraud skin", "vs_skin_gouraud", Some("fs_skin_gouraud"), TriangleList),
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
            painted: builder.painted(&solids, &painted, "fs_painted"),
            skins_shadowed: ["fs_skin_shadowed", "fs_tissue_shadowed"]
                .map(|fragment| tube("shadowed skin", "vs_skin", Some(fragment), TriangleList)),
            solids_shadowed: [
                solid("shadowed solid", "vs_solid", Some("fs_solid_shadowed"), TriangleList),
                builder.painted(&solids, &painted, "fs_painted_shadowed"),
            ],
            hides: builder.hides(&solids, &module("hide", &[SOLID, TISSUE, HIDE].concat()), options.lean),
            stroke,
            stroke_shadow,
            slab: solid("slab", lean(["vs_solid", "vs_slab"]), Some(lean(["fs_solid", "fs_slab"])), TriangleList),
            solid_edges: solid("solid edges", "vs_solid", Some("fs_solid_edge"), LineList),
            solid_shadow: solid("solid shadow", "vs_solid_shadow", None, TriangleList),
            floor: builder.floor(&floor, options.lean),
            room: builder.plain(&floor, "vs_room", "fs_room", TriangleList),
        }
    }
}

impl Pipelines {
    /// The pipeline for tubes of a shading.
    pub fn skin_of(&self, tissue: bool, shading: Shading) -> &RenderPipeline {
        match shading {
            Shading::Flat => &self.skin_flat,
            Shading::Gouraud => &self.skin_gouraud,
            Shading::Shadowed => &self.skins_shadowed[usize::from(tissue)],
            Shading::Textured if tissue => &self.tissue,
            Shading::PerPixel | Shading::Textured => &self.skin,
        }
    }

    /// The pipeline for the skins of soft bodies of a shading.
    pub fn hide_of(&self, tissue: bool, shading: Shading) -> &RenderPipeline {
        match shading {
            Shading::Textured if tissue => &self.hides[0],
            Shading::Shadowed if tissue => &self.hides[1],
            _ => self.solid_of(shading, false),
        }
    }

    /// The pipeline for solids and meshes of a shading, textured or not.
    pub fn solid_of(&self, shading: Shading, texture: bool) -> &RenderPipeline {
        match shading {
            Shading::Flat => &self.solid_flat,
            Shading::Gouraud => &self.solid_gouraud,
            Shading::PerPixel => &self.solid,
            Shading::Textured if texture => &self.painted,
            Shading::Textured => &self.solid,
            Shading::Shadowed => &self.solids_shadowed[usize::from(texture)],
        }
    }
}

impl<'a> PipelineBuilder<'a> {
    fn new(device: &'a Device, layouts: &Layouts, format: TextureFormat, options: RendererOptions) -> Self {
        let layout = |groups: &[Option<&wgpu::BindGroupLayout>]| {
            device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: None,
                bind_group_layouts: groups,
                immediate_size: 0,
            })
        };
        let with_texture = layout(&[Some(&layouts.picture), Some(&layouts.texture)]);
        let layouts = [&layouts.light, &layouts.picture].map(|group| layout(&[Some(group)]));
        Self { device, layouts, with_texture, format, samples: options.samples, shadow_taps: options.shadow_taps }
    }

    /// The floor in its parts, and how many corners each has.
    fn floor(&self, module: &ShaderModule, lean: bool) -> Vec<(RenderPipeline, u32)> {
        use wgpu::PrimitiveTopology::TriangleStrip;
        if !lean {
            return vec![(self.plain(module, "vs_floor", "fs_floor", TriangleStrip), 4)];
        }
        vec![
            (self.plain(module, "vs_floor_patch", "fs_floor_patch", TriangleList), FLOOR_PATCH_CORNERS),
            (self.plain(module, "vs_floor_rings", "fs_floor_rings", TriangleList), FLOOR_RING_CORNERS),
        ]
    }

    /// A pipeline without buffers.
    fn plain(
        &self,
        module: &ShaderModule,
        vertex: &str,
        fragment: &str,
        topology: wgpu::PrimitiveTopology,
    ) -> RenderPipeline {
        self.create(&PipelineDesc { label: vertex, vertex, fragment: Some(fragment), buffers: &[], topology, module })
    }

    /// Pipelines for points, lines and leaves, in the picture and in the shadow map.
    fn strokes(&self, module: &ShaderModule) -> [RenderPipeline; 2] {
        let tip = wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x4];
        let buffers = [
            layout(32, wgpu::VertexStepMode::Vertex, &tip),
            layout(BODY_STRIDE, wgpu::VertexStepMode::Instance, &BODY),
        ];
        let topology = wgpu::PrimitiveTopology::TriangleList;
        [("vs_stroke", Some("fs_stroke")), ("vs_stroke_shadow", None)].map(|(vertex, fragment)| {
            self.create(&PipelineDesc { label: "stroke", vertex, fragment, buffers: &buffers, topology, module })
        })
    }

    /// Pipelines for soft bodies of tissue, plain and in soft shadow.
    fn hides(
        &self,
        buffers: &[Option<VertexBufferLayout<'_>>],
        module: &ShaderModule,
        lean: bool,
    ) -> [RenderPipeline; 2] {
        let plain = if lean { "fs_hide_lean" } else { "fs_hide" };
        let (vertex, topology) = ("vs_hide", wgpu::PrimitiveTopology::TriangleList);
        [plain, "fs_hide_shadowed"].map(|fragment| {
            let fragment = Some(fragment);
            self.create(&PipelineDesc { label: "hide", vertex, fragment, buffers, topology, module })
        })
    }

    /// A pipeline for textured solids.
    fn painted(
        &self,
        buffers: &[Option<VertexBufferLayout<'_>>],
        module: &ShaderModule,
        fragment: &str,
    ) -> RenderPipeline {
        let (vertex, fragment) = ("vs_painted", Some(fragment));
        let topology = wgpu::PrimitiveTopology::TriangleList;
        self.create_with(
            &PipelineDesc { label: "painted", vertex, fragment, buffers, topology, module },
            &self.with_texture,
        )
    }

    fn create(&self, desc: &PipelineDesc<'_>) -> RenderPipeline {
        self.create_with(desc, &self.layouts[usize::from(desc.fragment.is_some())])
    }

    fn create_with(&self, desc: &PipelineDesc<'_>, layout: &wgpu::PipelineLayout) -> RenderPipeline {
        let lines = desc.topology == wgpu::PrimitiveTopology::LineList;
        let shadow = desc.fragment.is_none();
        let flag = |on: bool| f64::from(u8::from(on));
        let taps = f64::from(self.shadow_taps);
        let encode = ("ENCODE_SRGB", flag(!self.format.is_srgb()));
        let constants = [encode, ("SHADOW_TAPS", taps)];
        // lines are drawn a little nearer than the surface they outline: 1.5 mm at 1 m
        let nudge = [encode, ("NUDGE", if lines { 1.5e-3 } else { 0.0 })];
        let options = |constants| wgpu::PipelineCompilationOptions { constants, ..Default::default() };
        let targets =
            [Some(wgpu::ColorTargetState { format: self.format, blend: None, write_mask: wgpu::ColorWrites::ALL })];
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(desc.label),
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module: desc.module,
                entry_point: Some(desc.vertex),
                compilation_options: options(&nudge),
                buffers: desc.buffers,
            },
            primitive: wgpu::PrimitiveState {
                topology: desc.topology,
                cull_mode: (!lines).then_some(wgpu::Face::Back).filter(|_| !desc.buffers.is_empty()),
                ..Default::default()
            },
            depth_stencil: Some(depth_state(shadow)),
            multisample: wgpu::MultisampleState { count: if shadow { 1 } else { self.samples }, ..Default::default() },
            fragment: desc.fragment.map(|entry| wgpu::FragmentState {
                module: desc.module,
                entry_point: Some(entry),
                compilation_options: options(&constants),
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// Depths are reversed in the picture (nearer is greater) and plain in the shadow map, where a bias pushes them back.
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
