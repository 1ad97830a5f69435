//! Interpolated and extrapolated states of snapshots.
//!
//! In: one or two snapshots and a time. Out: a body at a time, written into reused storage.
//! Never here: the choice of snapshots. Curves whose division changed between snapshots are matched by rest arc length.

use glam::{DQuat, DVec2, DVec3};
use metachron_core::{Body, CurveState, RigidState, SimTime, Snapshot, SoftState, ToolState};

/// Limit of extrapolation, seconds: the displayed state of an agent that stopped must not fly apart.
const BEYOND_MAX_S: f64 = 0.1;

/// Writes the state between two snapshots for the frame at `time`, one step of the agent earlier; returns its time.
///
/// The state one step earlier is between two published ones as long as the agent keeps its rate.
pub fn between(before: &Snapshot, newest: &Snapshot, time: SimTime, into: &mut Body) -> SimTime {
    let span = newest.moment().secs_after(before.moment());
    let step = span / newest.steps.saturating_sub(before.steps).max(1) as f64;
    let w = ((time.secs_after(before.moment()) - step) / span).clamp(0.0, 1.0);
    if !(w < 1.0 && blend(&before.body, &newest.body, w, into)) {
        copy(&newest.body, into);
        return newest.moment();
    }
    let late = std::time::Duration::from_secs_f64(span * w);
    SimTime::from_nanos(before.moment().as_nanos() + u64::try_from(late.as_nanos()).unwrap_or(0))
}

/// Writes the newest state extrapolated by its velocities to the frame at `time`; returns its time.
pub fn beyond(newest: &Snapshot, time: SimTime, into: &mut Body) -> SimTime {
    let age_s = time.secs_after(newest.moment()).clamp(0.0, BEYOND_MAX_S);
    copy(&newest.body, into);
    into.lead(age_s);
    let ahead = (age_s * 1e9) as u64;
    SimTime::from_nanos(newest.moment().as_nanos() + ahead)
}

/// Copies a body into reused storage.
pub fn copy(from: &Body, into: &mut Body) {
    match from {
        Body::Curve(curve) => {
            let to = into.curve_mut();
            to.arc_m.clone_from(&curve.arc_m);
            to.positions.clone_from(&curve.positions);
            to.velocities.clone_from(&curve.velocities);
            to.frames.clone_from(&curve.frames);
            to.radii_m.clone_from(&curve.radii_m);
            to.flattening_m.clone_from(&curve.flattening_m);
        }
        Body::Soft(soft) => {
            let to = into.soft_mut();
            to.positions.clone_from(&soft.positions);
            to.velocities.clone_from(&soft.velocities);
        }
        other => into.clone_from(other),
    }
}

/// Writes the body interpolated at `w` from `a` to `b`; `false` where they differ in kind.
fn blend(a: &Body, b: &Body, w: f64, into: &mut Body) -> bool {
    match (a, b) {
        (Body::Curve(a), Body::Curve(b)) if !a.arc_m.is_empty() => blend_curves(a, b, w, into.curve_mut()),
        (Body::Rigid(a), Body::Rigid(b)) => {
            *into = Body::Rigid(RigidState {
                position: a.position.lerp(b.position, w),
                rotation: turn(a.rotation, b.rotation, w),
                velocity: a.velocity.lerp(b.velocity, w),
                spin: a.spin.lerp(b.spin, w),
            });
        }
        (Body::Tool(a), Body::Tool(b)) => {
            *into = Body::Tool(ToolState {
                tip: a.tip.lerp(b.tip, w),
                led: a.led.lerp(b.led, w),
                rotation: turn(a.rotation, b.rotation, w),
                velocity: a.velocity.lerp(b.velocity, w),
                spin: a.spin.lerp(b.spin, w),
                jaw: a.jaw + (b.jaw - a.jaw) * w,
                grasp: b.grasp,
                admits: b.admits,
                force_n: a.force_n + (b.force_n - a.force_n) * w,
                is_idle: b.is_idle,
            });
        }
        (Body::Soft(a), Body::Soft(b)) if a.positions.len() == b.positions.len() => {
            blend_soft(a, b, w, into.soft_mut());
        }
        _ => return false,
    }
    true
}

