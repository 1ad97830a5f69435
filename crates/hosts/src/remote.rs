//! A world that runs elsewhere, called as if it ran here.
//!
//! In: an endpoint. Out: [`RemoteWorld`]. Never here: what was seen of it ([`crate::mirror`]), the bytes of messages.

use crate::check;
use crate::endpoint::{LEASE, Place, Side, is_open_to_all, open};
use crate::error::HostsError;
use crate::host::PERIOD;
use crate::identity::{Identity, is_name};
use crate::link::{Link, hello, unexpected};
use crate::mirror::{Mirror, RemoteFrame};
use crate::rounded::Sketches;
use crate::serving::{ANYONE, SceneFiles};
use crate::wire::{Call, PROGRAM, Reply, Request, Welcome, decode, encode};
use metachron_core::{AgentId, Body, SimSpan, SimTime, Snapshot};
use metachron_runtime::{Command, Reach, TimelineCommand};
use metachron_world::{
    Checkpoint, CheckpointError, DividedCalls, EventFilter, EventReader, Object, Part, PartAdvanced, SceneMark,
    StateLink, Touched, WorldCalls, WorldError,
};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

/// Whether a host is there at all is asked for so long, so often.
const GREETING: (u32, Duration) = (20, Duration::from_millis(50));
/// So many messages wait to be read; of more the newest are lost, and all states are asked for.
const WAITING: usize = 64;
/// Time passes elsewhere in calls of this length.
const PIECE: SimSpan = SimSpan::from_millis(20);

/// A world that runs elsewhere. Clones are the same connection, which ends with the last.
///
/// Reading ([`WorldCalls::latest`], [`WorldCalls::all_objects`], [`RemoteWorld::frame`]) shows the newest states that came, and never waits; what
/// changes the world waits for its host's answer. While the host is silent, states stay as they were last seen, and calls
/// are [`WorldError::Silent`]; where it lives again, they go on.
#[derive(Clone)]
pub struct RemoteWorld {
    connection: Arc<Connection>,
}

/// A link with the thread that reads from it.
struct Connection {
    link: Arc<Link>,
    reader: Option<JoinHandle<()>>,
    _subscribers: [Subscriber<()>; 2],
    _token: LivelinessToken,
}

impl std::fmt::Debug for RemoteWorld {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RemoteWorld").field("world", &self.calls().mirror.world).finish_non_exhaustive()
    }
}

/// How a world elsewhere is called.
#[derive(Debug, Clone)]
pub struct Calling {
    endpoint: String,
    scene: Option<SceneMark>,
    identity: Option<Identity>,
    insecure_lan: bool,
    is_looking: bool,
}

impl Calling {
    /// At `endpoint`: `tcp/127.0.0.1:7447` of this machine, or `tls/bench:7447` with an identity.
    #[must_use]
    pub fn at(endpoint: impl Into<String>) -> Self {
        Self { endpoint: endpoint.into(), scene: None, identity: None, insecure_lan: false, is_looking: false }
    }

    /// A world of another scene is refused.
    #[must_use]
    pub fn scene(mut self, mark: SceneMark) -> Self {
        self.scene = Some(mark);
        self
    }

    /// As the holder of a certificate. The host's must be of the same authority and name the address of the endpoint.
    #[must_use]
    pub fn identity(mut self, identity: Identity) -> Self {
        self.identity = Some(identity);
        self
    }

    /// To look at: states are rounded, places to 8 µm, and take a fraction of the bytes.
    #[must_use]
    pub const fn looking(mut self) -> Self {
        self.is_looking = true;
        self
    }

    /// Lets a `tcp/` endpoint be beyond this machine: any process of the network may read what is said, or say something else.
    #[must_use]
    pub const fn insecure_lan(mut self) -> Self {
        self.insecure_lan = true;
        self
    }
}

impl From<&str> for Calling {
    fn from(endpoint: &str) -> Self {
        Self::at(endpoint)
    }
}

impl From<&String> for Calling {
    fn from(endpoint: &String) -> Self {
        Self::at(endpoint)
    }
}

