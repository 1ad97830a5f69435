//! Another agent as its neighbour expects it: brought to the neighbour's own time, with the impulses that are on their way.
//!
//! In: the newest snapshot, however old, and the ledger of what it does not know yet. Out: positions, velocities in slots, and
//! how it answers impulses; it goes on with its neighbour's substeps. Never here: which impulses it gets.
//! Theory: docs/theory/coupling.md, eq. 5–7d: v* = v + a τ + W (J − J_ack), x* = x + v τ + a τ²/2 + W ((J − J_ack) t − (S − S_ack)).

mod deliver;
mod ground;
mod held;

use super::sprung::{Lean, Sprung};
use super::{Exchange, Form, Impulse, Place, Placed, Site, Slots, Twist, View};
use crate::{AgentId, Anchor, Body, Inertia, Neighbour, Surroundings, ToolState};
use glam::{DMat3, DQuat, DVec3};
use std::sync::Arc;

/// A neighbour at one's own time.
#[derive(Debug, Clone, Default)]
pub struct Other {
    neighbour: Option<Neighbour>,
    pose: Pose,
    /// Velocities in slots: a rigid body's or tool's centre and spin; a tube's nodes and segments in turn; a soft body's vertices.
    velocities: Vec<DVec3>,
    /// A rigid body's springs.
    lean: Option<Lean>,
    /// A tube's nodes, a soft body's vertices.
    positions: Vec<DVec3>,
    /// Room for two answers.
    answer: Vec<DVec3>,
    carried: Vec<DVec3>,
    /// Of a soft body: by how much what is on its way changes how each vertex accelerates, m/s²; empty for nothing.
    taken_back: Vec<DVec3>,
    age_s: f64,
    held: bool,
    /// How far impulses have lifted it off what it stood on, metres, ≥ 0; `None` while none has.
    height_m: Option<f64>,
    /// Whether impulses only press it on what it stands on, while a solve takes that for granted.
    pressed: Option<bool>,
    /// What other owners have announced for a rigid body: in how many seconds it acts.
    coming: Vec<(f64, Twist)>,
    /// What is expected of them after that: in how many seconds it begins, N and N·m.
    lasting: Vec<(f64, Twist)>,
}

/// A body at rest is immovable until something comes at it faster than this, m/s: what is laid down gently is not noticed.
pub const WAKE_M_S: f64 = 5e-3;

/// Where a body of one piece is.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pose {
    centre: DVec3,
    rotation: DQuat,
}

impl Default for Pose {
    fn default() -> Self {
        Self { centre: DVec3::ZERO, rotation: DQuat::IDENTITY }
    }
}

impl Other {
    /// Takes in the newest state of `neighbour`, brought to the time of `around`; whether it is one that can be touched or held.
    /// A rigid body says `from` where it looks: what it stands in the way of has not been on the other side of it.
    ///
    /// Storage is used again: nothing is allocated once the sizes settle.
    pub fn meet(
        &mut self,
        neighbour: &Neighbour,
        around: &Surroundings<'_>,
        exchange: &Exchange,
        from: Option<DVec3>,
    ) -> bool {
        let known = self.see(neighbour);
        if known {
            self.reckon();
            self.age_s = around.time.secs_after(neighbour.snapshot.time);
            self.foresee(self.age_s);
            // what bends accelerates as told for about a step, and forwards: back by more of them its nodes would fly apart
            self.go_on(if self.is_many() { self.age_s.max(-2.0 * self.reckoned_s()) } else { self.age_s });
            self.deliver(neighbour, around, exchange, from);
        }
        known
    }

