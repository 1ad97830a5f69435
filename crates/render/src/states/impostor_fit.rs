//! Where the impostor of a group stands once the group's members have moved.
//!
//! In: poses of the members, at first and now. Out: the turn, scale and shift that bring the first nearest to the present ones in the sense of
//! least squares (UME91, eq. 40 … 43), applied to the impostor. Never here: whether the impostor is drawn.
//! A member that is rigid says by its own rotation how the group has turned, so that a group of one turns too.

use super::scene_view::{BodyShape, Bounds, Form, SceneView, Track};
use glam::{DMat3, DQuat, DVec3};
use metachron_core::{Body, RigidState};
use metachron_drawable::Placement;

/// Passes of the search for the nearest rotation; it starts at that of the frame before.
const PASSES: usize = 20;
/// A turn that is too small to go on, radians.
const STILL_RAD: f64 = 1e-9;
/// The addition to the stiffness against a turn that no member resists, as a part of all of it.
const ROUND_OFF: f64 = 1e-12;
/// The part of r² that the axes of a ball of radius r count with.
const AXES: f64 = 1.0 / 3.0;

/// The impostor of a group some of whose members move.
#[derive(Debug)]
pub(crate) struct ImpostorFit {
    /// Its index among the actors, and the members' indices.
    track: usize,
    members: Vec<usize>,
    /// The poses of it and of the members at first; `None` until all of them have a pose.
    first: Option<First>,
    /// How far the group has turned.
    turned: DQuat,
}

/// The impostor and the members when all had a pose for the first time.
#[derive(Debug)]
struct First {
    placement: Placement,
    body: BodyShape,
    members: Group,
}

/// Members of a group at one time.
#[derive(Debug)]
struct Group {
    members: Vec<MemberPose>,
    centre: DVec3,
    /// Sum of squared distances of all of them from the centre, m².
    spread_m2: f64,
}

/// A member at one time.
#[derive(Debug, Clone, Copy)]
struct MemberPose {
    centre: DVec3,
    radius_m: f64,
    /// Its rotation if it is rigid.
    rotation: Option<DQuat>,
    velocity: DVec3,
}

impl MemberPose {
    fn of(track: &Track) -> Option<Self> {
        let Bounds { centre, radius_m, .. } = track.bounds;
        let mean = |all: &[DVec3]| all.iter().sum::<DVec3>() / all.len().max(1) as f64;
        let (rotation, velocity) = match &track.pose {
            Body::Nothing => return None,
            Body::Rigid(rigid) => (Some(rigid.rotation), rigid.velocity),
            Body::Tool(tool) => (Some(tool.rotation), tool.velocity),
            Body::Curve(curve) => (None, mean(&curve.velocities)),
            Body::Soft(soft) => (None, mean(&soft.velocities)),
        };
        Some(Self { centre, radius_m, rotation, velocity })
    }
}

impl Group {
    /// `None` where a member has no pose yet.
    fn of(members: &[usize], tracks: &[Track]) -> Option<Self> {
        let members: Vec<_> = members.iter().map(|at| MemberPose::of(&tracks[*at])).collect::<Option<_>>()?;
        let centre = members.iter().map(|it| it.centre).sum::<DVec3>() / members.len().max(1) as f64;
        let spread = |it: &MemberPose| it.centre.distance_squared(centre) + it.radius_m * it.radius_m;
        let spread_m2 = members.iter().map(spread).sum();
        Some(Self { members, centre, spread_m2 })
    }

    /// The rotation from `first` nearest to these members, sought from `turned` by Newton's method, or where that would not approach it by the
    /// safe step of (MBCM16).
    fn turned_from(&self, first: &Self, mut turned: DQuat) -> DQuat {
        let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
        let mut moments = DMat3::ZERO;
        for (now, then) in self.members.iter().zip(&first.members) {
            moments += outer(now.centre - self.centre, then.centre - first.centre);
            if let Some((now_axes, then_axes)) = now.rotation.zip(then.rotation) {
                let axes = DMat3::from_quat(now_axes * then_axes.conjugate());
                moments += axes * (AXES * now.radius_m * then.radius_m);
            }
        }
        for _ in 0..PASSES {
            let left = moments * DMat3::from_quat(turned.conjugate());
            let torque =
                DVec3::new(left.y_axis.z - left.z_axis.y, left.z_axis.x - left.x_axis.z, left.x_axis.y - left.y_axis.x);
            let hold = left.x_axis.x + left.y_axis.y + left.z_axis.z;
            let slack = 1.0 + ROUND_OFF;
            let stiffness = DMat3::from_diagonal(DVec3::splat(slack * hold)) - 0.5 * (left + left.transpose());
            let newton = stiffness.inverse() * torque;
            let approaches = hold > 0.0 && newton.length_squared() < 1.0 && newton.dot(torque) >= 0.0;
            let step = if approaches { newton } else { torque / hold.abs().max(f64::MIN_POSITIVE) };
            if !step.is_finite() || step.length_squared() < STILL_RAD * STILL_RAD {
                break;
            }
            turned = (DQuat::from_scaled_axis(step) * turned).normalize();
        }
        turned
    }
}

impl SceneView {
    /// Says which of the actors the last actors are drawn in place of, one list for each: these are not counted as
    /// objects, and move as the members do if one of them moves.
    pub fn set_groups(&mut self, groups: &[Vec<usize>]) {
        self.impostors = groups.len();
        let before = self.tracks.len().saturating_sub(groups.len());
        let moves = |at: &usize| {
            let track = &self.tracks[*at];
            !matches!(track.actor.form, Form::Scenery(..)) || track.motion.is_some()
        };
        let moving = groups.iter().enumerate().filter(|(_, members)| members.iter().any(moves));
        let fit = |(k, members): (usize, &Vec<usize>)| ImpostorFit {
            track: before + k,
            members: members.clone(),
            first: None,
            turned: DQuat::IDENTITY,
        };
        self.fits = moving.map(fit).collect();
    }

