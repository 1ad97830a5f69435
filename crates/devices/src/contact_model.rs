//! The local model of an object's contacts: the wrench on it elsewhere than where its newest state has it, until the
//! next state comes.
//!
//! In: the newest states of a world. Out: a wrench for any pose near that. Never here: where the object is led, how old a state may be.
//!
//! Each contact is a plane through the point that bears most: along its normal it gives the published force and, for
//! the way of the object off the published pose, the published stiffness (docs/theory/coupling.md, eq. 7s, 7t); never a
//! pull. Friction follows the normal force.

use glam::{DQuat, DVec3};
use metachron_core::{Body, SimTime, Snapshot, Wrench};
use metachron_geometry::ShapeKind;
use metachron_world::{ContactNow, Object, World, WorldError};

/// The contacts of an object near a state of it.
#[derive(Debug, Clone, Default)]
pub struct ContactModel {
    /// The scene's time of the state.
    pub moment: SimTime,
    /// The step that led to it, seconds; 0 where none has been seen.
    pub step_s: f64,
    /// Whether the object rested: the state holds until it moves.
    pub at_rest: bool,
    /// Where it was led to, metres, and its rotation.
    position_m: DVec3,
    rotation: DQuat,
    contacts: Vec<Bearing>,
    /// The pull of the bodies that its jaws hold, N.
    held_n: DVec3,
}

/// A contact that bears something.
#[derive(Debug, Clone, Copy)]
struct Bearing {
    /// From where the object is led to, metres.
    arm_m: DVec3,
    /// Towards the object.
    normal: DVec3,
    /// Along the normal, N, and across it.
    force_n: f64,
    across_n: DVec3,
    stiffness_n_m: f64,
}

impl ContactModel {
    /// Takes in the newest state of `object`; whether it is another one than before.
    ///
    /// # Errors
    /// The errors of [`World::latest`].
    pub fn refresh(&mut self, world: &World, object: Object) -> Result<bool, WorldError> {
        let state = world.latest(object)?;
        let moment = state.moment();
        if moment == self.moment && self.step_s > 0.0 {
            return Ok(false);
        }
        let lasted_s = moment.secs_after(self.moment);
        self.step_s = state.cluster.map_or(lasted_s, |cluster| cluster.step_s);
        (self.moment, self.at_rest) = (moment, state.at_rest);
        self.stand(&state, middle_of(world, object));
        let of = |contact: &ContactNow| Bearing::of(contact, self.position_m);
        self.contacts.clear();
        self.contacts.extend(world.contacts(object)?.iter().filter_map(of));
        self.held_n = state.grips.iter().filter(|grip| grip.by.is_some()).map(|grip| grip.force_n).sum();
        Ok(true)
    }

    /// Where the object was led to: a kinematic body is there, a tool is off it by the give of its drive.
    fn stand(&mut self, state: &Snapshot, middle_m: DVec3) {
        match &state.body {
            Body::Rigid(body) => {
                (self.position_m, self.rotation) = (body.position - body.rotation * middle_m, body.rotation);
            }
            Body::Tool(tool) => (self.position_m, self.rotation) = (tool.led, tool.rotation),
            Body::Nothing | Body::Curve(_) | Body::Soft(_) => {}
        }
    }

    /// Lets contacts answer a way that was gone within `within_s` seconds, where that is more than the step of the state (eq. 7v): what stiffness is
    /// of mass grows with the square of the step's inverse.
    pub fn answer_within(&mut self, within_s: f64) {
        let share = (self.step_s / within_s).min(1.0).powi(2);
        self.contacts.iter_mut().for_each(|contact| contact.stiffness_n_m *= share);
    }

    /// Its rotation in the state.
    #[must_use]
    pub const fn rotation(&self) -> DQuat {
        self.rotation
    }

    /// The wrench on the object at a pose, about that place, world axes.
    #[must_use]
    pub fn wrench(&self, position_m: DVec3, rotation: DQuat) -> Wrench {
        let (way_m, turn) = (position_m - self.position_m, rotation * self.rotation.conjugate());
        let mut sum = Wrench { force_n: self.held_n, torque_n_m: DVec3::ZERO };
        for contact in &self.contacts {
            let arm_m = turn * contact.arm_m;
            let nearer_m = -(way_m + arm_m - contact.arm_m).dot(contact.normal);
            let force_n = (contact.force_n + contact.stiffness_n_m * nearer_m).max(0.0);
            let across_n = contact.across_n * (force_n / contact.force_n);
            sum.add(contact.normal * force_n + across_n, arm_m);
        }
        sum
    }
}

/// The centre of mass of an object in its own axes, metres: states give that, commanded poses the origin.
fn middle_of(world: &World, object: Object) -> DVec3 {
    match world.agents().of(object.id()).and_then(|agent| agent.form()).map(|form| form.kind.clone()) {
        Some(ShapeKind::Solid(shape)) => shape.com_local,
        _ => DVec3::ZERO,
    }
}

impl Bearing {
    /// None of a contact that only touches, and of one whose place is not known.
    fn of(contact: &ContactNow, position_m: DVec3) -> Option<Self> {
        let ContactNow { point_m, normal, force_n: all_n, stiffness_n_m, .. } = *contact;
        let force_n = all_n.dot(normal);
        let arm_m = if point_m.is_finite() { point_m - position_m } else { DVec3::ZERO };
        (force_n > 0.0).then_some(Self { arm_m, normal, force_n, across_n: all_n - normal * force_n, stiffness_n_m })
    }
}
