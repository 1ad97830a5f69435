//! Every kind of shape against every other, brought together until they are this near: the nearest place is found, is as near as it is, and
//! both sides see the same; far from the origin and for shapes of a millimetre too.

use super::surfaces::{block_skin, flat_sheet, skin_of};
use super::*;

/// The shapes of all kinds at a scale, and where their nodes and vertices are in their own axes.
struct Cast {
    shapes: Vec<(&'static str, CollisionShape, Vec<DVec3>)>,
    radii: [f64; 7],
}

impl Cast {
    fn new(scale: f64) -> Self {
        let half = DVec3::new(0.02, 0.03, 0.04) * scale;
        let (sheet, flat) = flat_sheet();
        let (block, corners) = block_skin();
        let skin = |form: &CollisionShape, vertices, closed| {
            let ShapeKind::Surface(surface) = &form.kind else { unreachable!() };
            let mut form = skin_of(&surface.triangles, vertices, surface.radius_m * scale, closed);
            if let ShapeKind::Surface(surface) = &mut form.kind {
                surface.edge_m *= scale;
            }
            form
        };
        let mut grasper = tool();
        let ToolShape { shaft_radius_m, shaft_length_m } = ToolShape::default();
        grasper.kind = ShapeKind::Tool(ToolShape {
            shaft_radius_m: shaft_radius_m * scale,
            shaft_length_m: shaft_length_m * scale,
        });
        let scaled = |points: &[DVec3]| points.iter().map(|x| *x * scale).collect::<Vec<_>>();
        let nodes: Vec<_> =
            (-3..=3).map(|i| DVec3::new(0.02 * f64::from(i), 0.002 * f64::from(i * i), 0.0) * scale).collect();
        let shapes = vec![
            ("ball", ball(0.03 * scale), vec![]),
            ("capsule", capsule(0.02 * scale, 0.04 * scale), vec![]),
            ("box", cuboid(half), vec![]),
            ("cylinder", cylinder(0.02 * scale, 0.04 * scale), vec![]),
            ("hull", hull(half), vec![]),
            ("chain", chain(), nodes),
            ("tool", grasper, vec![]),
            ("sheet", skin(&sheet, 25, false), scaled(&flat)),
            ("block", skin(&block, 8, true), scaled(&corners)),
        ];
        Self { shapes, radii: [5e-3 * scale; 7] }
    }
}

/// Deterministic numbers in −1 … 1.
struct Random(u64);

impl Random {
    fn vector(&mut self) -> DVec3 {
        let mut next = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        DVec3::new(next(), next(), next())
    }

    fn turn(&mut self) -> DQuat {
        DQuat::from_rotation_arc(self.vector().normalize(), self.vector().normalize())
    }
}

/// By how much the lowest place may be above the nearest, in sizes of a metre: a span leaves its lowest place within a fiftieth of its end to
/// that end, tubes a crossing that is nearer by a thousandth of their radii to their nodes, and a face of a skin to its corners.
fn slack(names: [&str; 2]) -> f64 {
    let is_span = |name: &str| matches!(name, "capsule" | "chain");
    let is_round = |name: &str| matches!(name, "ball" | "capsule" | "chain");
    if names.iter().any(|name| is_span(name)) && !names.iter().all(|name| is_round(name)) {
        return 1e-4;
    }
    let leaves = |name: &str| matches!(name, "sheet" | "block" | "chain");
    if names.iter().any(|name| leaves(name)) { 3e-5 } else { 2e-6 }
}

fn all_pairs_agree(scale: f64, origin: DVec3, gap_m: f64) {
    let Cast { shapes, radii } = Cast::new(scale);
    let mut random = Random(7);
    let mut tried = 0;
    for (name, one, first) in &shapes {
        for (other, two, second) in &shapes {
            for _ in 0..6 {
                let (r, s, way) = (random.turn(), random.turn(), random.vector().normalize());
                let to = origin + random.vector() * (0.03 * scale);
                let from = to - way * (0.6 * scale);
                let moved = |points: &[DVec3], at: DVec3, turn: DQuat| points.iter().map(|x| at + turn * *x).collect();
                let (a0, a1): (Vec<_>, Vec<_>) = (moved(first, from, r), moved(first, to, r));
                let b0: Vec<_> = moved(second, origin, s);
                let of = |form, points, at, turn| super::swept::placed(form, points, &radii, (at, turn));
                let a = SweptShape { start: of(one, &a0, from, r), end: of(one, &a1, to, r) };
                let b = of(two, &b0, origin, s);
                let mut scratch = NarrowPhaseScratch::default();
                let share = first_touch(
                    &a,
                    &SweptShape { start: b, end: b },
                    SweptReach { reach_m: gap_m, around_m: 1e-4 },
                    &mut scratch,
                    &mut Vec::new(),
                );
                let Some(share) = share.filter(|share| *share > 0.0) else { continue };
                let mut room = Default::default();
                let a = a.within(share, &mut room).unwrap();
                let (seen, back) = (all(&a, &b, 3.0 * gap_m), all(&b, &a, 3.0 * gap_m));
                tried += 1;
                let pair = format!("{name} and {other} at {share}: {seen:?}");
                assert!(!seen.is_empty(), "{pair}");
                // a first touch is reported up to a micrometre early
                let above_m = lowest(&seen).gap_m - gap_m;
                assert!(above_m > -1e-9 && above_m < 1.1e-6 + slack([name, other]) * scale, "{above_m} {pair}");
                assert!((lowest(&back).gap_m - lowest(&seen).gap_m).abs() < 1e-8, "{pair} {back:?}");
                for found in [&seen, &back] {
                    assert!(found.windows(2).all(|pair| pair[0].key < pair[1].key), "{pair}");
                    assert!(found.iter().all(|touch| (touch.normal.length() - 1.0).abs() < 1e-9), "{pair}");
                }
                // of two blocks of one size the first is clipped by the second
                if (name, other) != (&"cylinder", &"cylinder") {
                    assert_eq!(seen.len(), back.len(), "{pair} {back:?}");
                    let mirrored =
                        |m: &Touch, n: &Touch| (m.gap_m - n.gap_m).abs() < 1e-8 && m.normal.distance(-n.normal) < 1e-6;
                    assert!(seen.iter().all(|m| back.iter().any(|n| mirrored(m, n))), "{pair} {back:?}");
                }
            }
        }
    }
    assert!(tried > 300, "{tried}");
}

#[test]
fn all_kinds_touch_all_kinds_at_their_true_gap() {
    all_pairs_agree(1.0, DVec3::ZERO, 2e-4);
}

#[test]
fn all_kinds_touch_all_kinds_a_kilometre_from_the_origin() {
    all_pairs_agree(1.0, DVec3::new(1e3, -0.7e3, 0.3e3), 2e-4);
}

#[test]
fn all_kinds_touch_all_kinds_at_sizes_of_a_millimetre() {
    all_pairs_agree(0.02, DVec3::ZERO, 1e-5);
}
