//! The account of a macro step: of all of it, of each pair, of each participant.
//!
//! In: impulses of contacts and rows, reports of solves. Out: sums, by participants and partners. Never here: which rows there are, the solve.

use crate::constraint::JointTotal;
use crate::lists::{entry, reset};
use crate::member::GuardedMember;
use crate::member::memory::Partner;
use crate::solve::Report;
use glam::DVec3;
use metachron_core::{SolveLevel, Wrench};

/// Counts and figures of a macro step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ClusterReport {
    /// Fine steps that it was made in.
    pub fine_steps: u32,
    /// Fine steps begun, those given up because a member needed shorter ones among them; at most [`FINE_STEPS_MAX`](super::FINE_STEPS_MAX).
    pub begun_steps: u32,
    /// Contacts of the last fine step, unloaded ones included.
    pub contacts: u32,
    /// The contacts of a rigid pile among them, which rapier3d has; all others are the problem's.
    pub pile_contacts: u32,
    /// Factors of the coupled matrix in all fine steps.
    pub factors: u32,
    /// Products of conjugate gradients in all fine steps: of the iterative form, which makes no factors.
    pub products: u32,
    /// Solves in all fine steps.
    pub solves: u32,
    /// The solves among them that ended within interior points, before all laws held.
    pub unfinished: u32,
    /// The dearest level of a solve.
    pub level: SolveLevel,
    /// The most by which the answer of any solve misses laws and momentum, m/s (clusters.md, eq. 9).
    pub miss_m_s: f64,
    /// The deepest overlap seen, metres.
    pub depth_m: f64,
    /// Work of all members, in the unit of [`metachron_core::StepReport::work`].
    pub work: f64,
}

/// The impulses of a pair of bodies, or of a link, in a macro step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairTotal {
    /// The participant of lower number, by its place in the list.
    pub member: usize,
    /// The partner that it touched, or the link by which it is held.
    pub partner: Partner,
    /// The impulse on the participant, world axes, N·s.
    pub impulse_n_s: DVec3,
    /// Places that bore something, or rows of the link, counted in every fine step; zero for a pair that only touches.
    pub contacts: u32,
    /// The deepest overlap, metres, ≥ 0.
    pub depth_m: f64,
    /// The most that one contact gave in a fine step, in a rigid pile in a step of rapier3d, N·s; zero for links.
    pub most_n_s: f64,
    /// Where that contact is, metres; not a number for links.
    pub point_m: DVec3,
    /// Its normal, towards the participant, of length 1; zero for links.
    pub normal: DVec3,
    /// How easily the participant and its partner give way at that contact along its normal, 1/kg, ≥ 0 (coupling.md, eq. 7h); `None` for links
    /// and in rigid piles.
    pub inverse_mass_per_kg: Option<[f64; 2]>,
    /// How much more the pair bears along that normal for each metre that a side which a user leads is led on towards the other, N/m, ≥ 0
    /// (coupling.md, eq. 7s). 0 where a user leads neither, in rigid piles, and where neither gives way.
    pub stiffness_n_m: f64,
}

impl PairTotal {
    /// Adds the impulse of a contact or of a link's row.
    pub(super) fn add(&mut self, impulse_n_s: DVec3, depth_m: f64) {
        self.impulse_n_s += impulse_n_s;
        self.depth_m = self.depth_m.max(depth_m);
        self.contacts += 1;
    }
}

/// Adds an impulse at a point to the contact wrench of a body, if that moves as a whole.
pub(super) fn give(wrench: &mut Wrench, member: &GuardedMember<'_>, impulse_n_s: DVec3, point_m: DVec3) {
    if let Some(pose) = member.pose(&[], 0.0) {
        wrench.add(impulse_n_s, point_m - pose.centre_m);
    }
}

/// The total of a pair, made where it is new.
pub(super) fn total_of(totals: &mut Vec<PairTotal>, member: usize, partner: Partner) -> &mut PairTotal {
    let order = |total: &PairTotal| (total.member, total.partner);
    entry(totals, &(member, partner), order, || PairTotal {
        member,
        partner,
        impulse_n_s: DVec3::ZERO,
        contacts: 0,
        depth_m: 0.0,
        most_n_s: 0.0,
        point_m: DVec3::NAN,
        normal: DVec3::ZERO,
        inverse_mass_per_kg: None,
        stiffness_n_m: 0.0,
    })
}

impl ClusterReport {
    /// Counts a solve.
    pub(super) fn add(&mut self, took: &Report) {
        self.factors += took.factors as u32;
        self.products += took.products as u32;
        self.solves += 1;
        self.unfinished += u32::from(took.level == SolveLevel::Interior);
        self.level = self.level.max(took.level);
        self.miss_m_s = self.miss_m_s.max(took.miss_m_s);
    }
}

/// The sums over all fine steps of a macro step.
#[derive(Debug, Default)]
pub(super) struct Sums {
    /// The impulses of pairs and links, by participants and partners.
    pub totals: Vec<PairTotal>,
    /// The contact impulse on each participant, N·s and N·m·s.
    pub wrenches: Vec<Wrench>,
    /// The impulses of joints along the directions that they leave free.
    pub efforts: Vec<JointTotal>,
}

impl Sums {
    /// Begins a macro step of so many participants, for the first time or again.
    pub fn begin(&mut self, participants: usize) {
        let Self { totals, wrenches, efforts } = self;
        totals.clear();
        efforts.clear();
        reset(wrenches, participants, Wrench::default());
    }
}
