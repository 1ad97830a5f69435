//! How long a step may be where three bodies press on each other, or two and the ground, and beside what bends and is faster.
//!
//! In: a step that is wanted, who is near, what they tell of whom they touch. Out: that step, or an equal part of it. Never here: the
//! step itself, pairs of which nobody else has a say ([`super::beside`]). Theory: docs/theory/coupling.md, eq. 7o.

use super::beside::{SPLIT_SLACK, bends, is_linked, no_longer};
use crate::{Neighbour, StepContext};
use metachron_core::PairKind;
use metachron_core::{AgentId, Bounds, SimSpan};
use metachron_geometry::CollisionShape;

/// In a crowd nobody makes longer steps than this, seconds: the parts of a rigid body in contact. In longer ones what two owners give to
/// one body changes too much from one look to the next: at 60 Hz boxes rolled off tubes and fell through cloths.
pub(super) const PART_S: f64 = 1.0 / 240.0;
/// Who has touched something fixed counts as standing on it for so long, seconds: as long as couplings that do nothing are told.
const LINGERS_S: f64 = 1.0;
/// Parts that end within so many nanoseconds of where equal ones would end there.
const SAME_NS: u64 = 1_000;

/// A part of a step of `dt` as it may be in a crowd, where `me` and any neighbour that may be touched in it are in one; all of it elsewhere.
/// `bounds` are those of the body that looks.
pub fn crowded(dt: SimSpan, around: &StepContext<'_>, bounds: impl FnOnce() -> Bounds, me: Member) -> SimSpan {
    if dt.as_secs_f64() <= PART_S * SPLIT_SLACK {
        return dt;
    }
    no_longer(me.left_of(dt, around), around, bounds, |n| {
        // a crowd asks for as short steps as anybody with whom this one keeps step
        let crowd_s = is_crowded(n, around, me).then_some(PART_S);
        crowd_s.or_else(|| (n.owned && n.in_step).then_some(n.step_s.max(PART_S)))
    })
}

/// What a body did lately, from step to step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Lately {
    /// How many seconds ago something fixed bore it; `None` for never.
    grounded_s: Option<f64>,
    /// How long its last step was, seconds.
    step_s: f64,
}

impl Lately {
    /// A step of `dt_s` seconds has passed, in which something fixed bore it or did not.
    pub fn pass(&mut self, borne: bool, dt_s: f64) {
        self.grounded_s = if borne { Some(0.0) } else { self.grounded_s.map(|ago_s| ago_s + dt_s) };
        self.step_s = dt_s;
    }

    /// Whether something fixed bore it: a body that hops is on the ground between its hops.
    #[must_use]
    pub fn is_grounded(&self) -> bool {
        self.grounded_s.is_some_and(|ago_s| ago_s <= LINGERS_S)
    }
}

/// What of a body decides whether it makes a crowd with others.
#[derive(Debug, Clone, Copy)]
pub struct Member {
    /// Whether it bends.
    pub bends: bool,
    /// Whether it is thin and held ([`CollisionShape::is_hung`]).
    pub hung: bool,
    /// Whether others share its world.
    pub shares: bool,
    /// Whether it lies on somebody that something fixed holds up, who answers for all that presses it (eq. 7l).
    pub lies: bool,
    /// Whether something fixed bears it (`Snapshot::grounded`).
    pub grounded: bool,
    /// What else it did lately.
    pub lately: Lately,
}

impl Member {
    /// A body of this form that bends, which did so lately: it shares no world, and answers for what it bears by itself.
    #[must_use]
    pub fn bent(lately: Lately, form: &CollisionShape) -> Self {
        let (hung, grounded) = (form.is_hung(), lately.is_grounded());
        Self { bends: true, hung, shares: false, lies: false, grounded, lately }
    }

    /// What is left of a step of `dt` whose parts it has begun to make, else all of one: who leaves a crowd keeps step with those of its
    /// rate, and what two that step together expect of each other is exact (docs/theory/soft.md, eq. 16h).
    fn left_of(&self, dt: SimSpan, around: &StepContext<'_>) -> SimSpan {
        let parts = (dt.as_secs_f64() / (PART_S * SPLIT_SLACK)).ceil() as u64;
        let (part, gone) = (dt.as_nanos() / parts, around.time.as_nanos() % dt.as_nanos());
        let begun = (gone + SAME_NS) / part;
        let on_beat = gone.abs_diff(begun * part) <= SAME_NS;
        let divided = self.lately.step_s > 0.0 && self.lately.step_s <= PART_S * SPLIT_SLACK;
        if divided && on_beat && (1..parts).contains(&begun) { SimSpan::from_nanos(dt.as_nanos() - gone) } else { dt }
    }
}

