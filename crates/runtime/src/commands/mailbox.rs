//! Commands to an agent: the newest of each kind, taken at its next turn.
//!
//! In: [`Command`]s from any thread. Out: the newest of each kind, once. Storage is bounded: one place per kind, which a newer command
//! overwrites. Never here: the execution of commands ([`crate::turn::agent_runner`] does).

use super::bounds::{self, OutOfBounds};
use glam::DVec3;
use metachron_contact::{AnchorForce, AnchorSpring, Carving, Input, Inputs, PoseGoal, SetMotion, SetMotor};
use metachron_core::{AgentId, Body, Resolution, SimSpan};
use std::borrow::Cow;
use std::sync::atomic::{
    AtomicBool,
    Ordering::{Acquire, Release},
};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// A command to an agent.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Command {
    /// Simulate at this resolution; clamped to the agent's range.
    Retune(Resolution),
    /// Step by this span; clamped to the agent's range.
    SetDt(SimSpan),
    /// A spring of the user pulls at the agent. A tool is led by the one of the lowest key.
    Spring(Keyed<AnchorSpring>),
    /// A force acts on the agent.
    Force(Keyed<AnchorForce>),
    /// An impulse, N·s and N·m·s: evenly over the agent's next step. Impulses at one point add up.
    Impulse(AnchorForce),
    /// A motor drives the joint whose number is the key, instead of the motor that the scene gives it; `None` is the scene's again.
    /// For the joint's first agent.
    Motor(Keyed<SetMotor>),
    /// A kinematic body is led to a pose; `None` lets it go its own way again.
    Pose(Keyed<PoseGoal>),
    /// Another place or velocity, before its next step.
    SetMotion(SetMotion),
    /// The pressure of the agent's filling, inside minus outside, Pa; an agent that refuses this pressure stays as it
    /// is.
    SetPressure(f64),
    /// Its cells in a region of space are removed before its next step; an agent that has none there, or no others, stays as it is.
    Carve(Carving),
    /// Wake up from rest.
    Wake,
}

/// Something that is done to an agent until it is taken back, or until its time is over.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Keyed<T> {
    /// Its name: the newest of a key takes the place of the older. Below [`KEYS`], but for motors.
    pub key: u32,
    /// The command; `None` takes the one of this key back.
    pub what: Option<T>,
    /// For how long it acts, in the agent's time, from when the agent takes it; `None` until it is taken back.
    pub lasts: Option<SimSpan>,
}

impl Command {
    /// The inputs that an agent must take to obey it.
    #[must_use]
    pub fn needs(&self) -> Inputs {
        let acts =
            |force: &AnchorForce| Inputs::of(&[Input::Force]).with(Input::Torque, force.torque_n_m != DVec3::ZERO);
        match self {
            Self::SetDt(_) | Self::Motor(_) | Self::Wake => Inputs::NONE,
            Self::Retune(_) => Inputs::of(&[Input::Resolution]),
            Self::Spring(_) => Inputs::of(&[Input::Spring]),
            Self::Force(Keyed { what, .. }) => what.as_ref().map_or(Inputs::of(&[Input::Force]), acts),
            Self::Impulse(impulse) => acts(impulse),
            Self::Pose(_) => Inputs::of(&[Input::Pose]),
            Self::SetMotion(SetMotion { position_m, rotation, velocity_m_s, spin_rad_s }) => Inputs::NONE
                .with(Input::Place, position_m.is_some() || rotation.is_some())
                .with(Input::Velocity, velocity_m_s.is_some() || spin_rad_s.is_some()),
            Self::SetPressure(_) => Inputs::of(&[Input::Pressure]),
            Self::Carve(_) => Inputs::of(&[Input::Carving]),
        }
    }
}

impl<T> Keyed<T> {
    /// Under key 0, until it is taken back.
    pub const fn first(what: Option<T>) -> Self {
        Self { key: 0, what, lasts: None }
    }
}

/// The most springs, the most forces, and the most points with impulses and regions carved in one step that an agent takes.
pub const KEYS: u32 = 8;

