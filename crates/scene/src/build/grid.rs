//! Objects that a scene repeats on a grid: how many, where, how turned, and under which names.
//!
//! In: the common keys of one object. Out: [`Copies`]. Never here: the kind of object.

use super::POSITION_MAX_M;
use super::common::rotation;
use crate::check::{Checker, Place};
use crate::format::{CommonFile, OneOrEach};
use glam::{DQuat, DVec3};
use metachron_core::AgentId;
use metachron_world::{Member, Spec};

/// Most objects along one side of a grid.
const SIDE_MAX: u32 = 1000;

/// The copies of one object.
#[derive(Debug, Clone)]
pub(super) struct Copies {
    all: Vec<CopyPlace>,
    numbered: bool,
}

/// Where one copy of an object is, by the object itself.
#[derive(Debug, Clone, Copy)]
pub(super) struct CopyPlace {
    /// From the object's own position, metres, along the world's axes.
    pub(super) offset_m: DVec3,
    /// Beyond the object's own rotation, about the world's axes.
    pub(super) turn: DQuat,
}

/// The way in which a grid can repeat the objects of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Repeats {
    /// The model has no position of its own.
    Nothing,
    /// Its copies are moved.
    Moved,
    /// They may be turned as well.
    MovedAndTurned,
}

impl Copies {
    /// The object itself and no other.
    pub(super) fn single() -> Self {
        Self { all: vec![CopyPlace { offset_m: DVec3::ZERO, turn: DQuat::IDENTITY }], numbered: false }
    }

    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// The name of every copy.
    pub(super) fn names<'a>(&'a self, name: &'a str) -> impl Iterator<Item = String> + 'a {
        (0..self.len()).map(move |k| if self.numbered { format!("{name}-{k}") } else { name.to_owned() })
    }

    /// Every copy of `member`, which is the first; ids count up from its own.
    pub(super) fn members<'a>(&'a self, member: &'a Member) -> impl Iterator<Item = Member> + 'a {
        let names = self.names(&member.name);
        (member.id.0..).zip(names).zip(&self.all).map(|((id, name), place)| {
            let spec = placed(member.spec.clone(), place);
            Member { id: AgentId(id), name, spec, ..member.clone() }
        })
    }

    /// The place and the name of every copy.
    pub(super) fn places<'a>(&'a self, name: &'a str) -> impl Iterator<Item = (CopyPlace, String)> + 'a {
        self.all.iter().copied().zip(self.names(name))
    }
}

impl CopyPlace {
    /// A rotation of the object as its copy has it.
    pub(super) fn turned(self, rotation: DQuat) -> DQuat {
        // untouched bits where nothing turns
        if self.turn == DQuat::IDENTITY { rotation } else { (self.turn * rotation).normalize() }
    }
}

