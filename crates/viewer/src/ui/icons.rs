//! Buttons with vector icons: sharp at every scale, named for screen readers and tests.
//!
//! In: an [`Icon`] and its name. Out: a button's response. Never here: the effect of a press.

use super::theme::palette;
use egui::{Color32, Pos2, Rect, Response, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2};

/// A vector icon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Icon {
    /// A triangle.
    Run,
    /// Two bars.
    Pause,
    /// A triangle against a bar.
    Step,
    /// A bar before a triangle to the left.
    Back,
    /// A turning arrow.
    Reset,
    /// A camera.
    Screenshot,
    /// A question mark in a ring.
    Help,
    /// A minus sign.
    Minus,
    /// A plus sign.
    Plus,
    /// A window with a side panel.
    Panels,
}

const SIDE: f32 = 28.0;

/// A square button with an icon; `name` is the text for screen readers, `hover` the tooltip.
pub fn icon_button(ui: &mut Ui, icon: Icon, name: &str, hover: &str) -> Response {
    let (rect, response) = ui.allocate_exact_size(vec2(SIDE, SIDE), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, name));
    if ui.is_rect_visible(rect) {
        let palette = palette(ui);
        let style = ui.style().interact(&response);
        if response.hovered() || response.has_focus() {
            ui.painter().rect_filled(rect, 5.0, style.weak_bg_fill);
        }
        let color = if response.hovered() { palette.text } else { palette.text.gamma_multiply(0.85) };
        let shapes = shapes(icon, Rect::from_center_size(rect.center(), vec2(13.0, 13.0)), color);
        ui.painter().extend(shapes);
    }
    response.on_hover_text(hover)
}

fn shapes(icon: Icon, r: Rect, color: Color32) -> Vec<Shape> {
    let stroke = Stroke::new(1.6, color);
    let (c, w) = (r.center(), r.width());
    match icon {
        Icon::Run => vec![triangle(r, color)],
        Icon::Pause => [-0.24, 0.24]
            .map(|x| Shape::rect_filled(Rect::from_center_size(c + vec2(x * w, 0.0), vec2(3.6, w)), 1.0, color))
            .to_vec(),
        Icon::Step => {
            let bar = Rect::from_center_size(pos2(r.right() - 1.0, c.y), vec2(2.6, w));
            vec![triangle(r.with_max_x(r.right() - 3.5), color), Shape::rect_filled(bar, 1.0, color)]
        }
        Icon::Back => {
            let bar = Rect::from_center_size(pos2(r.left() + 1.0, c.y), vec2(2.6, w));
            let right = r.right() - 1.0;
            let points = vec![pos2(right, r.top()), pos2(r.left() + 3.5, c.y), pos2(right, r.bottom())];
            vec![Shape::convex_polygon(points, color, Stroke::NONE), Shape::rect_filled(bar, 1.0, color)]
        }
        Icon::Reset => turning_arrow(c, 0.45 * w, stroke),
        Icon::Screenshot => {
            let body = Rect::from_min_max(pos2(r.left() - 1.0, r.top() + 2.5), pos2(r.right() + 1.0, r.bottom()));
            let bump = Rect::from_center_size(pos2(c.x, r.top() + 1.5), vec2(5.5, 3.0));
            vec![
                Shape::rect_stroke(body, 2.0, stroke, egui::StrokeKind::Inside),
                Shape::rect_filled(bump, 1.0, color),
                Shape::circle_stroke(body.center(), 2.8, stroke),
            ]
        }
        Icon::Help => vec![Shape::circle_stroke(c, 0.56 * w, stroke), hook(c, stroke), dot(c + vec2(0.0, 4.0), color)],
        Icon::Minus => vec![bar(c, vec2(4.5, 0.0), stroke)],
        Icon::Plus => vec![bar(c, vec2(4.5, 0.0), stroke), bar(c, vec2(0.0, 4.5), stroke)],
        Icon::Panels => {
            let x = r.right() - 4.5;
            vec![
                Shape::rect_stroke(r.expand2(vec2(1.0, -0.5)), 2.0, stroke, egui::StrokeKind::Inside),
                Shape::line_segment([pos2(x, r.top() + 1.0), pos2(x, r.bottom() - 1.0)], stroke),
            ]
        }
    }
}

