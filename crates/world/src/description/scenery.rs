//! What of a scene is only drawn: meshes, trees, and groups that may be drawn as one mesh.
//!
//! In: what a scene file says. Out: the same as plain data. Never here: what physics meets.

use super::appearance::Appearance;
use metachron_core::AgentId;
use metachron_drawable::{Model, Motion, Placement, Texture};
use std::ops::Range;
use std::sync::Arc;

/// An object that is only drawn: nothing collides with it, and it moves as is declared, if at all.
#[derive(Debug, Clone)]
pub struct Scenery {
    /// Its name, unique in the scene.
    pub name: String,
    /// Its mesh or foliage.
    pub model: Model,
    /// Its pose and scale.
    pub at: Placement,
    /// How it looks.
    pub appearance: Appearance,
    /// Its texture.
    pub texture: Option<Arc<Texture>>,
    /// How it moves; `None` where it never does.
    pub motion: Option<Motion>,
}

/// Most levels of a group.
pub const GROUP_LEVELS_MAX: usize = 8;

/// Objects that may be drawn as one mesh, which moves as they do.
#[derive(Debug, Clone)]
pub struct Group {
    /// The mesh that replaces all of it, with the group's name.
    pub proxy: Scenery,
    /// Triangles of its impostors: 1 … [`GROUP_LEVELS_MAX`] rising numbers, each a cut of the mesh.
    pub levels: Vec<u32>,
    /// All agents in it and in its groups.
    pub agents: Vec<AgentId>,
    /// All scenery in it and in its groups, a range of [`Scene::scenery`](super::scene::Scene::scenery).
    pub members: Range<usize>,
    /// All groups in it and in those, a range of [`Scene::groups`](super::scene::Scene::groups) that ends before it.
    pub groups: Range<usize>,
}
