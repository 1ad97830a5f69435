//! Which members of a cluster rapier3d can step, where they touch in too many places for one problem.
//!
//! In: members, the static solids around them. Out: whose each member's contacts are. Never here: steps, contacts.
//! Theory: docs/theory/clusters.md, section 9.

use crate::detect::ClusterScene;
use crate::lists::reset;
use crate::member::participant::place_of;
use crate::member::{Participant, Role};
use metachron_core::AgentId;
use metachron_geometry::{CollisionShape, ContactTraits, ShapeKind, ShapePose};

/// Whose the contacts of a member are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Domain {
    /// The problem's.
    Problem,
    /// A rigid pile's, but for those with members of the problem.
    RigidPile,
}

/// Finds the domain of each member of a cluster with a rigid pile: rapier3d steps rigid bodies with the usual rules for pairs and without friction
/// about normals, of which none passes through another or through a static solid but by its groups.
pub(crate) fn assign(scene: &ClusterScene, all: &[Participant<'_>], domains: &mut Vec<Domain>) {
    reset(domains, all.len(), Domain::Problem);
    if !scene.statics().iter().all(|solid| rubs_as_usual(&solid.form)) {
        return;
    }
    let place = |id: AgentId| place_of(all, id);
    for (one, domain) in all.iter().zip(&mut *domains) {
        let is_rigid = one.member.role() == Role::Rigid && !one.member.is_remote();
        let is_free = || !one.laws.iter().any(|(other, _)| place(*other).is_some());
        if is_rigid && is_solid(one) && is_free() {
            *domain = Domain::RigidPile;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::StepContext;
    use crate::joint::{Joint, JointKind};
    use crate::member::{ClusterMember, ContactMemory, Remote, SkinPoint, StepEnd};
    use crate::solve::Side;
    use glam::{DQuat, DVec3};
    use metachron_core::{SimTime, StepError};
    use metachron_geometry::{ContactSide, Place, PlacedShape, Solid, SolidShape};

    /// A ball; remote: stepped elsewhere.
    struct Ball {
        form: CollisionShape,
        is_remote: bool,
    }

    impl ClusterMember for Ball {
        fn role(&self) -> Role {
            Role::Rigid
        }
        fn remote(&self) -> Option<Remote<'_>> {
            self.is_remote.then_some(Remote { answers_after_s: 0.0, partners: &[] })
        }
        fn begin(&mut self, _: f64) -> Result<(), StepError> {
            Ok(())
        }
        fn skin(&self) -> Option<PlacedShape<'_>> {
            let view = ShapePose::Solid { position: DVec3::ZERO, rotation: DQuat::IDENTITY };
            Some(PlacedShape { form: &self.form, view })
        }
        fn skin_point(&self, _: &Place, _: ContactSide) -> SkinPoint {
            Side::FIXED.into()
        }
        fn keep(&mut self) {}
        fn go_back(&mut self) {}
        fn end(&mut self, _: &StepEnd<'_>) -> Result<(), StepError> {
            Ok(())
        }
    }

    #[test]
    fn a_pair_that_passes_through_each_other_is_the_problem_s_whatever_the_number_of_a_remote_member() {
        let solid = SolidShape::new(Solid::Ball { radius_m: 0.1 }, DVec3::ZERO).unwrap();
        let ball = |is_remote| Ball { form: CollisionShape::new(ShapeKind::Solid(solid.clone()), 0.5), is_remote };
        let joint = Joint { collide: false, ..Joint::new(AgentId(2), Some(AgentId(5)), JointKind::Spherical) };
        let scene = ClusterScene::default().jointed([joint].into()).unwrap();
        // remote members follow all others
        for remote in [1, 3, 9] {
            let ids = [2, 4, 5, remote].map(AgentId);
            let mut bodies = ids.map(|id| (id, ball(id == AgentId(remote)), ContactMemory::default(), Vec::new()));
            let all: Vec<_> = bodies
                .iter_mut()
                .map(|(id, member, memory, grips)| {
                    let context = StepContext::alone(*id, SimTime::ZERO);
                    let member = (member as &mut dyn ClusterMember).into();
                    Participant { id: *id, member, context, laws: &[], memory, parts: 1, alone_s: 0.01, grips }
                })
                .collect();
            let mut domains = Vec::new();
            assign(&scene, &all, &mut domains);
            let expected = [Domain::Problem, Domain::RigidPile, Domain::Problem, Domain::Problem];
            assert_eq!(domains, expected, "with a remote member of number {remote}");
        }
    }
}
