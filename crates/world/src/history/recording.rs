//! A recording: everything that was done to a world from outside, in the order in which it was done, so that the same can be done again.
//!
//! In: the calls that change a world, the answers of its governors; of one in real time the parts of its turns. Out: a file, and all that read
//! from one.
//! Never here: how they are made again ([`super::replay`]), the state of an object.
//!
//! A file: [`MAGIC`], the version of the format, then chunks, each with its length, twice, and its checksum, so that a file that was cut short is
//! read to its last whole chunk, and a damaged one is known from it. The first chunk says whose calls follow. All numbers outside of chunks are
//! little-endian.

use super::checkpoint::{CheckpointError, SceneIdentity, checksum};
use crate::description::builder::Part;
use metachron_core::{AgentId, Archive, ArchiveError, Body, SimTime, archive_values};
use metachron_runtime::{Command, Demand, PartKind, Timeline, TimelineCommand, TurnPart};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The first bytes of every file.
const MAGIC: [u8; 8] = *b"METACREC";
/// The version of the format: it changes with the meaning of the bytes.
const FORMAT: u32 = 9;
/// Bytes of a chunk before its contents: length, its complement and checksum.
const CHUNK_HEAD: usize = 4 + 4 + 8;
/// So many entries are written at once: a process that is killed loses the newest ones, about a second of a frame loop.
const CHUNK_ENTRIES: usize = 128;
/// As many parts of turns leave the process at once, and none is kept from it longer than this, of the run's time.
const CHUNK_PARTS: usize = 1000;
const WRITE_INTERVAL: Duration = Duration::from_millis(200);
/// How often a recording in real time notes the hash of all states, so that a replay that goes another way says so
/// early.
const CHECK_INTERVAL: Duration = Duration::from_secs(1);
/// The version of the program, which repeats its own recordings alone, to the bit.
const PROGRAM: &str = env!("CARGO_PKG_VERSION");

/// The scene that a recording is of, as it was given.
#[derive(Debug, Clone, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub struct SceneText {
    /// The name of a built-in scene, or the path of a file.
    pub name: String,
    /// The text of the scene.
    pub text: String,
    /// The folder of the files next to it; `None` of a scene that has none but built-in ones.
    pub folder: Option<String>,
    /// Keys that were changed, and their values, in rising precedence.
    pub overrides: Vec<(String, String)>,
}

/// The beginning of a file.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
struct Head {
    of: SceneIdentity,
    scene: Option<SceneText>,
    /// Whether it is of a world on threads or in a pool, whose turns are in it.
    real_time: bool,
}

/// Something that was done to a world from outside.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) enum Entry {
    /// Time passed up to this wall time.
    Wait(Duration),
    /// Work of this length occupied a core.
    Spend(Duration),
    Drive(TimelineCommand),
    /// In real time: the state in which it began, as the bytes of a checkpoint's file.
    Begin(Vec<u8>),
    /// The governor of an agent asked for this before its first turn.
    Start(AgentId, Demand),
    /// In real time: from now on time passes by this timeline.
    Timeline(Timeline),
    /// In real time: the next object that joins begins at this moment.
    Present(SimTime),
    /// In real time: parts of turns, in the order in which they were made.
    Turns(PackedTurns),
    /// In real time: all states have this hash now.
    Check(u64),
    Command(AgentId, Command),
    SetState(AgentId, Box<Body>),
    Add(String, Box<Part>),
    Remove(AgentId),
    /// It was put into the state of this checkpoint, as the bytes of its file.
    Restore(Vec<u8>),
    /// The governor of an agent asked for this after a turn; for so many turns before that it asked for nothing.
    Demand(AgentId, u32, Demand),
    /// The recording ended, with this hash of all states.
    End(u64),
}

/// Parts of turns, each with its time since the one before.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct PackedTurns {
    from: Duration,
    parts: Vec<PackedPart>,
}

#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct PackedPart {
    kind: PartKind,
    agent: AgentId,
    /// Readings of two clocks of a pool may be in another order than the parts that were made with them.
    after_ns: i64,
    factors_max: Option<u32>,
}

impl PackedTurns {
    fn pack(parts: &[TurnPart]) -> Self {
        let from = parts.first().map_or(Duration::ZERO, |part| part.wall);
        let mut before = from;
        let pack = |TurnPart { kind, agent, wall, factors_max }: &TurnPart| {
            let after_ns = nanos(*wall) - nanos(before);
            before = *wall;
            PackedPart { kind: *kind, agent: *agent, after_ns, factors_max: *factors_max }
        };
        Self { from, parts: parts.iter().map(pack).collect() }
    }

