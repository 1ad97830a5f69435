//! Numbers in, demands out: who decides how finely things are drawn and simulated.
//!
//! In: what is in view ([`ObjectView`]) and the frame's measured work ([`FrameWork`]); what an agent's turns take ([`TurnMeasure`]).
//! Out: a resolution (ε, n) for every picture ([`Plan`]), dt and ε for every agent ([`RateDemand`]).
//! Never here: agents, threads, scenes, the GPU. Theory: `docs/theory/control.md`, after (GDC04).

mod level;
mod picture;
mod rate;
mod status;
mod view;

pub use level::PRIMITIVE_LEVELS;
pub use picture::{FrameWork, LevelDemand, PictureControl, Plan};
pub use rate::{RateControl, RateDemand, RateLimits, TurnMeasure};
pub use status::Status;
pub use view::{Kind, Law, ObjectView, Policy, Shading};
