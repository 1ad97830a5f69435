//! A scene built in code: rigid bodies, tubes, static solids, gravity.
//!
//! In: parts with their measures, by name. Out: a [`Scene`] with the defaults that scene files have.
//! Never here: files.

/// Methods that set one value each, which becomes what its place holds.
macro_rules! setters {
    ($($(#[$doc:meta])* $name:ident: $type:ty => $($place:ident).+;)*) => {$(
        $(#[$doc])*
        #[must_use]
        pub fn $name(mut self, $name: $type) -> Self {
            self.$($place).+ = $name.into();
            self
        }
    )*};
}

mod rigid;
mod sensors;
mod soft;
mod tube;

use super::appearance::Appearance;
use super::couplings::Faults;
use super::kinds::{EnvironmentKind, ExecutorKind, Material, PriorityKind, ShadingKind, StatesKind};
use super::scene::{Machine, Member, PaceWish, Scene, Spec};
use super::target::Target;
use glam::{DQuat, DVec3};
use metachron_contact::Agent;
use metachron_contact::detect::{ClusterScene, SolveBudget};
use metachron_contact::solve::DEPTH_DEFAULT_M;
use metachron_core::{AgentId, DisjointSets, N_MAX, Resolution, ResolutionRange, SimSpan, unit_rotation};
use metachron_geometry::{Cells, Obstacle, Solid, StaticSolid};
use metachron_models::rigid::{Joint, JointError, JointKind, Mimic, RigidSpec};
pub use rigid::Rigid;
pub use sensors::SensorOn;
use sensors::{Mounted, Mounts};
pub use soft::Soft;
use std::sync::Arc;
pub use tube::Tube;

/// Default step rate of a part, Hz.
const RATE_DEFAULT_HZ: f64 = 240.0;
/// Default gravity, m/s².
const GRAVITY_DEFAULT: DVec3 = DVec3::new(0.0, 0.0, -9.81);
/// Friction and restitution of rigid bodies and static solids where a part does not say otherwise.
const SURFACE: (f64, f64) = (0.5, 0.0);

/// Why a scene cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneBuildError {
    /// Two parts have one name.
    #[error("two objects are named \"{name}\"; every object needs a unique name")]
    SameName {
        /// The name.
        name: String,
    },
    /// An object without a name: nothing could ask for it.
    #[error("an object has an empty name; expected at least one character")]
    NoName,
    /// A joint names an object that is no rigid body.
    #[error("a joint names \"{name}\", which is no rigid body of the scene")]
    NoBody {
        /// The name.
        name: String,
    },
    /// A joint follows one that there is not.
    #[error("a joint follows the joint \"{name}\", and the scene has none of that name")]
    NoJoint {
        /// The name.
        name: String,
    },
    /// The finest spacing of a soft body gives more cells than a step can take.
    #[error("the finest ε of \"{name}\" is too fine for its size")]
    TooFine {
        /// The part.
        name: String,
    },
    /// A sensor names an object or joint that does not exist.
    #[error("the sensor \"{sensor}\" is on \"{on}\", which is no {what} of the scene")]
    NoMount {
        /// The sensor.
        sensor: String,
        /// The name that it gives.
        on: String,
        /// The kind of thing that it can be on.
        what: &'static str,
    },
    /// A rotation that is none.
    #[error("\"{name}\" is turned by {found}; expected a quaternion that is finite and not zero")]
    BadRotation {
        /// The object.
        name: String,
        /// The rotation as given.
        found: String,
    },
    /// A sensor sits where nothing can.
    #[error("the sensor \"{sensor}\" is at {found}; expected finite numbers and a quaternion of a length above 0")]
    BadSite {
        /// The sensor.
        sensor: String,
        /// The site as given.
        found: String,
    },
    /// A joint cannot be.
    #[error("the joint of \"{name}\" cannot be: {reason}")]
    BadJoint {
        /// The first body.
        name: String,
        /// Why.
        reason: String,
    },
    /// How contacts rest or are solved cannot be.
    #[error("{reason}")]
    BadContact {
        /// The number that is wrong, its value and its range.
        reason: String,
    },
    /// An object that cannot be built.
    #[error("object \"{name}\": {reason}")]
    BadObject {
        /// The object.
        name: String,
        /// The number that is wrong, its value and its range.
        reason: String,
    },
    /// A rate is outside its range.
    #[error("the rate of \"{name}\" is {rate_hz} Hz; expected 1 to 100000 Hz")]
    BadRate {
        /// The part.
        name: String,
        /// The rate as given.
        rate_hz: String,
    },
}

/// A scene in the making. It can be serialized where no part is [`Custom`].
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct SceneBuilder {
    gravity: DVec3,
    contact_depth_m: f64,
    contact_budget: SolveBudget,
    fixed: Vec<Obstacle>,
    parts: Vec<(String, Part)>,
    joints: Vec<Joined>,
    sensors: Vec<Mounted>,
}

/// A joint by the names of its bodies; no second one is the world.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Joined {
    name: String,
    a: String,
    b: Option<String>,
    kind: JointKind,
    at_m: DVec3,
    friction: f64,
    armature: f64,
    mimic: Option<Followed>,
}

