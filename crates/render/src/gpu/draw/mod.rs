//! Draws a [`Picture`] with wgpu: tubes skinned on the GPU, solids by instances, one shadow map, one lighting pass.
//!
//! In: a picture, a camera, a target. Out: pixels and the time they took. Never here: snapshots, levels, windows.
//! A renderer can be dropped and made anew with another device at any time; all its content comes from the picture.

mod cuts;
mod depth;
mod meshes;
mod options;
mod passes;
mod pipelines;
mod resources;
mod skins;
mod timing;

use super::offscreen::DeviceLoss;
use crate::composition::environment::Environment;
use crate::composition::picture::{Colouring, Picture, SkinSample, SolidInstance};
use crate::seen::view::{Camera, Size};
use cuts::Cuts;
use depth::DepthPass;
use meshes::Meshes;
pub use options::{RendererOptions, Target};
use pipelines::{Pipelines, Setup};
use resources::bindings::{Bindings, Layouts};
use resources::buffers::{Growing, Targets};
use resources::globals::Globals;
use resources::textures::Textures;
use skins::SkinBuffers;
use std::time::{Duration, Instant};
use timing::Timing;

/// Cost of drawing a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DrawTimes {
    /// CPU time of this thread: uploading, encoding, submitting.
    pub cpu: Duration,
    /// GPU time of the newest frame whose time stamps are back; `None` where the adapter has none.
    pub gpu: Option<Duration>,
    /// Triangles drawn, without the shadow map's.
    pub triangles: u64,
    /// Draw calls, with the shadow map's.
    pub draws: u32,
}

/// Why a picture could not be drawn.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DrawError {
    /// The target is larger than the device's textures allow. Nothing was drawn; a smaller target works.
    #[error("a picture of {width} × {height} pixels is too large for this adapter; its limit is {max}")]
    TooLarge {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// The largest width and height.
        max: u32,
    },
    /// The device is gone. Make a new device and a new renderer; pictures stay valid.
    #[error("the graphics device was lost: {reason}")]
    DeviceLost {
        /// The driver's message.
        reason: String,
    },
    /// wgpu rejected a call: a bug of this crate, or a device out of memory. The picture is undefined.
    #[error("the graphics device reported an error: {message}")]
    Refused {
        /// The message of wgpu.
        message: String,
    },
}

/// Draws pictures on one device.
#[derive(Debug)]
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    setup: Setup,
    lost: DeviceLoss,
    layouts: Layouts,
    pipelines: Pipelines,
    bindings: Bindings,
    meshes: Meshes,
    cuts: Cuts,
    samples: Growing,
    instances: Growing,
    skins: SkinBuffers,
    textures: Textures,
    targets: Option<Targets>,
    /// Made when depths are first shown.
    depth_pass: Option<DepthPass>,
    timing: Option<Timing>,
}

