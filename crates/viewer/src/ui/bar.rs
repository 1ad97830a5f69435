//! The bar at the top: the scene, the transport buttons, the clock and the frame rate.
//!
//! In: the [`Status`] and the frames' summary. Out: [`Command`]s. Never here: their effect.

use super::commands;
use super::commands::Command;
use super::history::FrameSummary;
use super::icons::{Icon, icon_button};
use super::protocol::Status;
use super::text;
use super::theme::{Palette, palette};
use egui::{Align, Color32, Layout, RichText, Ui};

/// A bar narrower than this, points, omits the program's name and the real-time factor.
const WIDE: f32 = 800.0;
/// A bar narrower than this also omits the scene's name, the speed and the tools: all have keys.
const NARROW: f32 = 560.0;

/// A bar narrower than this omits the clock, but not the frame rate.
const SLIM: f32 = 360.0;

/// Tooltip of the real-time factor.
const REAL_TIME: &str = "Simulated seconds per second of the slowest agent; time that an agent cannot catch up is dropped. \
                         The requested speed is on the left";

/// Draws the bar.
pub fn show(ui: &mut Ui, status: &Status, summary: &FrameSummary) -> Vec<Command> {
    let mut commands = Vec::new();
    let palette = palette(ui);
    ui.horizontal_centered(|ui| {
        let (wide, narrow) = (ui.available_width() > WIDE, ui.available_width() < NARROW);
        let slim = ui.available_width() < SLIM;
        if wide {
            ui.label(RichText::new("metachron").strong().size(14.0));
        }
        if !narrow {
            ui.add(egui::Label::new(RichText::new(&status.scene).size(14.0).color(palette.weak)).truncate());
        }
        ui.add_space(if wide { 10.0 } else { 2.0 });
        transport(ui, status, &mut commands);
        ui.add_space(6.0);
        if !narrow {
            speed(ui, status, &mut commands);
            ui.add_space(10.0);
        }
        if !slim {
            clock(ui, status, wide, &palette);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if !narrow {
                tools(ui, &mut commands);
                ui.add_space(8.0);
            }
            frame_rate(ui, status, summary, &palette);
        });
    });
    commands
}

fn transport(ui: &mut Ui, status: &Status, out: &mut Vec<Command>) {
    ui.spacing_mut().item_spacing.x = 2.0;
    let (icon, name) = if status.running { (Icon::Pause, "Pause") } else { (Icon::Run, "Run") };
    button(ui, Icon::Back, "Back", Command::Back, out);
    button(ui, icon, name, Command::PauseOrRun, out);
    button(ui, Icon::Step, "Step", Command::Step, out);
    button(ui, Icon::Reset, "Reset", Command::Reset, out);
}

fn speed(ui: &mut Ui, status: &Status, out: &mut Vec<Command>) {
    button(ui, Icon::Minus, "Slower", Command::Slower, out);
    let text = RichText::new(text::speed(status.speed)).monospace();
    let response = ui.add(egui::Button::new(text).frame(false).min_size(egui::vec2(38.0, 22.0)));
    if response.on_hover_text(hover(ui, "Speed; click for real time", Command::RealTime)).clicked() {
        out.push(Command::RealTime);
    }
    button(ui, Icon::Plus, "Faster", Command::Faster, out);
}

fn clock(ui: &mut Ui, status: &Status, wide: bool, palette: &Palette) {
    ui.spacing_mut().item_spacing.x = 8.0;
    let time = format!("{:9.3} s", status.sim_time.as_secs_f64());
    ui.label(RichText::new(time).monospace().size(13.0)).on_hover_text("Simulated time");
    if !wide {
        return;
    }
    let factor = format!("{:.2}× real time", status.real_time_factor);
    let behind = status.running && status.real_time_factor < 0.95 * status.speed;
    let color = if behind { palette.warn } else { palette.weak };
    ui.label(RichText::new(factor).color(color)).on_hover_text(REAL_TIME);
}

fn frame_rate(ui: &mut Ui, status: &Status, summary: &FrameSummary, palette: &Palette) {
    let (text, color) = rate_text(status, summary, palette);
    ui.label(RichText::new(text).monospace().color(color)).on_hover_text("Frames per second, measured and target");
    ui.add_space(5.0);
    let (rect, _) = ui.allocate_exact_size(egui::vec2(8.0, 8.0), egui::Sense::hover());
    ui.painter().circle_filled(rect.center(), 3.5, color);
}

fn rate_text(status: &Status, summary: &FrameSummary, palette: &Palette) -> (String, Color32) {
    const ON_TIME: f64 = 0.95;
    const NEARLY: f64 = 0.75;
    let share = summary.rate_hz / status.target_hz.max(1e-9);
    let color = match share {
        s if s >= ON_TIME => palette.good,
        s if s >= NEARLY => palette.warn,
        _ => palette.bad,
    };
    (format!("{:.1} of {:.0} fps", summary.rate_hz, status.target_hz), color)
}

fn tools(ui: &mut Ui, out: &mut Vec<Command>) {
    ui.spacing_mut().item_spacing.x = 2.0;
    button(ui, Icon::Help, "Help", Command::Help, out);
    button(ui, Icon::Screenshot, "Screenshot", Command::Screenshot, out);
    button(ui, Icon::Panels, "Hide panels", Command::HideUi, out);
}

fn button(ui: &mut Ui, icon: Icon, name: &str, command: Command, out: &mut Vec<Command>) {
    let hover = hover(ui, name, command);
    if icon_button(ui, icon, name, &hover).clicked() {
        out.push(command);
    }
}

fn hover(ui: &Ui, name: &str, command: Command) -> String {
    format!("{name}   {}", commands::keys_text(ui.ctx(), command))
}
