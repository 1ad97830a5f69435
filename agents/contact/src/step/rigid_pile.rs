//! A rigid pile: rigid bodies for whose problem there is no time, stepped by rapier3d: the coarsest level of a solve.
//!
//! In: members with the velocities that they would have without contact. Out: their velocities with it, where they are then, the impulses of
//! each pair. Bodies lie in each other as deep as rapier3d lets them (some tenths of a millimetre), in single precision.
//! Never here: deformables, which touch none of the rigid pile; rows of springs and joints: these are solved before, as if nothing touched.
//! Theory: docs/theory/clusters.md, section 9.

use crate::detect::domain::{Domain, assign};
use crate::detect::{ClusterScene, Search};
use crate::member::memory::Partner;
use crate::member::participant::{Progress, place_of};
use crate::member::{Locked, Participant};
use crate::step::report::{ClusterReport, Sums, give, total_of};
use glam::{DMat3, DQuat, DVec3};
use metachron_core::{AgentId, Archive, ArchiveError, SolveLevel, StepError, archive_values};
use metachron_geometry::narrow_phase::StaticSolid;
use metachron_geometry::{CollisionShape, ShapeKind, ShapePose, Solid, SolidShape};
use rapier3d::dynamics::{
    CoefficientCombineRule, FrictionModel, IntegrationParameters, LockedAxes, MassProperties, RigidBodyBuilder,
    RigidBodyHandle, SpringCoefficients,
};
use rapier3d::geometry::{
    ColliderBuilder, ColliderHandle, ContactPair, Group, InteractionGroups, InteractionTestMode, SharedShape,
};
use rapier3d::parry::math::{Pose, Rotation, Vec3};
use rapier3d::pipeline::PhysicsWorld;

/// Rigid bodies are a rigid pile where each solve has time for fewer factors than these: three of interior points leave contacts about as deep as
/// rapier3d does.
pub const FACTORS_SAFE: u32 = 3;
/// They are one until there is time for so many.
const FACTORS_AGAIN: u32 = 2 * FACTORS_SAFE;
/// No step of rapier3d is longer than this, seconds: a landing body sinks by a part of its way in one.
const LONGEST_S: f64 = 1.0 / 240.0;
/// The most steps of rapier3d in a fine step: no body goes farther in one than half its radius, as far as that takes no more.
const STEPS_MAX: f64 = 64.0;
/// Nothing is farther from the origin or faster than this, metres, m/s and rad/s.
const REACH_MAX: f32 = 1e6;
/// By how many radii of its body a contact is predicted.
const FORESEEN_RADII: f64 = 2.0;
/// How stiff contacts are: so columns of boxes sink by a tenth of a millimetre (docs/throughput.md).
const STIFF: SpringCoefficients<f32> = SpringCoefficients { natural_frequency: 300.0, damping_ratio: 10.0 };

/// The rigid pile of a cluster, if it has one.
#[derive(Default)]
pub(super) struct RigidPile {
    world: Option<Box<World>>,
    /// Of each member; without meaning where there is no heap.
    domains: Vec<Domain>,
}

/// Counts and figures of a step of a rigid pile.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PileReport {
    pub is_on: bool,
    pub contacts: usize,
    pub depth_m: f64,
}

/// The bodies of a rigid pile in rapier3d.
struct World {
    physics: PhysicsWorld,
    /// Where the origin of rapier3d is: near the bodies, as its numbers are single.
    origin_m: DVec3,
    /// By rising numbers.
    bodies: Vec<Known>,
    /// Storage: members that something touches, and the impulses of contacts.
    touched: Vec<usize>,
    given: Vec<Given>,
}

/// The impulse of a contact on a member in a step of rapier3d.
struct Given {
    member: usize,
    partner: Partner,
    impulse_n_s: DVec3,
    point_m: DVec3,
    depth_m: f64,
    counts: bool,
}

/// A body, with its inertia in its own axes, kg·m².
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct Known {
    id: AgentId,
    /// Its place among the members of the step.
    member: usize,
    handle: RigidBodyHandle,
    mass_kg: f64,
    inertia: DMat3,
    radius_m: f64,
    /// Whether anything has touched it in the step: a flying body moves exactly, as its member says.
    touched: bool,
}

/// A place of a rigid member: its centre of mass and its rotation.
struct Placed<'a> {
    form: &'a CollisionShape,
    shape: &'a SolidShape,
    centre_m: DVec3,
    rotation: DQuat,
}

