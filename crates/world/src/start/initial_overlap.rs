//! Moves deformables and tools that would start inside another object clear of it, before the run.
//!
//! In: a scene as it is written. Out: the same scene in which free deformables start clear of all other objects, and tools clear of all
//! that they do not grasp; the list of moved agents.
//! Never here: running agents, rigid bodies inside each other (contact separates them during the run without adding speed).
//!
//! Pushed out during the run, a deformable would be stretched and bent on its way, and spring back: a tube through a block of twice
//! its width would leave at metres per second. Moved as a whole before the run, it stores no energy.
//! The parts of a tool deep inside a light box would push the box in different directions, each with the full force of the drive. Drawn
//! back along its shaft, the tool enters as it would from outside.

use super::initial_shape::{StartShape, shape};
use super::overlap::{Container, OVERLAP_MIN_M};
use crate::description::couplings::{Coupling, CouplingKind};
use crate::description::placement::Moved;
use crate::description::scene::{Scene, Spec};
use glam::DVec3;
use metachron_core::AgentId;
use metachron_geometry::Touch;
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
use std::collections::BTreeSet;

/// A later direction must be shorter than the best so far by more than this, metres: of equal ones the first is taken.
const TIE_M: f64 = 1e-6;
/// Normals whose cosine is above this count as one direction.
const SAME_DIRECTION: f64 = 0.999;
/// Most directions tried.
const DIRECTIONS_MAX: usize = 16;
/// Most positions tried along each direction.
const POSITIONS_MAX: usize = 64;
/// Directions tried first. Up leads, so it wins a tie: an object without room goes on top.
const AXES: [DVec3; 6] = [DVec3::Z, DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::NEG_Z];

impl Scene {
    /// Finds objects that start inside each other and moves those apart that can be moved without strain; fills
    /// [`Scene::overlaps`] and [`Scene::moved`].
    pub fn resolve_initial_overlaps(&mut self) {
        let inside = self.find_overlaps();
        self.overlaps = self.overlaps_by_name(&inside);
        self.move_apart(&inside);
    }

    /// Moves every free deformable out of the objects that it starts inside, along the shortest way that leaves it clear of all; of two
    /// deformables the later one. A free rigid body is moved out of a deformable that is held, a tool out of all that it does not grasp.
    /// Where there is no such way, nothing is moved.
    pub(super) fn move_apart(&mut self, inside: &[(AgentId, Container, f64)]) {
        let pairs: Vec<_> = inside.iter().map(|(a, b, _)| self.movers(*a, *b)).filter(|all| !all.is_empty()).collect();
        if pairs.is_empty() {
            return;
        }
        let mut shapes: Vec<StartShape> = self.agents.iter().filter_map(shape).collect();
        let movers: BTreeSet<AgentId> = pairs.iter().filter_map(|all| self.nearest_exit(all, &shapes)).collect();
        for mover in movers {
            let Some(at) = shapes.iter().position(|shape| shape.id == mover) else { continue };
            let Some(by_m) = self.shortest_exit(&shapes[at], &shapes) else { continue };
            shapes[at] = shapes[at].shifted(by_m);
            let member = &mut self.agents[mover.0 as usize];
            match &mut member.spec {
                Spec::Tube(tube) => tube.path_m.iter_mut().for_each(|point| *point += by_m),
                Spec::Soft(soft) => soft.position += by_m,
                Spec::Rigid(body) => body.position += by_m,
                Spec::Tool(tool) => tool.starts_off_m += by_m,
                Spec::Synthetic(_) | Spec::Custom(_) => {}
            }
            self.moved.push(Moved { object: member.name.clone(), by_m });
        }
    }

    /// The agents of a pair that may be moved.
    fn movers(&self, a: AgentId, b: Container) -> Vec<AgentId> {
        let bends = |id: AgentId| matches!(self.agents[id.0 as usize].spec, Spec::Tube(_) | Spec::Soft(_));
        let loose = |id: &AgentId| bends(*id) && self.is_free(*id);
        match b {
            Container::Fixed(_) => Some(a).filter(loose).into_iter().collect(),
            Container::Agent(b) if self.is_led(a) || self.is_led(b) => {
                let (tool, other) = if self.is_led(a) { (a, b) } else { (b, a) };
                let may_retract = self.may_retract(tool, other);
                [tool, other].into_iter().filter(|id| may_retract && (*id == tool || loose(id))).collect()
            }
            Container::Agent(b) if !(bends(a) || bends(b)) => vec![],
            Container::Agent(b) => {
                let rigid = || [b, a].into_iter().find(|id| !bends(*id) && self.is_free(*id));
                [b, a].into_iter().find(loose).or_else(rigid).into_iter().collect()
            }
        }
    }

