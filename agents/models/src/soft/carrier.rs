//! The carrier of a skin: the cage of a closed surface, or the lattice of a sheet or a rope.
//!
//! In: a specification and an ε. Out: nodes in material coordinates, the mesh between them, the nodes that carry any material point.
//! Never here: where anything is now, when ε changes. Theory: docs/theory/soft.md, eq. 16, 17, 23.
//!
//! Material coordinates are positions at rest in the body's own axes; of a rope, the length from its start.

use super::fe_mesh::{FeMesh, closed_surface};
use super::lattice::{Lattice, counts_at};
use super::spec::{SoftShape, SoftSpec, VERTICES_MAX};
use glam::{DQuat, DVec3};
use metachron_geometry::{Cage, Carried, SurfaceShape, Triangles, cage_counts};

/// The carrier of a skin.
pub(super) enum Carrier {
    Cage(Cage),
    Lattice(Lattice),
}

/// The points of a skin, as their carrier needs them.
pub(super) struct SkinPoints {
    /// Positions at rest in the body's own axes, metres.
    pub rest: Vec<DVec3>,
    /// Material coordinates, metres.
    pub material: Vec<DVec3>,
    /// The mean direction into the body at each point at rest; of length 1, or none.
    pub inward: Vec<DVec3>,
    /// The skin as others touch it.
    pub surface: SurfaceShape,
}

impl Carrier {
    /// The carrier of the skin of `spec` with cells of at most `eps_m`, those of a cage halved about some of its points; `None` where there can be
    /// none.
    pub fn new(spec: &SoftSpec, eps_m: f64, halved_m: &[DVec3]) -> Option<Self> {
        match &spec.shape {
            SoftShape::Embedded { surface, .. } => {
                Cage::halved(surface, eps_m, VERTICES_MAX as usize, spec.halving(halved_m)).map(Self::Cage)
            }
            shape => Lattice::of(shape.divided_by(eps_m)?).map(Self::Lattice),
        }
    }

    /// Whether [`Self::new`] would make the same of these.
    pub fn is_as_wanted(&self, spec: &SoftSpec, eps_m: f64, halved_m: &[DVec3]) -> bool {
        match (self, &spec.shape) {
            (Self::Cage(cage), SoftShape::Embedded { surface, .. }) => {
                cage.counts() == cage_counts(surface, eps_m) && cage.is_halved(spec.halving(halved_m))
            }
            (Self::Lattice(lattice), shape) => counts_at(shape, eps_m) == Some(lattice.counts()),
            (Self::Cage(_), _) => false,
        }
    }

    /// The elements between its nodes.
    pub fn mesh(&self, spec: &SoftSpec) -> FeMesh {
        match self {
            Self::Cage(cage) => FeMesh::caged(cage, spec),
            Self::Lattice(lattice) => FeMesh::new(lattice.shape(), spec),
        }
    }

    /// The sheet or rope with the segments that are its cells; `None` of a cage.
    pub const fn lattice(&self) -> Option<&SoftShape> {
        match self {
            Self::Cage(_) => None,
            Self::Lattice(lattice) => Some(lattice.shape()),
        }
    }

    /// The number of the cell that a point of the skin belongs to, on the side of the unit vector `inward`, among the
    /// cells that are left; `None` where that of a lattice is gone.
    pub fn cell_under(&self, material_m: DVec3, inward: DVec3) -> Option<usize> {
        match self {
            Self::Cage(cage) => Some(cage.cell_under(material_m, inward)),
            Self::Lattice(lattice) => lattice.triangle_at(material_m),
        }
    }

    /// Takes cells away, by their numbers among the cells that are left: these are numbered anew in the same order.
    pub fn remove(&mut self, is_gone: &[bool]) {
        match self {
            Self::Cage(cage) => cage.remove(is_gone),
            Self::Lattice(lattice) => lattice.remove(is_gone),
        }
    }

    /// The nodes in material coordinates, metres.
    pub fn nodes_m(&self) -> &[DVec3] {
        match self {
            Self::Cage(cage) => cage.nodes_m(),
            Self::Lattice(lattice) => lattice.nodes_m(),
        }
    }

