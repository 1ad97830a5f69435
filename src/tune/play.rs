//! One closed loop played to its end: a law, a plant, a disturbance.
//!
//! In: a [`Trial`]. Out: its frames. The controller is the one that draws; the plant is the fitted one. Equal trials give equal
//! frames on every machine. Never here: what makes a trial good.

use super::disturb::{Dice, Disturbance};
use super::plant::Plant;
use crate::control::{FrameWork, Law, ObjectView, PictureControl, Policy, Status};
use std::time::Duration;

/// Where a trial begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// Where the frame takes its time.
    Target,
    /// Where frames come at so many times the wanted rate, > 0; or at the end of the range that is nearest to that.
    Rate(f64),
}

/// One loop to be played.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    /// The law with its gains.
    pub law: Law,
    /// Frames a second that are wanted, > 0.
    pub target_hz: f64,
    /// How many times as fast as the plant's machine this one is, > 0.
    pub speed: f64,
    /// Where it begins.
    pub start: Start,
    /// What upsets it.
    pub disturbance: Disturbance,
    /// Deviation of a frame's time, as a part of it, ≥ 0.
    pub noise: f64,
    /// Equal seeds give equal noise.
    pub seed: u64,
    /// How long it is watched, wall seconds, > 0.
    pub seconds: f64,
}

/// One frame of a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beat {
    /// When it was finished, wall seconds after the start.
    pub time_s: f64,
    /// Its time over the wanted one, t/T_set.
    pub ratio: f64,
    /// Whether it took 5 % longer than the frame may, T.
    pub late: bool,
    /// The loop variable ε̂.
    pub eps_hat: f64,
    /// Triangles drawn.
    pub polygons: f64,
    /// Triangles that would have taken just T_set, as far as the range reaches.
    pub polygons_ideal: f64,
    /// Objects whose level n is not the one of the frame before.
    pub switches: u32,
    /// What the controller says of itself.
    pub status: Status,
}

/// A frame past this part of its time is late.
const LATE: f64 = 1.05;
/// Corrections to a start: levels are coarser than what is asked for.
const AIMS: usize = 4;

/// Plays a trial.
#[must_use]
pub fn play(plant: &Plant, trial: &Trial) -> Vec<Beat> {
    let mut control = PictureControl::new(Policy::Feedback, trial.law, trial.target_hz);
    let set_s = control.set_point_s();
    place(&mut control, plant, trial, set_s);
    let mut dice = Dice::new(trial.seed);
    let mut beats: Vec<Beat> = Vec::with_capacity((trial.seconds * trial.target_hz) as usize + 1);
    let mut views: Vec<ObjectView> = Vec::new();
    let mut levels: Vec<u8> = Vec::new();
    let mut time_s = 0.0;
    while time_s < trial.seconds {
        let passed = time_s / trial.seconds;
        views.clear();
        views.extend_from_slice(plant.views(beats.len()));
        trial.disturbance.look(passed, &mut views);
        let plan = control.plan(&views);
        let polygons = plan.polygons;
        let switches = count_switches(&mut levels, plan.levels.iter().map(|level| level.resolution.n));
        let shown = beats
            .len()
            .checked_sub(plant.dead_time)
            .map_or(polygons, |k| beats.get(k).map_or(polygons, |b| b.polygons));
        let load = trial.disturbance.load(passed, dice.uniform()) * (1.0 + trial.noise * dice.normal()).max(0.1);
        let work_s = load * plant.seconds(shown, trial.speed);
        let work = Duration::from_secs_f64(work_s);
        control.observe(FrameWork { work, draw: work, skip: false });
        time_s += work_s.max(1.0 / trial.target_hz);
        beats.push(Beat {
            time_s,
            ratio: work_s / set_s,
            late: work_s * trial.target_hz > LATE,
            eps_hat: control.eps_hat(),
            polygons,
            polygons_ideal: plant.line.x_of(set_s * trial.speed / load).clamp(1.0, plan_full(&control)),
            switches,
            status: control.status(),
        });
    }
    beats
}

fn plan_full(control: &PictureControl) -> f64 {
    control.last_plan().full_polygons.max(1.0)
}

/// Brings the picture to where the trial begins.
fn place(control: &mut PictureControl, plant: &Plant, trial: &Trial, set_s: f64) {
    let wanted_s = match trial.start {
        Start::Target => set_s,
        Start::Rate(factor) => set_s / factor,
    };
    let wanted = plant.line.x_of(wanted_s * trial.speed).max(1.0);
    for _ in 0..AIMS {
        let polygons = control.plan(plant.views(0)).polygons;
        control.coarsen(polygons / wanted);
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
        Trial {
            law: Law::CORRECTED,
            target_hz: 30.0,
            speed: 1.0,
            start,
            disturbance: Disturbance::Nothing,
            noise: 0.0,
            seed: 1,
            seconds: 2.0,
        }
    }

    #[test]
    fn a_trial_begins_where_it_should_and_ends_at_the_target() {
        let plant = Plant::identify(&observed(7e-3, 0.22e-6, 0)).unwrap();
        for (start, ratio) in [(Start::Target, 1.0), (Start::Rate(0.4), 2.5), (Start::Rate(2.5), 0.4)] {
            let beats = play(&plant, &trial(start));
            assert!((beats[0].ratio / ratio - 1.0).abs() < 0.05, "{start:?} begins at {}", beats[0].ratio);
            let last = beats.last().unwrap();
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
