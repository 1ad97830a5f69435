//! Models of matter as agents: rigid bodies, elastic tubes, soft bodies, driven tools.
//!
//! In: step lengths and an agent's view of the others. Out: states, as snapshots.
//! Never here: a clock, a thread, a file, the GPU. Theory: `docs/theory/rod.md`, `docs/theory/soft.md`.
//!
//! ```
//! use glam::DVec3;
//! use metachron_contact::step::LoneStepper;
//! use metachron_contact::{Agent, StepContext};
//! use metachron_core::{AgentId, SimSpan, SimTime, Snapshot};
//! use metachron_geometry::Solid;
//! use metachron_models::rigid::{RigidBody, RigidSpec};
//!
//! let ball = RigidSpec::free(Solid::Ball { radius_m: 0.1 }, DVec3::Z * 5.0, 1.0);
//! let mut ball = RigidBody::new(RigidSpec { gravity: DVec3::NEG_Z * 9.81, ..ball }).unwrap();
//! let alone = StepContext::alone(AgentId(0), SimTime::ZERO);
//! LoneStepper::default().step(&mut ball, SimSpan::from_millis(100), alone).unwrap();
//! let mut state = Snapshot::default();
//! ball.write_snapshot(&mut state);
//! let (position, _) = state.body.probe(0.0).unwrap();
//! assert!((position.z - (5.0 - 0.5 * 9.81 * 0.1 * 0.1)).abs() < 1e-12); // free flight is exact: z₀ − ½ g t²
//! ```

pub mod conformance;
mod limits;
pub mod rigid;
pub mod rod;
mod set_motion;
pub mod soft;
mod symmetric;
pub mod synthetic;
pub mod tool;
mod trajectory;
