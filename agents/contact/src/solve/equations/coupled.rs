//! A part of the members' matrix with the terms that contacts add to it, ⊕ A/f + Jᵀ G J, and its factor.
//!
//! In: members, which of their blocks are whole in it, rows, a gain of each row. Out: solutions. Never here: which parts are wanted, laws of
//! contact. Theory: `docs/theory/clusters.md`, eq. 8.

use super::gradients::Stiffness;
use super::members::Members;
use super::rows::Rows;
use crate::lists::{refill, reset};
use crate::solve::sparse::factor::{Cholesky, Pair, Place};
use crate::solve::statement::problem::Block;
use glam::{DMat3, DVec3};
use metachron_core::{Archive, ArchiveError};

/// The place of a block that is not in it.
const NOWHERE: usize = usize::MAX;

/// A matrix, where rows add to it, and its factor.
#[derive(Debug, Clone, Default)]
pub(super) struct Coupled {
    factor: Cholesky,
    /// The blocks that it is of, and the place of each of all blocks in it.
    met: Vec<usize>,
    places: Vec<usize>,
    /// The part of the members' matrix that is in it, and its couplings.
    own: Vec<Block>,
    pairs: Vec<Pair>,
    /// Where two terms of a row meet, by front, meetings of one place next to each other; the meetings of front k start
    /// at `of_fronts[k]`.
    meetings: Vec<Meeting>,
    of_fronts: Vec<usize>,
    /// The fronts of all meetings, row by row; the fronts of row k start at `starts[k]`.
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
    x: Vec<DVec3>,
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
    /// Writes or reads the order of its factor, which the next matrix needs.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        if archive.is_reading() {
            self.forget();
        }
        self.factor.archive(archive)
    }

    /// Takes up the members, without contacts, and where rows couple them: whole blocks with all that they are coupled with, of others those on
    /// the diagonal that rows touch.
    pub fn couple(&mut self, members: &Members, rows: &Rows, is_whole: impl Fn(usize) -> bool) {
        let Self { met, places, own, pairs, x, .. } = self;
        refill(places, (0..members.size()).map(|block| if is_whole(block) { 0 } else { NOWHERE }));
        rows.all_terms().iter().for_each(|term| places[term.block] = 0);
        met.clear();
        for (block, place) in places.iter_mut().enumerate().filter(|(_, place)| **place == 0) {
            *place = met.len();
            met.push(block);
        }
        let near = members.blocks.iter().filter_map(|block| {
            let [row, column] = [block.row, block.column].map(|block| places[block]);
            let is_near = row != NOWHERE && (block.row == block.column || is_whole(block.row));
            is_near.then_some(Block { row, column, ..*block })
        });
        refill(own, near);
        refill(pairs, own.iter().map(Pair::of));
        reset(x, met.len(), DVec3::ZERO);
        if !self.take(rows) {
            self.meet(rows);
        }
    }

    /// Makes room for the matrix with these rows; whether their meetings are known.
    fn take(&mut self, rows: &Rows) -> bool {
        for row in (0..self.active.len()).filter(|&row| self.active[row]) {
            self.fronts[self.starts[row]..self.starts[row + 1]].iter().for_each(|&front| self.factor.spoil(front));
        }
        self.gains.fill(DMat3::ZERO);
        self.active.fill(false);
        let (size, mut is_known) = (self.met.len(), self.knows(rows));
        if !(is_known && self.factor.fits(size, &self.pairs)) {
            let Self { factor, places, pairs, changes, .. } = self;
            for terms in (0..rows.len()).map(|row| rows.terms(row)) {
                for (left, term) in terms.iter().enumerate() {
                    let row = places[term.block];
                    pairs.extend(terms[..=left].iter().map(|other| Pair { row, column: places[other.block] }));
                }
            }
            reset(changes, size, false);
            rows.all_terms().iter().for_each(|term| changes[places[term.block]] = true);
            if factor.shape(size, pairs, changes) {
                is_known = false;
            }
        }
        self.factor.set(&self.own);
        is_known
    }

    /// Finds where the rows add to the matrix.
    fn meet(&mut self, rows: &Rows) {
        self.forget();
        let Self { factor, places, gains, active, pushed, starts, fronts, blocks, unsorted, .. } = self;
        let terms = rows.all_terms();
        gains.resize(rows.len(), DMat3::ZERO);
        active.resize(rows.len(), false);
        pushed.resize(terms.len(), DMat3::ZERO);
        for row in 0..rows.len() {
            starts.push(fronts.len());
            for left in rows.range(row) {
                for right in rows.range(row).start..=left {
                    let [row_at, column] = [left, right].map(|term| places[terms[term].block]);
                    let place = factor.place(Pair { row: row_at, column });
                    fronts.extend(place.map(|place| place.front));
                    unsorted.extend(place.map(|place| Meeting { row, left, right, place }));
                }
            }
        }
        starts.push(fronts.len());
        blocks.extend(names(rows, places));
        self.sort();
    }

    /// Whether the meetings are those of rows on these blocks.
    fn knows(&self, rows: &Rows) -> bool {
        !self.starts.is_empty() && self.blocks.iter().copied().eq(names(rows, &self.places))
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

    /// Factors it where it has changed.
    ///
    /// # Errors
    /// A block at which it is not positive definite, or rounding leaves it without a factor.
    pub fn factor(&mut self, contacts: Stiffness<'_>) -> Result<(), usize> {
        let Stiffness { rows, gains, threads, .. } = contacts;
        let Self { factor, met, meetings, of_fronts, fronts, starts, gains: known, active, pushed, .. } = self;
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
        done.map_err(|block| met[block])
    }

    /// Solves by the last factor, for the blocks that are in it; the others stay.
    pub fn solve(&mut self, right: &[DVec3], into: &mut [DVec3]) {
        let Self { factor, met, x, .. } = self;
        x.iter_mut().zip(&*met).for_each(|(x, &block)| *x = right[block]);
        factor.solve(x);
        x.iter().zip(met).for_each(|(x, block)| into[*block] = *x);
    }
}

/// The places of the blocks of rows, with an end of each row, so that lists are equal where those of all rows are.
fn names<'a>(rows: &'a Rows, places: &'a [usize]) -> impl Iterator<Item = usize> + 'a {
    let of_row = |row| rows.terms(row).iter().map(|term| places[term.block]).chain(std::iter::once(usize::MAX));
    (0..rows.len()).flat_map(of_row)
}
