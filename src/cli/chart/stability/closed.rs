//! A closed system: three balls and two tubes in a ring of soft springs, five clocks, no gravity, a minute.
//!
//! Nothing pulls from outside, so momentum stays, and energy may only fall. Both are taken when all five clocks show the same
//! time, every impulse that was given delivered; and as they are told, to see what was on its way.

use super::super::experiment::{Experiment, Finding, worst};
use super::super::figure::{Axis, Colour, Figure, Layer, Mark, Panel, span};
use super::super::play::Play;
use super::super::stage::Faults;
use super::super::table::Table;
use super::common::{plain_body, plain_tube};
use glam::DVec3;
use metachron_agents::coupling::audit::{Audit, audit};
use metachron_agents::coupling::{Law, Link};
use metachron_agents::rigid::RigidSpec;
use metachron_agents::rod::TubeSpec;
use metachron_agents::shape::Solid;
use metachron_agents::{AgentId, Anchor, SimTime};
use serde::{Deserialize, Serialize};

/// The experiment.
pub(in super::super) struct Closed;

/// Rates of ball, tube, ball, tube, ball: all show the same time every 50 ms.
const RATES_HZ: [f64; 5] = [1000.0, 500.0, 240.0, 120.0, 60.0];
/// Which way the five are set up, so that each clock drives each kind once.
const TURNS: [usize; 5] = [0, 1, 2, 3, 4];
const SECONDS: f64 = 60.0;
const QUICK_SECONDS: f64 = 2.0;
const MASSES_KG: [f64; 3] = [1.0, 0.5, 0.2];
const RADIUS_M: f64 = 0.05;
const TUBE_M: f64 = 0.4;
const TUBE_RADIUS_M: f64 = 0.015;
const SEGMENTS: usize = 12;
/// The ring: radius, and stiffness and length of its springs.
const RING_M: f64 = 0.3;
const SPRING_N_M: f64 = 4.0;
const SPRING_REST_M: f64 = 0.05;
/// Clocks agree to within this, seconds: sixtieths are not whole nanoseconds.
const SAME_S: f64 = 1e-5;
const ENERGY_MAX: f64 = 1.01;
/// What momentum may change with everything delivered, as a share of the momenta at the start.
const DRIFT_MAX: f64 = 0.005;

/// Which way it is set up, and for how long it runs.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct Case {
    turn: usize,
    seconds: f64,
}

/// What it came to.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in super::super) struct Row {
    /// The rates are handed on by so many places.
    turn: usize,
    seconds: f64,
    /// Peak of the energy at a common time, in that of the start.
    energy_peak: f64,
    energy_end: f64,
    /// Peak of the energies as they are told.
    raw_peak: f64,
    /// The greatest change of momentum, everything delivered, as a share of the momenta at the start added.
    drift: f64,
    /// The same without delivery, and the greatest impulse that was on its way meanwhile.
    raw_drift: f64,
    in_flight: f64,
    /// How often all clocks agreed, and contacts there were then.
    looks: u32,
    contacts: u32,
}

impl Experiment for Closed {
    type Case = Case;
    type Row = Row;
    const NAME: &'static str = "closed";
    const TITLE: &'static str =
        "three balls and two tubes in a ring, five clocks: momentum and energy at a common time";

    fn cases(quick: bool) -> Vec<Case> {
        let (turns, seconds) = if quick { (&TURNS[..1], QUICK_SECONDS) } else { (&TURNS[..], SECONDS) };
        turns.iter().map(|&turn| Case { turn, seconds }).collect()
    }

    fn measure(case: &Case) -> Row {
        let Case { turn, seconds } = *case;
        let broken = Row {
            turn,
            seconds,
            energy_peak: f64::NAN,
            energy_end: f64::NAN,
            raw_peak: f64::NAN,
            drift: f64::NAN,
            raw_drift: f64::NAN,
            in_flight: f64::NAN,
            looks: 0,
            contacts: 0,
        };
        play(case).unwrap_or(broken)
    }