    /// Takes in the newest state of `neighbour` as it was published; whether it is one that can be touched or held.
    pub fn see(&mut self, neighbour: &Neighbour) -> bool {
        let snapshot = &neighbour.snapshot;
        self.neighbour = Some(neighbour.clone());
        self.held = snapshot.at_rest || matches!(snapshot.inertia, Inertia::Immovable);
        (self.age_s, self.height_m, self.lean, self.pressed) = (0.0, None, None, None);
        self.coming.clear();
        self.lasting.clear();
        self.taken_back.clear();
        self.positions.clear();
        self.velocities.clear();
        match &snapshot.body {
            Body::Nothing => false,
            Body::Rigid(body) => {
                self.pose = Pose { centre: body.position, rotation: body.rotation };
                self.velocities.extend([body.velocity, body.spin]);
                self.lean = self.lean_of(snapshot.sprung.get().copied(), [body.velocity, body.spin]);
                true
            }
            Body::Tool(ToolState { tip, rotation, velocity, .. }) => {
                self.pose = Pose { centre: *tip, rotation: *rotation };
                self.velocities.extend([*velocity, DVec3::ZERO]);
                true
            }
            Body::Curve(curve) => {
                self.positions.extend_from_slice(&curve.positions);
                self.interleave(&curve.velocities);
                !self.positions.is_empty()
            }
            Body::Soft(soft) => {
                self.positions.extend_from_slice(&soft.positions);
                self.velocities.extend_from_slice(&soft.velocities);
                !self.positions.is_empty()
            }
        }
    }

    /// Whether it is made of many points and not one piece.
    #[must_use]
    pub fn is_many(&self) -> bool {
        !self.positions.is_empty()
    }

    /// From one point to the next, how many slots: between those of a tube's nodes stand its spins. A rigid body has one point.
    #[must_use]
    pub fn stride(&self) -> usize {
        if self.neighbour.as_ref().is_some_and(|n| matches!(n.snapshot.body, Body::Soft(_))) { 1 } else { 2 }
    }

    /// Who.
    #[must_use]
    pub fn id(&self) -> Option<AgentId> {
        self.neighbour.as_ref().map(|n| n.id)
    }

    /// The neighbour as it was seen.
    #[must_use]
    pub const fn neighbour(&self) -> Option<&Neighbour> {
        self.neighbour.as_ref()
    }

    /// Its shape.
    #[must_use]
    pub fn form(&self) -> Option<&Arc<Form>> {
        self.neighbour.as_ref().and_then(|n| n.form.as_ref())
    }

    /// How old its state was, seconds; negative where it was ahead.
    #[must_use]
    pub const fn age_s(&self) -> f64 {
        self.age_s
    }

    /// Over how long a depth is taken back from it, seconds: until what was pushed out can show. Springs show it a step later.
    #[must_use]
    pub fn answers_within_s(&self) -> f64 {
        self.age_s.max(self.lean.as_ref().map_or(0.0, Lean::span_s))
    }

    /// Whether impulses do not move it: it is led, held, or at rest.
    #[must_use]
    pub const fn is_held(&self) -> bool {
        self.held
    }

    /// Whether it only rests: impulses would move it if it woke.
    #[must_use]
    pub fn is_asleep(&self) -> bool {
        self.held && self.neighbour.as_ref().is_some_and(|n| !matches!(n.snapshot.inertia, Inertia::Immovable))
    }

    /// Whether springs hold it, as its owner knows.
    #[must_use]
    pub const fn is_sprung(&self) -> bool {
        self.lean.is_some()
    }

    /// Wakes a body that rests: from now on impulses move it.
    pub fn wake(&mut self) {
        self.held = self.neighbour.as_ref().is_none_or(|n| matches!(n.snapshot.inertia, Inertia::Immovable));
    }

    /// Wakes a body that rests if a blow is on its way to it: it only rests until it reads of that.
    pub fn stir(&mut self, around: &Surroundings<'_>, exchange: &Exchange) {
        let Some(neighbour) = self.neighbour.clone().filter(|n| self.held && n.snapshot.at_rest) else { return };
        self.wake();
        self.deliver(&neighbour, around, exchange, None);
        let moves = self.velocities.iter().step_by(self.stride()).any(|v| v.length_squared() > WAKE_M_S * WAKE_M_S);
        self.held = self.held || !moves;
    }

    /// Its velocities in slots, m/s and rad/s.
    #[must_use]
    pub fn velocities(&self) -> &[DVec3] {
        &self.velocities
    }

    /// The same, to be written on by a solve.
    pub fn velocities_mut(&mut self) -> &mut [DVec3] {
        &mut self.velocities
    }

    /// Its smooth acceleration, m/s²: none where impulses do not move it.
    #[must_use]
    pub fn acceleration(&self) -> DVec3 {
        match (&self.neighbour, &self.lean) {
            (Some(_), Some(lean)) => lean.acceleration(0.0)[0],
            (Some(neighbour), None) if !self.held => neighbour.snapshot.acceleration + self.carried_by_others()[0],
            _ => DVec3::ZERO,
        }
    }

