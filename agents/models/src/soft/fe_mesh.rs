//! Division of a soft body: vertices at rest, their masses, the elements between them, its skin.
//!
//! In: a shape and its material. Out: a [`FeMesh`], until ε changes or cells are removed. Never here: where the vertices are now.

use super::bar::Bar;
use super::bending::BendingElement;
use super::grid::{Grid, Side};
use super::hexahedron::{Hexahedron, HexahedronKind};
use super::material::Law;
use super::membrane::Membrane;
use super::shell_bending::ShellBending;
use super::spec::{SoftMaterial, SoftShape, SoftSpec};
use super::system::System;
use super::tetrahedron::Tetrahedron;
use glam::{DQuat, DVec3};
use metachron_geometry::narrow_phase::VoronoiRegions;
use metachron_geometry::{Cage, CageCell, HangingNode, SurfaceShape, Triangles, near_triangle};

/// How near the surface comes to nodes that hold it, as a share of the finest ε.
const HELD_SHARE: f64 = 0.5;

/// A divided soft body.
#[derive(Debug, Clone, Default)]
pub(super) struct FeMesh {
    /// Positions of the vertices at rest, in the body's own axes, metres.
    pub rest: Vec<DVec3>,
    /// Mass of each vertex, kg.
    pub mass_kg: Vec<f64>,
    /// Whether each vertex is fixed.
    pub held: Vec<bool>,
    /// The vertices that move with others, by rising numbers.
    pub(super) hanging: Vec<HangingNode>,
    bars: Vec<Bar>,
    pub(super) membranes: Vec<Membrane>,
    pub(super) bending: Vec<BendingElement>,
    pub(super) shells: Vec<ShellBending>,
    pub(super) tetrahedra: Vec<Tetrahedron>,
    /// The materials of the tetrahedra.
    pub(super) laws: Vec<Law>,
    pub(super) hexahedra: Vec<Hexahedron>,
    kinds: Vec<HexahedronKind>,
    /// Three vertices in a row, and the distance of the middle one from the line at rest, metres.
    pub(super) rows: Vec<([u32; 3], f64)>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// The edges of its skin; of a cage the edges of its cells.
    pub(super) edges: Vec<[u32; 2]>,
    /// Pairs of vertices whose distance says how far a step bends the body, where its edges do not say all.
    pub(super) stretched: Vec<[u32; 2]>,
    pub(super) radius_m: f64,
}

impl FeMesh {
    /// Divides the body of `spec` into the cells of `cage`.
    pub fn caged(cage: &Cage, spec: &SoftSpec) -> Self {
        let count = cage.nodes_m().len();
        let mut mesh = Self {
            rest: cage.nodes_m().to_vec(),
            mass_kg: vec![0.0; count],
            held: vec![false; count],
            ..Self::default()
        };
        spec.held.iter().for_each(|side| mesh.hold_cage(cage, *side, &spec.shape));
        let place = |bits: usize| DVec3::from_array([0, 1, 2].map(|axis| (bits >> axis & 1) as f64));
        let kind =
            |length_m: DVec3| HexahedronKind::new(std::array::from_fn(|bits| place(bits) * length_m), &spec.material);
        mesh.kinds.push(kind(cage.cell_m()));
        if cage.cells().iter().any(|cell| cell.is_half) {
            mesh.kinds.push(kind(cage.cell_m() * 0.5));
        }
        for CageCell { corners, fill, volumes_m3, is_half } in cage.cells() {
            let mass_kg = volumes_m3.map(|volume| volume * spec.material.density_kg_m3);
            corners.iter().zip(mass_kg).for_each(|(node, mass)| mesh.mass_kg[*node as usize] += mass);
            mesh.hexahedra.push(Hexahedron {
                vertices: *corners,
                kind: usize::from(*is_half),
                fill: *fill,
                mass_kg,
                turn: DQuat::IDENTITY,
            });
            let of_axis = |axis: usize| {
                (0..8).filter(move |bits| bits >> axis & 1 == 0).map(move |bits| [bits, bits | 1 << axis])
            };
            mesh.edges.extend((0..3).flat_map(of_axis).map(|ends| ends.map(|bits: usize| corners[bits])));
        }
        mesh.edges.sort_unstable();
        mesh.edges.dedup();
        // a cage is straight at rest
        mesh.rows = cage.rows().into_iter().map(|row| (row, 0.0)).collect();
        mesh.hang(cage);
        mesh
    }

