//! Agents that start against or inside each other or fixed solids.
//!
//! In: a scene. Out: all that overlap where they would touch, and how deep; every pair that lies at rest; every pair
//! of rigid bodies so near that turning could make them touch.
//! Never here: what is done about it.

use super::cast::{Member, Scene, Spec};
use super::ties::{Coupling, CouplingKind};
use glam::{DQuat, DVec3};
use metachron_agents::coupling::touch::{TouchRoom, touches};
use metachron_agents::coupling::{Form, FormKind, Law, Placed, SolidForm, Touch, View};
use metachron_agents::rod::Tube;
use metachron_agents::shape::{Obstacle, Solid, ToolShape};
use metachron_agents::soft::SoftBody;
use metachron_agents::{Agent, AgentId, Body, CurveState, Snapshot, SoftState};
use std::collections::BTreeSet;

/// Less than this is rounding, not overlap, metres: shapes are in single precision.
const OVERLAP_MIN_M: f64 = 2e-5;
/// Bodies no farther apart than this lie against each other, metres.
const TOUCH_MAX_M: f64 = 1e-4;
/// How far a plane's slab reaches past a figure, in sizes of it.
const SLAB_SHARE: f64 = 4.0;

/// An agent that starts inside another or inside a fixed solid.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlap {
    /// Its name; of two agents that with the lower number.
    pub a: String,
    /// The other's.
    pub b: String,
    /// How deep at the deepest place, metres.
    pub depth_m: f64,
}

/// An agent's shape where it starts.
struct Figure {
    id: AgentId,
    form: Form,
    place: Pose,
    low: DVec3,
    high: DVec3,
}

enum Pose {
    Solid(DVec3, DQuat),
    Chain(CurveState),
    Soft(SoftState),
    Tool(DVec3, DQuat, f64),
}

impl Scene {
    /// All that starts inside each other: pairs of agents in the order of their numbers, then rigid ones inside fixed solids.
    ///
    /// What bends may be meant to be held there. Meshes are left out: what is inside one of them may be in its hollow.
    #[must_use]
    pub fn overlaps(&self) -> Vec<Overlap> {
        let mut pairs = Vec::new();
        self.pairs_within(0.0, |one, two, gap_m| {
            if gap_m <= -OVERLAP_MIN_M {
                pairs.push((one.id.min(two.id), one.id.max(two.id), -gap_m));
            }
        });
        pairs.sort_by_key(|&(a, b, _)| (a, b));
        let name = |id: AgentId| self.name_of(id).to_owned();
        let pairs = pairs.into_iter().map(|(a, b, depth_m)| Overlap { a: name(a), b: name(b), depth_m });
        pairs.chain(self.fixed_overlaps()).collect()
    }

    /// The rigid agents that start inside fixed solids.
    fn fixed_overlaps(&self) -> Vec<Overlap> {
        let (mut room, mut found) = (TouchRoom::default(), Vec::new());
        let mut overlaps = Vec::new();
        let rigid = self.agents.iter().filter(|member| matches!(member.spec, Spec::Rigid(_)));
        for figure in rigid.filter_map(figure) {
            for obstacle in self.obstacles.iter().filter(|obstacle| !matches!(obstacle.solid, Solid::Mesh { .. })) {
                let Some(fixed) = figure.over(obstacle) else { continue };
                touches(&figure.placed(), &fixed.placed(), 0.0, &mut room, &mut found);
                let depth_m = found.iter().map(|touch: &Touch| -touch.gap_m).fold(0.0, f64::max);
                if depth_m >= OVERLAP_MIN_M {
                    let (a, b) = (self.name_of(figure.id).to_owned(), obstacle.name.clone());
                    overlaps.push(Overlap { a, b, depth_m });
                }
            }
        }
        overlaps
    }

    /// Every pair of rigid agents that starts at rest against each other and touches by the ledger.
    #[must_use]
    pub fn resting_pairs(&self) -> Vec<(AgentId, AgentId)> {
        let still = |id: AgentId| match self.agents.get(id.0 as usize).map(|member| &member.spec) {
            Some(Spec::Rigid(body)) => body.velocity == DVec3::ZERO && body.spin == DVec3::ZERO,
            _ => false,
        };
        let other = self.pairs_by_other_laws();
        let mut pairs = Vec::new();
        self.pairs_within(TOUCH_MAX_M, |one, two, _| {
            let pair = (one.id.min(two.id), one.id.max(two.id));
            if still(pair.0) && still(pair.1) && !other.contains(&pair) {
                pairs.push(pair);
            }
        });
        pairs.sort_unstable();
        pairs
    }

