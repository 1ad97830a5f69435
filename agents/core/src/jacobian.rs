//! The sparse Jacobian of one contact: which velocities it joins, with which weights (docs/theory/contact.md, eq. 1).

use glam::DVec3;

/// The velocities that a contact joins: u = Σ w v + Σ ω × r, over at most six linear ones and four spins.
///
/// A slot is a place in the array of three-dimensional velocities that the owner of the contact keeps: the velocity of a
/// node, or the spin of a segment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactJacobian {
    linear: [(u32, f64); 6],
    angular: [(u32, DVec3); 4],
    counts: [u8; 2],
}

impl ContactJacobian {
    /// Adds `weight` times the velocity in `slot`.
    ///
    /// # Panics
    /// At the seventh call: a contact joins two bodies, each at one point between two or three nodes.
    pub fn add_linear(&mut self, slot: u32, weight: f64) {
        self.linear[usize::from(self.counts[0])] = (slot, weight);
        self.counts[0] += 1;
    }

    /// Adds the velocity that the spin in `slot` gives at the end of `arm_m`.
    ///
    /// # Panics
    /// At the fifth call: a point belongs to one segment at most.
    pub fn add_angular(&mut self, slot: u32, arm_m: DVec3) {
        self.angular[usize::from(self.counts[1])] = (slot, arm_m);
        self.counts[1] += 1;
    }

    /// The linear velocities it gathers, and their weights.
    pub fn linear(&self) -> &[(u32, f64)] {
        &self.linear[..usize::from(self.counts[0])]
    }

    fn angular(&self) -> &[(u32, DVec3)] {
        &self.angular[..usize::from(self.counts[1])]
    }

    /// The relative velocity J v (eq. 1).
    #[must_use]
    pub fn velocity(&self, velocities: &[DVec3]) -> DVec3 {
        let angular: DVec3 = self.angular().iter().map(|&(slot, arm)| velocities[slot as usize].cross(arm)).sum();
        self.velocity_of_nodes(velocities) + angular
    }

    /// The part of the relative velocity that nodes contribute: spins move a round skin only across its normal.
    pub fn velocity_of_nodes(&self, velocities: &[DVec3]) -> DVec3 {
        self.linear().iter().map(|&(slot, w)| velocities[slot as usize] * w).sum()
    }

    /// The part of the relative velocity that the slots from `first` on contribute.
    pub fn velocity_from(&self, first: usize, velocities: &[DVec3]) -> DVec3 {
        let is_in = |slot: u32| slot as usize >= first;
        let linear =
            self.linear().iter().filter(|(slot, _)| is_in(*slot)).map(|&(slot, w)| velocities[slot as usize] * w);
        let angular = self.angular().iter().filter(|(slot, _)| is_in(*slot));
        linear.sum::<DVec3>() + angular.map(|&(slot, arm)| velocities[slot as usize].cross(arm)).sum::<DVec3>()
    }

    /// The linear velocities that it gathers among the first `own` slots, with their weights.
    pub fn own(&self, own: usize) -> Self {
        let mut slots = Self::default();
        let first = self.linear().iter().filter(|(slot, _)| (*slot as usize) < own);
        first.for_each(|&(slot, weight)| slots.add_linear(slot, weight));
        slots
    }

    /// Marks the slots of a contact with something fixed; contacts of two parts of one body have weights of both signs and mark nothing.
    pub fn mark_fixed(&self, fixed: &mut [bool]) {
        if self.linear().iter().all(|(_, weight)| *weight >= 0.0) {
            self.linear().iter().for_each(|(slot, _)| fixed[*slot as usize] = true);
        }
    }

    /// Whether all of the slots below `fixed.len()` that it gathers from are marked.
    pub fn is_fixed(&self, fixed: &[bool]) -> bool {
        self.linear().iter().all(|(slot, _)| fixed.get(*slot as usize).is_none_or(|fixed| *fixed))
    }

    /// The arm at which it gathers from a spin in `slot` or after it.
    pub fn arm_from(&self, slot: usize) -> Option<DVec3> {
        self.angular().iter().find(|(at, _)| *at as usize >= slot).map(|(_, arm)| *arm)
    }

    /// Adds the impulses and angular impulses Jᵀ λ (eq. 2).
    pub fn scatter(&self, impulse: DVec3, into: &mut [DVec3]) {
        for &(slot, w) in self.linear() {
            into[slot as usize] += impulse * w;
        }
        for &(slot, arm) in self.angular() {
            into[slot as usize] += arm.cross(impulse);
        }
    }

    /// The same, restricted to the slots that `into` holds.
    pub fn scatter_known(&self, impulse: DVec3, into: &mut [DVec3]) {
        for &(slot, w) in self.linear() {
            into.get_mut(slot as usize).into_iter().for_each(|sum| *sum += impulse * w);
        }
        for &(slot, arm) in self.angular() {
            into.get_mut(slot as usize).into_iter().for_each(|sum| *sum += arm.cross(impulse));
        }
    }

    /// A scale for the contact's inverse mass, from the scale of each slot: Σ w² m⁻¹ + Σ r² I⁻¹ (eq. 9).
    #[must_use]
    pub fn mobility(&self, mobilities: &[f64]) -> f64 {
        let linear: f64 = self.linear().iter().map(|&(slot, w)| w * w * mobilities[slot as usize]).sum();
        let angular: f64 =
            self.angular().iter().map(|&(slot, arm)| arm.length_squared() * mobilities[slot as usize]).sum();
        linear + angular
    }
}
