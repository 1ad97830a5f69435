//! The stress in tubes and soft bodies, in states that they have published.
//!
//! In: a scene, and snapshots of its objects. Out: numbers, found by models of the same objects that step nothing. Never here: how stress
//! follows from a shape.

use crate::{Scene, Spec};
use metachron_core::{AgentId, Body, Snapshot};
use metachron_models::rod::Tube;
use metachron_models::soft::SoftBody;
use std::collections::BTreeMap;
use std::fmt;

/// Finds the stress in the tubes and soft bodies of a scene.
#[derive(Default)]
pub struct Stresses {
    tubes: BTreeMap<AgentId, Tube>,
    soft: BTreeMap<AgentId, SoftBody>,
}

impl fmt::Debug for Stresses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Stresses").field("tubes", &self.tubes.len()).field("soft", &self.soft.len()).finish()
    }
}

impl Stresses {
    /// Of this scene's objects; a body that cannot be built has none.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let mut found = Self::default();
        for member in &scene.agents {
            match &member.spec {
                Spec::Tube(tube) => found.tubes.extend(Tube::new(tube.clone()).map(|tube| (member.id, tube))),
                Spec::Soft(soft) => found.soft.extend(SoftBody::new(soft.clone()).map(|soft| (member.id, soft))),
                _ => {}
            }
        }
        found
    }

    /// The von Mises stress of elastic forces at every vertex of a soft body and at every node of a tube, there the greatest in the section, in this
    /// state of that object, Pa, ≥ 0. `None` for anything else: an object that joined later, a body from which cells were removed.
    pub fn von_mises_pa(&mut self, object: AgentId, state: &Snapshot) -> Option<Vec<f64>> {
        match &state.body {
            Body::Curve(curve) => self.tubes.get(&object)?.von_mises_pa(curve),
            Body::Soft(_) => self.soft.get_mut(&object)?.von_mises_pa(state),
            _ => None,
        }
    }
}
