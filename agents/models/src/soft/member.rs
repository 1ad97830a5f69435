//! A soft body in a contact cluster: one block for each vertex that is not held.
//!
//! In: steps and velocities. Out: the matrix of linearly implicit Euler, velocities without contact, its skin. Never here: contacts.
//! Theory: docs/theory/soft.md, eq. 1, 3, 4; docs/theory/clusters.md, section 9.

use super::body::SoftBody;
use super::skin::{Apart, Skin};
use super::system::Purpose;
use super::touched::Touches;
use crate::limits::{QUIET_ACCELERATION_M_S2, QUIET_S, QUIET_SPEED_M_S};
use glam::{DQuat, DVec3};
use metachron_contact::member::{
    Attachments, ClusterMember, MaterialPoint, MemberMotion, Role, SkinPoint, StepEnd, StepSystem,
};
use metachron_contact::solve::{Response, Side, SideTerm};
use metachron_contact::{Agent, StepContext};
use metachron_core::{Anchor, Archive, ArchiveError, StepError};
use metachron_geometry::narrow_phase::RestShape;
use metachron_geometry::{Carried, ContactSide, Place, PlacedShape, ShapePose};

/// No edge may turn or stretch further in a step, radians: a turn by φ stretches it by φ²/2, here 1 %, and makes E φ⁴/8 a volume.
const TURN_MAX_RAD: f64 = 0.15;

/// Its unknowns in a cluster: those of the moving vertices.
#[derive(Debug, Clone, Default)]
pub(super) struct Unknowns {
    free: Vec<DVec3>,
    now: Vec<DVec3>,
    /// Positions at the start of the step begun, of all vertices.
    start: Vec<DVec3>,
    /// The velocity of all vertices that answers, in sum, the momentum that the step leaves unanswered, m/s.
    owed_m_s: DVec3,
    saved: SavedState,
}

/// A state to go back to.
#[derive(Debug, Clone, Default)]
struct SavedState {
    positions: Vec<DVec3>,
    velocities: Vec<DVec3>,
    turns: Vec<DQuat>,
    /// How far its skin is from where its vertices carry it.
    apart: Apart,
    acceleration: DVec3,
    quiet_s: f64,
    at_rest: bool,
    touches: Touches,
}

impl Unknowns {
    /// Writes or reads the velocities that are known between steps.
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.value(&mut self.now)
    }
}

impl SoftBody {
    /// Lists the velocities of moving vertices, now and without contact.
    pub(super) fn list_velocities(&mut self) {
        let Self { system, free, velocities, unknowns, .. } = self;
        let moving = |list: &[DVec3], into: &mut Vec<DVec3>| {
            into.clear();
            into.extend(system.rows().iter().zip(list).filter_map(|(row, v)| row.map(|_| *v)));
        };
        moving(free, &mut unknowns.free);
        moving(velocities, &mut unknowns.now);
    }

    /// Places all vertices where they are `t_s` seconds after the start of the step begun, by the velocities of moving ones.
    fn place_after(&mut self, v: &[DVec3], t_s: f64) {
        let Self { system, positions, unknowns, .. } = self;
        positions.clone_from(&unknowns.start);
        for (position, row) in positions.iter_mut().zip(system.rows()) {
            if let Some(row) = *row {
                *position += v[row as usize] * t_s;
            }
        }
        system.spread(positions);
    }

    /// Adds the velocity that keeps momentum to rounding to the velocities and places at the end of a step.
    fn pay_owed(&mut self, h_s: f64) {
        let Self { system, positions, velocities, unknowns, .. } = self;
        let owed_m_s = std::mem::take(&mut unknowns.owed_m_s);
        if owed_m_s == DVec3::ZERO {
            return;
        }
        for ((position, velocity), _) in
            positions.iter_mut().zip(&mut *velocities).zip(system.rows()).filter(|(_, row)| row.is_some())
        {
            *velocity += owed_m_s;
            *position += owed_m_s * h_s;
        }
        system.spread(positions);
        system.spread(velocities);
        unknowns.now.iter_mut().for_each(|velocity| *velocity += owed_m_s);
    }

