//! A lane of turns for every agent: rate, lateness, dt, ε, waiting and cluster over the last half minute.
//!
//! In: the rows of a [`Status`], while the lanes are shown. Out: the lane that was pressed. Never here: turns; a cell is what was counted in a
//! tenth of a second. Only lanes that fit are laid out, and what is kept is bounded ([`BYTES_MAX`]).

use super::protocol::{AgentRow, AgentState, Status};
use super::text;
use super::theme::{Palette, palette};
use egui::ecolor::Hsva;
use egui::{Align2, Color32, FontId, Mesh, Rect, Role, Sense, Shape, Ui, WidgetInfo, pos2, vec2};
use metachron_core::AgentId;
use std::collections::VecDeque;

/// Cells of a lane: half a minute.
pub const CELLS: usize = 300;
/// Time of a cell, seconds.
const CELL_S: f64 = 0.1;
/// Memory for all cells, bytes: 300 each of 4000 agents, fewer of more.
pub const BYTES_MAX: usize = 32 << 20;
/// Height of a lane, points, and width of the names.
const ROW: f32 = 18.0;
const NAMES: f32 = 132.0;
/// Room for the scroll bar, points.
const BAR: f32 = 14.0;

/// The turns of an agent in a tenth of a second.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cell {
    rate_hz: f32,
    wanted_hz: f32,
    late_s: f32,
    dt_s: f32,
    /// Not a number where it has none.
    eps_m: f32,
    /// By how much its time was put off meanwhile.
    waited_s: f32,
    /// The leader of its cluster; `None` of an agent that is alone.
    leader: Option<AgentId>,
    kind: Kind,
}

/// What it was doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Steps,
    Rests,
    Parked,
    Gone,
}

/// All agents at one time.
#[derive(Debug, Clone, Default)]
struct Column {
    sim_s: f64,
    cells: Vec<Cell>,
}

/// The cells that are kept.
#[derive(Debug, Clone, Default)]
pub struct Lanes {
    columns: VecDeque<Column>,
    sampled_s: Option<f64>,
    /// How far each agent's time was put off at the last sample, seconds.
    put_off_s: Vec<f64>,
}

impl Lanes {
    /// Appends the agents' numbers at wall time `at_s`, ten times a second while simulated time passes.
    pub fn sample(&mut self, at_s: f64, status: &Status) {
        let stands = self.columns.back().is_some_and(|last| last.sim_s == status.sim_time.as_secs_f64());
        if stands || self.sampled_s.is_some_and(|last| (0.0..CELL_S).contains(&(at_s - last))) {
            return;
        }
        self.sampled_s = Some(at_s);
        let each = status.agents.len().max(1) * size_of::<Cell>();
        let most = (BYTES_MAX / each).clamp(1, CELLS);
        let mut column = Column::default();
        while self.columns.len() >= most {
            column = self.columns.pop_front().unwrap_or_default();
        }
        column.sim_s = status.sim_time.as_secs_f64();
        column.cells.clear();
        self.put_off_s.resize(status.agents.len(), 0.0);
        let rows = status.agents.iter().zip(&mut self.put_off_s);
        column.cells.extend(rows.map(|(row, before_s)| {
            let waited_s = (row.put_off_s - std::mem::replace(before_s, row.put_off_s)).max(0.0);
            Cell::of(row, waited_s)
        }));
        self.columns.push_back(column);
    }

    /// Gives up what is kept: nobody looks at it.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    fn cell(&self, column: usize, row: usize) -> Option<(f64, &Cell)> {
        let column = self.columns.get(column)?;
        Some((column.sim_s, column.cells.get(row)?))
    }
}

impl Cell {
    fn of(row: &AgentRow, waited_s: f64) -> Self {
        Self {
            rate_hz: row.rate_hz as f32,
            wanted_hz: row.wanted_hz as f32,
            late_s: row.late_s as f32,
            dt_s: row.dt_s as f32,
            eps_m: row.simulation.map_or(f32::NAN, |resolution| resolution.eps_m as f32),
            waited_s: waited_s as f32,
            leader: row.leader,
            kind: match row.state {
                AgentState::Running => Kind::Steps,
                AgentState::Resting => Kind::Rests,
                AgentState::Parked(_) => Kind::Parked,
                AgentState::Gone => Kind::Gone,
            },
        }
    }

    /// Fraction of the requested rate, as the height of the cell.
    fn share(&self) -> f32 {
        match self.kind {
            Kind::Steps if self.wanted_hz > 0.0 => (self.rate_hz / self.wanted_hz).clamp(0.08, 1.0),
            Kind::Gone => 0.0,
            _ => 0.08,
        }
    }

    fn is_late(&self) -> bool {
        self.kind == Kind::Steps && self.late_s > self.dt_s
    }

    fn color(&self, palette: &Palette) -> Color32 {
        match self.kind {
            Kind::Parked => palette.bad,
            Kind::Rests | Kind::Gone => palette.weak.gamma_multiply(0.5),
            Kind::Steps => self.leader.map_or(palette.good, cluster_color),
        }
    }

    fn text(&self, name: &str, sim_s: f64, leader: Option<&str>) -> String {
        let what = match self.kind {
            Kind::Steps => format!("{:.0} of {:.0} Hz", self.rate_hz, self.wanted_hz),
            Kind::Rests => "at rest".to_owned(),
            Kind::Parked => "parked".to_owned(),
            Kind::Gone => "gone".to_owned(),
        };
        let eps = if self.eps_m.is_nan() { "–".to_owned() } else { text::metres(self.eps_m.into()) };
        let cluster = leader.map_or_else(|| "alone".to_owned(), |leader| format!("cluster of {leader}"));
        format!(
            "{name} at {sim_s:.2} s\n{what}\nlate {}\ndt {}\nε {eps}\nwaited {}\n{cluster}",
            text::seconds(self.late_s.into()),
            text::seconds(self.dt_s.into()),
            text::seconds(self.waited_s.into()),
        )
    }
}

