//! Momentum and energy of agents that keep different clocks, at one common time.
//!
//! In: the snapshot that each agent published last, and the masses of tubes. Out: the sums, with every impulse that was given and not
//! yet taken applied as its receiver will apply it: v + W dJ, x + W (t dJ − dS) at the receiver's own time
//! (docs/theory/coupling.md, eq. 3). After that rigid bodies fly to the common time; an impulse that presses a body on the ground that
//! supports it goes into the ground. Never here: how agents step. Plain addition of the energies of two clocks would count the half
//! of an impact that its owner has felt, but not the half that the peer has still to receive.
//!
//! Exact for rigid bodies whose acceleration is constant in between. For tubes the state counts as published, with the
//! change of velocities: the effect of a shift of positions on the elastic energy is left out; it is of second order in the impulse.

mod acted;

use super::other::turned;
use glam::{DMat3, DQuat, DVec3};
use metachron_core::foot::is_borne;
use metachron_core::{AgentId, Body, CurveState, Inertia, RigidState, SimTime, Snapshot};
use metachron_core::{Impulse, Ledger, Site};

/// An agent as the audit sees it.
#[derive(Debug, Clone, Copy)]
pub struct Member<'a> {
    /// The agent.
    pub id: AgentId,
    /// The snapshot that it published last.
    pub snapshot: &'a Snapshot,
    /// Mass per length of a tube, kg/m; not read for other agents.
    pub mass_per_length_kg_m: f64,
    /// Rotary inertia ρI of a tube about a diameter, per length, kg·m; not read for other agents.
    pub rotary_kg_m: f64,
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
/// tubes is part of what they publish.
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
pub fn on_their_way(
    member: &Member<'_>,
    members: &[Member<'_>],
    mut visit: impl FnMut(AgentId, Site, Impulse, Impulse),
) {
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
    let h = at.secs_after(member.snapshot.time);
    if let Some(sprung) = member.snapshot.sprung.get() {
        let inertia = (*inverse_mass, *inverse_inertia);
        let way = acted::acted(member, members, at).map(|impulse| [impulse.linear, impulse.angular]);
        let [gone, velocity] = sprung.settled(inertia, [state.velocity, state.spin], way, h);
        (state.position, state.rotation) = (state.position + gone[0], turned(state.rotation, gone[1]));
        [state.velocity, state.spin] = velocity;
        return Some(state);
    }
    let (mut given, mut carried) = (Impulse::ZERO, Impulse::ZERO);
    on_their_way(member, members, |_, _, dj, way| {
        given += dj;
        carried += way;
    });
    if let Some(rebound) = member.snapshot.rebound.get() {
        let by_then = Impulse { linear: carried.linear + given.linear * h, angular: DVec3::ZERO };
        let [back, way] = rebound.part(rebound.spared_by([given, by_then], at, (*inverse_mass, *inverse_inertia)), at);
        // both are brought to the common time by the velocity
        (given, carried) = (given - back, carried - way + back * h);
    }
    let stand = member.snapshot.stand;
    if let Some(stand) = stand.filter(|stand| stand.bears(state.position, given)) {
        (given, carried) = (stand.leaves(given), stand.leaves(carried));
    }
    let tips = member.snapshot.tips.get();
    if let Some(tips) = tips {
        (given, carried) = [given, carried].map(|all| tips.hold((*inverse_mass, *inverse_inertia), all)).into();
    }
    let all = [given.linear, carried.linear].map(|impulse| impulse * *inverse_mass);
    let since_s = all[1].length() / all[0].length().max(f64::MIN_POSITIVE);
    let [change, way] = stand.map_or(all, |stand| stand.lifted(all, since_s));
    state.velocity += change;
    state.position += way;
    state.spin += *inverse_inertia * given.angular;
    state.rotation = turned(state.rotation, *inverse_inertia * carried.angular);
    let a = member.snapshot.acceleration;
    state.position += state.velocity * h + a * (0.5 * h * h);
    state.velocity += a * h;
    let turning = tips.map_or(DVec3::ZERO, |tips| tips.turning);
    state.rotation = turned(state.rotation, state.spin * h + turning * (0.5 * h * h));
    state.spin += turning * h;
    Some(state)
}

impl Audit {
    fn on_its_way(&mut self, dj: Impulse) {
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
    on_their_way(member, members, |_, _, dj, _| sum.on_its_way(dj));
    // free rotation keeps angular momentum and energy: both are those of the published rotation
    let (mass, inertia) = (1.0 / inverse_mass, inverse_inertia.inverse());
    let spun = inertia * state.spin;
    let spin_j = 0.5 * state.spin.dot(spun);
    sum.energy_j += 0.5 * mass * state.velocity.length_squared() + spin_j + potential(member.id, &state);
    sum.momentum += state.velocity * mass;
    sum.angular += state.position.cross(state.velocity) * mass + spun;
}

fn curve(sum: &mut Audit, member: &Member<'_>, members: &[Member<'_>], state: &CurveState) {
    let response = member.snapshot.inertia.response();
    let curve = response.and_then(|response| Some((response, response.curve()?.spins())));
    let Some((inertia, spins)) = curve else { return still(sum, member, state) };
    let mut pushed = vec![DVec3::ZERO; 2 * state.positions.len() - 1];
    let (mut carried, mut delivered) = (pushed.clone(), DVec3::ZERO);
    on_their_way(member, members, |_, site, dj, moved| {
        sum.on_its_way(dj);
        let Site::Arc(arc_m) = site else { return };
        let Some((segment, share)) = state.locate(arc_m) else { return };
        delivered += dj.linear;
        for (list, impulse) in [(&mut pushed, dj), (&mut carried, moved)] {
            list[2 * segment] += impulse.linear * (1.0 - share);
            list[2 * segment + 2] += impulse.linear * share;
            list[2 * segment + 1] += impulse.angular;
        }
    });
    if inertia.slots() == pushed.len() {
        let borne = is_borne(inertia.supports(), pushed.iter().step_by(2).sum());
        inertia.respond(&mut pushed, borne);
        inertia.respond(&mut carried, borne);
    }
    let before = Motion::of(member, state, |k| state.velocities[k], |k| spins.get(k).copied().unwrap_or_default());
    let shifted = |k: usize| state.positions[k] + carried[2 * k];
    let velocity = |k: usize| state.velocities[k] + pushed[2 * k];
    let spin = |k: usize| spins.get(k).copied().unwrap_or_default() + pushed[2 * k + 1];
    let moved = CurveState { positions: (0..state.positions.len()).map(shifted).collect(), ..state.clone() };
    // the part that a spring of the tube takes belongs to the body at its far end: the sum over all bodies is that of the given impulses
    let momentum = before.momentum + delivered;
    let after = Motion { momentum, ..Motion::of(member, &moved, velocity, spin) };
    after.add(sum, member.snapshot.energy_j, before.kinetic_j);
}

/// Adds a tube that has not stepped yet, or that no agent could have touched: no impulse is in flight to it.
fn still(sum: &mut Audit, member: &Member<'_>, state: &CurveState) {
    let motion = Motion::of(member, state, |k| state.velocities[k], |_| DVec3::ZERO);
    motion.add(sum, member.snapshot.energy_j, motion.kinetic_j);
}

/// Kinetic energy and momenta of a tube with its consistent mass (docs/theory/rod.md, eq. 10).
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    kinetic_j: f64,
    momentum: DVec3,
    angular: DVec3,
}

