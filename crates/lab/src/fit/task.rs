//! A scene that is played repeatedly at different settings.
//!
//! In: settings for every object. Out: the distance of its points from the converged answer's, and the costs. Never here: which
//! settings are tried.

use super::super::args::FitArgs;
use super::names;
use super::objects::Object;
use metachron_console::output::BadInput;
use metachron_console::progress::Bar;
use metachron_core::AgentId;
use metachron_models::rod::Integrator;
use metachron_session::fit::{Choice, Path, Setting, Trial, farthest_m};
use metachron_session::{Played, Point, SessionError, apply, method_of, play_points, setting_of, solve_prices};
use metachron_world::{Member, Scene, Spec};
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

/// Longest step, seconds; at most a tenth of the run as well.
const DT_MAX_S: f64 = 0.1;
/// The fewest pieces of a tube or rope, and of a sheet or solid where it has most.
const PIECES_MIN: [u32; 2] = [4, 2];
/// The most pieces of a tube, and of a soft body, in the converged answer.
const PIECES_MAX: [u32; 2] = [4096, 64];

/// A scene under fit.
pub(super) struct Task<'a> {
    /// The scene as it was read.
    pub(super) first: Scene,
    /// The scene with the models chosen so far.
    pub(super) scene: Scene,
    pub(super) objects: Vec<Object>,
    /// All points: first those held to the tolerance, then some of every other agent, for the notes on it.
    pub(super) points: Vec<Point>,
    /// Number of points held to the tolerance.
    pub(super) held: usize,
    pub(super) seconds: f64,
    stopped: &'a AtomicBool,
    bar: Option<Bar>,
    pub(super) runs: Cell<u32>,
    runs_max: u32,
    /// Cost of a solve of every integrator relative to implicit Euler, as measured on this machine.
    pub(super) prices: Vec<f64>,
    failed: Option<SessionError>,
    parked: Option<String>,
}

impl<'a> Task<'a> {
    /// The task of a scene, with the points to be held.
    ///
    /// # Errors
    /// [`BadInput`] for a scene in which nothing moves, and for an unknown name.
    pub(super) fn new(
        args: &FitArgs,
        scene: Scene,
        objects: Vec<Object>,
        stopped: &'a AtomicBool,
        bar: Bar,
    ) -> Result<Self, BadInput> {
        if objects.is_empty() {
            return Err(BadInput(format!("{}: no object moves: there is nothing to fit", scene.name)));
        }
        let mut points = held(&scene, &objects, args.probe.as_deref())?;
        let held = points.len();
        points.extend(scene.agents.iter().flat_map(points_of));
        let (seconds, runs_max) = (args.seconds, args.runs);
        let (bar, runs, failed, parked) = (Some(bar), Cell::new(0), None, None);
        let (first, prices) = (scene.clone(), solve_prices());
        Ok(Self { first, scene, objects, points, held, seconds, stopped, bar, runs, runs_max, prices, failed, parked })
    }

    /// Removes the progress bar from the screen.
    pub(super) fn clear_bar(&mut self) {
        self.bar = None;
    }

