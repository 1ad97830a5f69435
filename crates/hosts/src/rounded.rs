//! States for callers that only look: rounded far below what is seen, and sent as what changed of them.
//!
//! In: a message of states, and the states before. Out: its bytes; at the caller the message again, with rounded states. Never here: which
//! caller is sent what.
//!
//! Numbers of bodies are multiples of a power of two, so that most of their bits are those of the message before. The bytes of a body are
//! combined with those before by XOR, and sorted by their place in a number, the first bytes of all before the second ones: long runs of zeros are
//! left, which compress.

use crate::wire::{BadMessage, MESSAGE_MAX, Moment, VERSION};
use flate2::Compression;
use flate2::read::{DeflateDecoder, DeflateEncoder};
use glam::{DQuat, DVec3};
use metachron_core::{AgentId, Body, CurveState, RigidState, Snapshot, SoftState, ToolState};
use std::collections::HashMap;
use std::io::Read;
use std::sync::Arc;

/// Places are multiples of 2⁻¹⁷ m, 8 µm: a pixel is larger at any distance from which it shows a metre.
const PLACE_BITS: i32 = 17;
/// Velocities are multiples of 2⁻¹⁰ m/s or rad/s: a state is led on by them from frame to frame, where 8 µm of error come of it.
const SPEED_BITS: i32 = 10;
/// Components of rotations are multiples of 2⁻¹⁷.
const TURN_BITS: i32 = 17;

/// A message of states without their bodies, and what changed of these.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
struct Sketch {
    moment: Moment,
    /// Of each state.
    bodies: Vec<BodyBytes>,
}

/// A rounded body in postcard's form.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
enum BodyBytes {
    Whole(Vec<u8>),
    /// Combined with the bytes before by XOR, in planes.
    Changed(Vec<u8>),
}

/// The bytes of a message; `before` are the states that callers have of its objects.
///
/// # Errors
/// [`BadMessage::TooLong`], and [`BadMessage::Malformed`] for a state that no message can have.
pub(crate) fn encode(moment: &Moment, before: &HashMap<AgentId, Arc<Snapshot>>) -> Result<Vec<u8>, BadMessage> {
    let malformed = |error: postcard::Error| BadMessage::Malformed(error.to_string());
    let (mut moment, mut bodies) = (moment.clone(), Vec::new());
    for object in &mut moment.states {
        let bytes = bytes(&object.state.body).map_err(malformed)?;
        let known = before.get(&object.id).map(|known| self::bytes(&known.body)).transpose().map_err(malformed)?;
        bodies.push(match known.filter(|known| known.len() == bytes.len()) {
            Some(known) => BodyBytes::Changed(planes(&combined(bytes, &known))),
            None => BodyBytes::Whole(bytes),
        });
        object.state = Arc::new(Snapshot { body: Body::Nothing, ..Snapshot::clone(&object.state) });
    }
    let plain = postcard::to_stdvec(&Sketch { moment, bodies }).map_err(malformed)?;
    let mut sent = vec![VERSION];
    let compressed = DeflateEncoder::new(&*plain, Compression::fast()).read_to_end(&mut sent);
    compressed.map_err(|error| BadMessage::Malformed(error.to_string()))?;
    if plain.len().max(sent.len()) > MESSAGE_MAX { Err(BadMessage::TooLong(plain.len())) } else { Ok(sent) }
}

/// The bodies that a caller has, in bytes, as of a message.
#[derive(Debug, Default)]
pub(crate) struct Sketches {
    sequence: u64,
    bodies: HashMap<AgentId, Vec<u8>>,
}

/// The changes that a message brings to the bodies that a caller has.
#[derive(Debug, Default)]
pub(crate) struct Change {
    sequence: u64,
    bodies: Vec<(AgentId, Vec<u8>)>,
    gone: Vec<AgentId>,
}

/// A message that was read.
#[derive(Debug)]
pub(crate) enum Sketched {
    /// The one after the newest, and its change, which is applied once its numbers are checked.
    Next(Moment, Change),
    /// One that is known.
    Old,
    /// A later one: what it changes is not there.
    Later,
}

impl Sketches {
    /// Begins anew with all states.
    pub fn begin(&mut self, all: &[Moment]) {
        let states = all.iter().flat_map(|part| &part.states);
        self.sequence = all.first().map_or(0, |first| first.sequence);
        self.bodies = states.filter_map(|object| Some((object.id, bytes(&object.state.body).ok()?))).collect();
    }

