//! A lane for every agent: its turns over the last seconds of wall time (of virtual time in lockstep), each from its begin to its end.
//!
//! In: the turns of the agents whose lanes are shown, frame by frame. Out: the lane that was pressed. Never here: how turns come about.
//! Only lanes that fit are laid out, only their agents are asked, and of each at most [`TURNS_MAX`] turns are kept while its lane is shown.

use super::protocol::{AgentRow, AgentState, Simulation, Status, TurnRow};
use super::text;
use super::theme::{Palette, palette};
use egui::ecolor::Hsva;
use egui::{Align2, Color32, FontId, Mesh, Rect, Role, Sense, Shape, Ui, WidgetInfo, pos2, vec2};
use metachron_core::AgentId;
use std::collections::{BTreeMap, VecDeque};

/// Turns that are kept of a lane: two seconds at 1 kHz.
pub const TURNS_MAX: usize = 2048;
/// Seconds from the left end of a lane to the right at first, and how far the wheel zooms.
const SPAN_S: f64 = 2.0;
const SPAN_RANGE_S: [f64; 2] = [1e-3, 60.0];
/// Height of a lane, points, and width of the names.
const ROW: f32 = 18.0;
const NAMES: f32 = 132.0;
/// Room for the scroll bar, points.
const BAR: f32 = 14.0;
/// Width of the narrowest turn, points.
const THIN: f32 = 1.0;

/// The lanes that are shown.
#[derive(Debug, Clone)]
pub struct Lanes {
    lanes: BTreeMap<AgentId, Lane>,
    /// Whose lanes were laid out in the last frame.
    visible: Vec<AgentId>,
    span_s: f64,
}

impl Default for Lanes {
    fn default() -> Self {
        Self { lanes: BTreeMap::new(), visible: Vec::new(), span_s: SPAN_S }
    }
}

impl Lanes {
    /// Takes the turns that agents with a lane have made since the last frame, and gives up the turns of all others.
    pub fn gather(&mut self, simulation: &mut dyn Simulation) {
        let visible = std::mem::take(&mut self.visible);
        self.lanes.retain(|id, _| visible.contains(id));
        for id in visible {
            let lane = self.lanes.entry(id).or_default();
            simulation.turns(id, &mut |turn| lane.push(turn));
        }
    }

    /// Gives up all kept turns: the lanes are not shown.
    pub fn clear(&mut self) {
        (self.lanes, self.visible) = (BTreeMap::new(), Vec::new());
    }

    /// The end of the newest turn of all, seconds: the right end of the lanes.
    fn newest_s(&self) -> f64 {
        self.lanes.values().filter_map(|lane| lane.turns.back()).fold(0.0, |newest, turn| newest.max(turn.ended_s))
    }
}

/// The newest turns of an agent, by their begin.
#[derive(Debug, Clone, Default)]
struct Lane {
    turns: VecDeque<TurnRow>,
}

impl Lane {
    /// Appends a turn; waits that follow each other are one, which ends with the next step at the latest.
    fn push(&mut self, turn: TurnRow) {
        if let Some(last) = self.turns.back_mut() {
            if turn.begun_s < last.begun_s {
                // the run began again, or was put back
                self.turns.clear();
            } else if last.waits() && turn.waits() {
                last.ended_s = turn.ended_s;
                return;
            } else if last.waits() {
                last.ended_s = last.ended_s.min(turn.begun_s);
            }
        }
        while self.turns.len() >= TURNS_MAX {
            self.turns.pop_front();
        }
        self.turns.push_back(turn);
    }

    /// The number of the last turn that goes on at a moment, give or take `by_s`.
    fn at(&self, at_s: f64, by_s: f64) -> Option<usize> {
        self.turns.iter().rposition(|turn| turn.begun_s - by_s <= at_s && at_s <= turn.ended_s + by_s)
    }

    /// How long it had waited for others when a turn began, seconds.
    fn waited_s(&self, number: usize) -> f64 {
        let before = number.checked_sub(1).and_then(|before| self.turns.get(before));
        before.filter(|before| before.waits()).map_or(0.0, TurnRow::took_s)
    }

    /// A turn in words; `cluster` is whose cluster it is in.
    fn text(&self, name: &str, number: usize, cluster: &str) -> String {
        let turn = &self.turns[number];
        let (at_s, took) = (turn.time.as_secs_f64(), text::seconds(turn.took_s()));
        let begun_s = turn.begun_s;
        if turn.waits() {
            return format!("{name} at {at_s:.4} s\nwaits for others {took}, from {begun_s:.4} s\n{cluster}");
        }
        let eps = turn.eps_m.map_or_else(|| "–".to_owned(), text::metres);
        format!(
            "{name} at {at_s:.4} s\nbegun at {begun_s:.4} s, took {took}\ndt {}\nlate {}\nwaited {}\ngiven up {}\nε {eps}\n{cluster}",
            text::seconds(turn.dt_s),
            text::seconds(turn.late_s),
            text::seconds(self.waited_s(number)),
            text::seconds(turn.dropped_s),
        )
    }
}

