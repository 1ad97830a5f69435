//! The tables of a scene other than its objects.

use super::{CellFile, CouplingFile, FaultsFile, GroupFile, JointFile, OneOrRange, Point, PortalFile, SensorFile};
use metachron_core::gains;
use metachron_world::kinds::{EnvironmentKind, ExecutorKind, LawKind, PolicyKind, PriorityKind, StatesKind, ValueKind};
use schemars::JsonSchema;
use serde::de::IgnoredAny;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;

/// A scene file without its `[[object]]` tables, which are read one by one according to their models.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Version of this format: 1.
    #[schemars(range(min = 1, max = 1))]
    pub format: i64,
    /// One line that describes the scene.
    pub description: Option<String>,
    /// How agents are run. Default `auto`: `threads` for a few, `pool` for many.
    /// `lockstep` runs them on one thread in virtual time, with declared costs.
    pub executor: Option<ExecutorKind>,
    /// How the operating system schedules the threads of agents. Default `normal`.
    pub priority: Option<PriorityKind>,
    /// How long the turn of an object may last before the object counts as stalled, seconds on the clock of the wall. Default 0.25.
    /// Ten of its steps are always allowed, and a cluster's turn as many times as long as it has members, 25 at most; a checkpoint waits for a stalled turn as long.
    #[schemars(range(min = 0.001, max = 3600.0))]
    pub stall_s: Option<f64>,
    /// Time at which states are drawn. Default `interpolate`.
    pub states: Option<StatesKind>,
    /// Surroundings of the objects.
    pub world: Option<WorldFile>,
    /// The target frame rate and how it is held.
    pub target: Option<TargetFile>,
    /// The camera, or several as `[[camera]]`; at most 100. Default: far enough away to see the whole scene.
    #[serde(default)]
    pub camera: CameraFiles,
    /// The declared machine: costs that lockstep charges instead of measuring them.
    pub machine: Option<MachineFile>,
    /// Material points whose position and velocity are reported; at most 1000.
    #[serde(default)]
    #[schemars(length(max = 1000))]
    pub probe: Vec<ProbeFile>,
    /// Joints between rigid objects; at most 10000. Objects connected by joints are of one cluster.
    #[serde(default)]
    #[schemars(length(max = 10_000))]
    pub joint: Vec<JointFile>,
    /// Sensors, which programs read by name, and which the report has at the end; at most 1000.
    #[serde(default)]
    #[schemars(length(max = 1000))]
    pub sensor: Vec<SensorFile>,
    /// Pairs of objects that interact otherwise than by the default contact; at most 10000.
    #[serde(default)]
    #[schemars(length(max = 10_000))]
    pub coupling: Vec<CouplingFile>,
    /// Meshes and trees that may be drawn as one mesh; at most 1000.
    #[serde(default)]
    #[schemars(length(max = 1000))]
    pub group: Vec<GroupFile>,
    /// Rooms of a building; at most 1000. Objects in a cell are drawn only where they may be seen through portals.
    #[serde(default)]
    #[schemars(length(max = 1000))]
    pub cell: Vec<CellFile>,
    /// Openings between cells; at most 1000.
    #[serde(default)]
    #[schemars(length(max = 1000))]
    pub portal: Vec<PortalFile>,
    /// Accepted here as a key only: each object is read by its model.
    #[serde(default)]
    #[schemars(skip)]
    pub object: IgnoredAny,
}

/// `[world]`: the surroundings of the objects.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WorldFile {
    /// Gravity, m/s², up to 1e4. Default `[0, 0, -9.81]`.
    pub gravity_m_s2: Option<Point>,
    /// The light of the scene in pictures, and its background. Default `room`.
    pub environment: Option<EnvironmentKind>,
    /// Whether moving objects collide with each other. Default true; with false only pairs that a `[[coupling]]` names do.
    pub contacts: Option<ContactsFile>,
    /// How deep objects that lie on each other rest, metres, 1e-6 … 1e-3: the softness of contacts follows from it. Default 2e-5; smaller
    /// for bodies below a centimetre, at some more factors a step. Bodies too light to be pressed so deep lie less
    /// deep.
    #[schemars(range(min = 1e-6, max = 1e-3))]
    pub contact_depth_m: Option<f64>,
    /// How far the solves of contacts go. Default `exact`; at the free pace they are so in any case.
    pub contact: Option<SolvesFile>,
    /// How many steps a solve makes in any case where it goes by `budget` and has not come to its end before, 1 … 400. Default 5, after which an
    /// answer is safe; with more contacts are less deep while bodies land, and turns may take longer than there is time.
    #[schemars(range(min = 1, max = 400))]
    pub contact_least_steps: Option<u32>,
    /// Faults injected into the clock and messages of every object.
    pub faults: Option<FaultsFile>,
}

