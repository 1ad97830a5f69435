//! A body falls on a spring-mounted one with a faster clock: the energy under every contact law.
//!
//! 50 g fall 5 cm onto 100 g on springs of 500 N/m. The mounted body keeps 1 kHz; the other is slow, its steps have jitter, and
//! some of its states are lost. In 1d two balls; in 3d a tilted box that turns and slides lands on a plate with friction.

use crate::chart::asynchronous::bench::{Faults, PairLaw};
use crate::chart::asynchronous::play::{ContactImpulse, Play};
use crate::chart::stability::common::{COMMON_ENERGY_MAX, GRAVITY, plain_body};
use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Panel, Table, blank, claims, each, table, worst,
    worst_of,
};
use glam::{DQuat, DVec3};
use metachron_contact::{AnchorSpring, Law};
use metachron_core::{AgentId, Anchor};
use metachron_geometry::Solid;
use metachron_geometry::narrow_phase::NarrowPhaseScratch;
use metachron_models::rigid::RigidSpec;
use serde::{Deserialize, Serialize};

/// The experiment.
pub(crate) struct Drop;

/// Names of the laws, and stiffness in N/m where they have one.
const LAWS: [(&str, f64); 6] = [
    ("ledger", 0.0),
    ("penalty", 50.0),
    ("penalty", 500.0),
    ("penalty", 5000.0),
    ("penalty-extrapolated", 500.0),
    ("tlm", 500.0),
];
const SPACES: [&str; 2] = ["1d", "3d"];
const RATES_HZ: [f64; 5] = [240.0, 120.0, 60.0, 30.0, 10.0];
const LOSSES: [f64; 3] = [0.0, 0.02, 0.1];
const JITTER: f64 = 0.2;
const SEEDS: u64 = 20;
const QUICK_SEEDS: u64 = 2;

/// Masses of the mounted and of the falling body, kg, and the rate of the mounted one.
pub(super) const MOUNTED_KG: f64 = 0.1;
pub(super) const FALLING_KG: f64 = 0.05;
const MOUNTED_HZ: f64 = 1000.0;
/// Stiffness and damping of the mount, all springs together.
const MOUNT_N_M: f64 = 500.0;
const MOUNT_N_S_M: f64 = 0.5;
/// Damping of the laws that have one, as a share of critical damping.
const DAMPING_RATIO: f64 = 0.1;
const FALL_M: f64 = 0.05;
/// An impact without rebound: the sum over two clocks then peaks at 1 + m₁ m₂/(m₁ + m₂)² = 1.22 at least, because the mounted
/// body has already taken the impulse and the other has not; it is higher where a second impact precedes the delivery of the first.
const RESTITUTION: f64 = 0.0;
const SECONDS: f64 = 3.0;
/// From here on the two are at rest.
const REST_S: f64 = 2.5;
/// A run ends past this multiple of its starting energy: it shows nothing more.
const BLOWN_UP: f64 = 1e6;
/// Bounds of the findings.
const RAW_MAX: f64 = 1.3;
const MOMENTUM_MAX: f64 = 0.005;
const DEPTH_MAX_M: f64 = 0.002;

/// A law, the number of dimensions, the slow rate, the share of lost states.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    law: &'static str,
    stiffness_n_m: f64,
    space: &'static str,
    rate_hz: f64,
    jitter: f64,
    loss: f64,
    seeds: u64,
}

/// The worst over all seeds.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Found {
    /// Peak of the energies added over two clocks, as a multiple of that of the start.
    raw_peak: f64,
    /// The same at a common time, with all impulses delivered.
    common_peak: f64,
    /// Difference of the two contact impulses, all delivered, as a share of the impulse exchanged.
    momentum_error: f64,
    /// The deepest overlap at rest, at a common time.
    depth_m: f64,
}

type Row = Measured<Case, Found>;

impl Experiment for Drop {
    type Row = Row;
    const NAME: &'static str = "drop";
    const TITLE: &'static str = "50 g fall on 100 g on springs, separate clocks: peak energy of every contact law";
    const TABLE: fn(&[Row]) -> Table = |rows| {
        let of = |here: &[Row], number: fn(&Row) -> f64| worst_of(here, |_| true, number);
        table!(rows.chunk_by(|a, b| a.case.key() == b.case.key()), |here| law: here[0].case.law,
            k_n_m: here[0].case.stiffness_n_m, space: here[0].case.space, rate_hz: here[0].case.rate_hz,
            "raw peak"(3): of(here, |r| r.raw_peak), peak(4): of(here, |r| r.common_peak),
            "momentum error"(5): of(here, |r| r.momentum_error), depth_mm(4): 1e3 * of(here, |r| r.depth_m))
    };

