//! Two sides that close: when they meet, how fast, whether they rebound, and how much of an impact makes no energy.
//!
//! In: gaps and how they close; work. Out: a [`Meeting`], a share. Never here: contacts, bodies, the solve.
//! Theory: docs/theory/clusters.md, eq. 12a, 27 and 27a.

/// Sides that would part no faster than this do not rebound, m/s: a body would rise by 0.13 mm.
const IMPACT_M_S: f64 = 0.05;

/// A gap at the start of a fine step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closing {
    pub gap_m: f64,
    /// How fast it closes, and by how much that grows; a side that others held in the last step gains nothing.
    pub speed_m_s: f64,
    pub gain_m_s2: f64,
    /// The most by which it would if nothing held either side, or if one of them were stopped.
    pub fall_m_s2: f64,
}

/// Two sides that meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// When, seconds from the start of the fine step: in a later one from its length on, before it for sides that are in each other.
    pub after_s: f64,
    /// How fast they close then, at the latest at the end of the step, and part after, m/s.
    pub closing_m_s: f64,
    pub parting_m_s: f64,
    /// How much faster they close then than at the start of the step, and part at its end than after the impact, m/s.
    pub gained_m_s: f64,
    pub gains_m_s: f64,
    /// Whether they rebound (eq. 27a).
    pub rebounds: bool,
}

impl Closing {
    /// How the sides meet; `None` where they do not. With Newton's coefficient of restitution, 0 to 1, and the lengths of the macro step and
    /// the fine step, seconds.
    pub fn meeting(&self, restitution: f64, [macro_s, step_s]: [f64; 2]) -> Option<Meeting> {
        let Self { gap_m, speed_m_s, gain_m_s2, fall_m_s2 } = *self;
        let after_s = first_root(gap_m, speed_m_s, gain_m_s2)?.max(-step_s);
        // others may drive the sides together in this step alone: a meeting after it has no more of that gain
        let within_s = after_s.min(step_s);
        let (gained_m_s, gains_m_s) = (gain_m_s2 * within_s, -gain_m_s2 * (step_s - within_s));
        let closing_m_s = speed_m_s + gained_m_s;
        let parting_m_s = restitution * closing_m_s;
        // sides that come back within a macro step would hop at every step
        let rebounds = parting_m_s > IMPACT_M_S && 2.0 * parting_m_s > fall_m_s2 * macro_s;
        Some(Meeting { after_s, closing_m_s, parting_m_s, gained_m_s, gains_m_s, rebounds })
    }
}

impl Meeting {
    /// The speed at which they part at the end of the step, where they fly after the impact, m/s.
    pub fn parts_at_end_m_s(&self) -> f64 {
        self.parting_m_s + self.gains_m_s
    }
}

/// The work of the forces between bodies that touch, J: that of the solution of a step, and its first and second
/// derivative by the share of the impacts that acts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Work {
    pub solved_j: f64,
    pub slope_j: f64,
    pub curve_j: f64,
}

impl Work {
    /// The greatest share of the impacts by which the work is not above zero (eq. 12a).
    pub fn share(&self) -> f64 {
        let Self { solved_j, slope_j, curve_j } = *self;
        // push-out makes some, which is not for impacts to give back
        let solved_j = solved_j.min(0.0);
        if solved_j + slope_j + 0.5 * curve_j <= 0.0 {
            return 1.0;
        }
        // the form that loses no digits where the curve is small
        let below_j = slope_j + (slope_j * slope_j - 2.0 * solved_j * curve_j).max(0.0).sqrt();
        if below_j > 0.0 { (-2.0 * solved_j / below_j).clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// When a gap g closes that does so at a speed v, which grows by a: the root t of g = v t + ½ a t² at which it closes, t < 0 for g < 0.
fn first_root(gap: f64, speed: f64, gain: f64) -> Option<f64> {
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

    #[test]
    fn sides_rebound_that_then_fly_for_longer_than_a_macro_step() {
        let rebounds = |speed_m_s: f64, fall_m_s2: f64| {
            let closing = Closing { gap_m: 0.0, speed_m_s, gain_m_s2: 0.0, fall_m_s2 };
            closing.meeting(0.5, [0.01, 0.01]).is_some_and(|meeting| meeting.rebounds)
        };
        assert!(rebounds(0.11, 9.81) && !rebounds(0.09, 9.81), "5 cm/s");
        assert!(
            rebounds(0.6, 50.0) && !rebounds(0.4, 50.0),
            "0.5 m/s change in 10 ms, 0.3 and 0.2 m/s are twice passed"
        );
    }

    #[test]
    fn impacts_are_shortened_to_where_they_make_no_work() {
        let work = |solved_j: f64, slope_j: f64, curve_j: f64| Work { solved_j, slope_j, curve_j };
        assert_eq!(work(-1.0, 0.25, 1.0).share(), 1.0);
        let share = work(-1.0, 1.0, 1.0).share();
        assert!((-1.0 + share + 0.5 * share * share).abs() < 1e-15, "{share}");
        assert_eq!(work(0.5, 1.0, 1.0).share(), 0.0, "nothing was lost that it could give back");
    }
}
