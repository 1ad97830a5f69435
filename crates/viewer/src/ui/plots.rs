//! Plots: frame time against its target, each agent's cost and rate, histories of one agent.
//!
//! In: the recent frames and samples. Out: shapes. Never here: storing numbers.

use super::history::{FRAMES, History, Sample};
use super::protocol::Status;
use super::text;
use super::theme::{Palette, palette};
use egui::{Align2, Color32, FontId, Rect, Sense, Ui, pos2, vec2};
use egui_plot::{HLine, Line, LineStyle, Plot, PlotPoints};

/// The axis of frame times reaches at least this many target periods.
const HEADROOM: f64 = 1.6;

/// Work and interval of recent frames, with the target line.
pub fn frame_times(ui: &mut Ui, history: &History, target_hz: f64) {
    let palette = palette(ui);
    let target_ms = 1e3 / target_hz.max(1e-3);
    let start = FRAMES - history.frames().len();
    let points = |pick: fn(&crate::ui::protocol::FrameTimes) -> std::time::Duration| -> PlotPoints<'static> {
        let frames = history.frames().iter().enumerate();
        frames.map(|(i, frame)| [(start + i) as f64, pick(frame).as_secs_f64() * 1e3]).collect()
    };
    let summary = history.summary(target_hz);
    let top = (HEADROOM * target_ms).max(1.15e3 * summary.p99_s);
    let interval = Line::new("Interval", points(|f| f.interval)).color(palette.weak.gamma_multiply(0.55)).width(1.0);
    let work = Line::new("Work", points(|f| f.work)).color(palette.accent).width(1.6);
    let target = HLine::new("Target", target_ms).color(palette.warn).style(LineStyle::dashed_loose()).width(1.0);
    plain_plot("frame times", 112.0, &palette)
        .y_grid_spacer(|input| even_marks(input, 4.0))
        .include_x(0.0)
        .include_x(FRAMES as f64)
        .include_y(0.0)
        .include_y(top)
        .y_axis_formatter(|mark, _| format!("{} ms", text::plain(mark.value)))
        .show_axes([false, true])
        .show(ui, move |plot| {
            plot.set_plot_bounds_y(0.0..=top);
            plot.line(interval);
            plot.line(work);
            plot.hline(target);
        });
    legend(ui, &[("work", palette.accent), ("interval", palette.weak), ("target", palette.warn)]);
}

fn plain_plot(name: &'static str, height: f32, palette: &Palette) -> Plot<'static> {
    Plot::new(name)
        .height(height)
        .show_grid([false, true])
        .grid_color(palette.line)
        .grid_spacing(4.0..=14.0)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .allow_double_click_reset(false)
        .show_x(false)
        .y_axis_min_width(44.0)
        .set_margin_fraction(vec2(0.0, 0.06))
}

/// Marks at round numbers that divide the axis into about `parts`, all of one weight, so that each has a label.
fn even_marks(input: egui_plot::GridInput, parts: f64) -> Vec<egui_plot::GridMark> {
    let (low, high) = input.bounds;
    let step_size = round_step((high - low) / parts);
    if !(step_size > 0.0 && (high - low).is_finite()) {
        return Vec::new();
    }
    let marks = (low / step_size).ceil() as i64..=(high / step_size).floor() as i64;
    marks.map(|i| egui_plot::GridMark { value: i as f64 * step_size, step_size }).collect()
}

/// The number 1, 2 or 5 times a power of ten at or above five eighths of `rough`.
fn round_step(rough: f64) -> f64 {
    let power = 10_f64.powf(rough.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|&step| step >= 0.625 * rough).unwrap_or(10.0 * power)
}

fn legend(ui: &mut Ui, entries: &[(&str, Color32)]) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 5.0;
        for (name, color) in entries {
            let (rect, _) = ui.allocate_exact_size(vec2(12.0, 10.0), Sense::hover());
            ui.painter().hline(rect.x_range(), rect.center().y, egui::Stroke::new(2.0, *color));
            ui.label(egui::RichText::new(*name).small().color(palette(ui).weak));
            ui.add_space(6.0);
        }
    });
}

/// Bars of each agent's share of a core, and of its rate relative to the requested one.
pub fn costs(ui: &mut Ui, status: &Status) {
    let palette = palette(ui);
    let total: f64 = status.agents.iter().map(|row| row.cpu_share).sum();
    let widest = status.agents.iter().map(|row| row.cpu_share).fold(0.05, f64::max);
    ui.label(format!("{:.2} of a core in {} agents", total, status.agents.len()));
    ui.add_space(4.0);
    egui::ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
        for row in &status.agents {
            let (rect, response) = ui.allocate_exact_size(vec2(420.0, 20.0), Sense::hover());
            let share = if row.wanted_hz > 0.0 { (row.rate_hz / row.wanted_hz).min(1.0) } else { 0.0 };
            bar(ui, column(rect, 0.34, 0.66), row.cpu_share / widest, palette.accent);
            let on_time = if share >= 0.95 { palette.good } else { palette.warn };
            bar(ui, column(rect, 0.68, 0.99), share, on_time);
            row_text(ui, rect, row, &palette);
            response.on_hover_text(format!("{} per step", text::seconds(row.step_s)));
        }
    });
    legend(ui, &[("share of a core", palette.accent), ("rate / requested rate", palette.good)]);
}

