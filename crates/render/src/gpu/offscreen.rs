//! Pictures without a window: choosing an adapter, drawing into a texture, reading it back, writing a file.
//!
//! In: the environment (`WGPU_BACKEND`, `WGPU_ADAPTER_NAME`, as usual in wgpu), a picture. Out: pixels, PNG files. Never here: windows, the
//! content of the picture.

use super::depth_image::DepthImage;
use super::draw::{DrawError, DrawTimes, Renderer, RendererOptions, Target};
use super::upscale::{Upscaled, Upscaler};
use crate::composition::picture::{Colouring, Picture, Style};
use crate::seen::view::{Camera, Size};
use image::RgbaImage;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// Whether and why a device was lost.
#[derive(Debug, Clone, Default)]
pub struct DeviceLoss(Arc<OnceLock<String>>);

impl DeviceLoss {
    /// Watches a device from now on; replaces the watcher set before.
    #[must_use]
    pub fn watch(device: &wgpu::Device) -> Self {
        let lost = Self::default();
        let cell = Arc::clone(&lost.0);
        device.set_device_lost_callback(move |reason, message| {
            // only the first loss counts
            let _ = cell.set(if message.is_empty() { format!("{reason:?}") } else { message });
        });
        lost
    }

    /// The driver's message when the device was lost; `None` while it works.
    #[must_use]
    pub fn reason(&self) -> Option<String> {
        self.0.get().cloned()
    }
}

/// Reasons for having no GPU to draw with, or no picture from it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No adapter of any backend. Runs without pictures are not affected.
    #[error(
        "no graphics adapter was found. Mesa's software driver is enough: on Debian or Ubuntu \
         `apt-get install mesa-vulkan-drivers`, on Fedora `dnf install mesa-vulkan-drivers` ({detail})"
    )]
    NoAdapter {
        /// The message of wgpu, shortened.
        detail: String,
    },
    /// An adapter was found but could not be opened.
    #[error("the graphics adapter {adapter} could not be opened: {detail}")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// The message of wgpu.
        detail: String,
    },
    /// Drawing failed.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// The pixels could not be read back. Drawing again may succeed.
    #[error("the picture could not be read back: {detail}")]
    ReadBack {
        /// The message of wgpu.
        detail: String,
    },
    /// The picture could not be made a file.
    #[error("the picture could not be made a PNG file")]
    Encode(#[from] image::ImageError),
}

/// An adapter and its device.
#[derive(Debug, Clone)]
pub struct Gpu {
    /// The adapter's description.
    pub info: wgpu::AdapterInfo,
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
}

impl Gpu {
    /// Opens an adapter without a window: Vulkan (or the system's native API), else OpenGL. `WGPU_BACKEND` and `WGPU_ADAPTER_NAME` override
    /// this.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] states what to install; [`GpuError::NoDevice`] names the adapter that could not be opened.
    pub fn headless() -> Result<Self, GpuError> {
        let choices = match wgpu::Backends::from_env() {
            Some(chosen) => vec![chosen],
            None => vec![wgpu::Backends::PRIMARY, wgpu::Backends::GL],
        };
        let mut detail = String::new();
        for backends in choices {
            match Self::open(backends) {
                Err(GpuError::NoAdapter { detail: more }) => {
                    detail = if detail.is_empty() { more } else { format!("{detail}; {more}") };
                }
                opened => return opened,
            }
        }
        Err(GpuError::NoAdapter { detail })
    }

    fn open(backends: wgpu::Backends) -> Result<Self, GpuError> {
        let descriptor =
            wgpu::InstanceDescriptor { backends, ..wgpu::InstanceDescriptor::new_without_display_handle() }.with_env();
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor { backends, ..descriptor });
        let adapter = pollster::block_on(choose(&instance))?;
        let info = adapter.get_info();
        let descriptor = device_descriptor(&adapter);
        let opened = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) =
            opened.map_err(|error| GpuError::NoDevice { adapter: info.name.clone(), detail: error.to_string() })?;
        Ok(Self { info, device, queue })
    }

    /// Whether it is a software rasteriser (CPU).
    #[must_use]
    pub fn is_processor(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// The adapter in one line: name, backend and, where it says one, driver.
    #[must_use]
    pub fn describe(&self) -> String {
        let wgpu::AdapterInfo { name, backend, driver, .. } = &self.info;
        if driver.is_empty() { format!("{name} ({backend})") } else { format!("{name} ({backend}, {driver})") }
    }
}

