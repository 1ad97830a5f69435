//! The `metachron` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    metachron::cli::main(|request, _| anyhow::bail!("the scene {} cannot be played yet", request.scene.name))
}
