//! Soft bodies in the picture: moving skins of triangles, and ropes as tubes.
//!
//! In: the displayed vertices and their connectivity. Out: corners with normals for one mesh of the frame, smooth except at the sharp edges
//! of solids; a framed curve. Never here: levels, the GPU. Nothing is allocated once sizes settle.

use super::level::Shading;
use super::picture::MeshCorner;
use super::scene_view::SkinForm;
use glam::{DQuat, DVec3};
use metachron_core::{CurveState, SoftState};
use metachron_geometry::SurfaceShape;

/// Level of the patches of a rope.
pub const ROPE_LEVEL: u8 = 2;
/// Least drawn thickness of a sheet, as a fraction of its edges: below, the depths of its two faces cannot be told apart.
const THIN_SHARE: f64 = 0.01;

/// Triangles of a solid that share a vertex are shaded as one surface where the cosine between them is at least this, 60°: the bends of a
/// soft body stay smooth, the edges of its shape stay sharp.
const SMOOTH_COS: f64 = 0.5;

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
    /// Whether it is tissue.
    pub tissue: bool,
}

/// The surfaces that meet at each vertex of a solid: the first has the vertex's number, others are stored after all vertices.
#[derive(Debug, Default)]
struct Faces {
    all: Vec<Face>,
    /// Corners of each triangle, by face.
    triangles: Vec<[u32; 3]>,
}

/// One surface at a vertex.
#[derive(Debug, Clone, Copy)]
struct Face {
    vertex: u32,
    /// The normal of its first triangle; zero until that is known.
    first: DVec3,
    /// The area-weighted sum of its triangles' normals.
    sum: DVec3,
    /// The next surface at this vertex.
    next: Option<u32>,
}

/// Reused scratch storage.
#[derive(Debug, Default)]
pub(super) struct SkinScratch {
    normals: Vec<DVec3>,
    faces: Faces,
    /// The sides of a sheet's triangles; after `find_rim` only its border edges, which belong to one triangle.
    rim: Vec<[u32; 2]>,
}

impl Skins {
    /// Clears the list; storage is kept.
    pub(super) fn clear(&mut self) {
        self.corners.clear();
        self.rest.clear();
        self.triangles.clear();
        self.sides.clear();
        self.runs.clear();
    }

