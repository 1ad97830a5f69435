//! The suite finds the promise that an agent breaks.

use super::{Breach, Load, Promise, Suite, check};
use crate::rigid::{KinematicBody, Led, RigidSpec};
use glam::{DQuat, DVec3};
use metachron_contact::member::{ClusterMember, Role, SkinPoint, StepEnd};
use metachron_contact::{Agent, AnchorSpring, Input, Inputs, OwnSteps, SetMotion, StepContext, Stepping};
use metachron_core::{Anchor, Body, CurveState, Resolution, SimSpan, Snapshot, StepError, StepReport, check_span};
use metachron_geometry::{CollisionShape, ContactSide, Place, PlacedShape, Solid};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A row of points that falls freely; it keeps every promise but the one in `breaks`.
#[derive(Clone)]
struct Row {
    breaks: Option<Promise>,
    speed: f64,
    height: f64,
    held: Resolution,
}

const G: f64 = 10.0;
/// Differs from one agent to the next, as an address or a clock would.
static BORN: AtomicU64 = AtomicU64::new(1);

impl Row {
    fn points(&self) -> usize {
        (1.0 / self.held.eps_m).round() as usize
    }

    fn breaks(&self, promise: Promise) -> bool {
        self.breaks == Some(promise)
    }
}

impl Agent for Row {
    fn model(&self) -> &'static str {
        "row"
    }

    fn set_motion(&mut self, motion: &SetMotion) -> bool {
        self.speed = motion.velocity_m_s.map_or(self.speed, |v| v.z);
        motion.velocity_m_s.is_some()
    }

    fn inputs(&self) -> Inputs {
        Inputs::of(&[Input::Resolution]).with(Input::Velocity, !self.breaks(Promise::Inputs))
    }

    fn resolution(&self) -> Option<Resolution> {
        Some(self.held)
    }

    fn set_resolution(&mut self, wanted: Resolution) {
        if self.breaks(Promise::Retune) && wanted != self.held {
            self.speed *= 1.0 + 1e-9;
        }
        self.held = wanted;
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Own(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        let wrong = if self.breaks(Promise::Residual) { 1.0 / self.held.eps_m } else { self.held.eps_m };
        into.residual_m = wrong;
        let n = self.points();
        let at = |i: usize| DVec3::new(i as f64 / n as f64, 0.0, self.height);
        into.body = Body::Curve(CurveState {
            arc_m: (0..=n).map(|i| i as f64 / n as f64).collect(),
            positions: (0..=n).map(at).collect(),
            velocities: vec![DVec3::Z * self.speed; n + 1],
            frames: vec![DQuat::IDENTITY; n],
            radii_m: vec![0.1; n + 1],
            flattening_m: vec![],
        });
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        // its middle is half a metre out along x
        (DVec3::Z * self.speed, DVec3::Y * (-0.5 * self.speed))
    }

    fn mass_kg(&self) -> f64 {
        1.0
    }
}

impl OwnSteps for Row {
    fn step(&mut self, dt: SimSpan, context: &StepContext<'_>) -> Result<StepReport, StepError> {
        if self.breaks(Promise::RefusedSpan) {
            self.height += 1e-12;
        }
        let dt_s = check_span(dt)?;
        if context.user_springs.iter().any(|hand| !hand.target.is_finite()) {
            if !self.breaks(Promise::Finite) {
                return Err(StepError::Diverged { model: "row", dt_s, what: "a hand".to_owned() });
            }
            self.height = f64::NAN;
        }
        let born = BORN.fetch_add(1, Ordering::Relaxed) as f64;
        let noise = if self.breaks(Promise::SameBits) { born * 1e-12 } else { 0.0 };
        let lost = if self.breaks(Promise::ExactTime) { 0.99 } else { 1.0 };
        self.height += self.speed * dt_s + noise;
        self.speed -= G * dt_s * lost;
        Ok(StepReport { work: 1.0, substeps: 1, at_rest: false })
    }
}

