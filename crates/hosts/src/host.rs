//! A world that runs here, served to callers elsewhere.
//!
//! In: anything that answers a world's calls, an endpoint. Out: its states and events sixty times a second, and answers. Never
//! here: the effect of a call, which the world knows; sessions ([`crate::endpoint`]).

use crate::endpoint::{Place, Side, is_open_to_all, open};
use crate::error::HostsError;
use crate::gate::{CALLS_MAX, Callers, Fault, Gate, Refusals};
use crate::identity::is_name;
use crate::refusal::Refusal;
use crate::rounded;
use crate::serving::{ANYONE, Begins, Role, SceneFiles, Serving};
use crate::shown::{Changes, Shown};
use crate::waiting::{CALLS_WAITING, Waiting};
use crate::wire::{
    BadMessage, Call, Encoded, MESSAGE_MAX, PACKED_MAX, PROGRAM, Reply, Request, Welcome, decode, encode,
};
use metachron_core::SimSpan;
use metachron_world::{Checkpoint, DividedCalls, EventFilter, Part, Touched, WorldCalls, WorldError};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use zenoh::bytes::ZBytes;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::query::{Query, Queryable};
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

/// States leave so often.
pub(crate) const PERIOD: Duration = Duration::from_nanos(16_666_667);
/// The longest span that one call lets pass: other callers wait for it.
const SPAN_MAX: SimSpan = SimSpan::from_secs(1);

/// A world that is served until this is dropped; it runs on then.
pub struct Host {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
    /// The other sides of these see that they end.
    served: Option<(Queryable<()>, Subscriber<()>, LivelinessToken)>,
}

struct Shared {
    world: Arc<dyn WorldCalls>,
    name: String,
    scene: Option<Box<SceneFiles>>,
    begins: Option<Begins>,
    roles: BTreeMap<String, Role>,
    is_open: bool,
    /// A number that no run of a host had before.
    run: u64,
    session: Session,
    gate: Mutex<Gate>,
    shown: Mutex<Shown>,
    /// Callers and their calls.
    waiting: Waiting<(String, Query)>,
    ends: AtomicBool,
    /// The caller of the part of a world that is stepped here: states are sent when that caller shows them.
    part_of: Mutex<Option<String>>,
}

impl std::fmt::Debug for Host {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Host").field("name", &self.shared.name).finish_non_exhaustive()
    }
}

/// Serves `world`, until the host is dropped.
///
/// # Errors
/// [`HostsError`]: nothing is served then.
pub fn serve(world: Arc<dyn WorldCalls>, serving: Serving) -> Result<Host, HostsError> {
    check_scene(serving.scene.as_ref())?;
    let roles = roles(&serving)?;
    let Serving { name, endpoint, scene, begins, identity, insecure_lan, .. } = serving;
    let place = Place { endpoint: &endpoint, identity: identity.as_ref(), insecure_lan };
    let session = open(place, Side::Host(&roles.keys().map(|name| &**name).collect::<Vec<_>>()))?;
    let failed = |error: zenoh::Error| HostsError::network(&endpoint, &error);
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let run = (since_1970.as_nanos() as u64 ^ u64::from(std::process::id())).max(1);
    let events = world.listen(EventFilter::all());
    let shown = Mutex::new(Shown::new(events));
    let gate = Mutex::new(Gate::new(identity.is_some(), roles.len()));
    let (ends, part_of) = (AtomicBool::new(false), Mutex::default());
    let (scene, waiting) = (scene.map(Box::new), Waiting::new());
    let is_open = is_open_to_all(&endpoint);
    let shared = Arc::new(Shared {
        world,
        name,
        scene,
        begins,
        roles,
        is_open,
        run,
        session,
        gate,
        shown,
        waiting,
        ends,
        part_of,
    });
    let (publishing, answering) = (Arc::clone(&shared), Arc::clone(&shared));
    let threads = vec![
        spawn("hosts-publish", move || publishing.publish_on()).map_err(failed)?,
        spawn("hosts-answer", move || answering.answer_on()).map_err(failed)?,
    ];
    let mut host = Host { shared: Arc::clone(&shared), threads, served: None };
    let (session, key) = (&shared.session, |last: &str| format!("metachron/{}/{last}", shared.name));
    let living = Arc::clone(&shared);
    let callers =
        session.liveliness().declare_subscriber("metachron/caller/*/*").history(true).callback(move |sample| {
            let caller = caller_of(sample.key_expr().as_str());
            match sample.kind() {
                SampleKind::Put if caller.split('/').all(is_name) => living.gate().arrive(&caller),
                SampleKind::Put => living.gate().refuse(&caller, Fault::Stranger),
                SampleKind::Delete => {
                    living.gate().leave(&caller);
                    living.part_of().take_if(|of| *of == caller);
                }
            }
        });
    let callers = callers.wait().map_err(failed)?;
    let taking = Arc::clone(&shared);
    let queryable = session.declare_queryable(key("call/*/*")).callback(move |query| taking.take(query));
    let queryable = queryable.wait().map_err(failed)?;
    let token = session.liveliness().declare_token(key(&format!("host/{run}"))).wait().map_err(failed)?;
    host.served = Some((queryable, callers, token));
    Ok(host)
}

