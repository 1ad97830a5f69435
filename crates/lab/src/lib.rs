//! The laboratory: charts of error, stability and cost, benchmarks, and the commands that compare films, tune gains and fit scenes.
//!
//! In: arguments. Out: CSV, SVG, PNG and JSON files, tables on standard output.
//! Never here: anything that a running scene needs.
//!
//! ```
//! use clap::{Args, Command, FromArgMatches};
//! use metachron_lab::args::{BenchArgs, BenchSubject};
//! use std::path::Path;
//!
//! let command = BenchArgs::augment_args(Command::new("bench"));
//! let matches = command.clone().try_get_matches_from(["bench", "rod", "--quick", "--seconds", "2"]).unwrap();
//! let args = BenchArgs::from_arg_matches(&matches).unwrap();
//! assert_eq!((args.subject, args.quick, args.seconds), (BenchSubject::Rod, true, Some(2.0)));
//! assert_eq!(args.out, Path::new("bench")); // where no folder is named
//! assert!(command.try_get_matches_from(["bench", "rod", "--seconds", "-1"]).is_err());
//! ```

pub mod args;
mod bench;
mod chart;
mod compare;
mod docs;
mod fit;
mod tune;

pub use bench::command as bench;
pub use chart::command as chart;
pub use compare::command as compare;
pub use docs::command as docs;
pub use fit::command as fit;
pub use tune::command as tune;
