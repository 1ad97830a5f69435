//! `chart`: experiments that show where methods fail, as CSV, SVG and PNG in a folder and a table on standard output.
//!
//! In: which subject, which folder. Out: files, a table, findings. Never here: what is measured (each experiment is a file).

mod accuracy;
mod asynchronous;
mod bench;
mod blank;
mod coupling;
mod energy_bench;
mod experiment;
pub(super) mod figure;
mod lockstep_run;
mod policies;
mod power;
mod rows;
mod scaling;
mod scenes;
mod stability;
mod sweep;
mod table;
mod timing;

pub(crate) use bench::{Cluster, Member};
pub(crate) use stability::common::{GRAVITY, plain_soft};

use super::args::{ChartArgs, Subject};
use accuracy::diagram::Diagram;
use anyhow::Context;
use metachron_console::exit::Exit;
use metachron_console::files::write_file;
use metachron_console::output::{BadInput, data, message};
use metachron_console::progress::Bar;
use metachron_render::{Gpu, PictureFile, offscreen};
use policies::live::Live;
use policies::plates::Figures;
use rows::RowFile;
use scaling::growth::Scaling;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

pub(super) use blank::blank;
pub(super) use experiment::{
    Experiment, Finding, LiveColumns, Measured, Named, Record, claims, count_of, distinct, each, number_of, worst,
    worst_of,
};
pub(super) use figure::{Axis, Colour, Figure, Layer, Mark, Panel, lines, span};
pub(super) use policies::compared::selection::Selection;
pub(super) use power::exponent;
pub(super) use table::{Cell, Shown, Table, fields, table};
pub(super) use timing::{calibration_us, floor_us, least_us, median, pace_for_goals};

/// Settings that the experiments of a command share.
struct Setting<'a> {
    subject: &'static str,
    folder: &'a Path,
    quick: bool,
    quiet: bool,
    stopped: &'a AtomicBool,
}

/// The result of an experiment.
#[derive(Serialize)]
pub(crate) struct Done {
    name: &'static str,
    pub(crate) title: &'static str,
    complete: bool,
    rows: usize,
    pub(crate) files: Vec<PathBuf>,
    pub(crate) table: Table,
    findings: Vec<Finding>,
}

/// An experiment that can be run by its name.
struct Entry {
    name: &'static str,
    /// Its columns that measure times of this machine.
    live: LiveColumns,
    run: fn(&Setting<'_>) -> anyhow::Result<Done>,
}

const fn entry<E: Experiment>() -> Entry {
    Entry { name: E::NAME, live: E::LIVE, run: run::<E> }
}

const STABILITY: &[Entry] = &[
    entry::<stability::clocks::drop::Drop>(),
    entry::<stability::clocks::penalty_limit::PenaltyLimit>(),
    entry::<stability::pairs::Pairs>(),
    entry::<stability::heavy::Heavy>(),
    entry::<stability::clocks::closed::Closed>(),
    entry::<stability::tube_map::TubeMap>(),
    entry::<stability::capstan::Capstan>(),
    entry::<stability::incline::Incline>(),
    entry::<stability::clocks::impact::Impact>(),
];

const ACCURACY: &[Entry] = &[
    entry::<Diagram<accuracy::tubes::cantilever::Cantilever>>(),
    entry::<Diagram<accuracy::tubes::elastica::Elastica>>(),
    entry::<Diagram<accuracy::tubes::catenary::Catenary>>(),
    entry::<Diagram<accuracy::tubes::four_point::FourPoint>>(),
    entry::<Diagram<accuracy::tubes::end_moment::EndMoment>>(),
    entry::<Diagram<accuracy::tubes::helix::Helix>>(),
    entry::<Diagram<accuracy::tubes::frequencies::Frequencies>>(),
    entry::<Diagram<accuracy::tubes::swing::Swing>>(),
    entry::<Diagram<accuracy::tubes::buckling::TwistBuckling>>(),
    entry::<Diagram<accuracy::tubes::buckling::MichellRing>>(),
    entry::<Diagram<accuracy::tubes::inflation::Inflation>>(),
    entry::<Diagram<accuracy::sheet::Sheet>>(),
    entry::<Diagram<accuracy::beam::SolidBeam>>(),
];

const SCALING: &[Entry] = &[
    entry::<Scaling<scaling::segments::Segments>>(),
    entry::<Scaling<scaling::contacts::Contacts>>(),
    entry::<Scaling<scaling::agents::Agents>>(),
    entry::<Scaling<scaling::sleepers::Sleepers>>(),
];

const COUPLING: &[Entry] = &[entry::<coupling::error::CouplingError>()];

const CONTACT: &[Entry] = &[entry::<super::bench::contact::SolveLevels>()];

const POLICIES: &[Entry] = &[
    entry::<policies::papers::auditorium::Auditorium>(),
    entry::<policies::papers::grove::Grove>(),
    entry::<policies::papers::values::Values>(),
    entry::<policies::papers::domes::Domes>(),
    entry::<policies::papers::library::Library>(),
    entry::<policies::papers::walkthrough::Walkthrough>(),
    entry::<policies::compared::disturbed::Disturbed>(),
    entry::<policies::papers::levels::Levels>(),
    entry::<policies::compared::still::Still>(),
    entry::<policies::compared::selection::Selection>(),
    entry::<policies::compared::bound::Bound>(),
    entry::<policies::papers::scanline::Scanline>(),
    entry::<policies::papers::rooms::Rooms>(),
    entry::<policies::compared::every::Every>(),
    entry::<Figures<0, false>>(),
    entry::<Figures<1, false>>(),
    entry::<Figures<2, false>>(),
    entry::<Figures<3, false>>(),
    entry::<Figures<4, false>>(),
    entry::<Figures<5, false>>(),
    entry::<Figures<6, false>>(),
    entry::<Figures<7, false>>(),
];

const POLICIES_LIVE: &[Entry] = &[
    entry::<Live<0>>(),
    entry::<Live<1>>(),
    entry::<Live<2>>(),
    entry::<Live<3>>(),
    entry::<Live<4>>(),
    entry::<policies::live::held::Held>(),
    entry::<Figures<0, true>>(),
    entry::<Figures<1, true>>(),
    entry::<policies::live::prediction::Prediction>(),
    entry::<policies::live::traversal::Traversal>(),
];

/// Some experiments of a subject, and where their files go.
pub(crate) struct Chart {
    subject: &'static str,
    chosen: Vec<&'static Entry>,
    folder: PathBuf,
    quick: bool,
    quiet: bool,
    live: bool,
}

impl Chart {
    /// The experiments that arguments name.
    ///
    /// # Errors
    /// An experiment that there is not, pictures of what draws none.
    pub(crate) fn new(args: &ChartArgs) -> anyhow::Result<Self> {
        let (subject, all) = match (args.subject, args.live) {
            (Subject::Accuracy, false) => ("accuracy", ACCURACY),
            (Subject::Contact, false) => ("contact", CONTACT),
            (Subject::Scaling, false) => ("scaling", SCALING),
            (Subject::Stability, false) => ("stability", STABILITY),
            (Subject::Coupling, false) => ("coupling", COUPLING),
            (Subject::Policies, false) => ("policies", POLICIES),
            (Subject::Policies, true) => ("policies-live", POLICIES_LIVE),
            _ => return Err(BadInput("--live applies to `chart policies` only".to_owned()).into()),
        };
        let chosen = chosen(all, &args.only)?;
        let (folder, quick, quiet, live) = (args.out.clone(), args.quick, args.quiet, args.live);
        Ok(Self { subject, chosen, folder, quick, quiet, live })
    }