impl Motion {
    fn of(
        member: &Member<'_>,
        state: &CurveState,
        velocity: impl Fn(usize) -> DVec3,
        spin: impl Fn(usize) -> DVec3,
    ) -> Self {
        let mut sum = Self::default();
        for (k, arc) in state.arc_m.windows(2).enumerate() {
            let l = arc[1] - arc[0];
            let (m, turned) = (member.mass_per_length_kg_m * l, member.rotary_kg_m * l);
            let (a, b, w) = (velocity(k), velocity(k + 1), spin(k));
            let (xa, xb, axis) = (state.positions[k], state.positions[k + 1], state.frames[k] * DVec3::Z);
            let about = axis.dot(w);
            sum.kinetic_j += m * (a.dot(a + b) + b.length_squared()) / 6.0;
            sum.kinetic_j += 0.5 * turned * (w.length_squared() + about * about);
            sum.momentum += (a + b) * (0.5 * m);
            sum.angular += (xa.cross(a * 2.0 + b) + xb.cross(b * 2.0 + a)) * (m / 6.0) + (w + axis * about) * turned;
        }
        sum
    }

    fn add(&self, sum: &mut Audit, published_j: f64, published_kinetic_j: f64) {
        sum.energy_j += published_j + self.kinetic_j - published_kinetic_j;
        sum.momentum += self.momentum;
        sum.angular += self.angular;
    }
}

