//! Procedural meshes from a formula and a seed, so that scenes for experiments need no files.
//!
//! In: a kind, a seed, a number of triangles. Out: a mesh about one metre in size. Never here: levels, files.

use super::furniture;
use super::furniture::Part;
use glam::{DVec2, DVec3};
use metachron_geometry::creased_mesh;
use metachron_geometry::{PrimitiveMesh, Triangles};

metachron_core::choices! {
    /// Shape of a generated mesh.
    #[derive(Hash, PartialOrd, Ord)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum Generator {
        /// A ball of radius 1.
        Sphere = "sphere",
        /// A ring about z of radius 1; the tube's radius is a third of it.
        Torus = "torus",
        /// A ball whose radius varies by a fifth: smooth bumps.
        Blob = "blob",
        /// Hills on a square of side 2 about the origin, a quarter high; open at its border.
        Terrain = "terrain",
        /// A theatre seat that faces +y: seat, back, two arms and a foot, 0.55 wide and 1 high, standing on z = 0.
        Seat = "seat",
        /// A rod along z from −1 to 1, of radius a twentieth.
        Strut = "strut",
        /// A rod along z from −1 to 1, of radius a sixth.
        Bar = "bar",
        /// A table on four legs, 1.6 long along x, 0.8 wide and 0.75 high, standing on z = 0.
        Table = "table",
        /// A shelf that faces −y: two sides and three boards, 1 wide and 2 high, standing on z = 0.
        Shelf = "shelf",
        /// A door in its frame that faces −y, 1 wide and 2.1 high, standing on z = 0.
        Door = "door",
        /// Five books side by side along x, their backs to −y, 0.3 wide and high, standing on z = 0.
        Books = "books",
        /// A liver, about 2 long along x: a thick right lobe at −x, a thin left one at +x, a flat underside with the hollow of the gallbladder.
        Liver = "liver",
        /// The wall of a cavity, seen from within: a bowl 2 wide and 0.62 deep about the origin that bends inward above it, with a ridge along y in
        /// its bottom; open at the top.
        Cavity = "cavity",
    }
}

/// A mesh of at least `triangles` triangles, with as few more as its grids allow.
/// Equal arguments give bit-identical results.
#[must_use]
pub fn generate(kind: Generator, seed: u64, triangles: u32) -> PrimitiveMesh {
    let surface = generate_surface(kind, seed, triangles);
    creased_mesh(&surface.points, &surface.triangles)
}

/// The same as bare points and triangles.
#[must_use]
pub fn generate_surface(kind: Generator, seed: u64, triangles: u32) -> Triangles {
    let mut sheet = MeshBuilder::default();
    match kind {
        Generator::Sphere => sheet.ball(side(triangles, 12), |way| way),
        Generator::Blob => sheet.ball(side(triangles, 12), |way| way * (1.0 + 0.2 * layers(seed, way * 1.5, 2))),
        Generator::Torus => sheet.ring(triangles),
        Generator::Terrain => sheet.hills(side(triangles, 2), seed),
        Generator::Strut => sheet.rod(triangles, 1.0 / 20.0),
        Generator::Bar => sheet.rod(triangles, 1.0 / 6.0),
        Generator::Seat => sheet.boxes(triangles, &furniture::SEAT),
        Generator::Table => sheet.boxes(triangles, &furniture::TABLE),
        Generator::Shelf => sheet.boxes(triangles, &furniture::SHELF),
        Generator::Door => sheet.boxes(triangles, &furniture::DOOR),
        Generator::Books => sheet.boxes(triangles, &furniture::BOOKS),
        Generator::Liver => sheet.ball(side(triangles, 12), |way| way * liver_m(way, seed)),
        Generator::Cavity => sheet.bowl(side(triangles, 2), seed),
    }
    Triangles { points: sheet.points, triangles: sheet.triangles }
}

/// The rim of a cavity's wall in the middle of its sides, as an angle from its lowest point; at the corners it is a fifth more.
const RIM_RAD: f64 = 2.0;

/// How far the surface of a liver is from its middle in the direction `way`.
fn liver_m(way: DVec3, seed: u64) -> f64 {
    let ball = |at: DVec3, centre: [f64; 3], half: [f64; 3]| {
        let half = DVec3::from(half);
        (((at - DVec3::from(centre)) / half).length() - 1.0) * half.min_element()
    };
    // outside above zero; parts blend over a tenth
    let outside = |at: DVec3| {
        let right = ball(at, [-0.38, 0.0, 0.02], [0.62, 0.52, 0.46]);
        let left = ball(at, [0.42, 0.04, 0.06], [0.72, 0.36, 0.24]);
        let lobes = blend(right, left, 0.14);
        let underside = -0.26 - at.z;
        let hollow = -ball(at, [0.02, -0.3, -0.34], [0.16, 0.34, 0.2]);
        -blend(-lobes, blend(-underside, -hollow, 0.08), 0.08)
    };
    let (mut inner, mut outer) = (0.02, 2.0);
    for _ in 0..50 {
        let middle = 0.5 * (inner + outer);
        if outside(way * middle) > 0.0 { outer = middle } else { inner = middle }
    }
    inner * (1.0 + 0.015 * layers(seed, way * 3.0, 2))
}

