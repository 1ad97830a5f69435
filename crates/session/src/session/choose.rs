//! Choice of a frame: visible objects, a level for each of them, the picture made of these, and their declared costs.
//!
//! In: a session, a camera. Out: the composed [`Picture`]. Never here: drawing, measuring a frame.

use super::super::assemble;
use super::super::cpu_budget::{FrameLoop, FramePeriod};
use super::super::visible_resolution::Seen;
use super::{Chosen, Session};
use metachron_lod::adaptive::is_late;
use metachron_lod::adaptive::joint::Drawing;
use metachron_lod::control::{Backdrop, ObjectView};
use metachron_render::{Camera, CameraMotion, Hand, Level, Picture, Size, Style};
use metachron_runtime::AgentHandle;
use std::time::Duration;

impl Session {
    /// Reads the newest states, finds the objects seen by `camera`, chooses levels and makes the picture.
    pub fn compose(&mut self, camera: &Camera, size: Size, style: Style, hand: Option<Hand>) -> &Picture {
        let started = self.now();
        self.gather();
        self.scene_view.set_scale(self.control.render_scale());
        self.scene_view.set_shadows(self.control.shadows());
        let before = self.last_seen_by.replace((started, *camera));
        self.scene_view.set_camera_motion(before.and_then(|(then, before)| {
            CameraMotion::between(before, *camera, started.saturating_sub(then).as_secs_f64())
        }));
        self.survey(camera, size);
        let of = Seen { actors: self.scene_view.seen(), levels: &self.levels, states: self.reader.newest() };
        self.visible_resolution.update(started, of, camera, size);
        let culled = self.now();
        self.chosen.cull = culled.saturating_sub(started) + self.declared_cull();
        self.choose(started, size);
        let chosen = self.now();
        let picture = self.scene_view.compose(camera, &self.levels, style, hand);
        self.chosen.triangles = picture.triangles();
        self.chosen.other_triangles = (self.chosen.triangles as f64 - self.control.last_plan().polygons).max(0.0);
        self.chosen.select += chosen.saturating_sub(culled);
        self.chosen.build = self.world.now().saturating_sub(chosen);
        self.scene_view.picture()
    }

    /// Makes the picture of the last frame's levels as `camera` sees it, without objects that that frame did not see.
    pub fn compose_levels(&mut self, camera: &Camera, size: Size, style: Style) -> &Picture {
        let seen = |(view, level): (&ObjectView, &Level)| {
            let triangles = if view.visible { level.triangles } else { 0 };
            Level { triangles, ..*level }
        };
        let levels: Vec<Level> = self.views.iter().zip(&self.levels).map(seen).collect();
        self.scene_view.survey(camera, size);
        self.scene_view.compose(camera, &levels, style, None)
    }

    /// Makes the picture of the last frame's levels once more, after another camera had a look at them.
    pub fn compose_again(&mut self, camera: &Camera, size: Size) {
        self.survey(camera, size);
        self.scene_view.compose(camera, &self.levels, Style::default(), None);
    }

    /// Lets the declared cost of the composed frame pass, in virtual time; real time has passed by itself. Returns the part of it from the
    /// start of the drawing to its end.
    pub fn spend_declared(&mut self, size: Size) -> Duration {
        let Chosen { cull, select, select_next, objects_s, other_triangles, .. } = self.chosen;
        let backdrop = self.backdrop(size, other_triangles);
        let seconds = self.declared.with_shadows(self.control.shadows()).backdrop_s(backdrop) + objects_s;
        let draw = self.machine.frame_time(seconds, self.frames(), self.now());
        let (started, next) = (self.now(), select_next.unwrap_or_default());
        if self.shares_processor {
            self.world.spend(cull + select + draw.max(next));
            return self.now().saturating_sub(started + cull + select);
        }
        self.world.spend(cull + select);
        let begun = self.now();
        self.world.spend(next);
        self.world.wait_until(begun + draw);
        self.now().saturating_sub(begun)
    }

    /// Finds the objects seen by `camera`, with the pixels that they are drawn with.
    pub fn survey(&mut self, camera: &Camera, size: Size) {
        self.scene_view.survey(camera, size.scaled(self.control.render_scale()));
        let of = assemble::Actors { scene: &self.scene, fixed_parts: &self.fixed_parts };
        assemble::update_views(&mut self.views, self.scene_view.seen(), self.scene_view.updated(), of);
    }

