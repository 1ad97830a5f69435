//! The output of a block's command, as Markdown.
//!
//! In: blocks. Out: tables of experiments, the words of other commands, figures. An experiment is measured once, however many blocks show it.
//! Never here: documents.

use super::super::args::ChartArgs;
use super::super::bench::rig::machine::processor;
use super::super::chart::{self, Chart, Done, LiveColumns};
use super::blocks::{Block, View};
use anyhow::{Context, anyhow, ensure};
use clap::{Args, Command, FromArgMatches};
use metachron_console::output::BadInput;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fs;
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;

/// Commands whose every number is a time of this machine.
const LIVE: [&str; 2] = ["bench", "fit"];
/// Begins a block of such numbers.
const STAMP: &str = "Measured on ";

/// How much of a block is the same on every run.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Repeats {
    All,
    /// Some of its columns.
    Columns,
    Nothing,
}

impl Repeats {
    /// Of a block of an experiment with these live columns.
    fn of(views: &[View<'_>], live: LiveColumns) -> Self {
        let columns = views.iter().flat_map(|view| if let View::Columns(names) = view { &names[..] } else { &[] });
        let (shown, of_these) = (columns.clone().count(), columns.filter(|name| live.has(name)).count());
        let tables_alone = views.iter().all(|view| matches!(view, View::Columns(_)));
        match live {
            _ if !live.are_some() || tables_alone && shown > 0 && of_these == 0 => Self::All,
            LiveColumns::These(_) if tables_alone && (shown == 0 || of_these < shown) => Self::Columns,
            _ => Self::Nothing,
        }
    }
}

/// Prints blocks.
pub(super) struct Printer<'a> {
    folder: &'a Path,
    /// Whether blocks that measure this machine are printed too.
    live: bool,
    quiet: bool,
    stopped: &'a AtomicBool,
    done: BTreeMap<String, Done>,
}

/// The Markdown of a block, and the files beside its document.
pub(super) struct Said {
    pub(super) body: String,
    pub(super) files: Vec<(PathBuf, Vec<u8>)>,
}

impl<'a> Printer<'a> {
    pub(super) const fn new(folder: &'a Path, live: bool, quiet: bool, stopped: &'a AtomicBool) -> Self {
        Self { folder, live, quiet, stopped, done: BTreeMap::new() }
    }

    /// Prints a block of a document in the folder `beside`; `None` where that was stopped.
    ///
    /// # Errors
    /// A command that is unknown or fails, a column that it does not print, a live block without its date.
    pub(super) fn print(&mut self, block: &Block<'_>, beside: &Path) -> anyhow::Result<Option<Said>> {
        let chart = match block.words.first() {
            Some(&"chart") => Some(self.chart(&block.words).map_err(wrong)?),
            _ => None,
        };
        let spoken_live = block.words.iter().any(|word| LIVE.contains(word));
        let (live, repeats) = match &chart {
            Some(chart) => (Some(chart.live_columns()), Repeats::of(&block.views, chart.live_columns())),
            None => (None, if spoken_live { Repeats::Nothing } else { Repeats::All }),
        };
        let dated = self.live || repeats == Repeats::All || block.body.starts_with(STAMP);
        if !dated {
            let why = format!("numbers of a machine begin with `{STAMP}`, date, commit and processor");
            return Err(BadInput(why).into());
        }
        if repeats == Repeats::Nothing && !self.live {
            return Ok(Some(Said { body: block.body.to_owned(), files: Vec::new() }));
        }
        let said = match chart {
            Some(chart) => self.charted(&chart, block, beside)?,
            None => Some(Said { body: self.spoken(&block.words)?, files: Vec::new() }),
        };
        Ok(said.map(|said| match (repeats, live) {
            (Repeats::All, _) => said,
            (Repeats::Columns, Some(live)) if !self.live => Said { body: kept(&said.body, block.body, live), ..said },
            _ => Said { body: stamp() + &said.body, ..said },
        }))
    }

    /// The chart that a block names.
    fn chart(&self, words: &[&str]) -> anyhow::Result<Chart> {
        let command = ChartArgs::augment_args(Command::new("chart"));
        let matches = command.try_get_matches_from(words)?;
        let mut args = ChartArgs::from_arg_matches(&matches)?;
        ensure!(args.only.len() == 1, "a block shows one experiment, named by `--only`");
        // quick rows and all rows of an experiment are files of one name
        args.out = self.folder.join(if args.quick { "quick" } else { "all" });
        args.quiet = self.quiet;
        Chart::new(&args)
    }

