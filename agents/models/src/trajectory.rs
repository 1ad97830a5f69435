//! The path through the keyframes of a led body: a smooth curve through all of them, and the way back to it.
//!
//! In: keyframes and a time. Out: a [`Pose`] and its velocity. Never here: user springs, grasping jaws.
//!
//! Tip and jaw are monotone cubics (FB84): once continuously differentiable, and between two keyframes no coordinate leaves
//! the range of both, so a tool never dips below the place it was sent to. Rotation is a slerp along 3u² − 2u³, at rest
//! in every keyframe. A script that repeats is one closed curve.

use glam::{DQuat, DVec3, DVec4};
use metachron_core::{Archive, ArchiveError};

/// Rate at which a body that was led elsewhere returns to its script, 1/s: nine tenths of the distance in a second.
const RETURN_RATE_PER_S: f64 = 4.0;
/// Rotations whose dot product is within this of one are the same.
const SAME_TURN: f64 = 1e-14;

/// Pose of a led body at one time of its script.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Keyframe {
    /// Seconds from the start of the script, ≥ 0.
    pub at_s: f64,
    /// The point between a tool's jaws, or the origin of a kinematic body's axes, metres.
    pub tip_m: DVec3,
    /// Rotation from its axes (a tool's shaft along −z, so the jaws point along +z) to the world's.
    pub rotation: DQuat,
    /// Opening of a tool's jaws: 0 shut … 1 wide open. Jaws that close past 0.2 grasp; above 0.3 they release.
    pub jaw: f64,
}

/// A moving point.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct PointMotion {
    /// Metres.
    pub position: DVec3,
    /// Metres per second.
    pub velocity: DVec3,
}

impl PointMotion {
    /// How it moves as seen from `other`.
    pub(crate) fn relative_to(self, other: Self) -> Self {
        Self { position: self.position - other.position, velocity: self.velocity - other.velocity }
    }

    /// This deviation after `t` seconds of critical damping: exact for any step.
    pub(crate) fn decayed(self, damping_per_s: f64, t: f64) -> Self {
        let left = libm::exp(-damping_per_s * t);
        let push = self.velocity + self.position * damping_per_s;
        Self {
            position: (self.position + push * t) * left,
            velocity: (self.velocity - push * (damping_per_s * t)) * left,
        }
    }
}

/// The pose that the script commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pose {
    pub tip: DVec3,
    pub velocity: DVec3,
    pub rotation: DQuat,
    pub jaw: f64,
}

/// A keyframe and the slope of the curve there.
#[derive(Debug, Clone, Copy)]
struct SplineKey {
    at_s: f64,
    /// Tip and jaw.
    value: DVec4,
    slope: DVec4,
    rotation: DQuat,
}

/// A script ready to be read.
#[derive(Debug, Clone)]
pub(crate) struct Script {
    keys: Vec<SplineKey>,
    repeat: bool,
    /// Time at which the script starts, seconds.
    begin_s: f64,
}

impl Pose {
    /// The pose `dt` seconds later of a body that is here, while its script goes from one pose to another: the offset
    /// from it decays.
    pub(crate) fn returning(&self, from: &Self, to: &Self, dt: f64) -> Self {
        let motion = |pose: &Self| PointMotion { position: pose.tip, velocity: pose.velocity };
        let off = motion(self).relative_to(motion(from)).decayed(RETURN_RATE_PER_S, dt);
        let turned_off = self.rotation * from.rotation.conjugate();
        let rotation = if turned_off.w.abs() >= 1.0 - SAME_TURN {
            to.rotation
        } else {
            let left = libm::exp(-RETURN_RATE_PER_S * dt);
            (DQuat::IDENTITY.slerp(turned_off, left) * to.rotation).normalize()
        };
        Self { tip: to.tip + off.position, velocity: to.velocity + off.velocity, rotation, jaw: to.jaw }
    }
}