/// The lesser of two numbers, rounded where they are within `over` of each other.
fn blend(a: f64, b: f64, over: f64) -> f64 {
    let near = (over - (a - b).abs()).max(0.0) / over;
    a.min(b) - 0.25 * near * near * over
}

/// Cells along a grid so that `per` triangles per squared cell count make at least `triangles`.
fn side(triangles: u32, per: u32) -> u32 {
    (f64::from(triangles) / f64::from(per)).sqrt().ceil().max(1.0) as u32
}

#[derive(Default)]
struct MeshBuilder {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl MeshBuilder {
    /// A grid of `columns` × `rows` cells, whose corners `place` gives for (0 … columns, 0 … rows).
    fn grid(&mut self, columns: u32, rows: u32, place: impl Fn(u32, u32) -> DVec3) {
        let first = self.points.len() as u32;
        self.points.extend((0..=rows).flat_map(|r| (0..=columns).map(move |c| (c, r))).map(|(c, r)| place(c, r)));
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let a = first + row * (columns + 1) + column;
            let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
            self.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }

    /// Six faces of a cube of `cells`² each; `place` maps the unit direction of each corner to its position.
    fn ball(&mut self, cells: u32, place: impl Fn(DVec3) -> DVec3) {
        let first = self.points.len();
        self.cube(cells);
        for point in &mut self.points[first..] {
            // equal angles per cell: nearly equal triangles
            let lean =
                point.to_array().map(|x| if x.abs() == 1.0 { x } else { libm::tan(x * std::f64::consts::FRAC_PI_4) });
            *point = place(DVec3::from(lean).normalize());
        }
        self.weld(first);
    }

    /// The surface of the cube −1 … 1.
    fn cube(&mut self, cells: u32) {
        let at = |i: u32| 2.0 * f64::from(i) / f64::from(cells) - 1.0;
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                self.grid(cells, cells, |c, r| {
                    let (u, v) = if side > 0.0 { (at(c), at(r)) } else { (at(r), at(c)) };
                    let mut point = DVec3::ZERO;
                    (point[axis], point[(axis + 1) % 3], point[(axis + 2) % 3]) = (side, u, v);
                    point
                });
            }
        }
    }

    fn ring(&mut self, triangles: u32) {
        let around = ((f64::from(triangles) / 6.0).sqrt().round() as u32).max(3);
        let along = triangles.div_ceil(2 * around).max(3);
        let angle = |i: u32, of: u32| std::f64::consts::TAU * f64::from(i % of) / f64::from(of);
        self.grid(along, around, |c, r| {
            let (turn, tilt) = (angle(c, along), angle(r, around));
            let out = 1.0 + libm::cos(tilt) / 3.0;
            DVec3::new(libm::cos(turn) * out, libm::sin(turn) * out, libm::sin(tilt) / 3.0)
        });
        self.weld(0);
    }

    /// A wall of quads and a triangle fan at each end.
    fn rod(&mut self, triangles: u32, radius: f64) {
        let around = (libm::sqrt(0.5 * f64::from(triangles)) as u32).clamp(4, 96);
        let rows = (triangles.saturating_sub(2 * around)).div_ceil(2 * around).max(1);
        self.grid(around, rows, |c, r| {
            let turn = std::f64::consts::TAU * f64::from(c % around) / f64::from(around);
            let along = 2.0 * f64::from(r) / f64::from(rows) - 1.0;
            DVec3::new(radius * libm::cos(turn), radius * libm::sin(turn), along)
        });
        for (side, row) in [(-1.0, 0), (1.0, rows)] {
            let middle = self.points.len() as u32;
            self.points.push(DVec3::Z * side);
            let corner = |c: u32| row * (around + 1) + c;
            let fan = (0..around).map(|c| [middle, corner(c), corner(c + 1)]);
            self.triangles.extend(fan.map(|t| if side > 0.0 { t } else { [t[0], t[2], t[1]] }));
        }
        self.weld(0);
    }

    fn hills(&mut self, cells: u32, seed: u64) {
        let at = |i: u32| 2.0 * f64::from(i) / f64::from(cells) - 1.0;
        self.grid(cells, cells, |c, r| {
            let flat = DVec2::new(at(c), at(r));
            flat.extend(0.125 * layers(seed, flat.extend(0.5) * 2.0, 3))
        });
    }

    /// A ball seen from within, flattened, without its top: rounded squares of a grid about the lowest point are its circles of latitude.
    fn bowl(&mut self, cells: u32, seed: u64) {
        let at = |i: u32| 2.0 * f64::from(i) / f64::from(cells) - 1.0;
        self.grid(cells, cells, |c, r| {
            let flat = DVec2::new(at(c), at(r));
            let fourth = (flat * flat) * (flat * flat);
            let out = libm::sqrt(libm::sqrt(fourth.x + fourth.y));
            let way = flat.normalize_or_zero();
            let from_below = out * RIM_RAD;
            let level = way * libm::sin(from_below);
            let ridge = 0.1 * libm::exp(-(level.x / 0.22) * (level.x / 0.22)) * (1.0 - out).max(0.0);
            let place = level.extend(ridge - 0.62 * libm::cos(from_below));
            place * (1.0 + 0.02 * layers(seed, place * 4.0, 2))
        });
    }

    /// Boxes with rounded edges, all with the same number of cells.
    fn boxes(&mut self, triangles: u32, parts: &[Part]) {
        let cells = side(triangles, 12 * parts.len() as u32);
        for (centre, half, round) in parts {
            let first = self.points.len();
            self.cube(cells);
            for point in &mut self.points[first..] {
                let bulged = point.lerp(point.normalize() * 1.2, round * 0.5);
                *point = DVec3::from(*centre) + bulged * DVec3::from(*half);
            }
            self.weld(first);
        }
    }

    /// Merges all coincident points after `first`: the faces of a cube become one surface.
    fn weld(&mut self, first: usize) {
        let key = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
        let mut known = std::collections::BTreeMap::new();
        let mut kept: Vec<DVec3> = Vec::new();
        let number: Vec<u32> = self.points[first..]
            .iter()
            .map(|&p| {
                *known.entry(key(p)).or_insert_with(|| {
                    kept.push(p);
                    (first + kept.len() - 1) as u32
                })
            })
            .collect();
        self.points.truncate(first);
        self.points.extend(kept);
        let renamed = |i: u32| if (i as usize) < first { i } else { number[i as usize - first] };
        self.triangles.iter_mut().for_each(|t| *t = t.map(renamed));
    }
}