/// Connects with the world that is served at an endpoint.
///
/// # Errors
/// [`HostsError`]: nothing is connected then.
pub fn connect(calling: impl Into<Calling>) -> Result<RemoteWorld, HostsError> {
    let Calling { endpoint, scene, identity, insecure_lan, is_looking } = calling.into();
    let place = Place { endpoint: &endpoint, identity: identity.as_ref(), insecure_lan };
    let session = open(place, Side::Caller)?;
    let failed = |error: zenoh::Error| HostsError::network(&endpoint, &error);
    let caller = format!("{}/{}", identity.as_ref().map_or(ANYONE, Identity::name), session.zid());
    // the host gives a place to a caller that lives; declarations overtake calls
    let token = session.liveliness().declare_token(format!("metachron/caller/{caller}")).wait().map_err(failed)?;
    let welcome =
        greet(&session, &caller, is_looking).ok_or_else(|| HostsError::NoWorld { endpoint: endpoint.clone() })??;
    check_welcome(&welcome, scene.as_ref())?;
    let mirror = Arc::new(Mirror::new(welcome));
    let of_world = |last: &str| format!("metachron/{}/{last}", mirror.world);
    let (to_reader, messages) = sync_channel(WAITING);
    let states = session.declare_subscriber(of_world(if is_looking { "seen" } else { "state" }));
    let states = states.callback(move |sample| drop(to_reader.try_send(sample.payload().to_bytes().into_owned())));
    let states = states.wait().map_err(failed)?;
    let watched = Arc::clone(&mirror);
    // of this run: a world that takes its place has not heard its calls
    let host = session.liveliness().declare_subscriber(of_world(&format!("host/{}", mirror.run))).history(true);
    let host =
        host.callback(move |sample| watched.set_alive(sample.kind() == SampleKind::Put)).wait().map_err(failed)?;
    if !mirror.lives_within(LEASE) {
        return Err(HostsError::NoWorld { endpoint });
    }
    // greetings had the first numbers
    let (sequence, ends) = (Mutex::new(u64::from(GREETING.0)), AtomicBool::new(false));
    let is_open = is_open_to_all(&endpoint);
    let sketches = Mutex::new(is_looking.then(Sketches::default));
    let posted = Arc::default();
    let link = Arc::new(Link { session, mirror, caller, is_open, sketches, sequence, posted, ends });
    link.refresh()?;
    let reading = Arc::clone(&link);
    let reader = std::thread::Builder::new().name("hosts-states".to_owned()).spawn(move || reading.read(&messages));
    let reader = Some(reader.map_err(|error| failed(error.into()))?);
    Ok(RemoteWorld { connection: Arc::new(Connection { link, reader, _subscribers: [states, host], _token: token }) })
}

/// Introduces a caller; `None` where no host answers. Each greeting has a number of its own: the answer to one before may be lost.
fn greet(session: &Session, caller: &str, is_looking: bool) -> Option<Result<Welcome, HostsError>> {
    let (often, pause) = GREETING;
    for sequence in 1..=u64::from(often) {
        let hello = encode(&Request { run: 0, sequence, call: hello(is_looking) }).ok()?;
        let asked = session.get(format!("metachron/*/call/{caller}")).payload(hello).timeout(LEASE);
        let answers = asked.wait().ok()?;
        let answer =
            answers.recv().ok().and_then(|reply| reply.result().ok().map(|it| it.payload().to_bytes().into_owned()));
        match answer.map(|bytes| decode(&bytes)) {
            Some(Ok(Reply::Hello(welcome))) => return Some(Ok(welcome)),
            Some(Ok(Reply::Refused(refusal))) => return Some(Err(WorldError::from(refusal).into())),
            Some(Ok(_)) => return Some(Err(unexpected().into())),
            Some(Err(bad)) => return Some(Err(WorldError::Elsewhere(bad.to_string()).into())),
            None => std::thread::sleep(pause),
        }
    }
    None
}

