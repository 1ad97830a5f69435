//! A world's state at one moment, kept in memory or in a file, to go on from it: in the same world or in another process.
//!
//! In: a world between turns. Out: bytes by which it, or a world started from the same scene, goes on as this one would
//! have, to the bit. Never here: what the state of an object is (`archive` of each says it), the scene.
//!
//! A file: [`MAGIC`], the version of the format, the length and the checksum of the rest, then the program's version,
//! the scene's identity, the time, the state. All numbers of its head are little-endian.

use super::output_file::OutputFile;
use crate::start::joined::{JoinedParts, archive_parts};
use crate::{Scene, WorldError};
use metachron_core::{Archive, ArchiveError, HASH_START, SimTime};
use metachron_runtime::{AgentHandle, AgentState, Run};
use std::path::{Path, PathBuf};

/// The first bytes of every file.
const MAGIC: [u8; 8] = *b"METACHRN";
/// The version of the format: it changes with the meaning of the bytes.
const FORMAT: u32 = 14;
/// Bytes before the checksummed ones.
const HEAD: usize = MAGIC.len() + 4 + 8 + 8;
/// The version of the program, which reads its own checkpoints alone: states are saved field by field as this version
/// has them.
const PROGRAM: &str = env!("CARGO_PKG_VERSION");

/// A world's state at one moment ([`crate::World::checkpoint`]).
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    pub(crate) of: SceneIdentity,
    pub(crate) time: SimTime,
    pub(super) times: Vec<SimTime>,
    /// The parts of the objects that joined after the start and are still there.
    pub(crate) joined: JoinedParts,
    pub(crate) state: Vec<u8>,
}

/// The scene of a world, as one that runs elsewhere is compared with one that is here.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneMark {
    /// Its name.
    pub name: String,
    /// Hash of its objects (names, models, rates) and of the numbers of its fixed solids, joints and couplings: the
    /// same by which a checkpoint is known. Masses, stiffnesses and sizes are not in it.
    pub hash: u64,
}

/// The identity of a scene: its objects, and how many of everything else there are. Values (masses, stiffnesses,
/// changes by `--set`) are not compared: a state may go on under other ones.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct SceneIdentity {
    name: String,
    objects: Vec<ObjectIdentity>,
    fixed: usize,
    joints: usize,
    couplings: usize,
}

/// The identity of an object.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
struct ObjectIdentity {
    name: String,
    model: String,
    rate_hz: f64,
}

/// Why a world's state could not be saved, read or put back.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// Something in the world does not save its state. The world goes on as it was.
    #[error("the world's state cannot be saved: {0}")]
    Refused(ArchiveError),
    /// The world was stopped: it has no state that goes on.
    #[error("the world was stopped, and cannot be saved or put back")]
    Stopped,
    /// The checkpoint, or the recording, is of another scene. The world goes on as it was.
    #[error("what was saved is of another scene: {what} is {found}; expected {expected}")]
    OtherScene {
        /// The property that differs.
        what: String,
        /// As the checkpoint has it.
        found: String,
        /// As the world has it.
        expected: String,
    },
    /// The world is a replay, which goes on as it was.
    #[error("a replay does what its recording says, and goes back to no checkpoint")]
    Replay,
    /// The checkpoint has an agent of somebody's own that joined its world ([`crate::Custom`]) and is not in this one: only a checkpoint that
    /// is kept in memory has the part that makes it again. The world goes on as it was.
    #[error(
        "\"{name}\" is an agent of your own that joined the world: no file has what makes it again, only a checkpoint that is kept in memory"
    )]
    Own {
        /// Its name.
        name: String,
    },
    /// The state does not fit the world's objects, or one of them does not read it. The world goes on as it was.
    #[error("the state could not be read: {0}")]
    Unreadable(ArchiveError),
    /// The world could not be started.
    #[error(transparent)]
    Start(#[from] WorldError),
    /// A file could not be read or written.
    #[error("{}: {error}", path.display())]
    File {
        /// Its path.
        path: PathBuf,
        /// The system's error.
        error: std::io::Error,
    },
    /// A file is no checkpoint that this program reads.
    #[error("{}: {reason}", path.display())]
    BadFile {
        /// Its path.
        path: PathBuf,
        /// The fault of the bytes.
        reason: BadCheckpoint,
    },
}

/// A fault of the bytes of a checkpoint.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BadCheckpoint {
    /// Not the first bytes of one.
    #[error("this is no checkpoint of metachron")]
    NoCheckpoint,
    /// Of another version of the format.
    #[error("its format is {found}; this program reads format {FORMAT}")]
    OtherFormat {
        /// The version of the format.
        found: u32,
    },
    /// Shorter or longer than it says.
    #[error("it has {found} bytes after its head, which says {expected}: it is not complete")]
    WrongLength {
        /// Bytes that there are.
        found: u64,
        /// Bytes that there should be.
        expected: u64,
    },
    /// Its bytes are not the ones that were written.
    #[error("its checksum is {found:016x}; its bytes make {expected:016x}: it is damaged")]
    Damaged {
        /// The checksum that it gives.
        found: u64,
        /// The checksum of its bytes.
        expected: u64,
    },
    /// Written by another version of the program, whose objects have other states.
    #[error("it was written by metachron {found}; this is {PROGRAM}")]
    OtherProgram {
        /// The version that has written it.
        found: String,
    },
    /// Bytes that are whole but mean nothing.
    #[error("{0}")]
    Malformed(ArchiveError),
}

