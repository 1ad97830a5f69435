//! How a world is served, and the files of its scene that callers may read.
//!
//! In: a name, an endpoint, the text of a scene. Out: the same, for [`crate::serve`]. Never here: files on a disk, the meaning of a text.

use metachron_world::SceneText;
use std::collections::BTreeMap;

/// A scene as a viewer elsewhere needs it to draw a world: its text, and the files that it names.
#[derive(Debug, Clone, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub struct SceneFiles {
    /// The text, without the folder that it was in.
    pub scene: SceneText,
    /// The bytes of the files beside it, by their names in the text. With the text less than [`crate::MESSAGE_MAX`].
    pub files: BTreeMap<String, Vec<u8>>,
}

/// How a world is served.
#[derive(Debug, Clone)]
pub struct Serving {
    pub(crate) name: String,
    pub(crate) endpoint: String,
    pub(crate) scene: Option<SceneFiles>,
}

impl Serving {
    /// Under `name`, 1 to 64 of a to z, A to Z, 0 to 9, _ and -, at `endpoint`, such as `tcp/127.0.0.1:7447`.
    #[must_use]
    pub fn new(name: impl Into<String>, endpoint: impl Into<String>) -> Self {
        Self { name: name.into(), endpoint: endpoint.into(), scene: None }
    }

    /// With its scene, for callers that draw it. The path of a folder stays here.
    #[must_use]
    pub fn scene(mut self, scene: SceneFiles) -> Self {
        self.scene = Some(SceneFiles { scene: SceneText { folder: None, ..scene.scene }, ..scene });
        self
    }
}
