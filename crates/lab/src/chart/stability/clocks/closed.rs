//! A closed system of three rigid bodies and two tubes, five clocks, no gravity, a minute.
//!
//! `plates`: two heavy plates close in on a ball and two tubes. The tubes take the ball's energy within seconds; from then on
//! there is no impact until the plates reach the tubes, after three quarters of the run. `ring`: three balls and two tubes, each on
//! a spring to the next. Without external forces momentum is constant and energy may only fall. Both are sampled when all five
//! clocks show the same time, with every given impulse delivered; and also as published, to measure the impulses in
//! flight.

use super::closed_system::{ROOM_M, SYSTEMS, system};
use crate::chart::asynchronous::play::Play;
use crate::chart::stability::common::COMMON_ENERGY_MAX;
use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Panel, Table, blank, claims, count_of, each, span,
    table, worst, worst_of,
};
use glam::DVec3;
use metachron_contact::audit::{Audit, audit};
use metachron_core::{AgentId, SimTime};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The experiment.
pub(crate) struct Closed;

/// Cyclic shifts of the rates, so that each clock drives each kind of agent once.
const TURNS: [usize; 5] = [0, 1, 2, 3, 4];
/// Seeds of the starting velocities.
const SEEDS: [u64; 2] = [1, 2];
const SECONDS: f64 = 60.0;
const QUICK_SECONDS: f64 = 2.0;
/// Clocks agree within this, seconds: sixtieths are not whole nanoseconds.
const SAME_S: f64 = 1e-5;
/// Rounding allowed for the momentum with everything delivered, as a share of the momenta exchanged.
const ROUNDING: f64 = 1e-9;
/// Least number of samples that find an impact since the previous sample: the bodies really collide.
const BLOWS_MIN: u32 = 5;

/// A system, the shift of its rates, its seed and its length.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    system: &'static str,
    /// The rates are shifted cyclically by so many places.
    turn: usize,
    seed: u64,
    seconds: f64,
}

/// The results of a case.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Found {
    /// Peak of the energy at a common time, as a multiple of that of the start.
    energy_peak: f64,
    energy_end: f64,
    /// Peak of the energies as published.
    raw_peak: f64,
    /// The greatest change of momentum, everything delivered, as a share of the sum of the momenta's magnitudes at the start.
    drift: f64,
    /// The same for the angular momentum, as a share of the angular momenta that these momenta would have at the plates.
    angular_drift: f64,
    /// The same for the momentum without delivery; the greatest impulse in flight; the greatest excess of the first over the second.
    raw_drift: f64,
    in_flight: f64,
    beyond: f64,
    /// Number of samples at which all clocks agreed, and number of such samples with an impact since the previous one.
    looks: u32,
    impacts: u32,
    /// The longest time without an impact, seconds.
    pause_s: f64,
    /// Second by second, separated by spaces: the highest energy, the greatest change of momentum as published, the greatest
    /// impulse in flight; shares as above.
    energy_of_second: String,
    published_of_second: String,
    in_flight_of_second: String,
}

type Row = Measured<Case, Found>;

impl Experiment for Closed {
    type Row = Row;
    const NAME: &'static str = "closed";
    const TITLE: &'static str =
        "closed system of three rigid bodies and two tubes on five clocks: momentum and energy at a common time";
    const TABLE: fn(&[Row]) -> Table = table!(|r| system: r.case.system, turn: r.case.turn, seed: r.case.seed,
        seconds: r.case.seconds, "energy peak"(4): r.energy_peak, "energy end"(4): r.energy_end,
        "raw peak"(4): r.raw_peak, drift(4): r.drift, angular(4): r.angular_drift, "raw drift"(4): r.raw_drift,
        "in flight"(4): r.in_flight, impacts: r.impacts, pause_s(1): r.pause_s);

    fn cases(quick: bool) -> Vec<Case> {
        let (turns, seeds, seconds) =
            if quick { (&TURNS[..1], &SEEDS[..1], QUICK_SECONDS) } else { (&TURNS[..], &SEEDS[..], SECONDS) };
        each!(system in SYSTEMS, &turn in turns, &seed in seeds => Case { system, turn, seed, seconds })
    }

