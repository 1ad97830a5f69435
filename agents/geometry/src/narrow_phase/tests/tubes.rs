//! Tubes against tubes, solids and tools, by sampling.

use super::*;
use crate::near_segments;
use crate::solids::signed_distance::Field;

const RADII: [f64; 12] = [8e-3, 8.1e-3, 8.2e-3, 8.1e-3, 8e-3, 7.9e-3, 7.8e-3, 7.9e-3, 8e-3, 8.1e-3, 8.2e-3, 8.1e-3];

/// The least gap of two tubes, sampled: 40 balls a span against the other's 40.
fn sampled(a: &[DVec3], b: &[DVec3]) -> f64 {
    let balls = |nodes: &[DVec3]| -> Vec<(DVec3, f64)> {
        let inside = |k: usize, i: u32| {
            let s = f64::from(i) / 40.0;
            (nodes[k].lerp(nodes[k + 1], s), RADII[k] + (RADII[k + 1] - RADII[k]) * s)
        };
        (0..nodes.len() - 1).flat_map(|k| (0..=40).map(move |i| inside(k, i))).collect()
    };
    let (first, second) = (balls(a), balls(b));
    let pairs = first.iter().flat_map(|p| second.iter().map(move |q| p.0.distance(q.0) - p.1 - q.1));
    pairs.fold(f64::INFINITY, f64::min)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn tube_distance_agrees_with_sampling(a in crooked(12), b in crooked(12), off in vector(0.08)) {
        let b: Vec<_> = b.iter().map(|p| *p + off).collect();
        let form = chain();
        let (first, second) = (along(&form, &a, &RADII), along(&form, &b, &RADII));
        let expected = sampled(&a, &b);
        let (_, bound) = nearest(&first, &second, 1.0).unwrap();
        // samples are 0.6 mm apart at most: (0.3 mm)² / 2 / 16 mm, both ways, and more where axes cross
        prop_assert!(bound <= expected + 1e-12 && (bound > expected - 2e-5 || expected < -5e-3), "{bound} and {expected}");
        let found = all(&first, &second, 0.02);
        if expected < 0.0195 {
            // crossings that are nearer than nodes by less than a thousandth of the radii are left out; tapers lean
            prop_assert!(lowest(&found).gap_m < expected + 1e-4, "{} and {expected}", lowest(&found).gap_m);
        }
        prop_assert!(found.iter().all(|touch| adds_up(touch, &a, &b)));
        prop_assert!(found.iter().all(|touch| touch.gap_m >= bound));
    }

    #[test]
    fn every_foot_and_every_crossing_is_reported(a in crooked(12), b in crooked(12), off in vector(0.05)) {
        let b: Vec<_> = b.iter().map(|p| *p + off).collect();
        let form = chain();
        let found = all(&along(&form, &a, &RADII), &along(&form, &b, &RADII), 0.02);
        let is_told = |p: DVec3, q: DVec3| {
            let same = |touch: &Touch| axis(touch.on_a, &a).0.distance(p) + axis(touch.on_b, &b).0.distance(q) < 1e-9;
            found.iter().any(same)
        };
        for i in 0..11 {
            for j in 0..11 {
                let way = b[j + 1] - b[j];
                let t = (a[i] - b[j]).dot(way) / way.length_squared();
                let q = b[j].lerp(b[j + 1], t);
                // the radii are 7.8 mm at least
                let is_foot = (0.0..1.0).contains(&t) && a[i].distance(q) < 0.0156 + 0.02 - 1e-3;
                prop_assert!(!is_foot || is_told(a[i], q), "node {i}, span {j}");
                let (s, t) = near_segments([a[i], a[i + 1]], [b[j], b[j + 1]]);
                let (p, q) = (a[i].lerp(a[i + 1], s), b[j].lerp(b[j + 1], t));
                let crosses = [s, t].iter().all(|&share| share > 0.0 && share < 1.0);
                let lower = |touch: &Touch| touch.gap_m < p.distance(q) - 0.0156 + 2e-5 + 8e-4;
                prop_assert!(!crosses || p.distance(q) > 0.034 || is_told(p, q) || found.iter().any(lower));
            }
        }
    }

    #[test]
    fn tube_solid_distance_agrees_with_sampling(a in crooked(12), r in turn(), off in vector(0.06)) {
        let half = DVec3::new(0.02, 0.03, 0.04);
        let (tube, solids) = (chain(), [cuboid(half), cylinder(0.02, 0.04), hull(half)]);
        for form in &solids {
            let ShapeKind::Solid(SolidShape { solid, .. }) = &form.kind else { unreachable!() };
            let field = Field::of(solid).unwrap();
            let mut expected = f64::INFINITY;
            for k in 0..11 {
                for i in 0..=50 {
                    let s = f64::from(i) / 50.0;
                    let p = r.conjugate() * (a[k].lerp(a[k + 1], s) - off);
                    let radius = RADII[k] + (RADII[k + 1] - RADII[k]) * s;
                    let near = field.touches(p, 1.0).iter().next().unwrap();
                    expected = expected.min(near.distance_m - radius);
                }
            }
            let (tube, block) = (along(&tube, &a, &RADII), at(form, off, r));
            let (_, bound) = nearest(&tube, &block, 1.0).unwrap();
            // the hull counts spans at their widest radius: 1 mm; samples are 0.4 mm apart
            let slack = if matches!(solid, Solid::Hull { .. }) { 1.1e-3 } else { 2.1e-4 };
            prop_assert!(bound <= expected + 1e-9, "{solid:?}: {bound} and {expected}");
            prop_assert!(bound > expected - slack || expected < -6e-3, "{solid:?}: {bound} and {expected}");
            let found = all(&tube, &block, 0.02);
            prop_assert!(found.iter().all(|touch| adds_up(touch, &a, &[])));
            if expected < 0.019 && expected > -6e-3 {
                // a fiftieth of a span at each end, and single precision corners of the hull
                prop_assert!(lowest(&found).gap_m < expected + 5e-4, "{solid:?}: {} and {expected}", lowest(&found).gap_m);
            }
        }
    }
}

