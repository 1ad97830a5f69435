//! The `metachron` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    metachron::cli::main()
}