    /// Whether the user has interrupted.
    pub(super) fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }

    /// The failure of a model, if there was one.
    pub(super) fn failure(&mut self) -> Result<(), SessionError> {
        self.failed.take().map_or(Ok(()), Err)
    }

    /// The reason why there is no answer.
    pub(super) fn lost(&self) -> String {
        let why = self.parked.as_deref().unwrap_or("no run reached its end");
        format!("there is no converged answer to compare with: {why}")
    }

    /// The first agent of an object: all of them are alike.
    pub(super) fn member(&self, object: usize) -> &Member {
        &self.scene.agents[self.objects[object].agents[0].0 as usize]
    }

    /// The same in the scene as it was read.
    pub(super) fn first_member(&self, object: usize) -> &Member {
        &self.first.agents[self.objects[object].agents[0].0 as usize]
    }

    /// The present settings of the scene.
    pub(super) fn settings(&self) -> Vec<Setting> {
        (0..self.objects.len()).map(|object| setting_of(self.member(object))).collect()
    }

    /// The present settings with step and spacing halved `level` times where they may change; tubes by a second-order rule if `second`.
    pub(super) fn refined(&self, level: u32, second: bool) -> Vec<Setting> {
        let finer = f64::from(1_u32 << level);
        let refine = |object: usize| {
            let member = self.member(object);
            let now = setting_of(member);
            if !is_free(member) {
                return now;
            }
            let tube = matches!(member.spec, Spec::Tube(_));
            let most = PIECES_MAX[usize::from(!tube)].max(now.pieces);
            let method = if second && tube { method_of(Integrator::Bdf2) } else { now.method };
            Setting { dt_s: now.dt_s / finer, pieces: (now.pieces << level).min(most), method }
        };
        (0..self.objects.len()).map(refine).collect()
    }

    /// The paths of the held points, with step and spacing halved `level` times.
    pub(super) fn reference(&mut self, level: u32) -> Option<Vec<Path>> {
        let settings = self.refined(level, true);
        let mut played = self.play(&settings)?;
        if let Some((agent, reason)) = &played.parked {
            self.parked = Some(format!("`{}` was parked: {reason}", self.scene.name_of(*agent)));
            return None;
        }
        played.paths.truncate(self.held);
        Some(played.paths)
    }

    /// Error against the converged answer and costs of some settings; `None` where the run was stopped, or only the last run is left,
    /// which is reserved for the result.
    pub(super) fn attempt(&mut self, settings: &[Setting], answer: &[Path]) -> Option<Trial> {
        if self.left() <= 1 {
            return None;
        }
        let played = self.play(settings)?;
        let apart_m = farthest_m(&played.paths[..self.held], answer);
        let error_m = if played.parked.is_some() { f64::INFINITY } else { apart_m };
        let costs_s = self.sums(&played.costs_s).into_iter().enumerate();
        let costs_s = costs_s.map(|(object, cost_s)| cost_s * self.price(object, settings[object].method)).collect();
        Some(Trial { error_m, costs_s })
    }

    /// Cost of an object's solve by a method, relative to that of the declared machine.
    fn price(&self, object: usize, method: usize) -> f64 {
        let tube = matches!(self.member(object).spec, Spec::Tube(_));
        let price = self.prices.get(method).filter(|price| tube && price.is_finite());
        price.copied().unwrap_or(1.0)
    }

    /// Turns a tube into a rope; `false` where that is impossible.
    pub(super) fn slacken(&mut self, object: usize) -> bool {
        let mut scene = self.scene.clone();
        let can = self.objects[object].agents.iter().all(|agent| scene.agents[agent.0 as usize].replace_tube_by_rope());
        if can {
            self.scene = scene;
        }
        can
    }

    /// Measured CPU of every object, seconds per simulated second.
    pub(super) fn cpu(&mut self, settings: &[Setting]) -> Vec<f64> {
        self.play(settings).map_or_else(|| vec![f64::NAN; self.objects.len()], |played| self.sums(&played.cpu_s))
    }

    /// The scene at these settings.
    pub(super) fn scene_at(&self, settings: &[Setting]) -> Scene {
        let mut scene = self.scene.clone();
        for (object, setting) in self.objects.iter().zip(settings) {
            if is_free(&self.scene.agents[object.agents[0].0 as usize]) {
                object.agents.iter().for_each(|agent| apply(&mut scene, *agent, setting));
            }
        }
        scene
    }

    /// Number of runs left.
    pub(super) fn left(&self) -> u32 {
        self.runs_max - self.runs.get()
    }

    /// Plays the scene at these settings to its end; `None` where the user interrupted, no run is left, or it failed.
    pub(super) fn play(&mut self, settings: &[Setting]) -> Option<Played> {
        if self.left() == 0 {
            return None;
        }
        let scene = self.scene_at(settings);
        let runs = self.runs.get() + 1;
        self.runs.set(runs);
        let done = f64::from(runs) / f64::from(self.runs_max.max(1));
        self.bar.iter().for_each(|bar| bar.set(done, format!("run {runs}")));
        let stopped = self.stopped;
        match play_points(&scene, &self.points, self.seconds, &mut || !stopped.load(Ordering::Relaxed)) {
            Ok(played) => played,
            Err(error) => {
                self.failed.get_or_insert(error);
                None
            }
        }
    }

    /// The choices for every object.
    pub(super) fn choices(&self) -> Vec<Choice> {
        let dt_max_s = DT_MAX_S.min(0.1 * self.seconds);
        let choice = |object: usize| {
            let member = self.member(object);
            let now = setting_of(member);
            if !is_free(member) {
                return Choice { dt_max_s: now.dt_s, pieces_min: now.pieces, methods: Vec::new() };
            }
            let tube = matches!(member.spec, Spec::Tube(_));
            let methods = Integrator::ALL.into_iter().filter(|one| tube && *one != Integrator::Xpbd).map(method_of);
            let methods = methods.filter(|method| self.prices[*method].is_finite());
            let line = tube || member.spec.model() == "rope";
            Choice { dt_max_s, pieces_min: PIECES_MIN[usize::from(!line)], methods: methods.collect() }
        };
        (0..self.objects.len()).map(choice).collect()
    }

    /// Numbers of agents summed over each object.
    fn sums(&self, numbers: &[f64]) -> Vec<f64> {
        let sum = |object: &Object| object.agents.iter().map(|agent| numbers[agent.0 as usize]).sum();
        self.objects.iter().map(sum).collect()
    }
}