/// How far the solves of contacts go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SolvesFile {
    /// As far as there is time in a step of all that touch: then contacts are some hundredths of a millimetre deeper. Momentum is exact and no
    /// energy made at any number of steps.
    Budget,
    /// Until all laws of contact hold, whatever that takes.
    #[default]
    Exact,
}

/// Whether objects collide.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected true or false")]
pub enum ContactsFile {
    /// Whether moving objects collide with each other.
    Whether(bool),
    /// Refused: contacts are solved in one way.
    #[schemars(skip)]
    By(ContactPath),
}

/// Former ways to solve contacts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ContactPath {
    /// Each pair by one of its two sides.
    Pairs,
    /// All that touch as one problem.
    Clusters,
}

/// `[target]`: the target frame rate and how it is held.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TargetFile {
    /// Target frames per second, 1 … 1000. Default 60.
    #[schemars(range(min = 1.0, max = 1000.0))]
    pub frame_hz: Option<f64>,
    /// Policy that chooses the level of every visible object. Default `adaptive`.
    pub policy: Option<PolicyKind>,
    /// How `robin-hood` values an object. Default `plain`.
    pub value: Option<ValueKind>,
    /// Feedback law. Default `corrected`.
    pub law: Option<LawKind>,
    /// Gain α of the printed law, 1e-9 … 1. Default 1e-4.
    #[schemars(range(min = gains::ALPHA.0, max = gains::ALPHA.1))]
    pub alpha: Option<f64>,
    /// Gain β of the printed law, 1e-6 … 1e3. Default 5.
    #[schemars(range(min = gains::BETA.0, max = gains::BETA.1))]
    pub beta: Option<f64>,
    /// Gain κ of the corrected law, 0.001 … 1.99; below 1 it is stable for every scene. Default: the law's own.
    #[schemars(range(min = gains::KAPPA.0, max = gains::KAPPA.1))]
    pub kappa: Option<f64>,
    /// Gain λ of the corrected law on the error's change, 0 … 1.99. Default: the law's own.
    #[schemars(range(min = gains::LEAD.0, max = gains::LEAD.1))]
    pub lead: Option<f64>,
    /// Share of the frame time that is left free, 0 … 0.9. Default: for feedback its law's own, for policies that predict 0.02.
    #[schemars(range(min = gains::MARGIN.0, max = gains::MARGIN.1))]
    pub margin: Option<f64>,
    /// Gain of the agents' own loops: share of the way to a finer level that one demand goes, 0.02 … 1. Default 0.5.
    #[schemars(range(min = gains::REFINE.0, max = gains::REFINE.1))]
    pub agent_refine: Option<f64>,
    /// Gain of the agents' own loops: share of a delay by others that one demand removes, 0.02 … 1.99. Default 0.5.
    #[schemars(range(min = gains::YIELD.0, max = gains::YIELD.1))]
    pub agent_yield: Option<f64>,
    /// Greatest lag from reading the camera to the finished picture, milliseconds, 1 … 1000: levels are chosen so that it is kept, and the
    /// camera is drawn at its predicted pose for that time. Default: no bound, and the camera is drawn where it was read.
    pub lag_ms: Option<f64>,
    /// Share reserved for choosing levels, of the part that culling leaves of `lag_ms`, 0.001 … 0.5. Default 0.05.
    pub optimiser_share: Option<f64>,
    /// Whether `adaptive` and `robin-hood` spend time left over when everything is at its finest on still smoother shapes and softer
    /// shadows. Default false.
    pub raise: Option<bool>,
    /// Whether policies that choose by cost may leave objects out of the picture where not even the coarsest of everything fits: for objects without a `may_vanish` of their own. Default false.
    pub may_vanish: Option<bool>,
    /// How much a level's benefit falls with the distance from the middle of the picture, 0 … 1. Default 0. This and the next two are for
    /// policies that choose by cost.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub focus: Option<f64>,
    /// How much it falls with speed across the picture, 0 … 1. Default 0 for `greedy`, `greedy-incremental` and `greedy-repaired`, 0.5 for
    /// the others.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub motion: Option<f64>,
    /// How much it falls with the distance from the level of the frame before, 0 … 1: for `greedy`, `greedy-incremental`,
    /// `greedy-repaired`, and in addition to its own for `adaptive`. Default 0.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub hysteresis: Option<f64>,
    /// Fraction of its width and height that the picture is drawn with, `[least, most]` or one number for both, 0.35 … 1 in steps of 0.05; then it is
    /// enlarged.
    /// Fewer pixels are drawn where all else is at its coarsest and frames are late still. Default `[0.35, 1.0]`.
    pub render_scale: Option<OneOrRange<f64>>,
}