    /// The message in these bytes.
    ///
    /// # Errors
    /// [`BadMessage`], also for what changed of a body that is not there.
    pub fn decode(&self, sent: &[u8]) -> Result<Sketched, BadMessage> {
        let malformed = |reason: String| BadMessage::Malformed(reason);
        let (version, compressed) = sent.split_first().ok_or_else(|| malformed("it is empty".to_owned()))?;
        if *version != VERSION {
            return Err(BadMessage::OtherVersion(*version));
        }
        let mut plain = Vec::new();
        let bounded = DeflateDecoder::new(compressed).take(MESSAGE_MAX as u64 + 1).read_to_end(&mut plain);
        bounded.map_err(|error| malformed(error.to_string()))?;
        if plain.len() > MESSAGE_MAX {
            return Err(BadMessage::TooLong(plain.len()));
        }
        let Sketch { mut moment, bodies } =
            postcard::from_bytes(&plain).map_err(|error| malformed(error.to_string()))?;
        if bodies.len() != moment.states.len() {
            return Err(malformed("it has another number of bodies than of states".to_owned()));
        }
        if Some(moment.sequence) != self.sequence.checked_add(1) {
            return Ok(if moment.sequence <= self.sequence { Sketched::Old } else { Sketched::Later });
        }
        let gone = moment.gone.clone();
        let mut change = Change { sequence: moment.sequence, bodies: Vec::with_capacity(bodies.len()), gone };
        for (object, sent) in moment.states.iter_mut().zip(bodies) {
            let whole = match (sent, self.bodies.get(&object.id)) {
                (BodyBytes::Whole(bytes), _) => bytes,
                (BodyBytes::Changed(change), Some(known)) if change.len() == known.len() => {
                    combined(numbers(&change), known)
                }
                (BodyBytes::Changed(_), _) => return Err(malformed("it changes a body that is not there".to_owned())),
            };
            let mut body: Body = postcard::from_bytes(&whole).map_err(|error| malformed(error.to_string()))?;
            turns(&mut body).for_each(|rotation| *rotation = rotation.normalize());
            object.state = Arc::new(Snapshot { body, ..Snapshot::clone(&object.state) });
            change.bodies.push((object.id, whole));
        }
        Ok(Sketched::Next(moment, change))
    }

    /// Goes on from a message that was found sound.
    pub fn apply(&mut self, Change { sequence, bodies, gone }: Change) {
        self.bodies.extend(bodies);
        gone.iter().for_each(|id| drop(self.bodies.remove(id)));
        self.sequence = sequence;
    }
}

fn combined(mut bytes: Vec<u8>, known: &[u8]) -> Vec<u8> {
    bytes.iter_mut().zip(known).for_each(|(byte, known)| *byte ^= known);
    bytes
}

/// The bytes of a number.
const WIDTH: usize = size_of::<f64>();

/// The bytes by their places in numbers: every eighth from the first on, then every eighth from the second on, and so forth.
fn planes(bytes: &[u8]) -> Vec<u8> {
    (0..WIDTH).flat_map(|plane| bytes.iter().skip(plane).step_by(WIDTH).copied()).collect()
}

/// The bytes of which these are the planes.
fn numbers(planes: &[u8]) -> Vec<u8> {
    let (mut bytes, mut left) = (vec![0; planes.len()], planes.iter());
    for plane in 0..WIDTH {
        bytes.iter_mut().skip(plane).step_by(WIDTH).zip(&mut left).for_each(|(byte, of_plane)| *byte = *of_plane);
    }
    bytes
}

/// The bytes of a rounded body.
fn bytes(body: &Body) -> Result<Vec<u8>, postcard::Error> {
    let mut body = body.clone();
    round(&mut body);
    postcard::to_stdvec(&body)
}

fn grid(number: f64, bits: i32) -> f64 {
    let steps = f64::from(bits).exp2();
    // without the sign of a zero
    (number * steps).round() / steps + 0.0
}

fn round(body: &mut Body) {
    let vector = |vector: &mut DVec3, bits: i32| *vector = vector.to_array().map(|number| grid(number, bits)).into();
    let all = |vectors: &mut [DVec3], bits: i32| vectors.iter_mut().for_each(|one| vector(one, bits));
    match body {
        Body::Nothing => {}
        Body::Rigid(RigidState { position, velocity, spin, .. }) => {
            vector(position, PLACE_BITS);
            [velocity, spin].into_iter().for_each(|one| vector(one, SPEED_BITS));
        }
        Body::Tool(ToolState { tip, led, velocity, spin, .. }) => {
            [tip, led].into_iter().for_each(|one| vector(one, PLACE_BITS));
            [velocity, spin].into_iter().for_each(|one| vector(one, SPEED_BITS));
        }
        Body::Curve(CurveState { positions, velocities, radii_m, flattening_m, .. }) => {
            all(positions, PLACE_BITS);
            all(velocities, SPEED_BITS);
            flattening_m.iter_mut().for_each(|two| *two = two.to_array().map(|number| grid(number, PLACE_BITS)).into());
            // radii stay above zero
            radii_m.iter_mut().for_each(|radius| *radius = f64::from(*radius as f32));
        }
        Body::Soft(SoftState { positions, velocities, nodes }) => {
            all(positions, PLACE_BITS);
            all(velocities, SPEED_BITS);
            if let Some(nodes) = nodes {
                all(&mut nodes.positions, PLACE_BITS);
                all(&mut nodes.velocities, SPEED_BITS);
            }
        }
    }
    let turned = |rotation: &DQuat| rotation.to_array().map(|number| grid(number, TURN_BITS));
    turns(body).for_each(|rotation| *rotation = DQuat::from_array(turned(rotation)));
}