    /// The side of a point that is carried so.
    fn carried_side(&self, carried: &Carried) -> Side {
        let rows = self.system.rows();
        let mut terms = [SideTerm::weighted(0, 0.0); 4];
        let mut count = 0;
        for (node, weight) in carried.terms() {
            if let Some(row) = rows[node] {
                terms[count] = SideTerm::weighted(row as usize, weight);
                count += 1;
            }
        }
        Side::new(0, &terms[..count]).unwrap_or(Side::FIXED)
    }
}

impl ClusterMember for SoftBody {
    fn role(&self) -> Role {
        Role::Deformable
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        self.predict(h_s, Purpose::Shared).map_err(|what| self.diverged(what, h_s))?;
        self.list_velocities();
        let Self { positions, unknowns, .. } = self;
        unknowns.start.clone_from(positions);
        Ok(())
    }

    fn system(&self) -> StepSystem<'_> {
        let Self { system, unknowns: Unknowns { free, now: velocities, .. }, .. } = self;
        let response = system.response().map(|factor| factor as &dyn Response);
        StepSystem { blocks: system.blocks(), response, free, unanswered: system.unanswered(), velocities }
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        Some(PlacedShape { form: &self.form, view: ShapePose::Surface(self.seen()) })
    }

    fn skin_point(&self, place: &Place, _contact: ContactSide) -> SkinPoint {
        match *place {
            Place::Surface { vertices, shares } => {
                let [a, b, c] = vertices;
                let own = || Carried { nodes: [a, b, c, c], weights: [shares[0], shares[1], shares[2], 0.0] };
                let carried = self.skin.as_ref().map_or_else(own, |skin| skin.carried_at(vertices, shares));
                let led_m_s = self.skin.as_ref().map_or(DVec3::ZERO, |skin| {
                    vertices.iter().zip(shares).map(|(vertex, share)| skin.easing_m_s(*vertex) * share).sum()
                });
                SkinPoint { led_m_s, ..self.carried_side(&carried).into() }
            }
            Place::Point(_) | Place::Chain { .. } => Side::FIXED.into(),
        }
    }

    fn strain(&self, v: &[DVec3], h_s: f64) -> f64 {
        self.mesh.edge_change(|vertex| self.system.velocity(vertex, v), h_s) / TURN_MAX_RAD
    }

    fn keep(&mut self) {
        let saved = &mut self.unknowns.saved;
        saved.positions.clone_from(&self.positions);
        saved.velocities.clone_from(&self.velocities);
        saved.turns.clear();
        saved.turns.extend(self.mesh.turns());
        self.skin.iter_mut().for_each(|skin| saved.apart.clone_from(skin.apart()));
        saved.acceleration = self.acceleration;
        (saved.quiet_s, saved.at_rest) = (self.quiet_s, self.at_rest);
        saved.touches.clone_from(&self.touches);
    }

    fn go_back(&mut self) {
        let saved = &self.unknowns.saved;
        self.positions.clone_from(&saved.positions);
        self.velocities.clone_from(&saved.velocities);
        self.mesh.set_turns(&saved.turns);
        self.skin.iter_mut().for_each(|skin| skin.apart().clone_from(&saved.apart));
        self.acceleration = saved.acceleration;
        (self.quiet_s, self.at_rest) = (saved.quiet_s, saved.at_rest);
        self.touches.clone_from(&saved.touches);
        self.follow();
    }

    fn move_to(&mut self, v: &[DVec3], t_s: f64) {
        self.place_after(v, t_s);
        self.follow();
    }

    fn look(&mut self, context: &StepContext<'_>, _dt_s: f64) {
        if self.spec.eps_touched_m.is_some() {
            context.anchor_springs().for_each(|spring| self.note_held(spring.anchor));
        }
    }

    fn adapt(&mut self) {
        self.divide_where_touched();
    }

    fn end(&mut self, &StepEnd { v, h_s, unanswered, pressed, .. }: &StepEnd<'_>) -> Result<(), StepError> {
        self.unknowns.owed_m_s = self.system.together(unanswered);
        self.place_after(v, h_s);
        let finite = self.positions.iter().all(|x| x.is_finite() && x.abs().max_element() <= super::step::REACH_MAX);
        if !finite {
            self.positions.clone_from(&self.unknowns.start);
            self.follow();
            return Err(self.diverged("a vertex left the coordinate range", h_s));
        }
        let before = self.linear_momentum();
        let Self { system, velocities, .. } = self;
        for (velocity, row) in velocities.iter_mut().zip(system.rows()) {
            *velocity = row.map_or(DVec3::ZERO, |row| v[row as usize]);
        }
        system.spread(velocities);
        let Self { unknowns, .. } = self;
        let quiet = v
            .iter()
            .zip(&unknowns.now)
            .all(|(v, before)| v.length() <= QUIET_SPEED_M_S && v.distance(*before) <= QUIET_ACCELERATION_M_S2 * h_s);
        unknowns.now.copy_from_slice(v);
        self.pay_owed(h_s);
        self.at_rest = false;
        self.ease(h_s);
        self.acceleration = (self.linear_momentum() - before) / (self.mass_kg() * h_s);
        self.quiet_s = if quiet { self.quiet_s + h_s } else { 0.0 };
        self.note_pressed(pressed, h_s);
        Ok(())
    }

    fn can_sleep(&self) -> bool {
        self.spec.sleep && self.quiet_s >= QUIET_S && self.skin.as_ref().is_none_or(Skin::is_quiet)
    }

    fn sleep(&mut self) {
        self.at_rest = true;
        self.acceleration = DVec3::ZERO;
        self.velocities.fill(DVec3::ZERO);
        self.follow();
    }

    fn work(&self) -> f64 {
        SoftBody::work(self)
    }

    fn motion(&self) -> Option<&dyn MemberMotion> {
        Some(self)
    }

    fn attachments(&self) -> Option<&dyn Attachments> {
        Some(self)
    }
}

