//! How a picture gets onto the screen or into a file.
//!
//! In: a picture as flat arrays, an adapter. Out: pixels, depths, and what they took. Never here: what is in the picture.

pub mod benchmark;
pub mod depth_image;
pub mod draw;
pub mod flip;
mod full_screen;
pub mod image_metrics;
pub mod offscreen;
pub mod upscale;
