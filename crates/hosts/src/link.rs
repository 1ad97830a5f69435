//! Calls of a world that runs elsewhere, and what its host sends.
//!
//! In: a session with a host, messages. Out: answers; a mirror that is up to date. Never here: how a session begins, which calls there are.

use crate::endpoint::LEASE;
use crate::mirror::Mirror;
use crate::rounded::{Change, Sketched, Sketches};
use crate::wire::{Call, Moment, PROGRAM, Reply, Request, decode, encode};
use metachron_core::AgentId;
use metachron_world::{Object, WorldError};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use zenoh::handlers::DefaultHandler;
use zenoh::qos::CongestionControl;
use zenoh::query::ConsolidationMode;
use zenoh::session::SessionGetBuilder;
use zenoh::{Session, Wait};

/// The most that an answer is waited for. It is as long as any work of a host: one that ends or falls silent meanwhile is noticed within a
/// [`LEASE`] or two, by its link.
const ANSWER_WITHIN: Duration = Duration::from_hours(24);
/// All states are asked for at most so often.
const REFRESH: Duration = Duration::from_millis(250);

/// Calls of a host and their answers.
pub(crate) struct Link {
    pub session: Session,
    pub mirror: Arc<Mirror>,
    pub caller: String,
    pub is_open: bool,
    /// Of a caller that only looks.
    pub sketches: Mutex<Option<Sketches>>,
    /// The number of the newest call.
    pub sequence: Mutex<u64>,
    pub posted: Arc<Mutex<Posted>>,
    pub ends: AtomicBool,
}

/// The outcome of the calls that were posted.
#[derive(Default)]
pub(crate) struct Posted {
    /// How long the newest that ended has taken: until its answer, or until none was waited for any more.
    pub round_trip: Duration,
    /// The newest refusal.
    pub refused: Option<WorldError>,
    /// How many had no answer in time.
    pub lost: u64,
}

