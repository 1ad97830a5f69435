//! Draws the newest states with wgpu at levels of detail that the caller chooses.
//!
//! In: snapshots, looks, a camera, a level for every actor. Out: the actors in view and their sizes ([`Visibility`]), a [`Picture`] as numbers,
//! and with the feature `gpu` its pixels. Never here: a window, a policy, the runtime.
//!
//! A frame: [`SceneView::set_snapshot`] receives the newest snapshots, [`SceneView::pose`] poses them at the frame's time, [`SceneView::survey`]
//! finds which actors are visible and how large, [`SceneView::compose`] makes the [`Picture`] at the requested levels,
//! `Renderer::render` draws it. [`SceneView`] needs no GPU; `Offscreen` needs no window.
//!
//! ```
//! use glam::DVec3;
//! use metachron_render::{Camera, Size};
//!
//! let size = Size { width: 640, height: 480 };
//! let camera = Camera::looking(DVec3::new(0.0, -5.0, 0.0), DVec3::ZERO, 0.7);
//! let frustum = camera.frustum(size);
//! assert!(frustum.sees(DVec3::ZERO, 0.1));
//! assert!(!frustum.sees(DVec3::new(0.0, -9.0, 0.0), 0.1)); // behind the eye
//! // half the height is 240 pixels, and tan(0.35) of the depth
//! let expected = 240.0 / (5.0 * 0.35_f64.tan());
//! assert!((camera.pixels_per_metre(5.0, size) - expected).abs() < 1e-6);
//! ```
mod composition;
#[cfg(feature = "gpu")]
mod gpu;
mod seen;
mod states;

pub use composition::compose::Hand;
pub use composition::environment::{Environment, EnvironmentLight};
pub use composition::forces::ToolForce;
pub use composition::mesh_corner::MeshCorner;
pub use composition::picture::{Colouring, FloorDraw, MeshKey, Picture, SkinSample, SolidInstance, SolidKind, Style};
pub use composition::skin::{SkinForm, SkinRun, Skins};
pub use composition::tessellation::skin_divisions;
#[cfg(feature = "gpu")]
pub use gpu::benchmark::{Drawn, benchmark, benchmark_left};
#[cfg(feature = "gpu")]
pub use gpu::depth_image::DepthImage;
#[cfg(feature = "gpu")]
pub use gpu::draw::{DrawError, DrawTimes, Renderer, RendererOptions, Target};
#[cfg(feature = "gpu")]
pub use gpu::flip::flip;
#[cfg(feature = "gpu")]
pub use gpu::image_metrics::{psnr_db, ssim};
#[cfg(feature = "gpu")]
pub use gpu::offscreen;
#[cfg(feature = "gpu")]
pub use gpu::offscreen::{DeviceLoss, Gpu, GpuError, Offscreen, PictureFile};
#[cfg(feature = "gpu")]
pub use gpu::upscale::{Upscaled, Upscaler};
pub use seen::level::{Level, Shading};
pub use seen::pick::Hit;
pub use seen::view::{Camera, CameraMotion, Frustum, Ray, Size};
pub use seen::visibility::{Visibility, VisibleCounts};
pub use states::membership::History;
pub use states::scene_view::{Actor, Appearance, Form, Material, SceneView, States, StaticObject};
