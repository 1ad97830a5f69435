//! Objects that a scene repeats on a grid: how many, where, and under which names.
//!
//! In: the common keys of one object. Out: [`Copies`]. Never here: what the object is.

use super::POSITION_MAX_M;
use crate::check::{Checker, Place, allowed};
use crate::format::{CommonFile, OneOrEach};
use glam::DVec3;
use metachron_core::AgentId;
use metachron_world::{Member, Spec};

/// Most objects along one side of a grid.
const SIDE_MAX: u32 = 1000;
/// Greatest spacing of neighbours in a grid, and greatest random displacement, metres.
const SPACING_MAX_M: f64 = 1e4;

/// Offsets of the copies of one object from the object's own position, metres.
#[derive(Debug, Clone)]
pub(super) struct Copies {
    offsets_m: Vec<DVec3>,
    numbered: bool,
}

impl Copies {
    /// The object itself and no other.
    pub(super) fn single() -> Self {
        Self { offsets_m: vec![DVec3::ZERO], numbered: false }
    }

    pub(super) fn len(&self) -> usize {
        self.offsets_m.len()
    }

    /// The name of every copy.
    pub(super) fn names<'a>(&'a self, name: &'a str) -> impl Iterator<Item = String> + 'a {
        (0..self.len()).map(move |k| if self.numbered { format!("{name}-{k}") } else { name.to_owned() })
    }

    /// Every copy of `member`, which is the first; ids count up from its own.
    pub(super) fn members<'a>(&'a self, member: &'a Member) -> impl Iterator<Item = Member> + 'a {
        let names = self.names(&member.name);
        (member.id.0..).zip(names).zip(&self.offsets_m).map(|((id, name), offset)| {
            let spec = moved(member.spec.clone(), *offset);
            Member { id: AgentId(id), name, spec, ..member.clone() }
        })
    }

    /// The offset and the name of every copy.
    pub(super) fn places<'a>(&'a self, name: &'a str) -> impl Iterator<Item = (DVec3, String)> + 'a {
        self.offsets_m.iter().copied().zip(self.names(name))
    }
}

fn moved(spec: Spec, by: DVec3) -> Spec {
    match spec {
        Spec::Rigid(mut body) => {
            body.position += by;
            Spec::Rigid(body)
        }
        Spec::Tube(mut tube) => {
            tube.path_m.iter_mut().for_each(|point| *point += by);
            Spec::Tube(tube)
        }
        Spec::Soft(mut soft) => {
            soft.position += by;
            Spec::Soft(soft)
        }
        other => other,
    }
}

/// Reads the copies of an object; `can_move` says whether its model has a position of its own, `most` how many there may be.
pub(super) fn copies(
    c: &mut Checker<'_, '_>,
    place: &Place,
    common: &CommonFile,
    can_move: bool,
    most: usize,
) -> Copies {
    let Some(grid) = common.grid else {
        let scatter = common.scatter_m.is_some();
        let strays = [
            ("spacing_m", common.spacing_m.is_some()),
            ("rise_m", common.rise_m.is_some()),
            ("scatter_m", scatter),
            ("scatter_seed", common.scatter_seed.is_some()),
        ];
        for (key, _) in strays.into_iter().filter(|(_, given)| *given) {
            c.wrong(place, key, "has no effect without a grid", "expected `grid = [x, y, z]` beside it");
        }
        return Copies::single();
    };
    if !can_move {
        c.wrong(
            place,
            "grid",
            "repeats a tool or a synthetic agent, which has no position to offset",
            "expected no `grid` for this model",
        );
        return Copies::single();
    }
    let count = grid.iter().map(|n| u64::from(*n)).product::<u64>();
    if grid.iter().any(|n| !(1..=SIDE_MAX).contains(n)) || count > most as u64 {
        let expected = format!("expected at most {most} in all, 1 … {SIDE_MAX} along each axis");
        c.wrong(place, "grid", format_args!("makes {count} objects"), expected);
        return Copies::single();
    }
    let Some(spacing) = common.spacing_m else {
        c.wrong(place, "spacing_m", "is missing", "expected `spacing_m = [x, y, z]` beside `grid`");
        return Copies::single();
    };
    let spacing = c.point(place, "spacing_m", spacing, SPACING_MAX_M);
    let mut most = |value: f64| c.number(place, "scatter_m", value, &allowed(0.0..=SPACING_MAX_M, "m"));
    let scatter_m = match common.scatter_m {
        None => DVec3::ZERO,
        Some(OneOrEach::One(value)) => DVec3::splat(most(value)),
        Some(OneOrEach::Each(values)) => DVec3::from(values.map(most)),
    };
    let seed = u64::from(common.scatter_seed.unwrap_or(0));
    let [rise_x, rise_y] = common.rise_m.unwrap_or_default();
    let rise = c.point(place, "rise_m", [rise_x, rise_y, 0.0], SPACING_MAX_M);
    let at = |k: u32| {
        let steps = DVec3::from(grid_place(grid, k));
        steps * spacing + DVec3::Z * rise.dot(steps) + scatter_m * random_cube(seed, k)
    };
    let offsets_m: Vec<DVec3> = (0..count as u32).map(at).collect();
    if offsets_m.iter().any(|o| o.abs().max_element() > POSITION_MAX_M) {
        let expected = format!("expected a grid that ends within {POSITION_MAX_M} m");
        c.wrong(place, "spacing_m", "places objects too far away", expected);
        return Copies::single();
    }
    Copies { offsets_m, numbered: true }
}

/// Grid coordinates of copy `k`, counted along x, then y, then z.
fn grid_place([x, y, _]: [u32; 3], k: u32) -> [f64; 3] {
    [k % x, k / x % y, k / (x * y)].map(f64::from)
}

/// A pseudo-random point of the cube from −1 to 1, the same for the same seed and number.
fn random_cube(seed: u64, number: u32) -> DVec3 {
    let mut state = seed << 32 | u64::from(number);
    DVec3::from_array(std::array::from_fn(|_| {
        // SplitMix64 (Steele, Lea, Flood 2014): one state per coordinate
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 * (2.0 / (1_u64 << 53) as f64) - 1.0
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_of_a_grid_are_numbered_along_x_first() {
        let places: Vec<_> = (0..12).map(|k| grid_place([2, 3, 2], k)).collect();
        assert_eq!(places[1], [1.0, 0.0, 0.0]);
        assert_eq!(places[2], [0.0, 1.0, 0.0]);
        assert_eq!(places[6], [0.0, 0.0, 1.0]);
        assert_eq!(places[11], [1.0, 2.0, 1.0]);
    }

    #[test]
    fn random_distances_fill_the_cube_and_depend_on_the_seed() {
        let all: Vec<_> = (0..4000).map(|k| random_cube(7, k)).collect();
        let mean = all.iter().sum::<DVec3>() / 4000.0;
        let square = all.iter().map(|p| *p * *p).sum::<DVec3>() / 4000.0;
        // uniform on −1 … 1: mean 0, mean square 1/3; four standard errors of 4000 draws
        assert!(mean.abs().max_element() < 4.0 * (1.0 / 3.0_f64).sqrt() / 4000.0_f64.sqrt(), "{mean}");
        assert!(
            (square - 1.0 / 3.0).abs().max_element() < 4.0 * (4.0 / 45.0_f64).sqrt() / 4000.0_f64.sqrt(),
            "{square}"
        );
        assert!(all.iter().all(|p| p.abs().max_element() <= 1.0));
        assert_ne!(random_cube(7, 3), random_cube(8, 3));
    }
}
