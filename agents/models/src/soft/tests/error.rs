//! A soft body's estimate of its error in space, against a closed form.

use super::*;

fn snapshot(body: &SoftBody) -> Snapshot {
    let mut snapshot = Snapshot::default();
    body.write_snapshot(&mut snapshot);
    snapshot
}

#[test]
fn the_spatial_error_of_a_hanging_rope_is_estimated_within_a_factor_of_three() {
    for (span, segments) in [(0.5, 10), (0.5, 20), (0.5, 40), (0.8, 10), (0.8, 20), (0.8, 40)] {
        let low = DVec3::new(0.5 * span, 0.0, -0.5 * libm::sqrt(1.0 - span * span));
        let shape = SoftShape::Rope { path_m: vec![DVec3::ZERO, low, DVec3::X * span], radius_m: 0.005, segments };
        let material = SoftMaterial { young_pa: 1e8, damping_per_s: 20.0, ..MATERIAL };
        let held = vec![Side::Left, Side::Right];
        let mut body = SoftBody::new(SoftSpec { material, gravity: G, held, ..spec(shape) }).unwrap();
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