    /// The agent of `all` with the shortest way out of everything.
    fn nearest_exit(&self, all: &[AgentId], shapes: &[StartShape]) -> Option<AgentId> {
        if let [one] = all {
            return Some(*one);
        }
        let way_m = |id: AgentId| {
            let shape = shapes.iter().find(|shape| shape.id == id)?;
            Some((self.shortest_exit(shape, shapes)?.length(), id))
        };
        let ways = all.iter().filter_map(|id| way_m(*id));
        ways.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, id)| id)
    }

    fn is_led(&self, id: AgentId) -> bool {
        matches!(self.agents[id.0 as usize].spec, Spec::Tool(_))
    }

    /// Whether a tool may be drawn back out of `other`: it does not grasp it, and no attachment holds the tool.
    fn may_retract(&self, tool: AgentId, other: AgentId) -> bool {
        let Spec::Tool(spec) = &self.agents[tool.0 as usize].spec else { return false };
        let linked = |c: &Coupling| matches!(c.kind, CouplingKind::Attach { .. }) && (c.a == tool || c.b == tool);
        !(spec.graspable.contains(&other) || self.couplings.iter().any(linked))
    }

    /// Whether an agent is free: it has no joint, attachment, clamp, pin or held points, and is no tool, not kinematic and not synthetic.
    pub(crate) fn is_free(&self, id: AgentId) -> bool {
        let jointed = self.joints.iter().any(|joint| joint.a == id || joint.b == Some(id));
        let tied = |kind: &CouplingKind| matches!(kind, CouplingKind::Attach { .. });
        let attached = self.couplings.iter().any(|c| tied(&c.kind) && (c.a == id || c.b == id));
        let held = match &self.agents[id.0 as usize].spec {
            Spec::Tube(tube) => [tube.clamp, tube.pin].concat().contains(&true) || !tube.attachments.is_empty(),
            Spec::Soft(soft) => !soft.held.is_empty(),
            Spec::Rigid(body) => body.led.is_some(),
            Spec::Tool(_) | Spec::Synthetic(_) | Spec::Custom(_) => true,
        };
        !(jointed || attached || held)
    }

    /// The shortest displacement that takes `shape` clear of everything it touches; for a tool, back along its shaft if that leads out.
    fn shortest_exit(&self, shape: &StartShape, shapes: &[StartShape]) -> Option<DVec3> {
        let mut search =
            OverlapSearch { scene: self, shapes, apart: self.pairs_apart(), scratch: NarrowPhaseScratch::default() };
        let back = shape.shaft_direction();
        if let Some(way) = back
            && let Some(far_m) = search.clear(shape, way, f64::INFINITY)
        {
            return Some(way * far_m);
        }
        let mut ways = AXES.to_vec();
        search.deepest(shape, |touch| {
            if ways.len() < DIRECTIONS_MAX && ways.iter().all(|way| way.dot(touch.normal) < SAME_DIRECTION) {
                ways.push(touch.normal);
            }
        });
        let mut best: Option<DVec3> = None;
        for way in ways {
            let most_m = best.map_or(f64::INFINITY, |best| best.length() - TIE_M);
            best = search.clear(shape, way, most_m).map(|far_m| way * far_m).or(best);
        }
        best
    }
}

/// The objects that an agent may be inside of.
struct OverlapSearch<'a> {
    scene: &'a Scene,
    shapes: &'a [StartShape],
    apart: BTreeSet<(AgentId, AgentId)>,
    scratch: NarrowPhaseScratch,
}

impl OverlapSearch<'_> {
    /// How far `shape` has to move along `way` to be clear, metres; `None` if that is `most_m` or more.
    ///
    /// It cannot be clear before it has moved as far as it is deep, so it moves by its depth and is tested again.
    fn clear(&mut self, shape: &StartShape, way: DVec3, most_m: f64) -> Option<f64> {
        let mut far_m = 0.0;
        for _ in 0..POSITIONS_MAX {
            let deep_m = self.deepest(&shape.shifted(way * far_m), |_| {});
            if deep_m < OVERLAP_MIN_M {
                return Some(far_m);
            }
            far_m += deep_m + OVERLAP_MIN_M;
            if far_m >= most_m {
                return None;
            }
        }
        None
    }

    /// Depth of `shape` in any other object, metres, ≥ 0; calls `visit` with every touch.
    fn deepest(&mut self, shape: &StartShape, mut visit: impl FnMut(&Touch)) -> f64 {
        let (mut found, mut deep_m) = (Vec::new(), 0.0_f64);
        let mut look = |other: &StartShape, scratch: &mut NarrowPhaseScratch| {
            touches(&shape.placed(), &other.placed(), 0.0, scratch, &mut found);
            for touch in &found {
                deep_m = deep_m.max(-touch.gap_m);
                visit(touch);
            }
        };
        let others = self.shapes.iter().filter(|other| other.id != shape.id && shape.box_touches(other, 0.0));
        for other in others.filter(|other| self.scene.collide(shape, other, &self.apart)) {
            look(other, &mut self.scratch);
        }
        // a tool passes through static solids
        for obstacle in self.scene.obstacles.iter().filter(|_| shape.shaft_direction().is_none()) {
            if let Some(fixed) = shape.obstacle_shape(obstacle).filter(|fixed| shape.form.presses(&fixed.form)) {
                look(&fixed, &mut self.scratch);
            }
        }
        deep_m
    }
}
