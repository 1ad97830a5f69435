//! The surface of an object in a state: points, their velocities, triangles.
//!
//! In: its shape and its newest state. Out: triangles in metres, world axes. Never here: levels of detail, normals, colours.

use glam::{DMat3, DQuat, DVec2, DVec3};
use metachron_core::{Body, CurveState, RigidState, SoftState, ToolState};
use metachron_geometry::{Primitive, PrimitiveMesh, Rounding, ShapeKind, Solid, SurfaceShape, ToolShape, hull_mesh};
use metachron_world::Scene;
use std::f64::consts::{FRAC_PI_2, TAU};

/// The level at which round solids are made of triangles: a ball has 432.
const LEVEL: u8 = 3;
/// Half of the edge of the square that stands for a plane, metres.
const PLANE_HALF_M: f64 = 2.0;
/// Points around a tube.
const AROUND: u32 = 12;
/// Rings of a round end, its tip not counted.
const END_RINGS: u32 = 3;

/// Triangles in world axes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Points, metres.
    pub points: Vec<DVec3>,
    /// Velocity of each point, m/s.
    pub velocities: Vec<DVec3>,
    /// The vertex or node of the object that each point follows; none of a rigid body or a tool.
    pub follows: Vec<u32>,
    /// Points of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// A rigid body's triangles in its own axes, about its centre of mass.
#[derive(Debug, Clone, Default)]
pub(super) struct LocalMesh {
    pub points: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// The surface of a scene's solids that never move.
    #[must_use]
    pub fn fixed(scene: &Scene) -> Surface {
        let mut surface = Surface::default();
        for obstacle in scene.obstacles.iter() {
            surface.place(&obstacle.solid, obstacle.position, obstacle.rotation);
        }
        surface
    }

    /// The surface of a body of this shape; no triangles where the two are not of one kind.
    #[must_use]
    pub fn of(shape: &ShapeKind, body: &Body) -> Self {
        match (shape, body) {
            (ShapeKind::Solid(solid), Body::Rigid(state)) => {
                Self::moved(&LocalMesh::of(&solid.solid, solid.com_local), state)
            }
            (ShapeKind::Chain, Body::Curve(curve)) => Self::tube(curve),
            (ShapeKind::Surface(skin), Body::Soft(state)) if skin.triangles.is_empty() => Self::rope(skin, state),
            (ShapeKind::Surface(skin), Body::Soft(state)) => Self::skin(skin, state),
            (ShapeKind::Tool(tool), Body::Tool(state)) => Self::tool(tool, state),
            _ => Self::default(),
        }
    }

    /// The mean of its points, and of their velocities; `None` without points.
    pub(super) fn middle(&self) -> Option<[DVec3; 2]> {
        let mean = |all: &[DVec3]| all.iter().sum::<DVec3>() / all.len() as f64;
        (!self.points.is_empty()).then(|| [mean(&self.points), mean(&self.velocities)])
    }

    /// A rigid body's triangles where it is.
    pub(super) fn moved(local: &LocalMesh, state: &RigidState) -> Self {
        let arms: Vec<DVec3> = local.points.iter().map(|p| state.rotation * *p).collect();
        Self {
            points: arms.iter().map(|arm| state.position + *arm).collect(),
            velocities: arms.iter().map(|arm| state.velocity + state.spin.cross(*arm)).collect(),
            follows: vec![],
            triangles: local.triangles.clone(),
        }
    }

    /// The same in the axes of a body that is at `position` and turned by `rotation`.
    pub(super) fn in_axes_of(&self, position: DVec3, rotation: DQuat) -> Self {
        let back = rotation.inverse();
        Self { points: self.points.iter().map(|p| back * (*p - position)).collect(), ..self.clone() }
    }

