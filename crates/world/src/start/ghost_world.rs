//! A world that runs elsewhere, shown by ghosts: objects whose steps are made there.
//!
//! In: a scene, the calls of a world of the same scene. Out: a [`World`] with the states that it has there, object by object. Never here: a
//! step, a connection.

use super::assemble;
use crate::calls::WorldCalls;
use crate::description::kinds::ExecutorKind;
use crate::error::WorldError;
use crate::reading::object::Object;
use crate::world::{Setting, World};
use crate::{Part, Scene};
use metachron_core::{AgentId, Body, Snapshot};
use metachron_runtime::{AgentState, Ghosts, SystemClock};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// A world of ghosts, and the states that it shows.
///
/// All that reads a [`World`] reads it: states, frames, statistics, pictures. It makes no step, time passes in it as it is shown, and what acts
/// on it has no effect; it has no checkpoints and no recordings. To act on its objects, call the world that they are in.
pub struct GhostWorld {
    world: World,
    ghosts: Ghosts,
    /// By their numbers; `None` of objects that are not shown.
    shown: Vec<Option<Arc<Snapshot>>>,
}

impl GhostWorld {
    /// The objects of `scene` as they begin.
    ///
    /// # Errors
    /// [`WorldError::Build`] and [`WorldError::Run`].
    pub fn of(scene: &Scene) -> Result<Self, WorldError> {
        let executor = ExecutorKind::Threads;
        let surroundings = assemble::surroundings(scene)?;
        let spawns = assemble::spawns(scene, &surroundings, executor, &mut |_| None)?;
        let clock = Arc::new(SystemClock::new());
        let ghosts = Ghosts::start(spawns, Arc::clone(&clock))?;
        let setting = Setting { surroundings, clock, log: Arc::default(), joined: Arc::default() };
        let world = World::of_run(scene, executor, Box::new(ghosts.clone()), setting);
        Ok(Self { world, ghosts, shown: vec![None; scene.agents.len()] })
    }

    /// The world that shows them.
    #[must_use]
    pub const fn world(&self) -> &World {
        &self.world
    }

    /// Shows what is newest in `calls`: states, objects that joined, objects that left. An object that joined as a model of somebody's own is
    /// not shown.
    ///
    /// # Errors
    /// The last object that cannot be shown, and why; all others are.
    pub fn follow(&mut self, calls: &dyn WorldCalls) -> Result<(), WorldError> {
        self.ghosts.set_time(calls.time());
        let there: BTreeMap<AgentId, Object> =
            calls.all_objects().into_iter().map(|object| (object.id(), object)).collect();
        for (agent, shown) in self.world.agents().iter().zip(&mut self.shown) {
            if !there.contains_key(&agent.id()) && agent.state() != AgentState::Gone {
                self.ghosts.leave(agent.id());
                *shown = None;
            }
        }
        let mut error = None;
        for (id, object) in there {
            if id.0 as usize >= self.shown.len() {
                error = self.join(id, object, calls).err().or(error);
            }
            // it may leave meanwhile
            let Ok(state) = calls.latest(object) else { continue };
            let shown = &mut self.shown[id.0 as usize];
            if shown.as_ref().is_some_and(|shown| Arc::ptr_eq(shown, &state)) {
                continue;
            }
            let agent = &self.world.agents()[id.0 as usize];
            if !is_of(&state.body, &agent.latest().body) {
                error =
                    Some(WorldError::Elsewhere(format!("the state of \"{}\" is that of another shape", agent.name())));
                continue;
            }
            self.ghosts.show(id, Arc::clone(&state));
            *shown = Some(state);
        }
        error.map_or(Ok(()), Err)
    }

    /// Takes an object up under its number, once: one that cannot be made is not shown.
    fn join(&mut self, id: AgentId, object: Object, calls: &dyn WorldCalls) -> Result<(), WorldError> {
        self.ghosts.reach(id);
        let made = self.make(object, calls);
        // also one that could not be made has its number
        self.ghosts.reach(AgentId(id.0 + 1));
        self.shown.resize(self.world.agents().len(), None);
        made
    }

    /// Makes an object under the next number; none of a model of somebody's own.
    fn make(&self, object: Object, calls: &dyn WorldCalls) -> Result<(), WorldError> {
        let part = match calls.part(object) {
            // it has left meanwhile
            Err(WorldError::Gone { .. }) => None,
            part => part?.filter(|part| !matches!(part, Part::Custom(_))),
        };
        let Some(part) = part else { return Ok(()) };
        let name = calls.name(object.into())?;
        // making it may panic: not all that came of it has been checked
        catch_unwind(AssertUnwindSafe(|| self.world.add(&*name, part).map(drop))).unwrap_or_else(|_| {
            Err(WorldError::Elsewhere(format!("\"{name}\" cannot be made: its values contradict each other")))
        })
    }
}

/// Whether a state may follow another one of the same object: a skin keeps its vertices, and one that has left may come back.
fn is_of(state: &Body, before: &Body) -> bool {
    match (state, before) {
        (Body::Soft(state), Body::Soft(before)) => state.positions.len() == before.positions.len(),
        (_, Body::Nothing) => true,
        _ => std::mem::discriminant(state) == std::mem::discriminant(before),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rigid;
    use metachron_core::SimSpan;
    use metachron_geometry::Solid;

    fn scene() -> Scene {
        let ball = Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.5]);
        Scene::builder().fixed("floor", Solid::Plane).add("ball", ball).build().unwrap()
    }

    #[test]
    fn a_ghost_world_shows_what_moves_joins_leaves_and_is_put_back() {
        let world = World::start(&scene(), ExecutorKind::Lockstep).unwrap();
        let mut ghosts = GhostWorld::of(&scene()).unwrap();
        let mut same = |world: &World| {
            ghosts.follow(world).unwrap();
            let shown = ghosts.world();
            assert_eq!((shown.time(), shown.hash()), (world.time(), world.hash()));
            let names = |world: &World| {
                let all = world.all_objects().map(|object| world.name(object).unwrap().to_owned());
                all.collect::<Vec<_>>()
            };
            assert_eq!(names(shown), names(world));
        };
        same(&world);
        world.advance(SimSpan::from_millis(200));
        same(&world);
        let mark = world.checkpoint().unwrap();
        let second = world.add("second", Rigid::ball(0.1).at([1.0, 0.0, 0.5])).unwrap();
        same(&world);
        world.remove(second).unwrap();
        world.remove(world.object("ball").unwrap()).unwrap();
        world.add("third", Rigid::ball(0.1).at([2.0, 0.0, 0.5])).unwrap();
        world.advance(SimSpan::from_millis(100));
        same(&world);
        world.restore(&mark).unwrap();
        same(&world);
        assert!(ghosts.world().checkpoint().is_err());
    }
}