/// Whether the body that looks and a neighbour that it may touch are in a crowd, one of whom at least bends: they touch each other, or have
/// within a second, and one shares a world with others or both are on the ground, or both bend and one is hung; or they are two of three in
/// a row.
fn is_crowded(neighbour: &Neighbour, around: &StepContext<'_>, me: Member) -> bool {
    let snapshot = &neighbour.snapshot;
    let either_bends = me.bends || bends(neighbour);
    let either_hung = me.hung || neighbour.form.as_ref().is_some_and(|form| form.is_hung());
    let hung = me.bends && bends(neighbour) && either_hung;
    let held_up = me.shares || snapshot.shares || (me.grounded && snapshot.grounded);
    if either_bends && (hung || held_up) && touch(neighbour, around) {
        return true;
    }
    // who bears it answers for both that press it (eq. 7l)
    let lies = me.lies || snapshot.lies.get().is_some();
    let third = |n: &&Neighbour| n.id != neighbour.id && (either_bends || bends(n));
    !lies && around.neighbours.iter().filter(third).any(|third| makes_three(neighbour, third, around))
}

/// Whether a third one touches the body that looks or the neighbour, and the middle one of the three does not own both of its contacts: who
/// does solves them in one. The two need not touch yet, unless the third touches both.
fn makes_three(neighbour: &Neighbour, third: &Neighbour, around: &StepContext<'_>) -> bool {
    let is_owned = touches(neighbour, around.me);
    let around_me = touches(third, around.me) || (is_owned && has_taken(third, around));
    let around_it = touches(third, neighbour.id) || (neighbour.owned && touches(neighbour, third.id));
    if touch(neighbour, around) { around_me || around_it } else { around_it && !touch(third, around) }
}

/// Whether the body that looks and a neighbour touch each other, or have within a second.
fn touch(neighbour: &Neighbour, around: &StepContext<'_>) -> bool {
    touches(neighbour, around.me) || has_taken(neighbour, around)
}

/// Whether a neighbour tells of contact with `other` that it owns.
pub(super) fn touches(neighbour: &Neighbour, other: AgentId) -> bool {
    neighbour.snapshot.pairs.iter().any(|pair| pair.with == other && pair.kind == PairKind::Ledger)
}

