//! Stacks of two to four bodies of nine kinds, drawn at random: no scene was chosen because it works.

use crate::bodies::{rigid, rope, sheet, solid, tube, turned};
use crate::table::{Placed, Table, placed};
use glam::{DQuat, DVec3};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};

/// Rates that a body of a mixed stack may have, Hz.
const RATES_HZ: [f64; 8] = [30.0, 60.0, 60.0, 100.0, 120.0, 240.0, 240.0, 500.0];

/// Numbers by SplitMix64.
pub struct Draw(u64);

impl Draw {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        low + (high - low) * ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn below(&mut self, count: usize) -> usize {
        (self.between(0.0, count as f64) as usize).min(count - 1)
    }

    /// A number whose logarithm is even between these.
    pub fn power(&mut self, low: f64, high: f64) -> f64 {
        libm::pow(10.0, self.between(low, high))
    }
}

/// The rates of a stack.
#[derive(Debug, Clone, Copy)]
pub enum Rates {
    Equal(f64),
    Mixed,
}

/// The stack of this number.
pub fn stack(seed: u64, rates: Rates) -> Table {
    let mut draw = Draw::new(seed);
    let count = 2 + draw.below(3);
    let mut height_m = 0.0;
    let mut bodies = vec![];
    for at in 0..count {
        height_m += if at == 0 { draw.between(0.001, 0.01) } else { draw.between(0.002, 0.03) };
        bodies.push(body(&mut draw, &mut height_m));
    }
    for body in &mut bodies {
        body.rate_hz = match rates {
            Rates::Equal(rate_hz) => rate_hz,
            Rates::Mixed => RATES_HZ[draw.below(RATES_HZ.len())],
        };
    }
    Table::new(bodies)
}

/// A body that stands on `height_m`, which becomes its top.
fn body(draw: &mut Draw, height_m: &mut f64) -> Placed {
    let aside = DVec3::new(draw.between(-0.01, 0.01), draw.between(-0.01, 0.01), 0.0);
    let yaw = draw.between(0.0, 3.1);
    let mut up = |half: f64| {
        *height_m += 2.0 * half;
        aside + DVec3::Z * (*height_m - half)
    };
    let along = |half: f64| DVec3::new(libm::cos(yaw), libm::sin(yaw), 0.0) * half;
    let soft = |middle: DVec3, size_m: [f64; 3], segments: [u32; 3], young_pa: f64| {
        turned(middle, solid(middle, size_m.into(), segments, young_pa), yaw)
    };
    match draw.below(9) {
        0 => {
            let size = draw.between(0.05, 0.07);
            soft(up(0.5 * size), [size; 3], [3; 3], draw.power(4.7, 5.5))
        }
        1 => soft(up(0.015), [0.14, 0.14, 0.03], [5, 5, 2], draw.power(4.7, 5.5)),
        2 => soft(up(0.004), [0.09, 0.09, 0.008], [5, 5, 1], 3e5),
        3 => {
            let middle = up(0.002);
            turned(middle, sheet(middle, 0.14, 7), yaw)
        }
        4 => rope(up(0.006), along(0.07), 0.006, 1e6),
        5 => tube(up(0.01), along(0.08), 0.01),
        6 => {
            let half = draw.between(0.02, 0.035);
            tilted(draw, DVec3::splat(half), (-1.3, 0.3), yaw, up)
        }
        7 => tilted(draw, DVec3::new(0.05, 0.05, 0.005), (-1.0, -0.4), yaw, up),
        _ => {
            let radius_m = draw.between(0.02, 0.035);
            let mass_kg = draw.power(-1.3, 0.3);
            placed(RigidBody::new(rigid(Solid::Ball { radius_m }, up(radius_m), mass_kg)).unwrap(), false)
        }
    }
}

