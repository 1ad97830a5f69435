//! The other agents near a tube during one step: what they gave it, where they are, and what it gives them.
//!
//! In: neighbours as they were published; the impulses of the contacts and links that this tube owns. Out: contacts for the
//! tube's own solve, far ends of links, ledgers. Never here: the tube's own state and its solve.
//! Theory: docs/theory/coupling.md.

use super::anchor_springs::{End, Tie};
use super::apply_impulses::ReceivedImpulses;
use super::contact::Skin;
use super::discretization::Discretization;
use super::sided::Sided;
use super::substep::Substep;
use glam::DVec3;
use metachron_contact::beside::{may_touch, parts};
use metachron_contact::{Contact, Exchange, Law, Mates, Search, WAKE_M_S};
use metachron_contact::{Neighbour, StepContext};
use metachron_core::PairState;
use metachron_core::{AgentId, Bounds, SimTime, Snapshot};
use metachron_geometry::narrow_phase::NarrowPhaseScratch;
use metachron_geometry::{CollisionShape, PlacedShape, ShapePose, Touch};
use std::fmt;
use std::sync::Arc;

/// The agents near one tube.
#[derive(Clone, Default)]
pub struct Company {
    form: Option<Arc<CollisionShape>>,
    mates: Mates,
    received: ReceivedImpulses,
    room: Room,
    touches: Vec<Touch>,
    sided: Sided,
    /// Who sleeps where the tube may get, and owns the pair: nobody but this tube would see it come.
    knocks: Vec<AgentId>,
    mass_kg: f64,
    watched: bool,
}

/// Room for searches; a copy of a tube starts with none.
#[derive(Default)]
struct Room(NarrowPhaseScratch);

impl Clone for Room {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl fmt::Debug for Company {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Company").field("exchange", &self.mates.exchange).finish_non_exhaustive()
    }
}

impl Company {
    /// The company of a tube of this form and mass.
    pub fn new(form: Arc<CollisionShape>, mass_kg: f64) -> Self {
        Self { form: Some(form), mass_kg, ..Self::default() }
    }

    /// The tube's form.
    pub fn form(&self) -> Option<&Arc<CollisionShape>> {
        self.form.as_ref()
    }

    /// Whether anybody is near enough to need to know how the tube answers impulses.
    pub fn is_watched(&self) -> bool {
        self.watched
    }

    /// Begins a step that ends at `until`: takes in what others gave since the last one, in slots of `division`.
    pub fn open(&mut self, around: &StepContext<'_>, division: &Discretization, until: SimTime) {
        self.watched = !around.links.is_empty() || around.neighbours.iter().any(|n| n.form.is_some());
        let Self { mates: Mates { exchange, .. }, received, .. } = self;
        received.clear(2 * division.segments() + 1);
        if !around.neighbours.is_empty() || !exchange.is_empty() {
            exchange.open(around);
            let dt = until.secs_after(around.time);
            exchange.take(around, until, |id, site, sum, carried| {
                received.add(division, site, sum, carried);
                let giver = around.neighbours.iter().find(|n| n.id == id);
                giver.into_iter().for_each(|giver| received.check_clock(giver, around.time, dt));
            });
        }
    }

    /// The books of all couplings.
    pub fn exchange(&self) -> &Exchange {
        &self.mates.exchange
    }

    /// The state of the pair with `id`.
    pub fn pair_mut(&mut self, id: AgentId) -> &mut PairState {
        self.mates.exchange.pair_mut(id)
    }

    /// Friction coefficient of the tube's skin.
    pub fn friction(&self) -> f64 {
        self.form.as_ref().map_or(0.0, |form| form.friction)
    }

    /// What it keeps of laws by which the tube acts on itself.
    pub fn sided(&mut self) -> &mut Sided {
        &mut self.sided
    }

    /// Lends what a search for places needs: the tube's form, room, and a list that comes back by [`Self::give_back`].
    pub fn search(&mut self) -> Option<(Arc<CollisionShape>, &mut NarrowPhaseScratch, Vec<Touch>)> {
        let list = std::mem::take(&mut self.touches);
        self.form.clone().map(|form| (form, &mut self.room.0, list))
    }

    /// Takes back the list of a search.
    pub fn give_back(&mut self, list: Vec<Touch>) {
        self.touches = list;
    }

    /// What others gave that acts through the substep that comes, in slots; empty for nothing.
    pub fn fresh(&self) -> &[DVec3] {
        self.received.fresh()
    }