/// Requirements on an adapter, with or without a window: its own texture sizes, and time stamps where supported.
pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
    wgpu::DeviceDescriptor {
        label: Some("metachron"),
        required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
        required_limits: wgpu::Limits::downlevel_defaults().using_resolution(adapter.limits()),
        ..Default::default()
    }
}

async fn choose(instance: &wgpu::Instance) -> Result<wgpu::Adapter, GpuError> {
    if let Ok(wanted) = std::env::var("WGPU_ADAPTER_NAME") {
        return adapter_named(instance, &wanted).await;
    }
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::from_env().unwrap_or(wgpu::PowerPreference::HighPerformance),
        ..Default::default()
    };
    let found = instance.request_adapter(&options).await;
    found.map_err(|error| GpuError::NoAdapter { detail: shortened(&error.to_string()) })
}

/// The first adapter that has `wanted` in its name, in letters of any case. The function of wgpu for this panics where there is none.
async fn adapter_named(instance: &wgpu::Instance, wanted: &str) -> Result<wgpu::Adapter, GpuError> {
    let adapters = instance.enumerate_adapters(wgpu::Backends::all()).await;
    let names: Vec<String> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
    let at = names.iter().position(|name| name.to_lowercase().contains(&wanted.to_lowercase()));
    at.and_then(|at| adapters.into_iter().nth(at)).ok_or_else(|| GpuError::NoAdapter {
        detail: format!("WGPU_ADAPTER_NAME is {wanted:?}; the adapters are [{}]", names.join(", ")),
    })
}

/// The first line of a library's message, shortened to 160 characters.
fn shortened(words: &str) -> String {
    const MOST: usize = 160;
    let line = words.lines().next().unwrap_or_default();
    match line.char_indices().nth(MOST) {
        Some((end, _)) => format!("{} …", line[..end].trim_end()),
        None => line.to_owned(),
    }
}

/// A picture in memory.
pub type PictureFile = RgbaImage;

/// Draws pictures into its own texture.
#[derive(Debug)]
pub struct Offscreen {
    gpu: Gpu,
    renderer: Renderer,
    size: Size,
    texture: Option<(wgpu::Texture, wgpu::TextureView)>,
    upscaler: Upscaler,
    /// The texture of pictures of fewer pixels.
    reduced: Option<Reduced>,
    /// The target that draws depths, once they were asked for: depths of several samples a pixel cannot be read.
    depth_target: Option<Box<Self>>,
}

/// A texture of fewer pixels than the target's.
#[derive(Debug)]
struct Reduced {
    size: Size,
    view: wgpu::TextureView,
    shown: Upscaled,
}

/// Format of the textures that are read back: the shaders apply the sRGB curve themselves, which costs a software rasteriser less than an
/// sRGB format.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

impl Offscreen {
    /// A target of `size` on `gpu`; one without pixels draws nothing.
    ///
    /// # Errors
    /// [`GpuError::Draw`] where the device lacks a feature or the size is beyond its limit.
    pub fn new(gpu: Gpu, size: Size, options: RendererOptions) -> Result<Self, GpuError> {
        let renderer = Renderer::new(&gpu.device, &gpu.queue, FORMAT, options)?;
        let upscaler = Upscaler::new(&gpu.device, FORMAT, options.lean);
        Self::with(gpu, renderer, upscaler, size)
    }

    /// The same with another size; the renderer and its caches are kept.
    ///
    /// # Errors
    /// [`GpuError::Draw`] where the size is beyond the device's limit.
    pub fn resized(self, size: Size) -> Result<Self, GpuError> {
        Self::with(self.gpu, self.renderer, self.upscaler, size)
    }

