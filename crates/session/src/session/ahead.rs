//! Prediction for scenes with a bounded lag: extrapolates cameras, chooses levels while the previous frame is drawn (GB99).
//!
//! In: cameras as they are read. Out: predicted cameras, and the next frame's levels. Never here: a policy, drawing.
//! Theory: `docs/theory/control.md`, section 6.

use super::Session;
use metachron_render::{Camera, Size};

impl Session {
    /// The camera read now, extrapolated to the time when the picture begun now is finished; unchanged if the scene bounds no lag.
    pub fn predict_camera(&mut self, camera: Camera) -> Camera {
        let now = self.now();
        let before = self.last_camera.replace((now, camera));
        let (Some((most_s, _)), Some((then, before))) = (self.scene.target.lag(), before) else { return camera };
        let (passed_s, lag_s) = (now.saturating_sub(then).as_secs_f64(), self.lag_s.min(most_s));
        // assumes that the next frame follows this one after the same interval as this one followed the last
        self.next_camera = Some(camera.extrapolated(&before, (lag_s + passed_s) / passed_s));
        camera.extrapolated(&before, lag_s / passed_s)
    }

    /// Chooses the next frame's levels while this frame, seen by `camera`, is drawn: if the scene bounds the lag and the policy predicts
    /// costs. To be called between the start of the drawing and the wait for its end.
    pub fn choose_next_frame(&mut self, camera: &Camera, size: Size) {
        self.chosen.select_next = None;
        if self.scene.target.lag_ms.is_none() || !self.control.policy().predicts() {
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
}
