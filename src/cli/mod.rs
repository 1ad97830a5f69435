//! The command line: arguments in, exit code out.
//!
//! In: arguments and environment. Out: data on standard output, messages on standard error, requested files.
//! Never here: physics, drawing, the format of scenes.
mod args;
#[cfg(feature = "render")]
mod calibrate;
mod check;
mod describe;
mod devices;
mod exports;
mod generate;
#[cfg(feature = "hosts")]
mod hosts;
mod import;
mod play;
mod replay;
pub mod run;

use args::{Cli, Command};
use clap::{CommandFactory, FromArgMatches};
use metachron_console::exit::Exit;
use std::process::ExitCode;

/// Runs the command given by the arguments.
#[must_use]
pub fn main() -> ExitCode {
    crate::scenes::provide();
    block_file_size_signal();
    let mut arguments: Vec<_> = std::env::args_os().collect();
    if arguments.len() < 2 {
        arguments.truncate(1);
        arguments.push("run".into());
    }
    let matches = Cli::command().get_matches_from(arguments);
    let done = match Cli::from_arg_matches(&matches) {
        Ok(cli) => dispatch(cli, &matches),
        Err(error) => error.exit(),
    };
    done.unwrap_or_else(|error| metachron_console::output::report_error(&error)).into()
}

/// Lets a write past the limit on the size of files (`ulimit -f`) fail, as one to a full disk does, instead of ending the process: the signal that
/// would do that is held back in this thread, and so in all that it starts; programs that it starts have their own mask.
fn block_file_size_signal() {
    #[cfg(unix)]
    {
        use nix::sys::signal::{SigSet, Signal};
        // where the system refuses, the signal ends the process as before
        let _ = SigSet::from(Signal::SIGXFSZ).thread_block();
    }
}

fn dispatch(cli: Cli, matches: &clap::ArgMatches) -> anyhow::Result<Exit> {
    match cli.command {
        #[cfg(feature = "hosts")]
        Command::Run(args) => {
            run::command(&args, matches.subcommand_matches("run"), |request| hosts::place(&args, request))
        }
        #[cfg(not(feature = "hosts"))]
        Command::Run(args) => run::command(&args, matches.subcommand_matches("run"), |_| Ok(())),
        Command::Replay(args) => replay::command(&args),
        #[cfg(feature = "hosts")]
        Command::Host(args) => hosts::host(&args),
        #[cfg(feature = "hosts")]
        Command::View(args) => hosts::view(&args),
        #[cfg(feature = "hosts")]
        Command::Tool(args) => hosts::tool(&args),
        #[cfg(feature = "hosts")]
        Command::Identity(command) => hosts::identity(&command),
        Command::Check(args) => check::command(&args),
        #[cfg(feature = "lab")]
        Command::Chart(args) => metachron_lab::chart(&args),
        #[cfg(feature = "lab")]
        Command::Bench(args) => metachron_lab::bench(&args),
        #[cfg(feature = "lab")]
        Command::Compare(args) => metachron_lab::compare(&args),
        #[cfg(feature = "lab")]
        Command::Docs(args) => metachron_lab::docs(&args),
        #[cfg(feature = "lab")]
        Command::Tune(args) => metachron_lab::tune(&args),
        #[cfg(feature = "lab")]
        Command::Fit(args) => metachron_lab::fit(&args),
        #[cfg(feature = "render")]
        Command::Calibrate(args) => calibrate::command(&args),
        Command::Generate(args) => generate::command(&args),
        Command::Import(args) => import::command(&args),
        Command::Schema => describe::schema(),
        Command::List(args) => describe::list(&args),
        Command::Completions { shell } => describe::completions(shell),
        Command::Man { command } => describe::man(command.as_deref()),
    }
}