    /// Every pair of rigid agents of one rate that touches by the ledger and whose balls, those around each, overlap.
    #[must_use]
    pub fn near_pairs(&self) -> Vec<(AgentId, AgentId)> {
        let rate = |id: AgentId| self.agents.get(id.0 as usize).map(|member| member.pace.rate_hz);
        let other = self.pairs_by_other_laws();
        let rigid = self.agents.iter().filter(|member| matches!(member.spec, Spec::Rigid(_)));
        let mut pairs = Vec::new();
        self.met(rigid.filter_map(figure).collect(), 0.0, |one, two| {
            let pair = (one.id.min(two.id), one.id.max(two.id));
            let apart_m = (one.low + one.high).distance(two.low + two.high) / 2.0;
            let reach_m = (one.high.x - one.low.x + two.high.x - two.low.x) / 2.0;
            if apart_m < reach_m && rate(pair.0) == rate(pair.1) && !other.contains(&pair) {
                pairs.push(pair);
            }
        });
        pairs.sort_unstable();
        pairs
    }

    /// Pairs with a law of contact that is not the ledger.
    fn pairs_by_other_laws(&self) -> BTreeSet<(AgentId, AgentId)> {
        let other_law = |c: &&Coupling| c.kind == CouplingKind::Contact && c.law != Law::Ledger;
        self.couplings.iter().filter(other_law).map(|c| (c.a.min(c.b), c.a.max(c.b))).collect()
    }

    /// Calls `visit` with every pair that touches and starts no farther apart than `reach_m`, and with its least gap.
    fn pairs_within(&self, reach_m: f64, mut visit: impl FnMut(&Figure, &Figure, f64)) {
        let (mut room, mut found) = (TouchRoom::default(), Vec::new());
        self.met(self.agents.iter().filter_map(figure).collect(), reach_m, |one, two| {
            touches(&one.placed(), &two.placed(), reach_m, &mut room, &mut found);
            if let Some(gap_m) = found.iter().map(|touch: &Touch| touch.gap_m).reduce(f64::min) {
                visit(one, two, gap_m);
            }
        });
    }

    /// Calls `visit` with every pair of `figures` that can touch and whose boxes are no farther apart than `reach_m`.
    fn met(&self, mut figures: Vec<Figure>, reach_m: f64, mut visit: impl FnMut(&Figure, &Figure)) {
        figures.sort_by(|a, b| a.low.x.total_cmp(&b.low.x));
        let apart = self.pairs_apart();
        for (at, one) in figures.iter().enumerate() {
            for two in figures[at + 1..].iter().take_while(|two| two.low.x <= one.high.x + reach_m) {
                if one.meets(two, reach_m) && self.touch(one, two, &apart) {
                    visit(one, two);
                }
            }
        }
    }

    /// Pairs whose contact differs from the scene's: with contacts those that do not touch, without those that do.
    fn pairs_apart(&self) -> BTreeSet<(AgentId, AgentId)> {
        let contact =
            |c: &&super::ties::Coupling| c.kind == CouplingKind::Contact && (c.law == Law::Off) == self.contacts;
        let coupled = self.couplings.iter().filter(contact).map(|c| (c.a, c.b));
        let jointed = self.joints.iter().filter(|j| !j.collide && self.contacts).filter_map(|j| Some((j.a, j.b?)));
        coupled.chain(jointed).map(|(a, b)| (a.min(b), a.max(b))).collect()
    }

    fn touch(&self, one: &Figure, two: &Figure, apart: &BTreeSet<(AgentId, AgentId)>) -> bool {
        let led = |figure: &Figure| matches!(figure.form.kind, FormKind::Tool(_));
        let named = apart.contains(&(one.id.min(two.id), one.id.max(two.id)));
        named != self.contacts && !(led(one) && led(two))
    }
}