    /// Lets the nodes of `cage` that hang move with others: these have their masses, and where all of them are held, it is.
    pub(super) fn hang(&mut self, cage: &Cage) {
        self.hanging = cage.hanging().to_vec();
        for HangingNode { node, carried, .. } in &self.hanging {
            let mass = std::mem::take(&mut self.mass_kg[*node as usize]);
            carried.terms().for_each(|(by, weight)| self.mass_kg[by] += mass * weight);
            self.held[*node as usize] = carried.terms().all(|(by, _)| self.held[by]);
        }
    }

    /// Holds the nodes on a side of a cage that the surface comes as near to as half the finest ε, whatever the present one is: a coarse cage
    /// would else be held where the surface in it is not. Where there is none, all on that side.
    fn hold_cage(&mut self, cage: &Cage, side: Side, shape: &SoftShape) {
        let SoftShape::Embedded { surface, range_m, .. } = shape else { return };
        let ((axis, last), near_m) = (side.place(), HELD_SHARE * range_m.0);
        let nodes: Vec<u32> = cage.on_side(axis, last).collect();
        let Some(plane_m) = nodes.first().map(|node| self.rest[*node as usize][axis]) else { return };
        let corners = surface.triangles.iter().map(|corners| corners.map(|corner| surface.points[corner as usize]));
        let is_near = |triangle: &[DVec3; 3]| triangle.iter().any(|at| (at[axis] - plane_m).abs() <= near_m);
        let triangles: Vec<[DVec3; 3]> = corners.filter(is_near).collect();
        let meets = |node: &&u32| {
            let at = self.rest[**node as usize];
            triangles.iter().any(|triangle| near_triangle(at, *triangle).distance(at) <= near_m)
        };
        let met: Vec<u32> = nodes.iter().filter(meets).copied().collect();
        let held = if met.is_empty() { nodes } else { met };
        held.into_iter().for_each(|node| self.held[node as usize] = true);
    }

    /// Divides the body of `spec` into the lattice of `shape`: its own, or the same with other segments.
    pub fn new(shape: &SoftShape, spec: &SoftSpec) -> Self {
        let grid = Grid::of(shape);
        let count = grid.count();
        let mut mesh = Self {
            rest: vec![DVec3::ZERO; count],
            mass_kg: vec![0.0; count],
            held: vec![false; count],
            ..Self::default()
        };
        for side in &spec.held {
            grid.on(*side).for_each(|vertex| mesh.held[vertex as usize] = true);
        }
        match shape {
            SoftShape::Sheet { size_m, thickness_m, .. } => mesh.sheet(&grid, *size_m, *thickness_m, &spec.material),
            SoftShape::Box { size_m, .. } => mesh.solid(&grid, &spec.material, |share| *size_m * share),
            SoftShape::Ball { radius_m, .. } => mesh.solid(&grid, &spec.material, |share| ball(share) * *radius_m),
            SoftShape::Embedded { .. } => {} // its mesh is that of a cage
            SoftShape::Tetrahedra { mesh, regions } => return Self::tetrahedral(mesh, regions, spec),
            SoftShape::Shell { surface, thickness_m } => return Self::shell(surface, *thickness_m, spec),
            SoftShape::Rope { path_m, radius_m, .. } => mesh.rope(&grid, path_m, *radius_m, &spec.material),
        }
        let sag = |row: [u32; 3], rest: &[DVec3]| sagitta(row, rest).length();
        mesh.rows = grid.rows().into_iter().map(|row| (row, sag(row, &mesh.rest))).collect();
        mesh
    }

    /// Whether anything holds it: vertices that have lost their mass do not count.
    pub fn is_held(&self) -> bool {
        self.held.iter().zip(&self.mass_kg).any(|(held, mass)| *held && *mass > 0.0)
    }

    /// Lists the edges of all triangles.
    pub(super) fn list_edges(&mut self) {
        self.edges = edges_of(&self.triangles);
    }

    /// Places the vertices of a solid.
    fn place(&mut self, grid: &Grid, place_of: impl Fn(DVec3) -> DVec3) {
        let cells = DVec3::from_array(grid.cells.map(|count| count as f64));
        for place in grid.places() {
            let share = DVec3::from_array(place.map(|count| count as f64)) / cells;
            self.rest[grid.at(place) as usize] = place_of(share);
        }
    }

