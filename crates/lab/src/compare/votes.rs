//! Strengths of films from votes between two of them (BT52).
//!
//! In: votes as the page saves them. Out: a strength a film with its interval. Never here: films.
//!
//! A film of strength β is better than one of strength γ with the chance 1/(1 + e^(γ − β)); strengths add up to zero. A vote for neither is
//! half a vote for each. Every pair with votes has half a vote more for each side, so that a film that always won has a finite strength.
//! Intervals are 1.96 standard deviations by the inverse of the information.

use anyhow::Context;
use metachron_console::output::BadInput;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::Path;

/// Newton's steps: a concave sum comes to rest in a few, each at most 1 long.
const STEPS: usize = 100;
/// Standard deviations of an interval in which 19 of 20 lie.
const DEVIATIONS: f64 = 1.96;

/// One vote.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(super) struct Vote {
    left: String,
    right: String,
    better: Better,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Better {
    Left,
    Right,
    Same,
}

/// The strength of a film.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Strength {
    pub film: String,
    /// Votes with it.
    pub votes: u32,
    /// The share in which it was better; a vote for neither is half a one.
    pub better: f64,
    pub strength: f64,
    /// The interval.
    pub low: f64,
    pub high: f64,
}

/// Reads a file of votes: CSV with the columns left, right and better, which is left, right or same.
pub(super) fn read(path: &Path) -> anyhow::Result<Vec<Vote>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
    let rows = csv::Reader::from_reader(text.as_bytes()).into_deserialize().collect::<Result<Vec<Vote>, _>>();
    let expected = "expected columns left, right, better, the last of left, right or same";
    rows.map_err(|why| BadInput(format!("{}: {why}; {expected}", path.display())).into())
}

/// The strengths of all films, by their names.
///
/// # Errors
/// A vote between a film and itself; films that no votes link.
pub(super) fn strengths(votes: &[Vote]) -> Result<Vec<Strength>, String> {
    let names: BTreeSet<&str> = votes.iter().flat_map(|vote| [&*vote.left, &*vote.right]).collect();
    let names: Vec<&str> = names.into_iter().collect();
    let number = |name: &str| names.binary_search(&name).unwrap_or(0);
    let count = names.len();
    let mut wins = vec![vec![0.0; count]; count];
    for vote in votes {
        let (a, b) = (number(&vote.left), number(&vote.right));
        if a == b {
            return Err(format!("a vote has {} on both sides; expected two films", vote.left));
        }
        let left = match vote.better {
            Better::Left => 1.0,
            Better::Right => 0.0,
            Better::Same => 0.5,
        };
        wins[a][b] += left;
        wins[b][a] += 1.0 - left;
    }
    linked(&wins, &names)?;
    let (strengths, covariance) = fitted(&wins);
    let told = (0..count).map(|a| {
        let (won, lost) = (wins[a].iter().sum::<f64>(), wins.iter().map(|row| row[a]).sum::<f64>());
        let half = DEVIATIONS * covariance[a][a].max(0.0).sqrt();
        let [strength, low, high] = [0.0, -half, half].map(|by| strengths[a] + by);
        let votes = (won + lost).round() as u32;
        Strength { film: names[a].to_owned(), votes, better: won / (won + lost), strength, low, high }
    });
    Ok(told.collect())
}

/// Whether votes link all films.
fn linked(wins: &[Vec<f64>], names: &[&str]) -> Result<(), String> {
    let mut known = vec![0];
    let mut at = 0;
    while let Some(&a) = known.get(at).filter(|_| !names.is_empty()) {
        let others = (0..wins.len()).filter(|&b| wins[a][b] + wins[b][a] > 0.0 && !known.contains(&b));
        known.extend(others.collect::<Vec<_>>());
        at += 1;
    }
    match names.iter().enumerate().find(|(b, _)| !known.contains(b)) {
        Some((_, name)) => {
            Err(format!("no votes link {name} to {}; expected votes between them, or by others", names[0]))
        }
        None if names.is_empty() => Err("there are no votes; expected at least one".to_owned()),
        None => Ok(()),
    }
}

