//! A pair that is searched for places that may close, and the name of a contact found.
//!
//! In: members with the velocities they have and would have. Out: what a round of the search goes by, owners of contacts. Never here: the search.

use crate::detect::ClusterScene;
use crate::member::Participant;
use crate::member::memory::{Partner, Spin};
use crate::member::state::Progress;
use glam::DVec3;
use metachron_geometry::Place;
use metachron_geometry::narrow_phase::{StaticSolid, TouchKey};

/// A place is taken up if its gap may close below this within the step, metres.
pub(crate) const LOOK_M: f64 = 4e-4;
/// Sides that are closer than this have met, metres.
pub(crate) const MET_M: f64 = 1e-6;

/// Where a contact belongs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Owner {
    /// The participant that remembers it: the lower number, side 0.
    pub member: usize,
    pub partner: Partner,
    /// The participant on side 1, where there is one.
    pub other: Option<usize>,
    /// The name of the place within its pair.
    pub key: TouchKey,
    /// Its friction about the normal.
    pub spin: Spin,
    /// The point of the participant's skin.
    pub place: Place,
    /// Newton's coefficient of restitution of its pair, 0 to 1.
    pub restitution: f64,
}

impl Owner {
    pub(crate) fn name(&self) -> (usize, Partner, TouchKey) {
        (self.member, self.partner, self.key)
    }

    /// The pair that it belongs to.
    pub const fn pair(&self) -> (usize, Partner) {
        (self.member, self.partner)
    }

    /// Its participants.
    pub fn both(&self) -> impl Iterator<Item = usize> + use<> {
        std::iter::once(self.member).chain(self.other)
    }
}

/// What a round of the search goes by.
pub(crate) struct Round<'a, 'p> {
    pub scene: &'a ClusterScene,
    pub all: &'a [Participant<'p>],
    pub progress: &'a [Progress],
    pub h_s: f64,
    pub judge: Judge,
}

/// By which velocities a place is judged.
#[derive(Clone, Copy)]
pub(crate) enum Judge {
    /// Those at the start and without contact, each side's alone too.
    Predicted,
    /// Those of a solution.
    Solved,
}

/// What a member is searched against.
#[derive(Clone, Copy)]
pub(crate) enum Against<'a> {
    /// Another member.
    Member(usize),
    /// A static solid, with its number.
    Static { number: u32, solid: &'a StaticSolid },
    /// The member itself.
    Own,
}

/// A member and what it is searched against.
#[derive(Clone, Copy)]
pub(crate) struct Pair<'a> {
    pub(crate) member: usize,
    pub(crate) against: Against<'a>,
}

/// How far a pair is searched.
#[derive(Clone, Copy)]
pub(crate) struct Reaching {
    /// From where it is, metres.
    pub(crate) reach_m: f64,
    /// On its way, at the moment at which it is this near; `None` for a pair that is searched where it is.
    pub(crate) swept_m: Option<f64>,
}

impl<'a> Round<'a, '_> {
    /// Whether it is the one before the solve.
    pub(crate) fn predicts(&self) -> bool {
        matches!(self.judge, Judge::Predicted)
    }

    /// The velocities at which a member's place moves, as far as this round knows.
    pub(crate) fn moved(&self, member: usize) -> &'a [DVec3] {
        let state = &self.progress[member];
        if self.predicts() { &state.v_predicted } else { &state.v_mean }
    }
}

impl Pair<'_> {
    /// The member on side 1; `None` for a static solid.
    pub(crate) fn other(&self) -> Option<usize> {
        match self.against {
            Against::Member(other) => Some(other),
            Against::Own => Some(self.member),
            Against::Static { .. } => None,
        }
    }
}
