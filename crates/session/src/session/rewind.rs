//! Moments of a run that are kept, so that the run can be shown, and in lockstep gone on from, as it was.
//!
//! In: a session between its frames. Out: a ring of moments within a bound of memory, the oldest given up first. Never here: files, a panel.
//!
//! In lockstep a moment is a checkpoint of the world and the state of the frame loop, which takes part in the world by
//! the cost of frames: from there everything happens again, to the bit. In real time it is the picture's states, and
//! the world runs on while it is looked at.

use super::super::cpu_budget::CpuBudget;
use super::super::visible_resolution::VisibleResolution;
use super::{Chosen, Session};
use glam::DVec3;
use metachron_core::{Body, SimTime, Snapshot};
use metachron_lod::control::{ObjectView, PictureControl};
use metachron_render::{Camera, History, Level};
use metachron_runtime::{Reader, TimelineCommand};
use metachron_world::{Checkpoint, CheckpointError};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The memory that a window keeps moments in, bytes: half a minute of a scene with a checkpoint of 64 kB, at 60 frames a second.
pub const REWIND_BYTES: usize = 128 << 20;
/// Keeping moments takes at most one part in so many of the time that passes on the wall: where one takes long, fewer are kept.
const COST_PARTS: u32 = 20;
/// The memory of control for an object, bytes: a view, a level, a demand and its own lists.
const OBJECT_BYTES: usize = 1024;

/// The moments of a run that are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RewindStatus {
    /// Simulated time of the oldest moment.
    pub oldest: SimTime,
    /// Simulated time of the newest moment.
    pub newest: SimTime,
    /// The moment that is looked at; `None` while the present is shown.
    pub shown: Option<SimTime>,
    /// How many there are.
    pub moments: usize,
    /// Memory that they take, bytes: checkpoints, states of matter and contacts as lists are long; states that two share are counted with
    /// the older.
    pub bytes: usize,
    /// The bound of it, bytes.
    pub bytes_max: usize,
    /// How long it takes to keep one, seconds of wall time, smoothed.
    pub cost_s: f64,
    /// Whether the run can go on from them: in lockstep.
    pub restores: bool,
}

/// The ring.
#[derive(Debug)]
pub(super) struct Rewind {
    moments: VecDeque<Moment>,
    bytes: usize,
    bytes_max: usize,
    shown: Option<usize>,
    /// The last time that one was kept, and how long that takes, smoothed.
    kept: Option<Instant>,
    cost_s: f64,
}

/// One of them.
#[derive(Debug)]
struct Moment {
    time: SimTime,
    histories: Vec<History>,
    going_on: Option<Box<GoingOn>>,
    bytes: usize,
}

/// The state from which a run in lockstep goes on.
#[derive(Debug)]
struct GoingOn {
    world: Checkpoint,
    control: PictureControl,
    cpu_budget: CpuBudget,
    visible_resolution: VisibleResolution,
    views: Vec<ObjectView>,
    levels: Vec<Level>,
    chosen: Chosen,
    frame_cpu_s: f64,
    last_start: Option<Duration>,
    last_camera: Option<(Duration, Camera)>,
    last_seen_by: Option<(Duration, Camera)>,
    next_camera: Option<Camera>,
    lag_s: f64,
    finished: u64,
}

impl Rewind {
    /// The time of the moment that is looked at while the world runs on.
    pub fn shown_beside(&self) -> Option<SimTime> {
        let moment = &self.moments[self.shown?];
        moment.going_on.is_none().then_some(moment.time)
    }

    fn push(&mut self, moment: Moment) {
        self.bytes += moment.bytes;
        self.moments.push_back(moment);
        // the newest stays, however large it is
        while self.bytes > self.bytes_max && self.moments.len() > 1 {
            self.bytes -= self.moments.pop_front().map_or(0, |oldest| oldest.bytes);
        }
    }

    /// Gives up all later moments.
    fn cut_after(&mut self, time: SimTime) {
        while let Some(later) = self.moments.pop_back_if(|moment| moment.time > time) {
            self.bytes -= later.bytes;
        }
    }

    /// Whether so little wall time has passed since the last one that another would cost too much of it.
    fn is_too_soon(&self) -> bool {
        let rests = Duration::try_from_secs_f64(self.cost_s).unwrap_or_default() * COST_PARTS;
        self.kept.is_some_and(|kept| kept.elapsed() < rests)
    }
}

impl Session {
    /// Keeps moments from now on, in at most so many bytes.
    pub fn keep_moments(&mut self, bytes_max: usize) {
        self.rewind =
            Some(Rewind { moments: VecDeque::new(), bytes: 0, bytes_max, shown: None, kept: None, cost_s: 0.0 });
    }

    /// The kept moments; `None` before there are any.
    #[must_use]
    pub fn rewind(&self) -> Option<RewindStatus> {
        let rewind = self.rewind.as_ref()?;
        let (oldest, newest) = (rewind.moments.front()?.time, rewind.moments.back()?.time);
        Some(RewindStatus {
            oldest,
            newest,
            shown: rewind.shown.map(|at| rewind.moments[at].time),
            moments: rewind.moments.len(),
            bytes: rewind.bytes,
            bytes_max: rewind.bytes_max,
            cost_s: rewind.cost_s,
            restores: self.is_virtual(),
        })
    }