/// The joint that another one follows, by its name.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Followed {
    joint: String,
    ratio: f64,
}

/// The parts that can be added to a scene: a [`Rigid`] body, a [`Tube`], a [`Soft`] body, or an agent of your own
/// ([`Custom`]), which no file can have.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub enum Part {
    /// A rigid body.
    Rigid(Rigid),
    /// A soft tube, cable or rod.
    Tube(Tube),
    /// A sheet, solid or rope.
    Soft(Soft),
    /// An agent of somebody else's.
    #[serde(skip)]
    Custom(Custom),
}

/// An agent of a model of your own ([`Agent`]): it touches others where it is a member of clusters ([`Agent::member`]). A model passes
/// `metachron_models::conformance` first. It is not drawn.
#[derive(Clone)]
pub struct Custom {
    make: Arc<dyn Fn(AgentId) -> Box<dyn Agent> + Send + Sync>,
    rate_hz: f64,
}

impl Custom {
    /// This agent: a clone of it for each world that the scene is started as.
    #[must_use]
    pub fn new(agent: impl Agent + Clone + Sync + 'static) -> Self {
        Self::made_by(move |_| Box::new(agent.clone()))
    }

    /// The agent that `make` makes, by its number: a new one for each world that the scene is started as.
    #[must_use]
    pub fn made_by(make: impl Fn(AgentId) -> Box<dyn Agent> + Send + Sync + 'static) -> Self {
        Self { make: Arc::new(make), rate_hz: RATE_DEFAULT_HZ }
    }

    setters! {
        /// Steps a simulated second, 1 … 100000.
        rate_hz: f64 => rate_hz;
    }

    pub(crate) fn build(&self, id: AgentId) -> Box<dyn Agent> {
        (self.make)(id)
    }
}

impl std::fmt::Debug for Custom {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Custom").field("rate_hz", &self.rate_hz).finish_non_exhaustive()
    }
}

macro_rules! parts {
    ($($part:ident)*) => {$(
        impl From<$part> for Part {
            fn from(part: $part) -> Self {
                Self::$part(part)
            }
        }
    )*};
}

parts! { Custom Rigid Soft Tube }

impl SceneBuilder {
    /// An empty scene with gravity along −z.
    pub(crate) const fn new() -> Self {
        Self {
            gravity: GRAVITY_DEFAULT,
            contact_depth_m: DEPTH_DEFAULT_M,
            contact_budget: SolveBudget::Exact,
            fixed: Vec::new(),
            parts: Vec::new(),
            joints: Vec::new(),
            sensors: Vec::new(),
        }
    }

    setters! {
        /// Gravity, m/s².
        gravity: [f64; 3] => gravity;
        /// The depth of a resting contact, metres, 1e-6 … 1e-3; default 2e-5. A ten-thousandth of the smallest body is not
        /// seen.
        contact_depth_m: f64 => contact_depth_m;
        /// How far the solves of contacts go in a run that goes by a clock; default: to the end.
        contact_budget: SolveBudget => contact_budget;
    }

    /// A solid that never moves, with its axes at the origin.
    #[must_use]
    pub fn fixed(self, name: impl Into<String>, solid: Solid) -> Self {
        self.fixed_at(name, solid, [0.0; 3], DQuat::IDENTITY)
    }

    /// A solid that never moves, with its axes at `position_m`, metres, turned by `rotation`.
    #[must_use]
    pub fn fixed_at(self, name: impl Into<String>, solid: Solid, position_m: [f64; 3], rotation: DQuat) -> Self {
        let position = position_m.into();
        self.obstacle(Obstacle { position, rotation, ..static_solid(name, solid) })
    }

