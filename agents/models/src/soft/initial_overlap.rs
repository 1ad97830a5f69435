//! Soft bodies that start through a solid: every way out would tear them.
//!
//! In: the places where a body meets a solid. Out: the places that pass through without contact until they have left the solid.
//! Never here: contacts. Theory: `docs/theory/contact.md`, eq. 25.

use metachron_geometry::PARTED;
use metachron_geometry::{Place, Touch};

/// The vertices of a soft body that started inside one solid, pass through it and have not left it since, by rising number.
#[derive(Debug, Default)]
pub(super) struct PassingVertices {
    /// Whether the first places have been examined.
    begun: bool,
    through: Vec<u32>,
}

impl PassingVertices {
    /// Processes all places where a body meets the solid. A held body that starts deeper inside than `deep_m`, at places whose
    /// ways out diverge, passes through.
    pub fn update(&mut self, places: &[Touch], held: bool, deep_m: f64) {
        let begins = !std::mem::replace(&mut self.begun, true);
        if begins && held && is_parted(places, deep_m) {
            self.through = inside(places);
        } else if !self.through.is_empty() {
            let still = inside(places);
            self.through.retain(|vertex| still.binary_search(vertex).is_ok());
        }
    }

    /// Whether a place passes through.
    pub fn contains(&self, place: &Touch) -> bool {
        !self.through.is_empty() && vertices(place).any(|vertex| self.through.binary_search(&vertex).is_ok())
    }
}

/// Whether the deep places have no common way out.
fn is_parted(places: &[Touch], deep_m: f64) -> bool {
    let mut deep = places.iter().filter(|place| place.gap_m < -deep_m);
    let first = deep.next().map(|place| place.normal);
    first.is_some_and(|first| deep.any(|place| place.normal.dot(first) < PARTED))
}

fn inside(places: &[Touch]) -> Vec<u32> {
    let mut found: Vec<u32> = places.iter().filter(|place| place.gap_m < 0.0).flat_map(vertices).collect();
    found.sort_unstable();
    found.dedup();
    found
}

fn vertices(place: &Touch) -> impl Iterator<Item = u32> + use<> {
    let (vertices, shares) = match place.on_a {
        Place::Surface { vertices, shares } => (vertices, shares),
        Place::Point(_) | Place::Chain { .. } => ([0; 3], [0.0; 3]),
    };
    vertices.into_iter().zip(shares).filter(|(_, share)| *share != 0.0).map(|(vertex, _)| vertex)
}
