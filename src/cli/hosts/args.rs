//! The arguments of `host`, `view`, `tool` and `identity`, and their help texts.

use crate::cli::args::OutputArgs;
use crate::cli::devices::DeviceKind;
use clap::{Args, Subcommand, ValueHint};
use metachron_console::values::{LimitArgs, assignment, seconds, size, target_fps};
use std::path::PathBuf;

pub const HOST_EXAMPLES: &str = "\
Examples:
  metachron host cavity                                serves the scene to this machine until Ctrl-C
  metachron host swarm.toml --listen tcp/127.0.0.1:7500 --name swarm --json
  metachron view tcp/127.0.0.1:7500                    a window on it, in another terminal
  metachron host --name bench                          waits for work; then, in another terminal:
  metachron run pile --hosts bench=tcp/127.0.0.1:7447
  metachron host cavity --listen tls/0.0.0.0:7447 --identity bench.pem --operators lab2 --viewers screen

Beyond this machine both ends have certificates (`metachron identity`), and only callers are let in that are named.";

/// `host`.
#[derive(Debug, Args)]
pub struct HostArgs {
    /// A built-in scene or the path of a scene file; without one the host waits for parts of scenes that `metachron run --hosts` gives it
    #[arg(value_hint = ValueHint::FilePath)]
    pub scene: Option<String>,
    /// Where callers reach the world: tcp/, a loopback address and a port; or tls/, an address and a port, with --identity
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/127.0.0.1:7447")]
    pub listen: String,
    /// The certificate of this host, a file of `metachron identity new`
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub identity: Option<PathBuf>,
    /// Certificates whose holders may read and command the world
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "identity")]
    pub operators: Vec<String>,
    /// Certificates whose holders may read the world
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "identity")]
    pub viewers: Vec<String>,
    /// Let tcp/ be beyond this machine: any process of the network may read and command the world
    #[arg(long, conflicts_with = "identity")]
    pub insecure_lan: bool,
    /// The name of the world: 1 to 64 letters, digits, _ and -
    #[arg(long, default_value = "world")]
    pub name: String,
    /// Let time stand until a caller lets it pass
    #[arg(long)]
    pub paused: bool,
    /// Change a key of the scene; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = assignment)]
    pub set: Vec<(String, String)>,
    /// Print time, agents, cores, callers and refused messages as JSON, a line a second
    #[arg(long)]
    pub json: bool,
    /// How far the scene may go.
    #[command(flatten)]
    pub limits: LimitArgs,
}

pub const VIEW_EXAMPLES: &str = "\
Examples:
  metachron view tcp/127.0.0.1:7447                    a window on the world that `metachron host` serves there
  metachron view tls/bench:7447 --identity screen.pem  on a world of another machine
  metachron view tcp/127.0.0.1:7447 --headless --seconds 5 --video seen.y4m --mcap seen.mcap

Frames are drawn here, within a budget of their own. Pause, speed, springs and pressures act on the world where it runs.";

/// `view`.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// Where the world is served
    pub endpoint: String,
    /// The caller by its certificate, or without one.
    #[command(flatten)]
    pub call: CallArgs,
    /// Open no window: pictures, films and files of what is seen
    #[arg(long)]
    pub headless: bool,
    /// End after this many frames
    #[arg(long, value_name = "N", conflicts_with = "seconds", value_parser = clap::value_parser!(u64).range(1..))]
    pub frames: Option<u64>,
    /// End after this many seconds of the world's time; 10 where nothing is said and there is no window
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub seconds: Option<f64>,
    /// Target frame rate, frames per second, 1 to 1000; the scene's where not given
    #[arg(long, value_name = "F", value_parser = target_fps)]
    pub target_fps: Option<f64>,
    /// Size of the picture or the window in pixels, each 1 to 8192
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Show panels and colours of the window as at first, and not as they were left
    #[cfg(feature = "viewer")]
    #[arg(long)]
    pub reset_window: bool,
    /// How far the scene may go.
    #[command(flatten)]
    pub limits: LimitArgs,
    /// The outputs: files and printed text.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// How a world elsewhere is called.
#[derive(Debug, Args)]
pub struct CallArgs {
    /// The certificate of this caller, a file of `metachron identity new`, for tls/
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub identity: Option<PathBuf>,
    /// Let tcp/ be beyond this machine: any process of the network may read and change what is said
    #[arg(long, conflicts_with = "identity")]
    pub insecure_lan: bool,
}

pub const TOOL_EXAMPLES: &str = "\
Examples:
  metachron tool --device simulated --leads probe --connect tcp/127.0.0.1:7447
  metachron tool --device simulated --leads probe --connect tls/bench:7447 --identity lab2.pem --seconds 10 --json

The device is read here a thousand times a second; its object is led, and its contacts are solved, where the world runs.
Between two messages of states the force follows the hand, and a tank bounds the energy that it is given.";

/// `tool`.
#[derive(Debug, Args)]
pub struct ToolArgs {
    /// The device: simulated, a hand that goes along the object's keyframes, or gamepad in builds with the feature `gamepad`
    #[arg(long, value_name = "KIND", value_parser = crate::cli::devices::kind)]
    pub device: DeviceKind,
    /// The tool or kinematic body that it leads
    #[arg(long, value_name = "OBJECT")]
    pub leads: String,
    /// Where the world is served
    #[arg(long, value_name = "ENDPOINT")]
    pub connect: String,
    /// The caller by its certificate, or without one.
    #[command(flatten)]
    pub call: CallArgs,
    /// End after this many seconds; at Ctrl-C where not given
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub seconds: Option<f64>,
    /// Print the device's report as JSON, a line a second
    #[arg(long)]
    pub json: bool,
    /// How far the scene may go.
    #[command(flatten)]
    pub limits: LimitArgs,
}

pub const IDENTITY_EXAMPLES: &str = "\
Examples:
  metachron identity new bench --authority lab.pem --new-authority
                                                       bench.pem, for a host that is reached as tls/bench:7447, and lab.pem
  metachron identity new screen --authority lab.pem    screen.pem, for a caller
  metachron identity new bench2 --authority lab.pem --address 10.0.0.5,bench2.lab.example

The first one makes the authority too. Its holder can issue every name: keep lab.pem apart, and give each machine its own file alone.";

/// `identity`.
#[derive(Debug, Subcommand)]
pub enum IdentityCommand {
    /// Make a certificate and its key, in the file NAME.pem that no other user may read
    New(NewIdentityArgs),
}

/// `identity new`.
#[derive(Debug, Args)]
pub struct NewIdentityArgs {
    /// Its holder: 1 to 64 letters, digits, _ and -; `--operators` and `--viewers` name it so
    pub name: String,
    /// The authority that issues it
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub authority: PathBuf,
    /// Make the authority too, in a file that is not there yet
    #[arg(long)]
    pub new_authority: bool,
    /// Addresses of a host besides its name: names of DNS and IP addresses
    #[arg(long, value_name = "ADDRESSES", value_delimiter = ',')]
    pub address: Vec<String>,
    /// For how many days it is valid, 1 to 3650
    #[arg(long, value_name = "DAYS", default_value_t = 365, value_parser = clap::value_parser!(i64).range(1..=3650))]
    pub days: i64,
}