/// Checks that callers can be sent the scene.
fn check_scene(scene: Option<&SceneFiles>) -> Result<(), HostsError> {
    let Some(SceneFiles { scene: text, files }) = scene else { return Ok(()) };
    if encode(&Reply::Scene(scene.cloned().map(Box::new))).is_ok() {
        return Ok(());
    }
    let longest = files.iter().max_by_key(|(_, bytes)| bytes.len()).map_or(&text.name, |(name, _)| name);
    let bytes = text.text.len() + files.values().map(Vec::len).sum::<usize>();
    Err(HostsError::LongScene { bytes, most: MESSAGE_MAX, longest: longest.clone() })
}

/// The callers that are let in, and their roles: with certificates the named ones, without them all.
fn roles(Serving { name, endpoint, identity, roles, .. }: &Serving) -> Result<BTreeMap<String, Role>, HostsError> {
    if let Some(name) = std::iter::once(name).chain(roles.keys()).find(|name| !is_name(name)) {
        return Err(HostsError::BadName { name: name.clone() });
    }
    match (identity, roles.is_empty()) {
        (Some(_), true) => Err(HostsError::NoCallers),
        (Some(_), false) => Ok(roles.clone()),
        (None, false) => {
            let has = "callers are named, and without certificates their names are unknown";
            Err(HostsError::IdentityOrNot { endpoint: endpoint.clone(), has })
        }
        (None, true) => Ok([(ANYONE.to_owned(), Role::Operator)].into()),
    }
}

/// The name and the session of a caller, of a key that ends with them.
fn caller_of(key: &str) -> String {
    let mut chunks = key.rsplit('/');
    let (session, name) = (chunks.next().unwrap_or_default(), chunks.next().unwrap_or_default());
    format!("{name}/{session}")
}

fn spawn(name: &str, act: impl FnOnce() + Send + 'static) -> Result<JoinHandle<()>, zenoh::Error> {
    std::thread::Builder::new().name(name.to_owned()).spawn(act).map_err(zenoh::Error::from)
}

impl Host {
    /// How many callers there are.
    #[must_use]
    pub fn callers(&self) -> usize {
        let Callers { whole, looking } = self.shared.gate().callers();
        whole + looking
    }

    /// How many messages were refused.
    #[must_use]
    pub fn refused(&self) -> Refusals {
        self.shared.gate().refused
    }

    /// The peers of which messages were refused since the last call of this, and how many of each: holders of certificates, or callers where
    /// there are none, and all strangers together.
    #[must_use]
    pub fn take_refused(&self) -> Vec<(String, Refusals)> {
        self.shared.gate().take_refused()
    }

    /// Whether any process of the network may read and command the world ([`Serving::insecure_lan`]).
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.shared.is_open
    }

    /// How many bytes of states, events and departures were sent: those of whole states once, and those of rounded ones once, however many
    /// callers have them.
    #[must_use]
    pub fn sent(&self) -> u64 {
        self.shared.shown().sent
    }

    /// How often the state of an object was too long for a message ([`crate::MESSAGE_MAX`]) and was left out.
    #[must_use]
    pub fn too_long(&self) -> u64 {
        self.shared.shown().too_long
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        self.shared.ends.store(true, Relaxed);
        self.threads.drain(..).for_each(|thread| drop(thread.join()));
        drop(self.served.take());
        let _ = self.shared.session.close().wait();
    }
}

impl Shared {
    fn gate(&self) -> MutexGuard<'_, Gate> {
        self.gate.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn part_of(&self) -> MutexGuard<'_, Option<String>> {
        self.part_of.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn shown(&self) -> MutexGuard<'_, Shown> {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Shows callers what changes, until the host ends.
    fn publish_on(&self) {
        let mut next = Instant::now();
        while !self.ends.load(Relaxed) {
            if self.part_of().is_none() {
                self.publish();
            }
            next = (next + PERIOD).max(Instant::now());
            std::thread::sleep(next.saturating_duration_since(Instant::now()).min(PERIOD));
        }
    }

