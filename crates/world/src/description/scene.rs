//! A scene that can be run: every value checked, every default filled in, every name resolved.
//!
//! In: built in code ([`Scene::builder`]) or by `metachron-scene`. Out: plain data that the frame loop turns into agents, obstacles, a camera and a target.
//! Never here: the file's text, running agents.

use super::appearance::Appearance;
use super::builder::{Custom, SceneBuilder};
use super::couplings::{Coupling, Faults};
use super::kinds::{EnvironmentKind, ExecutorKind, PriorityKind, StatesKind};
use super::placement::{Moved, Overlap};
#[cfg(feature = "scenery")]
use super::scenery::{Group, Scenery};
use super::sensor::Sensor;
use super::target::Target;
use glam::DVec3;
#[cfg(doc)]
use metachron_contact::detect::DEPTH_RANGE_M;
use metachron_contact::detect::SolveBudget;
use metachron_core::{AgentId, Resolution, ResolutionRange, SimSpan};
use metachron_geometry::{Cells, Obstacle};
use metachron_models::rigid::Joint;
use metachron_models::rigid::RigidSpec;
use metachron_models::rod::TubeSpec;
use metachron_models::soft::SoftSpec;
use metachron_models::synthetic::SyntheticSpec;
use metachron_models::tool::ToolSpec;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

/// A scene that can be run.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The built-in scene's name, or the file's.
    pub name: String,
    /// One line that describes the scene; may be empty.
    pub description: String,
    /// How agents are run.
    pub executor: ExecutorKind,
    /// How the operating system schedules the threads of agents.
    pub priority: PriorityKind,
    /// How long the turn of an object may last, wall time, before the object counts as stalled; `None` for 250 ms. Ten of its steps are
    /// always allowed, and a cluster's turn as many times as long as it has members, 25 at most; a checkpoint waits for a stalled turn as long. In
    /// lockstep other threads that ask for the object's state, or wait for the world, judge the turn in progress.
    pub stall_limit: Option<Duration>,
    /// Time at which states are drawn.
    pub states: StatesKind,
    /// Its environment light in pictures.
    pub environment: EnvironmentKind,
    /// Gravity, m/s².
    pub gravity: DVec3,
    /// The target frame rate and how it is held.
    pub target: Target,
    /// The cameras; the first is used where none is chosen. None where the scene gives none.
    pub cameras: Vec<NamedCamera>,
    /// The declared machine.
    pub machine: Machine,
    /// The agents; an agent's id is its index here.
    pub agents: Vec<Member>,
    /// The static solids.
    pub obstacles: Arc<[Obstacle]>,
    /// Looks of the obstacles, in their order.
    pub obstacle_appearances: Vec<Appearance>,
    /// Objects that are only drawn; the members of a group are adjacent.
    #[cfg(feature = "scenery")]
    pub scenery: Vec<Scenery>,
    /// Objects that may be drawn as one mesh; a group comes after the groups in it.
    #[cfg(feature = "scenery")]
    pub groups: Vec<Group>,
    /// Rooms and the openings between them.
    pub cells: Cells,
    /// Which obstacles are walls of rooms: light falls in through them.
    pub walls: Range<usize>,
    /// Whether agents collide with each other where no coupling says otherwise.
    pub contacts: bool,
    /// The depth of resting contacts, metres ([`DEPTH_RANGE_M`]).
    pub contact_depth_m: f64,
    /// How far the solves of contacts go.
    pub contact_budget: SolveBudget,
    /// Joints between rigid agents.
    pub joints: Arc<[Joint]>,
    /// Their names, in their order; empty where a joint has none.
    pub joint_names: Vec<String>,
    /// The sensors, which programs read by name.
    pub sensors: Vec<Sensor>,
    /// Pairs that interact otherwise than by the default contact.
    pub couplings: Vec<Coupling>,
    /// The points whose state is reported.
    pub probes: Vec<Probe>,
    /// Pairs that overlap where the scene puts them.
    pub overlaps: Vec<Overlap>,
    /// Agents that start elsewhere because of an overlap.
    pub moved: Vec<Moved>,
}

/// A camera of a scene, by its name.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedCamera {
    /// Its name; no other camera of the scene has it.
    pub name: String,
    /// Where it is and looks.
    pub camera: Camera,
}