fn placed(spec: Spec, place: &CopyPlace) -> Spec {
    let by = place.offset_m;
    match spec {
        Spec::Rigid(mut body) => {
            body.shift(by);
            body.rotation = place.turned(body.rotation);
            let keys = body.led.iter_mut().flat_map(|led| &mut led.keyframes);
            keys.for_each(|key| key.rotation = place.turned(key.rotation));
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

/// Reads the copies of an object, of which there may be `most`.
pub(super) fn copies(
    c: &mut Checker<'_, '_>,
    place: &Place,
    common: &CommonFile,
    repeats: Repeats,
    most: usize,
) -> Copies {
    let Some(grid) = common.grid else {
        let keys = ["spacing_m", "rise_m", "scatter_m", "scatter_deg", "scatter_seed"];
        c.refuse(place, &keys, "has no effect without a grid", "expected `grid = [x, y, z]` beside it");
        return Copies::single();
    };
    if repeats == Repeats::Nothing {
        c.wrong(
            place,
            "grid",
            "repeats a tool or a synthetic agent, which has no position to offset",
            "expected no `grid` for this model",
        );
        return Copies::single();
    }
    let count = grid.iter().fold(1_u64, |count, n| count.saturating_mul(u64::from(*n)));
    if grid.iter().any(|n| !(1..=SIDE_MAX).contains(n)) || count > most as u64 {
        let expected = format!("expected at most {most} in all, 1 … {SIDE_MAX} along each axis");
        c.wrong(place, "grid", format_args!("makes {count} objects"), expected);
        return Copies::single();
    }
    let Some(spacing) = common.spacing_m else {
        c.wrong(place, "spacing_m", "is missing", "expected `spacing_m = [x, y, z]` beside `grid`");
        return Copies::single();
    };
    let ([rise_x, rise_y], spacing) = (common.rise_m.unwrap_or_default(), DVec3::from(spacing));
    let rise = DVec3::new(rise_x, rise_y, 0.0);
    let scatter = scatter(c, place, common, repeats);
    let at = |k: u32| {
        let (steps, random) = (DVec3::from(grid_place(grid, k)), random_cubes(scatter.seed, k));
        let offset_m = steps * spacing + DVec3::Z * rise.dot(steps) + scatter.reach_m * random[0];
        CopyPlace { offset_m, turn: rotation(Some((scatter.reach_deg * random[1]).into())) }
    };
    let all: Vec<CopyPlace> = (0..count as u32).map(at).collect();
    if all.iter().any(|copy| copy.offset_m.abs().max_element() > POSITION_MAX_M) {
        let expected = format!("expected a grid that ends within {POSITION_MAX_M} m");
        c.wrong(place, "spacing_m", "places objects too far away", expected);
        return Copies::single();
    }
    Copies { all, numbered: true }
}

/// How far copies stray at random from the places of their grid, to either side along and about each axis.
struct Scatter {
    reach_m: DVec3,
    reach_deg: DVec3,
    seed: u64,
}

fn scatter(c: &mut Checker<'_, '_>, place: &Place, common: &CommonFile, repeats: Repeats) -> Scatter {
    if common.scatter_deg.is_some() && repeats != Repeats::MovedAndTurned {
        c.wrong(place, "scatter_deg", "turns rigid bodies alone", "expected no `scatter_deg` for this model");
    }
    let [reach_m, reach_deg] = [common.scatter_m, common.scatter_deg].map(each);
    Scatter { reach_m, reach_deg, seed: u64::from(common.scatter_seed.unwrap_or(0)) }
}

/// One number for all axes, or one each; zero where none is given.
fn each(given: Option<OneOrEach>) -> DVec3 {
    match given {
        None => DVec3::ZERO,
        Some(OneOrEach::One(value)) => DVec3::splat(value),
        Some(OneOrEach::Each(values)) => values.into(),
    }
}

/// Grid coordinates of copy `k`, counted along x, then y, then z.
fn grid_place([x, y, _]: [u32; 3], k: u32) -> [f64; 3] {
    [k % x, k / x % y, k / (x * y)].map(f64::from)
}

/// Two pseudo-random points of the cube from −1 to 1, the same for the same seed and number.
fn random_cubes(seed: u64, number: u32) -> [DVec3; 2] {
    let mut state = seed << 32 | u64::from(number);
    let mut next = || {
        // SplitMix64 (Steele, Lea, Flood 2014): one state per coordinate
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 * (2.0 / (1_u64 << 53) as f64) - 1.0
    };
    [(); 2].map(|()| DVec3::new(next(), next(), next()))
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
        let both: Vec<_> = (0..4000).map(|k| random_cubes(7, k)).collect();
        for all in [0, 1].map(|which| both.iter().map(|points| points[which]).collect::<Vec<_>>()) {
            fills_the_cube(&all);
        }
        assert_ne!(random_cubes(7, 3), random_cubes(8, 3));
        // places and turns have nothing to do with each other: of two uniform numbers the mean product is 0, with variance 1/9
        let together = both.iter().map(|[a, b]| *a * *b).sum::<DVec3>() / 4000.0;
        assert!(together.abs().max_element() < 4.0 / (3.0 * 4000.0_f64.sqrt()), "{together}");
    }

    fn fills_the_cube(all: &[DVec3]) {
        let mean = all.iter().sum::<DVec3>() / 4000.0;
        let square = all.iter().map(|p| *p * *p).sum::<DVec3>() / 4000.0;
        // uniform on −1 … 1: mean 0, mean square 1/3; four standard errors of 4000 draws
        assert!(mean.abs().max_element() < 4.0 * (1.0 / 3.0_f64).sqrt() / 4000.0_f64.sqrt(), "{mean}");
        assert!(
            (square - 1.0 / 3.0).abs().max_element() < 4.0 * (4.0 / 45.0_f64).sqrt() / 4000.0_f64.sqrt(),
            "{square}"
        );
        assert!(all.iter().all(|p| p.abs().max_element() <= 1.0));
    }

    /// The turns of 27 copies of an object beyond its own, about the world's axis of each, radians.
    fn turns(keys: &str) -> Result<Vec<DVec3>, String> {
        let text = format!("format = 1\n[[object]]\nname = \"b\"\ngrid = [3, 3, 3]\nspacing_m = [1, 1, 1]\n{keys}");
        let source = crate::Source::memory("grid", text.as_bytes()).unwrap();
        let scene = crate::load(&source, &[]).map_err(|error| format!("{:?}", error.problems))?;
        let of = |member: &Member| match &member.spec {
            Spec::Rigid(body) => body.rotation.to_scaled_axis(),
            _ => DVec3::ZERO,
        };
        Ok(scene.agents.iter().map(of).collect())
    }

    #[test]
    fn copies_of_a_rigid_body_are_turned_at_random_as_far_as_asked() {
        let cube = "model = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.1, 0.1, 0.1]\n";
        let deg = 10.0_f64.to_radians();
        let about_z = turns(&format!("{cube}scatter_deg = [0, 0, 10]\nscatter_seed = 4")).unwrap();
        assert!(about_z.iter().all(|turn| turn.truncate().length() < 1e-15 && turn.z.abs() <= deg));
        // of 27 draws some are in each of the outer quarters
        assert!(about_z.iter().any(|turn| turn.z > 0.5 * deg) && about_z.iter().any(|turn| turn.z < -0.5 * deg));
        let other = turns(&format!("{cube}scatter_deg = [0, 0, 10]\nscatter_seed = 5")).unwrap();
        assert_ne!(about_z, other);
        assert!(turns(cube).unwrap().iter().all(|turn| *turn == DVec3::ZERO));
        let rope = "model = \"rope\"\npath_m = [[0, 0, 0], [0.1, 0, 0]]\nradius_m = 0.01\nsegments = 4\nyoung_pa = 1e5\nscatter_deg = 5";
        assert!(turns(rope).unwrap_err().contains("scatter_deg"));
    }
}
