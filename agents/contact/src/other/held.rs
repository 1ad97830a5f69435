//! Another agent at a point where a spring holds it: how that point is expected to move, and how it is given what the spring gives.
//!
//! In: a point, and the step of whoever holds it. Out: its mean velocity in that step; into how many parts an impulse falls.
//! Never here: the spring. Theory: docs/theory/coupling.md, eq. 9a; soft.md, eq. 16f, 16h.

use super::Other;
use glam::DVec3;
use metachron_core::Anchor;
use metachron_geometry::Place;

impl Other {
    /// A point, and its velocity in the mean of a step of `h` seconds of one who holds it by a spring. A body that bends takes what
    /// such a one gives as a force: in an implicit step of that length it is the velocity at the end that moves it (eq. 9a).
    #[must_use]
    pub fn carried_m_s(&self, anchor: Anchor, h: f64) -> Option<(DVec3, DVec3)> {
        let (point, velocity) = self.point(anchor)?;
        let gain = match self.place(anchor)? {
            Place::Point(_) => self.gain(h)[0],
            Place::Chain { segment, share, .. } => {
                let [a, b] = [segment, segment + 1].map(|node| self.acceleration_of(2 * node as usize));
                a.lerp(b, share) * (h - self.reckoned_s()).max(0.5 * h)
            }
            Place::Surface { vertices, .. } => {
                self.acceleration_of(vertices[0] as usize) * (h - self.reckoned_s()).max(0.5 * h)
            }
        };
        Some((point, velocity + gain))
    }

    /// By how much the mean velocity of each slot of what bends in the next `h` seconds is above the one that is reckoned now, where
    /// `lasts` goes on being given to it evenly, N and N·m in slots, empty for nothing; `None` where all is given at once
    /// (docs/theory/soft.md, eq. 16f, 16h).
    pub fn gains(&mut self, h: f64, lasts: Option<&Vec<DVec3>>, [into, room]: [&mut Vec<DVec3>; 2]) {
        into.clear();
        into.extend((0..self.velocities().len()).map(|slot| self.acceleration_of(slot) * h));
        let parts = f64::from(self.parts(h));
        let response = self.response().filter(|r| parts > 1.0 && r.slots() == into.len() && !self.held);
        let curve = response.and_then(|response| Some((response, response.curve()?)));
        let Some(((response, curve), lasts)) = curve.zip(lasts) else {
            into.iter_mut().for_each(|gain| *gain *= 0.5);
            return self.spring_back(h, lasts, [into, room]);
        };
        // in steps of its own what is free of both only comes so far
        room.clear();
        room.resize(into.len(), DVec3::ZERO);
        room.iter_mut().zip(lasts).for_each(|(free, lasts)| *free = *lasts * h);
        response.respond(room, self.borne);
        room.iter_mut().zip(&*into).for_each(|(free, gain)| *free += *gain);
        curve.momenta(room);
        response.respond(room, self.borne);
        let (late, reckoned) = (0.5 * (parts - 1.0) / parts, self.reckoned_s() / h);
        into.iter_mut().zip(&*room).for_each(|(gain, free)| *gain -= *gain * reckoned + *free * late);
    }

    /// Whether it bends and foretells its next step.
    #[must_use]
    pub fn is_foretold(&self) -> bool {
        self.foretold_s().is_some()
    }

    /// Adds what its elastic forces take back in the next `h` seconds of what `lasts` gives in them, where it is ahead and takes that late
    /// (eq. 16h).
    fn spring_back(&mut self, h: f64, lasts: Option<&Vec<DVec3>>, [into, room]: [&mut Vec<DVec3>; 2]) {
        let Some((step_s, lasts)) = self.foretold_s().zip(lasts).filter(|(_, lasts)| lasts.len() == into.len()) else {
            return;
        };
        let late = (-self.age_s / step_s).clamp(0.0, 1.0);
        let share = (h / step_s - late).clamp(0.0, 1.0);
        if late * share == 0.0 {
            return;
        }
        room.clear();
        room.extend(lasts.iter().map(|lasts| *lasts * step_s));
        self.respond(room);
        room.iter_mut().for_each(|moved| *moved *= late);
        let mut carried = std::mem::take(&mut self.carried);
        carried.clone_from(room);
        self.find_change(room, &mut carried);
        self.carried = carried;
        into.iter_mut().zip(&*room).for_each(|(gain, a)| *gain += *a * (step_s * share));
    }

    /// Lets `h` seconds pass in which what bends moves by its velocities and these `gains`.
    pub fn go_on_by(&mut self, h: f64, gains: &[DVec3]) {
        let mut beyond = std::mem::take(&mut self.answer);
        beyond.clear();
        beyond
            .extend(gains.iter().enumerate().map(|(slot, gain)| (*gain - self.acceleration_of(slot) * (0.5 * h)) * h));
        self.go_on(h);
        self.shift(&beyond);
        self.answer = beyond;
    }

    /// Into how many parts what lasts and is given it in `h` seconds is divided: one a step of its own, a millisecond at least.
    #[must_use]
    pub fn parts(&self, h: f64) -> u32 {
        let step_s = self.neighbour.as_ref().map_or(f64::INFINITY, |n| n.step_s);
        if self.is_many() { (h / step_s.max(1e-3) + 1e-6).floor().max(1.0) as u32 } else { 1 }
    }

    /// By how much the velocities of a tube or soft body are reckoned ahead, seconds of its acceleration.
    pub(super) fn reckoned_s(&self) -> f64 {
        self.response().map_or(0.0, |response| 0.5 * response.span_s())
    }
}
