//! An agent's publication: its whole visible state at one moment of its own time.
//!
//! In: an agent writes itself into a [`Snapshot`] that is reused (no allocation once the sizes settle).
//! Out: drawing, coupling, probes and hashes read it. Never here: its transport between threads (the runtime does that).

use crate::{AgentId, Body, Bounds, ClusterState, Grip, Resolution, SimSpan, SimTime};
use crate::{AttachmentEvent, ContactState, JointEffort, Ledger, LocalModel, PairState, Removed, SensorTouch, Wrench};
use glam::{DMat3, DQuat, DVec3};

/// The state an agent last published, stamped with its own time.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub struct Snapshot {
    /// The agent's own time, written by the runtime when it publishes.
    pub time: SimTime,
    /// Delay of its time behind the scene's, written likewise: an agent that cannot keep up with its neighbours continues delayed.
    pub clock_offset: SimSpan,
    /// Number of its steps so far, written likewise; steps that a cluster divides further count once.
    pub steps: u64,
    /// The resolution that the simulation runs at; `None` for a model that has none.
    pub resolution: Option<Resolution>,
    /// Number of nodes whose motion is solved for, held ones included; `None` for a model without nodes.
    pub nodes: Option<u32>,
    /// Position and motion of the agent's matter.
    pub body: Body,
    /// Mechanical energy in joules: kinetic + elastic + gravity, zero at the origin.
    pub energy_j: f64,
    /// The agent's estimate of its own error, in metres, ≥ 0.
    pub residual_m: f64,
    /// The part of it that steps accumulate in [`crate::DRIFT_S`], metres, ≥ 0; the rest comes from its spacing.
    pub drift_m: f64,
    /// Agents that this one acts on now: they must not sleep meanwhile.
    pub touches: Vec<AgentId>,
    /// Grasp and spring forces on this agent.
    pub grips: Vec<Grip>,
    /// Whether the agent is at rest: others treat it as immovable until they wake it.
    pub at_rest: bool,
    /// Its smooth acceleration, m/s², without couplings and impacts. Others predict its motion by it.
    pub acceleration: DVec3,
    /// The mean change of its spin in the last step, rad/s², world axes; zero for all but dynamic rigid bodies.
    pub angular_acceleration: DVec3,
    /// Its response to impulses.
    pub inertia: Inertia,
    /// The bounding box of its matter; `None` where nothing of it can be touched.
    pub bounds: Option<Bounds>,
    /// Impulses given to others, in couplings that it owns.
    pub given: Vec<Ledger>,
    /// Impulses taken from others, in couplings that they own.
    pub taken: Vec<Ledger>,
    /// How it answers the partners of its asynchronous pairs; no blocks where it has none near.
    pub local_model: LocalModel,
    /// The couplings that it owns.
    pub pairs: Vec<PairState>,
    /// Its contacts in the cluster that steps it, but for agents of lower numbers: these publish theirs.
    pub contacts: Vec<ContactState>,
    /// The contact wrench on it in that cluster, the mean of the last step, about its centre of mass; zero for a deformable.
    /// In a rigid pile that rapier3d steps it contains normal impulses alone.
    pub contact_wrench: Wrench,
    /// The efforts of the hinges and slides whose first body it is, the means of the last step.
    pub efforts: Vec<JointEffort>,
    /// Its part in a contact cluster; `None` where it steps by itself.
    pub cluster: Option<ClusterState>,
    /// Rigid bodies that it has touched for so long that the two should share one clock.
    pub bonds: Vec<AgentId>,
    /// The events of its attachments since the start; each is reported by one of its two agents.
    pub events: Vec<AttachmentEvent>,
    /// The touches of sensors that it took part in since the start; each pair is reported by one of its two agents.
    pub sensed: Vec<SensorTouch>,
    /// The matter taken out of it since the start.
    pub removed: Removed,
}

/// A body's response to impulses: its inverse mass, at the time of the snapshot.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub enum Inertia {
    /// Immovable, or its response to impulses is not published.
    #[default]
    Immovable,
    /// A rigid body about its centre of mass.
    Rigid {
        /// Along the axes of the world, 1/kg; zero along one that is locked.
        inverse_mass: DVec3,
        /// 1/(kg·m²), world axes; zero about one that is locked.
        inverse_inertia: DMat3,
    },
}