/// Vertices interpolated at `w` from `a` to `b`.
fn blend_soft(a: &SoftState, b: &SoftState, w: f64, into: &mut SoftState) {
    let between = |from: &[DVec3], to: &[DVec3], into: &mut Vec<DVec3>| {
        into.clear();
        into.extend(from.iter().zip(to).map(|(a, b)| a.lerp(*b, w)));
    };
    between(&a.positions, &b.positions, &mut into.positions);
    between(&a.velocities, &b.velocities, &mut into.velocities);
}

/// Rotation from `a` to `b` along the shorter arc.
fn turn(a: DQuat, b: DQuat, w: f64) -> DQuat {
    a.slerp(if a.dot(b) < 0.0 { -b } else { b }, w)
}

/// Nodes of `b`, each interpolated from the position of its material point in `a`.
fn blend_curves(a: &CurveState, b: &CurveState, w: f64, into: &mut CurveState) {
    into.arc_m.clone_from(&b.arc_m);
    into.positions.clear();
    into.velocities.clear();
    into.frames.clear();
    into.radii_m.clear();
    into.flattening_m.clear();
    let mut reader = CurveReader { curve: a, left: 0 };
    for (i, &arc_m) in b.arc_m.iter().enumerate() {
        let (position, velocity, radius) = reader.node(arc_m);
        into.positions.push(position.lerp(b.positions[i], w));
        into.velocities.push(velocity.lerp(b.velocities[i], w));
        into.radii_m.push(radius + (b.radii_m[i] - radius) * w);
    }
    reader.left = 0;
    for (&arc_m, &flattening) in b.arc_m.iter().zip(&b.flattening_m) {
        into.flattening_m.push(reader.flattening(arc_m).unwrap_or(flattening).lerp(flattening, w));
    }
    reader.left = 0;
    for (i, &frame) in b.frames.iter().enumerate() {
        let was = reader.frame(0.5 * (b.arc_m[i] + b.arc_m[i + 1])).unwrap_or(frame);
        into.frames.push(was.lerp(frame, w)); // normalised, along the shorter arc: frames of one step are close
    }
}

/// Reads a curve at rising arc lengths in one pass.
struct CurveReader<'a> {
    curve: &'a CurveState,
    left: usize,
}