/// Reason why a command was not delivered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// There is no such agent.
    #[error("there is no agent {} in this run", .0.0)]
    NoAgent(AgentId),
    /// The command holds a number that is not finite or outside its range; the text says the range.
    #[error("{0}")]
    BadNumber(&'static str),
    /// The command, or the state, holds a number that is beyond the bound of its kind.
    #[error(transparent)]
    OutOfBounds(#[from] OutOfBounds),
    /// A key that is too large, or impulses at too many points or too many regions before the agent has taken a step.
    #[error(
        "an agent takes {KEYS} springs, {KEYS} forces, and impulses at {KEYS} points and {KEYS} carved regions a step; keys are 0 to 7"
    )]
    TooMany,
    /// The agent takes no such command ([`metachron_contact::Agent::inputs`]).
    #[error("\"{name}\" (model \"{model}\") takes no {}; it takes {takes}", lacks.name())]
    NotTaken {
        /// The agent's name.
        name: Arc<str>,
        /// Its model.
        model: Cow<'static, str>,
        /// The input that the command needs.
        lacks: Input,
        /// The inputs that the agent takes.
        takes: Inputs,
    },
    /// There is no joint of that number that can have a motor and whose first agent this is.
    #[error(
        "\"{name}\" drives no joint {joint}: a motor is of a hinge or a slide, and for the first of the two that it joins; the joints that it drives are {drives:?}"
    )]
    NoMotor {
        /// The agent's name.
        name: Arc<str>,
        /// The joint's number.
        joint: u32,
        /// The numbers of the joints that it drives.
        drives: Vec<u32>,
    },
    /// The run has ended, or ends.
    #[error("the run of \"{0}\" has ended: it takes no command any more")]
    Ended(Arc<str>),
}

/// The newest command of each kind, waiting for one agent.
#[derive(Debug, Default)]
pub(crate) struct Mailbox {
    /// Whether there is any command: an agent without commands reads only this.
    full: AtomicBool,
    /// Allocated by the first command: most agents never get one.
    pending: OnceLock<Box<Mutex<PendingCommands>>>,
}

/// The state, and then the place and motion, that an agent takes before its next step.
#[derive(Debug, Clone, Default)]
pub struct AwaitedMotion {
    /// Another whole state.
    pub state: Option<Body>,
    /// Another place or velocity; fields that it leaves open stay.
    pub motion: SetMotion,
}

/// Contents of a mailbox.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct PendingCommands {
    /// The newest requested resolution.
    pub set_resolution: Option<Resolution>,
    /// The newest requested step length.
    pub dt: Option<SimSpan>,
    /// The newest of each key.
    pub springs: Vec<Keyed<AnchorSpring>>,
    pub forces: Vec<Keyed<AnchorForce>>,
    pub motors: Vec<Keyed<SetMotor>>,
    pub poses: Vec<Keyed<PoseGoal>>,
    /// One for each point, N·s and N·m·s.
    pub impulses: Vec<AnchorForce>,
    /// The newest place and velocity.
    pub motion: Option<SetMotion>,
    /// The regions to be carved, in their order.
    pub carvings: Vec<Carving>,
    /// The newest whole state.
    pub state: Option<Box<Body>>,
    /// It is to leave the run.
    pub leaves: bool,
    /// The newest requested pressure, Pa.
    pub pressure_pa: Option<f64>,
}

impl Mailbox {
    /// Stores `command` in the place of its kind.
    ///
    /// # Errors
    /// [`SendError::BadNumber`], [`SendError::OutOfBounds`] and [`SendError::TooMany`]; nothing is delivered then.
    pub fn send(&self, command: Command) -> Result<(), SendError> {
        command.check()?;
        if key(&command).is_some_and(|key| key >= KEYS) {
            return Err(SendError::TooMany);
        }
        if command == Command::Wake {
            return Ok(());
        }
        self.put(|pending| pending.take(command))
    }

    /// The agent is to take this state before its next step.
    ///
    /// # Errors
    /// [`SendError::OutOfBounds`]; nothing is delivered then.
    pub fn set_state(&self, state: Body) -> Result<(), SendError> {
        bounds::check_state(&state)?;
        self.put(|pending| {
            pending.state = Some(Box::new(state));
            Ok(())
        })
    }

    /// The agent is to leave the run for good: nothing of it is left but its number.
    pub fn leave(&self) {
        let _ = self.put(|pending| {
            pending.leaves = true;
            Ok(())
        });
    }

