//! Loops whose rounds may run on several threads at the same time.
//!
//! In: two lists, a function of each pair of their elements. Out: the same bits on any threads: rounds write to their
//! own elements only. Never here: threads; crates that have some implement [`ParallelFor`].

use std::fmt;

/// Runs two jobs, at the same time where it has a thread to spare.
pub trait ParallelFor: fmt::Debug + Sync {
    /// Runs both jobs, and returns when both have ended.
    fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send));
}

/// One job after the other, on the caller's thread.
#[derive(Debug, Clone, Copy, Default)]
pub struct PlainLoop;

impl ParallelFor for PlainLoop {
    fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
        first();
        second();
    }
}

/// A loop over fewer than two jobs of so many blocks of three velocities is not divided: a job takes some 50 µs, handing it over 10.
const JOB_MIN: usize = 64;

/// Whether rounds of `size` blocks in all are worth more than one thread.
#[must_use]
pub const fn is_worth_dividing(size: usize) -> bool {
    size >= 2 * JOB_MIN
}

/// Calls `visit` with the elements of `a` and `b` at each place; `size` says how many blocks of three velocities a round works on.
///
/// Jobs are halves of the list, halves of these, and so on, by size.
pub fn for_each<A: Send, B: Send>(
    threads: &dyn ParallelFor,
    a: &mut [A],
    b: &mut [B],
    size: &(impl Fn(&A) -> usize + Sync),
    visit: &(impl Fn(&mut A, &mut B) + Sync),
) {
    let rounds = a.len().min(b.len());
    let total: usize = a[..rounds].iter().map(size).sum();
    if rounds < 2 || !is_worth_dividing(total) {
        a.iter_mut().zip(b).for_each(|(a, b)| visit(a, b));
        return;
    }
    let (mut at, mut before) = (1, size(&a[0]));
    while at + 1 < rounds && 2 * (before + size(&a[at])) <= total {
        before += size(&a[at]);
        at += 1;
    }
    let (a_first, a_second) = a.split_at_mut(at);
    let (b_first, b_second) = b.split_at_mut(at);
    threads.join(&mut || for_each(threads, a_first, b_first, size, visit), &mut || {
        for_each(threads, a_second, b_second, size, visit)
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A new thread for every second job.
    #[derive(Debug)]
    struct Scoped {
        jobs: AtomicUsize,
    }

    impl ParallelFor for Scoped {
        fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
            self.jobs.fetch_add(1, Ordering::Relaxed);
            std::thread::scope(|scope| {
                scope.spawn(second);
                first();
            });
        }
    }

    fn squares(threads: &dyn ParallelFor, sizes: &[usize]) -> Vec<usize> {
        let (mut sizes, mut out) = (sizes.to_vec(), vec![0; sizes.len()]);
        for_each(threads, &mut sizes, &mut out, &|size| *size, &|size, out| *out += *size * *size);
        out
    }

    #[test]
    fn every_round_is_made_once_whoever_makes_it() {
        for sizes in [vec![], vec![1000], vec![0, 0, 500], vec![500, 0, 0], (0..200).collect(), vec![1; 1000]] {
            let scoped = Scoped { jobs: AtomicUsize::new(0) };
            let wanted: Vec<usize> = sizes.iter().map(|size| size * size).collect();
            assert_eq!(squares(&scoped, &sizes), wanted);
            assert_eq!(squares(&PlainLoop, &sizes), wanted);
        }
    }

    #[test]
    fn a_list_is_worth_dividing_into_like_jobs_and_a_small_one_is_not() {
        let jobs = |sizes: &[usize]| {
            let scoped = Scoped { jobs: AtomicUsize::new(0) };
            squares(&scoped, sizes);
            1 + scoped.jobs.into_inner()
        };
        assert_eq!(jobs(&[JOB_MIN - 1, JOB_MIN]), 1);
        assert_eq!(jobs(&[1; 2 * JOB_MIN]), 2);
        assert_eq!(jobs(&[1; 8 * JOB_MIN]), 8);
        // a large round is not divided, and the small ones around it are not left to one thread each
        assert_eq!(jobs(&[1, 1, 10 * JOB_MIN, 1, 1]), 3);
    }
}
