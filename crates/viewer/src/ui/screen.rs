//! The picture on the window's device: a texture that the renderer draws into and egui shows.
//!
//! In: a composed picture. Out: a texture's id and the times of the picture. Never here: pacing, panels.
//! The thread waits for the picture, so that its measured work is complete; egui draws after it on the same queue.

use super::Screen;
use super::blit;
use super::protocol::{Simulation, ViewRequest};
use egui::{Rect, Shape};
use egui_wgpu::{RenderState, wgpu};
use metachron_render::Gpu;
use metachron_render::offscreen;
use metachron_render::{DeviceLoss, DrawError, Renderer, RendererOptions, Size, Target, Upscaled, Upscaler};
use metachron_world::OutputFile;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Times of one picture.
#[derive(Debug, Clone, Copy, Default)]
pub struct DrawnTimes {
    /// Gathering states and choosing levels.
    pub compose: Duration,
    /// Drawing, until the device was done.
    pub draw: Duration,
    /// The part of it that the device measured itself.
    pub gpu: Option<Duration>,
    /// Whether the size that it is shown with differs from the one before.
    pub resized: bool,
}

/// The picture's texture.
struct Canvas {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    /// Pixels that are drawn, and pixels that they are shown with.
    drawn: Size,
    shown: Size,
    picture: Upscaled,
}

/// The window's device as a [`Screen`].
pub struct GpuScreen {
    gpu: Gpu,
    target_format: wgpu::TextureFormat,
    adapter: String,
    renderer: Renderer,
    upscaler: Upscaler,
    canvas: Option<Canvas>,
    times: Option<DrawnTimes>,
    failure: Option<DrawError>,
    due: bool,
    pictures: u64,
    lose_after: Option<u64>,
}

impl GpuScreen {
    /// A screen on the device that eframe opened; `lose_after` destroys the device after that many pictures.
    ///
    /// # Errors
    /// [`DrawError::Refused`] where the device lacks a feature that the shaders need.
    pub fn new(state: &RenderState, lose_after: Option<u64>) -> Result<Self, DrawError> {
        let info = state.adapter.get_info();
        let options = RendererOptions::for_adapter(&info);
        let gpu = Gpu { info, device: state.device.clone(), queue: state.queue.clone() };
        let renderer = Renderer::new(&gpu.device, &gpu.queue, FORMAT, options)?;
        Ok(Self {
            target_format: state.target_format,
            adapter: gpu.describe(),
            renderer,
            upscaler: Upscaler::new(&gpu.device, state.target_format, options.lean),
            canvas: None,
            times: None,
            failure: None,
            due: true,
            pictures: 0,
            lose_after,
            gpu,
        })
    }

    /// Whether the device was lost: nothing can be drawn until it is replaced.
    pub fn lost(&self) -> &DeviceLoss {
        self.renderer.lost()
    }

    /// Whether a software rasteriser draws and presents the picture.
    pub fn is_software(&self) -> bool {
        self.gpu.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Sets whether the next call of [`Screen::draw`] makes a new picture.
    pub fn set_due(&mut self, due: bool) {
        self.due = due;
    }

    /// The times of the newest picture; returned once.
    pub fn take_times(&mut self) -> Option<DrawnTimes> {
        self.times.take()
    }

    /// The error of the newest picture; returned once.
    pub fn take_failure(&mut self) -> Option<DrawError> {
        self.failure.take()
    }

    /// Writes the newest picture, without panels, into `folder`; returns the file's path.
    ///
    /// # Errors
    /// A sentence for the user with the file and the cause.
    pub fn save(&self, folder: &Path, scene: &str) -> Result<PathBuf, String> {
        let Some(canvas) = &self.canvas else { return Err("No picture has been drawn yet.".to_owned()) };
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let path = folder.join(format!("metachron-{}-{}.png", file_name(scene), now.as_millis()));
        let image = offscreen::read_back_shown(&self.gpu, &canvas.texture, canvas.shown, self.lost());
        let png = image.and_then(|image| offscreen::png(&image)).map_err(|error| error.to_string())?;
        let failed = |error| format!("{} cannot be written: {error}", path.display());
        OutputFile::write(&path, png).map_err(failed).map(|()| path)
    }

    fn render(&mut self, simulation: &mut dyn Simulation, view: &ViewRequest) -> Result<DrawnTimes, DrawError> {
        let start = Instant::now();
        let picture = simulation.compose(view);
        let composed = Instant::now();
        let max = self.gpu.device.limits().max_texture_dimension_2d;
        let shown = Size { width: view.size.width.clamp(1, max), height: view.size.height.clamp(1, max) };
        let size = shown.scaled(picture.scale);
        let resized = self.resize(size, shown);
        let Some(canvas) = &self.canvas else { return Ok(DrawnTimes::default()) };
        let times = self.renderer.render(picture, &view.camera, Target { view: &canvas.view, size, shown })?;
        simulation.while_drawn(view);
        // a failure here means a lost device, which is noticed before the next frame
        let _ = offscreen::wait(&self.gpu.device, self.renderer.lost());
        let gpu = self.renderer.gpu_time().or(times.gpu);
        Ok(DrawnTimes { compose: composed - start, draw: composed.elapsed(), gpu, resized })
    }

    /// Makes the texture of `drawn` pixels if there is none yet. Returns whether it is shown with others than the one before.
    fn resize(&mut self, drawn: Size, shown: Size) -> bool {
        let before = self.canvas.as_ref().map(|canvas| (canvas.drawn, canvas.shown));
        if before == Some((drawn, shown)) {
            return false;
        }
        let Size { width, height } = drawn;
        let device = &self.gpu.device;
        // most targets of egui store sRGB-encoded bytes unchanged; a target that encodes needs linear input, hence the decoding view
        let encodes = self.target_format.is_srgb();
        let decoded = [FORMAT.add_srgb_suffix()];
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: if encodes { &decoded } else { &[] },
        });
        let decoding = texture.create_view(&wgpu::TextureViewDescriptor {
            format: Some(if encodes { decoded[0] } else { FORMAT }),
            ..wgpu::TextureViewDescriptor::default()
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let picture = self.upscaler.show(device, &decoding, drawn, shown);
        self.canvas = Some(Canvas { texture, view, drawn, shown, picture });
        before.is_none_or(|(_, before)| before != shown)
    }
}

/// The renderer's shaders encode colours to sRGB themselves: an sRGB format costs a software rasteriser 6 ms more per picture.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// A scene's name reduced to characters that are safe in a file name.
fn file_name(scene: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    scene.chars().take(60).map(plain).collect()
}

impl Screen for GpuScreen {
    fn draw(&mut self, simulation: &mut dyn Simulation, view: &ViewRequest, over: Rect) -> Option<Shape> {
        if self.lost().reason().is_some() {
            return None;
        }
        if self.due || self.canvas.is_none() {
            match self.render(simulation, view) {
                Ok(times) => self.times = Some(times),
                Err(error) => self.failure = Some(error),
            }
            self.due = false;
            self.pictures += 1;
            if self.lose_after == Some(self.pictures) {
                self.gpu.device.destroy();
                let _ = self.gpu.device.poll(wgpu::PollType::Poll);
            }
        }
        self.canvas.as_ref().map(|canvas| blit::shape(&canvas.picture, over))
    }

    fn adapter(&self) -> &str {
        &self.adapter
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_with_any_name_gives_a_file_name_without_folders() {
        assert_eq!(file_name("tube-2"), "tube-2");
        assert_eq!(file_name("../a b/ü.toml"), "___a_b___toml");
    }
}