    fn case_of(row: &Row) -> Case {
        Case { turn: row.turn, seconds: row.seconds }
    }

    fn figure(rows: &[Row]) -> Figure {
        let dots = |label: &str, colour, get: fn(&Row) -> f64| Layer {
            label: label.to_owned(),
            colour,
            mark: Mark::Dots(rows.iter().map(|r| (r.turn as f64, get(r))).collect()),
        };
        let x = || Axis::linear("which way the clocks are handed out", -0.5, 4.5);
        let limit = Mark::Dashed(vec![(-0.5, ENERGY_MAX), (4.5, ENERGY_MAX)]);
        let energies = rows.iter().flat_map(|r| [r.energy_peak, r.energy_end]).chain([ENERGY_MAX]);
        let (low, high) = span(energies, false);
        let energy = Panel {
            title: "energy at a common time".to_owned(),
            x: x(),
            y: Axis::linear("share of the start's", low, high),
            layers: vec![
                Layer { label: "start + 1 %".to_owned(), colour: Colour::Grey, mark: limit },
                dots("peak", Colour::Blue, |r| r.energy_peak),
                dots("after a minute", Colour::Green, |r| r.energy_end),
            ],
        };
        let momentum = Panel {
            title: "momentum".to_owned(),
            x: x(),
            y: Axis::log("change / momenta at the start", 1e-16, 1.0),
            layers: vec![
                dots("as it is told", Colour::Red, |r| r.raw_drift.max(1e-16)),
                dots("on its way", Colour::Orange, |r| r.in_flight.max(1e-16)),
                dots("delivered", Colour::Blue, |r| r.drift.max(1e-16)),
            ],
        };
        Figure { title: "A closed system of five clocks".to_owned(), panels: vec![energy, momentum], columns: 2 }
    }

    fn table(rows: &[Row]) -> Table {
        let mut table = Table::new(&[
            "turn",
            "seconds",
            "energy peak",
            "energy end",
            "raw peak",
            "drift",
            "raw drift",
            "in flight",
            "looks",
            "contacts",
        ]);
        table.rows.extend(rows.iter().map(|r| {
            vec![
                (r.turn as f64, 0).into(),
                (r.seconds, 0).into(),
                (r.energy_peak, 4).into(),
                (r.energy_end, 4).into(),
                (r.raw_peak, 4).into(),
                (r.drift, 4).into(),
                (r.raw_drift, 4).into(),
                (r.in_flight, 4).into(),
                (f64::from(r.looks), 0).into(),
                (f64::from(r.contacts), 0).into(),
            ]
        }));
        table
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let beyond = |r: &Row| r.raw_drift - r.in_flight;
        vec![
            Finding::at_most(
                "energy at a common time, in that of the start",
                worst(rows.iter().map(|r| r.energy_peak)),
                ENERGY_MAX,
            ),
            Finding::at_most(
                "momentum, everything delivered: change over the momenta",
                worst(rows.iter().map(|r| r.drift)),
                DRIFT_MAX,
            ),
            Finding::at_most(
                "momentum as told: change beyond what was on its way",
                worst(rows.iter().map(beyond)),
                0.0,
            ),
        ]
    }
}