    fn with(gpu: Gpu, renderer: Renderer, upscaler: Upscaler, size: Size) -> Result<Self, GpuError> {
        let max = gpu.device.limits().max_texture_dimension_2d;
        if size.width > max || size.height > max {
            return Err(DrawError::TooLarge { width: size.width, height: size.height, max }.into());
        }
        let texture = (!size.is_empty()).then(|| {
            let texture = texture(&gpu, size, wgpu::TextureUsages::COPY_SRC);
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            (texture, view)
        });
        Ok(Self { gpu, renderer, size, texture, upscaler, reduced: None, depth_target: None })
    }

    /// The device that draws.
    #[must_use]
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The renderer that draws.
    #[must_use]
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// The target's size.
    #[must_use]
    pub fn size(&self) -> Size {
        self.size
    }

    /// Draws and waits for completion, so that a clock around this call measures the frame's whole work.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render(&mut self, picture: &Picture, camera: &Camera) -> Result<DrawTimes, GpuError> {
        let times = self.submit(picture, camera)?;
        Ok(DrawTimes { gpu: self.wait()?, ..times })
    }

    /// Starts drawing: [`Offscreen::wait`] waits for completion, and this thread is free until then.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn submit(&mut self, picture: &Picture, camera: &Camera) -> Result<DrawTimes, GpuError> {
        let Some((_, view)) = &self.texture else { return Ok(DrawTimes::default()) };
        let (size, shown) = (self.size.scaled(picture.scale), self.size);
        if size == shown {
            return Ok(self.renderer.render(picture, camera, Target { view, size, shown })?);
        }
        let reduced = match self.reduced.take().filter(|there| there.size == size) {
            Some(there) => there,
            None => Reduced::new(&self.gpu, &self.upscaler, size, shown),
        };
        let times = self.renderer.render(picture, camera, Target { view: &reduced.view, size, shown })?;
        enlarge(&self.gpu, &reduced.shown, view);
        self.reduced = Some(reduced);
        Ok(times)
    }

    /// Waits until all submitted work is drawn; returns the GPU time, where the adapter reports one.
    ///
    /// # Errors
    /// [`GpuError::Draw`] where the device was lost.
    pub fn wait(&mut self) -> Result<Option<Duration>, GpuError> {
        wait(&self.gpu.device, self.renderer.lost())?;
        Ok(self.renderer.gpu_time())
    }

    /// The pixels of the last picture, sRGB.
    ///
    /// # Errors
    /// [`GpuError::ReadBack`] where the device could not read them.
    pub fn read_back(&self) -> Result<PictureFile, GpuError> {
        match &self.texture {
            None => Ok(RgbaImage::new(0, 0)),
            Some((texture, _)) => read_back(&self.gpu, texture, self.renderer.lost()),
        }
    }

    /// The depths of `picture` as `camera` sees it, at the target's full size. It draws the picture once more.
    ///
    /// # Errors
    /// As [`Renderer::render`], and [`GpuError::ReadBack`].
    pub fn depths(&mut self, picture: &Picture, camera: &Camera) -> Result<DepthImage, GpuError> {
        let mut screen = match self.depth_target.take() {
            Some(screen) => screen,
            None => {
                let options = RendererOptions { samples: 1, ..self.renderer.options() };
                Box::new(Self::new(self.gpu.clone(), self.size, options)?)
            }
        };
        let style = Style { colouring: Colouring::Depth, wireframe: false, forces: false };
        screen.render(&Picture { style, scale: 1.0, ..picture.clone() }, camera)?;
        let depths_m = screen.renderer.read_depths(&self.gpu, camera, screen.renderer.lost())?;
        self.depth_target = Some(screen);
        Ok(DepthImage { size: self.size, depths_m })
    }

    /// The last picture as a PNG file.
    ///
    /// # Errors
    /// [`GpuError::ReadBack`] or [`GpuError::Encode`].
    pub fn png(&self) -> Result<Vec<u8>, GpuError> {
        png(&self.read_back()?)
    }
}

