//! Writes the settings found into the scene file; every other line stays as it was.
//!
//! In: a scene file and settings. Out: the same file with other steps, segments and integrators. Never here: the search for them.

use super::objects::{name, tables};
use super::task::Task;
use super::{Fitted, to_rope};
use anyhow::Context;
use metachron_console::files::write_file;
use metachron_console::output::BadInput;
use metachron_models::rod::Integrator;
use metachron_scene::{Limits, Source, load};
use metachron_session::fit::Setting;
use metachron_world::{Member, Spec};
use std::path::Path;
use toml_edit::{Array, DocumentMut, Item, Table, Value};

/// Writes the needed settings into the file; returns the number of changed keys.
pub(super) fn write(path: &Path, task: &Task<'_>, fitted: &Fitted, limits: Limits) -> anyhow::Result<usize> {
    let shown = path.display();
    let before = std::fs::read_to_string(path).with_context(|| format!("{shown} cannot be read"))?;
    let (text, changes) = changed(&before, task, fitted).map_err(|what| BadInput(format!("{shown}: {what}")))?;
    let source = Source::recorded(&path.to_string_lossy(), &text, path.parent());
    source
        .and_then(|source| load(&source.within(limits), &[]))
        .map_err(|error| anyhow::Error::from(error).context(format!("{shown} is unchanged")))?;
    write_file(path, &text)?;
    Ok(changes)
}

/// The text with the needed settings, and the number of changed keys.
fn changed(text: &str, task: &Task<'_>, fitted: &Fitted) -> Result<(String, usize), String> {
    let mut document: DocumentMut = text.parse().map_err(|error| format!("{error}"))?;
    let scene = task.scene_at(&fitted.need.settings);
    let mut changes = 0;
    for (object, (now, need)) in fitted.now.0.iter().zip(&fitted.need.settings).enumerate() {
        let becomes_rope = task.first_member(object).spec.model() != task.member(object).spec.model();
        if now == need && !becomes_rope {
            continue;
        }
        let wanted = &task.objects[object];
        let member = &scene.agents[wanted.agents[0].0 as usize];
        let table = tables(&mut document).find(|table| name(table) == Some(&wanted.name));
        let table = table.ok_or_else(|| format!("`{}` has no `[[object]]` table of its own", wanted.name))?;
        changes += put_dt(table, now, need);
        changes += if becomes_rope { to_rope::put(table, member) } else { put(table, member, now, need) };
    }
    Ok((document.to_string(), changes))
}

/// Puts a step into an object's table; returns the number of changed keys.
fn put_dt(table: &mut Table, now: &Setting, need: &Setting) -> usize {
    let mut changes = 0;
    if need.dt_s != now.dt_s {
        let dt_ms = rounded(need.dt_s * 1e3);
        let has_rate = table.contains_key("rate_hz");
        if has_rate {
            changes += set(table, "rate_hz", (1e3 / dt_ms).into());
        }
        if !has_rate || table.contains_key("dt_ms") {
            changes += set(table, "dt_ms", dt_ms.into());
        }
    }
    changes
}

/// Puts a division and a method into an object's table; returns the number of changed keys.
fn put(table: &mut Table, member: &Member, now: &Setting, need: &Setting) -> usize {
    let mut changes = 0;
    if need.pieces != now.pieces {
        changes += match spacing_m(member) {
            Some(eps_m) => set(table, "eps_m", eps_m.into()),
            None => set(table, "segments", segments(member)),
        };
    }
    if need.method != now.method {
        changes += set(table, "integrator", Integrator::ALL[need.method].name().into());
    }
    changes
}

/// The spacing of a soft body that has an ε instead of segments, metres, rounded up: a shorter one may make one more cell.
fn spacing_m(member: &Member) -> Option<f64> {
    let Spec::Soft(soft) = &member.spec else { return None };
    soft.spacing().map(|nodes| rounded((nodes.eps_m * 1e6).ceil() * 1e-6))
}

/// The division of a body, in the form of its table.
fn segments(member: &Member) -> Value {
    match &member.spec {
        Spec::Tube(tube) => Value::from(tube.segments.unwrap_or(0) as i64),
        _ => match member.cells().as_slice() {
            [one] => Value::from(i64::from(*one)),
            many => many.iter().map(|count| i64::from(*count)).collect::<Array>().into(),
        },
    }
}

/// Sets the value of a key; the text around the old value stays.
pub(super) fn set(table: &mut Table, key: &str, value: Value) -> usize {
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => {
            let decor = old.decor().clone();
            *old = value;
            *old.decor_mut() = decor;
        }
        None => table[key] = Item::Value(value),
    }
    1
}

/// Rounds to six digits after the point, so that 0.1 + 0.2 is 0.3.
pub(super) fn rounded(value: f64) -> f64 {
    format!("{value:.6}").parse().unwrap_or(value)
}