    /// Keeps this moment, if time has passed since the last one and the last did not take too long. To be called before a frame is composed;
    /// while the past is looked at it keeps nothing.
    ///
    /// # Errors
    /// [`CheckpointError::Refused`] where something in the world does not save its state: nothing more is kept then.
    pub fn keep_moment(&mut self) -> Result<(), CheckpointError> {
        let time = if self.is_virtual() { self.sim_now() } else { self.chosen.sim };
        let Some(rewind) = &self.rewind else { return Ok(()) };
        if rewind.shown.is_some() || rewind.moments.back().is_some_and(|last| last.time == time) || rewind.is_too_soon()
        {
            return Ok(());
        }
        let begun = Instant::now();
        let going_on = if self.is_virtual() { self.going_on().inspect_err(|_| self.rewind = None)? } else { None };
        let Some(rewind) = &mut self.rewind else { return Ok(()) };
        let mut histories = self.scene_view.histories(self.scene.agents.len());
        let copied = copy(&mut histories, rewind.moments.back().map_or(&[], |last| &last.histories));
        let checkpoint = going_on.as_ref().map_or(0, |it| it.world.size_bytes() + OBJECT_BYTES * it.views.len());
        let bytes = copied + checkpoint + histories.len() * size_of::<History>();
        rewind.cut_after(time);
        rewind.push(Moment { time, histories, going_on, bytes });
        let cost_s = begun.elapsed().as_secs_f64();
        rewind.cost_s += if rewind.kept.is_some() { 0.1 * (cost_s - rewind.cost_s) } else { cost_s };
        rewind.kept = Some(Instant::now());
        Ok(())
    }

    fn going_on(&self) -> Result<Option<Box<GoingOn>>, CheckpointError> {
        if self.world.replayed().is_some() {
            // a replay repeats its recording: it can be looked at
            return Ok(None);
        }
        Ok(Some(Box::new(GoingOn {
            world: self.world.checkpoint()?,
            control: self.control.clone(),
            cpu_budget: self.cpu_budget.clone(),
            visible_resolution: self.visible_resolution.clone(),
            views: self.views.clone(),
            levels: self.levels.clone(),
            chosen: self.chosen,
            frame_cpu_s: self.frame_cpu_s,
            last_start: self.last_start,
            last_camera: self.last_camera,
            last_seen_by: self.last_seen_by,
            next_camera: self.next_camera,
            lag_s: self.lag_s,
            finished: self.finished,
        })))
    }

    /// Looks at the last moment that is not later than `time`, or at the oldest. In lockstep the run is put back there, and paused.
    ///
    /// # Errors
    /// The errors of [`metachron_world::World::restore`].
    pub fn look_at(&mut self, time: SimTime) -> Result<(), CheckpointError> {
        let Some(rewind) = &self.rewind else { return Ok(()) };
        let at = rewind.moments.partition_point(|moment| moment.time <= time).saturating_sub(1);
        self.look_at_moment(at)
    }

    /// Looks at the moment before the one that is looked at, or after it; from the present at the newest one before it.
    ///
    /// # Errors
    /// As [`Self::look_at`].
    pub fn look_beside(&mut self, back: bool) -> Result<(), CheckpointError> {
        let Some(rewind) = &self.rewind else { return Ok(()) };
        let newest = rewind.moments.len().saturating_sub(1);
        let here = rewind.shown.unwrap_or(newest);
        self.look_at_moment(if back { here.saturating_sub(1) } else { (here + 1).min(newest) })
    }

    fn look_at_moment(&mut self, at: usize) -> Result<(), CheckpointError> {
        let Some(moment) = self.rewind.as_ref().and_then(|rewind| rewind.moments.get(at)) else { return Ok(()) };
        let histories = moment.histories.clone();
        if moment.going_on.is_some() {
            self.put_back(at)?;
            self.world.drive(TimelineCommand::Pause);
        }
        self.scene_view.set_histories(&histories, self.scene.agents.len());
        self.rewind.iter_mut().for_each(|rewind| rewind.shown = Some(at));
        Ok(())
    }

    /// Returns to the newest moment: to the present, where the world has run on.
    ///
    /// # Errors
    /// As [`Self::look_at`].
    pub fn look_live(&mut self) -> Result<(), CheckpointError> {
        let Some(rewind) = &self.rewind else { return Ok(()) };
        let Some(newest) = rewind.moments.len().checked_sub(1).filter(|_| rewind.shown.is_some()) else {
            return Ok(());
        };
        if rewind.moments[newest].going_on.is_some() {
            self.look_at_moment(newest)?;
        } else {
            self.show_newest();
        }
        self.rewind.iter_mut().for_each(|rewind| rewind.shown = None);
        Ok(())
    }