impl CurveReader<'_> {
    fn seek(&mut self, arc_m: f64) {
        let last = self.curve.arc_m.len().saturating_sub(2);
        while self.left < last && self.curve.arc_m[self.left + 1] <= arc_m {
            self.left += 1;
        }
    }

    /// The nodes on both sides, and the share of the second.
    fn beside(&mut self, arc_m: f64) -> ([usize; 2], f64) {
        self.seek(arc_m);
        let (curve, left) = (self.curve, self.left);
        let right = (left + 1).min(curve.arc_m.len() - 1);
        let h = curve.arc_m[right] - curve.arc_m[left];
        ([left, right], if h > 0.0 { ((arc_m - curve.arc_m[left]) / h).clamp(0.0, 1.0) } else { 0.0 })
    }

    /// `None` where the sections are round.
    fn flattening(&mut self, arc_m: f64) -> Option<DVec2> {
        let ([left, right], w) = self.beside(arc_m);
        let list = &self.curve.flattening_m;
        Some(list.get(left)?.lerp(*list.get(right)?, w))
    }

    fn node(&mut self, arc_m: f64) -> (DVec3, DVec3, f64) {
        let ([left, right], w) = self.beside(arc_m);
        let curve = self.curve;
        let r = &curve.radii_m;
        (
            curve.positions[left].lerp(curve.positions[right], w),
            curve.velocities[left].lerp(curve.velocities[right], w),
            r[left] + (r[right] - r[left]) * w,
        )
    }

    fn frame(&mut self, arc_m: f64) -> Option<DQuat> {
        self.seek(arc_m);
        self.curve.frames.get(self.left).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64, steps: u64, body: Body) -> Snapshot {
        Snapshot { time: SimTime::from_nanos(ms * 1_000_000), steps, body, ..Snapshot::default() }
    }

    /// A straight curve 1 m long with `n` segments that moves along z at 2 m/s, at `t` seconds.
    fn moving(n: usize, t: f64) -> Body {
        let arc_m: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
        Body::Curve(CurveState {
            positions: arc_m.iter().map(|&s| DVec3::new(s, 0.0, 2.0 * t)).collect(),
            velocities: vec![DVec3::new(0.0, 0.0, 2.0); n + 1],
            frames: vec![DQuat::from_rotation_arc(DVec3::Z, DVec3::X); n],
            radii_m: vec![0.01; n + 1],
            flattening_m: vec![],
            arc_m,
        })
    }

    fn heights(body: &Body) -> Vec<f64> {
        let Body::Curve(curve) = body else { panic!("not a curve") };
        curve.positions.iter().map(|p| p.z).collect()
    }

    #[test]
    fn linear_motion_is_interpolated_exactly_one_step_late() {
        let (before, newest) = (at(100, 10, moving(8, 0.1)), at(140, 12, moving(8, 0.14)));
        let mut body = Body::Nothing;
        // the snapshots are two steps of 20 ms apart: the frame at 150 ms shows 130 ms
        let shown = between(&before, &newest, SimTime::from_nanos(150_000_000), &mut body);
        assert_eq!(shown.as_nanos() / 1000, 130_000);
        assert!(heights(&body).iter().all(|z| (z - 0.26).abs() < 1e-15));
    }

    #[test]
    fn linear_motion_is_extrapolated_exactly_up_to_a_limit() {
        let newest = at(100, 10, moving(8, 0.1));
        let mut body = Body::Nothing;
        beyond(&newest, SimTime::from_nanos(150_000_000), &mut body);
        assert!(heights(&body).iter().all(|z| (z - 0.3).abs() < 1e-15));
        beyond(&newest, SimTime::from_nanos(9_000_000_000), &mut body);
        assert!(heights(&body).iter().all(|z| (z - 0.4).abs() < 1e-15));
    }

    #[test]
    fn a_remeshed_curve_is_matched_by_material_points() {
        let (before, newest) = (at(0, 0, moving(5, 0.0)), at(40, 1, moving(12, 0.04)));
        let mut body = Body::Nothing;
        between(&before, &newest, SimTime::from_nanos(50_000_000), &mut body);
        let Body::Curve(curve) = &body else { panic!("not a curve") };
        assert_eq!(curve.positions.len(), 13);
        for (p, s) in curve.positions.iter().zip(&curve.arc_m) {
            assert!((*p - DVec3::new(*s, 0.0, 0.02)).length() < 1e-15, "{p}");
        }
    }

    #[test]
    fn a_turn_is_interpolated_at_constant_speed() {
        let rigid =
            |angle: f64| Body::Rigid(RigidState { rotation: DQuat::from_rotation_z(angle), ..RigidState::default() });
        let (before, newest) = (at(0, 0, rigid(0.0)), at(100, 1, rigid(2.0)));
        let mut body = Body::Nothing;
        between(&before, &newest, SimTime::from_nanos(125_000_000), &mut body);
        let Body::Rigid(state) = body else { panic!("not rigid") };
        assert!(state.rotation.angle_between(DQuat::from_rotation_z(0.5)) < 1e-7); // acos near 1 loses half the digits
    }

    #[test]
    fn a_late_agent_keeps_its_newest_state() {
        let (before, newest) = (at(0, 0, moving(4, 0.0)), at(10, 1, moving(4, 0.01)));
        let mut body = Body::Nothing;
        let shown = between(&before, &newest, SimTime::from_nanos(900_000_000), &mut body);
        assert_eq!(shown, newest.time);
        assert!(heights(&body).iter().all(|z| (z - 0.02).abs() < 1e-15));
    }
}