/// A helix that winds around z.
fn helix(segments: usize, phase: f64) -> Vec<DVec3> {
    let point = |i: usize| {
        let angle = 0.25 * i as f64 + phase;
        DVec3::new(0.06 * libm::cos(angle), 0.06 * libm::sin(angle), 0.006 * angle)
    };
    (0..=segments).map(point).collect()
}

#[test]
fn tested_pairs_grow_linearly_with_the_length_of_the_tubes() {
    let form = chain();
    let tried = |segments: usize| {
        let (a, b) = (helix(segments, 0.0), helix(segments, std::f64::consts::PI));
        let radii = vec![8e-3; segments + 1];
        let (mut scratch, mut found) = (NarrowPhaseScratch::default(), Vec::new());
        touches(&along(&form, &a, &radii), &along(&form, &b, &radii), 2e-3, &mut scratch, &mut found);
        assert!(found.len() > segments, "the strands of a double helix lie side by side");
        scratch.searches.chains.tried
    };
    let (short, long) = (tried(100), tried(400));
    assert!(long < 5 * short, "{short} pairs for 100 spans, {long} for 400");
    // all pairs would be 160 000
    assert!(long < 40_000, "{long}");
}

#[test]
fn tubes_far_apart_test_no_pairs() {
    let form = chain();
    let (a, radii) = (helix(400, 0.0), vec![8e-3; 401]);
    let b: Vec<_> = a.iter().map(|p| *p + DVec3::X).collect();
    let (mut scratch, mut found) = (NarrowPhaseScratch::default(), Vec::new());
    touches(&along(&form, &a, &radii), &along(&form, &b, &radii), 2e-3, &mut scratch, &mut found);
    assert!(found.is_empty() && scratch.searches.chains.tried == 0);
}

#[test]
fn shut_jaws_hold_a_tube_from_both_sides() {
    let (tube, grasper) = (chain(), tool());
    let nodes: Vec<_> = (-3..=3).map(|i| DVec3::Y * 0.01 * f64::from(i)).collect();
    let radii = [2e-3; 7];
    let held = |jaw: f64| {
        let view = ShapePose::Tool { tip: DVec3::ZERO, rotation: DQuat::IDENTITY, jaw };
        all(&along(&tube, &nodes, &radii), &PlacedShape { form: &grasper, view }, 1e-3)
    };
    assert!(held(1.0).is_empty(), "wide open they pass by");
    let shut = held(0.1);
    let side = |x: f64| shut.iter().any(|touch| touch.normal.x * x > 0.9 && touch.gap_m < 0.0);
    assert!(side(1.0) && side(-1.0), "{shut:?}");
}

#[test]
fn a_tube_lying_on_a_shaft_touches_its_side() {
    let (tube, grasper) = (chain(), tool());
    let nodes: Vec<_> = (-3..=3).map(|i| DVec3::new(0.01 * f64::from(i) + 1e-3, 4e-3 + 2.5e-3, -0.1)).collect();
    let view = ShapePose::Tool { tip: DVec3::ZERO, rotation: DQuat::IDENTITY, jaw: 0.0 };
    let found = all(&along(&tube, &nodes, &[4e-3; 7]), &PlacedShape { form: &grasper, view }, 1e-3);
    let touch = lowest(&found);
    assert!(touch.gap_m.abs() < 1e-7 && (touch.normal - DVec3::Y).length() < 1e-3, "{found:?}"); // parts are single precision
    assert!(axis(touch.on_b, &[]).0.distance(DVec3::new(0.0, 2.5e-3, -0.1)) < 1e-5);
}
