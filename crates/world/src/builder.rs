//! A scene built in code: rigid bodies, tubes, static solids, gravity.
//!
//! In: parts with their measures, by name. Out: a [`Scene`] with the defaults that scene files have.
//! Never here: files; whether a model can be built is found at [`crate::World::start`].

use super::couplings::Faults;
use super::kinds::{
    EnvironmentKind, ExecutorKind, LawKind, Material, PolicyKind, PriorityKind, ShadingKind, StatesKind, ValueKind,
};
use super::scene::{Appearance, Factors, Gains, Machine, Member, PaceWish, RENDER_SCALE, Scene, Spec, Target};
use glam::{DQuat, DVec3};
use metachron_contact::Agent;
use metachron_contact::cluster::DEPTH_DEFAULT_M;
use metachron_core::{AgentId, N_MAX, Resolution, ResolutionRange, SimSpan};
use metachron_geometry::{Cells, ContactTraits, Obstacle, Solid};
use metachron_models::rigid::{Joint, JointError, JointKind, RigidSpec};
use metachron_models::rod::{Material as Elastic, Section, TubeSpec};
use std::sync::Arc;

/// Default step rate of a part, Hz.
const RATE_DEFAULT_HZ: f64 = 240.0;
/// Default gravity, m/s².
const GRAVITY_DEFAULT: DVec3 = DVec3::new(0.0, 0.0, -9.81);
/// Friction and restitution of rigid bodies and static solids where a part does not say otherwise.
const SURFACE: (f64, f64) = (0.5, 0.2);
/// Friction of a tube's skin where it does not say otherwise.
const TUBE_FRICTION: f64 = 0.2;
/// Equal parts of a tube where it does not say otherwise.
const SEGMENTS_DEFAULT: usize = 40;
/// Poisson's ratio and density (kg/m³) of a tube where it does not say otherwise: soft tissue.
const TISSUE: (f64, f64) = (0.45, 1050.0);
/// Shear coefficient of thin walls.
const SHEAR_FACTOR: f64 = 27.0 / 28.0;

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
    /// A joint names what is no rigid body.
    #[error("a joint names \"{name}\", which is no rigid body of the scene")]
    NoBody {
        /// The name.
        name: String,
    },
    /// A joint cannot be.
    #[error("the joint of \"{name}\" cannot be: {reason}")]
    BadJoint {
        /// The first body.
        name: String,
        /// Why.
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

/// A scene in the making.
#[derive(Debug, Clone)]
pub struct SceneBuilder {
    gravity: DVec3,
    contact_depth_m: f64,
    fixed: Vec<Obstacle>,
    parts: Vec<(String, Part)>,
    joints: Vec<Joined>,
}

/// A joint by the names of its bodies; no second one is the world.
#[derive(Debug, Clone)]
struct Joined {
    a: String,
    b: Option<String>,
    kind: JointKind,
    at_m: DVec3,
}

/// What can be added to a scene: a [`Rigid`] body, a [`Tube`], or an agent of your own ([`Custom`]).
#[derive(Debug, Clone)]
pub enum Part {
    /// A rigid body.
    Rigid(Rigid),
    /// A soft tube, cable or rod.
    Tube(Tube),
    /// An agent of somebody else's.
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
    /// The agent that `make` makes: a new one for each world that the scene is started as.
    #[must_use]
    pub fn new(make: impl Fn(AgentId) -> Box<dyn Agent> + Send + Sync + 'static) -> Self {
        Self { make: Arc::new(make), rate_hz: RATE_DEFAULT_HZ }
    }

    /// Steps a simulated second, 1 … 100000.
    #[must_use]
    pub fn rate_hz(mut self, rate_hz: f64) -> Self {
        self.rate_hz = rate_hz;
        self
    }

    pub(super) fn build(&self, id: AgentId) -> Box<dyn Agent> {
        (self.make)(id)
    }
}

impl std::fmt::Debug for Custom {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Custom").field("rate_hz", &self.rate_hz).finish_non_exhaustive()
    }
}

impl From<Custom> for Part {
    fn from(custom: Custom) -> Self {
        Self::Custom(custom)
    }
}

/// A rigid body before it is added.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct Rigid {
    spec: RigidSpec,
    rate_hz: f64,
}

