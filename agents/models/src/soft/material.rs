//! Laws of isotropic elastic materials, in terms of their principal stretches.
//!
//! In: three stretches. Out: the energy of a volume and its derivatives. Never here: elements. Theory: docs/theory/soft.md, eq. 25–27.

use super::spec::{MaterialLaw, SoftMaterial};

/// The response of a material to three principal stretches.
#[derive(Debug, Clone, Copy)]
pub(super) struct StretchResponse {
    /// Energy of a unit of volume at rest, J/m³.
    pub energy: f64,
    /// Its derivatives by the stretches, Pa: the principal Piola stresses.
    pub slope: [f64; 3],
    /// Its second derivatives by the stretches, Pa.
    pub curvature: [[f64; 3]; 3],
}

/// An isotropic elastic material.
pub(super) trait Material {
    /// Its response to these stretches; the least is negative where matter is turned inside out.
    fn respond(&self, stretches: [f64; 3]) -> StretchResponse;
}

/// The constants of Lamé, Pa.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lame {
    pub mu: f64,
    pub lambda: f64,
}

impl Lame {
    pub fn of(material: &SoftMaterial) -> Self {
        let SoftMaterial { young_pa, poisson, .. } = *material;
        let mu = 0.5 * young_pa / (1.0 + poisson);
        Self { mu, lambda: young_pa * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)) }
    }
}

/// The law of a material of a scene.
#[derive(Debug, Clone, Copy)]
pub(super) enum Law {
    Corotational(Lame),
    Ogden(Ogden),
}

impl Law {
    pub fn of(material: &SoftMaterial) -> Self {
        let lame = Lame::of(material);
        match material.law {
            MaterialLaw::Corotational => Self::Corotational(lame),
            MaterialLaw::NeoHookean => Self::Ogden(Ogden { lame, exponent: 2.0 }),
            MaterialLaw::Ogden { exponent } => Self::Ogden(Ogden { lame, exponent }),
        }
    }
}

impl Material for Law {
    fn respond(&self, stretches: [f64; 3]) -> StretchResponse {
        match self {
            Self::Corotational(lame) => lame.respond(stretches),
            Self::Ogden(law) => law.respond(stretches),
        }
    }
}

/// Linear in the stretches (eq. 25).
impl Material for Lame {
    fn respond(&self, stretches: [f64; 3]) -> StretchResponse {
        let Self { mu, lambda } = *self;
        let strains = stretches.map(|stretch| stretch - 1.0);
        let dilatation: f64 = strains.iter().sum();
        let square: f64 = strains.iter().map(|strain| strain * strain).sum();
        StretchResponse {
            energy: mu * square + 0.5 * lambda * dilatation * dilatation,
            slope: strains.map(|strain| 2.0 * mu * strain + lambda * dilatation),
            curvature: [0, 1, 2].map(|i| [0, 1, 2].map(|j| if i == j { 2.0 * mu + lambda } else { lambda })),
        }
    }
}

/// Ogden's law of one term for matter that may be compressed and turned inside out (eq. 26); with the exponent 2 the
/// stable Neo-Hookean one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ogden {
    lame: Lame,
    exponent: f64,
}

/// Below this stretch the power of a stretch goes on as the parabola that fits it there: powers have no value below zero, and steep ones no
/// use for so much compression.
const STRETCH_LEAST: f64 = 0.3;

impl Ogden {
    /// λᵃ and its first two derivatives.
    fn power(&self, stretch: f64) -> [f64; 3] {
        let a = self.exponent;
        let at = stretch.max(STRETCH_LEAST);
        let first = a * libm::pow(at, a - 1.0);
        let (value, second) = (first * at / a, first * (a - 1.0) / at);
        let by = stretch - at;
        [value + by * (first + 0.5 * by * second), first + by * second, second]
    }
}

