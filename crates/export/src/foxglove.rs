//! MCAP files with Foxglove's scenes: opened by Foxglove, Lichtblick and Rerun.
//!
//! In: moments. Out: `/scene` (foxglove.SceneUpdate), `/tf` (foxglove.FrameTransform), `/joint_states` (foxglove.JointStates), `/events`
//! (foxglove.Log), `/contacts` (metachron.Contacts), `/state` (metachron.State), all in JSON, in chunks that LZ4 makes smaller.
//! Never here: other encodings.

mod schema;

use super::moment::{ContactMoment, JointMoment, ObjectMoment};
use super::surface::Surface;
use super::{ExportError, Moment, MomentWriter, colour};
use glam::{DQuat, DVec3};
use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};
use metachron_core::{AgentId, Body, SimTime};
use metachron_world::{Event, Happening, OutputFile};
use serde_json::{Value, json};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// A chunk is closed, and the data before it is safe from a crash, after so much simulated time.
const CHUNK_S: f64 = 1.0;
/// Points of surfaces are given to this part of a metre: a micrometre.
const SHOWN_PER_M: f64 = 1e6;
/// The frame that all others are in.
const WORLD: &str = "world";
/// The entity of static solids.
const FIXED: &str = "fixed";

/// A file in MCAP.
///
/// Times are simulated time since the start of the run.
/// `/scene`: every object as a list of triangles, its points to a micrometre; a rigid body's once, in a frame of its
/// name, which `/tf` moves, and a deformable's whenever it has a new state.
/// The frame and the entity of an object are called as it is; one called `world` or `fixed`, as ours are, has `_` behind its name there.
/// `/state`: `{"name", "time", "snapshot"}` for every object that has a new state, the snapshot with all its fields
/// (`metachron_core::Snapshot`).
/// `/contacts`: at every moment `{"timestamp", "contacts"}`, each with the names of its `object` and of what it is `with`, the `point` that bears
/// most, the `normal` there towards the object, the `force` on the object (the mean of its last step) and `depth`.
/// `/joint_states`: position, velocity and effort of all hinges and slides by name, where there are any.
/// `/events`: each as a sentence under the name of its object at the time of that object, with its kind as `event` and the other object as `with`.
/// It can be read while it grows, and one that was cut short opens up to about its last second.
pub struct McapFile {
    path: PathBuf,
    writer: Writer<BufWriter<OutputFile>>,
    channels: Channels,
    sequence: u32,
    flushed: SimTime,
    /// Bodies whose triangles the file holds already, and the steps of every object's newest state in it.
    rigid: BTreeSet<AgentId>,
    steps: BTreeMap<AgentId, u64>,
    /// The objects in the scene a moment ago.
    shown: BTreeMap<AgentId, String>,
}

#[derive(Debug, Clone, Copy)]
struct Channels {
    scene: u16,
    transforms: u16,
    states: u16,
    contacts: u16,
    joints: u16,
    events: u16,
}

impl std::fmt::Debug for McapFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("McapFile").field("path", &self.path).field("messages", &self.sequence).finish_non_exhaustive()
    }
}

impl McapFile {
    /// Begins a file, in place of one that exists; `fixed` are the solids that never move.
    ///
    /// # Errors
    /// [`ExportError`] where it cannot be written.
    pub fn create(path: &Path, fixed: &Surface) -> Result<Self, ExportError> {
        let file = BufWriter::new(OutputFile::growing(path).map_err(ExportError::at(path))?);
        let options = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .library(concat!("metachron ", env!("CARGO_PKG_VERSION")));
        let at = failed(path);
        let mut writer = options.create(file).map_err(&at)?;
        let mut channel = |topic: &str, name: &str, schema: &Value| {
            let schema = writer.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
            writer.add_channel(schema, topic, "json", &BTreeMap::new())
        };
        let channels = Channels {
            scene: channel("/scene", "foxglove.SceneUpdate", &schema::scene()).map_err(&at)?,
            transforms: channel("/tf", "foxglove.FrameTransform", &schema::transform()).map_err(&at)?,
            states: channel("/state", "metachron.State", &schema::state()).map_err(&at)?,
            contacts: channel("/contacts", "metachron.Contacts", &schema::contacts()).map_err(&at)?,
            joints: channel("/joint_states", "foxglove.JointStates", &schema::joint_states()).map_err(&at)?,
            events: channel("/events", "foxglove.Log", &schema::log()).map_err(&at)?,
        };
        let (rigid, steps, shown) = Default::default();
        let path = path.to_owned();
        let mut it = Self { path, writer, channels, sequence: 0, flushed: SimTime::ZERO, rigid, steps, shown };
        let start = SimTime::ZERO;
        let entity = entity(FIXED, WORLD, start, fixed);
        it.put(channels.scene, start, &json!({ "deletions": [], "entities": [entity] }))?;
        Ok(it)
    }

