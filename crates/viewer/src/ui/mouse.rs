//! Mouse and flight in the picture: orbit, pan, zoom, fly, select, and the user spring that pulls an object.
//!
//! In: egui's response over the picture. Out: a moved camera and [`Action`]s. Never here: forces (the spring is part of the object's own
//! solver) and drawing, except the spring's end and the name under the pointer.

use super::protocol::{Action, Bounds, Simulation};
use super::text;
use super::theme::{Palette, palette};
use egui::{Align2, CursorIcon, FontId, Key, PointerButton, Pos2, Rect, Response, Stroke, Ui, vec2};
use glam::{DVec2, DVec3};
use metachron_render::{Camera, Hit, Ray, Size};

/// Flight speed, in distances to the target per second.
const FLY_PER_S: f64 = 0.9;
/// Relative change of the spring end's depth per point of scroll.
const DEPTH_PER_POINT: f64 = 0.0015;

/// Relative zoom per point of the wheel's smooth scroll.
const ZOOM_PER_POINT: f64 = 0.0022;
/// Room left around a framed object, as a factor on its radius.
const FRAME_ROOM: f64 = 1.15;

/// State of the user's mouse control: camera and user spring.
#[derive(Debug, Clone, Default)]
pub struct Hand {
    /// The free camera; `None` while the scene's camera is in use.
    own: Option<Camera>,
    /// Follow the selected object.
    pub track: bool,
    tracked: Option<DVec3>,
    /// The free end of the user spring, in space; `None` while nothing is pulled.
    grip: Option<DVec3>,
}

/// The picture's place in the window and its camera.
#[derive(Debug, Clone, Copy)]
pub struct Window {
    /// Its place, points.
    pub rect: Rect,
    scale: f32,
    /// Its camera.
    pub camera: Camera,
}

/// One frame of input and the actions that it causes.
struct Turn<'a> {
    ui: &'a Ui,
    response: &'a Response,
    simulation: &'a dyn Simulation,
    window: Window,
    actions: Vec<Action>,
}

impl Window {
    fn size(&self) -> Size {
        size_of(self.rect, self.scale)
    }

    fn ray(&self, at: Pos2) -> Ray {
        self.camera.ray(self.pixels(at - self.rect.min), self.size())
    }

    /// Where a point is seen.
    pub fn place(&self, point: DVec3) -> Option<Pos2> {
        let (pixel, _) = self.camera.project(point, self.size())?;
        Some(self.rect.min + vec2(pixel.x as f32, pixel.y as f32) / self.scale)
    }

    fn pixels(&self, points: egui::Vec2) -> DVec2 {
        DVec2::new(f64::from(points.x), f64::from(points.y)) * f64::from(self.scale)
    }
}

/// The size in pixels of a picture in `rect` with its edges rounded to pixels; at least one by one.
#[must_use]
pub fn size_of(rect: Rect, scale: f32) -> Size {
    let pixels = |range: egui::Rangef| ((range.max * scale).round() - (range.min * scale).round()).max(1.0) as u32;
    Size { width: pixels(rect.x_range()), height: pixels(rect.y_range()) }
}

impl Hand {
    /// The camera of the picture.
    #[must_use]
    pub fn camera(&self, simulation: &dyn Simulation) -> Camera {
        self.own.unwrap_or_else(|| simulation.scene_camera())
    }

    /// Whether the scene's own camera is in use.
    #[must_use]
    pub const fn follows_scene(&self) -> bool {
        self.own.is_none()
    }

    /// Switches to the scene's own camera.
    pub fn follow_scene(&mut self) {
        (self.own, self.track) = (None, false);
    }

    /// Keeps the present camera; it follows neither the scene nor an object.
    pub fn free(&mut self, simulation: &dyn Simulation) {
        (self.own, self.track) = (Some(self.camera(simulation)), false);
    }

    /// Frames all of `bounds` in a picture of this size.
    pub fn frame(&mut self, simulation: &dyn Simulation, bounds: &Bounds, size: Size) {
        self.change_camera(simulation, |camera| camera.show(bounds.centre, FRAME_ROOM * bounds.radius_m, size));
    }

    fn change_camera(&mut self, simulation: &dyn Simulation, change: impl FnOnce(&mut Camera)) {
        let mut camera = self.camera(simulation);
        change(&mut camera);
        self.own = Some(camera);
    }

