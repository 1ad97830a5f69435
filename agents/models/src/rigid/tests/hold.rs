//! Bodies that springs hold while others own contact with them: others foresee what they do.

use super::*;
use metachron_contact::Neighbour;
use metachron_contact::{Exchange, Other};
use metachron_core::RigidState;
use metachron_core::{Impulse, Site};

const ME: AgentId = AgentId(0);
const OWNER: AgentId = AgentId(1);

/// A block of 100 g that four springs hold, and who pushes it.
struct Held {
    body: RigidBody,
    time: SimTime,
    owner: Exchange,
    owner_time: SimTime,
}

fn at(seconds: f64) -> SimTime {
    SimTime::ZERO + SimSpan::from_secs_f64(seconds).unwrap()
}

fn springs(stiffness_n_m: f64) -> Vec<AnchorSpring> {
    let corners = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
    let spring = |[b, c]: [f64; 2]| {
        let corner = DVec3::new(0.0, b * 0.03, c * 0.02);
        AnchorSpring {
            by: None,
            anchor: Anchor::Local(corner),
            target: corner + UP * (0.1 * G / (4.0 * stiffness_n_m)),
            target_velocity: DVec3::ZERO,
            stiffness_n_m,
            damping_n_s_m: 1.0,
        }
    };
    corners.map(spring).to_vec()
}

impl Held {
    fn new() -> Self {
        let solid = Solid::Box { half_extents_m: DVec3::new(0.01, 0.03, 0.02) };
        let body = RigidBody::new(RigidSpec { mass_kg: 0.1, sleep: false, ..spec(solid, DVec3::ZERO) }).unwrap();
        Self { body, time: SimTime::ZERO, owner: Exchange::default(), owner_time: SimTime::ZERO }
    }

    /// The owner goes on by `h` seconds, through which it pushes evenly.
    fn push(&mut self, impulse: Impulse, h: f64) {
        self.owner.open(&StepContext::alone(OWNER, self.owner_time));
        self.owner.give(ME, Site::Whole, 0.5 * h, impulse);
        self.owner_time += SimSpan::from_secs_f64(h).unwrap();
    }

    fn step(&mut self, h: f64, hands: &[AnchorSpring]) {
        let mut owner = Snapshot { time: self.owner_time, ..Snapshot::default() };
        self.owner.write(&mut owner);
        let form = self.body.form();
        let neighbours = [Neighbour { form, ..Neighbour::observed(OWNER, Arc::new(owner)) }];
        let around = StepContext { me: ME, time: self.time, neighbours: &neighbours, hands, links: &[] };
        let dt = SimSpan::from_secs_f64(h).unwrap();
        self.body.step(dt, &around).unwrap();
        self.time += dt;
    }

    fn snapshot(&self) -> Snapshot {
        let mut snapshot = Snapshot::default();
        self.body.write_snapshot(&mut snapshot);
        snapshot.time = self.time;
        snapshot
    }

    /// Where its owner expects the body at its own time, and its velocity and spin.
    fn expected(&self) -> (DVec3, DVec3, DVec3) {
        let mut other = Other::default();
        let seen = Neighbour::observed(ME, Arc::new(self.snapshot()));
        assert!(other.meet(&seen, &StepContext::alone(OWNER, self.owner_time), &self.owner, None));
        let (place, _) = other.point(Anchor::Local(DVec3::ZERO)).unwrap();
        (place, other.velocities()[0], other.velocities()[1])
    }

    fn state(&self) -> RigidState {
        let Body::Rigid(state) = self.snapshot().body else { panic!("a body") };
        state
    }
}

