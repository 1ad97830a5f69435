//! Springs on a rigid body: linearly implicit, stable at any stiffness and for any mass of the other end.
//!
//! In: the motion, the springs, a step. Out: the velocities after the step and the force of each spring; all springs together
//! as others have to know them. Never here: contacts; positions stay; how jaws turn a body ([`crate::rigid::orientation_spring`]).
//!
//! With the generalised velocity u = (v, ω), the point Jacobian G = (1, −r×) and the spring's force at the *end* of the step,
//! M (u⁺ − u) = h M g + Σ Gᵀ h (k (x + h ẋ − p − h G u⁺) + c (ẋ − G u⁺)): one symmetric 6×6 system. The rotation of r under
//! a force f adds the stiffness max(r·f, 0)(1 − r̂ r̂ᵀ) against rotation, taken at the force of a first pass. A stiff spring
//! therefore never blows up: past k ≈ m/h² it simply carries its point to the target within the step.

use super::mass_properties::MassDistribution;
use super::motion::{Motion, VelocityStep};
use super::orientation_spring::OrientationSpring;
use glam::{DMat3, DVec3};
use metachron_contact::AnchorSpring;
use metachron_core::{Anchor, Grip};
use metachron_core::{Mat6, Sprung, Twist};

/// A spring on this body, and the compliance of its other end.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinearSpring {
    /// The spring; its target is the present position of the other end.
    pub pull: AnchorSpring,
    /// Rest length, metres, ≥ 0.
    pub rest_m: f64,
    /// Inverse mass of the other end, 1/kg; zero where that end is driven.
    pub yields: DMat3,
    /// The impulse it gave this body in the last part, N·s.
    pub impulse: DVec3,
    /// The torsional spring that keeps the body from turning, where jaws grasp it.
    pub turn: Option<OrientationSpring>,
}

impl LinearSpring {
    /// A spring whose other end is driven.
    pub(super) const fn driven(pull: AnchorSpring) -> Self {
        Self { pull, rest_m: 0.0, yields: DMat3::ZERO, impulse: DVec3::ZERO, turn: None }
    }

    /// Its stretch where its ends are `away` from each other, metres, and the projection on the directions in which it pulls.
    fn stretch(&self, away: DVec3) -> (DVec3, DMat3) {
        if self.rest_m == 0.0 {
            return (away, DMat3::IDENTITY);
        }
        let along = away.normalize_or(DVec3::Z);
        let pass = DMat3::from_cols(along * along.x, along * along.y, along * along.z);
        (along * (away.length() - self.rest_m), pass)
    }

    /// Point of attack relative to the centre of mass: only an anchor in the body's own axes is a point of it.
    pub(super) fn arm(&self, motion: &Motion) -> Option<DVec3> {
        match self.pull.anchor {
            Anchor::Local(local) => Some(motion.rotation * local),
            Anchor::Arc(_) | Anchor::Vertex(_) => None,
        }
    }
}

/// A part of a step under springs.
#[derive(Debug, Clone, Copy)]
pub(super) struct PartLoads {
    /// Its length, seconds.
    pub h: f64,
    /// Gravity, m/s².
    pub gravity: DVec3,
    /// The impulse of other loads that act evenly over the part, N·s and N·m·s.
    pub lasting: Twist,
    /// The change by impulses received at the part's start: the reaction of the springs to it is counted in their impulses.
    pub received: VelocityStep,
}

/// Result of the springs in a part.
pub(super) struct SpringResult {
    /// The change of velocity and spin.
    pub change: Twist,
    /// The part of it that is due to the lasting loads.
    pub lasting: Twist,
    /// The impulse with which all springs resist a further change of the velocities in this part, about the centre of mass.
    pub resistance: Mat6,
}