    /// Applies this frame's input over the picture; returns the resulting actions.
    pub fn input(&mut self, ui: &Ui, response: &Response, simulation: &dyn Simulation) -> Vec<Action> {
        self.follow_tracked(simulation);
        let window = self.window(ui, response, simulation);
        let mut turn = Turn { ui, response, simulation, window, actions: Vec::new() };
        self.start(&mut turn);
        if self.grip.is_some() {
            self.pull(&mut turn)
        } else {
            self.move_camera(&turn)
        }
        self.wheel(&mut turn);
        self.fly(&turn);
        self.click(&mut turn);
        turn.actions
    }

    /// The picture as it is shown.
    pub fn window(&self, ui: &Ui, response: &Response, simulation: &dyn Simulation) -> Window {
        Window { rect: response.rect, scale: ui.ctx().pixels_per_point(), camera: self.camera(simulation) }
    }

    fn follow_tracked(&mut self, simulation: &dyn Simulation) {
        let selected = if self.track { simulation.status().selected } else { None };
        let centre = selected.and_then(|id| simulation.bounds(Some(id))).map(|ball| ball.centre);
        if let (Some(before), Some(now)) = (self.tracked, centre) {
            self.change_camera(simulation, |camera| camera.target_m += now - before);
        }
        self.tracked = centre;
    }

    /// A drag that begins on an object attaches the user spring to it.
    fn start(&mut self, turn: &mut Turn<'_>) {
        let orbiting = turn.ui.input(|input| input.modifiers.alt);
        if orbiting || !turn.response.drag_started_by(PointerButton::Primary) {
            return;
        }
        let origin = turn.ui.input(|input| input.pointer.press_origin());
        if let Some(hit) = origin.and_then(|at| turn.simulation.pick(turn.window.ray(at))) {
            self.grip = Some(hit.point_m);
            turn.actions.extend([Action::Select(Some(hit.object)), Action::DragStart(hit)]);
        }
    }

    /// The free end of the spring follows the pointer in the plane that faces the eye.
    fn pull(&mut self, turn: &mut Turn<'_>) {
        let Some(grip) = self.grip else { return };
        if !turn.ui.input(|input| input.pointer.primary_down()) {
            self.grip = None;
            turn.actions.push(Action::DragEnd);
        } else if let Some(at) = turn.response.interact_pointer_pos() {
            let target = on_plane(&turn.window.ray(at), grip, turn.window.camera.forward());
            self.grip = Some(target);
            turn.actions.push(Action::DragMove(target));
        }
    }

    fn move_camera(&mut self, turn: &Turn<'_>) {
        let delta = turn.response.drag_delta();
        if delta == egui::Vec2::ZERO {
            return;
        }
        let (pixels, size) = (turn.window.pixels(delta), turn.window.size());
        let turning = turn.response.dragged_by(PointerButton::Primary);
        self.change_camera(turn.simulation, |camera| {
            if turning { camera.orbit(pixels, size) } else { camera.pan(pixels, size) }
        });
    }

    /// The wheel zooms, or moves the spring's free end in depth while an object is pulled.
    fn wheel(&mut self, turn: &mut Turn<'_>) {
        if !turn.response.contains_pointer() && self.grip.is_none() {
            return;
        }
        let read = |input: &egui::InputState| (f64::from(input.smooth_scroll_delta.y), f64::from(input.zoom_delta()));
        let (scroll, pinch) = turn.ui.input(read);
        if let Some(grip) = self.grip.filter(|_| scroll != 0.0) {
            let eye = turn.window.camera.eye();
            let target = eye + (grip - eye) * (scroll * DEPTH_PER_POINT).exp();
            self.grip = Some(target);
            turn.actions.push(Action::DragMove(target));
        } else if self.grip.is_none() && (scroll != 0.0 || pinch != 1.0) {
            let factor = (-scroll * ZOOM_PER_POINT).exp() / pinch;
            self.change_camera(turn.simulation, |camera| camera.zoom(factor));
        }
    }

    fn fly(&mut self, turn: &Turn<'_>) {
        let (flight, dt) = turn.ui.input(|input| {
            let down = |key| f64::from(u8::from(input.key_down(key)));
            let flight =
                DVec3::new(down(Key::D) - down(Key::A), down(Key::W) - down(Key::S), down(Key::E) - down(Key::Q));
            (if input.pointer.secondary_down() { flight } else { DVec3::ZERO }, f64::from(input.stable_dt))
        });
        if flight != DVec3::ZERO && turn.response.is_pointer_button_down_on() {
            self.change_camera(turn.simulation, |camera| camera.fly(flight * FLY_PER_S * dt * camera.distance_m));
        }
    }

