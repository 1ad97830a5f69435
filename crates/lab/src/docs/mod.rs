//! `docs`: compares documents with what their commands print, or prints it into them.
//!
//! In: Markdown documents with blocks ([`blocks`]). Out: the documents with their blocks printed anew, or the lines that differ.
//! Never here: what a command prints ([`printer`]).

mod blocks;
mod printer;

use super::args::DocsArgs;
use super::chart::{prepared, stopper};
use anyhow::Context;
use blocks::{Block, Part, parts};
use metachron_console::exit::Exit;
use metachron_console::files::write_file;
use metachron_console::output::{BadInput, message};
use printer::Printer;
use std::fs;
use std::path::{Path, PathBuf};

/// The documents of a repository: its README and all below `docs`.
const ALL: [&str; 2] = ["README.md", "docs"];
/// Lines of a block that are shown where it is not what its command prints.
const LINES_SHOWN: usize = 6;

/// Compares or writes documents.
///
/// # Errors
/// A document that cannot be read or written, a block that is not closed, a command that fails.
pub fn command(args: &DocsArgs) -> anyhow::Result<Exit> {
    let stopped = stopper()?;
    // comparing leaves nothing behind
    let passing = match (&args.out, args.write) {
        (None, false) => Some(tempfile::tempdir().context("there is no room for what the commands write")?),
        _ => None,
    };
    let given = args.out.as_deref().unwrap_or(Path::new("charts"));
    let folder = prepared(passing.as_ref().map_or(given, |folder| folder.path()))?;
    let mut printer = Printer::new(folder, args.live, args.quiet, &stopped);
    let named = if args.files.is_empty() { ALL.map(PathBuf::from).to_vec() } else { args.files.clone() };
    let mut documents = Vec::new();
    for path in &named {
        collect(path, &mut documents)?;
    }
    let mut wrong = 0;
    for path in documents {
        let text = fs::read_to_string(&path).map_err(|why| unreadable(&path, &why))?;
        let fresh = printed(&path, &text, &mut printer).with_context(|| path.display().to_string())?;
        let Some(fresh) = fresh else { return Ok(Exit::Interrupted) };
        if args.write {
            for (path, bytes) in fresh.files {
                write_file(&path, bytes)?;
            }
            if fresh.text != text {
                write_file(&path, fresh.text)?;
            }
        } else {
            wrong += fresh.differences.len();
            fresh.differences.iter().for_each(|difference| message(difference));
        }
    }
    if wrong > 0 {
        message(&format!(
            "{wrong} places are not what their commands print; `metachron docs --write` prints them anew"
        ));
    }
    Ok(if wrong == 0 { Exit::Ok } else { Exit::Failed })
}

fn unreadable(path: &Path, why: &std::io::Error) -> BadInput {
    BadInput(format!("{} cannot be read: {why}", path.display()))
}

/// The Markdown files at a path or below it, in the order of their names.
fn collect(path: &Path, out: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    if !path.is_dir() {
        out.push(path.to_owned());
        return Ok(());
    }
    let entries = fs::read_dir(path).map_err(|why| unreadable(path, &why))?;
    let mut below = entries.map(|entry| Ok(entry?.path())).collect::<anyhow::Result<Vec<_>>>()?;
    below.sort();
    below
        .into_iter()
        .filter(|p| p.is_dir() || p.extension().is_some_and(|e| e == "md"))
        .try_for_each(|p| collect(&p, out))
}

/// A document as its commands print it.
struct Fresh {
    text: String,
    /// Figures and their rows, beside the document.
    files: Vec<(PathBuf, Vec<u8>)>,
    /// Where the document says something else.
    differences: Vec<String>,
}

/// Prints the blocks of a document; `None` where that was stopped.
fn printed(path: &Path, text: &str, printer: &mut Printer<'_>) -> anyhow::Result<Option<Fresh>> {
    let mut fresh = Fresh { text: String::new(), files: Vec::new(), differences: Vec::new() };
    for part in parts(text).map_err(|why| BadInput(format!("{why:#}")))? {
        match part {
            Part::Prose(prose) => fresh.text += prose,
            Part::Block(block) => {
                let place = || format!("line {}: {}", block.line, block.opening);
                let Some(said) = printer.print(&block, path.parent().unwrap_or(path)).with_context(place)? else {
                    return Ok(None);
                };
                fresh.text += &format!("{}\n{}", block.opening, said.body);
                if said.body != block.body {
                    fresh.differences.push(difference(path, &block, &said.body));
                }
                for (file, bytes) in said.files {
                    if fs::read(&file).ok().as_ref() != Some(&bytes) {
                        let why = "is not what its command draws";
                        fresh.differences.push(format!("{}:{}: {} {why}", path.display(), block.line, file.display()));
                    }
                    fresh.files.push((file, bytes));
                }
            }
        }
    }
    Ok(Some(fresh))
}

/// The lines in which a block differs from what its command prints.
fn difference(path: &Path, block: &Block<'_>, body: &str) -> String {
    let (mut old, mut new) = (block.body.lines(), body.lines());
    let mut told = format!("{}:{}: not what the command prints: {}", path.display(), block.line, block.opening);
    let pairs = std::iter::from_fn(|| Some((old.next(), new.next())).filter(|(a, b)| a.is_some() || b.is_some()));
    for (old, new) in pairs.filter(|(old, new)| old != new).take(LINES_SHOWN) {
        for (sign, line) in [('-', old), ('+', new)] {
            told += &line.map_or_else(String::new, |line| format!("\n  {sign} {line}"));
        }
    }
    told
}
