//! The side panel: frame time against the target, the controller and its gains, drawing options of the picture.
//!
//! In: the [`Status`] and the recent frames. Out: [`Action`]s, and changed [`DrawingOptions`]. Never here: the law itself.

use super::DrawingOptions;
use super::history::{FrameSummary, History};
use super::plots;
use super::protocol::{Action, AgentRow, AgentState, ContactSolve, Filled, Law, Status, Tuning};
use super::text;
use super::theme::{Palette, palette};
use egui::{Align, ComboBox, Layout, ProgressBar, RichText, Slider, SliderClamping, Ui};
use metachron_core::{NumberRange, gains};
use metachron_lod::cost::benefit::Sliders;
use std::ops::RangeInclusive;

/// Range of target frame rates on the slider, per second.
const TARGET_HZ: RangeInclusive<f64> = 5.0..=144.0;

/// Tooltip of the tuning button.
const TUNE: &str = "Tune the gains: a few seconds of frames at many resolutions, then a search in the background; the best gains are applied";

/// Tooltip of contact forces.
const FORCES: &str = "A ball at each contact; an arrow along its normal as long as the force (orange), friction (blue), and what a tool feels (red)";

/// Draws the panel.
pub fn show(ui: &mut Ui, status: &Status, history: &History, looks: &mut DrawingOptions) -> Vec<Action> {
    let mut actions = Vec::new();
    egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 3.0;
        let summary = history.summary(status.target_hz);
        section(ui, "Frame", |ui| frame(ui, status, history, &summary, &mut actions));
        section(ui, "Control", |ui| control(ui, status, &mut actions));
        section(ui, "Picture", |ui| picture(ui, looks, status, &mut actions));
        let row = status.selected.and_then(|id| status.agents.iter().find(|row| row.id == id));
        if !status.couplings.is_empty() {
            section(ui, "Couplings", |ui| super::couplings::show(ui, &status.couplings));
        }
        section(ui, "Selected", |ui| selected(ui, row, &mut actions));
    });
    actions
}

fn section(ui: &mut Ui, title: &str, content: impl FnOnce(&mut Ui)) {
    ui.add_space(5.0);
    ui.label(RichText::new(title.to_uppercase()).size(10.5).color(palette(ui).weak).extra_letter_spacing(0.8));
    ui.add_space(2.0);
    content(ui);
    ui.add_space(5.0);
    ui.separator();
}

fn frame(ui: &mut Ui, status: &Status, history: &History, summary: &FrameSummary, out: &mut Vec<Action>) {
    plots::frame_times(ui, history, status.target_hz);
    crate::ui::budget_bar::show(ui, &status.shares);
    let late = format!("{:.1} %", 100.0 * summary.late_share);
    ui.add_space(2.0);
    ui.columns_const(|[work, tail, lateness]| {
        number_tile(
            work,
            "mean work",
            &text::seconds(summary.mean_s),
            "Mean frame time: reading states, selecting levels, drawing, panels",
        );
        number_tile(tail, "99th percentile", &text::seconds(summary.p99_s), "99th percentile of the frame time");
        number_tile(lateness, "late frames", &late, "Fraction of recent frames late by more than a tenth of a period");
    });
    let mut target = status.target_hz;
    slider(ui, "Target rate", &mut target, TARGET_HZ, |s| s.step_by(1.0).suffix(" fps"));
    if target != status.target_hz {
        out.push(Action::TargetFps(target));
    }
    if let Some(clamp) = &status.clamp {
        ui.label(RichText::new(clamp).color(palette(ui).warn));
    }
}

fn control(ui: &mut Ui, status: &Status, out: &mut Vec<Action>) {
    let mut policy = status.policy.clone();
    labelled(ui, "Policy", |ui| {
        let combo = ComboBox::from_id_salt("policy").selected_text(&policy).width(130.0).show_ui(ui, |ui| {
            for name in &status.policies {
                ui.selectable_value(&mut policy, name.clone(), name);
            }
        });
        combo.response.accessible_name("Policy");
    });
    if policy != status.policy {
        out.push(Action::Policy(policy));
    }
    let mut frozen = status.frozen;
    if ui.checkbox(&mut frozen, "Freeze selection").on_hover_text("All objects keep their present level").changed() {
        out.push(Action::Freeze(frozen));
    }
    if let Some(sliders) = status.sliders {
        benefit_weights(ui, sliders, status.damped, out);
    }
    if let Some(law) = status.law {
        feedback(ui, law, status, out);
    }
}

