//! Bending of a sheet of triangles of any shape at rest: the shape operator of a triangle from the angles over its edges.
//!
//! In: a triangle and the vertices across its edges. Out: forces and stiffness. Never here: stretching ([`super::membrane`]).
//! Theory: docs/theory/soft.md, eq. 32, 33 (GGRZ06): as functions of angles, forces have no sum and no torque.

use super::deformation::outer;
use super::spec::SoftMaterial;
use super::system::System;
use glam::{DMat3, DVec2, DVec3};

/// A triangle, and the triangles over its edges.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShellBending {
    /// Its corners, and across the edge opposite to each the corner of the triangle there; itself where there is none.
    vertices: [u32; 6],
    /// Whether there is a triangle over the edge opposite to each corner.
    folded: [bool; 3],
    /// The angle over each edge at rest, radians.
    rest: [f64; 3],
    /// Stiffness between the angles, N·m: the energy is ½ (θ − θ₀)ᵀ K (θ − θ₀).
    stiffness: [[f64; 3]; 3],
}

/// An angle over an edge and its gradient.
#[derive(Debug, Clone, Copy)]
struct Fold {
    angle: f64,
    /// Gradients by the positions of both ends of the edge, of the corner on this side and of the corner across it,
    /// 1/m.
    slopes: [DVec3; 4],
}

/// The angle between the triangles (a, b, c) and (b, a, d): positive in a valley, seen from where their normals point.
fn fold([a, b, c, d]: [DVec3; 4]) -> Fold {
    let edge = b - a;
    let length = edge.length();
    let (here, there) = (edge.cross(c - a), (d - a).cross(edge));
    let (area, across) = (here.length_squared(), there.length_squared());
    // of a triangle that has collapsed no angle is known, and none is resisted until it opens again
    if area.min(across).min(length) <= f64::MIN_POSITIVE {
        return Fold { angle: 0.0, slopes: [DVec3::ZERO; 4] };
    }
    let along = edge / length;
    let angle = libm::atan2(-here.cross(there).dot(along), here.dot(there));
    let (by_c, by_d) = (here * (length / area), there * (length / across));
    // the slopes at the ends follow from where the feet of both heights are
    let shares = |point: DVec3| (point - a).dot(along) / length;
    let (at_c, at_d) = (shares(c), shares(d));
    let by_b = -(by_c * at_c + by_d * at_d);
    let by_a = -(by_c * (1.0 - at_c) + by_d * (1.0 - at_d));
    Fold { angle, slopes: [by_a, by_b, by_c, by_d] }
}

impl ShellBending {
    /// The bending of the triangle `corners` at rest; `across` are the corners over the edges opposite to each, where there are triangles.
    pub fn new(corners: [u32; 3], across: [Option<u32>; 3], rest_m: &[DVec3], bent: &ShellMaterial) -> Self {
        let [a, b, c] = corners;
        let vertices = [a, b, c, across[0].unwrap_or(a), across[1].unwrap_or(b), across[2].unwrap_or(c)];
        let at = corners.map(|vertex| rest_m[vertex as usize]);
        let normal = (at[1] - at[0]).cross(at[2] - at[0]);
        let (double_area, x) = (normal.length(), (at[1] - at[0]).normalize());
        let y = (normal / double_area).cross(x);
        // S = Σ θ/(2 A l) n nᵀ with n the edge turned by a right angle: the angle θ times this
        let operators: [[f64; 3]; 3] = std::array::from_fn(|i| {
            let edge = at[(i + 2) % 3] - at[(i + 1) % 3];
            let n = DVec2::new(-edge.dot(y), edge.dot(x));
            [n.x * n.x, n.y * n.y, n.x * n.y].map(|term| term / (double_area * edge.length()))
        });
        let stiffness = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let ([ixx, iyy, ixy], [jxx, jyy, jxy]) = (operators[i], operators[j]);
                let traces = (ixx + iyy) * (jxx + jyy);
                let product = ixx * jxx + iyy * jyy + 2.0 * ixy * jxy;
                let rigidity = bent.rigidity_n_m * ((1.0 - bent.poisson) * product + bent.poisson * traces);
                if across[i].is_some() && across[j].is_some() { rigidity * 0.5 * double_area } else { 0.0 }
            })
        });
        let mut bending = Self { vertices, folded: across.map(|over| over.is_some()), rest: [0.0; 3], stiffness };
        bending.rest = bending.folds(rest_m).map(|fold| fold.angle);
        bending
    }

    /// Places of the vertices of the fold over the edge opposite to a corner.
    const fn places(edge: usize) -> [usize; 4] {
        [(edge + 1) % 3, (edge + 2) % 3, edge, 3 + edge]
    }

    fn folds(&self, positions: &[DVec3]) -> [Fold; 3] {
        std::array::from_fn(|edge| {
            if !self.folded[edge] {
                return Fold { angle: 0.0, slopes: [DVec3::ZERO; 4] };
            }
            fold(Self::places(edge).map(|place| positions[self.vertices[place] as usize]))
        })
    }

    /// How far each angle is from rest, within half a turn.
    fn bent(&self, folds: &[Fold; 3]) -> [f64; 3] {
        let turn = std::f64::consts::TAU;
        std::array::from_fn(|edge| {
            let by = folds[edge].angle - self.rest[edge];
            by - turn * (by / turn).round()
        })
    }

    /// Adds its forces and stiffness at these positions (eq. 32, 33).
    pub fn add(&self, positions: &[DVec3], system: &mut System) {
        let folds = self.folds(positions);
        let bent = self.bent(&folds);
        let mut slopes = [[DVec3::ZERO; 6]; 3];
        for (edge, fold) in folds.iter().enumerate() {
            for (place, slope) in Self::places(edge).into_iter().zip(fold.slopes) {
                slopes[edge][place] += slope;
            }
        }
        let torques = self.stiffness.map(|row| row.iter().zip(bent).map(|(k, by)| k * by).sum::<f64>());
        for (place, &row) in self.vertices.iter().enumerate() {
            system.push(row, -(0..3).map(|edge| slopes[edge][place] * torques[edge]).sum::<DVec3>());
            for (other, &column) in self.vertices.iter().enumerate().filter(|(_, column)| row >= **column) {
                let mut block = DMat3::ZERO;
                for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                    block += outer(slopes[i][place], slopes[j][other] * self.stiffness[i][j]);
                }
                system.stiffen(row, column, block);
            }
        }
    }

    /// Elastic energy, J.
    pub fn energy_j(&self, positions: &[DVec3]) -> f64 {
        let bent = self.bent(&self.folds(positions));
        let pairs = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
        0.5 * pairs.map(|(i, j)| bent[i] * self.stiffness[i][j] * bent[j]).sum::<f64>()
    }
}

