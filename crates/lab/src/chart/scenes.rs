//! Small scenes with two rates, shared by several experiments.
//!
//! In: the two rates. Out: agents in contact. Never here: measurements.

use super::energy_bench::Play;
use super::stability::common::{GRAVITY, TUBE_RADIUS_M, plain_body, plain_tube};
use glam::DVec3;
use metachron_contact::AnchorSpring;
use metachron_core::{AgentId, Anchor};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::RigidSpec;
use metachron_models::rod::TubeSpec;

/// A scene of two kinds of agents: the first kind has one rate, the second the other.
pub(super) struct Scene {
    pub(super) play: Play,
    /// Points that are followed.
    pub(super) points: Vec<(AgentId, Anchor)>,
    /// The energy of the scene in its lowest state, joules: energies are reported above this.
    pub(super) zero_j: f64,
}

/// The scenes with tubes.
pub(super) const WITH_TUBES: [&str; 3] = ["tube-on-bar", "gripper", "crossing"];

/// The scene with a name.
pub(super) fn scene(name: &str, rates_hz: [f64; 2]) -> Option<Scene> {
    match name {
        "tube-on-bar" => tube_on_bar(rates_hz),
        "gripper" => gripper(rates_hz),
        "crossing" => crossing(rates_hz),
        "ball-on-box" => ball_on_box(rates_hz),
        "oblique-blow" => oblique_impact(rates_hz),
        _ => None,
    }
}

/// Whether the first agent is the fast one: both, unless the rates are the same.
pub(super) const fn ways(same_rates: bool) -> &'static [bool] {
    if same_rates { &[true] } else { &[true, false] }
}

fn gravity() -> DVec3 {
    DVec3::NEG_Z * GRAVITY
}

fn floor() -> Obstacle {
    Obstacle::new("floor", Solid::Plane)
}

/// A soft tube along `path_m` under gravity, with friction and a damping of 2/s.
fn tube(path_m: Vec<DVec3>) -> TubeSpec {
    TubeSpec { gravity: gravity(), friction: 0.5, damping_per_s: 2.0, ..plain_tube(path_m, TUBE_RADIUS_M, 20) }
}

/// A tube falls a centimetre onto a bar that rests freely on the floor, and bends over it.
fn tube_on_bar([tube_hz, bar_hz]: [f64; 2]) -> Option<Scene> {
    let mut play = Play::among(&[floor()])?;
    let half = DVec3::new(0.04, 0.15, 0.1);
    let height = 2.0 * half.z + TUBE_RADIUS_M;
    let x = 0.2;
    let path_m = vec![DVec3::new(-x, 0.0, height + 0.01), DVec3::new(x, 0.0, height + 0.01)];
    let hose = play.add_tube(tube(path_m), tube_hz)?;
    let bar = plain_body(Solid::Box { half_extents_m: half }, DVec3::Z * half.z, 1.0);
    let bar = RigidSpec { gravity: gravity(), friction: 0.5, ..bar };
    let bar = play.add_body(bar, bar_hz, vec![])?;
    let points = vec![
        (hose, Anchor::Arc(0.0)),
        (hose, Anchor::Arc(x)),
        (hose, Anchor::Arc(2.0 * x)),
        (bar, Anchor::Local(DVec3::ZERO)),
    ];
    let zero_j = play.energy_j() - weight_n(2.0 * x) * (0.01 + half.z);
    Some(Scene { play, points, zero_j })
}

