//! Two balls with different clocks collide once: against the closed form, through the impulse ledger and not in one cluster.

use crate::chart::lockstep_run::{LockstepRun, members};
use crate::chart::stability::common::plain_body;
use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Panel, Table, claims, count_of, each, span, table,
    worst, worst_of,
};
use glam::DVec3;
use metachron_contact::Law;
use metachron_contact::audit::settled;
use metachron_core::{AgentId, PairKind, SimSpan, SimTime};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_runtime::AgentSpawn;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// The experiment.
pub(crate) struct Impact;

const RESTITUTIONS: [f64; 3] = [0.0, 0.5, 1.0];
const MASS_RATIOS: [f64; 6] = [1e-3, 0.1, 1.0, 10.0, 100.0, 1000.0];
const RATES_HZ: [[f64; 2]; 6] =
    [[240.0, 240.0], [1000.0, 240.0], [1000.0, 60.0], [60.0, 1000.0], [1000.0, 10.0], [10.0, 1000.0]];
const RADIUS_M: f64 = 0.05;
/// Distance of the surfaces at the start, metres, and closing speed, m/s.
const GAP_M: f64 = 0.2;
const CLOSING_M_S: f64 = 1.0;
const SECONDS: f64 = 0.6;
const TOLERANCE: f64 = 0.01;

/// A pair.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    restitution: f64,
    /// Mass of the ball that is hit over that of the ball that flies.
    mass_ratio: f64,
    rate_hitting_hz: f64,
    rate_hit_hz: f64,
}

/// The results of a pair.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Found {
    /// The greater error of the two velocities after the impact, as a share of the closing speed.
    error: f64,
    /// Change of the total momentum, as a share of it.
    momentum_error: f64,
    /// The law of their contact; empty where they did not meet.
    kind: String,
    steps_hitting: u64,
    steps_hit: u64,
    /// Whether one of them was led by the other, in one cluster, at the end.
    led: bool,
}

type Row = Measured<Case, Found>;

impl Experiment for Impact {
    type Row = Row;
    const NAME: &'static str = "impact";
    const TITLE: &'static str = "impact of two balls on different clocks: velocities against the closed form";
    const TABLE: fn(&[Row]) -> Table = |rows| {
        let pairs =
            rows.chunk_by(|a, b| (a.case.restitution, a.case.mass_ratio) == (b.case.restitution, b.case.mass_ratio));
        table!(pairs, |here| e(1): here[0].case.restitution, mass_ratio(3): here[0].case.mass_ratio,
            "worst error"(9): worst_of(here, |_| true, |r| r.error),
            "worst momentum error"(9): worst_of(here, |_| true, |r| r.momentum_error),
            kinds: here.iter().map(|r| r.kind.as_str()).collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>().join(" "))
    };

    fn cases(quick: bool) -> Vec<Case> {
        let ratios = if quick { &[1.0, 10.0, 1000.0][..] } else { &MASS_RATIOS[..] };
        let rates = if quick { &RATES_HZ[2..4] } else { &RATES_HZ[..] };
        each!(restitution in RESTITUTIONS, &mass_ratio in ratios, &[rate_hitting_hz, rate_hit_hz] in rates =>
            Case { restitution, mass_ratio, rate_hitting_hz, rate_hit_hz })
    }

    fn measure(case: &Case) -> Option<Found> {
        let masses = [0.1, 0.1 * case.mass_ratio];
        let ball = |x: f64, speed: f64, mass: f64| {
            let plain = plain_body(Solid::Ball { radius_m: RADIUS_M }, DVec3::X * x, mass);
            RigidBody::new(RigidSpec { velocity: DVec3::X * speed, restitution: case.restitution, ..plain }).ok()
        };
        let far = GAP_M + 2.0 * RADIUS_M;
        let (hitting, hit) = (ball(0.0, CLOSING_M_S, masses[0])?, ball(far, 0.0, masses[1])?);
        let alone = |name: &str, ball: RigidBody, rate_hz: f64| AgentSpawn::alone(name, Box::new(ball), rate_hz);
        let mut hitting = alone("hitting", hitting, case.rate_hitting_hz);
        hitting.laws = vec![(AgentId(1), Law::Ledger)];
        let spawns = vec![hitting, alone("hit", hit, case.rate_hit_hz)];
        let mut run = LockstepRun::start(spawns).ok()?;
        run.run_to(SECONDS);
        let snapshots = run.snapshots();
        let members = members(&snapshots);
        let at = SimTime::ZERO + SimSpan::from_secs_f64(SECONDS)?;
        let speeds = [settled(&members[0], &members, at)?.velocity, settled(&members[1], &members, at)?.velocity];
        let share = masses[1] / (masses[0] + masses[1]);
        let closed = [1.0 - (1.0 + case.restitution) * share, (1.0 + case.restitution) * (1.0 - share)];
        let error = speeds.iter().zip(closed).map(|(v, c)| v.distance(DVec3::X * (c * CLOSING_M_S)) / CLOSING_M_S);
        let momentum = speeds[0] * masses[0] + speeds[1] * masses[1];
        let pair = snapshots.iter().flat_map(|s| &s.pairs).next();
        let steps = run.steps();
        Some(Found {
            error: worst(error),
            momentum_error: momentum.distance(DVec3::X * (masses[0] * CLOSING_M_S)) / (masses[0] * CLOSING_M_S),
            kind: pair.map_or_else(String::new, |pair| pair.kind.name().to_owned()),
            steps_hitting: steps.first()?.0,
            steps_hit: steps.get(1)?.0,
            led: steps.iter().any(|(_, leader)| leader.is_some()),
        })
    }

    fn figure(rows: &[Row]) -> Figure {
        let least = |v: f64| v.max(1e-16);
        let (low, high) = span(rows.iter().map(|r| least(r.error)).chain([TOLERANCE]), true);
        let panels = RESTITUTIONS.into_iter().map(|e| {
            let line = |(rates_hz, colour): ([f64; 2], Colour)| {
                let rates = |r: &Row| [r.case.rate_hitting_hz, r.case.rate_hit_hz];
                let here = rows.iter().filter(|r| r.case.restitution == e && rates(r) == rates_hz);
                let label = format!("{} Hz on {} Hz", rates_hz[0], rates_hz[1]);
                Layer::line(label, colour, here.map(|r| (r.case.mass_ratio, least(r.error))))
            };
            let lines = RATES_HZ.into_iter().zip(Colour::LINES).map(line);
            let ends = [MASS_RATIOS[0], MASS_RATIOS[5]];
            let x = Axis::log("mass hit / mass that flies", ends[0], ends[1]);
            let y = Axis::log("error of the velocity / closing speed", low, high);
            Panel::new(format!("e = {e}"), x, y, lines.chain([Layer::limit("1 %", ends, TOLERANCE)]))
        });
        Figure::new("Impact of two balls on two clocks", 3, panels.collect())
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let other = count_of(rows, |r| r.kind != PairKind::Ledger.name() || r.led);
        claims![
            "velocities after the impact: error over the closing speed" => worst_of(rows, |_| true, |r| r.error), at_most TOLERANCE;
            "pairs not coupled by the ledger, or stepped in one cluster" => other, at_most 0.0;
        ]
    }
}
