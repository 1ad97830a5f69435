//! The window's time: it runs, stands, steps, and moments of the past are looked at and gone on from.
//!
//! In: commands of the user. Out: the session's time. Never here: the bar that shows it.

use super::{Meter, WindowSimulation};
use crate::ui::{Look, Severity};
use metachron_runtime::TimelineCommand;
use metachron_world::CheckpointError;
use std::time::Duration;

impl WindowSimulation<'_> {
    /// Runs, pauses, steps or changes the speed; a run that goes on from a moment of the past is as it was then.
    pub(super) fn drive(&mut self, drive: TimelineCommand) {
        let goes_on = matches!(drive, TimelineCommand::Run | TimelineCommand::Step(_));
        let put_back = goes_on && self.go_on_from_there();
        match drive {
            TimelineCommand::Run => self.running = true,
            TimelineCommand::Pause | TimelineCommand::Step(_) | TimelineCommand::Leap(_) => self.running = false,
            TimelineCommand::Speed(speed) => self.speed = speed,
            TimelineCommand::Free => self.speed = 1.0,
        }
        if put_back {
            let timeline = self.session.world().timeline();
            if timeline.speed() != self.speed {
                self.session.drive(TimelineCommand::Speed(self.speed));
            }
            // it ran then, and runs on: nothing is to be changed in it
            if drive == TimelineCommand::Run && timeline.runs_at(self.session.now()) {
                return;
            }
        }
        self.session.drive(drive);
    }

    /// Whether the run was put back to the moment that was looked at.
    fn go_on_from_there(&mut self) -> bool {
        let outcome = self.session.go_on_from_there();
        self.went_on = matches!(outcome, Ok(true));
        self.take_moment(outcome.map(drop));
        self.went_on
    }

    /// Looks at a moment. In lockstep the run stands there, also at the newest, until the user lets it run.
    pub(super) fn look(&mut self, look: Look) {
        let outcome = match look {
            Look::At(time) => self.session.look_at(time),
            Look::Back => self.session.look_beside(true),
            Look::Forward => self.session.look_beside(false),
            Look::Live => self.session.look_live(),
        };
        if !self.session.world().timeline().runs_at(self.session.now()) {
            self.running = false;
        }
        self.take_moment(outcome);
    }

    /// Begins to measure from where the run stands now.
    fn take_moment(&mut self, outcome: Result<(), CheckpointError>) {
        if let Err(error) = outcome {
            self.show_message(Severity::Failure, error.to_string());
        }
        (self.started, self.refreshed) = (self.session.now(), None);
        self.meter = Meter::new(&self.session);
    }

    /// Lets virtual time pass by one frame, unless it stands in the past; real time passes by itself. Keeps the moment.
    pub(super) fn pass_time(&mut self) {
        if self.session.is_put_back() || std::mem::take(&mut self.went_on) {
            return;
        }
        let now = self.session.now();
        let next = self.started + self.session.period();
        self.started = if self.session.is_virtual() && now > Duration::ZERO { next.max(now) } else { now };
        self.session.wait_until(self.started);
        if let Err(error) = self.session.keep_moment() {
            self.show_message(Severity::Warning, format!("there is no way back: {error}"));
        }
    }
}