    fn solid(&mut self, grid: &Grid, material: &SoftMaterial, place_of: impl Fn(DVec3) -> DVec3) {
        self.place(grid, place_of);
        for [i, j, k] in grid.places().filter(|place| (0..3).all(|axis| place[axis] < grid.cells[axis])) {
            let vertices = std::array::from_fn(|bits| grid.at([i + (bits & 1), j + (bits >> 1 & 1), k + (bits >> 2)]));
            let corners: [DVec3; 8] = vertices.map(|vertex: u32| self.rest[vertex as usize]);
            let kind = self.kind_of(corners, material);
            let mass_kg = self.kinds[kind].volumes_m3.map(|volume| volume * material.density_kg_m3);
            vertices.iter().zip(mass_kg).for_each(|(vertex, mass)| self.mass_kg[*vertex as usize] += mass);
            self.hexahedra.push(Hexahedron { vertices, kind, fill: 1.0, mass_kg, turn: DQuat::IDENTITY });
        }
        self.skin(grid);
        self.list_edges();
    }

    /// The kind of a cell with these corners: one for all of equal shape.
    fn kind_of(&mut self, corners: [DVec3; 8], material: &SoftMaterial) -> usize {
        let kind = HexahedronKind::new(corners, material);
        let known = self.kinds.iter().position(|known| known.is_like(&kind));
        known.unwrap_or_else(|| {
            self.kinds.push(kind);
            self.kinds.len() - 1
        })
    }

