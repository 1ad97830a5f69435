//! The turns and frames of a run on a time axis, as trace events in JSON: opened by Perfetto (ui.perfetto.dev) and by
//! Chrome's tracing page.
//!
//! In: a world's turns and events, the frames of a loop that draws it. Out: a lane for each object and one for frames, on wall time (virtual in
//! lockstep). Never here: states, surfaces, statistics.
//! Format: "Trace Event Format" (Duca and Sinclair), its array form, which needs no end, so that a file that was cut short opens.

use super::ExportError;
use metachron_core::{AgentId, SimSpan, SimTime};
use metachron_runtime::{AgentHandle, StreamReader, Turn};
use metachron_world::{Event, EventFilter, Events, Happening, OutputFile, World};
use serde_json::{Map, Value, json};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The most bytes of a file: more than browsers open with ease.
const BYTES_MAX: u64 = 256 << 20;
/// The groups of lanes: frames, and objects.
const FRAMES: u32 = 1;
const OBJECTS: u32 = 2;

/// A frame of a loop that draws.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Wall time at which it began.
    pub begun: Duration,
    /// Its work.
    pub work: Duration,
    /// Its parts, in their order; they begin one after the other.
    pub parts: Vec<(&'static str, Duration)>,
    /// Values that are drawn as curves, by name.
    pub counters: Vec<(&'static str, f64)>,
}

/// A trace in a file: slices for steps, with dt, ε, lateness and leader, and for waits; instants for events.
///
/// It can be read while it grows, and one that was cut short opens as far as it goes. It takes [`PerfettoFile::BYTES_MAX`] bytes at most: later entries are left out, and [`PerfettoFile::is_full`] says
/// so.
pub struct PerfettoFile {
    path: PathBuf,
    file: BufWriter<OutputFile>,
    world: World,
    events: Events,
    lanes: Vec<Lane>,
    bytes: u64,
    bytes_max: u64,
    is_full: bool,
    lost: u64,
}

/// The turns of an object that were read.
struct Lane {
    reader: StreamReader,
    /// A wait that may go on.
    wait: Option<Turn>,
    /// When the steps that were read last ended, by the object's own time.
    ended: Vec<(SimTime, Duration)>,
}

impl std::fmt::Debug for PerfettoFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PerfettoFile").field("path", &self.path).field("bytes", &self.bytes).finish_non_exhaustive()
    }
}

impl PerfettoFile {
    /// The most bytes of a file.
    pub const BYTES_MAX: u64 = BYTES_MAX;

    /// Begins a file, in place of one that exists, with the turns and events of the world from now on.
    ///
    /// # Errors
    /// [`ExportError::File`].
    pub fn create(path: &Path, world: &World) -> Result<Self, ExportError> {
        let mut file = BufWriter::new(OutputFile::growing(path).map_err(ExportError::at(path))?);
        file.write_all(b"[").map_err(ExportError::at(path))?;
        let mut it = Self {
            path: path.to_owned(),
            file,
            world: world.clone(),
            events: world.events(EventFilter::all()),
            lanes: Vec::new(),
            bytes: 1,
            bytes_max: BYTES_MAX,
            is_full: false,
            lost: 0,
        };
        for (pid, name) in [(FRAMES, "frames"), (OBJECTS, "objects")] {
            it.put(&json!({ "ph": "M", "name": "process_name", "pid": pid, "args": { "name": name } }))?;
        }
        it.put(&json!({ "ph": "M", "name": "thread_name", "pid": FRAMES, "tid": 0, "args": { "name": "frames" } }))?;
        it.listen()?;
        Ok(it)
    }

    /// Writes the turns and events since the last call, and the frame that has just ended, if there is one. To be
    /// called a few times a second at least: an object keeps its newest [`metachron_runtime::TURNS_KEPT`] turns.
    ///
    /// # Errors
    /// [`ExportError::File`].
    pub fn write(&mut self, frame: Option<&Frame>) -> Result<(), ExportError> {
        self.listen()?;
        let world = self.world.clone();
        world.agents().iter().try_for_each(|agent| self.turns(agent))?;
        let happened: Vec<Event> = self.events.drain().collect();
        happened.iter().try_for_each(|event| self.event(event))?;
        frame.map_or(Ok(()), |frame| self.frame(frame))
    }

    /// Completes the file with the turns and events since the last call.
    ///
    /// # Errors
    /// [`ExportError::File`].
    pub fn finish(&mut self) -> Result<(), ExportError> {
        self.write(None)?;
        for at in 0..self.lanes.len() {
            let wait = self.lanes[at].wait.take();
            wait.map_or(Ok(()), |wait| self.slice(AgentId(at as u32), &wait))?;
        }
        self.file.write_all(b"\n]\n").and_then(|()| self.file.flush()).map_err(ExportError::at(&self.path))
    }

    /// Whether something was left out because the file is as long as it may be.
    #[must_use]
    pub const fn is_full(&self) -> bool {
        self.is_full
    }

    /// How many turns and events came between two calls that no object keeps.
    #[must_use]
    pub const fn lost(&self) -> u64 {
        self.lost + self.events.lost()
    }

    /// Hears the turns of objects that have joined.
    fn listen(&mut self) -> Result<(), ExportError> {
        let world = self.world.clone();
        for agent in world.agents().iter().skip(self.lanes.len()) {
            self.lanes.push(Lane { reader: agent.listen_to_turns(), wait: None, ended: Vec::new() });
            let (name, tid) = (agent.name(), lane_of(agent.id()));
            self.put(
                &json!({ "ph": "M", "name": "thread_name", "pid": OBJECTS, "tid": tid, "args": { "name": name } }),
            )?;
        }
        Ok(())
    }

