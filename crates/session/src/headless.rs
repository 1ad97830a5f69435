//! Plays a scene without a window: for reports, pictures and tests.
//!
//! In: a session, an end, the means of drawing. Out: an [`Outcome`], and a picture file if one is requested.
//! Never here: arguments, progress bars (the caller is called back at every frame).

use super::error::SessionError;
#[cfg(feature = "picture")]
use super::film::Film;
use super::outcome::{FrameRecord, Outcome};
use super::session::{Finished, Session};
use metachron_render::{Camera, Size, Style};
#[cfg(feature = "picture")]
use metachron_render::{Offscreen, PictureFile, RendererOptions};
#[cfg(feature = "picture")]
use metachron_world::OutputFile;
#[cfg(feature = "picture")]
use std::path::Path;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// When a run ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum End {
    /// After so many frames.
    Frames(u64),
    /// After so many simulated seconds.
    Seconds(f64),
    /// With the recording that is repeated.
    Recording,
}

impl End {
    /// For how long the time of a world elsewhere may stand: as long as the run is to last.
    fn patience(self) -> Duration {
        match self {
            Self::Seconds(seconds) => Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX),
            Self::Frames(_) | Self::Recording => Duration::MAX,
        }
    }
}

/// The way in which frames are drawn.
pub enum Drawing {
    /// Nothing: a frame costs its declared time, or nothing in real time.
    Nothing,
    /// Every frame is drawn, in real time.
    #[cfg(feature = "picture")]
    Every(Box<Offscreen>),
    #[cfg(feature = "picture")]
    /// Only frames of which a picture is wanted are drawn, without a time limit; costs are declared.
    Last(Box<Offscreen>),
}

impl Drawing {
    /// The adapter's name and driver; `None` where nothing is drawn.
    pub(super) fn adapter(&self) -> Option<String> {
        match self {
            Self::Nothing => None,
            #[cfg(feature = "picture")]
            Self::Every(screen) | Self::Last(screen) => Some(screen.gpu().describe()),
        }
    }
}

/// Size and style of the pictures of a run.
#[derive(Debug, Clone, Copy)]
pub struct PictureFormat {
    /// Size in pixels.
    pub size: Size,
    /// How they are drawn.
    pub style: Style,
}

/// A run without a window.
pub struct Headless {
    /// When it ends.
    pub end: End,
    /// Size of the picture in pixels.
    pub size: Size,
    /// How it is drawn.
    pub style: Style,
    /// The means of drawing.
    pub drawing: Drawing,
    /// File for the picture of the last frame.
    pub png: Option<PathBuf>,
    /// File for the depths of the last frame (PNG, 16 bits).
    pub depth: Option<PathBuf>,
    /// File for the film of all frames (YUV4MPEG2).
    pub film: Option<PathBuf>,
}

/// Plays `session` to its end. `go_on` receives every frame and the share of the run that is done, 0 … 1; if it returns `false` the run
/// ends.
///
/// # Errors
/// [`SessionError::Draw`] where the adapter fails, [`SessionError::File`] where a film cannot begin, [`SessionError::Diverged`]. A file that
/// takes no more ends the run, and so does a world elsewhere that is silent, or whose time stands for as long as the run is to last: its
/// outcome says why ([`Outcome::cut_off`]).
pub fn play_headless(
    mut session: Session,
    mut plan: Headless,
    go_on: &mut dyn FnMut(&FrameRecord, f64) -> bool,
) -> Result<Outcome, SessionError> {
    session.hold();
    #[cfg(feature = "picture")]
    warm_up(&mut session, &mut plan)?;
    let mut due = session.begin();
    let period = session.period();
    #[cfg(feature = "picture")]
    let mut film = film(&plan, period, due)?;
    let mut interrupted = false;
    let mut cut_off: Option<SessionError> = None;
    loop {
        session.wait_until(due);
        let done = share_done(&session, plan.end)?;
        cut_off = cut_off.or_else(|| session.cut_off(plan.end.patience()));
        if done >= 1.0 || interrupted || cut_off.is_some() || session.recording_failed() {
            break;
        }
        let format = PictureFormat { size: plan.size, style: plan.style };
        let camera = frame_camera(&mut session);
        let record = frame_seen_by(&mut session, &camera, format, &mut plan.drawing, false)?;
        #[cfg(feature = "picture")]
        if let Some(film) = &mut film {
            cut_off = film.push(session.shown(due), pictured(&session, &camera, &mut plan.drawing)?).err();
        }
        interrupted = !go_on(&record, done);
        due = session.shown(due + period);
    }
    // the picture shows the state at the end of the run, however long drawing takes
    session.hold();
    #[cfg(feature = "picture")]
    {
        cut_off = cut_off.or(film.and_then(|film| film.finish(session.shown(due)).err()));
        cut_off = keep_first(cut_off, write_picture(&mut session, &mut plan))?;
    }
    let adapter = plan.drawing.adapter();
    let outcome = session.end(adapter, interrupted);
    Ok(Outcome { cut_off: cut_off.map(Arc::new).or(outcome.cut_off), ..outcome })
}