impl Material for Ogden {
    fn respond(&self, stretches: [f64; 3]) -> StretchResponse {
        let Self { lame: Lame { mu, lambda }, exponent } = *self;
        let [a, b, c] = stretches;
        let (round, bulk) = (2.0 * mu / exponent, lambda + 2.0 * mu / exponent);
        let volume = a * b * c;
        let beside = [b * c, c * a, a * b];
        let pressure = bulk * (volume - 1.0) - round;
        let powers = stretches.map(|stretch| self.power(stretch));
        let sum: f64 = powers.iter().map(|power| power[0] - 1.0).sum();
        let of = |i: usize, j: usize| {
            let by_volume = bulk * beside[i] * beside[j];
            let other = if i == j { round / exponent * powers[i][2] } else { pressure * stretches[3 - i - j] };
            by_volume + other
        };
        StretchResponse {
            energy: round / exponent * sum - round * (volume - 1.0) + 0.5 * bulk * (volume - 1.0) * (volume - 1.0),
            slope: [0, 1, 2].map(|i| round / exponent * powers[i][1] + pressure * beside[i]),
            curvature: [0, 1, 2].map(|i| [0, 1, 2].map(|j| of(i, j))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(law: MaterialLaw, poisson: f64) -> SoftMaterial {
        SoftMaterial { young_pa: 1e4, poisson, density_kg_m3: 1e3, damping_per_s: 0.0, damping_s: 0.0, law }
    }

    const LAWS: [MaterialLaw; 5] = [
        MaterialLaw::Corotational,
        MaterialLaw::NeoHookean,
        MaterialLaw::Ogden { exponent: 8.0 },
        MaterialLaw::Ogden { exponent: -4.0 },
        MaterialLaw::Ogden { exponent: 1.0 },
    ];

    #[test]
    fn slopes_are_those_of_the_energy_and_curvatures_those_of_the_slopes() {
        for law in LAWS {
            let law = Law::of(&material(law, 0.4));
            for at in [[1.0, 1.0, 1.0], [1.3, 0.9, 0.7], [2.0, 0.5, 0.2], [1.1, 0.8, -0.4]] {
                let here = law.respond(at);
                for i in 0..3 {
                    let beside = |by: f64| {
                        let mut moved = at;
                        moved[i] += by;
                        law.respond(moved)
                    };
                    let (low, high) = (beside(-1e-5), beside(1e-5));
                    let scale = 1e4 + here.slope[i].abs() + here.curvature[i][i].abs();
                    assert!(((high.energy - low.energy) / 2e-5 - here.slope[i]).abs() < 1e-6 * scale, "{law:?} {at:?}");
                    for j in 0..3 {
                        let wanted = (high.slope[j] - low.slope[j]) / 2e-5;
                        assert!((wanted - here.curvature[i][j]).abs() < 1e-6 * scale, "{law:?} {at:?} {i} {j}");
                    }
                }
            }
        }
    }

    #[test]
    fn near_rest_all_laws_are_that_of_hooke() {
        for law in LAWS {
            let material = material(law, 0.4);
            let (law, hooke) = (Law::of(&material), Lame::of(&material).respond([1.0; 3]));
            let rest = law.respond([1.0; 3]);
            assert!(rest.energy.abs() < 1e-9 && rest.slope.iter().all(|slope| slope.abs() < 1e-9), "{law:?}");
            for (ours, wanted) in rest.curvature.iter().flatten().zip(hooke.curvature.iter().flatten()) {
                assert!((ours - wanted).abs() < 1e-9 * wanted, "{law:?}: {ours} {wanted}");
            }
        }
    }

    /// The stretch across at which nothing pulls across, by bisection.
    fn free_across(law: &Law, along: f64) -> f64 {
        let (mut low, mut high) = (0.2, 3.0);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if law.respond([along, middle, middle]).slope[1] > 0.0 { high = middle } else { low = middle }
        }
        0.5 * (low + high)
    }

    #[test]
    fn what_keeps_its_volume_is_pulled_as_the_closed_form_says() {
        // P = (2 μ/a) (λ^(a − 1) − λ^(−a/2 − 1)), of an incompressible Ogden material of one term; a = 2 is Neo-Hookean
        for (law, a) in [(MaterialLaw::NeoHookean, 2.0), (LAWS[2], 8.0), (LAWS[3], -4.0)] {
            let material = material(law, 0.499_999);
            let (law, mu) = (Law::of(&material), Lame::of(&material).mu);
            for along in [0.7_f64, 0.9, 1.2, 1.6] {
                let across = free_across(&law, along);
                let pull = law.respond([along, across, across]).slope[0];
                let wanted = 2.0 * mu / a * (along.powf(a - 1.0) - along.powf(-0.5 * a - 1.0));
                assert!((pull / wanted - 1.0).abs() < 1e-4, "{a} {along}: {pull} {wanted}");
            }
        }
    }
}
