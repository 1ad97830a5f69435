//! A partner of an asynchronous pair as a member of the problem that computes the pair: predicted from its snapshot, it
//! answers impulses by the local model that it has published.
//!
//! In: a snapshot, impulses in flight to the partner. Out: a skin, blocks and velocities as any member has them. Never here: the ledger,
//! which pairs there are, the partner's own contacts: those are in its local model. Theory: docs/theory/coupling.md, section 3.

use crate::Neighbour;
use crate::lists::{refill, reset};
use crate::member::{
    Attachments, ClusterMember, MaterialPoint, MemberMotion, Remote, Role, SkinPoint, StepEnd, StepSystem,
};
use crate::remote::local::invert;
use crate::remote::published_shape::{Motion, PublishedShape};
use crate::solve::{Block, Side, SideTerm};
use glam::{DMat3, DVec3};
use metachron_core::{AgentId, Anchor, Body, Impulse, Inertia, LocalBlock, LocalModel, SimTime, Site, StepError};
use metachron_geometry::{CollisionShape, ContactSide, Place, PlacedShape, ShapeKind};
use std::sync::Arc;

/// No partner is predicted by more than this many of its steps.
const PREDICTED_STEPS_MAX: f64 = 2.0;

/// A partner that is stepped elsewhere.
#[derive(Debug, Default)]
pub struct RemoteMember {
    form: Option<Arc<CollisionShape>>,
    /// How it moves as it is led, which no impulse changes; `None` for a body that impulses move.
    led: Option<Motion>,
    /// The participants that compute their pairs with it.
    partners: Vec<AgentId>,
    shape: PublishedShape,
    model: LocalModel,
    blocks: Vec<Block>,
    /// Velocities of the blocks now, at the end of a step without impulses, and how they change a second.
    now: Vec<DVec3>,
    free: Vec<DVec3>,
    gain_m_s2: Vec<DVec3>,
    /// The impulses that deviate from the model's own forecast, N·s for each block.
    deviation: Vec<DVec3>,
    /// How far these have moved it, N·s² for each block.
    carried: Vec<DVec3>,
    flight: Vec<InFlight>,
    /// The time of the snapshot that the matrix was made for.
    seen: Option<SimTime>,
    kept: (PublishedShape, Vec<DVec3>),
    matrix: Vec<f64>,
}

/// An impulse in flight to a block, and the same times the seconds since it acted.
#[derive(Debug, Clone, Copy, Default)]
struct InFlight {
    impulse: DVec3,
    way: DVec3,
}

/// A participant's view of its pair with a partner.
pub struct RemoteView<'a> {
    /// The participant.
    pub id: AgentId,
    /// The partner's newest state.
    pub neighbour: &'a Neighbour,
    /// The participant's own time.
    pub time: SimTime,
}

impl RemoteMember {
    /// Takes in the newest state of a partner; whether it can be met: it has a local model, moves as a whole, or moves as it is led.
    pub fn see(&mut self, neighbour: &Neighbour) -> bool {
        self.form.clone_from(&neighbour.form);
        self.partners.clear();
        let snapshot = &neighbour.snapshot;
        let known = self.shape.take(&snapshot.body);
        let is_led = matches!((&snapshot.inertia, &snapshot.body), (Inertia::Immovable, Body::Rigid(_)));
        self.led = Motion::of(&snapshot.body).filter(|_| is_led);
        if self.seen != Some(snapshot.time) || self.blocks.is_empty() {
            self.seen = Some(snapshot.time);
            if snapshot.local_model.blocks.is_empty() {
                lone(&snapshot.inertia, &snapshot.body, neighbour.step_s, &mut self.model);
            } else {
                self.model.copy_from(&snapshot.local_model);
            }
            self.set_matrix();
        }
        for list in [&mut self.deviation, &mut self.carried] {
            reset(list, self.model.blocks.len(), DVec3::ZERO);
        }
        refill(&mut self.gain_m_s2, self.model.blocks.iter().map(|block| block.acceleration));
        known && (self.led.is_some() || !self.blocks.is_empty())
    }

