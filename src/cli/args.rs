//! The command-line arguments and their help texts.

use super::devices::DeviceWish;
use super::exports::ExportPaths;
#[cfg(feature = "hosts")]
use super::hosts::args::{
    CallArgs, HOST_EXAMPLES, HostArgs, IDENTITY_EXAMPLES, IdentityCommand, TOOL_EXAMPLES, ToolArgs, VIEW_EXAMPLES,
    ViewArgs,
};
use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand, ValueHint};
use metachron_console::values::{CommonArgs, LimitArgs, assignment, seconds, size, target_fps};
#[cfg(feature = "hosts")]
use metachron_console::values::{Pin, pin};
#[cfg(feature = "lab")]
use metachron_lab::args::{
    BENCH_EXAMPLES, BenchArgs, CHART_EXAMPLES, COMPARE_EXAMPLES, ChartArgs, CompareArgs, DOCS_EXAMPLES, DocsArgs,
    FIT_EXAMPLES, FitArgs, TUNE_EXAMPLES, TuneArgs,
};
use metachron_scene::papers::Paper;
use metachron_session::report::Goal;
use metachron_world::kinds::{ExecutorKind, LawKind, PolicyKind};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  metachron                                    the tube demo (a window, or without a display ten headless seconds)
  metachron list                               the built-in scenes
  metachron run yard                           another one
  metachron run my.toml                        a scene of your own
  metachron check my.toml                      its problems, line by line
  metachron schema > metachron.schema.json     for completion in an editor

Exit codes: 0 ok, 1 failed run, 2 bad input or usage, 4 a goal of --fail-on was missed, 130 interrupted.";

const RUN_EXAMPLES: &str = "\
Examples:
  metachron run                                        the tube demo
  metachron run tube --headless --seconds 10 --report report.json --png last.png
  metachron run domes --headless --executor lockstep --seconds 24 --video domes.y4m
  metachron run tube --headless --target-fps 30 --fail-on 'missed_share>0.01'
  metachron run pendulum --executor lockstep --frames 300 --headless --report -
  metachron run yard --set object.hose.young_pa=5e5 --set target.frame_hz=30
  metachron run crossing --executor lockstep --headless --seconds 2 --oracle
  metachron run cavity --device simulated=probe        a hand at 1 kHz leads the probe; its force is in the report
  METACHRON_EXECUTOR=lockstep metachron run overload --headless

Files that grow with the run take the place of older ones when it begins, all others when they are whole.
Flags go before --set, --set before the environment (METACHRON_…), that before the scene, and the scene before defaults.
Data goes to standard output, messages to standard error.";

const REPLAY_EXAMPLES: &str = "\
Examples:
  metachron run tube --headless --seconds 10 --record tube.rec
  metachron replay tube.rec                            ends with the same state hash, or says where it differs
  metachron replay tube.rec --until 2.5 --png then.png

A recording has the scene, what was changed in it, and all that was done; one that was cut short or
is damaged is repeated as far as it goes, with a warning. Files beside the scene are read again:
a run with --allow-outside is repeated with --allow-outside.";

const CHECK_EXAMPLES: &str = "\
Examples:
  metachron check my.toml other.toml
  metachron check --json my.toml | jq '.[].problems'";

#[cfg(feature = "render")]
const CALIBRATE_EXAMPLES: &str = "\
Examples:
  metachron calibrate                                  the table, measured once and kept
  metachron calibrate --renew                          measured anew, on a quiet machine
  metachron calibrate --export prices.json             for another user of this machine";

const GENERATE_EXAMPLES: &str = "\
Examples:
  metachron generate auditorium                        the built-in scene, on standard output
  metachron generate grove --trees 2000 --zigzag --out grove-2000.toml
  metachron run grove-2000.toml";

const IMPORT_EXAMPLES: &str = "\
Examples:
  metachron import robot.urdf                          the scene on standard output, the list on standard error
  metachron import arm.xml --out arm.toml
  metachron import robot.urdf --fixed-base --copy-meshes --out robot.toml
  metachron run arm.toml

Meshes are named from the folder of --out, or else from that of the model; those that scenes do not read are written beside --out.";

