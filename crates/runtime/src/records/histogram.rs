//! Histogram of durations: percentiles of any number of times in little memory.
//!
//! In: times. Out: percentiles to 2 %, as [`Percentiles`]. An agent has two histograms, and there may be a hundred thousand agents: counters are
//! laid out in pages, one for each doubling of time, and only the pages that are used exist (a log-linear histogram as in HdrHistogram,
//! whose smallest takes 9 kB); a page is a cache line. When a counter is full, all are halved: earlier times then count for half. Never
//! here: clocks, locks.

use std::time::Duration;

/// The longest time distinguished from longer ones, microseconds: 16.8 seconds.
const LONGEST_US: u64 = (1 << 24) - 1;

/// Counters of a page. From the second page on each is 1/32 … 1/64 of its time wide.
const COUNTERS: usize = 32;

/// One page for times below 32 µs, counted singly, and one for each doubling up to [`LONGEST_US`].
const PAGES: usize = 20;

/// Pages allocated with the first time.
const PAGES_AT_ONCE: usize = 2;

/// Two percentiles and the maximum of a set of times, seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Percentiles {
    /// The median, to 2 %.
    pub p50_s: f64,
    /// The 99th percentile, to 2 %.
    pub p99_s: f64,
    /// The maximum; longer times than 16.8 s count as 16.8 s.
    pub max_s: f64,
}

/// Times of up to [`LONGEST_US`], counted to 2 %.
#[derive(Debug, Default)]
pub(crate) struct Histogram {
    /// Index of each page in `pages`, plus one; zero for a page that does not exist.
    index: [u8; PAGES],
    pages: Vec<[u16; COUNTERS]>,
    count: u64,
    longest_us: u64,
}

impl Histogram {
    /// Counts `time`.
    pub fn record(&mut self, time: Duration) {
        self.record_often(time, 1);
    }

    /// Counts `time` `often` times.
    pub fn record_often(&mut self, time: Duration, often: u16) {
        let us = u64::try_from(time.as_micros()).unwrap_or(u64::MAX).min(LONGEST_US);
        let (page, counter) = place(us);
        if self.index[page] == 0 {
            self.pages.reserve_exact(if self.pages.is_empty() { PAGES_AT_ONCE } else { 1 });
            self.pages.push([0; COUNTERS]);
            self.index[page] = self.pages.len() as u8;
        }
        let page = usize::from(self.index[page]) - 1;
        while self.pages[page][counter].checked_add(often).is_none() {
            self.halve();
        }
        self.pages[page][counter] += often;
        self.count += u64::from(often);
        self.longest_us = self.longest_us.max(us);
    }

    /// Reads a word of every page ([`crate::turn::prefetch`]).
    pub fn fetch(&self) {
        for page in &self.pages {
            std::hint::black_box(page[0]);
        }
    }

    fn halve(&mut self) {
        self.pages.iter_mut().flatten().for_each(|count| *count /= 2);
        self.count = self.pages.iter().flatten().map(|count| u64::from(*count)).sum();
    }

    /// The percentiles of all counted times; zeros if there are none.
    pub fn percentiles(&self) -> Percentiles {
        let [p50_s, p99_s] = self.quantiles([0.5, 0.99]).map(|us| us as f64 * 1e-6);
        Percentiles { p50_s, p99_s, max_s: self.longest_us as f64 * 1e-6 }
    }

    /// For each of the rising `shares` the least time that is not exceeded by this share of times, microseconds.
    fn quantiles<const N: usize>(&self, shares: [f64; N]) -> [u64; N] {
        let wanted = shares.map(|share| ((share * self.count as f64).ceil() as u64).max(1));
        let mut found = [self.longest_us; N];
        let (mut seen, mut next) = (0, 0);
        for (page, at) in self.index.iter().enumerate().filter(|(_, at)| **at > 0) {
            for (counter, count) in self.pages[usize::from(*at) - 1].iter().enumerate() {
                seen += u64::from(*count);
                while next < N && seen >= wanted[next] {
                    found[next] = middle(page, counter).min(self.longest_us);
                    next += 1;
                }
            }
        }
        found
    }
}

/// Page and counter of `us` microseconds.
fn place(us: u64) -> (usize, usize) {
    if us < COUNTERS as u64 {
        return (0, us as usize);
    }
    let shift = us.ilog2() - COUNTERS.ilog2();
    ((shift + 1) as usize, (us >> shift) as usize - COUNTERS)
}

