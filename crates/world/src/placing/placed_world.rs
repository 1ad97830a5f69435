//! A world whose objects are placed on several hosts, called as one.
//!
//! In: the scene, a world of it on each host. Out: the calls of a world ([`WorldCalls`]); objects go from host to host before they meet. A window
//! of time passes on all hosts at once, each object inside a box that meets no box of another host's: then no turn sees a difference, and
//! states are those of one process, to the bit. Where an object leaves its box, or a host falls silent, all hosts go back to states that were
//! kept, and do again what was done since (Jef85). Never here: a connection, a turn.

use super::divided::DividedCalls;
use super::flow::Flow;
use super::kept::patient;
use super::windows::{Act, HostRecord, Placing, PlacingSeen};
use crate::calls::{EventReader, WorldCalls};
use crate::description::couplings::CouplingKind;
use crate::error::WorldError;
use crate::history::checkpoint::{Checkpoint, CheckpointError, SceneMark};
use crate::reading::events::{Event, EventFilter};
use crate::reading::object::{Object, Touched, WorldTag};
use crate::{Part, Scene};
use metachron_core::{AgentId, Body, HASH_START, SimSpan, SimTime, Snapshot};
use metachron_runtime::{Command, TimelineCommand};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A host, and the world of the scene that it steps a part of.
#[derive(Clone)]
pub struct PlacedHost {
    /// Its name.
    pub name: String,
    /// Its world, in lockstep.
    pub world: Arc<dyn WorldCalls>,
}

/// The load of a host.
#[derive(Debug, Clone, PartialEq)]
pub struct HostLoad {
    /// Its name.
    pub name: String,
    /// Why it steps nothing any more; `None` of one that does.
    pub lost: Option<String>,
    /// How many objects it steps.
    pub objects: usize,
    /// CPU time of its steps so far.
    pub cpu: Duration,
    /// The time of the newest window beside its steps: the link there and back.
    pub waited: Duration,
    /// Objects that came to it from other hosts.
    pub moved: u64,
    /// Of these those whose host was lost.
    pub reborn: u64,
}

/// A world whose objects are stepped by several hosts.
pub struct PlacedWorld {
    pub(super) hosts: Vec<PlacedHost>,
    tag: WorldTag,
    scene: SceneMark,
    /// Objects that one host steps, however far apart they are.
    pub(super) ties: Vec<[AgentId; 2]>,
    /// The wanted rates of the objects of the scene.
    pub(super) rates_hz: Vec<f64>,
    placing: Mutex<Placing>,
    seen: Mutex<Arc<PlacingSeen>>,
    pub(super) flow: Mutex<Flow>,
}

impl std::fmt::Debug for PlacedHost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PlacedHost").field("name", &self.name).finish_non_exhaustive()
    }
}

impl PlacedHost {
    /// Its world, as one that it steps a part of.
    pub(super) fn divided(&self) -> Result<&dyn DividedCalls, WorldError> {
        let reason = || format!("the world on host \"{}\" takes no part in one on several", self.name);
        self.world.divided().ok_or_else(|| WorldError::Undivided { reason: reason() })
    }
}

impl std::fmt::Debug for PlacedWorld {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PlacedWorld").field("hosts", &self.hosts).finish_non_exhaustive()
    }
}

