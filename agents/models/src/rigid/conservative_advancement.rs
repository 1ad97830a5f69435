//! Lower bound of the time until a flying body may touch a static solid: conservative advancement (MIR96).
//!
//! In: a [`Motion`], a gravity and a span. Out: seconds of certainly free flight. Never here: contact response.
//!
//! A point of the body approaches along the normal n no faster than a = −n·v + |ω|R, and gravity adds b = −n·g at most, so
//! a gap d lasts at least the first root of ½ b t² + a t = d. Between convex solids the plane through the nearest point
//! separates them, so the bound holds; for the rest a = |v| + |ω|R and b = |g|. For a ball over a plane it is the exact time.

use super::RigidError;
use super::mass_properties::{MassDistribution, encloses, volume};
use super::motion::Motion;
use glam::{DQuat, DVec3};
use metachron_geometry::{Solid, hull_triangles, mesh_triangles};
use rapier3d::parry::math::{Pose, Rotation, Vec3};
use rapier3d::parry::query::{DefaultQueryDispatcher, QueryDispatcher};
use rapier3d::parry::shape::{Shape, SharedShape};

/// A shape fixed in the world.
pub(super) struct Fixed {
    shape: SharedShape,
    position: DVec3,
    rotation: DQuat,
    convex: bool,
    /// Lowest and highest corner in world axes; `None` for a plane, which is unbounded.
    bounds: Option<(DVec3, DVec3)>,
}

/// The moving shape with the measures that the bound needs.
pub(super) struct MovingShape {
    /// The shape, in its own axes.
    pub shape: SharedShape,
    /// Where the centre of mass is in the shape's axes.
    com: DVec3,
    convex: bool,
    /// No point of the shape is farther from the centre of mass, metres.
    pub radius_m: f64,
    /// No point of the surface moves faster along a normal than |ω| times this, metres; zero for a ball.
    pub swing_m: f64,
}

/// Contacts ahead of a flight: seconds of it that are certainly free.
#[derive(Debug, Clone, Copy)]
pub(super) struct ImpactTimes {
    /// Time until contact with a solid that does not bounce, or that hardly approaches.
    pub near_s: f64,
    /// Time until contact with an approaching solid that bounces.
    pub coming_s: f64,
}

/// An approaching solid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Approach {
    /// Free flight until it may be touched, seconds.
    pub free_s: f64,
    /// Approach speed along the normal, m/s.
    pub closing_m_s: f64,
}

impl Approach {
    /// No contact for `horizon` seconds.
    pub(super) const fn none(horizon: f64) -> Self {
        Self { free_s: horizon, closing_m_s: 0.0 }
    }
}

/// Contacts that approach more slowly than this do not bounce, m/s: off the ground the body would be back within 4 ms.
const BOUNCE_M_S: f64 = 0.02;

impl ImpactTimes {
    /// No contact for `horizon` seconds.
    pub(super) const fn clear(horizon: f64) -> Self {
        Self { near_s: horizon, coming_s: horizon }
    }

    /// Adds a solid whose contact with the body has this restitution.
    pub(super) fn add(&mut self, approach: Approach, restitution: f64) {
        let Approach { free_s, closing_m_s } = approach;
        let ahead = if restitution > 0.0 && closing_m_s > BOUNCE_M_S { &mut self.coming_s } else { &mut self.near_s };
        *ahead = ahead.min(free_s);
    }

    /// Seconds until any contact.
    pub(super) const fn free_s(&self) -> f64 {
        self.near_s.min(self.coming_s)
    }
}

/// The gap at which a body counts as touching, as a share of its radius: far above the 1e-6 that single-precision queries
/// resolve, far below the visible. At most [`SKIN_MAX_M`].
const SKIN_SHARE: f64 = 2e-4;
/// The widest gap that counts as touching, metres.
const SKIN_MAX_M: f64 = 1e-4;
/// A mesh whose hull has at most this many times its volume counts as convex.
const HULL_EXCESS: f64 = 1.02;

impl MovingShape {
    /// The collision shape of a moving solid, and its measures.
    ///
    /// A closed mesh that is not convex is divided into convex parts (V-HACD, 64³ voxels, concavity 0.01): corners in
    /// hollows are rounded by about a sixty-fourth of its size. An open mesh counts as its hull.
    pub(super) fn new(solid: &Solid, body: &MassDistribution) -> Result<Self, RigidError> {
        let shape = match solid {
            Solid::Mesh { points_m, triangles } => {
                let mesh = mesh_triangles(points_m, triangles)?;
                let hull = hull_triangles(points_m)?;
                if encloses(&mesh) && volume(&hull) > HULL_EXCESS * volume(&mesh) {
                    let points: Vec<_> = mesh.points.iter().map(|p| p.as_vec3()).collect();
                    SharedShape::convex_decomposition(&points, &mesh.triangles)
                } else {
                    Solid::Hull { points_m: points_m.clone() }.to_shared_shape()?
                }
            }
            _ => solid.to_shared_shape()?,
        };
        let convex = shape.as_compound().is_none_or(|parts| parts.shapes().len() == 1);
        let (mut radius_m, mut swing_m) = extents(solid, body.com);
        if !convex {
            // voxels stick out of the mesh a little
            let ball = shape.compute_local_bounding_sphere();
            let far = f64::from(ball.radius) + ball.center.as_dvec3().distance(body.com);
            (radius_m, swing_m) = (radius_m.max(far), swing_m.max(far));
        }
        Ok(Self { shape, com: body.com, convex, radius_m, swing_m })
    }