fn column(rect: Rect, from: f32, to: f32) -> Rect {
    let (left, width) = (rect.left(), rect.width());
    Rect::from_x_y_ranges(left + from * width..=left + to * width, rect.y_range().shrink(3.0))
}

fn bar(ui: &Ui, rect: Rect, share: f64, color: Color32) {
    ui.painter().rect_filled(rect, 3.0, palette(ui).raised);
    let filled = rect.with_max_x(rect.left() + rect.width() * share.clamp(0.0, 1.0) as f32);
    ui.painter().rect_filled(filled, 3.0, color.gamma_multiply(0.75));
}

fn row_text(ui: &Ui, rect: Rect, row: &crate::ui::protocol::AgentRow, palette: &Palette) {
    let clip = ui.painter().with_clip_rect(rect.with_max_x(rect.left() + 0.32 * rect.width()));
    clip.text(rect.left_center(), Align2::LEFT_CENTER, &row.name, FontId::proportional(12.5), palette.text);
    let figure = |at: f32, text: String| {
        let right = pos2(rect.left() + at * rect.width() - 6.0, rect.center().y);
        ui.painter().text(right, Align2::RIGHT_CENTER, text, FontId::monospace(10.5), palette.text);
    };
    figure(0.66, format!("{:.1} %", 100.0 * row.cpu_share));
    figure(0.99, format!("{:.0} / {:.0} Hz", row.rate_hz, row.wanted_hz));
}

/// Histories of the selected agent: spacing, level, step length, cost and age over the last minute.
pub fn histories(ui: &mut Ui, status: &Status, history: &History) {
    let palette = palette(ui);
    let chosen = status.agents.iter().position(|row| Some(row.id) == status.selected);
    let Some((index, samples)) = chosen.and_then(|index| Some((index, history.agent(index)?))) else {
        ui.label("Select an object to see its histories.");
        return;
    };
    ui.label(egui::RichText::new(&status.agents[index].name).strong());
    let now = samples.back().map_or(0.0, |s| s.at_s);
    let series = |pick: &dyn Fn(&Sample) -> Option<f64>| -> Vec<[f64; 2]> {
        samples.iter().filter_map(|s| Some([s.at_s - now, pick(s)?])).collect()
    };
    let sim = series(&|s| s.sim_eps_m.map(|eps| 1e3 * eps));
    let picture = series(&|s| s.picture_eps_m.map(|eps| 1e3 * eps));
    let level = series(&|s| s.n.map(f64::from));
    history_plot(ui, "ε, mm", vec![("picture", picture, palette.accent), ("simulation", sim, palette.good)]);
    history_plot(ui, "n", vec![("n", level, palette.accent)]);
    history_plot(ui, "dt, ms", vec![("dt", series(&|s| Some(1e3 * s.dt_s)), palette.good)]);
    history_plot(ui, "Step cost, µs", vec![("cost", series(&|s| Some(1e6 * s.step_s)), palette.good)]);
    history_plot(ui, "Age, ms", vec![("age", series(&|s| Some(1e3 * s.age_s)), palette.accent)]);
    ui.add_space(2.0);
    legend(ui, &[("picture", palette.accent), ("simulation", palette.good), ("last minute", Color32::TRANSPARENT)]);
}

fn history_plot(ui: &mut Ui, name: &'static str, lines: Vec<(&'static str, Vec<[f64; 2]>, Color32)>) {
    if lines.iter().all(|(_, points, _)| points.is_empty()) {
        return;
    }
    let palette = palette(ui);
    ui.horizontal(|ui| {
        ui.set_height(14.0);
        ui.label(egui::RichText::new(name).small().color(palette.weak));
        for (_, points, color) in &lines {
            let newest = points.last().map_or_else(String::new, |point| text::figures(point[1]));
            ui.label(egui::RichText::new(newest).monospace().size(10.5).color(*color));
        }
    });
    let top = lines.iter().flat_map(|(_, points, _)| points).map(|p| p[1]).fold(1e-3, f64::max);
    plain_plot(name, 44.0, &palette)
        .width(340.0)
        .include_x(-60.0)
        .include_x(0.0)
        .include_y(0.0)
        .include_y(1.1 * top)
        .show_axes([false, true])
        .y_grid_spacer(|input| even_marks(input, 1.5))
        .y_axis_formatter(|mark, _| text::plain(mark.value))
        .show(ui, move |plot| {
            for (label, points, color) in lines {
                plot.line(Line::new(label, PlotPoints::from(points)).color(color).width(1.5));
            }
        });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_of_any_length_gets_three_to_seven_round_marks() {
        for top in [1e-3, 0.07, 1.0, 3.3, 16.0, 50.0, 99.0, 1234.0] {
            let input = egui_plot::GridInput { bounds: (0.0, top), base_step_size: 1.0 };
            let marks = even_marks(input, 4.0);
            assert!((3..=7).contains(&marks.len()), "{} marks up to {top}", marks.len());
        }
        let nothing = egui_plot::GridInput { bounds: (0.0, f64::NAN), base_step_size: 1.0 };
        assert!(even_marks(nothing, 4.0).is_empty());
    }
}