/// Smooth noise of about −1 … 1: `octaves` layers, each with half the amplitude and period of the one before.
fn layers(seed: u64, at: DVec3, octaves: u32) -> f64 {
    (0..octaves)
        .map(|o| noise(seed.wrapping_add(u64::from(o)), at * f64::from(1_u32 << o)) / f64::from(1_u32 << o))
        .sum()
}

/// Random values at integer coordinates, smoothly interpolated.
fn noise(seed: u64, at: DVec3) -> f64 {
    let cell = at.floor();
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let w = (at - cell).to_array().map(ease);
    let mut sum = 0.0;
    for corner in 0..8_u32 {
        let bit = |axis: u32| f64::from(corner >> axis & 1);
        let place = cell + DVec3::new(bit(0), bit(1), bit(2));
        let share: f64 =
            (0..3).map(|axis| if bit(axis) > 0.0 { w[axis as usize] } else { 1.0 - w[axis as usize] }).product();
        sum += share * value(seed, place);
    }
    sum
}

/// A number in −1 … 1 for integer coordinates, by the finaliser of splitmix.
fn value(seed: u64, at: DVec3) -> f64 {
    let mut h = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    for x in at.to_array() {
        h = (h ^ (x as i64 as u64)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        h ^= h >> 31;
    }
    (h >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_at_least_the_triangles_asked_for_and_few_more() {
        for kind in Generator::ALL {
            for wanted in [2000, 20_000] {
                let count = generate(kind, 7, wanted).triangles.len() as f64;
                // grids are square: one more row with 6 cells per face is a third more, less half of it on average
                let more = count / f64::from(wanted) - 1.0;
                assert!((0.0..0.2).contains(&more), "{kind:?}: {count} of {wanted}");
            }
        }
    }

    #[test]
    fn a_sphere_has_the_area_of_its_radius_and_faces_outward() {
        let mesh = generate(Generator::Sphere, 0, 5000);
        let mut area = 0.0;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.vertices[i as usize].core.as_dvec3());
            let face = (b - a).cross(c - a);
            assert!(face.dot(a) > 0.0);
            area += 0.5 * face.length();
        }
        // chords of a grid with 20 cells per quarter turn: a thousandth below the sphere's
        assert!((area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 2e-3, "{area}");
    }

    #[test]
    fn equal_seeds_give_equal_bits_and_others_do_not() {
        let of = |seed| generate(Generator::Terrain, seed, 200).vertices;
        assert_eq!(of(3), of(3));
        assert_ne!(of(3), of(4));
    }
}
