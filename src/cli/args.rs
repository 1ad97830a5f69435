//! The command-line arguments and their help texts.

use super::assignment::assignment;
use super::report::Goal;
use crate::scene::format::PolicyKind;
use crate::scene::papers::Paper;
use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand, ValueHint};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  metachron                                    the tube demo (a window, or without a display ten headless seconds)
  metachron list                               the built-in scenes
  metachron run yard                           another one
  metachron run my.toml                        a scene of your own
  metachron check my.toml                      what is wrong with it, line by line
  metachron schema > metachron.schema.json     for completion in an editor

Exit codes: 0 ok, 1 failed run, 2 bad input or usage, 4 a goal of --fail-on was missed, 130 interrupted.";

const RUN_EXAMPLES: &str = "\
Examples:
  metachron run                                        the tube demo
  metachron run tube --headless --seconds 10 --report report.json --png last.png
  metachron run tube --headless --target-fps 30 --fail-on 'missed_share>0.01'
  metachron run pendulum --executor lockstep --frames 300 --headless --report -
  metachron run yard --set object.hose.young_pa=5e5 --set target.frame_hz=30
  metachron run crossing --executor lockstep --headless --seconds 2 --oracle
  METACHRON_EXECUTOR=lockstep metachron run overload --headless

Flags go before --set, --set before the environment (METACHRON_…), that before the scene, and the scene before defaults.
Data goes to standard output, messages to standard error.";

const CHECK_EXAMPLES: &str = "\
Examples:
  metachron check my.toml other.toml
  metachron check --json my.toml | jq '.[].problems'";

const BENCH_EXAMPLES: &str = "\
Examples:
  metachron bench agents --quick                       a minute, into the folder bench/
  metachron bench agents --executor pool --agents 1000
  metachron bench pile --quick
  metachron bench agents --json -q | jq '.rows[] | [.agents, .cpu_us_per_step]'

CPU times are the measure: on a machine that does other things too, wall times tell of those.";

const TUNE_EXAMPLES: &str = "\
Examples:
  metachron tune tube                                  finds gains on the declared machine; writes tube.gains.toml and charts/
  metachron run tube --gains tube.gains.toml           and with them
  metachron tune yard --target-fps 120 --quick
  metachron tune tube --analyse α=1e-4,β=5             why given gains are slow, swing, or are fine
  metachron tune tube --live --size 640x360            on the machine and the adapter present

Ctrl-C keeps the best gains so far.";

const FIT_EXAMPLES: &str = "\
Examples:
  metachron fit my.toml --tolerance 1e-3               what every object pays, and what a millimetre needs
  metachron fit my.toml --tolerance 1e-3 --write       and the scene with that
  metachron fit tube --tolerance 5e-3 --probe intestine --seconds 1
  metachron fit my.toml --tolerance 1e-4 --json -q | jq '.objects[].needs'

Ctrl-C keeps the best found so far.";

const CHART_EXAMPLES: &str = "\
Examples:
  metachron chart stability                            every experiment, into the folder charts/
  metachron chart stability --quick --only tube-map --out /tmp/charts
  metachron chart coupling --quick
  metachron chart policies --live --only auditorium    the paper's walk on this adapter
  metachron chart stability --json -q | jq '.experiments[].findings'

Ctrl-C ends a sweep after the rows in hand; the same command takes the finished rows up.";

const GENERATE_EXAMPLES: &str = "\
Examples:
  metachron generate auditorium                        the built-in scene, on standard output
  metachron generate grove --trees 2000 --zigzag --out grove-2000.toml
  metachron run grove-2000.toml";

/// A real-time physics engine in which every object keeps its own time and the frame never waits.
///
/// A scene is a TOML file of objects: soft tubes, rigid bodies, instruments. Each runs as an agent on its own clock, with its
/// own step and resolution; the picture takes their newest states inside a frame budget.
#[derive(Debug, Parser)]
#[command(name = "metachron", version, after_help = EXAMPLES, max_term_width = 120)]
pub struct Cli {
    /// The command; without one, the tube demo runs.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a scene: in a window where there is a display, otherwise headless
    #[command(after_help = RUN_EXAMPLES, allow_negative_numbers = true)]
    Run(Box<RunArgs>),
    /// Validate scenes; every problem is shown at its place in the file
    #[command(after_help = CHECK_EXAMPLES)]
    Check(CheckArgs),
    /// Find feedback gains for a scene, or explain given ones
    #[command(after_help = TUNE_EXAMPLES)]
    Tune(TuneArgs),
    /// Find the cheapest steps, segments and integrators that keep a scene's probes within a tolerance of its converged answer
    #[command(after_help = FIT_EXAMPLES, allow_negative_numbers = true)]
    Fit(FitArgs),
    /// Measure where methods fail, and draw it: CSV, SVG and PNG into a folder, a table here
    #[command(after_help = CHART_EXAMPLES)]
    Chart(ChartArgs),
    /// Measure how much load this machine carries: CSV, JSON, SVG and PNG into a folder, a table here
    #[command(after_help = BENCH_EXAMPLES)]
    Bench(BenchArgs),
    /// Write a scene of the papers' experiments as a scene file, with a seed and options
    #[command(after_help = GENERATE_EXAMPLES)]
    Generate(GenerateArgs),
    /// Print the JSON Schema of scene files
    Schema,
    /// List the built-in scenes
    List(ListArgs),
    /// Print the completions for a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Print the manual page, of the program or of one of its commands
    Man {
        /// A command, such as `run`
        command: Option<String>,
    },
}

