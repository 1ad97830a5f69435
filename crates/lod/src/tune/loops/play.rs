//! Simulation of one closed loop: a law, a plant, a disturbance.
//!
//! In: a [`Trial`]. Out: its frames. The controller is the one used for drawing; the plant is the fitted one. Equal trials give equal
//! frames on every machine. Never here: the rating of a trial.

use super::candidate::Candidate;
use super::disturbance::{Disturbance, Random};
use super::plant::{Plant, ends};
use crate::Bound;
use crate::control::{FrameWork, Law, ObjectView, PictureControl, Status};
use std::time::Duration;

/// The starting point of a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// At the target time of a frame.
    Target,
    /// At this many times the target rate, > 0; or at the end of the range that is nearest to that.
    Rate(f64),
}

/// One loop to be simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    /// The controller of the picture.
    pub candidate: Candidate,
    /// Target rate, frames per second, > 0.
    pub target_hz: f64,
    /// Speed of this machine relative to the plant's, > 0.
    pub speed: f64,
    /// The starting point.
    pub start: Start,
    /// The disturbance.
    pub disturbance: Disturbance,
    /// Relative deviation of a frame's time, ≥ 0.
    pub noise: f64,
    /// Equal seeds give equal noise.
    pub seed: u64,
    /// Duration, wall seconds, > 0.
    pub seconds: f64,
}

impl Trial {
    /// Ten seconds at rest on the plant's own machine, without noise.
    #[must_use]
    pub fn undisturbed(candidate: impl Into<Candidate>, target_hz: f64) -> Self {
        Self {
            candidate: candidate.into(),
            target_hz,
            speed: 1.0,
            start: Start::Target,
            disturbance: Disturbance::Nothing,
            noise: 0.0,
            seed: 0,
            seconds: 10.0,
        }
    }
}

/// One frame of a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrialFrame {
    /// Time of completion, wall seconds after the start.
    pub time_s: f64,
    /// Frame time over the target time, t/T_set.
    pub ratio: f64,
    /// Frame time over the whole time of a frame, t/T.
    pub part: f64,
    /// The loop variable ε̂.
    pub eps_hat: f64,
    /// Triangles drawn.
    pub polygons: f64,
    /// Triangles that would have taken exactly T, the whole time of a frame, as far as the range allows: shows the cost of a margin.
    pub polygons_ideal: f64,
    /// Objects whose level n differs from the frame before.
    pub switches: u32,
    /// Status of the controller.
    pub status: Status,
    /// Whether the loop rests at the end of the range of the objects in view, and not only at a limit of the law itself.
    pub at_end: bool,
}

/// Frames in which the predicting policy settles before a trial: γ falls by 5 % a frame at most, and by a factor of four here.
const WARM_UP: usize = 80;
/// Relative distance that counts as an end of the range: a tube has whole intervals.
const NEAR: f64 = 0.03;
/// Corrections of a start: levels are coarser than requested.
const START_CORRECTIONS: usize = 4;

/// Simulates a trial.
#[must_use]
pub fn play(plant: &Plant, trial: &Trial) -> Vec<TrialFrame> {
    let mut control = trial.candidate.control(plant, trial.target_hz);
    let set_s = trial.candidate.set_share() / trial.target_hz;
    set_start(&mut control, plant, trial, set_s);
    let mut random = Random::new(trial.seed);
    let mut frames: Vec<TrialFrame> = Vec::with_capacity((trial.seconds * trial.target_hz) as usize + 1);
    let mut views: Vec<ObjectView> = Vec::new();
    let mut levels: Vec<u8> = Vec::new();
    let mut time_s = 0.0;
    while time_s < trial.seconds {
        let passed = time_s / trial.seconds;
        views.clear();
        views.extend_from_slice(plant.views(frames.len()));
        trial.disturbance.apply_to_views(passed, &mut views);
        let plan = control.plan(&views);
        let polygons = plan.polygons;
        let switches = count_switches(&mut levels, plan.levels.iter().map(|level| level.resolution.n));
        let shown = frames
            .len()
            .checked_sub(plant.dead_time)
            .map_or(polygons, |k| frames.get(k).map_or(polygons, |b| b.polygons));
        let load = trial.disturbance.load(passed, random.uniform()) * (1.0 + trial.noise * random.normal()).max(0.1);
        let work_s = load * plant.seconds(shown, trial.speed);
        let work = Duration::from_secs_f64(work_s);
        control.observe(FrameWork { work, draw: work, ..FrameWork::default() });
        time_s += work_s.max(1.0 / trial.target_hz);
        let status = control.status();
        let at_end = is_at_end(trial.candidate, status, polygons, &views);
        frames.push(TrialFrame {
            time_s,
            ratio: work_s / set_s,
            part: work_s * trial.target_hz,
            eps_hat: control.eps_hat(),
            polygons,
            polygons_ideal: if at_end && status == Status::Clamped(Bound::Finest) {
                polygons
            } else {
                plant.line.x_of(trial.speed / load / trial.target_hz).clamp(1.0, plan_full(&control))
            },
            switches,
            status,
            at_end,
        });
    }
    frames
}

