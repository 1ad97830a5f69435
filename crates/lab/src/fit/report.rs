//! Formats the result of `fit`, as text for people and as JSON for programs.
//!
//! In: settings and costs, present and needed. Out: text. Never here: where it is printed.

use super::super::args::FitArgs;
use super::super::chart::{Cell, Shown, table};
use super::task::Task;
use super::{Fitted, Simpler, length};
use metachron_models::rod::Integrator;
use metachron_session::fit::Setting;
use serde_json::{Value, json};

/// The table, and the basis of its results.
pub(super) fn text(args: &FitArgs, task: &Task<'_>, fitted: &Fitted) -> String {
    let text = |text: &str| Cell::Text(text.to_owned());
    let lines = (0..task.objects.len()).flat_map(|object| [(object, 0), (object, 1)]);
    let lines = lines.map(|(object, which)| (object, which, setting_and_cost(fitted, object, which)));
    let table = table!(lines, |(object, which, (setting, cost_s))|
        object: text(if which == 0 { &task.objects[object].name } else { "" }),
        model: text(shown_model(task, object, which)), "": ["pays", "needs"][which],
        integrator: method(models(task, object)[which], setting).unwrap_or("-"), dt_ms(3): setting.dt_s * 1e3,
        segments: if setting.pieces > 0 { setting.pieces.cell(0) } else { text("-") }, ms_per_s(4): cost_s * 1e3,
        cpu_ms_per_s(3): fitted.cpu_s[which][object] * 1e3,
        simpler: text(simpler(fitted, object).filter(|_| which == 1).map_or("", |note| note.word)));
    let Fitted { now, need, known_m, .. } = fitted;
    let held = if now.1.error_m + known_m <= args.tolerance { "met" } else { "not met" };
    let mut out = format!(
        "{}: {} points within {} over {} s, against a converged answer known to {}\n  present settings: tolerance {held}, error {}, {:.3} ms per simulated second\n  needed settings: {:.3} ms, error {} ({} runs)\n\n{}",
        args.scene,
        task.held,
        length(args.tolerance),
        args.seconds,
        length(*known_m),
        length(now.1.error_m),
        now.1.cost_s() * 1e3,
        need.trial.cost_s() * 1e3,
        length(need.trial.error_m),
        task.runs.get(),
        table.text()
    );
    out.push_str("ms_per_s: milliseconds of one core per simulated second on the declared machine; cpu_ms_per_s: measured on this machine\n");
    out.push_str(&format!("cost of a solve on this machine, relative to implicit-euler: {}\n", prices(task)));
    notes(fitted).for_each(|note| out.push_str(&format!("note  {note}\n")));
    if need.cut_short {
        out.push_str("note  the search was cut short: cheaper settings may exist\n");
    }
    out
}

/// The model of an object; of the needed one nothing where it is the present one.
fn shown_model(task: &Task<'_>, object: usize, which: usize) -> &'static str {
    let [pays, needs] = models(task, object);
    if which == 0 {
        pays
    } else if needs == pays {
        ""
    } else {
        needs
    }
}

/// The present model of an object, and the needed one.
fn models(task: &Task<'_>, object: usize) -> [&'static str; 2] {
    [task.first_member(object), task.member(object)].map(|member| member.spec.model())
}

fn simpler(fitted: &Fitted, object: usize) -> Option<&Simpler> {
    fitted.simpler.get(object)?.as_ref()
}

fn notes(fitted: &Fitted) -> impl Iterator<Item = &str> {
    fitted.simpler.iter().flatten().map(|found| found.note.as_str())
}

/// The cost of a solve by every integrator.
fn prices(task: &Task<'_>) -> String {
    let price = |(integrator, price): (Integrator, &f64)| format!("{} {price:.2}", integrator.name());
    Integrator::ALL.into_iter().zip(&task.prices).map(price).collect::<Vec<_>>().join(", ")
}

/// An object's setting and cost: present or needed.
fn setting_and_cost(fitted: &Fitted, object: usize, which: usize) -> (Setting, f64) {
    match which {
        0 => (fitted.now.0[object], fitted.now.1.costs_s[object]),
        _ => (fitted.need.settings[object], fitted.need.trial.costs_s[object]),
    }
}

fn method(model: &str, setting: Setting) -> Option<&'static str> {
    (model == "tube").then(|| Integrator::ALL[setting.method].name())
}

/// The same as JSON.
pub(super) fn json(args: &FitArgs, task: &Task<'_>, fitted: &Fitted, written: bool) -> anyhow::Result<String> {
    let side = |object: usize, which: usize| -> Value {
        let (setting, cost_s) = setting_and_cost(fitted, object, which);
        let cpu = fitted.cpu_s[which][object];
        let model = models(task, object)[which];
        json!({
            "model": model,
            "integrator": method(model, setting),
            "dt_ms": setting.dt_s * 1e3,
            "segments": (setting.pieces > 0).then_some(setting.pieces),
            "ms_per_s": cost_s * 1e3,
            "cpu_ms_per_s": cpu.is_finite().then_some(cpu * 1e3),
        })
    };
    let object = |at: usize| {
        let (name, [model, _]) = (&task.objects[at].name, models(task, at));
        let simpler = simpler(fitted, at).map(|note| note.word);
        json!({ "name": name, "model": model, "pays": side(at, 0), "needs": side(at, 1), "simpler": simpler })
    };
    let price = |(integrator, price): (Integrator, &f64)| (integrator.name().to_owned(), json!(finite(*price)));
    let solves: serde_json::Map<_, _> = Integrator::ALL.into_iter().zip(&task.prices).map(price).collect();
    let report = json!({
        "scene": args.scene,
        "tolerance_m": args.tolerance,
        "seconds": args.seconds,
        "points": task.held,
        "known_m": fitted.known_m,
        "runs": task.runs.get(),
        "pays": { "error_m": finite(fitted.now.1.error_m), "ms_per_s": fitted.now.1.cost_s() * 1e3 },
        "needs": { "error_m": fitted.need.trial.error_m, "ms_per_s": fitted.need.trial.cost_s() * 1e3 },
        "objects": (0..task.objects.len()).map(object).collect::<Vec<_>>(),
        "solves": solves,
        "notes": notes(fitted).collect::<Vec<_>>(),
        "complete": !fitted.need.cut_short,
        "written": written,
    });
    Ok(format!("{}\n", serde_json::to_string_pretty(&report)?))
}

fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}