    /// The columns of its first experiment that are measured on this machine.
    pub(crate) fn live_columns(&self) -> LiveColumns {
        match self.chosen.first() {
            Some(entry) if !self.live => entry.live,
            _ => LiveColumns::All,
        }
    }

    /// Runs the experiments until it is stopped; `each` is called after every one.
    ///
    /// # Errors
    /// A file that cannot be written, an adapter that failed, an error of `each`.
    pub(crate) fn run(
        &self,
        stopped: &AtomicBool,
        each: &mut dyn FnMut(&Done) -> anyhow::Result<()>,
    ) -> anyhow::Result<Vec<Done>> {
        if self.live {
            // fails here rather than in the rows of the first experiment
            Gpu::headless()?;
        }
        let folder = prepared(&self.folder)?;
        let setting = Setting { subject: self.subject, folder, quick: self.quick, quiet: self.quiet, stopped };
        let mut done = Vec::new();
        for entry in &self.chosen {
            let one = (entry.run)(&setting)?;
            each(&one)?;
            done.push(one);
            if stopped.load(Ordering::Relaxed) {
                break;
            }
        }
        Ok(done)
    }
}

/// Runs the experiments of a subject.
///
/// # Errors
/// Bad input, a file that cannot be written, an adapter that failed.
pub fn command(args: &ChartArgs) -> anyhow::Result<Exit> {
    let chart = Chart::new(args)?;
    let stopped = stopper()?;
    let quiet = args.quiet || args.json;
    let done = chart.run(&stopped, &mut |one| if quiet { Ok(()) } else { data(&summary(one)) })?;
    let interrupted = stopped.load(Ordering::Relaxed);
    if args.json {
        let subject = chart.subject;
        let whole = serde_json::json!({ "chart": subject, "quick": args.quick, "interrupted": interrupted, "experiments": done });
        data(&format!("{}\n", serde_json::to_string_pretty(&whole)?))?;
    }
    if interrupted {
        message("interrupted: the finished rows are kept; run the same command again to continue");
    }
    Ok(if interrupted { Exit::Interrupted } else { Exit::Ok })
}

/// The experiments that were named, or all of them.
fn chosen(all: &'static [Entry], only: &[String]) -> anyhow::Result<Vec<&'static Entry>> {
    let find = |name: &String| all.iter().find(|e| e.name == name).ok_or_else(|| unknown(all, name));
    if only.is_empty() { Ok(all.iter().collect()) } else { only.iter().map(find).collect() }
}

fn unknown(all: &[Entry], name: &str) -> anyhow::Error {
    const NEAR_ENOUGH: f64 = 0.75;
    let near = all.iter().map(|e| (strsim::jaro_winkler(name, e.name), e.name)).max_by(|a, b| a.0.total_cmp(&b.0));
    let hint = near.filter(|n| n.0 > NEAR_ENOUGH).map_or_else(String::new, |n| format!("; did you mean `{}`?", n.1));
    let names: Vec<_> = all.iter().map(|e| e.name).collect();
    BadInput(format!("there is no experiment `{name}`{hint} (there are: {})", names.join(", "))).into()
}

/// Creates the folder and checks that it can be written: before an hour's work rather than after.
pub(super) fn prepared(folder: &Path) -> anyhow::Result<&Path> {
    let refused = |why: std::io::Error| BadInput(format!("the folder {} cannot be written: {why}", folder.display()));
    std::fs::create_dir_all(folder).map_err(refused)?;
    let trial = folder.join(".metachron-trial");
    std::fs::write(&trial, b"").and_then(|()| std::fs::remove_file(&trial)).map_err(refused)?;
    Ok(folder)
}

/// A flag that Ctrl-C sets; pressed again, it ends the program immediately.
pub(super) fn stopper() -> anyhow::Result<Arc<AtomicBool>> {
    let (stopped, presses) = (Arc::new(AtomicBool::new(false)), AtomicU32::new(0));
    let flag = Arc::clone(&stopped);
    ctrlc::set_handler(move || {
        flag.store(true, Ordering::Relaxed);
        if presses.fetch_add(1, Ordering::Relaxed) > 0 {
            std::process::exit(130);
        }
    })
    .context("Ctrl-C cannot be caught")?;
    Ok(stopped)
}

/// Measures, draws and writes one experiment.
fn run<E: Experiment>(setting: &Setting<'_>) -> anyhow::Result<Done> {
    let stem = format!("{}-{}", setting.subject, E::NAME);
    let cases = E::cases(setting.quick);
    let (file, kept) = RowFile::open::<E>(setting.folder, &stem, &settings::<E>(setting.quick), &cases)?;
    let bar = Bar::new(E::NAME, setting.quiet);
    let swept = sweep::sweep::<E>(&cases, file, kept, setting.stopped, &mut |done, all| {
        bar.set(done as f64 / all.max(1) as f64, format!("{done} of {all} rows"));
    })?;
    drop(bar);
    let mut files = vec![setting.folder.join(format!("{stem}.csv"))];
    if swept.complete {
        files.extend(figure::write(setting.folder, &stem, &E::figure(&swept.rows))?);
        files.extend(pictured::<E>(setting.folder, &stem, &swept.rows)?);
    }
    let findings = E::findings(&swept.rows);
    let judged = |one: Finding| if swept.complete { one } else { one.unfinished(swept.rows.len()) };
    Ok(Done {
        name: E::NAME,
        title: E::TITLE,
        complete: swept.complete,
        rows: swept.rows.len(),
        files,
        table: (E::TABLE)(&swept.rows),
        findings: findings.into_iter().map(judged).collect(),
    })
}

/// Identifies rows that may be reused: the experiment, its extent, and the program that measured them.
fn settings<E: Experiment>(quick: bool) -> String {
    format!("{} quick={quick} {}\n", E::NAME, build())
}

/// Identifies the program.
pub(super) fn build() -> String {
    let built = std::env::current_exe().and_then(std::fs::metadata).and_then(|m| Ok((m.len(), m.modified()?)));
    format!("version={} built={:?}", env!("CARGO_PKG_VERSION"), built.ok())
}

/// Writes the pictures next to the figure.
fn pictured<E: Experiment>(folder: &Path, stem: &str, rows: &[E::Row]) -> anyhow::Result<Vec<PathBuf>> {
    let write = |(name, picture): (String, PictureFile)| -> anyhow::Result<PathBuf> {
        let path = folder.join(format!("{stem}-{name}.png"));
        write_file(&path, offscreen::png(&picture)?)?;
        Ok(path)
    };
    E::pictures(rows)?.into_iter().map(write).collect()
}

/// An experiment's claims, with what was measured and whether they hold.
pub(crate) fn claims(done: &Done) -> Table {
    let so_far = if done.complete { "" } else { " so far" };
    let word = |holds: Option<bool>| match holds {
        Some(true) => format!("holds{so_far}"),
        Some(false) => format!("FAILS{so_far}"),
        None => "not measured".to_owned(),
    };
    table!(&done.findings, |one| "": word(one.holds), claim: one.claim, measured(4): one.measured, limit(4): one.limit)
}

/// An experiment's table, claims and files as text.
fn summary(done: &Done) -> String {
    let files: Vec<_> = done.files.iter().map(|f| f.display().to_string()).collect();
    let Done { name, title, table, .. } = done;
    let (state, claims) = (if done.complete { "" } else { " (unfinished)" }, claims(done).text());
    format!("{name}: {title}{state}\n\n{}\n{claims}\nfiles: {}\n\n", table.text(), files.join(", "))
}