/// A tube before it is added.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct Tube {
    path_m: Vec<DVec3>,
    radius_m: f64,
    wall_m: Option<f64>,
    young_pa: f64,
    density_kg_m3: f64,
    segments: usize,
    clamp: [bool; 2],
    damping_per_s: f64,
    rate_hz: f64,
}

impl From<Rigid> for Part {
    fn from(rigid: Rigid) -> Self {
        Self::Rigid(rigid)
    }
}

impl From<Tube> for Part {
    fn from(tube: Tube) -> Self {
        Self::Tube(tube)
    }
}

impl Rigid {
    /// A body of this shape: 1 kg at the origin, at rest.
    #[must_use]
    pub fn new(solid: Solid) -> Self {
        let (friction, restitution) = SURFACE;
        let spec = RigidSpec { friction, restitution, sleep: true, ..RigidSpec::free(solid, DVec3::ZERO, 1.0) };
        Self { spec, rate_hz: RATE_DEFAULT_HZ }
    }

    /// A ball of this radius, metres.
    #[must_use]
    pub fn ball(radius_m: f64) -> Self {
        Self::new(Solid::Ball { radius_m })
    }

    /// A box with these half edges, metres.
    #[must_use]
    pub fn cuboid(half_extents_m: [f64; 3]) -> Self {
        Self::new(Solid::Box { half_extents_m: half_extents_m.into() })
    }

    /// Its mass, kilograms, 1e-9 … 1e9.
    #[must_use]
    pub const fn mass_kg(mut self, mass_kg: f64) -> Self {
        self.spec.mass_kg = mass_kg;
        self
    }

    /// Position of its shape's origin, metres.
    #[must_use]
    pub fn at(mut self, position_m: [f64; 3]) -> Self {
        self.spec.position = position_m.into();
        self
    }

    /// Rotation from its shape's axes to the world's.
    #[must_use]
    pub const fn turned(mut self, rotation: DQuat) -> Self {
        self.spec.rotation = rotation;
        self
    }

    /// Velocity at the start, m/s.
    #[must_use]
    pub fn velocity_m_s(mut self, velocity: [f64; 3]) -> Self {
        self.spec.velocity = velocity.into();
        self
    }

    /// Coefficient of restitution, 0 … 1.
    #[must_use]
    pub const fn restitution(mut self, restitution: f64) -> Self {
        self.spec.restitution = restitution;
        self
    }

    /// Coulomb friction coefficient, ≥ 0.
    #[must_use]
    pub const fn friction(mut self, friction: f64) -> Self {
        self.spec.friction = friction;
        self
    }

    /// What it says about its contacts: what it collides with, rules of pairs, whether it only senses.
    #[must_use]
    pub const fn contact(mut self, traits: ContactTraits) -> Self {
        self.spec.traits = traits;
        self
    }

    /// Steps a simulated second, 1 … 100000.
    #[must_use]
    pub const fn rate_hz(mut self, rate_hz: f64) -> Self {
        self.rate_hz = rate_hz;
        self
    }
}

impl Tube {
    /// A tube along these points, metres: of soft tissue, 1 cm in radius, solid, both ends free.
    #[must_use]
    pub fn along(path_m: &[[f64; 3]]) -> Self {
        Self {
            path_m: path_m.iter().map(|point| DVec3::from_array(*point)).collect(),
            radius_m: 0.01,
            wall_m: None,
            young_pa: 1e6,
            density_kg_m3: TISSUE.1,
            segments: SEGMENTS_DEFAULT,
            clamp: [false; 2],
            damping_per_s: 0.0,
            rate_hz: RATE_DEFAULT_HZ,
        }
    }

    /// Outer radius, metres, > 0.
    #[must_use]
    pub const fn radius_m(mut self, radius_m: f64) -> Self {
        self.radius_m = radius_m;
        self
    }

    /// Thickness of its wall, metres, above 0 and at most its radius; without it the tube is solid.
    #[must_use]
    pub const fn wall_m(mut self, wall_m: f64) -> Self {
        self.wall_m = Some(wall_m);
        self
    }

    /// Young's modulus, Pa, > 0.
    #[must_use]
    pub const fn young_pa(mut self, young_pa: f64) -> Self {
        self.young_pa = young_pa;
        self
    }

    /// Density, kg/m³, > 0.
    #[must_use]
    pub const fn density_kg_m3(mut self, density_kg_m3: f64) -> Self {
        self.density_kg_m3 = density_kg_m3;
        self
    }