/// Whether settings of an agent may be chosen: a synthetic agent has no answer, and an agent with a tolerance chooses for itself.
/// A tool follows its script at any step, but the bodies that it grasps and pushes receive its state once per step.
pub(super) fn is_free(member: &Member) -> bool {
    member.tolerance_m.is_none() && !matches!(member.spec, Spec::Synthetic(_) | Spec::Custom(_))
}

/// Points that represent the place of an agent.
fn points_of(member: &Member) -> Vec<Point> {
    let at: &[f64] = match member.spec {
        Spec::Tube(_) | Spec::Soft(_) => &[0.0, 0.5, 1.0],
        Spec::Rigid(_) => &[0.0],
        Spec::Tool(_) | Spec::Synthetic(_) | Spec::Custom(_) => &[],
    };
    at.iter().map(|at| Point { agent: member.id, at: *at }).collect()
}

/// The points to be held: the scene's probes, those of one object, or where there are none some points of every agent.
fn held(scene: &Scene, objects: &[Object], wanted: Option<&str>) -> Result<Vec<Point>, BadInput> {
    let own = |agent: AgentId| {
        objects.iter().find(|object| object.agents.contains(&agent)).is_some_and(|object| wanted == Some(&object.name))
    };
    let is_meant = |agent: AgentId| wanted.is_none_or(|name| scene.name_of(agent) == name || own(agent));
    let probes = scene.probes.iter().filter(|probe| is_meant(probe.agent));
    let probes: Vec<_> = probes.map(|probe| Point { agent: probe.agent, at: probe.at }).collect();
    if !probes.is_empty() {
        return Ok(probes);
    }
    let points: Vec<_> = scene.agents.iter().filter(|member| is_meant(member.id)).flat_map(points_of).collect();
    match (points.is_empty(), wanted) {
        (false, _) => Ok(points),
        (true, Some(name)) => {
            let what = format!("`{name}` has no probe and is not a moving object; moving objects: {}", names(objects));
            Err(BadInput(what))
        }
        (true, None) => Err(BadInput(format!("{}: no object has a position to compare", scene.name))),
    }
}