impl TurnRow {
    /// Whether it made no step.
    fn waits(&self) -> bool {
        self.dt_s == 0.0
    }

    fn took_s(&self) -> f64 {
        (self.ended_s - self.begun_s).max(0.0)
    }

    /// Whether it began later than by its step.
    fn is_late(&self) -> bool {
        self.late_s > self.dt_s
    }
}

/// A colour for a cluster: neighbouring numbers are far apart.
fn cluster_color(leader: AgentId) -> Color32 {
    const GOLDEN: f32 = 0.618_034;
    Hsva::new((0.6 + leader.0 as f32 * GOLDEN).fract(), 0.55, 0.85, 1.0).into()
}

/// The leader of the cluster that a turn of an agent was in; `None` of one that is alone.
fn leader(row: &AgentRow, turn: &TurnRow) -> Option<AgentId> {
    // its own turn is also that of one that leads others
    (turn.leader != row.id || row.leader == Some(row.id)).then_some(turn.leader)
}

/// Draws the lanes; returns the agent whose lane was pressed.
pub fn show(ui: &mut Ui, status: &Status, lanes: &mut Lanes) -> Option<AgentId> {
    if ui.rect_contains_pointer(ui.max_rect()) {
        let zoom = f64::from(ui.input(egui::InputState::zoom_delta));
        lanes.span_s = (lanes.span_s / zoom).clamp(SPAN_RANGE_S[0], SPAN_RANGE_S[1]);
    }
    let palette = palette(ui);
    ui.spacing_mut().item_spacing.y = 0.0;
    let across = format!("{} across, Ctrl+wheel zooms", text::seconds(lanes.span_s));
    ui.vertical_centered(|ui| ui.label(egui::RichText::new(across).size(10.0).color(palette.weak)));
    let shown = Shown { newest_s: lanes.newest_s(), span_s: lanes.span_s, palette };
    let (mut pressed, mut visible) = (None, Vec::new());
    let area = egui::ScrollArea::vertical().id_salt("lanes").auto_shrink([false, false]);
    area.show_rows(ui, ROW, status.agents.len(), |ui, range| {
        for row in &status.agents[range] {
            visible.push(row.id);
            if shown.lane(ui, status, row, lanes.lanes.get(&row.id)).clicked() {
                pressed = Some(row.id);
            }
        }
    });
    lanes.visible = visible;
    pressed
}

/// How lanes are drawn in a frame.
struct Shown {
    newest_s: f64,
    span_s: f64,
    palette: Palette,
}

impl Shown {
    fn lane(&self, ui: &mut Ui, status: &Status, row: &AgentRow, lane: Option<&Lane>) -> egui::Response {
        let palette = &self.palette;
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
        let at = names.left_center() + vec2(6.0, 0.0);
        clip.text(at, Align2::LEFT_CENTER, &row.name, FontId::proportional(12.0), color);
        // the scroll bar lies over the right end
        let turns = Rect::from_x_y_ranges(names.right()..=rect.right() - BAR, rect.y_range().shrink(2.0));
        // a line on which turns stand
        let ground = if matches!(row.state, AgentState::Parked(_)) { palette.bad } else { palette.weak };
        ui.painter().hline(turns.x_range(), turns.bottom(), (1.0, ground.gamma_multiply(0.5)));
        let Some(lane) = lane else { return response };
        ui.painter().add(Shape::mesh(self.mesh(row, lane, turns)));
        let Some(pointer) = response.hover_pos().filter(|pos| turns.x_range().contains(pos.x)) else { return response };
        let per_point_s = self.span_s / f64::from(turns.width());
        let at_s = self.newest_s - f64::from(turns.right() - pointer.x) * per_point_s;
        let words = match lane.at(at_s, per_point_s * f64::from(THIN)) {
            Some(number) => {
                let leader = leader(row, &lane.turns[number]).and_then(|leader| status.agents.get(leader.0 as usize));
                let cluster = leader.map_or_else(|| "alone".to_owned(), |leader| format!("cluster of {}", leader.name));
                lane.text(&row.name, number, &cluster)
            }
            None => match &row.state {
                AgentState::Running => return response,
                AgentState::Stalled => format!("{} is in a step that lasts too long", row.name),
                AgentState::Resting => format!("{} is at rest", row.name),
                AgentState::Parked(why) => format!("{} is parked: {why}", row.name),
                AgentState::Gone => format!("{} is gone", row.name),
            },
        };
        response.on_hover_text(words)
    }