    /// Number of equal parts, 2 … 4096.
    #[must_use]
    pub const fn segments(mut self, segments: usize) -> Self {
        self.segments = segments;
        self
    }

    /// Which ends are held in position and direction: start, end.
    #[must_use]
    pub const fn clamp(mut self, ends: [bool; 2]) -> Self {
        self.clamp = ends;
        self
    }

    /// Mass-proportional damping, 1/s, ≥ 0.
    #[must_use]
    pub const fn damping_per_s(mut self, damping_per_s: f64) -> Self {
        self.damping_per_s = damping_per_s;
        self
    }

    /// Steps a simulated second, 1 … 100000.
    #[must_use]
    pub const fn rate_hz(mut self, rate_hz: f64) -> Self {
        self.rate_hz = rate_hz;
        self
    }

    fn spec(self, gravity: DVec3) -> TubeSpec {
        let material = Elastic {
            young_pa: self.young_pa,
            poisson: TISSUE.0,
            density_kg_m3: self.density_kg_m3,
            shear_factor: SHEAR_FACTOR,
        };
        let section = Section::hollow(self.radius_m, self.wall_m.unwrap_or(self.radius_m), material);
        TubeSpec {
            clamp: self.clamp,
            damping_per_s: self.damping_per_s,
            self_contact: true,
            friction: TUBE_FRICTION,
            gravity,
            sleep: true,
            ..TubeSpec::free(self.path_m, section, self.segments)
        }
    }
}

impl SceneBuilder {
    /// An empty scene with gravity along −z.
    pub(super) const fn new() -> Self {
        let joints = Vec::new();
        Self {
            gravity: GRAVITY_DEFAULT,
            contact_depth_m: DEPTH_DEFAULT_M,
            fixed: Vec::new(),
            parts: Vec::new(),
            joints,
        }
    }

    /// Gravity, m/s².
    #[must_use]
    pub fn gravity(mut self, gravity_m_s2: [f64; 3]) -> Self {
        self.gravity = gravity_m_s2.into();
        self
    }