    /// The greatest length of a cell, metres.
    pub fn cell_m(&self) -> f64 {
        match self {
            Self::Cage(cage) => cage.cell_m().max_element(),
            Self::Lattice(lattice) => lattice.cell_m(),
        }
    }

    /// How a point of the skin moves with the nodes; `inward` tells two cells of a cage apart.
    pub fn carry(&self, material_m: DVec3, inward: DVec3) -> Carried {
        match self {
            Self::Cage(cage) => cage.carry(material_m, inward),
            Self::Lattice(lattice) => lattice.carry(material_m),
        }
    }

    /// The nodes' values at a material point that may be beyond them: trilinear in the cells of a cage, linear past them.
    pub fn interpolate(&self, material_m: DVec3, list: &[DVec3]) -> DVec3 {
        match self {
            Self::Cage(cage) => interpolate_in(cage, material_m, list),
            Self::Lattice(lattice) => lattice.carry(material_m).mean(list),
        }
    }

    /// The rotations of its cells, of which it has `turns`, at the middles of the cells of another one; none of a lattice.
    pub fn turns_at(&self, turns: &[DQuat], other: &Self) -> Vec<DQuat> {
        let (Self::Cage(own), Self::Cage(other)) = (self, other) else { return vec![] };
        let nodes = other.nodes_m();
        let middle = |corners: &[u32; 8]| 0.5 * (nodes[corners[0] as usize] + nodes[corners[7] as usize]);
        other.cells().iter().map(|cell| turns[own.cell_at(middle(&cell.corners))]).collect()
    }
}

fn interpolate_in(cage: &Cage, at_m: DVec3, list: &[DVec3]) -> DVec3 {
    let (cell, share) = cage.locate(at_m);
    let inner = share.clamp(DVec3::ZERO, DVec3::ONE);
    let beyond = share - inner;
    let along = |axis: usize, bits: usize| if bits >> axis & 1 == 1 { inner[axis] } else { 1.0 - inner[axis] };
    let mut sum = DVec3::ZERO;
    for (bits, node) in cell.corners.iter().enumerate() {
        let [x, y, z] = [0, 1, 2].map(|axis| along(axis, bits));
        let slope = |axis: usize| if bits >> axis & 1 == 1 { beyond[axis] } else { -beyond[axis] };
        let weight = x * y * z + slope(0) * y * z + x * slope(1) * z + x * y * slope(2);
        sum += list[*node as usize] * weight;
    }
    sum
}

impl SkinPoints {
    /// The points of a body whose skin does not change with its cells: of a closed surface its points, of a sheet or a
    /// rope the vertices of the lattice that its shape names.
    pub fn of(spec: &SoftSpec) -> Self {
        if let SoftShape::Embedded { surface, .. } = &spec.shape {
            let inward = inward_of(surface);
            let (rest, material) = (surface.points.clone(), surface.points.clone());
            return Self { rest, material, inward, surface: closed_surface(surface) };
        }
        let mesh = FeMesh::new(&spec.shape, spec);
        let material = Lattice::of(spec.shape.clone()).map_or_else(Vec::new, |lattice| lattice.nodes_m().to_vec());
        Self { inward: vec![DVec3::ZERO; material.len()], material, surface: mesh.surface(), rest: mesh.rest }
    }
}

/// The mean direction into the body at each point of a surface.
fn inward_of(surface: &Triangles) -> Vec<DVec3> {
    let mut inward = vec![DVec3::ZERO; surface.points.len()];
    for corners in &surface.triangles {
        let into = into_body(corners.map(|corner| surface.points[corner as usize]));
        corners.iter().for_each(|corner| inward[*corner as usize] += into);
    }
    inward.iter_mut().for_each(|into| *into = into.normalize_or_zero());
    inward
}

/// The direction into the body at a triangle, by twice its area.
pub(super) fn into_body([a, b, c]: [DVec3; 3]) -> DVec3 {
    (c - a).cross(b - a)
}
