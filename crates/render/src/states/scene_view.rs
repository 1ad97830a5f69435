//! From published snapshots to the states that a frame shows.
//!
//! In: the newest snapshot of each agent and the frame's time. Out: one pose per object, at the time that the choice of [`States`] gives,
//! and its age. Never here: threads, clocks, the GPU. Nothing is allocated once sizes settle.

mod shapes;

use super::impostor_fit::ImpostorFit;
use super::pose;
use crate::composition::compose;
use crate::composition::environment::Environment;
use crate::composition::lod_transition::Geomorph;
use crate::composition::picture::Picture;
use crate::composition::skin::SkinForm;
use crate::composition::texturing::Painting;
use crate::seen::view::{Camera, CameraMotion, Size};
use crate::seen::visibility::{Survey, Visibility};
use glam::DVec3;
use metachron_core::{AgentId, Body, CurveState, RigidState, SimTime, Snapshot};
use metachron_drawable::{Model, Motion, Placement, Skeleton};
use metachron_geometry::{CollisionShape, ShapeKind};
use metachron_geometry::{Obstacle, PrimitiveMesh, Solid, ToolShape};
pub(crate) use shapes::{BodyShape, Bounds, Models, StaticShape};
use std::sync::Arc;

pub use metachron_core::kinds::{Material, StatesKind as States};

/// Appearance of an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// Colour, sRGB.
    pub colour: [u8; 3],
    /// Material.
    pub material: Material,
}

/// Drawn form of an agent.
#[derive(Debug, Clone)]
pub enum Form {
    /// Not drawn.
    Unseen,
    /// A skin over a framed curve.
    Tube,
    /// A rigid solid.
    Solid(Solid),
    /// A grasping tool.
    Tool(ToolShape),
    /// Geometry without snapshots, at rest or in a declared motion ([`SceneView::set_motion`]); its level gives the number of triangles.
    Scenery(Model, Placement),
    /// The skin of a sheet or soft solid.
    Skin(SkinForm),
    /// A rope.
    Rope {
        /// Its radius, metres.
        radius_m: f64,
    },
}

/// An agent to be drawn.
#[derive(Debug, Clone)]
pub struct Actor {
    /// The agent.
    pub id: AgentId,
    /// Its form.
    pub form: Form,
    /// Its colour and material.
    pub appearance: Appearance,
}

/// A visible static solid. The first plane among the static solids is the floor.
#[derive(Debug, Clone)]
pub struct StaticObject {
    /// Shape and pose.
    pub obstacle: Obstacle,
    /// Its colour and material.
    pub appearance: Appearance,
    /// Whether it throws a shadow, and the light is fitted to it: walls and ceilings of rooms do not, or it would be dark in them.
    pub throws_shadow: bool,
}

/// All objects that can be drawn, and their states at the time of a frame.
#[derive(Debug, Default)]
pub struct SceneView {
    pub(crate) tracks: Vec<Track>,
    pub(crate) statics: Vec<StaticShape>,
    pub(crate) picture: Picture,
    pub(crate) scratch: compose::Scratch,
    pub(crate) survey: Survey,
    /// How many of the last actors are drawn in place of groups of others, and the fits of the moving ones.
    pub(crate) impostors: usize,
    pub(crate) fits: Vec<ImpostorFit>,
    /// Results of the last survey, and the camera and picture size of that survey.
    pub(crate) found: Vec<Visibility>,
    /// The actors that the last survey updated.
    pub(crate) updated: Vec<usize>,
    pub(crate) eye: Option<(Camera, Size)>,
    /// How the camera moves; `None` if it rests.
    pub(crate) camera_motion: Option<CameraMotion>,
    /// Metres that the arrow of one newton has.
    pub(crate) force_scale: f64,
    /// Frames over which meshes change their cut.
    pub(crate) geomorph_frames: u8,
}