    /// Adds a participant that computes its pair with the partner; `given` visits the impulses in flight to the partner
    /// (eq. 5).
    pub fn add_partner(&mut self, view: &RemoteView<'_>, given: impl FnOnce(&mut dyn FnMut(Site, Impulse, Impulse))) {
        self.partners.push(view.id);
        let model = &self.model;
        let since_s = view.time.secs_after(view.neighbour.snapshot.time);
        let partner = model.partners.iter().find(|partner| partner.id == view.id);
        let age_s = partner.map_or(0.0, |partner| view.time.secs_after(partner.read).max(0.0));
        // impulses given before its step began act on a held body evenly through it; later ones are predicted to act
        let before = if since_s > 0.0 && age_s > 0.0 { (1.0 - since_s / age_s).max(0.0) } else { 0.0 };
        let begun = (since_s / model.step_s).clamp(0.0, 1.0);
        let acts = if model.held { before * begun + (1.0 - before) } else { 1.0 };
        let Self { shape, deviation, carried, flight, .. } = self;
        reset(flight, deviation.len(), InFlight::default());
        given(&mut |site, impulse, way| {
            let mut add = |value: Impulse, to: fn(&mut InFlight) -> &mut DVec3| {
                shape.visit_blocks(site, value, |slot, part| {
                    place_of_slot(model, slot).into_iter().for_each(|place| *to(&mut flight[place]) += part);
                });
            };
            add(impulse, |flight| &mut flight.impulse);
            add(way, |flight| &mut flight.way);
        });
        // a deviation has moved a held body for no longer than its step
        let moved_s = if since_s > 0.0 { since_s } else { age_s }.min(model.step_s);
        for (at, InFlight { impulse, way }) in flight.iter().enumerate() {
            let force = partner.and_then(|partner| partner.forces.get(at)).copied().unwrap_or(DVec3::ZERO);
            let persistent = force * age_s;
            let new = (*impulse - persistent) * acts;
            deviation[at] += new;
            carried[at] += if model.held { new * moved_s } else { *way * (1.0 - share_of(persistent, *impulse)) };
            // it goes on only as far as it is given
            for (row, gain) in self.gain_m_s2.iter_mut().enumerate() {
                *gain -= model.compliance[row * deviation.len() + at] * force;
            }
        }
    }

    /// Brings it to `time` (eq. 5, 6).
    pub fn predict(&mut self, neighbour: &Neighbour, time: SimTime) {
        let size = self.model.blocks.len();
        let step_s = self.model.step_s;
        let since_s =
            time.secs_after(neighbour.snapshot.time).clamp(-PREDICTED_STEPS_MAX * step_s, PREDICTED_STEPS_MAX * step_s);
        self.now.clear();
        let Self { model, shape, led, now, deviation, carried, .. } = self;
        shape.go_on(*led, since_s);
        for (at, block) in model.blocks.iter().enumerate() {
            let row = &model.compliance[at * size..(at + 1) * size];
            let of = |list: &[DVec3]| row.iter().zip(list).map(|(w, impulse)| *w * *impulse).sum::<DVec3>();
            let changed = of(deviation);
            now.push(block.velocity + block.acceleration * since_s + changed);
            let way = block.acceleration * (0.5 * since_s * since_s) + of(carried);
            shape.shift(block, way, since_s);
        }
    }

    /// The velocity of a point of space as if it were the matter of a body that is led, m/s; zero of all others.
    fn led_at(&self, point: DVec3) -> DVec3 {
        self.led.map_or(DVec3::ZERO, |led| led.at(point - self.shape.centre))
    }

    /// A = W⁻¹ of the local model; none where W is not positive definite.
    fn set_matrix(&mut self) {
        let Self { model, blocks, matrix, .. } = self;
        blocks.clear();
        if invert(model, matrix) {
            let size = 3 * model.blocks.len();
            for row in 0..model.blocks.len() {
                for column in 0..=row {
                    let entry = |i: usize, j: usize| matrix[(3 * row + i) * size + 3 * column + j];
                    let value = DMat3::from_cols(
                        DVec3::new(entry(0, 0), entry(1, 0), entry(2, 0)),
                        DVec3::new(entry(0, 1), entry(1, 1), entry(2, 1)),
                        DVec3::new(entry(0, 2), entry(1, 2), entry(2, 2)),
                    );
                    blocks.push(Block { row, column, value });
                }
            }
        }
    }

