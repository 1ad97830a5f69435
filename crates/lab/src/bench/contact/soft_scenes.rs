//! The scenes of `bench contact` with soft bodies: piles on cubes, solids under a plate, ropes, a bin of unlike bodies.
//!
//! In: sizes, seeds. Out: stages. Never here: rigid bodies alone, measurements.

use super::super::super::chart::GRAVITY;
use super::super::soft::bodies::{self, cube, falling_sheet};
use super::rigid_scenes::STEP_S;
use super::stage::{Body, Stage, block, drawn, rigid, walls};
use glam::{DQuat, DVec3};
use metachron_geometry::Solid;
use metachron_models::rigid::RigidSpec;
use metachron_models::rod::{Material, Section, TubeSpec};
use metachron_models::soft::{MaterialLaw, SoftMaterial, SoftShape, SoftSpec};

/// A soft body of the bodies of `agents/models/tests/clusters`.
fn soft(shape: SoftShape, position: DVec3, young_pa: f64) -> SoftSpec {
    let material = SoftMaterial {
        young_pa,
        poisson: 0.3,
        density_kg_m3: 1000.0,
        damping_per_s: 0.0,
        damping_s: 0.0,
        law: MaterialLaw::Corotational,
    };
    bodies::soft(shape, material, position)
}

fn solid(middle: DVec3, size_m: DVec3, segments: [u32; 3], young_pa: f64) -> SoftSpec {
    soft(SoftShape::Box { size_m, segments }, middle - size_m * 0.5, young_pa)
}

fn rope(middle: DVec3, half: DVec3, segments: u32) -> SoftSpec {
    let path_m = vec![-half, half];
    soft(SoftShape::Rope { path_m, radius_m: 0.006, segments }, middle, 1e6)
}

/// Boxes on and around a soft cube, one of 20 kg on top.
pub(super) fn soft_pile(boxes: usize, cells: u32) -> Stage {
    let middle = DVec3::Z * 0.1002;
    let mut bodies = vec![Body::Soft(solid(middle, DVec3::splat(0.2), [cells; 3], 1e5))];
    let (mut layer, mut left) = (0, boxes);
    while left > 0 {
        let z = 0.0204 + 0.0412 * f64::from(layer);
        for ring in 0..100_u32 {
            let [x, y] = [ring % 10, ring / 10].map(|v| (f64::from(v) - 4.5) * 0.0445);
            if z < 0.225 && x.abs() < 0.125 && y.abs() < 0.125 || left == 0 {
                continue;
            }
            let shift = DVec3::new(drawn(left, 0), drawn(left, 1), 0.0) * 0.001;
            bodies.push(block(DVec3::new(x, y, z) + shift, DVec3::splat(0.02), 0.05, 0.06 * drawn(left, 2)));
            left -= 1;
        }
        layer += 1;
    }
    let top = DVec3::Z * (0.0204 + 0.0412 * f64::from(layer) + 0.032);
    bodies.push(block(top, DVec3::splat(0.05), 20.0, 0.2));
    Stage::on_floor(bodies, STEP_S, 0.5)
}

/// A limp sheet that falls on its lower edge and folds on itself.
pub(super) fn sheet(cells: u32) -> Stage {
    Stage::on_floor(vec![Body::Soft(falling_sheet(cells))], 1.0 / 480.0, 0.5)
}

/// A cube of tissue on a floor that is shaken.
pub(super) fn shaken(cells: u32) -> Stage {
    Stage::apart(vec![Body::Soft(cube(cells)), Body::ShakenFloor], 0.01)
}

/// Four solids under a plate.
pub(super) fn four(cells: [u32; 3]) -> Stage {
    let solids = [(-0.1, -0.07), (0.1, -0.07), (-0.1, 0.07), (0.1, 0.07)]
        .map(|(x, y)| Body::Soft(solid(DVec3::new(x, y, 0.0302), DVec3::new(0.18, 0.12, 0.06), cells, 1e5)));
    let plate = block(DVec3::Z * 0.0656, DVec3::new(0.2, 0.14, 0.005), 2.0, 0.05);
    Stage::on_floor(solids.into_iter().chain([plate]).collect(), STEP_S, 0.5)
}

/// Layers of ropes across each other.
pub(super) fn ropes(count: u32, layers: u32) -> Stage {
    let half_m = 0.015 * f64::from(count) + 0.02;
    let mut bodies = Vec::new();
    for layer in 0..layers {
        for k in 0..count {
            let place_m = (f64::from(k) - 0.5 * f64::from(count - 1)) * 0.03;
            let height = DVec3::Z * (0.0061 + 0.0121 * f64::from(layer));
            let (along, across) = if layer % 2 == 0 { (DVec3::X, DVec3::Y) } else { (DVec3::Y, DVec3::X) };
            bodies.push(Body::Soft(rope(height + across * place_m, along * half_m, 2 * count + 2)));
        }
    }
    Stage::on_floor(bodies, STEP_S, 0.5)
}