impl Link {
    /// Reads states until the connection ends, and asks for all where some are missing.
    pub fn read(&self, messages: &Receiver<Vec<u8>>) {
        let mut refreshed = Instant::now();
        while !self.ends.load(Relaxed) {
            match messages.recv_timeout(LEASE / 20) {
                Ok(bytes) => self.take(&bytes),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            if self.mirror.is_stale() && self.mirror.silence().is_none() && refreshed.elapsed() >= REFRESH {
                // where it fails it is asked again
                let _ = self.refresh();
                refreshed = Instant::now();
            }
        }
    }

    /// Takes a message of states.
    fn take(&self, bytes: &[u8]) {
        let mut sketches = self.sketches();
        let message = match &*sketches {
            Some(sketches) => sketches.decode(bytes),
            None => match decode(bytes) {
                Ok(Reply::Moment(moment)) => Ok(Sketched::Next(moment, Change::default())),
                _ => return self.mirror.refuse(),
            },
        };
        match message {
            Ok(Sketched::Next(moment, change)) => {
                if self.mirror.take(moment)
                    && let Some(sketches) = &mut *sketches
                {
                    sketches.apply(change);
                }
            }
            Ok(Sketched::Old) => {}
            Ok(Sketched::Later) => self.mirror.miss(),
            Err(_) => self.mirror.refuse(),
        }
    }

    fn sketches(&self) -> MutexGuard<'_, Option<Sketches>> {
        self.sketches.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Introduces the caller again, where its host has forgotten it, and takes all states.
    pub fn refresh(&self) -> Result<(), WorldError> {
        // the lock is free again before the host is asked
        let is_looking = self.sketches().is_some();
        self.call(hello(is_looking))?;
        let all = self.call(Call::All)?.into_iter();
        let parts = all.map(|part| if let Reply::Moment(part) = part { Ok(part) } else { Err(unexpected()) });
        let parts = parts.collect::<Result<Vec<Moment>, _>>()?;
        self.sketches().iter_mut().for_each(|sketches| sketches.begin(&parts));
        self.mirror.take_all(parts);
        Ok(())
    }

    /// Calls the host, and waits for all that it answers.
    fn call(&self, call: Call) -> Result<Vec<Reply>, WorldError> {
        let (asked, silences) = (Instant::now(), self.mirror.silences());
        if let Some(silent) = self.mirror.silence() {
            return Err(silent);
        }
        let answers =
            self.send(call, |get| get.timeout(ANSWER_WITHIN).consolidation(ConsolidationMode::None).wait())?;
        let mut replies = Vec::new();
        while let Ok(answer) = answers.recv_timeout(LEASE / 20) {
            let Some(answer) = answer else {
                if self.mirror.silences() == silences {
                    continue;
                }
                // what was on its way when the link broke does not come
                return Err(self.mirror.silent_for(asked.elapsed()));
            };
            let Ok(sample) = answer.result() else { continue };
            match decode(&sample.payload().to_bytes()) {
                Ok(Reply::Refused(refusal)) => return Err(refusal.into()),
                Ok(reply) => replies.push(reply),
                Err(bad) => {
                    self.mirror.refuse();
                    return Err(WorldError::Elsewhere(bad.to_string()));
                }
            }
        }
        if replies.is_empty() { Err(self.mirror.silent_for(asked.elapsed())) } else { Ok(replies) }
    }

    /// Sends a call under the next number: calls leave in the order of their numbers.
    fn send<T>(
        &self,
        call: Call,
        ask: impl FnOnce(SessionGetBuilder<'_, '_, DefaultHandler>) -> zenoh::Result<T>,
    ) -> Result<T, WorldError> {
        let elsewhere = |reason: String| WorldError::Elsewhere(reason);
        let key = format!("metachron/{}/call/{}", self.mirror.world, self.caller);
        let mut sequence = self.sequence.lock().unwrap_or_else(PoisonError::into_inner);
        *sequence += 1;
        let request = encode(&Request { run: self.mirror.run, sequence: *sequence, call });
        let get = self.session.get(key).payload(request.map_err(|bad| elsewhere(bad.to_string()))?);
        ask(get).map_err(|error| elsewhere(error.to_string()))
    }

    /// Calls the host and waits for nothing; a call that it refuses is the error of the next one posted. Where the link is full the call is lost,
    /// which counts as no answer.
    pub fn post(&self, call: Call) -> Result<(), WorldError> {
        if let Some(silent) = self.mirror.silence() {
            return Err(silent);
        }
        let (all, begun) = (Arc::clone(&self.posted), Instant::now());
        let take = move |answer: zenoh::query::Reply| {
            let mut posted = all.lock().unwrap_or_else(PoisonError::into_inner);
            posted.round_trip = begun.elapsed();
            match answer.result().map(|sample| decode(&sample.payload().to_bytes())) {
                Ok(Ok(Reply::Refused(refusal))) => posted.refused = Some(refusal.into()),
                Ok(_) => {}
                Err(_) => posted.lost += 1,
            }
        };
        let post = |get: SessionGetBuilder<'_, '_, DefaultHandler>| {
            get.timeout(LEASE).congestion_control(CongestionControl::Drop).callback(take).wait()
        };
        self.send(call, post)?;
        self.posted().refused.take().map_or(Ok(()), Err)
    }

    pub fn posted(&self) -> MutexGuard<'_, Posted> {
        self.posted.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Calls the host for one answer.
    pub fn ask(&self, call: Call) -> Result<Reply, WorldError> {
        self.call(call)?.pop().ok_or_else(unexpected)
    }

    /// Calls the host for nothing but that it is done; what it changed is seen then.
    pub fn act(&self, call: Call) -> Result<(), WorldError> {
        let Reply::Done(sequence) = self.ask(call)? else { return Err(unexpected()) };
        self.see(sequence)
    }

    /// Readers of states see from then on all that is in the messages up to this number.
    pub fn see(&self, sequence: u64) -> Result<(), WorldError> {
        if sequence > 0 && !self.mirror.reach(sequence, LEASE) {
            self.refresh()?;
        }
        Ok(())
    }

    pub fn own(&self, object: Object) -> Result<AgentId, WorldError> {
        if object.is_of(self.mirror.tag) { Ok(object.id()) } else { Err(WorldError::Foreign) }
    }
}

pub(crate) fn hello(is_looking: bool) -> Call {
    Call::Hello { program: PROGRAM.to_owned(), is_looking }
}

pub(crate) fn unexpected() -> WorldError {
    WorldError::Elsewhere("the host has answered something else than was asked".to_owned())
}
