//! Mass distribution of a solid: centre of mass and principal moments of inertia, in double precision.
//!
//! In: a [`RigidSpec`]: a [`Solid`] of uniform density, or measured mass properties. Out: [`MassDistribution`]. Never here: where the body is, how it moves.
//! Primitives use the closed forms; hulls and closed meshes the integrals over the tetrahedra between the origin and every
//! triangle, which are exact for flat faces. An open mesh has no inside: it has the mass distribution of its convex hull.

use super::{RigidError, RigidSpec};
use crate::symmetric::{PrincipalAxes, principal_axes};
use glam::{DMat3, DQuat, DVec3};
use metachron_geometry::{CompoundPart, Solid, Triangles, hull_triangles, mesh_triangles};

/// Mass, centre and principal moments of a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MassDistribution {
    /// Mass, kilograms.
    pub mass_kg: f64,
    /// Centre of mass in the shape's axes, metres.
    pub com: DVec3,
    /// Principal moments of inertia about the centre, kg·m², all > 0.
    pub moments: DVec3,
    /// Rotation from the principal axes to the shape's.
    pub axes: DQuat,
}

impl MassDistribution {
    /// The distribution that `spec` gives, or else that of its solid.
    pub(super) fn of_body(spec: &RigidSpec) -> Result<Self, RigidError> {
        let Some(given) = spec.inertia else { return Self::of(&spec.solid, spec.mass_kg) };
        let PrincipalAxes { values, axes } = principal_axes(given.about_com_kg_m2);
        let axes = DQuat::from_mat3(&axes).normalize();
        Ok(Self { mass_kg: spec.mass_kg, com: given.com_m, moments: values, axes })
    }

    /// The distribution of `mass_kg` over `solid`.
    pub(super) fn of(solid: &Solid, mass_kg: f64) -> Result<Self, RigidError> {
        let centred = |moments: DVec3| Self { mass_kg, com: DVec3::ZERO, moments, axes: DQuat::IDENTITY };
        Ok(match solid {
            Solid::Ball { radius_m: r } => centred(DVec3::splat(0.4 * mass_kg * r * r)),
            Solid::Box { half_extents_m: h } => {
                let square = *h * *h;
                centred(mass_kg / 3.0 * (DVec3::splat(square.element_sum()) - square))
            }
            Solid::Cylinder { radius_m, half_height_m } => centred(mass_kg * cylinder(*radius_m, *half_height_m)),
            Solid::Capsule { radius_m, half_height_m } => centred(capsule(mass_kg, *radius_m, *half_height_m)),
            Solid::Plane => return Err(RigidError::MovingPlane),
            Solid::Compound { parts } => Self::together(parts, mass_kg)?,
            Solid::Hull { points_m } => Self::inside(&hull_triangles(points_m)?, mass_kg),
            Solid::Mesh { points_m, triangles } => {
                let mesh = mesh_triangles(points_m, triangles)?;
                let solid = if mesh.encloses() { mesh } else { hull_triangles(points_m)? };
                Self::inside(&solid, mass_kg)
            }
        })
    }

    /// The distribution of `mass_kg` over several solids by their volumes and densities, by parallel axes.
    fn together(parts: &[CompoundPart], mass_kg: f64) -> Result<Self, RigidError> {
        let mut all = Vec::with_capacity(parts.len());
        let mut sum = 0.0;
        for part in parts {
            let share = part.solid.volume_m3()? * part.density;
            all.push((part, Self::of(&part.solid, share)?));
            sum += share;
        }
        let place = |part: &CompoundPart, own: &Self| part.position_m + part.rotation * own.com;
        let com: DVec3 = all.iter().map(|(part, own)| place(part, own) * (own.mass_kg / sum)).sum();
        let mut inertia = DMat3::ZERO;
        for (part, own) in &all {
            let (turned, arm) = (DMat3::from_quat(part.rotation * own.axes), place(part, own) - com);
            let about_itself = turned * DMat3::from_diagonal(own.moments) * turned.transpose();
            let moved = DMat3::from_diagonal(DVec3::splat(arm.length_squared())) - outer(arm);
            inertia += about_itself + moved * own.mass_kg;
        }
        let PrincipalAxes { values, axes } = principal_axes(inertia * (mass_kg / sum));
        Ok(Self { mass_kg, com, moments: values, axes: DQuat::from_mat3(&axes).normalize() })
    }

