//! Compounds: several solids that are one body, each of which touches as it would alone.

use crate::bodies::rigid;
use crate::table::{GRAVITY, Table, placed, plane};
use glam::{DQuat, DVec3};
use metachron_contact::member::Partner;
use metachron_geometry::{CompoundPart, Solid};
use metachron_models::rigid::{RigidBody, RigidSpec};

fn part(solid: Solid, position_m: DVec3) -> CompoundPart {
    CompoundPart::new(solid, position_m, DQuat::IDENTITY)
}

fn cuboid(x: f64, y: f64, z: f64) -> Solid {
    Solid::Box { half_extents_m: DVec3::new(x, y, z) }
}

/// A top on four legs, 0.12 m high, with its axes in the middle of the top.
fn five_boxes() -> Solid {
    let leg = |x: f64, y: f64| part(cuboid(0.01, 0.01, 0.05), DVec3::new(x, y, -0.06));
    let top = part(cuboid(0.1, 0.1, 0.01), DVec3::ZERO);
    let legs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(x, y)| leg(0.08 * x, 0.08 * y));
    Solid::Compound { parts: std::iter::once(top).chain(legs).collect() }
}

/// How far the axes of five boxes are above their ground.
const HEIGHT_M: f64 = 0.11;

#[test]
fn a_dumbbell_rests_on_its_balls_and_weighs_what_it_does() {
    let ball = |x: f64| part(Solid::Ball { radius_m: 0.05 }, DVec3::X * x);
    let bar = part(cuboid(0.2, 0.01, 0.01), DVec3::ZERO);
    let dumbbell = Solid::Compound { parts: [ball(-0.2), ball(0.2), bar].into() };
    let spec = rigid(dumbbell, DVec3::Z * 0.06, 2.0);
    let mut table = Table::among(vec![placed(RigidBody::new(spec).unwrap(), false)], &[plane(DQuat::IDENTITY, 0.5)]);
    let findings = table.play(1.5);
    let (place, velocity) = table.middle(0);
    assert!((place.z - 0.05).abs() < 5e-5 && velocity.length() < 1e-3, "{place}, {velocity}");
    let weight_n = 2.0 * -GRAVITY.z;
    assert!((table.given_n(0, Partner::Static(0)) / weight_n - 1.0).abs() < 1e-3);
    assert!(findings.rest_m < 1e-4, "{}", findings.rest_m);
}

#[test]
fn a_table_slides_down_a_slope_as_coulomb_says_and_stays_where_it_sticks() {
    const SLOPE_RAD: f64 = 0.21;
    let lean = DQuat::from_rotation_y(SLOPE_RAD);
    for (ground, slides) in [(0.02, true), (0.5, false)] {
        let spec = rigid(five_boxes(), lean * (DVec3::Z * (HEIGHT_M + 1e-4)), 1.5);
        let spec = RigidSpec { rotation: lean, friction: 0.5, ..spec };
        let mut table = Table::among(vec![placed(RigidBody::new(spec).unwrap(), false)], &[plane(lean, ground)]);
        let mut speed_at = |seconds: f64| {
            while table.time.as_secs_f64() < seconds - 1e-9 {
                table.step();
            }
            table.middle(0).1.dot(lean * DVec3::X)
        };
        let speeds = [0.5, 1.0].map(&mut speed_at);
        let m_s2 = (speeds[1] - speeds[0]) / 0.5;
        // the geometric mean of 0.5 and 0.02 is 0.1
        let wanted = -GRAVITY.z * (libm::sin(SLOPE_RAD) - 0.1 * libm::cos(SLOPE_RAD));
        let wanted = if slides { wanted } else { 0.0 };
        assert!((m_s2 - wanted).abs() < 1e-2 * -GRAVITY.z, "{m_s2} instead of {wanted} m/s²");
    }
}

#[test]
fn a_ball_stays_in_the_hollow_of_a_cup() {
    let wall = |x: f64, y: f64| {
        let half = if x == 0.0 { cuboid(0.1, 0.01, 0.05) } else { cuboid(0.01, 0.1, 0.05) };
        part(half, DVec3::new(x, y, 0.06))
    };
    let floor = part(cuboid(0.1, 0.1, 0.01), DVec3::ZERO);
    let walls = [wall(0.09, 0.0), wall(-0.09, 0.0), wall(0.0, 0.09), wall(0.0, -0.09)];
    let cup = Solid::Compound { parts: std::iter::once(floor).chain(walls).collect() };
    let cup = placed(RigidBody::new(rigid(cup, DVec3::Z * 0.0101, 2.0)).unwrap(), false);
    let ball = RigidSpec { velocity: DVec3::X * 0.4, ..rigid(Solid::Ball { radius_m: 0.03 }, DVec3::Z * 0.08, 0.1) };
    let mut table =
        Table::among(vec![cup, placed(RigidBody::new(ball).unwrap(), false)], &[plane(DQuat::IDENTITY, 0.5)]);
    table.play(2.0);
    let (place, _) = table.middle(1);
    assert!((place.z - 0.05).abs() < 1e-4 && place.truncate().length() < 0.08, "{place}");
}

#[test]
fn a_heap_of_tables_stands_as_one_does() {
    // 16 places each: more than 1,000
    let spec = |k: usize| {
        let [x, y] = [k % 9, k / 9].map(|v| 0.2005 * v as f64);
        RigidSpec { friction: 0.5, ..rigid(five_boxes(), DVec3::new(x, y, HEIGHT_M + 1e-4), 1.5) }
    };
    let tables = (0..81).map(|k| placed(RigidBody::new(spec(k)).unwrap(), false));
    let mut heap = Table::among(tables.collect(), &[plane(DQuat::IDENTITY, 0.5)]).hurried();
    let mut last = heap.step().0;
    while heap.time.as_secs_f64() < 0.5 {
        last = heap.step().0;
    }
    assert!(last.pile_contacts > 1000, "rapier3d has it: {last:?}");
    let com = spec(0).com_local();
    for k in 0..81 {
        let (place, velocity) = heap.middle(k);
        let wanted = spec(k).position + com;
        assert!((place - wanted).length() < 3e-4 && velocity.length() < 2e-3, "{k}: {place}, not {wanted}; {velocity}");
    }
}