/// Strengths of the greatest likelihood and their covariance.
fn fitted(wins: &[Vec<f64>]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let count = wins.len();
    let mut strengths = vec![0.0; count];
    let mut covariance = Vec::new();
    for _ in 0..STEPS {
        let mut slope = vec![0.0; count];
        // the mean of all strengths is free: its direction is filled in, and taken out of the inverse again
        let mut information = vec![vec![1.0 / count as f64; count]; count];
        for (a, b) in (0..count).flat_map(|a| (0..count).map(move |b| (a, b))) {
            if a != b && wins[a][b] + wins[b][a] > 0.0 {
                let all = wins[a][b] + wins[b][a] + 1.0;
                let chance = 1.0 / (1.0 + libm::exp(strengths[b] - strengths[a]));
                slope[a] += wins[a][b] + 0.5 - all * chance;
                information[a][a] += all * chance * (1.0 - chance);
                information[a][b] -= all * chance * (1.0 - chance);
            }
        }
        covariance = inverse(information);
        covariance.iter_mut().flatten().for_each(|entry| *entry -= 1.0 / count as f64);
        for (strength, row) in strengths.iter_mut().zip(&covariance) {
            *strength += row.iter().zip(&slope).map(|(c, s)| c * s).sum::<f64>().clamp(-1.0, 1.0);
        }
    }
    (strengths, covariance)
}

/// The inverse of a symmetric positive definite matrix, by elimination.
fn inverse(mut matrix: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let count = matrix.len();
    for (k, row) in matrix.iter_mut().enumerate() {
        row.extend((0..count).map(|i| f64::from(u8::from(i == k))));
    }
    for k in 0..count {
        let pivot: Vec<f64> = matrix[k].iter().map(|entry| entry / matrix[k][k]).collect();
        for (i, row) in matrix.iter_mut().enumerate() {
            let share = if i == k { row[k] - 1.0 } else { row[k] };
            row.iter_mut().zip(&pivot).for_each(|(entry, of)| *entry -= share * of);
        }
    }
    matrix.into_iter().map(|row| row[count..].to_vec()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn votes(left: &str, right: &str, counts: [usize; 3]) -> Vec<Vote> {
        let of = |(better, count): (Better, usize)| {
            std::iter::repeat_n(Vote { left: left.to_owned(), right: right.to_owned(), better }, count)
        };
        [Better::Left, Better::Right, Better::Same].into_iter().zip(counts).flat_map(of).collect()
    }

    #[test]
    fn two_films_are_as_far_apart_as_the_logarithm_of_their_votes() {
        let of = strengths(&votes("a", "b", [11, 3, 2])).unwrap();
        // half a vote more for each: 12.5 to 4.5; ln of that, and the variance of a logit, 1/(n p (1 − p)), of which each has a half
        let (apart, deviation) = ((12.5_f64 / 4.5).ln(), (1.0_f64 / 12.5 + 1.0 / 4.5).sqrt());
        assert!((of[0].strength - of[1].strength - apart).abs() < 1e-9 && of[0].votes == 16, "{of:?}");
        assert!((of[0].high - of[0].low - DEVIATIONS * deviation).abs() < 1e-9, "{of:?}");
        assert!((of[0].better - 0.75).abs() < 1e-12 && (of[0].strength + of[1].strength).abs() < 1e-12);
    }

    #[test]
    fn strengths_that_made_the_votes_are_found_again() {
        let [a, b, c] = [0.8, 0.1, -0.9_f64];
        let share = |of: f64| (1e5 / (1.0 + (-of).exp())).round() as usize;
        let pair = |left, right, by| votes(left, right, [share(by), 100_000 - share(by), 0]);
        let all = [pair("a", "b", a - b), pair("c", "b", c - b), pair("a", "c", a - c)].concat();
        let found = strengths(&all).unwrap();
        // counts are rounded to one of 1e5, and half a vote more changes them by as little
        assert!(found.iter().zip([a, b, c]).all(|(of, is)| (of.strength - is).abs() < 1e-4), "{found:?}");
    }

    #[test]
    fn a_film_that_always_wins_is_finite_and_votes_that_say_nothing_are_refused() {
        let of = strengths(&votes("a", "b", [5, 0, 0])).unwrap();
        assert!((of[0].strength - 0.5 * 11.0_f64.ln()).abs() < 1e-9, "{of:?}");
        for (wrong, why) in [
            (vec![], "no votes"),
            (votes("a", "a", [1, 0, 0]), "both sides"),
            ([votes("a", "b", [1, 0, 0]), votes("c", "d", [1, 0, 0])].concat(), "link"),
        ] {
            assert!(strengths(&wrong).unwrap_err().contains(why));
        }
    }
}
