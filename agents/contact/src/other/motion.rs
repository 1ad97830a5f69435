//! How another agent moves as its neighbour expects it: freely, on what it stands on, on its springs, or bending as it told.
//!
//! Theory: docs/theory/coupling.md, eq. 6a and 7d.

use super::{Other, Pose};
use glam::{DQuat, DVec3};
use metachron_core::Inertia;
use metachron_core::sprung::SprungPrediction;
use metachron_core::{InverseMass, Sprung, Twist};

impl Other {
    /// Its smooth acceleration and the mean of what others give it, m/s²: none where impulses do not move it.
    #[must_use]
    pub fn acceleration(&self) -> DVec3 {
        let carried = if self.lean.is_none() { self.carried_by_others() } else { DVec3::ZERO };
        self.smooth() + self.held_still(carried)
    }

    /// Its smooth acceleration, m/s²: none where impulses do not move it.
    fn smooth(&self) -> DVec3 {
        match (&self.neighbour, &self.lean) {
            (Some(_), Some(lean)) => lean.acceleration(0.0)[0],
            (Some(neighbour), None) if !self.held => {
                self.held_still(neighbour.snapshot.acceleration + self.landing.unwrap_or_default())
            }
            _ => DVec3::ZERO,
        }
    }

    /// How it turns ever faster, rad/s²: of what tips.
    #[must_use]
    pub fn turning(&self) -> DVec3 {
        self.tips().map_or(DVec3::ZERO, |tips| tips.turning)
    }

    /// The same of a slot of what bends, m/s² or rad/s²: a tube tells how each of its nodes and segments accelerates, a soft body of
    /// its vertices.
    #[must_use]
    pub fn acceleration_of(&self, slot: usize) -> DVec3 {
        let slots = self.velocities.len();
        let changed = || self.taken_back.get(slot).copied().unwrap_or_default();
        match self.response() {
            Some(response) if !self.held && response.accelerations(false).len() == slots => {
                response.accelerations(self.borne)[slot] + changed()
            }
            _ if slot.is_multiple_of(self.stride()) => self.acceleration(),
            _ => DVec3::ZERO,
        }
    }

    /// What the next `h` seconds add to the velocities of its first two slots, for who gives an impulse at their start: half of
    /// it where it falls freely, all of it where springs hold it and the impulse lasts (docs/theory/coupling.md, eq. 7d).
    #[must_use]
    pub fn gain(&self, h: f64) -> Twist {
        match &self.lean {
            Some(lean) => lean.acceleration(h).map(|a| a * h),
            None => {
                let falling = self.fall(h).map_or(DVec3::ZERO, |fall| fall.normal * (fall.way_m / h - fall.speed_m_s));
                let [blows, turns] = self.gain_by_others(h);
                [self.smooth() * (0.5 * h) + falling + blows, self.turning() * (0.5 * h) + turns]
            }
        }
    }

    /// Impulses will last for `h` seconds: what springs hold answers by that.
    pub fn foresee(&mut self, h: f64) {
        if let Some(lean) = &mut self.lean {
            lean.foresee(h);
        }
    }

    /// A blow, which takes no time, begins or ends: a drive of limited force gives nothing in it.
    pub fn strike(&mut self, struck: bool) {
        if let Some(lean) = &mut self.lean {
            lean.strike(struck);
        }
    }

    /// The mean inverse mass (1/kg) and inverse inertia of a body on springs.
    #[must_use]
    pub fn mobility(&self) -> Option<[f64; 2]> {
        self.lean.as_ref().map(SprungPrediction::mobility)
    }

    pub(super) fn lean_of(&self, sprung: Option<Sprung>, velocity: Twist) -> Option<SprungPrediction> {
        match (sprung.filter(|_| !self.held), &self.neighbour.as_ref()?.snapshot.inertia) {
            (Some(sprung), Inertia::Rigid { inverse_mass, inverse_inertia }) => {
                let inertia = InverseMass { linear_per_kg: *inverse_mass, angular_per_kg_m2: *inverse_inertia };
                Some(SprungPrediction::new(sprung, inertia, velocity))
            }
            _ => None,
        }
    }

