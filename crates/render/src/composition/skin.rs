//! Soft bodies in the picture: moving skins of triangles, and ropes as tubes.
//!
//! In: the displayed vertices, their connectivity, a level. Out: corners with normals for one mesh of the frame, smooth except at the sharp
//! edges of solids; a framed curve. Never here: the choice of levels, the GPU. Nothing is allocated once sizes settle.

mod normals;

use super::mesh_corner::MeshCorner;
use super::tessellation::{CoarseSkin, FineSkin, RestPoint, SkinEdges, SkinPoint, skin_divisions};
use crate::seen::level::Shading;
use glam::{DQuat, DVec3};
use metachron_core::{CurveState, SoftState};
use metachron_geometry::SurfaceShape;
use normals::{Faces, vertex_normals};
use std::sync::Arc;

/// Least drawn thickness of a sheet, as a fraction of its edges: below, the depths of its two faces cannot be told apart.
const THIN_SHARE: f64 = 0.01;

/// The skin of a sheet or soft solid.
#[derive(Debug, Clone)]
pub struct SkinForm {
    /// Its triangles.
    pub surface: SurfaceShape,
    /// Its vertices at rest, in the body's own axes: tissue's texture keeps to them.
    pub(crate) rest: Arc<[MeshCorner]>,
    /// Their mean distance from their middle, metres.
    pub(crate) mean_radius_m: f64,
    pub(crate) edges: SkinEdges,
}

impl SkinForm {
    /// A skin of these triangles, whose vertices are at `rest_m` when nothing bends it, metres.
    #[must_use]
    pub fn new(surface: SurfaceShape, rest_m: &[DVec3]) -> Self {
        let mut normals = vec![DVec3::ZERO; rest_m.len()];
        for triangle in surface.triangles.iter() {
            let corner = |k: usize| rest_m.get(triangle[k] as usize).copied().unwrap_or_default();
            let normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
            for vertex in triangle {
                if let Some(sum) = normals.get_mut(*vertex as usize) {
                    *sum += normal;
                }
            }
        }
        let corner = |(at, normal): (&DVec3, &DVec3)| MeshCorner {
            core: at.as_vec3().to_array(),
            normal: normal.normalize_or(DVec3::Z).as_vec3().to_array(),
            uv: [0.0; 2],
        };
        let count = rest_m.len().max(1) as f64;
        let middle = rest_m.iter().sum::<DVec3>() / count;
        let mean_radius_m = rest_m.iter().map(|at| at.distance(middle)).sum::<f64>() / count;
        Self {
            rest: rest_m.iter().zip(&normals).map(corner).collect(),
            mean_radius_m: mean_radius_m.max(1e-6),
            edges: SkinEdges::of(&surface.triangles),
            surface,
        }
    }

    /// Takes other triangles between the same vertices.
    pub(crate) fn set_surface(&mut self, surface: &SurfaceShape) {
        if Arc::ptr_eq(&self.surface.triangles, &surface.triangles) {
            return;
        }
        if self.surface.triangles != surface.triangles {
            self.edges = SkinEdges::of(&surface.triangles);
        }
        self.surface = surface.clone();
    }
}

/// The corners and triangles of all skins of a frame.
#[derive(Debug, Clone, Default)]
pub struct Skins {
    /// Corners, relative to the picture's origin, metres.
    pub corners: Vec<MeshCorner>,
    /// The same at rest, metres in their bodies' own axes: where tissue's texture lies. Zero for skins without one.
    pub rest: Vec<MeshCorner>,
    /// Corners of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Their sides, three per triangle, where edges are drawn.
    pub sides: Vec<[u32; 2]>,
    /// The triangles of each instance of the picture.
    pub runs: Vec<SkinRun>,
}

/// One skin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SkinRun {
    /// Its first triangle, and the number of triangles.
    pub triangles: (u32, u32),
    /// The instance of [`crate::Picture::instances`] with its colour and thickness.
    pub instance: u32,
    /// Shading.
    pub shading: Shading,
    /// Whether it is tissue, with a texture where it is lit per pixel.
    pub tissue: bool,
}

