//! Where the members of a small island touch each other and the ground: parry's contact manifolds, kept from part to part.
//!
//! In: members and solids that stand still. Out: [`Contact`]s with their impulses of the part before.
//! Never here: the impulses of this part.
//!
//! Queries are in single precision, but about the pair itself: a gap is known to 1e-7 of the bodies' size anywhere.

use super::super::Held;
use super::super::member::{Ground, Member};
use super::row::NOBODY;
use glam::{DQuat, DVec3};
use metachron_core::AgentId;
use rapier3d::parry::math::{Pose, Rotation};
use rapier3d::parry::query::{
    ContactManifold, ContactManifoldsWorkspace, DefaultQueryDispatcher, PersistentQueryDispatcher,
};
use rapier3d::parry::shape::Shape;
use std::collections::BTreeMap;

/// What a point remembers: the force that it gave in the last part, and in the last blow at a part's end, newtons.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Warm {
    /// Over the part.
    pub during: DVec3,
    /// At its end.
    pub ending: DVec3,
}

/// A point where two bodies touch, or may within the part.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact {
    /// The member.
    pub a: u32,
    /// The other member, or [`NOBODY`].
    pub b: u32,
    /// From b towards a, unit.
    pub normal: DVec3,
    /// The point in the axes of a, metres from its centre of mass.
    pub on_a: DVec3,
    /// The point in the axes of b, metres from its centre of mass; in the world's axes for the ground.
    pub on_b: DVec3,
    /// Gap at the start of the part, metres.
    pub gap_m: f64,
    /// Of the pair.
    pub friction: f64,
    /// Of the pair.
    pub restitution: f64,
    /// What it gave before.
    pub warm: Warm,
    place: Place,
}

/// Where a contact is remembered.
#[derive(Debug, Clone, Copy)]
struct Place {
    pair: u32,
    manifold: u32,
    point: u32,
}

/// Two shapes that may touch.
struct Pair {
    a: usize,
    b: Side,
    /// Whose pair it is, however the members are numbered: the second is a member or a solid of the ground.
    name: (AgentId, Result<AgentId, usize>),
    manifolds: Vec<ContactManifold<(), Warm>>,
    workspace: Option<ContactManifoldsWorkspace>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Side {
    Member(usize),
    Ground(usize),
}

/// All pairs of an island.
#[derive(Default)]
pub(super) struct Near {
    pairs: Vec<Pair>,
    /// Every contact of the part, pair by pair.
    pub contacts: Vec<Contact>,
}

/// Points are looked for this much farther than the bodies can come within the part, as a share of the smaller one's size.
const REACH_SHARE: f64 = 0.01;

impl Near {
    /// Lists every pair that may ever touch: all but those that a joint keeps from colliding.
    pub(super) fn list(&mut self, members: &[Member], ground: &[Ground], held: &[Held]) {
        let apart = |i: usize, j: usize| {
            held.iter().any(|(a, b, joint)| !joint.collide && [(i, Some(j)), (j, Some(i))].contains(&(*a, *b)))
        };
        let mut known: BTreeMap<_, _> = self.pairs.drain(..).map(|pair| (pair.name, pair)).collect();
        for i in 0..members.len() {
            let others = (i + 1..members.len()).filter(|&j| !apart(i, j)).map(Side::Member);
            for b in others.chain((0..ground.len()).map(Side::Ground)) {
                let other = match b {
                    Side::Member(j) => Ok(members[j].id),
                    Side::Ground(g) => Err(g),
                };
                let name = (members[i].id, other);
                let fresh = || Pair { a: i, b, name, manifolds: Vec::new(), workspace: None };
                self.pairs.push(known.remove(&name).map_or_else(fresh, |pair| Pair { a: i, b, ..pair }));
            }
        }
    }

