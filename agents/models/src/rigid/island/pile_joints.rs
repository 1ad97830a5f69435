//! Joints as rapier3d's, for islands too large for the direct solve.
//!
//! In: a [`Joint`] and where the centres of mass are in their shapes. Out: a `GenericJoint`. Never here: the solve.

use crate::rigid::{Joint, JointKind};
use glam::{DQuat, DVec3};
use rapier3d::dynamics::{
    GenericJoint, GenericJointBuilder, JointAxesMask, JointAxis, RopeJointBuilder, SpringJointBuilder,
};
use rapier3d::parry::math::{Pose, Rotation};

/// The joint between bodies whose origins are their centres of mass; the world's body stands in the anchor itself.
pub(super) fn build(joint: &Joint, com_a: DVec3, com_b: Option<DVec3>) -> GenericJoint {
    let anchor_a = joint.anchor_a_m - com_a;
    let anchor_b = com_b.map_or(DVec3::ZERO, |com| joint.anchor_b_m - com);
    // rapier's joints act about the frame's x axis
    let turn = match joint.kind {
        JointKind::Revolute { axis, .. } | JointKind::Prismatic { axis, .. } => {
            DQuat::from_rotation_arc(DVec3::X, axis.normalize())
        }
        _ => DQuat::IDENTITY,
    };
    let frames = (frame(anchor_a, turn), frame(anchor_b, joint.rest.normalize().conjugate() * turn));
    let mut built = match joint.kind {
        JointKind::Fixed => with(JointAxesMask::all(), frames),
        JointKind::Spherical => with(JointAxesMask::LIN_AXES, frames),
        JointKind::Revolute { range_rad, .. } => {
            let hinge = with(JointAxesMask::all() & !JointAxesMask::ANG_X, frames);
            within(hinge, JointAxis::AngX, range_rad)
        }
        JointKind::Prismatic { range_m, .. } => {
            let slide = with(JointAxesMask::all() & !JointAxesMask::LIN_X, frames);
            within(slide, JointAxis::LinX, range_m)
        }
        JointKind::Spring { stiffness_n_m, damping_n_s_m, rest_m } => {
            let spring = SpringJointBuilder::new(rest_m as f32, stiffness_n_m as f32, damping_n_s_m as f32);
            let spring = spring.local_anchor1(anchor_a.as_vec3()).local_anchor2(anchor_b.as_vec3());
            spring.spring_model(rapier3d::dynamics::MotorModel::ForceBased).build().into()
        }
        JointKind::Rope { length_m } => RopeJointBuilder::new(length_m as f32)
            .local_anchor1(anchor_a.as_vec3())
            .local_anchor2(anchor_b.as_vec3())
            .build()
            .into(),
    };
    built.set_contacts_enabled(joint.collide);
    built
}

fn frame(anchor: DVec3, turn: DQuat) -> Pose {
    let q = turn.as_quat();
    Pose::from_parts(anchor.as_vec3(), Rotation::from_xyzw(q.x, q.y, q.z, q.w).normalize())
}

fn with(locked: JointAxesMask, frames: (Pose, Pose)) -> GenericJoint {
    GenericJointBuilder::new(locked).local_frame1(frames.0).local_frame2(frames.1).build()
}

fn within(mut joint: GenericJoint, axis: JointAxis, range: Option<[f64; 2]>) -> GenericJoint {
    if let Some(range) = range {
        joint.set_limits(axis, range.map(|x| x as f32));
    }
    joint
}