    /// What others gave that acted through the substep that ended, in slots; empty for nothing.
    pub fn spent(&self) -> &[DVec3] {
        self.received.spent()
    }

    /// What others gave since the last step.
    pub fn received(&mut self) -> &mut ReceivedImpulses {
        &mut self.received
    }

    /// Gathers those whose couplings with this tube it owns, for a step of `dt` seconds from `bounds`.
    pub fn gather(&mut self, around: &StepContext<'_>, bounds: &Bounds, dt: f64) {
        self.knocks.clear();
        self.knock(around, bounds, dt);
        let friction = self.friction();
        self.mates.gather(around, friction, |neighbour, _| may_touch(neighbour, around, bounds, dt));
        self.mates.regain(around, dt);
    }

    /// There is nobody in this step.
    pub fn dismiss(&mut self) {
        self.mates.dismiss();
        self.knocks.clear();
    }

    /// Finds those who own the pair with this tube and sleep where it may get within two steps of `dt` seconds.
    fn knock(&mut self, around: &StepContext<'_>, bounds: &Bounds, dt: f64) {
        if bounds.speed_m_s <= WAKE_M_S {
            return;
        }
        let sleeps = |n: &&Neighbour| !n.owned && n.form.is_some() && n.law != Law::Off && n.snapshot.at_rest;
        for neighbour in around.neighbours.iter().filter(sleeps) {
            let Some(there) = neighbour.snapshot.bounds else { continue };
            let apart = (there.low - bounds.high).max(bounds.low - there.high).max_element();
            if apart < 2.0 * dt * bounds.speed_m_s {
                self.knocks.push(neighbour.id);
            }
        }
    }

    /// Those whose couplings with this tube it owns.
    pub const fn mates(&self) -> &Mates {
        &self.mates
    }

    /// The same, to act on.
    pub const fn mates_mut(&mut self) -> &mut Mates {
        &mut self.mates
    }

    /// Whether there is nobody.
    pub fn is_empty(&self) -> bool {
        self.mates.is_empty()
    }

    /// Into how many parts a step of `dt` seconds falls while somebody is near enough to touch or linked.
    pub fn parts(&self, dt: f64) -> u32 {
        if self.is_empty() { 1 } else { parts(dt) }
    }

    /// Finds the contacts with the others, whose velocities stand behind the tube's own.
    pub fn find(&mut self, skin: &Skin<'_>, slack_m: f64, contacts: &mut Vec<Contact>) {
        let Self { form, mates, room, .. } = self;
        let Some(form) = form else { return };
        let here = PlacedShape { form, view: ShapePose::Chain { positions: skin.positions, radii_m: skin.radii_m } };
        let first = contacts.len();
        let search = Search { h_s: skin.h_s, slack_m, speed_m_s: skin.speed() };
        mates.find(&here, search, skin.slots, (&mut room.0, contacts));
        contacts[first..].sort_unstable_by_key(|contact| contact.key);
    }

    /// Tells links where their far ends are for a substep.
    pub fn aim(&mut self, ties: &mut [Tie], positions: &[DVec3], substep: Substep) {
        for tie in ties {
            let End::Linked(link) = tie.end else { continue };
            let Some(far) = self.mates.far(&link, substep.span_s) else { continue };
            let point = tie.mix(positions[tie.segment], positions[tie.segment + 1]);
            tie.set_far_end(&far, point, substep);
        }
    }

    /// Gives what a substep that stands gave, `start` seconds into the step, and lets the others go on by `h`.
    pub fn accept<'a>(
        &mut self,
        contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)>,
        ties: &[Tie],
        span: (usize, f64, f64),
    ) {
        if !(self.is_empty() && ties.is_empty()) {
            self.mates.accept(contacts, ties.iter().filter_map(Tie::pulled), span);
        }
    }

    /// Ends a step of `dt` seconds.
    pub fn close(&mut self, around: &StepContext<'_>, dt: f64) {
        self.mates.tell(self.mass_kg);
        self.mates.keep(around, dt);
        self.mates.close(around, dt);
    }

    /// Whether everybody that the tube touches rests or never moves: only then may it rest itself.
    pub fn is_calm(&self) -> bool {
        self.received.is_empty() && self.mates.is_calm()
    }

    /// Writes ledgers and pairs, and who must stay awake.
    pub fn write(&self, into: &mut Snapshot) {
        self.mates.write(into);
        into.touches.extend_from_slice(&self.knocks);
    }
}
