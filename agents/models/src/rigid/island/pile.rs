//! Many bodies: a rapier3d world of all members, single precision, about an origin of its own.
//!
//! In: members at their [`Motion`]s. Out: their motions after a stretch of time, and who touches whom.
//! Never here: free flight of lone bodies, springs, who is a member.
//!
//! Bodies come and go one by one: what the others remember of their contacts stays. The members' double-precision motions
//! are the truth; a body is told of its own only where something else has changed it.

use super::super::motion::Motion;
use super::super::world::collider;
use super::Held;
use super::member::{Ground, Member, pose_about};
use super::pile_joints;
use crate::rigid::Joint;
use glam::{DQuat, DVec3};
use rapier3d::dynamics::{
    FrictionModel, ImpulseJointHandle, IntegrationParameters, MassProperties, RigidBodyBuilder, RigidBodyHandle,
    SpringCoefficients,
};
use rapier3d::geometry::{ColliderHandle, ContactPair};
use rapier3d::parry::math::{Pose, Rotation, Vec3};
use rapier3d::parry::shape::{SharedShape, TypedShape};
use rapier3d::pipeline::PhysicsWorld;

/// The world of a pile.
pub(super) struct Pile {
    sim: PhysicsWorld,
    origin: DVec3,
    ground: Vec<ColliderHandle>,
    seats: Vec<Seat>,
    /// The joints that this world holds already, as the scene gave them.
    jointed: Vec<(Joint, ImpulseJointHandle)>,
    /// What joints to the world hold on to, and where it is.
    posts: Vec<(RigidBodyHandle, DVec3)>,
}

/// A member in the world.
#[derive(Clone, Copy)]
struct Seat {
    body: RigidBodyHandle,
    collider: ColliderHandle,
    /// The motion that the world's own copy stands for.
    told: Motion,
    /// Whether the world pulls it down.
    falls: bool,
}

/// The mark of a solid that never moves, where a member's number would be.
const GROUND: u128 = u128::MAX;
/// A pile that has moved this far from its origin is placed anew, metres: single precision there resolves 8e-6 m.
const ORIGIN_MAX_M: f64 = 64.0;
/// Natural frequency of a contact, Hz: rapier's 30 lets a hundredfold load sink 35 mm (measured by W4), this 0.3 mm; six equal
/// boxes of 0.2 m sink 8.7 mm and 0.1 mm (`tests/stacks.rs`).
const STIFFNESS_HZ: f32 = 300.0;
/// Damping ratio of a contact, rapier's own.
const DAMPING_RATIO: f32 = 10.0;
/// Contacts are foreseen over no more than this share of a body's size.
const REACH_SHARE: f64 = 2.0;
/// Two bodies that are nearer than this share of their size touch.
const MARGIN_SHARE: f64 = 2e-3;

impl Pile {
    pub(super) fn new(ground: &[Ground], origin: DVec3) -> Self {
        let mut sim = PhysicsWorld::default();
        let handles = ground.iter().map(|solid| {
            let shape = collider(solid.shape.clone(), solid.friction, solid.restitution).user_data(GROUND);
            sim.colliders.insert(shape.position(pose_about(origin, solid.position_near(origin), solid.rotation)))
        });
        let ground = handles.collect();
        Self { sim, origin, ground, seats: Vec::new(), jointed: Vec::new(), posts: Vec::new() }
    }

    /// Takes a body in; it becomes the last one.
    pub(super) fn insert(&mut self, member: &Member) {
        let axes = member.spread.axes.as_quat();
        let properties = MassProperties::with_principal_inertia_frame(
            Vec3::ZERO,
            member.spread.mass_kg as f32,
            member.spread.moments.as_vec3(),
            Rotation::from_xyzw(axes.x, axes.y, axes.z, axes.w),
        );
        // the origin of the solver's body is the centre of mass, so that both copies of the state mean the same point
        let body = RigidBodyBuilder::dynamic()
            .additional_mass_properties(properties)
            .can_sleep(false)
            .allow_fast_rotation(true)
            .gyroscopic_forces_enabled(true)
            // contacts are looked for as far as a pair comes within the part: found late they are found deep
            .soft_ccd_prediction((REACH_SHARE * member.radius_m) as f32)
            .pose(pose_about(self.origin, member.motion.position, member.motion.rotation))
            .linvel(member.motion.velocity.as_vec3())
            .angvel(member.motion.spin(&member.spread).as_vec3());
        let shape = collider(self.shape_of(member), member.friction, member.restitution)
            .user_data(self.seats.len() as u128)
            .position(Pose::from_parts(-member.spread.com.as_vec3(), Rotation::IDENTITY));
        let (body, collider) = self.sim.insert(body, shape);
        self.seats.push(Seat { body, collider, told: member.motion, falls: true });
    }

