//! The light of a picture: its key light, the light from all around by direction, and the background that fits it.
//!
//! In: the name of an environment. Out: directions and radiances, linear. Never here: shadows, materials, the GPU.
//!
//! The light from a direction d, a unit vector, is L(d) = m + 3/2 s d_z, with m the mean and s half the difference of
//! the two hemispheres' light. A surface of normal n then receives, over π, ∫ L(d) max(d·n, 0) dω / π = m + s n_z
//! (RH01): `sky` facing up, `ground` facing down.

use glam::DVec3;
pub use metachron_core::kinds::EnvironmentKind as Environment;

/// The numbers of an environment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnvironmentLight {
    /// Direction towards the key light, a unit vector; of a light at the camera without meaning.
    pub toward: DVec3,
    /// Its colour times its strength.
    pub key: DVec3,
    /// The light that a surface facing up receives from all around, over π.
    pub sky: DVec3,
    /// The light that a surface facing down receives.
    pub ground: DVec3,
    /// The lamp as a mirror shows it; zero where there is none.
    pub lamp: DVec3,
    /// Whether the key light is at the camera instead.
    pub at_camera: bool,
    /// Share of the light from all around that is left where the key light has faded.
    pub far_share: f64,
    /// Whether the key light fades away from the scene.
    pub fades: bool,
}

impl EnvironmentLight {
    /// That of `environment`.
    #[must_use]
    pub fn of(environment: Environment) -> Self {
        let rgb = DVec3::new;
        match environment {
            Environment::Room => Self {
                toward: rgb(-0.36, -0.30, 0.883).normalize(),
                key: rgb(3.7, 3.5, 3.2),
                sky: rgb(0.26, 0.31, 0.39),
                ground: rgb(0.15, 0.13, 0.13),
                lamp: rgb(6.5, 6.3, 6.0),
                at_camera: false,
                far_share: 1.0,
                fades: true,
            },
            Environment::Sky => Self {
                toward: rgb(-0.58, -0.49, 0.65).normalize(),
                key: rgb(4.2, 3.9, 3.4),
                sky: rgb(0.36, 0.46, 0.64),
                ground: rgb(0.20, 0.19, 0.17),
                lamp: DVec3::ZERO,
                at_camera: false,
                far_share: 1.0,
                fades: false,
            },
            Environment::Endoscope => Self {
                toward: DVec3::Z,
                key: rgb(3.6, 3.5, 3.35),
                sky: rgb(0.06, 0.03, 0.026),
                ground: rgb(0.05, 0.025, 0.022),
                lamp: DVec3::ZERO,
                at_camera: true,
                far_share: 0.3,
                fades: true,
            },
        }
    }

    /// Whether it throws shadows.
    #[must_use]
    pub const fn throws_shadows(&self) -> bool {
        !self.at_camera
    }

    /// The light from the direction `from`, a unit vector, without the key light.
    #[must_use]
    pub fn radiance(&self, from: DVec3) -> DVec3 {
        0.5 * (self.sky + self.ground) + (self.sky - self.ground) * (0.75 * from.z)
    }

    /// The part of that light that a surface of the unit normal `n` receives, over π.
    #[must_use]
    pub fn ambient(&self, n: DVec3) -> DVec3 {
        self.ground.lerp(self.sky, 0.5 + 0.5 * n.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn a_surface_receives_the_integral_of_the_background_over_what_it_faces() {
        for light in Environment::ALL.map(EnvironmentLight::of) {
            for n in [DVec3::Z, DVec3::NEG_Z, DVec3::X, DVec3::new(0.6, -0.48, 0.64)] {
                // midpoints in height and azimuth: areas of equal size on the sphere
                let (rows, columns) = (200_i32, 200_i32);
                let mut sum = DVec3::ZERO;
                for i in 0..rows * columns {
                    let z = 2.0 * (f64::from(i / columns) + 0.5) / f64::from(rows) - 1.0;
                    let (sin, cos) = (TAU * f64::from(i % columns) / f64::from(columns)).sin_cos();
                    let d = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
                    sum += light.radiance(d) * d.dot(n).max(0.0);
                }
                let received = sum * (4.0 * PI / f64::from(rows * columns)) / PI;
                // second order in the areas' size: (2/200)²
                assert!(received.distance(light.ambient(n)) < 2e-4, "{n}: {received}, {}", light.ambient(n));
            }
        }
    }

    #[test]
    fn no_background_is_darker_than_black() {
        for light in Environment::ALL.map(EnvironmentLight::of) {
            assert!(light.radiance(DVec3::NEG_Z).min_element() >= 0.0 && light.radiance(DVec3::Z).min_element() >= 0.0);
        }
    }
}
