//! A tube's estimate of its own error, against independent answers.

use super::*;
use glam::DVec3;
use metachron_core::DRIFT_S;
use metachron_core::step_doubling::FIRST;

/// A clamped tube of 1 MPa, straight out, about to be let go.
fn let_go(integrator: Integrator, segments: usize, damping_per_s: f64) -> Tube {
    let mut spec = reference_spec(1e6, segments);
    (spec.integrator, spec.clamp, spec.gravity) = (integrator, [true, false], DVec3::NEG_Z * 9.81);
    spec.damping_per_s = damping_per_s;
    Tube::new(spec).unwrap()
}

/// The greatest distance of a node from its own in another tube.
fn apart(a: &Tube, b: &Tube) -> f64 {
    a.state().x.iter().zip(&b.state().x).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

/// A tube's estimate of the error of its steps in a tenth of a second, `seconds` after it was let go, and how far it is
/// from where another rule in fine steps takes the same state.
fn estimated_and_true(
    integrator: Integrator,
    (segments, dt_ms): (usize, f64),
    (damping, seconds): (f64, f64),
) -> [f64; 2] {
    let mut tube = let_go(integrator, segments, damping);
    run(&mut tube, dt_ms, seconds);
    let mut exact = tube.clone();
    exact.stepper.past.forget();
    exact.spec.integrator =
        if integrator == Integrator::EnergyMomentum { Integrator::Bdf2 } else { Integrator::EnergyMomentum };
    run(&mut exact, 0.2, DRIFT_S);
    tube.steps = FIRST; // the steps that come next are made twice
    run(&mut tube, dt_ms, DRIFT_S);
    [tube.doubling.error_m(), apart(&tube, &exact)]
}

#[test]
fn the_error_in_time_is_estimated_within_a_factor_of_five_and_mostly_of_two() {
    let mut ratios = vec![];
    for (integrator, spans) in [
        (Integrator::SymplecticEuler, &[0.4, 0.8][..]),
        (Integrator::ImplicitEuler, &[0.5, 1.0, 2.0, 4.0, 10.0]),
        (Integrator::Bdf2, &[1.0, 2.0, 4.0, 10.0]),
        (Integrator::EnergyMomentum, &[1.0, 2.0, 4.0, 10.0]),
    ] {
        for &dt_ms in spans {
            for motion in [(0.0, 0.1), (0.0, 0.2), (0.0, 0.4), (6.0, 0.1), (6.0, 0.3), (6.0, 0.6)] {
                let [said, truth] = estimated_and_true(integrator, (16, dt_ms), motion);
                let name = integrator.name();
                let ratio = said / truth;
                // the estimate is rather too great than too small: errors of two steps are partly taken back by others
                assert!(ratio > 1.0 / 3.0 && ratio < 5.0, "{name} {dt_ms} ms {motion:?}: {said} m for {truth} m");
                ratios.push(ratio);
            }
        }
    }
    ratios.sort_by(f64::total_cmp);
    let (median, tail) = (ratios[ratios.len() / 2], ratios[ratios.len() * 9 / 10]);
    println!("median {median:.2}, nine of ten below {tail:.2}, greatest {:.2}", ratios[ratios.len() - 1]);
    assert!((0.7..2.0).contains(&median) && tail < 2.5, "median {median}, nine of ten below {tail}");
}

#[test]
fn the_error_of_a_fall_is_that_of_the_closed_form() {
    for dt_ms in [1.0, 5.0, 20.0] {
        let mut spec = reference_spec(1e6, 16);
        spec.gravity = DVec3::NEG_Z * 9.81;
        let mut tube = Tube::new(spec).unwrap();
        tube.steps = FIRST;
        run(&mut tube, dt_ms, DRIFT_S);
        // x = g t (t + h)/2: half a step's speed too far
        let (said, truth) = (tube.doubling.error_m(), 0.5e-3 * 9.81 * dt_ms * DRIFT_S);
        assert!((said / truth - 1.0).abs() < 1e-6, "{dt_ms} ms: said {said} m, true {truth} m");
    }
}

#[test]
fn a_twenty_fourth_of_many_steps_is_repeated_and_nothing_else_changes() {
    for integrator in Integrator::ALL {
        let dt_ms = if integrator == Integrator::SymplecticEuler { 0.8 } else { 2.0 };
        let mut tube = Tube::new(carried(let_go(integrator, 16, 0.0).spec.clone(), dt_ms)).unwrap();
        let (mut unwatched, mut work, mut plain) = (tube.clone(), 0.0, 0.0);
        for _ in 0..960 {
            unwatched.steps = 0; // none of the first is made twice
            for (tube, work) in [(&mut tube, &mut work), (&mut unwatched, &mut plain)] {
                let context = StepContext::alone(AgentId(0), SimTime::ZERO);
                *work += tube.step(millis(dt_ms), &context).unwrap().work;
            }
        }
        let name = integrator.name();
        assert!(work > plain && work <= 1.05 * plain, "{name}: {work} of {plain}");
    }
}

#[test]
fn similar_tubes_do_not_repeat_their_steps_together() {
    let mut tubes = vec![let_go(Integrator::ImplicitEuler, 8, 0.0); 12];
    let mut repeated = [0; 240];
    for repeated in &mut repeated {
        // all move alike: a tube whose step takes more than the least of all makes it twice
        let step = |(tube, me): (&mut Tube, AgentId)| {
            tube.step(millis(2.0), &StepContext::alone(me, SimTime::ZERO)).unwrap().work
        };
        let work: Vec<f64> = tubes.iter_mut().zip((0..).map(AgentId)).map(step).collect();
        let least = work.iter().copied().fold(f64::INFINITY, f64::min);
        *repeated = work.iter().filter(|work| **work > least).count();
    }
    assert!(repeated[..FIRST as usize].iter().all(|count| *count == 0), "{repeated:?}");
    assert!(repeated.iter().all(|count| *count <= 1), "{repeated:?}");
    assert!(repeated.iter().sum::<usize>() >= 2 * 12, "{repeated:?}");
}

#[test]
fn a_repeated_step_leaves_the_bits_of_a_plain_one() {
    for integrator in Integrator::ALL {
        let mut tubes = [FIRST, FIRST + 1].map(|first| {
            let mut tube = Tube::new(carried(let_go(integrator, 16, 0.0).spec.clone(), 2.0)).unwrap();
            tube.steps = first; // the one watches its next two steps, the other none of these
            tube
        });
        for _ in 0..20 {
            tubes.iter_mut().for_each(|tube| {
                run(tube, 2.0, 2e-3);
            });
        }
        let [watched, other] = tubes;
        assert!(watched.doubling.error_m() > 0.0 && other.doubling.error_m() == 0.0);
        assert_eq!(watched.state().x, other.state().x, "{}", integrator.name());
        assert_eq!(watched.state().u, other.state().u, "{}", integrator.name());
    }
}
