//! The order in which vertices are removed from a mesh.
//!
//! In: a welded mesh, positions to keep. Out: a [`ProgressiveMesh`]. Never here: cuts.
//! Each position waits in a heap with its cheapest valid collapse; positions with changed neighbours are evaluated again.

use super::quadric::Quadric;
use super::topology::{HUB, Surface, Verdict, direction};
use super::weld::{SAME_PLACE, Welded};
use super::{Cut, ProgressiveMesh, error};
use glam::{DVec3, Vec3};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Limits on the turn of faces in a collapse, as cosines: first limited, in the last pass unlimited.
const TURNS: [f64; 2] = [0.2, -2.0];
/// Weight of a border relative to a surface of the same width.
const RIM_WEIGHT: f64 = 4.0;
/// Cost of a collapse for its length alone, as a fraction of the cost of a deviation by that length: flat regions thin out evenly.
const LENGTH_SHARE: f64 = 1e-4;

/// A queued collapse: the bits of its cost (non-negative, so they sort like it), the position removed, the one it moves to, the evaluation
/// count.
type QueuedCollapse = Reverse<(u64, u32, u32, u32)>;

struct Builder {
    surface: Surface,
    /// Wedges of each triangle after the collapses so far.
    corners: Vec<[u32; 3]>,
    /// The normal of each wedge.
    normals: Vec<Vec3>,
    /// Wedges at each position.
    wedges: Vec<Vec<u32>>,
    quadrics: Vec<Quadric>,
    /// The substitute of each wedge; itself until it is removed.
    substitutes: Vec<u32>,
    /// The collapse at which each triangle vanished, counted from 1; 0 while it exists.
    gone: Vec<u32>,
    /// Positions in the order of removal.
    order: Vec<u32>,
    /// Positions that are never removed.
    kept: Vec<u32>,
    heap: BinaryHeap<QueuedCollapse>,
    /// Evaluations of each position: a queued collapse of an earlier evaluation is void.
    evaluations: Vec<u32>,
    neighbours: Vec<(u32, u8)>,
    prices: Vec<(f64, u32)>,
}

/// Computes the order of a mesh in which the positions `kept` are never removed.
pub(super) fn ordered(welded: &Welded, kept: &[u32]) -> ProgressiveMesh {
    let mut builder = Builder::new(welded, kept.to_vec());
    for turn in TURNS {
        builder.collapse_all(turn);
    }
    let mut tom = builder.sorted(welded);
    tom.least = tom.triangles.partition_point(|t| tom.birth(*t) == 0) as u32;
    let finer = tom.triangles.get(tom.least as usize);
    let vertices = finer.map_or(tom.vertices.len() as u32, |t| tom.birth(*t));
    tom.coarsest = Cut { vertices, triangles: tom.least };
    tom.errors = error::table(&tom);
    tom
}

impl Builder {
    fn new(welded: &Welded, kept: Vec<u32>) -> Self {
        let points: Vec<DVec3> = welded.places.iter().map(|p| p.as_dvec3()).collect();
        let count = points.len();
        let triangles = welded.triangles.iter().map(|t| t.map(|w| welded.place_of[w as usize])).collect();
        let mut wedges = vec![Vec::new(); count];
        welded.place_of.iter().enumerate().for_each(|(w, &p)| wedges[p as usize].push(w as u32));
        let surface = Surface::new(points, triangles);
        Self {
            quadrics: quadrics(&surface),
            corners: welded.triangles.clone(),
            normals: welded.wedges.iter().map(|w| w.normal).collect(),
            wedges,
            substitutes: (0..welded.wedges.len() as u32).collect(),
            gone: vec![0; surface.triangles.len()],
            order: Vec::with_capacity(count),
            kept,
            heap: BinaryHeap::with_capacity(2 * count),
            evaluations: vec![0; count],
            neighbours: Vec::new(),
            prices: Vec::new(),
            surface,
        }
    }

