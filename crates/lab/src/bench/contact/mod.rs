//! `bench contact`: the cost and the quality of contact in scenes that decide them, beside rapier3d and MuJoCo.
//!
//! In: towers, piles, jams, soft bodies that fold or are shaken, joints, bins of unlike bodies. Out: rows of CPU time a step on one core,
//! factors without a bound and within one, depth at landing and at rest, drift, energy made. Never here: how a step is made, how peers are run.

mod course;
mod levels;
mod peer;
mod rigid_scenes;
mod soft_scenes;
mod stage;

use super::super::args::BenchArgs;
use super::rig::machine::processor;
use super::rig::peers::Peers;
use super::subject::{Progress, Subject};
use crate::chart::{Axis, Colour, Figure, Layer, Table, blank, span, table};
use anyhow::Context;
use course::Course;
pub(crate) use levels::SolveLevels;
use metachron_console::output::{BadInput, message};
use peer::PeerRun;
use serde::{Deserialize, Serialize};
use stage::Stage;

/// The subject.
pub(super) struct Contact;

/// A run of one engine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    pub test: String,
    pub engine: String,
    pub bodies: usize,
    /// The most contacts of a step; NaN of another engine's file.
    pub contacts: f64,
    /// Macro steps.
    pub steps: usize,
    pub ms_per_step_p50: f64,
    pub ms_per_step_p99: f64,
    pub ms_most: f64,
    /// CPU time of all steps, seconds.
    pub cpu_s: f64,
    /// Ratio of that to the peer's for the same test; NaN without one.
    pub over_peer: f64,
    /// For each macro step; NaN of other engines.
    pub fine_steps: f64,
    pub solves: f64,
    pub factors: f64,
    pub products: f64,
    /// Solves in all steps that came to no end.
    pub unfinished: u32,
    /// The deepest overlap before and within the last half second, metres.
    pub landing_m: f64,
    pub rest_m: f64,
    /// How far bodies went in the last half second, the mean and the most, metres.
    pub drift_mean_m: f64,
    pub drift_most_m: f64,
    /// By how much the highest body sank, metres.
    pub sank_m: f64,
    /// The most energy above its least so far, and how much was lost, J; NaN of another engine's file.
    pub made_j: f64,
    pub lost_j: f64,
    pub machine: String,
}

/// A scene with its variant.
struct Case {
    /// The name of the scene, for `--only`.
    scene: &'static str,
    /// The end of the name of the test, after the scene; empty for a scene of one case.
    variant: String,
    seconds: f64,
    stage: Box<dyn Fn() -> anyhow::Result<Stage>>,
    levels: &'static [Level],
}

/// How far solves go.
struct Level {
    engine: &'static str,
    factors_max: Option<u32>,
}

impl Case {
    fn new(
        scene: &'static str,
        variant: impl Into<String>,
        seconds: f64,
        stage: impl Fn() -> anyhow::Result<Stage> + 'static,
    ) -> Self {
        Self { scene, variant: variant.into(), seconds, stage: Box::new(stage), levels: &LEVELS }
    }

    /// The same without time for a solve: rapier3d steps the bodies that it can step.
    fn hurried(self) -> Self {
        Self { levels: &HURRIED, ..self }
    }

    fn name(&self) -> String {
        if self.variant.is_empty() { self.scene.to_owned() } else { format!("{}, {}", self.scene, self.variant) }
    }

    /// The rows of our engine at each level, and of rapier3d, where it takes the scene.
    fn measure(&self) -> anyhow::Result<Vec<Row>> {
        let stage = (self.stage)()?;
        let mut rows = Vec::new();
        for &Level { engine, factors_max } in self.levels {
            let course = Course::of_cluster(&mut stage.play()?.within(factors_max), self.seconds)?;
            rows.push(row(self.name(), engine, &course));
        }
        if let Some(mut world) = stage.plain_world() {
            let theirs = Course::of_plain_world(&mut world, self.seconds);
            let unknown = f64::NAN;
            let plain = row(self.name(), "rapier3d", &theirs);
            rows.push(Row { solves: unknown, factors: unknown, products: unknown, ..plain });
        }
        Ok(rows)
    }
}

/// Our engine where no solve makes more factors than these: the least of a scene's budget, and a few more.
const BUDGETED: &str = "metachron, 8 factors";
const BUDGET_FACTORS: u32 = 8;
const LEVELS: [Level; 2] =
    [Level { engine: "metachron", factors_max: None }, Level { engine: BUDGETED, factors_max: Some(BUDGET_FACTORS) }];
