//! Converts the couplings and faults of a scene for agents and the runtime.
//!
//! In: a [`Scene`]. Out: for each agent its laws, links and faults. Never here: forces.

use crate::description::couplings;
use crate::description::couplings::{Coupling, CouplingKind};
use crate::{Scene, Spec};
use metachron_contact::{Law, Link};
use metachron_core::AgentId;
use metachron_runtime::Faults;
use std::collections::BTreeMap;

/// The ties of all agents of a scene.
pub struct Ties {
    laws: BTreeMap<AgentId, Vec<(AgentId, Law)>>,
    attached: BTreeMap<AgentId, Vec<Link>>,
}

impl Ties {
    /// Reads the ties of `scene`.
    pub fn of(scene: &Scene) -> Self {
        let mut laws: BTreeMap<AgentId, Vec<_>> = BTreeMap::new();
        for pair in contact_laws(scene) {
            laws.entry(pair.a).or_default().push((pair.b, pair.law));
        }
        let mut attached: BTreeMap<AgentId, Vec<_>> = BTreeMap::new();
        let links = (0..).zip(&scene.couplings).filter_map(|(number, coupling)| link(coupling, number));
        for (id, link) in links {
            attached.entry(id).or_default().push(link);
        }
        Self { laws, attached }
    }

    /// The contact laws between `id` and its peers that are not the ledger; returned for one side of a pair.
    pub fn laws(&mut self, id: AgentId) -> Vec<(AgentId, Law)> {
        self.laws.remove(&id).unwrap_or_default()
    }

    /// The permanent links of `id`; returned for one side of a pair.
    pub fn attached(&mut self, id: AgentId) -> Vec<Link> {
        self.attached.remove(&id).unwrap_or_default()
    }
}

/// Converts injected faults to the runtime's type.
pub const fn faults(faults: couplings::Faults) -> Faults {
    let couplings::Faults { jitter, loss, seed } = faults;
    Faults { jitter, loss, seed }
}

/// A pair with a law of its own.
struct PairLaw {
    a: AgentId,
    b: AgentId,
    law: Law,
}

/// The pairs that are not solved with all that they touch. In a scene without contacts these are all pairs of material
/// objects that no coupling names.
fn contact_laws(scene: &Scene) -> Vec<PairLaw> {
    let contacts = scene.couplings.iter().filter(|c| c.kind == CouplingKind::Contact);
    let mut laws: BTreeMap<_, _> = contacts.map(|c| ((c.a.min(c.b), c.a.max(c.b)), c.law)).collect();
    if !scene.contacts {
        let solid: Vec<AgentId> =
            scene.agents.iter().filter(|m| !matches!(m.spec, Spec::Synthetic(_))).map(|m| m.id).collect();
        let pairs = solid.iter().enumerate().flat_map(|(at, a)| solid[at + 1..].iter().map(move |b| (*a, *b)));
        for pair in pairs {
            laws.entry(pair).or_insert(Law::Off);
        }
    }
    let own = laws.into_iter().filter(|(_, law)| *law != Law::Cluster);
    own.map(|((a, b), law)| PairLaw { a, b, law }).collect()
}

/// The link that a coupling makes of its first agent, by the coupling's number in the scene.
fn link(coupling: &Coupling, number: u32) -> Option<(AgentId, Link)> {
    let Coupling { a, b: other, kind, law } = *coupling;
    let CouplingKind::Attach { at_a, at_b, stiffness_n_m, damping_n_s_m, rest_m, tears_above_n, yields_above_n } = kind
    else {
        return None;
    };
    let link = Link {
        other,
        here: at_a,
        there: at_b,
        stiffness_n_m,
        damping_n_s_m,
        rest_m,
        law,
        number,
        tears_above_n,
        yields_above_n,
    };
    Some((a, link))
}
