//! `bench select`: the time to choose a level for every visible object, by policy and number of objects.
//!
//! In: the experiment of `chart policies --only selection`. Out: its rows in the form of a benchmark. Never here: a policy.

use super::super::args::BenchArgs;
use super::subject::{Progress, Subject};
use crate::chart::{Experiment, Figure, Selection, Table};

/// The subject.
pub(super) struct Select;

impl Subject for Select {
    type Row = <Selection as Experiment>::Row;
    const NAME: &'static str = "select";
    const TABLE: fn(&[Self::Row]) -> Table = Selection::TABLE;

    fn measure(args: &BenchArgs, progress: &Progress) -> anyhow::Result<Vec<Self::Row>> {
        progress.rows(Selection::cases(args.quick), |_| String::new(), |case| Ok(Selection::row(&case)))
    }

    fn figure(rows: &[Self::Row]) -> Figure {
        Selection::figure(rows)
    }
}
