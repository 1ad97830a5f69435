//! One rapier3d world of rigid bodies among static solids: the peer of benchmarks of rigid piles.
//!
//! In: bodies and solids as a scene gives them, settings. Out: a world to step. Never here: agents, measurements.

use anyhow::{Context, bail};
use glam::{DQuat, DVec3};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::RigidSpec;
use metachron_world::{Scene, Spec};
use rapier3d::dynamics::{FrictionModel, IntegrationParameters, RigidBodyBuilder, SpringCoefficients};
use rapier3d::geometry::{ColliderBuilder, SharedShape};
use rapier3d::parry::math::{Pose, Rotation, Vec3};
use rapier3d::pipeline::PhysicsWorld;

/// The settings that a world is made with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub settings: Settings,
    /// The length of a step, seconds.
    pub step_s: f64,
    /// Half the diagonal of a typical body, metres.
    pub radius_m: f64,
    /// m/s².
    pub gravity: DVec3,
}

/// Solver settings of the plain world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Settings {
    /// rapier3d's defaults; only the size of the bodies is set.
    Own,
    /// Settings by which columns of six boxes of 0.2 m sink by 0.1 mm instead of 8.7 (docs/throughput.md).
    Careful,
}

impl Settings {
    fn parameters(self, radius_m: f64) -> IntegrationParameters {
        let length_unit = 2.0 * radius_m as f32;
        if self == Self::Own {
            return IntegrationParameters { length_unit, ..IntegrationParameters::default() };
        }
        let stiff = SpringCoefficients::new(300.0, 10.0);
        IntegrationParameters {
            length_unit,
            num_solver_iterations: 4,
            num_internal_stabilization_iterations: 2,
            contact_softness: stiff,
            static_contact_softness: stiff,
            friction_model: FrictionModel::Simplified,
            normalized_max_linear_velocity: f32::MAX,
            ..IntegrationParameters::default()
        }
    }
}

/// The rigid bodies of a scene of nothing else.
pub(crate) fn rigid_specs(scene: &Scene) -> anyhow::Result<Vec<&RigidSpec>> {
    let specs = scene.agents.iter().map(|member| match &member.spec {
        Spec::Rigid(spec) => Ok(spec),
        _ => bail!("`{}` is not a rigid body", member.name),
    });
    specs.collect()
}

/// A world of bodies of primitive shapes.
///
/// # Errors
/// A shape that it does not take.
pub(crate) fn world_of<'a>(
    bodies: impl IntoIterator<Item = &'a RigidSpec>,
    obstacles: &[Obstacle],
    frame: Frame,
) -> anyhow::Result<PhysicsWorld> {
    let mut world = PhysicsWorld { gravity: frame.gravity.as_vec3(), ..PhysicsWorld::default() };
    world.integration_parameters = frame.settings.parameters(frame.radius_m);
    world.integration_parameters.dt = frame.step_s as f32;
    for solid in obstacles {
        let shape = shape(&solid.solid)?.friction(solid.friction as f32).restitution(solid.restitution as f32);
        world.colliders.insert(shape.position(pose(solid.position, solid.rotation)));
    }
    for spec in bodies {
        insert(&mut world, spec, frame)?;
    }
    Ok(world)
}

fn insert(world: &mut PhysicsWorld, spec: &RigidSpec, frame: Frame) -> anyhow::Result<()> {
    let mut body = RigidBodyBuilder::dynamic()
        .pose(pose(spec.position, spec.rotation))
        .linvel(spec.velocity.as_vec3())
        .angvel(spec.spin.as_vec3())
        .can_sleep(false);
    if frame.settings == Settings::Careful {
        let foreseen = body.soft_ccd_prediction(2.0 * frame.radius_m as f32);
        body = foreseen.allow_fast_rotation(true).gyroscopic_forces_enabled(true);
    }
    let shape = shape(&spec.solid)?.mass(spec.mass_kg as f32);
    world.insert(body, shape.friction(spec.friction as f32).restitution(spec.restitution as f32));
    Ok(())
}

fn shape(solid: &Solid) -> anyhow::Result<ColliderBuilder> {
    match solid {
        Solid::Box { half_extents_m: half } => Ok(ColliderBuilder::cuboid(half.x as f32, half.y as f32, half.z as f32)),
        Solid::Ball { radius_m } => Ok(ColliderBuilder::ball(*radius_m as f32)),
        Solid::Plane => Ok(ColliderBuilder::new(SharedShape::halfspace(Vec3::Z))),
        _ => None.context("the single rapier3d world supports balls, boxes and planes only"),
    }
}

fn pose(position: DVec3, rotation: DQuat) -> Pose {
    let turned = rotation.as_quat();
    Pose::from_parts(position.as_vec3(), Rotation::from_xyzw(turned.x, turned.y, turned.z, turned.w))
}
