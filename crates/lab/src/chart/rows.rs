//! The CSV file of an experiment, which grows row by row and can be continued after an interruption.
//!
//! In: rows as they come. Out: a file that contains every finished row at any moment, in the order of the cases once it is
//! complete. While rows are missing, a mark file next to it holds the settings of the run. Never here: what a row means.

use super::experiment::{CaseOf, Experiment, Record};
use anyhow::Context;
use metachron_console::files::write_file;
use std::fs::{self, File, OpenOptions};
use std::path::{Path, PathBuf};

/// The file while its experiment runs.
pub(super) struct RowFile {
    path: PathBuf,
    mark: PathBuf,
    out: csv::Writer<File>,
}

impl RowFile {
    /// Opens the file of `E` in `folder` and returns the rows that an interrupted run of the same settings left there.
    ///
    /// # Errors
    /// Errors of the file system.
    pub(super) fn open<E: Experiment>(
        folder: &Path,
        stem: &str,
        settings: &str,
        cases: &[CaseOf<E>],
    ) -> anyhow::Result<(Self, Vec<E::Row>)> {
        let (path, mark) = (folder.join(format!("{stem}.csv")), folder.join(format!("{stem}.unfinished")));
        let same = fs::read_to_string(&mark).is_ok_and(|text| text == settings);
        let kept = if same { read::<E>(&path, cases) } else { Vec::new() };
        replace::<E>(&path, &kept)?;
        let file = OpenOptions::new().append(true).open(&path);
        let file = file.with_context(|| format!("{} cannot be written", path.display()))?;
        // the column names are written with the first row
        let out = csv::WriterBuilder::new().has_headers(kept.is_empty()).from_writer(file);
        write_file(&mark, settings)?;
        Ok((Self { path, mark, out }, kept))
    }

    /// Adds a row; it is on file when this returns.
    ///
    /// # Errors
    /// Errors of the file system.
    pub(super) fn add<E: Experiment>(&mut self, row: &E::Row) -> anyhow::Result<()> {
        let written = self.out.serialize(row).map_err(anyhow::Error::from).and_then(|()| Ok(self.out.flush()?));
        written.with_context(|| format!("{} cannot be written", self.path.display()))
    }

    /// Completes the file: writes all rows again, in order, and removes the mark.
    ///
    /// # Errors
    /// Errors of the file system.
    pub(super) fn finish<E: Experiment>(self, rows: &[E::Row]) -> anyhow::Result<()> {
        drop(self.out);
        replace::<E>(&self.path, rows)?;
        fs::remove_file(&self.mark).with_context(|| format!("{} cannot be removed", self.mark.display()))
    }
}

/// Writes rows in place of those that are there: at no moment are finished rows missing.
fn replace<E: Experiment>(path: &Path, rows: &[E::Row]) -> anyhow::Result<()> {
    let mut out = csv::Writer::from_writer(Vec::new());
    rows.iter().try_for_each(|row| out.serialize(row))?;
    write_file(path, out.into_inner()?)
}

/// The rows of a file that belong to these cases, one per case; a last line that was cut off is skipped.
fn read<E: Experiment>(path: &Path, cases: &[CaseOf<E>]) -> Vec<E::Row> {
    let Ok(mut file) = csv::Reader::from_path(path) else { return Vec::new() };
    let Ok(names) = file.headers().cloned() else { return Vec::new() };
    let mut seen: Vec<CaseOf<E>> = Vec::new();
    let mut rows = Vec::new();
    for row in file.records().flatten().filter_map(|line| E::Row::read(&names, &line).ok()) {
        let case = row.case();
        if cases.contains(&case) && !seen.contains(&case) {
            seen.push(case);
            rows.push(row);
        }
    }
    rows
}
