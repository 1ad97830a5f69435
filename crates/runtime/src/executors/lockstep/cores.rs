//! Jobs that share the cores of the declared machine, in virtual time.
//!
//! In: jobs with the time each would take alone. Out: when the next one ends. All jobs progress alike: at full speed while there are cores
//! for all, else at the fraction cores / jobs of it. Every job's end is a mark on one common count of service, so that an event costs O(log
//! n) whatever the number of jobs (the virtual time of generalised processor sharing).
//! Integers throughout: the same events on every computer. Never here: agents, the content of a job.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Duration;

/// Service is counted in picoseconds, so that sharing a core loses less than a nanosecond in a thousand events.
const PICOS_PER_NANO: u128 = 1000;

/// Jobs in progress on shared cores.
#[derive(Debug)]
pub(super) struct Cores {
    cores: u128,
    /// Service received by a job that was there from the beginning, picoseconds.
    served: u128,
    /// The service at which each job ends, and its owner's number.
    jobs: BinaryHeap<Reverse<(u128, u32)>>,
}

impl Cores {
    /// That many cores, at least one.
    pub fn new(cores: u32) -> Self {
        Self { cores: u128::from(cores.max(1)), served: 0, jobs: BinaryHeap::new() }
    }

    /// The service so far and the jobs in progress.
    pub fn jobs(&self) -> (u128, BinaryHeap<Reverse<(u128, u32)>>) {
        (self.served, self.jobs.clone())
    }

    /// Takes over a service and jobs in progress.
    pub fn set_jobs(&mut self, served: u128, jobs: BinaryHeap<Reverse<(u128, u32)>>) {
        (self.served, self.jobs) = (served, jobs);
    }

    /// Starts the job of `owner`, which takes `work` on a core of its own.
    pub fn start(&mut self, owner: u32, work: Duration) {
        self.jobs.push(Reverse((self.served + work.as_nanos() * PICOS_PER_NANO, owner)));
    }

    /// Time until a job ends, if none is added; `None` without jobs.
    pub fn until_end(&self) -> Option<Duration> {
        let Reverse((end, _)) = self.jobs.peek()?;
        let (gain, cost) = self.rate();
        let nanos = (end.saturating_sub(self.served) * cost).div_ceil(gain * PICOS_PER_NANO);
        Some(Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX)))
    }

    /// Lets `span` pass for all jobs; at most [`Self::until_end`].
    pub fn pass(&mut self, span: Duration) {
        let (gain, cost) = self.rate();
        self.served += span.as_nanos() * PICOS_PER_NANO * gain / cost;
    }

    /// Takes a job that has ended: the one with the earliest end, at equal ends the lowest number.
    pub fn take_ended(&mut self) -> Option<u32> {
        let &Reverse((end, owner)) = self.jobs.peek()?;
        (end <= self.served).then(|| {
            self.jobs.pop();
            owner
        })
    }

    /// The speed of each job as a fraction: full while there are cores for all.
    fn rate(&self) -> (u128, u128) {
        let jobs = self.jobs.len() as u128;
        if jobs <= self.cores { (1, 1) } else { (self.cores, jobs) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn us(n: u64) -> Duration {
        Duration::from_micros(n)
    }

    /// Runs all jobs to their ends: owner and end time of each.
    fn run(cores: &mut Cores) -> Vec<(u32, Duration)> {
        let (mut now, mut ends) = (Duration::ZERO, Vec::new());
        while let Some(span) = cores.until_end() {
            cores.pass(span);
            now += span;
            while let Some(owner) = cores.take_ended() {
                ends.push((owner, now));
            }
        }
        ends
    }

    #[test]
    fn jobs_with_a_core_each_take_their_own_time() {
        let mut cores = Cores::new(2);
        cores.start(0, us(100));
        cores.start(1, us(40));
        assert_eq!(run(&mut cores), [(1, us(40)), (0, us(100))]);
    }

    #[test]
    fn three_jobs_on_two_cores_share_them_evenly() {
        let mut cores = Cores::new(2);
        (0..3).for_each(|owner| cores.start(owner, us(100)));
        // 300 µs of work on two cores; ceil to the nanosecond
        assert_eq!(run(&mut cores), [(0, us(150)), (1, us(150)), (2, us(150))]);
    }

    #[test]
    fn a_short_job_among_long_ones_waits_for_its_share_only() {
        let mut cores = Cores::new(1);
        cores.start(0, us(1000));
        cores.start(1, us(10));
        assert_eq!(run(&mut cores), [(1, us(20)), (0, us(1010))]);
    }

    #[test]
    fn no_work_is_lost_or_made_over_many_events() {
        let mut cores = Cores::new(2);
        let (mut now, mut total) = (Duration::ZERO, Duration::ZERO);
        for k in 0..3000_u32 {
            let work = Duration::from_nanos(u64::from(k * 7919 % 10_007));
            cores.start(k % 7, work);
            total += work;
            if k % 3 == 0 {
                let span = cores.until_end().unwrap();
                cores.pass(span);
                now += span;
                cores.take_ended();
            }
        }
        now += run(&mut cores).last().unwrap().1;
        let least = total / 2;
        // an end is rounded up by less than a nanosecond, and the last job alone leaves one core idle
        assert!(now >= least, "{now:?} for {total:?}");
        assert!(now <= least + us(20), "{now:?} for {total:?}");
    }
}
