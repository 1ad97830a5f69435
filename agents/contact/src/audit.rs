//! Momentum and energy of agents that keep different clocks, at one common time.
//!
//! In: the snapshot that each agent published last, and the masses of tubes. Out: the sums, with every impulse that was given and not
//! yet taken applied as its receiver will apply it: v + W dJ, x + W (t dJ − dS) at the receiver's own time
//! (docs/theory/coupling.md, eq. 3, 4). After that rigid bodies fly to the common time. Never here: how agents step.
//! Plain addition of the energies of two clocks would count the half of an impact that one side has felt, but not the half that the
//! other has still to receive.
//!
//! Exact for rigid bodies whose acceleration is constant in between. Tubes count as published, with the work of impulses in flight.

use glam::{DMat3, DQuat, DVec3};
use metachron_core::{
    AgentId, Body, CurveState, Impulse, Inertia, Ledger, RigidState, SimTime, Site, Snapshot, inverse_of_free,
};

/// An agent as the audit sees it.
#[derive(Debug, Clone, Copy)]
pub struct Member<'a> {
    /// The agent.
    pub id: AgentId,
    /// The snapshot that it published last.
    pub snapshot: &'a Snapshot,
    /// Mass per length of a tube, kg/m; not read for other agents.
    pub mass_per_length_kg_m: f64,
}

/// The sums at the common time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Audit {
    /// Kinetic and potential energy, for tubes also elastic, joules.
    pub energy_j: f64,
    /// Linear momentum, kg·m/s.
    pub momentum: DVec3,
    /// Angular momentum about the origin, kg·m²/s.
    pub angular: DVec3,
    /// Sum of the magnitudes of the impulses in flight, N·s.
    pub in_flight_n_s: f64,
    /// The same for the angular impulses, N·m·s.
    pub in_flight_n_m_s: f64,
}

/// Audits agents at `at`. Tools and bodies that nothing moves are not counted: impulses given to them leave the system.
///
/// `potential` gives the potential energy in joules of a rigid body in a state, from gravity and external springs; that of
/// tubes is part of their published states.
#[must_use]
pub fn audit(members: &[Member<'_>], at: SimTime, potential: &mut dyn FnMut(AgentId, &RigidState) -> f64) -> Audit {
    let mut sum = Audit::default();
    for member in members {
        match &member.snapshot.body {
            Body::Rigid(_) => rigid(&mut sum, member, members, at, potential),
            Body::Curve(state) => curve(&mut sum, member, members, state),
            Body::Soft(_) | Body::Tool(_) | Body::Nothing => {}
        }
    }
    sum
}

/// Visits the impulses that peers have given `member` and that it has not taken: giver, site, dJ, and t dJ − dS at its own time.
pub fn in_flight(member: &Member<'_>, members: &[Member<'_>], mut visit: impl FnMut(AgentId, Site, Impulse, Impulse)) {
    for giver in members {
        let Some(given) = giver.snapshot.given.iter().find(|l| l.with == member.id) else { continue };
        let taken: Option<&Ledger> = member.snapshot.taken.iter().find(|l| l.with == giver.id);
        if taken.is_none_or(|taken| given.is_beyond(taken)) {
            given.since(taken, member.snapshot.time, |site, dj, carried| visit(giver.id, site, dj, carried));
        }
    }
}

/// The state of a rigid body at the time `at`, with all impulses in flight applied; `None` for any other body.
#[must_use]
pub fn settled(member: &Member<'_>, members: &[Member<'_>], at: SimTime) -> Option<RigidState> {
    let (Body::Rigid(mut state), Inertia::Rigid { inverse_mass, inverse_inertia }) =
        (member.snapshot.body.clone(), &member.snapshot.inertia)
    else {
        return None;
    };
    let (mut given, mut carried) = (Impulse::ZERO, Impulse::ZERO);
    in_flight(member, members, |_, _, dj, way| {
        given += dj;
        carried += way;
    });
    let h = at.secs_after(member.snapshot.time);
    state.velocity += given.linear * *inverse_mass;
    state.position += carried.linear * *inverse_mass;
    state.spin += *inverse_inertia * given.angular;
    state.rotation = turned(state.rotation, *inverse_inertia * carried.angular);
    let a = member.snapshot.acceleration;
    state.position += state.velocity * h + a * (0.5 * h * h);
    state.velocity += a * h;
    state.rotation = turned(state.rotation, state.spin * h);
    Some(state)
}

/// A rotation turned further by a rotation vector in world axes.
fn turned(rotation: DQuat, by: DVec3) -> DQuat {
    if by == DVec3::ZERO { rotation } else { (DQuat::from_scaled_axis(by) * rotation).normalize() }
}

