//! Exit codes, messages, progress, values of arguments and files of gains that the commands of metachron share.
//!
//! In: text of arguments and files. Out: typed values; data on standard output, messages on standard error.
//! Never here: a command, physics, drawing.
//!
//! ```
//! use metachron_console::values::{assignment, seconds, size};
//!
//! assert_eq!(size("1280x720"), Ok([1280, 720]));
//! assert!(size("0x720").unwrap_err().contains("1280x720")); // the message shows an example
//! assert_eq!(seconds("2.5"), Ok(2.5));
//! assert!(seconds("inf").is_err());
//! // white space is dropped, and a value may contain the sign
//! let expected = ("look".to_owned(), "'x=y'".to_owned());
//! assert_eq!(assignment("look = 'x=y'"), Ok(expected));
//! ```

pub mod exit;
pub mod files;
pub mod gains;
pub mod output;
pub mod progress;
pub mod values;
