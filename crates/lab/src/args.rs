//! The arguments of `chart`, `bench`, `compare`, `docs`, `tune` and `fit`.

use clap::builder::PossibleValuesParser;
use clap::{Args, ValueHint};
use metachron_console::values::{CommonArgs, bounded, seconds, size, target_fps};
use std::path::PathBuf;

/// Examples for the help of the command.
pub const BENCH_EXAMPLES: &str = "\
Examples:
  metachron bench agents --quick                       a minute, into the folder bench/
  metachron bench agents --executor pool --agents 1000
  metachron bench pile --quick
  metachron bench soft --peers docs/bench/soft-peers.json
  metachron bench scenes --against ../before/target/release/metachron
  metachron bench agents --json -q | jq '.rows[] | [.agents, .cpu_us_per_step]'

Compare CPU times: wall times include the load of other programs.";

/// Examples for the help of the command.
pub const TUNE_EXAMPLES: &str = "\
Examples:
  metachron tune tube                                  finds gains on the declared machine; writes tube.gains.toml and charts/
  metachron run tube --gains tube.gains.toml           plays the scene with them
  metachron tune yard --target-fps 120 --quick
  metachron tune tube --analyse α=1e-4,β=5             explains why given gains are slow, unstable or good
  metachron tune tube --live --size 640x360            on this machine and its adapter

Ctrl-C keeps the best gains so far.";

/// Examples for the help of the command.
pub const FIT_EXAMPLES: &str = "\
Examples:
  metachron fit my.toml --tolerance 1e-3               present cost of every object, and cost needed for 1 mm
  metachron fit my.toml --tolerance 1e-3 --write       and writes these settings into the scene
  metachron fit tube --tolerance 5e-3 --probe intestine --seconds 1
  metachron fit my.toml --tolerance 1e-4 --json -q | jq '.objects[].needs'

Ctrl-C keeps the best found so far.";

/// Examples for the help of the command.
pub const CHART_EXAMPLES: &str = "\
Examples:
  metachron chart stability                            every experiment, into the folder charts/
  metachron chart stability --quick --only tube-map --out /tmp/charts
  metachron chart coupling --quick
  metachron chart policies --live --only auditorium    the paper's walkthrough on this adapter
  metachron chart stability --json -q | jq '.experiments[].findings'

Ctrl-C ends a sweep after the rows in progress; run the same command again to continue.";

/// Examples for the help of the command.
pub const COMPARE_EXAMPLES: &str = "\
Examples:
  metachron run domes --headless --policy hierarchical --video with-groups.y4m
  metachron run domes --headless --policy greedy --video without.y4m
  metachron compare with-groups.y4m without.y4m        writes comparison.html, and prints how alike they are
  metachron compare --votes votes.csv more.csv         strengths of the films by the votes that the page saved";

/// Examples for the help of the command.
pub const DOCS_EXAMPLES: &str = "\
Examples:
  metachron docs                                       README.md and docs/ against what their commands print
  metachron docs --write docs/policies.md              prints its tables and figures anew
  metachron docs --write --live docs/accuracy.md       also what is measured on this machine

A block is what stands between two comments:
  <!-- metachron chart policies --only auditorium | policy = greedy, adaptive | policy, mean, max | claims | figure -->
  <!-- end -->
The command comes first, and names one experiment if it is a chart. Then, after each |, rows (column = values), columns,
`claims`, or `figure`, which is kept in the folder figures. Other commands stand as words under their prompt.
A comment that is nearly one of these is refused with its line; code between fences is not read.
Columns of times of this machine are left as they stand, under the line with their date; others are compared.
Exit codes: 0 all the same, 1 a document says something else or a command fails, 2 a document, or a block of one, that cannot be read.";

/// `tune`.
#[derive(Debug, Args)]
pub struct TuneArgs {
    /// A built-in scene or the path of a scene file
    #[arg(default_value = "tube", value_hint = ValueHint::FilePath)]
    pub scene: String,
    /// Explain these gains instead of searching for better ones, such as α=1e-4,β=5 or kappa=0.5,margin=0.1
    #[arg(long, value_name = "GAINS")]
    pub analyse: Option<String>,
    /// Write the gains here (TOML); SCENE.gains.toml where not given
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub gains: Option<PathBuf>,
    /// Overwrite an existing gains file
    #[arg(long)]
    pub force: bool,
    /// Write the figure here; the folder is created where it does not exist
    #[arg(long, value_name = "FOLDER", default_value = "charts", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// Run the experiment on this machine and its graphics adapter instead of the declared machine
    #[arg(long)]
    pub live: bool,
    /// Target frame rate, frames per second, 1 to 1000
    #[arg(long, value_name = "F", value_parser = target_fps)]
    pub target_fps: Option<f64>,
    /// Size of the picture in pixels, each 1 to 8192; 1280x720 where not given
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Seed of the declared machine's noise
    #[arg(long, value_name = "N")]
    pub seed: Option<u32>,
    /// Fewer frames and seeds: takes seconds instead of a minute
    #[arg(long)]
    pub quick: bool,
    /// The arguments common to `check`, `tune` and `fit`.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// `fit`.
#[derive(Debug, Args)]
pub struct FitArgs {
    /// A built-in scene or the path of a scene file
    #[arg(value_hint = ValueHint::FilePath)]
    pub scene: String,
    /// Greatest distance of a probe from its position in the converged answer, metres
    #[arg(long, value_name = "METRES", allow_hyphen_values = true)]
    pub tolerance: f64,
    /// Compare only the probes of this object, or its ends and middle where it has none
    #[arg(long, value_name = "NAME")]
    pub probe: Option<String>,
    /// Simulated seconds that are compared, 0.01 to 1000
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = fit_seconds)]
    pub seconds: f64,
    /// Greatest number of runs of the scene, of all kinds together
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub runs: u32,
    /// Write the settings found into the scene file; every other line stays as it is
    #[arg(long)]
    pub write: bool,
    /// The arguments common to `check`, `tune` and `fit`.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// `compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// Films of one size as `run --video` writes them (YUV4MPEG2, 8 bits, 4:2:0), at least two
    #[arg(required_unless_present = "votes", value_hint = ValueHint::FilePath)]
    pub films: Vec<PathBuf>,
    /// The page that shows two of them side by side and asks which is better; it needs no other file
    #[arg(long, value_name = "FILE", default_value = "comparison.html", value_hint = ValueHint::FilePath)]
    pub out: PathBuf,
    /// Evaluate these files of votes, which the page saves, instead
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["films", "out"], value_hint = ValueHint::FilePath)]
    pub votes: Vec<PathBuf>,
}