    /// The parts, in their order.
    pub fn parts(&self) -> impl Iterator<Item = TurnPart> + '_ {
        let mut wall_ns = nanos(self.from);
        self.parts.iter().map(move |PackedPart { kind, agent, after_ns, factors_max }| {
            wall_ns = wall_ns.saturating_add(*after_ns);
            let wall = Duration::from_nanos(wall_ns.max(0) as u64);
            TurnPart { kind: *kind, agent: *agent, wall, factors_max: *factors_max }
        })
    }
}

fn nanos(wall: Duration) -> i64 {
    i64::try_from(wall.as_nanos()).unwrap_or(i64::MAX)
}

/// Why a world is not recorded, or a recording could not be kept.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The world was stopped, or is a replay.
    #[error("a world that was stopped, or is a replay, cannot be recorded")]
    Stopped,
    /// The world is being recorded.
    #[error("the world is being recorded already: end that recording first")]
    Recorded,
    /// The recording begins with the state of a world that has already run, which cannot be saved.
    #[error("a recording that does not begin at the start begins with a checkpoint: {0}")]
    Begun(CheckpointError),
    /// A file could not be read or written.
    #[error("{}: {error}", path.display())]
    File {
        /// Its path.
        path: PathBuf,
        /// The system's error.
        error: std::io::Error,
    },
    /// An object's step in lockstep has kept the thread that lets time pass for too long. The recording goes on.
    #[error("the recording cannot end in a step: that of \"{name}\" has lasted for {:.1} s", lasts.as_secs_f64())]
    Stalled {
        /// The object.
        name: String,
        /// For how long, wall time.
        lasts: Duration,
    },
    /// The writer took no more: the recording is complete up to there.
    #[error("the recording could not be written on: {0}")]
    Write(std::io::Error),
    /// A file is no recording that this program repeats.
    #[error("{}: {reason}", path.display())]
    BadFile {
        /// Its path.
        path: PathBuf,
        /// The fault of its bytes.
        reason: BadRecording,
    },
}

/// A fault of the bytes of a recording.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BadRecording {
    /// Not the first bytes of one.
    #[error("this is no recording of metachron")]
    NoRecording,
    /// Of another version of the format.
    #[error("its format is {found}; this program reads format {FORMAT}")]
    OtherFormat {
        /// The version of the format.
        found: u32,
    },
    /// Written by another version of the program, whose steps have other bits.
    #[error("it was recorded by metachron {found}; this is {PROGRAM}")]
    OtherProgram {
        /// The version that has written it.
        found: String,
    },
    /// The chunk that says which scene it is of has other bytes than were written.
    #[error("it is damaged: what it says of its scene does not have its checksum")]
    Damaged,
    /// It ends within its first chunk.
    #[error("it ends before it says which scene it is of")]
    NoHead,
    /// Bytes that are whole but mean nothing.
    #[error("chunk {chunk}: {reason}")]
    Malformed {
        /// The chunk, counted from zero.
        chunk: usize,
        /// Its fault.
        reason: ArchiveError,
    },
}

/// The calls that changed a world, read from a file ([`crate::World::replay`] repeats them).
#[derive(Debug, Clone)]
pub struct Recording {
    head: Head,
    pub(super) entries: Vec<Entry>,
    lost_bytes: usize,
    is_damaged: bool,
}

