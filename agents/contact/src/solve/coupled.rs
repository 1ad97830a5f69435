//! The members' matrix with what contacts add to it, ⊕ A/f + Jᵀ G J, and its factor.
//!
//! In: blocks of members, rows, a gain of each row. Out: solutions. Never here: which blocks are part of it (the whole matrix, or those
//! near its diagonal). Theory: `docs/theory/clusters.md`, eq. 8.

use super::factor::{Cholesky, Pair, Place};
use super::problem::Block;
use super::rows::{Rows, Term};
use super::skew::Stiffness;
use glam::DMat3;
use glam::DVec3;
use metachron_core::{Archive, ArchiveError};

/// A matrix, where rows add to it, and its factor.
#[derive(Debug, Clone, Default)]
pub(super) struct Coupled {
    factor: Cholesky,
    /// Where two terms of a row meet, by front, those with one place next to each other; those of front k start at `of_fronts[k]`.
    meetings: Vec<Meeting>,
    of_fronts: Vec<usize>,
    /// The fronts of all meetings, row by row; those of row k start at `starts[k]`.
    fronts: Vec<usize>,
    starts: Vec<usize>,
    /// The blocks of all rows that the meetings were found for.
    blocks: Vec<usize>,
    /// Storage to sort meetings with.
    order: Vec<usize>,
    unsorted: Vec<Meeting>,
    /// The gains that are in the factor, and which of them are not zero.
    gains: Vec<DMat3>,
    active: Vec<bool>,
    /// Of each term of all rows its gain times its map.
    pushed: Vec<DMat3>,
    /// The blocks that rows add to.
    changes: Vec<bool>,
}

/// Rows, and what their matrix calls the blocks that they are about.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlacedRows<'a> {
    pub rows: &'a Rows,
    pub places: &'a [usize],
}

/// Two terms of one row, counted over all rows, and where their product goes.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    row: usize,
    left: usize,
    right: usize,
    place: Place,
}

