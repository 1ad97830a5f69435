//! A whole tuning: every family is searched, from the laws that it is compared with.
//!
//! In: a plant, a target, a search of one family. Out: a row for every law, and the best of them. The laws for comparison are points that
//! the searches start from, so that none of them is better than the result. Never here: the search itself, names,
//! files.

use super::relay::relay_gains;
use super::search::{Family, SearchResult};
use super::trials::Verdict;
use crate::control::Law;
use crate::tune::loops::candidate::Candidate;
use crate::tune::loops::plant::Plant;

/// The gain of the normalised law, α = k/f₀: the same loop gain at any rate.
pub const NORMALISED: f64 = 0.046;

/// Where the gains of a row come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// Found, in this family.
    Found(Family),
    /// The corrected law with its own gains.
    Default,
    /// The gains of (GDC04).
    Printed,
    /// The printed law with α = k/f₀.
    Normalised,
    /// A relay's, with the margin of the corrected law found.
    Relay,
}

/// A law, and where its gains come from.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Where its gains come from.
    pub origin: Origin,
    /// How it was judged.
    pub verdict: Verdict,
}

/// The result of a tuning.
#[derive(Debug, Clone, PartialEq)]
pub struct Tuning {
    /// The find of every family searched, then the laws for comparison.
    pub rows: Vec<Row>,
    /// The searches, in their order.
    pub found: Vec<(Family, SearchResult)>,
    /// The best feedback law of all rows ([`Verdict::compare`]). The policy that predicts has no gains to give.
    pub best: Verdict,
    /// The law of `best`.
    pub law: Law,
    /// Whether a search was stopped before its end.
    pub interrupted: bool,
}

impl Tuning {
    /// The verdict on the policy that predicts, where it is better than the gains.
    #[must_use]
    pub fn better_policy(&self) -> Option<&Verdict> {
        let adaptive = |row: &&Row| matches!(row.verdict.candidate, Candidate::Adaptive { .. });
        self.rows.iter().find(adaptive).map(|row| &row.verdict).filter(|verdict| verdict.compare(&self.best).is_lt())
    }
}

/// Searches every family by `search`, which judges the laws given to it first; `None` if no feedback law was judged. After a search that was
/// stopped no other begins.
#[must_use]
pub fn tune(
    plant: &Plant,
    target_hz: f64,
    mut search: impl FnMut(Family, &[Candidate]) -> Option<SearchResult>,
) -> Option<Tuning> {
    let mut found: Vec<(Family, SearchResult)> = Vec::new();
    let mut compared: Vec<Row> = Vec::new();
    for family in Family::ALL {
        let references = references(plant, target_hz, family, &found);
        let inherited = found.first().filter(|_| family == Family::Pi).map(|(_, corrected)| corrected.best.candidate);
        let starts: Vec<_> = references.iter().map(|(_, candidate)| *candidate).chain(inherited).collect();
        let Some(result) = search(family, &starts) else { break };
        let judged = references.iter().zip(&result.starts);
        compared.extend(judged.map(|((origin, _), verdict)| Row { origin: *origin, verdict: verdict.clone() }));
        let interrupted = result.interrupted;
        found.push((family, result));
        if interrupted {
            break;
        }
    }
    let own = found.iter().map(|(family, f)| Row { origin: Origin::Found(*family), verdict: f.best.clone() });
    let rows: Vec<_> = own.chain(compared).collect();
    let laws = rows.iter().filter_map(|row| match row.verdict.candidate {
        Candidate::Feedback(law) => Some((law, &row.verdict)),
        Candidate::Adaptive { .. } => None,
    });
    let (law, best) = laws.min_by(|a, b| a.1.compare(b.1)).map(|(law, verdict)| (law, verdict.clone()))?;
    let interrupted = found.len() < Family::ALL.len() || found.iter().any(|(_, f)| f.interrupted);
    Some(Tuning { rows, found, best, law, interrupted })
}