    /// Finds every point that may touch within `h` seconds.
    pub(super) fn find(&mut self, members: &[Member], ground: &[Ground], h: f64) {
        self.contacts.clear();
        for (number, pair) in self.pairs.iter_mut().enumerate() {
            let a = &members[pair.a];
            match pair.b {
                Side::Member(j) => {
                    let b = &members[j];
                    let small = a.radius_m.min(b.radius_m);
                    let reach = (a.travel_m(h) + b.travel_m(h)) + REACH_SHARE * small;
                    if a.motion.position.distance(b.motion.position) > a.radius_m + b.radius_m + reach {
                        pair.manifolds.clear();
                        continue;
                    }
                    let origin_b = b.motion.position - b.motion.rotation * b.spread.com;
                    pair.query(a, (b.shape.as_ref(), origin_b, b.motion.rotation), reach);
                    let law = ((a.friction * b.friction).sqrt(), a.restitution.max(b.restitution));
                    let home = (j as u32, b.motion.position, b.motion.rotation);
                    pair.collect((number, a, home), law, &mut self.contacts);
                }
                Side::Ground(g) => {
                    let solid = &ground[g];
                    let reach = a.travel_m(h) + REACH_SHARE * a.radius_m;
                    if solid.is_beyond(a.motion.position, a.radius_m + reach) {
                        pair.manifolds.clear();
                        continue;
                    }
                    let origin = solid.position_near(a.motion.position);
                    pair.query(a, (solid.shape.as_ref(), origin, solid.rotation), reach);
                    let law = ((a.friction * solid.friction).sqrt(), a.restitution.max(solid.restitution));
                    let home = (NOBODY, DVec3::ZERO, DQuat::IDENTITY);
                    pair.collect((number, a, home), law, &mut self.contacts);
                }
            }
        }
    }

    /// Keeps what a contact gave for the next part.
    pub(super) fn remember(&mut self, index: usize, warm: Warm) {
        let Place { pair, manifold, point } = self.contacts[index].place;
        let pair = &mut self.pairs[pair as usize];
        pair.manifolds[manifold as usize].points[point as usize].data = warm;
    }
}

impl Pair {
    /// Asks parry for the contacts of `a` with a shape whose axes start at `origin`.
    fn query(&mut self, a: &Member, (shape, origin, rotation): (&dyn Shape, DVec3, DQuat), reach: f64) {
        let back = a.motion.rotation.conjugate();
        let origin_a = a.motion.position - a.motion.rotation * a.spread.com;
        let (turn, shift) = ((back * rotation).as_quat(), back * (origin - origin_a));
        let turn = Rotation::from_xyzw(turn.x, turn.y, turn.z, turn.w).normalize();
        let pose = Pose::from_parts(shift.as_vec3(), turn);
        let found = DefaultQueryDispatcher.contact_manifolds(
            &pose,
            a.shape.as_ref(),
            shape,
            reach as f32,
            &mut self.manifolds,
            &mut self.workspace,
        );
        if found.is_err() {
            self.manifolds.clear();
        }
    }

    /// Writes the points as contacts; `home` is the other body's number, centre of mass and rotation.
    fn collect(
        &self,
        (number, a, home): (usize, &Member, (u32, DVec3, DQuat)),
        (friction, restitution): (f64, f64),
        into: &mut Vec<Contact>,
    ) {
        for (m, manifold) in self.manifolds.iter().enumerate() {
            let sub = manifold.subshape_pos1().copied().unwrap_or(Pose::IDENTITY);
            let out = (sub.rotation * manifold.local_n1).as_dvec3().normalize_or_zero();
            for (p, point) in manifold.points.iter().enumerate() {
                let gap_m = f64::from(point.dist);
                // both sides act in the middle of the gap, so that what they give has no moment
                let on_a = (sub * point.local_p1).as_dvec3() + out * (0.5 * gap_m) - a.spread.com;
                let world = a.motion.position + a.motion.rotation * on_a;
                into.push(Contact {
                    a: self.a as u32,
                    b: home.0,
                    normal: a.motion.rotation * -out,
                    on_a,
                    on_b: home.2.conjugate() * (world - home.1),
                    gap_m,
                    friction,
                    restitution,
                    warm: point.data,
                    place: Place { pair: number as u32, manifold: m as u32, point: p as u32 },
                });
            }
        }
    }
}
