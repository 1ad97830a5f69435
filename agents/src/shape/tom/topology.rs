//! Whether a position may be put in another's place without spoiling the surface.
//!
//! In: triangles around positions. Out: a verdict. Never here: cost.
//! A surface without branches keeps its kind under a collapse that meets the link condition (DEGN99): whoever neighbours both
//! ends forms a triangle with them; a boundary shrinks along itself and never below three edges. What is smaller than that, the
//! last few triangles of a part that hangs on nothing, may vanish.

use glam::DVec3;

/// Most positions of a part that may vanish: a tetrahedron's.
const TINY: usize = 4;
/// A triangle flatter than this, height to longest side, has no direction.
const FLAT: f64 = 1e-6;

/// Triangles and what is around each position, as collapses leave them.
#[derive(Debug)]
pub(super) struct Surface {
    /// Positions.
    pub points: Vec<DVec3>,
    /// Positions of each triangle; those of one that is gone do not change any more.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles around each position.
    pub around: Vec<Vec<u32>>,
    /// How many triangles are left.
    pub left: usize,
}

/// What the triangles around a position make of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Standing {
    /// Surrounded.
    Inner,
    /// On a rim: its two neighbours along it.
    Rim([u32; 2]),
    /// Where surfaces branch or rims cross.
    Branch,
}

/// A collapse that may be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// The surface keeps its kind.
    Keeps,
    /// A small part loses some of its last triangles.
    Vanishes,
}

impl Surface {
    pub fn new(points: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        let mut around = vec![Vec::new(); points.len()];
        for (number, t) in triangles.iter().enumerate() {
            t.iter().for_each(|&p| around[p as usize].push(number as u32));
        }
        let left = triangles.len();
        Self { points, triangles, around, left }
    }

    /// Every neighbour of `p` with the number of triangles on their edge, into `found`.
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

    /// Whether `u` may be put in the place of its neighbour `v`; faces may turn until the cosine is `turn`.
    pub fn verdict(&self, u: u32, v: u32, turn: f64) -> Option<Verdict> {
        let (mut of_u, mut of_v) = (Vec::with_capacity(16), Vec::with_capacity(16));
        self.neighbours(u, &mut of_u);
        self.neighbours(v, &mut of_v);
        let shared = of_u.iter().find(|(p, _)| *p == v)?.1;
        let tiny = self.is_tiny(u, v);
        if tiny && self.left <= usize::from(shared) {
            return None;
        }
        let keeps = tiny || self.keeps_kind((&of_u, standing(&of_u)), (&of_v, standing(&of_v)), (u, v, shared));
        let sound = keeps && self.keeps_faces(u, v, if tiny { -2.0 } else { turn });
        sound.then_some(if tiny { Verdict::Vanishes } else { Verdict::Keeps })
    }

    /// Whether the part that `u` and `v` belong to has no more than [`TINY`] positions.
    fn is_tiny(&self, u: u32, v: u32) -> bool {
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
        part.iter().all(|&p| corners(p).all(|q| part.contains(&q)))
    }

    fn keeps_kind(
        &self,
        (of_u, at_u): (&[(u32, u8)], Standing),
        (of_v, at_v): (&[(u32, u8)], Standing),
        (_, v, shared): (u32, u32, u8),
    ) -> bool {
        let common = of_u.iter().filter(|(p, _)| of_v.iter().any(|(q, _)| p == q)).count();
        match (at_u, at_v) {
            (Standing::Branch, other) => other == Standing::Branch,
            (Standing::Inner, _) => shared == 2 && common == 2,
            (Standing::Rim(_), Standing::Inner) => false,
            (Standing::Rim(ends), at_v) => {
                let beyond = if ends[0] == v { ends[1] } else { ends[0] };
                let closes = matches!(at_v, Standing::Rim(of_v) if of_v.contains(&beyond));
                ends.contains(&v) && shared == 1 && common == 1 && !closes
            }
        }
    }

    /// Whether the faces that move with `u` keep an area and do not turn over.
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

    /// Puts `u` in the place of `v`: moves its triangles, and tells `gone` those that vanish.
    pub fn collapse(&mut self, u: u32, v: u32, mut gone: impl FnMut(u32)) {
        for number in std::mem::take(&mut self.around[u as usize]) {
            let t = self.triangles[number as usize];
            if t.contains(&v) {
                t.iter().filter(|&&p| p != u).for_each(|&p| self.around[p as usize].retain(|&other| other != number));
                self.left -= 1;
                gone(number);
            } else {
                self.triangles[number as usize] = t.map(|p| if p == u { v } else { p });
                self.around[v as usize].push(number);
            }
        }
    }
}

fn standing(neighbours: &[(u32, u8)]) -> Standing {
    let mut rim = [u32::MAX; 2];
    let mut open = 0;
    for &(p, count) in neighbours {
        match count {
            2 => {}
            1 if open < 2 => {
                rim[open] = p;
                open += 1;
            }
            _ => return Standing::Branch,
        }
    }
    match open {
        0 => Standing::Inner,
        2 => Standing::Rim(rim),
        _ => Standing::Branch,
    }
}

/// The unit normal of a triangle; `None` where it is too flat to have one.
pub(super) fn direction([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let normal = (b - a).cross(c - a);
    let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
    let area = normal.length();
    (area > FLAT * longest).then(|| normal / area)
}
