//! Two sides that meet within a fine step: when, how fast, and whether they rebound.
//!
//! In: a gap and how it closes. Out: a [`Meeting`]. Never here: contacts, bodies, the solve.
//! Theory: docs/theory/clusters.md, eq. 3b and 27a.

/// Sides that would part no faster than this do not rebound, m/s: a body would rise by 0.13 mm.
const IMPACT_M_S: f64 = 0.05;

/// Two sides that close.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// When they meet, seconds from the start of the fine step; before it where they are in each other.
    pub after_s: f64,
    /// How fast they close then, and by how much faster than at the start of the step.
    pub closing_m_s: f64,
    pub gained_m_s: f64,
    /// By how much the speed at which they part changes in a macro step without contact, or would if either were stopped.
    pub lost_m_s: f64,
    /// Newton's coefficient of restitution.
    pub restitution: f64,
}

impl Meeting {
    /// Whether the sides rebound.
    pub fn collides(&self) -> bool {
        let parting_m_s = self.restitution * self.closing_m_s;
        parting_m_s > IMPACT_M_S && self.flies(parting_m_s)
    }

    /// The speed at which the sides must part (eq. 3b): gravity has changed it since the start of the step, at which velocities jump.
    pub fn parting_m_s(&self) -> f64 {
        (self.restitution * self.closing_m_s + self.gained_m_s).max(0.0)
    }

    /// Whether sides that part so fast stay apart for longer than a macro step: what comes back within one would hop at every step.
    pub fn flies(&self, parts_m_s: f64) -> bool {
        parts_m_s > 0.0 && 2.0 * parts_m_s > self.lost_m_s
    }
}

/// When a gap g closes that does so at a speed v, which grows by a: the root t of g = v t + ½ a t² at which it closes, t < 0 for g < 0.
pub fn first_root(gap: f64, speed: f64, gain: f64) -> Option<f64> {
    let inside = speed * speed + 2.0 * gain * gap;
    // the form that loses no digits where the gain is small
    let below = speed + inside.max(0.0).sqrt();
    (inside >= 0.0 && below > 0.0).then(|| 2.0 * gap / below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fall_from_rest_takes_its_time() {
        let t = first_root(1.0, 0.0, 9.81).unwrap();
        assert!((t - (2.0_f64 / 9.81).sqrt()).abs() < 1e-15);
        assert_eq!(first_root(1.0, -1.0, 0.0), None, "it parts");
        assert_eq!(first_root(0.5, 2.0, 0.0), Some(0.25));
        assert_eq!(first_root(-0.5, 2.0, 0.0), Some(-0.25), "it has met");
        assert_eq!(first_root(1.0, 1.0, -1.0), None, "it turns before");
        assert_eq!(first_root(-2e-5, 0.0, 9.81), None, "it lies");
    }
}
