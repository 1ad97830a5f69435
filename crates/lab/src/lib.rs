//! The laboratory: charts of error, stability and cost, benchmarks, and the commands that tune gains and fit scenes.
//!
//! In: arguments. Out: CSV, SVG, PNG and JSON files, tables on standard output.
//! Never here: anything that a running scene needs.
//!
//! ```
//! use clap::{Args, Command};
//! use metachron_lab::args::BenchArgs;
//!
//! let command = BenchArgs::augment_args(Command::new("bench"));
//! let matches = command.try_get_matches_from(["bench", "rod", "--quick"]).unwrap();
//! assert!(matches.get_flag("quick"));
//! ```

pub mod args;
mod bench;
mod chart;
mod fit;
mod tune;

pub use bench::command as bench;
pub use chart::command as chart;
pub use fit::command as fit;
pub use tune::command as tune;
