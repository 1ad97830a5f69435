//! How deep do fifteen scenes land and rest at equal and unlike rates, how much do they weigh, gain and cost? Prints a
//! line for each.
//!
//! `cluster_scenes [rates, as 60:60,240:60] [start of a name]`

#[path = "../tests/clusters/bodies.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod bodies;
#[path = "../tests/clusters/scenes.rs"]
mod scenes;
#[path = "../tests/clusters/table.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod table;

use scenes::{NAMES, SECONDS, faults, scene};
use std::time::Instant;

const RATES: &str = "60:60,120:120,240:240,240:60,60:240,500:60,60:500,1000:100,60:61";

fn main() {
    let mut words = std::env::args().skip(1);
    let rates = words.next().unwrap_or_else(|| RATES.into());
    let only = words.next().unwrap_or_default();
    for name in NAMES.into_iter().filter(|name| name.starts_with(&only)) {
        for pair in rates.split(',') {
            let hz = |word: Option<&str>| word.and_then(|word| word.parse().ok()).unwrap_or(60.0);
            let mut words = pair.split(':');
            let (lowest_hz, others_hz) = (hz(words.next()), hz(words.next()));
            let started = Instant::now();
            let found = scene(name).at_rates(lowest_hz, others_hz).play(SECONDS);
            println!(
                "{name:36} {lowest_hz:4}:{others_hz:4} Hz  {:.4} mm landing {:.4} at rest  {:8.5} mJ made  weight {:.4}  \
                 factors {:5.2}, at rest {:5.2}  contacts {:4}  {:.2} s  {:?}",
                found.landing_m * 1e3,
                found.rest_m * 1e3,
                found.gain_j * 1e3,
                found.weight,
                f64::from(found.factors) / f64::from(found.steps),
                found.factors_at_rest,
                found.contacts,
                started.elapsed().as_secs_f64(),
                faults(name, &found),
            );
        }
    }
}