    /// A solid that never moves, with its own friction, restitution and traits.
    #[must_use]
    pub fn obstacle(mut self, obstacle: Obstacle) -> Self {
        self.fixed.push(obstacle);
        self
    }

    /// Joins the rigid bodies `a` and `b`, or `a` and the world, at a place where both are at the start, metres. The place and the axis of `kind`
    /// are in the axes of the world, as the bodies are at the start. Springs and ropes, which have two ends, are not for this.
    #[must_use]
    pub fn joint(mut self, a: impl Into<String>, b: Option<&str>, kind: JointKind, at_m: [f64; 3]) -> Self {
        let (name, b, at_m) = (String::new(), b.map(str::to_owned), at_m.into());
        let (friction, armature, mimic) = (0.0, 0.0, None);
        self.joints.push(Joined { name, a: a.into(), b, kind, at_m, friction, armature, mimic });
        self
    }

    /// Gives the joint that was added last dry friction, beside its motor: N·m of a hinge or a ball in its socket, N of a slide, 0 to 1e9.
    #[must_use]
    pub fn joint_friction(mut self, friction: f64) -> Self {
        self.joints.last_mut().into_iter().for_each(|joint| joint.friction = friction);
        self
    }

    /// Gives the joint that was added last the inertia of a rotor behind its gear: kg·m² of a hinge or a ball in its socket, kg of a slide, 0 to 1e9.
    #[must_use]
    pub fn joint_armature(mut self, armature: f64) -> Self {
        self.joints.last_mut().into_iter().for_each(|joint| joint.armature = armature);
        self
    }

    /// Lets the joint that was added last, a hinge or a slide, follow another one from where both start, as a gear does: its travel is `ratio`
    /// times that of the joint of this name, radians or metres for each radian or metre, within ±1e6. Either drives the other.
    #[must_use]
    pub fn mimic(mut self, joint: impl Into<String>, ratio: f64) -> Self {
        if let Some(last) = self.joints.last_mut() {
            last.mimic = Some(Followed { joint: joint.into(), ratio });
        }
        self
    }

    /// Names the joint that was added last, so that [`crate::World::joint`] and sensors find it.
    #[must_use]
    pub fn joint_name(mut self, name: impl Into<String>) -> Self {
        if let Some(joint) = self.joints.last_mut() {
            joint.name = name.into();
        }
        self
    }

    /// Adds a sensor, which [`crate::World::sensor`] reads.
    #[must_use]
    pub fn sensor(mut self, name: impl Into<String>, on: SensorOn) -> Self {
        self.sensors.push(Mounted { name: name.into(), on });
        self
    }

    /// Adds a rigid body or a tube.
    #[must_use]
    pub fn add(mut self, name: impl Into<String>, part: impl Into<Part>) -> Self {
        self.parts.push((name.into(), part.into()));
        self
    }

    /// The names of the moving objects added so far, in their order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.parts.iter().map(|(name, _)| &**name)
    }

    /// The scene; agents that start inside each other are moved apart where that strains nothing.
    ///
    /// # Errors
    /// [`SceneBuildError`].
    pub fn build(self) -> Result<Scene, SceneBuildError> {
        self.check_names()?;
        let Self { gravity, contact_depth_m, contact_budget, fixed, parts, joints, sensors } = self;
        let unit = |solid: Obstacle| Ok(Obstacle { rotation: checked_rotation(&solid.name, solid.rotation)?, ..solid });
        let obstacles: Arc<[Obstacle]> = fixed.into_iter().map(unit).collect::<Result<_, _>>()?;
        check_surroundings(&obstacles, contact_depth_m, contact_budget)?;
        let ids = (0..).map(AgentId);
        let agents: Result<Vec<_>, _> =
            ids.zip(parts).map(|(id, (name, part))| member(id, name, part, gravity)).collect();
        let agents = agents?;
        let joint_names: Vec<_> = joints.iter().map(|joined| joined.name.clone()).collect();
        let joints =
            joints.iter().map(|joined| joined.between(&agents, &joint_names)).collect::<Result<Vec<_>, _>>()?;
        let mut tied = DisjointSets::of(joints.len());
        for (number, joint) in (0..).zip(&joints) {
            let name = || agents[joint.a.0 as usize].name.clone();
            let bad = |error: JointError| SceneBuildError::BadJoint { name: name(), reason: error.to_string() };
            joint.check_mimic(number, &joints, &mut tied).map_err(bad)?;
        }
        let mounts = Mounts { agents: &agents, fixed: &obstacles, joints: &joint_names };
        let sensors: Result<Vec<_>, _> = sensors.into_iter().map(|mounted| mounts.sensor(mounted)).collect();
        let sensors = sensors?;
        let mut scene = Scene {
            name: "built in code".to_owned(),
            description: String::new(),
            executor: ExecutorKind::default(),
            priority: PriorityKind::default(),
            stall_limit: None,
            states: StatesKind::default(),
            environment: EnvironmentKind::default(),
            gravity,
            target: Target::default(),
            cameras: Vec::new(),
            machine: Machine::default(),
            agents,
            obstacle_appearances: obstacles.iter().map(|_| DEFAULT_APPEARANCE).collect(),
            obstacles,
            #[cfg(feature = "scenery")]
            scenery: Vec::new(),
            #[cfg(feature = "scenery")]
            groups: Vec::new(),
            cells: Cells::default(),
            walls: 0..0,
            contacts: true,
            contact_depth_m,
            contact_budget,
            joints: joints.into(),
            joint_names,
            sensors,
            couplings: Vec::new(),
            probes: Vec::new(),
            overlaps: Vec::new(),
            moved: Vec::new(),
        };
        scene.resolve_initial_overlaps();
        Ok(scene)
    }
}