impl PlacedWorld {
    /// Places the objects of `scene` on hosts, whose worlds are of that scene and in the same state, in lockstep: those that name a host on that one
    /// ([`Self::pin`]).
    ///
    /// # Errors
    /// [`WorldError::Undivided`] without hosts, for an object that names another host, and for a world of another scene or in another state;
    /// [`WorldError::Silent`] for one that is silent for 5 s; the other errors of its calls.
    pub fn start(scene: &Scene, hosts: Vec<PlacedHost>) -> Result<Self, WorldError> {
        let undivided = |reason: String| WorldError::Undivided { reason };
        let first = hosts.first().ok_or_else(|| undivided("there is no host".to_owned()))?;
        let (mark, time, hash) = (scene.mark(), first.world.time(), patient(|| first.world.hash())?);
        for PlacedHost { name, world } in &hosts {
            if world.scene().hash != mark.hash || world.time() != time || patient(|| world.hash())? != hash {
                return Err(undivided(format!(
                    "the world on host \"{name}\" is of another scene, or in another state"
                )));
            }
        }
        let couplings = scene.couplings.iter().filter(|coupling| coupling.kind != CouplingKind::Contact);
        let of_joints = scene.joints.iter().flat_map(|joint| {
            let followed = joint.mimic.and_then(|mimic| scene.joints.get(mimic.joint as usize)).map(|joint| joint.a);
            [joint.b, followed].into_iter().flatten().map(|other| [joint.a, other])
        });
        let ties = couplings.map(|coupling| [coupling.a, coupling.b]).chain(of_joints).collect();
        let rates_hz: Vec<f64> = scene.agents.iter().map(|member| member.pace.rate_hz).collect();
        let placing = Placing::of(&hosts, time, &rates_hz)?;
        let (tag, seen, flow) = (WorldTag::new(), Mutex::new(Arc::new(placing.seen.clone())), Mutex::default());
        let placed = Self { hosts, tag, scene: mark, ties, rates_hz, placing: Mutex::new(placing), seen, flow };
        for (member, host) in scene.agents.iter().filter_map(|member| Some((member, member.host.as_ref()?))) {
            placed.pin(tag.object(member.id), host)?;
        }
        patient(|| placed.begin(&mut placed.placing()))?;
        Ok(placed)
    }

    /// Lets others see how far time has come, and who steps what.
    pub(super) fn show(&self, seen: &PlacingSeen) {
        *self.seen.lock().unwrap_or_else(PoisonError::into_inner) = Arc::new(seen.clone());
    }

    fn seen(&self) -> Arc<PlacingSeen> {
        Arc::clone(&self.seen.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn placing(&self) -> MutexGuard<'_, Placing> {
        self.placing.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The load of each host.
    #[must_use]
    pub fn loads(&self) -> Vec<HostLoad> {
        let placing = self.seen();
        let load = |(number, host): (usize, &PlacedHost)| {
            let objects = placing.owners.values().filter(|owner| owner.host == number).count();
            let HostRecord { cpu, waited, moved, reborn } = placing.records[number];
            HostLoad {
                name: host.name.clone(),
                lost: placing.lost[number].clone(),
                objects,
                cpu,
                waited,
                moved,
                reborn,
            }
        };
        self.hosts.iter().enumerate().map(load).collect()
    }

    /// Lets the host of this name step an object, and all that is with it, for as long as the host lives, whatever its load. Of two in one group the
    /// pin of the one of the lower number holds.
    ///
    /// # Errors
    /// [`WorldError::Undivided`] where there is no such host, [`WorldError::Foreign`].
    pub fn pin(&self, object: Object, host: &str) -> Result<(), WorldError> {
        let names = || self.hosts.iter().map(|host| &*host.name).collect::<Vec<_>>().join(", ");
        let number = self.hosts.iter().position(|known| known.name == host);
        let (id, name) = (self.id(object)?, self.name(object.into())?);
        let reason = || format!("there is no host \"{host}\" for \"{name}\"; there are {}", names());
        let number = number.ok_or_else(|| WorldError::Undivided { reason: reason() })?;
        self.placing().pins.insert(id, number);
        Ok(())
    }

    /// How often an object has left its box, so that time went back to the states that were kept.
    #[must_use]
    pub fn escapes(&self) -> u64 {
        self.seen().escapes
    }

    /// A host that answers.
    fn any(&self) -> Result<&dyn WorldCalls, WorldError> {
        let first = self.seen().living().first().copied();
        first.map(|host| &*self.hosts[host].world).ok_or_else(|| self.silent())
    }

    /// The error of a world none of whose hosts answers.
    pub(super) fn silent(&self) -> WorldError {
        self.hosts.iter().find_map(|host| host.world.answers().err()).unwrap_or(WorldError::Stopped)
    }

    /// The world that steps an object, and the object there.
    fn owner(&self, object: Object) -> Result<OwnedObject<'_>, WorldError> {
        if !object.is_of(self.tag) {
            return Err(WorldError::Foreign);
        }
        let host = self.seen().owners.get(&object.id()).map(|owner| owner.host);
        let world = match host {
            Some(host) => &*self.hosts[host].world,
            // it has left: its name is known everywhere
            None => self.any()?,
        };
        Ok(OwnedObject { world, object: world.object_of(object.id())? })
    }

    fn id(&self, object: Object) -> Result<AgentId, WorldError> {
        self.owner(object).map(|owned| owned.object.id())
    }
}

/// An object, as the world that steps it names it.
struct OwnedObject<'a> {
    world: &'a dyn WorldCalls,
    object: Object,
}