/// The response to impulses of a rigid body of this mass and these principal moments when it is turned by `rotation`, as
/// its snapshot publishes it ([`Inertia::Rigid`]).
#[must_use]
pub fn rigid_inertia(mass_kg: f64, moments_kg_m2: DVec3, rotation: DQuat) -> Inertia {
    let turn = DMat3::from_quat(rotation);
    let inverse_inertia = turn * DMat3::from_diagonal(moments_kg_m2.recip()) * turn.transpose();
    Inertia::Rigid { inverse_mass: 1.0 / mass_kg, inverse_inertia }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Agent, Pull, Surroundings};
    use metachron_core::{Anchor, SimSpan};
    use metachron_models::rod::Tube;
    use metachron_models::rod::{Material, Section, TubeSpec};

    const MOMENTS: DVec3 = DVec3::new(0.02, 0.03, 0.04);

    fn at(seconds: f64) -> SimTime {
        SimTime::ZERO + SimSpan::from_secs_f64(seconds).unwrap()
    }

    fn ball(time: f64, position: DVec3, velocity: DVec3, spin: DVec3) -> Snapshot {
        let rotation = DQuat::from_rotation_x(0.3);
        let state = RigidState { position, rotation, velocity, spin };
        let inertia = rigid_inertia(2.0, MOMENTS, rotation);
        Snapshot { time: at(time), body: Body::Rigid(state), inertia, ..Snapshot::default() }
    }

    fn member(id: u32, snapshot: &Snapshot) -> Member<'_> {
        Member { id: AgentId(id), snapshot, mass_per_length_kg_m: 0.0, rotary_kg_m: 0.0 }
    }

    #[test]
    fn falling_bodies_of_different_clocks_keep_the_energy_of_the_fall() {
        let g = DVec3::NEG_Z * 9.81;
        let dropped = |time: f64| {
            let (x, v) = (DVec3::Z - DVec3::Z * (0.5 * 9.81 * time * time), g * time);
            Snapshot { acceleration: g, ..ball(time, x, v, DVec3::ZERO) }
        };
        let (early, late) = (dropped(0.1), dropped(0.25));
        let members = [member(0, &early), member(1, &late)];
        let sum = audit(&members, at(0.3), &mut |_, state| -2.0 * g.dot(state.position));
        assert!((sum.energy_j - 2.0 * 2.0 * 9.81).abs() < 1e-12, "{sum:?}");
        assert!((sum.momentum - g * (0.3 * 4.0)).length() < 1e-12, "{sum:?}");
    }

    #[test]
    fn a_blow_that_only_its_owner_has_felt_is_whole() {
        // one of two equal bodies meets the other, elastically, at 0.15 s: it has stopped, and the other has not received its impulse
        let blow = DVec3::X * 2.0;
        let mut owner = ball(0.2, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        let mut ledger = Ledger::new(AgentId(1));
        ledger.give(Site::Whole, at(0.15), 0.0, Impulse { linear: blow, angular: DVec3::ZERO });
        owner.given.push(ledger.clone());
        let mut other = ball(0.1, DVec3::X * 0.1, DVec3::ZERO, DVec3::ZERO);
        let sum =
            |owner: &Snapshot, other: &Snapshot| audit(&[member(0, owner), member(1, other)], at(0.2), &mut |_, _| 0.0);
        let before = sum(&owner, &other);
        assert!((before.energy_j - 1.0).abs() < 1e-12 && before.momentum == blow, "{before:?}"); // 2 kg at 1 m/s
        assert_eq!(before.in_flight_n_s, 2.0);
        // 0.05 s after the impact at 1 m/s, on the line through the origin: no angular momentum
        assert!(before.angular.length() < 1e-15);
        other.taken.push(Ledger { with: AgentId(0), ..ledger });
        assert_eq!(sum(&owner, &other).momentum, DVec3::ZERO, "what was taken is not delivered again");
    }

    #[test]
    fn an_angular_impulse_turns_the_body_about_its_own_axes() {
        let (owner, other) =
            (ball(0.0, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO), ball(0.0, DVec3::Y, DVec3::X, DVec3::Z));
        let mut ledger = Ledger::new(AgentId(1));
        let twist = DVec3::new(0.1, -0.2, 0.3);
        ledger.give(Site::Whole, at(0.0), 0.0, Impulse { linear: DVec3::ZERO, angular: twist });
        let pushed = Snapshot { given: vec![ledger], ..owner.clone() };
        let of = |owner: &Snapshot| audit(&[member(0, owner), member(1, &other)], at(0.0), &mut |_, _| 0.0);
        assert!((of(&pushed).angular - of(&owner).angular - twist).length() < 1e-15);
    }

    /// A free tube that a user spring has swung for a while.
    fn swung() -> Tube {
        let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
        let section = Section::hollow(0.015, 0.002, material);
        let mut tube = Tube::new(TubeSpec::free(vec![DVec3::ZERO, DVec3::X], section, 12)).unwrap();
        let hand = Pull {
            by: None,
            anchor: Anchor::Arc(0.8),
            target: DVec3::new(1.0, 0.7, 0.4),
            target_velocity: DVec3::ZERO,
            stiffness_n_m: 5.0,
            damping_n_s_m: 0.0,
        };
        for k in 0..40 {
            let around = Surroundings { hands: &[hand], ..Surroundings::alone(AgentId(0), at(0.004 * f64::from(k))) };
            tube.step(SimSpan::from_secs_f64(0.004).unwrap(), &around).unwrap();
        }
        tube
    }

    #[test]
    fn a_tube_s_sums_are_its_own() {
        let tube = swung();
        let mut snapshot = Snapshot::default();
        tube.write_snapshot(&mut snapshot);
        let spec = tube.spec();
        let (mass_per_length_kg_m, rotary_kg_m) = (spec.mass_per_length_kg_m, spec.section.rotary_kg_m);
        let member = Member { id: AgentId(0), snapshot: &snapshot, mass_per_length_kg_m, rotary_kg_m };
        let sum = audit(&[member], SimTime::ZERO, &mut |_, _| 0.0);
        let (momentum, angular) = tube.momentum();
        assert!(momentum.length() > 0.1 && (sum.momentum - momentum).length() < 1e-14, "{sum:?} {momentum}");
        // a tube with no agent near does not publish how its segments turn: a tenth of a thousandth of the whole
        assert!((sum.angular - angular).length() < 1e-3 * angular.length(), "{sum:?} {angular}");
        assert!((sum.energy_j - tube.energy_j()).abs() < 1e-14); // one sum and one difference
    }
}
