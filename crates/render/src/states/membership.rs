//! Agents that join a scene in play and leave it, and states that are shown again.
//!
//! In: actors of newcomers, numbers of agents that left, histories. Out: a [`SceneView`] of the agents that are there.
//! Never here: the looks of any of them.

use super::scene_view::{Actor, SceneView, Track};
use metachron_core::{AgentId, Body, Snapshot};
use std::sync::Arc;

/// The states that an agent is posed by: its two newest ones.
#[derive(Debug, Clone, Default)]
pub struct History {
    /// The state before the newest, where it has one.
    pub before: Option<Arc<Snapshot>>,
    /// The newest state.
    pub newest: Option<Arc<Snapshot>>,
    /// Whether the agent continues to step.
    pub awake: bool,
}

impl SceneView {
    /// Takes up an agent whose number is one more than that of the last agent: its actor comes before all scenery, whose numbers rise by one.
    pub fn join(&mut self, actor: Actor) {
        let at = (actor.id.0 as usize).min(self.tracks.len());
        let mut meshes = Vec::new();
        let known = self.picture.meshes.len() as u32;
        let mut track = Track::new(actor, &mut meshes, &mut super::scene_view::Models::default());
        if !meshes.is_empty() {
            track.body.mesh_index = track.body.mesh_index.map(|number| known + number);
            self.picture.meshes = self.picture.meshes.iter().cloned().chain(meshes).collect();
        }
        self.tracks.insert(at, track);
        self.tracks[at + 1..].iter_mut().for_each(|scenery| scenery.actor.id.0 += 1);
        self.fits.iter_mut().for_each(|fit| fit.shift(at));
        // an agent that was found at a place is not there any more
        self.found.clear();
        self.eye = None;
    }

    /// Shows an agent no more: it has left.
    pub fn leave(&mut self, id: AgentId) {
        if let Some(track) = self.track_mut(id) {
            track.set_history(&History::default());
        }
    }

    /// The states that the first `count` actors, the agents, are posed by.
    #[must_use]
    pub fn histories(&self, count: usize) -> Vec<History> {
        self.tracks.iter().take(count).map(Track::history).collect()
    }

    /// Poses the agents by these from now on, as many as there are; of the first `count` actors the others are not shown.
    pub fn set_histories(&mut self, histories: &[History], count: usize) {
        let none = History::default();
        for (at, track) in self.tracks.iter_mut().take(count).enumerate() {
            track.set_history(histories.get(at).unwrap_or(&none));
        }
    }
}

impl Track {
    fn history(&self) -> History {
        History { before: self.before.clone(), newest: self.newest.clone(), awake: self.awake }
    }

    fn set_history(&mut self, history: &History) {
        let History { before, newest, awake } = history.clone();
        (self.before, self.newest, self.awake, self.still) = (before, newest, awake, false);
        if self.newest.is_none() {
            self.show(Body::Nothing);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::scene_view::{Appearance, Form, Material, States};
    use super::*;
    use crate::{Camera, Ray, Size};
    use glam::{DQuat, DVec3};
    use metachron_core::{RigidState, SimTime};
    use metachron_drawable::{Generator, Model, Placement, ProgressiveMesh, generate};
    use metachron_geometry::Solid;

    #[test]
    fn a_newcomer_stands_before_the_scenery_and_is_picked_until_it_leaves() {
        let appearance = Appearance { colour: [200; 3], material: Material::Plastic };
        let model = Model::Mesh(Arc::new(ProgressiveMesh::new(&generate(Generator::Sphere, 0, 20)).unwrap()));
        let at = Placement { position: 5.0 * DVec3::Y, rotation: DQuat::IDENTITY, scale: 1.0 };
        let ball = |id| Actor { id: AgentId(id), form: Form::Solid(Solid::Ball { radius_m: 0.1 }), appearance };
        let still = Actor { id: AgentId(1), form: Form::Scenery(model, at), appearance };
        let mut view = SceneView::new(vec![ball(0), still], vec![]);
        let camera = Camera::looking(-3.0 * DVec3::Y, DVec3::ZERO, 0.8);
        let size = Size { width: 100, height: 100 };
        view.survey(&camera, size);
        view.join(ball(1));
        let state = |x: f64| {
            let body = Body::Rigid(RigidState { position: x * DVec3::X, ..RigidState::default() });
            Arc::new(Snapshot { body, ..Snapshot::default() })
        };
        view.set_snapshot(AgentId(0), &state(-0.5), true);
        view.set_snapshot(AgentId(1), &state(0.5), true);
        let seen = |view: &mut SceneView| {
            view.pose(SimTime::ZERO, States::Latest);
            view.survey(&camera, size);
            view.seen().iter().map(|seen| (seen.id.0, seen.visible)).collect::<Vec<_>>()
        };
        assert_eq!(seen(&mut view), [(0, true), (1, true), (2, true)]);
        let ray = Ray { origin: DVec3::new(0.5, -3.0, 0.0), direction: DVec3::Y };
        assert_eq!(view.pick(ray).map(|hit| hit.object), Some(AgentId(1)));
        view.leave(AgentId(1));
        assert_eq!(seen(&mut view), [(0, true), (1, false), (2, true)]);
        assert_eq!(view.pick(ray), None);
    }
}
