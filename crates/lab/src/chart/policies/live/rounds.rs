//! The rounds of a scene as one: medians, their spread, and whether the default is the best of the policies.
//!
//! In: the rows of one scene, round by round. Out: a table of policies, findings. Never here: how a row is measured.

use crate::chart::policies::numeric::{Row, error_over_allowed, predicts, within};
use crate::chart::{Finding, Table, table};
use metachron_lod::control::Policy;

/// A number of a policy over the rounds.
#[derive(Debug, Clone, Copy, PartialEq)]
struct OverRounds {
    median: f64,
    /// Half of the range: a difference of medians up to this has no cause.
    spread: f64,
}

impl OverRounds {
    /// Over the rounds that know the number; NaN for none.
    fn of(rows: &[Row], policy: &str, what: fn(&Row) -> f64) -> Self {
        let known: Vec<_> = rows.iter().filter(|row| row.policy == policy).map(what).filter(|x| !x.is_nan()).collect();
        Self { median: within(&known, 0.5), spread: 0.5 * (within(&known, 1.0) - within(&known, 0.0)) }
    }

    fn above(self, other: Self) -> Difference {
        Difference { by: self.median - other.median, spread: self.spread.max(other.spread) }
    }

    /// Whether it is more than chance; `false` where one is not known.
    fn is_above(self, other: Self) -> bool {
        let Difference { by, spread } = self.above(other);
        by > spread
    }
}

/// The median of a policy's rounds; NaN for none.
pub(super) fn median_of(rows: &[Row], policy: &str, what: fn(&Row) -> f64) -> f64 {
    OverRounds::of(rows, policy, what).median
}

/// By how much a median is above another, and how much of that is chance.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Difference {
    by: f64,
    spread: f64,
}

/// The numbers of a policy that are compared.
struct Numbers {
    late: OverRounds,
    value: OverRounds,
}

impl Numbers {
    fn of(rows: &[Row], policy: &str) -> Self {
        Self {
            late: OverRounds::of(rows, policy, |row| row.misses),
            value: OverRounds::of(rows, policy, |row| row.value_over_bound),
        }
    }
}

/// Error of 19 of 20 predictions over the allowed one.
fn error(row: &Row) -> f64 {
    error_over_allowed(row.model_error95, row.spread95)
}

/// Whether the default has the fewest late frames of the policies of as high a value, the highest value of the policies with as few late
/// frames, and predicts its frames.
///
/// A difference counts where it is greater than the spread over the rounds of both; in a single round there is none. A policy whose value is
/// not known competes by its late frames alone.
pub(super) fn verdict(scene: &str, rows: &[Row]) -> Vec<Finding> {
    let own = Numbers::of(rows, "adaptive");
    let others = Policy::ALL.iter().map(|policy| policy.name()).filter(|name| !["full", "adaptive"].contains(name));
    let others: Vec<_> =
        others.map(|name| Numbers::of(rows, name)).filter(|other| !other.late.median.is_nan()).collect();
    let claim = |words: &str| format!("adaptive, {scene}: {words}");
    vec![
        worst_of(
            claim("share of late frames above the fewest of policies of as high a value"),
            others.iter().filter(|other| !own.value.is_above(other.value)).map(|other| own.late.above(other.late)),
            others.is_empty(),
        ),
        worst_of(
            claim("value over its bound below the highest of policies as few frames of which are late"),
            others.iter().filter(|other| !other.late.is_above(own.late)).map(|other| other.value.above(own.value)),
            others.is_empty(),
        ),
        predicts(scene, median_of(rows, "adaptive", error)),
    ]
}

/// The difference that exceeds its limit by most; NaN for nothing to compare with, and 0 where nothing competes.
fn worst_of(claim: String, differences: impl Iterator<Item = Difference>, none: bool) -> Finding {
    let known = differences.filter(|one| !one.by.is_nan());
    let worst = known.max_by(|a, b| (a.by - a.spread).total_cmp(&(b.by - b.spread)));
    let Difference { by, spread } = worst.unwrap_or(Difference { by: if none { f64::NAN } else { 0.0 }, spread: 0.0 });
    Finding::at_most(claim, by, spread)
}