    /// The turns of a lane: a bar each, with a dark red foot from when it was due where that was more than its step before; an amber cap where
    /// it waited. Of turns that are narrower than a point one a point is drawn.
    fn mesh(&self, row: &AgentRow, lane: &Lane, rect: Rect) -> Mesh {
        let mut mesh = Mesh::default();
        let x = |at_s: f64| {
            let back = ((self.newest_s - at_s) / self.span_s).clamp(0.0, 2.0) as f32;
            rect.right() - back * rect.width()
        };
        let part = |from: f32, to: f32, low: f32, high: f32| {
            let y = |share: f32| rect.bottom() - share * rect.height();
            let [from, to] = [from, to].map(|x| x.clamp(rect.left(), rect.right()));
            Rect::from_min_max(pos2(from, y(high)), pos2(to, y(low)))
        };
        // how far to the left bars and feet have come
        let (mut bars, mut feet) = (f32::INFINITY, f32::INFINITY);
        for turn in lane.turns.iter().rev().take_while(|turn| x(turn.ended_s) >= rect.left()) {
            let (from, to) = (x(turn.begun_s), x(turn.ended_s));
            if from <= bars - THIN {
                let (color, low) = match (turn.waits(), leader(row, turn)) {
                    (true, _) => (self.palette.warn, 0.8),
                    (false, None) => (self.palette.good, 0.0),
                    (false, Some(leader)) => (cluster_color(leader), 0.0),
                };
                mesh.add_colored_rect(part(from, to.max(from + THIN).min(bars), low, 1.0), color);
                bars = from;
            }
            let due = x(turn.begun_s - turn.late_s);
            if turn.is_late() && due <= feet - THIN {
                mesh.add_colored_rect(part(due, to.max(due + THIN).min(feet), 0.0, 0.25), self.palette.bad);
                feet = due;
            }
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_core::SimTime;

    fn turn(begun_s: f64, dt_s: f64) -> TurnRow {
        TurnRow {
            begun_s,
            ended_s: begun_s + 1e-3,
            time: SimTime::ZERO,
            dt_s,
            eps_m: None,
            leader: AgentId(0),
            late_s: 0.0,
            dropped_s: 0.0,
        }
    }

    fn lane(turns: impl Iterator<Item = TurnRow>) -> Lane {
        let mut lane = Lane::default();
        turns.for_each(|turn| lane.push(turn));
        lane
    }

    #[test]
    fn what_is_kept_and_what_is_drawn_of_many_turns_is_bounded() {
        let lane = lane((0..100_000).map(|k| turn(1e-5 * f64::from(k), 1e-5)));
        assert_eq!(
            (lane.turns.len(), lane.turns[0].begun_s),
            (TURNS_MAX, 1e-5 * f64::from(100_000 - TURNS_MAX as u32))
        );
        let palette = super::super::theme::DARK;
        let shown = Shown { newest_s: 1.0, span_s: 0.1, palette };
        let rect = Rect::from_min_max(pos2(0.0, 0.0), pos2(100.0, 10.0));
        let mesh = shown.mesh(&AgentRow::new(AgentId(0), "a", "rigid"), &lane, rect);
        let drawn = mesh.vertices.len() / 4;
        // 20 ms of turns are a fifth of the lane
        assert!((15..=21).contains(&drawn), "{drawn} bars for 20 points");
        assert!(mesh.vertices.iter().all(|vertex| (78.0..=100.0).contains(&vertex.pos.x)));
    }

    #[test]
    fn nothing_is_drawn_beyond_the_ends_of_a_lane() {
        // each was due long before the left end
        let late =
            (0..20).map(|k| TurnRow { late_s: 10.0 + 0.1 * f64::from(k), ..turn(0.9 + 0.01 * f64::from(k), 1e-3) });
        let shown = Shown { newest_s: 1.0, span_s: 0.1, palette: super::super::theme::DARK };
        let rect = Rect::from_min_max(pos2(150.0, 0.0), pos2(250.0, 10.0));
        let mesh = shown.mesh(&AgentRow::new(AgentId(0), "a", "rigid"), &lane(late), rect);
        let drawn: Vec<f32> = mesh.vertices.iter().map(|vertex| vertex.pos.x).collect();
        assert!(drawn.len() > 20 && drawn.iter().all(|x| (150.0..=250.0).contains(x)), "{drawn:?}");
    }

    #[test]
    fn waits_that_follow_each_other_are_one_and_the_next_step_says_how_long() {
        let lane = lane([turn(1.0, 1e-3), turn(1.01, 0.0), turn(1.02, 0.0), turn(1.0205, 1e-3)].into_iter());
        let lengths: Vec<f64> = lane.turns.iter().map(|turn| (turn.took_s() * 1e4).round() / 1e4).collect();
        assert_eq!(lengths, [1e-3, 0.0105, 1e-3]);
        assert!((lane.waited_s(2) - 0.0105).abs() < 1e-9 && lane.waited_s(1) == 0.0);
        assert_eq!((lane.at(1.015, 0.0), lane.at(1.005, 0.0)), (Some(1), None));
    }

    #[test]
    fn a_run_that_begins_again_has_no_turns_of_the_one_before() {
        let lane = lane([turn(5.0, 1e-3), turn(6.0, 1e-3), turn(0.5, 1e-3)].into_iter());
        assert_eq!(lane.turns.len(), 1);
    }
}
