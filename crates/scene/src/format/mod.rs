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

pub use cells::{CellFile, PortalFile, SideKind};
pub use common::{CommonFile, HoldKind};
pub use contact::ContactFile;
pub use coupling::{CouplingFile, CouplingKind, CouplingLaw, FaultsFile, Spot};
pub use joint::{JointFile, JointKind, MimicFile, MotorFile};
pub use rigid::{Axis, PoseKeyFile, RigidFile, Shape, SolidShapeFile};
pub use scene::{
    CameraFile, CameraFiles, CameraKeyFile, ContactPath, ContactsFile, ProbeFile, SceneFile, SolvesFile, WorldFile,
};
pub use scenery::{GroupFile, MeshFile, MotionFile, TreeFile, TreeLod};
pub use sensor::{SensorFile, SensorFileKind};
pub use soft::{LawKind, RegionFile, RopeFile, SheetFile, SoftFile, SoftShapeKind, SolidFile};
pub use synthetic::SyntheticFile;
pub use tool::{KeyframeFile, ToolFile};
pub use tube::{End, PressureFile, TubeFile};
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