    /// Whether it is convex.
    pub(super) const fn is_convex(&self) -> bool {
        self.convex
    }

    /// Whether it is a ball.
    pub(super) const fn is_ball(&self) -> bool {
        self.swing_m == 0.0
    }

    /// Position of the origin of the shape's axes, for a body in this motion.
    pub(super) fn origin(&self, motion: &Motion) -> DVec3 {
        motion.position - motion.rotation * self.com
    }

    /// The gap at which this body counts as touching, metres.
    pub(super) fn skin_m(&self) -> f64 {
        (SKIN_SHARE * self.radius_m).min(SKIN_MAX_M)
    }
}

/// The distance from the centre of mass to the farthest point, and to the farthest point that the spin moves along a normal.
fn extents(solid: &Solid, com: DVec3) -> (f64, f64) {
    let both = |r: f64| (r, r);
    match solid {
        Solid::Ball { radius_m } => (*radius_m, 0.0),
        Solid::Box { half_extents_m } => both(half_extents_m.length()),
        Solid::Capsule { radius_m, half_height_m } => (radius_m + half_height_m, *half_height_m),
        Solid::Cylinder { radius_m, half_height_m } => both(libm::hypot(*radius_m, *half_height_m)),
        Solid::Plane => both(0.0),
        Solid::Hull { points_m } | Solid::Mesh { points_m, .. } => {
            both(points_m.iter().map(|p| p.distance(com)).fold(0.0, f64::max))
        }
    }
}

impl Fixed {
    /// A solid fixed at `position`.
    pub(super) fn new(solid: &Solid, position: DVec3, rotation: DQuat) -> Result<Self, metachron_geometry::ShapeError> {
        let shape = solid.to_shared_shape()?;
        let rotation = rotation.normalize();
        let bounds = (!matches!(solid, Solid::Plane)).then(|| {
            let bounds = shape.compute_aabb(&pose(position, rotation));
            (bounds.mins.as_dvec3(), bounds.maxs.as_dvec3())
        });
        Ok(Self { shape, position, rotation, convex: !matches!(solid, Solid::Mesh { .. }), bounds })
    }

    /// The shape and its place, for the contact solver.
    pub(super) fn placed(&self) -> (SharedShape, Pose) {
        (self.shape.clone(), pose(self.position, self.rotation))
    }

    /// The approach of the body to this solid: at most `horizon` seconds.
    pub(super) fn approach(&self, mover: &MovingShape, motion: &Motion, fall: Fall, horizon: f64) -> Approach {
        let reach = fall.reach(motion, mover, horizon);
        if self.bounds.is_some_and(|(low, high)| {
            motion.position.distance(motion.position.clamp(low, high)) > mover.radius_m + reach
        }) {
            return Approach::none(horizon);
        }
        let Some((normal, gap)) = self.gap(mover, motion, reach) else { return Approach::none(horizon) };
        let (swing, closing_m_s) = (fall.spin_max * mover.swing_m, -normal.dot(motion.velocity));
        let (a, b) = if self.convex && mover.convex {
            (swing + closing_m_s, (-normal.dot(fall.gravity)).max(0.0))
        } else {
            (swing + motion.velocity.length(), fall.gravity.length())
        };
        Approach { free_s: first_root(a, b, gap - mover.skin_m()).min(horizon), closing_m_s }
    }

    /// Height of the body's lowest point above this plane, metres.
    ///
    /// Each convex part is queried itself: parry 0.31.1 answers for a compound over a half space with the pose inverted.
    fn height(&self, mover: &MovingShape, relative: &Pose) -> Option<f32> {
        let lowest = |part: &dyn Shape, pose: Pose| {
            let lowest = part.as_support_map()?.support_point_toward(&pose, -Vec3::Z);
            Some(lowest.z)
        };
        match mover.shape.as_compound() {
            Some(parts) => {
                let heights = parts.shapes().iter().filter_map(|(at, part)| lowest(part.as_ref(), *relative * *at));
                heights.reduce(f32::min)
            }
            None => lowest(mover.shape.as_ref(), *relative),
        }
    }

