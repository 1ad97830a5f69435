//! The files of the scene that is shown: opened, read again, and watched for changes.
//!
//! In: a path, the text of files. Out: another session, or a message while the old one runs on. Never here: the meaning
//! of a scene.

use super::WindowSimulation;
use crate::ui::{Message, Severity};
use metachron_scene::{FileVersion, SceneError, Source, SourceFile};
use metachron_session::Session;
use metachron_world::{Pace, Scene};
use std::path::Path;
use std::time::{Duration, Instant};

/// How often the files are looked at.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// The files on the disk that a scene is made of: its own, meshes, textures.
#[derive(Debug)]
pub(super) struct WatchedFiles {
    /// None of a built-in scene.
    files: Vec<SourceFile>,
    looked: Instant,
}

impl WatchedFiles {
    /// The files of a scene that has been read, as they were then.
    pub fn of(source: &Source) -> Self {
        Self { files: source.files(), looked: Instant::now() }
    }

    /// Whether one of them is another one than when this was asked last; a file that is gone has not changed.
    fn have_changed(&mut self, every: Duration) -> bool {
        if self.looked.elapsed() < every {
            return false;
        }
        self.looked = Instant::now();
        let mut changed = false;
        for file in &mut self.files {
            changed |= has_changed(file);
        }
        changed
    }
}

fn has_changed(file: &mut SourceFile) -> bool {
    let now = FileVersion::of(&file.path);
    now.is_some() && std::mem::replace(&mut file.version, now) != now
}

impl WindowSimulation<'_> {
    /// Reads the scene again where one of its files has changed.
    pub(super) fn follow_files(&mut self) {
        self.follow_files_every(LOOK_EVERY);
    }

    pub(super) fn follow_files_every(&mut self, every: Duration) {
        if self.files.have_changed(every) {
            self.reload();
        }
    }

    /// Reads the scene again; while a file of it is wrong the message stays, and the old scene runs on.
    pub(super) fn reload(&mut self) {
        let source = match Source::open(self.plan.source.name()) {
            Ok(source) => source.within(self.plan.source.limits()),
            Err(error) => return self.not_reloaded(&error),
        };
        match self.load(source.clone()) {
            Ok(scene) => self.restart(scene),
            Err(error) => {
                // the one at fault may be a file that the scene had not named before
                self.files = WatchedFiles::of(&source);
                self.not_reloaded(&error);
            }
        }
    }

    fn not_reloaded(&mut self, error: &SceneError) {
        let text = format!("scene not reloaded: {}", first_problem(error));
        self.file_error = Some(Message { severity: Severity::Failure, text });
    }

    pub(super) fn open(&mut self, path: &Path) {
        let overrides = std::mem::take(&mut self.plan.overrides);
        let limits = self.plan.source.limits();
        match Source::open(&path.to_string_lossy()).and_then(|source| self.load(source.within(limits))) {
            Ok(scene) => self.restart(scene),
            Err(error) => {
                self.plan.overrides = overrides;
                self.show_message(Severity::Failure, format!("scene not opened: {}", first_problem(&error)));
            }
        }
    }

    fn load(&mut self, source: Source) -> Result<Scene, SceneError> {
        let scene = metachron_scene::load(&source, &self.plan.overrides)?;
        (self.files, self.file_error) = (WatchedFiles::of(&source), None);
        self.plan.source = source;
        Ok(scene)
    }

    /// Restarts with `scene`; speed and pause are kept.
    pub(super) fn restart(&mut self, scene: Scene) {
        match Session::open(scene, Pace::RealTime) {
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
