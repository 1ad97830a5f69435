//! Names of objects in a running world.

use metachron_core::AgentId;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// An object of a world: only that world takes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Object {
    world: WorldTag,
    id: AgentId,
}

/// The tag by which one world of a process, wherever it runs, differs from all others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct WorldTag(u32);

impl Default for WorldTag {
    fn default() -> Self {
        Self::new()
    }
}

impl WorldTag {
    /// One that no world has had.
    #[must_use]
    pub fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        Self(NEXT.fetch_add(1, Relaxed))
    }

    /// The object of this number in the world of the tag.
    #[must_use]
    pub const fn object(self, id: AgentId) -> Object {
        Object { world: self, id }
    }
}

impl Object {
    /// The number of its agent: its place in the scene.
    #[must_use]
    pub const fn id(self) -> AgentId {
        self.id
    }

    /// Whether the world of this tag named it.
    #[must_use]
    pub fn is_of(self, world: WorldTag) -> bool {
        self.world == world
    }
}

/// The other side of a contact, or a thing that a query finds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Touched {
    /// Another object.
    Object(Object),
    /// A static solid, by its place among the scene's.
    Fixed(u32),
}

impl From<Object> for Touched {
    fn from(object: Object) -> Self {
        Self::Object(object)
    }
}
