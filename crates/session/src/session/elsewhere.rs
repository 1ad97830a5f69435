//! A session of a world that runs elsewhere: it shows that world, and what users do acts there.
//!
//! In: a scene, the calls of a world of it. Out: a session whose agents are ghosts, with its own frames and budget. Never here: a connection.

use super::super::assemble::Governors;
use super::super::elsewhere::Elsewhere;
use super::super::error::SessionError;
use super::Session;
use metachron_core::{AgentId, SimTime};
use metachron_runtime::TimelineCommand;
use metachron_world::{Scene, WorldCalls, WorldError};
use std::sync::Arc;
use std::time::Duration;

impl Session {
    /// Shows a world that runs elsewhere, of the same `scene`. No step is made here: levels are chosen and frames are drawn within the budget of
    /// this session, and springs, pressures and the flow of time act there. It has no checkpoints and no recordings.
    ///
    /// # Errors
    /// [`SessionError::World`].
    pub fn open_elsewhere(scene: Scene, calls: Arc<dyn WorldCalls>) -> Result<Self, SessionError> {
        let elsewhere = Elsewhere::new(&scene, calls)?;
        let governors = Governors::of(&scene);
        let mut session = Self::open_as(scene, governors, |_, _| Ok(elsewhere.shown().clone()))?;
        session.elsewhere = Some(elsewhere);
        Ok(session)
    }

    /// Whether its world runs elsewhere.
    #[must_use]
    pub const fn is_elsewhere(&self) -> bool {
        self.elsewhere.is_some()
    }

    /// Why a world elsewhere does not answer now.
    #[must_use]
    pub fn unanswered(&self) -> Option<WorldError> {
        self.elsewhere.as_ref()?.calls.answers().err()
    }

    /// Why a world elsewhere was not shown whole, or did not take what was done to it; said once.
    pub fn take_error_elsewhere(&mut self) -> Option<WorldError> {
        self.elsewhere.as_mut()?.error.take()
    }

    /// Warnings about all that is shown of a world elsewhere: a link that anybody may listen to, objects that cannot be shown.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        self.elsewhere.as_ref().map_or(&[], |elsewhere| &elsewhere.notes)
    }

    /// Adds a note on a world elsewhere, for its window and its report.
    pub fn note(&mut self, text: String) {
        self.elsewhere.iter_mut().for_each(|elsewhere| elsewhere.note(text.clone()));
    }

    /// Keeps the newest error of a world elsewhere as a note; why a run that is to last for `patience` cannot come to its end: the host does not
    /// answer, or time has stood for so long.
    pub(in super::super) fn cut_off(&mut self, patience: Duration) -> Option<SessionError> {
        if let Some(error) = self.take_error_elsewhere() {
            self.note(error.to_string());
        }
        if let Some(silent) = self.unanswered() {
            return Some(silent.into());
        }
        // time that passes in this process stands for as long as its steps last
        let elsewhere = self.elsewhere.as_ref().filter(|elsewhere| elsewhere.calls.link().is_some())?;
        let stood = elsewhere.stood();
        let (at_s, stood_s) = (self.sim_now().as_secs_f64(), stood.as_secs_f64());
        (stood > patience).then_some(SessionError::Stands { at_s, stood_s })
    }

    /// Simulated seconds that have passed in this session, of a world elsewhere since it began.
    #[must_use]
    pub fn played_s(&self) -> f64 {
        let first = self.elsewhere.as_ref().map_or(SimTime::ZERO, |elsewhere| elsewhere.first);
        self.sim_now().since(first).as_secs_f64()
    }

    /// Whether simulated time passes.
    #[must_use]
    pub fn passes(&self) -> bool {
        match &self.elsewhere {
            Some(elsewhere) => elsewhere.passes(),
            None => self.world.timeline().runs_at(self.now()),
        }
    }

    /// The name of the host that steps an object, where several step its world.
    #[must_use]
    pub fn host_of(&self, id: AgentId) -> Option<&str> {
        let calls = &self.elsewhere.as_ref()?.calls;
        calls.host_of(calls.object_of(id).ok()?)
    }

    /// Changes the flow of time: pause, run, speed, single step.
    pub fn drive(&mut self, drive: TimelineCommand) {
        match &mut self.elsewhere {
            Some(elsewhere) => elsewhere.drive(drive),
            None => self.world.drive(drive),
        }
    }

    /// The world that commands act on.
    pub(super) fn acted_on(&self) -> &dyn WorldCalls {
        match &self.elsewhere {
            Some(elsewhere) => &*elsewhere.calls,
            None => &self.world,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_contact::AnchorSpring;
    use metachron_core::{Anchor, SimSpan};
    use metachron_render::{Size, States, Style};
    use metachron_world::kinds::ExecutorKind;
    use metachron_world::{Rigid, World};

    #[test]
    fn a_session_of_a_world_elsewhere_draws_its_states_and_acts_there() {
        let ball = Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.5]);
        let scene = Scene { states: States::Latest, ..Scene::builder().add("ball", ball).build().unwrap() };
        let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
        let mut session = Session::open_elsewhere(scene, Arc::new(world.clone())).unwrap();
        let (camera, size) = (session.scene_camera(), Size { width: 64, height: 64 });
        let draw = |session: &mut Session| {
            let picture = session.compose(&camera, size, Style::default(), None);
            picture.instances.iter().map(|one| picture.origin.z + f64::from(one.position[2])).collect::<Vec<_>>()
        };
        assert!((draw(&mut session)[0] - 0.5).abs() < 1e-6);
        let (target, target_velocity) = (glam::DVec3::new(1.0, 0.0, 0.5), glam::DVec3::ZERO);
        let pull = AnchorSpring {
            by: None,
            anchor: Anchor::Local(glam::DVec3::ZERO),
            target,
            target_velocity,
            stiffness_n_m: 20.0,
            damping_n_s_m: 1.0,
        };
        session.hand(AgentId(0), Some(pull)).unwrap();
        world.advance(SimSpan::from_millis(100));
        let place = world.latest(world.object("ball").unwrap()).unwrap().body.probe(0.0).unwrap().0;
        assert!(place.x > 0.1 && place.z < 0.47, "it is pulled, and falls: {place}");
        let shown_m = draw(&mut session)[0];
        assert!((shown_m - place.z).abs() < 1e-6, "{shown_m} m of {place}");
        assert_eq!((session.sim_now(), session.picture_time()), (world.time(), world.time()));
        session.drive(TimelineCommand::Speed(0.5));
        assert_eq!(world.timeline().speed(), 0.5);
        let second = world.add("second", Rigid::ball(0.05).at([0.2, 0.0, 0.5])).unwrap();
        assert_eq!(draw(&mut session).len(), 2);
        world.remove(second).unwrap();
        world.stop();
        assert!(session.take_error_elsewhere().is_none());
        assert!(matches!(session.hand(AgentId(0), None), Err(WorldError::Stopped)));
    }
}
