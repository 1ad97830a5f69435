//! metachron in Bevy: a plugin whose entities follow the objects of a world that keeps its own time.
//!
//! In: a scene or a [`World`], entities with components. Out: transforms, meshes and messages of each frame.
//! Never here: a step of physics; colours, lights, cameras.

mod axes;
mod drag;
mod messages;
mod objects;
mod surfaces;
mod time;

pub use axes::{rotation_to_bevy, rotation_to_metachron, to_bevy, to_metachron};
pub use drag::{Drag, PointerDrag, Spring};
pub use messages::{ContactMessage, Refused, StateMessage};
pub use objects::{Follows, Simulated};
pub use surfaces::{SurfaceMesh, fixed_mesh};

use bevy_app::{App, Plugin, PostUpdate};
use bevy_asset::AssetEventSystems;
use bevy_ecs::prelude::{IntoScheduleConfigs, Resource, SystemSet};
use bevy_transform::TransformSystems;
use metachron_world::{EventFilter, Scene, World, WorldError, kinds::ExecutorKind};
use std::ops::Deref;

/// The page of the crate: its code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;

/// Lets a world live beside the app: everything that it does is done in `PostUpdate`, before transforms are propagated and changed assets are
/// told of, so that a frame shows the moment at which it is made.
///
/// It needs Bevy's `TimePlugin`, which `MinimalPlugins` and `DefaultPlugins` have.
#[derive(Debug, Clone)]
pub struct MetachronPlugin {
    world: World,
}

impl MetachronPlugin {
    /// Starts a scene; its time stands until the app's first frame.
    ///
    /// # Errors
    /// The errors of [`World::start`].
    pub fn start(scene: &Scene, executor: ExecutorKind) -> Result<Self, WorldError> {
        World::start(scene, executor).map(Self::new)
    }

    /// Shows a world that was started elsewhere.
    #[must_use]
    pub const fn new(world: World) -> Self {
        Self { world }
    }
}

/// The world of the plugin: commands, queries, sensors, checkpoints, all that a [`World`] does.
#[derive(Debug, Clone, Resource)]
pub struct MetachronWorld(World);

impl Deref for MetachronWorld {
    type Target = World;

    fn deref(&self) -> &World {
        &self.0
    }
}

/// The stages of the plugin in `PostUpdate`, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, SystemSet)]
pub enum MetachronSystems {
    /// Objects of new entities join; springs are passed on.
    Act,
    /// Time passes.
    Advance,
    /// Transforms, meshes and messages are written.
    Show,
}

impl Plugin for MetachronPlugin {
    fn build(&self, app: &mut App) {
        use MetachronSystems::{Act, Advance, Show};
        let in_order = (Act, Advance, Show).chain().before(TransformSystems::Propagate).before(AssetEventSystems);
        app.insert_resource(MetachronWorld(self.world.clone()))
            .insert_resource(messages::Listener(self.world.events(EventFilter::all())))
            .init_resource::<objects::Followers>()
            .add_message::<ContactMessage>()
            .add_message::<StateMessage>()
            .add_message::<Refused>()
            .add_message::<PointerDrag>()
            .configure_sets(PostUpdate, in_order)
            .add_systems(PostUpdate, (objects::join, drag::take_pointer, drag::pull).chain().in_set(Act))
            .add_systems(PostUpdate, time::pass.in_set(Advance))
            .add_systems(PostUpdate, (objects::show, messages::send).chain().in_set(Show));
    }
}