    /// The outward normal at the nearest point, and the gap there (negative inside); `None` beyond `reach`.
    fn gap(&self, mover: &MovingShape, motion: &Motion, reach: f64) -> Option<(DVec3, f64)> {
        // relative in double precision first: single precision then only handles small numbers where it matters
        let back = self.rotation.conjugate();
        let relative = pose(back * (mover.origin(motion) - self.position), back * motion.rotation);
        if self.bounds.is_none() {
            let height = f64::from(self.height(mover, &relative)?);
            return (height <= reach + mover.skin_m()).then(|| (self.rotation * DVec3::Z, height));
        }
        let contact = DefaultQueryDispatcher
            .contact(&relative, self.shape.as_ref(), mover.shape.as_ref(), (reach + mover.skin_m()) as f32)
            .ok()??;
        Some((self.rotation * contact.normal1.as_dvec3(), f64::from(contact.dist)))
    }

    /// How deep the body is inside this solid, metres, ≥ 0.
    pub(super) fn depth_m(&self, mover: &MovingShape, motion: &Motion) -> f64 {
        let near = self
            .bounds
            .is_none_or(|(low, high)| motion.position.distance(motion.position.clamp(low, high)) < mover.radius_m);
        if near { self.gap(mover, motion, 0.0).map_or(0.0, |(_, gap)| (-gap).max(0.0)) } else { 0.0 }
    }
}

/// Acceleration and maximum spin of a flying body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fall {
    /// Acceleration, m/s².
    pub gravity: DVec3,
    /// The largest spin it can reach, rad/s.
    pub spin_max: f64,
}

impl Fall {
    /// Upper bound of the distance travelled by any point of the body in `t` seconds.
    fn reach(&self, motion: &Motion, mover: &MovingShape, t: f64) -> f64 {
        (motion.velocity.length() + self.spin_max * mover.swing_m) * t + 0.5 * self.gravity.length() * t * t
    }
}

/// The first t > 0 at which ½ b t² + a t = d, with b ≥ 0; a gap that is closed counts as zero.
pub(super) fn first_root(a: f64, b: f64, d: f64) -> f64 {
    let d = d.max(0.0);
    let under = a * a + 2.0 * b * d;
    if a > 0.0 {
        2.0 * d / (a + under.sqrt())
    } else if b > 0.0 {
        (under.sqrt() - a) / b
    } else {
        f64::INFINITY
    }
}

/// A pose in single precision.
pub(super) fn pose(position: DVec3, rotation: DQuat) -> Pose {
    let q = rotation.as_quat();
    Pose::from_parts(position.as_vec3(), Rotation::from_xyzw(q.x, q.y, q.z, q.w).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_root_solves_its_equation() {
        for (a, b, d) in [(1.0, 9.81, 2.0), (-3.0, 9.81, 0.5), (-3.0, 9.81, -1.0), (0.0, 9.81, 1e-9), (2.0, 0.0, 1.0)] {
            let t = first_root(a, b, d);
            let left = 0.5 * b * t * t + a * t - d.max(0.0);
            assert!(t > 0.0 && left.abs() < 1e-12, "{a} {b} {d}: {t} leaves {left:e}"); // rounding of numbers near 1
        }
        assert_eq!(first_root(1.0, 9.81, 0.0), 0.0);
        assert_eq!(first_root(-1.0, 0.0, 0.0), f64::INFINITY);
    }

    #[test]
    fn the_bound_never_passes_the_true_touch() {
        let solid = Solid::Box { half_extents_m: DVec3::new(0.1, 0.2, 0.05) };
        let body = MassDistribution::of(&solid, 1.0).unwrap();
        let mover = MovingShape::new(&solid, &body).unwrap();
        let floor = Fixed::new(&Solid::Plane, DVec3::ZERO, DQuat::IDENTITY).unwrap();
        let gravity = DVec3::Z * -9.81;
        for i in 0..50_u32 {
            let seed = f64::from(i);
            let mut motion = Motion {
                position: DVec3::new(0.0, 0.0, 0.5 + 0.05 * seed),
                rotation: DQuat::from_euler(glam::EulerRot::XYZ, seed, 2.0 * seed, 0.7 * seed),
                velocity: DVec3::new(1.0, 0.0, libm::sin(seed) * 3.0),
                angular: DVec3::ZERO,
            };
            motion.set_spin(&body, DVec3::new(libm::cos(seed), libm::sin(2.0 * seed), 1.0) * 8.0);
            let fall = Fall { gravity, spin_max: motion.spin_max(&body) };
            let t = floor.approach(&mover, &motion, fall, 10.0).free_s;
            motion.fly(&body, gravity, t);
            let gap = floor.gap(&mover, &motion, 100.0).unwrap().1;
            assert!(gap > 0.0, "case {i}: {gap:e} m inside after {t} s"); // the skin is 4e-5 m
        }
    }
}
