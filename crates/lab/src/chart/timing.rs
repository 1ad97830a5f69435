//! The least cost of a call, a lower bound for calls that touch the same memory, and the speed of the machine.
//!
//! In: a call, or a number of bytes. Out: CPU time. Never here: what the call does.

use cpu_time::ThreadTime;
use std::hint::black_box;
use std::time::Duration;

/// Duration of a batch: far above the cost of reading the clock.
const BATCH: Duration = Duration::from_micros(500);

/// CPU time of one call in the fastest of many batches, over about `span`, microseconds; `None` where a call fails.
///
/// Load of a shared machine only adds time, so the least is closest to the call's own.
pub fn least_us(span: Duration, mut call: impl FnMut() -> Option<()>) -> Option<f64> {
    let start = ThreadTime::now();
    call()?;
    let once = start.elapsed().max(Duration::from_nanos(100));
    let count = (BATCH.as_secs_f64() / once.as_secs_f64()).ceil() as u32;
    let (whole, mut least) = (ThreadTime::now(), f64::INFINITY);
    while whole.elapsed() < span {
        let batch = ThreadTime::now();
        for _ in 0..count {
            call()?;
        }
        least = least.min(batch.elapsed().as_secs_f64() / f64::from(count));
    }
    Some(least * 1e6)
}

/// CPU time of a plain loop that reads and writes every number in so many bytes once, microseconds.
pub fn floor_us(bytes: usize, span: Duration) -> Option<f64> {
    let mut memory = vec![1.0_f64; bytes / size_of::<f64>()];
    least_us(span, || {
        for x in black_box(&mut memory[..]) {
            *x = *x * 0.75 + 0.25;
        }
        Some(())
    })
}

/// The median, the upper one of an even number; NaN of none.
pub fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(f64::NAN)
}

/// [`calibration_us`] on the machine for which goals were set, two cores of a virtual AMD EPYC, microseconds.
const GOALS_US: f64 = 0.88;

/// CPU time of a thousand dependent multiplications and additions, microseconds: a reference for the speed of the machine at the
/// time of a measurement.
pub fn calibration_us() -> Option<f64> {
    const SPAN: Duration = Duration::from_millis(2);
    let mut x = 1_u64;
    least_us(SPAN, || {
        for _ in 0..1000 {
            x = black_box(x.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1));
        }
        Some(())
    })
}

/// Factor that scales times to the machine for which goals were set: by the least of the calibrations measured with them, because load
/// of a shared machine only adds time. NaN where there is none.
pub fn pace_for_goals(calibrations_us: impl Iterator<Item = Option<f64>>) -> f64 {
    GOALS_US / calibrations_us.flatten().reduce(f64::min).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_times_the_work_costs_more_and_a_call_that_fails_has_no_cost() {
        let span = Duration::from_millis(10);
        let [few, many] = [1 << 12, 10 << 12].map(|bytes| floor_us(bytes, span).unwrap());
        assert!(few > 0.0 && many > 2.0 * few, "{few} {many}");
        assert_eq!(least_us(span, || None), None);
    }

    #[test]
    fn calibration_cancels_the_speed_of_the_machine() {
        let pace = pace_for_goals([None, Some(9.0 * GOALS_US), Some(2.0 * GOALS_US)].into_iter());
        assert!((pace - 0.5).abs() < 1e-12, "{pace}");
        assert!(pace_for_goals([None].into_iter()).is_nan() && calibration_us().is_some_and(|us| us > 0.0));
    }
}
