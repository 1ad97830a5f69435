//! An agent's publication: its whole visible state at one moment of its own time.
//!
//! In: an agent writes itself into a [`Snapshot`] that is reused (no allocation once the sizes settle).
//! Out: drawing, coupling, probes and hashes read it. Never here: its transport between threads (the runtime does that).

mod lies;
mod stand;
mod tips;

pub use lies::{LiesOn, Upheld};
pub use stand::Stand;
pub use stand::{Footprint, STANDING_M_S};
pub use tips::Tips;

use crate::{AgentId, Body, Bounds, ClusterState, Grip, ImpulseResponse, Resolution, ReusableOption, SimSpan, SimTime};
use crate::{Ledger, LocalModel, Mat6, PairState, Rebound, Sprung};
use glam::{DMat3, DQuat, DVec3};
use std::any::Any;

/// The state an agent last published, stamped with its own time.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    /// The agent's own time, written by the runtime when it publishes.
    pub time: SimTime,
    /// Delay of its time behind the scene's, written likewise: an agent that cannot keep up with its neighbours continues delayed.
    pub clock_offset: SimSpan,
    /// How long its last step was where that was shorter than its scene wants (`Agent::longest_step`), written like its time; `None`
    /// elsewhere.
    pub shortened_step: Option<SimSpan>,
    /// Number of steps so far.
    pub steps: u64,
    /// The resolution that the simulation runs at; `None` for a model that has none.
    pub resolution: Option<Resolution>,
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
    /// Whether a fixed solid supports it: a deformable touched one within the last second, a rigid body stands on one, or tipped within the
    /// last second.
    pub grounded: bool,
    /// Whether it steps in one island with others.
    pub shares: bool,
    /// Its smooth acceleration, m/s², without couplings and impacts. Others predict its motion by it.
    pub acceleration: DVec3,
    /// Its response to impulses.
    pub inertia: Inertia,
    /// Its support by a fixed solid; `None` where there is none, or not on a single level.
    pub stand: Option<Stand>,
    /// Its tipping about an edge or a corner that a fixed solid supports; none where it does not tip.
    pub tips: ReusableOption<Tips>,
    /// Seconds of free flight until a fixed solid may be in its way, ≥ 0; `None` where there is none soon, and where it is not
    /// reported: the body is supported, or held by others.
    pub lands_s: Option<f64>,
    /// Forces and stiffness of the springs from driven points on it; none without such springs, or where no other agent needs them.
    pub sprung: ReusableOption<Sprung>,
    /// Impulses of fixed solids in its last step: it was not in contact before, and late impulses of others may have averted them.
    pub rebound: ReusableOption<Rebound>,
    /// The agent on which it rests, where a fixed solid supports that one.
    pub lies: ReusableOption<LiesOn>,
    /// Its response to impulses within the island that it shares, about its centre of mass: velocities (m/s, rad/s) caused by
    /// impulses (N·s, N·m·s); none where it shares none, or where a fixed solid holds that island.
    pub within: ReusableOption<Mat6>,
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
    /// Its part in a contact cluster; `None` where it steps by itself.
    pub cluster: Option<ClusterState>,
    /// Rigid bodies that it has touched for so long that the two should share one clock.
    pub bonds: Vec<AgentId>,
}

/// A body's response to impulses: its inverse mass, at the time of the snapshot.
#[derive(Debug, Clone, Default)]
pub enum Inertia {
    /// Immovable.
    #[default]
    Immovable,
    /// A rigid body about its centre of mass.
    Rigid {
        /// 1/kg.
        inverse_mass: f64,
        /// 1/(kg·m²), world axes.
        inverse_inertia: DMat3,
    },
    /// A deformable: the factor of its own step.
    Deformable(Box<dyn ImpulseResponse>),
}

impl Inertia {
    /// The response of a deformable; `None` of any other body.
    #[must_use]
    pub fn response(&self) -> Option<&dyn ImpulseResponse> {
        match self {
            Self::Deformable(response) => Some(response.as_ref()),
            _ => None,
        }
    }

    /// A model's own response to write into, keeping its storage when it is one of that type already.
    pub fn response_mut<R: ImpulseResponse + Default>(&mut self) -> &mut R {
        if !matches!(self, Self::Deformable(response) if (response.as_ref() as &dyn Any).is::<R>()) {
            *self = Self::Deformable(Box::<R>::default());
        }
        match self {
            Self::Deformable(response) => {
                (response.as_mut() as &mut dyn Any).downcast_mut().expect("of this type since above")
            }
            _ => unreachable!("made a deformable above"),
        }
    }
}

impl Snapshot {
    /// Empties what an agent may leave unset, keeping the storage. Ledgers stay, for agents with ledgers to overwrite:
    /// their storage is nested.
    pub fn clear(&mut self) {
        self.touches.clear();
        self.grips.clear();
        (self.at_rest, self.shares, self.acceleration, self.bounds) = (false, false, DVec3::ZERO, None);
        (self.stand, self.grounded) = (None, false);
        self.tips.set(None);
        self.drift_m = 0.0;
        self.sprung.set(None);
        self.rebound.set(None);
        self.lies.set(None);
        self.within.set(None);
        self.pairs.clear();
        self.cluster = None;
        self.bonds.clear();
    }

    /// The scene time that it belongs to: its own time plus its delay.
    #[must_use]
    pub fn moment(&self) -> SimTime {
        self.time + self.clock_offset
    }

    /// Its usual step length, seconds, where its scene requests `wanted_s`.
    #[must_use]
    pub fn step_s(&self, wanted_s: f64) -> f64 {
        self.shortened_step.map_or(wanted_s, SimSpan::as_secs_f64)
    }

    /// Whether every number that others use is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.body.is_finite()
            && self.acceleration.is_finite()
            && self.sprung.get().is_none_or(Sprung::is_finite)
            && self.rebound.get().is_none_or(Rebound::is_finite)
            && self.lies.get().is_none_or(LiesOn::is_finite)
            && self.within.get().is_none_or(Mat6::is_finite)
            && self.tips.get().is_none_or(Tips::is_finite)
            && self.grips.iter().all(|grip| grip.force_n.is_finite())
            && self.given.iter().all(Ledger::is_finite)
            && self.local_model.is_finite()
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
