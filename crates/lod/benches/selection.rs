//! How does the cost of a choice of levels grow with the objects, where prices and worths move a little from frame to frame?

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use metachron_lod::adaptive::{Adaptive, Offer, Settings, Time};

/// Objects with five levels each, of sizes that differ ninefold.
fn scene(objects: u64) -> Adaptive {
    let mut adaptive = Adaptive::new(Settings::default());
    for id in 0..objects {
        let offers = [0.02, 0.06, 0.18, 0.45, 1.0].map(|part| {
            let polygons = part * (100.0 + (id * 7919 % 900) as f64);
            Offer { cost: 20.0 + 13.5 * polygons, gain: 1.0 - 0.5 / polygons.max(2.0) }
        });
        adaptive.set(id, 0, false, &offers);
    }
    adaptive
}

fn choose_levels(c: &mut Criterion) {
    let mut group = c.benchmark_group("budget/choose");
    for objects in [100_u64, 1000, 10_000] {
        let mut adaptive = scene(objects);
        // half of the time of everything at its finest
        let target = objects as f64 * 0.5 * 13.5 * 550.0;
        let mut frame = 0;
        group.throughput(Throughput::Elements(objects));
        group.bench_function(BenchmarkId::from_parameter(objects), |b| {
            b.iter(|| {
                frame += 1;
                for id in 0..objects {
                    adaptive.weigh(id, 1.0 + ((id * 31 + frame * 7) % 997) as f64);
                }
                let plan = adaptive.choose(frame, Time { target, fixed: 0.0, reserved: 0.0 });
                adaptive.observe(frame, 0, plan.predicted);
                plan.predicted
            });
        });
    }
    group.finish();
}

criterion_group!(benches, choose_levels);
criterion_main!(benches);
