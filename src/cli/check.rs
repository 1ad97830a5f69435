//! `check`: validates scenes.

use super::args::CheckArgs;
use metachron_console::exit::Exit;
use metachron_console::output::{data, message, print_overlaps, rendered};
use metachron_scene::{SceneError, SceneProblem, Source, load};
use metachron_session::report::{MovedReport, OverlapReport};
use metachron_world::Scene;
use serde::Serialize;

#[derive(Serialize)]
struct Row<'a> {
    scene: &'a str,
    ok: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    content: Option<Content>,
    problems: Vec<ProblemRow<'a>>,
}

#[derive(Serialize)]
struct Content {
    agents: usize,
    fixed: usize,
    probes: usize,
    scenery: usize,
    joints: usize,
    couplings: usize,
    overlaps: Vec<OverlapReport>,
    moved: Vec<MovedReport>,
}

#[derive(Serialize)]
struct ProblemRow<'a> {
    line: usize,
    column: usize,
    text: &'a str,
    message: &'a str,
    expected: &'a str,
    help: Option<&'a str>,
}

/// Checks every scene; the command ends with code 2 if one of them is bad.
pub(super) fn command(args: &CheckArgs) -> anyhow::Result<Exit> {
    let results: Vec<(&str, Result<Scene, SceneError>)> =
        args.scenes.iter().map(|name| (name.as_str(), open(name, args))).collect();
    if args.common.json {
        let rows: Vec<_> = results.iter().map(|(name, result)| row(name, result)).collect();
        data(&format!("{}\n", serde_json::to_string_pretty(&rows)?))?;
    } else {
        for (name, result) in &results {
            print_result(name, result, args.common.quiet)?;
        }
    }
    Ok(if results.iter().all(|(_, result)| result.is_ok()) { Exit::Ok } else { Exit::BadInput })
}

fn open(name: &str, args: &CheckArgs) -> Result<Scene, SceneError> {
    load(&Source::open(name)?.within(args.common.limits.limits()), &args.common.set)
}

fn print_result(name: &str, result: &Result<Scene, SceneError>, quiet: bool) -> anyhow::Result<()> {
    match result {
        Err(error) => message(&rendered(error)),
        Ok(_) if quiet => {}
        Ok(scene) => {
            let Content { agents, fixed, probes, scenery, joints, couplings, .. } = content(scene);
            let always = [(agents, "agent"), (fixed, "fixed object"), (probes, "probe")].into_iter();
            let some = [(scenery, "scenic object"), (joints, "joint"), (couplings, "coupling")]
                .into_iter()
                .filter(|(count, _)| *count > 0);
            let list = always.chain(some).map(|(count, what)| counted(count, what)).collect::<Vec<_>>().join(", ");
            data(&format!("{name}: ok ({list})\n"))?;
            print_overlaps(scene);
        }
    }
    Ok(())
}

fn counted(count: usize, what: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {what}{plural}")
}

fn content(scene: &Scene) -> Content {
    Content {
        agents: scene.agents.len(),
        fixed: scene.obstacles.len(),
        probes: scene.probes.len(),
        scenery: scene.scenery.len(),
        joints: scene.joints.len(),
        couplings: scene.couplings.len(),
        overlaps: scene.overlaps.iter().map(OverlapReport::of).collect(),
        moved: scene.moved.iter().map(MovedReport::of).collect(),
    }
}

fn row<'a>(name: &'a str, result: &'a Result<Scene, SceneError>) -> Row<'a> {
    match result {
        Ok(scene) => Row { scene: name, ok: true, content: Some(content(scene)), problems: Vec::new() },
        Err(error) => {
            Row { scene: name, ok: false, content: None, problems: error.problems.iter().map(problem).collect() }
        }
    }
}

fn problem(problem: &SceneProblem) -> ProblemRow<'_> {
    ProblemRow {
        line: problem.line,
        column: problem.column,
        text: &problem.text,
        message: &problem.message,
        expected: &problem.expected,
        help: problem.help.as_deref(),
    }
}
