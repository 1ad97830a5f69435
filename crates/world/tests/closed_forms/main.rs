//! What worlds in lockstep do, against closed forms and against each other: bodies that are led, held, turned and soft, and what is asked of them.

mod kinematic;
mod queries;
mod restraint;
mod rotations;
mod sensors;
mod soft;
