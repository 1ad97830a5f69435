//! Shows the picture's texture under the panels inside egui's own render pass.
//!
//! In: a texture as the renderer shows it. Out: a shape for egui. Never here: drawing the picture.
//! egui's shader can draw the texture too, but costs about 100 ns per pixel on a software rasteriser (which runs every branch of its
//! filtering); a plain load of one texel costs a twentieth of that, a filtered one little more.

use egui_wgpu::wgpu;
use metachron_render::Upscaled;

/// The shape that shows it in `rect`.
pub fn shape(picture: &Upscaled, rect: egui::Rect) -> egui::Shape {
    egui_wgpu::Callback::new_paint_callback(rect, PaintCallback(picture.clone())).into()
}

struct PaintCallback(Upscaled);

impl egui_wgpu::CallbackTrait for PaintCallback {
    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        _resources: &egui_wgpu::CallbackResources,
    ) {
        self.0.draw(pass);
    }
}
