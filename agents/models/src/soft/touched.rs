//! Where a solid in a cage was touched lately, and when its cells are halved there and whole again.
//!
//! In: places of its skin that contacts, grasps and springs act on, the spans of its steps. Out: the points about which its cells are to be
//! halved. Never here: the cells, how the state moves to others. Theory: docs/theory/soft.md, section 12.

use super::body::SoftBody;
use super::carrier::Carrier;
use glam::DVec3;
use metachron_core::Anchor;
use metachron_geometry::Place;

/// How long cells stay halved after they were touched last, and how long the division stays the same at least, seconds of simulated time.
const HALVED_S: f64 = 1.0;
const DIVIDED_S: f64 = 0.25;

/// Touches of a solid within the last second.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Touches {
    /// One for each place of its cage, by their first touch.
    lately: Vec<Touched>,
    /// The points about which its cells are halved, material coordinates, metres.
    pub halved_m: Vec<DVec3>,
    /// For how long its cells have been the same, seconds.
    divided_s: f64,
}

#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct Touched {
    /// Material coordinates, metres.
    at_m: DVec3,
    /// How long ago, seconds.
    ago_s: f64,
}

impl Touches {
    /// Lets time pass.
    fn pass(&mut self, h_s: f64) {
        self.lately.iter_mut().for_each(|touched| touched.ago_s += h_s);
        self.lately.retain(|touched| touched.ago_s < HALVED_S);
        self.divided_s += h_s;
    }
}

impl SoftBody {
    /// Notes that a step of `h_s` seconds has passed, in which these places of its skin were pressed.
    pub(super) fn note_pressed(&mut self, pressed: &[Place], h_s: f64) {
        if self.spec.eps_touched_m.is_none() {
            return;
        }
        self.touches.pass(h_s);
        for place in pressed {
            if let Place::Surface { vertices, shares } = *place {
                self.touch(vertices, shares);
            }
        }
    }

    /// Notes that a spring or a grasp holds it.
    pub(super) fn note_held(&mut self, anchor: Anchor) {
        let Anchor::Vertex(vertex) = anchor else { return };
        if (vertex as usize) < self.seen().len() {
            self.touch([vertex; 3], [1.0, 0.0, 0.0]);
        }
    }

    fn touch(&mut self, vertices: [u32; 3], shares: [f64; 3]) {
        let Some((skin, Carrier::Cage(cage))) = self.skin.as_ref().map(|skin| (skin, &skin.carrier)) else { return };
        let (at_m, _) = skin.material_at(vertices, shares);
        let place = cage.place_at(at_m);
        match self.touches.lately.iter_mut().find(|touched| cage.place_at(touched.at_m) == place) {
            Some(touched) => touched.ago_s = 0.0,
            None => self.touches.lately.push(Touched { at_m, ago_s: 0.0 }),
        }
    }

    /// Halves cells where it is touched, and makes those whole again that were not for a while; nothing where cells were removed.
    pub(super) fn divide_where_touched(&mut self) {
        let may_change = self.spec.eps_touched_m.is_some() && self.gone.is_empty();
        let Some(skin) = self.skin.as_ref().filter(|_| may_change && self.touches.divided_s >= DIVIDED_S) else {
            return;
        };
        let halved_m: Vec<DVec3> = self.touches.lately.iter().map(|touched| touched.at_m).collect();
        if skin.carrier.is_as_wanted(&self.spec, self.eps_m, &halved_m) {
            return;
        }
        self.touches.divided_s = 0.0;
        // with too many nodes it stays as it is
        if let Some(carrier) = Carrier::new(&self.spec, self.eps_m, &halved_m) {
            self.touches.halved_m = halved_m;
            self.move_onto(carrier);
        }
    }
}
