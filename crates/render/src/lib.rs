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
#[cfg(feature = "gpu")]
mod benchmark;
mod bounds_tree;
mod compose;
#[cfg(feature = "gpu")]
mod depth_image;
#[cfg(feature = "gpu")]
mod draw;
mod environment;
mod forces;
#[cfg(feature = "gpu")]
mod full_screen;
#[cfg(feature = "gpu")]
mod image_metrics;
mod impostor_fit;
mod instances;
mod level;
mod light_volume;
mod lod_transition;
mod membership;
#[cfg(feature = "gpu")]
pub mod offscreen;
mod pick;
mod picture;
mod portals;
mod pose;
mod scene_view;
mod skin;
mod tessellation;
mod texturing;
#[cfg(feature = "gpu")]
mod upscale;
mod view;
mod visibility;

#[cfg(feature = "gpu")]
pub use benchmark::{Drawn, benchmark, benchmark_left};
pub use compose::Hand;
#[cfg(feature = "gpu")]
pub use depth_image::DepthImage;
#[cfg(feature = "gpu")]
pub use draw::{DrawError, DrawTimes, Renderer, RendererOptions, Target};
pub use environment::{Environment, EnvironmentLight};
pub use forces::ToolForce;
#[cfg(feature = "gpu")]
pub use image_metrics::{psnr_db, ssim};
pub use level::{Level, Shading};
pub use membership::History;
#[cfg(feature = "gpu")]
pub use offscreen::{DeviceLoss, Gpu, GpuError, Offscreen, PictureFile};
pub use pick::Hit;
pub use picture::{Colouring, FloorDraw, MeshCorner, MeshKey, Picture, SkinSample, SolidInstance, SolidKind, Style};
pub use scene_view::{Actor, Appearance, Form, Material, SceneView, SkinForm, States, StaticObject};
pub use skin::{SkinRun, Skins};
pub use tessellation::skin_divisions;
#[cfg(feature = "gpu")]
pub use upscale::{Upscaled, Upscaler};
pub use view::{Camera, Frustum, Ray, Size};
pub use visibility::{Visibility, VisibleCounts};