    /// Lists the triangles of the faces of a solid, counter-clockwise seen from outside.
    fn skin(&mut self, grid: &Grid) {
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (a, b) in (0..grid.cells[u]).flat_map(|a| (0..grid.cells[v]).map(move |b| (a, b))) {
                for last in [false, true] {
                    let at = |du: usize, dv: usize| {
                        let mut place = [0; 3];
                        (place[axis], place[u], place[v]) = (if last { grid.cells[axis] } else { 0 }, a + du, b + dv);
                        grid.at(place)
                    };
                    let [p, q, r, s] = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
                    let halves = if (a + b) % 2 == 0 { [[p, q, r], [p, r, s]] } else { [[p, q, s], [q, r, s]] };
                    let out = |[a, b, c]: [u32; 3]| if last { [a, b, c] } else { [a, c, b] };
                    self.triangles.extend(halves.map(out));
                }
            }
        }
    }

    fn rope(&mut self, grid: &Grid, path_m: &[DVec3], radius_m: f64, material: &SoftMaterial) {
        let count = grid.cells[0];
        let total: f64 = path_m.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        let section = std::f64::consts::PI * radius_m * radius_m;
        let rest_m = total / count as f64;
        self.rest = (0..=count).map(|i| along(path_m, rest_m * i as f64)).collect();
        for i in 0..count as u32 {
            self.bars.push(Bar { ends: [i, i + 1], rest_m, ea_n: material.young_pa * section });
            self.edges.push([i, i + 1]);
            let half = 0.5 * rest_m * section * material.density_kg_m3;
            self.mass_kg[i as usize] += half;
            self.mass_kg[i as usize + 1] += half;
        }
        self.radius_m = radius_m;
    }

    /// The system of this body.
    pub fn system(&mut self, positions: &[DVec3]) -> System {
        let (held, bulky) = (self.held.clone(), self.is_solid());
        let hanging = self.hanging.clone();
        System::new(&held, &hanging, bulky, |system| self.add(positions, system))
    }

    /// Adds the forces and stiffness of all elements at these positions; updates the cells' rotations.
    pub fn add(&mut self, positions: &[DVec3], system: &mut System) {
        self.bars.iter().for_each(|bar| bar.add(positions, system));
        self.membranes.iter().for_each(|membrane| membrane.add(positions, system));
        self.bending.iter().for_each(|element| element.add(positions, system));
        self.shells.iter().for_each(|element| element.add(positions, system));
        for hexahedron in &mut self.hexahedra {
            let kind = &self.kinds[hexahedron.kind];
            let mean = hexahedron.follow(kind, positions);
            hexahedron.add(kind, positions, &mean, system);
        }
        for element in &mut self.tetrahedra {
            let deformation = element.follow(positions);
            element.add(&self.laws[element.material], &deformation, system);
        }
    }

    /// Whether it fills a volume.
    pub fn is_solid(&self) -> bool {
        !(self.hexahedra.is_empty() && self.tetrahedra.is_empty())
    }

    /// The rotations of the cells and tetrahedra, from which they are followed on.
    pub fn turns(&self) -> impl Iterator<Item = DQuat> + '_ {
        let cells = self.hexahedra.iter().map(|cell| cell.turn);
        cells.chain(self.tetrahedra.iter().map(|element| element.turn))
    }

    /// Sets the rotations of the cells back to `turns`.
    pub fn set_turns(&mut self, turns: &[DQuat]) {
        let cells = self.hexahedra.iter_mut().map(|cell| &mut cell.turn);
        let all = cells.chain(self.tetrahedra.iter_mut().map(|element| &mut element.turn));
        all.zip(turns).for_each(|(own, turn)| *own = *turn);
    }

    /// Forgets the rotations of the cells: the next ones depend on these positions alone.
    pub fn begin_turns(&mut self, positions: &[DVec3]) {
        let Self { hexahedra, kinds, tetrahedra, .. } = self;
        hexahedra.iter_mut().for_each(|cell| cell.begin_turn(&kinds[cell.kind], positions));
        tetrahedra.iter_mut().for_each(|element| element.begin_turn(positions));
    }

    /// Elastic energy, J; uses updated rotations of the cells.
    pub fn energy_j(&self, positions: &[DVec3]) -> f64 {
        let bars: f64 = self.bars.iter().map(|bar| bar.energy_j(positions)).sum();
        let membranes: f64 = self.membranes.iter().map(|membrane| membrane.energy_j(positions)).sum();
        let bending: f64 = self.bending.iter().map(|element| element.energy_j(positions)).sum();
        let hexahedra = self.hexahedra.iter().map(|hexahedron| {
            let mut hexahedron = *hexahedron;
            let mean = hexahedron.follow(&self.kinds[hexahedron.kind], positions);
            hexahedron.energy_j(&self.kinds[hexahedron.kind], positions, &mean)
        });
        let tetrahedra = self.tetrahedra.iter().map(|element| {
            let deformation = { *element }.follow(positions);
            element.energy_j(&self.laws[element.material], &deformation)
        });
        let shells: f64 = self.shells.iter().map(|element| element.energy_j(positions)).sum();
        bars + membranes + bending + shells + hexahedra.sum::<f64>() + tetrahedra.sum::<f64>()
    }

    /// The von Mises stress of elastic forces at every vertex, Pa: the mean of the elements around it by volume.
    pub fn von_mises_pa(&self, positions: &[DVec3], material: &SoftMaterial) -> Vec<f64> {
        let mut sums = vec![[0.0; 2]; self.rest.len()];
        let mut add = |vertices: &[u32], volume: f64, stress_pa: f64| {
            for vertex in vertices {
                let [weighted, whole] = &mut sums[*vertex as usize];
                (*weighted, *whole) = (*weighted + volume * stress_pa, *whole + volume);
            }
        };
        for bar in &self.bars {
            add(&bar.ends, bar.rest_m, material.young_pa * bar.strain(positions).abs());
        }
        for membrane in &self.membranes {
            add(membrane.vertices(), membrane.mass_kg().iter().sum(), membrane.von_mises_pa(positions));
        }
        let law = Law::of(material);
        for cell in &self.hexahedra {
            let deformation = { *cell }.deformation(&self.kinds[cell.kind], positions);
            add(&cell.vertices, cell.mass_kg.iter().sum(), deformation.von_mises_pa(&law));
        }
        for element in &self.tetrahedra {
            let deformation = { *element }.follow(positions);
            add(&element.vertices, element.volume_m3, deformation.von_mises_pa(&self.laws[element.material]));
        }
        sums.into_iter().map(|[weighted, whole]| if whole > 0.0 { weighted / whole } else { 0.0 }).collect()
    }

    /// The largest change of sag of three vertices in a row against rest, metres: the error of straight pieces.
    pub fn residual_m(&self, positions: &[DVec3]) -> f64 {
        // a rope bends freely: the loss of a kink is no error
        let slack = self.membranes.is_empty() && !self.is_solid();
        let sag = |(row, rest): &([u32; 3], f64)| {
            let now = sagitta(*row, positions).length();
            let beyond = (now - rest).abs();
            if slack { beyond.min(now) } else { beyond }
        };
        self.rows.iter().map(sag).fold(0.0, f64::max)
    }

    /// The largest change of an edge within `h` seconds at these velocities, as a share of its rest length.
    pub fn edge_change(&self, velocity: impl Fn(u32) -> DVec3, h: f64) -> f64 {
        let share = |&[a, b]: &[u32; 2]| {
            velocity(a).distance(velocity(b)) * h / self.rest[a as usize].distance(self.rest[b as usize])
        };
        let edges = if self.stretched.is_empty() { &self.edges } else { &self.stretched };
        edges.iter().map(share).fold(0.0, f64::max)
    }

    /// The skin of a lattice, as others touch it.
    pub fn surface(&self) -> SurfaceShape {
        let mut on = vec![false; self.rest.len()];
        self.edges.iter().flatten().for_each(|vertex| on[*vertex as usize] = true);
        SurfaceShape {
            edge_m: mean_length_m(&self.edges, &self.rest),
            vertices: (0..on.len() as u32).filter(|vertex| on[*vertex as usize]).collect(),
            edges: self.edges.clone().into(),
            triangles: self.triangles.clone().into(),
            radius_m: self.radius_m,
            closed: self.is_solid(),
            fans: VoronoiRegions::of(&self.edges, &self.triangles).into(),
        }
    }

    /// The radius of a rope, or half the thickness of a sheet, metres; 0 of a solid.
    pub const fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.bars.len() + self.membranes.len() + self.hexahedra.len() + self.tetrahedra.len()
    }
}