/// `generate`.
#[derive(Debug, Args)]
pub struct GenerateArgs {
    /// Which scene
    #[arg(value_parser = PossibleValuesParser::new(Paper::ALL.map(Paper::name)))]
    pub scene: String,
    /// Seed of everything random in it
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(..=1_000_000))]
    pub seed: u32,
    /// Number of trees of the grove; 600 where not given
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(3..=3000))]
    pub trees: Option<u32>,
    /// Lead the camera through the grove with two sudden turns instead of straight along it
    #[arg(long)]
    pub zigzag: bool,
    /// Trees of the grove without levels of detail: as much of the full mesh is drawn as there is time for
    #[arg(long)]
    pub prefix: bool,
    /// Write the scene to this file instead of standard output
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, requires = "out")]
    pub force: bool,
}

/// A value of `--style`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum StyleWord {
    /// Draw every edge
    Wireframe,
    /// Colour by (ε, n): hue for n, stripes for ε
    Resolution,
    /// Colour by the age of what is shown
    Age,
    /// Shade by detail: dark is an object's coarsest level, white its finest
    Detail,
}

/// `run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// A built-in scene (see `metachron list`) or the path of a scene file
    #[arg(default_value = "tube", value_hint = ValueHint::FilePath)]
    pub scene: String,
    /// Open no window
    #[arg(long, env = "METACHRON_HEADLESS", value_parser = clap::builder::FalseyValueParser::new())]
    pub headless: bool,
    /// End after so many frames
    #[arg(long, value_name = "N", conflicts_with = "seconds", value_parser = clap::value_parser!(u64).range(1..))]
    pub frames: Option<u64>,
    /// End after so many simulated seconds; headless runs take 10 where neither this nor --frames is given
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub seconds: Option<f64>,
    /// Frames a second to hold, 1 to 1000
    #[arg(long, value_name = "F", env = "METACHRON_TARGET_FPS", value_parser = target_fps)]
    pub target_fps: Option<f64>,
    /// Policy that chooses the level of detail of every visible object
    #[arg(long, env = "METACHRON_POLICY", value_parser = PossibleValuesParser::new(PolicyKind::ALL.map(PolicyKind::name)))]
    pub policy: Option<String>,
    /// The feedback law: corrected (its gain does not depend on the machine) or as the paper prints it
    #[arg(long, env = "METACHRON_LAW", value_parser = PossibleValuesParser::new(["corrected", "printed"]))]
    pub law: Option<String>,
    /// Take the gains of the feedback law from this file (TOML, as `metachron tune` writes it); --set and flags take precedence over it
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub gains: Option<PathBuf>,
    /// How agents run: a thread each, a pool of workers, the cheaper of the two by their number (auto), or one thread in
    /// virtual time with declared costs (lockstep: the same bits on every run)
    #[arg(long, env = "METACHRON_EXECUTOR", value_parser = PossibleValuesParser::new(["auto", "threads", "pool", "lockstep"]))]
    pub executor: Option<String>,
    /// Size of the picture or the window in pixels, each 1 to 8192; pictures are 1280x720 where no size is given
    #[arg(long, value_name = "WxH", env = "METACHRON_SIZE", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Seed of the declared machine's noise
    #[arg(long, value_name = "N", env = "METACHRON_SEED")]
    pub seed: Option<u32>,
    /// Change a key of the scene, such as target.frame_hz=60 or object.NAME.rate_hz=120; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = assignment)]
    pub set: Vec<(String, String)>,
    /// Run the scene a second time on one very fine common clock, and report what its own clocks changed (headless only)
    #[arg(long)]
    pub oracle: bool,
    /// Write the last frame's picture here (PNG)
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub png: Option<PathBuf>,
    /// How headless pictures show things: wireframe, or colours by resolution, age or detail; several are separated by commas
    #[arg(long, value_name = "STYLE", value_delimiter = ',')]
    pub style: Vec<StyleWord>,
    /// Write the report here (JSON); - is standard output
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub report: Option<PathBuf>,
    /// Write one row per frame here (CSV); a window without an end keeps at least the newest 108000 frames
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub frames_csv: Option<PathBuf>,
    /// End with code 4 where this holds for the report, such as missed_share>0.01 or frame_ms.p99>40; may be repeated
    #[arg(long, value_name = "CONDITION", value_parser = goal)]
    pub fail_on: Vec<Goal>,
    /// Print the report as JSON on standard output, instead of the summary
    #[arg(long)]
    pub json: bool,
    /// Print errors only: no progress, no summary, no list of the files written
    #[arg(short, long)]
    pub quiet: bool,
}