    /// The distribution of `mass_kg` over the inside of a closed surface.
    fn inside(surface: &Triangles, mass_kg: f64) -> Self {
        // moments about a point near the solid: far from the origin the differences would lose digits
        let near = surface.points[surface.triangles[0][0] as usize];
        let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
        for triangle in &surface.triangles {
            let [a, b, c] = triangle.map(|i| surface.points[i as usize] - near);
            let part = a.dot(b.cross(c)) / 6.0;
            let sum = a + b + c;
            volume += part;
            first += part / 4.0 * sum;
            second += part / 20.0 * (outer(a) + outer(b) + outer(c) + outer(sum));
        }
        let com = first / volume;
        let about_com = (second * (1.0 / volume) - outer(com)) * mass_kg;
        let trace = about_com.x_axis.x + about_com.y_axis.y + about_com.z_axis.z;
        let inertia = DMat3::from_diagonal(DVec3::splat(trace)) - about_com;
        let PrincipalAxes { values, axes } = principal_axes(inertia);
        Self { mass_kg, com: near + com, moments: values, axes: DQuat::from_mat3(&axes).normalize() }
    }
}

fn outer(a: DVec3) -> DMat3 {
    DMat3::from_cols(a * a.x, a * a.y, a * a.z)
}

/// Moments of a cylinder along z of unit mass.
fn cylinder(radius: f64, half_height: f64) -> DVec3 {
    let across = radius * radius / 4.0 + half_height * half_height / 3.0;
    DVec3::new(across, across, radius * radius / 2.0)
}

