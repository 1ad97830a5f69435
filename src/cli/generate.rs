//! `generate`: writes a scene of the papers' experiments.
//!
//! In: the scene's name and options. Out: TOML on standard output or in a file. Never here: the content of a scene.

use super::args::GenerateArgs;
use anyhow::Context;
use metachron_console::exit::Exit;
use metachron_console::files::{check_output_path, write_file};
use metachron_console::output::{BadInput, data, message};
use metachron_scene::papers::{Choices, Paper};

/// Writes the scene.
pub(super) fn command(args: &GenerateArgs) -> anyhow::Result<Exit> {
    let paper: Paper = args.scene.parse().context("there is no such scene")?;
    refuse_strays(args, paper)?;
    let usual = Choices::default();
    let trees = args.trees.unwrap_or(usual.trees);
    let text = paper.text(&Choices { seed: args.seed, trees, zigzag: args.zigzag, prefix: args.prefix });
    match &args.out {
        None => data(&text)?,
        Some(path) => {
            check_output_path(path, "--out", args.force)?;
            write_file(path, text)?;
            message(&format!("scene: {}", path.display()));
        }
    }
    Ok(Exit::Ok)
}

/// Refuses the grove's options for other scenes: only the grove has trees and two paths.
fn refuse_strays(args: &GenerateArgs, paper: Paper) -> Result<(), BadInput> {
    let given = [("--trees", args.trees.is_some()), ("--zigzag", args.zigzag), ("--prefix", args.prefix)];
    match given.iter().find(|(_, given)| *given) {
        Some((flag, _)) if paper != Paper::Grove => {
            Err(BadInput(format!("{flag} applies to the grove only, not to {}", paper.name())))
        }
        _ => Ok(()),
    }
}