/// One camera as a table, or several as a list of tables.
#[derive(Debug, Clone, JsonSchema)]
#[serde(untagged)]
pub enum CameraFiles {
    /// `[camera]`.
    One(Box<CameraFile>),
    /// `[[camera]]`; at most 100.
    Several(#[schemars(length(max = 100))] Vec<CameraFile>),
}

impl Default for CameraFiles {
    fn default() -> Self {
        Self::Several(Vec::new())
    }
}

/// Read by hand: of an untagged enum an error says neither the key nor its place.
impl<'de> Deserialize<'de> for CameraFiles {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OneOrSeveral;
        impl<'de> Visitor<'de> for OneOrSeveral {
            type Value = CameraFiles;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a table `[camera]`, or tables `[[camera]]`")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<CameraFiles, A::Error> {
                Deserialize::deserialize(MapAccessDeserializer::new(map)).map(CameraFiles::One)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<CameraFiles, A::Error> {
                Deserialize::deserialize(SeqAccessDeserializer::new(seq)).map(CameraFiles::Several)
            }
        }
        deserializer.deserialize_any(OneOrSeveral)
    }
}

/// `[camera]`, or one of `[[camera]]`: a still view; with `period_s` an orbit about `look_at_m`; with `keyframe` a path.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// Its name, by which it is chosen; each camera has another. Default: `camera`, and of several `camera 1` and so on.
    pub name: Option<String>,
    /// Position of the eye, metres. Not with `keyframe`.
    pub eye_m: Option<Point>,
    /// Point that it looks at, metres. Default: the origin.
    pub look_at_m: Option<Point>,
    /// Vertical angle of view, degrees, 1 … 150. Default 40.
    pub fov_deg: Option<f64>,
    /// Seconds per turn about `look_at_m`, 0.1 … 1e5 in magnitude; negative turns clockwise seen from above.
    pub period_s: Option<f64>,
    /// A path: 2 … 10000 keyframes.
    pub keyframe: Option<Vec<CameraKeyFile>>,
    /// Whether the path repeats. Default false.
    pub repeat: Option<bool>,
    /// Whether it moves linearly from keyframe to keyframe, instead of starting and stopping softly at each. Default false.
    pub even: Option<bool>,
}

/// View of the camera at one time.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraKeyFile {
    /// Seconds from the start, 0 … 1e6, later than the keyframe before.
    pub at_s: f64,
    /// Position of the eye, metres.
    pub eye_m: Point,
    /// Point that it looks at, metres.
    pub look_at_m: Point,
    /// Vertical angle of view, degrees, 1 … 150. Default: the camera's `fov_deg`.
    pub fov_deg: Option<f64>,
}