/// One line for each policy: medians over the rounds, and half of the range of its late frames.
pub(super) fn summary(rows: &[Row]) -> Table {
    let policies = Policy::ALL.into_iter().map(Policy::name);
    let played = policies.map(|policy| (policy, rows.iter().filter(|row| row.policy == policy).collect::<Vec<_>>()));
    let played = played.filter(|(_, rounds)| !rounds.is_empty());
    let median = |policy: &str, what: fn(&Row) -> f64| median_of(rows, policy, what);
    let late = |policy: &str| OverRounds::of(rows, policy, |row| row.misses);
    table!(played, |(policy, rounds)| scene: rounds[0].setting, policy: policy, rounds: rounds.len(),
        T_ms(2): median(policy, |row| row.target_ms), frames: median(policy, |row| row.frames as f64),
        mean(3): median(policy, |row| row.mean), p95(3): median(policy, |row| row.p95),
        max(2): median(policy, |row| row.max), "late_%"(1): 100.0 * late(policy).median,
        "spread_%"(1): 100.0 * late(policy).spread, value(4): median(policy, |row| row.value_over_bound),
        error95(3): median(policy, |row| row.model_error95), spread95(3): median(policy, |row| row.spread95),
        error(2): median(policy, error), reversals(5): median(policy, |row| row.reversals),
        triangles: median(policy, |row| row.polygons), ssim(4): median(policy, |row| row.ssim),
        ssim_least(4): median(policy, |row| row.ssim_least), flip(4): median(policy, |row| row.flip),
        holes(4): median(policy, |row| row.holes))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounds of a policy with these shares of late frames.
    fn rounds(policy: &str, late: [f64; 3], value: f64) -> Vec<Row> {
        let row = |(round, misses): (usize, f64)| Row {
            round,
            misses,
            value_over_bound: value,
            model_error95: 0.3,
            spread95: 0.2,
            ..Row::of("grove", policy, &[])
        };
        late.into_iter().enumerate().map(row).collect()
    }

    fn holds(rows: &[Vec<Row>]) -> Vec<Option<bool>> {
        verdict("grove", &rows.concat()).iter().map(|finding| finding.holds).collect()
    }

    #[test]
    fn no_policy_may_have_fewer_late_frames_at_as_high_a_value_or_a_higher_value_with_as_few() {
        let own = || rounds("adaptive", [0.01, 0.02, 0.03], 0.99);
        // 0.3 is more than 1.2 times 0.2
        assert_eq!(holds(&[own()]), [Some(false), Some(false), Some(false)], "nothing was compared");
        let late = rounds("greedy", [0.20, 0.30, 0.31], 1.0);
        assert_eq!(holds(&[own(), late])[..2], [Some(true), Some(true)]);
        let idle = rounds("static", [0.0, 0.0, 0.0], 0.6);
        assert_eq!(holds(&[own(), idle])[..2], [Some(true), Some(true)]);
        let alike = rounds("convex", [0.03, 0.02, 0.02], 0.995);
        assert_eq!(holds(&[own(), alike])[..2], [Some(true), Some(false)]);
        let fewer = rounds("threshold", [0.0, 0.0, 0.0], f64::NAN);
        assert_eq!(holds(&[own(), fewer])[..2], [Some(false), Some(true)], "two hundredths, with a spread of one");
    }

    #[test]
    fn summary_has_a_line_for_each_policy() {
        let table = summary(&[rounds("adaptive", [0.0, 0.1, 0.02], 1.0), rounds("static", [0.0; 3], 0.5)].concat());
        assert_eq!(table.rows.len(), 2);
        assert!(summary(&[]).rows.is_empty());
    }
}