/// Whether a neighbour has taken what contact with the body that looks, which owns it, gave.
fn has_taken(neighbour: &Neighbour, around: &StepContext<'_>) -> bool {
    neighbour.owned
        && !is_linked(neighbour, around)
        && neighbour.snapshot.taken.iter().any(|ledger| ledger.with == around.me)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use metachron_core::{Body, CurveState, RigidState, SimTime, Snapshot};
    use metachron_core::{Ledger, PairState};
    use metachron_geometry::ShapeKind;
    use std::sync::Arc;

    const ME: AgentId = AgentId(0);
    const FREE: Member = Member {
        bends: false,
        hung: false,
        shares: false,
        lies: false,
        grounded: false,
        lately: Lately { grounded_s: None, step_s: 0.0 },
    };
    const BENT: Member = Member { bends: true, ..FREE };

    /// A neighbour that owns its contacts with `owns`, and has taken from `taken`.
    fn neighbour(id: u32, body: Body, owns: &[u32], taken: &[u32]) -> Neighbour {
        let bounds = Some(Bounds { low: DVec3::NEG_ONE, high: DVec3::ONE, speed_m_s: 0.0 });
        let pairs = owns.iter().map(|&with| PairState::new(AgentId(with), PairKind::Ledger)).collect();
        let taken: Vec<Ledger> = taken.iter().map(|&from| Ledger::new(AgentId(from))).collect();
        let owned = taken.iter().any(|ledger| ledger.with == ME);
        let snapshot = Arc::new(Snapshot { body, bounds, pairs, taken, ..Snapshot::default() });
        let kind = ShapeKind::Chain { held_ends: 0, height_j_kg: 0.0 };
        let form = Some(Arc::new(CollisionShape { kind, friction: 0.0, restitution: 0.0 }));
        Neighbour { form, owned, step_s: 1.0 / 60.0, ..Neighbour::observed(AgentId(id), snapshot) }
    }

    fn rigid() -> Body {
        Body::Rigid(RigidState::default())
    }

    fn tube() -> Body {
        Body::Curve(CurveState { positions: vec![DVec3::ZERO; 2], ..CurveState::default() })
    }

    /// Into how many parts `me` divides a step of a sixtieth of a second.
    fn parts(me: Member, neighbours: &[Neighbour]) -> u64 {
        let around = StepContext { neighbours, ..StepContext::alone(ME, SimTime::ZERO) };
        let dt = SimSpan::from_secs_f64(1.0 / 60.0).unwrap();
        let bounds = || Bounds { low: DVec3::NEG_ONE, high: DVec3::ONE, speed_m_s: 0.0 };
        dt.as_nanos() / crowded(dt, &around, bounds, me).as_nanos()
    }

    #[test]
    fn a_body_that_two_owners_press_on_makes_a_crowd_of_all_three() {
        let [left, right] = [1, 2].map(|id| neighbour(id, tube(), &[0], &[]));
        assert_eq!(parts(FREE, &[left.clone(), right]), 4, "the box between");
        let carried = neighbour(2, rigid(), &[], &[0, 1]);
        let other = neighbour(1, tube(), &[2], &[]);
        assert_eq!(parts(BENT, &[other.clone(), carried]), 4, "one of the tubes");
        let lands = neighbour(2, rigid(), &[], &[1]);
        assert_eq!(parts(BENT, &[other, Neighbour { owned: true, ..lands }]), 4, "and one that comes beside the two");
        assert_eq!(parts(FREE, &[left]), 1, "one tube under a box is a pair");
    }

    #[test]
    fn who_owns_both_contacts_in_the_middle_makes_no_crowd_nor_do_rigid_bodies_alone() {
        let under = [1, 2].map(|id| neighbour(id, tube(), &[], &[0]));
        assert_eq!(parts(BENT, &under), 1, "a soft block on two tubes");
        let boxes = [1, 2].map(|id| neighbour(id, rigid(), &[0], &[]));
        assert_eq!(parts(FREE, &boxes), 1, "islands are for these");
        assert_eq!(parts(BENT, &boxes), 4);
    }

    #[test]
    fn two_on_the_ground_that_touch_are_a_crowd_and_what_shares_a_world_is() {
        let tube = neighbour(1, tube(), &[0], &[]);
        let with = |change: fn(&mut Snapshot)| {
            let mut snapshot = Snapshot::clone(&tube.snapshot);
            change(&mut snapshot);
            Neighbour { snapshot: Arc::new(snapshot), ..tube.clone() }
        };
        let grounded = Member { grounded: true, ..FREE };
        assert_eq!(parts(grounded, &[with(|s| s.grounded = true)]), 4);
        assert_eq!(parts(grounded, std::slice::from_ref(&tube)), 1);
        assert_eq!(parts(Member { shares: true, ..FREE }, std::slice::from_ref(&tube)), 4);
        assert_eq!(parts(FREE, &[with(|s| s.shares = true)]), 4);
    }

    #[test]
    fn who_owns_keeps_step_with_who_bends_below_up_to_the_rate_of_crowds() {
        let below = |step_s| Neighbour { owned: true, in_step: true, step_s, ..neighbour(1, tube(), &[], &[]) };
        let bound = |me, below| parts(me, &[below]);
        assert_eq!([1.0 / 60.0, 1.0 / 120.0, 1e-3].map(|step_s| bound(BENT, below(step_s))), [1, 2, 4]);
        assert_eq!(bound(BENT, Neighbour { owned: false, ..below(1e-3) }), 1, "who is owned has its own clock");
        assert_eq!(bound(BENT, Neighbour { in_step: false, ..below(1e-3) }), 1, "and who does not keep step");
    }

    #[test]
    fn what_bends_on_a_sheet_that_is_held_makes_a_crowd_with_it() {
        let hung = Member { hung: true, ..BENT };
        let above = neighbour(1, tube(), &[0], &[]);
        assert_eq!(parts(hung, std::slice::from_ref(&above)), 4);
        assert_eq!(parts(Member { bends: false, ..hung }, std::slice::from_ref(&above)), 1, "nothing rigid is hung");
        assert_eq!(parts(BENT, &[above]), 1);
    }

    #[test]
    fn a_body_that_hops_stays_on_the_ground_for_a_second() {
        let mut lately = Lately::default();
        lately.pass(false, 0.1);
        assert!(!lately.is_grounded(), "never");
        lately.pass(true, 0.1);
        (0..9).for_each(|_| lately.pass(false, 0.1));
        assert!(lately.is_grounded());
        (0..2).for_each(|_| lately.pass(false, 0.1));
        assert!(!lately.is_grounded());
    }

    #[test]
    fn a_step_that_was_divided_is_finished_before_a_whole_one_begins() {
        let dt = SimSpan::from_secs_f64(1.0 / 60.0).unwrap();
        let left_after = |parts: u64, last_s: f64| {
            let time = SimTime::ZERO + dt + dt + SimSpan::from_nanos(parts * dt.as_nanos() / 4);
            let me = Member { lately: Lately { grounded_s: None, step_s: last_s }, ..BENT };
            crowded(dt, &StepContext::alone(ME, time), || unreachable!("nobody is near"), me).as_nanos() * 4
                / dt.as_nanos()
        };
        let left = |parts| left_after(parts, 1.0 / 240.0);
        assert_eq!([0, 1, 2, 3, 4].map(left), [4, 3, 2, 1, 4]);
        assert_eq!(left_after(1, 1.0 / 60.0), 4, "who never divided one has a beat of its own");
    }
}
