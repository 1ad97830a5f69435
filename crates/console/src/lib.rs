//! What the commands of metachron share: exit codes, messages, progress, values of arguments, files of gains.
//!
//! In: text of arguments and files. Out: typed values; data on standard output, messages on standard error.
//! Never here: a command, physics, drawing.
//!
//! ```
//! use metachron_console::values::{assignment, size};
//!
//! assert_eq!(size("1280x720"), Ok([1280, 720]));
//! assert!(size("0x720").unwrap_err().contains("expected"));
//! let (key, value) = assignment("target.frame_hz = 60").unwrap();
//! assert_eq!((key.as_str(), value.as_str()), ("target.frame_hz", "60"));
//! ```

pub mod exit;
pub mod gains;
pub mod output;
pub mod progress;
pub mod values;