/// A rigid box turned about z and a little about x; `up` gives its middle by half its height.
fn tilted(
    draw: &mut Draw,
    half_extents_m: DVec3,
    masses: (f64, f64),
    yaw: f64,
    mut up: impl FnMut(f64) -> DVec3,
) -> Placed {
    let mass_kg = draw.power(masses.0, masses.1);
    let tilt = draw.between(0.0, 0.1);
    let middle = up(half_extents_m.z + half_extents_m.y * tilt);
    let spec = rigid(Solid::Box { half_extents_m }, middle, mass_kg);
    let rotation = DQuat::from_rotation_z(yaw) * DQuat::from_rotation_x(tilt);
    placed(RigidBody::new(RigidSpec { rotation, ..spec }).unwrap(), false)
}

/// The faults of a stack after two seconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Faults {
    /// Deeper than 8 mm ever, or than 4 mm in the last tenth of a second.
    pub deep: bool,
    pub stays_deep: bool,
    /// More than 0.1 J above the least energy so far.
    pub gains: bool,
    /// Higher than it began by 5 cm.
    pub thrown: bool,
    /// Its middle is under the floor.
    pub through: bool,
}

impl Faults {
    pub fn any(self) -> bool {
        self != Self::default()
    }
}

/// How a stack did.
#[derive(Debug, Clone, Copy, Default)]
pub struct Outcome {
    pub faults: Faults,
    pub deepest_m: f64,
    pub end_m: f64,
    pub gain_j: f64,
    pub fine_steps: u32,
    pub solves: u32,
    pub unfinished: u32,
    pub factors: u32,
}

/// Plays a stack for some seconds.
pub fn play(table: &mut Table, seconds: f64) -> Outcome {
    let mut outcome = Outcome::default();
    let count = table.bodies.len();
    let began: Vec<f64> = (0..count).map(|body| table.middle(body).0.z).collect();
    let mut least_j = table.energy_j();
    while table.time.as_secs_f64() < seconds {
        let (report, _) = table.step();
        outcome.deepest_m = outcome.deepest_m.max(report.depth_m);
        if table.time.as_secs_f64() > seconds - 0.1 {
            outcome.end_m = outcome.end_m.max(report.depth_m);
        }
        let energy_j = table.energy_j();
        outcome.gain_j = outcome.gain_j.max(energy_j - least_j);
        least_j = least_j.min(energy_j);
        outcome.fine_steps += report.fine_steps;
        outcome.solves += report.solves;
        outcome.unfinished += report.unfinished;
        outcome.factors += report.factors;
        for (body, began) in began.iter().enumerate() {
            let height_m = table.middle(body).0.z;
            outcome.faults.thrown |= height_m > began + 0.05 || height_m.is_nan();
            outcome.faults.through |= height_m < 0.0;
        }
    }
    outcome.faults.deep = outcome.deepest_m > 8e-3;
    outcome.faults.stays_deep = outcome.end_m > 4e-3;
    outcome.faults.gains = outcome.gain_j > 0.1;
    outcome
}

#[test]
fn random_stacks_come_to_rest() {
    let outcomes: Vec<Outcome> = (1..=24).map(|seed| play(&mut stack(seed, Rates::Equal(60.0)), 1.5)).collect();
    let bad: Vec<_> = (1..).zip(&outcomes).filter(|(_, outcome)| outcome.faults.any()).collect();
    assert!(bad.is_empty(), "{bad:?}");
    let sum = |of: fn(&Outcome) -> u32| outcomes.iter().map(of).sum::<u32>();
    let (unfinished, solves) = (sum(|outcome| outcome.unfinished), sum(|outcome| outcome.solves));
    println!("{unfinished} of {solves} solves unfinished, {} factors", sum(|outcome| outcome.factors));
    assert!(unfinished * 1000 <= solves, "{unfinished} of {solves} solves");
}

#[test]
fn random_stacks_of_mixed_rates_come_to_rest() {
    let outcomes = (1..=6).map(|seed| (seed, play(&mut stack(seed, Rates::Mixed), 1.0)));
    let bad: Vec<_> = outcomes.filter(|(_, outcome)| outcome.faults.any()).collect();
    assert!(bad.is_empty(), "{bad:?}");
}
