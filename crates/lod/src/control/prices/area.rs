//! Cost of a triangle by the area that it covers (RH05, §4.1): no model is assumed, times between the measured areas are interpolated.
//!
//! In: measured objects. Out: seconds of an object. Never here: a measurement, a shading. Theory: `docs/theory/budget.md`, eq. 44.

use crate::cost::curve::{Curve, between};

/// The areas at which a triangle is priced, pixels: geometric steps, because they span four decades.
pub const AREAS_PX: [f64; 7] = [1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 4096.0];

/// Prices of objects of one shading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Areas {
    /// Fixed cost of an object, seconds, ≥ 0.
    pub setup: f64,
    /// Cost of a triangle that covers as many pixels as [`AREAS_PX`] says, seconds, ≥ 0 and never falling.
    pub polygon: [f64; AREAS_PX.len()],
}

/// A measured object is used for the step that its mean area is this near to, as a factor.
const NEAR: f64 = 1.25;

impl Areas {
    /// Whether all prices are finite and not negative.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        [self.setup].iter().chain(&self.polygon).all(|price| price.is_finite() && *price >= 0.0)
    }

    /// Seconds of an object of `polygons` triangles that cover `pixels` together: setup + n · price(A/n).
    #[must_use]
    pub fn time(&self, polygons: f64, pixels: f64) -> f64 {
        let points: [(f64, f64); AREAS_PX.len()] = std::array::from_fn(|k| (AREAS_PX[k], self.polygon[k]));
        let price = if polygons > 0.0 { between(&points, pixels / polygons) } else { 0.0 };
        self.setup + polygons * price
    }

    /// The same prices where every triangle is drawn once and not, for a shadow map that covers next to nothing, once more.
    #[must_use]
    pub fn drawn_once(self) -> Self {
        let once = 0.5 * self.polygon[0];
        Self { polygon: self.polygon.map(|price| price - once), ..self }
    }

    /// Prices from measured objects (triangles, pixels, seconds); `None` if the least or the greatest area is missing, or if no area was
    /// measured with two numbers of triangles, which determine the setup.
    #[must_use]
    pub fn fitted(objects: &[(f64, f64, f64)]) -> Option<Self> {
        let step = |&(n, pixels, _): &(f64, f64, f64)| {
            AREAS_PX.iter().position(|area| (pixels / n / area).max(area * n / pixels) <= NEAR)
        };
        let steps: Vec<_> = objects.iter().filter_map(|object| Some((step(object)?, *object))).collect();
        let there = |wanted: usize| steps.iter().any(|(at, _)| *at == wanted);
        let setup = setup(&steps)?.max(0.0);
        let price =
            |&(at, (n, _, seconds)): &(usize, (f64, f64, f64))| (AREAS_PX[at], ((seconds - setup) / n).max(0.0));
        let curve = Curve::through(&steps.iter().map(price).collect::<Vec<_>>())?;
        (there(0) && there(AREAS_PX.len() - 1)).then(|| Self { setup, polygon: AREAS_PX.map(|area| curve.at(area)) })
    }
}

/// Time of an object without triangles: the median over pairs of equal area (SEN68).
fn setup(steps: &[(usize, (f64, f64, f64))]) -> Option<f64> {
    let mut found = Vec::new();
    for (i, (at, (n, _, t))) in steps.iter().enumerate() {
        let others = steps[i + 1..].iter().filter(|(other, (m, ..))| other == at && m != n);
        found.extend(others.map(|(_, (m, _, u))| (t * m - u * n) / (m - n)));
    }
    found.retain(|setup| setup.is_finite());
    found.sort_by(f64::total_cmp);
    found.get(found.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A machine on which geometry and pixels run one after the other, with a cost of edges between: not a max of two lines.
    fn machine(n: f64, pixels: f64) -> f64 {
        2e-6 + n * (0.15e-6 + 4e-9 * (pixels / n).sqrt()) + 3e-9 * pixels
    }

    /// Objects of several numbers of triangles at every area, with noise of 3 %.
    fn objects() -> Vec<(f64, f64, f64)> {
        let pairs = AREAS_PX.into_iter().flat_map(|area| [12.0, 48.0, 192.0].map(|n| (n, n * area)));
        let tremble = |k: usize| 1.0 + 0.03 * ((k * 7919 % 13) as f64 / 6.0 - 1.0);
        pairs.enumerate().map(|(k, (n, pixels))| (n, pixels, machine(n, pixels) * tremble(k))).collect()
    }

    #[test]
    fn held_out_objects_are_predicted_within_a_tenth() {
        let areas = Areas::fitted(&objects()).unwrap();
        for n in [7.0, 30.0, 110.0, 700.0] {
            for area in [1.5, 9.0, 33.0, 180.0, 700.0, 3000.0] {
                let (predicted, true_s) = (areas.time(n, n * area), machine(n, n * area));
                assert!((predicted / true_s - 1.0).abs() < 0.1, "{n} of {area} px: {predicted} for {true_s}");
            }
        }
    }

    #[test]
    fn missing_measurements_give_no_prices() {
        let all = objects();
        let without = |lost: f64| all.iter().copied().filter(|o| o.1 / o.0 != lost).collect::<Vec<_>>();
        assert_eq!(Areas::fitted(&[]), None);
        assert_eq!(Areas::fitted(&without(1.0)), None);
        assert_eq!(Areas::fitted(&without(4096.0)), None);
        assert!(Areas::fitted(&without(64.0)).is_some(), "a line leads over a step that is missing");
        let alike: Vec<_> = all.iter().copied().filter(|o| o.0 == 12.0).collect();
        assert_eq!(Areas::fitted(&alike), None, "one number of triangles does not tell what an object costs by itself");
    }

    #[test]
    fn prices_are_finite_for_all_inputs() {
        let areas = Areas::fitted(&objects()).unwrap();
        assert!(areas.is_sound() && areas.time(0.0, 100.0) == areas.setup);
        assert!(areas.time(10.0, 0.0) > areas.setup && areas.time(10.0, 1e9).is_finite());
        let wrong = Areas { setup: f64::NAN, ..areas };
        assert!(!wrong.is_sound());
    }
}
