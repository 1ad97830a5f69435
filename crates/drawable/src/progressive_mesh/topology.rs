//! Validity of a collapse: whether a position may move to another's place without damaging the surface.
//!
//! In: triangles around positions. Out: a verdict. Never here: cost.
//! A surface without branches keeps its topology under a collapse that meets the link condition (DEGN99): every common neighbour of both
//! ends forms a triangle with them; a boundary shrinks along itself and never below three edges. Smaller parts, the last few triangles of a
//! disconnected component, may vanish.

use glam::DVec3;
use std::collections::HashMap;

/// A position of more triangles than this is a hub: it stays until it has fewer, and its triangles are not enumerated. This keeps the time
/// for a fan of n triangles proportional to n.
pub(super) const HUB: usize = 64;
/// Most positions of a component that may vanish: a tetrahedron's.
const TINY: usize = 4;
/// A triangle flatter than this, height to longest side, has no normal.
const FLAT: f64 = 1e-6;

/// Triangles and neighbourhoods of each position after the collapses so far.
#[derive(Debug)]
pub(super) struct Surface {
    /// Positions.
    pub points: Vec<DVec3>,
    /// Positions of each triangle; those of a removed triangle no longer change.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles around each position; around a hub also some removed ones.
    pub around: Vec<Vec<u32>>,
    /// Number of remaining triangles.
    pub left: usize,
    /// Whether each triangle remains.
    stands: Vec<bool>,
    /// Number of removed triangles still listed around each position.
    stale: Vec<u32>,
    /// Number of triangles that share each edge; the lesser position first.
    edges: HashMap<[u32; 2], u32>,
    /// Number of edges at each position with one triangle, and with more than two.
    uneven: Vec<[u32; 2]>,
}

/// Kind of a position by the triangles around it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Standing {
    /// Interior.
    Inner,
    /// On a border.
    Rim,
    /// Where surfaces branch or borders cross.
    Branch,
}

/// A valid collapse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// The surface keeps its topology.
    Keeps,
    /// A small component loses some of its last triangles.
    Vanishes,
}

impl Surface {
    pub fn new(points: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        let (count, left) = (points.len(), triangles.len());
        let mut surface = Self {
            points,
            around: vec![Vec::new(); count],
            left,
            stands: vec![true; left],
            stale: vec![0; count],
            edges: HashMap::with_capacity(left / 2 * 3),
            uneven: vec![[0; 2]; count],
            triangles: Vec::new(),
        };
        for (number, &[a, b, c]) in triangles.iter().enumerate() {
            [a, b, c].iter().for_each(|&p| surface.around[p as usize].push(number as u32));
            [[a, b], [b, c], [c, a]].iter().for_each(|&edge| surface.share(edge, 1));
        }
        Self { triangles, ..surface }
    }

    /// Number of triangles that share the edge between two positions; 0 where there is none.
    pub fn sharing(&self, a: u32, b: u32) -> u32 {
        self.edges.get(&[a.min(b), a.max(b)]).copied().unwrap_or(0)
    }

    /// Whether a position has too many triangles to enumerate.
    pub fn is_hub(&self, p: u32) -> bool {
        self.around[p as usize].len() > HUB
    }

    /// Changes an edge's number of triangles by `by`.
    fn share(&mut self, [a, b]: [u32; 2], by: i32) {
        let edge = [a.min(b), a.max(b)];
        let count = self.edges.entry(edge).or_default();
        let before = *count;
        let now = before.saturating_add_signed(by);
        *count = now;
        if now == 0 {
            self.edges.remove(&edge);
        }
        for p in edge {
            let [rims, branches] = &mut self.uneven[p as usize];
            *rims = *rims + u32::from(now == 1) - u32::from(before == 1);
            *branches = *branches + u32::from(now > 2) - u32::from(before > 2);
        }
    }

    /// Every neighbour of `p`, which must not be a hub, with the number of triangles on their edge, into `found`.
    pub fn neighbours(&self, p: u32, found: &mut Vec<(u32, u8)>) {
        found.clear();
        let corners = self.around[p as usize].iter().flat_map(|&t| self.triangles[t as usize]);
        for other in corners.filter(|&other| other != p) {
            match found.iter_mut().find(|(known, _)| *known == other) {
                Some((_, count)) => *count = count.saturating_add(1),
                None => found.push((other, 1)),
            }
        }
    }

