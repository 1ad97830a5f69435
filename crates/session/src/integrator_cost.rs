//! Measures the cost of a solve of each integrator of the tube relative to implicit Euler on this machine.
//!
//! Out: a factor for every integrator. Never here: how many solves a step takes; tubes count them as their work.

use cpu_time::ThreadTime;
use glam::DVec3;
use metachron_contact::StepContext;
use metachron_contact::step::LoneStepper;
use metachron_core::{AgentId, SimSpan, SimTime};
use metachron_models::rod::Integrator;
use metachron_models::rod::Tube;
use metachron_models::rod::{Material, Section, TubeSpec};

/// A step that every integrator can take.
const DT: SimSpan = SimSpan::from_nanos(100_000);
const SEGMENTS: usize = 64;
/// Steps of a batch.
const STEPS: u32 = 40;
/// Batches per integrator, interleaved; the fastest counts, because other load on the machine only ever adds time.
const BATCHES: u32 = 9;

/// The price of a solve by every integrator, in the order of [`Integrator::ALL`], where one of implicit Euler costs 1.
///
/// Takes some hundredths of a second. An integrator that cannot be measured yields NaN.
#[must_use]
pub fn solve_prices() -> Vec<f64> {
    let mut tubes = Integrator::ALL.map(|integrator| Some((swinging(integrator)?, LoneStepper::default())));
    let mut least_s = Integrator::ALL.map(|_| f64::NAN);
    for _ in 0..BATCHES {
        for (tube, least_s) in tubes.iter_mut().zip(&mut least_s) {
            let batch_s = tube.as_mut().and_then(|(tube, stepper)| batch_s(tube, stepper)).unwrap_or(f64::NAN);
            *least_s = least_s.min(batch_s);
        }
    }
    let plain = Integrator::ALL.iter().position(|one| *one == Integrator::ImplicitEuler);
    let plain_s = plain.map_or(f64::NAN, |at| least_s[at]);
    least_s.iter().map(|least_s| least_s / plain_s).collect()
}

/// A soft cable, just released.
fn swinging(integrator: Integrator) -> Option<Tube> {
    let material = Material { young_pa: 1e5, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 0.5 };
    let path_m = vec![DVec3::ZERO, DVec3::X];
    let free = TubeSpec::free(path_m, Section::hollow(0.015, 0.002, material), SEGMENTS);
    let gravity = DVec3::NEG_Z * 9.81;
    Tube::new(TubeSpec { integrator, gravity, pin: [true, false], self_contact: false, ..free }).ok()
}

/// CPU seconds per unit of work, over some steps.
fn batch_s(tube: &mut Tube, stepper: &mut LoneStepper) -> Option<f64> {
    let (start, mut work) = (ThreadTime::now(), 0.0);
    for _ in 0..STEPS {
        work += stepper.step(tube, DT, StepContext::alone(AgentId(0), SimTime::ZERO)).ok()?.work;
    }
    Some(start.elapsed().as_secs_f64() / work)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_integrator_has_a_price_and_implicit_euler_is_the_unit() {
        let prices = solve_prices();
        assert_eq!(prices.len(), Integrator::ALL.len());
        for (price, integrator) in prices.iter().zip(Integrator::ALL) {
            let unit = integrator == Integrator::ImplicitEuler;
            assert!(*price > 0.0 && price.is_finite() && (!unit || *price == 1.0), "{}: {price}", integrator.name());
        }
    }
}