/// Checks that a world is one that this program reads, and of the expected scene.
fn check_welcome(welcome: &Welcome, expected: Option<&SceneMark>) -> Result<(), HostsError> {
    if welcome.program != PROGRAM {
        return Err(HostsError::OtherProgram { found: welcome.program.clone(), expected: PROGRAM.to_owned() });
    }
    if !is_name(&welcome.world) {
        return Err(HostsError::BadName { name: welcome.world.clone() });
    }
    match expected.filter(|expected| expected.hash != welcome.scene_hash) {
        None => Ok(()),
        Some(SceneMark { name, hash }) => Err(HostsError::OtherScene {
            found: welcome.scene.clone(),
            found_hash: welcome.scene_hash,
            expected: name.clone(),
            expected_hash: *hash,
        }),
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.link.ends.store(true, Relaxed);
        self.reader.take().into_iter().for_each(|reader| drop(reader.join()));
        let _ = self.link.session.close().wait();
    }
}

impl RemoteWorld {
    fn calls(&self) -> &Link {
        &self.connection.link
    }

    /// All objects as they were last seen, and the time then.
    #[must_use]
    pub fn frame(&self) -> RemoteFrame {
        self.calls().mirror.frame()
    }

    /// The first frame that is later than `since`, once it comes.
    ///
    /// # Errors
    /// [`WorldError::Silent`] if none comes within `patience`, or the host is silent.
    pub fn next_frame(&self, since: SimTime, patience: Duration) -> Result<RemoteFrame, WorldError> {
        self.calls().mirror.next_frame(since, patience)
    }

    /// The scene of the world, for a program that draws it; `None` where its host does not say it.
    ///
    /// # Errors
    /// [`WorldError::Silent`] and [`WorldError::Elsewhere`].
    pub fn scene_files(&self) -> Result<Option<SceneFiles>, WorldError> {
        if let Reply::Scene(scene) = self.calls().ask(Call::Scene)? {
            Ok(scene.map(|scene| *scene))
        } else {
            Err(unexpected())
        }
    }

    /// Gives a scene to a host that waits for work ([`crate::Serving::begins`]): it ends this world and serves one of the scene in its place, which
    /// is connected with anew.
    ///
    /// # Errors
    /// [`WorldError::Silent`] and [`WorldError::Elsewhere`].
    pub fn begin(&self, scene: SceneFiles) -> Result<(), WorldError> {
        self.calls().act(Call::Begin(Box::new(scene)))
    }

    /// The run of its host: each world that is served has a number that no other had.
    #[must_use]
    pub fn run(&self) -> u64 {
        self.calls().mirror.run
    }

    /// How long ago the newest message came.
    #[must_use]
    pub fn age(&self) -> Duration {
        self.calls().mirror.age()
    }

    /// Whether its host is silent: it has ended, or sent nothing for a second.
    #[must_use]
    pub fn is_silent(&self) -> bool {
        self.calls().mirror.silence().is_some()
    }

    /// Whether any process of the network may read what is said ([`Calling::insecure_lan`]).
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.calls().is_open
    }

    /// How many calls that were posted had no answer within a second.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.calls().posted().lost
    }

    /// How many messages of the host were refused, because their bytes or numbers cannot be.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.calls().mirror.refused()
    }
}

impl WorldCalls for RemoteWorld {
    fn scene(&self) -> SceneMark {
        self.calls().mirror.scene.clone()
    }

    fn all_objects(&self) -> Vec<Object> {
        self.calls().mirror.all_objects()
    }

    fn object(&self, name: &str) -> Result<Object, WorldError> {
        self.calls().mirror.object(name)
    }

    fn object_of(&self, id: AgentId) -> Result<Object, WorldError> {
        self.calls().mirror.object_of(id)
    }

    fn name(&self, of: Touched) -> Result<Arc<str>, WorldError> {
        self.calls().mirror.name(of)
    }

    fn latest(&self, object: Object) -> Result<Arc<Snapshot>, WorldError> {
        self.calls().mirror.latest(object)
    }

    fn part(&self, object: Object) -> Result<Option<Part>, WorldError> {
        let asked = Call::Part(self.calls().own(object)?);
        if let Reply::Part(part) = self.calls().ask(asked)? { Ok(part.map(|part| *part)) } else { Err(unexpected()) }
    }

    fn time(&self) -> SimTime {
        self.calls().mirror.time()
    }