impl Figure {
    fn meets(&self, other: &Self, reach_m: f64) -> bool {
        self.low.cmple(other.high + reach_m).all() && other.low.cmple(self.high + reach_m).all()
    }

    /// A fixed solid where it stands, if this may be inside it. A plane is a slab below this figure, as high as the plane.
    fn over(&self, obstacle: &Obstacle) -> Option<Self> {
        let rotation = obstacle.rotation.normalize();
        let (middle, half) = ((self.low + self.high) * 0.5, (self.high - self.low) * 0.5);
        let (solid, place) = if matches!(obstacle.solid, Solid::Plane) {
            let up = rotation * DVec3::Z;
            let height = up.dot(middle - obstacle.position);
            if height > up.abs().dot(half) {
                return None;
            }
            let deep = SLAB_SHARE * (half.length() + height.abs());
            (Solid::Box { half_extents_m: DVec3::splat(deep) }, middle - up * (height + deep))
        } else {
            (obstacle.solid.clone(), obstacle.position)
        };
        let form = SolidForm::new(solid, DVec3::ZERO).ok()?;
        let radius = DVec3::splat(form.radius_m);
        let form = Form { kind: FormKind::Solid(form), friction: 0.0, restitution: 0.0 };
        let fixed =
            Self { id: self.id, form, place: Pose::Solid(place, rotation), low: place - radius, high: place + radius };
        self.meets(&fixed, 0.0).then_some(fixed)
    }

    fn placed(&self) -> Placed<'_> {
        let view = match &self.place {
            Pose::Solid(position, rotation) => View::Solid { position: *position, rotation: *rotation },
            Pose::Chain(curve) => View::Chain { positions: &curve.positions, radii_m: &curve.radii_m },
            Pose::Soft(soft) => View::Surface(&soft.positions),
            Pose::Tool(tip, rotation, jaw) => View::Tool { tip: *tip, rotation: *rotation, jaw: *jaw },
        };
        Placed { form: &self.form, view }
    }
}

/// The shape of an agent at its start; `None` for one that nothing touches.
fn figure(member: &Member) -> Option<Figure> {
    let form = |kind| Form { kind, friction: 0.0, restitution: 0.0 };
    let (kind, place, low, high) = match &member.spec {
        Spec::Rigid(spec) => {
            let solid = SolidForm::new(spec.solid.clone(), DVec3::ZERO).ok()?;
            let (radius, at) = (DVec3::splat(solid.radius_m), spec.position);
            (FormKind::Solid(solid), Pose::Solid(at, spec.rotation.normalize()), at - radius, at + radius)
        }
        Spec::Tube(spec) => {
            let mut start = Snapshot::default();
            Tube::new(spec.clone()).ok()?.write_snapshot(&mut start);
            let Body::Curve(curve) = start.body else { return None };
            let radius = DVec3::splat(curve.radii_m.iter().copied().fold(0.0, f64::max));
            let low = curve.positions.iter().copied().reduce(DVec3::min)? - radius;
            let high = curve.positions.iter().copied().reduce(DVec3::max)? + radius;
            // where it is held is no matter of places
            (FormKind::Chain { held_ends: 0 }, Pose::Chain(curve), low, high)
        }
        Spec::Soft(spec) => {
            let body = SoftBody::new(spec.clone()).ok()?;
            let Body::Soft(soft) = body.start() else { return None };
            let low = soft.positions.iter().copied().reduce(DVec3::min)?;
            let high = soft.positions.iter().copied().reduce(DVec3::max)?;
            let kind = body.form()?.kind.clone();
            (kind, Pose::Soft(soft), low, high)
        }
        Spec::Instrument(spec) => {
            let (key, shape) = (spec.keyframes.first()?, ToolShape::default());
            let reach = DVec3::splat(shape.shaft_length_m + TOOL_TIP_RADII * shape.shaft_radius_m);
            (FormKind::Tool(shape), Pose::Tool(key.tip_m, key.rotation, key.jaw), key.tip_m - reach, key.tip_m + reach)
        }
        Spec::Synthetic(_) => return None,
    };
    Some(Figure { id: member.id, form: form(kind), place, low, high })
}

/// Nothing of a tool is farther from its tip than its shaft is long and this many shaft radii.
const TOOL_TIP_RADII: f64 = 12.0;