impl Script {
    /// Writes or reads when it starts; its keys never change.
    pub(crate) fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.value(&mut self.begin_s)
    }

    /// A curve through `keyframes`: at least one, times rising.
    pub(crate) fn new(keyframes: &[Keyframe], repeat: bool) -> Self {
        let mut keys: Vec<SplineKey> = keyframes
            .iter()
            .map(|key| SplineKey {
                at_s: key.at_s,
                value: key.tip_m.extend(key.jaw),
                slope: DVec4::ZERO,
                rotation: key.rotation.normalize(),
            })
            .collect();
        if repeat && keys.len() > 1 {
            close_loop(&mut keys);
        }
        set_slopes(&mut keys, repeat);
        let repeat = repeat && keys.len() > 1;
        Self { keys, repeat, begin_s: 0.0 }
    }

    /// Shifts the start of the script by so many seconds, later if positive.
    pub(crate) fn begin_later(&mut self, by_s: f64) {
        self.begin_s += by_s;
    }

    /// The pose at `time_s`: before its first keyframe the script waits in it, after its last it waits in that.
    pub(crate) fn at(&self, time_s: f64) -> Pose {
        let time_s = time_s - self.begin_s;
        let (first, last) = (self.keys[0], self.keys[self.keys.len() - 1]);
        let t = if self.repeat && time_s > first.at_s {
            first.at_s + (time_s - first.at_s) % (last.at_s - first.at_s)
        } else {
            time_s
        };
        let right = self.keys.partition_point(|key| key.at_s <= t);
        match (right.checked_sub(1), self.keys.get(right)) {
            (None, _) => pose_at(&first),
            (Some(left), Some(next)) => between(&self.keys[left], next, t),
            (Some(_), None) => pose_at(&last),
        }
    }

    /// Whether the script no longer moves from `time_s` on.
    pub(crate) fn is_over(&self, time_s: f64) -> bool {
        !self.repeat && time_s - self.begin_s >= self.keys[self.keys.len() - 1].at_s
    }
}

/// Appends a keyframe that returns to the start, so that the script can repeat without a jump.
fn close_loop(keys: &mut Vec<SplineKey>) {
    let (first, before, last) = (keys[0], keys[keys.len() - 2], keys[keys.len() - 1]);
    let same = first.value == last.value && first.rotation.dot(last.rotation).abs() >= 1.0 - 1e-12;
    if !same {
        keys.push(SplineKey { at_s: last.at_s + (last.at_s - before.at_s), ..first });
    }
}

/// The harmonic mean of both neighbouring slopes where they agree in sign, else zero (FB84); zero at open ends.
fn set_slopes(keys: &mut [SplineKey], closed: bool) {
    let last = keys.len() - 1;
    let secant = |a: &SplineKey, b: &SplineKey| Secant {
        span_s: b.at_s - a.at_s,
        slope: (b.value - a.value) / (b.at_s - a.at_s),
    };
    for i in 1..last {
        keys[i].slope = mean_slope(secant(&keys[i - 1], &keys[i]), secant(&keys[i], &keys[i + 1]));
    }
    if closed && last > 1 {
        let wrapped = mean_slope(secant(&keys[last - 1], &keys[last]), secant(&keys[0], &keys[1]));
        (keys[0].slope, keys[last].slope) = (wrapped, wrapped);
    }
}

/// The straight line between two keyframes: its duration, seconds, and its slope per second.
#[derive(Clone, Copy)]
struct Secant {
    span_s: f64,
    slope: DVec4,
}

fn mean_slope(before: Secant, after: Secant) -> DVec4 {
    let (Secant { span_s: h0, slope: s0 }, Secant { span_s: h1, slope: s1 }) = (before, after);
    let (w0, w1) = (h0 + 2.0 * h1, 2.0 * h0 + h1);
    let mean = |a: f64, b: f64| if a * b > 0.0 { (w0 + w1) / (w0 / a + w1 / b) } else { 0.0 };
    DVec4::new(mean(s0.x, s1.x), mean(s0.y, s1.y), mean(s0.z, s1.z), mean(s0.w, s1.w))
}

fn pose_at(key: &SplineKey) -> Pose {
    Pose { tip: key.value.truncate(), velocity: DVec3::ZERO, rotation: key.rotation, jaw: key.value.w }
}

