//! Choosing beside the display: levels of the next frame while this one is drawn (FS93, GB99), and cameras of scenes with a bounded lag.
//!
//! In: cameras as they are read. Out: predicted cameras, and the next frame's levels. Never here: a policy, drawing.
//! Theory: `docs/theory/control.md`, section 6.

use super::Session;
use metachron_render::{Camera, Size};

/// Finding and choosing that takes less than this part of a frame is not worth a choice that is a frame old.
const WORTH_BESIDE: f64 = 0.01;

/// The weight of a new measurement in the smoothed time of finding and choosing.
const CHOICE_NEWS: f64 = 0.05;

impl Session {
    /// The camera read now, extrapolated to the time when the picture begun now is finished; unchanged if the scene bounds no lag.
    pub fn predict_camera(&mut self, camera: Camera) -> Camera {
        let now = self.now();
        let before = self.last_camera.replace((now, camera));
        let Some((then, before)) = before else { return camera };
        let passed_s = now.saturating_sub(then).as_secs_f64();
        let Some((most_s, _)) = self.scene.target.lag() else {
            self.next_camera = Some(camera.extrapolated(&before, 1.0));
            return camera;
        };
        let lag_s = self.lag_s.min(most_s);
        // assumes that the next frame follows this one after the same interval as this one followed the last
        self.next_camera = Some(camera.extrapolated(&before, (lag_s + passed_s) / passed_s));
        camera.extrapolated(&before, lag_s / passed_s)
    }

    /// Chooses the next frame's levels while this frame, seen by `camera`, is drawn: if the policy predicts costs, and the scene bounds the lag
    /// or choosing is long enough and another core is there. To be called between the start of the drawing and the wait for its end.
    pub fn choose_next_frame(&mut self, camera: &Camera, size: Size) {
        self.chosen.select_next = None;
        if !(self.control.policy().predicts() && (self.scene.target.lag_ms.is_some() || self.is_choice_long())) {
            return;
        }
        let started = self.now();
        let eye = self.next_camera.take().unwrap_or(*camera);
        self.survey(&eye, size);
        self.set_choice_inputs(size);
        self.control.plan_ahead(&self.views);
        let declared = self.declared_cull() + self.declared_choice();
        self.chosen.select_next = Some(self.now().saturating_sub(started) + declared);
    }

    /// Whether a core beside the one that draws saves a noticeable part of the frame by choosing (FS93, §6).
    fn is_choice_long(&self) -> bool {
        self.cores() > 1 && self.choice_s * self.control.target_hz() > WORTH_BESIDE
    }

    /// Learns how long a choice takes, wherever it is made.
    pub(super) fn learn_choice(&mut self) {
        let took_s = (self.chosen.select + self.chosen.select_next.unwrap_or_default()).as_secs_f64();
        let part = if self.finished == 0 { 1.0 } else { CHOICE_NEWS };
        self.choice_s += part * (took_s - self.choice_s);
    }
}