    /// Collapses until no valid collapse is left.
    fn collapse_all(&mut self, turn: f64) {
        (0..self.evaluations.len() as u32).for_each(|p| self.queue_cheapest(p, turn));
        while let Some(Reverse((_, u, v, evaluation))) = self.heap.pop() {
            if self.evaluations[u as usize] != evaluation {
                continue;
            }
            // positions two edges away may have changed since
            let mut of_u = std::mem::take(&mut self.neighbours);
            self.surface.neighbours(u, &mut of_u);
            let sound = self.surface.verdict(u, &of_u, v, turn).is_some();
            self.neighbours = of_u;
            if sound {
                self.collapse(u, v, turn);
            } else {
                self.queue_cheapest(u, turn);
            }
        }
    }

    /// Finds the cheapest valid collapse of `p` and queues it.
    fn queue_cheapest(&mut self, p: u32, turn: f64) {
        self.evaluations[p as usize] += 1;
        if self.surface.around[p as usize].is_empty() || self.surface.is_hub(p) || self.kept.contains(&p) {
            return;
        }
        let mut neighbours = std::mem::take(&mut self.neighbours);
        self.surface.neighbours(p, &mut neighbours);
        self.prices.clear();
        let area: f64 = self.surface.around[p as usize].iter().map(|&t| self.area(t)).sum();
        for &(to, _) in &neighbours {
            let (from, at) = (self.surface.points[p as usize], self.surface.points[to as usize]);
            let slide = LENGTH_SHARE * area * from.distance_squared(at);
            self.prices.push((self.quadrics[p as usize].at(at) + slide, to));
        }
        self.prices.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let judged = |&(price, to): &(f64, u32)| Some((price, to, self.surface.verdict(p, &neighbours, to, turn)?));
        let found = self.prices.iter().find_map(judged);
        self.neighbours = neighbours;
        let Some((price, to, verdict)) = found else { return };
        let price = if verdict == Verdict::Vanishes { price + self.loss(p, to) } else { price };
        self.heap.push(Reverse((price.to_bits(), p, to, self.evaluations[p as usize])));
    }

    /// Cost of the triangles that a small part loses: all of their area deviates by the collapse's length.
    fn loss(&self, u: u32, v: u32) -> f64 {
        let both = |t: &&u32| self.surface.triangles[**t as usize].contains(&v);
        let area: f64 = self.surface.around[u as usize].iter().filter(both).map(|&t| self.area(t)).sum();
        area * self.surface.points[u as usize].distance_squared(self.surface.points[v as usize])
    }

    fn area(&self, t: u32) -> f64 {
        let [a, b, c] = self.surface.triangles[t as usize].map(|p| self.surface.points[p as usize]);
        0.5 * (b - a).cross(c - a).length()
    }

    fn collapse(&mut self, u: u32, v: u32, turn: f64) {
        self.substitute_wedges(u, v);
        self.order.push(u);
        let step = self.order.len() as u32;
        let mut touched = std::mem::take(&mut self.neighbours);
        self.surface.neighbours(u, &mut touched);
        let (gone, surface) = (&mut self.gone, &mut self.surface);
        surface.collapse(u, v, |t| gone[t as usize] = step);
        let of_u = self.quadrics[u as usize];
        self.quadrics[v as usize] += of_u;
        self.evaluations[u as usize] += 1;
        let mut around: Vec<u32> = touched.iter().map(|(p, _)| *p).collect();
        // neighbours of a hub that are not neighbours of `u` see no change of the hub
        if !self.surface.is_hub(v) {
            self.surface.neighbours(v, &mut touched);
            around.extend(touched.iter().map(|(p, _)| *p).filter(|p| !around.contains(p)).collect::<Vec<_>>());
        }
        self.neighbours = touched;
        for p in around {
            match self.surface.around[p as usize].is_empty() {
                true if p == v => {}
                true => self.strand(p, v),
                false => self.queue_cheapest(p, turn),
            }
        }
        if self.surface.around[v as usize].is_empty() {
            self.strand(v, v);
        }
    }

    /// A position without triangles is removed immediately; the last of its part keeps its place.
    fn strand(&mut self, p: u32, v: u32) {
        self.evaluations[p as usize] += 1;
        self.order.push(p);
        for &w in &self.wedges[p as usize] {
            self.substitutes[w as usize] = if p == v { w } else { self.wedges[v as usize][0] };
        }
    }

