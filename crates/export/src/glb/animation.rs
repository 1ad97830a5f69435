//! A run as one animated binary glTF file, which Blender, three.js and game engines play.
//!
//! In: moments. Out: of rigid bodies keys of translation and rotation; of what bends or has jaws morph targets, a node for every so many of them
//! and for every division into triangles, of which each is shown (scale 1, else 0) in its time. Never here: tables of glTF (`super`).
//! Format: glTF 2.0 (Khronos Group 2017), sections 3.7.2.2 and 3.11.

use super::super::moment::ObjectMoment;
use super::super::surface::Surface;
use super::super::{ExportError, Moment, MomentWriter, colour};
use super::Glb;
use glam::{DQuat, DVec3};
use metachron_core::{AgentId, Body};
use metachron_world::OutputFile;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The most bytes of a file, about: more than browsers open with ease.
const BYTES_MAX: usize = 256 << 20;
/// The most morph targets of a node: what draws it looks at each of them for every point.
const TARGETS_MAX: usize = 64;
/// A point with its normal, and what the tables say of a list of them, bytes, about.
const POINT_BYTES: usize = 24;
const TABLE_BYTES: usize = 512;

/// A run in a file, with a key for every moment.
///
/// The file is written by [`MomentWriter::finish`], and takes the place of one that is there when it is whole. Times are simulated time since the start of the run; a moment of the
/// time of the one before is left out, an earlier one is [`ExportError::Earlier`]. All moments together may take [`GlbAnimation::BYTES_MAX`] bytes,
/// then [`ExportError::TooLong`]: a tube of 100 nodes takes 30 kB each, a rigid body 28 bytes.
#[derive(Debug)]
pub struct GlbAnimation {
    path: PathBuf,
    /// `None` once it is complete.
    file: Option<OutputFile>,
    fixed: Surface,
    times_s: Vec<f32>,
    bytes: usize,
    bytes_max: usize,
    tracks: BTreeMap<AgentId, Vec<Track>>,
}

/// An object at some keys that follow each other, as one node shows it.
#[derive(Debug)]
struct Track {
    name: Arc<str>,
    /// Its first key, and the one from which on it is hidden.
    first: usize,
    hidden: Option<usize>,
    surface: Surface,
    motion: Motion,
}

#[derive(Debug)]
enum Motion {
    /// The surface is in its own axes; its places, a key each.
    Rigid(Vec<(DVec3, DQuat)>),
    /// The places of the surface's points, its own first, and which of these each key shows.
    Bends { shapes: Vec<Vec<DVec3>>, shown: Vec<usize> },
}

impl GlbAnimation {
    /// The most bytes of a file, about.
    pub const BYTES_MAX: usize = BYTES_MAX;

    /// Begins a file; `fixed` are the solids that never move.
    ///
    /// # Errors
    /// [`ExportError::File`].
    pub fn create(path: &Path, fixed: &Surface) -> Result<Self, ExportError> {
        let file = Some(OutputFile::whole(path).map_err(ExportError::at(path))?);
        let (path, fixed, times_s, tracks) = (path.to_owned(), fixed.clone(), Vec::new(), BTreeMap::new());
        Ok(Self { path, file, fixed, times_s, bytes: 0, bytes_max: BYTES_MAX, tracks })
    }

    /// Adds a key of an object to its track, or begins another where its triangles are others or the track is full.
    fn key(&mut self, key: usize, object: &ObjectMoment) {
        let tracks = self.tracks.entry(object.id).or_default();
        let goes_on = |track: &&mut Track| track.next() == key && track.surface.triangles == object.surface.triangles;
        let Some(track) = tracks.last_mut().filter(goes_on) else {
            let track = Track::begun(key, object);
            self.bytes += track.bytes();
            return tracks.push(track);
        };
        let Some(mut next) = track.continued() else {
            self.bytes += track.push(object);
            return;
        };
        self.bytes += next.bytes() + next.push(object);
        track.hidden = Some(next.first);
        tracks.push(next);
    }
}