    /// The member's shape, or that of the last one where both are equal: the solver asks for all shapes in every part, and a
    /// thousand equal ones are a thousand lines of the cache.
    fn shape_of(&self, member: &Member) -> SharedShape {
        let last = self.seats.last().map(|seat| self.sim.colliders[seat.collider].shared_shape());
        last.filter(|last| is_same(last, &member.shape)).unwrap_or(&member.shape).clone()
    }

    /// Lets the member `index` go; those after it move up by one.
    pub(super) fn remove(&mut self, index: usize) {
        let gone = self.seats.remove(index);
        self.sim.remove_body(gone.body);
        for (number, seat) in self.seats.iter().enumerate().skip(index) {
            self.sim.colliders[seat.collider].user_data = number as u128;
        }
    }

    /// Adds the joints that are not in the world yet.
    pub(super) fn hold(&mut self, members: &[Member], held: &[Held]) {
        let sim = &self.sim;
        self.jointed.retain(|(_, handle)| sim.impulse_joints.contains(*handle));
        for (a, b, joint) in held {
            if self.jointed.iter().any(|(known, _)| known == joint) {
                continue;
            }
            let other = match b {
                Some(b) => self.seats[*b].body,
                None => self.post(joint.anchor_b_m),
            };
            let built = pile_joints::build(joint, members[*a].spread.com, b.map(|b| members[b].spread.com));
            let handle = self.sim.insert_impulse_joint(self.seats[*a].body, other, built);
            self.jointed.push((*joint, handle));
        }
    }

    /// Something fixed in the world to hold on to.
    fn post(&mut self, at: DVec3) -> RigidBodyHandle {
        let pose = pose_about(self.origin, at, DQuat::IDENTITY);
        let post = self.sim.insert_body(RigidBodyBuilder::fixed().pose(pose));
        self.posts.push((post, at));
        post
    }

    /// Settings for these members: sizes are measured against a typical one, iterations by how unlike their masses are.
    pub(super) fn settle(&mut self, members: &[Member]) {
        let size: f64 = members.iter().map(|m| 2.0 * m.radius_m).sum::<f64>() / members.len().max(1) as f64;
        let masses = || members.iter().map(|m| m.spread.mass_kg);
        let ratio = masses().fold(0.0, f64::max) / masses().fold(f64::INFINITY, f64::min);
        self.sim.integration_parameters = parameters(size as f32, ratio);
    }