impl Checkpoint {
    /// Simulated time of the state.
    #[must_use]
    pub const fn time(&self) -> SimTime {
        self.time
    }

    /// The time of each object's state, by their numbers: in real time they differ, as each is at the end of a step of
    /// its own. Zero of objects that have left.
    #[must_use]
    pub fn times(&self) -> &[SimTime] {
        &self.times
    }

    /// The name of its scene.
    #[must_use]
    pub fn scene(&self) -> &str {
        &self.of.name
    }

    /// Size of the state, bytes.
    #[must_use]
    pub fn size_bytes(&self) -> usize {
        self.state.len()
    }

    /// Writes it to a file, in place of one that is there, which stays as it was until the new one is whole. Of an agent of your own that joined ([`crate::Custom`]) the file has the state and
    /// the name: a world goes on from it where that agent is there.
    ///
    /// # Errors
    /// [`CheckpointError::File`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), CheckpointError> {
        let path = path.as_ref();
        OutputFile::write(path, self.to_bytes()).map_err(|error| CheckpointError::File { path: path.to_owned(), error })
    }

    /// Reads the one that a file holds.
    ///
    /// # Errors
    /// [`CheckpointError::File`]; [`CheckpointError::BadFile`] for any file that [`Self::write`] of this version has not written.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, CheckpointError> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|error| CheckpointError::File { path: path.to_owned(), error })?;
        Self::from_bytes(&bytes).map_err(|reason| CheckpointError::BadFile { path: path.to_owned(), reason })
    }

    /// The bytes of a file.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut archive = Archive::writer();
        let mut copy = self.clone();
        // plain values of this program can all be written
        let written = Self::archive(&mut PROGRAM.to_owned(), &mut copy, &mut archive);
        debug_assert_eq!(written, Ok(()));
        let body = archive.into_bytes();
        let mut bytes = Vec::with_capacity(HEAD + body.len());
        bytes.extend_from_slice(&MAGIC);
        bytes.extend_from_slice(&FORMAT.to_le_bytes());
        bytes.extend_from_slice(&(body.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&checksum(&body).to_le_bytes());
        bytes.extend_from_slice(&body);
        bytes
    }

    /// The checkpoint in the bytes of a file.
    ///
    /// # Errors
    /// [`BadCheckpoint`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, BadCheckpoint> {
        let Some((head, body)) = bytes.split_first_chunk::<HEAD>().filter(|(head, _)| head.starts_with(&MAGIC)) else {
            return Err(BadCheckpoint::NoCheckpoint);
        };
        let number = |from: usize| u64::from_le_bytes(std::array::from_fn(|at| head[from + at]));
        let found = number(MAGIC.len()) as u32;
        if found != FORMAT {
            return Err(BadCheckpoint::OtherFormat { found });
        }
        let (expected, found) = (number(MAGIC.len() + 4), body.len() as u64);
        if found != expected {
            return Err(BadCheckpoint::WrongLength { found, expected });
        }
        let (found, expected) = (number(MAGIC.len() + 12), checksum(body));
        if found != expected {
            return Err(BadCheckpoint::Damaged { found, expected });
        }
        let (mut program, mut read) = (String::new(), Self::empty());
        let mut archive = Archive::reader(body);
        archive.value(&mut program).map_err(BadCheckpoint::Malformed)?;
        if program != PROGRAM {
            return Err(BadCheckpoint::OtherProgram { found: program });
        }
        let mut archive = Archive::reader(body);
        Self::archive(&mut program, &mut read, &mut archive).map_err(BadCheckpoint::Malformed)?;
        archive.finish().map_err(BadCheckpoint::Malformed)?;
        Ok(read)
    }

    fn archive(program: &mut String, of: &mut Self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        metachron_core::archive_values!(archive, *program, of.of, of.time, of.times)?;
        archive_parts(&mut of.joined, archive)?;
        archive.value(&mut of.state)
    }

    fn empty() -> Self {
        let of = SceneIdentity::default();
        Self { of, time: SimTime::ZERO, times: vec![], joined: JoinedParts::new(), state: vec![] }
    }

    /// The state that a run has written.
    pub(crate) fn of_run(of: SceneIdentity, run: &dyn Run, joined: JoinedParts, state: Vec<u8>) -> Self {
        let time = |agent: &AgentHandle| match agent.state() {
            AgentState::Gone => SimTime::ZERO,
            _ => agent.latest().moment(),
        };
        Self { of, time: run.sim_now(), times: run.agents().iter().map(time).collect(), joined, state }
    }

    /// Checks that a file can have all that joined.
    ///
    /// # Errors
    /// [`CheckpointError::Own`].
    pub(super) fn check_saved(&self) -> Result<(), CheckpointError> {
        match self.joined.values().find(|joined| joined.is_own()) {
            Some(own) => Err(CheckpointError::Own { name: own.name.clone() }),
            None => Ok(()),
        }
    }
}

