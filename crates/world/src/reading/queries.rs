//! Spatial queries of a running world: rays, shapes that are cast, the nearest point, overlaps, contacts.
//!
//! In: the newest states. Out: hits. A ray or a shape goes on by the distance that is certainly free until it is within
//! a hundredth of a millimetre of something: exact for every kind of object, and no faster where it grazes one. Never
//! here: forces, steps.

use super::events::touched;
use super::object::{Object, Touched};
use crate::error::WorldError;
use crate::world::World;
use glam::{DQuat, DVec3};
use metachron_contact::remote::PublishedShape;
use metachron_core::{ContactPartner, ContactState, SimTime, unit_rotation};
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
use metachron_geometry::{
    Aabb, CollisionShape, PlacedShape, ShapeError, ShapeKind, ShapePose, Solid, SolidShape, Touch,
};

/// A surface nearer than this is met, metres.
const MET_M: f64 = 1e-5;
/// The radius of a ray and of a point, metres: below the resolution of single precision.
const POINT_M: f64 = 1e-6;
/// A ray that has made so many steps grazes something for long: it meets it there.
const STEPS_MAX: u32 = 256;

/// A hit of a query.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The object or solid that was found.
    pub what: Touched,
    /// The point of its surface, metres.
    pub point_m: DVec3,
    /// The normal of its surface there, outwards, of length 1.
    pub normal: DVec3,
    /// How far away it is along the ray, the cast or the shortest line, metres; negative by how much something overlaps.
    pub distance_m: f64,
}

/// A contact of an object as it is now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactNow {
    /// The other side.
    pub with: Touched,
    /// When it began.
    pub since: SimTime,
    /// The place that bears most, metres.
    pub point_m: DVec3,
    /// The normal there, towards the object, of length 1.
    pub normal: DVec3,
    /// The force on the object, world axes, N: the mean of the last step.
    pub force_n: DVec3,
    /// The deepest overlap, metres, ≥ 0.
    pub depth_m: f64,
    /// How much more it bears for each metre that a side which a user leads (poses of a kinematic body, the spring of a tool) is led on within
    /// the next step, along the normal, N/m, ≥ 0; 0 where a user leads neither, and in heaps.
    pub stiffness_n_m: f64,
}

impl World {
    /// The first thing that a ray meets within `reach_m` metres.
    ///
    /// # Errors
    /// [`WorldError::BadQuery`] for numbers that are not finite, and for a direction without length.
    pub fn cast_ray(&self, from_m: DVec3, direction: DVec3, reach_m: f64) -> Result<Option<Hit>, WorldError> {
        let point = Solid::Ball { radius_m: POINT_M };
        self.cast(&Cast { solid: &point, rotation: DQuat::IDENTITY, from_m, direction, reach_m })
    }

    /// The first thing that a solid meets that goes along a straight line without turning.
    ///
    /// # Errors
    /// [`WorldError::BadQuery`] as for rays, and for a solid that is invalid or has no size.
    pub fn cast(&self, cast: &Cast<'_>) -> Result<Option<Hit>, WorldError> {
        let Cast { solid, rotation, from_m, direction, reach_m } = *cast;
        let Some(way) =
            direction.try_normalize().filter(|_| from_m.is_finite() && reach_m >= 0.0 && reach_m.is_finite())
        else {
            return Err(WorldError::bad_query(
                "a cast needs a finite start, a direction with a length and a reach of at least 0 m",
            ));
        };
        let mut probe = Probe::new(solid, rotation)?;
        let path = Aabb::of(&[from_m, from_m + way * reach_m]).grown(probe.radius_m);
        let near = self.near(&path);
        let mut gone_m = 0.0;
        for _ in 0..STEPS_MAX {
            let left_m = reach_m - gone_m;
            let Some(met) = probe.nearest(self, &near, from_m + way * gone_m, left_m) else { return Ok(None) };
            if met.distance_m <= MET_M {
                return Ok(Some(Hit { distance_m: gone_m, ..met }));
            }
            gone_m += met.distance_m;
            if gone_m > reach_m {
                return Ok(None);
            }
        }
        Ok(probe.nearest(self, &near, from_m + way * gone_m, MET_M).map(|met| Hit { distance_m: gone_m, ..met }))
    }

    /// The point of any surface that is nearest to a point, within `reach_m` metres.
    ///
    /// # Errors
    /// [`WorldError::BadQuery`] for numbers that are not finite.
    pub fn nearest(&self, point_m: DVec3, reach_m: f64) -> Result<Option<Hit>, WorldError> {
        if !point_m.is_finite() || !(0.0..f64::INFINITY).contains(&reach_m) {
            return Err(WorldError::bad_query("the nearest point needs a finite place and a reach of at least 0 m"));
        }
        let mut probe = Probe::new(&Solid::Ball { radius_m: POINT_M }, DQuat::IDENTITY)?;
        let near = self.near(&Aabb::about(point_m, reach_m + POINT_M));
        Ok(probe.nearest(self, &near, point_m, reach_m))
    }