/// The first reason for the run's end: `before`, or a picture that could not be written. Other errors end the run without an outcome.
#[cfg(feature = "picture")]
fn keep_first(
    before: Option<SessionError>,
    picture: Result<(), SessionError>,
) -> Result<Option<SessionError>, SessionError> {
    match picture {
        Ok(()) => Ok(before),
        Err(error @ (SessionError::Picture(_) | SessionError::File { .. })) => Ok(before.or(Some(error))),
        Err(error) => Err(error),
    }
}

/// Makes drawing ready while time is held: prices are known and a first picture, which creates pipelines and buffers, is finished. Virtual
/// time does not pass meanwhile anyway.
#[cfg(feature = "picture")]
fn warm_up(session: &mut Session, plan: &mut Headless) -> Result<(), SessionError> {
    if let Drawing::Every(screen) = &mut plan.drawing {
        let gpu = screen.gpu().clone();
        session.calibrate(&gpu.describe(), gpu.is_processor(), || Some(gpu));
        let camera = session.scene_camera();
        session.compose(&camera, plan.size, plan.style, None);
        screen.render(session.picture(), &camera).map_err(SessionError::Draw)?;
        session.pass_over();
    }
    Ok(())
}

fn share_done(session: &Session, end: End) -> Result<f64, SessionError> {
    Ok(match end {
        End::Frames(frames) => session.frames() as f64 / frames as f64,
        End::Seconds(seconds) => session.played_s() / seconds,
        End::Recording => session.replayed().unwrap_or(Ok(1.0)).map_err(SessionError::Diverged)?,
    })
}

/// Gathers, chooses, draws and updates the controller, unless it must not learn from this frame (`skip`).
pub(super) fn one_frame(
    session: &mut Session,
    format: PictureFormat,
    drawing: &mut Drawing,
    skip: bool,
) -> Result<FrameRecord, SessionError> {
    let camera = frame_camera(session);
    frame_seen_by(session, &camera, format, drawing, skip)
}

/// The scene's camera at the time when the frame that begins now is shown.
fn frame_camera(session: &mut Session) -> Camera {
    let camera = session.scene_camera();
    session.predict_camera(camera)
}

/// As [`one_frame`], seen by `camera` instead of the scene's camera.
pub(super) fn frame_seen_by(
    session: &mut Session,
    camera: &Camera,
    format: PictureFormat,
    drawing: &mut Drawing,
    skip: bool,
) -> Result<FrameRecord, SessionError> {
    match drawing {
        #[cfg(feature = "picture")]
        Drawing::Every(screen) => draw_frame(session, camera, format, screen, skip),
        #[cfg(feature = "picture")]
        Drawing::Last(_) => Ok(undrawn_frame(session, camera, format, skip)),
        Drawing::Nothing => Ok(undrawn_frame(session, camera, format, skip)),
    }
}

