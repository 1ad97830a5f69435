//! Converts the joints, couplings and faults of a scene for agents and the runtime.
//!
//! In: a [`Scene`]. Out: for each agent its laws, links, faults, and the leader of the island in which it begins. Never here: forces.

use super::couplings::{Coupling, CouplingKind};
use super::{Scene, Spec};
use metachron_contact::{Law, Link};
use metachron_core::AgentId;
use metachron_runtime::Faults;
use std::collections::BTreeMap;

/// The ties of all agents of a scene.
pub(super) struct Ties {
    laws: BTreeMap<AgentId, Vec<(AgentId, Law)>>,
    attached: BTreeMap<AgentId, Vec<Link>>,
    leaders: Vec<AgentId>,
}

impl Ties {
    /// Reads the ties of `scene`.
    pub(super) fn of(scene: &Scene) -> Self {
        let mut laws: BTreeMap<AgentId, Vec<_>> = BTreeMap::new();
        for (a, b, law) in contact_laws(scene) {
            laws.entry(a).or_default().push((b, law));
        }
        let mut attached: BTreeMap<AgentId, Vec<_>> = BTreeMap::new();
        for (id, link) in scene.couplings.iter().filter_map(link) {
            attached.entry(id).or_default().push(link);
        }
        Self { laws, attached, leaders: leaders(scene) }
    }

    /// The contact laws between `id` and its peers that are not the ledger; returned for one side of a pair.
    pub(super) fn laws(&mut self, id: AgentId) -> Vec<(AgentId, Law)> {
        self.laws.remove(&id).unwrap_or_default()
    }

    /// The permanent links of `id`; returned for one side of a pair.
    pub(super) fn attached(&mut self, id: AgentId) -> Vec<Link> {
        self.attached.remove(&id).unwrap_or_default()
    }

    /// The leader of the island in which `id` begins, if joints or resting contact connect it to others: the lowest number among them.
    pub(super) fn together(&self, id: AgentId) -> Option<AgentId> {
        self.leaders.get(id.0 as usize).copied().filter(|leader| *leader != id)
    }
}

/// Converts injected faults to the runtime's type.
pub(super) const fn faults(faults: super::couplings::Faults) -> Faults {
    let super::couplings::Faults { jitter, loss, seed } = faults;
    Faults { jitter, loss, seed }
}

/// Every pair with a law of its own; in a scene without contacts that is every pair of material objects.
fn contact_laws(scene: &Scene) -> Vec<(AgentId, AgentId, Law)> {
    let contacts = scene.couplings.iter().filter(|c| c.kind == CouplingKind::Contact);
    let named: BTreeMap<_, _> = contacts.map(|c| ((c.a.min(c.b), c.a.max(c.b)), c.law)).collect();
    if scene.contacts {
        return named.into_iter().map(|((a, b), law)| (a, b, law)).collect();
    }
    let matter: Vec<AgentId> =
        scene.agents.iter().filter(|m| !matches!(m.spec, Spec::Synthetic(_))).map(|m| m.id).collect();
    let pairs = matter.iter().enumerate().flat_map(|(at, a)| matter[at + 1..].iter().map(move |b| (*a, *b)));
    pairs.map(|pair| (pair.0, pair.1, named.get(&pair).copied().unwrap_or(Law::Off))).collect()
}

fn link(coupling: &Coupling) -> Option<(AgentId, Link)> {
    let CouplingKind::Attach { at_a, at_b, stiffness_n_m, damping_n_s_m, rest_m } = coupling.kind else { return None };
    let law = coupling.law;
    Some((coupling.a, Link { other: coupling.b, here: at_a, there: at_b, stiffness_n_m, damping_n_s_m, rest_m, law }))
}

/// More bodies than this near each other begin in one island; with fewer, an island solves them directly, and they join it one by one.
const HEAP_MIN: usize = 128;

/// For each agent the lowest number among those that are connected to it by joints, by resting contact or as a heap: its own if there are
/// none. A stack that starts at rest must not first be dropped on itself, and a thousand bodies about to touch must not first detect each
/// other one by one.
fn leaders(scene: &Scene) -> Vec<AgentId> {
    let mut above: Vec<usize> = (0..scene.agents.len()).collect();
    let jointed = scene.joints.iter().filter_map(|joint| Some((joint.a, joint.b?)));
    jointed.chain(scene.resting_pairs()).chain(heaps(scene)).for_each(|pair| join(&mut above, pair));
    (0..above.len()).map(|at| AgentId(root(&mut above, at) as u32)).collect()
}

