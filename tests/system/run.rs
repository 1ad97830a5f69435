//! Promises of the whole program, played from the command line: physics, control, rest, outputs and ends.

mod budget;
mod grasp;
mod isolation;
mod limits;
mod outputs;
mod physics;
mod settling;