impl Audit {
    fn add_in_flight(&mut self, dj: Impulse) {
        self.in_flight_n_s += dj.linear.length();
        self.in_flight_n_m_s += dj.angular.length();
    }
}

fn rigid(
    sum: &mut Audit,
    member: &Member<'_>,
    members: &[Member<'_>],
    at: SimTime,
    potential: &mut dyn FnMut(AgentId, &RigidState) -> f64,
) {
    let Inertia::Rigid { inverse_mass, inverse_inertia } = member.snapshot.inertia else { return };
    let Some(state) = settled(member, members, at) else { return };
    in_flight(member, members, |_, _, dj, _| sum.add_in_flight(dj));
    // free rotation keeps angular momentum and energy: both are as in the published rotation
    let is_locked = |answers: DVec3| [0, 1, 2].map(|axis| answers[axis] == 0.0);
    let turns = DVec3::new(inverse_inertia.x_axis.x, inverse_inertia.y_axis.y, inverse_inertia.z_axis.z);
    let inertia = inverse_of_free(inverse_inertia, is_locked(turns));
    // nothing moves along a locked axis
    let mass = DVec3::select(inverse_mass.cmpgt(DVec3::ZERO), inverse_mass.recip(), DVec3::ZERO);
    let angular_momentum = inertia * state.spin;
    let spin_j = 0.5 * state.spin.dot(angular_momentum);
    sum.energy_j += 0.5 * state.velocity.dot(state.velocity * mass) + spin_j + potential(member.id, &state);
    sum.momentum += state.velocity * mass;
    sum.angular += state.position.cross(state.velocity * mass) + angular_momentum;
}

/// Adds a tube as it published itself: impulses in flight to it count as in flight alone.
fn curve(sum: &mut Audit, member: &Member<'_>, members: &[Member<'_>], state: &CurveState) {
    let motion = Motion::of(member, state);
    sum.energy_j += member.snapshot.energy_j;
    sum.momentum += motion.momentum;
    sum.angular += motion.angular;
    // impulses in flight are taken as its local model answers them: J·v + ½ J·W J
    let model = &member.snapshot.local_model;
    let mut pushed = vec![DVec3::ZERO; model.blocks.len()];
    in_flight(member, members, |_, site, dj, _| {
        sum.add_in_flight(dj);
        sum.momentum += dj.linear;
        let Site::Arc(arc_m) = site else { return };
        let Some((segment, share)) = state.locate(arc_m) else { return };
        let at = state.positions[segment].lerp(state.positions[segment + 1], share);
        sum.angular += at.cross(dj.linear) + dj.angular;
        let slot = 2 * segment as u32;
        let parts = [(slot, dj.linear * (1.0 - share)), (slot + 1, dj.angular), (slot + 2, dj.linear * share)];
        for (slot, part) in parts {
            let place = model.blocks.iter().position(|block| block.slot == slot);
            place.into_iter().for_each(|place| pushed[place] += part);
        }
    });
    for (row, block) in model.blocks.iter().enumerate() {
        let answers = model.compliance[row * pushed.len()..].iter().zip(&pushed).map(|(w, j)| *w * *j);
        sum.energy_j += pushed[row].dot(block.velocity + answers.sum::<DVec3>() * 0.5);
    }
}

/// Momenta of a tube with its consistent mass, as far as its nodes carry them (docs/theory/rod.md, eq. 10).
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    momentum: DVec3,
    angular: DVec3,
}

impl Motion {
    fn of(member: &Member<'_>, state: &CurveState) -> Self {
        let mut sum = Self::default();
        for (k, arc) in state.arc_m.windows(2).enumerate() {
            let m = member.mass_per_length_kg_m * (arc[1] - arc[0]);
            let (a, b) = (state.velocities[k], state.velocities[k + 1]);
            let (xa, xb) = (state.positions[k], state.positions[k + 1]);
            sum.momentum += (a + b) * (0.5 * m);
            sum.angular += (xa.cross(a * 2.0 + b) + xb.cross(b * 2.0 + a)) * (m / 6.0);
        }
        sum
    }
}

/// The response to impulses of a rigid body of this mass and these principal moments when it is turned by `rotation`, as
/// its snapshot publishes it ([`Inertia::Rigid`]).
#[must_use]
pub fn rigid_inertia(mass_kg: f64, moments_kg_m2: DVec3, rotation: DQuat) -> Inertia {
    let turn = DMat3::from_quat(rotation);
    let inverse_inertia = turn * DMat3::from_diagonal(moments_kg_m2.recip()) * turn.transpose();
    Inertia::Rigid { inverse_mass: DVec3::splat(1.0 / mass_kg), inverse_inertia }
}