    /// Moves the impostors of groups of which a member was posed again.
    pub(super) fn fit_impostors(&mut self) {
        for fit in &mut self.fits {
            if fit.members.iter().any(|at| self.tracks[*at].fresh) {
                fit.move_impostor(&mut self.tracks);
            }
        }
    }
}

impl ImpostorFit {
    /// An actor was put in at the place `at`.
    pub(super) fn shift(&mut self, at: usize) {
        for actor in self.members.iter_mut().chain([&mut self.track]) {
            *actor += usize::from(*actor >= at);
        }
    }

    fn move_impostor(&mut self, tracks: &mut [Track]) {
        let Some(now) = Group::of(&self.members, tracks) else { return };
        let track = &mut tracks[self.track];
        let Form::Scenery(_, at) = &mut track.actor.form else { return };
        let first = match &self.first {
            Some(first) => first,
            None => return self.first = Some(First { placement: *at, body: track.body, members: now }),
        };
        self.turned = now.turned_from(&first.members, self.turned);
        let scale = (now.spread_m2 / first.members.spread_m2.max(f64::MIN_POSITIVE)).sqrt();
        let arm = self.turned * (first.placement.position - first.members.centre);
        at.scale = scale * first.placement.scale;
        track.body = first.body.scaled(scale);
        track.show(Body::Rigid(RigidState {
            position: now.centre + scale * arm,
            rotation: self.turned * first.placement.rotation,
            velocity: now.members.iter().map(|it| it.velocity).sum::<DVec3>() / now.members.len().max(1) as f64,
            ..RigidState::default()
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::super::scene_view::{Actor, Appearance, Material, States};
    use super::*;
    use metachron_core::{AgentId, SimTime, Snapshot};
    use metachron_drawable::{Generator, Model, ProgressiveMesh, generate};
    use metachron_geometry::Solid;
    use std::sync::Arc;

    /// Balls and the impostor of all of them; at the start it is where it is given.
    fn view(balls: usize, at: Placement) -> SceneView {
        let appearance = Appearance { colour: [200; 3], material: Material::Plastic };
        let actor = |id: usize, form| Actor { id: AgentId(id as u32), form, appearance };
        let mesh = Arc::new(ProgressiveMesh::new(&generate(Generator::Sphere, 0, 20)).unwrap());
        let mut actors: Vec<_> = (0..balls).map(|id| actor(id, Form::Solid(Solid::Ball { radius_m: 0.1 }))).collect();
        actors.push(actor(balls, Form::Scenery(Model::Mesh(mesh), at)));
        let mut view = SceneView::new(actors, vec![]);
        view.set_groups(&[(0..balls).collect()]);
        view
    }

    fn put(view: &mut SceneView, balls: &[(DVec3, DQuat)], ms: u64) -> Placement {
        let time = SimTime::from_nanos(1_000_000 * ms);
        for (id, (position, rotation)) in (0..).zip(balls) {
            let body = Body::Rigid(RigidState { position: *position, rotation: *rotation, ..RigidState::default() });
            view.set_snapshot(AgentId(id), &Arc::new(Snapshot { time, steps: ms, body, ..Snapshot::default() }), true);
        }
        view.pose(time, States::Latest);
        let track = &view.tracks[balls.len()];
        match (&track.actor.form, &track.pose) {
            (Form::Scenery(_, at), Body::Rigid(pose)) => {
                Placement { position: pose.position, rotation: pose.rotation, scale: at.scale }
            }
            _ => unreachable!("it is scenery"),
        }
    }

    #[test]
    fn an_impostor_turns_shifts_and_grows_as_its_members_do() {
        let start = Placement { position: DVec3::new(1.0, 0.5, 0.0), rotation: DQuat::IDENTITY, scale: 2.0 };
        let first = [DVec3::ZERO, DVec3::X * 3.0, DVec3::Y * 2.0, DVec3::Z].map(|at| (at, DQuat::IDENTITY));
        let mut view = view(4, start);
        assert_eq!(put(&mut view, &first, 0), start);
        for (ms, angle) in [(10, 0.4), (20, 1.1), (30, 2.9)] {
            let (turn, shift) = (DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 2.0) / 3.0, angle), DVec3::splat(angle));
            let moved = first.map(|(at, own)| (turn * at + shift, turn * own));
            let now = put(&mut view, &moved, ms);
            assert!(now.position.distance(turn * start.position + shift) < 1e-6, "{now:?}");
            assert!(now.rotation.angle_between(turn) < 1e-6 && (now.scale - 2.0).abs() < 1e-9, "{now:?}");
        }
        // twice as far apart: nearly twice as large, as the balls themselves did not grow
        let apart = put(&mut view, &first.map(|(at, own)| (2.0 * at, own)), 40);
        assert!((3.9..4.0).contains(&apart.scale), "{}", apart.scale);
        assert!((view.tracks[4].bounds.radius_m / apart.scale - 1.0).abs() < 0.01);
    }

    #[test]
    fn the_impostor_of_a_single_rigid_body_turns_with_it() {
        let start = Placement { position: DVec3::X, rotation: DQuat::IDENTITY, scale: 1.0 };
        let mut view = view(1, start);
        put(&mut view, &[(DVec3::ZERO, DQuat::IDENTITY)], 0);
        let turn = DQuat::from_rotation_z(1.2);
        let now = put(&mut view, &[(DVec3::Z, turn)], 10);
        assert!(now.position.distance(turn * DVec3::X + DVec3::Z) < 1e-6 && (now.scale - 1.0).abs() < 1e-12);
    }
}
