//! The scene file as it is written: serde types, one per table, whose doc comments are the descriptions of the JSON Schema.
//!
//! In: TOML values. Out: the same values, typed; keys that do not exist are refused.
//! Never here: defaults that depend on other keys, and rules between keys (see `build`).

mod cells;
mod common;
mod contact;
mod coupling;
mod joint;
pub mod ranges;
mod rigid;
mod scene;
mod scenery;
mod sensor;
mod soft;
mod synthetic;
mod tool;
mod tube;
mod value;

pub use cells::{CELL, CellFile, PortalFile, SideKind};
pub use common::{COMMON, COMMON_KEYS, CommonFile, HoldKind};
pub use contact::{CONTACT, ContactFile};
pub use coupling::{COUPLING, CouplingFile, CouplingKind, CouplingLaw, FAULTS, FaultsFile, Spot};
pub use joint::{JOINT, JointFile, JointKind, MOTOR, MotorFile};
pub use rigid::{Axis, PartFile, PoseKeyFile, RIGID, RigidFile, Shape, TIMES};
pub use scene::{
    CAMERA, COST, CameraFile, CameraFiles, CameraKeyFile, ContactPath, ContactsFile, LOAD, LoadFile, MACHINE,
    MachineFile, ModelCostFile, PROBE, ProbeFile, SCENE, STEP_COST, SURROUNDINGS, SceneFile, ShadingCostFile,
    SolvesFile, TARGET, TargetFile, WorldFile,
};
pub use scenery::{GroupFile, MESH, MOTION, MeshFile, MotionFile, TREE, TreeFile, TreeLod};
pub use sensor::{SensorFile, SensorFileKind};
pub use soft::{
    LawKind, RegionFile, RopeEnd, RopeFile, SOFT, SheetFile, SheetSide, SoftShapeKind, SolidFile, SolidSide,
};
pub use synthetic::{SYNTHETIC, SyntheticFile};
pub use tool::{KEYFRAME, KeyframeFile, TOOL, ToolFile};
pub use tube::{ATTACH, AttachFile, End, PERISTALSIS, PeristalsisFile, PressureFile, TUBE, TubeFile};
pub use value::{OneOrEach, OneOrRange, Point};

/// The models an object can have, as scenes write them.
pub const MODELS: [&str; 9] = ["tube", "rigid", "sheet", "solid", "rope", "tool", "synthetic", "mesh", "tree"];

/// Old names of models, which still work, and the names that they have now.
pub const OLD_NAMES: [(&str, &str); 1] = [("instrument", "tool")];

/// The model that a scene names, by its present or its old name.
#[must_use]
pub fn model_named(name: &str) -> Option<&'static str> {
    let name = OLD_NAMES.iter().find(|(old, _)| *old == name).map_or(name, |(_, now)| now);
    MODELS.into_iter().find(|model| *model == name)
}