/// Sliders for the weights of a level's benefit; hysteresis only where the policy uses it.
fn benefit_weights(ui: &mut Ui, sliders: Sliders, damped: bool, out: &mut Vec<Action>) {
    let mut wanted = sliders;
    let Sliders { size, accuracy, importance, focus, motion, hysteresis } = &mut wanted;
    let factors =
        [("Size", size), ("Accuracy", accuracy), ("Importance", importance), ("Focus", focus), ("Motion", motion)];
    for (name, value) in factors.into_iter().chain(damped.then_some(("Hysteresis", hysteresis))) {
        slider(ui, name, value, 0.0..=1.0, |s| s.max_decimals(2));
    }
    if wanted != sliders {
        out.push(Action::Sliders(wanted));
    }
}

fn feedback(ui: &mut Ui, law: Law, status: &Status, out: &mut Vec<Action>) {
    let mut wanted = law;
    choose_law(ui, &mut wanted, &status.laws);
    law_gains(ui, &mut wanted);
    ui.horizontal(|ui| {
        let default = status.laws.iter().copied().find(|law| law.is_same_law(&wanted)).unwrap_or(wanted);
        if ui.add_enabled(wanted != default, egui::Button::new("Reset to default")).clicked() {
            wanted = default;
        }
        if ui.button("Copy as TOML").on_hover_text("Target rate and gains, for the scene file").clicked() {
            ui.ctx().copy_text(as_toml(status, &wanted));
        }
        if status.tuning.is_none() && ui.button("Tune").on_hover_text(TUNE).clicked() {
            out.push(Action::Tune);
        }
    });
    if let Some(tuning) = &status.tuning {
        progress(ui, tuning, out);
    }
    if wanted != law {
        out.push(Action::Law(wanted));
    }
}

/// Progress of the search for gains, with a cancel button.
fn progress(ui: &mut Ui, tuning: &Tuning, out: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        if ui.button("Cancel").on_hover_text("Stop tuning; the gains stay unchanged").clicked() {
            out.push(Action::StopTuning);
        }
        let bar = ProgressBar::new(tuning.done as f32).desired_height(14.0).show_percentage();
        ui.add(bar).accessible_name("Tuning");
    });
    ui.label(RichText::new(&tuning.words).small().color(palette(ui).weak));
}

fn choose_law(ui: &mut Ui, law: &mut Law, laws: &[Law]) {
    labelled(ui, "Law", |ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        for other in laws {
            let name = if matches!(other, Law::Printed { .. }) { "As printed" } else { "Corrected" };
            let chosen = other.is_same_law(law);
            if ui.selectable_label(chosen, name).clicked() && !chosen {
                *law = *other;
            }
        }
    });
}

fn law_gains(ui: &mut Ui, law: &mut Law) {
    match law {
        Law::Printed { alpha, beta } => {
            slider(ui, "Gain α", alpha, range(gains::ALPHA), |s| {
                s.logarithmic(true).custom_formatter(|v, _| format!("{v:.1e}"))
            });
            slider(ui, "Gain β", beta, range(gains::BETA), |s| s.logarithmic(true).max_decimals(2));
        }
        Law::Corrected { kappa, lead, margin } => {
            slider(ui, "Gain κ", kappa, range(gains::KAPPA), |s| s.max_decimals(2));
            slider(ui, "Lead λ", lead, range(gains::LEAD), |s| s.max_decimals(2));
            let mut percent = *margin * 100.0;
            slider(ui, "Margin", &mut percent, 0.0..=100.0 * gains::MARGIN.greatest, |s| {
                s.max_decimals(0).suffix(" %")
            });
            // the conversion to percent and back must not count as a change
            if (percent - *margin * 100.0).abs() > 1e-9 {
                *margin = percent / 100.0;
            }
        }
    }
}

fn as_toml(status: &Status, law: &Law) -> String {
    let gains = match law {
        Law::Printed { alpha, beta } => format!("law = \"printed\"\nalpha = {alpha:e}\nbeta = {beta}\n"),
        Law::Corrected { kappa, lead, margin } => {
            format!("law = \"corrected\"\nkappa = {kappa}\nlead = {lead}\nmargin = {margin}\n")
        }
    };
    format!("[target]\nframe_hz = {:?}\npolicy = \"{}\"\n{gains}", status.target_hz, status.policy)
}

