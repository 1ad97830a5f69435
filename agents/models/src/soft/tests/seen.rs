//! A change of ε in the picture: a skin stays where it is, and goes where its new nodes carry it too slowly to be seen to jump.

use super::*;
use crate::soft::NodeSpacing;
use metachron_core::Resolution;
use metachron_drawable::{Generator, generate_surface};

const FRAME_S: f64 = 1.0 / 60.0;

/// A body of a scene, at rest under its weight at its finest ε, and how wide a pixel of that scene's picture of 1280 × 720 is where the body is
/// nearest, metres.
struct Pictured {
    spec: SoftSpec,
    range_m: (f64, f64),
    pixel_m: f64,
}

/// The width of a pixel of a picture of 720 rows that are `fov_deg` high, at a distance, metres.
fn pixel_m(distance_m: f64, fov_deg: f64) -> f64 {
    2.0 * distance_m * libm::tan(0.5 * fov_deg.to_radians()) / 720.0
}

/// The liver of `organ`, the sheet of `mesentery`, and the rope of `catenary` with spacings of its own.
fn pictured() -> [Pictured; 3] {
    let material =
        |young_pa, poisson| SoftMaterial { young_pa, poisson, damping_per_s: 4.0, damping_s: 0.004, ..MATERIAL };
    let of = |shape, held, material| SoftSpec { material, held, gravity: G, ..spec(shape) };
    let nodes = |range_m: (f64, f64)| Some(NodeSpacing { eps_m: range_m.0, range_m });
    let liver = generate_surface(Generator::Liver, 0, 4000);
    let points = liver.points.iter().map(|point| *point * 0.1).collect();
    let surface = Arc::new(Triangles { points, ..liver });
    let organ_m = (0.0135, 0.0165);
    let organ = SoftShape::Embedded { surface, eps_m: organ_m.0, range_m: organ_m };
    let sheet = SoftShape::Sheet { size_m: [0.32, 0.1], thickness_m: 0.001, segments: [32, 10] };
    let path_m = [[-0.1, 0.2], [0.0, 0.09], [0.1, 0.2]].map(|[x, z]| DVec3::new(x, -0.02, z)).to_vec();
    let rope = SoftShape::Rope { path_m, radius_m: 0.0015, segments: 40 };
    let [sheet_m, rope_m] = [(0.01, 0.04), (0.0075, 0.03)];
    let upright = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    [
        Pictured {
            spec: of(organ, vec![Side::Bottom], material(8e3, 0.45)),
            range_m: organ_m,
            pixel_m: pixel_m(0.38, 34.0),
        },
        Pictured {
            spec: SoftSpec {
                nodes: nodes(sheet_m),
                rotation: upright,
                ..of(sheet, vec![Side::Far], material(8e4, 0.4))
            },
            range_m: sheet_m,
            pixel_m: pixel_m(0.45, 38.0),
        },
        Pictured {
            spec: SoftSpec { nodes: nodes(rope_m), ..of(rope, vec![Side::Left, Side::Right], material(2e6, 0.3)) },
            range_m: rope_m,
            pixel_m: pixel_m(0.38, 36.0),
        },
    ]
}

#[test]
fn no_point_of_a_skin_moves_by_half_a_pixel_in_a_frame_where_its_spacing_changes() {
    for Pictured { spec, range_m, pixel_m } in pictured() {
        let mut body = SoftBody::new(spec).unwrap();
        run(&mut body, FRAME_S, 180);
        for eps_m in [range_m.1, range_m.0] {
            let mut seen = body.seen().to_vec();
            body.set_resolution(Resolution { eps_m, n: 0 });
            assert!(seen.iter().zip(body.seen()).all(|(was, now)| was.distance(*now) < 1e-12), "{}", body.model());
            let mut most = 0.0_f64;
            for _ in 0..90 {
                run(&mut body, FRAME_S, 1);
                let moved = seen.iter().zip(body.seen()).map(|(was, now)| was.distance(*now)).fold(0.0, f64::max);
                most = most.max(moved / pixel_m);
                seen = body.seen().to_vec();
            }
            println!("{} to {eps_m} m: {most} pixels in a frame, {} nodes", body.model(), body.nodes());
            assert!(most < 0.5, "{} to {eps_m} m: {most} pixels in a frame", body.model());
        }
    }
}