/// Options of adding one skin.
#[derive(Debug, Clone, Copy)]
pub(super) struct SkinOptions {
    /// The point that positions are relative to, metres.
    pub origin: DVec3,
    /// The instance with its colour.
    pub instance: u32,
    /// Shading.
    pub shading: Shading,
    /// Whether its edges are drawn.
    pub edges: bool,
    /// Level of its patches.
    pub n: u8,
    /// Whether it is tissue.
    pub tissue: bool,
}

/// A skin as it is displayed.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShownSkin<'a> {
    pub form: &'a SkinForm,
    pub soft: &'a SoftState,
}

/// Reused scratch storage.
#[derive(Debug, Default)]
pub(super) struct SkinScratch {
    normals: Vec<DVec3>,
    faces: Faces,
    fine: FineSkin,
}

impl Skins {
    /// Clears the list; storage is kept.
    pub(crate) fn clear(&mut self) {
        self.corners.clear();
        self.rest.clear();
        self.triangles.clear();
        self.sides.clear();
        self.runs.clear();
    }

    /// Adds the skin of a body that an instance draws, with its sides where edges are drawn.
    pub(super) fn add(&mut self, skin: ShownSkin<'_>, options: SkinOptions, scratch: &mut SkinScratch) {
        let SkinOptions { origin, instance, shading, edges, n, tissue } = options;
        let form = &skin.form.surface;
        let (first, from) = (self.corners.len() as u32, self.triangles.len() as u32);
        scratch.divide(skin, skin_divisions(n));
        let FineSkin { points, triangles, rim, .. } = &scratch.fine;
        let corner = |x: DVec3, n: DVec3| MeshCorner {
            core: (x - origin).as_vec3().to_array(),
            normal: n.as_vec3().to_array(),
            uv: [0.0; 2],
        };
        let rest = points.iter().map(|point| if tissue { point.rest.corner() } else { MeshCorner::NOWHERE });
        self.corners.extend(points.iter().map(|point| corner(point.position, point.normal)));
        self.rest.extend(rest.clone());
        self.triangles.extend(triangles.iter().map(|t| t.map(|point| first + point)));
        if !form.closed {
            let back = first + points.len() as u32;
            self.corners.extend(points.iter().map(|point| corner(point.position, -point.normal)));
            // the texture of both faces is the same
            self.rest.extend(rest);
            self.triangles.extend(triangles.iter().map(|&[a, b, c]| [back + a, back + c, back + b]));
            for &[a, b] in rim {
                self.triangles.extend([[first + b, first + a, back + a], [first + b, back + a, back + b]]);
            }
        }
        if edges {
            let all = self.triangles[from as usize..].iter();
            self.sides.extend(all.flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]));
        }
        self.runs.push(SkinRun { triangles: (from, self.triangles.len() as u32 - from), instance, shading, tissue });
    }
}

impl SkinScratch {
    /// Divides every side of a skin into `parts`, its front where it is open.
    fn divide(&mut self, skin: ShownSkin<'_>, parts: u32) {
        let ShownSkin { form: SkinForm { surface: form, rest, edges, .. }, soft } = skin;
        let still = |vertex: usize| rest.get(vertex).map(RestPoint::of).unwrap_or_default();
        self.fine.points.clear();
        let vertices = &form.triangles;
        if form.closed {
            self.faces.find(form, soft);
            self.fine.points.extend(self.faces.all.iter().map(|face| SkinPoint {
                position: soft.positions[face.vertex as usize],
                normal: face.sum.normalize_or(DVec3::Z),
                rest: still(face.vertex as usize),
            }));
            self.fine.divide(CoarseSkin { edges, vertices, corners: &self.faces.triangles, parts });
        } else {
            vertex_normals(form, soft, &mut self.normals);
            let both = soft.positions.iter().zip(&self.normals).enumerate();
            self.fine.points.extend(both.map(|(vertex, (position, normal))| SkinPoint {
                position: *position,
                normal: *normal,
                rest: still(vertex),
            }));
            self.fine.divide(CoarseSkin { edges, vertices, corners: vertices, parts });
        }
    }
}

