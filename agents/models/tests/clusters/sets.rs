//! Three sets of scenes in which nothing was chosen because it works: pairs, bodies that tip over their ground, piles of boxes.

use crate::bodies::{block, material, rigid, rope, sheet, solid, tube, turned};
use crate::stacks::{Draw, Outcome, play};
use crate::table::{Placed, Table, placed};
use glam::{DQuat, DVec3};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::soft::{SoftShape, SoftSpec};

/// Rates of the lower body and of the upper one, Hz.
const RATES_HZ: [[f64; 2]; 5] = [[240.0, 240.0], [60.0, 60.0], [60.0, 61.0], [240.0, 60.0], [60.0, 240.0]];

/// Rates and restitutions of the boxes of piles.
const PILE_RATES_HZ: [f64; 8] = [10.0, 30.0, 60.0, 60.0, 120.0, 240.0, 480.0, 1000.0];
const PILE_RESTITUTIONS: [f64; 3] = [0.0, 0.2, 0.5];

pub const PAIRS: u64 = 210;
pub const TIPS: u64 = 400;
pub const PILES: u64 = 2000;

/// How a scene of a set went.
#[derive(Debug, Clone, Copy, Default)]
pub struct Verdict {
    /// The deepest overlap, and in the last tenth of a second, metres.
    pub deepest_m: f64,
    pub end_m: f64,
    /// The energy above its running minimum, J, and above which of it some was made: 0.1 J and a hundredth of the
    /// energy at the start.
    pub gain_j: f64,
    allowed_j: f64,
    /// Whether a body is higher at the end than all of them on each other, or under the floor.
    astray: bool,
}

impl Verdict {
    pub fn is_deep(&self) -> bool {
        self.deepest_m > 8e-3
    }

    pub fn stays_deep(&self) -> bool {
        self.end_m > 5e-3
    }

    pub fn flies(&self) -> bool {
        self.astray || self.gain_j > self.allowed_j
    }

    pub fn is_bad(&self) -> bool {
        self.is_deep() || self.stays_deep() || self.flies()
    }
}

/// Plays one scene of a set.
fn judge(mut table: Table, seconds: f64) -> Verdict {
    let count = table.bodies.len();
    let allowed_j = f64::max(0.1, 0.01 * table.energy_j());
    let Outcome { deepest_m, end_m, gain_j, faults, .. } = play(&mut table, seconds);
    let is_up = (0..count).any(|body| table.middle(body).0.z > 0.2 * count as f64 + 0.1);
    Verdict { deepest_m, end_m, gain_j, allowed_j, astray: is_up || faults.through }
}

/// One of seven kinds of body that stands on `height_m`, and how high it is.
fn of_kind(kind: u64, height_m: f64) -> (Placed, f64) {
    let up = |half_m: f64| DVec3::Z * (height_m + half_m);
    let soft = |middle: DVec3, spec: SoftSpec| turned(middle, spec, 0.3);
    let cube = solid(up(0.03), DVec3::splat(0.06), [3; 3], 1e5);
    match kind {
        0 => {
            let ball = SoftShape::Ball { radius_m: 0.04, segments: 4 };
            (soft(up(0.04), SoftSpec { shape: ball, position: up(0.04), material: material(1e5), ..cube }), 0.08)
        }
        1 => (soft(up(0.03), cube), 0.06),
        2 => (soft(up(0.015), solid(up(0.015), DVec3::new(0.14, 0.14, 0.03), [5, 5, 2], 1e5)), 0.03),
        3 => (soft(up(0.002), sheet(up(0.002), 0.14, 7)), 0.004),
        4 => (rope(up(0.006), DVec3::X * 0.07, 0.006, 1e6), 0.012),
        5 => (tube(up(0.01), DVec3::Y * 0.08, 0.01), 0.02),
        _ => (block(up(0.03), DVec3::splat(0.03), 0.4, 0.3), 0.06),
    }
}

/// A body of one of seven kinds falls 5 cm onto one of six, the same without the rigid box, on the floor.
pub fn pair(number: u64) -> Verdict {
    let (rates, kinds) = (RATES_HZ[(number % 5) as usize], number / 5);
    let (lower, height_m) = of_kind(kinds % 6, 1e-3);
    let (upper, _) = of_kind(kinds / 6, height_m + 0.051);
    judge(Table::new(vec![lower, upper]).at_rates(rates[0], rates[1]), 1.5)
}

/// A tilted or eccentric rigid box, plate, capsule or cylinder of 0.4 kg on a tube, rope, soft block or rigid box on the floor.
pub fn tip(number: u64) -> Verdict {
    let (rates, kinds) = (RATES_HZ[(number % 5) as usize], number / 5 % 16);
    let mut draw = Draw::new(number);
    let (lower, height_m) = of_kind([5, 4, 1, 6][(kinds % 4) as usize], 1e-3);
    let (solid, half_m) = match kinds / 4 {
        0 => (Solid::Box { half_extents_m: DVec3::splat(0.03) }, 0.03),
        1 => (Solid::Box { half_extents_m: DVec3::new(0.06, 0.04, 0.005) }, 0.005),
        2 => (Solid::Capsule { radius_m: 0.02, half_height_m: 0.03 }, 0.05),
        _ => (Solid::Cylinder { radius_m: 0.03, half_height_m: 0.03 }, 0.03),
    };
    let (tilt, yaw) = (draw.between(0.0, 0.5), draw.between(0.0, 3.1));
    let aside = DVec3::new(draw.between(-0.03, 0.03), draw.between(-0.03, 0.03), 0.0);
    let middle = aside + DVec3::Z * (height_m + half_m + 0.06 * tilt + draw.between(0.002, 0.02));
    let rotation = DQuat::from_rotation_z(yaw) * DQuat::from_rotation_x(tilt);
    let spec = RigidSpec { rotation, ..rigid(solid, middle, 0.4) };
    let upper = placed(RigidBody::new(spec).unwrap(), false);
    judge(Table::new(vec![lower, upper]).at_rates(rates[0], rates[1]), 1.5)
}

/// A pile of two to four boxes of 10, 16 and 20 cm and 0.1 to 100 kg, let go with gaps of up to 10 cm.
pub fn pile(number: u64) -> Verdict {
    let mut draw = Draw::new(number);
    let count = 2 + draw.below(3);
    let mut height_m = 0.0;
    let mut bodies = vec![];
    for _ in 0..count {
        let half_m = [0.05, 0.08, 0.1][draw.below(3)];
        height_m += draw.between(0.0, 0.1) + half_m;
        let middle = DVec3::new(draw.between(-0.01, 0.01), draw.between(-0.01, 0.01), height_m);
        height_m += half_m;
        let spec = rigid(Solid::Box { half_extents_m: DVec3::splat(half_m) }, middle, draw.power(-1.0, 2.0));
        let restitution = PILE_RESTITUTIONS[draw.below(3)];
        let mut body = placed(RigidBody::new(RigidSpec { restitution, ..spec }).unwrap(), false);
        body.rate_hz = PILE_RATES_HZ[draw.below(PILE_RATES_HZ.len())];
        bodies.push(body);
    }
    judge(Table::new(bodies), 3.0)
}

#[test]
fn a_few_of_each_set_come_to_rest() {
    let pairs = (0..PAIRS).step_by(26).map(pair);
    let tips = (0..TIPS).step_by(37).map(tip);
    let piles = (0..PILES).step_by(101).map(pile);
    let bad: Vec<_> = pairs.chain(tips).chain(piles).filter(Verdict::is_bad).collect();
    assert!(bad.is_empty(), "{bad:?}");
}