/// `[machine]`: a preset, and the values that differ from it.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MachineFile {
    /// The preset to start from: `two-cores-software` (default) or `workstation`.
    pub preset: Option<String>,
    /// Cores that agents and frames share, 1 … 4096.
    #[schemars(range(min = 1, max = 4096))]
    pub cores: Option<u32>,
    /// Costs of a step of each model, by the model's name, and of a factor of contacts that are solved as one problem, by `factor`.
    #[serde(default)]
    pub step: BTreeMap<String, ModelCostFile>,
    /// Milliseconds per frame before anything is drawn, 0 … 1e4.
    pub draw_setup_ms: Option<f64>,
    /// Microseconds per drawn object, 0 … 1e6.
    pub draw_object_us: Option<f64>,
    /// Microseconds per triangle, 0 … 1e4.
    pub draw_triangle_us: Option<f64>,
    /// Nanoseconds per pixel of the picture as drawn, 0 … 1e6.
    pub draw_pixel_ns: Option<f64>,
    /// Nanoseconds per pixel that a picture of fewer pixels is enlarged to, 0 … 1e6.
    pub draw_enlarge_ns: Option<f64>,
    /// Whether a graphics card draws, and not the cores that agents step on. Default: as the preset has it, a card in `workstation`.
    pub graphics_card: Option<bool>,
    /// Nanoseconds per object for culling, 0 … 1e6. Default 0.
    pub cull_object_ns: Option<f64>,
    /// Nanoseconds per object in view for choosing its level, 0 … 1e6. Default 0.
    pub choose_object_ns: Option<f64>,
    /// Costs of objects by their shading, where they differ from `draw_object_us`, `draw_triangle_us` and the preset.
    pub shading: Option<ShadingCostsFile>,
    /// Relative standard deviation of every cost, 0 … 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub noise: Option<f64>,
    /// Relative standard deviation of a slowly varying factor on the frame time, which keeps nine tenths of itself from frame to frame,
    /// 0 … 1. Default 0.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub wander: Option<f64>,
    /// Share of frames that take 1.5 times as long, 0 … 1. Default 0.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub spikes: Option<f64>,
    /// Additional load of the machine while frames are drawn, by rising time; at most 1000 entries.
    #[serde(default)]
    #[schemars(length(max = 1000))]
    pub load: Vec<LoadFile>,
    /// Additional load of the machine while agents step, by rising time; at most 1000 entries.
    #[serde(default)]
    #[schemars(length(max = 1000))]
    pub step_load: Vec<LoadFile>,
    /// Seed of the noise.
    pub seed: Option<u32>,
}

/// `[[machine.load]]` and `[[machine.step_load]]`: from a time on every frame, or every step, takes a factor times its declared time.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadFile {
    /// Wall-clock seconds after the start, 0 … 1e6; later than the entry before.
    pub at_s: f64,
    /// The factor from then on, 0.01 … 100: 2.5 is a machine 2.5 times as slow, 0.4 one 2.5 times as fast.
    pub factor: f64,
}

/// `[machine.shading]`: costs of objects by their shading.
#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct ShadingCostsFile {
    /// One colour per triangle.
    pub flat: Option<ShadingCostFile>,
    /// Colours at vertices, interpolated between them.
    pub gouraud: Option<ShadingCostFile>,
    /// Lighting at every pixel.
    pub per_pixel: Option<ShadingCostFile>,
    /// Lighting at every pixel of a textured surface.
    pub textured: Option<ShadingCostFile>,
    /// Leaves drawn as points instead of shaded triangles.
    pub points: Option<ShadingCostFile>,
    /// Boughs drawn as lines.
    pub lines: Option<ShadingCostFile>,
}

/// Cost of an object: object + max(triangle · triangles + vertex · vertices, pixel · pixels that it covers).
#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShadingCostFile {
    /// Microseconds per object, 0 … 1e6.
    pub object_us: Option<f64>,
    /// Microseconds per triangle, 0 … 1e4.
    pub triangle_us: Option<f64>,
    /// Microseconds per vertex, 0 … 1e4. Default 0.
    pub vertex_us: Option<f64>,
    /// Nanoseconds per pixel that the object covers, 0 … 1e6. Default 0.
    pub pixel_ns: Option<f64>,
}

/// Cost of a step of a model: base + unit · work.
#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelCostFile {
    /// Microseconds per step, 0 … 1e9.
    pub base_us: Option<f64>,
    /// Microseconds per unit of work (tube: one segment in one solved system, with one or more systems per substep; synthetic: a declared
    /// microsecond; factor: a contact; others: a step), 0 … 1e9.
    pub unit_us: Option<f64>,
}

/// `[[probe]]`: a material point whose position and velocity are reported.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeFile {
    /// Name of the object.
    pub object: String,
    /// Point of a tube: 0 start … 1 end, arc length along the rest shape. Default 1.
    /// A rigid object reports its centre of mass, a tool its tip.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub at: Option<f64>,
    /// Milliseconds between samples, 0.01 … 1e6: the report then has `samples` as well. Default: only the last state.
    pub every_ms: Option<f64>,
}