fn triangle(r: Rect, color: Color32) -> Shape {
    let left = r.left() + 1.0;
    let points = vec![pos2(left, r.top()), pos2(r.right(), r.center().y), pos2(left, r.bottom())];
    Shape::convex_polygon(points, color, Stroke::NONE)
}

fn bar(c: Pos2, half: egui::Vec2, stroke: Stroke) -> Shape {
    Shape::line_segment([c - half, c + half], stroke)
}

fn dot(at: Pos2, color: Color32) -> Shape {
    Shape::circle_filled(at, 1.0, color)
}

fn hook(c: Pos2, stroke: Stroke) -> Shape {
    let arc = (0..=10).map(|i| {
        let angle = std::f32::consts::PI * (1.0 + 1.35 * i as f32 / 10.0);
        c + vec2(0.0, -1.4) + 2.3 * vec2(angle.cos(), angle.sin())
    });
    let points = arc.chain([c + vec2(0.0, 1.9)]).collect();
    Shape::line(points, Stroke::new(1.3, stroke.color))
}

fn turning_arrow(c: Pos2, radius: f32, stroke: Stroke) -> Vec<Shape> {
    const STEPS: i32 = 24;
    let at = |i: i32| {
        let angle = -0.35 * std::f32::consts::PI - 1.62 * std::f32::consts::PI * i as f32 / STEPS as f32;
        c + radius * vec2(angle.cos(), angle.sin())
    };
    let head = at(0);
    let tip = vec![head + vec2(3.9, 0.6), head + vec2(-1.8, -3.2), head + vec2(-1.4, 3.6)];
    vec![Shape::line((0..=STEPS).map(at).collect(), stroke), Shape::convex_polygon(tip, stroke.color, Stroke::NONE)]
}

/// The window's own icon: a bent tube on a dark ground.
#[must_use]
pub fn window_icon() -> egui::IconData {
    const SIDE_PX: u32 = 64;
    let middle = (SIDE_PX / 2) as f32;
    let rgba = (0..SIDE_PX * SIDE_PX).flat_map(|index| {
        let at = vec2((index % SIDE_PX) as f32 + 0.5 - middle, (index / SIDE_PX) as f32 + 0.5 - middle) / middle;
        icon_pixel(at).to_srgba_unmultiplied()
    });
    egui::IconData { rgba: rgba.collect(), width: SIDE_PX, height: SIDE_PX }
}

/// One pixel of the icon at (x, y) in −1 … 1: an S of two half rings, lit from above.
fn icon_pixel(at: egui::Vec2) -> Color32 {
    const RING: f32 = 0.36;
    const TUBE: f32 = 0.2;
    if at.abs().max_elem() > 0.97 {
        return Color32::TRANSPARENT;
    }
    let centre = if at.y < 0.0 { vec2(0.0, -RING) } else { vec2(0.0, RING) };
    let arm = at - centre;
    let on_arc = if at.y < 0.0 { arm.x < 0.0 || arm.y < 0.0 } else { arm.x > 0.0 || arm.y > 0.0 };
    let off = if on_arc { (arm.length() - RING).abs() } else { (arm - vec2(arm.x.signum() * RING, 0.0)).length() };
    if off > TUBE {
        return Color32::from_rgb(27, 31, 38);
    }
    let light = 0.55 + 0.45 * (1.0 - (off / TUBE).powi(2)).sqrt();
    Color32::from_rgb((236.0 * light) as u8, (128.0 * light) as u8, (118.0 * light) as u8)
}