impl Coupled {
    /// Writes or reads what the next matrix needs: the order of its factor.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        if archive.is_reading() {
            self.forget();
        }
        self.factor.archive(archive)
    }

    /// Takes up a matrix of `size` blocks without contacts, with room for these couplings and those of the rows.
    pub fn take(&mut self, size: usize, blocks: &[Block], pairs: &mut Vec<Pair>, rows: PlacedRows<'_>) {
        for row in (0..self.active.len()).filter(|&row| self.active[row]) {
            self.fronts[self.starts[row]..self.starts[row + 1]].iter().for_each(|&front| self.factor.spoil(front));
        }
        self.gains.fill(DMat3::ZERO);
        self.active.fill(false);
        if !(self.knows(rows) && self.factor.fits(size, pairs)) {
            pairs.extend(rows.couplings());
            self.changes.clear();
            self.changes.resize(size, false);
            rows.rows.all_terms().iter().for_each(|term| self.changes[rows.places[term.block]] = true);
            if self.factor.shape(size, pairs, &self.changes) {
                self.forget();
            }
        }
        self.factor.set(blocks);
    }

    /// Finds where the rows add to the matrix.
    pub fn meet(&mut self, placed: PlacedRows<'_>) {
        if self.knows(placed) {
            return;
        }
        let PlacedRows { rows, places } = placed;
        self.forget();
        self.gains.resize(rows.len(), DMat3::ZERO);
        self.active.resize(rows.len(), false);
        self.pushed.resize(rows.all_terms().len(), DMat3::ZERO);
        let terms = rows.all_terms();
        for row in 0..rows.len() {
            self.starts.push(self.fronts.len());
            self.blocks.extend(rows.terms(row).iter().map(|term| places[term.block]));
            for left in rows.range(row) {
                for right in rows.range(row).start..=left {
                    let pair = [left, right].map(|term| places[terms[term].block]);
                    let place = self.factor.place(Pair { row: pair[0], column: pair[1] });
                    self.fronts.extend(place.map(|place| place.front));
                    self.unsorted.extend(place.map(|place| Meeting { row, left, right, place }));
                }
            }
            // an end of each row's blocks, so that lists of blocks are equal where all rows' are
            self.blocks.push(usize::MAX);
        }
        self.starts.push(self.fronts.len());
        self.sort();
    }

    /// Whether the meetings are those of rows on these blocks.
    fn knows(&self, PlacedRows { rows, places }: PlacedRows<'_>) -> bool {
        let blocks = (0..rows.len())
            .flat_map(|row| rows.terms(row).iter().map(|term| places[term.block]).chain(std::iter::once(usize::MAX)));
        !self.starts.is_empty() && self.blocks.iter().copied().eq(blocks)
    }

    fn forget(&mut self) {
        for list in [&mut self.starts, &mut self.blocks, &mut self.fronts, &mut self.order, &mut self.of_fronts] {
            list.clear();
        }
        self.meetings.clear();
        self.unsorted.clear();
        self.gains.clear();
        self.active.clear();
    }

    /// Lists the meetings by front and place, those with one place as they are.
    fn sort(&mut self) {
        let Self { factor, meetings, unsorted, order, of_fronts, .. } = self;
        of_fronts.resize(factor.len() + 2, 0);
        // two places ahead, as each start moves on to the next while the list is filled
        unsorted.iter().for_each(|meeting| of_fronts[meeting.place.front + 2] += 1);
        (2..of_fronts.len()).for_each(|k| of_fronts[k] += of_fronts[k - 1]);
        order.resize(unsorted.len(), 0);
        for (k, meeting) in unsorted.iter().enumerate() {
            let next = &mut of_fronts[meeting.place.front + 1];
            order[*next] = k;
            *next += 1;
        }
        for front in of_fronts.windows(2).take(factor.len()) {
            order[front[0]..front[1]].sort_unstable_by_key(|&k| (unsorted[k].place, k));
        }
        meetings.extend(order.iter().map(|&k| unsorted[k]));
    }

    /// Factors ⊕ A/f + Jᵀ G J where it has changed; `false` where rounding leaves it without a factor.
    pub fn factor(&mut self, contacts: Stiffness<'_>) -> bool {
        let Stiffness { rows, gains, threads, .. } = contacts;
        let Self { factor, meetings, of_fronts, fronts, starts, gains: known, active, pushed, .. } = self;
        let terms = rows.all_terms();
        for (row, (known, gain)) in known.iter_mut().zip(gains).enumerate().filter(|(_, (known, gain))| known != gain) {
            fronts[starts[row]..starts[row + 1]].iter().for_each(|&front| factor.spoil(front));
            rows.range(row).for_each(|term| pushed[term] = *gain * terms[term].map);
            *known = *gain;
            active[row] = *gain != DMat3::ZERO;
        }
        let done = factor.factor(threads, |front, entries| {
            let here = meetings[of_fronts[front]..of_fronts[front + 1]].iter();
            let mut sum: Option<(Place, DMat3)> = None;
            for &Meeting { left, right, place, .. } in here.filter(|meeting| active[meeting.row]) {
                let product = terms[left].map.transpose() * pushed[right];
                match &mut sum {
                    Some((known, sum)) if *known == place => *sum += product,
                    other => {
                        if let Some((known, sum)) = other.replace((place, product)) {
                            entries.add(known, &sum);
                        }
                    }
                }
            }
            sum.iter().for_each(|(place, sum)| entries.add(*place, sum));
        });
        done.is_ok()
    }

    /// x ← (⊕ A/f + Jᵀ G J)⁻¹ x of the last factor.
    pub fn solve(&mut self, x: &mut [DVec3]) {
        self.factor.solve(x);
    }
}

impl<'a> PlacedRows<'a> {
    /// Where terms of one row meet.
    fn couplings(self) -> impl Iterator<Item = Pair> + 'a {
        let Self { rows, places } = self;
        let pair = |term: &Term, other: &Term| Pair { row: places[term.block], column: places[other.block] };
        (0..rows.len()).flat_map(move |row| {
            let terms = rows.terms(row).iter().enumerate();
            terms.flat_map(move |(left, term)| rows.terms(row)[..=left].iter().map(move |other| pair(term, other)))
        })
    }
}