fn broken(breaks: Option<Promise>) -> Vec<Promise> {
    let make = || {
        let held = Resolution { eps_m: 0.1, n: 0 };
        Box::new(Row { breaks, speed: 0.0, height: 3.0, held }) as Box<dyn Agent>
    };
    let deviation = |agent: &dyn Agent, t: f64| crate::conformance::fall_deviation(agent, DVec3::Z * -G, t);
    let count = |work: &mut dyn FnMut()| {
        work();
        u64::from(breaks == Some(Promise::Allocation))
    };
    let hand = AnchorSpring {
        by: None,
        anchor: Anchor::Arc(0.5),
        target: DVec3::NAN,
        target_velocity: DVec3::ZERO,
        stiffness_n_m: 1.0,
        damping_n_s_m: 0.0,
    };
    let suite = Suite {
        closed_form: Some((&deviation, 1e-12)), // 200 roundings
        resolutions: [0.2, 0.1, 0.05].map(|eps_m| Resolution { eps_m, n: 0 }).to_vec(),
        converging: Some((&make, 1)),
        absurd: vec![hand],
        allocations: Some((&count, 0.0)),
        ..Suite::new(&make, SimSpan::from_nanos(1_000_000))
    };
    check(&suite).into_iter().map(|Breach { promise, .. }| promise).collect()
}

#[test]
fn a_conforming_agent_has_no_breach() {
    assert_eq!(broken(None), []);
}

#[test]
fn every_broken_promise_is_reported_and_no_other() {
    let all = [
        Promise::ExactTime,
        Promise::RefusedSpan,
        Promise::Retune,
        Promise::Residual,
        Promise::SameBits,
        Promise::Inputs,
        Promise::Allocation,
        Promise::Finite,
    ];
    for promise in all {
        // noise in the bits is found by every comparison of bits
        let found = broken(Some(promise));
        assert!(found.contains(&promise), "{promise:?} was not found");
        let others = found.iter().filter(|p| **p != promise && **p != Promise::RefusedSpan).count();
        assert_eq!(others, 0, "breaking {promise:?} was taken for {found:?}");
    }
}

/// A slab that stands still, with a skin or without.
struct Slab {
    body: KinematicBody,
    has_skin: bool,
}

impl Agent for Slab {
    fn model(&self) -> &'static str {
        "slab"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Cluster(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        self.body.write_snapshot(into);
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        self.body.momentum()
    }

    fn mass_kg(&self) -> f64 {
        0.0
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        self.body.form()
    }
}

impl ClusterMember for Slab {
    fn role(&self) -> Role {
        Role::Kinematic
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        self.body.begin(h_s)
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        self.body.skin().filter(|_| self.has_skin)
    }

    fn skin_point(&self, place: &Place, contact: ContactSide) -> SkinPoint {
        self.body.skin_point(place, contact)
    }

    fn keep(&mut self) {
        self.body.keep();
    }

    fn go_back(&mut self) {
        self.body.go_back();
    }

    fn end(&mut self, step: &StepEnd<'_>) -> Result<(), StepError> {
        self.body.end(step)
    }
}

#[test]
fn a_slab_carries_a_load_and_one_without_a_skin_is_reported() {
    for has_skin in [true, false] {
        let make = || {
            let solid = Solid::Box { half_extents_m: DVec3::new(0.1, 0.1, 0.01) };
            let spec = RigidSpec { led: Some(Led::default()), ..RigidSpec::free(solid, DVec3::ZERO, 1.0) };
            Box::new(Slab { body: KinematicBody::new(&spec).unwrap(), has_skin }) as Box<dyn Agent>
        };
        let load = Load { make: &make, stands_m: DVec3::Z * 0.01, half_m: 0.05, mass_kg: 2.0, settles_s: 0.5 };
        let suite = Suite { load: Some(load), steps: 10, ..Suite::new(&make, SimSpan::from_millis(4)) };
        let broken: Vec<_> = check(&suite).into_iter().map(|Breach { promise, .. }| promise).collect();
        let expected: &[Promise] = if has_skin { &[] } else { &[Promise::Carries] };
        assert_eq!(broken, expected);
    }
}
