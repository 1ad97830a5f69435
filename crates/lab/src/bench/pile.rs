//! `bench pile`: a thousand boxes as agents that step in clusters while they touch, compared with one rapier3d world of the same boxes.
//!
//! In: the built-in scene `pile`. Out: rows of whole steps (every box by 1/240 s) per second of CPU time, each over the same
//! simulated seconds: boxes fall into a bin and come to rest. Only steps really made count, and no box sleeps. Agents that gave
//! up time are compared with as many first steps of the plain world, because boxes that fall cost less than a heap.
//! The plain world runs with rapier3d's own settings and with careful ones, by which stacks of boxes stay. Published results for a thousand boxes follow.
//! Never here: how agents form clusters.

use super::super::args::BenchArgs;
use super::rig::machine::{others_cpu, own_cpu};
use super::rig::plain_world::{Frame, Settings, rigid_specs, world_of};
use super::subject::{Progress, Subject};
use crate::chart::{Axis, Colour, Figure, Layer, Table, table};
use metachron_render::{Size, Style};
use metachron_runtime::AgentStats;
use metachron_scene::{Source, load};
use metachron_session::{Drawing, End, Headless, Session, play_headless};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Pace, Scene};
use serde::{Deserialize, Serialize};

/// The subject.
pub(super) struct Pile;

/// Simulated seconds, in full and with `--quick`: the boxes rest after two.
const SECONDS: [f64; 2] = [5.0, 2.0];

/// Steps per simulated second, of the scene and of the plain world.
const STEP_HZ: f64 = 240.0;

/// Other engines with 1000 boxes in columns at 240 Hz: whole steps per second of CPU time on a core of an AMD EPYC.
const OTHERS: [(&str, f64); 3] =
    [("MuJoCo 4.0.0, Newton", 277.6), ("MuJoCo 4.0.0, CG", 216.8), ("PyBullet 3.2.7, 50 iterations", 74.0)];

/// The step rate of one engine or executor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    pub who: String,
    /// Whether it was measured in this run; otherwise it was measured elsewhere, with boxes in columns.
    pub here: bool,
    pub boxes: usize,
    /// NaN, as the times after it, of what was measured elsewhere.
    pub sim_s: f64,
    /// Simulated time given up, mean over the boxes.
    pub dropped_s: f64,
    pub cpu_s: f64,
    pub steps_per_cpu_s: f64,
    /// Ratio to the plain world's rate over as many steps.
    pub share: f64,
}

/// A measurement of one row.
type Measure<'a> = Box<dyn FnOnce() -> anyhow::Result<Row> + 'a>;

/// CPU seconds that the plain world has used after each of its steps.
type Spent = Vec<f64>;

impl Subject for Pile {
    type Row = Row;
    const NAME: &'static str = "pile";
    const TABLE: fn(&[Row]) -> Table = table!(|r| who: r.who, here: r.here, boxes: r.boxes, sim_s(1): r.sim_s,
        dropped_s(2): r.dropped_s, cpu_s(2): r.cpu_s, steps_per_cpu_s(1): r.steps_per_cpu_s, share(2): r.share);

    fn measure(args: &BenchArgs, progress: &Progress) -> anyhow::Result<Vec<Row>> {
        let sim_s = args.seconds.unwrap_or(SECONDS[usize::from(args.quick)]);
        let scene = load(&Source::open("pile")?, &[])?;
        let mut spent = Spent::new();
        let cases: Vec<(&str, Measure<'_>)> = vec![
            ("one rapier3d world", Box::new(|| plain(&scene, sim_s, Settings::Own, &mut spent))),
            (
                "one rapier3d world, careful settings",
                Box::new(|| plain(&scene, sim_s, Settings::Careful, &mut Spent::new())),
            ),
            ("agents in virtual time", Box::new(|| agents(&scene, ExecutorKind::Lockstep, sim_s))),
            ("agents in a pool", Box::new(|| agents(&scene, ExecutorKind::Pool, sim_s))),
        ];
        let rows = progress.rows(cases, |(words, _)| (*words).to_owned(), |(_, measured)| measured())?;
        let Some(plain) = rows.first().cloned() else { return Ok(rows) };
        let others = OTHERS.map(|(who, steps)| Row {
            who: who.to_owned(),
            here: false,
            sim_s: f64::NAN,
            dropped_s: f64::NAN,
            cpu_s: f64::NAN,
            steps_per_cpu_s: steps,
            ..plain.clone()
        });
        let held = |row: Row, steps| Row { share: row.steps_per_cpu_s / first_steps_per_s(&spent, steps), ..row };
        let here =
            rows.into_iter().map(|row| (row.steps_per_cpu_s * row.cpu_s, row)).map(|(made, row)| held(row, made));
        Ok(here.chain(others.map(|row| held(row, f64::INFINITY))).collect())
    }