/// All its rotations.
fn turns(body: &mut Body) -> impl Iterator<Item = &mut DQuat> {
    let (one, many): (Option<&mut DQuat>, &mut [DQuat]) = match body {
        Body::Rigid(body) => (Some(&mut body.rotation), &mut []),
        Body::Tool(tool) => (Some(&mut tool.rotation), &mut []),
        Body::Curve(curve) => (None, &mut curve.frames),
        Body::Soft(_) | Body::Nothing => (None, &mut []),
    };
    one.into_iter().chain(many)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::ObjectState;
    use metachron_core::SimTime;

    /// A tube that waves, at a step.
    fn wave(step: u32) -> Arc<Snapshot> {
        let node =
            |at: u32| DVec3::new(0.01 * f64::from(at), 0.1 * f64::from(at + step).sin(), 0.3 + 1e-4 * f64::from(step));
        let frame = |at: u32| DQuat::from_rotation_x(0.1 * f64::from(at + step));
        let curve = CurveState {
            arc_m: (0..200).map(|at| 0.01 * f64::from(at)).collect(),
            positions: (0..200).map(node).collect(),
            velocities: (0..200).map(|at| node(at) * 0.1).collect(),
            frames: (0..199).map(frame).collect(),
            radii_m: vec![0.012; 200],
            flattening_m: Vec::new(),
        };
        Arc::new(Snapshot { body: Body::Curve(curve), energy_j: f64::from(step), ..Snapshot::default() })
    }

    fn moment(step: u32) -> Moment {
        let state = ObjectState { id: AgentId(0), name: "gut".into(), state: wave(step) };
        let time = SimTime::from_nanos(u64::from(step));
        Moment { run: 7, sequence: u64::from(step), time, states: vec![state], ..Moment::default() }
    }

    fn sent(step: u32, before: u32) -> Vec<u8> {
        encode(&moment(step), &HashMap::from([(AgentId(0), wave(before))])).unwrap()
    }

    #[test]
    fn rounded_states_are_those_of_the_world_within_half_a_step_of_their_grids() {
        let mut sketches = Sketches::default();
        sketches.begin(&[moment(1)]);
        for step in 2..20 {
            let Ok(Sketched::Next(read, change)) = sketches.decode(&sent(step, step - 1)) else {
                panic!("the next one")
            };
            sketches.apply(change);
            let (there, is) = (&read.states[0].state, wave(step));
            let (Body::Curve(there_is), Body::Curve(is_there)) = (&there.body, &is.body) else { panic!("a tube") };
            let place =
                (there_is.positions.iter().zip(&is_there.positions)).map(|(a, b)| (*a - *b).abs().max_element());
            let speed =
                (there_is.velocities.iter().zip(&is_there.velocities)).map(|(a, b)| (*a - *b).abs().max_element());
            // half of 2⁻¹⁷ m and of 2⁻¹⁰ m/s
            assert!(place.fold(0.0, f64::max) <= 3.9e-6 && speed.fold(0.0, f64::max) <= 4.9e-4);
            assert!(there_is.frames.iter().zip(&is_there.frames).all(|(a, b)| a.angle_between(*b) < 3e-5));
            assert!(there_is.frames.iter().all(|frame| (frame.length() - 1.0).abs() < 1e-12));
            assert_eq!((there.energy_j, read.time), (is.energy_j, moment(step).time));
        }
    }

    #[test]
    fn a_message_that_was_missed_is_noticed_and_an_old_one_changes_nothing() {
        let mut sketches = Sketches::default();
        sketches.begin(&[moment(3)]);
        assert!(matches!(sketches.decode(&sent(3, 2)), Ok(Sketched::Old)));
        assert!(matches!(sketches.decode(&sent(5, 4)), Ok(Sketched::Later)));
        assert!(matches!(sketches.decode(&sent(4, 3)), Ok(Sketched::Next(..))));
    }

    #[test]
    fn bytes_of_no_message_are_refused_and_ask_for_no_storage() {
        let mut sketches = Sketches::default();
        sketches.begin(&[moment(1)]);
        // a body that is not there, and a number of bodies that is not that of states
        let foreign =
            Moment { states: vec![ObjectState { id: AgentId(9), ..moment(2).states[0].clone() }], ..moment(2) };
        let known = HashMap::from([(AgentId(9), wave(1))]);
        assert!(sketches.decode(&encode(&foreign, &known).unwrap()).is_err());
        // 64 MiB of zeros
        let mut bomb = vec![VERSION];
        let zeros = vec![0; 4 * MESSAGE_MAX];
        DeflateEncoder::new(&*zeros, Compression::best()).read_to_end(&mut bomb).unwrap();
        assert!(bomb.len() < 1 << 20 && matches!(sketches.decode(&bomb), Err(BadMessage::TooLong(_))));
        let good = sent(2, 1);
        let mut state = 1_u64;
        for _ in 0..2_000 {
            let mut bytes = good.clone();
            // the generator of Knuth's MMIX
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let at = (state >> 33) as usize % bytes.len();
            bytes[at] = (state >> 20) as u8;
            let _ = sketches.decode(&bytes);
        }
        assert!(matches!(sketches.decode(&good), Ok(Sketched::Next(..))));
    }
}