/// A checkbox of a meaning of colours: no two are chosen.
fn colouring(ui: &mut Ui, looks: &mut DrawingOptions, name: &str, of: fn(&mut DrawingOptions) -> &mut bool) {
    let mut wanted = *looks;
    if ui.checkbox(of(&mut wanted), name).changed() {
        *looks = looks.plain_or(wanted);
    }
}

/// A menu of the scene's cameras, where there are several.
fn camera(ui: &mut Ui, status: &Status, out: &mut Vec<Action>) {
    let Some(name) = status.cameras.get(status.camera).filter(|_| status.cameras.len() > 1) else { return };
    labelled(ui, "Camera", |ui| {
        let combo = ComboBox::from_id_salt("camera").selected_text(name).width(130.0).show_ui(ui, |ui| {
            for (number, name) in status.cameras.iter().enumerate() {
                if ui.selectable_label(number == status.camera, name).clicked() {
                    out.push(Action::Camera(number));
                }
            }
        });
        combo.response.accessible_name("Camera");
    });
}

fn picture(ui: &mut Ui, looks: &mut DrawingOptions, status: &Status, out: &mut Vec<Action>) {
    camera(ui, status, out);
    egui::Grid::new("looks").num_columns(2).spacing(egui::vec2(18.0, 4.0)).show(ui, |ui| {
        colouring(ui, looks, "Colour by resolution", |looks| &mut looks.colours);
        ui.checkbox(&mut looks.wireframe, "Wireframe");
        ui.end_row();
        colouring(ui, looks, "Colour by age", |looks| &mut looks.ages);
        colouring(ui, looks, "Shade by detail", |looks| &mut looks.details);
        ui.end_row();
        colouring(ui, looks, "Depth", |looks| &mut looks.depths);
        ui.checkbox(&mut looks.forces, "Contact forces").on_hover_text(FORCES);
        ui.end_row();
    });
    value(ui, "Triangles", &text::count(status.triangles), "In the last picture");
    let [potentially, visible, drawn] = status.objects.map(text::count);
    let objects = format!("{drawn} of {visible} of {potentially}");
    value(ui, "Objects", &objects, "Drawn, of those in view, of those in rooms that the eye reaches");
    value(
        ui,
        "Scale",
        &format!("{:.0} %{}", 100.0 * status.render_scale, if status.shadows { "" } else { ", no shadows" }),
        "Fraction of its width and height that the picture is drawn with, and whether objects throw shadows; less where everything is at its \
         coarsest and frames would be late",
    );
}

fn selected(ui: &mut Ui, row: Option<&AgentRow>, out: &mut Vec<Action>) {
    let palette = palette(ui);
    let Some(row) = row else {
        ui.label(RichText::new("Click an object or a row.").color(palette.weak));
        return;
    };
    ui.horizontal(|ui| {
        ui.label(RichText::new(&row.name).strong());
        ui.label(RichText::new(&row.model).color(palette.weak));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.small_button("Deselect").clicked() {
                out.push(Action::Select(None));
            }
        });
    });
    if let AgentState::Parked(reason) = &row.state {
        ui.label(RichText::new(format!("Parked: {reason}")).color(palette.bad));
    }
    value(ui, "Error estimate", &text::metres(row.residual_m), "The agent's own estimate");
    value(
        ui,
        "Dropped time",
        &text::seconds(row.dropped_s),
        "Simulated time dropped because the agent could not keep up",
    );
    if let Some(simulation) = &row.simulation {
        value(ui, "Simulation ε", &text::metres(simulation.eps_m), "Spacing of samples along the shape");
    }
    if let Some(picture) = &row.picture {
        // a primitive is not divided along a shape: only its level is meaningful
        let eps = row.simulation.map_or_else(String::new, |_| format!("ε {}, ", text::metres(picture.eps_m)));
        value(ui, "Picture", &format!("{eps}n {}", picture.n), "Sample spacing of the skin, and level of its patches");
    }
    if let Some(Filled { pressure_pa, most_pa }) = row.filled {
        let mut wanted_pa = pressure_pa;
        slider(ui, "Pressure", &mut wanted_pa, 0.0..=most_pa, |s| s.max_decimals(0).suffix(" Pa"));
        if wanted_pa != pressure_pa {
            out.push(Action::Pressure { agent: row.id, pressure_pa: wanted_pa });
        }
    }
    if let Some(ContactSolve { miss_m_s, depth_m, .. }) = row.contact {
        let text = format!("{} deep, {}/s off", text::metres(depth_m), text::metres(miss_m_s));
        value(
            ui,
            "Contacts",
            &text,
            "The deepest overlap of its cluster, and what laws of contact miss in its last step",
        );
    }
    if let Some(force_n) = row.force_n {
        value(ui, "Force", &format!("{} N", text::figures(force_n)), "Reaction force of the grasped object");
    }
}

