//! Heaps for whose solves there is no time: rapier3d steps them.

use crate::bodies::{block, cube, rigid, solid};
use crate::table::{GRAVITY, Table, placed, plane};
use glam::{DQuat, DVec3};
use metachron_contact::AnchorSpring;
use metachron_contact::member::Partner;
use metachron_core::Anchor;
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::soft::{SoftBody, SoftSpec};

const HALF_M: f64 = 0.03;

/// Columns of boxes, apart from each other by less than boxes look for each other.
fn columns(wide: usize, high: usize) -> Table {
    let boxes = (0..wide * wide * high).map(|k| {
        let [x, y, layer] = [k % wide, k / wide % wide, k / wide / wide].map(|v| v as f64);
        block(DVec3::new(0.0605 * x, 0.0605 * y, 0.0302 + 0.0604 * layer), DVec3::splat(HALF_M), 0.2, 0.0)
    });
    Table::among(boxes.collect(), &[plane(DQuat::IDENTITY, 0.5)]).hurried()
}

#[test]
fn a_heap_of_a_thousand_contacts_rests_where_a_small_one_does() {
    // 12 contacts a column, with its neighbours more than 1,000
    let (wide, high) = (10, 3);
    let mut heap = columns(wide, high);
    let mut last = (heap.step().0, 0);
    let before_j = heap.energy_j();
    let mut most_j = before_j;
    while heap.time.as_secs_f64() < 2.0 {
        last = (heap.step().0, last.1 + last.0.factors);
        most_j = most_j.max(heap.energy_j());
    }
    assert!(last.0.contacts > 1000 && last.0.factors == 0, "rapier3d has it: {last:?}");
    assert!(most_j < before_j + 1e-3, "{before_j} J, then {most_j} J");
    let on_floor_n: f64 = (0..wide * wide).map(|k| heap.given_n(k, Partner::Static(0))).sum();
    let weight_n = 0.2 * -GRAVITY.z * (wide * wide * high) as f64;
    assert!((on_floor_n / weight_n - 1.0).abs() < 1e-2, "{on_floor_n} of {weight_n} N");
    for k in 0..wide * wide * high {
        let (place, velocity) = heap.middle(k);
        let layer = (k / wide / wide) as f64;
        let at =
            DVec3::new(0.0605 * (k % wide) as f64, 0.0605 * (k / wide % wide) as f64, HALF_M * (1.0 + 2.0 * layer));
        // a column of three sinks by as much as rapier3d allows
        assert!((place - at).length() < 2e-4 && velocity.length() < 1e-3, "box {k}: {place}, not {at}; {velocity} m/s");
    }
}

#[test]
fn a_user_lifts_a_box_off_a_heap_and_feels_its_weight() {
    let (wide, high) = (10, 3);
    let mut heap = columns(wide, high);
    let lifted = wide * wide * high - 45;
    heap.step();
    let (stiffness_n_m, above_m) = (200.0, 0.1);
    let target = heap.middle(lifted).0 + DVec3::Z * above_m;
    heap.bodies[lifted].user_springs = vec![AnchorSpring {
        by: None,
        anchor: Anchor::Local(DVec3::ZERO),
        target,
        target_velocity: DVec3::ZERO,
        stiffness_n_m,
        damping_n_s_m: 8.0,
    }];
    while heap.time.as_secs_f64() < 2.0 {
        heap.step();
    }
    let stretched_m = 0.2 * -GRAVITY.z / stiffness_n_m;
    let (place, _) = heap.middle(lifted);
    assert!((place - target + DVec3::Z * stretched_m).length() < 1e-4, "{place}, {stretched_m} m below {target}");
    // its neighbours stay
    let (beside, _) = heap.middle(lifted - 1);
    assert!((beside.z - 5.0 * HALF_M).abs() < 2e-4, "{beside}");
}

