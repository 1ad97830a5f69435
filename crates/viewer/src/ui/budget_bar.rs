//! The budget bar: how the time of a frame is divided, and the fraction of all cores that simulates.
//!
//! In: [`Shares`]. Out: two lines of coloured parts. Never here: measuring.

use super::protocol::Shares;
use super::theme::palette;
use egui::{Color32, Rect, RichText, Sense, Ui, pos2, vec2};

/// Width of the bar in target frame times.
const ROOM: f64 = 1.25;

/// Height of the bar, points.
const HIGH: f32 = 9.0;

/// The colours of the parts: simulation, culling, selection, drawing, the rest.
const COLOURS: [Color32; 5] = [
    Color32::from_rgb(92, 122, 190),
    Color32::from_rgb(84, 160, 150),
    Color32::from_rgb(226, 178, 74),
    Color32::from_rgb(196, 108, 96),
    Color32::from_rgb(128, 128, 136),
];

/// Draws the bar with its legend.
pub fn show(ui: &mut Ui, shares: &Shares) {
    let Shares { simulation, cull, select, draw, rest } = *shares;
    ui.add_space(3.0);
    let width = ui.available_width();
    let (rect, response) = ui.allocate_exact_size(vec2(width, 2.0 * HIGH + 3.0), Sense::hover());
    response.on_hover_text(
        "Above: fraction of all cores used by the simulation. Below: frame time; the line is the frame budget.",
    );
    let line = |row: f32| Rect::from_min_size(pos2(rect.left(), rect.top() + row * (HIGH + 3.0)), vec2(width, HIGH));
    bar(ui, line(0.0), &[(simulation, COLOURS[0])], 1.0);
    let frame = [(cull, COLOURS[1]), (select, COLOURS[2]), (draw, COLOURS[3]), (rest, COLOURS[4])];
    bar(ui, line(1.0), &frame, ROOM);
    let target = rect.left() + width / ROOM as f32;
    ui.painter().vline(target, line(1.0).y_range(), (1.5, palette(ui).text));
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        let parts = [simulation, cull, select, draw, rest];
        for (((name, means), part), colour) in NAMES.into_iter().zip(parts).zip(COLOURS) {
            ui.label(RichText::new(format!("{name} {}", percent_text(part))).small().color(colour))
                .on_hover_text(means);
        }
    });
}

/// The parts and their tooltips.
const NAMES: [(&str, &str); 5] = [
    ("simulation", "Agents' share of all cores"),
    ("cull", "Reading states and visibility culling; 100 % is the frame budget"),
    ("select", "Selecting levels of detail; 100 % is the frame budget"),
    ("draw", "Composing and drawing the picture; 100 % is the frame budget"),
    ("window", "Panels and presentation; 100 % is the frame budget"),
];

/// A fraction in percent, or as a multiple of the whole.
fn percent_text(part: f64) -> String {
    if part < 2.0 { format!("{:.0} %", 100.0 * part) } else { format!("{part:.1}×") }
}

/// Parts side by side; the whole line stands for `room`.
fn bar(ui: &Ui, line: Rect, parts: &[(f64, Color32)], room: f64) {
    ui.painter().rect_filled(line, 2.0, palette(ui).ground);
    let mut from = line.left();
    for (part, colour) in parts {
        let part = if *part > 0.0 { (part / room).min(1.0) } else { 0.0 };
        let to = (from + line.width() * part as f32).min(line.right());
        ui.painter().rect_filled(Rect::from_x_y_ranges(from..=to, line.y_range()), 2.0, *colour);
        from = to;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_takes_many_frames_is_told_in_frames() {
        assert_eq!([0.016, 1.2, 15.63].map(percent_text), ["2 %", "120 %", "15.6×"]);
    }
}