/// Changes the velocities by gravity, the springs and other lasting loads over a part; writes each spring's impulse, and its force
/// for the agents that hold the body.
///
/// Nothing is written and `None` returned where no spring holds a point of this body.
pub(super) fn pull(
    motion: &mut Motion,
    body: &MassDistribution,
    ties: &mut [LinearSpring],
    under: &PartLoads,
    grips: &mut Vec<Grip>,
) -> Option<SpringResult> {
    if !ties.iter().any(|tie| tie.arm(motion).is_some()) {
        return None;
    }
    let h = under.h;
    let mut change = [DVec3::ZERO; 2];
    let mut system = System::free(motion, body, under);
    for pass in 0..2 {
        let forces = (pass > 0).then_some(change);
        system = System::free(motion, body, under);
        for tie in ties.iter() {
            system.add(tie, motion, body, forces);
        }
        change = system.matrix.solve(system.right);
    }
    grips.clear();
    let spin = motion.spin(body);
    for tie in ties.iter_mut() {
        let Some((r, spring)) = Spring::at(tie, motion, body, h) else { continue };
        tie.impulse = spring.after(change, r) - spring.reaction(tie, r, &under.received);
        if let Some(turn) = &mut tie.turn {
            let steady = turn.impulse_at(motion.rotation, spin, h);
            turn.store_impulse(steady, change[1], h, &under.received);
        }
        grips.push(Grip { by: tie.pull.by, force_n: tie.impulse / h });
    }
    motion.velocity += change[0];
    motion.angular += motion.inertia_times(body, change[1]);
    let lasting = system.matrix.solve(under.lasting);
    let mut resistance = system.matrix;
    resistance.add(&System::free(motion, body, under).matrix, -1.0);
    Some(SpringResult { change, lasting, resistance })
}

/// Writes the change of each spring's impulse due to a further `change` of the velocities in a part of `h` seconds.
pub(super) fn react_to_change(
    motion: &Motion,
    body: &MassDistribution,
    ties: &mut [LinearSpring],
    change: Twist,
    h: f64,
) {
    for tie in ties {
        let Some((r, spring)) = Spring::at(tie, motion, body, h) else { continue };
        tie.impulse = -(spring.resistance * (change[0] + change[1].cross(r)));
        if let Some(turn) = &mut tie.turn {
            turn.impulse = -change[1] * turn.resistance(h);
        }
    }
}

/// The force on the body in this state of springs whose far ends are driven, and its derivatives as the body moves
/// (docs/theory/coupling.md, eq. 7b).
pub(super) fn spring_state(motion: &Motion, body: &MassDistribution, ties: &[LinearSpring], gravity: DVec3) -> Sprung {
    let mut all = Sprung {
        force: [gravity * body.mass_kg, DVec3::ZERO],
        rising: [DVec3::ZERO; 2],
        stiffness: Mat6::ZERO,
        damping: Mat6::ZERO,
        past: [DVec3::ZERO; 2],
        span_s: 0.0,
        limit_n: f64::INFINITY,
    };
    let spin = motion.spin(body);
    for tie in ties {
        let Some(r) = tie.arm(motion) else { continue };
        let (away, slip) =
            (tie.pull.target - motion.position - r, tie.pull.target_velocity - motion.velocity - spin.cross(r));
        let (stretch, pass) = tie.stretch(away);
        let force = stretch * tie.pull.stiffness_n_m + pass * slip * tie.pull.damping_n_s_m;
        let rising = pass * tie.pull.target_velocity * tie.pull.stiffness_n_m;
        for (sum, at_point) in [(&mut all.force, force), (&mut all.rising, rising)] {
            sum[0] += at_point;
            sum[1] += r.cross(at_point);
        }
        all.stiffness.add_point(r, pass * tie.pull.stiffness_n_m);
        all.stiffness.add_turning(r, r.dot(force).max(0.0));
        all.damping.add_point(r, pass * tie.pull.damping_n_s_m);
        if let Some(turn) = &tie.turn {
            turn.add_to(motion.rotation, spin, &mut all);
        }
    }
    all
}

