//! A wall that gives, against closed forms: Lamé's thick tube, Brazier's bent tube, a gas in a closed volume, the ends of a dent.

use super::*;
use metachron_contact::step::LoneStepper;
use std::f64::consts::PI;

const YOUNG_PA: f64 = 1e6;
const POISSON: f64 = 0.3;
const RADIUS_M: f64 = 0.01;

/// A straight tube of 0.2 m with a wall that gives, this thick.
fn giving(wall_m: f64, segments: usize) -> TubeSpec {
    let material = Material { young_pa: YOUNG_PA, poisson: POISSON, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    TubeSpec {
        wall: WallModel::Gives,
        damping_per_s: 20.0,
        ..TubeSpec::free(vec![DVec3::ZERO, DVec3::X * 0.2], Section::hollow(RADIUS_M, wall_m, material), segments)
    }
}

#[test]
fn pressure_widens_thin_and_thick_walls_by_lames_law() {
    for wall_m in [2e-4, 1e-3, 3e-3, 7e-3] {
        let (a2, b2) = ((RADIUS_M - wall_m).powi(2), RADIUS_M.powi(2));
        let pressure_pa = 2e-3 * YOUNG_PA * wall_m / RADIUS_M;
        let mut tube = Tube::new(TubeSpec { pressure_pa, ..giving(wall_m, 16) }).unwrap();
        run(&mut tube, 5.0, 2.0);
        // a closed tube: σ_θ = 2 p a²/(b² − a²) outside, σ_z = p a²/(b² − a²)
        let lame_m = pressure_pa * a2 * RADIUS_M * (2.0 - POISSON) / (YOUNG_PA * (b2 - a2));
        let widened_m = tube.radius_at_m(0.1) - RADIUS_M;
        assert!((widened_m / lame_m - 1.0).abs() < 1e-6, "{widened_m} m, not {lame_m} m"); // the law at rest, settled to rounding
    }
}

/// Bend energy of the middle half of a tube held at this curvature once its sections have settled, J/m, and their flattening over R.
fn bent(wall_m: f64, curvature_1_m: f64) -> (f64, f64) {
    let length_m = 0.2;
    let at = |s: f64| {
        let angle = curvature_1_m * (s - 0.5) * length_m;
        DVec3::new(libm::sin(angle), 0.0, 1.0 - libm::cos(angle)) / curvature_1_m
    };
    let path_m: Vec<DVec3> = (0..=64).map(|k| at(f64::from(k) / 64.0)).collect();
    let spec = TubeSpec { path_m, straight: true, clamp: [true, true], substeps: 1, ..giving(wall_m, 32) };
    let mut tube = Tube::new(spec).unwrap();
    run(&mut tube, 2.0, 1.0);
    let flat = tube.wall.as_ref().unwrap().now.shape[16];
    (tube.energy_j() / tube.length_m(), (flat.y * flat.y + flat.z * flat.z).sqrt() / (RADIUS_M - 0.5 * wall_m))
}

#[test]
fn a_bent_thin_tube_carries_braziers_moment_at_most() {
    let wall_m = 5e-4;
    let r = RADIUS_M - 0.5 * wall_m;
    let brazier_n_m = 2.0 * 2f64.sqrt() / 9.0 * PI * YOUNG_PA * r * wall_m * wall_m / (1.0 - POISSON * POISSON).sqrt();
    // Brazier's curvature there: κ² = 4 K f/(3 EI)
    let critical_1_m = (2f64.sqrt() / 3.0) * wall_m / (r * r * (1.0 - POISSON * POISSON).sqrt());
    let mut best = (0.0, 0.0);
    for k in 14..=24 {
        let curvature = critical_1_m * f64::from(k) / 20.0;
        let step = 0.01 * critical_1_m;
        let ((before, _), (after, _), (_, flat)) =
            (bent(wall_m, curvature - step), bent(wall_m, curvature + step), bent(wall_m, curvature));
        let moment = (after - before) / (2.0 * step);
        if moment > best.0 {
            best = (moment, flat);
        }
    }
    assert!((best.0 / brazier_n_m - 1.0).abs() < 0.05, "{} N m, Brazier {brazier_n_m}", best.0);
    assert!((best.1 * 4.5 - 1.0).abs() < 0.1, "flattening {}, Brazier 2/9", best.1);
}

#[test]
fn a_bend_past_braziers_moment_kinks() {
    let wall_m = 5e-4;
    let r = RADIUS_M - 0.5 * wall_m;
    let critical_1_m = (2f64.sqrt() / 3.0) * wall_m / (r * r * (1.0 - POISSON * POISSON).sqrt());
    // ends held at an angle between them, the rest free to find its shape: an arc of this mean curvature
    let bent = |share: f64| {
        let (length_m, curvature_1_m) = (0.4, share * critical_1_m);
        let at = |s: f64| {
            let angle = curvature_1_m * (s - 0.5) * length_m;
            DVec3::new(libm::sin(angle), 0.0, 1.0 - libm::cos(angle)) / curvature_1_m
        };
        let path_m: Vec<DVec3> = (0..=64).map(|k| at(f64::from(k) / 64.0)).collect();
        let spec = TubeSpec { path_m, straight: true, clamp: [true, true], ..giving(wall_m, 48) };
        let mut tube = Tube::new(spec).unwrap();
        run(&mut tube, 2.0, 4.0);
        let mut flat: Vec<f64> =
            tube.wall.as_ref().unwrap().now.shape.iter().map(|s| (s.y * s.y + s.z * s.z).sqrt() / r).collect();
        flat.sort_by(f64::total_cmp);
        [flat[24], flat[48]]
    };
    let [even, most] = bent(0.8);
    assert!(most < 1.3 * even, "below the moment the bend stays even: {even} and {most}");
    let [even, most] = bent(1.3);
    assert!(most > 3.0 * even, "past it the bend gathers in a kink: {even} and {most}");
}

/// How far the flattening of a tube under this share of the ring's critical outer pressure has grown after a second, in its first value.
fn growth(share: f64) -> f64 {
    let wall_m: f64 = 5e-4;
    let spec = giving(wall_m, 8);
    let plate_n_m = YOUNG_PA * wall_m.powi(3) / 12.0 / (1.0 - POISSON * POISSON);
    let critical_pa = 3.0 * plate_n_m / (RADIUS_M - 0.5 * wall_m).powi(3);
    let mut tube = Tube::new(TubeSpec { pressure_pa: -share * critical_pa, ..spec }).unwrap();
    tube.wall.as_mut().unwrap().now.shape.iter_mut().for_each(|shape| shape.y = 1e-6);
    run(&mut tube, 1.0, 1.0);
    tube.wall.as_ref().unwrap().now.shape[4].y / 1e-6
}

#[test]
fn a_thin_tube_collapses_under_the_critical_outer_pressure_of_a_ring() {
    let (below, above) = (growth(0.95), growth(1.05));
    assert!(below.abs() < 1.0 && above > 2.0, "{below} below the critical pressure, {above} above it"); // Lévy: p = 3 E'I/R³
}

#[test]
fn a_collapsed_tube_closes_and_goes_no_further() {
    let wall_m = 5e-4;
    let mut tube = Tube::new(TubeSpec { pressure_pa: -200.0, ..giving(wall_m, 8) }).unwrap();
    tube.wall.as_mut().unwrap().now.shape.iter_mut().for_each(|shape| shape.y = 1e-5);
    run(&mut tube, 1.0, 3.0);
    let shape = tube.wall.as_ref().unwrap().now.shape[4];
    let met_m = tube.wall.as_ref().unwrap().law.met_m(shape);
    // the pressure 3 π p c on a stiffness of π E': a few hundred thousandths of the radius
    assert!(met_m > 0.0 && met_m < 0.01 * RADIUS_M, "opposite walls have met by {met_m} m");
}

#[test]
fn a_sealed_tube_is_as_wide_as_its_gas_and_its_wall_agree() {
    let (wall_m, pressure_pa) = (1e-3, 2e4);
    let mut tube = Tube::new(TubeSpec { pressure_pa, sealed: true, ..giving(wall_m, 8) }).unwrap();
    run(&mut tube, 5.0, 2.0);
    let (a, b) = (RADIUS_M - wall_m, RADIUS_M);
    let widened_m = tube.radius_at_m(0.1) - RADIUS_M;
    // p from Lamé's law for this widening; the volume from the work that p does on it, dA/db = 2π a² b (2 − ν)/((1 − ν) b² + (1 + ν) a²)
    let held_pa = widened_m * YOUNG_PA * (b * b - a * a) / (a * a * b * (2.0 - POISSON));
    let slope_m = 2.0 * PI * a * a * b * (2.0 - POISSON) / ((1.0 - POISSON) * b * b + (1.0 + POISSON) * a * a);
    let product = (101_325.0 + held_pa) * (PI * a * a + slope_m * widened_m) / ((101_325.0 + pressure_pa) * PI * a * a);
    assert!((product - 1.0).abs() < 1e-6, "p V is {product} of what was shut in"); // settled to rounding
    assert!((tube.pressure_pa() / held_pa - 1.0).abs() < 1e-6 && held_pa < 0.9 * pressure_pa);
}

#[test]
fn pressure_set_while_it_runs_widens_the_tube() {
    let mut tube = Tube::new(giving(1e-3, 8)).unwrap();
    run(&mut tube, 5.0, 0.5);
    assert_eq!(tube.radius_at_m(0.1), RADIUS_M);
    tube.set_pressure_pa(300.0).unwrap();
    run(&mut tube, 5.0, 2.0);
    let blown = Tube::new(TubeSpec { pressure_pa: 300.0, ..giving(1e-3, 8) }).unwrap();
    let lame_m =
        300.0 * 0.009_f64.powi(2) * RADIUS_M * (2.0 - POISSON) / (YOUNG_PA * (0.01_f64.powi(2) - 0.009_f64.powi(2)));
    assert!((tube.radius_at_m(0.1) - RADIUS_M - lame_m).abs() < 1e-9 && blown.pressure_pa() == tube.pressure_pa());
    assert!(tube.set_pressure_pa(f64::NAN).is_err() && tube.pressure_pa() == 300.0);
}

#[test]
fn pressure_that_follows_keys_widens_the_tube_by_lames_law_at_each_of_them() {
    let key = |at_s: f64, pressure_pa: f64| PressureKey { at_s, pressure_pa };
    let keys = vec![key(0.2, 0.0), key(1.2, 300.0), key(2.2, 300.0), key(2.3, 100.0)];
    let mut tube = Tube::new(TubeSpec { pressure_keys: keys, sleep: true, ..giving(1e-3, 8) }).unwrap();
    let per_pa_m = 0.009_f64.powi(2) * RADIUS_M * (2.0 - POISSON) / (YOUNG_PA * (0.01_f64.powi(2) - 0.009_f64.powi(2)));
    let mut until_s = 0.0;
    // the tube does not sleep through later keys
    for (at_s, wanted_pa, share) in [(0.2, 0.0, 1e-9), (2.2, 300.0, 5e-3), (6.0, 100.0, 1e-4)] {
        run(&mut tube, 5.0, at_s - until_s);
        until_s = at_s;
        let widened_m = tube.radius_at_m(0.1) - RADIUS_M;
        let off_m = (widened_m - wanted_pa * per_pa_m).abs();
        assert!(off_m <= share * 300.0 * per_pa_m, "{widened_m} m at {at_s} s, not {} m", wanted_pa * per_pa_m);
        assert!((tube.pressure_pa() - wanted_pa).abs() < 1e-9 * 300.0, "{} Pa at {at_s} s", tube.pressure_pa());
    }
    // a pressure set by hand stays
    tube.set_pressure_pa(50.0).unwrap();
    run(&mut tube, 5.0, 0.5);
    assert_eq!(tube.pressure_pa(), 50.0);
    let back = TubeSpec { pressure_keys: vec![key(1.0, 0.0), key(1.0, 5.0)], ..giving(1e-3, 8) };
    assert!(matches!(Tube::new(back), Err(TubeError::OutOfRange(_))));
}

#[test]
fn pressure_that_follows_keys_is_as_if_set_by_hand_before_every_step() {
    let keys = vec![PressureKey { at_s: 0.0, pressure_pa: 0.0 }, PressureKey { at_s: 1.0, pressure_pa: 300.0 }];
    let mut led = Tube::new(TubeSpec { pressure_keys: keys, ..giving(1e-3, 8) }).unwrap();
    let mut by_hand = Tube::new(giving(1e-3, 8)).unwrap();
    let mut time = SimTime::ZERO;
    let dt = SimSpan::from_millis(5);
    for _ in 0..100 {
        by_hand.set_pressure_pa(300.0 * (time + dt).as_secs_f64()).unwrap();
        for tube in [&mut led, &mut by_hand] {
            LoneStepper::default().step(tube, dt, StepContext::alone(AgentId(0), time)).unwrap();
        }
        time += dt;
    }
    let radii_m = [&led, &by_hand].map(|tube| tube.radius_at_m(0.1));
    assert!((radii_m[0] - radii_m[1]).abs() < 1e-15 && radii_m[0] > 1.0003 * RADIUS_M, "{radii_m:?}");
}

#[test]
fn muscles_alone_narrow_a_tube_as_the_prescribed_wave_does_and_pressure_resists_them() {
    let wave = Peristalsis { amplitude: 0.3, wavelength_m: 0.1, speed_m_s: 0.01 };
    let narrowest = |wall: WallModel, pressure_pa: f64| {
        let spec = giving(1e-3, 40);
        let mut tube = Tube::new(TubeSpec { wall, pressure_pa, peristalsis: Some(wave), ..spec }).unwrap();
        run(&mut tube, 5.0, 2.0);
        // the wave's crest at 2 s
        tube.radius_at_m(0.12)
    };
    let (prescribed, free) = (narrowest(WallModel::Prescribed, 0.0), narrowest(WallModel::Gives, 0.0));
    // 10 mm/s along 100 mm is slow: the wall lags by its damping over its stiffness, and bends along the wave by less than 1e-3
    assert!((free / prescribed - 1.0).abs() < 0.01, "{free} m, prescribed {prescribed} m");
    let (blown, widened_m) = (narrowest(WallModel::Gives, 2000.0), 2000.0 / 200.0 * 1.449_474e-5);
    assert!(((blown - free) / widened_m - 1.0).abs() < 0.01, "{blown} m under pressure, {free} m without"); // Lamé's law
}

#[test]
fn a_wall_that_gives_makes_no_energy() {
    for (integrator, dt_ms) in
        [(Integrator::ImplicitEuler, 5.0), (Integrator::ImplicitEuler, 20.0), (Integrator::Bdf2, 5.0)]
    {
        let spec = TubeSpec { damping_per_s: 0.0, integrator, sealed: true, pressure_pa: 100.0, ..giving(5e-4, 12) };
        let mut tube = Tube::new(spec).unwrap();
        let mut random = Random(9);
        let now = &mut tube.wall.as_mut().unwrap().now;
        now.shape.iter_mut().for_each(|shape| *shape = random.vector() * 0.3 * RADIUS_M);
        now.rate.iter_mut().for_each(|rate| *rate = random.vector());
        tube.set_state(shake(&tube, 5));
        let mut before = tube.energy_j();
        let start = before;
        for _ in 0..200 {
            run(&mut tube, dt_ms, dt_ms * 1e-3);
            let after = tube.energy_j();
            // backward differences lose energy and regain some of it: never more than at the start
            let bound = if integrator == Integrator::ImplicitEuler { before } else { start };
            assert!(after <= bound + 1e-7 * start.abs(), "{}: {after} J after {before} J", integrator.name());
            before = after;
        }
    }
}

#[test]
fn a_load_at_one_place_dents_as_much_of_the_tube_as_its_wall_can_reach() {
    use metachron_contact::member::ClusterMember;
    use metachron_contact::solve::Response;
    let wall_m: f64 = 5e-4;
    let spec = giving(wall_m, 400);
    let mut tube = Tube::new(TubeSpec { damping_per_s: 0.0, ..spec }).unwrap();
    // in a step of a thousand seconds nothing is left of inertia: an impulse moves it as its force does
    let (h_s, load_n) = (1e3, 1e-3);
    tube.begin(h_s).unwrap();
    let first = tube.state().u.len();
    let mut impulses = vec![DVec3::ZERO; first + 401];
    impulses[first + 200].y = load_n * h_s;
    tube.respond(&mut impulses);
    let (plate_pa, r) = (YOUNG_PA / (1.0 - POISSON * POISSON), RADIUS_M - 0.5 * wall_m);
    let stiffness = 9.0 * PI * plate_pa * wall_m.powi(3) / (12.0 * r.powi(3));
    let along = PI * YOUNG_PA * wall_m * r.powi(3) / 16.0;
    let lambda = (stiffness / (4.0 * along)).powf(0.25);
    let at = |node: usize| impulses[first + node].y * h_s;
    let deepest_m = load_n * lambda / (2.0 * stiffness);
    // a beam on an elastic bed; the annulus is stiffer than its mid-wall ring where it is loaded from outside, by its thickness of 5 %
    assert!((at(200) / deepest_m - 1.0).abs() < 0.05, "{} m deep, the beam {deepest_m} m", at(200));
    for node in [220, 250, 280] {
        let x = lambda * 0.2 / 400.0 * (node - 200) as f64;
        let beam = libm::exp(-x) * (libm::cos(x) + libm::sin(x));
        assert!(
            (at(node) / at(200) - beam).abs() < 0.03,
            "{} of the deepest at λx = {x}, the beam {beam}",
            at(node) / at(200)
        );
    }
}