    /// The vertices that triangles use, in the order of their numbers.
    fn skin(skin: &SurfaceShape, state: &SoftState) -> Self {
        let mut place = vec![u32::MAX; state.positions.len()];
        for (k, vertex) in skin.vertices.iter().enumerate() {
            place[*vertex as usize] = k as u32;
        }
        let at = |list: &[DVec3]| skin.vertices.iter().map(|v| list[*v as usize]).collect();
        Self {
            points: at(&state.positions),
            velocities: at(&state.velocities),
            follows: skin.vertices.to_vec(),
            triangles: skin.triangles.iter().map(|t| t.map(|v| place[v as usize])).collect(),
        }
    }

    fn tube(curve: &CurveState) -> Self {
        let of_node = |k: usize| curve.frames[k.saturating_sub(1).min(curve.frames.len() - 1)];
        if curve.frames.is_empty() {
            return Self::default();
        }
        let sections: Vec<Section> = (0..curve.positions.len())
            .map(|k| Section {
                follows: k as u32,
                centre: curve.positions[k],
                velocity: curve.velocities[k],
                axes: of_node(k),
                radius_m: curve.radii_m[k],
                flattening_m: curve.flattening_m.get(k).copied().unwrap_or(DVec2::ZERO),
            })
            .collect();
        Self::swept(&sections)
    }

    fn rope(rope: &SurfaceShape, state: &SoftState) -> Self {
        let nodes = &rope.vertices;
        let way = |k: usize| {
            let (from, to) = (k.saturating_sub(1), (k + 1).min(nodes.len() - 1));
            (state.positions[nodes[to] as usize] - state.positions[nodes[from] as usize]).normalize_or(DVec3::Z)
        };
        let mut axes = DQuat::IDENTITY;
        let sections: Vec<Section> = (0..nodes.len())
            .map(|k| {
                // the least turn from one node's axes to the next's: the triangles do not twist
                axes = DQuat::from_rotation_arc((axes * DVec3::Z).normalize(), way(k)) * axes;
                let node = nodes[k] as usize;
                let (centre, velocity) = (state.positions[node], state.velocities[node]);
                Section {
                    follows: nodes[k],
                    centre,
                    velocity,
                    axes,
                    radius_m: rope.radius_m,
                    flattening_m: DVec2::ZERO,
                }
            })
            .collect();
        Self::swept(&sections)
    }

    /// Rings about every section, with round ends.
    fn swept(sections: &[Section]) -> Self {
        let mut into = Self::default();
        let (Some(first), Some(last)) = (sections.first(), sections.last()) else { return into };
        let tip = into.point(first, first.axes * DVec3::Z * -first.radius_m);
        for k in (0..END_RINGS).rev() {
            into.ring(first, -FRAC_PI_2 * f64::from(k + 1) / f64::from(END_RINGS + 1));
        }
        sections.iter().for_each(|section| into.ring(section, 0.0));
        for k in 0..END_RINGS {
            into.ring(last, FRAC_PI_2 * f64::from(k + 1) / f64::from(END_RINGS + 1));
        }
        let end = into.point(last, last.axes * DVec3::Z * last.radius_m);
        let rings = (end - tip - 1) / AROUND;
        let at = |ring: u32, k: u32| tip + 1 + ring * AROUND + k % AROUND;
        for k in 0..AROUND {
            into.triangles.push([tip, at(0, k + 1), at(0, k)]);
            for ring in 1..rings {
                let [a, b, c, d] = [at(ring - 1, k), at(ring - 1, k + 1), at(ring, k), at(ring, k + 1)];
                into.triangles.extend([[a, b, d], [a, d, c]]);
            }
            into.triangles.push([end, at(rings - 1, k), at(rings - 1, k + 1)]);
        }
        into
    }

    /// A point of a section, `arm` from its centre.
    fn point(&mut self, section: &Section, arm: DVec3) -> u32 {
        self.points.push(section.centre + arm);
        self.velocities.push(section.velocity);
        self.follows.push(section.follows);
        self.points.len() as u32 - 1
    }

