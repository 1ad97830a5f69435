//! The file of the scene that is shown: opened, read again, and watched for changes.
//!
//! In: a path, what the file says. Out: another session, or a message while the old one runs on. Never here: what a scene means.

use super::WindowSimulation;
use crate::ui::{Message, Severity};
use metachron_scene::{SceneError, Source, builtin};
use metachron_session::Session;
use metachron_world::Scene;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// How often the file is looked at.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// A file on the disk.
#[derive(Debug)]
pub(super) struct WatchedFile {
    /// `None` of a built-in scene.
    path: Option<PathBuf>,
    state: Option<FileState>,
    looked: Instant,
}

/// By what a change is noticed.
#[derive(Debug, PartialEq, Eq)]
struct FileState {
    modified: SystemTime,
    bytes: u64,
}

impl FileState {
    fn of(path: &Path) -> Option<Self> {
        let file = path.metadata().ok()?;
        Some(Self { modified: file.modified().ok()?, bytes: file.len() })
    }
}

impl WatchedFile {
    /// The file of a scene as it is now.
    pub fn of(source: &Source) -> Self {
        let path = builtin::find(source.name()).is_none().then(|| PathBuf::from(source.name()));
        Self { state: path.as_deref().and_then(FileState::of), path, looked: Instant::now() }
    }

    /// Whether it is another one than when this was asked last; a file that is gone has not changed.
    fn has_changed(&mut self, every: Duration) -> bool {
        let Some(path) = self.path.as_deref().filter(|_| self.looked.elapsed() >= every) else { return false };
        self.looked = Instant::now();
        let state = FileState::of(path);
        state.is_some() && std::mem::replace(&mut self.state, state) != self.state
    }
}

impl WindowSimulation<'_> {
    /// Reads the scene again where its file has changed.
    pub(super) fn follow_file(&mut self) {
        self.follow_file_every(LOOK_EVERY);
    }

    pub(super) fn follow_file_every(&mut self, every: Duration) {
        if self.file.has_changed(every) {
            self.reload();
        }
    }

    /// Reads the scene again; while its file is wrong the message stays, and the old scene runs on.
    pub(super) fn reload(&mut self) {
        match Source::open(self.plan.source.name()).and_then(|source| self.load(source)) {
            Ok(scene) => self.restart(scene),
            Err(error) => {
                let text = format!("scene not reloaded: {}", first_problem(&error));
                self.file_error = Some(Message { severity: Severity::Failure, text });
            }
        }
    }

    pub(super) fn open(&mut self, path: &Path) {
        let overrides = std::mem::take(&mut self.plan.overrides);
        match Source::open(&path.to_string_lossy()).and_then(|source| self.load(source)) {
            Ok(scene) => self.restart(scene),
            Err(error) => {
                self.plan.overrides = overrides;
                self.show_message(Severity::Failure, format!("scene not opened: {}", first_problem(&error)));
            }
        }
    }

    fn load(&mut self, source: Source) -> Result<Scene, SceneError> {
        let scene = metachron_scene::load(&source, &self.plan.overrides)?;
        (self.file, self.file_error) = (WatchedFile::of(&source), None);
        self.plan.source = source;
        Ok(scene)
    }

    /// Restarts with `scene`; speed and pause are kept.
    pub(super) fn restart(&mut self, scene: Scene) {
        match Session::open(scene) {
            Ok(session) => self.replace(session),
            Err(error) => self.show_message(Severity::Failure, error.to_string()),
        }
    }
}

/// The problems of a scene in one line: the first one, and how many more there are.
fn first_problem(error: &SceneError) -> String {
    let Some(first) = error.problems.first() else { return error.to_string() };
    let line = if first.line == 0 { String::new() } else { format!(", line {}", first.line) };
    let more = match error.problems.len() + error.hidden - 1 {
        0 => String::new(),
        more => format!(" (and {more} more)"),
    };
    format!("{}{line}: {first}{more}", error.name)
}
