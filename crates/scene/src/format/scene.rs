//! The tables of a scene other than its objects.

use super::{CellFile, CouplingFile, FaultsFile, GroupFile, JointFile, Point, PortalFile, SensorFile};
use metachron_world::kinds::{EnvironmentKind, ExecutorKind, PriorityKind, StatesKind};
use metachron_world::{Machine, Target};
use schemars::JsonSchema;
use serde::de::IgnoredAny;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// A scene file without its `[[object]]` tables, which are read one by one according to their models.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Version of this format: 1.
    #[schemars(extend("const" = 1))]
    pub format: i64,
    /// One line that describes the scene.
    pub description: Option<String>,
    /// How agents are run. Default `auto`: `threads` for a few, `pool` for many.
    /// `lockstep` runs them on one thread in virtual time, with declared costs.
    #[serde(default)]
    pub executor: ExecutorKind,
    /// How the operating system schedules the threads of agents. Default `normal`.
    #[serde(default)]
    pub priority: PriorityKind,
    /// How long the turn of an object may last before the object counts as stalled, seconds on the clock of the wall. Default 0.25.
    /// Ten of its steps are always allowed, and a cluster's turn as many times as long as it has members, 25 at most; a checkpoint waits for a stalled turn as long.
    pub stall_s: Option<f64>,
    /// Time at which states are drawn. Default `interpolate`.
    #[serde(default)]
    pub states: StatesKind,
    /// Surroundings of the objects.
    #[serde(default)]
    pub world: WorldFile,
    /// The target frame rate and how it is held.
    #[serde(default)]
    pub target: Target,
    /// The camera, or several as `[[camera]]`; at most 100. Default: far enough away to see the whole scene.
    #[serde(default)]
    pub camera: CameraFiles,
    /// The declared machine: costs that lockstep charges instead of measuring them.
    #[serde(default)]
    pub machine: Machine,
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
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WorldFile {
    /// Gravity, m/s², up to 1e4. Default `[0, 0, -9.81]`.
    pub gravity_m_s2: Option<Point>,
    /// The light of the scene in pictures, and its background. Default `room`.
    pub environment: EnvironmentKind,
    /// Whether moving objects collide with each other. Default true; with false only pairs that a `[[coupling]]` names do.
    pub contacts: Option<ContactsFile>,
    /// How deep objects that lie on each other rest, metres: the softness of contacts follows from it. Default 2e-5; smaller
    /// for bodies below a centimetre, at some more factors a step. Bodies too light to be pressed so deep lie less
    /// deep.
    pub contact_depth_m: Option<f64>,
    /// How far the solves of contacts go. Default `exact`; at the free pace they are so in any case.
    pub contact: SolvesFile,
    /// How many steps a solve makes in any case where it goes by `budget` and has not come to its end before. Default 5, after which an
    /// answer is safe; with more contacts are less deep while bodies land, and turns may take longer than there is time.
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
    /// Vertical angle of view, degrees. Default 40.
    pub fov_deg: Option<f64>,
    /// Seconds per turn about `look_at_m`, 0.1 … 1e5 in magnitude; negative turns clockwise seen from above.
    pub period_s: Option<f64>,
    /// A path: 2 … 10000 keyframes.
    #[schemars(length(min = 2, max = 10_000))]
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
    /// Seconds from the start; later than the keyframe before.
    pub at_s: f64,
    /// Position of the eye, metres.
    pub eye_m: Point,
    /// Point that it looks at, metres.
    pub look_at_m: Point,
    /// Vertical angle of view, degrees. Default: the camera's `fov_deg`.
    pub fov_deg: Option<f64>,
}

/// `[[probe]]`: a material point whose position and velocity are reported.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeFile {
    /// Name of the object.
    pub object: String,
    /// Point of a tube by arc length along the rest shape: its start at 0, its end at 1. Default 1.
    /// A rigid object reports its centre of mass, a tool its tip.
    pub at: Option<f64>,
    /// Milliseconds between samples: the report then has `samples` as well. Default: only the last state.
    pub every_ms: Option<f64>,
}