    fn charted(&mut self, chart: &Chart, block: &Block<'_>, beside: &Path) -> anyhow::Result<Option<Said>> {
        let done = match self.done.entry(block.words.join(" ")) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(open) => {
                let done = chart.run(self.stopped, &mut |_| Ok(()))?.pop();
                open.insert(done.context("the experiment was not run")?)
            }
        };
        if self.stopped.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let figures =
            ["figures", "../figures", "docs/figures"].map(|f| beside.join(f)).into_iter().find(|f| f.is_dir());
        let mut table = done.table.clone();
        for (column, values) in &block.only {
            table = table.only(column, values).map_err(wrong)?;
        }
        let (mut shown, mut files) = (Vec::new(), Vec::new());
        for view in &block.views {
            shown.push(match view {
                View::Columns(columns) => table.columns(columns).map_err(wrong)?.markdown(),
                View::Claims => chart::claims(done).markdown(),
                View::Figure => {
                    let folder = figures.as_ref().context("there is no folder `figures` beside the document")?;
                    files.extend(drawn(done, folder)?);
                    figure(done, beside, folder)?
                }
            });
        }
        if shown.is_empty() {
            shown.push(table.markdown());
        }
        Ok(Some(Said { body: shown.join("\n"), files }))
    }

    /// The output of another command, with the command above it.
    fn spoken(&self, words: &[&str]) -> anyhow::Result<String> {
        if words.first() == Some(&"docs") {
            let why = "a document cannot print `metachron docs`, which would begin it again";
            return Err(BadInput(why.to_owned()).into());
        }
        let folder = self.folder.join("spoken");
        if folder.exists() {
            fs::remove_dir_all(&folder).with_context(|| format!("{} cannot be removed", folder.display()))?;
        }
        fs::create_dir_all(&folder).with_context(|| format!("{} cannot be made", folder.display()))?;
        let output = process::Command::new(std::env::current_exe()?).args(words).current_dir(&folder).output()?;
        if !output.status.success() {
            let why = format!("it ended with {}: {}", output.status, String::from_utf8_lossy(&output.stderr).trim());
            // a command that is no command, or has no such argument
            return Err(if output.status.code() == Some(2) { BadInput(why).into() } else { anyhow!(why) });
        }
        let said = String::from_utf8(output.stdout).context("it prints no text")?;
        let lines = said.lines().map(|line| format!("{}\n", line.trim_end())).collect::<String>();
        Ok(format!("```\n$ metachron {}\n{lines}```\n", words.join(" ")))
    }
}

/// A mistake in the document, not of the command.
fn wrong(why: anyhow::Error) -> anyhow::Error {
    BadInput(format!("{why:#}")).into()
}

/// Tables as printed anew, with the stamp of those that stand in the document, and with the live columns of their rows whose other cells are the
/// same; a row that is new, or says something else now, has dashes there.
fn kept(fresh: &str, old: &str, live: LiveColumns) -> String {
    let (stamped, old) = old.split_once("\n\n").unwrap_or((old, ""));
    let mut known = rows(old);
    let lines = fresh.lines().zip(rows(fresh)).map(|(line, row)| {
        if row.is_empty() {
            return line.to_owned();
        }
        let is_live = |name: &str, cell: &str| name != cell && live.has(name);
        let has = |old: &Vec<NamedCell<'_>>, cell: &NamedCell<'_>| is_live(cell.name, cell.text) || old.contains(cell);
        let same = known.iter_mut().find(|old| row.iter().all(|cell| has(old, cell)));
        // each row is the time of one
        let same = same.map(std::mem::take).unwrap_or_default();
        let cell = |cell: &NamedCell<'_>| {
            let before = same.iter().find(|old| old.name == cell.name).map_or("–", |old| old.text);
            if is_live(cell.name, cell.text) { before.to_owned() } else { cell.text.to_owned() }
        };
        format!("| {} |", row.iter().map(cell).collect::<Vec<_>>().join(" | "))
    });
    format!("{stamped}\n\n{}\n", lines.collect::<Vec<_>>().join("\n"))
}

/// A cell of a table with the name of its column.
#[derive(Debug, Clone, Copy, PartialEq)]
struct NamedCell<'a> {
    name: &'a str,
    text: &'a str,
}

