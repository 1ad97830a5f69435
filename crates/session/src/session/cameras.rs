//! The scene's own cameras: which of them is used, and where it is.
//!
//! In: a number or a name. Out: a [`Camera`] at a time. Never here: a camera that the user moves.

use super::super::assemble;
use super::Session;
use metachron_render::Camera;

impl Session {
    /// The camera of the scene that is used, now: a moment that is looked at is seen as it was.
    #[must_use]
    pub fn scene_camera(&self) -> Camera {
        let shown = self.rewind().and_then(|rewind| rewind.shown);
        self.camera_at(shown.unwrap_or_else(|| self.sim_now()).as_secs_f64())
    }

    /// The same so many seconds after the start.
    #[must_use]
    pub fn camera_at(&self, seconds: f64) -> Camera {
        assemble::camera(&self.scene, self.camera, &self.scene_view, seconds)
    }

    /// The names of the scene's cameras.
    pub fn camera_names(&self) -> impl Iterator<Item = &str> {
        self.scene.cameras.iter().map(|camera| camera.name.as_str())
    }

    /// The number of the one that is used.
    #[must_use]
    pub const fn camera_number(&self) -> usize {
        self.camera
    }

    /// Uses another camera of the scene; a number that none has changes nothing.
    pub fn use_camera(&mut self, number: usize) {
        if number < self.scene.cameras.len() {
            self.camera = number;
        }
    }
}
