//! Finds agents that start in contact with or inside each other or static solids.
//!
//! In: a scene. Out: all pairs that overlap although they collide, and how deep.
//! Never here: the response to it.

use super::initial_shape::{StartShape, shape};
use crate::description::couplings;
use crate::description::couplings::CouplingKind;
use crate::description::placement::Overlap;
use crate::description::scene::{Scene, Spec};
use metachron_contact::Law;
use metachron_core::AgentId;
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
use metachron_geometry::{Place, ShapeKind, Touch};
use std::collections::BTreeSet;

/// Less than this is rounding, not overlap, metres: shapes are in single precision.
pub(super) const OVERLAP_MIN_M: f64 = 2e-5;

/// The object that an agent starts inside of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Container {
    /// Another agent.
    Agent(AgentId),
    /// A static solid, by its index in [`Scene::obstacles`].
    Fixed(usize),
}

impl Scene {
    /// The overlaps, with names.
    pub(super) fn overlaps_by_name(&self, inside: &[(AgentId, Container, f64)]) -> Vec<Overlap> {
        let name = |b: Container| match b {
            Container::Agent(id) => self.name_of(id).to_owned(),
            Container::Fixed(at) => self.obstacles[at].name.clone(),
        };
        let named = |&(a, b, depth_m): &_| Overlap { a: name(Container::Agent(a)), b: name(b), depth_m };
        inside.iter().map(named).collect()
    }

    /// All overlaps at the poses that the scene gives, and their depths, metres: pairs of agents in the order of their ids, then agents
    /// inside static solids.
    pub(super) fn find_overlaps(&self) -> Vec<(AgentId, Container, f64)> {
        let mut pairs = Vec::new();
        self.pairs_within(0.0, |one, two, gap_m| {
            if gap_m <= -OVERLAP_MIN_M {
                pairs.push((one.id.min(two.id), Container::Agent(one.id.max(two.id)), -gap_m));
            }
        });
        pairs.sort_by_key(|&(a, b, _)| (a, b));
        self.overlaps_with_static(&mut pairs);
        pairs
    }

    /// Appends the agents that start inside static solids. A tube that is held may be held to the wall of one: it is reported only where
    /// its axis is inside.
    fn overlaps_with_static(&self, pairs: &mut Vec<(AgentId, Container, f64)>) {
        let (mut scratch, mut found) = (NarrowPhaseScratch::default(), Vec::new());
        let others =
            self.agents.iter().filter(|member| !matches!(member.spec, Spec::Tool(_)) && !member.spec.is_kinematic());
        for shape in others.filter_map(shape) {
            let held = !(self.is_free(shape.id) || matches!(self.agents[shape.id.0 as usize].spec, Spec::Rigid(_)));
            for (at, obstacle) in self.obstacles.iter().enumerate() {
                let Some(fixed) = shape.obstacle_shape(obstacle) else { continue };
                if !shape.form.presses(&fixed.form) {
                    continue;
                }
                touches(&shape.placed(), &fixed.placed(), 0.0, &mut scratch, &mut found);
                let counts = |touch: &&Touch| match touch.on_a {
                    Place::Chain { radius_m, .. } if held => touch.gap_m < -radius_m - OVERLAP_MIN_M,
                    _ => true,
                };
                let depth_m = found.iter().filter(counts).map(|touch| -touch.gap_m).fold(0.0, f64::max);
                if depth_m >= OVERLAP_MIN_M {
                    pairs.push((shape.id, Container::Fixed(at), depth_m));
                }
            }
        }
    }

    /// Deformables held through a static solid, with the solid's index: they pass through as if the solid were bored.
    pub(super) fn held_through(&self) -> impl Iterator<Item = (AgentId, usize)> + '_ {
        let mut pairs = Vec::new();
        self.overlaps_with_static(&mut pairs);
        pairs.into_iter().filter_map(|(id, container, _)| match container {
            Container::Fixed(at) if self.agents[id.0 as usize].spec.is_deformable() && !self.is_free(id) => {
                Some((id, at))
            }
            _ => None,
        })
    }

    /// Calls `visit` with every pair that collides and starts no farther apart than `reach_m`, and with its least gap, metres.
    fn pairs_within(&self, reach_m: f64, mut visit: impl FnMut(&StartShape, &StartShape, f64)) {
        let (mut scratch, mut found) = (NarrowPhaseScratch::default(), Vec::new());
        self.box_pairs(self.agents.iter().filter_map(shape).collect(), reach_m, |one, two| {
            touches(&one.placed(), &two.placed(), reach_m, &mut scratch, &mut found);
            if let Some(gap_m) = found.iter().map(|touch: &Touch| touch.gap_m).reduce(f64::min) {
                visit(one, two, gap_m);
            }
        });
    }

    /// Calls `visit` with every pair of `shapes` that can collide and whose boxes are no farther apart than `reach_m`.
    fn box_pairs(&self, mut shapes: Vec<StartShape>, reach_m: f64, mut visit: impl FnMut(&StartShape, &StartShape)) {
        shapes.sort_by(|a, b| a.low.x.total_cmp(&b.low.x));
        let apart = self.pairs_apart();
        for (at, one) in shapes.iter().enumerate() {
            for two in shapes[at + 1..].iter().take_while(|two| two.low.x <= one.high.x + reach_m) {
                if one.box_touches(two, reach_m) && self.collide(one, two, &apart) {
                    visit(one, two);
                }
            }
        }
    }

    /// Pairs whose contact differs from the scene's `contacts`: where that is true the pairs that do not collide, else
    /// the pairs that do.
    pub(super) fn pairs_apart(&self) -> BTreeSet<(AgentId, AgentId)> {
        let contact =
            |c: &&couplings::Coupling| c.kind == CouplingKind::Contact && (c.law == Law::Off) == self.contacts;
        let coupled = self.couplings.iter().filter(contact).map(|c| (c.a, c.b));
        let jointed = self.joints.iter().filter(|j| !j.collide && self.contacts).filter_map(|j| Some((j.a, j.b?)));
        coupled.chain(jointed).map(|(a, b)| (a.min(b), a.max(b))).collect()
    }

    /// Whether two agents collide; two tools never do, nor do two kinematic bodies.
    pub(super) fn collide(&self, one: &StartShape, two: &StartShape, apart: &BTreeSet<(AgentId, AgentId)>) -> bool {
        let led = |shape: &StartShape| matches!(shape.form.kind, ShapeKind::Tool(_));
        let named = apart.contains(&(one.id.min(two.id), one.id.max(two.id)));
        let kinematic = |shape: &StartShape| self.agents[shape.id.0 as usize].spec.is_kinematic();
        let both_led = led(one) && led(two) || kinematic(one) && kinematic(two);
        named != self.contacts && !both_led && one.form.presses(&two.form)
    }
}