/// A real-time physics engine in which every object keeps its own time and the frame never waits.
///
/// A scene is a TOML file of objects: soft tubes, rigid bodies, tools. Each runs as an agent on its own clock, with its
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
    /// Repeat a recorded run, to the bit: to see what happened, or to stop on the way
    #[command(after_help = REPLAY_EXAMPLES)]
    Replay(Box<ReplayArgs>),
    /// Run a scene and serve it to other processes, until Ctrl-C
    #[cfg(feature = "hosts")]
    #[command(after_help = HOST_EXAMPLES)]
    Host(HostArgs),
    /// Show a world that another process serves, in a window with its own frame budget
    #[cfg(feature = "hosts")]
    #[command(after_help = VIEW_EXAMPLES)]
    View(Box<ViewArgs>),
    /// Lead an object of a world that another process serves by a device here, and feel what it touches
    #[cfg(feature = "hosts")]
    #[command(after_help = TOOL_EXAMPLES)]
    Tool(Box<ToolArgs>),
    /// Make certificates by which hosts and callers know each other
    #[cfg(feature = "hosts")]
    #[command(subcommand, after_help = IDENTITY_EXAMPLES)]
    Identity(IdentityCommand),
    /// Validate scenes; all problems of the first stage that fails, each at its place in the file
    #[command(after_help = CHECK_EXAMPLES)]
    Check(CheckArgs),
    /// Find feedback gains for a scene, or explain given ones
    #[cfg(feature = "lab")]
    #[command(after_help = TUNE_EXAMPLES)]
    Tune(TuneArgs),
    /// Find the cheapest steps, segments and integrators that keep a scene's probes within a tolerance of its converged answer
    #[cfg(feature = "lab")]
    #[command(after_help = FIT_EXAMPLES, allow_negative_numbers = true)]
    Fit(FitArgs),
    /// Measure the limits of the methods: CSV, SVG and PNG into a folder, a table on standard output
    #[cfg(feature = "lab")]
    #[command(after_help = CHART_EXAMPLES)]
    Chart(ChartArgs),
    /// Measure how much load this machine carries: CSV, JSON, SVG and PNG into a folder, a table on standard output
    #[cfg(feature = "lab")]
    #[command(after_help = BENCH_EXAMPLES)]
    Bench(BenchArgs),
    /// Write a page on which people say which of two films is better, or evaluate their votes
    #[cfg(feature = "lab")]
    #[command(after_help = COMPARE_EXAMPLES)]
    Compare(CompareArgs),
    /// Compare documents with what their commands print, or print it into them
    #[cfg(feature = "lab")]
    #[command(after_help = DOCS_EXAMPLES)]
    Docs(DocsArgs),
    /// Show what drawing costs on this machine's adapter, as policies reckon with it; measure it anew, write it to a file, or read it
    #[cfg(feature = "render")]
    #[command(after_help = CALIBRATE_EXAMPLES)]
    Calibrate(CalibrateArgs),
    /// Write a scene of the papers' experiments as a scene file, with a seed and options
    #[command(after_help = GENERATE_EXAMPLES)]
    Generate(GenerateArgs),
    /// Write a URDF robot or an MJCF model as a scene file, and list what of it has no place in one
    #[command(after_help = IMPORT_EXAMPLES)]
    Import(ImportArgs),
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

/// `calibrate`.
#[cfg(feature = "render")]
#[derive(Debug, Args)]
pub struct CalibrateArgs {
    /// Forget what is known and measure anew
    #[arg(long, conflicts_with = "import")]
    pub renew: bool,
    /// Write the table to this file
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub export: Option<PathBuf>,
    /// Take the table from this file, which was measured on the same adapter by the same version
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub import: Option<PathBuf>,
    /// Print the table as JSON
    #[arg(long)]
    pub json: bool,
    /// Overwrite an existing file
    #[arg(long, requires = "export")]
    pub force: bool,
}

/// `generate`.
#[derive(Debug, Args)]
pub struct GenerateArgs {
    /// Name of the scene
    #[arg(value_parser = PossibleValuesParser::new(Paper::ALL.map(Paper::name)))]
    pub scene: String,
    /// Seed of everything random in it
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(..=1_000_000))]
    pub seed: u32,
    /// Number of trees of the grove; 600 where not given
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(3..=3000))]
    pub trees: Option<u32>,
    /// Move the camera through the grove with two sudden turns instead of straight along it
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