/// One agent over time.
#[derive(Debug)]
pub(crate) struct Track {
    pub actor: Actor,
    pub body: BodyShape,
    pub before: Option<Arc<Snapshot>>,
    pub newest: Option<Arc<Snapshot>>,
    pub awake: bool,
    /// The agent is at rest and shown at rest: its pose stays unchanged until the next snapshot.
    pub still: bool,
    /// Whether it was posed again since the last survey.
    pub fresh: bool,
    /// The displayed state.
    pub pose: Body,
    pub shown: SimTime,
    pub age_s: f64,
    pub bounds: Bounds,
    pub seen: bool,
    pub skeleton: Skeleton,
    /// ε at which the skeleton was made from the present pose; `None` where it was made from an earlier one.
    pub cut_m: Option<f64>,
    /// The cut at which a mesh is drawn while visible.
    pub geomorph: Option<Geomorph>,
    /// The displayed curve of a rope.
    pub rope: CurveState,
    /// Texture of scenery.
    pub painting: Option<Painting>,
    /// The motion of scenery that moves by itself.
    pub motion: Option<Motion>,
}

impl SceneView {
    /// A view of these actors and static solids.
    #[must_use]
    pub fn new(actors: Vec<Actor>, statics: Vec<StaticObject>) -> Self {
        let (mut meshes, mut models) = (Vec::new(), Models::default());
        let statics = statics.into_iter().map(|prop| StaticShape::new(prop, &mut meshes)).collect();
        let tracks = actors.into_iter().map(|actor| Track::new(actor, &mut meshes, &mut models)).collect();
        let models = models.0.into_iter().map(|(model, _)| model).collect();
        let picture = Picture { meshes: meshes.into(), models, ..Picture::default() };
        Self { tracks, statics, picture, ..Self::default() }
    }

    /// Lets an actor that is scenery move; an unknown actor is ignored.
    pub fn set_motion(&mut self, id: AgentId, motion: Motion) {
        if let Some(track) = self.tracks.iter_mut().find(|track| track.actor.id == id) {
            track.motion = Some(motion);
        }
    }

    /// Chooses the environment light of the scene from the next picture on.
    pub fn set_environment(&mut self, environment: Environment) {
        self.picture.environment = environment;
    }

    /// Chooses the scale of pictures from the next one on: [`Picture::scale`].
    pub fn set_scale(&mut self, scale: f64) {
        self.picture.scale = if scale > 0.0 { scale.min(1.0) } else { 1.0 };
    }

    /// Chooses whether objects throw shadows from the next picture on: [`Picture::shadows`].
    pub fn set_shadows(&mut self, shadows: bool) {
        self.picture.shadows = shadows;
    }

    /// Receives the newest snapshot of an agent; `awake` states whether the agent continues to step.
    /// A snapshot already received changes nothing, one of an earlier time restarts the agent's history (a reset).
    pub fn set_snapshot(&mut self, id: AgentId, newest: &Arc<Snapshot>, awake: bool) {
        if let Some(track) = self.track_mut(id) {
            track.set_snapshot(newest, awake);
        }
    }

    /// Receives the newest contact shape of an agent: the skin of a sheet or a solid is drawn and picked by it from now on.
    pub fn set_shape(&mut self, id: AgentId, shape: &CollisionShape) {
        let ShapeKind::Surface(surface) = &shape.kind else { return };
        if let Some(Track { actor: Actor { form: Form::Skin(skin), .. }, .. }) = self.track_mut(id) {
            skin.set_surface(surface);
        }
    }

    pub(super) fn track_mut(&mut self, id: AgentId) -> Option<&mut Track> {
        // the index of an actor is mostly its agent's number
        let here = |track: &Track| track.actor.id == id;
        let at = id.0 as usize;
        let at = if self.tracks.get(at).is_some_and(here) { Some(at) } else { self.tracks.iter().position(here) };
        at.and_then(|at| self.tracks.get_mut(at))
    }

    /// Poses every object at the frame's time by the rule of `states`, except objects that rest and are shown at rest;
    /// returns the number posed.
    pub fn pose(&mut self, time: SimTime, states: States) -> usize {
        let mut posed = 0;
        for track in self.tracks.iter_mut().filter(|track| !track.still) {
            posed += usize::from(track.pose_at(time, states));
        }
        self.fit_impostors();
        posed
    }

    /// Age in seconds of the newest state of an agent when the frame was posed; zero for one at rest.
    #[must_use]
    pub fn age_s(&self, id: AgentId) -> Option<f64> {
        self.tracks.iter().find(|track| track.actor.id == id).map(|track| track.age_s)
    }

    /// The state of an agent that the frame shows, and its time.
    #[must_use]
    pub fn shown(&self, id: AgentId) -> Option<(&Body, SimTime)> {
        self.tracks.iter().find(|track| track.actor.id == id).map(|track| (&track.pose, track.shown))
    }
}