/// Events of all hosts' worlds.
struct PlacedEvents {
    tag: WorldTag,
    readers: Vec<Box<dyn EventReader>>,
}

impl EventReader for PlacedEvents {
    fn take(&mut self) -> Vec<Event> {
        let tag = self.tag;
        let mut events: Vec<_> =
            self.readers.iter_mut().flat_map(|reader| reader.take()).map(|event| event.of(tag)).collect();
        events.sort_by_key(|event| event.at);
        events
    }

    fn lost(&self) -> u64 {
        self.readers.iter().map(|reader| reader.lost()).sum()
    }
}

impl WorldCalls for PlacedWorld {
    fn scene(&self) -> SceneMark {
        self.scene.clone()
    }

    fn all_objects(&self) -> Vec<Object> {
        self.seen().owners.keys().map(|id| self.tag.object(*id)).collect()
    }

    fn object(&self, name: &str) -> Result<Object, WorldError> {
        let id = self.any()?.object(name)?.id();
        if self.seen().owners.contains_key(&id) {
            return Ok(self.tag.object(id));
        }
        Err(WorldError::Gone { name: name.to_owned() })
    }

    fn object_of(&self, id: AgentId) -> Result<Object, WorldError> {
        Ok(self.tag.object(self.any()?.object_of(id)?.id()))
    }

    fn name(&self, of: Touched) -> Result<Arc<str>, WorldError> {
        match of {
            Touched::Object(object) => {
                let OwnedObject { world, object } = self.owner(object)?;
                world.name(object.into())
            }
            Touched::Fixed(_) => self.any()?.name(of),
        }
    }

    fn latest(&self, object: Object) -> Result<Arc<Snapshot>, WorldError> {
        let OwnedObject { world, object } = self.owner(object)?;
        world.latest(object)
    }

    fn part(&self, object: Object) -> Result<Option<Part>, WorldError> {
        let OwnedObject { world, object } = self.owner(object)?;
        world.part(object)
    }

    fn time(&self) -> SimTime {
        self.seen().time
    }

    fn hash(&self) -> Result<u64, WorldError> {
        self.all_objects().into_iter().try_fold(HASH_START, |hash, object| Ok(self.latest(object)?.fold_hash(hash)))
    }

    fn drive(&self, drive: TimelineCommand) -> Result<(), WorldError> {
        self.change_flow(drive)
    }

    fn advance(&self, span: SimSpan) -> Result<(), WorldError> {
        self.pass(&mut self.placing(), span)
    }

    fn command(&self, object: Object, command: Command) -> Result<(), WorldError> {
        let act = Act::Command(self.id(object)?, Box::new(command));
        self.act(&mut self.placing(), act)
    }

    fn set_state(&self, object: Object, state: &Body) -> Result<(), WorldError> {
        let act = Act::SetState(self.id(object)?, Box::new(state.clone()));
        self.act(&mut self.placing(), act)
    }

    fn add(&self, name: &str, part: Part) -> Result<Object, WorldError> {
        Ok(self.tag.object(self.join(&mut self.placing(), name, &part)?))
    }

    fn remove(&self, object: Object) -> Result<(), WorldError> {
        let act = Act::Remove(self.id(object)?);
        self.act(&mut self.placing(), act)
    }

    fn checkpoint(&self) -> Result<Checkpoint, CheckpointError> {
        self.gather(&mut self.placing())
    }

    fn restore(&self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.put_all_back(&mut self.placing(), checkpoint)
    }

    fn answers(&self) -> Result<(), WorldError> {
        self.any()?;
        self.flows()
    }

    fn host_of(&self, object: Object) -> Option<&str> {
        let seen = self.seen();
        let owner = seen.owners.get(&object.id()).filter(|_| object.is_of(self.tag))?;
        Some(&self.hosts[owner.host].name)
    }