    /// Adds the skin of a body that an instance draws, with its sides where edges are drawn.
    pub(super) fn add(&mut self, skin: &SkinForm, soft: &SoftState, options: SkinOptions, scratch: &mut SkinScratch) {
        let form = &skin.surface;
        let SkinOptions { origin, instance, shading, edges, tissue } = options;
        let (first, from) = (self.corners.len() as u32, self.triangles.len() as u32);
        let corner = |x: &DVec3, n: DVec3| MeshCorner {
            core: (*x - origin).as_vec3().to_array(),
            normal: n.as_vec3().to_array(),
            uv: [0.0; 2],
        };
        let still = |vertex: usize| skin.rest.get(vertex).copied().unwrap_or(MeshCorner::NOWHERE);
        if form.closed {
            scratch.faces.find(form, soft);
            let normal = |face: &Face| face.sum.normalize_or(DVec3::Z);
            let faces = scratch.faces.all.iter();
            self.corners.extend(faces.map(|face| corner(&soft.positions[face.vertex as usize], normal(face))));
            let faces = scratch.faces.all.iter();
            self.rest.extend(faces.map(|face| still(face.vertex as usize)));
            self.triangles.extend(scratch.faces.triangles.iter().map(|t| t.map(|face| first + face)));
        } else {
            scratch.find_normals(form, soft);
            let both = || soft.positions.iter().zip(&scratch.normals);
            self.corners.extend(both().map(|(x, n)| corner(x, *n)));
            self.triangles.extend(form.triangles.iter().map(|t| t.map(|vertex| first + vertex)));
            let back = first + soft.positions.len() as u32;
            self.corners.extend(both().map(|(x, n)| corner(x, -*n)));
            // the texture of both faces is the same
            let vertices = 0..soft.positions.len();
            self.rest.extend(vertices.clone().chain(vertices).map(still));
            self.triangles.extend(form.triangles.iter().map(|&[a, b, c]| [back + a, back + c, back + b]));
            scratch.find_rim(form);
            for &[a, b] in &scratch.rim {
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

impl Faces {
    fn find(&mut self, form: &SurfaceShape, soft: &SoftState) {
        let empty = |vertex| Face { vertex, first: DVec3::ZERO, sum: DVec3::ZERO, next: None };
        self.all.clear();
        self.all.extend((0..soft.positions.len() as u32).map(empty));
        self.triangles.clear();
        for triangle in form.triangles.iter() {
            let [a, b, c] = triangle.map(|vertex| soft.positions[vertex as usize]);
            let normal = (b - a).cross(c - a);
            let faces = triangle.map(|vertex| self.face(vertex, normal.normalize_or_zero()));
            faces.iter().for_each(|face| self.all[*face as usize].sum += normal);
            self.triangles.push(faces);
        }
    }

    /// The surface at `vertex` that a triangle with this normal belongs to; a degenerate triangle belongs to the first.
    fn face(&mut self, vertex: u32, normal: DVec3) -> u32 {
        let mut at = vertex;
        loop {
            let face = &mut self.all[at as usize];
            if face.first == DVec3::ZERO {
                face.first = normal;
            }
            if normal == DVec3::ZERO || face.first.dot(normal) >= SMOOTH_COS {
                return at;
            }
            match face.next {
                Some(next) => at = next,
                None => break,
            }
        }
        let new = self.all.len() as u32;
        self.all[at as usize].next = Some(new);
        self.all.push(Face { vertex, first: normal, sum: DVec3::ZERO, next: None });
        new
    }
}

impl SkinScratch {
    fn find_normals(&mut self, form: &SurfaceShape, soft: &SoftState) {
        self.normals.clear();
        self.normals.resize(soft.positions.len(), DVec3::ZERO);
        for triangle in form.triangles.iter() {
            let [a, b, c] = triangle.map(|vertex| soft.positions[vertex as usize]);
            let normal = (b - a).cross(c - a);
            triangle.iter().for_each(|vertex| self.normals[*vertex as usize] += normal);
        }
        self.normals.iter_mut().for_each(|normal| *normal = normal.normalize_or(DVec3::Z));
    }

    /// Finds the sides of triangles without a neighbour, each in the direction of its triangle.
    fn find_rim(&mut self, form: &SurfaceShape) {
        self.rim.clear();
        self.rim.extend(form.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]));
        self.rim.sort_unstable_by_key(|[a, b]| [*a.min(b), *a.max(b)]);
        let same = |one: &[u32; 2], two: &[u32; 2]| one[0] == two[1] && one[1] == two[0];
        let mut kept = 0;
        let mut at = 0;
        while at < self.rim.len() {
            if at + 1 < self.rim.len() && same(&self.rim[at], &self.rim[at + 1]) {
                at += 2;
            } else {
                self.rim[kept] = self.rim[at];
                (kept, at) = (kept + 1, at + 1);
            }
        }
        self.rim.truncate(kept);
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
        (form, SoftState { velocities: vec![DVec3::ZERO; 4], positions })
    }

    #[test]
    fn a_sheet_has_two_faces_and_a_rim_and_is_closed() {
        let (form, soft) = square();
        let (mut skins, mut scratch) = (Skins::default(), SkinScratch::default());
        let (origin, instance, shading) = (DVec3::ZERO, 7, Shading::Flat);
        let options = SkinOptions { origin, instance, shading, edges: false, tissue: true };
        let form = SkinForm::new(form, &soft.positions);
        skins.add(&form, &soft, options, &mut scratch);
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
        (form, SoftState { velocities: vec![DVec3::ZERO; 8], positions })
    }

    #[test]
    fn a_solid_is_smooth_within_its_sides_and_sharp_at_its_edges() {
        let (form, soft) = cube(0.3);
        let (mut skins, mut scratch) = (Skins::default(), SkinScratch::default());
        let (origin, instance, shading) = (DVec3::ZERO, 0, Shading::PerPixel);
        let options = SkinOptions { origin, instance, shading, edges: false, tissue: false };
        let form = SkinForm::new(form, &soft.positions);
        skins.add(&form, &soft, options, &mut scratch);
        assert_eq!(skins.corners.len(), 24, "three sides meet at each of eight vertices");
        for triangle in &skins.triangles {
            let corners = triangle.map(|corner| &skins.corners[corner as usize]);
            let [a, b, c] = corners.map(|corner| glam::Vec3::from(corner.core));
            let flat = (b - a).cross(c - a).normalize();
            assert!(corners.iter().all(|corner| flat.dot(corner.normal.into()) > 1.0 - 1e-6), "a side is flat");
        }
        // no data of the previous body is left in the scratch storage
        skins.clear();
        skins.add(&form, &soft, options, &mut scratch);
        assert_eq!((skins.corners.len(), skins.triangles.len()), (24, 12));
    }

    #[test]
    fn a_rope_s_frames_follow_it_and_do_not_spin() {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::new(2.0, 1.0, 0.0), DVec3::new(2.0, 2.0, 0.5)];
        let soft = SoftState { velocities: vec![DVec3::ZERO; 4], positions };
        let mut curve = CurveState::default();
        curve_of_rope(&soft, 0.1, &mut curve);
        for (frame, pair) in curve.frames.iter().zip(soft.positions.windows(2)) {
            let along = (pair[1] - pair[0]).normalize();
            assert!((*frame * DVec3::Z).distance(along) < 1e-12);
        }
        assert_eq!(curve.arc_m.len(), 4);
    }
}
