//! What coarser forms of a model draw wrong: small pictures of them beside pictures of all of it.
//!
//! In: a model. Out: the part of its pixels that it draws wrong with so many triangles. Never here: the GPU, a choice.
//! Theory: `docs/theory/budget.md`, eq. 47a.

use crate::progressive_mesh::FORMS;
use crate::{Model, PieceKind, Stroke};
use glam::{DQuat, DVec2, DVec3, Vec2, Vec3};
use metachron_geometry::{PrimitiveMesh, PrimitiveVertex};
use std::f64::consts::TAU;

/// Pixels of a picture along each side: of an outline that is off by a fiftieth of the model every pixel is another.
const SIDE: usize = 48;
/// Directions that a model is seen along.
const VIEWS: usize = 6;
/// Half the side of a square over the radius of a disc of its area: √π/2.
const SQUARE: f32 = 0.886_226_9;

/// The normals that are seen in the pixels of a picture; none where the model is not.
type Picture = Vec<Option<Vec3>>;

impl Model {
    /// The part of its pixels that it draws wrong with fewer triangles: from the fewest to all in equal ratios. Measured once; above 1 where
    /// more is covered wrongly than the model covers.
    #[must_use]
    pub fn losses(&self) -> [f32; FORMS] {
        match self {
            Self::Mesh(tom) => *tom.losses.get_or_init(|| losses(self)),
            Self::Foliage(foliage) => *foliage.losses.get_or_init(|| losses(self)),
        }
    }

    /// Its triangles as they are drawn with at most `triangles` for an eye that looks `forward`, strokes among them.
    fn drawn(&self, triangles: u32, forward: Vec3) -> PrimitiveMesh {
        let Self::Foliage(foliage) = self else { return self.mesh(triangles) };
        let cut = foliage.cut(triangles, 0.0);
        let mut mesh = self.mesh(cut.triangles);
        for stroke in &foliage.strokes()[cut.strokes.start as usize..cut.strokes.end as usize] {
            let Stroke { from, way, radius_m } = *stroke;
            let turned = match foliage.kind() {
                PieceKind::Bough => {
                    TurnedStroke { ends: [from, from + way], half: radius_m, normal: -forward, forward }
                }
                PieceKind::Leaf => {
                    // a square of the area of the point's disc
                    let half = SQUARE * radius_m * cut.growth;
                    let up = forward.any_orthonormal_vector() * half;
                    TurnedStroke { ends: [from - up, from + up], half, normal: way, forward }
                }
            };
            turned.add_to(&mut mesh);
        }
        mesh
    }
}

fn losses(model: &Model) -> [f32; FORMS] {
    let (least, most) = model.range();
    let extent = model.extent();
    if extent.radius <= 0.0 {
        return [0.0; FORMS];
    }
    let ratio = f64::from(most) / f64::from(least);
    let triangles = |form: usize| libm::pow(ratio, form as f64 / (FORMS - 1) as f64) * f64::from(least);
    let views: Vec<View> = (0..VIEWS).map(|at| View::new(at, extent.centre, extent.radius)).collect();
    let full: Vec<Picture> = views.iter().map(|view| view.picture(model, most)).collect();
    let covered = full.iter().flatten().flatten().count().max(1);
    std::array::from_fn(|form| {
        let own = views.iter().map(|view| view.picture(model, triangles(form).round() as u32));
        let wrong =
            |(own, full): (Picture, &Picture)| own.iter().zip(full).map(|(a, b)| difference(*a, *b)).sum::<f32>();
        own.zip(&full).map(wrong).sum::<f32>() / covered as f32
    })
}

/// How far a pixel is from what it should be: half of what normals differ by, all of it where one is missing.
fn difference(a: Option<Vec3>, b: Option<Vec3>) -> f32 {
    match (a, b) {
        (Some(a), Some(b)) => 0.5 * a.distance(b),
        (None, None) => 0.0,
        _ => 1.0,
    }
}

/// A direction that a model is seen along: x is to the right, y away from the eye, z up.
struct View {
    turn: DQuat,
    centre: DVec3,
    pixels_a_metre: f64,
}

impl View {
    fn new(at: usize, centre: DVec3, radius: f64) -> Self {
        // from nearly beside and from above in turn
        let down = if at.is_multiple_of(2) { 0.3 } else { 0.9 };
        let turn = DQuat::from_rotation_x(down) * DQuat::from_rotation_z(TAU * (at as f64 + 0.5) / VIEWS as f64);
        Self { turn, centre, pixels_a_metre: 0.5 * SIDE as f64 / radius }
    }

