//! A scene seen along its camera's path, frame by frame: each frame at its own place, however long the one before took.
//!
//! In: a scene, what draws. Out: a record and a picture of every frame. Never here: what the numbers mean.
//! Time stands still for agents; only the camera moves. So all policies see the same frames, on any machine.

use super::error::SessionError;
use super::headless::{Drawing, frame_seen_by};
use super::outcome::FrameRecord;
use super::session::Session;
use crate::compositor::{Offscreen, PictureFile, Style};
use crate::runtime::Drive;
use crate::scene::Scene;

/// A walk through a scene.
pub struct Walk {
    session: Session,
    drawing: Drawing,
    length_s: f64,
}

impl Walk {
    /// Opens `scene` with the prices of the adapter that draws.
    ///
    /// # Errors
    /// As [`Session::open`].
    pub fn open(scene: Scene, screen: Offscreen) -> Result<Self, SessionError> {
        let length_s = scene.camera.as_ref().and_then(crate::scene::Camera::length_s).unwrap_or(0.0);
        let mut session = Session::open(scene)?;
        session.drive(Drive::Pause);
        let gpu = screen.gpu();
        session.calibrate((&gpu.describe(), gpu.is_processor()), || Some(gpu.clone()));
        Ok(Self { session, drawing: Drawing::Every(Box::new(screen)), length_s })
    }

    /// The scene in play: for another policy, another target.
    pub const fn session(&mut self) -> &mut Session {
        &mut self.session
    }

    /// Draws what is seen at a part of the path, 0 … 1; the controller learns from it.
    ///
    /// # Errors
    /// [`SessionError::Draw`] where the adapter fails.
    pub fn step(&mut self, part: f64) -> Result<FrameRecord, SessionError> {
        let Drawing::Every(screen) = &self.drawing else { return Ok(FrameRecord::default()) };
        let (camera, size) = (self.session.camera_at(part * self.length_s), screen.size());
        frame_seen_by(&mut self.session, &camera, (size, Style::default()), (&mut self.drawing, false))
    }

    /// The picture that was drawn last.
    ///
    /// # Errors
    /// [`SessionError::Picture`] where it cannot be read back.
    pub fn picture(&self) -> Result<PictureFile, SessionError> {
        match &self.drawing {
            Drawing::Every(screen) | Drawing::Last(screen) => screen.read_back().map_err(SessionError::Picture),
            Drawing::Nothing => Ok(PictureFile::new(0, 0)),
        }
    }
}
