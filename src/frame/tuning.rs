//! Tuning while a window shows the scene: an experiment on its own frames, then a search on a thread of its own.
//!
//! In: frames of a session, one after the other. Out: how far it is, and in the end gains or a reason why there are none. Until then the
//! session is as it was before, but for the experiment's frames. Never here: a window, what good gains are ([`crate::tune`] says).

use super::experiment::Design;
use super::session::Session;
use crate::control::{Law, PictureControl, Policy};
use crate::tune::{Contender, Extent, Family, Observed, Plant, Search, Verdict, refusal, search};
use std::num::NonZero;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// Frames of the experiment: five seconds at thirty a second.
const FRAMES: u64 = 150;
/// The share of the whole that the experiment is told as.
const EXPERIMENT: f64 = 0.4;
/// What a search beside a running scene plays: one thread, the rest is the agents'.
const EXTENT: Extent = Extent { threads: NonZero::new(1), ..Extent::QUICK };

/// A tuning under way.
pub(super) struct Tuning {
    /// What held the picture before.
    before: (Policy, Law),
    target_hz: f64,
    stage: Stage,
}

enum Stage {
    /// Frames are drawn at many resolutions.
    Drawing(Design),
    /// Gains are looked for.
    Searching(Searching),
}

/// A search on its thread.
struct Searching {
    hand: JoinHandle<Result<Verdict, String>>,
    news: Arc<News>,
}

/// What the search and the window tell each other.
#[derive(Default)]
struct News {
    stopped: AtomicBool,
    /// The share that is done, and the best so far in words.
    told: Mutex<(f64, String)>,
}

/// What came of it.
pub(super) enum Tuned {
    /// These gains are the best that were found.
    Found(Verdict),
    /// There are none, for this reason.
    Refused(String),
}

impl Tuning {
    /// Begins with the experiment.
    pub fn begin(control: &mut PictureControl) -> Self {
        let (before, target_hz) = ((control.policy(), control.law()), control.target_hz());
        Self { before, target_hz, stage: Stage::Drawing(Design::begin(control, FRAMES)) }
    }

    /// Whether the frames belong to the experiment, and must not teach the controller.
    pub const fn draws(&self) -> bool {
        matches!(self.stage, Stage::Drawing(_))
    }

    /// Brings the controller to where the next frame is to be drawn.
    pub fn choose(&mut self, control: &mut PictureControl) {
        if let Stage::Drawing(design) = &mut self.stage {
            design.choose(control);
        }
    }

    /// Writes down a frame of the experiment; after its last the search begins and the session is as before.
    ///
    /// # Errors
    /// Where no thread can be had.
    pub fn note(&mut self, session: &mut Session, work_s: f64) -> std::io::Result<()> {
        let Stage::Drawing(design) = &mut self.stage else { return Ok(()) };
        design.note(session, work_s);
        if design.done() < 1.0 {
            return Ok(());
        }
        let observed = std::mem::take(&mut design.observed);
        self.restore(session.control());
        self.stage = Stage::Searching(Searching::start(observed, self.target_hz)?);
        Ok(())
    }

    /// Puts back what held the picture before.
    fn restore(&self, control: &mut PictureControl) {
        control.set_law(self.before.1);
        control.set_policy(self.before.0);
    }

    /// Stops; the session is as before.
    pub fn stop(self, control: &mut PictureControl) {
        match &self.stage {
            Stage::Drawing(_) => self.restore(control),
            // it ends with its candidate, by itself
            Stage::Searching(searching) => searching.news.stopped.store(true, Ordering::Relaxed),
        }
    }

    /// The share that is done, and words beside it.
    pub fn progress(&self) -> (f64, String) {
        match &self.stage {
            Stage::Drawing(design) => (EXPERIMENT * design.done(), "drawing at many resolutions".to_owned()),
            Stage::Searching(searching) => {
                let told = searching.news.told.lock().unwrap_or_else(PoisonError::into_inner);
                (EXPERIMENT + (1.0 - EXPERIMENT) * told.0, told.1.clone())
            }
        }
    }

    /// Whether the search is over.
    pub fn is_over(&self) -> bool {
        matches!(&self.stage, Stage::Searching(searching) if searching.hand.is_finished())
    }

    /// What came of it; waits for a search that is not over.
    pub fn end(self) -> Tuned {
        let Stage::Searching(searching) = self.stage else { return Tuned::Refused("it was not over".to_owned()) };
        match searching.hand.join() {
            Ok(Ok(verdict)) => Tuned::Found(verdict),
            Ok(Err(why)) => Tuned::Refused(why),
            Err(_) => Tuned::Refused("the search has failed, which is a bug".to_owned()),
        }
    }
}

impl Searching {
    fn start(observed: Vec<Observed>, target_hz: f64) -> std::io::Result<Self> {
        let news = Arc::new(News::default());
        let theirs = Arc::clone(&news);
        let look = move || find(&observed, target_hz, &theirs);
        let hand = std::thread::Builder::new().name("tuning".to_owned()).spawn(look)?;
        Ok(Self { hand, news })
    }
}

/// The best gains of the corrected law for what was observed.
fn find(observed: &[Observed], target_hz: f64, news: &News) -> Result<Verdict, String> {
    let plant = Plant::identify(observed).map_err(|why| why.to_string())?;
    if let Some(why) = refusal(&plant, target_hz) {
        return Err(why);
    }
    let mut go_on = |share: f64, best: &Verdict| {
        *news.told.lock().unwrap_or_else(PoisonError::into_inner) = (share, told(best));
        !news.stopped.load(Ordering::Relaxed)
    };
    let mut setting = Search { plant: &plant, target_hz, extent: EXTENT, go_on: &mut go_on };
    search(&mut setting, Family::Corrected).map(|found| found.best).ok_or_else(|| "nothing could be judged".to_owned())
}

/// Gains and what they are worth, in one line.
pub(super) fn told(verdict: &Verdict) -> String {
    let settles = verdict.settle_s.map_or_else(|| "does not settle".to_owned(), |s| format!("settles in {s:.2} s"));
    let late = 100.0 * verdict.miss_share;
    match verdict.contender {
        Contender::Feedback(Law::Corrected { kappa, margin, .. }) => {
            format!("κ {kappa:.2}, margin {:.0} %: {settles}, {late:.1} % late", 100.0 * margin)
        }
        Contender::Feedback(Law::Printed { alpha, beta }) => {
            format!("α {alpha:.1e}, β {beta:.2}: {settles}, {late:.1} % late")
        }
        Contender::Adaptive { margin } => format!("margin {:.0} %: {settles}, {late:.1} % late", 100.0 * margin),
    }
}