/// The pairs of rigid bodies near each other that belong to clusters of more than [`HEAP_MIN`].
fn heaps(scene: &Scene) -> Vec<(AgentId, AgentId)> {
    let mut pairs = scene.near_pairs();
    let mut above: Vec<usize> = (0..scene.agents.len()).collect();
    pairs.iter().for_each(|pair| join(&mut above, *pair));
    let mut sizes = vec![0; above.len()];
    (0..above.len()).for_each(|at| sizes[root(&mut above, at)] += 1);
    pairs.retain(|(a, _)| sizes[root(&mut above, a.0 as usize)] > HEAP_MIN);
    pairs
}

/// Merges the clusters of both.
fn join(above: &mut [usize], (a, b): (AgentId, AgentId)) {
    let (a, b) = (root(above, a.0 as usize), root(above, b.0 as usize));
    above[a.max(b)] = a.min(b);
}

/// Finds the root in the union-find forest `above`, and shortens the path.
fn root(above: &mut [usize], mut at: usize) -> usize {
    while above[at] != at {
        above[at] = above[above[at]];
        at = above[at];
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_scene::{Source, load};

    fn balls(ties: &str) -> Scene {
        let text = format!(
            "format = 1\n{ties}\n[[object]]\nname = \"b\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\ngrid = [6, 1, 1]\nspacing_m = [1, 1, 1]\n"
        );
        Source::memory("balls", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap()
    }

    #[test]
    fn agents_that_joints_hold_together_begin_in_the_world_of_the_lowest() {
        let joint = |a, b| format!("{{ kind = \"fixed\", a = \"b-{a}\", b = \"b-{b}\" }}");
        let scene = balls(&format!("joint = [{}, {}, {}]", joint(5, 3), joint(2, 1), joint(3, 2)));
        let ties = Ties::of(&scene);
        let together: Vec<_> = (0..6).map(|id| ties.together(AgentId(id)).map(|leader| leader.0)).collect();
        assert_eq!(together, [None, None, Some(1), Some(1), None, Some(1)]);
    }

    #[test]
    fn bodies_that_lie_against_each_other_begin_in_one_world_unless_their_law_is_another() {
        let row = |x: f64, more: &str| {
            format!(
                "{{ name = \"{x}\", model = \"rigid\", shape = \"ball\", radius_m = 0.5, position_m = [{x}, 0, 0]{more} }},\n"
            )
        };
        let still = [row(0.0, ""), row(1.0, ""), row(2.01, ""), row(3.01, ""), row(4.01, ", velocity_m_s = [1, 0, 0]")]
            .concat();
        let leaders = |ties: &str| {
            let text = format!("format = 1\n{ties}\nobject = [\n{still}]\n");
            let scene = Source::memory("row", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap();
            leaders(&scene).iter().map(|id| id.0).collect::<Vec<_>>()
        };
        assert_eq!(leaders(""), [0, 0, 2, 2, 4]);
        assert_eq!(leaders("coupling = [{ a = \"0\", b = \"1\", law = \"off\" }]"), [0, 1, 2, 2, 4]);
        assert_eq!(leaders("world = { contacts = false }"), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn a_heap_begins_in_one_world_and_what_is_smaller_or_sparser_does_not() {
        let worlds = |grid: &str, spacing: &str, more: &str| {
            let text = format!(
                "format = 1\n{more}\n[[object]]\nname = \"b\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.1, 0.1, 0.1]\nrate_hz = 60.0\ngrid = {grid}\nspacing_m = {spacing}\n"
            );
            let scene = Source::memory("heap", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap();
            leaders(&scene).into_iter().collect::<std::collections::BTreeSet<_>>().len()
        };
        let near = "[0.3, 0.4, 0.4]"; // rows along x: the ball around a box is 0.35 m thick
        assert_eq!(worlds("[129, 2, 1]", near, ""), 2);
        assert_eq!(worlds("[128, 2, 1]", near, ""), 256, "too small");
        assert_eq!(worlds("[129, 2, 1]", "[0.4, 0.4, 0.4]", ""), 258, "too sparse");
        assert_eq!(worlds("[129, 2, 1]", near, "[world]\ncontacts = false"), 258, "nothing touches");
    }

    #[test]
    fn a_world_without_contacts_turns_every_pair_off_but_those_it_names() {
        let coupling = "coupling = [{ a = \"b-4\", b = \"b-1\", law = \"ledger\" }]\n[world]\ncontacts = false";
        let laws = contact_laws(&balls(coupling));
        assert_eq!(laws.len(), 15);
        let on: Vec<_> = laws.iter().filter(|(.., law)| *law != Law::Off).map(|(a, b, _)| (a.0, b.0)).collect();
        assert_eq!(on, [(1, 4)]);
        assert!(contact_laws(&balls("")).is_empty());
    }
}
