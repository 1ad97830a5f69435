//! What a world writes down while it runs, or follows: the one place that knows whether it is recorded, replayed or neither.
//!
//! In: calls and governors' answers. Out: the same into a [`Recorder`], or a governor's answer from a recording instead of its own.
//! Never here: the file, the calls of a replay ([`super::replay`]).

use super::Member;
use super::assemble::Govern;
use super::recording::{Entry, Recorder, Recording};
use metachron_core::{AgentId, Archive, ArchiveError};
use metachron_runtime::{Demand, Governor, TurnMeasure};
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Whether a world is recorded, replayed or neither. In lockstep only one thread at a time is here.
#[derive(Default)]
pub(super) struct Log(Mutex<Mode>);

#[derive(Default)]
enum Mode {
    /// Nothing was done to it since its start.
    #[default]
    Fresh,
    Unrecorded,
    Recorded(Recorder),
    Replayed(Script),
}

/// What governors are to answer, and how far a replay is.
pub(super) struct Script {
    /// For each agent its governor's answers, each after so many turns with none.
    demands: BTreeMap<AgentId, VecDeque<(u32, Demand)>>,
    played: usize,
    of: usize,
    fault: Option<String>,
}

impl Log {
    /// The log of a world that repeats `recording`.
    pub fn of_replay(recording: &Recording) -> Self {
        let mut demands: BTreeMap<AgentId, VecDeque<_>> = BTreeMap::new();
        for entry in &recording.entries {
            if let Entry::Demand(agent, content, demand) = entry {
                demands.entry(*agent).or_default().push_back((*content, *demand));
            }
        }
        let script = Script { demands, played: 0, of: recording.entries.len(), fault: None };
        Self(Mutex::new(Mode::Replayed(script)))
    }

    /// Writes down what is about to be done.
    pub fn note(&self, entry: impl FnOnce() -> Entry) {
        let mut mode = self.mode();
        match &mut *mode {
            Mode::Recorded(recorder) => recorder.note(entry()),
            Mode::Fresh => *mode = Mode::Unrecorded,
            Mode::Unrecorded | Mode::Replayed(_) => {}
        }
    }

    /// Notes that something was done which is not written down.
    pub fn note_begun(&self) {
        let mut mode = self.mode();
        if matches!(*mode, Mode::Fresh) {
            *mode = Mode::Unrecorded;
        }
    }

    /// Whether nothing was done to the world since its start.
    pub fn is_fresh(&self) -> bool {
        matches!(*self.mode(), Mode::Fresh)
    }

    pub fn is_recorded(&self) -> bool {
        matches!(*self.mode(), Mode::Recorded(_))
    }

    /// Whether it is recorded no further, because something could not be written.
    pub fn recording_failed(&self) -> bool {
        matches!(&*self.mode(), Mode::Recorded(recorder) if recorder.has_failed())
    }

    pub fn is_replayed(&self) -> bool {
        matches!(*self.mode(), Mode::Replayed(_))
    }

    /// Begins to write down.
    pub fn record(&self, recorder: Recorder) {
        *self.mode() = Mode::Recorded(recorder);
    }

    /// Takes the recorder, if there is one: nothing more is written down.
    pub fn take_recorder(&self) -> Option<Recorder> {
        let mut mode = self.mode();
        if !matches!(*mode, Mode::Recorded(_)) {
            return None;
        }
        match std::mem::replace(&mut *mode, Mode::Unrecorded) {
            Mode::Recorded(recorder) => Some(recorder),
            _ => None,
        }
    }

    /// Notes that so many entries of a recording are played, and why no more are.
    pub fn note_played(&self, played: usize, fault: Option<String>) {
        if let Mode::Replayed(script) = &mut *self.mode() {
            (script.played, script.fault) = (played, fault);
        }
    }

    /// The share of a recording that is played, 0 … 1, or why no more of it is; `None` where there is none.
    pub fn played(&self) -> Option<Result<f64, String>> {
        let Mode::Replayed(script) = &*self.mode() else { return None };
        let share = if script.of == 0 { 1.0 } else { script.played as f64 / script.of as f64 };
        Some(script.fault.clone().map_or(Ok(share), Err))
    }

    fn mode(&self) -> MutexGuard<'_, Mode> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What the governor of `agent` asks for after a turn: what `answer` says, or what the recording says.
    fn demand(&self, agent: AgentId, answer: impl FnOnce() -> Demand) -> Demand {
        let mut mode = self.mode();
        match &mut *mode {
            Mode::Replayed(script) => script.next(agent),
            Mode::Recorded(recorder) => {
                let demand = answer();
                recorder.note_demand(agent, demand);
                demand
            }
            Mode::Fresh | Mode::Unrecorded => {
                // others need not wait for it
                drop(mode);
                answer()
            }
        }
    }
}

impl Script {
    fn next(&mut self, agent: AgentId) -> Demand {
        let Some(answers) = self.demands.get_mut(&agent) else { return Demand::default() };
        match answers.front_mut() {
            Some((0, demand)) => {
                let demand = *demand;
                answers.pop_front();
                demand
            }
            Some((content, _)) => {
                *content -= 1;
                Demand::default()
            }
            None => Demand::default(),
        }
    }
}

/// A governor whose answers are written down, or come from a recording.
struct LoggedGovernor {
    agent: AgentId,
    inner: Box<dyn Governor>,
    log: Arc<Log>,
}

impl Governor for LoggedGovernor {
    fn after_step(&mut self, turn: &TurnMeasure) -> Demand {
        let Self { agent, inner, log } = self;
        log.demand(*agent, || inner.after_step(turn))
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.inner.archive(archive)
    }
}

/// The governors that `govern` chooses, each with its answers in `log`.
pub(super) fn logged<'a>(
    govern: Govern<'a>,
    log: &'a Arc<Log>,
) -> impl FnMut(&Member) -> Option<Box<dyn Governor>> + 'a {
    move |member| {
        let inner = govern(member)?;
        Some(Box::new(LoggedGovernor { agent: member.id, inner, log: Arc::clone(log) }))
    }
}
