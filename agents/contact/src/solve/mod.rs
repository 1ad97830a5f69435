//! Contact clusters: one frictional contact problem over all bodies that touch, solved to its end in every step.
//!
//! In: members (a matrix, free velocities), contacts and rows of joints as plain data ([`Problem`]). Out: impulses, velocities and a
//! report ([`Solution`]). Never here: search for contacts, clocks, models. Theory: `docs/theory/clusters.md`.
//!
//! ```
//! use glam::{DMat3, DVec3};
//! use metachron_core::PlainLoop;
//! use metachron_contact::solve::{Block, Contact, Member, Problem, Side, Solver};
//!
//! // a box of 2 kg, 0.2 m wide, on a floor under its corners, pushed aside; its spin is the second block
//! let (h_s, mass_kg) = (0.01, 2.0);
//! let inertia = DVec3::splat(mass_kg * 0.2 * 0.2 / 6.0);
//! let blocks = [
//!     Block { row: 0, column: 0, value: DMat3::from_diagonal(DVec3::splat(mass_kg)) },
//!     Block { row: 1, column: 1, value: DMat3::from_diagonal(inertia) },
//! ];
//! let free = [DVec3::new(0.5, 0.0, -9.81 * h_s), DVec3::ZERO];
//! let members = [Member { blocks: &blocks, free: &free, unanswered: &[], now: &[], share: 1.0, response: None }];
//! let corner = |x, y| Contact {
//!     sides: [Side::rigid(0, DVec3::new(x, y, -0.1)), Side::FIXED],
//!     normal: DVec3::Z,
//!     tangents: [DVec3::X, DVec3::Y],
//!     gap_m: 0.0,
//!     friction: 0.3,
//!     parting_m_s: 0.0,
//!     surface_m_s: DVec3::ZERO,
//!     owed_slip_m: DVec3::ZERO,
//!     warm_n_s: DVec3::ZERO,
//!     load_n_s: 0.0,
//!     overlap_m: 0.0,
//! };
//! let contacts = [corner(-0.1, -0.1), corner(0.1, -0.1), corner(-0.1, 0.1), corner(0.1, 0.1)];
//! let mut solver = Solver::default();
//! let solution = solver.solve(&Problem { h_s, members: &members, contacts: &contacts, rows: &[], threads: &PlainLoop })?;
//!
//! let given: DVec3 = solution.contacts_n_s.iter().sum();
//! assert!((given.z - mass_kg * 9.81 * h_s).abs() < 0.001); // the floor carries the box …
//! assert!((given.x + 0.3 * given.z).abs() < 1e-4); // … and slows it by Coulomb's law
//! assert!(solution.report.miss_m_s < 5e-6); // all laws hold
//! # Ok::<(), metachron_contact::solve::ProblemError>(())
//! ```

mod cones;
mod equations;
mod levels;
mod solver;
mod sparse;
mod statement;

pub use equations::system::StepForm;
pub use solver::{DEPTH_DEFAULT_M, Report, Settings, Solution, Solver};
pub use sparse::sparse_factor::SparseFactor;
pub use statement::error::ProblemError;
pub use statement::joint::{Hold, JointRow, Pressed, Spring};
pub use statement::problem::{Block, Contact, Member, Problem, Response, multiply};
pub use statement::side::{SIDE_TERMS_MAX, Side, SidePart, SideTerm};

#[cfg(test)]
mod tests;
