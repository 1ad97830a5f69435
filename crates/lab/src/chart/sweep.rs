//! Measures the cases of an experiment, on all cores unless they measure time.
//!
//! In: cases, rows that exist already, a flag that stops it. Out: rows in the order of the cases, each in the file as soon
//! as it is measured. The core that measures a case is left to chance; the rows do not depend on it. Never here: measurements.

use super::experiment::{CaseOf, Experiment};
use super::rows::RowFile;
use anyhow::Context;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

/// The result of a sweep.
pub(super) struct Swept<R> {
    /// The rows so far, in the order of the cases.
    pub(super) rows: Vec<R>,
    /// Whether all cases were measured.
    pub(super) complete: bool,
}

/// Measures every case of `E` without a row in `rows`; `stopped` ends it after the rows in progress; `progress` is called for every
/// row with the number of rows done and of all rows.
///
/// # Errors
/// Errors of the file system; a case that panicked.
pub(super) fn sweep<E: Experiment>(
    cases: &[CaseOf<E>],
    mut file: RowFile,
    mut rows: Vec<Option<E::Row>>,
    stopped: &AtomicBool,
    progress: &mut dyn FnMut(usize, usize),
) -> anyhow::Result<Swept<E::Row>> {
    let open: Vec<usize> = (0..cases.len()).filter(|&k| rows[k].is_none()).collect();
    let mut done = cases.len() - open.len();
    progress(done, cases.len());
    let next = AtomicUsize::new(0);
    let work = |out: mpsc::Sender<(usize, Option<E::Row>)>| {
        while !stopped.load(Ordering::Relaxed) {
            let Some(&k) = open.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
            let row = catch_unwind(AssertUnwindSafe(|| E::row(&cases[k]))).ok();
            if out.send((k, row)).is_err() {
                break;
            }
        }
    };
    thread::scope(|scope| -> anyhow::Result<()> {
        let (out, rows_in) = mpsc::channel();
        let workers = if E::ALONE { 1 } else { cores() };
        for number in 0..workers.min(open.len()) {
            let (out, work) = (out.clone(), &work);
            let name = format!("sweep-{number}");
            thread::Builder::new()
                .name(name)
                .spawn_scoped(scope, move || work(out))
                .context("no thread could be started")?;
        }
        drop(out);
        for (k, row) in rows_in {
            let row = row.with_context(|| format!("case {k} of {} could not be measured", E::NAME))?;
            file.add::<E>(&row)?;
            rows[k] = Some(row);
            done += 1;
            progress(done, cases.len());
        }
        Ok(())
    })?;
    let complete = done == cases.len();
    let rows: Vec<E::Row> = rows.into_iter().flatten().collect();
    if complete {
        file.finish::<E>(&rows)?;
    }
    Ok(Swept { rows, complete })
}

fn cores() -> usize {
    thread::available_parallelism().map_or(1, std::num::NonZero::get)
}
