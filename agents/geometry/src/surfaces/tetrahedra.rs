//! Meshes of tetrahedra: the faults of one, and the surface around it.
//!
//! In: points and corners. Out: the first fault with its place, the boundary. Never here: files, materials.

use crate::Triangles;
use glam::DVec3;
use std::collections::HashMap;

/// A mesh of tetrahedra.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Tetrahedra {
    /// Its points, metres.
    pub points: Vec<DVec3>,
    /// The corners of each: seen from the first one, the other three are clockwise, so that (b − a) × (c − a) · (d − a) > 0.
    pub corners: Vec<[u32; 4]>,
    /// The number of the region of each; empty where all are one.
    pub regions: Vec<i64>,
}

/// A fault of a mesh of tetrahedra; all numbers from 0.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TetrahedraFault {
    /// There are none.
    #[error("it has no tetrahedra")]
    Empty,
    /// A corner does not exist.
    #[error("tetrahedron {} has a corner that does not exist: point {} of {points}", tetrahedron + 1, u64::from(*point) + 1)]
    NoPoint {
        /// Which one.
        tetrahedron: usize,
        /// The point it names.
        point: u32,
        /// How many there are.
        points: usize,
    },
    /// A coordinate is not finite.
    #[error("point {} is not finite", point + 1)]
    NotFinite {
        /// Which point.
        point: usize,
    },
    /// A tetrahedron has less than no volume, or next to none for its size.
    #[error("tetrahedron {} is {}: its volume is {volume_m3:.2e} m³", tetrahedron + 1, if *volume_m3 < 0.0 { "inverted" } else { "flat" })]
    Inverted {
        /// Which one.
        tetrahedron: usize,
        /// Its volume, m³.
        volume_m3: f64,
    },
    /// No tetrahedron has a point.
    #[error("point {} belongs to no tetrahedron", point + 1)]
    Unreferenced {
        /// Which point.
        point: usize,
    },
    /// More than two tetrahedra share a face, or two are on the same side of it.
    #[error("tetrahedron {} is not manifold: it shares a face with another on the same side", tetrahedron + 1)]
    NotManifold {
        /// The later of the two.
        tetrahedron: usize,
    },
    /// They are several bodies.
    #[error("it has {pieces} separate pieces that share no face, and a solid is one: make each an object")]
    Pieces {
        /// How many.
        pieces: usize,
    },
    /// The numbers of regions are not as many as tetrahedra.
    #[error("it has {regions} regions for {tetrahedra} tetrahedra")]
    Regions {
        /// How many numbers there are.
        regions: usize,
        /// How many there should be.
        tetrahedra: usize,
    },
}

/// The faces of a tetrahedron, counter-clockwise seen from outside.
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
/// A tetrahedron with less volume than this share of the cube of its longest edge is flat.
const FLAT: f64 = 1e-9;

impl Tetrahedra {
    /// The volume of one, m³.
    #[must_use]
    pub fn volume_m3(&self, tetrahedron: usize) -> f64 {
        let [a, b, c, d] = self.corners[tetrahedron].map(|corner| self.points[corner as usize]);
        (b - a).cross(c - a).dot(d - a) / 6.0
    }

    /// The triangles around it, over its own points, counter-clockwise seen from outside.
    #[must_use]
    pub fn boundary(&self) -> Vec<[u32; 3]> {
        lone_faces(self.faces().collect())
    }

    /// Points and triangles of the boundary alone.
    #[must_use]
    pub fn surface(&self) -> Triangles {
        let mut number = vec![u32::MAX; self.points.len()];
        let mut surface = Triangles { points: vec![], triangles: self.boundary() };
        for corner in surface.triangles.iter_mut().flatten() {
            let known = &mut number[*corner as usize];
            if *known == u32::MAX {
                *known = surface.points.len() as u32;
                surface.points.push(self.points[*corner as usize]);
            }
            *corner = *known;
        }
        surface
    }

    fn faces(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.corners.iter().flat_map(|corners| FACES.map(|face| face.map(|at| corners[at])))
    }

    /// Whether it is one solid that can be computed with.
    ///
    /// # Errors
    /// The first fault.
    pub fn check(&self) -> Result<(), TetrahedraFault> {
        let (points, tetrahedra) = (self.points.len(), self.corners.len());
        if tetrahedra == 0 {
            return Err(TetrahedraFault::Empty);
        }
        if !(self.regions.is_empty() || self.regions.len() == tetrahedra) {
            return Err(TetrahedraFault::Regions { regions: self.regions.len(), tetrahedra });
        }
        if let Some(point) = self.points.iter().position(|point| !point.is_finite()) {
            return Err(TetrahedraFault::NotFinite { point });
        }
        let mut used = vec![false; points];
        for (tetrahedron, corners) in self.corners.iter().enumerate() {
            for &point in corners {
                let Some(used) = used.get_mut(point as usize) else {
                    return Err(TetrahedraFault::NoPoint { tetrahedron, point, points });
                };
                *used = true;
            }
            let volume_m3 = self.volume_m3(tetrahedron);
            if volume_m3 <= FLAT * self.longest_m(tetrahedron).powi(3) {
                return Err(TetrahedraFault::Inverted { tetrahedron, volume_m3 });
            }
        }
        if let Some(point) = used.iter().position(|used| !used) {
            return Err(TetrahedraFault::Unreferenced { point });
        }
        self.check_faces()
    }