/// Where a camera is and looks, at every time.
#[derive(Debug, Clone, PartialEq)]
pub enum Camera {
    /// A still view.
    Still(View),
    /// Turns about the vertical axis through the point that it looks at.
    Orbit {
        /// The view at the start.
        start: View,
        /// Seconds per turn; negative turns clockwise seen from above.
        period_s: f64,
    },
    /// Moves along keyframes.
    Path {
        /// Times in seconds, rising, and views.
        keys: Vec<(f64, View)>,
        /// Whether the path repeats.
        repeat: bool,
        /// Whether it moves linearly between keyframes, instead of starting and stopping softly at each.
        even: bool,
    },
}

/// One view; up is +z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Position of the eye, metres.
    pub eye_m: DVec3,
    /// Point that it looks at, metres.
    pub look_at_m: DVec3,
    /// Vertical angle of view, degrees, 1 … 150.
    pub fov_deg: f64,
}

/// The declared machine: a preset, and the values that differ from it.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, schemars::JsonSchema), serde(default, deny_unknown_fields))]
pub struct Machine {
    /// The preset to start from: `two-cores-software` (default), `workstation` or `llvmpipe`, whose prices of drawing were measured.
    pub preset: String,
    /// Cores that agents and frames share.
    pub cores: Option<u32>,
    /// Costs of a step of each model, by the model's name, and of a factor of contacts that are solved as one problem, by `factor`.
    pub step: BTreeMap<String, StepCost>,
    /// Milliseconds per frame before anything is drawn.
    pub draw_setup_ms: Option<f64>,
    /// Microseconds per drawn object.
    pub draw_object_us: Option<f64>,
    /// Microseconds per triangle.
    pub draw_triangle_us: Option<f64>,
    /// Nanoseconds per pixel of the picture as drawn.
    pub draw_pixel_ns: Option<f64>,
    /// Nanoseconds per pixel that a picture of fewer pixels is enlarged to.
    pub draw_enlarge_ns: Option<f64>,
    /// Part of the faster of an object's triangles and pixels that the slower does not hide: 0 where two stages work beside each other, 1 where one
    /// does after the other. Policies are not told and begin with 0. Default 0.
    pub draw_serial: Option<f64>,
    /// Whether a graphics card draws, and not the cores that agents step on. Default: as the preset has it, a card in `workstation`.
    pub graphics_card: Option<bool>,
    /// Nanoseconds per object for culling. Default 0.
    pub cull_object_ns: Option<f64>,
    /// Nanoseconds per object in view for choosing its level. Default 0.
    pub choose_object_ns: Option<f64>,
    /// Costs of objects by their shading, where they differ from `draw_object_us`, `draw_triangle_us` and the preset.
    pub shading: ShadingCosts,
    /// Relative standard deviation of every cost.
    pub noise: Option<f64>,
    /// Relative standard deviation of a slowly varying factor on the frame time; it keeps nine tenths of itself from frame to frame.
    /// Default 0.
    pub wander: Option<f64>,
    /// Share of frames that take 1.5 times as long. Default 0.
    pub spikes: Option<f64>,
    /// Additional load of the machine while frames are drawn, by rising time; at most 1000 entries.
    #[cfg_attr(feature = "serde", schemars(length(max = 1000)))]
    pub load: Vec<Load>,
    /// Additional load of the machine while agents step, by rising time; at most 1000 entries.
    #[cfg_attr(feature = "serde", schemars(length(max = 1000)))]
    pub step_load: Vec<Load>,
    /// Seed of the noise.
    pub seed: Option<u32>,
}

/// From a time on every frame, or every step, takes a factor times its declared time.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, schemars::JsonSchema), serde(deny_unknown_fields))]
pub struct Load {
    /// Wall-clock seconds after the start; later than the entry before.
    pub at_s: f64,
    /// The factor from then on: 2.5 is a machine 2.5 times as slow, 0.4 one 2.5 times as fast.
    pub factor: f64,
}

/// Costs of objects by their shading.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Deserialize, schemars::JsonSchema),
    serde(default, deny_unknown_fields, rename_all = "kebab-case")
)]
pub struct ShadingCosts {
    /// One colour per triangle.
    pub flat: ObjectCost,
    /// Colours at vertices, interpolated between them.
    pub gouraud: ObjectCost,
    /// Lighting at every pixel.
    pub per_pixel: ObjectCost,
    /// Lighting at every pixel of a textured surface.
    pub textured: ObjectCost,
    /// Leaves drawn as points instead of shaded triangles.
    pub points: ObjectCost,
    /// Boughs drawn as lines.
    pub lines: ObjectCost,
}