    fn put(&self, what: impl FnOnce(&mut PendingCommands) -> Result<(), SendError>) -> Result<(), SendError> {
        let pending = self.pending.get_or_init(Box::default);
        let mut pending = pending.lock().unwrap_or_else(PoisonError::into_inner);
        what(&mut pending)?;
        self.full.store(true, Release);
        drop(pending);
        Ok(())
    }

    /// The waiting commands, if there are any.
    pub fn waiting(&self) -> Option<PendingCommands> {
        let pending = self.pending.get().filter(|_| self.has_pending())?;
        Some(pending.lock().unwrap_or_else(PoisonError::into_inner).clone())
    }

    /// The state, place and motion that wait.
    pub fn awaited_motion(&self) -> AwaitedMotion {
        let pending = self.waiting().unwrap_or_default();
        AwaitedMotion { state: pending.state.map(|state| *state), motion: pending.motion.unwrap_or_default() }
    }

    /// Lets `commands` wait in place of all that waits now.
    pub fn replace(&self, commands: Option<PendingCommands>) {
        let Some(commands) = commands else { return self.clear() };
        let _ = self.put(|pending| {
            *pending = commands;
            Ok(())
        });
    }

    /// Forgets waiting commands; called between turns.
    pub fn clear(&self) {
        self.full.store(false, Release);
        let waiting = self.pending.get().map(|pending| pending.lock().unwrap_or_else(PoisonError::into_inner));
        waiting.into_iter().for_each(|mut waiting| *waiting = PendingCommands::default());
    }

    /// Whether any command has arrived.
    pub fn has_pending(&self) -> bool {
        self.full.load(Acquire)
    }

    /// All commands since the last call. Never blocks: while another thread is writing it returns nothing yet.
    pub fn take(&self) -> PendingCommands {
        if !self.has_pending() {
            return PendingCommands::default();
        }
        let Some(Ok(mut pending)) = self.pending.get().map(|pending| pending.try_lock()) else {
            return PendingCommands::default();
        };
        self.full.store(false, Release);
        std::mem::take(&mut *pending)
    }
}

impl PendingCommands {
    /// Whether any of them is something that is done to the agent for a while.
    pub fn has_loads(&self) -> bool {
        let Self { springs, forces, motors, poses, impulses, .. } = self;
        let is_led = !poses.is_empty();
        is_led || !(springs.is_empty() && forces.is_empty() && motors.is_empty() && impulses.is_empty())
    }

    /// Stores a command in the place of its kind.
    fn take(&mut self, command: Command) -> Result<(), SendError> {
        match command {
            Command::Retune(resolution) => self.set_resolution = Some(resolution),
            Command::SetDt(dt) => self.dt = Some(dt),
            Command::Spring(spring) => renew(&mut self.springs, spring),
            Command::Force(force) => renew(&mut self.forces, force),
            Command::Motor(motor) => renew(&mut self.motors, motor),
            Command::Pose(pose) => renew(&mut self.poses, pose),
            Command::Impulse(impulse) => self.add(impulse).ok_or(SendError::TooMany)?,
            Command::SetMotion(motion) => self.move_by(motion),
            Command::SetPressure(pressure_pa) => self.pressure_pa = Some(pressure_pa),
            Command::Carve(carving) => self.carve(carving).ok_or(SendError::TooMany)?,
            Command::Wake => {}
        }
        Ok(())
    }

    /// Adds an impulse; `None` where there are too many points.
    fn add(&mut self, impulse: AnchorForce) -> Option<()> {
        match self.impulses.iter().position(|mine| mine.anchor == impulse.anchor) {
            Some(at) => {
                self.impulses[at].force_n += impulse.force_n;
                self.impulses[at].torque_n_m += impulse.torque_n_m;
            }
            None if self.impulses.len() < KEYS as usize => self.impulses.push(impulse),
            None => return None,
        }
        Some(())
    }

    /// Adds a region to be carved; `None` where there are too many.
    fn carve(&mut self, carving: Carving) -> Option<()> {
        (self.carvings.len() < KEYS as usize).then(|| self.carvings.push(carving))
    }