const HURRIED: [Level; 1] = [Level { engine: "metachron", factors_max: Some(0) }];

/// The boxes of towers are aside by up to so much, millimetres, and rebound by so much.
const TOWERS_MM: [f64; 3] = [12.0, 25.0, 35.0];
const TOWER_RESTITUTIONS: [f64; 2] = [0.0, 0.2];

/// All cases; with `quick` fewer and smaller ones.
fn cases(quick: bool) -> Vec<Case> {
    let mut all = Vec::new();
    for off_mm in TOWERS_MM {
        for restitution in TOWER_RESTITUTIONS {
            let seconds = if quick { 1.0 } else { 3.0 };
            all.push(Case::new("tower", format!("off by {off_mm} mm, e {restitution}"), seconds, move || {
                Ok(rigid_scenes::tower(1e-3 * off_mm).rebounding(restitution))
            }));
        }
    }
    let pendulum_s = if quick { 2.0 } else { 20.0 };
    all.push(Case::new("pendulum", "", pendulum_s, || Ok(rigid_scenes::pendulum())));
    let pile = |variant: String, restitution| {
        let seconds = if quick { 0.4 } else { 1.5 };
        Case::new("pile", variant, seconds, move || Ok(rigid_scenes::pile()?.rebounding(restitution)))
    };
    all.extend([0.0, 0.1].map(|restitution| pile(format!("one problem, e {restitution}"), restitution)));
    all.push(pile("a heap, e 0".to_owned(), 0.0).hurried());
    for seed in 1..=if quick { 2 } else { 20 } {
        all.push(Case::new("bin", format!("seed {seed}"), 2.0, move || Ok(soft_scenes::bin(seed))));
    }
    all.extend(from_prototype(quick));
    all.push(Case::new("overlap", "", 0.5, rigid_scenes::overlap));
    all
}

/// The cases of large clusters by which ways of solving them were chosen.
fn from_prototype(quick: bool) -> Vec<Case> {
    let seconds = |full: f64| if quick { 0.3 } else { full };
    let of = |scene: &'static str, full_s: f64, stage: fn() -> Stage| {
        Case::new(scene, "", seconds(full_s), move || Ok(stage()))
    };
    let mut all = vec![
        of("mess_small", 1.5, || rigid_scenes::mess(6)),
        of("bricks", 1.0, || rigid_scenes::bricks(10, 10)),
        of("softpile", 1.0, || soft_scenes::soft_pile(300, 6)),
        of("sheet", 1.2, || soft_scenes::sheet(30)),
        of("shaken", 2.0, || soft_scenes::shaken(10)),
        of("four", 1.5, || soft_scenes::four([9, 6, 3])),
        of("ropes", 1.5, || soft_scenes::ropes(10, 4)),
        of("stack", 2.0, || rigid_scenes::stack(1000.0)),
        of("chain", 2.0, || rigid_scenes::chain(100.0)),
    ];
    if !quick {
        all.push(of("mess", 0.6, || rigid_scenes::mess(10)));
    }
    all
}

/// The cases that are asked for; all where none is named.
fn chosen(all: Vec<Case>, only: &[String]) -> anyhow::Result<Vec<Case>> {
    for name in only {
        if !all.iter().any(|case| case.scene == name) {
            let mut scenes: Vec<_> = all.iter().map(|case| case.scene).collect();
            scenes.dedup();
            let known = scenes.join(", ");
            return Err(
                BadInput(format!("--only {name} is no scene of bench contact; expected one of: {known}")).into()
            );
        }
    }
    Ok(all.into_iter().filter(|case| only.is_empty() || only.iter().any(|name| name == case.scene)).collect())
}

/// A run as a row, without a peer.
fn row(test: String, engine: &str, course: &Course) -> Row {
    let each = |count: u32| f64::from(count) / course.ms.len() as f64;
    Row {
        test,
        engine: engine.to_owned(),
        bodies: course.bodies,
        contacts: f64::from(course.contacts),
        steps: course.ms.len(),
        ms_per_step_p50: course.ms_at(0.5),
        ms_per_step_p99: course.ms_at(0.99),
        ms_most: course.ms_at(1.0),
        cpu_s: course.cpu_s(),
        over_peer: f64::NAN,
        fine_steps: each(course.fine_steps),
        solves: each(course.solves),
        factors: each(course.factors),
        products: each(course.products),
        unfinished: course.unfinished,
        landing_m: course.landing_m,
        rest_m: course.rest_m,
        drift_mean_m: course.drift_mean_m,
        drift_most_m: course.drift_most_m,
        sank_m: course.sank_m,
        made_j: course.made_j,
        lost_j: course.lost_j,
        machine: processor(),
    }
}

