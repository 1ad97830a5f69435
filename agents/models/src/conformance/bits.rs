//! Promises about bits: refused steps, repeated runs, memory, states that are not finite.
//!
//! In: a [`Suite`]. Out: the promises that were broken. Never here: promises about physics ([`super::physics`]).

use super::{Run, Suite, too_long};
use metachron_core::{Archive, ArchiveError, SimSpan, StepError};

/// A refused step changes no bit, neither of the state nor of the steps after it.
pub(super) fn refused_span(suite: &Suite<'_>) -> Result<(), String> {
    let (mut refusing, mut reference) = (suite.start(), suite.start());
    for i in 0..suite.steps.min(50) {
        let before = refusing.hash();
        for bad in [SimSpan::ZERO, too_long(), SimSpan::from_nanos(u64::MAX)] {
            match refusing.step(bad, &[]) {
                Err(StepError::BadSpan { .. }) => {}
                other => {
                    return Err(format!(
                        "a step of {} s gave {other:?}; expected StepError::BadSpan",
                        bad.as_secs_f64()
                    ));
                }
            }
            if refusing.hash() != before {
                return Err(format!("a refused step of {} s changed the state", bad.as_secs_f64()));
            }
        }
        refusing.must_step(suite.dt, &[])?;
        reference.must_step(suite.dt, &[])?;
        if refusing.hash() != reference.hash() {
            return Err(format!("step {i} differs after steps were refused"));
        }
    }
    Ok(())
}

/// The step number `i` of a run in which the agent is pulled and divided anew.
fn busy_step(suite: &Suite<'_>, run: &mut Run<'_>, i: u32) -> Result<(), String> {
    let pulled = (suite.steps / 3..suite.steps / 2).contains(&i);
    if let Some(wanted) = suite.resolutions.get(i as usize / 20 % suite.resolutions.len().max(1)) {
        run.agent.set_resolution(*wanted);
    }
    run.must_step(suite.dt, suite.pull.filter(|_| pulled).as_slice())
}

/// A saved state that is read back goes on with the same bits.
pub(super) fn archive(suite: &Suite<'_>) -> Result<(), String> {
    let (mut run, mut other) = (suite.start(), suite.start());
    let marks = [1, 2, 3, 5].map(|part| part * suite.steps / 6);
    for i in 0..suite.steps {
        busy_step(suite, &mut run, i)?;
        if !marks.contains(&i) {
            busy_step(suite, &mut other, i)?;
            if i > marks[0] && run.hash() != other.hash() {
                return Err(format!("what was read back differs after step {i}"));
            }
            continue;
        }
        let mut archive = Archive::writer();
        match run.archive(&mut archive) {
            Err(ArchiveError::Refused { .. }) => return Ok(()),
            outcome => outcome.map_err(|error| error.to_string())?,
        }
        let bytes = archive.into_bytes();
        // built anew at one mark, elsewhere at the next
        if i == marks[1] {
            other = suite.start();
        } else {
            (0..5).try_for_each(|_| other.must_step(suite.dt, suite.pull.as_slice()))?;
        }
        let mut archive = Archive::reader(&bytes);
        other.archive(&mut archive).and_then(|()| archive.finish()).map_err(|error| error.to_string())?;
        if run.hash() != other.hash() {
            return Err(format!("what was read back after step {i} is not what was saved"));
        }
    }
    Ok(())
}

/// Two agents with the same inputs give the same bits.
pub(super) fn same_bits(suite: &Suite<'_>) -> Result<(), String> {
    let (mut one, mut other) = (suite.start(), suite.start());
    for i in 0..suite.steps {
        [&mut one, &mut other].into_iter().try_for_each(|run| busy_step(suite, run, i))?;
        if one.hash() != other.hash() {
            return Err(format!("two equal runs differ after step {i}"));
        }
    }
    Ok(())
}

/// Steps and snapshots allocate nothing once the sizes have settled.
pub(super) fn allocation(suite: &Suite<'_>) -> Result<(), String> {
    let Some((count, allowed)) = suite.allocations else { return Ok(()) };
    let mut run = suite.start();
    let mut snapshot = run.snapshot();
    for _ in 0..suite.steps {
        run.must_step(suite.dt, suite.pull.as_slice())?;
        run.agent.write_snapshot(&mut snapshot);
    }
    let mut failed = None;
    let counted = count(&mut || {
        for _ in 0..suite.steps {
            failed = failed.take().or(run.step(suite.dt, suite.pull.as_slice()).err());
            run.agent.write_snapshot(&mut snapshot);
        }
    });
    if let Some(error) = failed {
        return Err(error.to_string());
    }
    let each = counted as f64 / f64::from(suite.steps);
    if each <= allowed { Ok(()) } else { Err(format!("{each} allocations a step; expected at most {allowed}")) }
}

/// Under any pull no state is written that is not finite: the agent reports that it has diverged, or ignores the pull.
pub(super) fn finite(suite: &Suite<'_>) -> Result<(), String> {
    let mut run = suite.start();
    for i in 0..suite.steps {
        check_finite(&run).map_err(|what| format!("before step {i}: {what}"))?;
        run.must_step(suite.dt, suite.pull.as_slice())?;
    }
    for pull in &suite.absurd {
        let mut run = suite.start();
        run.must_step(suite.dt, &[])?;
        match run.step(suite.dt, &[*pull]) {
            Ok(()) | Err(StepError::Diverged { .. }) => {}
            Err(other) => {
                return Err(format!(
                    "a pull to {} gave {other:?}; expected a step or StepError::Diverged",
                    pull.target
                ));
            }
        }
        check_finite(&run).map_err(|what| format!("after a pull to {}: {what}", pull.target))?;
    }
    Ok(())
}

fn check_finite(run: &Run<'_>) -> Result<(), String> {
    let snapshot = run.snapshot();
    let numbers = [("energy", snapshot.energy_j), ("residual", snapshot.residual_m), ("mass", run.agent.mass_kg())];
    if let Some((what, value)) = numbers.iter().find(|(_, value)| !value.is_finite()) {
        return Err(format!("the {what} is {value}"));
    }
    if snapshot.residual_m < 0.0 {
        return Err(format!("the residual is {}", snapshot.residual_m));
    }
    if !snapshot.body.is_finite() {
        return Err("the body is not finite".to_owned());
    }
    if let Some(grip) = snapshot.grips.iter().find(|grip| !grip.force_n.is_finite()) {
        return Err(format!("the grip force is {}", grip.force_n));
    }
    Ok(())
}