impl Recording {
    /// Reads the recording that a file holds, up to its last whole chunk.
    ///
    /// # Errors
    /// [`RecordError::File`]; [`RecordError::BadFile`] for any file that a recording of this version has not begun.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, RecordError> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|error| RecordError::File { path: path.to_owned(), error })?;
        Self::from_bytes(&bytes).map_err(|reason| RecordError::BadFile { path: path.to_owned(), reason })
    }

    /// The recording in these bytes, up to its last whole chunk.
    ///
    /// # Errors
    /// [`BadRecording`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, BadRecording> {
        let Some(rest) = bytes.strip_prefix(&MAGIC) else { return Err(BadRecording::NoRecording) };
        let Some((format, mut rest)) = rest.split_first_chunk::<4>() else { return Err(BadRecording::NoHead) };
        let found = u32::from_le_bytes(*format);
        if found != FORMAT {
            return Err(BadRecording::OtherFormat { found });
        }
        let malformed = |chunk: usize| move |reason: ArchiveError| BadRecording::Malformed { chunk, reason };
        let first = match take_chunk(&mut rest) {
            Chunk::Whole(first) => first,
            Chunk::Cut => return Err(BadRecording::NoHead),
            Chunk::Damaged => return Err(BadRecording::Damaged),
        };
        let (mut found, mut head) = (String::new(), Head::default());
        let mut archive = Archive::reader(first);
        archive.value(&mut found).map_err(malformed(0))?;
        if found != PROGRAM {
            return Err(BadRecording::OtherProgram { found });
        }
        archive.value(&mut head).and_then(|()| archive.finish()).map_err(malformed(0))?;
        let mut entries = Vec::new();
        let mut chunk = 1;
        let is_damaged = loop {
            let bytes = match take_chunk(&mut rest) {
                Chunk::Whole(bytes) => bytes,
                Chunk::Cut => break false,
                Chunk::Damaged => break true,
            };
            let mut some: Vec<Entry> = Vec::new();
            let mut archive = Archive::reader(bytes);
            archive.value(&mut some).and_then(|()| archive.finish()).map_err(malformed(chunk))?;
            entries.append(&mut some);
            chunk += 1;
        };
        Ok(Self { head, entries, lost_bytes: rest.len(), is_damaged })
    }

    /// The scene as it was given; `None` of a scene that a program has built.
    #[must_use]
    pub const fn scene(&self) -> Option<&SceneText> {
        self.head.scene.as_ref()
    }

    /// Whether it was ended: the process that wrote it was not killed.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.lost_bytes == 0 && matches!(self.entries.last(), Some(Entry::End(_)))
    }

    /// Whether the bytes after its last whole chunk are other ones than were written, and not just a missing end.
    #[must_use]
    pub const fn is_damaged(&self) -> bool {
        self.is_damaged
    }

    /// Bytes behind its last whole chunk, which mean nothing.
    #[must_use]
    pub const fn lost_bytes(&self) -> usize {
        self.lost_bytes
    }

    /// The state hash at its end; `None` of one that was cut short.
    #[must_use]
    pub fn hash(&self) -> Option<u64> {
        match self.entries.last() {
            Some(Entry::End(hash)) => Some(*hash),
            _ => None,
        }
    }

    /// Whether it is of a world on threads or in a pool, whose turns are in it.
    #[must_use]
    pub const fn is_real_time(&self) -> bool {
        self.head.real_time
    }

    /// The agents whose governors have asked for something.
    pub(super) fn governed(&self) -> BTreeSet<AgentId> {
        let asked = |entry: &Entry| match entry {
            Entry::Demand(agent, ..) | Entry::Start(agent, _) => Some(*agent),
            _ => None,
        };
        self.entries.iter().filter_map(asked).collect()
    }

    pub(crate) const fn identity(&self) -> &SceneIdentity {
        &self.head.of
    }
}

/// The kind of the next bytes of a file.
enum Chunk<'a> {
    /// The contents of a chunk.
    Whole(&'a [u8]),
    /// Nothing, or the first bytes of a chunk.
    Cut,
    /// Other bytes than were written.
    Damaged,
}

/// Takes the next chunk if that is whole.
fn take_chunk<'a>(rest: &mut &'a [u8]) -> Chunk<'a> {
    let Some((head, bytes)) = rest.split_first_chunk::<CHUNK_HEAD>() else { return Chunk::Cut };
    let number = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| head[at + k]));
    let (length, complement) = (number(0), number(4));
    let sum = u64::from_le_bytes(std::array::from_fn(|k| head[8 + k]));
    if complement != !length {
        return Chunk::Damaged;
    }
    let Some((contents, after)) = bytes.split_at_checked(length as usize) else { return Chunk::Cut };
    if checksum(contents) != sum {
        return Chunk::Damaged;
    }
    *rest = after;
    Chunk::Whole(contents)
}

/// Writes a recording.
pub(crate) struct Recorder {
    out: Box<dyn Write + Send>,
    /// Entries that are not written yet.
    entries: Vec<Entry>,
    /// For each agent, how often its governor asked for nothing since it last asked for something.
    silent_turns: BTreeMap<AgentId, u32>,
    /// Up to when turns are written, and when states were last hashed.
    written: Duration,
    hashed: Duration,
    /// The state that all are being put into: it is written down where they were.
    restoring: Option<Vec<u8>>,
    /// Why no more is written.
    failed: Option<std::io::Error>,
}

impl Recorder {
    /// Begins a recording of the world that is known by `of`.
    ///
    /// # Errors
    /// The errors of `out`.
    pub fn begin(
        mut out: Box<dyn Write + Send>,
        of: SceneIdentity,
        scene: Option<SceneText>,
        real_time: bool,
    ) -> Result<Self, RecordError> {
        let (mut program, mut head) = (PROGRAM.to_owned(), Head { of, scene, real_time });
        let begun = out.write_all(&MAGIC).and_then(|()| out.write_all(&FORMAT.to_le_bytes()));
        let begun = begun.and_then(|()| write_chunk(&mut *out, |archive| archive_values!(archive, program, head)));
        begun.map_err(RecordError::Write)?;
        let (entries, silent_turns) = (Vec::new(), BTreeMap::new());
        let (written, hashed) = (Duration::ZERO, Duration::ZERO);
        Ok(Self { out, entries, silent_turns, written, hashed, restoring: None, failed: None })
    }