    fn turns(&mut self, agent: &AgentHandle) -> Result<(), ExportError> {
        let at = agent.id().0 as usize;
        let mut turns = Vec::new();
        self.lost += agent.read_turns(&mut self.lanes[at].reader, |turn| turns.push(turn));
        let steps = turns.iter().filter(|turn| is_step(turn));
        self.lanes[at].ended = steps.map(|turn| (turn.time, turn.ended)).collect();
        turns.iter().try_for_each(|turn| self.turn(agent.id(), turn))
    }

    /// Writes a step; waits that follow each other are one, which ends with the next step.
    fn turn(&mut self, id: AgentId, turn: &Turn) -> Result<(), ExportError> {
        let wait = &mut self.lanes[id.0 as usize].wait;
        if !is_step(turn) {
            let begun = wait.as_ref().map_or(turn.begun, |before| before.begun);
            *wait = Some(Turn { begun, ..*turn });
            return Ok(());
        }
        if let Some(before) = wait.take() {
            self.slice(id, &Turn { ended: before.ended.min(turn.begun), ..before })?;
        }
        self.slice(id, turn)
    }

    fn slice(&mut self, id: AgentId, turn: &Turn) -> Result<(), ExportError> {
        let mut args = Map::new();
        args.insert("time_s".to_owned(), json!(turn.time.as_secs_f64()));
        if is_step(turn) {
            args.insert("dt_ms".to_owned(), json!(turn.dt.as_secs_f64() * 1e3));
            args.insert("late_ms".to_owned(), json!(turn.late.as_secs_f64() * 1e3));
            args.insert("dropped_ms".to_owned(), json!(turn.dropped.as_secs_f64() * 1e3));
            turn.eps_m.map(|eps_m| args.insert("eps_m".to_owned(), json!(eps_m)));
            if turn.led_by != id {
                args.insert("led_by".to_owned(), json!(self.name_of(turn.led_by)));
            }
        }
        let name = if is_step(turn) { "step" } else { "waits" };
        self.put(&json!({
            "ph": "X", "name": name, "pid": OBJECTS, "tid": lane_of(id),
            "ts": micros(turn.begun), "dur": micros(turn.ended.saturating_sub(turn.begun)), "args": args,
        }))
    }

    /// An instant where the step of the object ended in which it happened.
    fn event(&mut self, event: &Event) -> Result<(), ExportError> {
        let id = event.object.id();
        let ended = self.lanes.get(id.0 as usize).map_or(&[][..], |lane| &lane.ended);
        let of_its_step = ended.iter().find(|(time, _)| *time >= event.at).or(ended.last());
        let at = of_its_step.map_or_else(|| self.world.now(), |(_, wall)| *wall);
        let mut args = json!({ "time_s": event.at.as_secs_f64() });
        if let Some(with) = &event.other {
            args["with"] = json!(**with);
        }
        if let Happening::Contact(contact) = event.what {
            args["force_n"] = json!(contact.force_n.length());
        }
        self.put(&json!({ "ph": "i", "s": "t", "name": event.what.name(), "pid": OBJECTS, "tid": lane_of(id), "ts": micros(at), "args": args }))
    }

    fn name_of(&self, id: AgentId) -> String {
        self.world.agents().of(id).map_or_else(String::new, |agent| agent.name().to_owned())
    }

    fn frame(&mut self, frame: &Frame) -> Result<(), ExportError> {
        let slice = |name: &str, begun: Duration, length: Duration| json!({ "ph": "X", "name": name, "pid": FRAMES, "tid": 0, "ts": micros(begun), "dur": micros(length) });
        self.put(&slice("frame", frame.begun, frame.work))?;
        let (mut begun, end) = (frame.begun, frame.begun + frame.work);
        for (name, length) in &frame.parts {
            // a part that is measured apart never reaches beyond its frame, so that it is shown within it
            let length = (*length).min(end.saturating_sub(begun));
            self.put(&slice(name, begun, length))?;
            begun += length;
        }
        for (name, value) in &frame.counters {
            let ts = micros(frame.begun);
            self.put(&json!({ "ph": "C", "name": name, "pid": FRAMES, "ts": ts, "args": { "value": value } }))?;
        }
        Ok(())
    }

    fn put(&mut self, event: &Value) -> Result<(), ExportError> {
        let comma = if self.bytes > 1 { ",\n" } else { "\n" };
        let text = format!("{comma}{event}");
        self.is_full |= self.bytes + text.len() as u64 > self.bytes_max;
        if self.is_full {
            return Ok(());
        }
        self.bytes += text.len() as u64;
        self.file.write_all(text.as_bytes()).map_err(ExportError::at(&self.path))
    }
}

/// Whether a turn was a step, and no wait.
fn is_step(turn: &Turn) -> bool {
    turn.dt > SimSpan::ZERO
}

/// The number of an object's lane: there is none of number 0.
fn lane_of(id: AgentId) -> u64 {
    u64::from(id.0) + 1
}

fn micros(time: Duration) -> f64 {
    time.as_nanos() as f64 * 1e-3
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_world::{Rigid, Scene, kinds::ExecutorKind};

    #[test]
    fn a_file_that_is_full_is_complete_and_says_that_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trace.json");
        let scene = Scene::builder().add("ball", Rigid::ball(0.05)).build().unwrap();
        let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
        let mut file = PerfettoFile::create(&path, &world).unwrap();
        file.bytes_max = 2000;
        for _ in 0..20 {
            world.advance(SimSpan::from_millis(20));
            file.write(None).unwrap();
        }
        file.finish().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(file.is_full() && (1000..2010).contains(&text.len()), "{}", text.len());
        assert!(serde_json::from_str::<Vec<Value>>(&text).unwrap().len() > 5);
    }
}
