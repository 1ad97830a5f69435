//! Balls, capsules and boxes against closed forms in double precision.

use super::*;

/// The least of a convex function of a share, by thirds.
fn least(f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let (p, q) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if f(p) < f(q) { high = q } else { low = p }
    }
    f(0.5 * (low + high))
}

/// The signed distance of a point from a box around the origin.
fn from_box(p: DVec3, half: DVec3) -> f64 {
    let beyond = p.abs() - half;
    if beyond.max_element() < 0.0 { beyond.max_element() } else { beyond.max(DVec3::ZERO).length() }
}

fn ends(position: DVec3, rotation: DQuat, half: f64) -> [DVec3; 2] {
    [-1.0, 1.0].map(|side| position + rotation * DVec3::Z * (side * half))
}

proptest! {
    #[test]
    fn ball_distance_is_that_of_their_centres(p in vector(0.3), q in vector(0.3), turns in turn()) {
        let (a, b) = (ball(0.05), ball(0.07));
        let found = all(&at(&a, p, turns), &at(&b, q, turns), 1.0);
        prop_assert_eq!(found.len(), 1);
        prop_assert!((found[0].gap_m - (p.distance(q) - 0.12)).abs() < 1e-15); // one rounding of numbers below 1
        prop_assert!((found[0].normal - (p - q).normalize()).length() < 1e-12);
        prop_assert!(adds_up(&found[0], &[], &[]));
        let (normal, gap_m) = nearest(&at(&a, p, turns), &at(&b, q, turns), 1.0).unwrap();
        prop_assert!(gap_m == found[0].gap_m && normal == found[0].normal);
    }

    #[test]
    fn ball_box_distance_is_exact(p in vector(0.4), q in vector(0.2), turns in turn()) {
        let half = DVec3::new(0.1, 0.15, 0.2);
        let (round, block) = (ball(0.05), cuboid(half));
        let (a, b) = (at(&round, p, DQuat::IDENTITY), at(&block, q, turns));
        let expected = from_box(turns.conjugate() * (p - q), half) - 0.05;
        let found = all(&a, &b, 2.0);
        prop_assert_eq!(found.len(), 1);
        prop_assert!((found[0].gap_m - expected).abs() < 1e-14); // tens of roundings of numbers below 1
        prop_assert!(adds_up(&found[0], &[], &[]));
        prop_assert!((nearest(&a, &b, 2.0).unwrap().1 - expected).abs() < 1e-14);
    }

    #[test]
    fn capsule_distance_is_that_of_their_axes(p in vector(0.2), q in vector(0.2), r in turn(), s in turn()) {
        let (first, second) = (capsule(0.03, 0.1), capsule(0.02, 0.15));
        let (u, v) = (ends(p, r, 0.1), ends(q, s, 0.15));
        let from_axis = |x: DVec3| least(|t| x.distance(v[0].lerp(v[1], t)));
        let expected = least(|t| from_axis(u[0].lerp(u[1], t))) - 0.05;
        let (a, b) = (at(&first, p, r), at(&second, q, s));
        let found = all(&a, &b, 1.0);
        // thirds stop where the square of the share's error drowns: 1e-8 squared, times curvatures near 10 per metre
        prop_assert!((lowest(&found).gap_m - expected).abs() < 1e-12, "{} and {expected}", lowest(&found).gap_m);
        prop_assert!(found.iter().all(|touch| adds_up(touch, &[], &[])));
        let (normal, gap_m) = nearest(&a, &b, 1.0).unwrap();
        prop_assert!((gap_m - expected).abs() < 1e-12);
        prop_assert!(expected < -0.045 || normal.dot(lowest(&found).normal) > 1.0 - 1e-9);
    }

    #[test]
    fn a_capsule_touches_a_box_where_its_axis_is_lowest(p in vector(0.3), r in turn(), s in turn()) {
        let half = DVec3::new(0.1, 0.15, 0.2);
        let (round, block) = (capsule(0.03, 0.1), cuboid(half));
        let axis = ends(p, r, 0.1);
        let expected = least(|t| from_box(s.conjugate() * axis[0].lerp(axis[1], t), half)) - 0.03;
        let (a, b) = (at(&round, p, r), at(&block, DVec3::ZERO, s));
        let found = all(&a, &b, 1.0);
        // within a fiftieth of its end a span leaves its lowest place to that end: 0.02 · 0.2 m of slope 1 at most
        prop_assert!((0.0..4e-3).contains(&(lowest(&found).gap_m - expected + 1e-9)), "{} and {expected}", lowest(&found).gap_m);
        prop_assert!(found.iter().all(|touch| adds_up(touch, &[], &[])));
        let (_, gap_m) = nearest(&a, &b, 1.0).unwrap();
        // never more, and a millionth of 0.2 m less, twice
        prop_assert!(gap_m <= expected + 1e-12 && gap_m > expected - 5e-7, "{gap_m} and {expected}");
    }
}

#[test]
fn capsules_side_by_side_touch_at_both_ends_of_their_common_stretch() {
    let form = capsule(0.02, 0.1);
    let beside = DVec3::new(0.041, 0.0, 0.05);
    let found = all(&at(&form, beside, DQuat::IDENTITY), &at(&form, DVec3::ZERO, DQuat::IDENTITY), 0.01);
    let heights: Vec<f64> = found.iter().map(|touch| axis(touch.on_a, &[]).0.z).collect();
    assert_eq!(heights.len(), 2, "{found:?}");
    assert!(heights.iter().any(|z| (z + 0.05).abs() < 1e-12) && heights.iter().any(|z| (z - 0.1).abs() < 1e-12));
    assert!(found.iter().all(|touch| (touch.gap_m - 0.001).abs() < 1e-12 && touch.normal.x > 1.0 - 1e-12));
}

#[test]
fn a_capsule_flat_on_a_smaller_box_touches_both_edges() {
    let (rod, block) = (capsule(0.01, 0.2), cuboid(DVec3::splat(0.03)));
    let lying = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    for tilt in [0.0, 1e-5, -1e-5] {
        let rotation = DQuat::from_rotation_y(tilt) * lying;
        let found =
            all(&at(&rod, DVec3::new(0.01, 0.0, 0.04), rotation), &at(&block, DVec3::ZERO, DQuat::IDENTITY), 1e-3);
        for edge in [-0.03, 0.03] {
            // where the gap has risen by 2e-3 of the radius the place is √(2 · 2e-3) radii past the edge
            let near = |touch: &Touch| (axis(touch.on_b, &[]).0.x - edge).abs() < 1e-3 && touch.gap_m.abs() < 3e-5;
            assert!(found.iter().any(near), "tilt {tilt}, edge {edge}: {found:?}");
        }
    }
}
