//! How does the cost of a tube's step grow with its segments? Linear is what the band matrix promises.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use metachron_contact::StepContext;
use metachron_contact::step::LoneStepper;
use metachron_core::{AgentId, N_MAX, Resolution, ResolutionRange, SimSpan, SimTime};
use metachron_models::rod::Tube;
use metachron_models::rod::{Material, Section, TubeSpec};

/// A tube of a metre that hangs from one end and swings.
fn tube(segments: usize) -> Tube {
    let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 0.5 };
    let free = TubeSpec::free(vec![DVec3::ZERO, DVec3::X], Section::hollow(0.015, 0.002, material), segments);
    let eps_m = 1.0 / segments as f64;
    let spec = TubeSpec {
        resolution: Resolution { eps_m, n: 1 },
        range: ResolutionRange { eps_m: (eps_m, eps_m), n: (0, N_MAX) },
        clamp: [true, false],
        self_contact: false,
        gravity: DVec3::NEG_Z * 9.81,
        ..free
    };
    Tube::new(spec).expect("the tube is sound")
}

fn step_tube(c: &mut Criterion) {
    let mut group = c.benchmark_group("rod/step");
    let dt = SimSpan::from_nanos(5_000_000);
    let context = StepContext::alone(AgentId(0), SimTime::ZERO);
    for segments in [16_usize, 64, 256] {
        let (mut tube, mut stepper) = (tube(segments), LoneStepper::default());
        group.throughput(Throughput::Elements(segments as u64));
        group.bench_function(BenchmarkId::from_parameter(segments), |b| {
            b.iter(|| stepper.step(&mut tube, dt, context).expect("it swings freely"));
        });
    }
    group.finish();
}

criterion_group!(benches, step_tube);
criterion_main!(benches);
