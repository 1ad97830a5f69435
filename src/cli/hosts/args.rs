//! The arguments of `host` and `view`, and their help texts.

use crate::cli::args::OutputArgs;
use clap::{Args, ValueHint};
use metachron_console::values::{LimitArgs, assignment, seconds, size, target_fps};

pub const HOST_EXAMPLES: &str = "\
Examples:
  metachron host cavity                                serves the scene to this machine until Ctrl-C
  metachron host swarm.toml --listen tcp/127.0.0.1:7500 --name swarm --json
  metachron view tcp/127.0.0.1:7500                    a window on it, in another terminal";

/// `host`.
#[derive(Debug, Args)]
pub struct HostArgs {
    /// A built-in scene or the path of a scene file
    #[arg(value_hint = ValueHint::FilePath)]
    pub scene: String,
    /// Where callers reach the world: tcp/, a loopback address and a port
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/127.0.0.1:7447")]
    pub listen: String,
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
  metachron view tcp/127.0.0.1:7447 --headless --seconds 5 --video seen.y4m --mcap seen.mcap

Frames are drawn here, within a budget of their own. Pause, speed, springs and pressures act on the world where it runs.";

/// `view`.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// Where the world is served
    pub endpoint: String,
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
