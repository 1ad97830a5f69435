//! The progress of a headless run, on standard error; hidden where that is not a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// Positions of the bar: more than any terminal has columns.
const STEPS: u64 = 1000;

/// A progress bar, which may be hidden.
pub struct Bar(ProgressBar);

impl Bar {
    /// A bar for the scene `name`, drawn once there is progress; nothing is shown where `quiet`.
    pub fn new(name: &str, quiet: bool) -> Self {
        let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(STEPS).with_prefix(name.to_owned()) };
        if let Ok(style) = ProgressStyle::with_template("{prefix} {bar:30} {percent:>3} %  {msg}") {
            bar.set_style(style);
        }
        Self(bar)
    }

    /// Shows the progress of the run: the share that is done, and the last frame.
    pub fn show(&self, done: f64, sim_s: f64, frame_ms: f64) {
        self.set(done, format!("{sim_s:.1} s  {frame_ms:.1} ms a frame"));
    }

    /// Shows the share that is done, and a message next to it.
    pub fn set(&self, done: f64, message: String) {
        self.0.set_position((done.clamp(0.0, 1.0) * STEPS as f64) as u64);
        self.0.set_message(message);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
