//! Contacts of a tube with itself and with the solids around it: detection and solution in a substep.
//!
//! In: the skin's position, its free motion, and the body's response to impulses (the factor of the rod's own solve).
//! Out: velocities that keep the skin apart. Never here: the rod's elasticity. Theory: `docs/theory/contact.md`.

mod initial_overlap;
mod self_contact;
mod solve;
mod static_contact;

use super::company::Company;
use glam::DVec3;
use metachron_contact::{Contact, Solver};
use metachron_core::ContactJacobian;
use metachron_geometry::narrow_phase::{self, FacingPoints, PLACES, RestedChain};
use metachron_geometry::signed_distance::Ball;
use metachron_geometry::{Obstacle, ShapeError};
use self_contact::Pairs;
pub(crate) use solve::{Solved, respond};
use static_contact::{WallTouch, Walls};

/// Contacts are activated this share of the radius before they touch: impulses of other contacts may close the gap.
const SLACK_RADII: f64 = 0.05;

/// Bit at which the number of a fixed solid begins in the key of its contacts; keys of self-contact are lower, those of peers higher.
const WALL_SHIFT: u32 = 41;
/// One past the highest number of a fixed solid.
const WALLS_END: u64 = 1 << (63 - WALL_SHIFT);

/// Key increments of the second and the first segment of a pair.
const KEY_STEPS: [u64; 2] = [PLACES as u64, 1 << 20];
/// Key differences to a contact that passed to the next segment, within one tube and between a tube and another; for warm starting.
const RELATED_KEYS: [i64; 8] = {
    let ([a, b], [c, d]) = (KEY_STEPS, narrow_phase::KEY_STEPS);
    let (a, b, c, d) = (a as i64, b as i64, c as i64, d as i64);
    [a, -a, b, -b, c, -c, d, -d]
};

/// Number of entries of [`RELATED_KEYS`] that matter without peers.
const RELATED_KEYS_WITHOUT_PEERS: usize = 4;

/// A tube's skin at the start of a substep: balls on nodes, joined by tapered spans.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Skin<'a> {
    /// Node positions, metres.
    pub positions: &'a [DVec3],
    /// Velocities without contact, in slots ([`node_slot`], [`segment_slot`]), m/s and rad/s.
    pub slots: &'a [DVec3],
    /// Outer radius at each node, metres.
    pub radii_m: &'a [f64],
    /// Rest arc length of each node, metres.
    pub arc_m: &'a [f64],
    /// Ends whose node cannot move: walls ignore them.
    pub held: [bool; 2],
    /// The substep, seconds.
    pub h_s: f64,
}

/// Index of a node's velocity in the array of slots that contacts use: nodes and segments alternate.
pub(crate) const fn node_slot(node: usize) -> usize {
    2 * node
}

/// Index of a segment's spin in the array of slots.
pub(crate) const fn segment_slot(segment: usize) -> usize {
    2 * segment + 1
}

/// The contacts of one tube, carried from substep to substep.
#[derive(Debug, Clone, Default)]
pub(crate) struct TubeContacts {
    pairs: Option<Pairs>,
    walls: Walls,
    friction: f64,
    radii_m: Vec<f64>,
    contacts: Vec<Contact>,
    mobilities: Vec<f64>,
    solver: Solver,
}

impl TubeContacts {
    /// Contacts with `obstacles` and, if `with_itself`, of the tube with itself.
    ///
    /// # Errors
    /// [`ShapeError`] for an obstacle that has no shape.
    pub fn new(obstacles: &[Obstacle], with_itself: bool, friction: f64) -> Result<Self, ShapeError> {
        Ok(Self { pairs: with_itself.then(Pairs::default), walls: Walls::new(obstacles)?, friction, ..Self::default() })
    }

    /// Discards all data by node and segment: the tube was divided anew.
    pub fn forget(&mut self) {
        if let Some(pairs) = &mut self.pairs {
            pairs.forget();
        }
        self.walls.forget();
        self.solver.forget();
    }

    /// Finds the contacts of a substep; returns their number.
    pub fn find(&mut self, skin: &Skin<'_>) -> usize {
        let Self { pairs, walls, friction, contacts, .. } = self;
        contacts.clear();
        let slack_m = SLACK_RADII * skin.widest_m();
        if let Some(pairs) = pairs {
            pairs.visit(skin, slack_m, |facing| {
                let contact = contact_between_segments(&facing, *friction);
                let closing = contact.jacobian.velocity_of_nodes(skin.slots).dot(contact.normal);
                if contact.gap_m + closing * skin.h_s <= slack_m {
                    contacts.push(contact);
                }
            });
        }
        walls.visit(skin, slack_m, |touch| contacts.push(contact_with_wall(&touch, *friction, skin.segments())));
        debug_assert!(contacts.is_sorted_by_key(|c| c.key), "pairs and walls are visited by rising keys");
        contacts.len()
    }

    /// Adds the contacts with peers, whose velocities follow the tube's own.
    pub fn find_peer_contacts(&mut self, skin: &Skin<'_>, company: &mut Company) {
        if !company.is_empty() {
            company.find(skin, SLACK_RADII * skin.widest_m(), &mut self.contacts);
        }
    }

    /// Sets the outer radius at each node, metres; `has_peers` if there are peers to touch.
    pub fn widen(&mut self, radii_m: impl Iterator<Item = f64>, has_peers: bool) {
        self.radii_m.clear();
        if has_peers || !self.is_idle() {
            self.radii_m.extend(radii_m);
        }
    }

    /// Undoes the part of the nodes' latest displacements `ways` that leads into fixed solids; `arc_m` are their rest arc lengths.
    pub fn hold_back(&self, positions: &mut [DVec3], ways: impl Iterator<Item = DVec3>, arc_m: &[f64]) {
        self.walls.hold_back(positions, ways, arc_m, &self.radii_m);
    }

