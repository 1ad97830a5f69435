//! Controllers that choose how finely things are drawn and simulated: numbers in, demands out.
//!
//! In: the objects in view ([`ObjectView`]) and the frame's measured work ([`FrameWork`]); the measured time of an agent's turns
//! ([`TurnMeasure`]).
//! Out: a level for every picture ([`Plan`]), dt and ε for every agent ([`RateDemand`]).
//! Never here: agents, threads, scenes, the GPU. Theory: `docs/theory/control.md`, after (GDC04), and `docs/theory/budget.md`.

mod adaptive;
mod area;
mod benefit;
mod convex;
mod feedback;
mod flicker;
mod groups;
mod hierarchy;
mod impostors;
mod ladder;
mod level;
mod logic;
mod picture;
mod plan;
mod policy;
mod price;
mod quality_boost;
mod query;
mod rate;
mod render_scale;
mod robin_hood;
mod select;
mod status;
mod tolerance;
mod vanish;
mod view;

pub use crate::cost::benefit::{GivenSliders, Sliders};
pub use crate::cost::stages::Stages;
pub use crate::cost::value::Value;
pub use area::{AREAS_PX, Areas};
pub use level::{IMPOSTORS_MAX, PRIMITIVE_LEVELS};
pub use picture::PictureControl;
pub use plan::{FrameWork, LevelDemand, Plan, detail};
pub use policy::{Law, Policy};
pub use price::{Backdrop, Measured, Misses, Prices};
pub use query::Promise;
pub use rate::{RateControl, RateDemand, RateGains, RateLimits, TurnMeasure, VisibleDetail};
pub use status::Status;
pub use tolerance::{ErrorControl, ErrorLimits, ErrorMeasure};
pub use view::{Kind, ObjectView, Pieces, Shading, Stroke};
