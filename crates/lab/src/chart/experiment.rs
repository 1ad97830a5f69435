//! The form of an experiment: cases that are data, and a function from a case to a row.
//!
//! In: whether to be quick. Out: cases, rows, a figure, a table, findings. Never here: files, threads, drawing.

use super::figure::Figure;
use super::table::Table;
use csv::StringRecord;
use metachron_render::PictureFile;
use serde::de::DeserializeOwned;
use serde::{Serialize, Serializer};
use std::ops::Deref;

/// One measurement, made for many cases.
pub trait Experiment: Sync {
    /// A case with its measurements: [`Measured`], where the fields of a case are the first columns.
    type Row: Record + 'static;

    /// The name that `--only` takes; the files are called after it.
    const NAME: &'static str;
    /// One sentence that says what the experiment shows.
    const TITLE: &'static str;

    /// The columns of the table that is printed, as [`Table::of`] takes them; none where a line is no row.
    const COLUMNS: &'static str = "";

    /// Whether cases are measured one at a time, because they measure the time of this machine.
    const ALONE: bool = false;

    /// The cases in the order of the rows; `quick`: a small part of them, or shorter runs.
    fn cases(quick: bool) -> Vec<CaseOf<Self>>;

    /// Measures one case. The same case gives the same row, whenever and on whichever thread, except for times of this machine.
    fn measure(case: &CaseOf<Self>) -> Self::Row;

    /// The picture of the rows so far.
    fn figure(rows: &[Self::Row]) -> Figure;

    /// Further pictures, each with the ending of its file's name.
    ///
    /// # Errors
    /// A picture that cannot be drawn.
    fn pictures(_: &[Self::Row]) -> anyhow::Result<Vec<(String, PictureFile)>> {
        Ok(Vec::new())
    }

    /// The table that is printed.
    fn table(rows: &[Self::Row]) -> Table {
        Table::of(rows, Self::COLUMNS)
    }

    /// The claims and their measured values.
    fn findings(rows: &[Self::Row]) -> Vec<Finding>;
}

/// The case that an experiment measures once.
pub type CaseOf<E> = <<E as Experiment>::Row as Record>::Case;

/// A line of the CSV file of an experiment.
pub trait Record: Serialize + Clone + Send + Sync {
    /// Identifies a row: rows of the same case are the same measurement.
    type Case: PartialEq + Sync;

    /// The case that was measured.
    fn case(&self) -> Self::Case;

    /// The same from a line of the file.
    ///
    /// # Errors
    /// A line without a column, or with a value of another kind.
    fn read(names: &StringRecord, line: &StringRecord) -> csv::Result<Self>;
}

/// A case and its measurements; the fields of both are the columns of the CSV file.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured<C, M> {
    /// The case.
    pub case: C,
    /// Its measurements.
    pub found: M,
}

impl<C, M> Deref for Measured<C, M> {
    type Target = M;

    fn deref(&self) -> &M {
        &self.found
    }
}

impl<C: Serialize, M: Serialize> Serialize for Measured<C, M> {
    fn serialize<S: Serializer>(&self, out: S) -> Result<S::Ok, S::Error> {
        (&self.case, &self.found).serialize(out)
    }
}

impl<C, M> Record for Measured<C, M>
where
    C: Serialize + DeserializeOwned + Clone + PartialEq + Send + Sync,
    M: Serialize + DeserializeOwned + Clone + Send + Sync,
{
    type Case = C;

    fn case(&self) -> C {
        self.case.clone()
    }

    fn read(names: &StringRecord, line: &StringRecord) -> csv::Result<Self> {
        Ok(Self { case: line.deserialize(Some(names))?, found: line.deserialize(Some(names))? })
    }
}

/// A claim compared with the rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// The claim, as a sentence with its limit.
    pub(super) claim: String,
    /// The measured value.
    pub(super) measured: f64,
    /// The limit.
    pub(super) limit: f64,
    /// Whether the claim holds; `None` where the rows that it needs were not measured.
    pub(super) holds: Option<bool>,
}

impl Finding {
    /// Holds where `measured` is at most `limit`; does not hold for NaN.
    pub fn at_most(claim: impl Into<String>, measured: f64, limit: f64) -> Self {
        Self { claim: claim.into(), measured, limit, holds: Some(measured <= limit) }
    }

    /// Claims with what was measured and what it is at most.
    pub fn all_at_most<const N: usize>(claims: [(&str, f64, f64); N]) -> Vec<Self> {
        claims.into_iter().map(|(claim, measured, limit)| Self::at_most(claim, measured, limit)).collect()
    }

    /// Holds where `measured` is at least `limit`; does not hold for NaN.
    pub fn at_least(claim: impl Into<String>, measured: f64, limit: f64) -> Self {
        Self { claim: claim.into(), measured, limit, holds: Some(measured >= limit) }
    }

    /// The same for an incomplete set of `rows` rows: a claim that needs missing rows neither holds nor fails.
    pub(super) fn unfinished(self, rows: usize) -> Self {
        let measured = rows > 0 && !self.measured.is_nan();
        Self { holds: self.holds.filter(|_| measured), ..self }
    }
}

/// The greatest of some numbers; NaN where one of them is, or where there are none.
pub fn worst(numbers: impl IntoIterator<Item = f64>) -> f64 {
    let greater = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) };
    numbers.into_iter().reduce(greater).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_fulfils_no_claim() {
        assert!(worst([1.0, f64::NAN, 2.0]).is_nan() && worst([]).is_nan());
        let bounded = |numbers: [f64; 2]| Finding::at_most("bounded", worst(numbers), 2.0).holds;
        assert_eq!((bounded([1.0, f64::NAN]), bounded([1.0, 2.0])), (Some(false), Some(true)));
    }

    #[test]
    fn a_claim_whose_rows_are_missing_neither_holds_nor_fails() {
        let after = |rows: usize, measured: f64| Finding::at_most("bounded", measured, 2.0).unfinished(rows).holds;
        assert_eq!((after(0, 0.0), after(3, f64::NAN)), (None, None));
        assert_eq!((after(3, 1.0), after(3, 3.0)), (Some(true), Some(false)));
    }
}