impl Snapshot {
    /// Empties the fields that an agent may leave unset, keeping the storage. Ledgers stay, for agents with ledgers to
    /// overwrite: their storage is nested.
    pub fn clear(&mut self) {
        self.touches.clear();
        self.grips.clear();
        (self.at_rest, self.acceleration, self.bounds) = (false, DVec3::ZERO, None);
        self.angular_acceleration = DVec3::ZERO;
        (self.drift_m, self.removed) = (0.0, Removed::default());
        self.pairs.clear();
        self.contacts.clear();
        self.contact_wrench = Wrench::default();
        self.efforts.clear();
        self.cluster = None;
        self.bonds.clear();
        self.events.clear();
        self.sensed.clear();
    }

    /// The scene time that it belongs to: its own time plus its delay.
    #[must_use]
    pub fn moment(&self) -> SimTime {
        self.time + self.clock_offset
    }

    /// Whether every number that others use is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.body.is_finite()
            && self.acceleration.is_finite()
            && self.angular_acceleration.is_finite()
            && self.grips.iter().all(|grip| grip.force_n.is_finite())
            && self.given.iter().all(Ledger::is_finite)
            && self.local_model.is_finite()
            && [self.energy_j, self.residual_m, self.drift_m].iter().all(|x| x.is_finite())
            && self.bounds.is_none_or(|b| b.low.is_finite() && b.high.is_finite() && b.speed_m_s.is_finite())
    }

    /// Folds every bit of the state into `hash` (FNV-1a, 64 bits): equal hashes mean bit-identical runs.
    #[must_use]
    pub fn fold_hash(&self, hash: u64) -> u64 {
        let mut fold = Fold(hash);
        fold.word(self.time.as_nanos());
        fold.word(self.steps);
        match &self.body {
            Body::Nothing => {}
            Body::Curve(c) => {
                c.positions.iter().chain(&c.velocities).for_each(|v| fold.vector(*v));
                c.frames.iter().for_each(|q| fold.rotation(*q));
                c.radii_m.iter().for_each(|r| fold.word(r.to_bits()));
                c.flattening_m.iter().for_each(|f| f.to_array().into_iter().for_each(|x| fold.word(x.to_bits())));
            }
            Body::Rigid(b) => {
                [b.position, b.velocity, b.spin].into_iter().for_each(|v| fold.vector(v));
                fold.rotation(b.rotation);
            }
            Body::Tool(t) => {
                [t.tip, t.velocity].into_iter().for_each(|v| fold.vector(v));
                fold.rotation(t.rotation);
                fold.word(t.jaw.to_bits());
            }
            Body::Soft(s) => s.positions.iter().chain(&s.velocities).for_each(|v| fold.vector(*v)),
        }
        fold.0
    }
}

/// The empty hash that [`Snapshot::fold_hash`] starts from (FNV-1a offset basis).
pub const HASH_START: u64 = 0xcbf2_9ce4_8422_2325;

struct Fold(u64);

impl Fold {
    fn word(&mut self, word: u64) {
        const FNV_PRIME: u64 = 0x0100_0000_01b3;
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(FNV_PRIME);
        }
    }

    fn vector(&mut self, v: DVec3) {
        v.to_array().into_iter().for_each(|x| self.word(x.to_bits()));
    }

    fn rotation(&mut self, q: DQuat) {
        q.to_array().into_iter().for_each(|x| self.word(x.to_bits()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CurveState;

    fn line() -> CurveState {
        CurveState {
            arc_m: vec![0.0, 1.0, 3.0],
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::X * 3.0],
            velocities: vec![DVec3::ZERO, DVec3::Z, DVec3::Z],
            frames: vec![DQuat::IDENTITY; 2],
            radii_m: vec![0.1; 3],
            flattening_m: vec![],
        }
    }

    #[test]
    fn a_probe_reads_the_material_point_at_its_share_of_the_rest_length() {
        let body = Body::Curve(line());
        assert_eq!(body.probe(0.5).unwrap().0, DVec3::X * 1.5);
        assert_eq!(body.probe(0.0).unwrap().0, DVec3::ZERO);
        assert_eq!(body.probe(1.0).unwrap().0, DVec3::X * 3.0);
        assert_eq!(body.probe(9.0).unwrap().0, DVec3::X * 3.0);
    }

    #[test]
    fn an_empty_curve_has_no_point() {
        assert_eq!(Body::Curve(CurveState::default()).probe(0.5), None);
    }

    #[test]
    fn one_changed_bit_changes_the_hash() {
        let mut snapshot = Snapshot { body: Body::Curve(line()), ..Snapshot::default() };
        let before = snapshot.fold_hash(HASH_START);
        snapshot.body.curve_mut().positions[1].y = f64::MIN_POSITIVE;
        assert_ne!(before, snapshot.fold_hash(HASH_START));
    }
}
