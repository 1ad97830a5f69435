//! Bodies of the sizes and stuffs that the scenes use, each by the place of its middle.

use crate::table::{GRAVITY, Placed, placed};
use glam::{DQuat, DVec3};
use metachron_geometry::{ContactTraits, Solid};
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::rod::{Material, Section, Tube, TubeSpec};
use metachron_models::soft::{MaterialLaw, Side, SoftBody, SoftMaterial, SoftShape, SoftSpec};

pub fn material(young_pa: f64) -> SoftMaterial {
    SoftMaterial {
        young_pa,
        poisson: 0.3,
        density_kg_m3: 1000.0,
        damping_per_s: 0.0,
        damping_s: 0.0,
        law: MaterialLaw::Corotational,
    }
}

fn soft(shape: SoftShape, position: DVec3, young_pa: f64) -> SoftSpec {
    SoftSpec {
        shape,
        nodes: None,
        eps_touched_m: None,
        material: material(young_pa),
        position,
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        held: vec![],
        friction: 0.5,
        traits: ContactTraits::default(),
        gravity: GRAVITY,
        self_contact: false,
        sleep: false,
    }
}

/// The same body after a turn of everything about the origin.
pub fn leaning(spec: SoftSpec, rotation: DQuat) -> SoftSpec {
    SoftSpec { position: rotation * spec.position, rotation: rotation * spec.rotation, ..spec }
}

/// A box of matter.
pub fn solid(middle: DVec3, size_m: DVec3, segments: [u32; 3], young_pa: f64) -> SoftSpec {
    soft(SoftShape::Box { size_m, segments }, middle - size_m * 0.5, young_pa)
}

/// The same, turned about z.
pub fn turned(middle: DVec3, spec: SoftSpec, yaw_rad: f64) -> Placed {
    let rotation = DQuat::from_rotation_z(yaw_rad);
    let position = middle + rotation * (spec.position - middle);
    placed(SoftBody::new(SoftSpec { position, rotation, ..spec }).unwrap(), false)
}

pub fn cube(middle: DVec3, size_m: f64) -> Placed {
    placed(SoftBody::new(solid(middle, DVec3::splat(size_m), [3; 3], 1e5)).unwrap(), false)
}

pub fn slab(held: bool, young_pa: f64) -> Placed {
    let spec = solid(DVec3::new(0.0, 0.0, 0.0251), DVec3::new(0.2, 0.2, 0.05), [6, 6, 2], young_pa);
    let sides = if held { vec![Side::Bottom] } else { vec![] };
    placed(SoftBody::new(SoftSpec { held: sides, ..spec }).unwrap(), held)
}

pub fn sheet(middle: DVec3, size_m: f64, segments: u32) -> SoftSpec {
    let shape = SoftShape::Sheet { size_m: [size_m; 2], thickness_m: 0.004, segments: [segments; 2] };
    soft(shape, middle - DVec3::new(0.5 * size_m, 0.5 * size_m, 0.0), 1e6)
}

pub fn cloth(middle: DVec3, size_m: f64, segments: u32) -> Placed {
    placed(SoftBody::new(sheet(middle, size_m, segments)).unwrap(), false)
}

pub fn rope(middle: DVec3, half: DVec3, radius_m: f64, young_pa: f64) -> Placed {
    let shape = SoftShape::Rope { path_m: vec![-half, half], radius_m, segments: 10 };
    placed(SoftBody::new(soft(shape, middle, young_pa)).unwrap(), false)
}

pub fn tube(middle: DVec3, half: DVec3, radius_m: f64) -> Placed {
    let material = Material { young_pa: 1e6, poisson: 0.3, density_kg_m3: 1000.0, shear_factor: 0.9 };
    let section = Section::hollow(radius_m, radius_m, material);
    let spec = TubeSpec::free(vec![middle - half, middle + half], section, 10);
    placed(Tube::new(TubeSpec { gravity: GRAVITY, friction: 0.5, ..spec }).unwrap(), false)
}

pub fn rigid(solid: Solid, middle: DVec3, mass_kg: f64) -> RigidSpec {
    RigidSpec { gravity: GRAVITY, ..RigidSpec::free(solid, middle, mass_kg) }
}

/// A rigid box, turned about z.
pub fn block(middle: DVec3, half_m: DVec3, mass_kg: f64, yaw_rad: f64) -> Placed {
    let spec = rigid(Solid::Box { half_extents_m: half_m }, middle, mass_kg);
    placed(RigidBody::new(RigidSpec { rotation: DQuat::from_rotation_z(yaw_rad), ..spec }).unwrap(), false)
}