/// `import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// A URDF robot or an MJCF model
    #[arg(value_hint = ValueHint::FilePath)]
    pub model: PathBuf,
    /// Start an MJCF model from the keyframe of this name: its qpos and ctrl
    #[arg(long, value_name = "NAME")]
    pub key: Option<String>,
    /// The SRDF file of a URDF robot, whose disabled collisions are in the scene; default: the one beside it with its name
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub srdf: Option<PathBuf>,
    /// Write the scene to this file instead of standard output
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// Overwrite an existing file, and existing meshes in the folder beside it
    #[arg(long, requires = "out")]
    pub force: bool,
    /// Fix the root of a robot, or an MJCF body that moves freely and carries others, where it starts
    #[arg(long)]
    pub fixed_base: bool,
    /// Copy all meshes beside the scene, so that it can be moved with them
    #[arg(long, requires = "out")]
    pub copy_meshes: bool,
    /// Print what has no place in the scene as JSON on standard output
    #[arg(long, requires = "out")]
    pub json: bool,
}

impl OutputArgs {
    /// Where files of the run for other programs are written.
    pub(super) fn exports(&self) -> ExportPaths {
        ExportPaths {
            mcap: self.mcap.clone(),
            vtk: self.vtk.clone(),
            glb: self.glb.clone(),
            animation: self.animation.clone(),
            perfetto: self.perfetto.clone(),
        }
    }
}

/// A value of `--style`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum StyleWord {
    /// Draw every edge
    Wireframe,
    /// Contact points, and forces as arrows
    Forces,
    /// Colour by (ε, n): hue for n, stripes for ε
    Resolution,
    /// Colour by the age of what is shown
    Age,
    /// Shade by detail: dark is an object's coarsest level, white its finest
    Detail,
    /// Greys of the distance along the view: white is at the eye
    Depth,
}

/// A value of `--pace`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum PaceWord {
    /// Beside the clock, virtual in lockstep
    RealTime,
    /// As fast as agents can step
    Free,
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
    /// Show panels and colours of the window as at first, and not as they were left
    #[cfg(feature = "viewer")]
    #[arg(long)]
    pub reset_window: bool,
    /// End after this many frames
    #[arg(long, value_name = "N", conflicts_with = "seconds", value_parser = clap::value_parser!(u64).range(1..))]
    pub frames: Option<u64>,
    /// End after this many simulated seconds; headless runs take 10 where neither this nor --frames is given
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub seconds: Option<f64>,
    /// Target frame rate, frames per second, 1 to 1000
    #[arg(long, value_name = "F", env = "METACHRON_TARGET_FPS", value_parser = target_fps)]
    pub target_fps: Option<f64>,
    /// Policy that chooses the level of detail of every visible object
    #[arg(long, env = "METACHRON_POLICY", value_parser = PossibleValuesParser::new(PolicyKind::ALL.map(PolicyKind::name)))]
    pub policy: Option<String>,
    /// The law of the policy feedback: corrected (its gain does not depend on the machine) or printed (as in the paper)
    #[arg(long, env = "METACHRON_LAW", value_parser = PossibleValuesParser::new(LawKind::ALL.map(LawKind::name)))]
    pub law: Option<String>,
    /// Take the gains of the feedback law from this file (TOML, as `metachron tune` writes it); --set and flags take precedence over it
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub gains: Option<PathBuf>,
    /// How agents run: a thread each, a pool of workers, the cheaper of the two by their number (auto), or one thread in
    /// virtual time with declared costs (lockstep: the same bits on every run)
    #[arg(long, env = "METACHRON_EXECUTOR", value_parser = PossibleValuesParser::new(ExecutorKind::ALL.map(ExecutorKind::name)))]
    pub executor: Option<String>,
    /// How time passes: beside the clock (real-time, the default: who is too slow for it makes longer steps and gives up time; in lockstep the
    /// declared machine may be), or free, as fast as agents can step: none gives up time or makes longer steps than it was asked for, and
    /// rates are kept (without a window and devices only)
    #[arg(long, default_value = "real-time")]
    pub pace: PaceWord,
    /// Size of the picture or the window in pixels, each 1 to 8192; pictures are 1280x720 where no size is given
    #[arg(long, value_name = "WxH", env = "METACHRON_SIZE", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Seed of the declared machine's noise
    #[arg(long, value_name = "N", env = "METACHRON_SEED")]
    pub seed: Option<u32>,
    /// Change a key of the scene, such as target.frame_hz=60 or object.NAME.rate_hz=120; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = assignment)]
    pub set: Vec<(String, String)>,
    /// Run the scene a second time as a reference, all agents on one very fine common clock, and report the differences (headless only)
    #[arg(long)]
    pub oracle: bool,
    /// Let a device lead a tool or a kinematic body and feel what it touches: simulated=OBJECT, a hand that goes along the object's keyframes, or
    /// gamepad=OBJECT in builds with the feature `gamepad`; may be repeated (not in lockstep)
    #[arg(long = "device", value_name = "KIND=OBJECT", value_parser = super::devices::wish, conflicts_with = "oracle")]
    pub device: Vec<DeviceWish>,
    /// Write down what is done to the run, so that `metachron replay` repeats it to the bit; the file grows with the run
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub record: Option<PathBuf>,
    /// Let these hosts step it together, each a part, and draw it here; each waits for work (`metachron host` without a scene): NAME=ENDPOINT, or a
    /// name of DNS for NAME=tls/NAME:7447. Objects keep the steps and resolutions of the scene, and states are those of one process in lockstep, to the bit
    #[cfg(feature = "hosts")]
    #[arg(long, value_name = "HOSTS", value_delimiter = ',', conflicts_with_all = ["oracle", "device", "record", "executor"])]
    pub hosts: Vec<String>,
    /// Let one of these hosts step an object, and all that is with it; may be repeated
    #[cfg(feature = "hosts")]
    #[arg(long = "host-of", value_name = "OBJECT=HOST", value_parser = pin, requires = "hosts")]
    pub host_of: Vec<Pin>,
    /// The caller of hosts by its certificate, or without one.
    #[cfg(feature = "hosts")]
    #[command(flatten)]
    pub call: CallArgs,
    /// How far the scene may go.
    #[command(flatten)]
    pub limits: LimitArgs,
    /// The outputs: files and printed text.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// The outputs of `run` and `replay`: files and printed text.
