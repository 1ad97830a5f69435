//! The law of a wall that gives: how stiffly a section widens and flattens, and how it bends when it is flat.
//!
//! In: a [`Section`]. Out: stiffnesses per length of tube, the softening of its bend. Never here: a state.
//! Theory: docs/theory/rod.md, section 15.

use crate::rod::Section;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// The flattening of a section over its mid-wall radius up to which Brazier's first-order law holds as it stands; his tube fails at 2/9.
const FIRST_ORDER: f64 = 1.0 / 3.0;
/// The curvature of the bend's softening by flattening past that (eq. 63), which bounds it everywhere.
const SOFTENING_CURVATURE: f64 = 2.25;
/// Inertia of flattening over that of widening: cos 2φ outwards, −½ sin 2φ along the wall, squared and averaged.
const OVAL_INERTIA: f64 = 0.625;

/// The wall of a round tube, per length. Vectors hold widening, then the two components of flattening.
#[derive(Debug, Clone, Copy)]
pub struct WallLaw {
    /// Outer radius at rest, metres.
    pub outer_m: f64,
    /// Mid-wall radius, metres.
    pub middle_m: f64,
    /// Inner radius, metres; zero of a solid rod.
    pub inner_m: f64,
    /// Inertia, kg/m.
    pub inertia: DVec3,
    /// Stiffness against widening and flattening, N/m² (eq. 56, 57).
    pub stiffness: DVec3,
    /// Stiffness against their second derivative along the tube, N·m² (eq. 58).
    pub along: DVec3,
    /// Force on the widening per length and pressure, metres (eq. 59).
    pub lift_m: f64,
    /// Stiffness of opposite walls that meet, N/m²; zero of a solid rod.
    pub closed: f64,
    /// Bend stiffness of the round tube, N·m².
    pub ei: f64,
}

/// The bend stiffness of a section over that of the round one: `mean` in all directions, and `oval` times cos 2φ and sin 2φ more.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Softening {
    /// The mean of its principal values.
    pub mean: f64,
    /// Half their difference, by its two components.
    pub oval: DVec2,
}

/// Brazier's energy at a node, and its derivative by the components of flattening.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brazier {
    /// Minus the derivative, N (per metre of tube).
    pub force: DVec2,
    /// A bound of the second derivative, N/m².
    pub stiffness: f64,
}

impl Softening {
    /// The bend that a round section would need for the same moment as this one, in the section's axes (eq. 62).
    #[inline(always)]
    pub fn of(&self, bend: DVec2) -> DVec2 {
        let Self { mean, oval } = *self;
        bend * mean + DVec2::new(oval.x * bend.x + oval.y * bend.y, oval.y * bend.x - oval.x * bend.y)
    }
}

impl WallLaw {
    /// The wall of this section.
    pub fn of(section: &Section) -> Self {
        let Section { radius_m: b, wall_m, young_pa: e, poisson: nu, .. } = *section;
        let (a, r) = (b - wall_m, b - 0.5 * wall_m);
        let (a2, b2) = (a * a, b * b);
        let plate = e / (1.0 - nu * nu);
        let solid = ovalisation_n_m2(plate, nu, 0.0);
        let oval = ovalisation_n_m2(plate, nu, a / b);
        let lame = (1.0 - nu) * b2 + (1.0 + nu) * a2;
        let hoop = 2.0 * PI * e * (b2 - a2) / lame;
        let along_hoop = 2.0 * PI * r * plate * wall_m.powi(3) / 12.0;
        let along_oval = PI * e * wall_m * r.powi(3) / 16.0;
        let mass = section.mass_per_length_kg_m;
        Self {
            outer_m: b,
            middle_m: r,
            inner_m: a,
            inertia: DVec3::new(mass, OVAL_INERTIA * mass, OVAL_INERTIA * mass),
            stiffness: DVec3::new(hoop, oval, oval),
            along: DVec3::new(along_hoop, along_oval, along_oval),
            lift_m: 2.0 * PI * a2 * b * (2.0 - nu) / lame,
            closed: if a > 0.0 { solid } else { 0.0 },
            ei: section.ei_n_m2,
        }
    }

    /// The area of the lumen of this section, m² (eq. 59).
    pub fn lumen_m2(&self, wall: DVec3) -> f64 {
        let flat2 = wall.y * wall.y + wall.z * wall.z;
        PI * self.inner_m * self.inner_m + self.lift_m * wall.x - 1.5 * PI * flat2
    }

    /// By how far opposite walls of this section have met, metres; not above zero of an open one.
    pub fn met_m(&self, wall: DVec3) -> f64 {
        (wall.y * wall.y + wall.z * wall.z).sqrt() - wall.x - self.inner_m
    }

    /// How a section bends (eq. 62, 63).
    pub fn softening(&self, wall: DVec3) -> Softening {
        let flat = DVec2::new(wall.y, wall.z) / self.middle_m;
        let f = flat.length();
        if f <= FIRST_ORDER {
            return Softening { mean: 1.0, oval: flat * -1.5 };
        }
        let (high, low) = (1.0 + 1.5 * f, share(f).0);
        Softening { mean: 0.5 * (low + high), oval: flat * (0.5 * (low - high) / f) }
    }

