//! The ends of transmission lines at one agent: links and contacts by wave variables.
//!
//! In: the ends of partners as they published them. Out: rows for the cluster's problem, and the waves that this end
//! sends. Never here: the law of a line (`transmission_line.rs`), the other end, which does the same for itself.
//! Theory: docs/theory/coupling.md, eq. 10 to 11.

use crate::lists::entry;
use crate::member::{Participant, SkinPoint};
use crate::remote::ledgers::state_of;
use crate::remote::published_shape::PublishedShape;
use crate::remote::transmission_line::{Line, LineLaw, LineStep};
use crate::solve::{Hold, Side};
use crate::step::{ClusterStepper, KnownImpulse, LineRow};
use crate::{Law, Link, Neighbour};
use glam::DVec3;
use metachron_core::{AgentId, Archive, ArchiveError, PairKind, PairState};
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
use metachron_geometry::{ContactSide, Place, Touch};

/// Below this slip speed, m/s, friction is proportional to the slip.
const STICK_M_S: f64 = 1e-3;

/// The lines of one agent: one to a partner.
#[derive(Default)]
pub(crate) struct Lines {
    /// By rising numbers of the partners.
    all: Vec<LineAt>,
    shape: PublishedShape,
    narrow: NarrowPhaseScratch,
    touches: Vec<Touch>,
}

/// The line to a partner.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
struct LineAt {
    with: AgentId,
    line: Line,
    /// Its row in this macro step; `None` where it is slack.
    #[serde(skip)]
    row: Option<LineNow>,
    /// The push of the last step, N.
    pushed_n: f64,
}

/// A line within a macro step.
#[derive(Debug, Clone, Copy)]
struct LineNow {
    number: usize,
    law: LineLaw,
    contacts: u32,
    depth_m: f64,
}

/// Where another body presses on a member, all places as one (eq. 10a).
struct Pressed {
    side: Side,
    led_m_s: DVec3,
    /// Away from the other body, of length one.
    normal: DVec3,
    /// Velocity of the other body there, m/s.
    far_m_s: DVec3,
    depth_m: f64,
    places: u32,
}