impl MomentWriter for GlbAnimation {
    fn write(&mut self, moment: &Moment) -> Result<(), ExportError> {
        let time_s = moment.time.as_secs_f64() as f32;
        match self.times_s.last() {
            Some(last) if *last == time_s => return Ok(()),
            Some(last) if *last > time_s => {
                return Err(ExportError::Earlier { path: self.path.clone(), time_s, last_s: *last });
            }
            _ => {}
        }
        if self.bytes > self.bytes_max {
            let (path, bytes_max) = (self.path.clone(), self.bytes_max);
            return Err(ExportError::TooLong { path, bytes_max, time_s, moments: self.times_s.len() });
        }
        let key = self.times_s.len();
        self.times_s.push(time_s);
        self.bytes += size_of::<f32>();
        let seen = moment.objects.iter().filter(|object| !object.surface.triangles.is_empty());
        seen.for_each(|object| self.key(key, object));
        for track in self.tracks.values_mut().flatten().filter(|track| track.next() <= key && track.hidden.is_none()) {
            track.hidden = Some(key);
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), ExportError> {
        let Some(mut out) = self.file.take() else { return Ok(()) };
        let mut file = Glb::default();
        let mut nodes: Vec<_> = file.fixed(&self.fixed).into_iter().collect();
        for (id, tracks) in &self.tracks {
            for track in tracks {
                let mut node = track.node(&mut file, nodes.len(), &self.times_s);
                node["extras"] = json!({ "object": id.0 });
                nodes.push(node);
            }
        }
        let start_s = self.times_s.first().copied().unwrap_or_default();
        let bytes = file.bytes(nodes, f64::from(start_s)).map_err(ExportError::at(&self.path))?;
        out.write_all(&bytes).and_then(|()| out.complete()).map_err(ExportError::at(&self.path))
    }
}

impl Track {
    fn begun(first: usize, object: &ObjectMoment) -> Self {
        let (surface, motion) = match &object.state.body {
            Body::Rigid(body) => {
                let surface = object.surface.in_axes_of(body.position, body.rotation);
                (surface, Motion::Rigid(vec![(body.position, body.rotation.normalize())]))
            }
            _ => (object.surface.clone(), Motion::bends(object.surface.points.clone())),
        };
        Self { name: object.name.clone(), first, hidden: None, surface, motion }
    }

    /// A track that begins with the last key of this, where this has as many morph targets as it may.
    fn continued(&self) -> Option<Self> {
        let Motion::Bends { shapes, .. } = &self.motion else { return None };
        let points = shapes.last().filter(|_| shapes.len() > TARGETS_MAX)?.clone();
        let surface = Surface { points: points.clone(), ..self.surface.clone() };
        let (name, first, motion) = (self.name.clone(), self.next() - 1, Motion::bends(points));
        Some(Self { name, first, hidden: None, surface, motion })
    }

    /// The key after its last.
    fn next(&self) -> usize {
        self.first
            + match &self.motion {
                Motion::Rigid(places) => places.len(),
                Motion::Bends { shown, .. } => shown.len(),
            }
    }

    /// The bytes of its mesh, about.
    fn bytes(&self) -> usize {
        POINT_BYTES * self.surface.points.len() + size_of_val(&*self.surface.triangles) + TABLE_BYTES
    }

    /// Adds a key; the bytes that it takes, about.
    fn push(&mut self, object: &ObjectMoment) -> usize {
        match (&mut self.motion, &object.state.body) {
            (Motion::Rigid(places), Body::Rigid(body)) => {
                // a rotation and its opposite are one: the near one is on the short way
                let rotation = body.rotation.normalize();
                let is_far = places.last().is_some_and(|(_, before)| before.dot(rotation) < 0.0);
                places.push((body.position, if is_far { -rotation } else { rotation }));
                size_of::<[f32; 7]>()
            }
            (Motion::Bends { shapes, shown }, _) => {
                let points = &object.surface.points;
                let is_new = shapes.last() != Some(points);
                if is_new {
                    shapes.push(points.clone());
                }
                shown.push(shapes.len() - 1);
                size_of::<f32>() * TARGETS_MAX + if is_new { POINT_BYTES * points.len() + TABLE_BYTES } else { 0 }
            }
            (Motion::Rigid(_), _) => 0,
        }
    }

