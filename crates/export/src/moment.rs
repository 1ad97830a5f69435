//! A world at one moment, as files hold it.
//!
//! In: a world. Out: the newest state and the surface of each of its objects, contacts, joints, events. Never here: files.

use super::surface::{LocalMesh, Surface};
use metachron_core::{AgentId, Body, ContactPartner, ContactState, SimTime, Snapshot};
use metachron_geometry::ShapeKind;
use metachron_runtime::AgentState;
use metachron_world::{Event, EventFilter, Events, ListedJoint, SensorKind, Touched, World};
use std::collections::BTreeMap;
use std::sync::Arc;

/// All objects of a world at one moment.
#[derive(Debug, Clone)]
pub struct Moment {
    /// The world's time.
    pub time: SimTime,
    /// Its objects that are not gone, by rising numbers.
    pub objects: Vec<ObjectMoment>,
    /// Their contacts.
    pub contacts: Vec<ContactMoment>,
    /// Its hinges and slides whose bodies are there, in the order of the scene.
    pub joints: Vec<JointMoment>,
    /// All that happened since the moment before.
    pub events: Vec<Event>,
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

/// A contact at a moment.
#[derive(Debug, Clone)]
pub struct ContactMoment {
    /// The number of the object on which its force acts.
    pub object: AgentId,
    /// The names of that object and of the object or static solid that it touches.
    pub names: [Arc<str>; 2],
    /// Its state.
    pub state: ContactState,
}

/// A hinge or a slide at a moment.
#[derive(Debug, Clone)]
pub struct JointMoment {
    /// Its name; its number in the scene where it has none.
    pub name: Arc<str>,
    /// How far its second body has moved from the first, rad or m.
    pub position: f64,
    /// How fast, rad/s or m/s.
    pub velocity: f64,
    /// Of its motor and stops, N·m or N.
    pub effort: f64,
}

/// Takes moments of a world; parts that do not change are made once.
#[derive(Debug)]
pub struct Moments {
    world: World,
    events: Events,
    rigid: BTreeMap<AgentId, LocalMesh>,
    names: BTreeMap<AgentId, Arc<str>>,
}

impl Moments {
    /// Of this world; events are heard from now on.
    #[must_use]
    pub fn of(world: &World) -> Self {
        let events = world.events(EventFilter::all());
        Self { world: world.clone(), events, rigid: BTreeMap::new(), names: BTreeMap::new() }
    }

    /// The world as it is now.
    pub fn take(&mut self) -> Moment {
        let time = self.world.time();
        let objects = self.objects();
        let contacts =
            objects.iter().flat_map(|object| object.state.contacts.iter().map(|state| self.contact(object, state)));
        let (contacts, joints) =
            (contacts.collect(), self.world.joints().filter_map(|joint| self.joint(&joint)).collect());
        let events = self.events.drain().collect();
        Moment { time, objects, contacts, joints, events }
    }

    fn contact(&self, object: &ObjectMoment, state: &ContactState) -> ContactMoment {
        let other = match state.with {
            ContactPartner::Static(number) => Some(Touched::Fixed(number)),
            ContactPartner::Agent(id) => self.world.object_of(id).ok().map(Touched::Object),
        };
        let other = other.and_then(|other| self.world.name(other).ok()).unwrap_or_default();
        ContactMoment { object: object.id, names: [object.name.clone(), other.into()], state: *state }
    }

    /// `None` of a joint without a coordinate, or of one whose body was removed.
    fn joint(&self, listed: &ListedJoint<'_>) -> Option<JointMoment> {
        let state = self.world.joint_state(listed.at).ok()?;
        let number = listed.at.number();
        let effort = self.world.read(&SensorKind::JointEffort(number)).ok()?.values[0];
        let name = listed.name.map_or_else(|| number.to_string().into(), Arc::from);
        Some(JointMoment { name, position: state.position, velocity: state.velocity, effort })
    }

    fn objects(&mut self) -> Vec<ObjectMoment> {
        let world = self.world.clone();
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
        objects.collect()
    }
}