/// A spring over one step: impulse = `impulse` − `resistance` × change of the point's velocity.
struct Spring {
    impulse: DVec3,
    resistance: DMat3,
    /// The directions in which it pulls.
    pass: DMat3,
}

impl Spring {
    /// The spring of `tie` at its anchor on the body, and that anchor relative to the centre of mass.
    fn at(tie: &LinearSpring, motion: &Motion, body: &MassDistribution, h: f64) -> Option<(DVec3, Self)> {
        let r = tie.arm(motion)?;
        let velocity = motion.velocity + motion.spin(body).cross(r);
        Some((r, Self::new(tie, motion.position + r, velocity, h)))
    }

    /// The spring of `tie` on a point that moves with `velocity`. An end that yields by W turns R into (1 + R W)⁻¹ R.
    fn new(tie: &LinearSpring, point: DVec3, velocity: DVec3, h: f64) -> Self {
        let (k, c) = (tie.pull.stiffness_n_m, tie.pull.damping_n_s_m);
        let slip = tie.pull.target_velocity - velocity;
        let (stretch, pass) = tie.stretch(tie.pull.target - point);
        let impulse = (stretch * k + pass * slip * (h * k + c)) * h;
        let resistance = pass * (h * (h * k + c));
        if tie.yields == DMat3::ZERO {
            return Self { impulse, resistance, pass };
        }
        let softer = (DMat3::IDENTITY + resistance * tie.yields).inverse();
        Self { impulse: softer * impulse, resistance: softer * resistance, pass }
    }

    /// The impulse for a given change of the body's velocities, at a point `r` from its centre.
    fn after(&self, [linear, angular]: Twist, r: DVec3) -> DVec3 {
        self.impulse - self.resistance * (linear + angular.cross(r))
    }

    /// The impulse by which a spring reacted to a sudden change of the body's velocities.
    fn reaction(&self, tie: &LinearSpring, r: DVec3, step: &VelocityStep) -> DVec3 {
        let VelocityStep { change: [linear, angular], span_s } = *step;
        let (k, c) = (tie.pull.stiffness_n_m, tie.pull.damping_n_s_m);
        self.pass * (linear + angular.cross(r)) * (span_s * (span_s * k + c))
    }
}

/// A symmetric positive system for the change of (v, ω) over a part of a step.
struct System {
    /// Length of the part, seconds.
    h: f64,
    matrix: Mat6,
    right: Twist,
}

impl System {
    /// A body without springs.
    fn free(motion: &Motion, body: &MassDistribution, under: &PartLoads) -> Self {
        let columns = DVec3::AXES.map(|axis| motion.inertia_times(body, axis));
        let inertia = DMat3::from_cols(columns[0], columns[1], columns[2]);
        let [linear, angular] = under.lasting;
        let right = [under.gravity * (under.h * body.mass_kg) + linear, angular];
        Self { h: under.h, matrix: Mat6::mass(body.mass_kg, inertia), right }
    }

    /// Adds a spring; with the velocity change of a `first` pass also the stiffness of its force against rotation across its arm.
    fn add(&mut self, tie: &LinearSpring, motion: &Motion, body: &MassDistribution, first: Option<Twist>) {
        let h = self.h;
        let Some((r, spring)) = Spring::at(tie, motion, body, h) else { return };
        self.matrix.add_point(r, spring.resistance);
        self.right[0] += spring.impulse;
        self.right[1] += r.cross(spring.impulse);
        if let Some(turn) = &tie.turn {
            self.matrix.add_turning(DVec3::ZERO, turn.resistance(h));
            self.right[1] += turn.impulse_at(motion.rotation, motion.spin(body), h);
        }
        if let Some(change) = first {
            let stiffness = h * h * r.dot(spring.after(change, r) / h).max(0.0);
            let (axis, spin) = (r.normalize_or_zero(), motion.spin(body));
            self.matrix.add_turning(r, stiffness);
            self.right[1] -= (spin - axis * axis.dot(spin)) * stiffness;
        }
    }
}
