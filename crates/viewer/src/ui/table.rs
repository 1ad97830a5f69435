//! The table of agents: rate, step, resolution, age, cost and state, one row each.
//!
//! In: the [`Status`]. Out: the row that was pressed. Never here: sorting; rows keep the scene's order.

use super::protocol::{AgentRow, AgentState, Status};
use super::text;
use super::theme::{Palette, palette};
use egui::{Align2, Color32, FontId, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};
use metachron_core::{AgentId, Resolution, SolveLevel};

const ROW: f32 = 22.0;
/// The least width of the table, points.
const WIDTH_MIN: f32 = 1000.0;
/// Names of the columns, their relative widths, and whether they hold numbers.
const COLUMNS: [(&str, f32, bool); 12] = [
    ("Agent", 1.5, false),
    ("Model", 0.9, false),
    ("Rate / requested", 1.3, true),
    ("dt", 0.85, true),
    ("Simulation ε", 1.0, true),
    ("Nodes", 0.7, true),
    ("Picture ε, n", 1.2, true),
    ("Age", 0.85, true),
    ("Step cost", 0.9, true),
    ("CPU", 0.7, true),
    ("Contact", 1.0, true),
    ("State", 1.3, false),
];
/// A state older than this many of its own periods is stale.
const STALE_PERIODS: f64 = 3.0;

/// A press on the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Press {
    /// Clicked a row.
    Select(AgentId),
    /// Double-clicked a row.
    Frame(AgentId),
}

/// Draws the table.
pub fn show(ui: &mut Ui, status: &Status) -> Option<Press> {
    let mut press = None;
    let palette = palette(ui);
    // narrower than this, numbers would lose their first digits: the table scrolls horizontally instead
    let width = (ui.available_width() - 12.0).max(WIDTH_MIN);
    egui::ScrollArea::horizontal().auto_shrink([false, false]).show(ui, |ui| {
        ui.set_width(width);
        press = rows(ui, status, &column_edges(width), &palette);
    });
    press
}

fn rows(ui: &mut Ui, status: &Status, edges: &[f32], palette: &Palette) -> Option<Press> {
    let mut press = None;
    header(ui, edges, palette);
    ui.spacing_mut().item_spacing.y = 0.0;
    let area = egui::ScrollArea::vertical().auto_shrink([false, false]);
    area.show_rows(ui, ROW, status.agents.len(), |ui, range| {
        for row in &status.agents[range] {
            let selected = status.selected == Some(row.id);
            let response = agent(ui, row, edges, selected, palette);
            if response.double_clicked() {
                press = Some(Press::Frame(row.id));
            } else if response.clicked() {
                press = Some(Press::Select(row.id));
            }
        }
    });
    press
}

fn column_edges(width: f32) -> Vec<f32> {
    let total: f32 = COLUMNS.iter().map(|(_, share, _)| share).sum();
    let mut edges = vec![0.0];
    let mut at = 0.0;
    for (_, share, _) in COLUMNS {
        at += share * width / total;
        edges.push(at);
    }
    edges
}

fn header(ui: &mut Ui, edges: &[f32], palette: &Palette) {
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 18.0), Sense::hover());
    for (index, (name, _, number)) in COLUMNS.iter().enumerate() {
        let at = Cell { row: rect, edges, index, number: *number };
        cell(ui, &at, name, FontId::proportional(11.5), palette.weak);
    }
    ui.painter().hline(rect.x_range(), rect.bottom(), egui::Stroke::new(1.0, palette.line));
}

struct Cell<'a> {
    row: Rect,
    edges: &'a [f32],
    index: usize,
    number: bool,
}

fn cell(ui: &Ui, at: &Cell<'_>, text: &str, font: FontId, color: Color32) {
    let (left, right) = (at.row.left() + at.edges[at.index], at.row.left() + at.edges[at.index + 1]);
    let clip = Rect::from_x_y_ranges(left..=right - 4.0, at.row.y_range());
    let painter = ui.painter().with_clip_rect(clip.intersect(ui.clip_rect()));
    let y = at.row.center().y;
    if at.number {
        painter.text(pos2(right - 14.0, y), Align2::RIGHT_CENTER, text, font, color);
    } else {
        let inset = if at.index == 0 { 22.0 } else { 4.0 };
        painter.text(pos2(left + inset, y), Align2::LEFT_CENTER, text, font, color);
    }
}

