//! How a world is served: where, to whom, and with which scene.
//!
//! In: a name, an endpoint, an identity, names of callers, the text of a scene. Out: the same, for [`crate::serve`]. Never here: a connection,
//! files on a disk, the meaning of a text.

use crate::identity::Identity;
use metachron_world::SceneText;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

/// A scene as a viewer elsewhere needs it to draw a world: its text, and the files that it names.
#[derive(Debug, Clone, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub struct SceneFiles {
    /// The text, without the folder that it was in.
    pub scene: SceneText,
    /// The bytes of the files beside it, by their names in the text. With the text less than [`crate::MESSAGE_MAX`].
    pub files: BTreeMap<String, Vec<u8>>,
}

/// The rights of a caller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// Read states, events, parts, the scene and the hash.
    Viewer,
    /// All that the world answers.
    Operator,
}

/// The name of all callers where none has a certificate.
pub(crate) const ANYONE: &str = "anyone";

/// Takes a scene that a host is to step a part of, or says why it does not.
pub(crate) type Begins = Arc<dyn Fn(SceneFiles) -> Result<(), String> + Send + Sync>;

/// How a world is served.
#[derive(Clone)]
pub struct Serving {
    pub(crate) name: String,
    pub(crate) endpoint: String,
    pub(crate) scene: Option<SceneFiles>,
    pub(crate) begins: Option<Begins>,
    pub(crate) identity: Option<Identity>,
    pub(crate) roles: BTreeMap<String, Role>,
    pub(crate) insecure_lan: bool,
}

impl fmt::Debug for Serving {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Serving").field("name", &self.name).field("endpoint", &self.endpoint).finish_non_exhaustive()
    }
}

impl Serving {
    /// Under `name`, 1 to 64 of a to z, A to Z, 0 to 9, _ and -, at `endpoint`: `tcp/127.0.0.1:7447`, which every process of this machine may call,
    /// or `tls/0.0.0.0:7447` with an identity.
    #[must_use]
    pub fn new(name: impl Into<String>, endpoint: impl Into<String>) -> Self {
        let (name, endpoint, roles) = (name.into(), endpoint.into(), BTreeMap::new());
        Self { name, endpoint, scene: None, begins: None, identity: None, roles, insecure_lan: false }
    }

    /// With its scene, for callers that draw it. The path of a folder stays here.
    #[must_use]
    pub fn scene(mut self, scene: SceneFiles) -> Self {
        self.scene = Some(SceneFiles { scene: SceneText { folder: None, ..scene.scene }, ..scene });
        self
    }

    /// Waits for work: operators give it scenes, of which `begin` makes a world, at time zero and in lockstep, to be served in the place of this
    /// one; its error is the caller's.
    #[must_use]
    pub fn begins(mut self, begin: impl Fn(SceneFiles) -> Result<(), String> + Send + Sync + 'static) -> Self {
        self.begins = Some(Arc::new(begin));
        self
    }

    /// At a `tls/` endpoint, to callers with certificates of the same authority that [`Serving::operators`] and [`Serving::viewers`] name.
    #[must_use]
    pub fn identity(mut self, identity: Identity) -> Self {
        self.identity = Some(identity);
        self
    }

    /// The holders of these certificates may read and command the world.
    #[must_use]
    pub fn operators<T: Into<String>>(mut self, names: impl IntoIterator<Item = T>) -> Self {
        self.roles.extend(names.into_iter().map(|name| (name.into(), Role::Operator)));
        self
    }

    /// The holders of these certificates may read the world, unless they are operators.
    #[must_use]
    pub fn viewers<T: Into<String>>(mut self, names: impl IntoIterator<Item = T>) -> Self {
        for name in names {
            self.roles.entry(name.into()).or_insert(Role::Viewer);
        }
        self
    }

    /// Lets a `tcp/` endpoint be beyond this machine: any process of the network may read and command the world then.
    #[must_use]
    pub const fn insecure_lan(mut self) -> Self {
        self.insecure_lan = true;
        self
    }
}