    /// Whether `u`, which is not a hub and has the neighbours `of_u`, may collapse onto `v`; faces may turn until the cosine is `turn`.
    pub fn verdict(&self, u: u32, of_u: &[(u32, u8)], v: u32, turn: f64) -> Option<Verdict> {
        let shared = self.sharing(u, v);
        let tiny = self.is_tiny(u, v);
        if shared == 0 || tiny && self.left <= shared as usize {
            return None;
        }
        let keeps = tiny || self.keeps_kind(u, of_u, v, shared);
        let sound = keeps && self.keeps_faces(u, v, if tiny { -2.0 } else { turn });
        sound.then_some(if tiny { Verdict::Vanishes } else { Verdict::Keeps })
    }

    /// Whether the component of `u` and `v` has at most [`TINY`] positions.
    fn is_tiny(&self, u: u32, v: u32) -> bool {
        if self.is_hub(u) || self.is_hub(v) {
            return false;
        }
        let mut part = Vec::with_capacity(TINY + 1);
        let corners = |p: u32| self.around[p as usize].iter().flat_map(|&t| self.triangles[t as usize]);
        for p in corners(u).chain(corners(v)) {
            if !part.contains(&p) {
                part.push(p);
            }
            if part.len() > TINY {
                return false;
            }
        }
        part.iter().all(|&p| !self.is_hub(p) && corners(p).all(|q| part.contains(&q)))
    }

    fn keeps_kind(&self, u: u32, of_u: &[(u32, u8)], v: u32, shared: u32) -> bool {
        let common = || of_u.iter().filter(|(p, _)| self.sharing(*p, v) > 0).count();
        match (self.standing(u), self.standing(v)) {
            (Standing::Branch, other) => other == Standing::Branch,
            (Standing::Inner, _) => shared == 2 && common() == 2,
            (Standing::Rim, Standing::Inner) => false,
            (Standing::Rim, at_v) => {
                let beyond = of_u.iter().find(|(p, count)| *count == 1 && *p != v);
                let closes = at_v == Standing::Rim && beyond.is_some_and(|(p, _)| self.sharing(*p, v) == 1);
                shared == 1 && common() == 1 && !closes
            }
        }
    }

    fn standing(&self, p: u32) -> Standing {
        match self.uneven[p as usize] {
            [0, 0] => Standing::Inner,
            [2, 0] => Standing::Rim,
            _ => Standing::Branch,
        }
    }

    /// Whether the faces that move with `u` keep an area and do not flip.
    fn keeps_faces(&self, u: u32, v: u32, turn: f64) -> bool {
        self.around[u as usize].iter().all(|&t| {
            let t = self.triangles[t as usize];
            if t.contains(&v) {
                return true;
            }
            let before = t.map(|p| self.points[p as usize]);
            let after = t.map(|p| self.points[if p == u { v } else { p } as usize]);
            let (from, to) = (direction(before), direction(after));
            match (from, to) {
                (_, None) => from.is_none(),
                (None, Some(_)) => true,
                (Some(from), Some(to)) => from.dot(to) >= turn,
            }
        })
    }

    /// Collapses `u`, which must not be a hub, onto `v`: moves its triangles, and calls `gone` with each that vanishes.
    pub fn collapse(&mut self, u: u32, v: u32, mut gone: impl FnMut(u32)) {
        for number in std::mem::take(&mut self.around[u as usize]) {
            let t = self.triangles[number as usize];
            let others = t.into_iter().filter(|&p| p != u);
            others.clone().for_each(|p| self.share([u, p], -1));
            if t.contains(&v) {
                others.clone().filter(|&p| p != v).for_each(|p| self.share([p, v], -1));
                self.stands[number as usize] = false;
                others.for_each(|p| self.forget(p, number));
                self.left -= 1;
                gone(number);
            } else {
                others.for_each(|p| self.share([p, v], 1));
                self.triangles[number as usize] = t.map(|p| if p == u { v } else { p });
                self.around[v as usize].push(number);
            }
        }
    }

    /// Removes a vanished triangle from the list around `p`. A long list is compacted only when half of it has vanished.
    fn forget(&mut self, p: u32, number: u32) {
        let (around, stale) = (&mut self.around[p as usize], &mut self.stale[p as usize]);
        if around.len() <= HUB {
            around.retain(|&other| other != number);
            return;
        }
        *stale += 1;
        if 2 * *stale as usize >= around.len() {
            around.retain(|&other| self.stands[other as usize]);
            *stale = 0;
        }
    }
}

/// The unit normal of a triangle; `None` where it is too flat.
pub(super) fn direction([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let normal = (b - a).cross(c - a);
    let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
    let area = normal.length();
    (area > FLAT * longest).then(|| normal / area)
}