    /// Shows callers what has changed; returns the number of the newest message.
    fn publish(&self) -> u64 {
        let Callers { whole, looking } = self.gate().callers();
        let mut shown = self.shown();
        let was_followed = std::mem::replace(&mut shown.is_followed, whole + looking > 0);
        if !shown.is_followed {
            return shown.sequence - 1;
        }
        if !was_followed {
            // events from before there was a caller
            shown.events.take();
            shown.gathered.clear();
        }
        let Changes { moment, before } = shown.changes(&*self.world, self.run);
        let (mut messages, mut sent) = (Vec::new(), 0);
        let Shown { sequence, too_long, .. } = &mut *shown;
        *too_long += moment.encode_parts(sequence, 1, &mut messages);
        for Encoded { moment, bytes } in messages {
            // a caller that has missed one finds it by the numbers
            let rounded = (looking > 0).then(|| rounded::encode(&moment, &before).ok()).flatten();
            for (last, bytes) in [("seen", rounded), ("state", (whole > 0).then_some(bytes))] {
                let Some(bytes) = bytes else { continue };
                sent += bytes.len() as u64;
                // Ok says nothing
                let _ = self.session.put(format!("metachron/{}/{last}", self.name), bytes).wait();
            }
        }
        shown.sent += sent;
        shown.sequence - 1
    }

    /// Lets a call wait for its turn, or refuses it.
    fn take(&self, query: Query) {
        let caller = caller_of(query.key_expr().as_str());
        if !caller.split('/').all(is_name) {
            self.gate().refuse(&caller, Fault::Stranger);
            return;
        }
        let (is_welcome, peer) = {
            let mut gate = self.gate();
            (gate.admits(&caller, Instant::now()), gate.peer_of(&caller).to_owned())
        };
        if !is_welcome {
            return self.refuse_flood(&caller, &query);
        }
        let bytes = query.payload().map_or(0, ZBytes::len);
        for (caller, query) in self.waiting.push(&peer, (caller, query), bytes) {
            self.gate().refuse(&caller, Fault::Flooded);
            self.refuse_flood(&caller, &query);
        }
    }

    fn refuse_flood(&self, caller: &str, query: &Query) {
        let reason = format!(
            "a peer makes at most {CALLS_MAX} calls a second, of which at most {CALLS_WAITING} of all peers wait"
        );
        self.reply(caller, query, refused(Refusal::Other(reason)));
    }

    /// Answers calls, one after the other, until the host ends.
    fn answer_on(&self) {
        while !self.ends.load(Relaxed) {
            if let Some((caller, query)) = self.waiting.pop(PERIOD) {
                self.answer(&caller, &query);
            }
        }
    }

    fn answer(&self, caller: &str, query: &Query) {
        let bytes = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
        let answers = match decode::<Request>(&bytes) {
            Err(bad) => {
                self.gate().refuse(caller, Fault::Malformed);
                refused(Refusal::Other(bad.to_string()))
            }
            Ok(Request { run, sequence, call }) => match self.admit(caller, run, sequence, &call) {
                Err(reason) => refused(Refusal::Other(reason)),
                Ok(()) => {
                    // what a caller sends is made into objects before all of it is checked: a fault there is its caller's
                    let (is_part, passes) = (call.is_of_a_part(), call.lets_time_pass());
                    let done = catch_unwind(AssertUnwindSafe(|| self.act(call)));
                    if matches!(done, Ok(Ok(_))) && (is_part || passes) {
                        *self.part_of() = is_part.then(|| caller.to_owned());
                    }
                    let done = done.unwrap_or_else(|_| {
                        self.gate().refuse(caller, Fault::Malformed);
                        Err(Refusal::Other("the call could not be made: its values contradict each other".to_owned()))
                    });
                    done.unwrap_or_else(refused)
                }
            },
        };
        self.reply(caller, query, answers);
    }

    fn reply(&self, caller: &str, query: &Query, answers: Vec<Vec<u8>>) {
        let key = format!("metachron/{}/call/{caller}", self.name);
        for answer in answers {
            // a caller that has gone needs none
            let _ = query.reply(&key, answer).wait();
        }
    }

    fn admit(&self, caller: &str, run: u64, sequence: u64, call: &Call) -> Result<(), String> {
        let mut gate = self.gate();
        match call {
            Call::Hello { program, .. } if program != PROGRAM => {
                gate.refuse(caller, Fault::Stranger);
                let program: String = program.chars().take(32).collect();
                Err(format!("the world's host is metachron {PROGRAM}; the caller is {program}"))
            }
            Call::Hello { is_looking, .. } => gate.greet(caller, sequence, *is_looking),
            _ => {
                gate.pass(caller, sequence, run == self.run)?;
                let name = caller.split('/').next().unwrap_or_default();
                if call.needs() == Role::Viewer || self.roles.get(name) == Some(&Role::Operator) {
                    return Ok(());
                }
                gate.refuse(caller, Fault::Forbidden);
                Err(format!("\"{name}\" may read the world, and not command it: its host names operators"))
            }
        }
    }