    fn hash(&self) -> Result<u64, WorldError> {
        if let Reply::Hash(hash) = self.calls().ask(Call::Hash)? { Ok(hash) } else { Err(unexpected()) }
    }

    fn drive(&self, drive: TimelineCommand) -> Result<(), WorldError> {
        self.calls().act(Call::Drive(drive))
    }

    fn advance(&self, span: SimSpan) -> Result<(), WorldError> {
        let mut left = span;
        while left > SimSpan::ZERO {
            let piece = left.min(PIECE);
            self.calls().act(Call::Advance(piece))?;
            left = SimSpan::from_nanos(left.as_nanos() - piece.as_nanos());
        }
        Ok(())
    }

    fn command(&self, object: Object, command: Command) -> Result<(), WorldError> {
        self.calls().act(Call::Command(self.calls().own(object)?, command))
    }

    fn post(&self, object: Object, command: Command) -> Result<(), WorldError> {
        self.calls().post(Call::Command(self.calls().own(object)?, command))
    }

    fn link(&self) -> Option<StateLink> {
        Some(StateLink { age: self.age(), period: PERIOD, round_trip: self.calls().posted().round_trip })
    }

    fn set_state(&self, object: Object, state: &Body) -> Result<(), WorldError> {
        self.calls().act(Call::SetState(self.calls().own(object)?, Box::new(state.clone())))
    }

    fn add(&self, name: &str, part: Part) -> Result<Object, WorldError> {
        match self.calls().ask(Call::Add(name.to_owned(), Box::new(part)))? {
            Reply::Added(id, sequence) => {
                self.calls().see(sequence)?;
                Ok(self.calls().mirror.tag.object(id))
            }
            _ => Err(unexpected()),
        }
    }

    fn remove(&self, object: Object) -> Result<(), WorldError> {
        self.calls().act(Call::Remove(self.calls().own(object)?))
    }

    fn checkpoint(&self) -> Result<Checkpoint, CheckpointError> {
        let Reply::Checkpoint(bytes) = self.calls().ask(Call::Checkpoint).map_err(of_checkpoint)? else {
            return Err(unexpected().into());
        };
        Checkpoint::from_bytes(&bytes).map_err(|bad| WorldError::Elsewhere(bad.to_string()).into())
    }

    fn restore(&self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.calls().act(Call::Restore(checkpoint.to_bytes())).map_err(of_checkpoint)
    }

    fn answers(&self) -> Result<(), WorldError> {
        self.calls().mirror.silence().map_or(Ok(()), Err)
    }

    fn listen(&self, filter: EventFilter) -> Box<dyn EventReader> {
        self.calls().mirror.listen(filter)
    }

    fn divided(&self) -> Option<&dyn DividedCalls> {
        Some(self)
    }
}

impl DividedCalls for RemoteWorld {
    fn release(&self, objects: &[AgentId]) -> Result<(), WorldError> {
        self.calls().act(Call::Release(objects.to_vec()))
    }

    fn pack(&self, objects: &[AgentId]) -> Result<Option<Vec<u8>>, WorldError> {
        if let Reply::Packed(packed) = self.calls().ask(Call::Pack(objects.to_vec()))? {
            Ok(packed)
        } else {
            Err(unexpected())
        }
    }

    fn adopt(&self, packed: &[u8]) -> Result<(), WorldError> {
        self.calls().act(Call::Adopt(packed.to_vec()))
    }

    fn advance_within(&self, span: SimSpan, boxes: &[Reach], shows: bool) -> Result<PartAdvanced, WorldError> {
        let call = Call::AdvanceWithin { span, boxes: boxes.to_vec(), shows };
        let Reply::Advanced(advanced, sequence) = self.calls().ask(call)? else { return Err(unexpected()) };
        check::reaches(&advanced.reaches).map_err(WorldError::Elsewhere)?;
        sequence.map_or(Ok(()), |sequence| self.calls().see(sequence))?;
        Ok(advanced)
    }
}

/// The error of a world as one of its checkpoints.
fn of_checkpoint(error: WorldError) -> CheckpointError {
    match error {
        WorldError::Stopped => CheckpointError::Stopped,
        other => other.into(),
    }
}