impl SceneBuilder {
    /// Whether all names of a kind differ.
    fn check_names(&self) -> Result<(), SceneBuildError> {
        let differ = |names: &[&String]| match names.iter().enumerate().find(|(at, name)| names[..*at].contains(name)) {
            Some((_, name)) => Err(SceneBuildError::SameName { name: (*name).clone() }),
            None => Ok(()),
        };
        let fixed = self.fixed.iter().map(|solid| &solid.name);
        let named: Vec<_> = fixed.chain(self.parts.iter().map(|(name, _)| name)).collect();
        if named.iter().any(|name| name.is_empty()) {
            return Err(SceneBuildError::NoName);
        }
        differ(&named)?;
        let joints = self.joints.iter().map(|joint| &joint.name).filter(|name| !name.is_empty());
        differ(&joints.collect::<Vec<_>>())?;
        differ(&self.sensors.iter().map(|sensor| &sensor.name).collect::<Vec<_>>())
    }
}

impl Joined {
    /// The joint of these agents, among joints of these names.
    fn between(&self, agents: &[Member], joints: &[String]) -> Result<Joint, SceneBuildError> {
        let body = |name: &String| {
            let found = agents.iter().find(|member| member.name == *name);
            let spec = found.and_then(|member| if let Spec::Rigid(spec) = &member.spec { Some(spec) } else { None });
            let id = found.map_or(AgentId(0), |member| member.id);
            spec.map(|spec| (id, spec)).ok_or_else(|| SceneBuildError::NoBody { name: name.clone() })
        };
        let (id, a) = body(&self.a)?;
        let b = self.b.as_ref().map(body).transpose()?;
        let local = |spec: &RigidSpec| spec.rotation.conjugate() * (self.at_m - spec.position);
        let mut kind = self.kind;
        if let JointKind::Revolute { axis, .. } | JointKind::Prismatic { axis, .. } = &mut kind {
            *axis = a.rotation.conjugate() * *axis;
        }
        let mimic = self.mimic.as_ref().map(|followed| {
            let found = joints.iter().position(|name| *name == followed.joint && !name.is_empty());
            let joint = found.ok_or_else(|| SceneBuildError::NoJoint { name: followed.joint.clone() })? as u32;
            // both are at their zero
            Ok(Mimic { joint, ratio: followed.ratio, offset: 0.0 })
        });
        let joint = Joint {
            mimic: mimic.transpose()?,
            friction: self.friction,
            armature: self.armature,
            anchor_a_m: local(a),
            anchor_b_m: b.map_or(self.at_m, |(_, spec)| local(spec)),
            ..Joint::new(id, b.map(|(id, _)| id), kind)
        };
        let joint = joint.at_rest_in(a.rotation, b.map_or(DQuat::IDENTITY, |(_, spec)| spec.rotation));
        let bad = |error: JointError| SceneBuildError::BadJoint { name: self.a.clone(), reason: error.to_string() };
        joint.check().map_err(bad)?;
        Ok(joint)
    }
}

