//! The objects of a scene while it is read: their entries, their names, and what each of them denotes.
//!
//! In: tables of the file. Out: the same as types that readers of models share. Never here: the keys of a model.

use super::grid::{Copies, Repeats};
use crate::check::{Checker, Place};
use crate::diagnostic::Problem;
use crate::format::{
    CommonFile, FaultsFile, MeshFile, RigidFile, RopeFile, SheetFile, SoftFile, SolidFile, SolidShapeFile,
    SyntheticFile, ToolFile, TreeFile, TubeFile,
};
use crate::source::Source;
use glam::DVec3;
use metachron_core::AgentId;
use metachron_drawable::geodesic_edges;
use metachron_geometry::{ContactTraits, Obstacle};
use metachron_models::synthetic::SyntheticSpec;
use metachron_world::{Appearance, Member, Scenery};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Most agents of a scene: each agent that can be touched stores something for every other one.
pub(crate) const AGENTS_MAX: usize = 10_000;
/// Most fixed objects of a scene.
pub(super) const OBSTACLES_MAX: usize = 10_000;

/// All objects of a scene.
#[derive(Debug, Default)]
pub(crate) struct Objects {
    pub(crate) agents: Vec<Member>,
    pub(crate) obstacles: Arc<[Obstacle]>,
    pub(crate) obstacle_appearances: Vec<Appearance>,
    pub(crate) scenery: Vec<Scenery>,
    /// Names of fixed objects and of agents.
    pub(crate) names: Names,
}

/// The context of the reader of a model, beside the model's own table.
pub(super) struct ModelContext<'a> {
    pub(super) place: &'a Place,
    pub(super) source: &'a Source,
    pub(super) gravity: DVec3,
    pub(super) levels: (u8, u8),
    pub(super) sleep: bool,
    pub(super) traits: ContactTraits,
}

/// Names, and the object that each denotes.
#[derive(Debug, Default)]
pub(crate) struct Names(pub(super) BTreeMap<String, NamedObject>);

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum NamedObject {
    /// A fixed object.
    Fixed,
    /// A mesh or tree, which is only drawn.
    Scenery,
    /// A rigid object that moves.
    Rigid(AgentId),
    /// A driven tool.
    Tool(AgentId),
    /// An agent without matter.
    Synthetic(AgentId),
    /// A tube.
    Tube(AgentId),
    /// A sheet, solid or rope.
    Soft(AgentId),
}

impl NamedObject {
    /// The id of an object that jaws can grasp if a scene allows it: one that has matter and moves freely.
    pub(super) const fn graspable(self) -> Option<AgentId> {
        match self {
            Self::Rigid(id) | Self::Tube(id) | Self::Soft(id) => Some(id),
            Self::Fixed | Self::Scenery | Self::Tool(_) | Self::Synthetic(_) => None,
        }
    }

    /// The id of an object that is an agent.
    pub(crate) const fn agent(self) -> Option<AgentId> {
        match self {
            Self::Fixed | Self::Scenery => None,
            Self::Rigid(id) | Self::Tool(id) | Self::Synthetic(id) | Self::Tube(id) | Self::Soft(id) => Some(id),
        }
    }
}

impl Names {
    pub(crate) fn get(&self, name: &str) -> Option<NamedObject> {
        self.0.get(name).copied()
    }

    pub(crate) fn agents(&self) -> impl Iterator<Item = &str> + Clone {
        self.0.iter().filter(|(_, n)| n.agent().is_some()).map(|(name, _)| name.as_str())
    }

    /// The names of the objects that `wanted` accepts.
    pub(super) fn only(&self, wanted: impl Fn(NamedObject) -> bool + Clone) -> impl Iterator<Item = &str> + Clone {
        self.0.iter().filter(move |(_, n)| wanted(**n)).map(|(name, _)| name.as_str())
    }

    pub(super) fn tubes(&self) -> impl Iterator<Item = (&str, AgentId)> + Clone {
        self.0
            .iter()
            .filter_map(|(name, n)| if let NamedObject::Tube(id) = n { Some((name.as_str(), *id)) } else { None })
    }

    pub(super) fn is_known(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }
}

/// An object as the file has it.
pub(crate) struct Entry {
    pub(super) place: Place,
    pub(super) common: CommonFile,
    pub(super) model: ModelFile,
    pub(super) fixed: bool,
    pub(super) copies: Copies,
}

/// A rigid object as a file has it: its solid, and the rest.
pub(super) struct RigidFiles {
    pub(super) solid: SolidShapeFile,
    pub(super) body: RigidFile,
}

pub(super) enum ModelFile {
    Tube(TubeFile),
    Rigid(RigidFiles),
    Sheet(SoftFile, SheetFile),
    Solid(SoftFile, SolidFile),
    Rope(SoftFile, RopeFile),
    Tool(ToolFile),
    Synthetic(SyntheticSpec, SyntheticFile),
    Mesh(MeshFile),
    Tree(TreeFile),
}

impl ModelFile {
    /// Whether it is only drawn.
    pub(super) const fn is_scenery(&self) -> bool {
        matches!(self, Self::Mesh(_) | Self::Tree(_))
    }

    /// How many objects of the picture one of it is.
    pub(super) fn parts(&self) -> usize {
        match self {
            Self::Mesh(MeshFile { dome_m: Some(_), .. }) => geodesic_edges().len(),
            Self::Tree(_) => 2,
            _ => 1,
        }
    }

    /// The way in which a grid can repeat it.
    pub(super) const fn repeats(&self) -> Repeats {
        match self {
            Self::Tool(_) | Self::Synthetic(..) => Repeats::Nothing,
            Self::Rigid(_) => Repeats::MovedAndTurned,
            _ => Repeats::Moved,
        }
    }
}

/// Input that all objects of a scene share.
pub(crate) struct SceneContext<'a> {
    pub(crate) source: &'a Source,
    pub(crate) gravity: DVec3,
    pub(crate) faults: Option<&'a FaultsFile>,
}

/// Reports that the scene has `found` up to the table at `path`, which is more than `most`.
pub(super) fn too_many(c: &mut Checker<'_, '_>, path: &str, found: &str, most: usize) {
    let span = c.document().locate(path);
    c.push(Problem::new(span, format!("the scene has {found}")).expecting(format!("expected at most {most}")));
}
