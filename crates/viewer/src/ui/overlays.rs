//! Overlays on the picture: help, information, the command palette, messages.
//!
//! In: the [`Status`] and the table of commands. Out: chosen [`Command`]s. Never here: the panels next to the picture.

use super::commands;
use super::commands::{Command, Group, MOUSE, SHORTCUTS};
use super::history::FrameSummary;
use super::icons::{Icon, icon_button};
use super::protocol::{Message, Severity, Status};
use super::text;
use super::theme::{Palette, palette};
use egui::{Align2, Area, Frame, Id, Key, Order, Rect, RichText, Ui, vec2};

/// The palette's state between frames.
#[derive(Debug, Clone, Default)]
pub struct Finder {
    /// The text typed.
    typed: String,
    /// Index of the chosen entry among the matching ones.
    chosen: usize,
}

/// Keys and mouse, in the middle of the window. Returns false once it is closed.
pub fn help(ctx: &egui::Context) -> bool {
    let modal = egui::Modal::new(Id::unique("help")).frame(sheet(ctx)).show(ctx, |ui| {
        ui.set_width(660.0);
        ui.heading("Keys and mouse");
        ui.add_space(8.0);
        ui.columns(2, |columns| {
            keys(&mut columns[0], "Time and scene", Group::Time);
            keys(&mut columns[0], "Camera", Group::Camera);
            keys(&mut columns[1], "Picture and panels", Group::Picture);
        });
        title(ui, "Mouse over the picture");
        egui::Grid::new("mouse").num_columns(2).min_row_height(16.0).spacing(vec2(24.0, 5.0)).show(ui, |ui| {
            for (hand, does) in MOUSE {
                ui.label(RichText::new(hand).strong());
                ui.label(does);
                ui.end_row();
            }
        });
        ui.add_space(6.0);
        ui.label(RichText::new("Ctrl with +, - or 0 changes the size of the interface.").color(palette(ui).weak));
        ui.add_space(6.0);
        ui.button("Close").clicked()
    });
    !(modal.inner || modal.should_close())
}

fn sheet(ctx: &egui::Context) -> Frame {
    Frame::popup(&ctx.global_style()).inner_margin(16).corner_radius(10.0)
}

fn title(ui: &mut Ui, text: &str) {
    ui.add_space(8.0);
    ui.label(RichText::new(text).color(palette(ui).accent));
    ui.add_space(2.0);
}

fn keys(ui: &mut Ui, name: &str, group: Group) {
    title(ui, name);
    egui::Grid::new(name).num_columns(2).min_row_height(16.0).min_col_width(82.0).spacing(vec2(14.0, 5.0)).show(
        ui,
        |ui| {
            for shortcut in SHORTCUTS.iter().filter(|row| row.group == group) {
                ui.label(RichText::new(commands::keys_text(ui.ctx(), shortcut.command)).monospace());
                ui.label(shortcut.does);
                ui.end_row();
            }
        },
    );
}

/// Numbers of the run, at the top left of the picture.
pub fn info(ui: &Ui, over: Rect, status: &Status, summary: &FrameSummary, adapter: &str) {
    let palette = palette(ui);
    let area = Area::new(Id::unique("info")).order(Order::Background).interactable(false);
    area.fixed_pos(over.min + vec2(12.0, 12.0)).show(ui.ctx(), |ui| {
        card(&palette).show(ui, |ui| {
            egui::Grid::new("info grid").num_columns(2).min_row_height(15.0).spacing(vec2(18.0, 4.0)).show(ui, |ui| {
                for (name, value) in info_rows(status, summary, adapter) {
                    ui.label(RichText::new(name).color(palette.weak));
                    ui.label(RichText::new(value).monospace());
                    ui.end_row();
                }
            });
        });
    });
}

fn info_rows(status: &Status, summary: &FrameSummary, adapter: &str) -> Vec<(&'static str, String)> {
    let mut rows = vec![
        ("Scene", status.scene.clone()),
        ("Simulated time", format!("{:.3} s", status.sim_time.as_secs_f64())),
        ("Speed", format!("{:.2}× of {}", status.real_time_factor, text::speed(status.speed))),
        ("Frames", format!("{:.1} of {:.0} per s", summary.rate_hz, status.target_hz)),
        ("Work", format!("{}, 99th percentile {}", text::seconds(summary.mean_s), text::seconds(summary.p99_s))),
        ("Triangles", text::count(status.triangles)),
        ("Agents", format!("{} on {}", status.agents.len(), status.executor)),
        ("Policy", status.policy.clone()),
        ("Energy", format!("{} J", text::figures(status.energy_j))),
        ("Adapter", adapter.to_owned()),
    ];
    if let Some(value) = status.loop_value {
        rows.push(("Loop variable", text::figures(value)));
    }
    if let Some(hash) = status.state_hash {
        rows.push(("State hash", format!("{hash:016x}")));
    }
    rows
}