    fn measure(case: &Case) -> Option<Found> {
        let (extremes, whole) = play(case).unwrap_or_default();
        let [energy_of_second, published_of_second, in_flight_of_second] = [0, 1, 2].map(|k| extremes.of_second(k));
        let pause_s = extremes.pause_s.max(case.seconds - extremes.last_impact_s);
        Some(Found {
            looks: extremes.looks,
            impacts: extremes.impacts,
            pause_s,
            energy_of_second,
            published_of_second,
            in_flight_of_second,
            ..if whole { extremes.found() } else { blank() }
        })
    }

    fn figure(rows: &[Row]) -> Figure {
        let seconds = rows.iter().map(|r| r.case.seconds).fold(1.0, f64::max);
        let x = || Axis::linear("time, s", 0.0, seconds);
        let energies = rows.iter().flat_map(|r| read(&r.energy_of_second)).map(|p| p.1).chain([1.0, COMMON_ENERGY_MAX]);
        let (low, high) = span(energies, false);
        let lines = rows.iter().map(|r| {
            let Case { system, turn, seed, .. } = &r.case;
            let first = *seed == SEEDS[0] && *system == SYSTEMS[0];
            let label = if first { format!("rates shifted by {turn}") } else { String::new() };
            Layer::line(label, Colour::LINES[turn % Colour::LINES.len()], read(&r.energy_of_second))
        });
        let layers = [Layer::limit("start + 1 %", [0.0, seconds], COMMON_ENERGY_MAX)].into_iter().chain(lines);
        let y = Axis::linear("energy / energy at the start", low, high);
        let energy = Panel::new("energy at a common time", x(), y, layers);
        let dots = |label: &str, colour, get: fn(&Row) -> &str| {
            Layer::dots(label, colour, rows.iter().flat_map(|r| read(get(r))).map(|(t, v)| (t, v.max(FLOOR))))
        };
        let delivered = rows.iter().map(|r| r.drift).fold(FLOOR, f64::max);
        let layers = [
            dots("in flight", Colour::Orange, |r| &r.in_flight_of_second),
            dots("change as published", Colour::Red, |r| &r.published_of_second),
            Layer::line("greatest change, delivered", Colour::Blue, [0.0, seconds].map(|t| (t, delivered))),
        ];
        let momentum = Panel::new("momentum", x(), Axis::log("change / momenta at the start", FLOOR, 10.0), layers);
        Figure::new("A closed system of five clocks", 2, vec![energy, momentum])
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let most = |number: fn(&Row) -> f64| worst_of(rows, |_| true, number);
        let idle = count_of(rows, |r| r.impacts < BLOWS_MIN);
        claims![
            "energy at a common time over the start's" => most(|r| r.energy_peak), at_most COMMON_ENERGY_MAX;
            "momentum with every impulse delivered: change over the momenta" => most(|r| r.drift), at_most ROUNDING;
            "published momentum: change beyond the impulses in flight" => most(|r| r.beyond), at_most ROUNDING;
            "runs with fewer than {BLOWS_MIN} impacts" => idle, at_most 0.0;
        ]
    }
}

/// The least value that the figure of momentum shows.
const FLOOR: f64 = 1e-16;

/// The numbers of a row, second by second.
fn read(numbers: &str) -> Vec<(f64, f64)> {
    let values = numbers.split(' ').filter_map(|v| v.parse().ok());
    values.enumerate().map(|(second, v)| (second as f64 + 0.5, v)).collect()
}

/// Extremes and counts over a run; momenta are shares of those at the start.
#[derive(Debug, Clone, Default)]
struct Extremes {
    energy: [f64; 3],
    drift: [f64; 2],
    published: [f64; 3],
    looks: u32,
    impacts: u32,
    last_impact_s: f64,
    pause_s: f64,
    /// Cumulative impulses of the pairs.
    struck: BTreeMap<[AgentId; 2], f64>,
    seconds: Vec<[f64; 3]>,
}

impl Extremes {
    fn found(&self) -> Found {
        let ([energy_peak, energy_end, raw_peak], [drift, angular_drift]) = (self.energy, self.drift);
        let [raw_drift, in_flight, beyond] = self.published;
        Found { energy_peak, energy_end, raw_peak, drift, angular_drift, raw_drift, in_flight, beyond, ..blank() }
    }