    /// The contacts found last, and their impulses.
    pub fn impulses(&self) -> impl Iterator<Item = (&Contact, &DVec3)> + Clone {
        self.contacts.iter().zip(self.solver.impulses())
    }

    /// Contacts in which fixed solids pressed in the last solve: slots and normal of each.
    pub fn supporting_contacts(&self) -> impl Iterator<Item = (ContactJacobian, DVec3)> {
        let fixed = self.impulses().filter(|(contact, _)| is_fixed(contact));
        fixed.filter(|(c, impulse)| impulse.dot(c.normal) > 0.0).map(|(c, _)| (c.jacobian, c.normal))
    }

    /// Whether any fixed solid pressed in the last solve.
    pub fn is_grounded(&self) -> bool {
        self.supporting_contacts().next().is_some()
    }

    /// Whether the last search found any contact with a moving body, the tube itself included.
    pub fn touches_what_moves(&self) -> bool {
        !self.contacts.iter().all(is_fixed)
    }

    /// Whether the last search found any contact.
    pub fn is_touching(&self) -> bool {
        !self.contacts.is_empty()
    }

    /// Whether the tube can touch neither itself nor a fixed solid.
    fn is_idle(&self) -> bool {
        self.pairs.is_none() && self.walls.is_empty()
    }
}

impl Skin<'_> {
    /// The tube, as it finds itself.
    fn chain(&self) -> RestedChain<'_> {
        let Self { positions, radii_m, arc_m, .. } = *self;
        RestedChain { positions, radii_m, arc_m }
    }

    fn segments(&self) -> usize {
        self.positions.len() - 1
    }

    /// Whether a node is a held end.
    fn is_held(&self, node: usize) -> bool {
        (node == 0 && self.held[0]) || (node == self.segments() && self.held[1])
    }

    fn velocity(&self, node: usize) -> DVec3 {
        self.slots[node_slot(node)]
    }

    fn ball(&self, node: usize) -> Ball {
        Ball { centre: self.positions[node], radius_m: self.radii_m[node] }
    }

    fn length(&self, segment: usize) -> f64 {
        self.positions[segment].distance(self.positions[segment + 1])
    }

    fn taper(&self, segment: usize) -> f64 {
        (self.radii_m[segment] - self.radii_m[segment + 1]).abs()
    }

    pub fn widest_m(&self) -> f64 {
        self.radii_m.iter().copied().fold(0.0, f64::max)
    }

    /// The speed of the fastest node, m/s.
    pub fn speed(&self) -> f64 {
        (0..self.positions.len()).map(|i| self.velocity(i).length_squared()).fold(0.0, f64::max).sqrt()
    }

    fn span_speed(&self, segment: usize) -> f64 {
        self.velocity(segment).length().max(self.velocity(segment + 1).length())
    }
}

/// Whether a contact is one with a fixed solid.
fn is_fixed(contact: &Contact) -> bool {
    (1..WALLS_END).contains(&(contact.key >> WALL_SHIFT))
}

/// Self-contact: facing points of two segments, and arms to the middle of the gap (eq. 20).
fn contact_between_segments(facing: &FacingPoints, friction: f64) -> Contact {
    let mut jacobian = ContactJacobian::default();
    for (side, sign) in [(0, 1.0), (1, -1.0)] {
        let (segment, share) = (facing.segments[side] as usize, facing.shares[side]);
        jacobian.add_linear(node_slot(segment) as u32, sign * (1.0 - share));
        jacobian.add_linear(node_slot(segment + 1) as u32, sign * share);
        // the arm points to the other side: against the normal for the first, along it for the second
        let arm = facing.normal * -sign * (facing.radii_m[side] + 0.5 * facing.gap_m);
        jacobian.add_angular(segment_slot(segment) as u32, arm * sign);
    }
    let [first, second] = facing.segments.map(u64::from);
    let key = first * KEY_STEPS[1] + second * KEY_STEPS[0] + u64::from(facing.place);
    Contact {
        key,
        jacobian,
        normal: facing.normal,
        gap_m: facing.gap_m,
        friction,
        rebound_m_s: 0.0,
        back_m_s: DVec3::ZERO,
        age_s: 0.0,
    }
}

/// Contact with a wall, at a node or inside a segment (eq. 21).
fn contact_with_wall(touch: &WallTouch, friction: f64, segments: usize) -> Contact {
    let mut jacobian = ContactJacobian::default();
    let index = touch.index as usize;
    let arm = touch.normal * -touch.radius_m;
    if let Some(share) = touch.share {
        jacobian.add_linear(node_slot(index) as u32, 1.0 - share);
        jacobian.add_linear(node_slot(index + 1) as u32, share);
        jacobian.add_angular(segment_slot(index) as u32, arm);
    } else {
        jacobian.add_linear(node_slot(index) as u32, 1.0);
        // a node's skin turns with the mean of the adjacent segments
        let beside = [index.checked_sub(1), Some(index).filter(|&k| k < segments)];
        let count = beside.iter().flatten().count() as f64;
        for segment in beside.into_iter().flatten() {
            jacobian.add_angular(segment_slot(segment) as u32, arm / count);
        }
    }
    let inside = u64::from(touch.share.is_some());
    let key =
        (u64::from(touch.wall) + 1) << WALL_SHIFT | inside << 40 | u64::from(touch.index) << 4 | u64::from(touch.place);
    Contact {
        key,
        jacobian,
        normal: touch.normal,
        gap_m: touch.gap_m,
        friction: (friction * touch.friction).sqrt(),
        rebound_m_s: 0.0,
        back_m_s: DVec3::ZERO,
        age_s: 0.0,
    }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod tube_tests;