    fn cases(quick: bool) -> Vec<Case> {
        let (rates_hz, losses) = if quick { (&RATES_HZ[2..3], &LOSSES[1..2]) } else { (&RATES_HZ[..], &LOSSES[..]) };
        let seeds = if quick { QUICK_SEEDS } else { SEEDS };
        each!((law, stiffness_n_m) in LAWS, space in SPACES, &rate_hz in rates_hz, &loss in losses =>
            Case { law, stiffness_n_m, space, rate_hz, jitter: JITTER, loss, seeds })
    }

    fn measure(case: &Case) -> Option<Found> {
        let falls: Vec<Found> = (1..=case.seeds).map(|seed| fall(case, seed).unwrap_or_else(blank)).collect();
        let greatest = |number: fn(&Found) -> f64| worst(falls.iter().map(number));
        Some(Found {
            raw_peak: greatest(|f| f.raw_peak),
            common_peak: greatest(|f| f.common_peak),
            momentum_error: greatest(|f| f.momentum_error),
            depth_m: greatest(|f| f.depth_m),
        })
    }

    fn figure(rows: &[Row]) -> Figure {
        let peak =
            |space| panel(space, rows, Axis::log("peak energy / start, at a common time", 0.5, 1e4), |r| r.common_peak);
        // a body that was thrown off overlaps nothing
        let rests = |r: &Row| if r.common_peak < 2.0 { r.depth_m } else { f64::NAN };
        let depth = |space| panel(space, rows, Axis::log("overlap at rest, m", 1e-7, 0.1), rests);
        let panels = SPACES.into_iter().flat_map(|space| [peak(space), depth(space)]).collect();
        Figure::new(format!("50 g fall on 100 g on springs; the worst of {SEEDS} seeds and all loss rates"), 2, panels)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let ours = |number: fn(&Row) -> f64| worst_of(rows, |r| r.case.law == "ledger", number);
        let at_60 = worst_of(rows, |r| r.case.law == "ledger" && r.case.rate_hz == 60.0, |r| r.depth_m);
        claims![
            "ledger: peak of the sum over two clocks" => ours(|r| r.raw_peak), at_most RAW_MAX;
            "ledger: peak at a common time" => ours(|r| r.common_peak), at_most COMMON_ENERGY_MAX;
            "ledger: momentum error" => ours(|r| r.momentum_error), at_most MOMENTUM_MAX;
            "ledger: overlap at rest at 60 Hz, m" => at_60, at_most DEPTH_MAX_M;
        ]
    }
}

impl Case {
    fn key(&self) -> (&'static str, f64, &'static str, f64) {
        (self.law, self.stiffness_n_m, self.space, self.rate_hz)
    }
}

/// The law with a name.
pub(crate) fn law(name: &str, stiffness_n_m: f64, damping_ratio: f64) -> PairLaw {
    let reduced_kg = MOUNTED_KG * FALLING_KG / (MOUNTED_KG + FALLING_KG);
    let damping_n_s_m = 2.0 * damping_ratio * (stiffness_n_m * reduced_kg).sqrt();
    match name {
        "penalty" => PairLaw::Penalty { stiffness_n_m, damping_n_s_m, extrapolate: false },
        "penalty-extrapolated" => PairLaw::Penalty { stiffness_n_m, damping_n_s_m, extrapolate: true },
        "tlm" => PairLaw::Product(Law::Tlm { stiffness_n_m, damping_n_s_m }),
        _ => PairLaw::Product(Law::Ledger),
    }
}

/// Two bodies, one above the other, and their zero of energy.
pub(crate) struct Pair {
    pub(crate) play: Play,
    pub(super) mounted: AgentId,
    pub(super) falling: AgentId,
    /// Energy where the falling body rests on the mounted one before its springs give, joules.
    pub(crate) zero_j: f64,
}

/// A fixed spring at a point of the mounted body, one of `count` that share its load.
fn mount(at: DVec3, count: f64) -> AnchorSpring {
    let sag = DVec3::Z * (MOUNTED_KG * GRAVITY / MOUNT_N_M);
    AnchorSpring {
        by: None,
        anchor: Anchor::Local(at),
        target: at + sag,
        target_velocity: DVec3::ZERO,
        stiffness_n_m: MOUNT_N_M / count,
        damping_n_s_m: MOUNT_N_S_M / count,
    }
}

