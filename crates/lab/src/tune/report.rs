//! Formats the result of `tune`, as text for people and as JSON for programs.
//!
//! In: a plant, verdicts, an explanation. Out: text. Never here: where it is printed.

use super::super::chart::{Cell, Shown, table};
use super::agents::AgentLoops;
use super::checked::Checked;
use super::{Identified, origin_name};
use metachron_console::gains;
use metachron_lod::control::Law;
use metachron_lod::tune::{Candidate, Explanation, Margins, Tuning, Verdict};
use serde_json::{Value, json};
use std::path::PathBuf;

/// All that a tuning has found.
pub(super) struct Found<'a> {
    pub tuned: &'a Tuning,
    pub agents: &'a AgentLoops,
    pub checked: &'a [Checked],
    pub files: &'a [PathBuf],
}

/// The table of a tuning, the plant, the files.
pub(super) fn text(on: &Identified, found: &Found<'_>) -> String {
    let Found { tuned, agents, checked, files } = found;
    let or = |word: &str, value: Option<Cell>| value.unwrap_or_else(|| word.cell(0));
    let table = table!(tuned.rows.iter().map(|row| (row.origin, &row.verdict)), |(origin, v)| law: origin_name(origin),
        gains: gains::gains_text(v.candidate), settle_s: or("never", v.settle_s.map(|s| s.cell(2))),
        overshoot(3): v.overshoot, miss_share(4): v.miss_share, gain_margin: or("–", v.margins.map(|m| m.gain.cell(1))),
        delay_margin: or("–", v.margins.map(|m| (m.delay as f64).cell(0))), reversals(4): v.reversals,
        quality(3): v.quality, robust_to: robust(v), lacks(2): v.shortfall, objective(4): v.objective);
    let files: Vec<_> = files.iter().map(|f| f.display().to_string()).collect();
    format!(
        "{}{}{}\n{}\nbest: {}\n{}{}files: {}\n",
        plant(on),
        speed_note(tuned),
        constraint_notes(tuned),
        table.text(),
        gains::gains_text(tuned.best.candidate),
        checked.iter().map(Checked::text).collect::<String>(),
        agents.text(),
        files.join(", ")
    )
}

/// A note where the gains were judged on another machine, because the view leaves nothing to control on this one.
fn speed_note(tuned: &Tuning) -> String {
    let speed = tuned.best.at_speed;
    if speed == 1.0 {
        return String::new();
    }
    format!(
        "note  on this machine the finest level fits in the frame budget: gains were evaluated on a machine {speed} times as fast\n"
    )
}

/// Notes where no gains keep the margins, and where the policy that predicts, which has no gains, is better than those given.
fn constraint_notes(tuned: &Tuning) -> String {
    let lacking = (!tuned.best.is_safe()).then(|| {
        let kept = tuned.best.margins.map_or_else(|| "its set point is out of reach".to_owned(), margins);
        format!(
            "note  no law tried keeps a gain margin of 2 and a delay margin of 2 frames; the best lacks least: {kept}\n"
        )
    });
    let policy = tuned.better_policy().map(|v| {
        format!("note  the policy adaptive, which has no gains, does better here: {}\n", gains::gains_text(v.candidate))
    });
    lacking.into_iter().chain(policy).collect()
}

/// The plant, in a few lines.
fn plant(on: &Identified) -> String {
    let line = &on.plant.line;
    let reach = on.plant.time_range(1.0);
    format!(
        "{} at {} Hz on {}\n  a frame takes {:.2} ms + {:.1} ns a polygon (95 %: {:.1} to {:.1}), scatter {:.1} %, dead time {} frames\n  \
         what is in view can take {:.2} to {:.2} ms\n",
        on.scene.name,
        on.target_hz,
        on.machine,
        1e3 * line.intercept,
        1e9 * line.slope,
        1e9 * line.slope_95.0,
        1e9 * line.slope_95.1,
        100.0 * line.scatter,
        on.plant.dead_time,
        1e3 * reach.least_s,
        1e3 * reach.most_s,
    )
}

/// The speeds of the machine at which a law still works.
fn robust(v: &Verdict) -> String {
    match (&v.robust_to[..], v.asked.len()) {
        (_, 0) => "out of reach".to_owned(),
        ([], _) => "none".to_owned(),
        (all, _) => all.iter().map(|s| format!("{s}x")).collect::<Vec<_>>().join(" "),
    }
}

/// The stability margins of a law.
fn margins(Margins { gain, delay }: Margins) -> String {
    format!("gain margin {gain:.2}, delay margin {delay} frames")
}

/// The comment above the fragment.
pub(super) fn comment(on: &Identified, tuned: &Tuning) -> String {
    let best = &tuned.best;
    let settle = best.settle_s.map_or_else(|| "does not settle".to_owned(), |s| format!("settles in {s:.2} s"));
    format!(
        "found by metachron tune for {} at {} Hz on {}\n{settle}, {:.2} % of frames late{}{}",
        on.scene.name,
        on.target_hz,
        on.machine,
        100.0 * best.miss_share,
        best.margins.map_or_else(String::new, |m| format!(", {}", margins(m))),
        if best.is_safe() { "" } else { ": less than is wanted, and no law tried lacks less" },
    )
}

