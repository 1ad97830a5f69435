//! Tubes of a scene built in code.
//!
//! In: measures. Out: a [`TubeSpec`]. Never here: the scene.

use super::RATE_DEFAULT_HZ;
use glam::DVec3;
use metachron_models::rod::{Material as Elastic, Section, TubeSpec};

/// Shear coefficient of thin walls.
const SHEAR_FACTOR: f64 = 27.0 / 28.0;
/// Poisson's ratio and density (kg/m³) of a tube where it does not say otherwise: soft tissue.
const TISSUE: (f64, f64) = (0.45, 1050.0);
/// Equal parts of a tube where it does not say otherwise.
const SEGMENTS_DEFAULT: usize = 40;
/// Friction of a tube's skin where it does not say otherwise.
const TUBE_FRICTION: f64 = 0.2;

/// A tube before it is added.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct Tube {
    path_m: Vec<DVec3>,
    radius_m: f64,
    wall_m: Option<f64>,
    young_pa: f64,
    density_kg_m3: f64,
    segments: usize,
    clamp: [bool; 2],
    damping_per_s: f64,
    pub(super) rate_hz: f64,
}

impl Tube {
    /// A tube along these points, metres: of soft tissue, 1 cm in radius, solid, both ends free.
    #[must_use]
    pub fn along(path_m: &[[f64; 3]]) -> Self {
        Self {
            path_m: path_m.iter().map(|point| DVec3::from_array(*point)).collect(),
            radius_m: 0.01,
            wall_m: None,
            young_pa: 1e6,
            density_kg_m3: TISSUE.1,
            segments: SEGMENTS_DEFAULT,
            clamp: [false; 2],
            damping_per_s: 0.0,
            rate_hz: RATE_DEFAULT_HZ,
        }
    }

    setters! {
        /// Outer radius, metres, > 0.
        radius_m: f64 => radius_m;
        /// Thickness of its wall, metres, above 0 and at most its radius; without it the tube is solid.
        wall_m: f64 => wall_m;
        /// Young's modulus, Pa, > 0.
        young_pa: f64 => young_pa;
        /// Density, kg/m³, > 0.
        density_kg_m3: f64 => density_kg_m3;
        /// Number of equal parts, 2 … 4096.
        segments: usize => segments;
        /// Which ends are held in position and direction: start, end.
        clamp: [bool; 2] => clamp;
        /// Mass-proportional damping, 1/s, ≥ 0.
        damping_per_s: f64 => damping_per_s;
        /// Steps a simulated second, 1 … 100000.
        rate_hz: f64 => rate_hz;
    }

    pub(super) fn spec(self, gravity: DVec3) -> TubeSpec {
        let material = Elastic {
            young_pa: self.young_pa,
            poisson: TISSUE.0,
            density_kg_m3: self.density_kg_m3,
            shear_factor: SHEAR_FACTOR,
        };
        let section = Section::hollow(self.radius_m, self.wall_m.unwrap_or(self.radius_m), material);
        TubeSpec {
            clamp: self.clamp,
            damping_per_s: self.damping_per_s,
            self_contact: true,
            friction: TUBE_FRICTION,
            gravity,
            sleep: true,
            ..TubeSpec::free(self.path_m, section, self.segments)
        }
    }
}