/// `docs`.
#[derive(Debug, Args)]
pub struct DocsArgs {
    /// Documents and folders of documents; README.md and docs where none is named
    #[arg(value_hint = ValueHint::AnyPath)]
    pub files: Vec<PathBuf>,
    /// Print into the documents what their commands print, instead of comparing them
    #[arg(long)]
    pub write: bool,
    /// Also print what is measured on this machine, with date, commit and processor
    #[arg(long, requires = "write")]
    pub live: bool,
    /// Keep the files that the commands write here; the folder is created where it does not exist. Default: `charts` with --write, else they
    /// are not kept
    #[arg(long, value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    pub out: Option<PathBuf>,
    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}

/// `chart`.
#[derive(Debug, Args)]
pub struct ChartArgs {
    /// Subject to chart
    pub subject: Subject,
    /// Write the files here; the folder is created where it does not exist
    #[arg(long, value_name = "FOLDER", default_value = "charts", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// Fewer cases or shorter runs: takes seconds instead of minutes
    #[arg(long)]
    pub quick: bool,
    /// For policies: draw with the renderer on this machine's graphics adapter instead of using a declared machine
    #[arg(long)]
    pub live: bool,
    /// Only this experiment; may be repeated
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Print the tables as JSON on standard output and nothing else there
    #[arg(long)]
    pub json: bool,
    /// No progress and no tables
    #[arg(short, long)]
    pub quiet: bool,
}

/// `bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// Subject to measure
    pub subject: BenchSubject,
    /// Write the files here; the folder is created where it does not exist
    #[arg(long, value_name = "FOLDER", default_value = "bench", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// Fewer cases, each for a second
    #[arg(long)]
    pub quick: bool,
    /// For agents: only this executor; may be repeated
    #[arg(long, value_parser = PossibleValuesParser::new(["threads", "pool", "lockstep"]))]
    pub executor: Vec<String>,
    /// For agents: only this model; may be repeated
    #[arg(long, value_parser = PossibleValuesParser::new(["synthetic", "asleep", "rod", "rigid"]))]
    pub model: Vec<String>,
    /// For agents: only cases of at most this many agents
    #[arg(long, value_name = "N")]
    pub agents: Option<usize>,
    /// For contact: only this scene; may be repeated
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// For soft and contact: show another engine's rows beside ours, from the file that python/peers/soft.py or contact.py writes
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub peers: Option<PathBuf>,
    /// For scenes: show another build beside this one, from its program
    #[arg(long, value_name = "PROGRAM", value_hint = ValueHint::ExecutablePath)]
    pub against: Option<PathBuf>,
    /// How long each case runs; for pile and scenes: simulated seconds
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub seconds: Option<f64>,
    /// Print the rows as JSON on standard output and nothing else there
    #[arg(long)]
    pub json: bool,
    /// No progress and no table
    #[arg(short, long)]
    pub quiet: bool,
}

/// A subject of `bench`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum BenchSubject {
    /// Agents on threads, in a pool and in lockstep: CPU per step against the bare loop, lateness, ages, memory
    Agents,
    /// Cost of a tube's step by number of segments, with and without self-contact search
    Rod,
    /// Built-in scenes in lockstep: CPU time of their agents' turns, beside that of another build
    Scenes,
    /// Time to select a level of detail for every object, by policy and number of objects
    Select,
    /// A thousand boxes as agents that step in clusters while they touch, compared with one rapier3d world of the same boxes
    Pile,
    /// Steps of scenes in which contact decides: towers, piles, jams, folds, ropes, bins: time, factors, depth, drift and energy made
    Contact,
    /// Steps of soft bodies: cubes of tissue by number of nodes, held, lying, loaded and shaken, a sheet, a tube whose wall gives
    Soft,
    /// Pictures on this machine's adapter, by triangles, pixels and shading
    Render,
}

/// A subject of `chart`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Subject {
    /// Error and cost of each method against independent solutions, compared with other engines
    Accuracy,
    /// Error of contacts over their cost, by levels of the solve, beside rapier3d, MuJoCo and PyBullet
    Contact,
    /// Growth of cost with segments, contacts and agents, and its distance from the machine's limit
    Scaling,
    /// Where integrators and couplings diverge, and where they are bounded but wrong
    Stability,
    /// Difference of a scene with separate clocks from the same scene under one very fine common clock
    Coupling,
    /// How well each frame-budget policy holds the frame time, on the scenes of the papers
    Policies,
}

fn fit_seconds(text: &str) -> Result<f64, String> {
    bounded(text, 0.01, 1000.0, "seconds")
}
