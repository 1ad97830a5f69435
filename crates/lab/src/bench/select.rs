//! `bench select`: the time to choose a level for every visible object, by policy and number of objects.
//!
//! In: the experiment of `chart policies --only selection`. Out: its rows in the form of a benchmark. Never here: a policy.

use super::super::args::BenchArgs;
use super::super::chart::figure::Figure;
use super::super::chart::table::Table;
use super::super::chart::{Experiment, Selection};
use super::subject::{Progress, Subject};

/// The subject.
pub(super) struct Select;

impl Subject for Select {
    type Row = <Selection as Experiment>::Row;
    const NAME: &'static str = "select";

    fn measure(args: &BenchArgs, progress: &Progress) -> anyhow::Result<Vec<Self::Row>> {
        let cases = Selection::cases(args.quick);
        let total = cases.len() as f64;
        let wanted =
            cases.iter().enumerate().take_while(|(at, _)| progress.continues(*at as f64 / total, String::new()));
        Ok(wanted.map(|(_, case)| Selection::measure(case)).collect())
    }

    fn table(rows: &[Self::Row]) -> Table {
        Selection::table(rows)
    }

    fn figure(rows: &[Self::Row]) -> Figure {
        Selection::figure(rows)
    }
}
