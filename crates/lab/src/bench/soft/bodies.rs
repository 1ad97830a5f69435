//! The bodies of `bench soft`: cubes of soft tissue, a sheet, the tube of the demonstration.
//!
//! In: a number of cells. Out: specifications. Never here: steps.

use super::super::super::chart::{GRAVITY, plain_soft};
use anyhow::Context;
use glam::{DQuat, DVec3};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::rod::{Tube, TubeSpec, WallModel};
use metachron_models::soft::{MaterialLaw, Side, SoftMaterial, SoftShape, SoftSpec};
use metachron_scene::{Source, load};
use metachron_world::Spec;

/// Edge of the cube, metres.
pub(super) const CUBE_M: f64 = 0.1;
/// How far above the floor bodies start, metres.
const ABOVE_M: f64 = 0.2e-3;
/// Half the thickness of the plate, metres.
const PLATE_HALF_M: f64 = 0.005;
/// Mass of the plate, kilograms: a fifth of the cube's.
const PLATE_KG: f64 = 0.2;
/// Edge of the sheet, metres.
const SHEET_M: f64 = 0.3;

/// Soft tissue.
const TISSUE: SoftMaterial = SoftMaterial {
    young_pa: 12e3,
    poisson: 0.4,
    density_kg_m3: 1050.0,
    damping_per_s: 0.2,
    damping_s: 0.0,
    law: MaterialLaw::Corotational,
};

/// A free soft body.
pub(in super::super) fn soft(shape: SoftShape, material: SoftMaterial, position: DVec3) -> SoftSpec {
    SoftSpec { position, friction: 0.5, ..plain_soft(shape, material) }
}

/// The cube, free just above the floor, of so many cells along each edge.
pub(in super::super) fn cube(cells: u32) -> SoftSpec {
    let shape = SoftShape::Box { size_m: DVec3::splat(CUBE_M), segments: [cells; 3] };
    soft(shape, TISSUE, DVec3::new(-0.5 * CUBE_M, -0.5 * CUBE_M, ABOVE_M))
}

/// The cube whose bottom is held.
pub(super) fn held_cube(cells: u32) -> SoftSpec {
    SoftSpec { held: vec![Side::Bottom], ..cube(cells) }
}

/// The plate just above the cube.
pub(super) fn plate() -> anyhow::Result<RigidBody> {
    let solid = Solid::Box { half_extents_m: DVec3::new(0.5 * CUBE_M, 0.5 * CUBE_M, PLATE_HALF_M) };
    let middle = DVec3::Z * (CUBE_M + 2.0 * ABOVE_M + PLATE_HALF_M);
    let spec = RigidSpec { gravity: DVec3::NEG_Z * GRAVITY, ..RigidSpec::free(solid, middle, PLATE_KG) };
    RigidBody::new(spec).context("the plate")
}

/// The floor: a plane at z = 0.
pub(super) fn floor() -> Obstacle {
    Obstacle::new("floor", Solid::Plane)
}

/// A sheet of 4 mm of so many cells along each edge that hangs from one of its sides.
pub(super) fn hung_sheet(cells: u32) -> SoftSpec {
    let material = SoftMaterial { young_pa: 1e5, poisson: 0.3, ..TISSUE };
    SoftSpec { held: vec![Side::Left], ..soft(sheet(cells), material, DVec3::ZERO) }
}

/// The same sheet, free, limp and nearly upright on the floor, so that it falls on its lower edge and folds; it touches itself.
pub(in super::super) fn falling_sheet(cells: u32) -> SoftSpec {
    /// From level, radians.
    const UPRIGHT_RAD: f64 = 1.45;
    let material = SoftMaterial { young_pa: 2e4, poisson: 0.3, damping_per_s: 2.0, ..TISSUE };
    let rotation = DQuat::from_rotation_y(-UPRIGHT_RAD);
    let position = DVec3::new(0.0, -0.5 * SHEET_M, 0.003);
    SoftSpec { rotation, self_contact: true, ..soft(sheet(cells), material, position) }
}

fn sheet(cells: u32) -> SoftShape {
    SoftShape::Sheet { size_m: [SHEET_M; 2], thickness_m: 0.004, segments: [cells; 2] }
}

/// The tube of the scene `tube`, among its static solids.
pub(super) struct DemoTube {
    spec: TubeSpec,
    pub(super) obstacles: Vec<Obstacle>,
}

impl DemoTube {
    pub(super) fn load() -> anyhow::Result<Self> {
        let scene = load(&Source::open("tube")?, &[])?;
        let tube = scene.agents.iter().find_map(|agent| match &agent.spec {
            Spec::Tube(spec) => Some(spec.clone()),
            _ => None,
        });
        let spec = tube.context("the scene `tube` has no tube")?;
        Ok(Self { spec, obstacles: scene.obstacles.to_vec() })
    }

    /// The tube with such a wall.
    pub(super) fn with(&self, wall: WallModel) -> anyhow::Result<Tube> {
        Tube::new(TubeSpec { wall, ..self.spec.clone() }).context("the tube of the scene `tube`")
    }
}