/// A number over its name.
fn number_tile(ui: &mut Ui, name: &str, value: &str, hover: &str) {
    ui.spacing_mut().item_spacing.y = 0.0;
    ui.label(RichText::new(value).monospace().size(13.5)).on_hover_text(hover);
    ui.label(RichText::new(name).small().color(palette(ui).weak));
}

fn value(ui: &mut Ui, name: &str, value: &str, hover: &str) {
    labelled(ui, name, |ui| {
        ui.label(RichText::new(value).monospace()).on_hover_text(hover);
    });
}

fn labelled(ui: &mut Ui, name: &str, content: impl FnOnce(&mut Ui)) {
    let palette: Palette = palette(ui);
    ui.horizontal(|ui| {
        let (rect, _) = ui.allocate_exact_size(egui::vec2(92.0, ui.spacing().interact_size.y), egui::Sense::hover());
        let font = egui::TextStyle::Body.resolve(ui.style());
        ui.painter().text(rect.left_center(), egui::Align2::LEFT_CENTER, name, font, palette.weak);
        content(ui);
    });
}

const fn range(of: NumberRange) -> RangeInclusive<f64> {
    of.least..=of.greatest
}

fn slider(
    ui: &mut Ui,
    name: &str,
    value: &mut f64,
    range: RangeInclusive<f64>,
    shape: impl FnOnce(Slider<'_>) -> Slider<'_>,
) {
    labelled(ui, name, |ui| {
        // a value outside the slider's range stays unchanged until the slider is moved
        let free = Slider::new(value, range).clamping(SliderClamping::Edits);
        ui.add(shape(free)).accessible_name(name);
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    #[test]
    fn the_pressure_slider_is_shown_for_what_has_an_inside_and_asks_for_what_it_is_moved_to() {
        for filled in [None, Some(Filled { pressure_pa: 100.0, most_pa: 1000.0 })] {
            let row = AgentRow { filled, ..AgentRow::new(metachron_core::AgentId(3), "hose", "tube") };
            let mut harness = Harness::new_ui_state(|ui, out| selected(ui, Some(&row), out), Vec::new());
            let mut sliders = harness.query_all_by_role_and_label(egui::Role::Slider, "Pressure");
            let Some(slider) = sliders.next() else {
                assert_eq!(filled, None);
                continue;
            };
            assert!(filled.is_some());
            slider.focus();
            drop(sliders);
            harness.run();
            harness.key_press(egui::Key::ArrowRight);
            harness.run();
            let [Action::Pressure { agent, pressure_pa }, ..] = harness.state()[..] else {
                panic!("{:?}", harness.state())
            };
            assert!(agent == row.id && pressure_pa > 100.0, "{pressure_pa} Pa");
        }
    }

    #[test]
    fn the_hysteresis_slider_is_shown_only_where_it_is_used() {
        let sliders = Some(Sliders::default());
        for (damped, there) in [(true, 1), (false, 0)] {
            let status = Status { sliders, damped, ..Status::default() };
            let harness = Harness::new_ui(|ui| control(ui, &status, &mut Vec::new()));
            let count = |name| harness.query_all_by_role_and_label(egui::Role::Slider, name).count();
            assert_eq!((count("Motion"), count("Hysteresis")), (1, there));
        }
    }

    #[test]
    fn the_scale_of_the_picture_is_shown() {
        for (shadows, text) in [(true, "65 %"), (false, "65 %, no shadows")] {
            let status = Status { render_scale: 0.65, shadows, ..Status::default() };
            let harness = Harness::new_ui(|ui| picture(ui, &mut DrawingOptions::default(), &status, &mut Vec::new()));
            assert!(harness.query_by_label(text).is_some(), "{text}");
        }
    }

    #[test]
    fn copied_gains_are_valid_toml() {
        let status = Status { target_hz: 30.0, policy: "feedback".to_owned(), ..Status::default() };
        for law in [Law::Printed { alpha: 1e-4, beta: 5.0 }, Law::Corrected { kappa: 0.5, lead: 0.2, margin: 0.1 }] {
            let text = as_toml(&status, &law);
            let table: toml::Table = text.parse().unwrap();
            assert_eq!(table["target"]["frame_hz"].as_float(), Some(30.0), "{text}");
        }
    }
}