    /// Does what a call says; returns its answers.
    fn act(&self, call: Call) -> Result<Vec<Vec<u8>>, Refusal> {
        let world = &*self.world;
        let reply = match call {
            Call::Hello { .. } => Reply::Hello(self.welcome()),
            Call::All => {
                self.publish();
                let (mut messages, mut shown) = (Vec::new(), self.shown());
                let (moment, mut sequence) = (shown.all(world, self.run), shown.sequence - 1);
                shown.too_long += moment.encode_parts(&mut sequence, 0, &mut messages);
                return Ok(messages.into_iter().map(|encoded| encoded.bytes).collect());
            }
            Call::Command(id, command) => done(0, world.command(world.object_of(id)?, command))?,
            Call::SetState(id, state) => {
                world.set_state(world.object_of(id)?, &state)?;
                Reply::Done(self.publish())
            }
            Call::Drive(drive) => done(0, world.drive(drive))?,
            Call::Advance(span) if span > SPAN_MAX => return Err(too_long_a_span(span)),
            Call::Advance(span) => {
                world.advance(span)?;
                Reply::Done(self.publish())
            }
            Call::Add(name, part) => {
                let added = world.add(&name, *part)?;
                Reply::Added(added.id(), self.publish())
            }
            Call::Remove(id) => done(0, world.remove(world.object_of(id)?))?,
            Call::Checkpoint => Reply::Checkpoint(world.checkpoint()?.to_bytes()),
            Call::Restore(bytes) => {
                let checkpoint = Checkpoint::from_bytes(&bytes).map_err(|bad| Refusal::Other(bad.to_string()))?;
                world.restore(&checkpoint)?;
                Reply::Done(self.publish())
            }
            Call::Hash => Reply::Hash(world.hash()?),
            Call::Part(id) => {
                let part = world.part(world.object_of(id)?)?;
                // a model that a program brought stays in its process
                Reply::Part(part.filter(|part| !matches!(part, Part::Custom(_))).map(Box::new))
            }
            Call::Scene => Reply::Scene(self.scene.clone()),
            Call::Begin(files) => {
                self.begin(*files)?;
                Reply::Done(0)
            }
            Call::Release(objects) => done(0, self.divided()?.release(&objects))?,
            Call::Pack(objects) => {
                let packed = self.divided()?.pack(&objects)?;
                Reply::Packed(packed.filter(|packed| packed.len() <= PACKED_MAX))
            }
            Call::Adopt(packed) => done(0, self.divided()?.adopt(&packed))?,
            Call::AdvanceWithin { span, .. } if span > SPAN_MAX => return Err(too_long_a_span(span)),
            Call::AdvanceWithin { span, boxes, shows } => {
                let advanced = self.divided()?.advance_within(span, &boxes, shows)?;
                if !shows {
                    // objects keep few of them
                    self.shown().gather_events();
                }
                Reply::Advanced(advanced, shows.then(|| self.publish()))
            }
        };
        let too_long = |bad: BadMessage| Refusal::Other(format!("{bad}: the answer is too long"));
        Ok(vec![encode(&reply).map_err(too_long)?])
    }

    fn divided(&self) -> Result<&dyn DividedCalls, Refusal> {
        self.world.divided().ok_or_else(|| Refusal::Other("this world is stepped by one process alone".to_owned()))
    }

    /// Takes a scene to step, where the host waits for one and nobody else is connected with it.
    fn begin(&self, files: SceneFiles) -> Result<(), Refusal> {
        let begin =
            self.begins.as_ref().ok_or_else(|| Refusal::Other("this host steps a scene of its own".to_owned()))?;
        if self.gate().callers().whole > 1 {
            return Err(Refusal::Other("this host works for another caller".to_owned()));
        }
        begin(files).map_err(Refusal::Other)
    }

    fn welcome(&self) -> Welcome {
        let scene = self.world.scene();
        let fixed = (0..).map_while(|number| self.world.name(Touched::Fixed(number)).ok()).collect();
        let (world, program) = (self.name.clone(), PROGRAM.to_owned());
        Welcome { run: self.run, world, program, scene: scene.name, scene_hash: scene.hash, fixed }
    }
}

fn too_long_a_span(span: SimSpan) -> Refusal {
    Refusal::Other(format!("a call lets {} s pass; expected at most 1 s", span.as_secs_f64()))
}

fn done(sequence: u64, outcome: Result<(), WorldError>) -> Result<Reply, Refusal> {
    outcome.map(|()| Reply::Done(sequence)).map_err(Refusal::from)
}

/// A refusal as the bytes of an answer.
fn refused(refusal: Refusal) -> Vec<Vec<u8>> {
    encode(&Reply::Refused(refusal)).into_iter().collect()
}
