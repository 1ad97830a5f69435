//! Rigid bodies slide down skins as down a plane: lines of the mesh are nothing to them.

use super::*;
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use crate::rod::Tube;
use crate::rod::{Material, Section, TubeSpec};
use metachron_geometry::Solid;

/// How long a slide is watched, from when to when, seconds: over 0.3 m and six lines of the mesh.
const WATCHED_S: [f64; 2] = [0.1, 0.55];

/// Gravity on a slope of 12° down x: tan 12° = 0.2126.
fn slope() -> DVec3 {
    let (sin, cos) = (libm::sin(12.0_f64.to_radians()), libm::cos(12.0_f64.to_radians()));
    DVec3::new(sin, 0.0, -cos) * 9.81
}

/// A strip of 60 × 20 cm in twelve cells, held by both of its long sides and so everywhere, its top in z = 0.
fn strip(shape: SoftShape, friction: f64) -> SoftSpec {
    let (corner, held) = match &shape {
        SoftShape::Sheet { thickness_m, .. } => {
            (DVec3::new(-0.2, -0.1, -0.5 * thickness_m), vec![Side::Near, Side::Far])
        }
        _ => (DVec3::new(-0.2, -0.1, -0.1), vec![Side::Bottom, Side::Top]),
    };
    SoftSpec { position: corner, held, friction, gravity: slope(), ..spec(shape) }
}

fn sheet() -> SoftShape {
    SoftShape::Sheet { size_m: [0.6, 0.2], thickness_m: 0.004, segments: [12, 1] }
}

fn block() -> SoftShape {
    SoftShape::Box { size_m: DVec3::new(0.6, 0.2, 0.1), segments: [12, 4, 1] }
}

/// What slides, 100 g that begin at x = −0.12 and 0.1 mm above z = 0.
fn slider(solid: Solid, height_m: f64, rotation: DQuat) -> RigidSpec {
    let position = DVec3::new(-0.12, 0.013, height_m + 1e-4);
    RigidSpec { gravity: slope(), friction: 1.0, rotation, ..RigidSpec::free(solid, position, 0.1) }
}

/// A box as the hull of its corners.
fn hull(half: DVec3) -> Solid {
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    Solid::Hull { points_m: (0..8).map(|i| half * DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect() }
}

fn cube() -> RigidSpec {
    slider(Solid::Box { half_extents_m: DVec3::new(0.03, 0.03, 0.02) }, 0.02, DQuat::IDENTITY)
}

/// How fast it gains speed down the slope in the mean of the watched time, m/s², with the rates of skin and slider, Hz.
fn gained(on: SoftSpec, slider: &RigidSpec, rates: (f64, f64)) -> f64 {
    let mut stage = Stage::new(Faults::default());
    stage.add(SoftBody::new(on).unwrap(), rates.0);
    let id = stage.add(RigidBody::new(slider.clone()).unwrap(), rates.1);
    let [early, late] = WATCHED_S.map(|time| {
        stage.run(time, |_| {});
        let state = stage.settled(id, time).state;
        println!("    {time} s: {:.4} moving {:.4}", state.position, state.velocity);
        state.velocity.x
    });
    (late - early) / (WATCHED_S[1] - WATCHED_S[0])
}

const RATES: [(f64, f64); 5] = [(60.0, 60.0), (240.0, 240.0), (1000.0, 1000.0), (240.0, 60.0), (60.0, 240.0)];

#[test]
fn without_friction_bodies_of_any_shape_slide_down_skins_as_down_a_plane() {
    let flat = DQuat::from_rotation_x(90.0_f64.to_radians());
    let sliders = [
        ("box", cube()),
        ("ball", slider(Solid::Ball { radius_m: 0.02 }, 0.02, DQuat::IDENTITY)),
        ("capsule across", slider(Solid::Capsule { radius_m: 0.02, half_height_m: 0.03 }, 0.02, flat)),
        ("hull", slider(hull(DVec3::new(0.03, 0.03, 0.02)), 0.02, DQuat::IDENTITY)),
        ("cylinder on its side", slider(Solid::Cylinder { radius_m: 0.02, half_height_m: 0.03 }, 0.02, flat)),
        ("cylinder", slider(Solid::Cylinder { radius_m: 0.03, half_height_m: 0.02 }, 0.02, DQuat::IDENTITY)),
    ];
    let mut worst = 0.0_f64;
    for shape in [sheet(), block()] {
        for (name, slider) in &sliders {
            for rates in RATES {
                let gained = gained(strip(shape.clone(), 0.0), slider, rates);
                println!("{} {name} {rates:?}: {gained:.4} of {:.4} m/s²", shape.model(), slope().x);
                worst = worst.max((gained / slope().x - 1.0).abs());
            }
        }
    }
    // at a line of the mesh a way may lean by a thousandth of an edge, 0.05 mm in 20: that takes of speed the square, once in six
    assert!(worst < 0.01, "off by {worst}");
}

#[test]
fn a_box_slides_over_the_lines_of_a_skin_as_coulomb_says() {
    let wanted = slope().x + 0.1 * slope().z;
    let mut worst = 0.0_f64;
    for shape in [sheet(), block()] {
        for rates in RATES {
            let gained = gained(strip(shape.clone(), 0.01), &cube(), rates);
            println!("{} {rates:?}: {gained:.4} of {wanted:.4} m/s²", shape.model());
            worst = worst.max((gained / wanted - 1.0).abs());
        }
    }
    assert!(worst < 0.01, "off by {worst}");
}

/// A tube of 10 cm and 12 mm, along the slope or across it, without friction or damping.
fn tube(way: DVec3) -> TubeSpec {
    let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let middle = DVec3::new(-0.12, 0.003, 0.0121);
    let ends = vec![middle - way * 0.05, middle + way * 0.05];
    let section = Section::hollow(0.012, 0.003, material);
    TubeSpec { friction: 0.0, damping_per_s: 0.0, gravity: slope(), ..TubeSpec::free(ends, section, 7) }
}

#[test]
fn without_friction_a_tube_slides_down_skins_as_down_a_plane() {
    let mut worst = 0.0_f64;
    for shape in [sheet(), block()] {
        for way in [DVec3::X, DVec3::Y] {
            for rates in RATES {
                let mut stage = Stage::new(Faults::default());
                stage.add(SoftBody::new(strip(shape.clone(), 0.0)).unwrap(), rates.0);
                let id = stage.add(Tube::new(tube(way)).unwrap(), rates.1);
                let at = [0.1, 0.3, 0.5].map(|time| {
                    stage.run(time, |_| {});
                    let Body::Curve(curve) = &stage.newest(id).body else { panic!("a tube") };
                    curve.positions.iter().map(|x| x.x).sum::<f64>() / curve.positions.len() as f64
                });
                let gained = (at[2] - 2.0 * at[1] + at[0]) / (0.2 * 0.2);
                println!("{} {way} {rates:?}: {gained:.4} of {:.4} m/s²", shape.model(), slope().x);
                worst = worst.max((gained / slope().x - 1.0).abs());
            }
        }
    }
    assert!(worst < 0.02, "off by {worst}");
}
