//! Where contact meets the rod's own step: between its solve and its move.
//!
//! In: the state a substep starts from, its free velocities and its factor. Out: velocities that keep the skin apart.
//! Never here: which contacts there are ([`super::TubeContacts::find`]). Theory: `docs/theory/contact.md`, eq. 5 and 22–23.

use super::{KIN, KIN_OWN, Skin, TubeContacts, node_slot, segment_slot};
use crate::rod::banded_ldl::{Factor, Row};
use crate::rod::company::Company;
use crate::rod::discretization::Division;
use crate::rod::state::Matter;
use glam::DVec3;
use metachron_contact::{Owner, Problem, Settings};

/// When a tube's contacts are good enough: 10 µm/s, a tenth of what counts as rest.
/// A stiff tube (10⁸ Pa) that lands flat takes 30 answers, a soft one at rest takes one or two.
const SETTINGS: Settings = Settings { iterations: 300, tolerance_m_s: 1e-5 };

/// A substep at the point where its system is solved and nothing has moved yet.
#[derive(Clone, Copy)]
pub(crate) struct Solved<'a> {
    /// The material.
    pub matter: &'a Matter,
    /// The division.
    pub division: &'a Division,
    /// The matrix.
    pub rows: &'a [Row],
    /// Its factor.
    pub factor: &'a Factor,
    /// The substep, seconds.
    pub h: f64,
}

impl TubeContacts {
    /// Corrects the free `velocities` of a substep that starts at `positions`; returns the work that contact then does, J.
    ///
    /// `first` finds the contacts; a further Newton iteration of the same substep keeps them.
    pub fn act(
        &mut self,
        positions: &[DVec3],
        velocities: &mut Vec<DVec3>,
        solved: &Solved<'_>,
        (company, first): (&mut Company, bool),
    ) -> f64 {
        if self.is_idle() && company.is_empty() {
            self.contacts.clear(); // of those who have gone
            return 0.0;
        }
        // a system that was lost has no motion to correct: the step will see it and give up or divide
        if !velocities.iter().sum::<DVec3>().is_finite() {
            return 0.0;
        }
        let own = velocities.len();
        company.mates_mut().extend(velocities, solved.h);
        if first {
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
            self.find_others(&skin, company);
            self.radii_m = radii_m;
        }
        if self.contacts.is_empty() {
            self.solver.forget();
            velocities.truncate(own);
            return 0.0;
        }
        self.scale(solved);
        company.mates().scale(&mut self.mobilities);
        let met = !company.is_empty();
        let Self { contacts, mobilities, solver, .. } = self;
        let kin = &KIN[..if met { KIN.len() } else { KIN_OWN }];
        let problem = Problem { contacts: &[], kin, h_s: solved.h, mobilities, settings: SETTINGS };
        let respond = |impulses: &mut [DVec3]| respond((solved.factor, solved.matter.held), impulses);
        company.mates_mut().solve(solver, (contacts, problem), velocities, Owner { slots: own, respond, tips: false });
        if met {
            company.mates_mut().watch(self.impulses(), velocities);
        }
        velocities[own..].fill(DVec3::ZERO); // what the others do is not this tube's work
        let work = self.impulses().map(|(contact, impulse)| contact.slots.velocity(velocities).dot(*impulse)).sum();
        velocities.truncate(own);
        work
    }

    /// Whether the skin comes near itself or a fixed solid in a substep that starts at `positions` and goes by `velocities`.
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

    /// The size of each slot's inverse mass (eq. 22): a node's from its own mass, a segment's from the matrix, because what
    /// it is joined to by shear resists its turning far more than its own inertia.
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

/// How a tube answers impulses, one a slot, by the factor of its substep: ends that are held stay.
pub(crate) fn respond((factor, held): (&Factor, [bool; 2]), impulses: &mut [DVec3]) {
    let last = impulses.len().saturating_sub(1);
    for (_, slot) in [(held[0], 0), (held[1], last)].into_iter().filter(|(held, _)| *held) {
        impulses[slot] = DVec3::ZERO;
    }
    factor.solve(impulses);
}