/// Moments of a capsule along z: a cylinder and two half balls, moved out by their own centres (3/8 r) and half the height.
fn capsule(mass: f64, r: f64, h: f64) -> DVec3 {
    let (tube, caps) = (2.0 * h, 4.0 / 3.0 * r);
    let caps_mass = mass * caps / (tube + caps);
    let across = 0.4 * r * r + h * h + 0.75 * h * r;
    (mass - caps_mass) * cylinder(r, h) + caps_mass * DVec3::new(across, across, 0.4 * r * r)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn corners(half: DVec3, centre: DVec3) -> Arc<[DVec3]> {
        let sign = |i: i32, bit: i32| f64::from((i >> bit & 1) * 2 - 1);
        (0..8).map(|i| centre + half * DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect()
    }

    fn sorted(moments: DVec3) -> DVec3 {
        let mut moments = moments.to_array();
        moments.sort_by(f64::total_cmp);
        DVec3::from_array(moments)
    }

    #[test]
    fn a_hull_of_a_boxs_corners_weighs_like_the_box() {
        let half = DVec3::new(0.1, 0.2, 0.3);
        let centre = DVec3::new(5.0, -2.0, 1.0);
        let hull = MassDistribution::of(&Solid::Hull { points_m: corners(half, centre) }, 2.0).unwrap();
        let mut expected = MassDistribution::of(&Solid::Box { half_extents_m: half }, 2.0).unwrap().moments.to_array();
        expected.sort_by(f64::total_cmp);
        // the hull passes through single precision: 1e-7 of coordinates near 5, over 0.1
        assert!((hull.com - centre).length() < 1e-6, "{:?}", hull.com);
        let wrong = (sorted(hull.moments) - DVec3::from_array(expected)).abs().max_element();
        assert!(wrong < 1e-5 * expected[2], "{:?} is not {expected:?}", hull.moments);
    }

    #[test]
    fn a_fine_mesh_of_a_capsule_weighs_like_the_capsule() {
        let (r, h, rings, around) = (0.2_f64, 0.3_f64, 96, 128);
        let point = |i: usize, j: usize| {
            let (polar, turn) = (i as f64 / rings as f64 * std::f64::consts::PI, j as f64 / around as f64);
            let shift = if i <= rings / 2 { h } else { -h };
            let turn = turn * std::f64::consts::TAU;
            DVec3::new(r * polar.sin() * turn.cos(), r * polar.sin() * turn.sin(), r * polar.cos() + shift)
        };
        // the row at the equator appears twice, at both ends of the straight part
        let rows: Vec<usize> = (0..=rings / 2).chain(rings / 2..=rings).collect();
        let points: Vec<DVec3> = rows
            .iter()
            .enumerate()
            .flat_map(|(row, &i)| {
                let down = if row > rings / 2 { -2.0 * h * f64::from(u8::from(i == rings / 2)) } else { 0.0 };
                (0..around).map(move |j| point(i, j) + DVec3::Z * down)
            })
            .collect();
        let id = |row: usize, j: usize| (row * around + j % around) as u32;
        let triangles = (0..rows.len() - 1).flat_map(|row| {
            (0..around).flat_map(move |j| {
                [[id(row, j), id(row + 1, j), id(row, j + 1)], [id(row, j + 1), id(row + 1, j), id(row + 1, j + 1)]]
            })
        });
        let mesh = Triangles { points, triangles: triangles.collect() };
        let got = sorted(MassDistribution::inside(&mesh, 3.0).moments);
        let mut expected = capsule(3.0, r, h).to_array();
        expected.sort_by(f64::total_cmp);
        // chords are inside the arc by (angle step)²/8 ≈ 3e-4, its square enters the moments
        let wrong = (got - DVec3::from_array(expected)).abs().max_element();
        assert!(wrong < 2e-3 * expected[2], "{got} is not {expected:?}");
    }

    #[test]
    fn a_dumbbell_weighs_as_its_balls_and_its_bar_by_parallel_axes() {
        let (r, l, half) = (0.1, 0.3, DVec3::new(0.2, 0.02, 0.03));
        let part = |solid, x: f64, density| CompoundPart {
            density,
            ..CompoundPart::new(solid, DVec3::new(x, 0.0, 0.4), DQuat::IDENTITY)
        };
        let ball = |x: f64| part(Solid::Ball { radius_m: r }, x, 3.0);
        let bar = part(Solid::Box { half_extents_m: half }, 0.0, 1.0);
        let parts = [ball(-l), ball(l), bar].into();
        let all = MassDistribution::of(&Solid::Compound { parts }, 5.0).unwrap();
        let volumes = [4.0 / 3.0 * std::f64::consts::PI * r * r * r * 3.0, 8.0 * half.element_product()];
        let share = 5.0 / (2.0 * volumes[0] + volumes[1]);
        let [ball_kg, bar_kg] = volumes.map(|volume| volume * share);
        let (about, own) = (2.0 * 0.4 * ball_kg * r * r, bar_kg / 3.0 * (half.length_squared() - half * half));
        let across = 2.0 * ball_kg * l * l;
        let expected = DVec3::new(about + own.x, about + across + own.y, about + across + own.z);
        assert!((all.com - DVec3::Z * 0.4).length() < 1e-15, "{:?}", all.com);
        assert!((sorted(all.moments) - sorted(expected)).abs().max_element() < 1e-14, "{} {expected}", all.moments);
    }

    #[test]
    fn given_moments_stand_in_for_those_of_the_solid() {
        let turn = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.2, 2.0));
        let about_com_kg_m2 = turn * DMat3::from_diagonal(DVec3::new(0.03, 0.04, 0.05)) * turn.transpose();
        let given = super::super::GivenInertia { com_m: DVec3::X, about_com_kg_m2 };
        let ball = RigidSpec::free(Solid::Ball { radius_m: 0.1 }, DVec3::ZERO, 2.0);
        let distribution = MassDistribution::of_body(&RigidSpec { inertia: Some(given), ..ball }).unwrap();
        let axes = DMat3::from_quat(distribution.axes);
        let back = axes * DMat3::from_diagonal(distribution.moments) * axes.transpose();
        assert!(back.abs_diff_eq(about_com_kg_m2, 1e-16), "{back}"); // rounding of numbers near 0.05
        assert_eq!((distribution.com, distribution.mass_kg), (DVec3::X, 2.0));
    }

    #[test]
    fn an_open_mesh_weighs_like_its_hull() {
        let points_m = corners(DVec3::splat(0.5), DVec3::ZERO);
        let whole = hull_triangles(&points_m).unwrap().triangles;
        let open = Solid::Mesh { points_m: points_m.clone(), triangles: whole[1..].into() };
        let hull = Solid::Hull { points_m };
        assert_eq!(MassDistribution::of(&open, 1.0).unwrap(), MassDistribution::of(&hull, 1.0).unwrap());
    }
}