    /// Advances all members by so many `parts` of `h` seconds.
    pub(super) fn advance(
        &mut self,
        (members, ground): (&mut [Member], &[Ground]),
        gravity: DVec3,
        (h, parts): (f64, u32),
    ) -> Result<(), &'static str> {
        self.follow(members, ground);
        self.tell(members);
        self.sim.gravity = gravity.as_vec3();
        self.sim.integration_parameters.dt = h as f32;
        for _ in 0..parts {
            self.sim.step();
            if !self.sim.quarantine().is_empty() {
                return Err("the contact solver lost a body of the pile");
            }
        }
        self.read(members)
    }

    /// Places the origin anew where the leader has gone far from it.
    fn follow(&mut self, members: &[Member], ground: &[Ground]) {
        let Some(first) = members.first().filter(|m| m.motion.position.distance(self.origin) > ORIGIN_MAX_M) else {
            return;
        };
        self.origin = first.motion.position;
        self.seats.iter_mut().for_each(|seat| seat.told.position = DVec3::NAN);
        for (handle, solid) in self.ground.iter().zip(ground) {
            let pose = pose_about(self.origin, solid.position_near(self.origin), solid.rotation);
            self.sim.colliders[*handle].set_position(pose);
        }
        for &(post, at) in &self.posts {
            self.sim.bodies[post].set_position(pose_about(self.origin, at, DQuat::IDENTITY), false);
        }
    }

    /// Brings the world's copies up to date where something else has moved a body.
    fn tell(&mut self, members: &[Member]) {
        for (seat, member) in self.seats.iter_mut().zip(members) {
            let (told, motion) = (seat.told, member.motion);
            let falls = member.gravity != DVec3::ZERO;
            if told == motion && falls == seat.falls {
                continue;
            }
            let body = &mut self.sim.bodies[seat.body];
            if told.position != motion.position || told.rotation != motion.rotation {
                body.set_position(pose_about(self.origin, motion.position, motion.rotation), true);
            }
            body.set_linvel(motion.velocity.as_vec3(), true);
            body.set_angvel(motion.spin(&member.spread).as_vec3(), true);
            body.set_gravity_scale(if falls { 1.0 } else { 0.0 }, true);
            (seat.told, seat.falls) = (motion, falls);
        }
    }

    /// Reads every member's motion back.
    fn read(&mut self, members: &mut [Member]) -> Result<(), &'static str> {
        for (seat, member) in self.seats.iter_mut().zip(members) {
            let body = &self.sim.bodies[seat.body];
            let turned = body.rotation().to_array().map(f64::from);
            let motion = &mut member.motion;
            motion.position = self.origin + body.translation().as_dvec3();
            motion.rotation = DQuat::from_array(turned).normalize();
            motion.velocity = body.linvel().as_dvec3();
            motion.set_spin(&member.spread, body.angvel().as_dvec3());
            seat.told = *motion;
            if !motion.is_sane(&member.spread) {
                return Err("the contact solver's answer is not finite");
            }
        }
        Ok(())
    }

    /// Notes for every member whether it touches anything and how deep, and shows every pair of members that is near enough to
    /// touch by turning alone, and whether it does touch. Gives the number of points that touch.
    pub(super) fn touches(&self, members: &mut [Member], mut pair: impl FnMut(u32, u32, bool)) -> usize {
        members.iter_mut().for_each(|m| (m.touching, m.depth_m) = (false, 0.0));
        let mut count = 0;
        for contact in self.sim.narrow_phase.contact_pairs() {
            let owner = |handle| {
                let data = self.sim.colliders.get(handle).map_or(GROUND, |c| c.user_data);
                usize::try_from(data).ok().filter(|&i| i < members.len())
            };
            let (a, b) = (owner(contact.collider1), owner(contact.collider2));
            let size = [a, b].iter().flatten().map(|&i| members[i].radius_m).fold(f64::INFINITY, f64::min);
            let touch = nearest(contact).filter(|(gap, _)| *gap <= MARGIN_SHARE * size);
            if let (Some(a), Some(b)) = (a, b)
                && members[a].is_near(&members[b])
            {
                pair(a as u32, b as u32, touch.is_some());
            }
            let Some((gap, points)) = touch else { continue };
            count += points;
            for index in [a, b].into_iter().flatten() {
                let member = &mut members[index];
                member.touching = true;
                member.depth_m = member.depth_m.max(-gap);
            }
        }
        count
    }
}

/// Whether two shapes are known to be equal.
fn is_same(a: &SharedShape, b: &SharedShape) -> bool {
    match (a.as_typed_shape(), b.as_typed_shape()) {
        (TypedShape::Ball(a), TypedShape::Ball(b)) => a == b,
        (TypedShape::Cuboid(a), TypedShape::Cuboid(b)) => a == b,
        _ => false,
    }
}

/// The nearest gap of a pair, metres, and how many points it has; `None` where the shapes are far.
fn nearest(pair: &ContactPair) -> Option<(f64, usize)> {
    let points = || pair.manifolds().iter().flat_map(|m| &m.points);
    let gap = points().map(|p| p.dist).reduce(f32::min)?;
    Some((f64::from(gap), points().count()))
}

/// Solver settings: as stiff as single precision lets it be, more passes the less alike the masses are.
fn parameters(size: f32, ratio: f64) -> IntegrationParameters {
    IntegrationParameters {
        length_unit: size,
        num_solver_iterations: if ratio > 30.0 { 16 } else { 4 },
        num_internal_stabilization_iterations: 2,
        contact_softness: SpringCoefficients::new(STIFFNESS_HZ, DAMPING_RATIO),
        static_contact_softness: SpringCoefficients::new(STIFFNESS_HZ, DAMPING_RATIO),
        friction_model: FrictionModel::Simplified,
        normalized_max_linear_velocity: f32::MAX,
        ..IntegrationParameters::default()
    }
}
