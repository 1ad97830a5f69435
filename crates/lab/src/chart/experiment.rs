//! The form of an experiment: cases that are data, and a function from a case to a row.
//!
//! In: whether to be quick. Out: cases, rows, a figure, a table, findings. Never here: files, threads, drawing.

use super::blank::blank;
use super::figure::Figure;
use super::table::Table;
use metachron_render::PictureFile;
use serde::de::DeserializeOwned;
use serde::{Serialize, Serializer};
use std::ops::Deref;

/// One measurement, made for many cases.
pub trait Experiment: Sync {
    /// A case with its measurements: [`Measured`], where the fields of a case are the first columns.
    type Row: Record;

    /// The name that `--only` takes; the files are called after it.
    const NAME: &'static str;
    /// One sentence that says what the experiment shows.
    const TITLE: &'static str;

    /// The table that is printed of the rows.
    const TABLE: fn(&[Self::Row]) -> Table;

    /// Whether cases are measured one at a time, because they measure the time of this machine.
    const ALONE: bool = false;

    /// The columns of the table whose numbers are times of this machine; all others are the same on every run.
    const LIVE: LiveColumns = if Self::ALONE { LiveColumns::All } else { LiveColumns::These(&[]) };

    /// The cases in the order of the rows; `quick`: a small part of them, or shorter runs.
    fn cases(quick: bool) -> Vec<CaseOf<Self>>;

    /// Measures one case; `None` where that fails, and the row is [`blank`]. The same case gives the same row, whenever and on
    /// whichever thread, except for times of this machine.
    fn measure(case: &CaseOf<Self>) -> Option<<Self::Row as Record>::Found>;

    /// The row of one case, measured now.
    fn row(case: &CaseOf<Self>) -> Self::Row {
        Self::Row::of(case, Self::measure(case).unwrap_or_else(blank))
    }

    /// The picture of the rows so far.
    fn figure(rows: &[Self::Row]) -> Figure;

    /// Further pictures, each with the ending of its file's name.
    ///
    /// # Errors
    /// A picture that cannot be drawn.
    fn pictures(_: &[Self::Row]) -> anyhow::Result<Vec<(String, PictureFile)>> {
        Ok(Vec::new())
    }

    /// The claims and their measured values.
    fn findings(rows: &[Self::Row]) -> Vec<Finding>;
}

/// Columns of a table that no two runs print alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LiveColumns {
    /// Every column, the claims and the figure.
    All,
    /// These, the claims and the figure, or nothing at all where none is named.
    These(&'static [&'static str]),
}

impl LiveColumns {
    /// Whether a column is one of them.
    pub(crate) fn has(self, column: &str) -> bool {
        match self {
            Self::All => true,
            Self::These(columns) => columns.contains(&column),
        }
    }

    /// Whether there is one, which claims and figure then show too.
    pub(crate) const fn are_some(self) -> bool {
        !matches!(self, Self::These([]))
    }
}

/// The case that an experiment measures once.
pub type CaseOf<E> = <<E as Experiment>::Row as Record>::Case;

/// A line of the CSV file of an experiment: a column for each column of its case, and more.
pub trait Record: Serialize + Send + Sync + 'static {
    /// The quantity measured; rows of cases that are written alike are the same measurement.
    type Case: Serialize + Sync;
    /// The values of a line.
    type Found: DeserializeOwned;

    /// The line of a case.
    fn of(case: &Self::Case, found: Self::Found) -> Self;
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
    C: Serialize + Clone + Send + Sync + 'static,
    M: Serialize + DeserializeOwned + Send + Sync + 'static,
{
    type Case = C;
    type Found = M;

    fn of(case: &C, found: M) -> Self {
        Self { case: case.clone(), found }
    }
}

/// A choice of some, which is written as its name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Named<T>(pub &'static str, pub T);

impl<T> Serialize for Named<T> {
    fn serialize<S: Serializer>(&self, out: S) -> Result<S::Ok, S::Error> {
        out.serialize_str(self.0)
    }
}

/// A list with an entry for every combination of some lists: `each!(scene in SCENES, &ratio in RATIOS => Case { scene, ratio })` has all ratios
/// of the first scene before those of the second. A list may depend on entries of those before it.
macro_rules! each {
    (@ $all:ident, $entry:expr) => { $all.push($entry) };
    (@ $all:ident, $entry:expr, $one:pat in $list:expr $(, $more:pat in $lists:expr)*) => {
        for $one in $list {
            $crate::chart::each!(@ $all, $entry $(, $more in $lists)*);
        }
    };
    ($($one:pat in $list:expr),+ => $entry:expr) => {{
        let mut all = Vec::new();
        $crate::chart::each!(@ all, $entry, $($one in $list),+);
        all
    }};
}

/// Claims, each with its measured value and its limit: `claims!["energy made, J" => made_j, at_most 0.1; …]`; names in braces are filled in.
macro_rules! claims {
    [$($claim:literal => $measured:expr, $relation:ident $limit:expr);* $(;)?] => {
        vec![$($crate::chart::Finding::$relation(format!($claim), $measured, $limit)),*]
    };
}

pub(crate) use {claims, each};

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

/// The number of the first row of some; NaN where there is none.
pub fn number_of<R>(rows: &[R], which: impl Fn(&R) -> bool, number: impl Fn(&R) -> f64) -> f64 {
    rows.iter().find(|row| which(row)).map_or(f64::NAN, number)
}

/// The greatest number of some rows; NaN where one of them is, or where there are none.
pub fn worst_of<R>(rows: &[R], which: impl Fn(&R) -> bool, number: impl Fn(&R) -> f64) -> f64 {
    worst(rows.iter().filter(|row| which(row)).map(number))
}

/// The distinct names of some, in their order.
pub fn distinct<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let mut list: Vec<&str> = Vec::new();
    for name in names {
        if !list.contains(&name) {
            list.push(name);
        }
    }
    list
}

/// How many rows are such.
pub fn count_of<R>(rows: &[R], which: impl Fn(&R) -> bool) -> f64 {
    rows.iter().filter(|row| which(row)).count() as f64
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
