//! A soft body's estimate of its own error, against closed forms and the same body in fine steps.

use super::*;
use metachron_core::DRIFT_S;
use metachron_core::step_doubling::FIRST;

fn snapshot(body: &SoftBody) -> Snapshot {
    let mut snapshot = Snapshot::default();
    body.write_snapshot(&mut snapshot);
    snapshot
}

/// The greatest distance of a vertex from its own in another body.
fn apart(a: &SoftBody, b: &SoftBody) -> f64 {
    a.positions.iter().zip(&b.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

#[test]
fn the_error_of_falling_is_that_of_the_closed_form() {
    for spec in all() {
        for dt_s in [1e-3, 5e-3, 2e-2] {
            let mut body = SoftBody::new(SoftSpec { gravity: G, ..spec.clone() }).unwrap();
            body.steps = FIRST;
            run(&mut body, dt_s, (DRIFT_S / dt_s).round() as u32);
            // x = g t (t + h)/2: half a step's speed too far
            let truth = 0.5 * 9.81 * dt_s * DRIFT_S;
            let estimated = snapshot(&body).drift_m;
            assert!((estimated / truth - 1.0).abs() < 1e-6, "{dt_s} s: said {estimated} m, true {truth} m");
        }
    }
}

#[test]
fn the_error_of_a_swing_is_estimated_within_a_factor_of_three_but_for_immediate_reversals() {
    // a solid turns round within the tenth of a second: two steps tell too little of that
    let ends = vec![Side::Left, Side::Right];
    let cases = [
        (rope(), 1e6, vec![Side::Left], 1.0 / 3.0),
        (SHEET, 1e5, ends, 1.0 / 3.0),
        (solid(), 1e5, vec![Side::Left], 1.0 / 6.0),
    ];
    for (shape, young_pa, held, least) in cases {
        for dt_s in [1e-3, 2e-3, 5e-3, 1e-2] {
            let made = || {
                let matter = SoftMatter { young_pa, ..MATTER };
                let spec = SoftSpec { matter, gravity: G, held: held.clone(), ..spec(shape.clone()) };
                let mut body = SoftBody::new(spec).unwrap();
                run(&mut body, 2e-3, 100);
                body
            };
            let (mut coarse, mut fine) = (made(), made());
            coarse.steps = FIRST; // the steps that come next are made twice
            run(&mut coarse, dt_s, (DRIFT_S / dt_s).round() as u32);
            run(&mut fine, 5e-5, 2000);
            let (estimated, truth) = (snapshot(&coarse).drift_m, apart(&coarse, &fine));
            let ratio = estimated / truth;
            println!("{} {dt_s} s: said {estimated:e}, true {truth:e}, {ratio:.2}", shape.model());
            assert!(ratio > least && ratio < 3.0, "{} {dt_s} s: said {estimated} m, true {truth} m", shape.model());
        }
    }
}

#[test]
fn one_step_in_twenty_four_is_repeated_for_its_error() {
    for spec in all() {
        let mut body = shaken(spec);
        let (mut work, mut plain) = (0.0, 0.0);
        for _ in 0..960 {
            let report = body.step(dt(1e-3), &StepContext::alone(AgentId(0), SimTime::ZERO)).unwrap();
            work += report.work;
            plain += body.work() * f64::from(report.substeps);
        }
        assert!(work > plain && work <= 1.05 * plain, "{work} of {plain}");
    }
}

#[test]
fn the_spatial_error_of_a_hanging_rope_is_estimated_within_a_factor_of_three() {
    for (span, segments) in [(0.5, 10), (0.5, 20), (0.5, 40), (0.8, 10), (0.8, 20), (0.8, 40)] {
        let low = DVec3::new(0.5 * span, 0.0, -0.5 * libm::sqrt(1.0 - span * span));
        let shape = SoftShape::Rope { path_m: vec![DVec3::ZERO, low, DVec3::X * span], radius_m: 0.005, segments };
        let matter = SoftMatter { young_pa: 1e8, damping_per_s: 20.0, ..MATTER };
        let held = vec![Side::Left, Side::Right];
        let mut body = SoftBody::new(SoftSpec { matter, gravity: G, held, ..spec(shape) }).unwrap();
        run(&mut body, 0.02, 1000);
        let (estimated, truth) = (snapshot(&body).residual_m, off_the_catenary(&body.positions, span));
        let ratio = estimated / truth;
        println!("span {span}, {segments} pieces: said {estimated:e}, true {truth:e}, {ratio:.2}");
        assert!(ratio > 1.0 / 3.0 && ratio < 3.0, "span {span}, {segments} pieces: said {estimated} m, true {truth} m");
    }
}

/// How far a polyline of length 1 between (0, 0) and (span, 0) is anywhere from the catenary's point of the same arc length.
fn off_the_catenary(line: &[DVec3], span: f64) -> f64 {
    // 2 a sinh(span/2a) = 1, by bisection
    let (mut low, mut high) = (1e-3, 10.0);
    for _ in 0..200 {
        let a = 0.5 * (low + high);
        let length = 2.0 * a * libm::sinh(0.5 * span / a);
        (low, high) = if length > 1.0 { (a, high) } else { (low, a) };
    }
    let curve = |s: f64| {
        let x = low * libm::asinh((s - 0.5) / low) + 0.5 * span;
        DVec3::new(x, 0.0, libm::hypot(low, s - 0.5) - libm::hypot(low, 0.5))
    };
    let pieces = (line.len() - 1) as f64;
    let point = |i: u32| {
        let s = f64::from(i) / 400.0;
        let at = ((s * pieces) as usize).min(line.len() - 2);
        line[at].lerp(line[at + 1], s * pieces - at as f64).distance(curve(s))
    };
    (0..=400).map(point).fold(0.0, f64::max)
}