impl Lines {
    /// Writes or reads the state that the next macro step needs.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.value(&mut self.all)
    }

    /// Lays out the rows of all lines for a macro step of `dt_s` seconds.
    pub fn lay_out(&mut self, place: usize, one: &Participant<'_>, stepper: &mut ClusterStepper, dt_s: f64) {
        for line in &mut self.all {
            line.row = None;
            line.line.open();
        }
        let context = one.context;
        for other in context.neighbours {
            if let (Law::Tlm { stiffness_n_m, damping_n_s_m }, Some(_)) = (other.law, &other.form) {
                self.contact(&LineEnd { place, one, other, stiffness_n_m, damping_n_s_m, dt_s }, stepper);
            }
            let line = context.links.iter().find(|link| link.other == other.id && matches!(link.law, Law::Tlm { .. }));
            if let Some((link, Law::Tlm { stiffness_n_m, damping_n_s_m })) = line.map(|link| (link, link.law)) {
                self.link(&LineEnd { place, one, other, stiffness_n_m, damping_n_s_m, dt_s }, link, stepper);
            }
        }
    }

    /// Takes over the waves read in the step, which is made.
    pub fn settle(&mut self) {
        self.all.iter_mut().for_each(|line| line.line.settle());
    }

    /// A link: a line from point to point.
    fn link(&mut self, end: &LineEnd<'_, '_>, link: &Link, stepper: &mut ClusterStepper) {
        let LineEnd { place, one, other, stiffness_n_m, damping_n_s_m, dt_s } = *end;
        let at = one.context.time;
        let Some((far_m, far_m_s)) = other.snapshot.body.point(link.there) else { return };
        let Some(here) = one.member.anchor(link.here) else { return };
        let way = far_m + far_m_s * at.secs_after(other.snapshot.time) - here.position;
        let line = self.line(other.id, stiffness_n_m);
        if other.computed_here {
            line.line.begin(way, at);
        }
        let arriving = line.listen(one, other, dt_s);
        let law = line.line.law(&LineStep { at, dt_s, far_m_s, way, arriving, rest_m: link.rest_m, damping_n_s_m });
        let row = law.row(place, here.side, here.led_m_s, law.along.map_or(Hold::ALL, Hold::along));
        line.add(stepper, row, LineNow { number: 0, law, contacts: 1, depth_m: 0.0 });
    }

    /// Contact: one line along the mean normal that only pushes, with friction by the push of the last step.
    fn contact(&mut self, end: &LineEnd<'_, '_>, stepper: &mut ClusterStepper) {
        let LineEnd { place, one, other, stiffness_n_m, damping_n_s_m, dt_s } = *end;
        let pressed = self.pressed(one, other);
        let line = self.line(other.id, stiffness_n_m);
        let arriving = line.listen(one, other, dt_s);
        let Some(Pressed { side, led_m_s, normal, far_m_s, depth_m, places }) = pressed else {
            line.pushed_n = 0.0;
            return;
        };
        let along = |v: DVec3| normal * normal.dot(v);
        let (arriving, z) = (along(arriving), line.line.impedance());
        let law = LineLaw {
            drive_n: -arriving + along(far_m_s) * damping_n_s_m,
            resistance_n_s_m: z + damping_n_s_m,
            along: Some(normal),
            arriving,
        };
        let velocity = side.velocity(one.member.system().velocities) + led_m_s - far_m_s;
        let slip = velocity - along(velocity);
        let forms = one.member.skin().map(|skin| skin.form).zip(other.form.as_deref());
        let friction = forms.map_or(0.0, |(mine, theirs)| mine.friction_with(theirs));
        let rub = slip * (-friction * line.pushed_n / slip.length().max(STICK_M_S));
        stepper.external().known.push(KnownImpulse { member: place, side, impulse: rub * dt_s });
        let row = law.row(place, side, led_m_s, Hold::pushing(normal));
        line.add(stepper, row, LineNow { number: 0, law, contacts: places, depth_m });
    }

    /// Where another body overlaps a member.
    fn pressed(&mut self, one: &Participant<'_>, other: &Neighbour) -> Option<Pressed> {
        let Self { shape, narrow, touches: found, .. } = self;
        let since_s = one.context.time.secs_after(other.snapshot.time);
        let (skin, form) = (one.member.skin()?, other.form.as_deref()?);
        found.clear();
        if shape.bring(&other.snapshot.body, since_s) {
            touches(&skin, &shape.placed(form)?, 0.0, narrow, found);
        }
        found.retain(|touch| touch.gap_m < 0.0);
        let deepest = *found.iter().min_by(|a, b| a.gap_m.total_cmp(&b.gap_m))?;
        let whole: f64 = found.iter().map(|touch| -touch.gap_m).sum();
        let normal: DVec3 = found.iter().map(|touch| touch.normal * -touch.gap_m).sum();
        let normal = normal.try_normalize()?;
        // points of bodies that move as a whole have a mean
        let middle = |of: fn(&Touch) -> Place| {
            found.iter().try_fold(DVec3::ZERO, |sum, touch| match of(touch) {
                Place::Point(at) => Some(sum + at * (-touch.gap_m / whole)),
                _ => None,
            })
        };
        let (mine, theirs) = (middle(|touch| touch.on_a), middle(|touch| touch.on_b));
        let place = mine.map_or(deepest.on_a, Place::Point);
        let far_m_s = shape.velocity(&other.snapshot.body, &theirs.map_or(deepest.on_b, Place::Point));
        let SkinPoint { side, led_m_s, .. } = one.member.skin_point(&place, ContactSide::first(normal));
        Some(Pressed { side, led_m_s, normal, far_m_s, depth_m: -deepest.gap_m, places: found.len() as u32 })
    }

    /// Sends the answers of the ends at `place`, and writes the states of the pairs.
    pub fn answer(&mut self, place: usize, stepper: &mut ClusterStepper, states: &mut Vec<PairState>, dt_s: f64) {
        let external = stepper.external();
        for line in &mut self.all {
            let state = state_of(states, line.with, PairKind::Tlm);
            (state.contacts, state.force_n, state.penetration_m) = (0, 0.0, 0.0);
            if let Some(now) = line.row {
                debug_assert_eq!(external.lines[now.number].member, place);
                let force = external.line_impulses[now.number] / dt_s;
                // a slack contact pushes nothing into its line
                if force == DVec3::ZERO && matches!(external.lines[now.number].hold, Hold::Along { low_n_s: 0.0, .. }) {
                    line.line.send(now.law.arriving, DVec3::ZERO, dt_s);
                } else {
                    line.line.answer(&now.law, force, dt_s);
                }
                line.pushed_n = force.length();
                (state.contacts, state.penetration_m, state.force_n) = (now.contacts, now.depth_m, force.length());
                state.impulse_n_s += force.length() * dt_s;
            }
            (state.kind, state.parasitic_kg) = (PairKind::Tlm, line.line.parasitic_kg());
            state.wave = Some(line.line.wave());
        }
    }

    /// The line to `with`; a new one where there is none.
    fn line(&mut self, with: AgentId, stiffness_n_m: f64) -> &mut LineAt {
        let new = || LineAt { with, line: Line::new(stiffness_n_m), row: None, pushed_n: 0.0 };
        entry(&mut self.all, &with, |line| line.with, new)
    }
}

/// The end of a line at a participant, in a macro step.
#[derive(Clone, Copy)]
struct LineEnd<'a, 'b> {
    place: usize,
    one: &'a Participant<'b>,
    other: &'a Neighbour,
    stiffness_n_m: f64,
    damping_n_s_m: f64,
    dt_s: f64,
}

impl LineLaw {
    /// Its row at a point of a member that is led at `led_m_s` beside its blocks.
    fn row(&self, member: usize, side: Side, led_m_s: DVec3, hold: Hold) -> LineRow {
        let resistance_n_s_m = self.resistance_n_s_m;
        LineRow { member, side, hold, resistance_n_s_m, target_m_s: self.drive_n / resistance_n_s_m - led_m_s }
    }
}

impl LineAt {
    /// The wave that arrives from the other end during the step, N.
    fn listen(&mut self, one: &Participant<'_>, other: &Neighbour, dt_s: f64) -> DVec3 {
        let pair = other.snapshot.pairs.iter().find(|pair| pair.with == one.id);
        self.line.receive(other.snapshot.time, pair.and_then(|pair| pair.wave), other.computed_here, dt_s);
        self.line.arriving(one.context.time, dt_s)
    }

    /// Adds its row, unless it resists nothing yet.
    fn add(&mut self, stepper: &mut ClusterStepper, row: LineRow, now: LineNow) {
        if row.resistance_n_s_m > 0.0 {
            let lines = &mut stepper.external().lines;
            self.row = Some(LineNow { number: lines.len(), ..now });
            lines.push(row);
        }
    }
}