    /// Makes the published velocities of a tube or soft body, which are means over its last substep, those at its end (eq. 6a).
    pub(super) fn reckon(&mut self) {
        let half_s = self.reckoned_s();
        if half_s == 0.0 {
            return;
        }
        for slot in 0..self.velocities.len() {
            let gained = self.acceleration_of(slot) * half_s;
            self.velocities[slot] += gained;
        }
    }

    /// Brings it to the time of who looks, `age_s` after its own. What bends accelerates as it told for about a step, and backwards no
    /// farther: back by more of them its nodes would fly apart. Forwards its points go on from there as the whole of it does
    /// (docs/theory/coupling.md, eq. 6d).
    pub(super) fn catch_up(&mut self) {
        if !self.is_many() {
            self.go_on(self.age_s);
            return;
        }
        let told_s = 2.0 * self.reckoned_s();
        let rest_s = (self.age_s - told_s).max(0.0);
        self.go_on(self.age_s.clamp(-told_s, told_s));
        if rest_s > 0.0 {
            let (a, stride) = (self.acceleration(), self.stride());
            for (x, v) in self.positions.iter_mut().zip(self.velocities.iter_mut().step_by(stride)) {
                *x += *v * rest_s + a * (0.5 * rest_s * rest_s);
                *v += a * rest_s;
            }
            let spins = self.velocities.iter().skip(1).step_by(2);
            self.frames.iter_mut().zip(spins).for_each(|(q, spin)| *q = turned(*q, *spin * rest_s));
        }
    }

    /// Lets `h` seconds pass: x + v h + a h²/2, v + a h.
    pub fn go_on(&mut self, h: f64) {
        if let Some(lean) = &mut self.lean {
            let way = lean.go_on(h);
            self.velocities.copy_from_slice(&lean.velocity());
            self.shift(&way);
            return;
        }
        if self.positions.is_empty() {
            let (a, turning) = (self.smooth(), self.turning());
            let fall = self.fall(h);
            let Pose { centre, rotation } = &mut self.pose;
            *centre += self.velocities[0] * h + a * (0.5 * h * h);
            *rotation = turned(*rotation, self.velocities[1] * h + turning * (0.5 * h * h));
            self.velocities[0] += a * h;
            self.velocities[1] += turning * h;
            if let Some(fall) = fall {
                self.settle(&fall, h);
            }
            self.receive(h);
            return;
        }
        let stride = self.stride();
        for slot in 0..self.velocities.len() {
            let a = self.acceleration_of(slot);
            let v = &mut self.velocities[slot];
            let way = *v * h + a * (0.5 * h * h);
            *v += a * h;
            if slot.is_multiple_of(stride) {
                self.positions[slot / stride] += way;
            } else if let Some(frame) = self.frames.get_mut(slot / stride) {
                *frame = turned(*frame, way);
            }
        }
    }

    /// Moves by what each slot is carried.
    pub(super) fn shift(&mut self, by: &[DVec3]) {
        if self.positions.is_empty() {
            self.pose.centre += by[0];
            self.pose.rotation = turned(self.pose.rotation, by[1]);
        } else {
            let stride = self.stride();
            self.positions.iter_mut().zip(by.iter().step_by(stride)).for_each(|(x, dx)| *x += *dx);
            self.frames.iter_mut().zip(by.iter().skip(1).step_by(2)).for_each(|(q, by)| *q = turned(*q, *by));
        }
    }
}

/// A rotation turned on by a small or large rotation vector in world axes.
pub(crate) fn turned(rotation: DQuat, by: DVec3) -> DQuat {
    if by == DVec3::ZERO { rotation } else { (DQuat::from_scaled_axis(by) * rotation).normalize() }
}