/// Cost of an object: object + max(triangle · triangles + vertex · vertices, pixel · pixels that it covers); `None` is the preset's.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, schemars::JsonSchema), serde(default, deny_unknown_fields))]
pub struct ObjectCost {
    /// Microseconds per object.
    pub object_us: Option<f64>,
    /// Microseconds per triangle.
    pub triangle_us: Option<f64>,
    /// Microseconds per vertex. Default 0.
    pub vertex_us: Option<f64>,
    /// Nanoseconds per pixel that the object covers. Default 0.
    pub pixel_ns: Option<f64>,
}

/// Cost of a step of a model: base + unit · work; `None` is the preset's.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, schemars::JsonSchema), serde(default, deny_unknown_fields))]
pub struct StepCost {
    /// Microseconds per step.
    pub base_us: Option<f64>,
    /// Microseconds per unit of work; that is of a tube one segment in one solved system, with one or more systems per substep, of a synthetic
    /// agent a declared microsecond, of `factor` a contact, of others a step.
    pub unit_us: Option<f64>,
}

/// An agent of the scene.
#[derive(Debug, Clone)]
pub struct Member {
    /// Its index in [`Scene::agents`].
    pub id: AgentId,
    /// Its name, unique in the scene.
    pub name: String,
    /// Its model and values.
    pub spec: Spec,
    /// Its rate and steps.
    pub pace: PaceWish,
    /// The error tolerance by which its steps and spacing are chosen, metres; `None` where it keeps a rate instead.
    pub tolerance_m: Option<f64>,
    /// Resolutions that its simulation may take.
    pub simulation: ResolutionRange,
    /// Resolution of its simulation at the start.
    pub start: Resolution,
    /// Resolutions that its picture may take.
    pub picture: ResolutionRange,
    /// Agents whose snapshots it sees: tools that may grasp it, or agents that it may grasp.
    pub links: Vec<AgentId>,
    /// How it looks.
    pub appearance: Appearance,
    /// The host that is to step it, where several do ([`crate::PlacedWorld::pin`]).
    pub host: Option<String>,
    /// Faults injected into its clock and messages.
    pub faults: Faults,
}

/// Rate and steps that an agent requests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaceWish {
    /// Requested steps per second.
    pub rate_hz: f64,
    /// Step length at the start.
    pub dt: SimSpan,
    /// Shortest and longest step the controller may choose; equal where dt is fixed.
    pub dt_range: (SimSpan, SimSpan),
}

/// Model of an agent, with its values.
#[derive(Debug, Clone)]
pub enum Spec {
    /// A soft tube.
    Tube(TubeSpec),
    /// A rigid body.
    Rigid(RigidSpec),
    /// A sheet, solid or rope.
    Soft(SoftSpec),
    /// A driven tool.
    Tool(ToolSpec),
    /// Declared cost and error.
    Synthetic(SyntheticSpec),
    /// A model of somebody else.
    Custom(Custom),
}

impl Spec {
    /// The model's name as scenes write it.
    #[must_use]
    pub fn model(&self) -> &'static str {
        match self {
            Self::Tube(_) => "tube",
            Self::Rigid(_) => "rigid",
            Self::Soft(spec) => spec.shape.model(),
            Self::Tool(_) => "tool",
            Self::Synthetic(_) => "synthetic",
            Self::Custom(_) => "custom",
        }
    }
}

/// A material point whose state is reported.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// The agent that the point belongs to.
    pub agent: AgentId,
    /// That agent's name.
    pub object: String,
    /// 0 start … 1 end of a tube's or rope's rest length, the first corner … the opposite one of a sheet or solid; no meaning
    /// for other models.
    pub at: f64,
    /// Time between samples, if samples are requested.
    pub every: Option<SimSpan>,
}

impl Scene {
    /// Begins a scene in code: no objects, gravity of 9.81 m/s² along −z.
    #[must_use]
    pub const fn builder() -> SceneBuilder {
        SceneBuilder::new()
    }