    fn listen(&self, filter: EventFilter) -> Box<dyn EventReader> {
        let readers = self.hosts.iter().map(|host| host.world.listen(filter)).collect();
        Box::new(PlacedEvents { tag: self.tag, readers })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::kinds::ExecutorKind;
    use crate::{Pace, Rigid, Tube, World};
    use glam::DVec3;
    use metachron_core::Anchor;
    use metachron_geometry::Solid;

    /// Balls that roll through each other's ways on a floor, and two tubes of which one is hit.
    fn scene() -> Scene {
        let mut scene = Scene::builder().fixed("floor", Solid::Plane);
        for number in 0..12_u32 {
            let (along, side) = (f64::from(number % 4), f64::from(number / 4));
            let ball = Rigid::ball(0.05).mass_kg(0.2).at([along, 0.6 * side, 0.06 + 0.1 * side]);
            let towards = if number % 2 == 0 { 1.5 } else { -1.0 };
            scene = scene.add(format!("ball {number}"), ball.velocity_m_s([towards, 0.1 * side, 0.0]));
        }
        for number in 0..2_u32 {
            let y = -1.0 - f64::from(number);
            let tube = Tube::along(&[[-0.2, y, 0.3], [0.2, y, 0.3]]).radius_m(0.01).segments(4).clamp([true, false]);
            scene = scene.add(format!("tube {number}"), tube);
        }
        scene.build().unwrap()
    }

    fn world(scene: &Scene) -> World {
        let world = World::start(scene, ExecutorKind::Lockstep).unwrap();
        world.set_pace(Pace::Free).unwrap();
        world
    }

    struct Placed {
        worlds: Vec<World>,
        placed: PlacedWorld,
    }

    fn placed(scene: &Scene, hosts: usize) -> Placed {
        let worlds: Vec<_> = (0..hosts).map(|_| world(scene)).collect();
        let host = |(number, world): (usize, &World)| PlacedHost {
            name: format!("host{number}"),
            world: Arc::new(world.clone()),
        };
        let placed = PlacedWorld::start(scene, worlds.iter().enumerate().map(host).collect()).unwrap();
        Placed { worlds, placed }
    }

    /// Boxes and balls of three rates that fall on each other, part and roll apart.
    fn crowd() -> Scene {
        let mut seed = 12_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / f64::from(1_u32 << 31)
        };
        let mut scene = Scene::builder().fixed("floor", Solid::Plane);
        for number in 0..40_u32 {
            let place = [2.0 * random(), 2.0 * random(), 0.1 + 1.5 * random()];
            let body = if number % 2 == 0 { Rigid::ball(0.06) } else { Rigid::cuboid([0.05, 0.04, 0.06]) };
            let velocity = [3.0 * random() - 1.5, 3.0 * random() - 1.5, 0.0];
            let body = body.rate_hz([60.0, 120.0, 240.0][number as usize % 3]);
            scene = scene.add(format!("body {number}"), body.mass_kg(0.1 + random()).at(place).velocity_m_s(velocity));
        }
        scene.build().unwrap()
    }

    #[test]
    fn a_crowd_that_meets_and_parts_has_the_bits_of_one_process() {
        let scene = crowd();
        let all = [2, 3].map(|hosts| placed(&scene, hosts));
        let whole = world(&scene);
        for quarter in 0..12 {
            whole.advance(QUARTER);
            for Placed { placed, .. } in &all {
                placed.advance(QUARTER).unwrap();
                assert_eq!(placed.hash().unwrap(), whole.hash(), "quarter {quarter}: {:?}", placed.loads());
            }
        }
    }

    const QUARTER: SimSpan = SimSpan::from_millis(250);

    #[test]
    fn states_on_one_two_and_four_hosts_are_those_of_one_process() {
        let whole = world(&scene());
        let all: Vec<_> = [1, 2, 4].map(|hosts| placed(&scene(), hosts)).into();
        for quarter in 0..12 {
            whole.advance(QUARTER);
            for Placed { placed, worlds } in &all {
                placed.advance(QUARTER).unwrap();
                let hosts = worlds.len();
                assert_eq!(
                    placed.hash().unwrap(),
                    whole.hash(),
                    "{hosts} hosts, quarter {quarter}: {:?}",
                    placed.loads()
                );
            }
        }
        for Placed { placed, worlds } in all.iter().skip(1) {
            assert!(placed.loads().iter().all(|load| load.objects > 0), "{:?}", placed.loads());
            let moved: u64 = placed.loads().iter().map(|load| load.moved).sum();
            assert!(moved > worlds.len() as u64, "{:?}", placed.loads());
        }
    }