    /// Takes a place and a velocity: fields that the new one leaves open stay as the older one wants them.
    fn move_by(&mut self, new: SetMotion) {
        let old = self.motion.unwrap_or_default();
        self.motion = Some(SetMotion {
            position_m: new.position_m.or(old.position_m),
            rotation: new.rotation.or(old.rotation),
            velocity_m_s: new.velocity_m_s.or(old.velocity_m_s),
            spin_rad_s: new.spin_rad_s.or(old.spin_rad_s),
        });
    }
}

/// Puts `new` in the place of the entry with its key.
fn renew<T>(all: &mut Vec<Keyed<T>>, new: Keyed<T>) {
    match all.iter_mut().find(|old| old.key == new.key) {
        Some(old) => *old = new,
        None => all.push(new),
    }
}

/// The key of a spring or a force.
fn key(command: &Command) -> Option<u32> {
    match command {
        Command::Spring(spring) => Some(spring.key),
        Command::Force(force) => Some(force.key),
        _ => None,
    }
}

impl Command {
    /// Whether the numbers of a command are in their ranges.
    ///
    /// # Errors
    /// [`SendError::BadNumber`] and [`SendError::OutOfBounds`].
    pub fn check(&self) -> Result<(), SendError> {
        let wanted = |is_good: bool, wanted| if is_good { Ok(()) } else { Err(SendError::BadNumber(wanted)) };
        let moves = |motion: &SetMotion| {
            bounds::check_motion(motion)?;
            wanted(motion.is_sound(), "a rotation must be a quaternion that is finite and not zero")
        };
        match self {
            Command::Pose(Keyed { what, .. }) => what.as_ref().map_or(Ok(()), |goal| moves(&goal.motion())),
            Command::SetMotion(motion) => moves(motion),
            Command::SetDt(_) | Command::Wake => Ok(()),
            Command::Retune(resolution) => wanted(resolution.eps_m.is_finite(), "a resolution must be finite"),
            Command::SetPressure(pressure_pa) => Ok(bounds::check_pressure(*pressure_pa)?),
            Command::Spring(Keyed { what, .. }) => Ok(what.as_ref().map_or(Ok(()), bounds::check_spring)?),
            Command::Force(Keyed { what, .. }) => Ok(what.as_ref().map_or(Ok(()), bounds::check_force)?),
            Command::Impulse(impulse) => Ok(bounds::check_impulse(impulse)?),
            Command::Motor(Keyed { what, .. }) => {
                let motor = what.as_ref().and_then(|set| set.motor);
                let sound = "a motor's goal must be at most 1e9 in magnitude, its stiffness and damping not negative, its effort above zero";
                wanted(motor.is_none_or(|motor| motor.check().is_ok()), sound)
            }
            Command::Carve(carving) => {
                wanted(carving.radius_m > 0.0, "the radius of a carved region must be above zero")?;
                Ok(bounds::check_carving(carving)?)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;
    use metachron_core::{Anchor, RigidState};

    fn pull(target: DVec3) -> AnchorSpring {
        let anchor = Anchor::Local(DVec3::ZERO);
        AnchorSpring { by: None, anchor, target, target_velocity: DVec3::ZERO, stiffness_n_m: 1.0, damping_n_s_m: 0.0 }
    }

    #[test]
    fn the_newest_command_of_a_kind_takes_the_place_of_the_older() {
        let mail = Mailbox::default();
        for eps_m in [0.1, 0.2, 0.3] {
            mail.send(Command::Retune(Resolution { eps_m, n: 1 })).unwrap();
        }
        mail.send(Command::SetDt(SimSpan::from_nanos(5))).unwrap();
        let taken = mail.take();
        assert_eq!((taken.set_resolution.unwrap().eps_m, taken.dt), (0.3, Some(SimSpan::from_nanos(5))));
        let taken = mail.take();
        assert_eq!((taken.set_resolution, taken.dt), (None, None), "once");
    }

    #[test]
    fn a_release_is_a_command_too() {
        let mail = Mailbox::default();
        let spring = |key, what| Command::Spring(Keyed { key, what, lasts: None });
        mail.send(spring(0, Some(pull(DVec3::X)))).unwrap();
        mail.send(spring(3, Some(pull(DVec3::Y)))).unwrap();
        mail.send(spring(0, None)).unwrap();
        let springs = mail.take().springs;
        assert_eq!(springs.iter().map(|s| (s.key, s.what.is_some())).collect::<Vec<_>>(), [(0, false), (3, true)]);
        assert!(mail.take().springs.is_empty());
    }

    #[test]
    fn a_reader_that_meets_a_writer_reads_the_command_the_next_time() {
        let mail = Mailbox::default();
        mail.send(Command::SetDt(SimSpan::from_nanos(5))).unwrap();
        let writing = mail.pending.get().unwrap().lock().unwrap();
        assert_eq!(mail.take().dt, None);
        drop(writing);
        assert_eq!(mail.take().dt, Some(SimSpan::from_nanos(5)));
    }

    #[test]
    fn a_spring_that_is_not_finite_is_refused_when_sent() {
        let mail = Mailbox::default();
        let bad = Command::Spring(Keyed::first(Some(pull(DVec3::NAN))));
        assert!(matches!(mail.send(bad), Err(SendError::OutOfBounds(_))));
        let negative = AnchorSpring { stiffness_n_m: -1.0, ..pull(DVec3::X) };
        assert!(mail.send(Command::Spring(Keyed::first(Some(negative)))).is_err());
        assert!(mail.send(Command::Retune(Resolution { eps_m: f64::NAN, n: 0 })).is_err());
        assert!(mail.take().springs.is_empty());
    }

    #[test]
    fn a_number_beyond_its_bound_is_refused_with_the_bound() {
        let (mail, point, far) = (Mailbox::default(), Anchor::Local(DVec3::ZERO), DVec3::X * 1e154);
        let body = RigidState { position: far, rotation: DQuat::IDENTITY, velocity: DVec3::ZERO, spin: DVec3::ZERO };
        for (refused, said) in [
            (
                mail.send(Command::force(point, far)),
                "the force is 1e154 N; expected a finite number from -1e10 to 1e10 N",
            ),
            (mail.send(Command::torque(point, far)), "the torque is 1e154 N·m"),
            (
                mail.send(Command::impulse(point, far)),
                "the impulse is 1e154 N·s; expected a finite number from -1e10 to 1e10 N·s",
            ),
            (
                mail.send(Command::force(Anchor::Arc(1e7), DVec3::X)),
                "the position is 1e7 m; expected a finite number from -1e6 to 1e6 m",
            ),
            (mail.send(Command::spring(point, far, 1.0, 0.0)), "the position is 1e154 m"),
            (
                mail.send(Command::spring(point, DVec3::X, 2e12, 0.0)),
                "the stiffness is 2e12 N/m; expected a finite number from 0e0 to 1e12",
            ),
            (mail.send(Command::spring(point, DVec3::X, 1.0, 1e13)), "the damping is 1e13 N·s/m"),
            (mail.send(Command::carve(far, DVec3::X, 1.0)), "the position is 1e154 m"),
            (mail.send(Command::SetPressure(1e9)), "the pressure is 1e9 Pa"),
            (mail.set_state(Body::Rigid(body)), "the position is 1e154 m"),
        ] {
            let error = refused.unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
        assert!(!mail.has_pending());
        mail.send(Command::impulse(point, DVec3::X * 1e10)).unwrap();
    }

    #[test]
    fn impulses_at_a_point_add_up_and_no_more_points_are_taken_than_said() {
        let mail = Mailbox::default();
        let at =
            |x: f64| AnchorForce { anchor: Anchor::Local(DVec3::X * x), force_n: DVec3::Y, torque_n_m: DVec3::ZERO };
        for _ in 0..2 {
            (0..KEYS).for_each(|k| mail.send(Command::Impulse(at(f64::from(k)))).unwrap());
        }
        assert!(matches!(mail.send(Command::Impulse(at(-1.0))), Err(SendError::TooMany)));
        let taken = mail.take().impulses;
        assert_eq!(taken.len(), KEYS as usize);
        assert!(taken.iter().all(|impulse| impulse.force_n == DVec3::Y * 2.0));
        let ninth = Keyed { key: KEYS, what: Some(at(0.0)), lasts: None };
        assert!(matches!(mail.send(Command::Force(ninth)), Err(SendError::TooMany)));
    }
}
