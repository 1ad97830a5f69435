//! The model of an agent: code that may be anybody's, called through here alone.
//!
//! In: calls. Out: their answers; from a model that has panicked, in this call or one before, the reason, and no code
//! of it runs any more. Running code is marked, so that others can see whose it is ([`CallMark`]). Never here: what
//! becomes of the agent.

use crate::agent::handle::Shared;
use metachron_contact::member::{BadAnswer, CallMark, GuardedMember};
use metachron_contact::{Agent, Inputs, OwnSteps, StepContext, Stepping};
use metachron_core::SimSpan;
use metachron_core::{Archive, ArchiveError, Snapshot, StepError, StepReport};
use metachron_geometry::CollisionShape;
use std::hint::black_box;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// Runs `part` of a turn; an error or a panic in it is the reason to park.
pub(crate) fn contained<T>(part: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    // a model is not called again after a panic, so its broken invariants have no effect
    match catch_unwind(AssertUnwindSafe(part)) {
        Ok(result) => result,
        Err(payload) => {
            if let Some(BadAnswer(what)) = payload.downcast_ref() {
                return Err(format!("answered {what}, which no step can go on with"));
            }
            let text = payload.downcast_ref::<&str>().copied().map(str::to_owned);
            let text = text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default();
            // an agent of somebody's own may panic, too
            Err(format!("panicked, which is a bug of its model or of metachron: {text}"))
        }
    }
}

/// A model with the state of its calls.
pub(crate) struct Model {
    agent: Box<dyn Agent>,
    /// Has the mark of its calls.
    shared: Arc<Shared>,
    /// Why it is not called any more.
    broken: Option<Box<str>>,
}

/// The traits of a model, asked once at the start.
#[derive(Debug)]
pub(crate) struct Traits {
    pub model: &'static str,
    pub inputs: Inputs,
    pub is_member: bool,
    pub form: Option<Arc<CollisionShape>>,
}

impl Traits {
    /// Asks `agent`; one that panics has none of them, and `mark` says so.
    pub fn of(agent: &mut dyn Agent, mark: &CallMark) -> Self {
        let asked = contained(|| {
            Ok(mark.during(|| Self {
                model: agent.model(),
                inputs: agent.inputs(),
                is_member: agent.member().is_some(),
                form: agent.form(),
            }))
        });
        asked.unwrap_or(Self { model: "unknown", inputs: Inputs::default(), is_member: false, form: None })
    }
}

impl Model {
    /// The model of the agent that `shared` is of.
    pub fn new(agent: Box<dyn Agent>, shared: Arc<Shared>) -> Self {
        let broken = shared.calls.is_running().then(|| "panicked when it was asked what it is".into());
        Self { agent, shared, broken }
    }

    /// Calls it.
    ///
    /// # Errors
    /// Why it is called no more: for a panic, in this call or before.
    pub fn call<T>(&mut self, call: impl FnOnce(&mut dyn Agent) -> T) -> Result<T, String> {
        let Self { agent, shared, broken } = self;
        if let Some(reason) = broken {
            return Err(reason.to_string());
        }
        contained(|| Ok(shared.calls.during(|| call(&mut **agent))))
            .inspect_err(|reason| *broken = Some(reason.as_str().into()))
    }

    /// Reads a word of it ([`super::prefetch`]).
    pub fn fetch(&mut self) {
        // a fault of the model shows in its turn
        drop(self.call(|agent| black_box(agent.resolution())));
    }

    /// The model as a member of clusters, for a step that begins; `None` of a model that is no member.
    ///
    /// # Errors
    /// As [`Self::call`].
    pub fn member(&mut self) -> Result<Option<GuardedMember<'_>>, String> {
        let Self { agent, shared, broken } = self;
        if let Some(reason) = broken {
            return Err(reason.to_string());
        }
        let mark = &shared.calls;
        mark.take_refused();
        contained(|| Ok(mark.during(|| agent.member()).map(|member| GuardedMember::new(member, mark))))
            .inspect_err(|reason| *broken = Some(reason.as_str().into()))
    }

    /// Its step by itself.
    ///
    /// # Errors
    /// Its own, and as [`Self::call`].
    pub fn step(&mut self, dt: SimSpan, context: &StepContext<'_>) -> Result<StepReport, String> {
        let stepped = self.call(|agent| match agent.stepping() {
            Stepping::Own(own) => Some(own.step(dt, context)),
            Stepping::Cluster(_) => None,
        })?;
        stepped.ok_or("a member of clusters has no steps of its own")?.map_err(|error| error.to_string())
    }

    /// Writes or reads its state. One that is broken writes none, and one that is read whole is not broken any more.
    ///
    /// # Errors
    /// Its own; [`ArchiveError::Panicked`] where it panics, after which it is broken.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.value(&mut self.broken)?;
        if self.broken.is_some() {
            return Ok(());
        }
        self.shared.calls.clear();
        self.call(|agent| agent.archive(archive)).map_err(|reason| ArchiveError::Panicked { reason })?
    }

    /// Notes that a step unwound for `reason`, where it did so in code of this model.
    pub fn note_unwound(&mut self, reason: &str) {
        if self.broken.is_none() && self.shared.calls.is_running() {
            self.broken = Some(reason.into());
        }
    }

    /// Why it is called no more; `None` of a model that is sound.
    pub fn broken(&self) -> Option<&str> {
        self.broken.as_deref()
    }

    /// Whether it has refused the step that was made last.
    pub fn take_refused(&self) -> bool {
        self.shared.calls.take_refused()
    }
}

impl Drop for Model {
    fn drop(&mut self) {
        // it may panic there too, on a thread that others need
        let agent = std::mem::replace(&mut self.agent, Box::new(Nothing));
        drop(catch_unwind(AssertUnwindSafe(|| drop(agent))));
    }
}

/// The remains of a model that is freed.
struct Nothing;

impl Agent for Nothing {
    fn model(&self) -> &'static str {
        "nothing"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Own(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.clear();
    }
}

impl OwnSteps for Nothing {
    fn step(&mut self, _dt: SimSpan, _context: &StepContext<'_>) -> Result<StepReport, StepError> {
        Ok(StepReport { work: 0.0, substeps: 1, at_rest: true })
    }
}