impl SceneIdentity {
    pub fn of(scene: &Scene) -> Self {
        let objects = scene.agents.iter().map(|member| ObjectIdentity {
            name: member.name.clone(),
            model: member.spec.model().to_owned(),
            rate_hz: member.pace.rate_hz,
        });
        Self {
            name: scene.name.clone(),
            objects: objects.collect(),
            fixed: scene.obstacles.len(),
            joints: scene.joints.len(),
            couplings: scene.couplings.len(),
        }
    }

    /// The identity in short.
    pub fn mark(&self) -> SceneMark {
        let mut archive = Archive::writer();
        // plain values of this program can all be written
        let written = archive.value(&mut self.clone());
        debug_assert_eq!(written, Ok(()));
        SceneMark { name: self.name.clone(), hash: checksum(&archive.into_bytes()) }
    }

    /// Checks that a checkpoint of the scene `found` is one of this scene. Its name may be another: files are renamed.
    ///
    /// # Errors
    /// [`CheckpointError::OtherScene`] with the first difference.
    pub fn check(&self, found: &Self) -> Result<(), CheckpointError> {
        let other =
            |what: String, found: String, expected: String| Err(CheckpointError::OtherScene { what, found, expected });
        let counts = [
            ("moving objects", found.objects.len(), self.objects.len()),
            ("fixed solids", found.fixed, self.fixed),
            ("joints", found.joints, self.joints),
            ("couplings", found.couplings, self.couplings),
        ];
        if let Some((what, found, expected)) = counts.into_iter().find(|(_, found, expected)| found != expected) {
            return other(format!("the number of {what}"), found.to_string(), expected.to_string());
        }
        let mut pairs = found.objects.iter().zip(&self.objects).enumerate();
        let Some((at, (found, expected))) = pairs.find(|(_, (found, expected))| found != expected) else {
            return Ok(());
        };
        let said = |one: &ObjectIdentity| format!("\"{}\", a {} at {} Hz", one.name, one.model, one.rate_hz);
        other(format!("object {at}"), said(found), said(expected))
    }
}

/// FNV-1a, 64 bits: no change of one byte leaves it as it was.
pub(super) fn checksum(bytes: &[u8]) -> u64 {
    const FNV_PRIME: u64 = 0x0100_0000_01b3;
    bytes.iter().fold(HASH_START, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(FNV_PRIME))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::kinds::ExecutorKind;
    use crate::{Rigid, Tube, World};
    use metachron_core::SimSpan;
    use metachron_geometry::Solid;

    fn scene() -> Scene {
        let ball = Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.051]);
        let tube = Tube::along(&[[-0.2, 0.0, 0.12], [0.2, 0.0, 0.12]]).radius_m(0.01).segments(4);
        Scene::builder().fixed("floor", Solid::Plane).add("ball", ball).add("tube", tube).build().unwrap()
    }

    fn start() -> World {
        World::start(&scene(), ExecutorKind::Lockstep).unwrap()
    }

    /// A checksum finds changed bytes; this is the case that it misses them.
    #[test]
    fn a_state_with_any_byte_changed_is_read_or_refused() {
        let world = start();
        world.add("crate", Rigid::cuboid([0.02; 3]).at([0.3, 0.0, 0.2])).unwrap();
        world.advance(SimSpan::from_millis(50));
        world.remove(world.object("tube").unwrap()).unwrap();
        world.advance(SimSpan::from_millis(50));
        let mark = world.checkpoint().unwrap();
        let (mut refused, before) = (0, world.hash());
        for at in (0..mark.state.len()).step_by(1 + mark.state.len() / 300) {
            let mut broken = mark.clone();
            broken.state[at] ^= 0xff;
            match world.restore(&broken) {
                Ok(()) => world.restore(&mark).unwrap(),
                Err(CheckpointError::Unreadable(_)) => refused += 1,
                Err(other) => panic!("byte {at}: {other}"),
            }
            assert!(world.checkpoint().unwrap() == mark && world.hash() == before, "byte {at}");
        }
        assert!(refused > 0, "no number was found to be wrong");
    }

    #[test]
    fn another_version_is_named() {
        let mark = start().checkpoint().unwrap();
        let mut bytes = mark.to_bytes();
        assert_eq!(Checkpoint::from_bytes(&bytes), Ok(mark));
        let found = FORMAT + 1;
        bytes[MAGIC.len()] = found as u8;
        assert_eq!(Checkpoint::from_bytes(&bytes), Err(BadCheckpoint::OtherFormat { found }));
    }
}
