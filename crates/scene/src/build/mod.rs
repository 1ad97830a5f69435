//! Builds a scene that can be run from the typed file: rules, defaults, names.
//!
//! In: [`super::format`] types and the document they came from. Out: [`Scene`] parts, problems to the [`Checker`].
//! Never here: text and its syntax.

mod common;
mod coupling;
mod glb;
mod grid;
mod group;
mod impostors;
mod joint;
mod joint_keys;
mod joint_rules;
mod mesh;
mod obj;
mod object;
mod rigid;
mod scenery;
mod soft;
mod stage;
mod synthetic;
mod texture;
mod tool;
mod tube;

pub(super) use common::world_faults;
pub(super) use coupling::couplings;
pub(super) use group::groups;
pub(super) use joint::joints;
pub(super) use object::{AGENTS_MAX, Around, Names, Objects, read_objects};
pub(super) use stage::{camera, machine, probes, target};

/// Coordinates of a scene stay within this, metres: past it a millimetre is lost in 32-bit drawing.
pub(super) const POSITION_MAX_M: f64 = 1e5;