#[test]
fn what_tumbles_over_a_heap_keeps_its_momentum() {
    let (wide, high) = (10, 3);
    let mut heap = columns(wide, high);
    let spec = rigid(Solid::Box { half_extents_m: DVec3::new(0.1, 0.04, 0.01) }, DVec3::new(0.3, 0.3, 0.35), 0.3);
    let thrown = RigidSpec { gravity: DVec3::ZERO, spin: DVec3::new(2.0, 3.0, 1.0), velocity: DVec3::Z * 0.02, ..spec };
    heap.bodies.push(placed(RigidBody::new(thrown).unwrap(), false));
    let last = heap.bodies.len() - 1;
    let (linear, angular) = heap.bodies[last].agent.momentum();
    while heap.time.as_secs_f64() < 1.0 {
        heap.step();
    }
    let (after, spun) = heap.bodies[last].agent.momentum();
    // single precision, added up over 240 steps
    assert!((after - linear).length() < 1e-5 * linear.length(), "{linear}, then {after}");
    let about_middle = |momentum: DVec3, heap: &mut Table| momentum - heap.middle(last).0.cross(after);
    let (now, before) = (about_middle(spun, &mut heap), angular - DVec3::new(0.3, 0.3, 0.35).cross(linear));
    assert!((now - before).length() < 1e-3 * before.length(), "{before}, then {now}");
}

#[test]
fn what_lies_beside_a_heap_is_solved_as_if_it_lay_alone_and_the_heap_too() {
    let (wide, high) = (10, 3);
    // beyond the heap, and far less than a step's look ahead away from it
    let soft = || cube(DVec3::new(0.3, -0.065, 0.0302), 0.06);
    let mut alone = Table::among(vec![soft()], &[plane(DQuat::IDENTITY, 0.5)]).hurried();
    let mut heap = columns(wide, high);
    heap.bodies.push(soft());
    let last = heap.bodies.len() - 1;
    let (mut with, mut without) = (heap.step().0, alone.step().0);
    while heap.time.as_secs_f64() < 0.5 {
        (with, without) = (heap.step().0, alone.step().0);
    }
    assert!(with.pile_contacts > 1000, "{with:?}");
    assert_eq!((with.contacts - with.pile_contacts, with.factors), (without.contacts, without.factors));
    let (here, there) = (heap.middle(last).0, alone.middle(0).0);
    assert!((here - there).length() < 1e-12, "{here}, alone {there}");
    for k in 0..wide * wide * high {
        let height_m = HALF_M * (1.0 + 2.0 * (k / wide / wide) as f64);
        let (place, _) = heap.middle(k);
        assert!((place.z - height_m).abs() < 2e-4, "box {k}: {place}");
    }
}

#[test]
fn what_flies_into_a_heap_keeps_the_momentum_of_all() {
    let wide = 8;
    // boxes that come together, from gaps of 0.3 mm
    let middle = DVec3::new(3.5, 3.5, 0.5) * 0.0603;
    let free = |k: usize| {
        let at = DVec3::from([k % wide, k / wide % wide, k / wide / wide].map(|v| 0.0603 * v as f64));
        let spec = rigid(Solid::Box { half_extents_m: DVec3::splat(HALF_M) }, at, 0.2);
        let velocity = (middle - at) * 0.5;
        placed(RigidBody::new(RigidSpec { gravity: DVec3::ZERO, velocity, ..spec }).unwrap(), false)
    };
    let mut bodies: Vec<_> = (0..wide * wide * 2).map(free).collect();
    let spec = solid(DVec3::new(0.2, 0.2, 0.16), DVec3::splat(0.06), [3; 3], 1e5);
    let thrown = SoftSpec { gravity: DVec3::ZERO, velocity: DVec3::new(0.3, 0.2, -1.0), ..spec };
    bodies.push(placed(SoftBody::new(thrown).unwrap(), false));
    let mut all = Table::among(bodies, &[]).hurried();
    let momentum = |all: &Table| {
        let each = all.bodies.iter().map(|body| body.agent.momentum());
        each.fold([DVec3::ZERO; 2], |[p, l], (linear, angular)| [p + linear, l + angular])
    };
    let before = momentum(&all);
    let before_j = all.energy_j();
    let (mut was_heap, mut met) = (false, false);
    while all.time.as_secs_f64() < 0.12 {
        let (report, _) = all.step();
        was_heap |= report.pile_contacts > 0;
        met |= was_heap && report.pile_contacts == 0;
    }
    assert!(was_heap && met, "rapier3d has it until it is struck: {was_heap}, {met}");
    assert!(all.energy_j() < before_j + 1e-6, "{before_j} J, then {} J", all.energy_j());
    // impulses act where their places were when a step began, so that moments of a soft body that deforms are off by a share of its way
    for ((now, before), share) in momentum(&all).into_iter().zip(before).zip([1e-5, 1e-2]) {
        assert!((now - before).length() < share * before.length(), "{before}, then {now}");
    }
}
