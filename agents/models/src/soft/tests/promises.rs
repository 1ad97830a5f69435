//! The promises of every agent, held against soft bodies.

use super::*;
use crate::conformance::fall_deviation;
use crate::conformance::{Suite, check};
use metachron_contact::AnchorSpring;
use metachron_core::Anchor;

#[test]
fn every_conformance_check_of_an_agent_passes() {
    for spec in all() {
        let make = || {
            let made = SoftBody::new(SoftSpec { gravity: G, ..spec.clone() }).unwrap();
            Box::new(made) as Box<dyn Agent>
        };
        let fall = |agent: &dyn Agent, t: f64| fall_deviation(agent, G, t);
        let pull = AnchorSpring {
            by: None,
            anchor: Anchor::Vertex(7),
            target: DVec3::new(0.1, 0.1, 0.1),
            target_velocity: DVec3::ZERO,
            stiffness_n_m: 10.0,
            damping_n_s_m: 0.1,
        };
        let absurd = [1e300, f64::NAN, f64::INFINITY].map(|x| AnchorSpring { target: DVec3::X * x, ..pull }).to_vec();
        let count = |f: &mut dyn FnMut()| allocation_counter::measure(f).count_total;
        let suite = Suite {
            steps: 60,
            pull: Some(pull),
            absurd,
            closed_form: Some((&fall, 1e-12)),
            allocations: Some((&count, 0.0)),
            ..Suite::new(&make, dt(0.005))
        };
        assert_eq!(check(&suite), [], "{:?}", spec.shape);
    }
}