#[derive(Debug, Args)]
pub struct OutputArgs {
    /// Write the last frame's picture here (PNG). Not of a window
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub png: Option<PathBuf>,
    /// Write the depths of the last frame here: PNG of 16 bits, whose text says how many metres a unit is; 0 is nothing. Not of a window
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub depth: Option<PathBuf>,
    /// See with this one of the scene's cameras, by name; the first where none is given
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Write a film of all frames here (YUV4MPEG2, which ffmpeg and most players read), which grows with the run; late frames show as on the
    /// screen. Not of a window
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub video: Option<PathBuf>,
    /// Write every frame's states, surfaces, contacts, joints and events here as MCAP, which Foxglove, Lichtblick and Rerun open; the file grows
    /// with the run. Not of a window
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub mcap: Option<PathBuf>,
    /// Write every frame's surfaces, objects and contacts into this folder as VTK series, which ParaView opens (series.pvd, objects.pvd,
    /// contacts.pvd); nothing is overwritten. Not of a window
    #[arg(long, value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    pub vtk: Option<PathBuf>,
    /// Write the last moment's surfaces here as binary glTF, which Blender, browsers and game engines open. Not of a window
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub glb: Option<PathBuf>,
    /// Write all frames' surfaces here as one animated binary glTF, which Blender, three.js and game engines play; 256 MiB at most. Not of a window
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub animation: Option<PathBuf>,
    /// Write here when each object stepped and waited, the frames and their parts, and events (JSON, which ui.perfetto.dev opens), in a file that
    /// grows with the run, 256 MiB at most. Not of a window
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub perfetto: Option<PathBuf>,
    /// Style of headless pictures: wireframe, or contact forces, or colours by resolution, age, detail or depth; several are separated by commas
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
    /// Print errors and warnings only: no progress, no notes, no summary, no list of the files written
    #[arg(short, long)]
    pub quiet: bool,
}

/// `replay`.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The recording, as `run --record` writes it
    #[arg(value_hint = ValueHint::FilePath)]
    pub recording: PathBuf,
    /// End at this simulated time, seconds, instead of with the recording
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub until: Option<f64>,
    /// Size of the picture in pixels, each 1 to 8192; 1280x720 where no size is given
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// How far the scene may go.
    #[command(flatten)]
    pub limits: LimitArgs,
    /// The outputs: files and printed text.
    #[command(flatten)]
    pub output: OutputArgs,
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

/// `list`.
#[derive(Debug, Args)]
pub struct ListArgs {
    /// Print the list as JSON
    #[arg(long)]
    pub json: bool,
}

fn goal(text: &str) -> Result<Goal, String> {
    text.parse().map_err(|e: metachron_session::report::GoalError| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_pass_claps_own_checks() {
        Cli::command().debug_assert();
    }
}