impl Renderer {
    /// A renderer for targets of `format`. Sets the device's callback for its loss ([`Renderer::lost`]).
    ///
    /// # Errors
    /// [`DrawError::Refused`] where the device lacks a feature that the shaders need.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        format: wgpu::TextureFormat,
        options: RendererOptions,
    ) -> Result<Self, DrawError> {
        let lost = DeviceLoss::watch(device);
        let options = RendererOptions {
            samples: if options.samples > 1 { 4 } else { 1 },
            shadow_px: options.shadow_px.clamp(64, 8192).min(device.limits().max_texture_dimension_2d),
            shadow_taps: if options.shadow_taps > 1 { 4 } else { 1 },
            lean: options.lean,
        };
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let layouts = Layouts::new(device);
        let setup = Setup { format, options, environment: Environment::default() };
        let pipelines = Pipelines::new(device, &layouts, setup);
        let bindings = Bindings::new(device, queue, &layouts, options.shadow_px);
        let renderer = Self {
            device: device.clone(),
            queue: queue.clone(),
            setup,
            lost,
            pipelines,
            bindings,
            meshes: Meshes::default(),
            cuts: Cuts::default(),
            samples: Growing::new("tube samples", size_of::<SkinSample>()),
            instances: Growing::new("solid instances", size_of::<SolidInstance>()),
            skins: SkinBuffers::default(),
            textures: Textures::new(device, layouts.texture.clone()),
            layouts,
            targets: None,
            depth_pass: None,
            timing: Timing::new(device, queue),
        };
        refusal(scope)?;
        Ok(renderer)
    }

    /// Whether and why the device was lost.
    #[must_use]
    pub fn lost(&self) -> &DeviceLoss {
        &self.lost
    }

    /// The options in use.
    #[must_use]
    pub fn options(&self) -> RendererOptions {
        self.setup.options
    }

    /// Draws `picture` as seen by `camera` and submits the work; it does not wait for the GPU.
    ///
    /// A target without pixels is left unchanged.
    ///
    /// # Errors
    /// See [`DrawError`]; the renderer stays usable unless the device was lost.
    pub fn render(&mut self, picture: &Picture, camera: &Camera, target: Target<'_>) -> Result<DrawTimes, DrawError> {
        let start = Instant::now();
        self.check(target.size)?;
        if target.size.is_empty() {
            return Ok(DrawTimes::default());
        }
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        self.prepare_light(picture.environment);
        self.upload(picture, camera, target);
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        let shadows = self.draw_shadows(&mut encoder, picture);
        let room = !resources::globals::floor_fills(picture, camera, target.shown);
        let mut draws = shadows + self.draw_picture(&mut encoder, picture, target, room);
        if picture.style.colouring == Colouring::Depth {
            draws += self.show_depths(&mut encoder, camera, target.view);
        }
        if let Some(timing) = &mut self.timing {
            timing.resolve(&mut encoder);
        }
        self.queue.submit([encoder.finish()]);
        if let Some(timing) = &mut self.timing {
            timing.request();
        }
        if let Err(refused) = refusal(scope) {
            return Err(self.loss().unwrap_or(refused));
        }
        Ok(DrawTimes { cpu: start.elapsed(), gpu: self.gpu_time(), triangles: picture.triangles(), draws })
    }

    /// GPU time of the newest frame whose time stamps are back.
    pub fn gpu_time(&mut self) -> Option<Duration> {
        self.timing.as_mut().and_then(Timing::newest)
    }

    /// The error of a lost device; a loss is reported during a poll.
    fn loss(&self) -> Option<DrawError> {
        // the poll of a lost device returns an error; the loss itself is reported by the callback
        let _ = self.device.poll(wgpu::PollType::Poll);
        self.lost.reason().map(|reason| DrawError::DeviceLost { reason })
    }

    fn check(&self, size: Size) -> Result<(), DrawError> {
        if let Some(loss) = self.loss() {
            return Err(loss);
        }
        let max = self.device.limits().max_texture_dimension_2d;
        if size.width > max || size.height > max {
            return Err(DrawError::TooLarge { width: size.width, height: size.height, max });
        }
        Ok(())
    }

    /// Makes the pipelines anew where the picture has another light than the one before: rare, and 0.1 s.
    fn prepare_light(&mut self, environment: Environment) {
        if self.setup.environment != environment {
            self.setup.environment = environment;
            self.pipelines = Pipelines::new(&self.device, &self.layouts, self.setup);
        }
    }

    fn upload(&mut self, picture: &Picture, camera: &Camera, target: Target<'_>) {
        let size = target.size;
        let globals = Globals::new(picture, camera, target, self.setup.options.shadow_px);
        self.queue.write_buffer(&self.bindings.globals, 0, bytemuck::bytes_of(&globals));
        self.samples.write(&self.device, &self.queue, bytemuck::cast_slice(&picture.samples));
        self.instances.write(&self.device, &self.queue, bytemuck::cast_slice(&picture.instances));
        self.skins.write(&self.device, &self.queue, &picture.skins);
        self.meshes.prepare(&self.device, picture);
        self.cuts.prepare(&self.device, &self.queue, picture);
        self.textures.prepare(&self.device, &self.queue, picture);
        if self.targets.as_ref().is_none_or(|targets| targets.size != size) {
            self.targets = Some(Targets::new(&self.device, self.setup.format, size, self.setup.options.samples));
        }
    }
}

/// The error that wgpu reported while `scope` was open.
fn refusal(scope: wgpu::ErrorScopeGuard) -> Result<(), DrawError> {
    match pollster::block_on(scope.pop()) {
        None => Ok(()),
        Some(error) => Err(DrawError::Refused { message: error.to_string() }),
    }
}