/// Drawn half thickness of a skin about its vertices, metres.
pub(super) fn drawn_radius_m(form: &SurfaceShape) -> f64 {
    if form.closed { 0.0 } else { form.radius_m.max(THIN_SHARE * form.edge_m) }
}

/// A rope as a framed curve with frames of minimal rotation; into reused storage.
pub(super) fn curve_of_rope(soft: &SoftState, radius_m: f64, curve: &mut CurveState) {
    curve.positions.clone_from(&soft.positions);
    curve.velocities.clone_from(&soft.velocities);
    curve.radii_m.clear();
    curve.radii_m.resize(soft.positions.len(), radius_m);
    curve.arc_m.clear();
    curve.frames.clear();
    let (mut arc_m, mut frame) = (0.0, DQuat::IDENTITY);
    curve.arc_m.push(arc_m);
    for pair in soft.positions.windows(2) {
        let way = pair[1] - pair[0];
        arc_m += way.length().max(f64::MIN_POSITIVE);
        curve.arc_m.push(arc_m);
        let along = way.normalize_or(frame * DVec3::Z);
        frame = (DQuat::from_rotation_arc(frame * DVec3::Z, along) * frame).normalize();
        curve.frames.push(frame);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn square() -> (SurfaceShape, SoftState) {
        let form = SurfaceShape {
            vertices: [0, 1, 2, 3].into(),
            edges: [[0, 1], [1, 2], [2, 3], [0, 3], [0, 2]].into(),
            triangles: [[0, 1, 2], [0, 2, 3]].into(),
            fans: Arc::default(),
            radius_m: 0.01,
            edge_m: 1.0,
            closed: false,
        };
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        (form, SoftState { velocities: vec![DVec3::ZERO; 4], positions, nodes: None })
    }

    #[test]
    fn a_sheet_has_two_faces_and_a_rim_and_is_closed() {
        let (form, soft) = square();
        let (mut skins, mut scratch) = (Skins::default(), SkinScratch::default());
        let (origin, instance, shading) = (DVec3::ZERO, 7, Shading::Flat);
        let options = SkinOptions { origin, instance, shading, edges: false, n: 0, tissue: true };
        let form = SkinForm::new(form, &soft.positions);
        skins.add(ShownSkin { form: &form, soft: &soft }, options, &mut scratch);
        assert_eq!(skins.runs, [SkinRun { triangles: (0, 4 + 8), instance, shading, tissue: true }]);
        // either face has the texture of the sheet at rest
        let rest: Vec<_> = skins.rest.iter().map(|corner| glam::Vec3::from(corner.core).as_dvec3()).collect();
        assert_eq!(rest, [&soft.positions[..], &soft.positions[..]].concat());
        let thick = |i: u32| {
            let MeshCorner { core, normal, .. } = skins.corners[i as usize];
            (glam::Vec3::from(core) + glam::Vec3::from(normal) * 0.01).as_dvec3()
        };
        let volumes = skins.triangles.iter().map(|t| {
            let [a, b, c] = t.map(thick);
            a.dot(b.cross(c)) / 6.0
        });
        let volume: f64 = volumes.sum();
        assert!((volume - 0.02).abs() < 1e-8, "{volume}"); // 1 m² by 2 cm, in single precision
    }

    /// A cube of one cell, each side of two triangles, whose top side is turned about the y axis.
    fn cube(turn_rad: f64) -> (SurfaceShape, SoftState) {
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles: Vec<[u32; 3]> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let form = SurfaceShape {
            vertices: (0..8).collect(),
            edges: [].into(),
            triangles: triangles.into(),
            fans: Arc::default(),
            radius_m: 0.0,
            edge_m: 1.0,
            closed: true,
        };
        let bit = |k: u32, b: u32| f64::from(k >> b & 1);
        let top = |x: f64, z: f64| z * (1.0 + x * turn_rad.tan());
        let positions = (0..8).map(|k| DVec3::new(bit(k, 0), bit(k, 1), top(bit(k, 0), bit(k, 2)))).collect();
        (form, SoftState { velocities: vec![DVec3::ZERO; 8], positions, nodes: None })
    }

    #[test]
    fn a_solid_is_smooth_within_its_sides_and_sharp_at_its_edges() {
        let (form, soft) = cube(0.3);
        let (mut skins, mut scratch) = (Skins::default(), SkinScratch::default());
        let (origin, instance, shading) = (DVec3::ZERO, 0, Shading::PerPixel);
        let options = SkinOptions { origin, instance, shading, edges: false, n: 0, tissue: false };
        let form = SkinForm::new(form, &soft.positions);
        skins.add(ShownSkin { form: &form, soft: &soft }, options, &mut scratch);
        assert_eq!(skins.corners.len(), 24, "three sides meet at each of eight vertices");
        for triangle in &skins.triangles {
            let corners = triangle.map(|corner| &skins.corners[corner as usize]);
            let [a, b, c] = corners.map(|corner| glam::Vec3::from(corner.core));
            let flat = (b - a).cross(c - a).normalize();
            assert!(corners.iter().all(|corner| flat.dot(corner.normal.into()) > 1.0 - 1e-6), "a side is flat");
        }
        // no data of the previous body is left in the scratch storage
        skins.clear();
        skins.add(ShownSkin { form: &form, soft: &soft }, options, &mut scratch);
        assert_eq!((skins.corners.len(), skins.triangles.len()), (24, 12));
    }

    /// Whether every side of a triangle is that of another one the other way round, by the places of its ends.
    fn is_without_gaps(skins: &Skins, radius_m: f32) -> bool {
        let at = |corner: u32| {
            let MeshCorner { core, normal, .. } = skins.corners[corner as usize];
            (glam::Vec3::from(core) + glam::Vec3::from(normal) * radius_m).to_array().map(f32::to_bits)
        };
        let sides = skins.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut balance = std::collections::BTreeMap::new();
        for [a, b] in sides.map(|side| side.map(at)) {
            *balance.entry([a.min(b), a.max(b)]).or_insert(0) += if a < b { 1 } else { -1 };
        }
        balance.values().all(|count| *count == 0)
    }

    fn at_level(form: &SurfaceShape, soft: &SoftState, n: u8) -> Skins {
        let (mut skins, mut scratch) = (Skins::default(), SkinScratch::default());
        let (origin, instance, shading) = (DVec3::ZERO, 0, Shading::PerPixel);
        let options = SkinOptions { origin, instance, shading, edges: false, n, tissue: true };
        let form = SkinForm::new(form.clone(), &soft.positions);
        skins.add(ShownSkin { form: &form, soft }, options, &mut scratch);
        skins
    }

    fn volume(skins: &Skins) -> f64 {
        let at = |corner: u32| glam::Vec3::from(skins.corners[corner as usize].core).as_dvec3();
        let sixths = skins.triangles.iter().map(|t| {
            let [a, b, c] = t.map(at);
            a.dot(b.cross(c)) / 6.0
        });
        sixths.sum()
    }

    #[test]
    fn a_level_divides_every_triangle_into_about_as_many_as_a_tube_s_patch() {
        let (form, soft) = cube(0.3);
        for n in 0..=6 {
            let parts = skin_divisions(n);
            let triangles = at_level(&form, &soft, n).triangles.len() as u32;
            assert_eq!(triangles, 12 * parts * parts);
            assert!((f64::from(parts * parts) / f64::from(1 << n)).log2().abs() <= 1.0);
        }
        // a sheet has its two faces, and two triangles for each part of its rim
        let (form, soft) = square();
        assert_eq!(at_level(&form, &soft, 3).triangles.len(), 2 * 2 * 9 + 4 * 2 * 3);
    }

    #[test]
    fn a_box_of_flat_sides_stays_one_and_no_level_opens_a_gap() {
        let (form, soft) = cube(0.3);
        for n in 0..=7 {
            let skins = at_level(&form, &soft, n);
            assert!(is_without_gaps(&skins, 0.0), "level {n}");
            // 1 m² under a slope of tan 0.3
            let exact = 1.0 + 0.5 * 0.3_f64.tan();
            assert!((volume(&skins) - exact).abs() < 1e-6, "level {n}: {}", volume(&skins));
        }
        // a corner that is pulled out bends all three sides and their sharp edges
        let (form, mut soft) = cube(0.0);
        soft.positions[7] += DVec3::splat(0.4);
        assert!((0..=7).all(|n| is_without_gaps(&at_level(&form, &soft, n), 0.0)));
    }

    /// An octahedron whose sides were halved `times` times, on the unit ball.
    fn ball(times: u32) -> (SurfaceShape, SoftState) {
        let mut positions = vec![DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
        let mut triangles =
            vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
        for _ in 0..times {
            let mut known = std::collections::BTreeMap::new();
            let mut halved = vec![];
            for [a, b, c] in triangles {
                let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[a, b]: [u32; 2]| {
                    *known.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                        positions.push((positions[a as usize] + positions[b as usize]).normalize());
                        positions.len() as u32 - 1
                    })
                });
                halved.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            triangles = halved;
        }
        let (form, _) = cube(0.0);
        let form =
            SurfaceShape { vertices: (0..positions.len() as u32).collect(), triangles: triangles.into(), ..form };
        (form, SoftState { velocities: vec![DVec3::ZERO; positions.len()], positions, nodes: None })
    }

    #[test]
    fn a_coarse_ball_is_rounded_and_has_the_normals_of_a_ball() {
        let exact = 4.0 / 3.0 * std::f64::consts::PI;
        for times in [2, 3] {
            let (form, soft) = ball(times);
            let [flat, round] = [0, 6].map(|n| at_level(&form, &soft, n));
            assert!(is_without_gaps(&round, 0.0));
            let [before, after] = [&flat, &round].map(|skins| (volume(skins) / exact - 1.0).abs());
            // corners of a halved octahedron have four neighbours or six: their mean normals are not quite the ball's
            assert!(after < before / 8.0, "{before} {after}");
            for corner in &round.corners {
                let [at, normal] = [corner.core, corner.normal].map(|v| glam::Vec3::from(v).as_dvec3());
                assert!(normal.dot(at.normalize()) > 0.99, "{at} {normal}");
            }
        }
    }

    #[test]
    fn a_rolled_sheet_is_drawn_round_and_both_of_its_faces_and_its_rim_close_it() {
        // a quarter of a cylinder of 1 m, in six strips
        let (around, along) = (6_u32, 4_u32);
        let at = |i: u32, j: u32| i * (along + 1) + j;
        let positions = (0..=around).flat_map(|i| {
            let (sin, cos) = (std::f64::consts::FRAC_PI_2 * f64::from(i) / f64::from(around)).sin_cos();
            (0..=along).map(move |j| DVec3::new(cos, sin, f64::from(j) * 0.3))
        });
        let positions: Vec<DVec3> = positions.collect();
        let quads =
            (0..around).flat_map(|i| (0..along).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
        let triangles: Vec<[u32; 3]> = quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let (form, _) = square();
        let form =
            SurfaceShape { triangles: triangles.into(), vertices: (0..positions.len() as u32).collect(), ..form };
        let soft = SoftState { velocities: vec![DVec3::ZERO; positions.len()], positions, nodes: None };
        let skins = at_level(&form, &soft, 4);
        assert!(is_without_gaps(&skins, 0.01));
        // a chord of 15 degrees sags by 8.6 mm; at the border the normals are half a strip's
        let inner = skins.corners.iter().map(|corner| corner.core.map(f64::from));
        let inner = inner.filter(|[x, y, z]| x.min(*y) > 0.3 && (0.3..=0.9).contains(z));
        let worst = inner.map(|[x, y, _]| (x.hypot(y) - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 5e-4, "{worst}");
    }

    #[test]
    fn a_rope_s_frames_follow_it_and_do_not_spin() {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::new(2.0, 1.0, 0.0), DVec3::new(2.0, 2.0, 0.5)];
        let soft = SoftState { velocities: vec![DVec3::ZERO; 4], positions, nodes: None };
        let mut curve = CurveState::default();
        curve_of_rope(&soft, 0.1, &mut curve);
        for (frame, pair) in curve.frames.iter().zip(soft.positions.windows(2)) {
            let along = (pair[1] - pair[0]).normalize();
            assert!((*frame * DVec3::Z).distance(along) < 1e-12);
        }
        assert_eq!(curve.arc_m.len(), 4);
    }
}
