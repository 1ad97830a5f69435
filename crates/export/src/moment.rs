//! A world at one moment, as files hold it.
//!
//! In: a world. Out: the newest state and the surface of each of its objects. Never here: files.

use super::surface::{LocalMesh, Surface};
use metachron_core::{AgentId, Body, SimTime, Snapshot};
use metachron_geometry::ShapeKind;
use metachron_runtime::AgentState;
use metachron_world::World;
use std::collections::BTreeMap;
use std::sync::Arc;

/// All objects of a world at one moment.
#[derive(Debug, Clone)]
pub struct Moment {
    /// The world's time.
    pub time: SimTime,
    /// Its objects that are not gone, by rising numbers.
    pub objects: Vec<ObjectMoment>,
}

/// An object at a moment.
#[derive(Debug, Clone)]
pub struct ObjectMoment {
    /// Its name.
    pub name: Arc<str>,
    /// The number of its agent.
    pub id: AgentId,
    /// Its newest state.
    pub state: Arc<Snapshot>,
    /// Its surface at that time; no triangles for an object without a shape.
    pub surface: Surface,
}

/// Takes moments of a world; parts that do not change are made once.
#[derive(Debug, Default)]
pub struct Moments {
    rigid: BTreeMap<AgentId, LocalMesh>,
    names: BTreeMap<AgentId, Arc<str>>,
}

impl Moments {
    /// The world as it is now.
    pub fn take(&mut self, world: &World) -> Moment {
        let time = world.time();
        let objects = world.agents().iter().filter(|agent| agent.state() != AgentState::Gone);
        let objects = objects.map(|agent| {
            let (id, state) = (agent.id(), agent.latest());
            let name = self.names.entry(id).or_insert_with(|| agent.name().into()).clone();
            let surface = match (agent.form().map(|shape| shape.kind.clone()), &state.body) {
                (Some(ShapeKind::Solid(solid)), Body::Rigid(body)) => {
                    let local = self.rigid.entry(id).or_insert_with(|| LocalMesh::of(&solid.solid, solid.com_local));
                    Surface::moved(local, body)
                }
                (Some(shape), body) => Surface::of(&shape, body),
                (None, _) => Surface::default(),
            };
            ObjectMoment { name, id, state, surface }
        });
        Moment { time, objects: objects.collect() }
    }
}