    /// A side of points of the partner with shares; a point without a block leaves its share to the others.
    fn shared(&self, points: &[(u32, f64)], spin: Option<(u32, DVec3)>) -> Side {
        let mut terms = [SideTerm::weighted(0, 0.0); 4];
        let mut count = 0;
        let mut sum = 0.0;
        for &(slot, share) in points {
            if let (Some(place), true) = (place_of_slot(&self.model, slot), share != 0.0) {
                terms[count] = SideTerm::weighted(place, share);
                count += 1;
                sum += share;
            }
        }
        if count == 0 {
            let nearest = points.first().and_then(|(slot, _)| self.nearest(*slot));
            let Some(place) = nearest else { return Side::FIXED };
            terms[0] = SideTerm::weighted(place, 1.0);
            return Side::new(0, &terms[..1]).unwrap_or(Side::FIXED);
        }
        terms[..count].iter_mut().for_each(|term| term.map *= 1.0 / sum);
        if let Some((slot, arm)) = spin
            && let Some(place) = place_of_slot(&self.model, slot)
        {
            terms[count] = SideTerm::spin(place, arm);
            count += 1;
        }
        Side::new(0, &terms[..count]).unwrap_or(Side::FIXED)
    }

    /// The block of a point that is nearest to another point.
    fn nearest(&self, slot: u32) -> Option<usize> {
        let shape = &self.shape;
        let from = shape.point(slot)?;
        let apart = |block: &LocalBlock| shape.point(block.slot).map(|at| at.distance_squared(from));
        let near = self.model.blocks.iter().enumerate().filter_map(|(place, block)| Some((place, apart(block)?)));
        near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(place, _)| place)
    }

    fn whole(&self, arm: DVec3) -> Side {
        let spin = place_of_slot(&self.model, 1).map(|place| SideTerm::spin(place, arm));
        let Some(centre) = place_of_slot(&self.model, 0) else { return Side::FIXED };
        let terms = [SideTerm::weighted(centre, 1.0), spin.unwrap_or(SideTerm::weighted(centre, 0.0))];
        Side::new(0, if spin.is_some() { &terms } else { &terms[..1] }).unwrap_or(Side::FIXED)
    }
}

impl ClusterMember for RemoteMember {
    fn role(&self) -> Role {
        if self.led.is_some() { Role::Kinematic } else { Role::Rigid }
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        refill(&mut self.free, self.now.iter().zip(&self.gain_m_s2).map(|(now, gain)| *now + *gain * h_s));
        Ok(())
    }

    fn system(&self) -> StepSystem<'_> {
        let Self { blocks, free, now: velocities, .. } = self;
        StepSystem { blocks, free, velocities, ..StepSystem::default() }
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        self.shape.placed(self.form.as_deref()?)
    }

    fn skin_point(&self, place: &Place, contact: ContactSide) -> SkinPoint {
        let (side, led_m_s) = match *place {
            Place::Point(point) => (self.whole(point - self.shape.centre), self.led_at(point)),
            Place::Surface { vertices: [a, b, c], shares } => {
                (self.shared(&[(a, shares[0]), (b, shares[1]), (c, shares[2])], None), DVec3::ZERO)
            }
            Place::Chain { segment, share, radius_m } => {
                let spin = (2 * segment + 1, contact.outward * radius_m);
                (self.shared(&[(2 * segment, 1.0 - share), (2 * segment + 2, share)], Some(spin)), DVec3::ZERO)
            }
        };
        SkinPoint { led_m_s, ..side.into() }
    }

    fn keep(&mut self) {
        let Self { shape, now, kept, .. } = self;
        kept.0.clone_from(shape);
        kept.1.clone_from(now);
    }

    fn go_back(&mut self) {
        let Self { shape, now, kept, .. } = self;
        shape.clone_from(&kept.0);
        now.clone_from(&kept.1);
    }

    fn end(&mut self, &StepEnd { v, h_s, .. }: &StepEnd<'_>) -> Result<(), StepError> {
        let Self { shape, model, led, now, .. } = self;
        shape.go_on(*led, h_s);
        for (block, v) in model.blocks.iter_mut().zip(v) {
            let at = LocalBlock { velocity: *v, ..*block };
            shape.shift(&at, DVec3::ZERO, h_s);
        }
        now.copy_from_slice(v);
        Ok(())
    }

    fn can_sleep(&self) -> bool {
        true
    }

    fn work(&self) -> f64 {
        0.0
    }

    fn motion(&self) -> Option<&dyn MemberMotion> {
        Some(self)
    }

    fn attachments(&self) -> Option<&dyn Attachments> {
        Some(self)
    }

    fn remote(&self) -> Option<Remote<'_>> {
        // a led body answers nothing
        let answers_after_s = if self.led.is_some() { 0.0 } else { self.model.step_s };
        Some(Remote { answers_after_s, partners: &self.partners })
    }
}

