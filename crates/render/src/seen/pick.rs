//! Picking: the nearest object along a ray, in its displayed state.
//!
//! In: a ray. Out: an object and its material point. Never here: the action on it.

use super::view::Ray;
use crate::states::scene_view::{Form, SceneView, Track};
use glam::{DQuat, DVec3, Vec3};
use metachron_core::{AgentId, Anchor, Body, CurveState, SoftState, ToolState};
use metachron_geometry::SurfaceShape;
use metachron_geometry::{Primitive, PrimitiveMesh, Rounding, Solid, ToolShape};

/// The hit of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The agent hit.
    pub object: AgentId,
    /// The material point.
    pub anchor: Anchor,
    /// The point in space, metres.
    pub point_m: DVec3,
    /// Distance along the ray, metres.
    pub distance_m: f64,
}

/// Level of the meshes that rays are tested against: accurate enough for a pointer.
const PICK_LEVEL: u8 = 3;
/// Radius for picking a tool, as a multiple of its shaft's: tools are thin.
const TOOL_GRIP: f64 = 3.0;

impl SceneView {
    /// The nearest object along `ray`, if there is one. Props are not picked.
    #[must_use]
    pub fn pick(&self, ray: Ray) -> Option<Hit> {
        let hits = self.tracks.iter().filter_map(|track| {
            let (anchor, distance_m) = self.hit(track, ray)?;
            let point_m = ray.origin + ray.direction * distance_m;
            Some(Hit { object: track.actor.id, anchor, point_m, distance_m })
        });
        hits.min_by(|a, b| a.distance_m.total_cmp(&b.distance_m))
    }

    fn hit(&self, track: &Track, ray: Ray) -> Option<(Anchor, f64)> {
        let near = (track.bounds.centre - ray.origin).cross(ray.direction).length() <= track.bounds.radius_m;
        match (&track.actor.form, &track.pose) {
            _ if !near => None,
            (Form::Tube, Body::Curve(curve)) => hit_curve(curve, ray),
            (Form::Skin(form), Body::Soft(soft)) => hit_skin(&form.surface, soft, ray),
            (Form::Rope { radius_m }, Body::Soft(soft)) => hit_rope(soft, *radius_m, ray),
            (Form::Tool(shape), Body::Tool(tool)) => hit_tool(shape, tool, ray),
            (Form::Solid(solid), Body::Rigid(body)) => {
                let local = Ray {
                    origin: body.rotation.inverse() * (ray.origin - body.position),
                    direction: body.rotation.inverse() * ray.direction,
                };
                let distance = self.hit_solid(solid, track.body.mesh_index, local)?;
                Some((Anchor::Local(local.origin + local.direction * distance), distance))
            }
            _ => None,
        }
    }

    fn hit_solid(&self, solid: &Solid, mesh_index: Option<u32>, ray: Ray) -> Option<f64> {
        if let Some(number) = mesh_index {
            let whole = Rounding { extents: Vec3::ONE, radius_m: 0.0 };
            return hit_mesh(self.picture.meshes.get(number as usize)?, whole, ray);
        }
        let (primitive, size) = Primitive::of(solid, PICK_LEVEL)?;
        hit_mesh(&primitive.mesh(PICK_LEVEL), size, ray)
    }
}

/// Distance along the ray to a capsule from `a` to `b`, and the fraction from `a` to `b`: the ray's closest approach to the line, moved
/// back to the skin.
fn hit_capsule(a: DVec3, b: DVec3, radius_m: f64, ray: Ray) -> Option<(f64, f64)> {
    let (axis, from) = (b - a, a - ray.origin);
    let (aa, ad, fd) = (axis.length_squared(), axis.dot(ray.direction), from.dot(ray.direction));
    let across = aa - ad * ad;
    let share = if across > 1e-12 * aa { ((ad * fd - from.dot(axis)) / across).clamp(0.0, 1.0) } else { 0.0 };
    let on_axis = from + axis * share;
    let along = on_axis.dot(ray.direction);
    let off = (on_axis - ray.direction * along).length_squared();
    let inside = radius_m * radius_m - off;
    let distance = along - inside.max(0.0).sqrt();
    (inside >= 0.0 && distance > 0.0).then_some((distance, share))
}