impl MemberMotion for SoftBody {
    fn skin_after<'a>(&'a self, v: &[DVec3], t_s: f64, nodes: &'a mut Vec<DVec3>) -> Option<PlacedShape<'a>> {
        let moved = |row: Option<u32>| row.map_or(DVec3::ZERO, |row| v[row as usize] * t_s);
        let rows = self.system.rows();
        nodes.clear();
        match &self.skin {
            Some(skin) => {
                nodes.extend(skin.carried().iter().map(|carried| {
                    carried.terms().map(|(node, w)| (self.positions[node] + moved(rows[node])) * w).sum::<DVec3>()
                }));
                if !skin.is_eased() {
                    nodes.iter_mut().enumerate().for_each(|(point, at)| *at += skin.apart_of(point));
                }
            }
            None => nodes.extend(self.positions.iter().zip(rows).map(|(at, row)| *at + moved(*row))),
        }
        Some(PlacedShape { form: &self.form, view: ShapePose::Surface(nodes) })
    }

    fn rest_shape(&self) -> Option<RestShape<'_>> {
        let rest = || self.skin.as_ref().map_or(&self.mesh.rest[..], |skin| skin.rest());
        self.spec.self_contact.then(|| RestShape::Surface(rest()))
    }

    fn cell_of(&self, place: &Place) -> Option<u32> {
        let Place::Surface { vertices, shares } = *place else { return None };
        self.skin.as_ref()?.cell_at(vertices, shares)
    }
}

impl Attachments for SoftBody {
    fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint> {
        let Anchor::Vertex(vertex) = anchor else { return None };
        let position = *self.seen().get(vertex as usize)?;
        let led_m_s = self.skin.as_ref().map_or(DVec3::ZERO, |skin| skin.easing_m_s(vertex));
        Some(MaterialPoint { led_m_s, ..MaterialPoint::new(position, self.carried_side(&self.carried(vertex))) })
    }

    fn slot_of(&self, block: usize) -> u32 {
        let mut rows = self.system.rows().iter();
        let node = rows.position(|row| *row == Some(block as u32)).unwrap_or_default();
        self.skin.as_ref().map_or(node as u32, |skin| skin.point_of(node))
    }
}
