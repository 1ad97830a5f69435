//! Stability margins of a loop, by the roots of its characteristic polynomial.
//!
//! In: the share of an error removed by one frame, and the delay in frames. Out: margins. Never here: a law, a scene.
//! Theory: `docs/theory/control.md`, eq. 27 and 28.

/// A loop near its set point, ln ε against ln t: one integrator, a proportional part, a delay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loop {
    /// Share of an error that one frame removes: κ s, or α s f/ε̂ of the printed law.
    pub gain: f64,
    /// Share of an error's change that one frame adds to that.
    pub lead: f64,
    /// Frames until a change shows.
    pub dead_time: usize,
}

/// The largest factor, and the most frames, that a margin is reported up to.
const MARGIN_MAX: f64 = 1000.0;
const DELAY_MAX: usize = 12;

impl Loop {
    /// The largest root of zᵈ⁺² − zᵈ⁺¹ + (g + l) z − l (eq. 27): the asymptotic factor by which an error shrinks each frame.
    #[must_use]
    pub fn radius(self) -> f64 {
        let degree = self.dead_time + 2;
        let mut coefficients = vec![0.0; degree + 1];
        coefficients[degree] = 1.0;
        coefficients[degree - 1] -= 1.0;
        coefficients[1] += self.gain + self.lead;
        coefficients[0] -= self.lead;
        largest_root(&coefficients)
    }

    /// Whether errors decay.
    #[must_use]
    pub fn is_stable(self) -> bool {
        self.gain > 0.0 && self.radius() < 1.0
    }

    /// The factor on the gains at which the loop becomes unstable; below 1 it already is, at most 1000.
    #[must_use]
    pub fn gain_margin(self) -> f64 {
        let stable = |factor: f64| Self { gain: self.gain * factor, lead: self.lead * factor, ..self }.radius() < 1.0;
        if self.gain <= 0.0 {
            return 0.0;
        }
        let (mut low, mut high) = (1.0 / MARGIN_MAX, MARGIN_MAX);
        if stable(high) {
            return high;
        }
        for _ in 0..60 {
            let middle = (low * high).sqrt();
            if stable(middle) { low = middle } else { high = middle }
        }
        low
    }

    /// The number of additional frames of delay at which the loop is still stable; at most 12.
    #[must_use]
    pub fn delay_margin(self) -> usize {
        let later = |frames: usize| Self { dead_time: self.dead_time + frames, ..self };
        (1..=DELAY_MAX).take_while(|&frames| later(frames).is_stable()).last().unwrap_or(0)
    }
}

/// The largest modulus of the roots, by Durand and Kerner's simultaneous iteration.
fn largest_root(coefficients: &[f64]) -> f64 {
    let degree = coefficients.len() - 1;
    let multiply = |a: (f64, f64), b: (f64, f64)| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    let divide = |a: (f64, f64), b: (f64, f64)| {
        let square = b.0 * b.0 + b.1 * b.1;
        ((a.0 * b.0 + a.1 * b.1) / square, (a.1 * b.0 - a.0 * b.1) / square)
    };
    let value = |z: (f64, f64)| {
        coefficients.iter().rev().fold((0.0, 0.0), |sum, c| {
            let next = multiply(sum, z);
            (next.0 + c, next.1)
        })
    };
    // starts on a circle, at angles without a symmetry of the polynomial
    let angle = |k: usize| 0.4 + std::f64::consts::TAU * k as f64 / degree as f64;
    let mut roots: Vec<_> = (0..degree).map(|k| (0.9 * libm::cos(angle(k)), 0.9 * libm::sin(angle(k)))).collect();
    for _ in 0..200 {
        for at in 0..degree {
            let mut others = (1.0, 0.0);
            for (_, root) in roots.iter().enumerate().filter(|(k, _)| *k != at) {
                others = multiply(others, (roots[at].0 - root.0, roots[at].1 - root.1));
            }
            let step = divide(value(roots[at]), others);
            if step.0.is_finite() && step.1.is_finite() {
                roots[at] = (roots[at].0 - step.0, roots[at].1 - step.1);
            }
        }
    }
    roots.iter().map(|z| (z.0 * z.0 + z.1 * z.1).sqrt()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn integrator(gain: f64, dead_time: usize) -> Loop {
        Loop { gain, lead: 0.0, dead_time }
    }

    #[test]
    fn without_delay_an_error_shrinks_by_one_minus_the_gain() {
        for gain in [0.1, 0.5, 1.5, 1.9] {
            assert!((integrator(gain, 0).radius() - (1.0_f64 - gain).abs()).abs() < 1e-9, "{gain}");
        }
        assert!((integrator(0.5, 0).gain_margin() - 4.0).abs() < 1e-6);
    }

    #[test]
    fn a_delayed_integrator_oscillates_beyond_its_critical_gain() {
        // zᵈ⁺¹ − zᵈ + g has a root on the unit circle at g = 2 sin(π/(2(2d+1))) (control.md, eq. 28)
        for dead_time in 0..5 {
            let boundary = 2.0 * libm::sin(std::f64::consts::PI / (2.0 * (2.0 * dead_time as f64 + 1.0)));
            let margin = integrator(0.1, dead_time).gain_margin() * 0.1;
            assert!((margin / boundary - 1.0).abs() < 1e-3, "{dead_time}: {margin} and {boundary}");
        }
        assert_eq!(integrator(0.5, 0).delay_margin(), 2, "0.618 > ½ > 0.445");
        assert_eq!(integrator(0.7, 0).delay_margin(), 1);
    }

    #[test]
    fn the_radius_is_the_decay_of_the_simulated_loop() {
        for (gain, lead, dead_time) in [(0.3, 0.2, 0), (0.5, 0.0, 1), (0.2, 0.1, 2), (0.9, 0.3, 1)] {
            let loops = Loop { gain, lead, dead_time };
            let mut x = vec![1.0; dead_time + 2];
            let (mut early, mut last) = (0.0_f64, 0.0_f64);
            for k in 0..400 {
                let at = x.len() - 1;
                let next = x[at] - (gain + lead) * x[at - dead_time] + lead * x[at - dead_time - 1];
                x.push(next);
                let size = x.iter().rev().take(30).fold(0.0_f64, |m, v| m.max(v.abs()));
                if k == 199 {
                    early = size
                }
                last = size;
            }
            let measured = (last / early).powf(1.0 / 200.0);
            assert!((measured - loops.radius()).abs() < 0.01, "{loops:?}: {measured} and {}", loops.radius());
        }
    }
}
