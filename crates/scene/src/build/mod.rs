//! Builds a scene that can be run from the typed file: rules, defaults, names.
//!
//! In: [`super::format`] types and the document they came from. Out: [`Scene`] parts, problems to the [`Checker`].
//! Never here: text and its syntax.

mod cells;
mod common;
mod contact;
mod coupling;
mod force_limits;
mod glb;
mod grid;
mod group;
mod impostors;
mod inertia;
mod joint;
mod joint_keys;
mod joint_rules;
mod mesh;
mod motor;
mod obj;
mod object;
mod objects;
mod rigid;
mod scenery;
mod sensor;
mod soft;
mod soft_mesh;
mod stage;
mod stl;
mod tetrahedra;
mod texture;
mod tool;
mod tube;

pub(super) use crate::format::ranges::POSITION_MAX_M;
pub(super) use cells::cells;
pub(super) use coupling::couplings;
pub(super) use group::groups;
pub(super) use joint::joints;
pub use mesh::surface;
pub(super) use mesh::triangles;
pub(super) use object::{make_objects, read_objects};
pub(super) use objects::{AGENTS_MAX, Entry, Names, Objects, SceneContext};
pub(super) use sensor::{joint_names, sensors};
pub(super) use stage::{cameras, check_target, machine, probes};