/// Rows with the peer's run of the same test behind them, and their time over its.
fn beside(rows: Vec<Row>, peers: Option<&Peers<PeerRun>>) -> Vec<Row> {
    let Some((peers, run)) = peers.and_then(|peers| Some((peers, peers.of(&rows.first()?.test)?))) else { return rows };
    let mut rows: Vec<_> = rows.into_iter().map(|row| Row { over_peer: row.cpu_s / run.cpu_s, ..row }).collect();
    rows.push(peer_row(peers, run));
    rows
}

/// Another engine's run as a row.
fn peer_row(peers: &Peers<PeerRun>, run: &PeerRun) -> Row {
    Row {
        test: run.test.clone(),
        engine: peers.engine.clone(),
        bodies: run.bodies,
        steps: run.steps,
        ms_per_step_p50: run.ms_p50,
        ms_per_step_p99: run.ms_p99,
        ms_most: run.ms_most,
        cpu_s: run.cpu_s,
        over_peer: 1.0,
        landing_m: run.landing_m,
        rest_m: run.rest_m,
        drift_mean_m: run.drift_mean_m,
        drift_most_m: run.drift_most_m,
        sank_m: run.sank_m,
        made_j: run.made_j,
        machine: peers.machine.clone(),
        ..blank()
    }
}

impl Subject for Contact {
    type Row = Row;
    const NAME: &'static str = "contact";
    const TABLE: fn(&[Row]) -> Table = table!(|r| test: r.test, engine: r.engine, p50_ms(3): r.ms_per_step_p50,
        p99_ms(3): r.ms_per_step_p99, most_ms(2): r.ms_most, cpu_s(3): r.cpu_s, over_peer(2): r.over_peer,
        fine(2): r.fine_steps, solves(2): r.solves, factors(2): r.factors, products(1): r.products,
        unfinished: r.unfinished, landing_mm(3): 1e3 * r.landing_m, rest_mm(3): 1e3 * r.rest_m,
        drift_mm(3): 1e3 * r.drift_mean_m, most_mm(3): 1e3 * r.drift_most_m, sank_mm(2): 1e3 * r.sank_m,
        made_j(5): r.made_j);

    fn measure(args: &BenchArgs, progress: &Progress) -> anyhow::Result<Vec<Row>> {
        let names: Vec<_> = cases(false).iter().map(Case::name).collect();
        let names: Vec<_> = names.iter().map(String::as_str).collect();
        let peers = args.peers.as_deref().map(|path| Peers::<PeerRun>::read(path, &names)).transpose()?;
        if let Some(Peers { engine, machine, .. }) = peers.as_ref().filter(|_| !args.quiet) {
            message(&format!("beside {engine} on {machine}"));
        }
        let cases = chosen(cases(args.quick), &args.only)?;
        let measured = |case: Case| {
            let case = Case { seconds: args.seconds.unwrap_or(case.seconds), ..case };
            let found = case.measure().with_context(|| case.name())?;
            // a shorter run is none that the peer's can be held against
            Ok(beside(found, peers.as_ref().filter(|_| !args.quick && args.seconds.is_none())))
        };
        Ok(progress.rows(cases, Case::name, measured)?.into_iter().flatten().collect())
    }

    fn figure(rows: &[Row]) -> Figure {
        let ours: Vec<_> = rows.iter().filter(|row| row.engine == "metachron").collect();
        let times = || ours.iter().flat_map(|row| [row.ms_per_step_p50, row.ms_per_step_p99]);
        let (least, most) = span(times(), true);
        let bar = |(at, row): (usize, &&Row)| {
            let cell = [at as f64 + 0.1, at as f64 + 0.9, row.ms_per_step_p50, row.ms_per_step_p99];
            Layer::cells(&row.test, Colour::LINES[at % Colour::LINES.len()], [cell])
        };
        let x = Axis::linear("", 0.0, ours.len().max(1) as f64);
        let y = Axis::log("CPU time per step, ms: the median and the 99th percentile", least, most);
        Figure::single("Steps in which contact decides", x, y, ours.iter().enumerate().map(bar))
    }
}

#[cfg(test)]
mod tests;
