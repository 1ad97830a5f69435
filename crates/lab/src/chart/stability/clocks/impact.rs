//! Two balls with different clocks collide once: against the closed form, through the impulse ledger and not in one cluster.

use crate::chart::experiment::{Experiment, Finding, worst};
use crate::chart::figure::{Axis, Colour, Figure, Layer, Mark, Panel, span};
use crate::chart::lockstep_run::{LockstepRun, members};
use crate::chart::stability::common::plain_body;
use crate::chart::table::Table;
use glam::DVec3;
use metachron_contact::Law;
use metachron_contact::audit::settled;
use metachron_core::{AgentId, PairKind};
use metachron_core::{SimSpan, SimTime};
use metachron_geometry::Solid;
use metachron_models::rigid::RigidBody;
use metachron_models::rigid::RigidSpec;
use metachron_runtime::AgentSpawn;
use serde::{Deserialize, Serialize};

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
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Case {
    restitution: f64,
    mass_ratio: f64,
    rates_hz: [f64; 2],
}

/// The results of a pair.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Row {
    restitution: f64,
    /// Mass of the ball that is hit over that of the ball that flies.
    mass_ratio: f64,
    rate_hitting_hz: f64,
    rate_hit_hz: f64,
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

impl Experiment for Impact {
    type Case = Case;
    type Row = Row;
    const NAME: &'static str = "impact";
    const TITLE: &'static str = "impact of two balls on different clocks: velocities against the closed form";

    fn cases(quick: bool) -> Vec<Case> {
        let ratios = if quick { &[1.0, 10.0, 1000.0][..] } else { &MASS_RATIOS[..] };
        let rates = if quick { &RATES_HZ[2..4] } else { &RATES_HZ[..] };
        let mut cases = Vec::new();
        for restitution in RESTITUTIONS {
            for &mass_ratio in ratios {
                cases.extend(rates.iter().map(|&rates_hz| Case { restitution, mass_ratio, rates_hz }));
            }
        }
        cases
    }

    fn measure(case: &Case) -> Row {
        let result = collide(case).unwrap_or_default();
        let Case { restitution, mass_ratio, rates_hz: [rate_hitting_hz, rate_hit_hz] } = *case;
        let ImpactResult { error, momentum_error, kind, steps: [steps_hitting, steps_hit], led } = result;
        Row {
            restitution,
            mass_ratio,
            rate_hitting_hz,
            rate_hit_hz,
            error,
            momentum_error,
            kind,
            steps_hitting,
            steps_hit,
            led,
        }
    }

    fn case_of(row: &Row) -> Case {
        let rates_hz = [row.rate_hitting_hz, row.rate_hit_hz];
        Case { restitution: row.restitution, mass_ratio: row.mass_ratio, rates_hz }
    }

    fn figure(rows: &[Row]) -> Figure {
        let least = |v: f64| v.max(1e-16);
        let (low, high) = span(rows.iter().map(|r| least(r.error)).chain([TOLERANCE]), true);
        let panels = RESTITUTIONS.into_iter().map(|e| {
            let mut layers: Vec<Layer> = RATES_HZ
                .into_iter()
                .zip(Colour::LINES)
                .map(|([a, b], colour)| {
                    let here =
                        rows.iter().filter(|r| r.restitution == e && [r.rate_hitting_hz, r.rate_hit_hz] == [a, b]);
                    let points = here.map(|r| (r.mass_ratio, least(r.error))).collect();
                    Layer { label: format!("{a} Hz on {b} Hz"), colour, mark: Mark::Line(points) }
                })
                .collect();
            let limit = vec![(MASS_RATIOS[0], TOLERANCE), (MASS_RATIOS[5], TOLERANCE)];
            layers.push(Layer { label: "1 %".to_owned(), colour: Colour::Grey, mark: Mark::Dashed(limit) });
            let x = Axis::log("mass hit / mass that flies", MASS_RATIOS[0], MASS_RATIOS[5]);
            let y = Axis::log("error of the velocity / closing speed", low, high);
            Panel { title: format!("e = {e}"), x, y, layers }
        });
        Figure { title: "Impact of two balls on two clocks".to_owned(), panels: panels.collect(), columns: 3 }
    }

    fn table(rows: &[Row]) -> Table {
        let mut table = Table::new(&["e", "mass_ratio", "worst error", "worst momentum error", "kinds"]);
        for e in RESTITUTIONS {
            for ratio in MASS_RATIOS {
                let here: Vec<&Row> = rows.iter().filter(|r| r.restitution == e && r.mass_ratio == ratio).collect();
                if here.is_empty() {
                    continue;
                }
                let mut kinds: Vec<&str> = here.iter().map(|r| r.kind.as_str()).collect();
                kinds.sort_unstable();
                kinds.dedup();
                table.rows.push(vec![
                    (e, 1).into(),
                    (ratio, 3).into(),
                    (worst(here.iter().map(|r| r.error)), 9).into(),
                    (worst(here.iter().map(|r| r.momentum_error)), 9).into(),
                    kinds.join(" ").into(),
                ]);
            }
        }
        table
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let other = rows.iter().filter(|r| r.kind != PairKind::Ledger.name() || r.led).count();
        vec![
            Finding::at_most(
                "velocities after the impact: error over the closing speed",
                worst(rows.iter().map(|r| r.error)),
                TOLERANCE,
            ),
            Finding::at_most("pairs not coupled by the ledger, or stepped in one cluster", other as f64, 0.0),
        ]
    }
}

/// The results of a pair.
struct ImpactResult {
    error: f64,
    momentum_error: f64,
    kind: String,
    steps: [u64; 2],
    led: bool,
}

impl Default for ImpactResult {
    fn default() -> Self {
        Self { error: f64::NAN, momentum_error: f64::NAN, kind: String::new(), steps: [0; 2], led: false }
    }
}

fn collide(case: &Case) -> Option<ImpactResult> {
    let masses = [0.1, 0.1 * case.mass_ratio];
    let ball = |x: f64, speed: f64, mass: f64| {
        let plain = plain_body(Solid::Ball { radius_m: RADIUS_M }, DVec3::X * x, mass);
        RigidBody::new(RigidSpec { velocity: DVec3::X * speed, restitution: case.restitution, ..plain }).ok()
    };
    let far = GAP_M + 2.0 * RADIUS_M;
    let (hitting, hit) = (ball(0.0, CLOSING_M_S, masses[0])?, ball(far, 0.0, masses[1])?);
    let [rate_hitting, rate_hit] = case.rates_hz;
    let alone = |name: &str, ball: RigidBody, rate_hz: f64| AgentSpawn::alone(name, Box::new(ball), rate_hz);
    let mut hitting = alone("hitting", hitting, rate_hitting);
    hitting.laws = vec![(AgentId(1), Law::Ledger)];
    let spawns = vec![hitting, alone("hit", hit, rate_hit)];
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
    Some(ImpactResult {
        error: worst(error),
        momentum_error: momentum.distance(DVec3::X * (masses[0] * CLOSING_M_S)) / (masses[0] * CLOSING_M_S),
        kind: pair.map_or_else(String::new, |pair| pair.kind.name().to_owned()),
        steps: [steps.first()?.0, steps.get(1)?.0],
        led: steps.iter().any(|(_, leader)| leader.is_some()),
    })
}