/// Five in a ring: ball, tube, ball, tube, ball.
fn ring(turn: usize) -> Option<(Play, [AgentId; 5])> {
    let mut play = Play::new(Law::Ledger, Faults::default());
    let rate = |i: usize| RATES_HZ[(i + turn) % RATES_HZ.len()];
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / 5.0;
    let at = |i: usize| DVec3::new(libm::cos(angle(i)), libm::sin(angle(i)), 0.1 * (i as f64 - 2.0)) * RING_M;
    let along = |i: usize| DVec3::new(-libm::sin(angle(i)), libm::cos(angle(i)), 0.2);
    let ball = |i: usize, k: usize| RigidSpec {
        velocity: at(i) * -1.5 + DVec3::new(0.1, -0.05, 0.2) * (k as f64 - 1.0),
        spin: DVec3::new(2.0, 1.0, -1.0) * k as f64,
        restitution: 0.7,
        friction: 0.3,
        ..plain_body(Solid::Ball { radius_m: RADIUS_M }, at(i), MASSES_KG[k])
    };
    let tube = |i: usize| {
        let half = along(i).normalize() * (0.5 * TUBE_M);
        TubeSpec { friction: 0.3, ..plain_tube(vec![at(i) - half, at(i) + half], TUBE_RADIUS_M, SEGMENTS) }
    };
    let ids = [
        play.add_body(ball(0, 0), rate(0), vec![])?,
        play.add_tube(tube(1), rate(1))?,
        play.add_body(ball(2, 1), rate(2), vec![])?,
        play.add_tube(tube(3), rate(3))?,
        play.add_body(ball(4, 2), rate(4), vec![])?,
    ];
    let (ball, start, end) = (Anchor::Local(DVec3::ZERO), Anchor::Arc(0.0), Anchor::Arc(TUBE_M));
    let ties = [(0, ball, 1, start), (1, end, 2, ball), (2, ball, 3, start), (3, end, 4, ball), (4, ball, 0, ball)];
    for (a, here, b, there) in ties {
        let link = Link {
            other: ids[b],
            here,
            there,
            stiffness_n_m: SPRING_N_M,
            damping_n_s_m: 0.0,
            rest_m: SPRING_REST_M,
            law: Law::Ledger,
        };
        play.link(ids[a], link);
    }
    Some((play, ids))
}

fn play(case: &Case) -> Option<Row> {
    let (play, ids) = ring(case.turn)?;
    let start = play.common(SimTime::ZERO);
    let size: f64 = momenta(&play, ids);
    let (raw_start, told_start) = (play.raw_j(), told(&play));
    let mut row = Row {
        turn: case.turn,
        seconds: case.seconds,
        energy_peak: 1.0,
        energy_end: 1.0,
        raw_peak: 1.0,
        drift: 0.0,
        raw_drift: 0.0,
        in_flight: 0.0,
        looks: 0,
        contacts: 0,
    };
    let ended = play.run(case.seconds, |play, _| {
        let times = ids.map(|id| play.stage.own(id).time);
        let (first, last) = (times.iter().min().copied(), times.iter().max().copied());
        let (Some(first), Some(last)) = (first, last) else { return false };
        if last.secs_after(first) > SAME_S {
            return true;
        }
        let sum = play.common(first);
        row.energy_peak = worst([row.energy_peak, sum.energy_j / start.energy_j]);
        row.energy_end = sum.energy_j / start.energy_j;
        row.raw_peak = worst([row.raw_peak, play.raw_j() / raw_start]);
        row.drift = worst([row.drift, (sum.momentum - start.momentum).length() / size]);
        row.raw_drift = worst([row.raw_drift, (told(play) - told_start).length() / size]);
        row.in_flight = worst([row.in_flight, sum.in_flight_n_s / size]);
        row.looks += 1;
        row.contacts += ids.iter().flat_map(|id| &play.stage.own(*id).pairs).map(|pair| pair.contacts).sum::<u32>();
        row.energy_peak < 1e3
    });
    (ended.time().as_secs_f64() >= case.seconds - 1e-3 || row.energy_peak >= 1e3).then_some(row)
}

/// Magnitudes of all momenta added, kg·m/s.
fn momenta(play: &Play, ids: [AgentId; 5]) -> f64 {
    let members = play.stage.members();
    let one = |id: AgentId| audit(&members[id.0 as usize..=id.0 as usize], SimTime::ZERO, &mut |_, _| 0.0);
    ids.map(one).iter().map(|sum: &Audit| sum.momentum.length()).sum()
}

/// Momentum as the agents tell it, nothing delivered, kg·m/s.
fn told(play: &Play) -> DVec3 {
    let members = play.stage.members();
    let one = |k: usize| audit(&members[k..=k], members[k].snapshot.time, &mut |_, _| 0.0).momentum;
    (0..members.len()).map(one).sum()
}