/// Rates of the bodies of a bin, Hz.
const RATES_HZ: [f64; 8] = [30.0, 60.0, 60.0, 100.0, 120.0, 240.0, 240.0, 500.0];

/// Twelve unlike bodies, four a layer, that fall into a bin of 0.4 m.
pub(super) fn bin(seed: u64) -> Stage {
    let mut draw = Draw(seed);
    let bodies = (0..12).map(|at| {
        let corner =
            DVec3::new(if at % 2 == 0 { -0.098 } else { 0.098 }, if at / 2 % 2 == 0 { -0.098 } else { 0.098 }, 0.0);
        let bottom_m = 0.005 + 0.11 * f64::from(at / 4);
        unlike(&mut draw, corner + DVec3::Z * bottom_m)
    });
    let bodies: Vec<_> = bodies.collect();
    let bodies = bodies.into_iter().map(|body| (body, RATES_HZ[draw.below(RATES_HZ.len())].recip()));
    let mut stage = Stage::on_floor(Vec::new(), STEP_S, 0.5);
    stage.bodies = bodies.collect();
    stage.obstacles.extend(walls(0.2, 0.02, 0.3));
    stage
}

/// Numbers by SplitMix64.
struct Draw(u64);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        low + (high - low) * ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        (self.between(0.0, count as f64) as usize).min(count - 1)
    }

    /// A number whose logarithm is even between these.
    fn power(&mut self, low: f64, high: f64) -> f64 {
        libm::pow(10.0, self.between(low, high))
    }
}

/// A body of one of nine kinds whose lowest point is about at `bottom`.
fn unlike(draw: &mut Draw, bottom: DVec3) -> Body {
    let aside = DVec3::new(draw.between(-0.01, 0.01), draw.between(-0.01, 0.01), 0.0);
    let yaw_rad = draw.between(0.0, 3.1);
    let up = |half_m: f64| bottom + aside + DVec3::Z * half_m;
    let along = |half_m: f64| DVec3::new(libm::cos(yaw_rad), libm::sin(yaw_rad), 0.0) * half_m;
    let turned = |middle: DVec3, spec: SoftSpec| {
        let rotation = DQuat::from_rotation_z(yaw_rad);
        Body::Soft(SoftSpec { position: middle + rotation * (spec.position - middle), rotation, ..spec })
    };
    match draw.below(9) {
        0 => {
            let size_m = draw.between(0.05, 0.07);
            let middle = up(0.5 * size_m);
            turned(middle, solid(middle, DVec3::splat(size_m), [3; 3], draw.power(4.7, 5.5)))
        }
        1 => turned(up(0.015), solid(up(0.015), DVec3::new(0.14, 0.14, 0.03), [5, 5, 2], draw.power(4.7, 5.5))),
        2 => turned(up(0.004), solid(up(0.004), DVec3::new(0.09, 0.09, 0.008), [5, 5, 1], 3e5)),
        3 => {
            let shape = SoftShape::Sheet { size_m: [0.14; 2], thickness_m: 0.004, segments: [7; 2] };
            turned(up(0.002), soft(shape, up(0.002) - DVec3::new(0.07, 0.07, 0.0), 1e6))
        }
        4 => Body::Soft(rope(up(0.006), along(0.07), 10)),
        5 => {
            let material = Material { young_pa: 1e6, poisson: 0.3, density_kg_m3: 1000.0, shear_factor: 0.9 };
            let (middle, half) = (up(0.01), along(0.08));
            let spec = TubeSpec::free(vec![middle - half, middle + half], Section::hollow(0.01, 0.01, material), 10);
            Body::Tube(TubeSpec { gravity: DVec3::NEG_Z * GRAVITY, friction: 0.5, ..spec })
        }
        6 => {
            let half_m = draw.between(0.02, 0.035);
            tilted(draw, DVec3::splat(half_m), (-1.3, 0.3), yaw_rad, up)
        }
        7 => tilted(draw, DVec3::new(0.05, 0.05, 0.005), (-1.0, -0.4), yaw_rad, up),
        _ => {
            let radius_m = draw.between(0.02, 0.035);
            Body::Rigid(rigid(Solid::Ball { radius_m }, up(radius_m), draw.power(-1.3, 0.3)))
        }
    }
}

/// A rigid box turned about z and a little about x; `up` gives its middle by half its height.
fn tilted(draw: &mut Draw, half_extents_m: DVec3, masses: (f64, f64), yaw_rad: f64, up: impl Fn(f64) -> DVec3) -> Body {
    let mass_kg = draw.power(masses.0, masses.1);
    let tilt_rad = draw.between(0.0, 0.1);
    let spec = rigid(Solid::Box { half_extents_m }, up(half_extents_m.z + half_extents_m.y * tilt_rad), mass_kg);
    let rotation = DQuat::from_rotation_z(yaw_rad) * DQuat::from_rotation_x(tilt_rad);
    Body::Rigid(RigidSpec { rotation, ..spec })
}