fn agent(ui: &mut Ui, row: &AgentRow, edges: &[f32], selected: bool, palette: &Palette) -> egui::Response {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let texts = cells(row);
    response.widget_info(|| WidgetInfo::selected(Role::Row, true, selected, accessible_text(row, &texts)));
    if ui.is_rect_visible(rect) {
        if selected {
            ui.painter().rect_filled(rect, 4.0, palette.accent.gamma_multiply(0.22));
        } else if response.hovered() {
            ui.painter().rect_filled(rect, 4.0, palette.raised.gamma_multiply(0.6));
        }
        let dot = pos2(rect.left() + 10.0, rect.center().y);
        ui.painter().circle_filled(dot, 3.5, state_color(&row.state, palette));
        for (index, text) in texts.iter().enumerate() {
            let at = Cell { row: rect, edges, index, number: COLUMNS[index].2 };
            let font = if at.number { FontId::monospace(11.5) } else { FontId::proportional(12.5) };
            cell(ui, &at, text, font, cell_color(row, index, palette));
        }
    }
    if let AgentState::Parked(reason) = &row.state { response.on_hover_text(reason) } else { response }
}

fn cells(row: &AgentRow) -> [String; COLUMNS.len()] {
    let eps = |r: &Resolution| text::metres(r.eps_m);
    [
        row.name.clone(),
        row.model.clone(),
        format!("{:.0} / {:.0} Hz", row.rate_hz, row.wanted_hz),
        text::seconds(row.dt_s),
        row.simulation.as_ref().map_or_else(dash, eps),
        row.nodes.map_or_else(dash, |nodes| text::count(nodes.into())),
        row.picture
            .as_ref()
            .map_or_else(dash, |r| format!("{}, {}", row.simulation.as_ref().map_or_else(dash, |_| eps(r)), r.n)),
        text::seconds(row.age_s),
        text::seconds(row.step_s),
        format!("{:.1} %", 100.0 * row.cpu_share),
        row.contact.map_or_else(dash, |solve| format!("{}, {}", solve.level.name(), solve.factors)),
        state_text(row),
    ]
}

fn dash() -> String {
    "–".to_owned()
}

fn state_text(row: &AgentRow) -> String {
    let state = match &row.state {
        AgentState::Running => row.led_by.as_ref().map_or_else(|| "running".to_owned(), |by| format!("with {by}")),
        AgentState::Stalled => "stalled".to_owned(),
        AgentState::Resting => "resting".to_owned(),
        AgentState::Parked(reason) => format!("parked: {reason}"),
        AgentState::Gone => "gone".to_owned(),
    };
    row.host.iter().fold(state, |state, host| format!("{state}, on {host}"))
}

fn accessible_text(row: &AgentRow, texts: &[String; COLUMNS.len()]) -> String {
    format!("{}, {}, {}, dt {}, {}", row.name, row.model, texts[2], texts[3], texts[COLUMNS.len() - 1])
}

fn state_color(state: &AgentState, palette: &Palette) -> Color32 {
    match state {
        AgentState::Running => palette.good,
        AgentState::Stalled => palette.warn,
        AgentState::Resting | AgentState::Gone => palette.weak,
        AgentState::Parked(_) => palette.bad,
    }
}

fn cell_color(row: &AgentRow, index: usize, palette: &Palette) -> Color32 {
    let running = row.state == AgentState::Running;
    let behind = running && row.wanted_hz > 0.0 && row.rate_hz < 0.95 * row.wanted_hz;
    let stale = running && row.rate_hz > 0.0 && row.age_s * row.rate_hz > STALE_PERIODS;
    match index {
        0 => palette.text,
        1 => palette.weak,
        2 if behind => palette.warn,
        7 if stale => palette.warn,
        10 if row.contact.is_some_and(|solve| solve.level == SolveLevel::Interior) => palette.warn,
        11 if matches!(row.state, AgentState::Parked(_)) => palette.bad,
        11 if row.state == AgentState::Stalled => palette.warn,
        11 => palette.weak,
        _ => palette.text.gamma_multiply(0.9),
    }
}