    #[test]
    fn a_pinned_object_is_stepped_by_its_host_and_what_it_meets_too() {
        let mut scene = scene();
        scene
            .agents
            .iter_mut()
            .filter(|agent| agent.name == "ball 5")
            .for_each(|ball| ball.host = Some("host2".into()));
        let (whole, Placed { worlds, placed }) = (world(&scene), placed(&scene, 3));
        let ball = placed.object("ball 5").unwrap();
        let other = placed.pin(ball, "host9").unwrap_err().to_string();
        assert!(other.contains("no host \"host9\" for \"ball 5\"; there are host0, host1, host2"), "{other}");
        for quarter in 0..6 {
            whole.advance(QUARTER);
            placed.advance(QUARTER).unwrap();
            assert_eq!(placed.hash().unwrap(), whole.hash(), "quarter {quarter}");
            assert_eq!(placed.host_of(ball) == Some("host2"), quarter < 4, "quarter {quarter}");
            if quarter == 3 {
                drop(worlds[2].stop());
            }
        }
    }

    #[test]
    fn a_host_that_falls_silent_changes_no_bit() {
        let (whole, Placed { worlds, placed }) = (world(&scene()), placed(&scene(), 3));
        for quarter in 0..8 {
            whole.advance(QUARTER);
            if let 2 | 5 = quarter {
                drop(worlds[quarter % 3].stop());
            }
            placed.advance(QUARTER).unwrap();
            assert_eq!(placed.hash().unwrap(), whole.hash(), "quarter {quarter}: {:?}", placed.loads());
        }
        assert!(placed.loads().iter().any(|load| load.reborn > 0));
        assert_eq!(placed.loads().iter().filter(|load| load.lost.is_none()).count(), 2);
        worlds.iter().for_each(|world| drop(world.stop()));
        assert!(placed.advance(QUARTER).is_err());
    }

    #[test]
    fn commands_and_objects_that_join_and_leave_act_as_in_one_process() {
        let (whole, Placed { placed, .. }) = (world(&scene()), placed(&scene(), 2));
        let calls: [&dyn WorldCalls; 2] = [&whole, &placed];
        let same = |what: &str| assert_eq!(placed.hash().unwrap(), whole.hash(), "{what}");
        let hit = Command::impulse(Anchor::Local(DVec3::ZERO), DVec3::new(0.0, 8.0, 2.0));
        let pass = |calls: [&dyn WorldCalls; 2]| calls.map(|world| world.advance(QUARTER).unwrap());
        let act = |act: &dyn Fn(&dyn WorldCalls)| calls.into_iter().for_each(act);
        pass(calls);
        act(&|world| world.command(world.object("ball 3").unwrap(), hit).unwrap());
        pass(calls);
        same("an impulse that throws a ball out of its box");
        // each time with twice the room, also for what passes again before it
        assert!((1..=5).contains(&placed.escapes()), "{}", placed.escapes());
        act(&|world| _ = world.add("late", Rigid::ball(0.08).mass_kg(1.0).at([0.1, 0.1, 0.5]).into()).unwrap());
        pass(calls);
        same("a ball that joins");
        let marks = calls.map(|world| world.checkpoint().unwrap());
        act(&|world| world.remove(world.object("ball 0").unwrap()).unwrap());
        pass(calls);
        same("a ball that leaves");
        calls.into_iter().zip(&marks).for_each(|(world, mark)| world.restore(mark).unwrap());
        same("a checkpoint");
        pass(calls);
        same("the time after it");
        whole.restore(&marks[1]).unwrap();
        pass([&whole, &whole]);
        assert_eq!(
            whole.time(),
            SimTime::from_nanos(4 * 250_000_000 + 250_000_000),
            "a placed world's checkpoint is a world's"
        );
    }
}
