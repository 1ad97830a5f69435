//! Draws the newest states (wgpu) and the panels around them (egui). Reads snapshots, never the runtime.
//!
//! A frame: [`Stage::see`] receives the newest snapshots, [`Stage::pose`] poses them at the frame's time, [`Stage::survey`] finds which
//! actors are visible and how large, [`Stage::compose`] makes the [`Picture`] at the requested levels, [`Renderer::render`] draws it.
//! [`Stage`] needs no GPU; [`Offscreen`] needs no window.

mod benchmark;
mod column;
mod compose;
mod draw;
mod gather;
mod glide;
mod level;
mod likeness;
mod offscreen;
mod painting;
mod pick;
mod picture;
mod pose;
mod skin;
mod solids;
mod survey;
mod view;
pub mod viewer;

pub use benchmark::{Drawn, benchmark, benchmark_left};
pub use compose::Hand;
pub use draw::{DrawError, DrawTimes, Renderer, RendererOptions, Target};
pub use gather::{Actor, Form, Look, Material, Prop, Stage, States};
pub use level::{Level, Shading};
pub use likeness::{psnr_db, ssim};
pub use offscreen::{Gpu, GpuError, Lost, Offscreen, PictureFile};
pub use pick::Hit;
pub use picture::{Colouring, FloorDraw, MeshCorner, MeshKey, Picture, SkinSample, SolidInstance, SolidKind, Style};
pub use skin::{ROPE_LEVEL, SkinRun, Skins};
pub use survey::Seen;
pub use view::{Camera, Frustum, Ray, Size};