impl Reduced {
    fn new(gpu: &Gpu, upscaler: &Upscaler, size: Size, shown: Size) -> Self {
        let texture = texture(gpu, size, wgpu::TextureUsages::TEXTURE_BINDING);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self { size, shown: upscaler.show(&gpu.device, &view, size, shown), view }
    }
}

/// A texture to draw into, with one more use.
fn texture(gpu: &Gpu, size: Size, used_as: wgpu::TextureUsages) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("offscreen"),
        size: wgpu::Extent3d { width: size.width, height: size.height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | used_as,
        view_formats: &[],
    })
}

/// Fills `target` with a picture of fewer pixels.
fn enlarge(gpu: &Gpu, picture: &Upscaled, target: &wgpu::TextureView) {
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("enlarge") });
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store };
    let attachment = wgpu::RenderPassColorAttachment { view: target, depth_slice: None, resolve_target: None, ops };
    picture.draw(&mut encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("enlarge"),
        color_attachments: &[Some(attachment)],
        ..Default::default()
    }));
    gpu.queue.submit([encoder.finish()]);
}

/// Waits until all submitted work is done.
pub fn wait(device: &wgpu::Device, lost: &DeviceLoss) -> Result<(), GpuError> {
    let polled = device.poll(wgpu::PollType::wait_indefinitely());
    if let Some(reason) = lost.reason() {
        return Err(DrawError::DeviceLost { reason }.into());
    }
    polled.map(|_| ()).map_err(|error| GpuError::ReadBack { detail: error.to_string() })
}

/// The pixels of a texture with four bytes per pixel, after all submitted work.
pub fn read_back(gpu: &Gpu, texture: &wgpu::Texture, lost: &DeviceLoss) -> Result<PictureFile, GpuError> {
    let image = RgbaImage::from_raw(texture.width(), texture.height(), read_bytes(gpu, texture, lost)?);
    image.ok_or_else(|| GpuError::ReadBack { detail: "the buffer is shorter than the picture".into() })
}

/// The same as bytes, row by row.
pub(crate) fn read_bytes(gpu: &Gpu, texture: &wgpu::Texture, lost: &DeviceLoss) -> Result<Vec<u8>, GpuError> {
    let (width, height) = (texture.width(), texture.height());
    let pitch = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: u64::from(pitch) * u64::from(height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch), rows_per_image: None };
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
        wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
    );
    gpu.queue.submit([encoder.finish()]);
    let failed = Arc::new(OnceLock::new());
    let cell = Arc::clone(&failed);
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        let _ = cell.set(result.err().map(|error| error.to_string()));
    });
    wait(&gpu.device, lost)?;
    if let Some(Some(detail)) = failed.get() {
        return Err(GpuError::ReadBack { detail: detail.clone() });
    }
    let bytes = buffer.get_mapped_range(..).map_err(|error| GpuError::ReadBack { detail: error.to_string() })?;
    let rows = bytes.chunks_exact(pitch as usize).flat_map(|row| &row[..4 * width as usize]);
    Ok(rows.copied().collect())
}

/// The pixels of a texture that can be bound, enlarged to `shown` if it is smaller.
///
/// # Errors
/// As [`read_back`].
pub fn read_back_shown(
    gpu: &Gpu,
    drawn: &wgpu::Texture,
    shown: Size,
    lost: &DeviceLoss,
) -> Result<PictureFile, GpuError> {
    let size = Size { width: drawn.width(), height: drawn.height() };
    if size == shown {
        return read_back(gpu, drawn, lost);
    }
    let enlarged = texture(gpu, shown, wgpu::TextureUsages::COPY_SRC);
    let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
    let upscaler = Upscaler::new(&gpu.device, FORMAT, false);
    enlarge(gpu, &upscaler.show(&gpu.device, &view(drawn), size, shown), &view(&enlarged));
    read_back(gpu, &enlarged, lost)
}

/// A picture as a PNG file.
///
/// # Errors
/// [`GpuError::Encode`].
pub fn png(image: &PictureFile) -> Result<Vec<u8>, GpuError> {
    let mut file = std::io::Cursor::new(Vec::new());
    image.write_to(&mut file, image::ImageFormat::Png)?;
    Ok(file.into_inner())
}
