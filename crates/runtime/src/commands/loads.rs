//! Users' commands that act on an agent: springs, forces, impulses, motors and poses, each for as long as it was sent
//! for.
//!
//! In: commands as the mailbox hands them over. Out: the loads of a step. Never here: their effect in the step.

use super::mailbox::{Keyed, PendingCommands};
use metachron_contact::{AnchorForce, AnchorSpring, PoseGoal, SetMotor};
use metachron_core::{SimSpan, SimTime};

/// All that users do to an agent.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Loads {
    springs: Vec<Timed<AnchorSpring>>,
    forces: Vec<Timed<AnchorForce>>,
    motors: Vec<Timed<SetMotor>>,
    /// At most one, as it is when the agent takes it.
    poses: Vec<Timed<Led>>,
    impulses: Vec<TimedImpulse>,
    /// The loads of the step that was prepared last.
    #[serde(skip)]
    acting: Acting,
}

/// The loads of a step.
#[derive(Debug, Default)]
pub(crate) struct Acting {
    pub springs: Vec<AnchorSpring>,
    /// In the mean of the step.
    pub forces: Vec<AnchorForce>,
    pub motors: Vec<SetMotor>,
    /// Where it is led when the step begins.
    pub pose: Option<PoseGoal>,
}

impl Acting {
    /// No loads.
    pub const NOTHING: Self = Self { springs: Vec::new(), forces: Vec::new(), motors: Vec::new(), pose: None };
}

/// A pose, and when it was one.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct Led {
    goal: PoseGoal,
    from: SimTime,
}

#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct Timed<T> {
    key: u32,
    what: T,
    /// From when on it no longer acts; `None` where it acts until it is taken back.
    until: Option<SimTime>,
}

/// An impulse: it acts evenly over one step.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct TimedImpulse {
    /// N·s and N·m·s.
    impulse: AnchorForce,
    /// The start of the step in which it acts, once that is known.
    at: Option<SimTime>,
}

impl Loads {
    /// Takes the commands that came in, at `now` of the agent's time.
    pub fn take(&mut self, sent: &mut PendingCommands, now: SimTime) {
        update(&mut self.springs, &mut sent.springs, now, |spring| spring);
        update(&mut self.forces, &mut sent.forces, now, |force| force);
        update(&mut self.motors, &mut sent.motors, now, |motor| motor);
        update(&mut self.poses, &mut sent.poses, now, |goal| Led { goal, from: now });
        self.impulses.extend(sent.impulses.drain(..).map(|impulse| TimedImpulse { impulse, at: None }));
    }

    /// Prepares a step of `dt` from `time`. A force that ends within it acts for its part of it, all else to its end.
    pub fn prepare(&mut self, time: SimTime, dt: SimSpan) {
        let Self { springs, forces, motors, poses, impulses, acting } = self;
        springs.retain(|spring| spring.acts(time));
        forces.retain(|force| force.acts(time));
        motors.retain(|motor| motor.acts(time));
        poses.retain(|pose| pose.acts(time));
        acting.pose = poses.first().map(|pose| pose.what.goal.after(time.secs_after(pose.what.from)));
        // a step that is made again has the same impulses
        impulses.retain(|impulse| impulse.at.is_none_or(|at| at == time));
        impulses.iter_mut().for_each(|impulse| impulse.at = Some(time));
        acting.springs.clear();
        acting.springs.extend(springs.iter().map(|spring| spring.what));
        acting.motors.clear();
        acting.motors.extend(motors.iter().map(|motor| motor.what));
        let dt_s = dt.as_secs_f64();
        acting.forces.clear();
        acting.forces.extend(forces.iter().map(|force| {
            let left = force.until.map_or(dt, |until| until.since(time).min(dt));
            scaled(force.what, left.as_secs_f64() / dt_s)
        }));
        acting.forces.extend(impulses.iter().map(|impulse| scaled(impulse.impulse, dt_s.recip())));
    }

    /// The loads of the step prepared last.
    pub const fn acting(&self) -> &Acting {
        &self.acting
    }