/// Whether the static solids can be, and contacts can rest so deep and be solved so far.
fn check_surroundings(solids: &[Obstacle], depth_m: f64, budget: SolveBudget) -> Result<(), SceneBuildError> {
    let wrong = |reason: String| SceneBuildError::BadContact { reason };
    ClusterScene::default().resting_at(depth_m).map_err(|error| wrong(error.to_string()))?;
    ClusterScene::default().within(budget).map_err(|error| wrong(error.to_string()))?;
    solids.iter().try_for_each(|solid| {
        let bad = |reason: String| SceneBuildError::BadObject { name: solid.name.clone(), reason };
        solid.check_surface().map_err(|error| bad(error.to_string()))?;
        StaticSolid::new(solid).map(drop).map_err(|error| bad(error.to_string()))
    })
}

/// The rotation of an object, of length 1.
fn checked_rotation(name: &str, given: DQuat) -> Result<DQuat, SceneBuildError> {
    let bad = || SceneBuildError::BadRotation { name: name.to_owned(), found: given.to_string() };
    unit_rotation(given).ok_or_else(bad)
}

/// A solid that never moves, with its axes at the origin, as rough and elastic as one that says nothing of it.
#[must_use]
pub fn static_solid(name: impl Into<String>, solid: Solid) -> Obstacle {
    let (friction, restitution) = SURFACE;
    Obstacle { friction, restitution, ..Obstacle::new(name, solid) }
}

/// Appearance of parts that declare none.
const DEFAULT_APPEARANCE: Appearance = Appearance {
    colour: [200, 160, 150],
    material: Material::Plastic,
    importance: 1.0,
    may_vanish: None,
    shading: ShadingKind::Any,
};

/// The agent of a part.
///
/// # Errors
/// [`SceneBuildError::BadRate`], [`SceneBuildError::BadRotation`], [`SceneBuildError::TooFine`] and [`SceneBuildError::BadObject`].
pub(crate) fn member(id: AgentId, name: String, part: Part, gravity: DVec3) -> Result<Member, SceneBuildError> {
    let rate_hz = match &part {
        Part::Rigid(rigid) => rigid.rate_hz,
        Part::Tube(tube) => tube.rate_hz,
        Part::Soft(soft) => soft.rate_hz,
        Part::Custom(custom) => custom.rate_hz,
    };
    let dt = SimSpan::from_secs_f64(1.0 / rate_hz).filter(|_| (1.0..=1e5).contains(&rate_hz));
    let Some(dt) = dt else { return Err(SceneBuildError::BadRate { name, rate_hz: rate_hz.to_string() }) };
    let mut eps_m = None;
    let (spec, start) = match part {
        Part::Rigid(rigid) => {
            let rotation = checked_rotation(&name, rigid.spec.rotation)?;
            let spec = RigidSpec { rotation, gravity: gravity * rigid.gravity_scale, ..rigid.spec };
            (Spec::Rigid(spec), Resolution { eps_m: 1.0, n: N_MAX })
        }
        Part::Tube(tube) => {
            let spec = tube.spec(gravity);
            let start = spec.resolution;
            (Spec::Tube(spec), start)
        }
        Part::Soft(mut soft) => {
            soft.spec.rotation = checked_rotation(&name, soft.spec.rotation)?;
            let Some((spec, range_m)) = soft.spec(gravity) else { return Err(SceneBuildError::TooFine { name }) };
            eps_m = range_m;
            (Spec::Soft(spec), Resolution { eps_m: range_m.map_or(1.0, |range| range.0), n: N_MAX })
        }
        Part::Custom(custom) => (Spec::Custom(custom), Resolution { eps_m: 1.0, n: 1 }),
    };
    spec.check().map_err(|reason| SceneBuildError::BadObject { name: name.clone(), reason: reason.to_string() })?;
    let picture = ResolutionRange { eps_m: (start.eps_m, start.eps_m), n: (1, 5) };
    Ok(Member {
        id,
        name,
        spec,
        pace: PaceWish { rate_hz, dt, dt_range: (dt, dt) },
        tolerance_m: None,
        simulation: eps_m.map_or(ResolutionRange::fixed(start), |eps_m| ResolutionRange { eps_m, n: (1, start.n) }),
        start,
        picture,
        links: Vec::new(),
        appearance: DEFAULT_APPEARANCE,
        host: None,
        faults: Faults::default(),
    })
}
