//! The common form of a benchmark: rows, their table and figure, and the files to which they are written.
//!
//! In: a subject. Out: CSV, JSON, SVG and PNG in a folder, a table on standard output. Never here: what is measured.

use super::super::args::BenchArgs;
use super::super::chart::figure;
use crate::chart::{Figure, Table, fields, prepared, stopper};
use metachron_console::exit::Exit;
use metachron_console::files::write_file;
use metachron_console::output::{data, message};
use metachron_console::progress::Bar;
use serde::Serialize;
use serde_json::{Map, Value};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Something that can be measured.
pub(super) trait Subject {
    /// One line of the CSV file; a pair of fields that end in `_p50` and `_p99` is one field of two in JSON.
    type Row: Serialize + 'static;
    /// Its name on the command line; the files are called after it.
    const NAME: &'static str;

    /// The table that is printed of the rows.
    const TABLE: fn(&[Self::Row]) -> Table;

    /// Measures the requested cases one by one while `progress` says to go on; returns the finished rows.
    fn measure(args: &BenchArgs, progress: &Progress) -> anyhow::Result<Vec<Self::Row>>;

    /// The picture of the rows.
    fn figure(rows: &[Self::Row]) -> Figure;
}

/// Follows a benchmark: receives its progress and says whether to go on.
pub(super) struct Progress {
    bar: Bar,
    stopped: Arc<AtomicBool>,
}

impl Progress {
    /// Reports a case that is about to be measured: the share that is done, and its description. `false`: measure no more.
    pub(super) fn continues(&self, done: f64, words: String) -> bool {
        self.bar.set(done, words);
        !self.stopped.load(Ordering::Relaxed)
    }

    /// Measures cases one by one, each reported with its description, while they go on.
    pub(super) fn rows<C, R>(
        &self,
        cases: Vec<C>,
        words: impl Fn(&C) -> String,
        mut measure: impl FnMut(C) -> anyhow::Result<R>,
    ) -> anyhow::Result<Vec<R>> {
        let total = cases.len() as f64;
        let continues = |(at, case): &(usize, C)| self.continues(*at as f64 / total, words(case));
        cases.into_iter().enumerate().take_while(continues).map(|(_, case)| measure(case)).collect()
    }
}

/// Measures a subject, writes its files and prints its rows.
pub(super) fn run<S: Subject>(args: &BenchArgs) -> anyhow::Result<Exit> {
    let stopped = stopper()?;
    let folder = prepared(&args.out)?;
    let progress = Progress { bar: Bar::new(S::NAME, args.quiet), stopped: Arc::clone(&stopped) };
    let rows = S::measure(args, &progress)?;
    drop(progress);
    let interrupted = stopped.load(Ordering::Relaxed);
    if interrupted && rows.is_empty() {
        message("interrupted before a row was finished: nothing was written");
        return Ok(Exit::Interrupted);
    }
    write::<S>(folder, &rows)?;
    if args.json {
        data(&format!("{}\n", json::<S>(&rows)?))?;
    } else if !args.quiet {
        data(&(S::TABLE)(&rows).text())?;
    }
    if interrupted {
        message("interrupted: the finished rows are written");
    }
    Ok(if interrupted { Exit::Interrupted } else { Exit::Ok })
}

/// Writes the files of `rows`.
pub(super) fn write<S: Subject>(folder: &Path, rows: &[S::Row]) -> anyhow::Result<()> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    rows.iter().try_for_each(|row| csv.serialize(row))?;
    for (kind, bytes) in [("csv", csv.into_inner()?), ("json", json::<S>(rows)?.into_bytes())] {
        let path = folder.join(format!("{}.{kind}", S::NAME));
        write_file(&path, bytes)?;
    }
    figure::write(folder, S::NAME, &S::figure(rows)).map(drop)
}

fn json<S: Subject>(rows: &[S::Row]) -> anyhow::Result<String> {
    let rows: Vec<_> = rows.iter().map(|row| paired(fields(row))).collect();
    Ok(serde_json::to_string_pretty(&serde_json::json!({ "bench": S::NAME, "rows": rows }))?)
}

/// The fields of a row with each pair of percentiles under one name.
fn paired(mut fields: Map<String, Value>) -> Map<String, Value> {
    let names: Vec<String> = fields.keys().filter_map(|key| Some(key.strip_suffix("_p50")?.to_owned())).collect();
    for name in names {
        let mut part = |end: &str| fields.remove(&format!("{name}_{end}"));
        let pair = serde_json::json!({ "p50": part("p50"), "p99": part("p99") });
        fields.insert(name, pair);
    }
    fields
}