    /// Sets the levels of this frame: levels chosen while the previous frame was drawn, else chosen now.
    fn choose(&mut self, started: Duration, size: Size) {
        self.chosen.select = Duration::ZERO;
        if !self.control.take_up(&self.views) {
            self.set_choice_inputs(size);
            self.control.plan(&self.views);
            self.chosen.select = self.declared_choice();
        }
        if self.control.policy().predicts() && self.is_late(started) {
            self.control.hurry();
        }
        let plan = self.control.last_plan();
        self.levels.clear();
        self.levels.extend(self.views.iter().zip(&plan.levels).map(|(view, demand)| assemble::level(view, demand)));
        let counts = self.scene_view.visible_counts();
        (self.chosen.objects, self.chosen.potentially_visible) = (counts.visible, counts.potentially_visible);
        let is_drawn = |(view, level): &(&ObjectView, &Level)| view.visible && level.triangles > 0 && !view.is_group();
        self.chosen.drawn = self.views.iter().zip(&self.levels).filter(is_drawn).count() as u64;
        self.chosen.more_triangles = (plan.full_polygons - plan.polygons).max(0.0);
        let declared = self.declared.with_shadows(self.control.shadows());
        self.chosen.objects_s = declared.objects_s(self.views.iter(), &plan.levels);
        self.chosen.n = self.mean_level();
    }

    /// Whether most of the time of the frame that began at `started` is gone; while time is paused no frame is late.
    fn is_late(&self, started: Duration) -> bool {
        let gone = self.now().saturating_sub(started) + self.declared_cull() + self.chosen.select;
        self.passes() && is_late(gone.as_secs_f64(), 1.0 / self.control.target_hz())
    }

    /// Sets the controller's inputs for the next choice.
    pub fn set_choice_inputs(&mut self, size: Size) {
        // the triangles outside the choice hardly change from one frame to the next
        self.control.set_backdrop(self.backdrop(size, self.chosen.other_triangles));
        self.share_processor();
        self.control.set_cull(self.chosen.cull);
    }

    /// The part of a picture shown with `size` that is independent of the choice.
    fn backdrop(&self, size: Size, triangles: f64) -> Backdrop {
        let drawn = size.scaled(self.control.render_scale());
        Backdrop { pixels: drawn.pixels(), enlarged: if drawn == size { 0.0 } else { size.pixels() }, triangles }
    }

    /// Logic done elsewhere while a frame was drawn in `draw`: the next choice, and the time of agents' steps on each
    /// core. In virtual time agents do not slow the drawing.
    pub fn logic_beside(&mut self, draw: Duration) -> Duration {
        let next = self.chosen.select_next.unwrap_or_default();
        if self.is_virtual() {
            return next;
        }
        let cpu_s = self.world.agents().iter().map(AgentHandle::cpu_s).sum::<f64>();
        let now = self.now();
        let (then, before_s) = std::mem::replace(&mut self.agents_cpu, (now, cpu_s));
        let all_s = now.saturating_sub(then).as_secs_f64() * f64::from(self.cores());
        let share = if all_s > 0.0 { ((cpu_s - before_s) / all_s).clamp(0.0, 1.0) } else { 0.0 };
        next + draw.mul_f64(share)
    }

    /// Declared time of finding visible objects; zero in real time, where it is measured.
    pub fn declared_cull(&self) -> Duration {
        self.declared_work(self.machine.choice_ns.0, self.views.len())
    }

    /// Declared time of choosing; zero in real time.
    pub fn declared_choice(&self) -> Duration {
        self.declared_work(self.machine.choice_ns.1, self.views.iter().filter(|view| view.visible).count())
    }

    fn declared_work(&self, each_ns: f64, count: usize) -> Duration {
        let seconds = if self.is_virtual() { 1e-9 * each_ns * count as f64 } else { 0.0 };
        Duration::try_from_secs_f64(seconds).unwrap_or_default()
    }

    /// Shares the processor among agents, and with the picture if it draws that too.
    fn share_processor(&mut self) {
        let Some((wants, lambda)) = self.control.wants() else {
            self.cpu_budget.close();
            return self.control.set_reserve(0.0);
        };
        let period_s = 1.0 / self.control.target_hz();
        let frame_loop = match self.shares_processor {
            true => FrameLoop::Draws(Drawing { wants, lambda }),
            false => FrameLoop::Takes(self.frame_cpu_s),
        };
        let (cores, control) = (self.cores(), &self.control);
        let limit_s =
            self.cpu_budget.settle(FramePeriod { cores, period_s }, frame_loop, &self.views, |at| control.weight(at));
        let reserve_s = limit_s.map_or(0.0, |limit_s| (period_s - limit_s).max(0.0));
        self.control.set_reserve(reserve_s);
    }
}
