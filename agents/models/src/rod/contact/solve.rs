//! Couples contact into the rod's own step, between its solve and its move.
//!
//! In: the state at the start of a substep, its free velocities and its factor. Out: velocities that keep the skin apart.
//! Never here: contact detection ([`super::TubeContacts::find`]). Theory: `docs/theory/contact.md`, eq. 5 and 22–23.

use super::{RELATED_KEYS, RELATED_KEYS_WITHOUT_PEERS, Skin, TubeContacts, node_slot, segment_slot};
use crate::rod::banded_ldl::{Factor, Row};
use crate::rod::company::Company;
use crate::rod::discretization::Discretization;
use crate::rod::state::RodMaterial;
use glam::DVec3;
use metachron_contact::{Owner, Problem, Settings};

/// Tolerance of a tube's contacts: 10 µm/s, a tenth of the speed that counts as rest.
/// A stiff tube (10⁸ Pa) that lands flat takes 30 solves with the factor, a soft one at rest takes one or two.
const SETTINGS: Settings = Settings { iterations: 300, tolerance_m_s: 1e-5 };

/// A substep whose system is solved, before any node has moved.
#[derive(Clone, Copy)]
pub(crate) struct Solved<'a> {
    /// The material.
    pub matter: &'a RodMaterial,
    /// The division.
    pub division: &'a Discretization,
    /// The matrix.
    pub rows: &'a [Row],
    /// Its factor.
    pub factor: &'a Factor,
    /// The substep, seconds.
    pub h: f64,
    /// Whether contacts are searched: a further Newton iteration of the same substep reuses those of the first.
    pub first: bool,
}

impl TubeContacts {
    /// Corrects the free `velocities` of a substep that starts at `positions`; returns the work that contact then does, J.
    pub fn act(
        &mut self,
        positions: &[DVec3],
        velocities: &mut Vec<DVec3>,
        solved: &Solved<'_>,
        company: &mut Company,
    ) -> f64 {
        if self.is_idle() && company.is_empty() {
            self.contacts.clear(); // contacts with peers that have gone
            return 0.0;
        }
        // a diverged system has no motion to correct: the step detects it and gives up or subdivides
        if !velocities.iter().sum::<DVec3>().is_finite() {
            return 0.0;
        }
        let own = velocities.len();
        company.mates_mut().extend(velocities, solved.h);
        if solved.first {
            let arc_m = &solved.division.arc_m;
            let radii_m = std::mem::take(&mut self.radii_m);
            let skin = Skin {
                positions,
                slots: velocities,
                radii_m: &radii_m,
                arc_m,
                held: solved.matter.held,
                h_s: solved.h,
            };
            self.find(&skin);
            self.find_peer_contacts(&skin, company);
            self.radii_m = radii_m;
        }
        if self.contacts.is_empty() {
            self.solver.forget();
            velocities.truncate(own);
            return 0.0;
        }
        self.scale(solved);
        company.mates().scale(&mut self.mobilities);
        let has_peers = !company.is_empty();
        let Self { contacts, mobilities, solver, .. } = self;
        let related_keys = &RELATED_KEYS[..if has_peers { RELATED_KEYS.len() } else { RELATED_KEYS_WITHOUT_PEERS }];
        let problem = Problem { contacts: &[], related_keys, h_s: solved.h, mobilities, settings: SETTINGS };
        let respond = |impulses: &mut [DVec3]| respond(solved.factor, solved.matter.held, impulses);
        company.mates_mut().solve(solver, (contacts, problem), velocities, Owner { slots: own, respond, tips: false });
        if has_peers {
            company.mates_mut().watch(self.impulses(), velocities);
        }
        velocities[own..].fill(DVec3::ZERO); // the peers' motion is not this tube's work
        let work = self.impulses().map(|(contact, impulse)| contact.jacobian.velocity(velocities).dot(*impulse)).sum();
        velocities.truncate(own);
        work
    }

    /// Whether the skin comes near itself or a fixed solid in a substep that starts at `positions` with `velocities`.
    pub fn would_touch(&mut self, positions: &[DVec3], velocities: &[DVec3], solved: &Solved<'_>) -> bool {
        if self.is_idle() {
            self.contacts.clear();
            return false;
        }
        let radii_m = std::mem::take(&mut self.radii_m);
        let skin = Skin {
            positions,
            slots: velocities,
            radii_m: &radii_m,
            arc_m: &solved.division.arc_m,
            held: solved.matter.held,
            h_s: solved.h,
        };
        let found = self.find(&skin) > 0;
        self.radii_m = radii_m;
        if !found {
            self.solver.forget();
        }
        found
    }

    /// The size of each slot's inverse mass (eq. 22): a node's from its own mass, a segment's from the matrix, because its shear coupling
    /// to the nodes resists turning far more than its own inertia.
    fn scale(&mut self, solved: &Solved<'_>) {
        let Solved { matter, division, rows, .. } = solved;
        let count = division.segments();
        self.mobilities.resize(rows.len(), 0.0);
        for node in 0..=count {
            let beside = [node.checked_sub(1), Some(node).filter(|&k| k < count)];
            let length: f64 = beside.into_iter().flatten().map(|k| division.length[k]).sum();
            self.mobilities[node_slot(node)] = 2.0 / (matter.mu * length);
        }
        for segment in 0..count {
            let slot = segment_slot(segment);
            self.mobilities[slot] = 3.0 / rows[slot].diag.d.element_sum();
        }
        for (end, node) in [(0, 0), (1, count)] {
            if matter.held[end] {
                self.mobilities[node_slot(node)] = 0.0;
            }
        }
    }
}

/// Turns impulses, one per slot, into velocity changes by the factor of the substep; held ends do not move.
pub(crate) fn respond(factor: &Factor, held: [bool; 2], impulses: &mut [DVec3]) {
    let last = impulses.len().saturating_sub(1);
    for (_, slot) in [(held[0], 0), (held[1], last)].into_iter().filter(|(held, _)| *held) {
        impulses[slot] = DVec3::ZERO;
    }
    factor.solve(impulses);
}