    /// The name of an agent; empty where no agent has this id.
    #[must_use]
    pub fn name_of(&self, id: AgentId) -> &str {
        self.agents.get(id.0 as usize).map_or("", |member| &member.name)
    }
}

impl Camera {
    /// Duration of its path or turn, seconds; `None` for a still view.
    #[must_use]
    pub fn length_s(&self) -> Option<f64> {
        match self {
            Self::Still(_) => None,
            Self::Orbit { period_s, .. } => Some(period_s.abs()),
            Self::Path { keys, .. } => keys.last().map(|(at, _)| *at),
        }
    }

    /// The view `seconds` after the start.
    #[must_use]
    pub fn view_at(&self, seconds: f64) -> View {
        match self {
            Self::Still(view) => *view,
            Self::Orbit { start, period_s } => {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * (seconds / period_s).fract());
                let arm = start.eye_m - start.look_at_m;
                let turned = DVec3::new(cos * arm.x - sin * arm.y, sin * arm.x + cos * arm.y, arm.z);
                View { eye_m: start.look_at_m + turned, ..*start }
            }
            Self::Path { keys, repeat, even } => view_on_path(keys, *repeat, *even, seconds),
        }
    }
}

/// Between two keyframes the view moves linearly (`even`), or by smoothstep: it starts and stops softly at each.
fn view_on_path(keys: &[(f64, View)], repeat: bool, even: bool, seconds: f64) -> View {
    let last = keys[keys.len() - 1];
    let seconds = if repeat && last.0 > 0.0 { seconds.rem_euclid(last.0) } else { seconds };
    let right = keys.partition_point(|(at, _)| *at <= seconds);
    match (right.checked_sub(1).map(|left| keys[left]), keys.get(right)) {
        (Some((from, a)), Some((to, b))) => {
            let w = (seconds - from) / (to - from);
            let w = if even { w } else { w * w * (3.0 - 2.0 * w) };
            View {
                eye_m: a.eye_m.lerp(b.eye_m, w),
                look_at_m: a.look_at_m.lerp(b.look_at_m, w),
                fov_deg: a.fov_deg + (b.fov_deg - a.fov_deg) * w,
            }
        }
        (None, Some((_, first))) => *first,
        _ => last.1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(x: f64) -> View {
        View { eye_m: DVec3::new(x, 0.0, 1.0), look_at_m: DVec3::ZERO, fov_deg: 40.0 }
    }

    #[test]
    fn a_quarter_of_an_orbit_turns_the_eye_by_a_right_angle() {
        let camera = Camera::Orbit { start: view(2.0), period_s: 8.0 };
        let eye = camera.view_at(2.0).eye_m;
        assert!(eye.distance(DVec3::new(0.0, 2.0, 1.0)) < 1e-12, "{eye}"); // a few ulp of 2
    }

    #[test]
    fn a_path_passes_its_keyframes_and_repeats() {
        let keys = vec![(0.0, view(0.0)), (1.0, view(1.0)), (3.0, view(0.0))];
        let camera = Camera::Path { keys, repeat: true, even: false };
        assert_eq!(camera.view_at(1.0), view(1.0));
        assert_eq!(camera.view_at(4.0), view(1.0));
        assert_eq!(camera.view_at(2.0).eye_m.x, 0.5);
        let once = Camera::Path { keys: vec![(1.0, view(1.0)), (3.0, view(0.0))], repeat: false, even: false };
        assert_eq!(once.view_at(0.0), view(1.0));
        assert_eq!(once.view_at(9.0), view(0.0));
    }

    #[test]
    fn an_even_path_covers_equal_ways_in_equal_times() {
        let keys = vec![(0.0, view(0.0)), (4.0, view(1.0))];
        let at = |even| Camera::Path { keys: keys.clone(), repeat: false, even }.view_at(1.0).eye_m.x;
        assert_eq!((at(true), at(false)), (0.25, 0.15625)); // smoothstep of a quarter
    }

    #[test]
    fn a_path_is_as_long_as_its_last_keyframe_says() {
        let keys = vec![(1.0, view(0.0)), (4.0, view(1.0))];
        assert_eq!(Camera::Path { keys, repeat: true, even: true }.length_s(), Some(4.0));
        assert_eq!(Camera::Still(view(0.0)).length_s(), None);
    }
}
