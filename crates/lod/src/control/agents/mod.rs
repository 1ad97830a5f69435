//! How finely an agent is simulated: its dt and ε.
//!
//! In: the measured time of its turns, or the error of its steps. Out: a demand. Never here: pictures.

pub mod rate;
pub mod tolerance;
