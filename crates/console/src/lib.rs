//! What the commands of metachron share: exit codes, messages, progress, values of arguments, files of gains.
//!
//! In: text of arguments and files. Out: typed values; data on standard output, messages on standard error.
//! Never here: a command, physics, drawing.

pub mod exit;
pub mod gains;
pub mod output;
pub mod progress;
pub mod values;