/// Two fingers on springs press a tube from both sides and hold it against its weight.
fn gripper([tube_hz, finger_hz]: [f64; 2]) -> Option<Scene> {
    let mut play = Play::among(&[])?;
    let y = 0.1;
    let path_m = vec![DVec3::new(0.0, -y, 0.0), DVec3::new(0.0, y, 0.0)];
    let hose = play.add_tube(TubeSpec { friction: 0.8, ..tube(path_m) }, tube_hz)?;
    let half = DVec3::new(0.01, 0.03, 0.03);
    let mut points = vec![(hose, Anchor::Arc(0.0)), (hose, Anchor::Arc(y)), (hose, Anchor::Arc(2.0 * y))];
    for side in [-1.0, 1.0] {
        let at = DVec3::X * (side * (TUBE_RADIUS_M + half.x + 5e-4));
        let finger = plain_body(Solid::Box { half_extents_m: half }, at, 0.1);
        let finger = RigidSpec { gravity: gravity(), friction: 0.8, ..finger };
        let corners = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
        let spring = |[b, c]: [f64; 2]| {
            let corner = DVec3::new(0.0, b * half.y, c * half.z);
            let press = DVec3::X * (-side * 0.01);
            let sag = DVec3::Z * (0.1 * GRAVITY / 400.0);
            AnchorSpring {
                by: None,
                anchor: Anchor::Local(corner),
                target: at + corner + press + sag,
                target_velocity: DVec3::ZERO,
                stiffness_n_m: 100.0,
                damping_n_s_m: 1.0,
            }
        };
        let id = play.add_body(finger, finger_hz, corners.map(spring).to_vec())?;
        points.push((id, Anchor::Local(DVec3::ZERO)));
    }
    let zero_j = play.energy_j() - 2.0 * 0.5 * 400.0 * 0.01 * 0.01;
    Some(Scene { play, points, zero_j })
}

/// A tube clamped at one end swings down two centimetres onto another that is clamped at both.
fn crossing([lower_hz, upper_hz]: [f64; 2]) -> Option<Scene> {
    let mut play = Play::among(&[])?;
    let half = 0.2;
    let lower = vec![DVec3::X * -half, DVec3::X * half];
    let lower = play.add_tube(TubeSpec { clamp: [true; 2], ..tube(lower) }, lower_hz)?;
    let up = DVec3::Z * (2.0 * TUBE_RADIUS_M + 0.02);
    let upper = vec![up - DVec3::Y * half, up + DVec3::Y * half];
    let upper = play.add_tube(TubeSpec { clamp: [true, false], ..tube(upper) }, upper_hz)?;
    let points =
        [lower, upper].into_iter().flat_map(|id| [0.0, half, 2.0 * half].map(|s| (id, Anchor::Arc(s)))).collect();
    let zero_j = play.energy_j() - weight_n(2.0 * half) * 0.05;
    Some(Scene { play, points, zero_j })
}

/// A ball falls a centimetre onto a box that rests freely on the floor, and stays there.
fn ball_on_box([ball_hz, box_hz]: [f64; 2]) -> Option<Scene> {
    let mut play = Play::among(&[floor()])?;
    let (half, radius_m, fall_m) = (0.1, 0.05, 0.01);
    let plain = |solid: Solid, height: f64, mass_kg: f64| {
        let plain = plain_body(solid, DVec3::Z * height, mass_kg);
        RigidSpec { gravity: gravity(), friction: 0.5, ..plain }
    };
    let ball = plain(Solid::Ball { radius_m }, 2.0 * half + radius_m + fall_m, 0.1);
    let ball = play.add_body(ball, ball_hz, vec![])?;
    let below = play.add_body(plain(Solid::Box { half_extents_m: DVec3::splat(half) }, half, 1.0), box_hz, vec![])?;
    let points = [ball, below].map(|id| (id, Anchor::Local(DVec3::ZERO))).to_vec();
    let zero_j = play.energy_j() - 0.1 * GRAVITY * fall_m;
    Some(Scene { play, points, zero_j })
}

/// Two balls collide off-centre, with friction.
fn oblique_impact(rates_hz: [f64; 2]) -> Option<Scene> {
    let mut play = Play::among(&[])?;
    let ball = |at: DVec3, velocity: DVec3, mass: f64| RigidSpec {
        velocity,
        friction: 0.3,
        restitution: 0.5,
        ..plain_body(Solid::Ball { radius_m: 0.05 }, at, mass)
    };
    let hitting = play.add_body(ball(DVec3::X * -0.2, DVec3::X, 0.1), rates_hz[0], vec![])?;
    let hit = play.add_body(ball(DVec3::Y * 0.04, DVec3::ZERO, 0.3), rates_hz[1], vec![])?;
    let points = [hitting, hit].map(|id| (id, Anchor::Local(DVec3::Y * 0.05))).to_vec();
    Some(Scene { play, points, zero_j: 0.0 })
}

/// Weight of so much of the tube, newtons.
fn weight_n(length_m: f64) -> f64 {
    plain_tube(vec![DVec3::ZERO, DVec3::X], TUBE_RADIUS_M, 2).section.mass_per_length_kg_m * length_m * GRAVITY
}