    fn picture(&self, model: &Model, triangles: u32) -> Picture {
        let mesh = model.drawn(triangles, (self.turn.inverse() * DVec3::Y).as_vec3());
        let place = |vertex: &PrimitiveVertex| {
            let place = self.turn * (vertex.core.as_dvec3() - self.centre) * self.pixels_a_metre;
            DVec3::new(place.x, place.z, place.y) + 0.5 * SIDE as f64
        };
        let places: Vec<DVec3> = mesh.vertices.iter().map(place).collect();
        let mut canvas = Canvas { depths: vec![f64::INFINITY; SIDE * SIDE], normals: vec![None; SIDE * SIDE] };
        for triangle in &mesh.triangles {
            let normals = triangle.map(|i| mesh.vertices[i as usize].normal);
            canvas.draw(triangle.map(|i| places[i as usize]), normals);
        }
        canvas.normals
    }
}

struct Canvas {
    depths: Vec<f64>,
    normals: Picture,
}

impl Canvas {
    /// Draws a triangle by its corners, pixels across, up and away, and their normals.
    fn draw(&mut self, corners: [DVec3; 3], normals: [Vec3; 3]) {
        let [a, b, c] = corners.map(DVec3::truncate);
        let area = (b - a).perp_dot(c - a);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // pixels whose middles may be inside
        let pixels = |low: f64, high: f64| {
            let [from, to] = [low, high].map(|x| (x + 0.5).clamp(0.0, SIDE as f64) as usize);
            from..to
        };
        for row in pixels(low.y, high.y) {
            for column in pixels(low.x, high.x) {
                let at = DVec2::new(column as f64, row as f64) + 0.5;
                let parts = [(b, c), (c, a), (a, b)].map(|(p, q)| (q - p).perp_dot(at - p) / area);
                let depth: f64 = parts.iter().zip(&corners).map(|(part, corner)| part * corner.z).sum();
                let pixel = row * SIDE + column;
                // the parts of a triangle without area are no numbers
                if parts.iter().all(|part| *part >= 0.0) && depth < self.depths[pixel] {
                    let normal: Vec3 = parts.iter().zip(&normals).map(|(part, normal)| *normal * *part as f32).sum();
                    (self.depths[pixel], self.normals[pixel]) = (depth, Some(normal.normalize_or_zero()));
                }
            }
        }
    }
}

/// A stroke between two points that turns to the eye: half its width, its normal, and the direction from the eye.
#[derive(Clone, Copy)]
struct TurnedStroke {
    ends: [Vec3; 2],
    half: f32,
    normal: Vec3,
    forward: Vec3,
}

impl TurnedStroke {
    /// Adds its two triangles.
    fn add_to(&self, mesh: &mut PrimitiveMesh) {
        let Self { ends: [from, to], half, normal, forward } = *self;
        let across = (to - from).cross(forward).normalize_or_zero() * half;
        let first = mesh.vertices.len() as u32;
        let corner = |core: Vec3| PrimitiveVertex { core, normal, uv: Vec2::ZERO };
        mesh.vertices.extend([from - across, from + across, to + across, to - across].map(corner));
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Generator, ProgressiveMesh, TreeSpec, generate, tree};
    use std::sync::Arc;

    fn of(kind: Generator, triangles: u32) -> [f32; FORMS] {
        Model::Mesh(Arc::new(ProgressiveMesh::new(&generate(kind, 1, triangles)).unwrap())).losses()
    }

    #[test]
    fn all_of_a_model_loses_nothing_and_a_coarser_form_of_a_ball_more() {
        let ball = of(Generator::Sphere, 2000);
        assert!(ball.is_sorted_by(|a, b| a >= b) && ball[0] > 0.5 && ball[FORMS - 1] == 0.0, "{ball:?}");
    }

    #[test]
    fn a_box_in_place_of_a_chair_is_worse_than_in_place_of_books() {
        let [seat, books] = [of(Generator::Seat, 240), of(Generator::Books, 240)];
        assert!(seat[0] > 1.0 && books[0] < 0.5, "{seat:?}, {books:?}");
    }

    #[test]
    fn half_of_a_crown_is_wrong_for_longer_than_one_over_its_triangles_says() {
        let [_, crown] = tree(&TreeSpec { seed: 1, height_m: 8.0, branches: 60, leaves: 400, prefix: false });
        let crown = Model::Foliage(Arc::new(crown)).losses();
        // the middle form has 28 of 800 triangles: 1/28 of what the coarsest one loses would be a thirtieth
        assert!(crown[FORMS - 1] == 0.0 && crown[FORMS / 2] > 0.5 * crown[0], "{crown:?}");
    }
}
