//! How long does a choice take, as objects grow to 100,000? `cargo run --release -p metachron-lod --example choosing`.
//!
//! In: nothing. Out: milliseconds of one choice of a moving picture (median and least), and the median's part of a frame at 60 Hz.

use std::time::Instant;

use metachron_lod::adaptive::{Adaptive, Offer, Settings, Time};

/// Choices that are timed; the median counts.
const FRAMES: u64 = 101;

fn main() {
    println!("objects  levels  choose, ms  least, ms  of 1/60 s  gap of the certificate");
    for count in [100, 1_000, 10_000, 100_000] {
        let mut adaptive = Adaptive::new(Settings::default());
        for id in 0..count {
            let offers = [0.02, 0.06, 0.18, 0.45, 1.0].map(|part| {
                let polygons = part * (100.0 + (id * 7919 % 900) as f64);
                Offer { cost: 20.0 + 13.5 * polygons, gain: 1.0 - 0.5 / polygons.max(2.0) }
            });
            adaptive.set(id, 0, false, &offers);
        }
        // half of the time of everything at its finest
        let target = count as f64 * 0.5 * 13.5 * 550.0;
        let (mut times, mut gap) = (Vec::new(), 0.0_f64);
        for frame in 0..FRAMES {
            for id in 0..count {
                adaptive.weigh(id, 1.0 + ((id * 31 + frame * 7) % 997) as f64);
            }
            let start = Instant::now();
            let plan = adaptive.choose(frame, Time { target, fixed: 0.0, reserved: 0.0 });
            times.push(start.elapsed().as_secs_f64() * 1e3);
            gap = gap.max(plan.gap());
            adaptive.observe(frame, 0, plan.predicted);
        }
        times.sort_by(f64::total_cmp);
        let median = times[times.len() / 2];
        println!(
            "{count:7}  {:6}  {median:10.4}  {:9.4}  {:8.2}%  {gap:.1e}",
            5,
            times[0],
            100.0 * median * 60.0 / 1e3
        );
    }
}
