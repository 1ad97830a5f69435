//! The loop between a device and a world: the phases of one tick.
//!
//! read     the handle's state; a failure is reported, and nothing is led
//! settle   the energy that it was given, from the tank
//! lead     the object to it
//! feel     the local model of the object's contacts, where the handle is
//! admit    as much of it as device and tank give
//!
//! In: ticks, from any thread. Out: a report. Never here: threads, waiting.

use super::contact_model::ContactModel;
use super::device::{Device, DeviceState};
use super::histogram::Histogram;
use super::report::DeviceReport;
use super::tank::{EnergyTank, Handle};
use glam::DVec3;
use metachron_contact::{AnchorSpring, Input};
use metachron_core::{Anchor, Body, SimSpan, SimTime, Wrench};
use metachron_runtime::Keyed;
use metachron_world::{Command, Object, StateLink, World, WorldCalls, WorldError};
use std::sync::Arc;
use std::time::Duration;

/// Up to an age of so many of its steps a state's force is whole: the next one was due by then.
const WHOLE_STEPS: f64 = 2.0;
/// An object whose device has gone is led for so long, of its own time; a hand whose world has gone feels the contacts fade in as long.
const LEADS: SimSpan = SimSpan::from_millis(100);

/// Settings of a loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopOptions {
    /// Ticks a second, 1 … 10 000. Beyond 4000 a thread that sleeps does not keep them.
    pub rate_hz: f64,
    /// Capacity of the energy tank, J, > 0: no more is given from any moment on than the hand puts in and this. Much below the energy that a
    /// contact stores, contacts push back less than they were pressed; far above it, contacts may hum.
    pub tank_j: f64,
}

impl Default for LoopOptions {
    /// 1 kHz; a tank with the work of 5 N over 4 cm.
    fn default() -> Self {
        Self { rate_hz: 1000.0, tank_j: 0.2 }
    }
}

/// A device that leads an object of a world.
pub struct DeviceLoop {
    world: World,
    object: Object,
    elsewhere: Option<Elsewhere>,
    device: Box<dyn Device>,
    is_tool: bool,
    period_s: f64,
    model: ContactModel,
    /// The scene's time when the newest state came.
    received_at: SimTime,
    tank: EnergyTank,
    before: Option<DeviceState>,
    report: DeviceReport,
    late_ms: Histogram,
    age_steps: Histogram,
    force_sum_n: f64,
}

/// The object where its steps are made.
struct Elsewhere {
    calls: Arc<dyn WorldCalls>,
    object: Object,
}

impl std::fmt::Debug for DeviceLoop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DeviceLoop").field("report", &self.report).finish_non_exhaustive()
    }
}

impl DeviceLoop {
    /// A loop that leads the object of this name.
    ///
    /// # Errors
    /// [`WorldError::NoObject`]; [`WorldError::Refused`] where the object is neither a kinematic body nor a tool, and for options outside their
    /// ranges.
    pub fn new(world: &World, name: &str, device: Box<dyn Device>, options: LoopOptions) -> Result<Self, WorldError> {
        let object = world.object(name)?;
        let refused = |reason: &str| WorldError::Refused { name: name.to_owned(), reason: reason.to_owned() };
        let is_tool = matches!(world.latest(object)?.body, Body::Tool(_));
        let is_kinematic = world.agents().of(object.id()).is_some_and(|agent| agent.inputs().has(Input::Pose));
        if !(is_tool || is_kinematic) {
            return Err(refused("a device leads kinematic bodies and tools"));
        }
        let LoopOptions { rate_hz, tank_j } = options;
        if !((1.0..=1e4).contains(&rate_hz) && tank_j > 0.0 && tank_j.is_finite()) {
            let reason = format!(
                "the rate is {rate_hz} Hz and the tank {tank_j} J; expected 1 to 10000 Hz, and a tank above 0 J"
            );
            return Err(refused(&reason));
        }
        let report = DeviceReport {
            device: device.name().to_owned(),
            object: name.to_owned(),
            tank_j,
            ..DeviceReport::default()
        };
        Ok(Self {
            world: world.clone(),
            object,
            elsewhere: None,
            device,
            is_tool,
            period_s: rate_hz.recip(),
            model: ContactModel::default(),
            received_at: SimTime::ZERO,
            tank: EnergyTank::new(tank_j),
            before: None,
            report,
            late_ms: Histogram::new(0.005),
            age_steps: Histogram::new(0.005),
            force_sum_n: 0.0,
        })
    }

    /// Leads the object where it runs, in a world of which the loop's own shows the newest states ([`GhostWorld`]).
    ///
    /// # Errors
    /// [`WorldError::NoObject`].
    ///
    /// [`GhostWorld`]: metachron_world::GhostWorld
    pub fn elsewhere(self, calls: Arc<dyn WorldCalls>) -> Result<Self, WorldError> {
        let object = calls.object(&self.report.object)?;
        Ok(Self { elsewhere: Some(Elsewhere { calls, object }), ..self })
    }