    fn longest_m(&self, tetrahedron: usize) -> f64 {
        let corners = self.corners[tetrahedron].map(|corner| self.points[corner as usize]);
        let ends = (0..4).flat_map(|i| (0..i).map(move |j| [i, j]));
        ends.map(|[i, j]| corners[i].distance(corners[j])).fold(0.0, f64::max)
    }

    /// Every face has at most one tetrahedron on either side, and all hang together by faces.
    fn check_faces(&self) -> Result<(), TetrahedraFault> {
        let mut sides: HashMap<[u32; 3], [Option<u32>; 2]> = HashMap::with_capacity(2 * self.corners.len());
        let mut parent: Vec<u32> = (0..self.corners.len() as u32).collect();
        for (number, face) in self.faces().enumerate() {
            let tetrahedron = (number / FACES.len()) as u32;
            let both = sides.entry(sorted(face)).or_default();
            let side = &mut both[usize::from(is_even(face))];
            if side.is_some() {
                return Err(TetrahedraFault::NotManifold { tetrahedron: tetrahedron as usize });
            }
            *side = Some(tetrahedron);
            if let [Some(a), Some(b)] = *both {
                let (a, b) = (root(&mut parent, a), root(&mut parent, b));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
        let pieces = (0..).zip(&parent).filter(|(at, parent)| at == *parent).count();
        if pieces == 1 { Ok(()) } else { Err(TetrahedraFault::Pieces { pieces }) }
    }
}

/// The faces that only one cell has, of the faces of all cells.
#[must_use]
pub fn lone_faces(mut faces: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
    let mut cells: HashMap<[u32; 3], u32> = HashMap::with_capacity(faces.len());
    faces.iter().for_each(|face| *cells.entry(sorted(*face)).or_default() += 1);
    faces.retain(|face| cells[&sorted(*face)] == 1);
    faces
}

fn root(parent: &mut [u32], mut at: u32) -> u32 {
    while parent[at as usize] != at {
        parent[at as usize] = parent[parent[at as usize] as usize];
        at = parent[at as usize];
    }
    at
}

fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// Whether a face goes round in the order of its sorted corners.
fn is_even([a, b, c]: [u32; 3]) -> bool {
    [[a, b, c], [b, c, a], [c, a, b]].contains(&sorted([a, b, c]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of six tetrahedra about its diagonal.
    fn cube() -> Tetrahedra {
        let points = (0..8).map(|bits| DVec3::from_array([0, 1, 2].map(|axis| f64::from(bits >> axis & 1)))).collect();
        let paths = [[1, 2, 4], [2, 4, 1], [4, 1, 2], [2, 1, 4], [4, 2, 1], [1, 4, 2]];
        let turned =
            |corners: [u32; 4], odd: bool| if odd { [corners[0], corners[2], corners[1], corners[3]] } else { corners };
        let of = |(at, [a, b, _]): (usize, [u32; 3])| turned([0, a, a | b, 7], at >= 3);
        Tetrahedra { points, corners: paths.into_iter().enumerate().map(of).collect(), regions: vec![] }
    }

    #[test]
    fn a_cube_of_six_has_its_volume_and_its_surface() {
        let cube = cube();
        assert_eq!(cube.check(), Ok(()));
        let volume: f64 = (0..6).map(|at| cube.volume_m3(at)).sum();
        let surface = cube.surface();
        assert!((volume - 1.0).abs() < 1e-15 && (surface.volume_m3() - 1.0).abs() < 1e-15);
        assert_eq!((surface.points.len(), surface.triangles.len()), (8, 12));
        assert!(crate::is_closed(&surface));
    }

    #[test]
    fn each_fault_is_named_with_its_place() {
        let with = |change: fn(&mut Tetrahedra)| {
            let mut mesh = cube();
            change(&mut mesh);
            mesh.check().map_err(|fault| fault.to_string()).err().unwrap_or_default()
        };
        assert_eq!(with(|mesh| mesh.corners.clear()), "it has no tetrahedra");
        assert!(with(|mesh| mesh.corners[2].swap(0, 1)).starts_with("tetrahedron 3 is inverted"));
        assert!(
            with(|mesh| mesh.corners[1][3] = 8)
                .contains("tetrahedron 2 has a corner that does not exist: point 9 of 8")
        );
        assert!(with(|mesh| mesh.corners[1][3] = u32::MAX).contains("point 4294967296 of 8"));
        assert_eq!(with(|mesh| mesh.points[4].y = f64::NAN), "point 5 is not finite");
        assert_eq!(with(|mesh| mesh.points.push(DVec3::ONE)), "point 9 belongs to no tetrahedron");
        assert!(with(|mesh| mesh.corners.push(mesh.corners[0])).starts_with("tetrahedron 7 is not manifold"));
        assert!(with(|mesh| mesh.points[7] = DVec3::new(1.0, 1.0, 0.0)).contains("flat"));
        assert!(with(|mesh| mesh.regions = vec![1]).contains("1 regions for 6"));
        let twice = |mesh: &mut Tetrahedra| {
            let far: Vec<DVec3> = mesh.points.iter().map(|point| *point + DVec3::X * 5.0).collect();
            mesh.corners.extend(mesh.corners.clone().iter().map(|corners| corners.map(|corner| corner + 8)));
            mesh.points.extend(far);
        };
        assert!(with(twice).starts_with("it has 2 separate pieces"));
    }
}
