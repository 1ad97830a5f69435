//! How many steps each member of a cluster makes within a macro step, and how long that is.
//!
//! In: what each member wants. Out: the plan. Never here: steps themselves. Theory: docs/theory/clusters.md, section 9 (eq. 23).

use crate::member::Role;
use std::f64::consts::SQRT_2;

/// The most steps that a member makes within a macro step.
const PARTS_MAX: u32 = 16;

/// How many steps of its own each of some bodies makes within a macro step, and how long that is, seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// The macro step, seconds.
    pub macro_s: f64,
    /// Steps of what bends and wants the longest ones are this long, seconds.
    pub longest_s: f64,
    /// The most steps that a member makes.
    pub parts: u32,
}

impl Plan {
    /// The plan for members with these roles and wanted steps, seconds (eq. 23).
    #[must_use]
    pub fn of(members: impl Iterator<Item = (Role, f64)> + Clone) -> Self {
        let bent = members.clone().filter(|(role, _)| *role == Role::Deformable).map(|(_, wanted_s)| wanted_s);
        let all = members.clone().map(|(_, wanted_s)| wanted_s);
        let longest_s = bent.reduce(f64::max).or_else(|| all.reduce(f64::max)).unwrap_or(1.0);
        let mut plan = Self { macro_s: f64::INFINITY, longest_s, parts: 1 };
        for (_, wanted_s) in members {
            let parts = plan.parts_of(wanted_s);
            plan.parts = plan.parts.max(parts);
            plan.macro_s = plan.macro_s.min(f64::from(parts) * wanted_s);
        }
        plan
    }

    /// How many steps a member that bends makes.
    #[must_use]
    pub fn parts_of(&self, wanted_s: f64) -> u32 {
        let ratio = self.longest_s / wanted_s;
        let mut parts = 1;
        // the nearest power of two, by ratios
        while parts < PARTS_MAX && ratio > f64::from(parts) * SQRT_2 {
            parts *= 2;
        }
        parts
    }

    /// How many steps a member of this role makes.
    #[must_use]
    pub fn parts_in(&self, role: Role, wanted_s: f64) -> u32 {
        if role == Role::Deformable { self.parts_of(wanted_s) } else { self.parts }
    }
}