/// `check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Built-in scenes or paths of scene files
    #[arg(required = true, value_name = "SCENE", value_hint = ValueHint::FilePath)]
    pub scenes: Vec<String>,
    /// The arguments common to `check`, `tune` and `fit`.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// The arguments common to the commands that judge scenes: `check`, `tune`, `fit`.
#[derive(Debug, Args)]
pub struct CommonArgs {
    /// Change a key of the scene; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = assignment)]
    pub set: Vec<(String, String)>,
    /// Print the result as JSON on standard output and nothing else there
    #[arg(long)]
    pub json: bool,
    /// No progress, and no output for scenes without problems
    #[arg(short, long)]
    pub quiet: bool,
}

/// `tune`.
#[derive(Debug, Args)]
pub struct TuneArgs {
    /// A built-in scene or the path of a scene file
    #[arg(default_value = "tube", value_hint = ValueHint::FilePath)]
    pub scene: String,
    /// Explain these gains instead of looking for better ones, such as α=1e-4,β=5 or kappa=0.5,margin=0.1
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
    /// Frames a second to hold, 1 to 1000
    #[arg(long, value_name = "F", value_parser = target_fps)]
    pub target_fps: Option<f64>,
    /// Size of the picture in pixels, each 1 to 8192; 1280x720 where not given
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Seed of the declared machine's noise
    #[arg(long, value_name = "N")]
    pub seed: Option<u32>,
    /// Fewer frames and fewer seeds: seconds instead of a minute
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
    /// Greatest distance of a probe from its place in the converged answer, metres
    #[arg(long, value_name = "METRES", allow_hyphen_values = true)]
    pub tolerance: f64,
    /// Compare only the probes of this object; its ends and its middle where it has none
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

/// `chart`.
#[derive(Debug, Args)]
pub struct ChartArgs {
    /// Subject to chart
    pub subject: Subject,
    /// Write the files here; the folder is created where it does not exist
    #[arg(long, value_name = "FOLDER", default_value = "charts", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// A small part of the cases, or shorter runs: minutes become seconds
    #[arg(long)]
    pub quick: bool,
    /// For policies: run on the graphics adapter present, through the renderer, instead of on a declared machine
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
    /// How long each case runs; for pile: simulated seconds
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
    /// Cost of a tube's step by number of segments, with and without the search for self-contact
    Rod,
    /// Time to choose a level of detail for every object, by policy and number of objects
    Select,
    /// A thousand boxes as agents that share islands while they touch, compared with one rapier3d world of the same boxes
    Pile,
    /// Pictures on this machine's adapter, by triangles, pixels and shading
    Render,
}

/// A subject of `chart`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Subject {
    /// Error of each method against an independent answer, and its cost, next to the points of other engines
    Accuracy,
    /// How cost grows with segments, contacts and agents, and how far it is from the limit of the machine
    Scaling,
    /// Where integrators and couplings blow up, and where they are bounded but wrong
    Stability,
    /// How far a scene with separate clocks is from the same scene under one very fine common clock
    Coupling,
    /// How well each frame-budget policy keeps its time, on the scenes of the papers
    Policies,
}

/// `list`.
#[derive(Debug, Args)]
pub struct ListArgs {
    /// Print the list as JSON
    #[arg(long)]
    pub json: bool,
}

fn seconds(text: &str) -> Result<f64, String> {
    bounded(text, 1e-3, 1e7, "seconds")
}

fn fit_seconds(text: &str) -> Result<f64, String> {
    bounded(text, 0.01, 1000.0, "seconds")
}

fn target_fps(text: &str) -> Result<f64, String> {
    bounded(text, 1.0, 1000.0, "frames a second")
}

fn bounded(text: &str, least: f64, greatest: f64, unit: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|v| (least..=greatest).contains(v));
    value.ok_or_else(|| format!("expected {least} to {greatest} {unit}"))
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let expected = || "expected WIDTHxHEIGHT, each 1 to 8192, such as 1280x720".to_owned();
    let (width, height) = text.split_once(['x', 'X', '×']).ok_or_else(expected)?;
    let side = |s: &str| s.parse().ok().filter(|n| (1..=8192).contains(n)).ok_or_else(expected);
    Ok([side(width)?, side(height)?])
}

fn goal(text: &str) -> Result<Goal, String> {
    text.parse().map_err(|e: super::report::GoalError| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_are_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn sizes_are_two_numbers_of_pixels() {
        assert_eq!(size("640x360"), Ok([640, 360]));
        for bad in ["640", "0x360", "640x", "640x9000", "-1x2", "axb", "1x2x3"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers_of_seconds_are_finite_and_above_zero() {
        for bad in ["nan", "inf", "-1", "0", "1e300", "", "x"] {
            assert!(seconds(bad).is_err(), "{bad}");
        }
    }
}
