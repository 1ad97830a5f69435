//! What a picture is drawn to, and how well.
//!
//! In: an adapter, a texture. Out: the options and the target of a renderer. Never here: drawing.

use crate::seen::view::Size;

/// Quality settings of a renderer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RendererOptions {
    /// Samples per pixel: 1 or 4. Four smooth every edge and cost about twice the pixels' time.
    pub samples: u32,
    /// Width and height of the shadow map, 64 … 8192.
    pub shadow_px: u32,
    /// Filtered shadow-map comparisons per pixel: 1 or 4. Four soften shadow edges and cost a software rasteriser a fifth more.
    pub shadow_taps: u32,
    /// Whether light is computed per vertex wherever that hardly shows: on fixed boxes and the floor all but the shadow, on tubes all that
    /// does not depend on the folds of the skin. A software rasteriser then needs half the time.
    pub lean: bool,
}

impl RendererOptions {
    /// For still pictures, which need not be drawn in real time.
    pub const STILL: Self = Self { samples: 4, shadow_px: 2048, shadow_taps: 4, lean: false };

    /// Real-time settings for an adapter: a software rasteriser gets one sample per pixel, a smaller shadow map and lean light.
    #[must_use]
    pub fn for_adapter(info: &wgpu::AdapterInfo) -> Self {
        match info.device_type {
            wgpu::DeviceType::Cpu => Self { samples: 1, shadow_px: 512, shadow_taps: 1, lean: true },
            _ => Self::STILL,
        }
    }
}

/// The target of a picture.
#[derive(Debug, Clone, Copy)]
pub struct Target<'a> {
    /// A view of a texture in the renderer's format.
    pub view: &'a wgpu::TextureView,
    /// The texture's size: pixels that are drawn.
    pub size: Size,
    /// The size that it is shown with: its proportions are the picture's, a smaller texture's are rounded.
    pub shown: Size,
}
