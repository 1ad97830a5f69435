//! Sets what bends beside what it would start inside.
//!
//! In: a scene as it is written. Out: the same scene in which loose agents that bend start clear of all others; who was moved.
//! Never here: running agents, rigid bodies inside each other (they come apart while they run, and gain no speed by it).
//!
//! Pushed out while it runs, what bends would be stretched and bent on its way, and spring back: a tube through a block of twice
//! its width would leave at metres a second. Moved as a whole before anything runs, it holds no energy.

use super::cast::{Scene, Spec};
use super::figure::{Figure, figure};
use super::overlap::{Inside, OVERLAP_MIN_M};
use super::ties::CouplingKind;
use glam::DVec3;
use metachron_agents::AgentId;
use metachron_agents::coupling::Touch;
use metachron_agents::coupling::touch::{TouchRoom, touches};
use std::collections::BTreeSet;

/// An agent that starts elsewhere than the scene puts it, because there it would be inside another.
#[derive(Debug, Clone, PartialEq)]
pub struct Moved {
    /// Its name.
    pub object: String,
    /// From where the scene puts it to where it starts, metres.
    pub by_m: DVec3,
}

/// Directions of which one is as good as another, metres: the first is taken.
const ALIKE_M: f64 = 1e-6;
/// Normals whose cosine is above this are one direction.
const SAME_WAY: f64 = 0.999;
/// Directions tried, at most.
const WAYS: usize = 16;
/// Places tried along each, at most.
const PLACES: usize = 64;
/// Up first: that is where a thing is put that has no room.
const AXES: [DVec3; 6] = [DVec3::Z, DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::NEG_Z];

impl Scene {
    /// Moves every loose agent that bends out of what it is inside, the shortest way that leaves it clear of all; of two that
    /// bend the later one. A loose rigid body is moved out of what bends and is held. Where there is no such way, nothing is moved.
    pub(super) fn set_apart(&mut self, inside: &[(AgentId, Inside, f64)]) {
        let movers: BTreeSet<AgentId> = inside.iter().filter_map(|(a, b, _)| self.mover(*a, *b)).collect();
        if movers.is_empty() {
            return;
        }
        let mut figures: Vec<Figure> = self.agents.iter().filter_map(figure).collect();
        for mover in movers {
            let Some(at) = figures.iter().position(|figure| figure.id == mover) else { continue };
            let Some(by_m) = self.way_out(&figures[at], &figures) else { continue };
            figures[at] = figures[at].shifted(by_m);
            let member = &mut self.agents[mover.0 as usize];
            match &mut member.spec {
                Spec::Tube(tube) => tube.path_m.iter_mut().for_each(|point| *point += by_m),
                Spec::Soft(soft) => soft.position += by_m,
                Spec::Rigid(body) => body.position += by_m,
                Spec::Instrument(_) | Spec::Synthetic(_) => {}
            }
            self.moved.push(Moved { object: member.name.clone(), by_m });
        }
    }

    /// Who of two is moved, if anybody.
    fn mover(&self, a: AgentId, b: Inside) -> Option<AgentId> {
        let bends = |id: AgentId| matches!(self.agents[id.0 as usize].spec, Spec::Tube(_) | Spec::Soft(_));
        let led = |id: AgentId| matches!(self.agents[id.0 as usize].spec, Spec::Instrument(_));
        match b {
            Inside::Fixed(_) => Some(a).filter(|a| bends(*a) && self.is_loose(*a)),
            Inside::Agent(b) if led(a) || led(b) || !(bends(a) || bends(b)) => None,
            Inside::Agent(b) => {
                let loose = |bending: bool| [b, a].into_iter().find(|id| bends(*id) == bending && self.is_loose(*id));
                loose(true).or_else(|| loose(false))
            }
        }
    }

    /// Whether nothing holds an agent where the scene puts it.
    pub(super) fn is_loose(&self, id: AgentId) -> bool {
        let jointed = self.joints.iter().any(|joint| joint.a == id || joint.b == Some(id));
        let tied = |kind: &CouplingKind| matches!(kind, CouplingKind::Attach { .. });
        let attached = self.couplings.iter().any(|c| tied(&c.kind) && (c.a == id || c.b == id));
        let held = match &self.agents[id.0 as usize].spec {
            Spec::Tube(tube) => [tube.clamp, tube.pin].concat().contains(&true) || !tube.attachments.is_empty(),
            Spec::Soft(soft) => !soft.held.is_empty(),
            Spec::Rigid(_) => false,
            Spec::Instrument(_) | Spec::Synthetic(_) => true,
        };
        !(jointed || attached || held)
    }

    /// The shortest way on which `figure` gets clear of everything that it touches.
    fn way_out(&self, figure: &Figure, figures: &[Figure]) -> Option<DVec3> {
        let mut around = Around { scene: self, figures, apart: self.pairs_apart(), room: TouchRoom::default() };
        let mut ways = AXES.to_vec();
        around.deepest(figure, |touch| {
            if ways.len() < WAYS && ways.iter().all(|way| way.dot(touch.normal) < SAME_WAY) {
                ways.push(touch.normal);
            }
        });
        let mut best: Option<DVec3> = None;
        for way in ways {
            let most_m = best.map_or(f64::INFINITY, |best| best.length() - ALIKE_M);
            best = around.clear(figure, way, most_m).map(|far_m| way * far_m).or(best);
        }
        best
    }
}

/// What an agent may be inside of.
struct Around<'a> {
    scene: &'a Scene,
    figures: &'a [Figure],
    apart: BTreeSet<(AgentId, AgentId)>,
    room: TouchRoom,
}

impl Around<'_> {
    /// How far `figure` has to go along `way` to be clear, metres; `None` from `most_m` on.
    ///
    /// Nowhere on the way is it clear before it has gone as far as it is deep: it goes so far and looks again.
    fn clear(&mut self, figure: &Figure, way: DVec3, most_m: f64) -> Option<f64> {
        let mut far_m = 0.0;
        for _ in 0..PLACES {
            let deep_m = self.deepest(&figure.shifted(way * far_m), |_| {});
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

    /// How deep `figure` is in anything, metres, ≥ 0; visits the places.
    fn deepest(&mut self, figure: &Figure, mut visit: impl FnMut(&Touch)) -> f64 {
        let (mut found, mut deep_m) = (Vec::new(), 0.0_f64);
        let mut look = |other: &Figure, room: &mut TouchRoom| {
            touches(&figure.placed(), &other.placed(), 0.0, room, &mut found);
            for touch in &found {
                deep_m = deep_m.max(-touch.gap_m);
                visit(touch);
            }
        };
        let others = self.figures.iter().filter(|other| other.id != figure.id && figure.meets(other, 0.0));
        for other in others.filter(|other| self.scene.touch(figure, other, &self.apart)) {
            look(other, &mut self.room);
        }
        for obstacle in self.scene.obstacles.iter() {
            if let Some(fixed) = figure.over(obstacle) {
                look(&fixed, &mut self.room);
            }
        }
        deep_m
    }
}