    /// What the next `h` seconds add to the velocities of its first two slots, for who gives an impulse at their start: half of
    /// it where it falls freely, all of it where springs hold it and the impulse lasts (docs/theory/coupling.md, eq. 7d).
    #[must_use]
    pub fn gain(&self, h: f64) -> Twist {
        match &self.lean {
            Some(lean) => lean.acceleration(h).map(|a| a * h),
            None => {
                let falling = self.fall(h).map_or(DVec3::ZERO, |fall| fall.normal * (fall.way_m / h - fall.speed_m_s));
                [self.acceleration() * (0.5 * h) + falling, self.carried_by_others()[1] * (0.5 * h)]
            }
        }
    }

    /// Impulses will last for `h` seconds: what springs hold answers by that.
    pub fn foresee(&mut self, h: f64) {
        if let Some(lean) = &mut self.lean {
            lean.foresee(h);
        }
    }

    /// The mean inverse mass (1/kg) and inverse inertia of a body on springs.
    #[must_use]
    pub fn mobility(&self) -> Option<[f64; 2]> {
        self.lean.as_ref().map(Lean::mobility)
    }

    fn lean_of(&self, sprung: Option<Sprung>, velocity: Twist) -> Option<Lean> {
        match (sprung.filter(|_| !self.held), &self.neighbour.as_ref()?.snapshot.inertia) {
            (Some(sprung), Inertia::Rigid { inverse_mass, inverse_inertia }) => {
                Some(Lean::new(sprung, (*inverse_mass, *inverse_inertia), velocity))
            }
            _ => None,
        }
    }

    /// The same of a node or vertex: a tube tells how each of its nodes accelerates, a soft body of its vertices.
    #[must_use]
    pub fn acceleration_of(&self, node: usize) -> DVec3 {
        match self.neighbour.as_ref().map(|n| &n.snapshot.inertia) {
            Some(Inertia::Curve(curve)) if !self.held && curve.accelerations.len() == self.positions.len() => {
                curve.accelerations[node]
            }
            Some(Inertia::Soft(soft)) if !self.held && soft.accelerations.len() == self.positions.len() => {
                soft.accelerations[node] + self.taken_back.get(node).copied().unwrap_or_default()
            }
            _ => self.acceleration(),
        }
    }

    /// Makes the published velocities of a tube or soft body, which are means over its last substep, those at its end (eq. 6a).
    fn reckon(&mut self) {
        let half_s = self.reckoned_s();
        if half_s == 0.0 {
            return;
        }
        let stride = self.stride();
        for node in 0..self.positions.len() {
            let gained = self.acceleration_of(node) * half_s;
            self.velocities[stride * node] += gained;
        }
    }

