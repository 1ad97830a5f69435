//! The list of couplings: the pair of agents, its law, its force, and how deep the two are in each other.
//!
//! In: the rows of a [`crate::ui::Status`]. Out: a section of the side panel. Never here: the choice of couplings.

use super::protocol::CouplingRow;
use super::text;
use super::theme::palette;
use egui::{Grid, RichText, Ui};

/// The columns and their tooltips.
const COLUMNS: [(&str, &str); 4] = [
    ("Pair", "The two agents"),
    ("Law", "Contact law"),
    ("Force", "Present contact, grasp or joint force"),
    ("Depth", "The deepest overlap"),
];

/// More rows than this are counted, not listed.
const ROWS_MAX: usize = 8;

/// Draws the list, the strongest first.
pub fn show(ui: &mut Ui, couplings: &[CouplingRow]) {
    let palette = palette(ui);
    let mut order: Vec<&CouplingRow> = couplings.iter().collect();
    order.sort_by(|a, b| b.force_n.total_cmp(&a.force_n));
    Grid::new("couplings").num_columns(COLUMNS.len()).spacing([10.0, 2.0]).show(ui, |ui| {
        for (name, meaning) in COLUMNS {
            ui.label(RichText::new(name).size(11.5).color(palette.weak)).on_hover_text(meaning);
        }
        ui.end_row();
        for row in order.iter().take(ROWS_MAX) {
            ui.label(RichText::new(format!("{} – {}", row.a, row.b)).size(12.0));
            ui.label(RichText::new(row.kind).size(11.5).color(palette.weak));
            let force = ui.label(RichText::new(format!("{} N", text::figures(row.force_n))).monospace().size(11.5));
            if let Some(inverse_masses) = row.inverse_mass_per_kg {
                force.on_hover_text(effective_mass_text(row, inverse_masses));
            }
            let depth = RichText::new(text::metres(row.penetration_m)).monospace().size(11.5).color(palette.weak);
            ui.label(depth).on_hover_text(format!("{} contacts", row.contacts));
            ui.end_row();
        }
    });
    if couplings.len() > ROWS_MAX {
        ui.label(RichText::new(format!("and {} more", couplings.len() - ROWS_MAX)).size(11.5).color(palette.weak));
    }
}

/// Tooltip: the effective mass of both at the contact with the largest force.
fn effective_mass_text(row: &CouplingRow, [a, b]: [f64; 2]) -> String {
    let inverse_masses = |inverse_mass: f64| text::kilograms(inverse_mass.recip());
    format!(
        "Effective mass at the contact with the largest force: {} ({} {}, {} {})",
        inverse_masses(a + b),
        row.a,
        inverse_masses(a),
        row.b,
        inverse_masses(b)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    #[test]
    fn every_column_has_a_heading_above_it() {
        let row = CouplingRow {
            a: "hose".to_owned(),
            b: "floor".to_owned(),
            kind: "ledger",
            contacts: 1,
            force_n: 1.25,
            penetration_m: 2e-3,
            inverse_mass_per_kg: None,
        };
        let harness = Harness::new_ui(|ui| show(ui, std::slice::from_ref(&row)));
        let cells = ["hose – floor", "ledger", "1.25 N", &text::metres(2e-3)];
        for ((heading, _), cell) in COLUMNS.iter().zip(cells) {
            let (above, below) = (harness.get_by_label(heading).rect(), harness.get_by_label(cell).rect());
            assert!(above.bottom() <= below.top() && above.left() == below.left(), "{heading}: {above:?} {below:?}");
        }
    }

    #[test]
    fn the_tooltip_gives_the_effective_mass_of_both_agents_and_of_the_pair() {
        let row = CouplingRow {
            a: "hose".to_owned(),
            b: "floor".to_owned(),
            kind: "ledger",
            contacts: 1,
            force_n: 1.0,
            penetration_m: 0.0,
            inverse_mass_per_kg: None,
        };
        let tooltip = |pair| effective_mass_text(&row, pair);
        assert_eq!(
            tooltip([60.0, 20.0]),
            "Effective mass at the contact with the largest force: 12.5 g (hose 16.7 g, floor 50.0 g)"
        );
        // a driven body has no inverse mass: it does not give way at all
        assert!(tooltip([0.5, 0.0]).ends_with("(hose 2.00 kg, floor immovable)"));
    }
}
