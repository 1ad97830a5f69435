//! The CSV file of an experiment, which grows row by row and can be continued after an interruption.
//!
//! In: rows as they come. Out: a file that contains every finished row at any moment, in the order of the cases once it is
//! complete. While rows are missing, a mark file next to it holds the settings of the run. Never here: what a row means.

use super::experiment::{CaseOf, Experiment, Record};
use anyhow::Context;
use metachron_console::files::write_file;
use serde::Serialize;
use std::fs::{self, File, OpenOptions};
use std::path::{Path, PathBuf};

/// The file while its experiment runs.
pub(super) struct RowFile {
    path: PathBuf,
    mark: PathBuf,
    out: csv::Writer<File>,
}

impl RowFile {
    /// Opens the file of `E` in `folder`, with the rows that an interrupted run of the same settings left there, each at the place of its case.
    ///
    /// # Errors
    /// Errors of the file system.
    pub(super) fn open<E: Experiment>(
        folder: &Path,
        stem: &str,
        settings: &str,
        cases: &[CaseOf<E>],
    ) -> anyhow::Result<(Self, Vec<Option<E::Row>>)> {
        let (path, mark) = (folder.join(format!("{stem}.csv")), folder.join(format!("{stem}.unfinished")));
        let same = fs::read_to_string(&mark).is_ok_and(|text| text == settings);
        let mut kept: Vec<Option<E::Row>> = cases.iter().map(|_| None).collect();
        if same {
            // a file that cannot be read is measured again
            let _ = read::<E>(&path, cases, &mut kept);
        }
        replace(&path, kept.iter().flatten())?;
        let file = OpenOptions::new().append(true).open(&path);
        let file = file.with_context(|| format!("{} cannot be written", path.display()))?;
        // the column names are written with the first row
        let out = csv::WriterBuilder::new().has_headers(kept.iter().all(Option::is_none)).from_writer(file);
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
        replace(&self.path, rows)?;
        fs::remove_file(&self.mark).with_context(|| format!("{} cannot be removed", self.mark.display()))
    }
}

/// Writes rows in place of those that are there: at no moment are finished rows missing.
fn replace<R: Serialize>(path: &Path, rows: impl IntoIterator<Item = R>) -> anyhow::Result<()> {
    let mut out = csv::Writer::from_writer(Vec::new());
    rows.into_iter().try_for_each(|row| out.serialize(row))?;
    write_file(path, out.into_inner()?)
}

/// Reads the rows of a file to the places of their cases; a last line that was cut off is skipped.
fn read<E: Experiment>(path: &Path, cases: &[CaseOf<E>], rows: &mut [Option<E::Row>]) -> anyhow::Result<()> {
    let mut file = csv::Reader::from_path(path)?;
    let names = file.headers()?.clone();
    let cases_as_written = cases.iter().map(columns).collect::<anyhow::Result<Vec<_>>>()?;
    for line in file.records().flatten() {
        let holds = |(name, value): &(String, String)| names.iter().zip(&line).any(|at| at == (name, value));
        let case = cases_as_written.iter().position(|columns| columns.iter().all(holds));
        if let Some((k, found)) = case.zip(line.deserialize(Some(&names)).ok()) {
            rows[k] = Some(E::Row::of(&cases[k], found));
        }
    }
    Ok(())
}

/// The columns of a case, with their names.
fn columns(case: &impl Serialize) -> anyhow::Result<Vec<(String, String)>> {
    let mut out = csv::Writer::from_writer(Vec::new());
    out.serialize(case)?;
    let written = out.into_inner()?;
    let mut written = csv::Reader::from_reader(&written[..]);
    let names = written.headers()?.clone();
    let values = written.records().next().context("a case without columns")??;
    Ok(names.iter().zip(&values).map(|(name, value)| (name.to_owned(), value.to_owned())).collect())
}

#[cfg(test)]
mod tests {
    use super::super::policies::compared::bound::Bound;
    use super::*;

    #[test]
    fn rows_of_the_same_settings_are_found_again_at_the_places_of_their_cases() {
        let (folder, cases) = (tempfile::tempdir().unwrap(), Bound::cases(true));
        let open = |settings| RowFile::open::<Bound>(folder.path(), "bound", settings, &cases).unwrap();
        let row = Bound::row(&cases[3]);
        let (mut file, kept) = open("quick");
        assert!(kept.iter().all(Option::is_none));
        file.add::<Bound>(&row).unwrap();
        drop(file);
        // a line that was cut off
        let mut text = fs::read_to_string(folder.path().join("bound.csv")).unwrap();
        text.push_str("random,10,8,gre");
        fs::write(folder.path().join("bound.csv"), text).unwrap();
        let kept = open("quick").1;
        let places: Vec<_> = (0..kept.len()).filter(|k| kept[*k].is_some()).collect();
        assert_eq!((places, format!("{:?}", kept[3])), (vec![3], format!("{:?}", Some(row))));
        assert!(open("full").1.iter().all(Option::is_none), "other settings are another measurement");
    }
}
