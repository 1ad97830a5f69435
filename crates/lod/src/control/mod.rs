//! Controllers that choose how finely things are drawn and simulated: numbers in, demands out.
//!
//! In: the objects in view ([`ObjectView`]) and the frame's measured work ([`FrameWork`]); the measured time of an agent's turns
//! ([`TurnMeasure`]).
//! Out: a level for every picture ([`Plan`]), dt and ε for every agent ([`RateDemand`]).
//! Never here: agents, threads, scenes, the GPU. Theory: `docs/theory/control.md`, after (GDC04), and `docs/theory/budget.md`.

mod agents;
mod choice;
mod demand;
mod flicker;
mod picture;
mod prices;
mod render_scale;

pub use crate::cost::benefit::{GivenSliders, Sliders};
pub use crate::cost::stages::Stages;
pub use crate::cost::value::Value;
pub use agents::rate::{RateControl, RateDemand, RateGains, RateLimits, TurnMeasure, VisibleDetail};
pub use agents::tolerance::{ErrorControl, ErrorLimits, ErrorMeasure};
pub use demand::level::{IMPOSTORS_MAX, PRIMITIVE_LEVELS};
pub use demand::plan::{FrameWork, LevelDemand, Plan, Tally, detail};
pub use demand::policy::{Law, Policy};
pub use demand::query::Promise;
pub use demand::status::Status;
pub use demand::view::{FORMS, Kind, Losses, ObjectView, Pieces, Shading, Stroke};
pub use picture::PictureControl;
pub use prices::area::{AREAS_PX, Areas};
pub use prices::price::{Backdrop, Measured, Misses, Prices};
