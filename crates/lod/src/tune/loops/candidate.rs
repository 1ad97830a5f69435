//! The candidates for holding a picture at its target time: a feedback law with its gains, or the policy that predicts.
//!
//! In: gains. Out: the controller as used for drawing, set up for a plant, and its linearised loop. Never here: a judgement.
//! Theory: `docs/theory/control.md`, eq. 4, 8, 27 and 30; `docs/theory/budget.md`, eq. 34.

use super::margins::Loop;
use super::plant::Plant;
use super::play::{Start, Trial, play};
use crate::adaptive::{DEFAULT_MARGIN, SIGMA_LEAST, WANDER};
use crate::control::{Law, PictureControl, Policy, Prices, Stages};

/// A controller that can be judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Candidate {
    /// Feedback from the measured time (GDC04), by this law.
    Feedback(Law),
    /// The policy `adaptive`: prices, and a Kalman filter for how much slower the machine is than the prices say.
    Adaptive {
        /// The least fraction of a frame that is left free, 0 … 0.5.
        margin: f64,
    },
}

impl From<Law> for Candidate {
    fn from(law: Law) -> Self {
        Self::Feedback(law)
    }
}

impl Candidate {
    /// The policy with the margin of scenes that do not set one.
    pub const ADAPTIVE: Self = Self::Adaptive { margin: DEFAULT_MARGIN };

    /// Target work as a fraction of the frame's time: T_set/T.
    #[must_use]
    pub fn set_share(self) -> f64 {
        match self {
            Self::Feedback(law) => law.set_share(),
            Self::Adaptive { margin } => 1.0 - margin,
        }
    }

    /// The controller as used for drawing; one that predicts gets the prices of `plant`.
    pub(crate) fn control(self, plant: &Plant, target_hz: f64) -> PictureControl {
        match self {
            Self::Feedback(law) => PictureControl::new(Policy::Feedback, law, target_hz),
            Self::Adaptive { margin } => {
                let mut control = PictureControl::new(Policy::Adaptive, Law::CORRECTED, target_hz);
                let object = Stages { setup: 0.0, polygon: plant.line.slope, vertex: 0.0, pixel: 0.0, serial: 0.0 };
                control.set_prices(Prices {
                    frame_s: plant.line.intercept.max(0.0),
                    pixel_s: 0.0,
                    enlarge_s: 0.0,
                    shading: [object; 4],
                    strokes: [object; 2],
                    areas: None,
                });
                control.set_margin(margin);
                control
            }
        }
    }

    /// The loop near the set point on a machine `speed` times as fast; `None` if the picture cannot take that time.
    #[must_use]
    pub fn local_loop(self, plant: &Plant, target_hz: f64, speed: f64) -> Option<Loop> {
        let set_s = self.set_share() / target_hz;
        if !plant.time_range(speed).contains(set_s) {
            return None;
        }
        let share = plant.share(set_s, speed);
        let (gain, lead) = match self {
            Self::Feedback(Law::Corrected { kappa, lead, .. }) => (kappa * share, lead * share),
            Self::Feedback(Law::Printed { alpha, .. }) => {
                (alpha * share * target_hz / rest_of(self, plant, target_hz, speed), 0.0)
            }
            Self::Adaptive { .. } => (learning(plant, set_s, target_hz, speed), 0.0),
        };
        Some(Loop { gain, lead, dead_time: plant.dead_time })
    }
}

/// The share of an error of γ that the Kalman filter removes in a frame in the steady state (control.md, eq. 30): g² R + g Q = Q, less the
/// error reintroduced by the fixed part of a frame, which is priced for another machine.
fn learning(plant: &Plant, set_s: f64, target_hz: f64, speed: f64) -> f64 {
    let fixed_s = plant.line.intercept.max(0.0);
    let (chosen_s, table_s) = (set_s - fixed_s, speed * set_s - fixed_s);
    if chosen_s <= 0.0 || table_s <= 0.0 {
        return 0.0;
    }
    let sigma = (plant.line.scatter * set_s * target_hz).max(SIGMA_LEAST);
    // errors of the simulated plant do not correlate: the process noise is at its least
    let ratio = WANDER.0 * (table_s * target_hz / sigma) * (table_s * target_hz / sigma);
    let filter = 0.5 * ((ratio * ratio + 4.0 * ratio).sqrt() - ratio);
    filter * (set_s - fixed_s / speed) / chosen_s
}

/// The starting ε̂ of a law that is placed at the target time.
fn rest_of(candidate: Candidate, plant: &Plant, target_hz: f64, speed: f64) -> f64 {
    let trial =
        Trial { speed, start: Start::Target, seconds: 0.5 / target_hz, ..Trial::undisturbed(candidate, target_hz) };
    play(plant, &trial).first().map_or(1.0, |frame| frame.eps_hat)
}