/// Gathers and chooses a frame, whose drawing takes its declared time, and updates the controller, unless it must not learn from this frame
/// (`skip`).
fn undrawn_frame(session: &mut Session, camera: &Camera, format: PictureFormat, skip: bool) -> FrameRecord {
    let PictureFormat { size, style } = format;
    let started = session.now();
    session.compose(camera, size, style, None);
    session.choose_next_frame(camera, size);
    let draw = session.spend_declared(size);
    let work = session.now().saturating_sub(started);
    session.finish(started, Finished { work, draw, gpu: None, skip })
}

/// Gathers, chooses and draws a frame on `screen`, chooses the next one meanwhile, and updates the controller, unless it must not learn
/// from this frame (`skip`).
///
/// # Errors
/// [`SessionError::Draw`] where the adapter fails.
#[cfg(feature = "picture")]
pub fn draw_frame(
    session: &mut Session,
    camera: &Camera,
    format: PictureFormat,
    screen: &mut Offscreen,
    skip: bool,
) -> Result<FrameRecord, SessionError> {
    let PictureFormat { size, style } = format;
    let started = session.now();
    session.compose(camera, size, style, None);
    let composed = session.now();
    screen.submit(session.picture(), camera).map_err(SessionError::Draw)?;
    session.choose_next_frame(camera, size);
    let gpu = screen.wait().map_err(SessionError::Draw)?;
    let done = session.now();
    let (work, draw) = (done.saturating_sub(started), done.saturating_sub(composed));
    Ok(session.finish(started, Finished { work, draw, gpu, skip }))
}

/// The film that a plan wants, if anything is drawn.
#[cfg(feature = "picture")]
fn film(plan: &Headless, period: Duration, begun: Duration) -> Result<Option<Film>, SessionError> {
    let drawn = plan.film.as_ref().filter(|_| !matches!(plan.drawing, Drawing::Nothing));
    drawn.map(|path| Film::create(path, plan.size, period, begun)).transpose()
}

/// The picture of the last frame, which was seen by `camera`; drawn now where frames are not.
#[cfg(feature = "picture")]
pub(super) fn pictured(session: &Session, camera: &Camera, drawing: &mut Drawing) -> Result<PictureFile, SessionError> {
    let screen = match drawing {
        Drawing::Nothing => return Ok(PictureFile::default()),
        Drawing::Every(screen) => screen,
        Drawing::Last(screen) => {
            screen.render(session.picture(), camera).map_err(SessionError::Draw)?;
            screen
        }
    };
    screen.read_back().map_err(SessionError::Picture)
}

/// Draws the last frame once more, without a time limit, and its depths.
#[cfg(feature = "picture")]
fn write_picture(session: &mut Session, plan: &mut Headless) -> Result<(), SessionError> {
    if plan.png.is_none() && plan.depth.is_none() {
        return Ok(());
    }
    let mut fresh;
    let still = match &mut plan.drawing {
        Drawing::Nothing => return Ok(()),
        Drawing::Last(still) => still,
        Drawing::Every(screen) => {
            let gpu = screen.gpu().clone();
            fresh = Offscreen::new(gpu, plan.size, RendererOptions::STILL).map_err(SessionError::Draw)?;
            &mut fresh
        }
    };
    let camera = session.scene_camera();
    session.compose(&camera, plan.size, plan.style, None);
    if let Some(path) = &plan.depth {
        let depths = still.depths(session.picture(), &camera).map_err(SessionError::Draw)?;
        write(path, &depths.png().map_err(SessionError::Picture)?)?;
    }
    if let Some(path) = &plan.png {
        still.render(session.picture(), &camera).map_err(SessionError::Draw)?;
        write(path, &still.png().map_err(SessionError::Picture)?)?;
    }
    Ok(())
}

#[cfg(feature = "picture")]
fn write(path: &Path, bytes: &[u8]) -> Result<(), SessionError> {
    OutputFile::write(path, bytes).map_err(|error| SessionError::File { path: path.to_owned(), error })
}