fn hit_curve(curve: &CurveState, ray: Ray) -> Option<(Anchor, f64)> {
    let hits = (0..curve.positions.len().saturating_sub(1)).filter_map(|i| {
        let radius = curve.radii_m[i].max(curve.radii_m[i + 1]);
        let (distance, w) = hit_capsule(curve.positions[i], curve.positions[i + 1], radius, ray)?;
        Some((Anchor::Arc(curve.arc_m[i] + (curve.arc_m[i + 1] - curve.arc_m[i]) * w), distance))
    });
    hits.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The nearest triangle of a skin along the ray, hit from either side, and its vertex nearest to the hit.
fn hit_skin(form: &SurfaceShape, soft: &SoftState, ray: Ray) -> Option<(Anchor, f64)> {
    let hits = form.triangles.iter().filter_map(|triangle| {
        let corners = triangle.map(|vertex| soft.positions[vertex as usize]);
        let [a, b, c] = corners;
        let distance = hit_triangle([a, b, c], ray).or_else(|| hit_triangle([a, c, b], ray))?;
        let point = ray.origin + ray.direction * distance;
        let nearest = triangle
            .iter()
            .zip(corners)
            .min_by(|p, q| p.1.distance_squared(point).total_cmp(&q.1.distance_squared(point)));
        nearest.map(|(vertex, _)| (Anchor::Vertex(*vertex), distance))
    });
    hits.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Radius for picking a rope, as a multiple of its own: ropes are thin.
const ROPE_GRIP: f64 = 2.0;

fn hit_rope(soft: &SoftState, radius_m: f64, ray: Ray) -> Option<(Anchor, f64)> {
    let hits = (0_u32..).zip(soft.positions.windows(2)).filter_map(|(i, ends)| {
        let (distance, w) = hit_capsule(ends[0], ends[1], ROPE_GRIP * radius_m, ray)?;
        Some((Anchor::Vertex(i + u32::from(w > 0.5)), distance))
    });
    hits.min_by(|a, b| a.1.total_cmp(&b.1))
}

fn hit_tool(shape: &ToolShape, tool: &ToolState, ray: Ray) -> Option<(Anchor, f64)> {
    let end = tool.tip - tool.rotation * DVec3::Z * shape.shaft_length_m;
    let (distance, _) = hit_capsule(tool.tip, end, TOOL_GRIP * shape.shaft_radius_m, ray)?;
    let point = ray.origin + ray.direction * distance;
    Some((Anchor::Local(DQuat::inverse(tool.rotation) * (point - tool.tip)), distance))
}

/// Distance along the ray to a triangle that faces it (Möller and Trumbore's test).
fn hit_triangle([a, b, c]: [DVec3; 3], ray: Ray) -> Option<f64> {
    let (u, v) = (b - a, c - a);
    let p = ray.direction.cross(v);
    let facing = u.dot(p);
    if facing <= 0.0 {
        return None;
    }
    let s = ray.origin - a;
    let q = s.cross(u);
    let (wu, wv) = (s.dot(p) / facing, ray.direction.dot(q) / facing);
    let distance = v.dot(q) / facing;
    (wu >= 0.0 && wv >= 0.0 && wu + wv <= 1.0 && distance > 0.0).then_some(distance)
}

/// Distance along the ray to the nearest triangle that faces it.
fn hit_mesh(mesh: &PrimitiveMesh, size: Rounding, ray: Ray) -> Option<f64> {
    let corner = |i: u32| {
        let v = mesh.vertices[i as usize];
        (v.core * size.extents + v.normal * size.radius_m).as_dvec3()
    };
    let hits = mesh.triangles.iter().filter_map(|t| hit_triangle(t.map(corner), ray));
    hits.min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::composition::skin::SkinForm;
    use crate::states::scene_view::{Actor, Appearance, Material, States};
    use metachron_core::{RigidState, SimTime, Snapshot};
    use metachron_geometry::{CollisionShape, ShapeKind};
    use std::sync::Arc;

    fn scene_view(forms: Vec<(Form, Body)>) -> SceneView {
        let appearance = Appearance { colour: [200; 3], material: Material::Plastic };
        let ids = 0..forms.len() as u32;
        let actors = forms
            .iter()
            .zip(ids)
            .map(|((form, _), id)| Actor { id: AgentId(id), form: form.clone(), appearance })
            .collect();
        let mut scene_view = SceneView::new(actors, vec![]);
        for (id, (_, body)) in forms.into_iter().enumerate() {
            scene_view.set_snapshot(AgentId(id as u32), &Arc::new(Snapshot { body, ..Snapshot::default() }), true);
        }
        scene_view.pose(SimTime::ZERO, States::Latest);
        scene_view
    }

    fn ball(x: f64) -> (Form, Body) {
        let position = DVec3::new(x, 0.0, 0.0);
        (Form::Solid(Solid::Ball { radius_m: 0.5 }), Body::Rigid(RigidState { position, ..RigidState::default() }))
    }

    #[test]
    fn the_nearer_of_two_is_picked_at_its_surface() {
        let scene_view = scene_view(vec![ball(5.0), ball(2.0)]);
        let hit = scene_view.pick(Ray { origin: DVec3::ZERO, direction: DVec3::X }).unwrap();
        assert_eq!(hit.object, AgentId(1));
        // a ball of level 3 is within 8 % of a radius of the exact one
        assert!((hit.distance_m - 1.5).abs() < 0.04, "{}", hit.distance_m);
        assert_eq!(scene_view.pick(Ray { origin: DVec3::ZERO, direction: DVec3::Y }), None);
    }

    #[test]
    fn a_tube_is_picked_at_the_arc_length_under_the_pointer() {
        let n = 10;
        let arc_m: Vec<f64> = (0..=n).map(|i| f64::from(i) * 0.1).collect();
        let curve = CurveState {
            positions: arc_m.iter().map(|&s| DVec3::new(2.0, s, 0.0)).collect(),
            velocities: vec![DVec3::ZERO; 11],
            frames: vec![DQuat::IDENTITY; 10],
            radii_m: vec![0.05; 11],
            flattening_m: vec![],
            arc_m,
        };
        let scene_view = scene_view(vec![(Form::Tube, Body::Curve(curve))]);
        let hit = scene_view.pick(Ray { origin: DVec3::new(0.0, 0.63, 0.0), direction: DVec3::X }).unwrap();
        let Anchor::Arc(arc) = hit.anchor else { panic!("{hit:?}") };
        assert!((arc - 0.63).abs() < 1e-12 && (hit.distance_m - 1.95).abs() < 1e-12, "{hit:?}");
    }

    #[test]
    fn a_ray_goes_through_where_a_skin_has_lost_its_triangles() {
        let corner = |k: u32| DVec3::new(2.0 + f64::from(k >> 2), f64::from(k & 1) - 0.5, f64::from(k >> 1 & 1) - 0.4);
        let positions: Vec<DVec3> = (0..8).map(corner).collect();
        let surface = |triangles: &[[u32; 3]]| SurfaceShape {
            vertices: (0..8).collect(),
            edges: [].into(),
            triangles: triangles.into(),
            fans: Arc::default(),
            radius_m: 0.0,
            edge_m: 1.0,
            closed: true,
        };
        let [near, far] = [[[0, 2, 1], [1, 2, 3]], [[4, 5, 6], [5, 7, 6]]];
        let whole = surface(&[near, far].concat());
        let soft = SoftState { velocities: vec![DVec3::ZERO; 8], positions, nodes: None };
        let form = Form::Skin(SkinForm::new(whole, &soft.positions));
        let mut scene_view = scene_view(vec![(form, Body::Soft(soft))]);
        let distance_m = |view: &SceneView| {
            let hit = view.pick(Ray { origin: DVec3::ZERO, direction: DVec3::X });
            hit.map(|hit| hit.distance_m)
        };
        assert_eq!(distance_m(&scene_view), Some(2.0));
        let shape = |triangles: &[[u32; 3]]| CollisionShape::new(ShapeKind::Surface(surface(triangles)), 0.0);
        scene_view.set_shape(AgentId(0), &shape(&far));
        assert_eq!(distance_m(&scene_view), Some(3.0));
        scene_view.set_shape(AgentId(0), &shape(&[]));
        assert_eq!(distance_m(&scene_view), None);
    }
}