    /// Whether something acts at `now` or later that keeps the agent from resting. A motor that moves its joint does so by itself.
    pub fn keep_awake(&self, now: SimTime) -> bool {
        let pulled = self.springs.iter().any(|spring| spring.acts(now));
        pulled
            || self.forces.iter().any(|force| force.acts(now))
            || self.impulses.iter().any(|impulse| impulse.at.is_none())
    }
}

impl<T> Timed<T> {
    fn acts(&self, at: SimTime) -> bool {
        self.until.is_none_or(|until| at < until)
    }
}

/// Replaces each entry by the one that was sent with the same key.
fn update<T, U>(mine: &mut Vec<Timed<U>>, sent: &mut Vec<Keyed<T>>, now: SimTime, taken: impl Fn(T) -> U) {
    for Keyed { key, what, lasts } in sent.drain(..) {
        mine.retain(|old| old.key != key);
        let place = mine.partition_point(|old| old.key < key);
        if let Some(what) = what {
            mine.insert(place, Timed { key, what: taken(what), until: lasts.map(|span| now + span) });
        }
    }
}

fn scaled(force: AnchorForce, by: f64) -> AnchorForce {
    AnchorForce { force_n: force.force_n * by, torque_n_m: force.torque_n_m * by, ..force }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use metachron_core::Anchor;

    fn ms(milliseconds: u64) -> SimTime {
        SimTime::ZERO + SimSpan::from_millis(milliseconds)
    }

    fn push(newtons: f64) -> AnchorForce {
        AnchorForce { anchor: Anchor::Local(DVec3::ZERO), force_n: DVec3::X * newtons, torque_n_m: DVec3::Z * newtons }
    }

    /// Force times time over steps of `dt_ms` from `from_ms` on.
    fn given_n_s(loads: &mut Loads, from_ms: u64, dt_ms: u64, steps: u64) -> f64 {
        let dt = SimSpan::from_millis(dt_ms);
        let given = (0..steps).map(|step| {
            loads.prepare(ms(from_ms + step * dt_ms), dt);
            loads.acting().forces.iter().map(|force| force.force_n.x * dt.as_secs_f64()).sum::<f64>()
        });
        given.sum()
    }

    #[test]
    fn a_force_gives_exactly_what_it_was_sent_for_whatever_the_steps() {
        for (dt_ms, steps) in [(4, 30), (7, 20), (50, 4), (120, 1)] {
            let mut loads = Loads::default();
            let lasts = Some(SimSpan::from_millis(100));
            let mut sent =
                PendingCommands { forces: vec![Keyed { key: 1, what: Some(push(3.0)), lasts }], ..Default::default() };
            loads.take(&mut sent, ms(10));
            assert!(loads.keep_awake(ms(10)));
            assert!((given_n_s(&mut loads, 10, dt_ms, steps) - 0.3).abs() < 1e-12);
            assert!(!loads.keep_awake(ms(110)), "it has ended");
        }
    }

    #[test]
    fn an_impulse_is_given_once_and_again_where_its_step_is_made_again() {
        let mut loads = Loads::default();
        let mut sent = PendingCommands { impulses: vec![push(0.5)], ..Default::default() };
        loads.take(&mut sent, ms(0));
        for _ in 0..2 {
            assert!((given_n_s(&mut loads, 0, 8, 1) - 0.5).abs() < 1e-15);
        }
        assert_eq!(given_n_s(&mut loads, 8, 8, 3), 0.0);
    }

    #[test]
    fn the_newest_of_a_key_takes_the_place_of_the_older_and_others_stay() {
        let mut loads = Loads::default();
        let force = |key, newtons: Option<f64>| Keyed { key, what: newtons.map(push), lasts: None };
        let mut sent =
            PendingCommands { forces: vec![force(2, Some(1.0)), force(1, Some(10.0))], ..Default::default() };
        loads.take(&mut sent, ms(0));
        assert!((given_n_s(&mut loads, 0, 1000, 1) - 11.0).abs() < 1e-12);
        sent.forces.push(force(1, Some(20.0)));
        loads.take(&mut sent, ms(0));
        assert!((given_n_s(&mut loads, 0, 1000, 1) - 21.0).abs() < 1e-12);
        sent.forces.push(force(1, None));
        loads.take(&mut sent, ms(0));
        assert!((given_n_s(&mut loads, 0, 1000, 1) - 1.0).abs() < 1e-12);
    }
}