    /// Lets the run go on from the moment that is looked at, as it did then: moments kept after it are given up. Where
    /// the world has run on, it returns to the present. Whether it was put back.
    ///
    /// # Errors
    /// As [`Self::look_at`].
    pub fn go_on_from_there(&mut self) -> Result<bool, CheckpointError> {
        let Some(at) = self.rewind.as_ref().and_then(|rewind| rewind.shown) else { return Ok(false) };
        if !self.is_put_back() {
            return self.look_live().map(|()| false);
        }
        self.look_at_moment(at)?;
        // once more without the pause: changes of a paused frame loop since then are undone
        self.put_back(at)?;
        self.branch_off();
        Ok(true)
    }

    /// Makes the moment where the run stands the present, so that a command can act there: moments kept after it are
    /// given up. Nothing where the run does not stand in the past.
    pub fn branch_off(&mut self) {
        let stands = self.is_put_back();
        if let Some(rewind) = self.rewind.as_mut().filter(|_| stands)
            && let Some(at) = rewind.shown.take()
        {
            rewind.cut_after(rewind.moments[at].time);
        }
    }

    /// Whether the run stands where it is looked at.
    #[must_use]
    pub fn is_put_back(&self) -> bool {
        let shown = self.rewind.as_ref().and_then(|rewind| Some(&rewind.moments[rewind.shown?]));
        shown.is_some_and(|moment| moment.going_on.is_some())
    }

    /// Puts world and frame loop into the state of a moment that has one.
    fn put_back(&mut self, at: usize) -> Result<(), CheckpointError> {
        let moment = self.rewind.as_ref().and_then(|rewind| rewind.moments.get(at));
        let Some(there) = moment.and_then(|moment| moment.going_on.as_deref()) else { return Ok(()) };
        self.world.restore(&there.world)?;
        self.control = there.control.clone();
        self.cpu_budget = there.cpu_budget.clone();
        self.visible_resolution = there.visible_resolution.clone();
        self.views.clone_from(&there.views);
        self.levels.clone_from(&there.levels);
        // objects that joined after it keep their places in the picture, unseen
        let later = moment.map_or(0, |moment| self.scene.agents.len().saturating_sub(moment.histories.len()));
        (0..later).for_each(|_| self.visible_resolution.join());
        if later > 0 {
            self.levels.clear();
        }
        self.chosen = there.chosen;
        self.frame_cpu_s = there.frame_cpu_s;
        (self.last_start, self.lag_s, self.finished) = (there.last_start, there.lag_s, there.finished);
        (self.last_camera, self.next_camera) = (there.last_camera, there.next_camera);
        self.last_seen_by = there.last_seen_by;
        let finished = self.finished;
        self.records.truncate(self.records.partition_point(|record| record.frame < finished));
        self.reader = Reader::new(self.world.agents());
        Ok(())
    }
}

/// Replaces states by copies of the parts that a picture shows, or by the copies of the moment before where they are
/// the same: an agent writes its states again as soon as nobody reads them. Returns the bytes of the new ones.
fn copy(histories: &mut [History], last: &[History]) -> usize {
    let mut bytes = 0;
    for (at, history) in histories.iter_mut().enumerate() {
        let known = last.get(at).map_or([None, None], |last| [last.newest.as_ref(), last.before.as_ref()]);
        for state in [&mut history.before, &mut history.newest].into_iter().flatten() {
            let is_it = |known: &&Arc<Snapshot>| known.moment() == state.moment() && known.steps == state.steps;
            let same = known.into_iter().flatten().find(is_it).cloned();
            *state = same.unwrap_or_else(|| {
                let copy = shown(state);
                bytes += size_bytes(&copy);
                Arc::new(copy)
            });
        }
    }
    bytes
}

/// The parts of a state that a picture shows.
fn shown(state: &Snapshot) -> Snapshot {
    Snapshot {
        time: state.time,
        clock_offset: state.clock_offset,
        steps: state.steps,
        body: state.body.clone(),
        at_rest: state.at_rest,
        acceleration: state.acceleration,
        contacts: state.contacts.clone(),
        contact_wrench: state.contact_wrench,
        grips: state.grips.clone(),
        ..Snapshot::default()
    }
}

/// The memory of such a copy.
fn size_bytes(state: &Snapshot) -> usize {
    let body = match &state.body {
        Body::Curve(curve) => {
            size_of_val(&curve.arc_m[..])
                + size_of_val(&curve.positions[..])
                + size_of_val(&curve.velocities[..])
                + size_of_val(&curve.frames[..])
                + size_of_val(&curve.radii_m[..])
                + size_of_val(&curve.flattening_m[..])
        }
        Body::Soft(soft) => {
            let of = |lists: [&[DVec3]; 2]| size_of_val(lists[0]) + size_of_val(lists[1]);
            let nodes = soft.nodes.as_ref().map_or(0, |nodes| of([&nodes.positions, &nodes.velocities]));
            of([&soft.positions, &soft.velocities]) + nodes
        }
        Body::Nothing | Body::Rigid(_) | Body::Tool(_) => 0,
    };
    size_of::<Snapshot>() + body + size_of_val(&state.contacts[..]) + size_of_val(&state.grips[..])
}
