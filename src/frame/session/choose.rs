//! A frame's choice: what is seen, a level for each of it, the picture made of these, and what they cost where costs are declared.
//!
//! In: a session, a camera. Out: the composed [`Picture`]. Never here: drawing, what a frame took.

use super::super::cast;
use super::Session;
use crate::compositor::{Camera, Hand, Picture, Size, Style};
use crate::control::{Backdrop, LevelDemand, ObjectView};
use metachron_budget::adaptive::joint::Drawing;

impl Session {
    /// Takes the newest states, finds what `camera` sees of them, chooses levels and makes the picture.
    pub fn compose(&mut self, camera: &Camera, size: Size, style: Style, hand: Option<Hand>) -> &Picture {
        let started = self.now();
        self.gather();
        self.stage.survey(camera, size);
        self.sight.look(started, self.stage.seen(), camera, size);
        let culled = self.now();
        self.chosen.cull = culled.saturating_sub(started);
        self.choose(size);
        let chosen = self.now();
        let picture = self.stage.compose(camera, &self.levels, style, hand);
        self.chosen.triangles = picture.triangles();
        self.chosen.other_triangles = (self.chosen.triangles as f64 - self.control.last_plan().polygons).max(0.0);
        self.chosen.select = chosen.saturating_sub(culled);
        self.chosen.build = self.run.now().saturating_sub(chosen);
        self.stage.picture()
    }

    /// Lets the declared cost of the composed frame pass, in virtual time; real time has passed by itself.
    pub fn spend_declared(&mut self, size: Size) {
        let backdrop = Backdrop { pixels: size.pixels(), triangles: self.chosen.other_triangles };
        let prices = &self.declared;
        let of = |(view, level): (&ObjectView, &LevelDemand)| {
            let drawn = view.visible && level.polygons > 0.0;
            if drawn { prices.object_s(level.shading, level.polygons, view.pixels) } else { 0.0 }
        };
        let objects_s: f64 = self.views.iter().zip(&self.control.last_plan().levels).map(of).sum();
        let cost = self.machine.frame_time(prices.backdrop_s(backdrop) + objects_s, self.frames(), self.now());
        self.run.spend(cost);
    }

    fn choose(&mut self, size: Size) {
        cast::renew(&mut self.views, self.stage.seen(), self.stage.looked(), &self.scene);
        // what is in the picture besides hardly changes from one frame to the next
        self.control.set_backdrop(Backdrop { pixels: size.pixels(), triangles: self.chosen.other_triangles });
        self.buy();
        self.control.set_cull(self.chosen.cull);
        let plan = self.control.plan(&self.views);
        self.levels.clear();
        self.levels.extend(self.views.iter().zip(&plan.levels).map(cast::level));
        self.chosen.objects = self.stage.seen().iter().filter(|s| s.visible).count() as u64;
        self.chosen.more_triangles = (plan.full_polygons - plan.polygons).max(0.0);
    }

    /// Shares the processor out between agents and the picture, where it draws as well.
    fn buy(&mut self) {
        let wants = self.control.wants().filter(|_| self.shares_processor);
        let Some((wants, lambda)) = wants else {
            self.purse.close();
            return self.control.set_reserve(0.0);
        };
        let period_s = 1.0 / self.control.target_hz();
        let drawing = Drawing { wants, lambda };
        let (cores, control) = (self.cores(), &self.control);
        let limit_s = self.purse.settle((cores, period_s), drawing, &self.views, |at| control.weight(at));
        let reserve_s = limit_s.map_or(0.0, |limit_s| (period_s - limit_s).max(0.0));
        self.control.set_reserve(reserve_s);
    }
}