    fn of_second(&self, which: usize) -> String {
        let numbers: Vec<String> = self.seconds.iter().map(|s| format!("{:.6e}", s[which])).collect();
        numbers.join(" ")
    }

    /// Takes in a sample at `at_s`: energies, changes of momenta, impulse in flight.
    fn add(&mut self, at_s: f64, [energy, raw]: [f64; 2], drift: [f64; 2], [published, flying]: [f64; 2]) {
        self.energy = [worst([self.energy[0], energy]), energy, worst([self.energy[2], raw])];
        self.drift = [0, 1].map(|k| worst([self.drift[k], drift[k]]));
        let published = [published, flying, published - flying];
        self.published = [0, 1, 2].map(|k| worst([self.published[k], published[k]]));
        self.seconds.resize((at_s as usize + 1).max(self.seconds.len()), [0.0; 3]);
        if let Some(second) = self.seconds.last_mut() {
            let now = [energy, published[0], published[1]];
            *second = [0, 1, 2].map(|k| worst([second[k], now[k]]));
        }
        self.looks += 1;
    }

    /// Counts an impact if the impulse of a pair has changed since the last sample.
    fn strike(&mut self, at_s: f64, play: &Play, ids: [AgentId; 5]) {
        let mut struck = false;
        for id in ids {
            for pair in &play.stage.own(id).pairs {
                struck |= self.struck.insert([id, pair.with], pair.impulse_n_s).unwrap_or(0.0) != pair.impulse_n_s;
            }
        }
        if struck {
            self.impacts += 1;
            self.pause_s = self.pause_s.max(at_s - self.last_impact_s);
            self.last_impact_s = at_s;
        }
    }
}

/// Plays the case; returns its results and whether it reached its end.
fn play(case: &Case) -> Option<(Extremes, bool)> {
    let (play, ids) = system(case.system, case.turn, case.seed)?;
    let start = play.common(SimTime::ZERO);
    let size: f64 = momenta(&play, ids);
    let (raw_start, published_start) = (play.raw_j(), published_momentum(&play));
    let mut extremes = Extremes::default();
    let ended = play.run(case.seconds, |play, _| {
        let times = ids.map(|id| play.stage.own(id).time);
        let (first, last) = (times.iter().min().copied(), times.iter().max().copied());
        let (Some(first), Some(last)) = (first, last) else { return false };
        if last.secs_after(first) > SAME_S {
            return true;
        }
        let (now, at_s) = (play.common(first), first.as_secs_f64());
        let energy = [now.energy_j / start.energy_j, play.raw_j() / raw_start];
        let drift = [
            (published_momentum(play) + momentum_in_flight(play, ids) - published_start).length(),
            (now.angular - start.angular).length() / ROOM_M,
        ];
        let published = [(published_momentum(play) - published_start).length(), now.in_flight_n_s];
        extremes.add(at_s, energy, drift.map(|d| d / size), published.map(|t| t / size));
        extremes.strike(at_s, play, ids);
        energy[0] < 1e3
    });
    Some((extremes, ended.time().as_secs_f64() >= case.seconds - 1e-3))
}

/// Sum of the magnitudes of all momenta, kg·m/s.
fn momenta(play: &Play, ids: [AgentId; 5]) -> f64 {
    let members = play.stage.members();
    let one = |id: AgentId| audit(&members[id.0 as usize..=id.0 as usize], SimTime::ZERO, &mut |_, _| 0.0);
    ids.map(one).iter().map(|sum: &Audit| sum.momentum.length()).sum()
}

/// The linear impulses that were given and not yet taken, kg·m/s.
fn momentum_in_flight(play: &Play, ids: [AgentId; 5]) -> DVec3 {
    ids.iter().map(|id| play.in_flight(*id)).sum()
}

/// Momentum as the agents publish it, nothing delivered, kg·m/s.
fn published_momentum(play: &Play) -> DVec3 {
    let members = play.stage.members();
    let one = |k: usize| audit(&members[k..=k], members[k].snapshot.time, &mut |_, _| 0.0).momentum;
    (0..members.len()).map(one).sum()
}