    /// The time from a tick to the next.
    #[must_use]
    pub fn period(&self) -> Duration {
        Duration::from_secs_f64(self.period_s)
    }

    /// One tick, `elapsed` after the one before and by so much too late. A failure is counted in the report; the next tick follows.
    pub fn tick(&mut self, elapsed: Duration, late: Duration) {
        self.report.ticks += 1;
        self.late_ms.record(late.as_secs_f64() * 1e3);
        if let Err(why) = self.serve(elapsed.as_secs_f64()) {
            self.report.failures += 1;
            self.report.first_failure.get_or_insert(why);
        }
    }

    /// The report so far.
    #[must_use]
    pub fn report(&self) -> DeviceReport {
        DeviceReport {
            late_ms: self.late_ms.quantiles(),
            age_steps: self.age_steps.quantiles(),
            force_mean_n: self.force_sum_n / self.report.ticks.max(1) as f64,
            energy_out_j: self.tank.out_j(),
            ..self.report.clone()
        }
    }

    fn serve(&mut self, elapsed_s: f64) -> Result<(), String> {
        let state = self.device.read(elapsed_s).map_err(|error| format!("the device gave no state: {error}"))?;
        if !state.is_sound() {
            return Err(format!("the device gave a state that is none: {state:?}"));
        }
        self.tank.settle(&state);
        let before = self.before.replace(state);
        self.report.presses += u64::from((state.buttons & !before.map_or(0, |before| before.buttons)).count_ones());
        let led = self.lead(&state);
        let felt = self.feel(&state);
        // without a wrench to feel, the hand is given none
        let wanted = *felt.as_ref().unwrap_or(&Wrench::default());
        let limits = self.device.limits();
        let given = self.tank.admit(&limits.of(&wanted), &Handle { state, limits, period_s: self.period_s });
        let force_n = given.force_n.length();
        self.force_sum_n += force_n;
        self.report.force_max_n = self.report.force_max_n.max(force_n);
        self.device.write(&given).map_err(|error| format!("the device took no wrench: {error}"))?;
        led.and(felt.map(drop)).map_err(|error| error.to_string())
    }

    /// Leads the object to where the handle is.
    fn lead(&self, state: &DeviceState) -> Result<(), WorldError> {
        let DeviceState { position_m, rotation, velocity_m_s, spin_rad_s, .. } = *state;
        let command = if self.is_tool {
            Command::Spring(Keyed::first(Some(AnchorSpring {
                by: None,
                anchor: Anchor::Local(DVec3::ZERO),
                target: position_m,
                target_velocity: velocity_m_s,
                // a tool follows by its own drive
                stiffness_n_m: 0.0,
                damping_n_s_m: 0.0,
            })))
        } else {
            Command::pose(position_m, rotation).moving(velocity_m_s, spin_rad_s)
        };
        let command = command.expires_after(LEADS);
        match &self.elsewhere {
            Some(Elsewhere { calls, object }) => calls.post(*object, command),
            None => self.world.command(self.object, command),
        }
    }

    /// The wrench on the object where the handle is, by the newest state; it fades where no other state comes.
    fn feel(&mut self, state: &DeviceState) -> Result<Wrench, WorldError> {
        let now = self.world.time();
        // a link's states are due with its messages, also those of what rests, and answer what was commanded a round trip ago
        let link = self.elsewhere.as_ref().and_then(|there| there.calls.link());
        let seconds = |of: fn(&StateLink) -> Duration| link.as_ref().map_or(0.0, |link| of(link).as_secs_f64());
        let (silent_s, period_s) = (seconds(|link| link.age), seconds(|link| link.period));
        if self.model.refresh(&self.world, self.object)? {
            self.received_at = now;
            self.model.answer_within(period_s + seconds(|link| link.round_trip));
        }
        // where a machine is loaded an object's clock is behind the scene's, and its state answers the newest pose all the same: the age is by arrival
        let age_s = if self.model.at_rest { 0.0 } else { now.secs_after(self.received_at).max(0.0) };
        // where a link is silent the scene's time stands
        let due_s = self.model.step_s.max(period_s);
        // before the first step nothing has been felt
        let age_steps = if self.model.step_s > 0.0 { age_s.max(silent_s) / due_s } else { 0.0 };
        self.age_steps.record(age_steps);
        self.report.stale += u64::from(age_steps > WHOLE_STEPS);
        let late_s = (age_steps - WHOLE_STEPS).max(0.0) * due_s;
        let share = (1.0 - late_s / LEADS.as_secs_f64()).max(0.0);
        let rotation = if self.is_tool { self.model.rotation() } else { state.rotation };
        Ok(self.model.wrench(state.position_m, rotation) * share)
    }
}
