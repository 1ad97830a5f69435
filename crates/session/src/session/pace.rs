//! How a session's time passes: beside a clock, or as fast as its agents can step.
//!
//! In: a pace, when frames are due. Out: simulated time that has passed by then. Never here: frames, when agents make their turns.

use super::super::elsewhere::Elsewhere;
use super::Session;
use metachron_core::{SimSpan, SimTime};
use metachron_runtime::TimelineCommand;
use std::time::Duration;

impl Session {
    /// Pauses real time until [`Session::begin`]. Virtual time passes only while the caller waits.
    pub fn hold(&mut self) {
        if !self.is_virtual() && !self.is_elsewhere() {
            self.world.drive(TimelineCommand::Pause);
        }
    }

    /// Starts real time, and virtual time that was paused for a window; returns the wall time of that. Time elsewhere is left as it is.
    pub fn begin(&mut self) -> Duration {
        let now = self.now();
        if !self.is_virtual() {
            self.begun = now;
        }
        self.elsewhere.iter_mut().for_each(Elsewhere::begin);
        if !self.waits_for_agents() && !self.is_elsewhere() && !self.passes() {
            self.world.drive(TimelineCommand::Run);
        }
        now
    }

    /// Waits until the wall time `until`, while the agents run; where each frame waits for all agents, until they have lived as long as from
    /// [`Session::begin`] to there.
    pub fn wait_until(&mut self, until: Duration) {
        if !self.waits_for_agents() {
            return self.world.wait_until(until);
        }
        let span = u64::try_from(until.saturating_sub(self.begun).as_nanos()).unwrap_or(u64::MAX);
        let due = SimTime::ZERO + SimSpan::from_nanos(span);
        self.world.advance(due.since(self.sim_now()));
    }

    /// When the frame that was due at `due`, and is finished, is shown: no earlier than now, unless frames wait for all agents.
    pub(in super::super) fn shown(&self, due: Duration) -> Duration {
        if self.waits_for_agents() { due } else { due.max(self.now()) }
    }

    /// Whether time stands in real time until all agents have come as far.
    fn waits_for_agents(&self) -> bool {
        !self.is_virtual() && self.world.is_free()
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::headless::{Drawing, End, Headless, play_headless};
    use super::*;
    use crate::Outcome;
    use metachron_render::{Size, Style};
    use metachron_scene::{Source, load};
    use metachron_world::Pace;

    /// A tube whose step and ε control may choose, and a load of 3 ms a step, each of them asked for a step of 2 ms; on the declared machine a step
    /// of the tube takes ten of them.
    const TOO_MUCH: &str = "format = 1\n[target]\nframe_hz = 50.0\n[machine]\n[machine.step.tube]\nbase_us = 20000\n\
        [[object]]\nname = \"tube\"\nmodel = \"tube\"\npath_m = [[0, 0, 0], [0.3, 0, 0]]\nradius_m = 0.01\nclamp = [\"start\"]\nyoung_pa = 1e6\ndensity_kg_m3 = 1000.0\n\
        dt_ms = [2.0, 16.0]\neps_m = [0.01, 0.06]\n\
        [[object]]\nname = \"load\"\nmodel = \"synthetic\"\nrate_hz = 500.0\ncost_us = 3000.0\n";

    fn played(executor: &str, pace: Pace) -> Outcome {
        let source = Source::memory("load", TOO_MUCH.as_bytes()).unwrap();
        let scene = load(&source, &[("executor".to_owned(), format!("\"{executor}\""))]).unwrap();
        let session = Session::open(scene, pace).unwrap();
        let plan = Headless {
            end: End::Frames(41),
            size: Size { width: 64, height: 64 },
            style: Style::default(),
            drawing: Drawing::Nothing,
            png: None,
            depth: None,
            film: None,
        };
        play_headless(session, plan, &mut |_, _| true).unwrap()
    }

    #[test]
    fn beside_a_real_clock_an_agent_begins_at_its_coarsest_and_elsewhere_as_the_scene_has_it() {
        let begins = |executor: &str, pace: Pace| {
            let source = Source::memory("load", TOO_MUCH.as_bytes()).unwrap();
            let scene = load(&source, &[("executor".to_owned(), format!("\"{executor}\""))]).unwrap();
            // time is held
            let session = Session::open(scene, pace).unwrap();
            let eps_m = session.agents()[0].latest().resolution.map(|held| held.eps_m);
            (eps_m, session.end(None, false).agents[0].stats.dt.as_nanos())
        };
        for executor in ["threads", "pool"] {
            assert_eq!(begins(executor, Pace::RealTime), (Some(0.06), 16_000_000), "{executor}");
            assert_eq!(begins(executor, Pace::Factor(0.5)), (Some(0.06), 16_000_000), "{executor}");
            assert_eq!(begins(executor, Pace::Free), (Some(0.01), 2_000_000), "{executor}");
        }
        assert_eq!(begins("lockstep", Pace::RealTime), (Some(0.01), 2_000_000));
    }

    #[test]
    fn at_the_free_pace_neither_time_nor_steps_nor_detail_are_given_up() {
        for executor in ["lockstep", "threads", "pool"] {
            let outcome = played(executor, Pace::Free);
            assert_eq!((outcome.pace, outcome.finished), ("free", 41), "{executor}");
            // a run ends a period after its last frame
            assert!((outcome.sim_s - 0.82).abs() < 1e-9, "{executor}: {} s", outcome.sim_s);
            for agent in &outcome.agents {
                let stats = &agent.stats;
                let whole = (stats.steps, stats.dt.as_nanos(), stats.lived.as_nanos(), stats.lengthened);
                assert_eq!(whole, (410, 2_000_000, 820_000_000, 0), "{executor} {}", stats.name);
                assert_eq!(agent.given_up_s, 0.0, "{executor} {}", stats.name);
                assert!(stats.resolution.is_none_or(|held| held.eps_m == 0.01), "{executor}: {:?}", stats.resolution);
            }
        }
    }

    #[test]
    fn beside_the_clock_the_declared_machine_takes_detail_and_time() {
        let outcome = played("lockstep", Pace::RealTime);
        let tube = &outcome.agents[0];
        assert_eq!(outcome.pace, "real-time");
        assert!(tube.stats.dt.as_nanos() > 2_000_000 && tube.given_up_s > 0.1, "{:?}", tube.stats);
    }
}