/// The same as JSON: the best law at the top level, together with everything else.
pub(super) fn json(on: &Identified, found: &Found<'_>) -> anyhow::Result<String> {
    let Found { tuned, agents, checked, files } = found;
    let rows: Vec<_> = tuned.rows.iter().map(|row| row_json(origin_name(row.origin), &row.verdict)).collect();
    let tried: Vec<_> = tuned
        .found
        .iter()
        .flat_map(|(_, f)| {
            f.tried.iter().map(|(candidate, objective)| {
                json!({ "law": law_name(*candidate), "gains": gains_json(*candidate), "objective": objective })
            })
        })
        .collect();
    let mut whole = row_json(law_name(tuned.best.candidate), &tuned.best);
    let rest = json!({
        "scene": on.scene.name, "target_hz": on.target_hz, "machine": on.machine, "plant": plant_json(on),
        "checked": checked.iter().map(Checked::json).collect::<Vec<_>>(),
        "agents": agents.json(), "laws": rows, "tried": tried, "interrupted": tuned.interrupted, "files": files,
    });
    if let (Some(whole), Value::Object(rest)) = (whole.as_object_mut(), rest) {
        whole.extend(rest);
    }
    Ok(serde_json::to_string_pretty(&whole)? + "\n")
}

fn plant_json(on: &Identified) -> Value {
    let line = &on.plant.line;
    let reach = on.plant.time_range(1.0);
    json!({
        "fixed_ms": 1e3 * line.intercept, "polygon_ns": 1e9 * line.slope,
        "polygon_ns_95": [1e9 * line.slope_95.0, 1e9 * line.slope_95.1], "scatter": line.scatter,
        "dead_time_frames": on.plant.dead_time, "reach_ms": [1e3 * reach.least_s, 1e3 * reach.most_s],
    })
}

fn row_json(name: &str, v: &Verdict) -> Value {
    json!({
        "law": name, "gains": gains_json(v.candidate), "settle_s": v.settle_s, "overshoot": v.overshoot,
        "miss_share": v.miss_share, "gain_margin": v.margins.map(|m| m.gain), "delay_margin_frames": v.margins.map(|m| m.delay),
        "reversals": v.reversals, "quality": v.quality, "robust_to": v.robust_to, "asked": v.asked, "at_speed": v.at_speed,
        "shortfall": v.shortfall, "objective": v.objective,
    })
}

/// The law's name, as scenes and `--analyse` write it.
fn law_name(candidate: Candidate) -> &'static str {
    match candidate {
        Candidate::Feedback(Law::Printed { .. }) => "printed",
        Candidate::Feedback(Law::Corrected { .. }) => "corrected",
        Candidate::Adaptive { .. } => "adaptive",
    }
}

fn gains_json(candidate: Candidate) -> Value {
    match candidate {
        Candidate::Feedback(Law::Printed { alpha, beta }) => json!({ "alpha": alpha, "beta": beta }),
        Candidate::Feedback(Law::Corrected { kappa, lead, margin }) => {
            json!({ "kappa": kappa, "lead": lead, "margin": margin })
        }
        Candidate::Adaptive { margin } => json!({ "margin": margin }),
    }
}

/// The explanation of given gains.
pub(super) fn analysis(on: &Identified, e: &Explanation, v: &Verdict) -> String {
    let near = e.near.map_or_else(String::new, |near| {
        format!(
            "  near the set point a frame removes {:.1} % of an error, and the loop is unstable past {:.1} %; margins over \
             the machine speeds at which the target can be reached: {}\n",
            100.0 * near.gain,
            100.0 * near.gain * near.gain_margin(),
            v.margins.map_or_else(|| "out of reach".to_owned(), margins)
        )
    });
    let rest = |eps: f64, ratio: f64, end: bool| {
        format!("ε̂ = {eps:.4} at {ratio:.2} of the target time{}", if end { " (a limit)" } else { "" })
    };
    let rests: Vec<_> = e.fixed_points.iter().map(|r| rest(r.eps_hat, r.ratio, r.clamped)).collect();
    let cycle = e.cycle.map_or_else(String::new, |c| {
        format!("  limit cycle: amplitude {:.1} % of the frame time, period {:.3} s\n", 100.0 * c.amplitude, c.period_s)
    });
    let settle = |k: usize| e.from[k].settle_s.map_or_else(|| "never".to_owned(), |s| format!("{s:.2} s"));
    format!(
        "{}  {}, {}: set point {:.2} ms, of which {:.0} % goes with polygons\n{near}  can rest: {}\n{cycle}  settles from 0.4 of the rate: \
         {}, from 2.5: {}; overshoot {:.2}, {:.2}\n  n changes {:.3} times per frame at rest; late {:.2} % of disturbed frames\n\n{}\n",
        plant(on),
        law_name(v.candidate),
        gains::gains_text(v.candidate),
        1e3 * e.set_s,
        100.0 * e.share,
        rests.join("; "),
        settle(0),
        settle(1),
        e.from[0].overshoot,
        e.from[1].overshoot,
        e.chatter,
        100.0 * v.miss_share,
        e.sentences
    )
}

/// The same as JSON.
pub(super) fn analysis_json(on: &Identified, e: &Explanation, v: &Verdict) -> anyhow::Result<String> {
    let rests: Vec<_> =
        e.fixed_points.iter().map(|r| json!({ "eps": r.eps_hat, "ratio": r.ratio, "clamped": r.clamped })).collect();
    let mut whole = row_json(law_name(v.candidate), v);
    let rest = json!({
        "scene": on.scene.name, "target_hz": on.target_hz, "machine": on.machine, "plant": plant_json(on),
        "set_ms": 1e3 * e.set_s, "share": e.share, "loop_gain": e.near.map(|n| n.gain),
        "loop_gain_boundary": e.near.map(|n| n.gain * n.gain_margin()), "rests": rests, "chatter": e.chatter,
        "cycle": e.cycle.map(|c| json!({ "amplitude": c.amplitude, "period_s": c.period_s })), "sentences": e.sentences,
    });
    if let (Some(whole), Value::Object(rest)) = (whole.as_object_mut(), rest) {
        whole.extend(rest);
    }
    Ok(serde_json::to_string_pretty(&whole)? + "\n")
}