/// Whether a controller of this status that draws `polygons` cannot do better. The printed law ties n to ε̂, so an end of its ε̂ is not
/// always an end of the picture's range.
fn is_at_end(candidate: Candidate, status: Status, polygons: f64, views: &[ObjectView]) -> bool {
    let printed = matches!(candidate, Candidate::Feedback(Law::Printed { .. }));
    match status {
        Status::Clamped(bound) if printed => {
            let (least, most) = ends(views);
            match bound {
                Bound::Finest => polygons >= (1.0 - NEAR) * most,
                Bound::Coarsest => polygons <= (1.0 + NEAR) * least,
            }
        }
        Status::Clamped(_) | Status::Reserved | Status::BetweenLevels | Status::Fixed => true,
        _ => false,
    }
}

fn plan_full(control: &PictureControl) -> f64 {
    control.last_plan().full_polygons.max(1.0)
}

/// Brings the picture to the start of the trial.
fn set_start(control: &mut PictureControl, plant: &Plant, trial: &Trial, set_s: f64) {
    let rate = match trial.start {
        Start::Target => 1.0,
        Start::Rate(rate) => rate,
    };
    if matches!(trial.candidate, Candidate::Adaptive { .. }) {
        // its state is its γ: the start is the settled state on a machine on which this picture takes exactly its time
        return settle(control, plant, trial.speed / rate);
    }
    // the loop was at rest before: the first error is unconfirmed
    control.plan(plant.views(0));
    control.observe(FrameWork {
        work: Duration::from_secs_f64(set_s),
        draw: Duration::from_secs_f64(set_s),
        skip: false,
        ..FrameWork::default()
    });
    let wanted = plant.line.x_of(set_s / rate * trial.speed).max(1.0);
    for _ in 0..START_CORRECTIONS {
        let polygons = control.plan(plant.views(0)).polygons;
        control.coarsen(polygons / wanted);
    }
}

/// Lets the predicting policy settle on a machine of this speed.
fn settle(control: &mut PictureControl, plant: &Plant, speed: f64) {
    for _ in 0..WARM_UP {
        let polygons = control.plan(plant.views(0)).polygons;
        let work = Duration::from_secs_f64(plant.seconds(polygons, speed));
        control.observe(FrameWork { work, draw: work, ..FrameWork::default() });
    }
}

fn count_switches(held: &mut Vec<u8>, now: impl Iterator<Item = u8>) -> u32 {
    let mut switches = 0;
    let mut count = 0;
    for (at, n) in now.enumerate() {
        match held.get_mut(at) {
            Some(before) => {
                switches += u32::from(*before != n);
                *before = n;
            }
            None => held.push(n),
        }
        count = at + 1;
    }
    held.truncate(count);
    switches
}

#[cfg(test)]
mod tests {
    use super::super::plant::tests::observed;
    use super::*;

    fn trial(start: Start) -> Trial {
        Trial { start, seed: 1, seconds: 2.0, ..Trial::undisturbed(Law::CORRECTED, 30.0) }
    }

    #[test]
    fn a_trial_begins_at_its_start_and_ends_at_the_target() {
        let plant = Plant::identify(&observed(7e-3, 0.22e-6, 0)).unwrap();
        for (start, ratio) in [(Start::Target, 1.0), (Start::Rate(0.4), 2.5), (Start::Rate(2.5), 0.4)] {
            let frames = play(&plant, &trial(start));
            assert!((frames[0].ratio / ratio - 1.0).abs() < 0.05, "{start:?} begins at {}", frames[0].ratio);
            let last = frames.last().unwrap();
            assert!((last.ratio - 1.0).abs() < 0.05, "{start:?} ends at {}", last.ratio);
        }
    }

    #[test]
    fn equal_seeds_give_equal_frames_and_others_do_not() {
        let plant = Plant::identify(&observed(7e-3, 0.22e-6, 1)).unwrap();
        let noisy = |seed| play(&plant, &Trial { noise: 0.05, seed, ..trial(Start::Target) });
        assert_eq!(noisy(3), noisy(3));
        assert_ne!(noisy(3), noisy(4));
    }

    #[test]
    fn a_machine_of_another_speed_draws_more_in_the_same_time() {
        let plant = Plant::identify(&observed(7e-3, 0.22e-6, 0)).unwrap();
        let polygons = |speed| play(&plant, &Trial { speed, ..trial(Start::Target) }).last().unwrap().polygons;
        let (slow, fast) = (polygons(0.5), polygons(2.0));
        // (T·speed − fixed)/c each
        let expected = |speed: f64| (0.03 * speed - 7e-3) / 0.22e-6;
        assert!(
            (slow / expected(0.5) - 1.0).abs() < 0.08 && (fast / expected(2.0) - 1.0).abs() < 0.08,
            "{slow} {fast}"
        );
    }
}
