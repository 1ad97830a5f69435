//! The cones that bound impulses: projections on them, their algebra, the way to their edge.
//!
//! In: impulses and radii. Out: the nearest impulses allowed, and slopes. Never here: contacts, bodies.

pub mod cone;
pub mod lorentz;