    /// Writes down a call that is about to be made. The entries before it are complete, and leave the process if they
    /// are many.
    pub fn note(&mut self, entry: Entry) {
        if self.entries.len() >= CHUNK_ENTRIES {
            self.flush();
        }
        self.entries.push(entry);
    }

    /// Writes down the parts of turns that were made, and now and then the `hash` of the states then.
    pub fn note_turns(&mut self, parts: &[TurnPart], hash: impl FnOnce() -> u64) {
        let Some(newest) = parts.last().map(|part| part.wall) else { return };
        let restored =
            self.restoring.as_ref().and_then(|_| parts.iter().position(|part| part.kind == PartKind::Restore));
        let (before, parts_since) = parts.split_at(restored.unwrap_or(0));
        if !before.is_empty() {
            self.entries.push(Entry::Turns(PackedTurns::pack(before)));
        }
        if restored.is_some() {
            self.note_restored();
        }
        self.entries.push(Entry::Turns(PackedTurns::pack(parts_since)));
        if newest > self.hashed + CHECK_INTERVAL {
            self.hashed = newest;
            self.entries.push(Entry::Check(hash()));
        }
        if newest > self.written + WRITE_INTERVAL || parts.len() >= CHUNK_PARTS {
            self.written = newest;
            self.flush();
        }
    }

    /// All are about to be put into the state of a checkpoint, whose bytes these are; `None`: they were not.
    pub fn set_restoring(&mut self, checkpoint: Option<Vec<u8>>) {
        self.restoring = checkpoint;
    }

    /// Writes down that they were.
    pub fn note_restored(&mut self) {
        let restored = self.restoring.take();
        self.entries.extend(restored.map(Entry::Restore));
    }

    /// Writes down how the governor of `agent` has answered.
    pub fn note_demand(&mut self, agent: AgentId, demand: Demand) {
        let silent_turns = self.silent_turns.entry(agent).or_default();
        if demand == Demand::default() {
            *silent_turns += 1;
        } else {
            let before = std::mem::take(silent_turns);
            self.entries.push(Entry::Demand(agent, before, demand));
        }
    }

    /// Whether something could not be written, so that nothing is written any more.
    pub const fn has_failed(&self) -> bool {
        self.failed.is_some()
    }

    /// Ends it.
    ///
    /// # Errors
    /// [`RecordError::Write`] if not all of it could be written.
    pub fn end(mut self, hash: u64) -> Result<(), RecordError> {
        self.entries.push(Entry::End(hash));
        self.flush();
        self.failed.take().map_or(Ok(()), |error| Err(RecordError::Write(error)))
    }

    fn flush(&mut self) {
        if self.failed.is_none() {
            let mut entries = std::mem::take(&mut self.entries);
            let written = write_chunk(&mut *self.out, |archive| archive.value(&mut entries));
            self.failed = written.and_then(|()| self.out.flush()).err();
        }
        self.entries.clear();
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if !self.entries.is_empty() {
            self.flush();
        }
    }
}

fn write_chunk(
    out: &mut dyn Write,
    contents: impl FnOnce(&mut Archive<'_>) -> Result<(), ArchiveError>,
) -> std::io::Result<()> {
    let mut archive = Archive::writer();
    contents(&mut archive).map_err(std::io::Error::other)?;
    let bytes = archive.into_bytes();
    let length = u32::try_from(bytes.len()).map_err(std::io::Error::other)?;
    // in one piece, so that a process that is killed leaves whole chunks
    let mut chunk = Vec::with_capacity(CHUNK_HEAD + bytes.len());
    chunk.extend_from_slice(&length.to_le_bytes());
    chunk.extend_from_slice(&(!length).to_le_bytes());
    chunk.extend_from_slice(&checksum(&bytes).to_le_bytes());
    chunk.extend_from_slice(&bytes);
    out.write_all(&chunk)
}

/// The entry of a part that joins; `None` of one that cannot be written down.
pub(crate) fn added(name: &str, part: &Part) -> Option<Entry> {
    let is_own = matches!(part, Part::Custom(_));
    (!is_own).then(|| Entry::Add(name.to_owned(), Box::new(part.clone())))
}
