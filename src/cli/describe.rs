//! `schema`, `list`, `completions`, `man`: descriptions of the program.

use super::args::{Cli, ListArgs};
use clap::CommandFactory;
use metachron_console::exit::Exit;
use metachron_console::output::{BadInput, data};
use metachron_scene::{builtin, json_schema, load};
use serde::Serialize;

/// The JSON Schema of scene files.
pub(super) fn schema() -> anyhow::Result<Exit> {
    data(&format!("{}\n", serde_json::to_string_pretty(&json_schema())?))?;
    Ok(Exit::Ok)
}

#[derive(Serialize)]
struct Row {
    name: &'static str,
    description: String,
    agents: usize,
    frame_hz: f64,
}

/// The built-in scenes.
pub(super) fn list(args: &ListArgs) -> anyhow::Result<Exit> {
    let row = |built_in: &builtin::BuiltIn| {
        let scene = load(&built_in.source()?, &[])?;
        let (agents, frame_hz) = (scene.agents.len(), scene.target.frame_hz);
        anyhow::Ok(Row { name: built_in.name, description: scene.description, agents, frame_hz })
    };
    let rows = builtin::all().iter().map(row).collect::<Result<Vec<_>, _>>()?;
    let text = if args.json {
        serde_json::to_string_pretty(&rows)? + "\n"
    } else {
        rows.iter().map(|r| format!("{:<11} {}\n", r.name, r.description)).collect()
    };
    data(&text)?;
    Ok(Exit::Ok)
}

/// The completions for a shell.
pub(super) fn completions(shell: clap_complete::Shell) -> anyhow::Result<Exit> {
    let mut bytes = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "metachron", &mut bytes);
    data(&String::from_utf8_lossy(&bytes))?;
    Ok(Exit::Ok)
}

/// The manual page of the program, or of one of its commands.
pub(super) fn man(command: Option<&str>) -> anyhow::Result<Exit> {
    let mut program = Cli::command();
    program.build();
    let page = match command {
        None => &program,
        Some(name) => program
            .find_subcommand(name)
            .ok_or_else(|| BadInput(format!("there is no command `{name}`; see `metachron help`")))?,
    };
    let mut bytes = Vec::new();
    clap_mangen::Man::new(page.clone()).render(&mut bytes)?;
    data(&String::from_utf8_lossy(&bytes))?;
    Ok(Exit::Ok)
}