/// The laws that `family` is compared with, after the earlier finds.
fn references(
    plant: &Plant,
    target_hz: f64,
    family: Family,
    found: &[(Family, SearchResult)],
) -> Vec<(Origin, Candidate)> {
    match family {
        Family::Corrected => vec![(Origin::Default, Law::CORRECTED.into())],
        Family::Pi => {
            let relay = found.first().and_then(|(_, corrected)| {
                let margin = 1.0 - corrected.best.candidate.set_share();
                relay_gains(&plant.on(corrected.best.at_speed), target_hz, margin)
            });
            relay.map(|law| (Origin::Relay, law.into())).into_iter().collect()
        }
        Family::Printed => {
            let normalised = Law::Printed { alpha: NORMALISED / target_hz, beta: 5.0 };
            vec![(Origin::Printed, Law::PRINTED.into()), (Origin::Normalised, normalised.into())]
        }
        Family::Adaptive => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::search::{Search, search};
    use super::super::trials::{Extent, judge};
    use super::*;
    use crate::tune::loops::plant::tests::{plant_of, tube_alone};

    const EXTENT: Extent = Extent { seeds: 1, millis: 800, threads: None };

    /// The tuning of a tube alone of which a change shows `dead_time` frames late.
    fn tuned(dead_time: usize, fixed_s: f64, target_hz: f64) -> (Plant, Tuning) {
        let plant = Plant { dead_time, ..plant_of(vec![tube_alone()], fixed_s, 1e-6) };
        let one = |family: Family, starts: &[Candidate]| {
            let mut go_on = |_: f64, _: &Verdict| true;
            let mut judge = |candidate| judge(&plant, candidate, target_hz, EXTENT);
            search(&mut Search { judge: &mut judge, go_on: &mut go_on }, family, starts)
        };
        let tuning = tune(&plant, target_hz, one).unwrap();
        (plant, tuning)
    }

    #[test]
    fn no_law_of_the_table_is_better_than_the_gains_given_and_none_lacks_less() {
        // early, late, and a frame of which a tenth goes with polygons: there a relay's gains bettered a grid's alone
        for (dead_time, fixed_s, target_hz) in [(0, 5e-3, 30.0), (2, 5e-3, 30.0), (0, 15e-3, 58.0)] {
            let (plant, tuning) = tuned(dead_time, fixed_s, target_hz);
            assert!(tuning.best.is_safe() && !tuning.interrupted, "{:?}", tuning.best);
            for row in &tuning.rows {
                let law = matches!(row.verdict.candidate, Candidate::Feedback(_));
                assert!(!law || tuning.best.compare(&row.verdict).is_le(), "{row:?} and {:?}", tuning.best);
                // a row has the worth of its law, not the search's estimate of it
                assert_eq!(judge(&plant, row.verdict.candidate, target_hz, EXTENT), row.verdict);
            }
            let compared = tuning.rows.iter().filter(|row| !matches!(row.origin, Origin::Found(_))).count();
            assert_eq!(compared, 4, "{:?}", tuning.rows);
        }
    }

    #[test]
    fn margins_are_constraints_and_where_nothing_keeps_them_the_least_lack_is_given() {
        let plant = plant_of(vec![tube_alone()], 5e-3, 1e-6);
        let judged = judge(&plant, Law::CORRECTED, 30.0, EXTENT);
        let verdict = |shortfall: f64, objective: f64| Verdict { shortfall, objective, ..judged.clone() };
        let order = [verdict(0.0, 0.2), verdict(0.0, 5.0), verdict(0.01, 0.1), verdict(0.01, 0.3), verdict(1.0, 0.0)];
        for pair in order.windows(2) {
            assert!(pair[0].compare(&pair[1]).is_lt() && pair[0].rank() < pair[1].rank(), "{pair:?}");
        }
        assert!(order[1].is_safe() && !order[2].is_safe());
        // a filter without noise corrects nearly all of an error at once: no margin of this policy bears two frames of delay
        let mut go_on = |_: f64, _: &Verdict| true;
        let mut judged = |candidate| judge(&plant, candidate, 30.0, EXTENT);
        let least = search(&mut Search { judge: &mut judged, go_on: &mut go_on }, Family::Adaptive, &[]).unwrap().best;
        assert!(!least.is_safe(), "{least:?}");
        for margin in [0.01, 0.05, 0.1, 0.2, 0.4] {
            let other = judge(&plant, Candidate::Adaptive { margin }, 30.0, EXTENT);
            assert!(least.shortfall <= other.shortfall, "{least:?} and {other:?}");
        }
    }
}