/// The cells of each line of tables, headers among them; none of another line.
fn rows(text: &str) -> Vec<Vec<NamedCell<'_>>> {
    let mut header = Vec::new();
    let row = |line| {
        let all = cells(line);
        if header.len() != all.len() {
            header.clone_from(&all);
        }
        header.iter().zip(all).map(|(name, text)| NamedCell { name, text }).collect()
    };
    text.lines().map(row).collect()
}

/// The cells of a line of a table; none of another line.
fn cells(line: &str) -> Vec<&str> {
    let inner = line.strip_prefix("| ").and_then(|rest| rest.strip_suffix(" |"));
    inner.map_or_else(Vec::new, |inner| inner.split(" | ").collect())
}

/// The drawing of an experiment and its rows, where documents keep them.
fn drawn(done: &Done, folder: &Path) -> anyhow::Result<Vec<(PathBuf, Vec<u8>)>> {
    let kind = |path: &Path, kind: &str| path.extension().is_some_and(|e| e == kind);
    let mut files = Vec::new();
    for path in &done.files {
        let kept = folder.join(path.file_name().unwrap_or_default());
        if kind(path, "svg") || kind(path, "csv") && kept.exists() {
            files.push((kept, fs::read(path).with_context(|| format!("{} cannot be read", path.display()))?));
        }
    }
    Ok(files)
}

/// The line that shows an experiment's drawing.
fn figure(done: &Done, beside: &Path, folder: &Path) -> anyhow::Result<String> {
    let drawing = done.files.iter().find(|f| f.extension().is_some_and(|e| e == "svg"));
    let name = drawing.and_then(|f| f.file_name()).context("the experiment draws nothing")?;
    let path = folder.strip_prefix(beside).unwrap_or(folder).join(name);
    Ok(format!("![{}]({})\n", done.title, path.display()))
}

/// When, of which source and on which machine numbers were measured.
fn stamp() -> String {
    let days = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86_400);
    let described = process::Command::new("git").args(["describe", "--always", "--dirty"]).output();
    let commit = described.ok().filter(|out| out.status.success()).and_then(|out| String::from_utf8(out.stdout).ok());
    let commit = commit.map_or_else(|| env!("CARGO_PKG_VERSION").to_owned(), |text| text.trim().to_owned());
    format!("{STAMP}{}, {commit}, {}.\n\n", date(days), processor())
}

/// The date so many days after the first of 1970.
fn date(days: u64) -> String {
    // years from March on, so that a leap day is the last of one; eras of 400 years from the year 0
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let (day, month) = (day - (153 * month + 2) / 5 + 1, if month < 10 { month + 3 } else { month - 9 });
    format!("{:04}-{month:02}-{day:02}", era * 400 + year + u64::from(month <= 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn live_columns_are_those_of_the_document_and_others_are_printed_anew() {
        let live = LiveColumns::These(&["ms"]);
        let old = "Measured on 2026-11-30, here.\n\n| n | ms | error |\n| --: | --: | --: |\n| 8 | 1.5 | 0.02 |\n";
        let fresh = "| n | ms | error |\n| --: | --: | --: |\n| 8 | 9.9 | 0.02 |\n| 16 | 9.9 | 0.01 |\n";
        assert_eq!(kept(fresh, old, live), old.to_owned() + "| 16 | – | 0.01 |\n");
        // times go with their rows, wherever these and their columns stand, and with no others
        let moved = "| ms | n | error |\n| --: | --: | --: |\n| 9.9 | 16 | 0.01 |\n| 9.9 | 8 | 0.02 |\n";
        assert!(kept(moved, old, live).ends_with("| – | 16 | 0.01 |\n| 1.5 | 8 | 0.02 |\n"));
        assert!(kept(&fresh.replace("0.02", "0.03"), old, live).contains("| 8 | – | 0.03 |"));
        let columns = |names: &[&'static str]| Repeats::of(&[View::Columns(names.to_vec())], live);
        assert_eq!(columns(&["n", "error"]), Repeats::All);
        assert_eq!(columns(&["n", "ms"]), Repeats::Columns);
        assert_eq!((columns(&["ms"]), Repeats::of(&[View::Claims], live)), (Repeats::Nothing, Repeats::Nothing));
        assert_eq!((Repeats::of(&[], live), Repeats::of(&[], LiveColumns::All)), (Repeats::Columns, Repeats::Nothing));
    }

    #[test]
    fn days_are_dates() {
        let known = [(0, "1970-01-01"), (59, "1970-03-01"), (11_016, "2000-02-29"), (20_787, "2026-11-30")];
        for (days, text) in known {
            assert_eq!(date(days), text);
        }
    }
}
