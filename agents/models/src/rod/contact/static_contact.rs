//! Contacts of a tube with fixed solids.
//!
//! In: the skin of a tube. Out: touching nodes and spans. A distant node is not measured again until it has moved that distance
//! (eq. 19). Never here: forces. Theory: `docs/theory/contact.md`.

use super::Skin;
use super::initial_overlap::Bores;
use glam::DVec3;
use metachron_geometry::signed_distance::Touch;
use metachron_geometry::signed_distance::{Ball, Field};
use metachron_geometry::{Obstacle, ShapeError};

/// How much farther than needed a mesh is searched, as a share of the radius: a node found far away can be skipped for longer.
const SEARCH_RADII: f64 = 1.0;

/// All fixed solids around a tube.
#[derive(Debug, Clone, Default)]
pub(super) struct Walls {
    walls: Vec<Wall>,
    /// Distance that the fastest node has moved, summed over steps, plus any widening of the tube; non-decreasing.
    travel_m: f64,
    last: Vec<DVec3>,
    last_radius_m: f64,
    /// Whether the parts that start through a solid have been searched.
    begun: bool,
}

/// One fixed solid, and how near each node was when last measured.
#[derive(Debug, Clone)]
struct Wall {
    field: Field,
    friction: f64,
    /// Each node: a lower bound of its gap and the travel at which it was measured. Reset after re-meshing.
    nodes: Vec<(f64, f64)>,
    /// Each node: the nearest point found by its last measurement, if any.
    near: Vec<Option<Touch>>,
    /// A lower bound of the gap of all nodes and spans, and the travel at which it was measured.
    clear: (f64, f64),
    /// The parts of the tube that pass through.
    bores: Bores,
}

/// How far from the skin walls are searched.
#[derive(Debug, Clone, Copy)]
struct SearchRange {
    /// The gap at the end of the step from which on a place counts as a contact, metres.
    slack_m: f64,
    /// The distance of the surfaces within which a wall is searched now, metres.
    reach_m: f64,
}

/// A node or a place inside a segment that touches a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WallTouch {
    /// Number of the wall.
    pub wall: u32,
    /// Number of the node, or of the segment.
    pub index: u32,
    /// The share of the segment, for a place inside one.
    pub share: Option<f64>,
    /// Index among the places of a node, from 0.
    pub place: u32,
    /// Unit normal, out of the wall.
    pub normal: DVec3,
    /// Distance of the surfaces, metres.
    pub gap_m: f64,
    /// Radius of the tube there, metres.
    pub radius_m: f64,
    /// Friction of the wall.
    pub friction: f64,
}

impl Walls {
    /// The fields of `obstacles`.
    ///
    /// # Errors
    /// [`ShapeError`] for a solid that has no shape.
    pub fn new(obstacles: &[Obstacle]) -> Result<Self, ShapeError> {
        let wall = |obstacle: &Obstacle| {
            let field = Field::new(obstacle)?;
            Ok(Wall {
                field,
                friction: obstacle.friction,
                nodes: vec![],
                near: vec![],
                clear: (f64::NEG_INFINITY, 0.0),
                bores: Bores::default(),
            })
        };
        let walls = obstacles.iter().map(wall).collect::<Result<_, ShapeError>>()?;
        Ok(Self { walls, ..Self::default() })
    }

    /// Whether there are no walls.
    pub fn is_empty(&self) -> bool {
        self.walls.is_empty()
    }

    /// Discards all measurements: the tube was divided anew.
    pub fn forget(&mut self) {
        self.last.clear();
    }

    /// Visits every place that may come within `slack_m` of a wall during the step, in a fixed order.
    pub fn visit(&mut self, skin: &Skin<'_>, slack_m: f64, mut visit: impl FnMut(WallTouch)) {
        if self.walls.is_empty() {
            return;
        }
        self.begin(skin);
        self.follow(skin);
        let margin_m = slack_m + skin.speed() * skin.h_s;
        for (number, wall) in (0_u32..).zip(&mut self.walls) {
            let (clear_m, at_m) = wall.clear;
            if clear_m - (self.travel_m - at_m) > margin_m {
                continue;
            }
            wall.measure(skin, slack_m, self.travel_m, &mut |touch| visit(WallTouch { wall: number, ..touch }));
        }
    }

    /// Undoes the part of the nodes' latest displacements `ways`, which were unknown when the walls were measured, that leads into
    /// walls or deeper into them. `arc_m` and `radii_m` are those of the nodes.
    pub fn hold_back(
        &self,
        positions: &mut [DVec3],
        ways: impl Iterator<Item = DVec3>,
        arc_m: &[f64],
        radii_m: &[f64],
    ) {
        if self.last.len() != positions.len() || radii_m.len() != positions.len() {
            return;
        }
        for (node, way) in ways.enumerate() {
            let moved_m = positions[node].distance(self.last[node]);
            for wall in &self.walls {
                let (gap_m, at_m) = wall.nodes[node];
                let is_near = gap_m - (self.travel_m - at_m) <= moved_m;
                if is_near && !wall.bores.overlap(arc_m[node], arc_m[node]) {
                    wall.field.hold_back(&mut positions[node], way, radii_m[node]);
                }
            }
        }
    }