    fn figure(rows: &[Row]) -> Figure {
        let most = rows.iter().map(|row| row.steps_per_cpu_s).fold(1.0, f64::max);
        let bar = |(at, row): (usize, &Row)| {
            let colour = if row.here { Colour::LINES[at % Colour::LINES.len()] } else { Colour::Grey };
            Layer::cells(&row.who, colour, [[at as f64 + 0.1, at as f64 + 0.9, 0.0, row.steps_per_cpu_s]])
        };
        let x = Axis::linear("", 0.0, rows.len().max(1) as f64);
        let y = Axis::linear("whole steps per second of CPU time", 0.0, 1.1 * most);
        Figure::single("A thousand boxes", x, y, rows.iter().enumerate().map(bar))
    }
}

/// Steps per second of CPU time over the first `steps` entries of `spent`, or over all of them where there are fewer.
fn first_steps_per_s(spent: &[f64], steps: f64) -> f64 {
    let steps = (steps.round() as usize).clamp(1, spent.len().max(1));
    spent.get(steps - 1).map_or(f64::NAN, |cpu_s| steps as f64 / cpu_s)
}

/// Measures the scene's boxes as agents.
fn agents(scene: &Scene, executor: ExecutorKind, seconds: f64) -> anyhow::Result<Row> {
    let session = Session::open(Scene { executor, ..scene.clone() }, Pace::RealTime)?;
    let plan = Headless {
        end: End::Seconds(seconds),
        size: Size { width: 640, height: 360 },
        style: Style::default(),
        drawing: Drawing::Nothing,
        png: None,
        depth: None,
        film: None,
    };
    let from = own_cpu() + others_cpu();
    let outcome = play_headless(session, plan, &mut |_, _| true)?;
    let cpu_s = (own_cpu() + others_cpu()).saturating_sub(from).as_secs_f64();
    let boxes = outcome.agents.len();
    let dropped_s = outcome.agents.iter().map(|a| a.stats.dropped.as_secs_f64()).sum::<f64>() / boxes.max(1) as f64;
    let who = format!("agents, {}", executor.name());
    // the simulated time of the steps made, however long they were: time that agents lag behind is not counted
    let made_s = |s: &AgentStats| s.lived.as_secs_f64() - s.rested.as_secs_f64();
    let made_s = outcome.agents.iter().map(|a| made_s(&a.stats)).sum::<f64>() / boxes.max(1) as f64;
    let steps_per_cpu_s = made_s * STEP_HZ / cpu_s;
    Ok(Row { who, here: true, boxes, sim_s: outcome.sim_s, dropped_s, cpu_s, steps_per_cpu_s, share: f64::NAN })
}

/// Half the diagonal of a box of the scene, metres.
const BOX_RADIUS_M: f64 = 0.034_64;

/// Measures the same boxes in one world; `spent` receives the CPU time used after each step.
fn plain(scene: &Scene, seconds: f64, settings: Settings, spent: &mut Spent) -> anyhow::Result<Row> {
    let bodies = rigid_specs(scene)?;
    let boxes = bodies.len();
    let frame = Frame { settings, step_s: 1.0 / STEP_HZ, radius_m: BOX_RADIUS_M, gravity: scene.gravity };
    let mut world = world_of(bodies, &scene.obstacles, frame)?;
    let steps = (seconds * STEP_HZ).round();
    let from = own_cpu();
    for _ in 0..steps as u64 {
        world.step();
        spent.push((own_cpu() - from).as_secs_f64());
    }
    let cpu_s = spent.last().copied().unwrap_or_default();
    let (sim_s, steps_per_cpu_s) = (steps / STEP_HZ, steps / cpu_s);
    let who = match settings {
        Settings::Own => "one rapier3d world".to_owned(),
        Settings::Careful => "one rapier3d world, careful settings".to_owned(),
    };
    Ok(Row { who, here: true, boxes, sim_s, dropped_s: 0.0, cpu_s, steps_per_cpu_s, share: f64::NAN })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plain_world_holds_the_boxes_of_the_scene_and_they_fall() {
        let scene =
            load(&Source::open(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/pile.toml")).unwrap(), &[]).unwrap();
        for settings in [Settings::Own, Settings::Careful] {
            let mut spent = Spent::new();
            let row = plain(&scene, 0.02, settings, &mut spent).unwrap();
            assert!(spent.len() == 5 && spent.is_sorted());
            assert_eq!((row.boxes, row.here), (1000, true));
            assert!(row.steps_per_cpu_s > 0.0 && (row.sim_s - 5.0 / STEP_HZ).abs() < 1e-12);
        }
    }

    #[test]
    fn fewer_steps_are_compared_with_as_many_first_ones() {
        let spent = [1.0, 2.0, 4.0, 8.0];
        let shares = [0.0, 1.0, 2.2, 4.0, 9.0, f64::INFINITY].map(|steps| first_steps_per_s(&spent, steps));
        assert_eq!(shares, [1.0, 1.0, 1.0, 0.5, 0.5, 0.5]);
        assert!(first_steps_per_s(&[], 1.0).is_nan());
    }
}