    fn put(&mut self, channel_id: u16, time: SimTime, message: &Value) -> Result<(), ExportError> {
        let header = MessageHeader {
            channel_id,
            sequence: self.sequence,
            log_time: time.as_nanos(),
            publish_time: time.as_nanos(),
        };
        self.sequence = self.sequence.wrapping_add(1);
        self.writer.write_to_known_channel(&header, message.to_string().as_bytes()).map_err(failed(&self.path))
    }

    /// The entities of a moment: a deformable is sent anew with every new state, a rigid body once.
    fn scene(&mut self, moment: &Moment) -> Value {
        let mut entities = Vec::new();
        for object in moment.objects.iter().filter(|object| !object.surface.triangles.is_empty()) {
            if let Body::Rigid(body) = &object.state.body {
                if self.rigid.insert(object.id) {
                    let local = object.surface.in_axes_of(body.position, body.rotation);
                    let name = name_of(object);
                    entities.push(entity(&name, &name, moment.time, &local));
                }
            } else if self.is_new(object) {
                entities.push(entity(&name_of(object), WORLD, moment.time, &object.surface));
            }
        }
        let now: BTreeMap<_, _> =
            moment.objects.iter().map(|object| (object.id, name_of(object).into_owned())).collect();
        let gone = self.shown.iter().filter(|(id, _)| !now.contains_key(id));
        let deletions: Vec<_> =
            gone.map(|(_, name)| json!({ "timestamp": stamp(moment.time), "type": 0, "id": name })).collect();
        self.shown = now;
        json!({ "deletions": deletions, "entities": entities })
    }

    /// Whether the file does not hold the newest state of an object.
    fn is_new(&self, object: &ObjectMoment) -> bool {
        self.steps.get(&object.id) != Some(&object.state.steps)
    }

    fn transform(&mut self, time: SimTime, object: &ObjectMoment) -> Result<(), ExportError> {
        let Body::Rigid(body) = &object.state.body else { return Ok(()) };
        let message = json!({
            "timestamp": stamp(time),
            "parent_frame_id": WORLD,
            "child_frame_id": name_of(object),
            "translation": vector(body.position),
            "rotation": rotation(body.rotation),
        });
        self.put(self.channels.transforms, time, &message)
    }

    fn state(&mut self, time: SimTime, object: &ObjectMoment) -> Result<(), ExportError> {
        if !self.is_new(object) {
            return Ok(());
        }
        self.steps.insert(object.id, object.state.steps);
        let message =
            json!({ "name": *object.name, "time": object.state.time.as_secs_f64(), "snapshot": *object.state });
        self.put(self.channels.states, time, &message)
    }
}

