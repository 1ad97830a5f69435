//! Which members of a cluster rapier3d can step, where they touch in too many places for one problem.
//!
//! In: members, the static solids around them. Out: whose each member's contacts are. Never here: steps, contacts.
//! Theory: docs/theory/clusters.md, section 9.

use super::{ClusterMember, ClusterScene, Participant, Role};
use metachron_core::AgentId;
use metachron_geometry::{CollisionShape, ContactTraits, ShapeKind, ShapePose};

/// Whose the contacts of a member are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Domain {
    /// The problem's.
    Problem,
    /// A heap's, but for those with members of the problem.
    Heap,
}

/// Finds the domain of each member of a cluster with a heap: rapier3d steps rigid bodies with the usual rules for pairs and without friction
/// about normals, of which none passes through another or through a static solid but by its groups.
pub(super) fn assign(scene: &ClusterScene, all: &[Participant<'_>], domains: &mut Vec<Domain>) {
    domains.clear();
    domains.resize(all.len(), Domain::Problem);
    if !scene.statics().iter().all(|solid| rubs_as_usual(&solid.form)) {
        return;
    }
    let place = |id: AgentId| all.binary_search_by_key(&id, |one| one.id).ok();
    for (one, domain) in all.iter().zip(&mut *domains) {
        let is_rigid = one.member.role() == Role::Rigid && !one.member.is_remote();
        let is_free = || !one.laws.iter().any(|(other, _)| place(*other).is_some());
        if is_rigid && is_solid(one) && is_free() {
            *domain = Domain::Heap;
        }
    }
    for id in scene.passing(|id| place(id).is_some()) {
        place(id).into_iter().for_each(|at| domains[at] = Domain::Problem);
    }
}

/// Whether the skin of a member is a solid that leaves to rapier3d nothing that it has not.
fn is_solid(one: &Participant<'_>) -> bool {
    one.member.skin().is_some_and(|skin| {
        let shapes = (&skin.form.kind, skin.view);
        matches!(shapes, (ShapeKind::Solid(_), ShapePose::Solid { .. })) && rubs_as_usual(skin.form)
    })
}

/// Whether a skin has no other rules than the usual ones, which in rapier3d come after all others, and no friction about normals.
fn rubs_as_usual(form: &CollisionShape) -> bool {
    let ContactTraits { friction_rule, restitution_rule, spin_radius_m, .. } = form.traits;
    friction_rule.is_none() && restitution_rule.is_none() && spin_radius_m == 0.0
}
