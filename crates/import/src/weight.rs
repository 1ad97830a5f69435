//! Mass, centre and moments of inertia of solids, and of several together.
//!
//! In: a solid of uniform density. Out: a [`Weight`]. Never here: which solids of a body weigh.
//! Primitives and ellipsoids by their closed forms, surfaces by the tetrahedra between a point and their triangles.

use crate::model::Mass;
use crate::pose::Pose;
use glam::{DMat3, DVec3};
use metachron_geometry::{Solid, Triangles, hull_triangles};
use std::f64::consts::PI;

/// A mass somewhere.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weight {
    pub(crate) mass_kg: f64,
    com_m: DVec3,
    /// About the centre of mass.
    inertia_kg_m2: DMat3,
}

impl Weight {
    /// The weight of ground that stays: none.
    pub(crate) const NONE: Self = Self { mass_kg: 0.0, com_m: DVec3::ZERO, inertia_kg_m2: DMat3::ZERO };

    /// That of a body whose moments are given, in its axes.
    pub(crate) fn given(mass: &Mass) -> Option<Self> {
        let Mass::Given { mass_kg, com_m, inertia_kg_m2: Some(inertia_kg_m2) } = *mass else { return None };
        Some(Self { mass_kg, com_m, inertia_kg_m2 })
    }

    /// A solid of a density; `None` for one that has no closed form.
    pub(crate) fn of_solid(solid: &Solid, density_kg_m3: f64) -> Option<Self> {
        let mass_kg = solid.volume_m3().ok()? * density_kg_m3;
        let diagonal = |moments: DVec3| Some(Self::centred(mass_kg, moments));
        match *solid {
            Solid::Ball { radius_m: r } => diagonal(DVec3::splat(0.4 * mass_kg * r * r)),
            Solid::Box { half_extents_m: half } => diagonal(mass_kg / 3.0 * others(half * half)),
            Solid::Cylinder { radius_m: r, half_height_m: h } => diagonal(mass_kg * cylinder(r, h)),
            Solid::Capsule { radius_m: r, half_height_m: h } => {
                // two half balls, whose centres are 3/8 r beyond the ends
                let caps_kg = mass_kg * (4.0 / 3.0 * r) / (2.0 * h + 4.0 / 3.0 * r);
                let across = 0.4 * r * r + h * h + 0.75 * h * r;
                let caps = DVec3::new(across, across, 0.4 * r * r);
                diagonal((mass_kg - caps_kg) * cylinder(r, h) + caps_kg * caps)
            }
            _ => None,
        }
    }

    pub(crate) fn of_ellipsoid(semi_axes_m: DVec3, density_kg_m3: f64) -> Self {
        let mass_kg = 4.0 / 3.0 * PI * semi_axes_m.element_product() * density_kg_m3;
        Self::centred(mass_kg, mass_kg / 5.0 * others(semi_axes_m * semi_axes_m))
    }

    /// The inside of a surface, or of its hull where it is not closed; `None` where that has no volume.
    pub(crate) fn of_surface(surface: &Triangles, density_kg_m3: f64) -> Option<Self> {
        let hull;
        let surface = if !surface.triangles.is_empty() && surface.encloses() {
            surface
        } else {
            hull = hull_triangles(&surface.points).ok()?;
            &hull
        };
        let near = surface.points[surface.triangles[0][0] as usize];
        let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
        for triangle in &surface.triangles {
            let [a, b, c] = triangle.map(|i| surface.points[i as usize] - near);
            let (part, sum) = (a.dot(b.cross(c)) / 6.0, a + b + c);
            volume += part;
            first += part / 4.0 * sum;
            second += part / 20.0 * (outer(a) + outer(b) + outer(c) + outer(sum));
        }
        let (mass_kg, com_m) = (volume * density_kg_m3, first / volume);
        let spread = (second - volume * outer(com_m)) * density_kg_m3;
        let inertia_kg_m2 = DMat3::from_diagonal(DVec3::splat(spread.diagonal().element_sum())) - spread;
        Some(Self { mass_kg, com_m: near + com_m, inertia_kg_m2 })
    }

    fn centred(mass_kg: f64, moments: DVec3) -> Self {
        Self { mass_kg, com_m: DVec3::ZERO, inertia_kg_m2: DMat3::from_diagonal(moments) }
    }