/// The first time counted by a counter, microseconds, and how many microseconds it covers.
const fn range(page: usize, counter: usize) -> (u64, u64) {
    if page == 0 {
        return (counter as u64, 1);
    }
    (((COUNTERS + counter) as u64) << (page - 1), 1 << (page - 1))
}

/// Representative time of a counter, microseconds: no time that it counts differs from it by more than half its width.
const fn middle(page: usize, counter: usize) -> u64 {
    let (first, width) = range(page, counter);
    first + width / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_the_public_histogram() {
        let mut theirs = hdrhistogram::Histogram::<u32>::new_with_bounds(1, 20_000_000, 3).unwrap();
        let mut times = Histogram::default();
        // 0.6 µs … 6 s, uniform in the logarithm
        for k in 0..7000_u32 {
            let us = libm::exp10(f64::from(k) * 1e-3 - 0.2);
            times.record(Duration::from_nanos((us * 1e3) as u64));
            theirs.saturating_record(us as u64);
        }
        for (found, share) in times.quantiles([0.1, 0.5, 0.9, 0.99]).iter().zip([0.1, 0.5, 0.9, 0.99]) {
            let exact = theirs.value_at_quantile(share) as f64;
            // half a counter of ours is at most 1/64 of its time wide, one of theirs 1/1000
            assert!((*found as f64 / exact - 1.0).abs() < 1.0 / 64.0 + 1e-3, "{found} for {exact}");
        }
    }

    /// The shares' times among all of `us`, by sorting.
    fn sorted(mut us: Vec<u64>, shares: &[f64]) -> Vec<f64> {
        us.sort_unstable();
        shares.iter().map(|share| us[((share * us.len() as f64).ceil() as usize).max(1) - 1] as f64).collect()
    }

    #[test]
    fn percentiles_are_right_to_two_hundredths() {
        let mut times = Histogram::default();
        (1..=1000).for_each(|us| times.record(Duration::from_micros(us * 10)));
        let found = times.percentiles();
        assert!((found.p50_s - 5e-3).abs() < 1e-4, "{found:?}");
        assert!((found.p99_s - 9.9e-3).abs() < 2e-4, "{found:?}");
        assert_eq!(found.max_s, 10e-3);
        assert_eq!(Histogram::default().percentiles(), Percentiles::default());
    }

    proptest::proptest! {
        #[test]
        fn percentiles_of_any_counts_agree_with_sorting(us in proptest::collection::vec(0_u64..20_000_000, 1..400)) {
            let mut times = Histogram::default();
            us.iter().for_each(|us| times.record(Duration::from_micros(*us)));
            let exact = sorted(us.iter().map(|us| (*us).min(LONGEST_US)).collect(), &[0.5, 0.99]);
            for (found, exact) in times.quantiles([0.5, 0.99]).iter().zip(exact) {
                let found = *found as f64;
                // a counter is at most 1/32 of its time wide
                assert!((found - exact).abs() <= exact / 64.0, "{found} for {exact}");
            }
        }
    }

    #[test]
    fn every_time_has_its_counter_and_the_next_one_begins_where_it_ends() {
        let mut expected = 0;
        for page in 0..PAGES {
            for counter in 0..COUNTERS {
                let (first, width) = range(page, counter);
                assert_eq!(first, expected);
                assert_eq!([place(first), place(first + width - 1)], [(page, counter); 2]);
                expected = first + width;
            }
        }
        assert_eq!(expected, LONGEST_US + 1);
    }

    #[test]
    fn shares_stay_right_when_counters_have_been_full() {
        let mut times = Histogram::default();
        for _ in 0..1000 {
            times.record_often(Duration::from_micros(10), 900);
            times.record_often(Duration::from_micros(20), 60);
            times.record_often(Duration::from_micros(30), 40);
        }
        assert_eq!(times.quantiles([0.5, 0.89, 0.93, 0.97]), [10, 10, 20, 30]);
        assert!((32_768..=131_072).contains(&times.count), "{}", times.count);
    }

    #[test]
    fn a_time_beyond_the_scale_counts_as_the_longest() {
        let mut times = Histogram::default();
        times.record(Duration::from_secs(1000));
        assert!(times.percentiles().max_s >= 10.0);
    }

    #[test]
    fn a_steady_agent_keeps_few_pages_and_allocates_no_more() {
        let mut times = Histogram::default();
        let day = |times: &mut Histogram| (0..100_000_u64).for_each(|k| times.record(Duration::from_micros(k % 500)));
        day(&mut times);
        assert_eq!(times.pages.len(), 5, "0 … 31, … 63, … 127, … 255, … 511 µs");
        assert_eq!(allocation_counter::measure(|| day(&mut times)).count_total, 0);
    }
}
