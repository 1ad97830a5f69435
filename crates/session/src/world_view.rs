//! The picture of a world that a program runs by itself: every object as it is now, at its finest.
//!
//! In: a world and the scene that it was started from. Out: a [`Picture`] for whatever draws it, and the scene's cameras.
//! Never here: frames, a budget of time, an adapter.

use super::assemble;
use super::error::SessionError;
use metachron_lod::control::{ObjectView, PictureControl, Policy};
use metachron_render::{Camera, History, Level, Picture, SceneView, Size, States, Style};
use metachron_runtime::{AgentHandle, AgentState};
use metachron_world::{Scene, World};

/// A view of a world now. Reading never waits for steps.
///
/// A picture has the newest state of each object, as [`World::latest`] gives it, with objects that joined and without
/// objects that left since the start. Everything is drawn as the policy `full` draws it: at its finest, at any cost.
pub struct WorldView {
    world: World,
    /// The scene, with the objects that joined.
    scene: Scene,
    scene_view: SceneView,
    control: PictureControl,
    views: Vec<ObjectView>,
    /// The fixed part of every actor's description.
    fixed_parts: Vec<assemble::FixedPart>,
}

impl WorldView {
    /// A view of `world`, which was started from `scene`.
    #[must_use]
    pub fn new(world: &World, scene: &Scene) -> Self {
        let mut control = assemble::picture_control(scene);
        control.set_policy(Policy::Full);
        Self {
            world: world.clone(),
            scene_view: assemble::scene_view(scene),
            control,
            views: Vec::new(),
            fixed_parts: assemble::fixed_parts(scene),
            scene: scene.clone(),
        }
    }

    /// The scene's camera of that name where it is now; without a name its first one, or, where it has none, one in front that sees everything.
    ///
    /// # Errors
    /// [`SessionError::NoCamera`] with the names that there are.
    pub fn camera(&mut self, name: Option<&str>) -> Result<Camera, SessionError> {
        let at = match name {
            None => 0,
            Some(name) => self.scene.cameras.iter().position(|camera| camera.name == name).ok_or_else(|| {
                let known: Vec<_> = self.scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
                SessionError::NoCamera { name: name.to_owned(), known: known.join(", ") }
            })?,
        };
        self.gather();
        Ok(assemble::camera(&self.scene, at, &self.scene_view, self.world.time().as_secs_f64()))
    }

    /// The world now, as `camera` sees it in a picture of `size`.
    pub fn compose(&mut self, camera: &Camera, size: Size) -> &Picture {
        self.gather();
        self.scene_view.survey(camera, size);
        let of = assemble::Actors { scene: &self.scene, fixed_parts: &self.fixed_parts };
        assemble::update_views(&mut self.views, self.scene_view.seen(), self.scene_view.updated(), of);
        let plan = self.control.plan(&self.views);
        let levels: Vec<Level> =
            self.views.iter().zip(&plan.levels).map(|(view, demand)| assemble::level(view, demand)).collect();
        self.scene_view.compose(camera, &levels, Style::default(), None)
    }

    /// Takes the newest states, and objects that joined.
    fn gather(&mut self) {
        let Self { world, scene, scene_view, .. } = self;
        let before = scene.agents.len();
        for agent in world.agents().iter().skip(before) {
            world.joined(agent.id()).into_iter().for_each(|member| assemble::join(scene, scene_view, member));
        }
        if scene.agents.len() > before {
            self.fixed_parts = assemble::fixed_parts(scene);
        }
        let agents = || world.agents().iter().take(scene.agents.len());
        // no state before the newest: the picture shown last may be long ago
        let newest = |agent: &AgentHandle| match agent.state() {
            AgentState::Gone => History::default(),
            state => History { before: None, newest: Some(agent.latest()), awake: state == AgentState::Running },
        };
        let histories: Vec<History> = agents().map(newest).collect();
        scene_view.set_histories(&histories, scene.agents.len());
        for agent in agents() {
            agent.form().iter().for_each(|form| scene_view.set_shape(agent.id(), form));
        }
        scene_view.pose(world.time(), States::Latest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec2, DVec3};
    use metachron_core::SimSpan;
    use metachron_world::Rigid;
    use metachron_world::kinds::ExecutorKind;

    const SIZE: Size = Size { width: 320, height: 180 };

    #[test]
    fn a_view_has_what_is_there_now_of_those_that_move_join_and_leave() {
        let scene = Scene::builder().add("ball", Rigid::ball(0.1).at([0.0, 0.0, 1.0])).build().unwrap();
        let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
        let mut view = WorldView::new(&world, &scene);
        let camera = view.camera(None).unwrap();
        let middle = camera.project(DVec3::Z, SIZE).unwrap().0;
        assert!(middle.distance(DVec2::new(160.0, 90.0)) < 1.0, "it sees everything: {middle}");
        let shown = |view: &mut WorldView| {
            let picture = view.compose(&camera, SIZE);
            picture.instances.iter().map(|one| picture.origin + DVec3::from(one.position.map(f64::from))).collect()
        };
        let start: Vec<DVec3> = shown(&mut view);
        assert!(start[0].distance(DVec3::Z) < 1e-3, "{start:?}");
        world.advance(SimSpan::from_millis(100));
        let other = world.add("other", Rigid::ball(0.1).at([0.3, 0.0, 1.0])).unwrap();
        let moved: Vec<DVec3> = shown(&mut view);
        assert_eq!(moved.len(), 2);
        assert!((moved[0].z - 0.951).abs() < 1e-2, "{moved:?}");
        world.remove(other).unwrap();
        world.advance(SimSpan::from_millis(20));
        assert_eq!(shown(&mut view).len(), 1);
        let error = view.camera(Some("above")).unwrap_err().to_string();
        assert!(error.contains("no camera \"above\""), "{error}");
    }
}
