//! Where a soft body starts through a solid: there is no way out on which it would not be torn.
//!
//! In: where a body meets a solid. Out: which of its places pass through untouched, until they have left the solid.
//! Never here: contacts. Theory: `docs/theory/contact.md`, eq. 25.

use metachron_geometry::PARTED;
use metachron_geometry::{Place, Touch};

/// The vertices of a soft body that started through one solid and have not left it since, by rising number.
#[derive(Debug, Default)]
pub(super) struct Bores {
    /// Whether it is known where the body starts.
    begun: bool,
    through: Vec<u32>,
}

impl Bores {
    /// Takes all places where a body meets the solid. One that is held, and starts deeper inside than `deep_m` in places whose
    /// ways out part, passes through.
    pub fn follow(&mut self, places: &[Touch], held: bool, deep_m: f64) {
        let begins = !std::mem::replace(&mut self.begun, true);
        if begins && held && is_parted(places, deep_m) {
            self.through = inside(places);
        } else if !self.through.is_empty() {
            let still = inside(places);
            self.through.retain(|vertex| still.binary_search(vertex).is_ok());
        }
    }

    /// Whether a place passes through.
    pub fn pass(&self, place: &Touch) -> bool {
        !self.through.is_empty() && vertices(place).any(|vertex| self.through.binary_search(&vertex).is_ok())
    }
}

/// Whether those places that are deep inside have no way out in common.
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
