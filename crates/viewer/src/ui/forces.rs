//! Contact forces in words over the picture: the scale of the arrows, and the wrench on every tool.
//!
//! In: a [`Forces`] and the picture's camera. Out: labels. Never here: the arrows, which are part of the picture.

use super::mouse::{Window, label};
use super::protocol::Forces;
use super::text;
use super::theme::palette;
use egui::{Ui, vec2};

/// An arrow of a round force is named whose length is at least this fraction of the camera's distance.
const NAMED: f64 = 0.03;

/// Draws the labels.
pub fn draw(ui: &Ui, window: &Window, forces: &Forces) {
    let palette = palette(ui);
    if let Some(scale) = scale_text(forces.scale_m_per_n, window.camera.distance_m) {
        label(ui, window.rect.left_top() + vec2(18.0, 12.0), &scale, &palette);
    }
    for tool in &forces.tools {
        if let Some(at) = window.place(tool.tip_m) {
            label(ui, at + vec2(14.0, 10.0), &wrench_text(tool.wrench), &palette);
        }
    }
}

fn scale_text(scale_m_per_n: f64, distance_m: f64) -> Option<String> {
    let least_n = NAMED * distance_m / scale_m_per_n;
    let named_n = 10.0_f64.powf(least_n.log10().ceil());
    let newtons = if named_n < 0.01 {
        format!("{} mN", text::plain(1e3 * named_n))
    } else {
        format!("{} N", text::plain(named_n))
    };
    (scale_m_per_n > 0.0).then(|| format!("Forces: {newtons} is {}", text::metres(named_n * scale_m_per_n)))
}

fn wrench_text(wrench: metachron_core::Wrench) -> String {
    let force = format!("{} N", text::figures(wrench.force_n.length()));
    let torque_n_m = wrench.torque_n_m.length();
    if torque_n_m > 0.0 { format!("{force}, {} N·m", text::figures(torque_n_m)) } else { force }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_names_a_round_force_whose_arrow_is_seen() {
        assert_eq!(scale_text(5e-3, 2.0).unwrap(), "Forces: 100 N is 500 mm");
        assert_eq!(scale_text(2e-2, 0.5).unwrap(), "Forces: 1 N is 20.0 mm");
        assert_eq!(scale_text(0.0, 2.0), None);
    }
}
