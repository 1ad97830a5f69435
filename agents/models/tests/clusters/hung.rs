//! A ball of 2 kg that hangs on everything that can hold it: tests of tearing and of yielding.

use crate::bodies::rigid;
use crate::table::{GRAVITY, Table, placed, spring};
use glam::DVec3;
use metachron_contact::Link;
use metachron_contact::joint::{Joint, JointKind};
use metachron_core::{AgentId, Anchor, ResolutionRange};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::rod::{Attachment, Material, Section, Tube, TubeSpec};

pub const G: f64 = -GRAVITY.z;
pub const CENTRE: Anchor = Anchor::Local(DVec3::ZERO);
pub const MASS_KG: f64 = 2.0;
pub const WEIGHT_N: f64 = MASS_KG * G;
/// Stiffness of springs, N/m: a weight stretches them by 2 cm.
pub const STIFFNESS_N_M: f64 = WEIGHT_N / 0.02;

pub fn ball(middle: DVec3, mass_kg: f64, gravity: DVec3) -> RigidSpec {
    RigidSpec { gravity, ..rigid(Solid::Ball { radius_m: 0.05 }, middle, mass_kg) }
}

pub fn balls(specs: impl IntoIterator<Item = RigidSpec>) -> Table {
    let bodies = specs.into_iter().map(|spec| placed(RigidBody::new(spec).unwrap(), false)).collect();
    Table::among(bodies, &[])
}

/// How a ball of 2 kg is held from above in these tests.
#[derive(Debug, Clone, Copy)]
pub enum Held {
    /// By a joint to the world.
    Joint(JointKind),
    /// By a joint to a body that nothing pulls and that 1e9 kg keep where it is.
    Beam(JointKind),
    /// By a link to such a body, with this length at rest.
    Link { rest_m: f64 },
}

/// Everything that can hold the ball, each of which bears its weight from the first step on.
pub const ALL: [Held; 10] = [
    Held::Joint(JointKind::Fixed),
    Held::Joint(JointKind::Spherical),
    Held::Joint(JointKind::Revolute { axis: DVec3::Y, range_rad: Some([-0.1, 0.1]), motor: None }),
    Held::Joint(JointKind::Prismatic { axis: DVec3::Y, range_m: None, motor: None }),
    Held::Joint(JointKind::Prismatic { axis: DVec3::Z, range_m: Some([-1.0, 0.0]), motor: None }),
    Held::Joint(JointKind::Rope { length_m: 0.5 }),
    Held::Joint(JointKind::Spring { stiffness_n_m: STIFFNESS_N_M, damping_n_s_m: 0.0, rest_m: 0.48 }),
    Held::Beam(JointKind::Fixed),
    Held::Link { rest_m: 0.48 },
    Held::Link { rest_m: 0.0 },
];

/// The forces above which the hold tears and yields, N.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    pub tears_above_n: f64,
    pub yields_above_n: f64,
}

/// The ball, at rest in the origin with its spring stretched by its weight, on a hold that gives way above some force.
pub fn hung(held: Held, limits: Limits) -> Table {
    let Limits { tears_above_n, yields_above_n } = limits;
    let weight = ball(DVec3::ZERO, MASS_KG, GRAVITY);
    let beam = ball(DVec3::Z * 0.5, 1e9, DVec3::ZERO);
    let joint = |kind: JointKind, b: Option<AgentId>| {
        let above = match kind {
            JointKind::Rope { .. } | JointKind::Spring { .. } => DVec3::Z * 0.5,
            _ => DVec3::ZERO,
        };
        let below = if b.is_some() { DVec3::Z * -0.5 } else { DVec3::ZERO };
        Joint { anchor_b_m: above + below, tears_above_n, yields_above_n, ..Joint::new(AgentId(0), b, kind) }
    };
    match held {
        Held::Joint(kind) => balls([weight]).jointed([joint(kind, None)]),
        Held::Beam(kind) => balls([weight, beam]).jointed([joint(kind, Some(AgentId(1)))]),
        Held::Link { rest_m } => {
            let mut table = balls([weight, beam]);
            let there = if rest_m > 0.0 { DVec3::ZERO } else { DVec3::Z * -0.48 };
            let link = Link { tears_above_n, yields_above_n, ..spring(STIFFNESS_N_M, 0.0, rest_m) };
            table.link([(0, CENTRE), (1, Anchor::Local(there))], link);
            table
        }
    }
}

/// Lets a weight hang for two seconds, by each way to hold it, that is below these limits: nothing gives way.
pub fn check_hangs(limits: Limits) {
    for held in ALL {
        let mut table = hung(held, limits);
        while table.time.as_secs_f64() < 2.0 {
            table.step();
            assert!(table.torn().is_empty() && table.yielded().is_empty(), "{held:?}");
        }
        // the springs' first step, which is exact to first order, makes them swing by that
        let height_m = table.middle(0).0.z;
        assert!(height_m.abs() < 1e-3, "{held:?}: {height_m} m");
    }
}

/// A tube of 0.2 m that hangs along all of its length, begins at rest with its attachment slack by this much, and sags by 1 mm below that; the
/// load of its attachment follows from its weight.
pub fn mesentery(slack_m: f64, limits: impl Fn(f64) -> Limits) -> Table {
    let material = Material { young_pa: 1e6, poisson: 0.3, density_kg_m3: 1000.0, shear_factor: 0.9 };
    let section = Section::hollow(0.01, 0.01, material);
    let per_m_n = section.mass_per_length_kg_m * G;
    let stiffness_n_m2 = per_m_n / 1e-3;
    // it comes there without passing it
    let damping_n_s_m2 = 3.0 * (stiffness_n_m2 * section.mass_per_length_kg_m).sqrt();
    let Limits { tears_above_n, yields_above_n } = limits(per_m_n * 0.2);
    let (from, to) = (0.0, 1.0);
    let attachment = Attachment { from, to, stiffness_n_m2, slack_m, damping_n_s_m2, tears_above_n, yields_above_n };
    let spec = TubeSpec::free(vec![DVec3::ZERO, DVec3::X * 0.2], section, 10);
    let range = ResolutionRange { eps_m: (0.01, 0.05), n: (0, 0) };
    let spec = TubeSpec { gravity: GRAVITY, attachments: vec![attachment], range, ..spec };
    Table::among(vec![placed(Tube::new(spec).unwrap(), false)], &[])
}
