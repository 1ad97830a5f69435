//! How a deformable is moved as a whole: turned and shifted about its centre of mass, with the velocities of a rigid body.
//!
//! In: where its matter is, where it is to go. Out: a map of points and velocities. Never here: which body may be moved.

use glam::{DQuat, DVec3};
use metachron_contact::{MOTION_MAX, SetMotion, is_within_motion};

/// A rigid motion of a deformable.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WholeMotion {
    centre_m: DVec3,
    to_m: DVec3,
    turn: DQuat,
    /// Velocity of its centre and spin, where they are given.
    velocity_m_s: Option<DVec3>,
    spin_rad_s: Option<DVec3>,
}

impl WholeMotion {
    /// Moves the body whose masses and points these are.
    pub fn new(motion: &SetMotion, masses: impl Iterator<Item = (f64, DVec3)>) -> Self {
        let (mass_kg, moment) = masses.fold((0.0, DVec3::ZERO), |(mass, sum), (m, x)| (mass + m, sum + x * m));
        let centre_m = moment / mass_kg;
        Self {
            centre_m,
            to_m: motion.position_m.unwrap_or(centre_m),
            turn: motion.rotation.map_or(DQuat::IDENTITY, DQuat::normalize),
            velocity_m_s: motion.velocity_m_s,
            spin_rad_s: motion.spin_rad_s,
        }
    }

    /// Whether it moves the body elsewhere.
    pub fn shifts(&self) -> bool {
        self.to_m != self.centre_m || self.turn != DQuat::IDENTITY
    }

    /// Where a point goes.
    pub fn place(&self, x: DVec3) -> DVec3 {
        self.to_m + self.turn * (x - self.centre_m)
    }

    /// How much it turns.
    pub const fn turn(&self) -> DQuat {
        self.turn
    }

    /// The velocity of a part that is at `x` already: that of a rigid body where one is given, else the one that it
    /// had, turned along.
    pub fn velocity(&self, x: DVec3, had: DVec3) -> DVec3 {
        if self.velocity_m_s.is_none() && self.spin_rad_s.is_none() {
            return self.turn * had;
        }
        self.velocity_m_s.unwrap_or_default() + self.spin_rad_s.unwrap_or_default().cross(x - self.to_m)
    }

    /// The spin of a part that had this one.
    pub fn spin(&self, had: DVec3) -> DVec3 {
        let is_given = self.velocity_m_s.is_some() || self.spin_rad_s.is_some();
        if is_given { self.spin_rad_s.unwrap_or_default() } else { self.turn * had }
    }
}

/// A node may be so far from where it is held, metres: rounding.
const HELD_M: f64 = 1e-6;

/// Whether the nodes of another state fit those of a body, `held` where they cannot be moved.
///
/// # Errors
/// The first fault, in words.
pub(crate) fn check_nodes(now: &[DVec3], to: [&[DVec3]; 2], held: impl Fn(usize) -> bool) -> Result<(), String> {
    let [positions, velocities] = to;
    for (what, found) in [("positions", positions.len()), ("velocities", velocities.len())] {
        if found != now.len() {
            return Err(format!("the state has {found} {what}; the body has {} nodes", now.len()));
        }
    }
    if let Some(at) = positions.iter().zip(velocities).position(|(x, v)| ![*x, *v].into_iter().all(is_within_motion)) {
        return Err(format!("node {at} of the state is not finite, or beyond {MOTION_MAX:e} m or m/s"));
    }
    let moved = |at: &usize| held(*at) && positions[*at].distance(now[*at]) > HELD_M;
    match (0..now.len()).find(moved) {
        Some(at) => Err(format!("node {at} is held at {}, and the state has it at {}", now[at], positions[at])),
        None => Ok(()),
    }
}