impl Track {
    pub fn new(actor: Actor, meshes: &mut Vec<PrimitiveMesh>, models: &mut Models) -> Self {
        let body = match &actor.form {
            Form::Solid(solid) => BodyShape::of(solid, meshes),
            Form::Scenery(model, at) => models.body(model, at),
            Form::Tool(tool) => {
                let radius_m = tool.shaft_length_m + 12.0 * tool.shaft_radius_m;
                let side = 2.0 * tool.shaft_radius_m * tool.shaft_length_m;
                BodyShape { radius_m, mean_area_m2: side, ..BodyShape::default() }
            }
            Form::Tube | Form::Skin(_) | Form::Rope { .. } | Form::Unseen => BodyShape::default(),
        };
        let pose = match &actor.form {
            Form::Scenery(_, at) => {
                Body::Rigid(RigidState { position: at.position, rotation: at.rotation, ..RigidState::default() })
            }
            _ => Body::Nothing,
        };
        let mut track = Self {
            actor,
            body,
            before: None,
            newest: None,
            awake: true,
            still: false,
            fresh: true,
            pose,
            shown: SimTime::ZERO,
            age_s: 0.0,
            bounds: Bounds::default(),
            seen: true,
            skeleton: Skeleton::default(),
            cut_m: None,
            geomorph: None,
            rope: CurveState::default(),
            painting: None,
            motion: None,
        };
        track.bounds = track.find_bounds();
        track
    }

    fn set_snapshot(&mut self, newest: &Arc<Snapshot>, awake: bool) {
        (self.awake, self.still) = (awake, false);
        match &self.newest {
            Some(known) if known.moment() == newest.moment() && known.steps == newest.steps => {}
            Some(known) if known.moment() < newest.moment() => {
                self.before = self.newest.replace(Arc::clone(newest));
            }
            _ => {
                self.before = None;
                self.newest = Some(Arc::clone(newest));
            }
        }
    }

    /// Whether there was a snapshot or a motion to pose it by.
    fn pose_at(&mut self, time: SimTime, states: States) -> bool {
        if let (Some(motion), Form::Scenery(_, rest)) = (&self.motion, &self.actor.form) {
            if self.shown == time {
                return false;
            }
            let (at, velocity) = motion.at(rest, time.as_secs_f64());
            self.shown = time;
            self.show(Body::Rigid(RigidState {
                position: at.position,
                rotation: at.rotation,
                velocity,
                ..RigidState::default()
            }));
            return true;
        }
        let Some(newest) = &self.newest else { return false };
        self.age_s = if self.awake { time.secs_after(newest.moment()).max(0.0) } else { 0.0 };
        self.shown = match (states, &self.before) {
            (States::Interpolate, Some(before)) => pose::between(before, newest, time, &mut self.pose),
            (States::Extrapolate, _) if self.awake => pose::beyond(newest, time, &mut self.pose),
            _ => {
                pose::copy(&newest.body, &mut self.pose);
                newest.moment()
            }
        };
        self.still = !self.awake && self.shown == newest.moment();
        self.renew();
        true
    }

    /// Takes this pose from the next survey on.
    pub fn show(&mut self, pose: Body) {
        self.pose = pose;
        self.renew();
    }

    /// Finds the values that depend on the pose.
    fn renew(&mut self) {
        self.bounds = self.find_bounds();
        (self.fresh, self.cut_m) = (true, None);
    }

    fn find_bounds(&self) -> Bounds {
        match &self.pose {
            Body::Nothing => Bounds::default(),
            Body::Rigid(rigid) => {
                let centre = rigid.position + rigid.rotation * self.body.middle_m;
                Bounds::ball(centre, self.body.radius_m)
            }
            Body::Tool(tool) => {
                let half = 0.5 * self.body.radius_m;
                Bounds::ball(tool.tip - tool.rotation * DVec3::Z * half, 1.2 * half)
            }
            Body::Curve(curve) => Bounds::of(&curve.positions, curve.radii_m.iter().copied().fold(0.0, f64::max)),
            Body::Soft(soft) => match &self.actor.form {
                // a vertex that its skin has no more is anywhere
                Form::Skin(skin) => Bounds::within(skin.surface.bounds(&soft.positions)),
                _ => Bounds::of(&soft.positions, 0.0),
            },
        }
    }
}
