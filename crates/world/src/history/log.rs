//! The log that a world writes while it runs, or follows: the one place that knows whether it is recorded, replayed or neither.
//!
//! In: calls and governors' answers. Out: the same into a [`Recorder`], or a governor's answer from a recording instead of its own.
//! Never here: the file, the calls of a replay ([`super::replay`]).

use super::checkpoint::Checkpoint;
use super::recording::{Entry, RecordError, Recorder, Recording};
use crate::Member;
use crate::start::assemble::Govern;
use metachron_core::{AgentId, Archive, ArchiveError};
use metachron_runtime::{Agents, Demand, Governor, OrderLog, TurnMeasure, TurnOrder, TurnPart, state_hash};
use std::collections::{BTreeMap, VecDeque};
use std::convert::Infallible;
use std::sync::atomic::{
    AtomicBool,
    Ordering::{Acquire, Release},
};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// Whether a world is recorded, replayed or neither. In lockstep, and in an order of turns, only one thread at a time is here.
#[derive(Default)]
pub(crate) struct Log {
    mode: Mutex<Mode>,
    /// Whether it is recorded or replayed: governors look at this alone where it is not.
    is_in_use: AtomicBool,
    /// The demands of governors before the first turns of their agents.
    starts: Mutex<Vec<(AgentId, Demand)>>,
}

#[derive(Default)]
pub(crate) enum Mode {
    /// Nothing was done to it since its start.
    #[default]
    Fresh,
    Unrecorded,
    /// In real time with the order of its turns.
    Recorded(Recorder, Option<Arc<TurnOrder>>),
    Replayed(Script),
}

/// The answers that governors are to give, and how far a replay is.
pub(crate) struct Script {
    /// For each agent its governor's answers, each after so many turns with none.
    demands: BTreeMap<AgentId, VecDeque<(u32, Demand)>>,
    starts: BTreeMap<AgentId, Demand>,
    played: usize,
    of: usize,
    fault: Option<String>,
}

impl Log {
    /// The log of a world that repeats `recording`.
    pub fn of_replay(recording: &Recording) -> Self {
        let mut demands: BTreeMap<AgentId, VecDeque<_>> = BTreeMap::new();
        let mut starts = BTreeMap::new();
        for entry in &recording.entries {
            match entry {
                Entry::Demand(agent, turns_before, demand) => {
                    demands.entry(*agent).or_default().push_back((*turns_before, *demand));
                }
                Entry::Start(agent, demand) => drop(starts.insert(*agent, *demand)),
                _ => {}
            }
        }
        let script = Script { demands, starts, played: 0, of: recording.entries.len(), fault: None };
        Self { mode: Mutex::new(Mode::Replayed(script)), is_in_use: AtomicBool::new(true), ..Self::default() }
    }

    /// Writes down a call that is about to be made.
    pub fn note(&self, entry: impl FnOnce() -> Entry) {
        self.mode().note(entry);
    }

    /// Does something to the world and writes it down: no part of a turn is made between the two, and no recording
    /// begins or ends. `wait` is for callers that do not have the run: it keeps calls in lockstep from letting time
    /// pass, which is written down before it is done.
    ///
    /// # Errors
    /// The errors of `wait`; nothing is done then.
    pub fn in_order<T, G, E>(
        &self,
        wait: impl Fn() -> Result<G, E>,
        act: impl FnOnce() -> T,
        note: impl FnOnce(&mut Mode, &T),
    ) -> Result<T, E> {
        loop {
            if let Some(order) = self.order() {
                let _held = order.between();
                // that of a recording which has ended meanwhile keeps nobody
                if self.mode().order().is_some_and(|now| Arc::ptr_eq(now, &order)) {
                    let done = act();
                    note(&mut self.mode(), &done);
                    return Ok(done);
                }
            } else {
                let was_recorded = self.is_recorded();
                let _waits = was_recorded.then(&wait).transpose()?;
                let mut mode = self.mode();
                if mode.order().is_none() && was_recorded == matches!(*mode, Mode::Recorded(..)) {
                    let done = act();
                    note(&mut mode, &done);
                    return Ok(done);
                }
            }
        }
    }

    /// Puts all into the state of `checkpoint` by `act`, and writes down that they were: of a state that is refused nothing.
    ///
    /// # Errors
    /// The errors of `act`.
    pub fn restore<E>(&self, checkpoint: &Checkpoint, act: impl FnOnce() -> Result<(), E>) -> Result<(), E> {
        if let Mode::Recorded(recorder, _) = &mut *self.mode() {
            recorder.set_restoring(Some(checkpoint.to_bytes()));
        }
        let outcome = act();
        // in real time the order of turns says when it was: there the state is written down before the part that it is in
        let note = |mode: &mut Mode, (): &()| match mode {
            Mode::Recorded(recorder, _) if outcome.is_ok() => recorder.note_restored(),
            Mode::Recorded(recorder, _) => recorder.set_restoring(None),
            _ if outcome.is_ok() => mode.note_begun(),
            _ => {}
        };
        let Ok(()) = self.in_order(|| Ok::<_, Infallible>(()), || (), note);
        outcome
    }