    /// The points around a section, at a latitude of the ball of its radius.
    fn ring(&mut self, section: &Section, latitude: f64) {
        for k in 0..AROUND {
            let angle = TAU * f64::from(k) / f64::from(AROUND);
            let turned = DVec2::new((2.0 * angle).cos(), (2.0 * angle).sin());
            let radius = section.radius_m + section.flattening_m.dot(turned);
            let across = DVec3::new(angle.cos(), angle.sin(), 0.0) * radius * latitude.cos();
            let along = DVec3::Z * section.radius_m * latitude.sin();
            self.point(section, section.axes * (across + along));
        }
    }

    fn tool(shape: &ToolShape, state: &ToolState) -> Self {
        let mut into = Self::default();
        for part in shape.parts(state.jaw) {
            let mut local = LocalMesh::default();
            local.add(&part.primitive.mesh(LEVEL), part.size, part.position, part.rotation);
            let of_tip = RigidState {
                position: state.tip,
                rotation: state.rotation,
                velocity: state.velocity,
                spin: state.spin,
            };
            into.append(&Self::moved(&local, &of_tip));
        }
        into
    }

    /// Adds a solid that stays where it is; a plane as a square about the origin of its axes.
    fn place(&mut self, solid: &Solid, position: DVec3, rotation: DQuat) {
        let local = LocalMesh::of(solid, DVec3::ZERO);
        self.append(&Self::moved(&local, &RigidState { position, rotation, ..RigidState::default() }));
    }

    fn append(&mut self, other: &Self) {
        let first = self.points.len() as u32;
        self.points.extend(&other.points);
        self.velocities.extend(&other.velocities);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|p| p + first)));
    }
}

/// A section of a tube or rope.
struct Section {
    follows: u32,
    centre: DVec3,
    velocity: DVec3,
    /// Its third axis is that of the tube.
    axes: DQuat,
    radius_m: f64,
    flattening_m: DVec2,
}

impl LocalMesh {
    /// The triangles of a solid about `com_m`, its centre of mass in the solid's axes.
    pub(super) fn of(solid: &Solid, com_m: DVec3) -> Self {
        let mut into = Self::default();
        into.add_solid(solid, -com_m, DQuat::IDENTITY);
        into
    }

    fn add_solid(&mut self, solid: &Solid, position: DVec3, rotation: DQuat) {
        const WHOLE: Rounding = Rounding { extents: glam::Vec3::ONE, radius_m: 0.0 };
        if let Some((primitive, size)) = Primitive::of(solid, LEVEL) {
            return self.add(&primitive.mesh(LEVEL), size, position, rotation);
        }
        match solid {
            Solid::Hull { points_m } => {
                if let Some(mesh) = hull_mesh(points_m) {
                    self.add(&mesh, WHOLE, position, rotation);
                }
            }
            Solid::Mesh { points_m, triangles } => {
                let first = self.points.len() as u32;
                self.points.extend(points_m.iter().map(|p| position + rotation * *p));
                self.triangles.extend(triangles.iter().map(|t| t.map(|p| p + first)));
            }
            Solid::Compound { parts } => {
                for part in parts.iter() {
                    self.add_solid(&part.solid, position + rotation * part.position_m, rotation * part.rotation);
                }
            }
            Solid::Plane => {
                let first = self.points.len() as u32;
                let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
                let at = |[x, y]: [f64; 2]| position + rotation * DVec3::new(x, y, 0.0) * PLANE_HALF_M;
                self.points.extend(corners.map(at));
                self.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|p| p + first)));
            }
            Solid::Ball { .. } | Solid::Box { .. } | Solid::Capsule { .. } | Solid::Cylinder { .. } => {}
        }
    }

    fn add(&mut self, mesh: &PrimitiveMesh, size: Rounding, position: DVec3, rotation: DQuat) {
        let first = self.points.len() as u32;
        let axes = DMat3::from_quat(rotation);
        let local = mesh.vertices.iter().map(|v| (v.core * size.extents + v.normal * size.radius_m).as_dvec3());
        self.points.extend(local.map(|p| position + axes * p));
        self.triangles.extend(mesh.triangles.iter().map(|t| t.map(|p| p + first)));
    }
}
