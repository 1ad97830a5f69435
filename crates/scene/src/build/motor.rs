//! Reads the motor of a joint: the keys of its kind, and its goal.
//!
//! In: [`MotorFile`]s. Out: [`Motor`]s, in radians; problems to the [`Checker`]. Never here: the joint's other keys.

use crate::check::{Checker, Place};
use crate::format::MotorFile;
use metachron_models::rigid::{Motor, MotorGoal};

/// The motors of hinges and slides: their keys, and how far either goes.
pub(super) struct MotorKeys {
    /// The name of the kind, with its article.
    pub(super) joint: &'static str,
    position: &'static str,
    velocity: &'static str,
    effort: &'static str,
    stiffness: &'static str,
    damping: &'static str,
    /// The unit of a position in the file, in the units of the joint.
    position_unit: f64,
}

/// Of a hinge.
pub(super) const HINGE: MotorKeys = MotorKeys {
    joint: "a revolute joint",
    position: "position_deg",
    velocity: "velocity_rad_s",
    effort: "max_torque_n_m",
    stiffness: "stiffness_n_m_rad",
    damping: "damping_n_m_s_rad",
    position_unit: std::f64::consts::PI / 180.0,
};

/// Of a slide.
pub(super) const SLIDE: MotorKeys = MotorKeys {
    joint: "a prismatic joint",
    position: "position_m",
    velocity: "velocity_m_s",
    effort: "max_force_n",
    stiffness: "stiffness_n_m",
    damping: "damping_n_s_m",
    position_unit: 1.0,
};

impl MotorKeys {
    /// The motor of a joint whose range is `range`, in the units of the joint.
    pub(super) fn read(
        &self,
        c: &mut Checker<'_, '_>,
        place: &Place,
        file: Option<&MotorFile>,
        range: Option<[f64; 2]>,
    ) -> Option<Motor> {
        let place = &place.table("motor");
        file?;
        let before = c.count();
        self.check_keys(c, place);
        if c.count() > before {
            return None;
        }
        let read = |key: &str| c.found(place, key);
        let (position, velocity) = (read(self.position), read(self.velocity));
        let (stiffness, damping) = (read(self.stiffness), read(self.damping));
        let max_effort = read(self.effort).unwrap_or(f64::INFINITY);
        let position = position.map(|at| at * self.position_unit);
        if let (Some(at), Some([least, greatest])) = (position, range)
            && !(least..=greatest).contains(&at)
        {
            c.wrong(place, self.position, "is outside of the joint's range", "expected a position within it");
        }
        if stiffness.unwrap_or(0.0) == 0.0 && damping == Some(0.0) {
            c.wrong(
                place,
                self.damping,
                "is zero without a stiffness",
                "expected more than zero: such a motor does nothing",
            );
            return None;
        }
        let goal = match (stiffness, damping, velocity) {
            (None, None, Some(velocity)) => MotorGoal::Velocity(velocity),
            _ => MotorGoal::Spring {
                position: position.unwrap_or(0.0),
                velocity: velocity.unwrap_or(0.0),
                stiffness: stiffness.unwrap_or(0.0),
                damping: damping.unwrap_or(0.0),
            },
        };
        Some(Motor { goal, max_effort })
    }

    /// Reports keys that belong to another kind of joint, and missing keys.
    fn check_keys(&self, c: &mut Checker<'_, '_>, place: &Place) {
        let own = [self.position, self.velocity, self.effort, self.stiffness, self.damping];
        let list = own.map(|key| format!("`{key}`")).join(", ");
        let keys = c.keys::<MotorFile>();
        let foreign: Vec<_> = keys.iter().map(String::as_str).filter(|key| !own.contains(key)).collect();
        let what = format_args!("does not belong to the motor of {}", self.joint);
        c.refuse(place, &foreign, what, &format!("the motor of {} has {list}", self.joint));
        let given = c.given(place, &own);
        let has = |key: &str| given.contains(&key);
        let mut missing = |key: &str, why: String| c.wrong(place, key, "is missing", why);
        if !(has(self.position) || has(self.velocity)) {
            missing(self.velocity, format!("expected `{}` or `{}`", self.position, self.velocity));
        }
        if has(self.position) && !has(self.stiffness) {
            missing(self.stiffness, format!("expected it beside `{}`, which a spring drives to", self.position));
        }
        if has(self.stiffness) && !has(self.position) {
            missing(self.position, format!("expected it beside `{}`: where the spring rests", self.stiffness));
        }
        if has(self.position) && has(self.velocity) && !has(self.damping) {
            let why = format!("expected it beside both goals: `{}` is that of the damper", self.velocity);
            missing(self.damping, why);
        }
    }
}