/// A closed surface, as others touch it.
pub(super) fn closed_surface(surface: &Triangles) -> SurfaceShape {
    let edges = edges_of(&surface.triangles);
    SurfaceShape {
        edge_m: mean_length_m(&edges, &surface.points),
        vertices: (0..surface.points.len() as u32).collect(),
        fans: VoronoiRegions::of(&edges, &surface.triangles).into(),
        edges: edges.into(),
        triangles: surface.triangles.clone().into(),
        radius_m: 0.0,
        closed: true,
    }
}

impl SoftShape {
    /// The skin of a box or a ball in its own axes, as finely divided as its lattice; `None` for other shapes.
    #[must_use]
    pub fn skin(&self) -> Option<Triangles> {
        skin_of(self)
    }
}

/// The skin of a box or a ball at rest, in its own axes; `None` for other shapes.
fn skin_of(shape: &SoftShape) -> Option<Triangles> {
    let grid = Grid::of(shape);
    let mut mesh = FeMesh { rest: vec![DVec3::ZERO; grid.count()], ..FeMesh::default() };
    match shape {
        SoftShape::Box { size_m, .. } => mesh.place(&grid, |share| *size_m * share),
        SoftShape::Ball { radius_m, .. } => mesh.place(&grid, |share| ball(share) * *radius_m),
        SoftShape::Sheet { .. }
        | SoftShape::Embedded { .. }
        | SoftShape::Tetrahedra { .. }
        | SoftShape::Shell { .. }
        | SoftShape::Rope { .. } => return None,
    }
    mesh.skin(&grid);
    let mut number = vec![u32::MAX; mesh.rest.len()];
    let mut points = vec![];
    for corner in mesh.triangles.iter_mut().flatten() {
        let known = &mut number[*corner as usize];
        if *known == u32::MAX {
            *known = points.len() as u32;
            points.push(mesh.rest[*corner as usize]);
        }
        *corner = *known;
    }
    Some(Triangles { points, triangles: mesh.triangles })
}

/// The edges of all triangles, each once, its lesser vertex first.
pub(super) fn edges_of(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut edges: Vec<_> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

fn mean_length_m(edges: &[[u32; 2]], points: &[DVec3]) -> f64 {
    let lengths = edges.iter().map(|[a, b]| points[*a as usize].distance(points[*b as usize]));
    lengths.sum::<f64>() / edges.len() as f64
}

/// Distance of the middle of three points from the line between the others, metres: an eighth of the second difference.
fn sagitta([a, b, c]: [u32; 3], positions: &[DVec3]) -> DVec3 {
    let [a, b, c] = [a, b, c].map(|vertex| positions[vertex as usize]);
    (a - b * 2.0 + c) * 0.125
}

/// The point of the unit ball for the shares 0 … 1 of a cube: a smooth one-to-one map.
fn ball(share: DVec3) -> DVec3 {
    let p = share * 2.0 - DVec3::ONE;
    let q = p * p;
    let stretched = |a: f64, b: f64| (1.0 - 0.5 * (a + b) + a * b / 3.0).max(0.0).sqrt();
    p * DVec3::new(stretched(q.y, q.z), stretched(q.z, q.x), stretched(q.x, q.y))
}

/// The point of a path at this length from its start.
fn along(path_m: &[DVec3], at_m: f64) -> DVec3 {
    let mut left = at_m;
    for pair in path_m.windows(2) {
        let length = pair[0].distance(pair[1]);
        if left <= length && length > 0.0 {
            return pair[0].lerp(pair[1], left / length);
        }
        left -= length;
    }
    path_m.last().copied().unwrap_or(DVec3::ZERO)
}