    /// All that a solid at a place overlaps, the deepest first.
    ///
    /// # Errors
    /// [`WorldError::BadQuery`] for a solid that is invalid or has no size, and for a place that is not finite.
    pub fn overlapping(&self, solid: &Solid, at_m: DVec3, rotation: DQuat) -> Result<Vec<Hit>, WorldError> {
        if !at_m.is_finite() {
            return Err(WorldError::bad_query("a solid needs a finite place"));
        }
        let mut probe = Probe::new(solid, rotation)?;
        let near = self.near(&Aabb::about(at_m, probe.radius_m));
        let mut hits: Vec<_> = near.iter().filter_map(|one| probe.against(self, one, at_m, 0.0)).collect();
        hits.retain(|hit| hit.distance_m < 0.0);
        hits.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
        Ok(hits)
    }

    /// The contacts of an object now.
    ///
    /// # Errors
    /// [`WorldError::Foreign`].
    pub fn contacts(&self, object: Object) -> Result<Vec<ContactNow>, WorldError> {
        let own = self.latest(object)?;
        let mut all: Vec<_> = own.contacts.iter().map(|contact| self.contact(contact.with, contact, 1.0)).collect();
        for other in self.agents().iter().filter(|other| other.id() < object.id()) {
            let theirs = other.latest();
            let of_it = theirs.contacts.iter().filter(|contact| contact.with == ContactPartner::Agent(object.id()));
            all.extend(of_it.map(|contact| self.contact(ContactPartner::Agent(other.id()), contact, -1.0)));
        }
        Ok(all)
    }

    fn contact(&self, with: ContactPartner, state: &ContactState, sign: f64) -> ContactNow {
        let ContactState { since, point_m, normal, force_n, depth_m, stiffness_n_m, .. } = *state;
        let with = touched(self.tag(), with);
        ContactNow { with, since, point_m, normal: normal * sign, force_n: force_n * sign, depth_m, stiffness_n_m }
    }

    /// The objects and solids with matter in a box.
    fn near(&self, within: &Aabb) -> Vec<Near> {
        let mut near = Vec::new();
        for (number, solid) in (0..).zip(self.surroundings().statics()) {
            if solid.bounds().meets(*within) {
                near.push(Near { what: Touched::Fixed(number), shape: PublishedShape::default() });
            }
        }
        for agent in self.agents().iter() {
            let Some(form) = agent.form() else { continue };
            let mut shape = PublishedShape::default();
            let known = shape.bring(&agent.latest().body, 0.0);
            if known && shape.placed(&form).is_some_and(|placed| placed.bounds().meets(*within)) {
                near.push(Near { what: Touched::Object(self.tag().object(agent.id())), shape });
            }
        }
        near
    }
}

/// A solid that goes along a straight line without turning.
#[derive(Debug, Clone, Copy)]
pub struct Cast<'a> {
    /// The solid.
    pub solid: &'a Solid,
    /// From its axes to the world's.
    pub rotation: DQuat,
    /// Where the origin of its axes begins, metres.
    pub from_m: DVec3,
    /// Where it goes; of any length above zero.
    pub direction: DVec3,
    /// How far, metres, ≥ 0.
    pub reach_m: f64,
}

/// Something near a query.
struct Near {
    what: Touched,
    shape: PublishedShape,
}

/// The solid of a query.
struct Probe {
    form: CollisionShape,
    rotation: DQuat,
    radius_m: f64,
    scratch: NarrowPhaseScratch,
    found: Vec<Touch>,
}

impl Probe {
    fn new(solid: &Solid, rotation: DQuat) -> Result<Self, WorldError> {
        let bad = |error: ShapeError| WorldError::bad_query(&error.to_string());
        let Some(rotation) = unit_rotation(rotation).filter(|_| !matches!(solid, Solid::Plane)) else {
            return Err(WorldError::bad_query(
                "a query needs a solid with a size and a rotation that is finite and not zero",
            ));
        };
        let shape = SolidShape::new(solid.clone(), DVec3::ZERO).map_err(bad)?;
        let radius_m = shape.radius_m;
        let form = CollisionShape::new(ShapeKind::Solid(shape), 0.0);
        let (scratch, found) = (NarrowPhaseScratch::default(), Vec::new());
        Ok(Self { form, rotation, radius_m, scratch, found })
    }

    /// The nearest place of the near objects and solids, within `reach_m`.
    fn nearest(&mut self, world: &World, near: &[Near], at_m: DVec3, reach_m: f64) -> Option<Hit> {
        let hits = near.iter().filter_map(|one| self.against(world, one, at_m, reach_m));
        hits.min_by(|a, b| a.distance_m.total_cmp(&b.distance_m))
    }

    /// The nearest place of one of them, within `reach_m`.
    fn against(&mut self, world: &World, near: &Near, at_m: DVec3, reach_m: f64) -> Option<Hit> {
        let Self { form, rotation, scratch, found, .. } = self;
        let mine = PlacedShape { form, view: ShapePose::Solid { position: at_m, rotation: *rotation } };
        match near.what {
            Touched::Fixed(number) => {
                world.surroundings().statics().get(number as usize)?.touches(&mine, reach_m, scratch, found);
            }
            Touched::Object(object) => {
                let shape = world.agents().of(object.id())?.form()?;
                touches(&mine, &near.shape.placed(&shape)?, reach_m, scratch, found);
            }
        }
        let best = found.iter().min_by(|a, b| a.gap_m.total_cmp(&b.gap_m))?;
        // the touch is known by the point of the query's own solid
        let point_m = mine.point(&best.on_a, -best.normal) - best.normal * best.gap_m;
        Some(Hit { what: near.what, point_m, normal: best.normal, distance_m: best.gap_m })
    }
}