    /// How deep what lies on each other rests, metres, 1e-6 … 1e-3; default 2e-5. A ten-thousandth of the smallest body is not seen.
    #[must_use]
    pub fn contact_depth_m(mut self, contact_depth_m: f64) -> Self {
        self.contact_depth_m = contact_depth_m;
        self
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

    /// Joins the rigid bodies `a` and `b`, or `a` and the world, at a place where both are at the start, metres. The joint's axis is in
    /// the axes of a's shape. Springs and ropes, which have two ends, are not for this.
    #[must_use]
    pub fn joint(mut self, a: &str, b: Option<&str>, kind: JointKind, at_m: [f64; 3]) -> Self {
        self.joints.push(Joined { a: a.to_owned(), b: b.map(str::to_owned), kind, at_m: at_m.into() });
        self
    }

    /// Adds a rigid body or a tube.
    #[must_use]
    pub fn add(mut self, name: impl Into<String>, part: impl Into<Part>) -> Self {
        self.parts.push((name.into(), part.into()));
        self
    }

    /// The scene; agents that start inside each other are moved apart where that strains nothing.
    ///
    /// # Errors
    /// [`SceneBuildError`].
    pub fn build(self) -> Result<Scene, SceneBuildError> {
        let Self { gravity, contact_depth_m, fixed, parts, joints } = self;
        let names: Vec<&String> =
            fixed.iter().map(|solid| &solid.name).chain(parts.iter().map(|(name, _)| name)).collect();
        if let Some((_, name)) = names.iter().enumerate().find(|(at, name)| names[..*at].contains(name)) {
            return Err(SceneBuildError::SameName { name: (*name).clone() });
        }
        let obstacles: Arc<[Obstacle]> = fixed.into();
        let ids = (0..).map(AgentId);
        let agents: Result<Vec<_>, _> =
            ids.zip(parts).map(|(id, (name, part))| member(id, name, part, gravity)).collect();
        let agents = agents?;
        let joints: Result<Arc<[_]>, _> = joints.iter().map(|joined| joined.between(&agents)).collect();
        let mut scene = Scene {
            name: "built in code".to_owned(),
            description: String::new(),
            executor: ExecutorKind::default(),
            priority: PriorityKind::default(),
            states: StatesKind::default(),
            environment: EnvironmentKind::default(),
            gravity,
            target: Target {
                frame_hz: 60.0,
                policy: PolicyKind::default(),
                value: ValueKind::default(),
                law: LawKind::default(),
                gains: Gains::default(),
                lag: None,
                raise: false,
                may_vanish: false,
                factors: Factors::default(),
                render_scale: RENDER_SCALE,
            },
            camera: None,
            machine: Machine::default(),
            agents,
            obstacle_appearances: obstacles.iter().map(|_| DEFAULT_APPEARANCE).collect(),
            obstacles,
            scenery: Vec::new(),
            groups: Vec::new(),
            cells: Cells::default(),
            walls: 0..0,
            contacts: true,
            contact_depth_m,
            joints: joints?,
            couplings: Vec::new(),
            probes: Vec::new(),
            overlaps: Vec::new(),
            moved: Vec::new(),
        };
        scene.resolve_initial_overlaps();
        Ok(scene)
    }
}

impl Joined {
    /// The joint of these agents.
    fn between(&self, agents: &[Member]) -> Result<Joint, SceneBuildError> {
        let body = |name: &String| {
            let found = agents.iter().find(|member| member.name == *name);
            let spec = found.and_then(|member| if let Spec::Rigid(spec) = &member.spec { Some(spec) } else { None });
            let id = found.map_or(AgentId(0), |member| member.id);
            spec.map(|spec| (id, spec)).ok_or_else(|| SceneBuildError::NoBody { name: name.clone() })
        };
        let (id, a) = body(&self.a)?;
        let b = self.b.as_ref().map(body).transpose()?;
        let local = |spec: &RigidSpec| spec.rotation.conjugate() * (self.at_m - spec.position);
        let joint = Joint {
            anchor_a_m: local(a),
            anchor_b_m: b.map_or(self.at_m, |(_, spec)| local(spec)),
            ..Joint::new(id, b.map(|(id, _)| id), self.kind)
        };
        let joint = joint.at_rest_in(a.rotation, b.map_or(DQuat::IDENTITY, |(_, spec)| spec.rotation));
        let bad = |error: JointError| SceneBuildError::BadJoint { name: self.a.clone(), reason: error.to_string() };
        joint.check().map_err(bad)?;
        Ok(joint)
    }
}

/// A solid that never moves, with its axes at the origin, as rough and elastic as one that says nothing of it.
#[must_use]
pub fn static_solid(name: impl Into<String>, solid: Solid) -> Obstacle {
    let (friction, restitution) = SURFACE;
    let (position, rotation, traits) = (DVec3::ZERO, DQuat::IDENTITY, ContactTraits::NONE);
    Obstacle { name: name.into(), solid, position, rotation, friction, restitution, traits }
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
/// [`SceneBuildError::BadRate`].
pub(super) fn member(id: AgentId, name: String, part: Part, gravity: DVec3) -> Result<Member, SceneBuildError> {
    let rate_hz = match &part {
        Part::Rigid(rigid) => rigid.rate_hz,
        Part::Tube(tube) => tube.rate_hz,
        Part::Custom(custom) => custom.rate_hz,
    };
    let dt = SimSpan::from_secs_f64(1.0 / rate_hz).filter(|_| (1.0..=1e5).contains(&rate_hz));
    let Some(dt) = dt else { return Err(SceneBuildError::BadRate { name, rate_hz: rate_hz.to_string() }) };
    let (spec, start) = match part {
        Part::Rigid(rigid) => {
            let spec = RigidSpec { gravity, ..rigid.spec };
            (Spec::Rigid(spec), Resolution { eps_m: 1.0, n: N_MAX })
        }
        Part::Tube(tube) => {
            let spec = tube.spec(gravity);
            let start = spec.resolution;
            (Spec::Tube(spec), start)
        }
        Part::Custom(custom) => (Spec::Custom(custom), Resolution { eps_m: 1.0, n: 1 }),
    };
    let picture = ResolutionRange { eps_m: (start.eps_m, start.eps_m), n: (1, 5) };
    Ok(Member {
        id,
        name,
        spec,
        pace: PaceWish { rate_hz, dt, dt_range: (dt, dt) },
        tolerance_m: None,
        simulation: ResolutionRange::fixed(start),
        start,
        picture,
        links: Vec::new(),
        appearance: DEFAULT_APPEARANCE,
        faults: Faults::default(),
    })
}
