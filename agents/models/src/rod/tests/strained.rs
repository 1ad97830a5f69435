//! Tubes that their path strains at the start: bent by it, or twisted along it.

use super::*;
use std::f64::consts::TAU;

/// A tube of a metre between two clamps, twisted by `twist_rad`.
fn twisted(twist_rad: f64, segments: usize) -> TubeSpec {
    TubeSpec { twist_rad, clamp: [true, true], damping_per_s: 6.0, ..reference_spec(1e6, segments) }
}

#[test]
fn a_twisted_tube_holds_the_energy_of_its_twist() {
    let spec = twisted(2.0, 24);
    let wanted = 0.5 * spec.section.gj_n_m2 * 4.0;
    let mut tube = Tube::new(spec).unwrap();
    assert!((tube.energy_j() / wanted - 1.0).abs() < 1e-12, "{}", tube.energy_j());
    // far below the twist at which it buckles, 13 rad: nothing moves, but for rounding
    run(&mut tube, 10.0, 1.0);
    assert!((tube.energy_j() / wanted - 1.0).abs() < 1e-12, "{}", tube.energy_j());
}

#[test]
fn a_twist_that_one_clamp_cannot_hold_springs_back() {
    let mut tube = Tube::new(TubeSpec { clamp: [true, false], ..twisted(2.0, 24) }).unwrap();
    run(&mut tube, 10.0, 6.0);
    assert!(tube.energy_j() < 1e-9 * tube.spec().section.gj_n_m2, "{}", tube.energy_j());
}

/// A circle of a metre around.
fn circle() -> Vec<DVec3> {
    let at = |k: u32| TAU * f64::from(k) / 256.0;
    (0..=256).map(|k| DVec3::new(at(k).sin(), 1.0 - at(k).cos(), 0.0) / TAU).collect()
}

#[test]
fn a_straight_tube_bent_to_a_ring_holds_the_energy_of_its_bend_and_springs_back() {
    let ring = TubeSpec { path_m: circle(), straight: true, damping_per_s: 6.0, ..reference_spec(1e6, 48) };
    let wanted = 0.5 * ring.section.ei_n_m2 * TAU * TAU;
    let mut tube = Tube::new(ring).unwrap();
    // a free end has no joint: one in 48
    assert!((tube.energy_j() / wanted - 1.0 + 1.0 / 48.0).abs() < 1e-3, "{}", tube.energy_j() / wanted);
    run(&mut tube, 10.0, 6.0);
    let x = &tube.state().x;
    let reach = x[0].distance(*x.last().unwrap());
    assert!((reach - tube.length_m()).abs() < 2e-3, "{reach}"); // rest lengths are chords of the ring: (2π/48)²/24 less
}

#[test]
fn a_twist_survives_a_change_of_division() {
    let mut tube = Tube::new(twisted(3.0, 20)).unwrap();
    let before = tube.energy_j();
    for count in [60.0, 11.0, 33.0] {
        tube.set_resolution(Resolution { eps_m: 1.0 / count, n: 3 });
        assert!((tube.energy_j() / before - 1.0).abs() < 1e-12, "{count} segments: {}", tube.energy_j());
    }
    // no joint is ever turned past 60°, however coarse the division that is asked for
    tube.set_resolution(Resolution { eps_m: 1.0, n: 3 });
    assert!(tube.segments() >= 3 && (tube.energy_j() / before - 1.0).abs() < 1e-12);
}

#[test]
fn a_twist_that_no_tube_can_hold_is_refused() {
    let refused = Tube::new(twisted(1e4, 20)).unwrap_err().to_string();
    assert!(refused.contains("twist_rad") && refused.contains("10000"), "{refused}");
}
