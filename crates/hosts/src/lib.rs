//! Worlds that run elsewhere: a world is served here and called from another process as if it ran there.
//!
//! In: anything that answers a world's calls ([`metachron_world::WorldCalls`]), an endpoint. Out: a [`Host`] that serves it, a
//! [`RemoteWorld`] that answers the same calls; certificates by which the two know each other. Never here: physics, a
//! picture.
//!
//! ```no_run
//! use metachron_hosts::{Calling, Serving, connect, serve};
//! use metachron_world::{Rigid, Scene, World, WorldCalls, kinds::ExecutorKind};
//! use std::sync::Arc;
//!
//! let scene = Scene::builder().add("ball", Rigid::ball(0.05).mass_kg(0.2)).build()?;
//! let here = World::start(&scene, ExecutorKind::Auto)?;
//! let host = serve(Arc::new(here), Serving::new("bench", "tcp/127.0.0.1:7447"))?;
//! let elsewhere = connect(Calling::at("tcp/127.0.0.1:7447").scene(scene.mark()))?;
//! let ball = elsewhere.object("ball")?;
//! println!("{:?}, refused {}", elsewhere.latest(ball)?.body.probe(0.0), host.refused().total());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(test)]
mod certificate_tests;
mod check;
mod endpoint;
mod error;
mod event_wire;
mod gate;
mod host;
#[cfg(test)]
mod hostile_tests;
mod identity;
mod link;
mod mirror;
mod refusal;
mod remote;
mod rounded;
mod serving;
mod shown;
mod waiting;
mod wire;

pub use error::HostsError;
pub use gate::{CALLS_MAX, Refusals, SESSIONS_MAX};
pub use host::{Host, serve};
pub use identity::{Authority, Identity};
pub use mirror::RemoteFrame;
pub use remote::{Calling, RemoteWorld, connect};
pub use serving::{SceneFiles, Serving};
pub use wire::MESSAGE_MAX;
