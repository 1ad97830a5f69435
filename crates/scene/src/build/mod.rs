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
mod rigid;
mod scenery;
mod sensor;
mod soft;
mod soft_mesh;
mod stage;
mod stl;
mod synthetic;
mod tetrahedra;
mod texture;
mod tool;
mod tube;

use crate::check::{Allowed, allowed};

pub(super) use cells::cells;
pub(super) use common::world_faults;
pub(super) use coupling::couplings;
pub(super) use group::groups;
pub(super) use joint::joints;
pub use mesh::surface;
pub(super) use mesh::triangles;
pub(super) use object::{AGENTS_MAX, Names, Objects, SceneContext, read_objects};
pub(super) use sensor::{joint_names, sensors};
pub(super) use stage::{cameras, machine, probes, target};

/// Coordinates of a scene stay within this, metres: past it a millimetre is lost in 32-bit drawing.
pub(super) const POSITION_MAX_M: f64 = 1e5;

/// Fastest start, m/s and rad/s: a faster body passes through anything within one step.
const SPEED_MAX: f64 = 1e4;

/// Greatest angle of a rotation to either side, degrees: past it double precision leaves less than a billionth of a turn.
const ROTATION_MAX_DEG: f64 = 1e6;

/// Most keyframes of a script.
const KEYFRAMES_MAX: usize = 10_000;

/// Sizes of solids, rigid or soft.
const LENGTH: Allowed = allowed(1e-6..=1e4, "m");

/// Scales of meshes: metres per unit of the file.
const SCALE: Allowed = allowed(1e-6..=1e6, "");

/// Coulomb friction coefficients of surfaces.
const FRICTION: Allowed = allowed(0.0..=10.0, "");

/// Stiffness of springs of couplings and joints.
const STIFFNESS: Allowed = allowed(1e-6..=1e9, "N/m");

/// Damping of the same springs.
const DAMPING: Allowed = allowed(0.0..=1e7, "N·s/m");

/// Forces above which couplings and joints tear.
const TEARING: Allowed = allowed(1e-6..=1e9, "N");

/// Times of keyframes and loads.
const TIME: Allowed = allowed(0.0..=1e6, "s");