    /// Where it is; `None` before the first [`Self::meet`] and for a body that has no shape.
    #[must_use]
    pub fn placed(&self) -> Option<Placed<'_>> {
        let neighbour = self.neighbour.as_ref()?;
        let Pose { centre, rotation } = self.pose;
        let view = match &neighbour.snapshot.body {
            Body::Nothing => return None,
            Body::Rigid(_) => View::Solid { position: centre, rotation },
            Body::Tool(tool) => View::Tool { tip: centre, rotation, jaw: tool.jaw },
            Body::Curve(curve) => View::Chain { positions: &self.positions, radii_m: &curve.radii_m },
            Body::Soft(_) => View::Surface(&self.positions),
        };
        Some(Placed { form: neighbour.form.as_deref()?, view })
    }

    /// Adds the velocity of the place of a contact to what `slots` gather, as [`Place::join`] does; this body's slots begin at `base`.
    pub fn join(&self, slots: &mut Slots, base: u32, place: &Place, towards: (DVec3, f64)) {
        place.join(slots, base, self.pose.centre, towards);
    }

    /// Where a material point is and how it moves; `None` where there is no such point.
    #[must_use]
    pub fn point(&self, anchor: Anchor) -> Option<(DVec3, DVec3)> {
        let place = self.place(anchor)?;
        let mut slots = Slots::default();
        self.join(&mut slots, 0, &place, (DVec3::ZERO, 1.0));
        let position = match place {
            Place::Point(point) => point,
            Place::Chain { segment, share, .. } => {
                let [a, b] = [segment, segment + 1].map(|node| self.positions[node as usize]);
                a.lerp(b, share)
            }
            Place::Surface { vertices, shares } => {
                vertices.into_iter().zip(shares).map(|(vertex, share)| self.positions[vertex as usize] * share).sum()
            }
        };
        Some((position, slots.velocity(&self.velocities)))
    }

    /// Adds the velocity of a material point to what `slots` gather; this body's slots begin at zero.
    pub fn hold(&self, slots: &mut Slots, anchor: Anchor) {
        if let Some(place) = self.place(anchor) {
            self.join(slots, 0, &place, (DVec3::ZERO, 1.0));
        }
    }

    fn place(&self, anchor: Anchor) -> Option<Place> {
        match (&self.neighbour.as_ref()?.snapshot.body, anchor) {
            (Body::Curve(curve), Anchor::Arc(arc_m)) => {
                let (segment, share) = curve.locate(arc_m)?;
                Some(Place::Chain { segment: segment as u32, share, radius_m: 0.0 })
            }
            (Body::Rigid(_) | Body::Tool(_), Anchor::Local(local)) => {
                Some(Place::Point(self.pose.centre + self.pose.rotation * local))
            }
            (Body::Soft(soft), Anchor::Vertex(vertex)) if (vertex as usize) < soft.positions.len() => {
                Some(Place::Surface { vertices: [vertex; 3], shares: [1.0, 0.0, 0.0] })
            }
            _ => None,
        }
    }

    /// The inverse mass of what gathers from `slots`, 1/kg: J A⁻¹ Jᵀ.
    #[must_use]
    pub fn inverse_mass(&mut self, slots: &Slots) -> DMat3 {
        let mut answer = std::mem::take(&mut self.answer);
        answer.resize(self.velocities.len(), DVec3::ZERO);
        let mut column = |axis: DVec3| {
            answer.fill(DVec3::ZERO);
            slots.scatter(axis, &mut answer);
            self.respond(&mut answer);
            slots.velocity(&answer)
        };
        let whole = DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z));
        self.answer = answer;
        whole
    }

    /// Turns impulses, one a slot, into the velocities they cause: W of the coupling (eq. 7).
    ///
    /// # Panics
    /// Where there are not as many as [`Self::velocities`].
    pub fn respond(&self, impulses: &mut [DVec3]) {
        if let (Some(lean), [linear, angular]) = (&self.lean, &mut *impulses) {
            [*linear, *angular] = lean.respond([*linear, *angular]);
            return;
        }
        let inertia = self.neighbour.as_ref().filter(|_| !self.held).map(|n| &n.snapshot.inertia);
        match inertia {
            Some(Inertia::Rigid { inverse_mass, inverse_inertia }) => {
                let stand = self.stands(impulses[0], impulses[1]);
                impulses[0] *= *inverse_mass;
                impulses[1] = *inverse_inertia * impulses[1];
                if let Some(normal) = stand {
                    impulses[0] -= normal * normal.dot(impulses[0]);
                    impulses[1] = DVec3::ZERO;
                }
            }
            Some(Inertia::Curve(curve)) if curve.slots() == impulses.len() => curve.respond(impulses),
            Some(Inertia::Soft(soft)) if soft.slots() == impulses.len() => soft.respond(impulses),
            _ => impulses.fill(DVec3::ZERO),
        }
    }

    /// The normal of what it stands on, where such an impulse only presses it down there (eq. 7a).
    fn stands(&self, linear: DVec3, angular: DVec3) -> Option<DVec3> {
        let stand = self.neighbour.as_ref()?.snapshot.stand?;
        let pressed = self.pressed.unwrap_or_else(|| stand.bears(self.pose.centre, Impulse { linear, angular }));
        pressed.then_some(stand.normal)
    }

    /// Lets impulses, one a slot, act on it: for the next `h` seconds, or at once where that is zero.
    pub fn push(&mut self, impulses: &[DVec3], h: f64) {
        let mut answer = std::mem::take(&mut self.answer);
        answer.clear();
        answer.extend_from_slice(impulses);
        self.respond(&mut answer);
        self.leave(answer[0]);
        self.velocities.iter_mut().zip(&answer).for_each(|(v, dv)| *v += *dv);
        if let (Some(lean), [linear, angular]) = (&mut self.lean, &answer[..]) {
            lean.push([*linear, *angular], h > 0.0);
        }
        self.answer = answer;
    }

    /// Lets `h` seconds pass: x + v h + a h²/2, v + a h.
    pub fn go_on(&mut self, h: f64) {
        if let Some(lean) = &mut self.lean {
            let way = lean.go_on(h);
            self.velocities.copy_from_slice(&lean.velocity());
            self.shift(&way);
            return;
        }
        if self.positions.is_empty() {
            let (a, [_, turning]) = (self.acceleration(), self.carried_by_others());
            let fall = self.fall(h);
            let Pose { centre, rotation } = &mut self.pose;
            *centre += self.velocities[0] * h + a * (0.5 * h * h);
            *rotation = turned(*rotation, self.velocities[1] * h + turning * (0.5 * h * h));
            self.velocities[0] += a * h;
            self.velocities[1] += turning * h;
            if let Some(fall) = fall {
                self.settle(&fall, h);
            }
            self.receive(h);
            return;
        }
        let stride = self.stride();
        for node in 0..self.positions.len() {
            let a = self.acceleration_of(node);
            let v = &mut self.velocities[stride * node];
            self.positions[node] += *v * h + a * (0.5 * h * h);
            *v += a * h;
        }
    }

    /// Books impulses, one a slot, that act from `after_s` seconds into the step on; on a body on springs they last for `h`.
    pub fn book(&self, exchange: &mut Exchange, (after_s, h): (f64, f64), impulses: &[DVec3]) {
        let after_s = if self.lean.is_some() { after_s + 0.5 * h } else { after_s };
        let Some(neighbour) = &self.neighbour else { return };
        if self.held && !matches!(neighbour.snapshot.body, Body::Tool(_)) {
            return; // a body at rest stands on something else, which takes the impulse
        }
        if matches!(neighbour.snapshot.body, Body::Soft(_)) {
            for (vertex, impulse) in impulses.iter().enumerate().filter(|(_, i)| **i != DVec3::ZERO) {
                let impulse = Impulse { linear: *impulse, angular: DVec3::ZERO };
                exchange.give(neighbour.id, Site::Vertex(vertex as u32), after_s, impulse);
            }
            return;
        }
        let Body::Curve(curve) = &neighbour.snapshot.body else {
            let impulse = Impulse { linear: impulses[0], angular: impulses[1] };
            if impulse != Impulse::ZERO {
                exchange.give(neighbour.id, Site::Whole, after_s, impulse);
            }
            return;
        };
        for (slot, impulse) in impulses.iter().enumerate().filter(|(_, i)| **i != DVec3::ZERO) {
            let (site, impulse) = if slot % 2 == 0 {
                (curve.arc_m[slot / 2], Impulse { linear: *impulse, angular: DVec3::ZERO })
            } else {
                let middle = 0.5 * (curve.arc_m[slot / 2] + curve.arc_m[slot / 2 + 1]);
                (middle, Impulse { linear: DVec3::ZERO, angular: *impulse })
            };
            exchange.give(neighbour.id, Site::Arc(site), after_s, impulse);
        }
    }

    /// A tube's velocities in slots: nodes as published, segments as its inertia tells.
    fn interleave(&mut self, nodes: &[DVec3]) {
        let neighbour = self.neighbour.as_ref();
        let spins = match neighbour.map(|n| &n.snapshot.inertia) {
            Some(Inertia::Curve(curve)) => &curve.spins[..],
            _ => &[],
        };
        for (k, v) in nodes.iter().enumerate() {
            self.velocities.push(*v);
            if k + 1 < nodes.len() {
                self.velocities.push(spins.get(k).copied().unwrap_or(DVec3::ZERO));
            }
        }
    }

    /// Moves by what each slot is carried.
    fn shift(&mut self, by: &[DVec3]) {
        if self.positions.is_empty() {
            self.pose.centre += by[0];
            self.pose.rotation = turned(self.pose.rotation, by[1]);
        } else {
            let stride = self.stride();
            self.positions.iter_mut().zip(by.iter().step_by(stride)).for_each(|(x, dx)| *x += *dx);
        }
    }
}

/// A rotation turned on by a small or large rotation vector in world axes.
pub(super) fn turned(rotation: DQuat, by: DVec3) -> DQuat {
    if by == DVec3::ZERO { rotation } else { (DQuat::from_scaled_axis(by) * rotation).normalize() }
}