fn card(palette: &Palette) -> Frame {
    Frame::new()
        .fill(palette.panel.gamma_multiply(0.90))
        .corner_radius(8.0)
        .inner_margin(egui::Margin::symmetric(12, 10))
}

/// The newest messages, at the bottom left of the picture.
pub fn messages(ui: &Ui, over: Rect, messages: &[Message]) {
    const SHOWN: usize = 4;
    if messages.is_empty() {
        return;
    }
    let palette = palette(ui);
    let area = Area::new(Id::unique("messages")).order(Order::Background).interactable(false);
    area.pivot(Align2::LEFT_BOTTOM).fixed_pos(over.left_bottom() + vec2(12.0, -12.0)).show(ui.ctx(), |ui| {
        ui.set_max_width(0.7 * over.width());
        for message in &messages[messages.len().saturating_sub(SHOWN)..] {
            let color = match message.severity {
                Severity::Note => palette.text,
                Severity::Warning => palette.warn,
                Severity::Failure => palette.bad,
            };
            card(&palette).show(ui, |ui| ui.label(RichText::new(&message.text).color(color)));
        }
    });
}

/// The button that brings the panels back where they are hidden: a user who finds the window so knows no key for it.
pub fn panels_button(ui: &Ui) -> Option<Command> {
    let keys = |command| commands::keys_text(ui.ctx(), command);
    let hover = format!(
        "Show the panels   {}\n{} also takes colours and styles back",
        keys(Command::HideUi),
        keys(Command::ResetWindow)
    );
    let area = Area::new(Id::unique("panels button")).pivot(Align2::RIGHT_TOP);
    let corner = ui.ctx().content_rect().right_top() + vec2(-12.0, 12.0);
    let button = area.fixed_pos(corner).show(ui.ctx(), |ui| icon_button(ui, Icon::Panels, "Show panels", &hover));
    button.inner.clicked().then_some(Command::HideUi)
}

/// Every command by name, filtered by the typed text. Returns the chosen command, and whether the palette stays open.
pub fn finder(ctx: &egui::Context, finder: &mut Finder) -> (Option<Command>, bool) {
    let mut chosen = None;
    let modal = egui::Modal::new(Id::unique("palette")).frame(sheet(ctx)).show(ctx, |ui| {
        ui.set_width(420.0);
        let typed =
            ui.add(egui::TextEdit::singleline(&mut finder.typed).hint_text("Type a command").desired_width(420.0));
        typed.clone().accessible_name("Command");
        typed.request_focus();
        if typed.changed() {
            finder.chosen = 0;
        }
        let found = matching(&finder.typed);
        move_choice(ui, finder, found.len());
        let entered = ui.input(|input| input.key_pressed(Key::Enter));
        for (index, (command, does)) in found.iter().enumerate() {
            let keys = commands::keys_text(ui.ctx(), *command);
            let row = egui::Button::selectable(index == finder.chosen, *does).shortcut_text(keys);
            let pressed = ui.add_sized(vec2(420.0, 24.0), row).clicked();
            if pressed || (entered && index == finder.chosen) {
                chosen = Some(*command);
            }
        }
        if found.is_empty() {
            ui.label(RichText::new("No command matches.").color(palette(ui).weak));
        }
    });
    let open = chosen.is_none() && !modal.should_close();
    if !open {
        *finder = Finder::default();
    }
    (chosen, open)
}

fn move_choice(ui: &Ui, finder: &mut Finder, count: usize) {
    let (up, down) = ui.input(|input| (input.num_presses(Key::ArrowUp), input.num_presses(Key::ArrowDown)));
    let last = count.saturating_sub(1);
    finder.chosen = (finder.chosen + down).min(last).saturating_sub(up);
}

/// Commands whose description holds every typed word, in the table's order.
fn matching(typed: &str) -> Vec<(Command, &'static str)> {
    let words: Vec<String> = typed.to_lowercase().split_whitespace().map(str::to_owned).collect();
    SHORTCUTS
        .iter()
        .filter(|row| row.command != Command::Palette)
        .filter(|row| words.iter().all(|word| row.does.to_lowercase().contains(word)))
        .map(|row| (row.command, row.does))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typed_words_narrow_the_palette_in_any_order() {
        assert_eq!(matching("").len(), SHORTCUTS.len() - 1);
        assert_eq!(matching("file reload"), [(Command::Reload, "Reload the scene file")]);
        assert!(matching("no such thing").is_empty());
    }
}