/// Builds the two bodies, one `fall_m` above the other.
pub(crate) fn pair(space: &str, law: PairLaw, rate_hz: f64, faults: Faults, fall_m: f64) -> Option<Pair> {
    let mut play = Play::new(law, faults);
    let gravity = DVec3::NEG_Z * GRAVITY;
    let body = |solid: Solid, height_m: f64, mass: f64, friction: f64| RigidSpec {
        gravity,
        friction,
        restitution: RESTITUTION,
        ..plain_body(solid, DVec3::Z * height_m, mass)
    };
    let (under, over, springs, rest_m) = if space == "1d" {
        let ball = || Solid::Ball { radius_m: 0.02 };
        let over = body(ball(), 0.04 + fall_m, FALLING_KG, 0.0);
        (body(ball(), 0.0, MOUNTED_KG, 0.0), over, vec![mount(DVec3::ZERO, 1.0)], 0.04)
    } else {
        let half = DVec3::new(0.1, 0.1, 0.01);
        let plate = Solid::Box { half_extents_m: half };
        let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
        let springs = corners.map(|(x, y)| mount(DVec3::new(x * half.x, y * half.y, 0.0), 4.0));
        let cube = Solid::Box { half_extents_m: DVec3::splat(0.02) };
        let over = RigidSpec {
            rotation: DQuat::from_rotation_x(0.3) * DQuat::from_rotation_y(0.2),
            velocity: DVec3::new(0.1, 0.05, 0.0),
            spin: DVec3::new(1.0, -2.0, 0.5),
            ..body(cube, 0.04 + fall_m, FALLING_KG, 0.3)
        };
        (body(plate, 0.0, MOUNTED_KG, 0.3), over, springs.to_vec(), 0.03)
    };
    let zero_j = FALLING_KG * GRAVITY * rest_m;
    let mounted = play.add_body(under, MOUNTED_HZ, springs)?;
    let falling = play.add_body(over, rate_hz, Vec::new())?;
    let own = 0.5 * MOUNT_N_M * (MOUNTED_KG * GRAVITY / MOUNT_N_M).powi(2);
    Some(Pair { play, mounted, falling, zero_j: zero_j + own })
}

fn fall(case: &Case, seed: u64) -> Option<Found> {
    let faults = Faults { jitter: case.jitter, loss: case.loss, seed, due: false };
    let law = law(case.law, case.stiffness_n_m, DAMPING_RATIO);
    let Pair { play, mounted, falling, zero_j } = pair(case.space, law, case.rate_hz, faults, FALL_M)?;
    let start_j = play.raw_j() - zero_j;
    let mut out = Found { raw_peak: 1.0, common_peak: 1.0, momentum_error: 0.0, depth_m: 0.0 };
    let mut contact = [ContactImpulse::default(); 2];
    let (mut room, mut pages) = (NarrowPhaseScratch::default(), 0_u32);
    let gravity = DVec3::NEG_Z * GRAVITY;
    let ended = play.run(SECONDS, |play, id| {
        let at = play.time();
        out.raw_peak = worst([out.raw_peak, (play.raw_j() - zero_j) / start_j]);
        out.common_peak = worst([out.common_peak, (play.common(at).energy_j - zero_j) / start_j]);
        let side = usize::from(id == falling);
        let mass = [MOUNTED_KG, FALLING_KG][side];
        contact[side].add(play.stage.own(id), mass, gravity, play.stage.last_s(id));
        pages += 1;
        if at.as_secs_f64() > REST_S && pages.is_multiple_of(8) {
            out.depth_m = out.depth_m.max(play.depth_m([mounted, falling], at, &mut room));
        }
        out.raw_peak < BLOWN_UP
    });
    let flying: DVec3 = [mounted, falling].iter().map(|id| ended.in_flight(*id)).sum();
    let exchanged = contact[1].size + ended.in_flight(falling).length();
    out.momentum_error = (contact[0].sum + contact[1].sum + flying).length() / exchanged.max(f64::MIN_POSITIVE);
    Some(out)
}

/// A quantity over the slow body's rate, one line per law.
fn panel(space: &'static str, rows: &[Row], y: Axis, get: fn(&Row) -> f64) -> Panel {
    let line = |((law, k), colour): ((&'static str, f64), Colour)| {
        let at = |rate_hz: f64| {
            let worst = worst_of(rows, |r| r.case.key() == (law, k, space, rate_hz), get);
            (rate_hz, worst.max(y.low) + 0.0 * worst)
        };
        let label = if k > 0.0 { format!("{law}, {k} N/m") } else { law.to_owned() };
        Layer::line(label, colour, RATES_HZ.into_iter().map(at))
    };
    let mut layers: Vec<Layer> = LAWS.into_iter().zip(Colour::LINES).map(line).collect();
    let limit = if y.high > 1.0 { COMMON_ENERGY_MAX } else { DEPTH_MAX_M };
    layers.push(Layer::limit("limit", [8.0, 300.0], limit));
    let x = Axis::log("rate of the slow body, Hz", 8.0, 300.0);
    Panel::new(format!("{space}: {}", y.label), x, y, layers)
}
