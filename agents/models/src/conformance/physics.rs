//! Promises about physics: time, conservation across a change of resolution, convergence of the error.
//!
//! In: a [`Suite`]. Out: the promises that were broken. Never here: promises about bits ([`super::bits`]).

use super::{Run, Suite, extents, rest_length_m};
use metachron_contact::Agent;
use metachron_core::{Resolution, SimSpan};

/// Relative tolerance of a sum over a body's parts: a thousand rounding errors.
const ROUNDING: f64 = 1e-12;
/// Factor by which a finer resolution may leave a larger residual.
const RESIDUAL_SLACK: f64 = 1.1;

/// Steps of any length, also mixed, reach the closed form at the sum of their lengths.
pub(super) fn exact_time(suite: &Suite<'_>) -> Result<(), String> {
    let nanos = suite.dt.as_nanos();
    let mixed = [nanos, nanos / 3, nanos * 2, nanos / 7].map(|n| SimSpan::from_nanos(n.max(1)));
    for spans in [&[suite.dt][..], &mixed[..]] {
        let mut run = suite.start();
        for i in 0..suite.steps {
            run.must_step(spans[i as usize % spans.len()], &[])?;
        }
        if let Some((deviation, allowed)) = suite.closed_form {
            let wrong = deviation(run.agent.as_ref(), run.time.as_secs_f64());
            // NaN is a failure too
            if wrong.is_nan() || wrong > allowed {
                let t = run.time.as_secs_f64();
                return Err(format!(
                    "after {t} s the deviation from the closed form is {wrong:e}; expected at most {allowed:e}"
                ));
            }
        }
    }
    Ok(())
}

/// Quantities that a change of resolution must conserve.
struct Invariants {
    mass_kg: f64,
    length_m: f64,
    linear: glam::DVec3,
    angular: glam::DVec3,
    /// Mass × the fastest speed: the scale of rounding errors in momentum.
    push: f64,
    /// `push` × the distance of the farthest point from the origin: the same for angular momentum.
    swing: f64,
}

impl Invariants {
    fn of(run: &Run<'_>) -> Self {
        let body = run.snapshot().body;
        let (linear, angular) = run.agent.momentum();
        let ((speed, far), mass_kg) = (extents(&body), run.agent.mass_kg());
        Self {
            mass_kg,
            length_m: rest_length_m(&body),
            linear,
            angular,
            push: mass_kg * speed,
            swing: mass_kg * speed * far,
        }
    }
}

/// Mass, linear momentum and rest length stay; angular momentum changes by at most (ε/L)² of `swing`.
pub(super) fn set_resolution(suite: &Suite<'_>) -> Result<(), String> {
    let mut run = suite.start();
    for _ in 0..suite.steps.min(50) {
        run.must_step(suite.dt, suite.pull.as_slice())?;
    }
    if suite.resolutions.is_empty() {
        let before = run.hash();
        let wanted = run.agent.resolution().unwrap_or(Resolution { eps_m: 0.01, n: 2 });
        run.agent.set_resolution(wanted);
        return if run.hash() == before {
            Ok(())
        } else {
            Err("set_resolution with the present resolution changed the state".to_owned())
        };
    }
    // coarse to fine and back: coarsening loses more than refining
    for wanted in suite.resolutions.iter().chain(suite.resolutions.iter().rev()) {
        let (before, held_before) = (Invariants::of(&run), run.agent.resolution());
        run.agent.set_resolution(*wanted);
        let after = Invariants::of(&run);
        let eps_m = run.agent.resolution().map_or(0.0, |r| r.eps_m).max(held_before.map_or(0.0, |r| r.eps_m));
        compare(&before, &after, eps_m).map_err(|what| format!("retuned to ε {} m, {what}", wanted.eps_m))?;
        run.must_step(suite.dt, suite.pull.as_slice())?;
    }
    Ok(())
}

fn compare(before: &Invariants, after: &Invariants, eps_m: f64) -> Result<(), String> {
    if (after.mass_kg - before.mass_kg).abs() > ROUNDING * before.mass_kg {
        return Err(format!("mass went from {} to {} kg", before.mass_kg, after.mass_kg));
    }
    if (after.length_m - before.length_m).abs() > ROUNDING * before.length_m {
        return Err(format!("rest length went from {} to {} m", before.length_m, after.length_m));
    }
    if after.linear.distance(before.linear) > ROUNDING * before.push {
        return Err(format!("momentum went from {} to {} kg m/s", before.linear, after.linear));
    }
    let share = if before.length_m > 0.0 { (eps_m / before.length_m).powi(2) } else { 0.0 };
    if after.angular.distance(before.angular) > (share + ROUNDING) * before.swing {
        return Err(format!("angular momentum went from {} to {} kg m²/s", before.angular, after.angular));
    }
    Ok(())
}

/// At a converged state a finer ε does not leave a larger residual.
pub(super) fn residual(suite: &Suite<'_>) -> Result<(), String> {
    let Some((make, steps)) = suite.converging else { return Ok(()) };
    let mut run = Run { agent: make(), ..suite.start() };
    let mut last: Option<(f64, f64)> = None;
    for wanted in &suite.resolutions {
        run.agent.set_resolution(*wanted);
        for _ in 0..steps {
            run.must_step(suite.dt, &[])?;
        }
        let now = run.snapshot().residual_m;
        if let Some((eps_m, coarser)) = last.filter(|(_, coarser)| now > RESIDUAL_SLACK * coarser) {
            return Err(format!(
                "the residual is {coarser:e} m at ε {eps_m} m and {now:e} m at the finer ε {} m",
                wanted.eps_m
            ));
        }
        last = Some((wanted.eps_m, now));
    }
    Ok(())
}

/// Deviation of an agent's linear momentum from that of free fall from rest, relative to it: m g t exactly.
#[must_use]
pub fn fall_deviation(agent: &dyn Agent, gravity: glam::DVec3, t: f64) -> f64 {
    let wanted = gravity * (agent.mass_kg() * t);
    agent.momentum().0.distance(wanted) / wanted.length()
}