    /// The effect of a curvature, 1/m, in the section's axes on its flattening (eq. 63).
    pub fn brazier(&self, wall: DVec3, curvature: DVec2) -> Brazier {
        let flat = DVec2::new(wall.y, wall.z) / self.middle_m;
        let (f, k2) = (flat.length(), curvature.length_squared());
        let y = DVec2::new(curvature.x * curvature.x - curvature.y * curvature.y, 2.0 * curvature.x * curvature.y);
        let scale = 0.5 * self.ei / self.middle_m;
        let stiffness = SOFTENING_CURVATURE * scale * k2 / self.middle_m;
        if f <= FIRST_ORDER {
            return Brazier { force: y * (1.5 * scale), stiffness };
        }
        let (low, slope) = share(f);
        let (e, along) = (flat / f, flat.dot(y) / f);
        let (mean_slope, oval_slope) = (0.5 * (slope + 1.5), 0.5 * (slope - 1.5));
        let oval = 0.5 * (low - 1.0 - 1.5 * f) / f;
        let gradient = e * (mean_slope * k2 + oval_slope * along) + (y - e * along) * oval;
        Brazier { force: gradient * -scale, stiffness }
    }
}

/// The bend stiffness of a section that is flatter by f > 1/3 across the bend, over that of the round one, and its derivative (eq. 63).
fn share(f: f64) -> (f64, f64) {
    let open = (1.0 - f).max(0.0);
    (0.5 * SOFTENING_CURVATURE * open * open, -SOFTENING_CURVATURE * open)
}

/// Stiffness of an annulus of inner over outer radius `hollow` against a pressure q cos 2φ on its outside, in plane strain: the force q π b on
/// the amplitude over the displacement there, N/m² (eq. 57; Michell's solution of the second harmonic).
fn ovalisation_n_m2(plate_pa: f64, poisson: f64, hollow: f64) -> f64 {
    let nu = poisson / (1.0 - poisson);
    if hollow <= 0.0 {
        return PI * plate_pa / (1.0 + nu / 3.0);
    }
    let m = 1.0 / (hollow * hollow);
    let sum = (1.0 + nu) * m * (m * m + m + 2.0) - (1.0 + nu) * (1.0 + 3.0 * m) / 3.0 + 2.0 * (1.0 + m + 2.0 * m * m)
        - 2.0 / 3.0 * nu * m * m * (m + 3.0);
    PI * plate_pa * (m - 1.0).powi(3) / sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rod::Material;

    fn law(wall_m: f64) -> WallLaw {
        let material = Material { young_pa: 1e6, poisson: 0.3, density_kg_m3: 1000.0, shear_factor: 0.5 };
        WallLaw::of(&Section::hollow(0.01, wall_m, material))
    }

    #[test]
    fn a_thin_wall_flattens_as_a_ring_that_does_not_stretch() {
        let (law, t) = (law(5e-5), 5e-5_f64);
        let ring = 9.0 * PI * 1e6 / (1.0 - 0.09) * t.powi(3) / 12.0 / law.middle_m.powi(3);
        assert!((law.stiffness.y / ring - 1.0).abs() < 0.01, "{} of {ring}", law.stiffness.y); // shear of t/R = 0.005
    }

    #[test]
    fn a_wall_grows_stiffer_up_to_the_solid_rod() {
        let stiffness: Vec<f64> = [1e-3, 3e-3, 6e-3, 9e-3, 9.999e-3].iter().map(|&t| law(t).stiffness.y).collect();
        assert!(stiffness.is_sorted(), "{stiffness:?}");
        assert!((stiffness[4] / law(0.01).stiffness.y - 1.0).abs() < 1e-3); // the hole is 1e-4 of the radius
    }

    #[test]
    fn the_force_on_flattening_is_the_derivative_of_the_bend_energy() {
        let law = law(1e-3);
        let k = DVec2::new(3.0, -1.7);
        let energy_j = |flat: DVec2| {
            let Softening { mean, oval } = law.softening(DVec3::new(0.0, flat.x, flat.y));
            let y = DVec2::new(k.x * k.x - k.y * k.y, 2.0 * k.x * k.y);
            0.5 * law.ei * (mean * k.length_squared() + oval.dot(y))
        };
        for flat in [DVec2::new(1e-3, 5e-4), DVec2::new(-3e-3, 4e-3), DVec2::new(5e-3, 7e-3), DVec2::new(9e-3, 9e-3)] {
            let step = 1e-7;
            let slope = |by: DVec2| (energy_j(flat + by) - energy_j(flat - by)) / (2.0 * step);
            let want = -DVec2::new(slope(DVec2::X * step), slope(DVec2::Y * step));
            let got = law.brazier(DVec3::new(0.0, flat.x, flat.y), k).force;
            assert!((got - want).length() < 1e-6 * want.length(), "{got}, {want}"); // differences of 1e-7 R
        }
    }
}
