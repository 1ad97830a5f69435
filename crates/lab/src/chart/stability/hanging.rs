//! The rest shape of a clamped tube under its own weight, by shooting; independent of the tube's own code.
//!
//! In: length, weight per length, stiffnesses. Out: the position of the tip. The tube starts along +x, clamped at the origin, and
//! bends and stretches in a plane (Simo and Reissner's law, as docs/theory/rod.md, eq. 1–6).

/// The parameters of the shape.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Hanging {
    /// Length at rest, metres.
    pub(in super::super) length_m: f64,
    /// Weight per length, N/m.
    pub(in super::super) weight_n_m: f64,
    /// Stiffness of stretch, N.
    pub(in super::super) ea_n: f64,
    /// Stiffness of shear, N.
    pub(in super::super) ga_n: f64,
    /// Stiffness of bend, N·m².
    pub(in super::super) ei_n_m2: f64,
}

/// Steps of the integration along the tube: the shape's error is below 1e-9 of the length.
const STEPS: u32 = 4000;
/// Halvings of the bracket: enough for the last digit.
const HALVINGS: u32 = 80;

/// φ (the angle to the vertical), dφ/ds, and the displacement from the tip: sideways and up.
type State = [f64; 4];

impl Hanging {
    /// The position of the tip: sideways and down, metres.
    pub(in super::super) fn tip_m(&self) -> (f64, f64) {
        // the angle at the tip is tiny for a soft tube: the bisection is over its logarithm
        let (mut low, mut high) = (-200.0_f64, libm::log(std::f64::consts::FRAC_PI_2));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.shot(libm::exp(middle))[0] < std::f64::consts::FRAC_PI_2 { low = middle } else { high = middle }
        }
        let [.., side, down] = self.shot(libm::exp(0.5 * (low + high)));
        (side, down)
    }

    /// The state at the clamp of a tube whose tip has the angle `phi` to the vertical.
    fn shot(&self, phi: f64) -> State {
        let h = self.length_m / f64::from(STEPS);
        let mut at: State = [phi, 0.0, 0.0, 0.0];
        for k in 0..STEPS {
            let s = h * f64::from(k);
            let a = self.slope(s, at);
            let b = self.slope(s + 0.5 * h, ahead(at, a, 0.5 * h));
            let c = self.slope(s + 0.5 * h, ahead(at, b, 0.5 * h));
            let d = self.slope(s + h, ahead(at, c, h));
            at = std::array::from_fn(|i| at[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
            if at[0] > 4.0 {
                break; // past any angle that could be the clamp's
            }
        }
        at
    }

    /// d/ds of the state, `s` metres from the tip: EI φ'' = N r′ₓ, with the force N = w s down, the stretch along the
    /// director and the shear across it.
    fn slope(&self, s: f64, [phi, bend, ..]: State) -> State {
        let force = self.weight_n_m * s;
        let (sin, cos) = (libm::sin(phi), libm::cos(phi));
        let (along, across) = (1.0 + force * cos / self.ea_n, force * sin / self.ga_n);
        let (side, down) = (along * sin - across * cos, along * cos + across * sin);
        [bend, force * side / self.ei_n_m2, side, down]
    }
}

fn ahead(at: State, slope: State, h: f64) -> State {
    std::array::from_fn(|i| at[i] + h * slope[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shape_is_that_of_an_independent_code() {
        let text = include_str!("../../../../../tests/reference/cosserat_tube.json");
        let file: serde_json::Value = serde_json::from_str(text).unwrap();
        for case in file["cases"].as_object().unwrap().values() {
            let of = |key: &str| case["parameters"][key].as_f64().unwrap();
            let tube = Hanging {
                length_m: 1.0,
                weight_n_m: of("weight_per_length"),
                ea_n: of("EA"),
                ga_n: of("GAs"),
                ei_n_m2: of("EI"),
            };
            let answer = &case["cosserat"][0];
            let (side, down) = tube.tip_m();
            assert!((side - answer["x_tip"].as_f64().unwrap()).abs() < 1e-7, "{side} in {answer}");
            assert!((down + answer["z_tip"].as_f64().unwrap()).abs() < 1e-7, "{down} in {answer}");
        }
    }
}
