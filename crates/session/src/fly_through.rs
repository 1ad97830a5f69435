//! A scene seen along its camera's path, frame by frame: each frame at its own place, however long the previous one took.
//!
//! In: a scene, the means of drawing. Out: a record and a picture of every frame. Never here: the meaning of the
//! numbers.
//! Agents are paused; only the camera moves. So all policies see the same frames, on any machine.
//! In lockstep a frame takes its declared time, and only the requested pictures are drawn.

use super::error::SessionError;
use super::headless::{Drawing, PictureFormat, frame_seen_by, pictured};
use super::outcome::FrameRecord;
use super::session::Session;
use metachron_render::{Camera, PictureFile, Size, Style};
use metachron_runtime::TimelineCommand;
use metachron_world::{Pace, Scene};

/// A walk through a scene.
pub struct FlyThrough {
    session: Session,
    drawing: Drawing,
    size: Size,
    length_s: f64,
    /// Camera of the last frame.
    camera: Camera,
}

impl FlyThrough {
    /// Opens `scene` for pictures of `size`, with the prices of the adapter that draws every frame.
    ///
    /// # Errors
    /// As [`Session::open`].
    pub fn open(scene: Scene, drawing: Drawing, size: Size) -> Result<Self, SessionError> {
        let length_s = scene.cameras.first().and_then(|first| first.camera.length_s()).unwrap_or(0.0);
        let mut session = Session::open(scene, Pace::RealTime)?;
        session.drive(TimelineCommand::Pause);
        if let Drawing::Every(screen) = &drawing {
            let gpu = screen.gpu();
            session.calibrate(&gpu.describe(), gpu.is_processor(), || Some(gpu.clone()));
        }
        let camera = session.camera_at(0.0);
        Ok(Self { session, drawing, size, length_s, camera })
    }

    /// The session: to change its policy or target.
    pub const fn session(&mut self) -> &mut Session {
        &mut self.session
    }

    /// Plays the frame at a fraction of the path, 0 … 1; the controller learns from it.
    ///
    /// # Errors
    /// [`SessionError::Draw`] where the adapter fails.
    pub fn step(&mut self, part: f64) -> Result<FrameRecord, SessionError> {
        self.camera = self.session.camera_at(part * self.length_s);
        let format = PictureFormat { size: self.size, style: Style::default() };
        frame_seen_by(&mut self.session, &self.camera, format, &mut self.drawing, false)
    }

    /// The picture of the last frame; `None` where nothing draws.
    ///
    /// # Errors
    /// [`SessionError::Draw`] where the adapter fails, [`SessionError::Picture`] where it cannot be read back.
    pub fn picture(&mut self) -> Result<Option<PictureFile>, SessionError> {
        let drawn = !matches!(self.drawing, Drawing::Nothing);
        drawn.then(|| pictured(&self.session, &self.camera, &mut self.drawing)).transpose()
    }

    /// The levels of the last frame in another style, and where `from` is given seen by that camera: objects that the
    /// frame did not see are left out.
    /// `None` where nothing draws.
    ///
    /// # Errors
    /// As [`FlyThrough::picture`].
    pub fn picture_of_levels(
        &mut self,
        from: Option<&Camera>,
        style: Style,
    ) -> Result<Option<PictureFile>, SessionError> {
        let camera = *from.unwrap_or(&self.camera);
        let (Drawing::Every(screen) | Drawing::Last(screen)) = &mut self.drawing else { return Ok(None) };
        let picture = self.session.compose_levels(&camera, self.size, style);
        screen.render(picture, &camera).map_err(SessionError::Draw)?;
        let drawn = screen.read_back().map_err(SessionError::Picture)?;
        self.session.compose_again(&self.camera, self.size);
        Ok(Some(drawn))
    }

    /// The camera of the last frame.
    #[must_use]
    pub const fn camera(&self) -> &Camera {
        &self.camera
    }
}