    fn click(&mut self, turn: &mut Turn<'_>) {
        if !turn.response.clicked() {
            return;
        }
        let hit = turn.response.interact_pointer_pos().and_then(|at| turn.simulation.pick(turn.window.ray(at)));
        turn.actions.push(Action::Select(hit.map(|hit| hit.object)));
        if turn.response.double_clicked()
            && let Some(bounds) = hit.and_then(|hit| turn.simulation.bounds(Some(hit.object)))
        {
            self.frame(turn.simulation, &bounds, turn.window.size());
        }
    }

    /// Draws the spring's free end with its force, and the name of the object under the pointer.
    pub fn draw(&self, ui: &Ui, response: &Response, simulation: &dyn Simulation) {
        let window = self.window(ui, response, simulation);
        let palette = palette(ui);
        if let Some(held) = &simulation.status().held {
            if let Some(at) = window.place(held.target) {
                draw_hand(ui, at, held.force_n, &palette);
            }
            ui.set_cursor_icon(CursorIcon::Grabbing);
        } else if let Some(hit) = hovered(ui, response, simulation, &window) {
            ui.set_cursor_icon(CursorIcon::Grab);
            draw_name(ui, &hit, simulation, &palette);
        }
    }
}

fn hovered(ui: &Ui, response: &Response, simulation: &dyn Simulation, window: &Window) -> Option<Hit> {
    if !response.hovered() || ui.input(|input| input.pointer.any_down()) {
        return None;
    }
    simulation.pick(window.ray(response.hover_pos()?))
}

/// The point where `ray` meets the plane through `through` across `normal`; `through` itself where they do not meet.
fn on_plane(ray: &Ray, through: DVec3, normal: DVec3) -> DVec3 {
    let along = ray.direction.dot(normal);
    let distance = (through - ray.origin).dot(normal);
    if along > 1e-6 && distance > 0.0 { ray.origin + ray.direction * (distance / along) } else { through }
}

fn draw_name(ui: &Ui, hit: &Hit, simulation: &dyn Simulation, palette: &Palette) {
    let agents = &simulation.status().agents;
    let Some(row) = agents.iter().find(|row| row.id == hit.object) else { return };
    let Some(at) = ui.input(|input| input.pointer.hover_pos()) else { return };
    label(ui, at + vec2(14.0, 4.0), &row.name, palette);
}

/// A text on a card.
pub fn label(ui: &Ui, at: Pos2, text: &str, palette: &Palette) {
    let galley = ui.painter().layout_no_wrap(text.to_owned(), FontId::proportional(12.0), palette.text);
    let rect = Align2::LEFT_TOP.anchor_size(at, galley.size()).expand2(vec2(6.0, 3.0));
    ui.painter().rect_filled(rect, 4.0, palette.panel.gamma_multiply(0.88));
    ui.painter().galley(at, galley, palette.text);
}

/// The force next to the spring's free end; the spring itself is part of the picture.
fn draw_hand(ui: &Ui, at: Pos2, force_n: f64, palette: &Palette) {
    ui.painter().circle_stroke(at, 7.0, Stroke::new(1.6, palette.warn));
    label(ui, at + vec2(15.0, -21.0), &format!("{} N", text::figures(force_n)), palette);
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    fn window() -> Window {
        let camera = Camera::looking(DVec3::new(2.0, -1.0, 0.7), DVec3::ZERO, 0.8);
        Window { rect: Rect::from_min_size(pos2(10.0, 20.0), vec2(300.0, 200.0)), scale: 1.5, camera }
    }

    #[test]
    fn the_hand_moves_in_the_plane_that_faces_the_eye() {
        let window = window();
        let through = DVec3::new(0.1, 0.2, 0.1);
        let at = pos2(200.0, 60.0);
        let target = on_plane(&window.ray(at), through, window.camera.forward());
        let off = (target - through).dot(window.camera.forward());
        assert!(off.abs() < 1e-12, "{off} m out of the plane"); // a few roundings of lengths near 1
        assert!(window.place(target).unwrap().distance(at) < 1e-3); // f32 points near 200
    }

    #[test]
    fn the_pointer_in_the_middle_looks_at_the_target_at_any_scale() {
        let window = window();
        let ray = window.ray(window.rect.center());
        assert!((ray.direction - window.camera.forward()).length() < 1e-12);
        assert!(window.place(DVec3::ZERO).unwrap().distance(window.rect.center()) < 1e-3);
    }
}