    /// Assigns to every wedge of `u` the wedge of `v` on its side of the crease, else the one with the nearest normal (for a hub only among
    /// the first).
    fn substitute_wedges(&mut self, u: u32, v: u32) {
        let place = |t: u32, i: usize| self.surface.triangles[t as usize][i];
        let mut pairs: Vec<(u32, u32)> = Vec::with_capacity(self.wedges[u as usize].len());
        for &w in &self.wedges[u as usize] {
            let beside = self.surface.around[u as usize].iter().find_map(|&t| {
                let corners = self.corners[t as usize];
                let own = (0..3).any(|i| corners[i] == w);
                (0..3).find(|&i| own && place(t, i) == v).map(|i| corners[i])
            });
            let alike = |to: &&u32| self.normals[w as usize].dot(self.normals[**to as usize]);
            let some = || self.wedges[v as usize].iter().take(HUB);
            let nearest = || some().max_by(|a, b| alike(a).total_cmp(&alike(b))).copied();
            pairs.push((w, beside.or_else(nearest).unwrap_or(w)));
        }
        for &(w, to) in &pairs {
            self.substitutes[w as usize] = to;
        }
        for &t in &self.surface.around[u as usize] {
            let renamed = |w: u32| pairs.iter().find(|(from, _)| *from == w).map_or(w, |(_, to)| *to);
            self.corners[t as usize] = self.corners[t as usize].map(renamed);
        }
    }

    /// The finished mesh: vertices and triangles removed last come first.
    fn sorted(&self, welded: &Welded) -> ProgressiveMesh {
        let mut went = vec![false; self.wedges.len()];
        self.order.iter().for_each(|&p| went[p as usize] = true);
        let stay = (0..self.wedges.len() as u32).filter(|&p| !went[p as usize]);
        let places: Vec<u32> = stay.chain(self.order.iter().rev().copied()).collect();
        let mut number = vec![0_u32; welded.wedges.len()];
        let wedges: Vec<u32> = places.iter().flat_map(|&p| self.wedges[p as usize].iter().copied()).collect();
        wedges.iter().enumerate().for_each(|(new, &old)| number[old as usize] = new as u32);
        let substitute = |&old: &u32| {
            let later = self.wedges[welded.place_of[old as usize] as usize][0] != old;
            number[self.substitutes[old as usize] as usize] | if later { SAME_PLACE } else { 0 }
        };
        let mut triangles: Vec<u32> = (0..welded.triangles.len() as u32).collect();
        // remaining triangles (0) first, then the last to vanish
        triangles.sort_by_key(|&t| Reverse(self.gone[t as usize].wrapping_sub(1)));
        ProgressiveMesh {
            vertices: wedges.iter().map(|&w| welded.wedges[w as usize]).collect(),
            triangles: triangles.iter().map(|&t| welded.triangles[t as usize].map(|w| number[w as usize])).collect(),
            substitutes: wedges.iter().map(substitute).collect(),
            coarsest: Cut { vertices: 0, triangles: 0 },
            least: 0,
            errors: Vec::new(),
            losses: Default::default(),
        }
    }
}

/// Initial quadric of every position: the planes of its triangles weighted by area, and at a border the planes perpendicular to it.
fn quadrics(surface: &Surface) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::default(); surface.points.len()];
    for t in &surface.triangles {
        let corners = t.map(|p| surface.points[p as usize]);
        let Some(normal) = direction(corners) else { continue };
        let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
        t.iter().for_each(|&p| quadrics[p as usize] += Quadric::plane(normal, corners[0], area / 3.0));
        for i in 0..3 {
            let (p, q) = (t[i], t[(i + 1) % 3]);
            let open = surface.sharing(p, q) == 1;
            let edge = corners[(i + 1) % 3] - corners[i];
            if let (true, Some(upright)) = (open, edge.cross(normal).try_normalize()) {
                let plane = Quadric::plane(upright, corners[i], RIM_WEIGHT * edge.length_squared());
                [p, q].iter().for_each(|&p| quadrics[p as usize] += plane);
            }
        }
    }
    quadrics
}