/// The body is ahead of its owner by up to a step of its own; what it learns afterwards must not surprise the owner.
#[test]
fn a_body_on_springs_does_what_its_owner_expects_however_long_its_step() {
    for (h, stiffness) in [(0.001, 100.0), (0.01, 100.0), (0.1, 100.0), (0.1, 1e5)] {
        let (mut held, hands) = (Held::new(), springs(stiffness));
        held.step(h, &hands);
        let (mut farthest, mut turn) = (0.0_f64, 0.0_f64);
        for k in 0..40 {
            let size = if k % 7 < 4 { 1.0 } else { 0.1 * f64::from(k % 3) };
            for i in 0..10 {
                let linear = DVec3::new(-1.0 - 0.3 * f64::from(i % 3), 0.2, -0.4) * (size * 0.1 * h);
                held.push(Impulse { linear, angular: DVec3::new(1e-4, -2e-4, 3e-4) * (size * h) }, 0.1 * h);
            }
            let before = held.expected();
            held.step(h, &hands);
            let after = held.expected();
            farthest = farthest.max((after.0 - before.0).length());
            // the same sums in another order: rounding of lengths near 0.01 m
            assert!((after.0 - before.0).length() < 1e-14, "{h} s, step {k}: {before:?} {after:?}");
            assert!((after.1 - before.1).length() < 1e-12, "{h} s, step {k}: {before:?} {after:?}");
            turn = turn.max((after.2 - before.2).length() / before.2.length());
        }
        println!("step {h} s, 4 springs of {stiffness} N/m: place off by {farthest:.1e} m, spin by {turn:.1e}");
        // the body turns by milliradians meanwhile, and its inertia and the arms of its springs with it
        assert!(turn < 2e-2, "{h} s: its spin differs by {turn} of it");
    }
}

/// At rest the springs hold against the push exactly, though the body hears of each push a step late.
#[test]
fn a_steady_push_stretches_the_springs_by_its_force_at_any_rates() {
    for (h, owner_h) in [(0.001, 0.001), (0.001, 0.1), (0.1, 0.001), (0.1, 0.1), (0.01, 0.013)] {
        let (mut held, hands) = (Held::new(), springs(100.0));
        held.step(h, &hands);
        while held.time < at(4.0) {
            while held.owner_time <= held.time {
                held.push(Impulse { linear: DVec3::X * owner_h, angular: DVec3::ZERO }, owner_h);
            }
            held.step(h, &hands);
        }
        let state = held.state();
        // 1 N on 400 N/m; what swings dies out as exp(−20 t)
        assert!((state.position - DVec3::X * 0.0025).length() < 1e-9, "{h} {owner_h}: {}", state.position);
        assert!(state.velocity.length() < 1e-8, "{h} {owner_h}: {}", state.velocity);
        let grips: DVec3 = held.snapshot().grips.iter().map(|grip| grip.force_n).sum();
        assert!((grips - DVec3::new(-1.0, 0.0, 0.1 * G)).length() < 1e-7, "{h} {owner_h}: {grips}");
    }
}

/// Momentum: what the owner gave is what springs, gravity and the body's own motion account for.
#[test]
fn a_body_on_springs_accounts_for_every_push_once() {
    for (h, owner_h) in [(0.01, 0.003), (0.003, 0.02), (0.05, 0.05)] {
        let (mut held, hands) = (Held::new(), springs(100.0));
        held.step(h, &hands);
        let start = held.body.momentum().0;
        let (mut given, mut pulled, mut k) = (DVec3::ZERO, DVec3::ZERO, 0);
        let begin = held.time;
        while held.time < at(2.0) {
            while held.owner_time <= held.time {
                k += 1;
                let push =
                    if held.owner_time < at(1.5) { DVec3::new(f64::from(k % 5), -1.0, 0.5) } else { DVec3::ZERO };
                given += push * owner_h;
                held.push(Impulse { linear: push * owner_h, angular: DVec3::ZERO }, owner_h);
            }
            held.step(h, &hands);
            pulled += held.snapshot().grips.iter().map(|grip| grip.force_n).sum::<DVec3>() * h;
        }
        let fallen = DVec3::NEG_Z * (0.1 * G * held.time.secs_after(begin));
        let missing = held.body.momentum().0 - start - given - pulled - fallen;
        assert!(missing.length() < 1e-9, "{h} {owner_h}: {missing}"); // springs turn with the body: 1e-12; times in ns
    }
}