impl MemberMotion for RemoteMember {
    fn speed_bound(&self, v: &[DVec3]) -> f64 {
        let radius_m = match self.form.as_deref().map(|form| &form.kind) {
            Some(ShapeKind::Solid(solid)) => solid.radius_m,
            _ => 0.0,
        };
        let led = self.led.map_or(0.0, |led| led.velocity_m_s.length() + led.spin_rad_s.length() * radius_m);
        let is_spin = |block: &LocalBlock| self.shape.point(block.slot).is_none() && block.slot % 2 == 1;
        let of = |(block, v): (&LocalBlock, &DVec3)| v.length() * if is_spin(block) { radius_m } else { 1.0 };
        let blocks = self.model.blocks.iter().zip(v).map(of);
        if self.shape.points.is_empty() {
            led + blocks.sum::<f64>()
        } else {
            blocks.chain(self.shape.fastest()).fold(0.0, f64::max)
        }
    }
}

impl Attachments for RemoteMember {
    fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint> {
        let shape = &self.shape;
        match anchor {
            Anchor::Local(local) if shape.points.is_empty() => {
                let arm = shape.rotation * local;
                let position = shape.centre + arm;
                Some(MaterialPoint { position, side: self.whole(arm), led_m_s: self.led_at(position) })
            }
            Anchor::Vertex(vertex) if shape.arc_m.is_empty() => {
                let position = *shape.points.get(vertex as usize)?;
                Some(MaterialPoint::new(position, self.shared(&[(vertex, 1.0)], None)))
            }
            Anchor::Arc(arc_m) => {
                let (segment, share) = shape.locate(arc_m)?;
                let position = shape.points.get(segment)?.lerp(*shape.points.get(segment + 1)?, share);
                let slot = 2 * segment as u32;
                Some(MaterialPoint::new(position, self.shared(&[(slot, 1.0 - share), (slot + 2, share)], None)))
            }
            _ => None,
        }
    }

    fn slot_of(&self, block: usize) -> u32 {
        self.model.blocks[block].slot
    }
}

/// The share of `whole` that `part` along it makes up, 0 … 1.
fn share_of(part: DVec3, whole: DVec3) -> f64 {
    let square = whole.length_squared();
    if square > 0.0 { (part.dot(whole) / square).clamp(0.0, 1.0) } else { 0.0 }
}

fn place_of_slot(model: &LocalModel, slot: u32) -> Option<usize> {
    model.blocks.iter().position(|block| block.slot == slot)
}

/// The local model of a body that has published none yet: it moves as a whole and nothing holds it.
fn lone(inertia: &Inertia, body: &Body, step_s: f64, into: &mut LocalModel) {
    into.blocks.clear();
    into.compliance.clear();
    into.partners.clear();
    into.step_s = step_s;
    if let (Inertia::Rigid { inverse_mass, inverse_inertia }, Body::Rigid(state)) = (inertia, body) {
        let blocks = [(0, state.velocity), (1, state.spin)];
        into.blocks.extend(blocks.map(|(slot, velocity)| LocalBlock { slot, velocity, acceleration: DVec3::ZERO }));
        let linear = DMat3::from_diagonal(*inverse_mass);
        into.compliance.extend([linear, DMat3::ZERO, DMat3::ZERO, *inverse_inertia]);
    }
}