    /// The same of another mass.
    pub(crate) fn with_mass(self, mass_kg: f64) -> Self {
        Self { mass_kg, inertia_kg_m2: self.inertia_kg_m2 * (mass_kg / self.mass_kg), ..self }
    }

    /// The same elsewhere.
    pub(crate) fn at(self, pose: Pose) -> Self {
        let turn = DMat3::from_quat(pose.rotation);
        let inertia_kg_m2 = turn * self.inertia_kg_m2 * turn.transpose();
        Self { com_m: pose.point(self.com_m), inertia_kg_m2, ..self }
    }

    /// All of them as one body, by parallel axes.
    pub(crate) fn together(all: &[Self]) -> Mass {
        let mass_kg: f64 = all.iter().map(|one| one.mass_kg).sum();
        let com_m: DVec3 = all.iter().map(|one| one.com_m * (one.mass_kg / mass_kg)).sum();
        let about = |one: &Self| {
            let arm = one.com_m - com_m;
            one.inertia_kg_m2 + (DMat3::from_diagonal(DVec3::splat(arm.length_squared())) - outer(arm)) * one.mass_kg
        };
        let inertia_kg_m2 = Some(all.iter().map(about).fold(DMat3::ZERO, |sum, one| sum + one));
        Mass::Given { mass_kg, com_m, inertia_kg_m2 }
    }
}

/// For each axis the sum of the other two.
fn others(square: DVec3) -> DVec3 {
    DVec3::splat(square.element_sum()) - square
}

/// Moments of a cylinder along z of unit mass.
fn cylinder(radius: f64, half_height: f64) -> DVec3 {
    let across = radius * radius / 4.0 + half_height * half_height / 3.0;
    DVec3::new(across, across, radius * radius / 2.0)
}

fn outer(a: DVec3) -> DMat3 {
    DMat3::from_cols(a * a.x, a * a.y, a * a.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The corners of a box and its faces, outward.
    fn surface(half: DVec3, at: DVec3) -> Triangles {
        let sign = |i: i32, bit: i32| f64::from((i >> bit & 1) * 2 - 1);
        let points: Vec<DVec3> = (0..8).map(|i| at + half * DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect();
        hull_triangles(&points).unwrap()
    }

    #[test]
    fn a_box_weighs_the_same_by_its_formula_by_its_surface_and_of_its_halves() {
        let half = DVec3::new(0.1, 0.2, 0.3);
        let whole = Weight::of_solid(&Solid::Box { half_extents_m: half }, 500.0).unwrap();
        assert!((whole.mass_kg - 24.0).abs() < 1e-12);
        assert!((whole.inertia_kg_m2.x_axis.x - 24.0 / 3.0 * 0.13).abs() < 1e-12);
        let at = DVec3::new(3.0, -2.0, 1.0);
        let by_surface = Weight::of_surface(&surface(half, at), 500.0).unwrap();
        // points of hulls pass through single precision: 1e-7 of 3 m, over 0.1 m
        assert!(by_surface.com_m.distance(at) < 1e-6 && (by_surface.mass_kg / 24.0 - 1.0).abs() < 1e-5);
        let upper = Weight::of_solid(&Solid::Box { half_extents_m: DVec3::new(0.1, 0.2, 0.15) }, 500.0).unwrap();
        let halves = [-0.15, 0.15].map(|z| upper.at(Pose { position: DVec3::new(0.0, 0.0, z), ..Pose::IDENTITY }));
        for other in [Weight::together(&[by_surface]), Weight::together(&halves)] {
            let Mass::Given { mass_kg, inertia_kg_m2: Some(tensor), .. } = other else { panic!("{other:?}") };
            let off = (tensor - whole.inertia_kg_m2).to_cols_array().into_iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            assert!((mass_kg / 24.0 - 1.0).abs() < 1e-5 && off < 1e-4, "{other:?}");
        }
    }

    #[test]
    fn an_ellipsoid_of_equal_axes_is_a_ball() {
        let ball = Weight::of_solid(&Solid::Ball { radius_m: 0.2 }, 300.0).unwrap();
        let same = Weight::of_ellipsoid(DVec3::splat(0.2), 300.0);
        assert!((ball.mass_kg - same.mass_kg).abs() < 1e-12);
        assert!((ball.inertia_kg_m2 - same.inertia_kg_m2).diagonal().length() < 1e-12);
    }
}