    /// Its node at the first moment of the run, which is number `number`, and its part of the animation.
    fn node(&self, file: &mut Glb, number: usize, times_s: &[f32]) -> Value {
        let mut node = json!({ "name": *self.name });
        let keys = &times_s[self.first..self.next()];
        let targets = match &self.motion {
            Motion::Rigid(places) => {
                let (translations, rotations): (Vec<_>, Vec<_>) =
                    places.iter().map(|(at, turned)| (at.as_vec3().to_array(), turned.as_quat().to_array())).unzip();
                node["translation"] = json!(translations[0]);
                node["rotation"] = json!(rotations[0]);
                if places.iter().any(|place| *place != places[0]) {
                    file.channel(number, "translation", keys, translations.as_flattened());
                    file.channel(number, "rotation", keys, rotations.as_flattened());
                }
                &[]
            }
            Motion::Bends { shapes, shown } => {
                let weight = |shown: usize, target: usize| if shown == target { 1.0 } else { 0.0 };
                let weights =
                    shown.iter().flat_map(|shown| (1..shapes.len()).map(move |target| weight(*shown, target)));
                let weights: Vec<f32> = weights.collect();
                if !weights.is_empty() {
                    file.channel(number, "weights", keys, &weights);
                }
                &shapes[1..]
            }
        };
        node["mesh"] = json!(file.mesh(&self.name, &self.surface, colour::of_name(&self.name), targets));
        let ends =
            [Some((0, 0.0_f32)).filter(|_| self.first > 0), Some((self.first, 1.0)), self.hidden.map(|key| (key, 0.0))];
        let ends: Vec<_> = ends.into_iter().flatten().collect();
        if ends.len() > 1 {
            node["scale"] = json!(vec![ends[0].1; 3]);
            let (keys, scales): (Vec<_>, Vec<_>) = ends.iter().map(|(key, scale)| (times_s[*key], [*scale; 3])).unzip();
            file.channel(number, "scale", &keys, scales.as_flattened());
        }
        node
    }
}

impl Motion {
    fn bends(points: Vec<DVec3>) -> Self {
        Self::Bends { shapes: vec![points], shown: vec![0] }
    }
}

impl Glb {
    /// Animates a property of a node: its values at times. Sizes change at once, all else goes straight on.
    fn channel(&mut self, node: usize, path: &str, times_s: &[f32], values: &[f32]) {
        let (kind, interpolation) = match path {
            "rotation" => ("VEC4", "LINEAR"),
            "weights" => ("SCALAR", "LINEAR"),
            "scale" => ("VEC3", "STEP"),
            _ => ("VEC3", "LINEAR"),
        };
        let input = self.floats(times_s, "SCALAR", None);
        (self.accessors[input]["min"], self.accessors[input]["max"]) =
            (json!(times_s[..1]), json!(times_s[times_s.len() - 1..]));
        let output = self.floats(values, kind, None);
        self.samplers.push(json!({ "input": input, "output": output, "interpolation": interpolation }));
        let sampler = self.samplers.len() - 1;
        self.channels.push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Moments;
    use metachron_core::SimSpan;
    use metachron_world::{Scene, Soft, World, kinds::ExecutorKind};

    #[test]
    fn a_run_that_is_too_long_is_told_and_what_was_written_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.glb");
        let scene = Scene::builder().add("jelly", Soft::ball(0.1, 4)).build().unwrap();
        let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
        let mut moments = Moments::of(&world);
        let mut file = GlbAnimation { bytes_max: 100_000, ..GlbAnimation::create(&path, &Surface::default()).unwrap() };
        let mut write = || {
            world.advance(SimSpan::from_millis(20));
            file.write(&moments.take())
        };
        let (written, refused) = (0..).find_map(|k| Some((k, write().err()?))).unwrap();
        let said = refused.to_string();
        assert!(said.contains("run.glb") && said.contains("more than 100000 bytes"), "{said}");
        assert!(said.contains(&format!("ends after {written} moments")), "{said}");
        file.finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert!((80_000..140_000).contains(&bytes.len()), "{}", bytes.len());
        assert_eq!(gltf::Gltf::from_slice(&bytes).unwrap().animations().count(), 1);
    }
}
