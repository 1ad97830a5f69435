//! The gains by which agents hold their shares of a core.
//!
//! In: windows of a measured run. Out: gains and a verdict. Never here: the picture's loop.

pub mod agent_plant;
pub mod agent_tuning;