/// The cubic Hermite curve between two knots.
fn between(a: &SplineKey, b: &SplineKey, t: f64) -> Pose {
    let h = b.at_s - a.at_s;
    let u = (t - a.at_s) / h;
    let (u2, u3) = (u * u, u * u * u);
    let rise = 3.0 * u2 - 2.0 * u3;
    let value =
        a.value * (1.0 - rise) + b.value * rise + a.slope * (h * (u3 - 2.0 * u2 + u)) + b.slope * (h * (u3 - u2));
    let velocity = (b.value - a.value) * (6.0 * (u - u2) / h)
        + a.slope * (3.0 * u2 - 4.0 * u + 1.0)
        + b.slope * (3.0 * u2 - 2.0 * u);
    Pose {
        tip: value.truncate(),
        velocity: velocity.truncate(),
        rotation: a.rotation.slerp(b.rotation, rise).normalize(),
        jaw: value.w.clamp(0.0, 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys() -> Vec<Keyframe> {
        let key = |at_s, x, z, turn: f64, jaw| Keyframe {
            at_s,
            tip_m: DVec3::new(x, 0.0, z),
            rotation: DQuat::from_rotation_y(turn),
            jaw,
        };
        vec![
            key(0.5, 0.0, 1.0, 0.0, 1.0),
            key(1.0, 0.3, 0.2, 0.5, 0.0),
            key(3.0, 1.0, 0.1, 2.0, 0.0),
            key(3.5, 0.2, 0.9, 0.0, 1.0),
        ]
    }

    #[test]
    fn the_script_passes_through_every_keyframe() {
        for repeat in [false, true] {
            let script = Script::new(&keys(), repeat);
            for key in keys() {
                let pose = script.at(key.at_s);
                assert!(pose.tip.distance(key.tip_m) < 1e-15, "{pose:?}"); // exact but for the last rounding
                assert!((pose.jaw - key.jaw).abs() < 1e-15);
                assert!(pose.rotation.angle_between(key.rotation) < 1e-7); // acos near 1 loses half the digits
            }
        }
    }

    #[test]
    fn position_and_velocity_have_no_jump_anywhere_not_even_where_it_starts_again() {
        for repeat in [false, true] {
            let script = Script::new(&keys(), repeat);
            let h = 1e-5;
            // the largest acceleration of these legs is below 60 m/s²: a change of 2 h times that is no jump
            for i in 0..900_000_u32 {
                let t = f64::from(i) * h;
                let (a, b) = (script.at(t), script.at(t + h));
                assert!((b.velocity - a.velocity).length() < 120.0 * h, "repeat {repeat}: velocity jumps at {t}");
                let moved = (b.tip - a.tip) / h - 0.5 * (a.velocity + b.velocity);
                assert!(moved.length() < 120.0 * h, "repeat {repeat}: at {t} the velocity is not how the tip moves");
                assert!((b.jaw - a.jaw).abs() < 10.0 * h && a.rotation.angle_between(b.rotation) < 1e-3);
            }
        }
    }

    #[test]
    fn between_two_keyframes_no_coordinate_leaves_their_range() {
        let script = Script::new(&keys(), false);
        for pair in keys().windows(2) {
            let (low, high) = (pair[0].tip_m.min(pair[1].tip_m), pair[0].tip_m.max(pair[1].tip_m));
            for i in 0..=1000_u32 {
                let t = pair[0].at_s + (pair[1].at_s - pair[0].at_s) * f64::from(i) / 1000.0;
                let tip = script.at(t).tip;
                assert!((tip - tip.clamp(low, high)).length() < 1e-15, "{tip} at {t}"); // rounding
            }
        }
    }

    #[test]
    fn a_script_that_ends_elsewhere_goes_back_in_as_long_as_its_last_leg_took() {
        let script = Script::new(&keys(), true);
        assert!(script.at(4.0).tip.distance(keys()[0].tip_m) < 1e-12); // rounding of the remainder
        assert!(script.at(0.5 + 7.0 * 3.5 + 0.5).tip.distance(keys()[1].tip_m) < 1e-12);
        assert!(!script.is_over(1e6) && Script::new(&keys(), false).is_over(3.5));
    }
}
