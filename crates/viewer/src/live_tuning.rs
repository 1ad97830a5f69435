//! Tuning while a window shows the scene: an experiment on its own frames, then a search on its own thread.
//!
//! In: frames of a session, one after the other. Out: the progress, and finally gains or a reason why there are none. Until then the
//! session stays as it was, except during the experiment's frames. Never here: a window, the measure of good gains
//! ([`metachron_lod::tune`] has it).

use metachron_lod::control::{Law, PictureControl, Policy};
use metachron_lod::tune::{Candidate, Extent, Family, Observed, Plant, Search, Verdict, judge, refusal, search};
use metachron_session::Design;
use metachron_session::Session;
use std::num::NonZero;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// Frames of the experiment: five seconds at thirty a second.
const FRAMES: u64 = 150;
/// The share of the total progress assigned to the experiment.
const EXPERIMENT: f64 = 0.4;
/// Extent of a search while the scene runs: one thread, the rest is left to the agents.
const EXTENT: Extent = Extent { threads: NonZero::new(1), ..Extent::QUICK };

/// A tuning in progress.
pub(super) struct Tuning {
    /// Policy and law before the tuning.
    before: (Policy, Law),
    render_scale: (f64, f64),
    target_hz: f64,
    stage: Stage,
}

enum Stage {
    /// Frames are drawn at many resolutions.
    Drawing(Design),
    /// Gains are searched.
    Searching(Searching),
}

/// A search on its thread.
struct Searching {
    thread: JoinHandle<Result<Verdict, String>>,
    shared: Arc<SearchState>,
}

/// Data shared by the search and the window.
#[derive(Default)]
struct SearchState {
    stopped: AtomicBool,
    /// The share that is done, and the best so far in words.
    progress: Mutex<(f64, String)>,
}

/// Result of a tuning.
pub(super) enum Tuned {
    /// The best gains found.
    Found(Verdict),
    /// No gains, for this reason.
    Refused(String),
}

impl Tuning {
    /// Starts with the experiment.
    pub fn begin(control: &mut PictureControl) -> Self {
        let (before, target_hz) = ((control.policy(), control.law()), control.target_hz());
        let render_scale = control.render_scale_range();
        Self { before, render_scale, target_hz, stage: Stage::Drawing(Design::begin(control, FRAMES)) }
    }

    /// Whether the frames belong to the experiment; the controller must not learn from them.
    pub const fn draws(&self) -> bool {
        matches!(self.stage, Stage::Drawing(_))
    }

    /// Sets the controller to the resolution of the next frame.
    pub fn choose(&mut self, control: &mut PictureControl) {
        if let Stage::Drawing(design) = &mut self.stage {
            design.choose(control);
        }
    }

    /// Records a frame of the experiment; after its last frame the search starts and the session is restored.
    ///
    /// # Errors
    /// If no thread can be created.
    pub fn note(&mut self, session: &mut Session, work_s: f64) -> std::io::Result<()> {
        let Stage::Drawing(design) = &mut self.stage else { return Ok(()) };
        design.note(session, work_s);
        if design.done() < 1.0 {
            return Ok(());
        }
        let observed = std::mem::take(&mut design.observed);
        self.restore(session.control());
        self.stage = Stage::Searching(Searching::start(observed, self.before.1, self.target_hz)?);
        Ok(())
    }

    /// Restores the previous policy, law and bounds of the picture's scale.
    fn restore(&self, control: &mut PictureControl) {
        control.set_render_scale(self.render_scale);
        control.set_law(self.before.1);
        control.set_policy(self.before.0);
    }

    /// Stops; the session is restored.
    pub fn stop(self, control: &mut PictureControl) {
        match &self.stage {
            Stage::Drawing(_) => self.restore(control),
            // the search ends by itself after its present candidate
            Stage::Searching(searching) => searching.shared.stopped.store(true, Ordering::Relaxed),
        }
    }

    /// The share that is done, and a description.
    pub fn progress(&self) -> (f64, String) {
        match &self.stage {
            Stage::Drawing(design) => (EXPERIMENT * design.done(), "drawing frames at many resolutions".to_owned()),
            Stage::Searching(searching) => {
                let progress = searching.shared.progress.lock().unwrap_or_else(PoisonError::into_inner);
                (EXPERIMENT + (1.0 - EXPERIMENT) * progress.0, progress.1.clone())
            }
        }
    }

    /// Whether the search has ended.
    pub fn is_over(&self) -> bool {
        matches!(&self.stage, Stage::Searching(searching) if searching.thread.is_finished())
    }

    /// The result; waits for a search that has not ended.
    pub fn end(self) -> Tuned {
        let Stage::Searching(searching) = self.stage else {
            return Tuned::Refused("the search had not ended".to_owned());
        };
        match searching.thread.join() {
            Ok(Ok(verdict)) => Tuned::Found(verdict),
            Ok(Err(why)) => Tuned::Refused(why),
            Err(_) => Tuned::Refused("the search failed; please report this bug".to_owned()),
        }
    }
}

impl Searching {
    fn start(observed: Vec<Observed>, present: Law, target_hz: f64) -> std::io::Result<Self> {
        let shared = Arc::new(SearchState::default());
        let theirs = Arc::clone(&shared);
        let run =
            move || find(&Plant::identify(&observed).map_err(|why| why.to_string())?, present, target_hz, &theirs);
        let thread = std::thread::Builder::new().name("tuning".to_owned()).spawn(run)?;
        Ok(Self { thread, shared })
    }
}

/// The best gains of the corrected law on this plant, or the present ones where none is better.
fn find(plant: &Plant, present: Law, target_hz: f64, shared: &SearchState) -> Result<Verdict, String> {
    if let Some(why) = refusal(plant, target_hz) {
        return Err(why);
    }
    let mut go_on = |share: f64, best: &Verdict| {
        *shared.progress.lock().unwrap_or_else(PoisonError::into_inner) = (share, verdict_text(best));
        !shared.stopped.load(Ordering::Relaxed)
    };
    let mut judge = |candidate| judge(plant, candidate, target_hz, EXTENT);
    search(&mut Search { judge: &mut judge, go_on: &mut go_on }, Family::Corrected, &[present.into()])
        .map(|found| found.best)
        .ok_or_else(|| "no candidate could be evaluated".to_owned())
}

/// Gains and their performance, in one line.
pub(super) fn verdict_text(verdict: &Verdict) -> String {
    let settles = verdict.settle_s.map_or_else(|| "does not settle".to_owned(), |s| format!("settles in {s:.2} s"));
    let late = 100.0 * verdict.miss_share;
    match verdict.candidate {
        Candidate::Feedback(Law::Corrected { kappa, margin, .. }) => {
            format!("κ {kappa:.2}, margin {:.0} %: {settles}, {late:.1} % late", 100.0 * margin)
        }
        Candidate::Feedback(Law::Printed { alpha, beta }) => {
            format!("α {alpha:.1e}, β {beta:.2}: {settles}, {late:.1} % late")
        }
        Candidate::Adaptive { margin } => format!("margin {:.0} %: {settles}, {late:.1} % late", 100.0 * margin),
    }
}