    pub fn is_recorded(&self) -> bool {
        matches!(*self.mode(), Mode::Recorded(..))
    }

    /// Whether it is recorded no further, because something could not be written.
    pub fn recording_failed(&self) -> bool {
        matches!(&*self.mode(), Mode::Recorded(recorder, _) if recorder.has_failed())
    }

    pub fn is_replayed(&self) -> bool {
        matches!(*self.mode(), Mode::Replayed(_))
    }

    /// Begins to write down to the recorder that `begin` gives, in real time with the order of turns; it is told
    /// whether nothing was done to the world since its start. Nothing is done to it meanwhile.
    ///
    /// # Errors
    /// [`RecordError::Recorded`]; the errors of `begin`.
    pub fn record(
        &self,
        begin: impl FnOnce(bool) -> Result<(Recorder, Option<Arc<TurnOrder>>), RecordError>,
    ) -> Result<(), RecordError> {
        let mut mode = self.mode();
        if matches!(*mode, Mode::Recorded(..)) {
            return Err(RecordError::Recorded);
        }
        let is_fresh = matches!(*mode, Mode::Fresh);
        let (mut recorder, order) = begin(is_fresh)?;
        if is_fresh {
            // a checkpoint, with which any other recording begins, has it
            self.starts().iter().for_each(|(agent, demand)| recorder.note(Entry::Start(*agent, *demand)));
        }
        *mode = Mode::Recorded(recorder, order);
        self.is_in_use.store(true, Release);
        Ok(())
    }

    /// The order of turns of a world that is recorded in real time.
    pub fn order(&self) -> Option<Arc<TurnOrder>> {
        self.mode().order().map(Arc::clone)
    }

    /// Takes the recorder, if there is one: nothing more is written down.
    pub fn take_recorder(&self) -> Option<Recorder> {
        let mut mode = self.mode();
        if !matches!(*mode, Mode::Recorded(..)) {
            return None;
        }
        self.is_in_use.store(false, Release);
        match std::mem::replace(&mut *mode, Mode::Unrecorded) {
            Mode::Recorded(recorder, order) => {
                order.inspect(|order| order.close());
                Some(recorder)
            }
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
        self.mode.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn starts(&self) -> MutexGuard<'_, Vec<(AgentId, Demand)>> {
        self.starts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The demand of the governor of `agent` before its first turn: by `answer`, or by the recording.
    fn start(&self, agent: AgentId, answer: impl FnOnce() -> Demand) -> Demand {
        if let Mode::Replayed(script) = &*self.mode() {
            return script.starts.get(&agent).copied().unwrap_or_default();
        }
        let demand = answer();
        if demand != Demand::default() {
            self.starts().push((agent, demand));
        }
        demand
    }

    /// The demand of the governor of `agent` after a turn: by `answer`, or by the recording.
    fn demand(&self, agent: AgentId, answer: impl FnOnce() -> Demand) -> Demand {
        if !self.is_in_use.load(Acquire) {
            return answer();
        }
        let mut mode = self.mode();
        match &mut *mode {
            Mode::Replayed(script) => script.next(agent),
            Mode::Recorded(recorder, _) => {
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

/// Writes down the turns of a world.
pub(super) struct TurnsToLog {
    pub log: Weak<Log>,
    pub agents: Agents,
}

impl OrderLog for TurnsToLog {
    fn take(&self, parts: &mut Vec<TurnPart>) {
        if let Some(log) = self.log.upgrade()
            && let Mode::Recorded(recorder, _) = &mut *log.mode()
        {
            recorder.note_turns(parts, || state_hash(&self.agents));
        }
        parts.clear();
    }
}

impl Mode {
    fn order(&self) -> Option<&Arc<TurnOrder>> {
        if let Self::Recorded(_, order) = self { order.as_ref() } else { None }
    }

    /// Writes down a call.
    pub fn note(&mut self, entry: impl FnOnce() -> Entry) {
        match self {
            Self::Recorded(recorder, _) => recorder.note(entry()),
            Self::Fresh => *self = Self::Unrecorded,
            Self::Unrecorded | Self::Replayed(_) => {}
        }
    }

    /// Notes that something was done which is not written down.
    pub fn note_begun(&mut self) {
        if matches!(self, Self::Fresh) {
            *self = Self::Unrecorded;
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
            Some((turns_before, _)) => {
                *turns_before -= 1;
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
    fn begins_with(&self) -> Demand {
        let Self { agent, inner, log } = self;
        log.start(*agent, || inner.begins_with())
    }

    fn after_step(&mut self, turn: &TurnMeasure) -> Demand {
        let Self { agent, inner, log } = self;
        log.demand(*agent, || inner.after_step(turn))
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.inner.archive(archive)
    }
}

/// The governors that `govern` chooses, each with its answers in `log`.
pub(crate) fn logged<'a>(
    govern: Govern<'a>,
    log: &'a Arc<Log>,
) -> impl FnMut(&Member) -> Option<Box<dyn Governor>> + 'a {
    move |member| {
        let inner = govern(member)?;
        Some(Box::new(LoggedGovernor { agent: member.id, inner, log: Arc::clone(log) }))
    }
}