impl MomentWriter for McapFile {
    fn write(&mut self, moment: &Moment) -> Result<(), ExportError> {
        let scene = self.scene(moment);
        for object in &moment.objects {
            self.transform(moment.time, object)?;
            self.state(moment.time, object)?;
        }
        self.put(self.channels.scene, moment.time, &scene)?;
        let contacts: Vec<_> = moment.contacts.iter().map(contact).collect();
        let contacts = json!({ "timestamp": stamp(moment.time), "contacts": contacts });
        self.put(self.channels.contacts, moment.time, &contacts)?;
        if !moment.joints.is_empty() {
            let joints: Vec<_> = moment.joints.iter().map(joint).collect();
            let joints = json!({ "timestamp": stamp(moment.time), "joints": joints });
            self.put(self.channels.joints, moment.time, &joints)?;
        }
        for event in &moment.events {
            self.put(self.channels.events, event.at, &log(event))?;
        }
        if moment.time.secs_after(self.flushed) >= CHUNK_S {
            self.flushed = moment.time;
            self.writer.flush().map_err(failed(&self.path))?;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), ExportError> {
        self.writer.finish().map(|_| ()).map_err(failed(&self.path))
    }
}

fn failed(path: &Path) -> impl Fn(McapError) -> ExportError {
    let path = path.to_owned();
    move |error| {
        let error = match error {
            McapError::Io(error) => error,
            other => std::io::Error::other(other),
        };
        ExportError::File { path: path.clone(), error }
    }
}

/// The name of an object's frame and entity: its own, with one `_` more where that, but for any `_` at its end, is one of ours.
fn name_of(object: &ObjectMoment) -> Cow<'_, str> {
    let name = &*object.name;
    if [WORLD, FIXED].contains(&name.trim_end_matches('_')) { format!("{name}_").into() } else { name.into() }
}

fn stamp(time: SimTime) -> Value {
    const NANOS: u64 = 1_000_000_000;
    json!({ "sec": time.as_nanos() / NANOS, "nsec": time.as_nanos() % NANOS })
}

fn vector(v: DVec3) -> Value {
    json!({ "x": v.x, "y": v.y, "z": v.z })
}

/// A point as exactly as pictures show it: `/state` has all digits, and the digits of many points take most of a file.
fn shown(point: DVec3) -> DVec3 {
    (point * SHOWN_PER_M).round() / SHOWN_PER_M
}

fn rotation(q: DQuat) -> Value {
    json!({ "x": q.x, "y": q.y, "z": q.z, "w": q.w })
}

fn contact(ContactMoment { names: [object, with], state, .. }: &ContactMoment) -> Value {
    json!({
        "object": **object,
        "with": **with,
        "point": if state.point_m.is_finite() { vector(state.point_m) } else { Value::Null },
        "normal": vector(state.normal),
        "force": vector(state.force_n),
        "depth": state.depth_m,
    })
}

fn joint(JointMoment { name, position, velocity, effort }: &JointMoment) -> Value {
    json!({ "name": **name, "position": position, "velocity": velocity, "effort": effort })
}

fn log(event: &Event) -> Value {
    let level = match event.what {
        Happening::Failed => schema::ERROR,
        Happening::Stalled | Happening::RateMissed | Happening::UnderResolved(_) | Happening::AttachmentGave => {
            schema::WARNING
        }
        _ => schema::INFO,
    };
    json!({
        "timestamp": stamp(event.at), "level": level, "name": *event.name, "message": event.to_string(), "file": "", "line": 0,
        "event": event.what.name(), "with": event.other.as_deref(),
    })
}

/// An entity that stays until another of its id comes.
fn entity(id: &str, frame: &str, time: SimTime, surface: &Surface) -> Value {
    json!({
        "timestamp": stamp(time),
        "frame_id": frame,
        "id": id,
        "lifetime": { "sec": 0, "nsec": 0 },
        "frame_locked": true,
        "metadata": [],
        "arrows": [], "cubes": [], "spheres": [], "cylinders": [], "lines": [], "texts": [], "models": [],
        "triangles": [{
            "pose": { "position": vector(DVec3::ZERO), "orientation": rotation(DQuat::IDENTITY) },
            "points": surface.points.iter().map(|p| vector(shown(*p))).collect::<Vec<_>>(),
            "color": colour(id),
            "colors": [],
            "indices": surface.triangles.iter().flatten().collect::<Vec<_>>(),
        }],
    })
}

fn colour(id: &str) -> Value {
    let [r, g, b] = if id == FIXED { colour::OF_FIXED } else { colour::of_name(id) };
    json!({ "r": r, "g": g, "b": b, "a": 1.0 })
}
