//! What an agent publishes: its whole visible state at one moment of its own time.
//!
//! In: an agent writes itself into a [`Snapshot`] that is used again and again (no allocation once the sizes settle).
//! Out: drawing, coupling, probes and hashes read it. Never here: how it travels between threads (the runtime does that).

mod lies;
mod stand;
mod tips;

pub use lies::{LiesOn, Upheld};
pub use stand::Stand;
pub use stand::{Footprint, STANDING_M_S};
pub use tips::Tips;

use crate::{AgentId, Body, Bounds, Grip, ImpulseResponse, Rare, Resolution, SimSpan, SimTime};
use crate::{Ledger, PairState, Rebound, Six, Sprung};
use glam::{DMat3, DQuat, DVec3};
use std::any::Any;

/// The state an agent last published, stamped with its own time.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    /// The agent's own time, written by the runtime when it publishes.
    pub time: SimTime,
    /// How far behind the scene its time may lie, written like it: who cannot keep up beside others lives on, later.
    pub put_off: SimSpan,
    /// How long its last step was where that was shorter than its scene wants ([`metachron_contact::Agent::longest_step`]), written like its time; `None`
    /// elsewhere.
    pub shorter: Option<SimSpan>,
    /// How many steps led here.
    pub steps: u64,
    /// The resolution the simulation holds; `None` for a model that has none.
    pub resolution: Option<Resolution>,
    /// Where the agent's matter is and how it moves.
    pub body: Body,
    /// Mechanical energy in joules: kinetic + elastic + gravity, zero at the origin.
    pub energy_j: f64,
    /// The agent's estimate of its own error, in metres, ≥ 0.
    pub residual_m: f64,
    /// The part of it that steps make in [`crate::DRIFT_S`], metres, ≥ 0; the rest is what its spacing leaves.
    pub drift_m: f64,
    /// Agents this one acts on now: they must not rest meanwhile.
    pub touches: Vec<AgentId>,
    /// Forces by which others hold this agent.
    pub grips: Vec<Grip>,
    /// Whether the agent is at rest: others take it for immovable until they wake it.
    pub at_rest: bool,
    /// Whether something fixed bears it: what bends has touched some within a second, a rigid body stands, or has tipped within one.
    pub grounded: bool,
    /// Whether it steps in one world with others.
    pub shares: bool,
    /// Its smooth acceleration, m/s²: without what couplings and blows did. Others expect it to go on like this.
    pub acceleration: DVec3,
    /// How it answers impulses.
    pub inertia: Inertia,
    /// How it stands on something fixed; `None` where it does not, or not on one level.
    pub stand: Option<Stand>,
    /// How it tips over an edge or a corner that something fixed bears; none where it does not.
    pub tips: Rare<Tips>,
    /// In how many seconds of free flight something fixed may be in its way, ≥ 0; `None` where nothing is soon, and where that is not
    /// told: it stands, or others hold it.
    pub lands_s: Option<f64>,
    /// How springs on led points hold it; none where none do, or where nobody would have to know.
    pub sprung: Rare<Sprung>,
    /// What fixed solids gave it in its last step: it was not there before, and late impulses may have spared it.
    pub rebound: Rare<Rebound>,
    /// On whom it lies, where something fixed holds that one up.
    pub lies: Rare<LiesOn>,
    /// How it answers impulses among those whose world it shares, about its centre of mass: velocities (m/s, rad/s) of impulses (N·s,
    /// N·m·s); none where it shares none, or where something fixed holds that world.
    pub within: Rare<Six>,
    /// The box around its matter; `None` where nothing of it can be touched.
    pub bounds: Option<Bounds>,
    /// What it has given to others, in couplings that it owns.
    pub given: Vec<Ledger>,
    /// What it has taken from others, in couplings that they own.
    pub taken: Vec<Ledger>,
    /// The couplings that it owns.
    pub pairs: Vec<PairState>,
    /// Rigid bodies that it has touched for so long that the two should share one clock.
    pub bonds: Vec<AgentId>,
}

/// How a body answers impulses: its inverse mass, at the time of the snapshot.
#[derive(Debug, Clone, Default)]
pub enum Inertia {
    /// Nothing moves it.
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
    /// Empties what an agent may leave unsaid, keeping the storage. Ledgers stay for an agent that has some to write over:
    /// theirs is storage within storage.
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
        self.bonds.clear();
    }

    /// The moment of the scene that it belongs to: its own time, and how far that has been put off.
    #[must_use]
    pub fn moment(&self) -> SimTime {
        self.time + self.put_off
    }

    /// How long its steps are as a rule, seconds, where its scene wants `wanted_s`.
    #[must_use]
    pub fn step_s(&self, wanted_s: f64) -> f64 {
        self.shorter.map_or(wanted_s, SimSpan::as_secs_f64)
    }

    /// Whether every number that others act on is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.body.is_finite()
            && self.acceleration.is_finite()
            && self.sprung.get().is_none_or(Sprung::is_finite)
            && self.rebound.get().is_none_or(Rebound::is_finite)
            && self.lies.get().is_none_or(LiesOn::is_finite)
            && self.within.get().is_none_or(Six::is_finite)
            && self.tips.get().is_none_or(Tips::is_finite)
            && self.grips.iter().all(|grip| grip.force_n.is_finite())
            && self.given.iter().all(Ledger::is_finite)
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