    /// Searches, once, the parts of a held tube that start through a solid; a free tube is pushed out as a whole.
    fn begin(&mut self, skin: &Skin<'_>) {
        if !std::mem::replace(&mut self.begun, true) && skin.held.contains(&true) {
            self.walls.iter_mut().for_each(|wall| wall.bores = Bores::new(skin, &wall.field));
        }
    }

    /// Accumulates the nodes' greatest displacement.
    fn follow(&mut self, skin: &Skin<'_>) {
        let widest = skin.widest_m();
        if self.last.len() == skin.positions.len() {
            let moves = skin.positions.iter().zip(&self.last).map(|(now, last)| now.distance_squared(*last));
            self.travel_m += moves.fold(0.0, f64::max).sqrt() + (widest - self.last_radius_m).max(0.0);
        } else {
            for wall in &mut self.walls {
                wall.nodes.clear();
                wall.nodes.resize(skin.positions.len(), (f64::NEG_INFINITY, 0.0));
                wall.near.clear();
                wall.near.resize(skin.positions.len(), None);
                wall.clear = (f64::NEG_INFINITY, 0.0);
            }
        }
        self.last.clear();
        self.last.extend_from_slice(skin.positions);
        self.last_radius_m = widest;
    }
}

impl Wall {
    /// Measures the nodes that may be near, then the spans that may be nearer than their nodes.
    fn measure(&mut self, skin: &Skin<'_>, slack_m: f64, travel_m: f64, visit: &mut impl FnMut(WallTouch)) {
        let search_m = SEARCH_RADII * skin.widest_m();
        if !self.bores.is_empty() {
            self.bores.leave(skin, &self.field);
        }
        for node in 0..skin.positions.len() {
            let margin_m = slack_m + skin.velocity(node).length() * skin.h_s;
            let (gap_m, at_m) = self.nodes[node];
            if gap_m - (travel_m - at_m) <= margin_m {
                self.measure_node(skin, node, SearchRange { slack_m, reach_m: margin_m + search_m }, visit);
                self.nodes[node].1 = travel_m;
            }
        }
        let mut clear_m = f64::INFINITY;
        for segment in 0..skin.segments() {
            let bound = |node: usize| self.nodes[node].0 - (travel_m - self.nodes[node].1);
            let (left, right) = (bound(segment), bound(segment + 1));
            let span_m = 0.5 * (left + right - skin.length(segment) - skin.taper(segment));
            clear_m = clear_m.min(span_m).min(left).min(right);
            let margin_m = slack_m + skin.span_speed(segment) * skin.h_s;
            if span_m <= margin_m && self.field.needs_span_tests() {
                self.measure_span(skin, segment, SearchRange { slack_m, reach_m: margin_m }, visit);
            }
        }
        self.clear = (clear_m, travel_m);
    }

    fn measure_node(&mut self, skin: &Skin<'_>, node: usize, range: SearchRange, visit: &mut impl FnMut(WallTouch)) {
        let SearchRange { slack_m, reach_m } = range;
        let ball = skin.ball(node);
        let touches = self.field.touches(ball.centre, ball.radius_m + reach_m);
        let way = skin.velocity(node) * skin.h_s;
        self.near[node] = touches.iter().next();
        self.nodes[node].0 = touches.clear_m - ball.radius_m;
        if skin.is_held(node) || self.bores.overlap(skin.arc_m[node], skin.arc_m[node]) {
            return;
        }
        for (place, touch) in (0_u32..).zip(touches.iter()) {
            let gap_m = touch.distance_m - ball.radius_m;
            if gap_m + way.dot(touch.normal) > slack_m || (gap_m > slack_m && self.field.is_missed(ball, way, slack_m))
            {
                continue;
            }
            visit(WallTouch { place, ..self.touch(node, None, touch, ball.radius_m) });
        }
    }

    fn measure_span(&self, skin: &Skin<'_>, segment: usize, range: SearchRange, visit: &mut impl FnMut(WallTouch)) {
        let SearchRange { slack_m, reach_m } = range;
        let ends = [skin.ball(segment), skin.ball(segment + 1)];
        if self.bores.overlap(skin.arc_m[segment], skin.arc_m[segment + 1]) {
            return;
        }
        let Some((share, touch)) = self.field.touches_span(ends, reach_m) else { return };
        let ball = ends[0].toward(ends[1], share);
        let way = skin.velocity(segment).lerp(skin.velocity(segment + 1), share) * skin.h_s;
        let gap_m = touch.distance_m - ball.radius_m;
        let hidden = [segment, segment + 1].iter().any(|&node| self.hides(skin, node, ball, touch));
        if gap_m + way.dot(touch.normal) <= slack_m && !hidden {
            visit(self.touch(segment, Some(share), touch, ball.radius_m));
        }
    }

    /// Whether the place at which a span touches is hidden by a place that one of its nodes touches already (eq. 13).
    fn hides(&self, skin: &Skin<'_>, node: usize, ball: Ball, touch: Touch) -> bool {
        self.near[node].is_some_and(|near| near.hides(skin.ball(node), ball, touch))
    }

    /// A touch of a wall that is still without its number, at the first place of its node or segment.
    fn touch(&self, index: usize, share: Option<f64>, touch: Touch, radius_m: f64) -> WallTouch {
        WallTouch {
            wall: 0,
            index: index as u32,
            share,
            place: 0,
            normal: touch.normal,
            gap_m: touch.distance_m - radius_m,
            radius_m,
            friction: self.friction,
        }
    }
}