/// How stiffly a sheet bends.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShellMaterial {
    /// E t³/12 (1 − ν²), N·m.
    pub rigidity_n_m: f64,
    pub poisson: f64,
}

impl ShellMaterial {
    pub fn new(material: &SoftMaterial, thickness_m: f64) -> Self {
        let SoftMaterial { young_pa, poisson, .. } = *material;
        let rigidity_n_m = young_pa * thickness_m.powi(3) / (12.0 * (1.0 - poisson * poisson));
        Self { rigidity_n_m, poisson }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slopes_of_a_fold_are_those_of_its_angle() {
        let at = [DVec3::ZERO, DVec3::new(1.2, 0.1, 0.0), DVec3::new(0.3, 0.9, 0.2), DVec3::new(0.8, -0.7, 0.4)];
        let Fold { angle, slopes } = fold(at);
        assert!(angle.abs() > 0.3);
        for (place, axis) in (0..4).flat_map(|place| (0..3).map(move |axis| (place, axis))) {
            let beside = |by: f64| {
                let mut moved = at;
                moved[place][axis] += by;
                fold(moved).angle
            };
            let wanted = (beside(1e-6) - beside(-1e-6)) / 2e-6;
            assert!((slopes[place][axis] - wanted).abs() < 1e-8, "{place} {axis}: {} {wanted}", slopes[place][axis]);
        }
    }

    #[test]
    fn what_is_bent_to_a_cylinder_has_the_energy_of_a_plate() {
        // triangles of equal sides, and one with three unlike neighbours: ½ D A κ² where the strip is short against the radius
        let bent = ShellMaterial { rigidity_n_m: 2.0, poisson: 0.0 };
        let flat = [
            [0.0, 0.0],
            [1.0, 0.0],
            [0.5, 0.75_f64.sqrt()],
            [1.5, 0.75_f64.sqrt()],
            [-0.5, 0.75_f64.sqrt()],
            [0.5, -0.75_f64.sqrt()],
        ];
        let kappa = 1e-3;
        for turn in [0.0_f64, 0.4, 1.1] {
            let on = |[x, y]: [f64; 2]| {
                let u = x * turn.cos() + y * turn.sin();
                DVec3::new(x, y, 0.5 * kappa * u * u)
            };
            let rest: Vec<DVec3> = flat.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect();
            let element = ShellBending::new([0, 1, 2], [Some(3), Some(4), Some(5)], &rest, &bent);
            let energy = element.energy_j(&flat.map(on));
            let wanted = 0.5 * 2.0 * 0.75_f64.sqrt() * 0.5 * kappa * kappa;
            assert!((energy / wanted - 1.0).abs() < 1e-5, "{turn}: {energy} {wanted}");
        }
    }
}