impl PileReport {
    /// Adds it to that of the fine step whose problem has been solved.
    pub fn add_to(self, report: &mut ClusterReport) {
        report.pile_contacts = self.contacts as u32;
        report.contacts += report.pile_contacts;
        if self.is_on {
            report.level = SolveLevel::RigidPile;
        }
        report.depth_m = report.depth_m.max(self.depth_m);
    }
}

impl RigidPile {
    /// Writes or reads the rigid pile, with all that rapier3d knows of it.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.option(
            &mut self.world,
            || Box::new(World::empty(DVec3::ZERO)),
            |world, archive| archive_values!(archive, world.physics, world.origin_m, world.bodies),
        )
    }

    /// Whether the cluster has one.
    pub fn is_on(&self) -> bool {
        self.world.is_some()
    }

    /// The domain of each member.
    pub fn domains(&self) -> &[Domain] {
        &self.domains
    }

    /// Makes a rigid pile of the members that can be one, if there is no time for their problem, they are most of it and nothing else touches them.
    pub fn begin(&mut self, scene: &ClusterScene, all: &[Participant<'_>], search: &Search, factors_max: Option<u32>) {
        if factors_max.is_none_or(|most| most >= FACTORS_SAFE) {
            return;
        }
        assign(scene, all, &mut self.domains);
        let is_pile = |member: usize| self.domains[member] == Domain::RigidPile;
        let within = search.owners.iter().filter(|owner| owner.both().all(is_pile)).count();
        if 2 * within > search.owners.len() && !self.is_touched(search) {
            let centres = || all.iter().filter_map(placed).map(|body| body.centre_m);
            let middle_m = centres().sum::<DVec3>() / centres().count() as f64;
            self.world = Some(Box::new(World::new(scene, middle_m)));
        }
    }

    /// Goes on with the rigid pile where it still is one; whether it goes on.
    pub fn go_on(&mut self, scene: &ClusterScene, all: &[Participant<'_>], factors_max: Option<u32>) -> bool {
        let is_short = factors_max.is_some_and(|most| most < FACTORS_AGAIN);
        self.world = self.world.take().filter(|_| is_short);
        if self.is_on() {
            assign(scene, all, &mut self.domains);
            self.world = self.world.take().filter(|_| self.domains.contains(&Domain::RigidPile));
        }
        self.is_on()
    }

    /// Ends the rigid pile if one of the other members touches it.
    pub fn end_if_touched(&mut self, search: &Search) {
        if self.is_touched(search) {
            self.world = None;
        }
    }

    /// Whether a member of the rigid pile and one of the problem touch.
    fn is_touched(&self, search: &Search) -> bool {
        let domains = &self.domains;
        search.owners.iter().any(|owner| owner.other.is_some_and(|other| domains[owner.member] != domains[other]))
    }

    /// Steps the members of the rigid pile by `h_s` seconds from where they are: in, each one's velocities at the end without contact; out, with it.
    /// The impulses of pairs are added to sums.
    ///
    /// # Errors
    /// [`StepError::Diverged`] where rapier3d has no finite answer.
    pub fn step(
        &mut self,
        all: &[Participant<'_>],
        progress: &mut [Progress],
        h_s: f64,
        into: &mut Sums,
    ) -> Result<PileReport, StepError> {
        let Self { world: Some(world), domains, .. } = self else { return Ok(PileReport::default()) };
        let Sums { totals, wrenches, .. } = into;
        world.take(all, domains, progress, h_s);
        // spans are whole nanoseconds
        let steps = (h_s / LONGEST_S - 1e-3).max(world.way(progress, h_s)).ceil().clamp(1.0, STEPS_MAX);
        world.physics.integration_parameters.dt = (h_s / steps) as f32;
        let mut report = PileReport::default();
        for left in (0..steps as u32).rev() {
            world.physics.step();
            let deepest_m = report.depth_m;
            report = world.read(all, left == 0);
            report.depth_m = report.depth_m.max(deepest_m);
            report.is_on = true;
        }
        if !world.is_sound() {
            self.world = None;
            let what = "the rigid pile has no finite answer".to_owned();
            return Err(StepError::Diverged { model: "cluster", dt_s: h_s, what });
        }
        for known in world.bodies.iter().filter(|known| known.touched) {
            let state = &mut progress[known.member];
            let body = &world.physics.bodies[known.handle];
            state.v_before.copy_from_slice(&[body.linvel().as_dvec3(), body.angvel().as_dvec3()]);
            state.hold();
        }
        world.given.sort_by_key(|given| (given.member, given.partner));
        for Given { member, partner, impulse_n_s, point_m, depth_m, counts } in world.given.drain(..) {
            let total = total_of(totals, member, partner);
            total.add(impulse_n_s, depth_m);
            if impulse_n_s.length() > total.most_n_s {
                (total.most_n_s, total.point_m) = (impulse_n_s.length(), point_m);
                total.normal = impulse_n_s.normalize_or_zero();
            }
            give(&mut wrenches[member], &all[member].member, impulse_n_s, point_m);
            if let Partner::Agent(id) = partner
                && let Some(other) = place_of(all, id)
            {
                give(&mut wrenches[other], &all[other].member, -impulse_n_s, point_m);
            }
            // a place is counted once, not in every step of rapier3d
            total.contacts -= u32::from(!counts);
        }
        Ok(report)
    }

    /// Moves members, whose steps have ended, to where rapier3d has them.
    pub fn place(&self, all: &mut [Participant<'_>]) {
        let Some(world) = &self.world else { return };
        for known in world.bodies.iter().filter(|known| known.touched) {
            let one = &mut all[known.member];
            let Some(Placed { shape, centre_m, rotation, .. }) = placed(one) else { continue };
            let pose = world.physics.bodies[known.handle].position();
            let [x, y, z, w] = pose.rotation.to_array().map(f64::from);
            let goal = DQuat::from_xyzw(x, y, z, w).normalize();
            let way_m = world.origin_m + pose.translation.as_dvec3() + goal * shape.com_local - centre_m;
            let turn = (goal * rotation.inverse()).to_scaled_axis();
            let axes = DMat3::from_quat(rotation);
            one.member.change(|m| m.carry(&[way_m * known.mass_kg, axes * known.inertia * axes.transpose() * turn]));
        }
    }
}

impl World {
    fn new(scene: &ClusterScene, origin_m: DVec3) -> Self {
        let mut physics = PhysicsWorld { gravity: Vec3::ZERO, ..PhysicsWorld::default() };
        physics.integration_parameters = IntegrationParameters {
            num_solver_iterations: 4,
            num_internal_stabilization_iterations: 2,
            contact_softness: STIFF,
            static_contact_softness: STIFF,
            friction_model: FrictionModel::Simplified,
            normalized_max_linear_velocity: f32::MAX,
            ..IntegrationParameters::default()
        };
        for (number, solid) in (0..).zip(scene.statics()) {
            if let Some(collider) = of_static(solid, origin_m) {
                physics.insert_collider(collider.user_data(Side::Static(number).name()), None);
            }
        }
        Self { physics, ..Self::empty(origin_m) }
    }

    fn empty(origin_m: DVec3) -> Self {
        let physics = PhysicsWorld::default();
        Self { physics, origin_m, bodies: Vec::new(), touched: Vec::new(), given: Vec::new() }
    }

    /// Takes up the members of the rigid pile as they are, and the changes of their velocities in the step.
    fn take(&mut self, all: &[Participant<'_>], domains: &[Domain], progress: &[Progress], h_s: f64) {
        let Self { physics, bodies, origin_m, .. } = self;
        bodies.retain(|known| {
            let stays = place_of(all, known.id).is_some_and(|at| domains[at] == Domain::RigidPile);
            if !stays {
                physics.remove_body(known.handle);
            }
            stays
        });
        let mut smallest_m = f64::INFINITY;
        for (member, (one, state)) in all.iter().zip(progress).enumerate() {
            let Some(body) = placed(one).filter(|_| domains[member] == Domain::RigidPile) else { continue };
            smallest_m = smallest_m.min(body.shape.radius_m);
            let at = match bodies.binary_search_by_key(&one.id, |known| known.id) {
                Ok(at) => at,
                Err(at) => {
                    bodies.insert(at, insert(physics, one, &body, *origin_m));
                    at
                }
            };
            (bodies[at].member, bodies[at].touched) = (member, false);
            let known = bodies[at];
            let Some(inside) = physics.bodies.get_mut(known.handle) else { continue };
            let now = [&state.v_start[0], &state.v_start[1]].map(|v| v.as_vec3());
            // a body that is set anew is searched anew
            let pose = body.pose(*origin_m);
            if *inside.position() != pose {
                inside.set_position(pose, true);
            }
            if [inside.linvel(), inside.angvel()] != now {
                inside.set_linvel(now[0], true);
                inside.set_angvel(now[1], true);
            }
            inside.reset_forces(true);
            inside.reset_torques(true);
            inside.add_force(((state.v_before[0] - state.v_start[0]) * (known.mass_kg / h_s)).as_vec3(), true);
            let axes = DMat3::from_quat(body.rotation);
            let spun = axes * known.inertia * axes.transpose() * (state.v_before[1] - state.v_start[1]);
            inside.add_torque((spun / h_s).as_vec3(), true);
        }
        // the error that rapier3d allows is a share of it
        physics.integration_parameters.length_unit = smallest_m as f32;
    }

    /// How far bodies go in `h_s` seconds, in halves of their radii.
    fn way(&self, progress: &[Progress], h_s: f64) -> f64 {
        let ways = self.bodies.iter().map(|known| {
            let state = &progress[known.member];
            state.v_start[0].length().max(state.v_before[0].length()) * h_s / (0.5 * known.radius_m)
        });
        ways.fold(0.0, f64::max)
    }

    /// Whether all bodies are somewhere.
    fn is_sound(&self) -> bool {
        self.bodies.iter().all(|known| {
            let body = &self.physics.bodies[known.handle];
            let pose = body.position();
            let place = [pose.translation, body.linvel(), body.angvel()];
            pose.rotation.is_finite() && place.iter().all(|v| v.abs().max_element() <= REACH_MAX)
        })
    }

    /// Notes the impulses of pairs in the last step, along the normals of their contacts; whether its places `count`.
    fn read(&mut self, all: &[Participant<'_>], counts: bool) -> PileReport {
        let mut report = PileReport::default();
        let (mut touched, mut given) = (std::mem::take(&mut self.touched), std::mem::take(&mut self.given));
        touched.clear();
        for pair in self.physics.narrow_phase.contact_pairs().filter(|pair| pair.has_any_active_contact()) {
            let Some(sides @ [first_side, _]) = self.sides(pair) else { continue };
            // normals point from the first collider of a pair to the second
            let sign = if self.side(pair.collider1) == Some(first_side) { -1.0 } else { 1.0 };
            let member = |side: Side| match side {
                Side::Body(id) => place_of(all, id),
                Side::Static(_) => None,
            };
            let [Some(first), second] = sides.map(member) else { continue };
            touched.extend(std::iter::once(first).chain(second));
            let partner = match (sides[1], second) {
                (Side::Static(number), _) => Partner::Static(number),
                (Side::Body(id), Some(_)) => Partner::Agent(id),
                (Side::Body(_), None) => continue,
            };
            let Some(first_at) = self.physics.colliders.get(pair.collider1).map(|collider| *collider.position()) else {
                continue;
            };
            for manifold in pair.solver_manifolds() {
                let part_at = manifold.subshape_pos1().map_or(first_at, |part| first_at * *part);
                let towards_member = manifold.data.normal.as_dvec3() * sign;
                for point in &manifold.points {
                    report.contacts += 1;
                    let depth_m = f64::from(-point.dist).max(0.0);
                    report.depth_m = report.depth_m.max(depth_m);
                    if point.data.impulse > 0.0 {
                        let impulse_n_s = towards_member * f64::from(point.data.impulse);
                        let point_m = self.origin_m + (part_at * point.local_p1).as_dvec3();
                        given.push(Given { member: first, partner, impulse_n_s, point_m, depth_m, counts });
                    }
                }
            }
        }
        for &member in &touched {
            let at = self.bodies.binary_search_by_key(&member, |known| known.member);
            at.into_iter().for_each(|at| self.bodies[at].touched = true);
        }
        (self.touched, self.given) = (touched, given);
        report
    }

    /// The sides of a pair: that of the lower number, then its partner.
    fn sides(&self, pair: &ContactPair) -> Option<[Side; 2]> {
        let mut sides = [self.side(pair.collider1)?, self.side(pair.collider2)?];
        sides.sort_unstable();
        Some(sides)
    }

    fn side(&self, collider: ColliderHandle) -> Option<Side> {
        Some(Side::named(self.physics.colliders.get(collider)?.user_data))
    }
}

/// A side of a contact in rapier3d; bodies come before static solids.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Side {
    Body(AgentId),
    Static(u32),
}

impl Side {
    fn name(self) -> u128 {
        match self {
            Self::Body(AgentId(id)) => u128::from(id),
            Self::Static(number) => 1 << 32 | u128::from(number),
        }
    }

    fn named(name: u128) -> Self {
        let number = name as u32;
        if name >> 32 == 0 { Self::Body(AgentId(number)) } else { Self::Static(number) }
    }
}

impl Placed<'_> {
    /// Where its axes are, from an origin.
    fn pose(&self, origin_m: DVec3) -> Pose {
        pose(self.centre_m - self.rotation * self.shape.com_local - origin_m, self.rotation)
    }
}

/// The place of a rigid member; `None` of one whose skin is no solid.
fn placed<'a>(one: &'a Participant<'_>) -> Option<Placed<'a>> {
    let skin = one.member.skin()?;
    let (ShapeKind::Solid(shape), ShapePose::Solid { position, rotation }) = (&skin.form.kind, skin.view) else {
        return None;
    };
    Some(Placed { form: skin.form, shape, centre_m: position, rotation })
}

fn insert(physics: &mut PhysicsWorld, one: &Participant<'_>, body: &Placed<'_>, origin_m: DVec3) -> Known {
    let [mass, inertia] = [0, 1].map(|block| one.member.system().blocks[block].value);
    let locked = one.member.locked();
    let (mass_kg, inertia) = locked.map_or((mass.x_axis.x, inertia), |locked| (locked.mass_kg, locked.inertia));
    let axes = DMat3::from_quat(body.rotation);
    let inertia = axes.transpose() * inertia * axes;
    let com = body.shape.com_local.as_vec3();
    let mass = MassProperties::with_inertia_matrix(com, mass_kg as f32, inertia.as_mat3());
    let builder = RigidBodyBuilder::dynamic()
        .pose(body.pose(origin_m))
        .can_sleep(false)
        .locked_axes(locked.map_or(LockedAxes::empty(), axes_of))
        .soft_ccd_prediction((FORESEEN_RADII * body.shape.radius_m) as f32)
        .allow_fast_rotation(true)
        // the members' own flight, a part of the change of their velocities, has the gyroscopic part
        .gyroscopic_forces_enabled(false);
    let collider = skin(body.shape.shape.clone(), body.form).mass_properties(mass);
    let (handle, _) = physics.insert(builder, collider.user_data(Side::Body(one.id).name()));
    Known { id: one.id, member: 0, handle, mass_kg, inertia, radius_m: body.shape.radius_m, touched: false }
}

/// A bit for each axis: of translations, then of rotations.
fn axes_of(locked: Locked) -> LockedAxes {
    let all = locked.locked_translation.into_iter().chain(locked.locked_rotation);
    let bits = (0..).zip(all).map(|(axis, is_locked)| u8::from(is_locked) << axis);
    LockedAxes::from_bits_truncate(bits.fold(0, |axes, axis| axes | axis))
}

/// A static solid; its form is always one.
fn of_static(solid: &StaticSolid, origin_m: DVec3) -> Option<ColliderBuilder> {
    let ShapeKind::Solid(SolidShape { solid: kind, shape, .. }) = &solid.form.kind else { return None };
    let shape = if matches!(kind, Solid::Plane) { SharedShape::halfspace(Vec3::Z) } else { shape.clone() };
    let at = pose(solid.position() - origin_m, solid.rotation());
    Some(skin(shape, &solid.form).position(at))
}

/// A shape with its skin: a pair takes the geometric mean of both frictions, and the larger restitution. Touches of
/// sensors are found elsewhere.
fn skin(shape: SharedShape, form: &CollisionShape) -> ColliderBuilder {
    let CollisionShape { friction, restitution, traits, .. } = form;
    let [member_of, collides_with] =
        [traits.groups.member_of, traits.groups.collides_with].map(Group::from_bits_retain);
    ColliderBuilder::new(shape)
        .sensor(traits.is_sensor)
        .collision_groups(InteractionGroups::new(member_of, collides_with, InteractionTestMode::And))
        .friction(friction.sqrt() as f32)
        .friction_combine_rule(CoefficientCombineRule::Multiply)
        .restitution(*restitution as f32)
        .restitution_combine_rule(CoefficientCombineRule::Max)
}

fn pose(position: DVec3, rotation: DQuat) -> Pose {
    let turned = rotation.as_quat();
    Pose::from_parts(position.as_vec3(), Rotation::from_xyzw(turned.x, turned.y, turned.z, turned.w))
}
