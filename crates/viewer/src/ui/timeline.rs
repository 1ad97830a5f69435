//! The timeline: a scrubber over the moments that are kept, a button back to the present, and the cost of the moments.
//!
//! In: the [`Status`]. Out: [`Action`]s. Never here: the moments.

use super::protocol::{Action, Look, Status};
use super::text;
use super::theme::palette;
use egui::{Align, Layout, RichText, Slider, Ui};
use metachron_core::SimTime;
use metachron_session::RewindStatus;

/// Height of the bar, points.
pub const HEIGHT: f32 = 30.0;

/// Draws the bar.
pub fn show(ui: &mut Ui, status: &Status) -> Option<Action> {
    let mut action = None;
    ui.horizontal_centered(|ui| {
        let Some(rewind) = &status.rewind else {
            ui.label(RichText::new("No moment is kept yet.").small().color(palette(ui).weak));
            return;
        };
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.label(RichText::new(memory_text(rewind)).small().monospace().color(palette(ui).weak))
                .on_hover_text(meaning(rewind));
            let live = ui.add_enabled(rewind.shown.is_some(), egui::Button::new("Live"));
            if live.on_hover_text("Return to the present").clicked() {
                action = Some(Action::Look(Look::Live));
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                action = scrubber(ui, rewind).or(action.take());
            });
        });
    });
    action
}

/// The handle stands at the moment that is looked at; dragged, it looks at others.
fn scrubber(ui: &mut Ui, rewind: &RewindStatus) -> Option<Action> {
    let shown = rewind.shown.unwrap_or(rewind.newest);
    let (oldest_s, newest_s) = (rewind.oldest.as_secs_f64(), rewind.newest.as_secs_f64());
    let color = if rewind.shown.is_some() { palette(ui).warn } else { palette(ui).weak };
    ui.label(RichText::new(format!("{:9.3} s", shown.as_secs_f64())).monospace().color(color));
    ui.spacing_mut().slider_width = (ui.available_width() - 8.0).max(40.0);
    let mut at_s = shown.as_secs_f64();
    let slider = Slider::new(&mut at_s, oldest_s..=newest_s.max(oldest_s + 1e-9)).show_value(false);
    let response = ui.add_enabled(newest_s > oldest_s, slider);
    response.clone().accessible_name("Moment");
    let nanos = |s: f64| SimTime::from_nanos((s.max(0.0) * 1e9).round() as u64);
    response.changed().then(|| Action::Look(Look::At(nanos(at_s))))
}

fn memory_text(rewind: &RewindStatus) -> String {
    let mega = |bytes: usize| bytes as f64 / f64::from(1 << 20);
    format!(
        "{} moments, {} of {:.0} MiB, {} each",
        text::count(rewind.moments as u64),
        text::figures(mega(rewind.bytes)),
        mega(rewind.bytes_max),
        text::seconds(rewind.cost_s)
    )
}

const fn meaning(rewind: &RewindStatus) -> &'static str {
    if rewind.restores {
        "Moments kept, the memory that they take and its bound, and the time to keep one. The run stands at the moment that is looked at, and \
         goes on from there to the same bits; later moments are then given up"
    } else {
        "Moments kept, the memory that they take and its bound, and the time to keep one. The run goes on while the past is looked at"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_of_memory_is_shown() {
        let rewind = RewindStatus {
            oldest: SimTime::ZERO,
            newest: SimTime::from_nanos(1_000_000_000),
            shown: None,
            moments: 1200,
            bytes: 3 << 19,
            bytes_max: 128 << 20,
            cost_s: 52e-6,
            restores: true,
        };
        assert_eq!(memory_text(&rewind), "1 200 moments, 1.50 of 128 MiB, 52.0 µs each");
    }
}