/// A colour for a cluster: neighbouring numbers are far apart.
fn cluster_color(leader: AgentId) -> Color32 {
    const GOLDEN: f32 = 0.618_034;
    Hsva::new((0.6 + leader.0 as f32 * GOLDEN).fract(), 0.55, 0.85, 1.0).into()
}

/// Draws the lanes; returns the agent whose lane was pressed.
pub fn show(ui: &mut Ui, status: &Status, lanes: &Lanes) -> Option<AgentId> {
    let mut pressed = None;
    ui.spacing_mut().item_spacing.y = 0.0;
    let area = egui::ScrollArea::vertical().id_salt("lanes").auto_shrink([false, false]);
    area.show_rows(ui, ROW, status.agents.len(), |ui, range| {
        for at in range {
            let response = lane(ui, status, lanes, at);
            if response.clicked() {
                pressed = Some(status.agents[at].id);
            }
        }
    });
    pressed
}

fn lane(ui: &mut Ui, status: &Status, lanes: &Lanes, at: usize) -> egui::Response {
    let palette = palette(ui);
    let row = &status.agents[at];
    let selected = status.selected == Some(row.id);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    response.widget_info(|| WidgetInfo::selected(Role::Row, true, selected, format!("Lane of {}", row.name)));
    if !ui.is_rect_visible(rect) {
        return response;
    }
    if selected {
        ui.painter().rect_filled(rect, 3.0, palette.accent.gamma_multiply(0.22));
    }
    let names = rect.with_max_x(rect.left() + NAMES);
    let color = if selected { palette.text } else { palette.weak };
    let clip = ui.painter().with_clip_rect(names.intersect(ui.clip_rect()));
    clip.text(names.left_center() + vec2(6.0, 0.0), Align2::LEFT_CENTER, &row.name, FontId::proportional(12.0), color);
    // the scroll bar lies over the right end
    let cells = Rect::from_x_y_ranges(names.right()..=rect.right() - BAR, rect.y_range().shrink(2.0));
    ui.painter().add(Shape::mesh(cells_mesh(lanes, at, cells, &palette)));
    let width = cells.width() / CELLS as f32;
    let column = |x: f32| {
        let from = cells.right() - width * lanes.columns.len() as f32;
        (x >= from).then(|| ((x - from) / width) as usize)
    };
    let hovered = response.hover_pos().and_then(|pos| lanes.cell(column(pos.x)?, at));
    let Some((sim_s, cell)) = hovered else { return response };
    let leader = cell.leader.and_then(|leader| status.agents.get(leader.0 as usize)).map(|row| row.name.as_str());
    response.on_hover_text(cell.text(&row.name, sim_s, leader))
}

/// The cells of a lane, the newest at the right: as high as the rate; a dark red foot where late, an amber cap where time was put off.
fn cells_mesh(lanes: &Lanes, at: usize, rect: Rect, palette: &Palette) -> Mesh {
    let mut mesh = Mesh::default();
    let width = rect.width() / CELLS as f32;
    for (back, column) in lanes.columns.iter().rev().enumerate() {
        let Some(cell) = column.cells.get(at) else { continue };
        let right = rect.right() - width * back as f32;
        let part = |low: f32, high: f32| {
            let y = |share: f32| rect.bottom() - share * rect.height();
            Rect::from_min_max(pos2(right - width, y(high)), pos2(right, y(low)))
        };
        mesh.add_colored_rect(part(0.0, cell.share()), cell.color(palette));
        if cell.is_late() {
            mesh.add_colored_rect(part(0.0, 0.25), palette.bad);
        }
        if cell.waited_s > 0.0 {
            mesh.add_colored_rect(part(0.8, 1.0), palette.warn);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_core::SimTime;

    fn status(agents: u32, tick: u64) -> Status {
        let row = |i| AgentRow { put_off_s: 1e-3 * tick as f64, ..AgentRow::new(AgentId(i), "a", "rigid") };
        let sim_time = SimTime::from_nanos(100_000_000 * tick);
        Status { sim_time, agents: (0..agents).map(row).collect(), ..Status::default() }
    }

    #[test]
    fn what_is_kept_of_many_agents_is_bounded() {
        for (agents, most) in [(10, CELLS), (20_000, CELLS)] {
            let mut lanes = Lanes::default();
            (0..most as u64 + 20).for_each(|tick| lanes.sample(0.1 * tick as f64 + 1e-3, &status(agents, tick)));
            let bytes = lanes.columns.len() * agents as usize * size_of::<Cell>();
            assert!(bytes <= BYTES_MAX && lanes.columns.len() <= CELLS, "{bytes} bytes of {agents}");
        }
    }

    #[test]
    fn a_cell_says_how_long_its_agent_has_waited_since_the_last() {
        let mut lanes = Lanes::default();
        (0..3).for_each(|tick| lanes.sample(0.2 * tick as f64, &status(1, tick)));
        lanes.sample(9.0, &status(1, 2));
        assert_eq!(lanes.columns.len(), 3, "time stands: nothing is added");
        let (sim_s, cell) = lanes.cell(2, 0).unwrap();
        assert!((sim_s - 0.2).abs() < 1e-12 && (cell.waited_s - 1e-3).abs() < 1e-9, "{cell:?}");
    }
}
