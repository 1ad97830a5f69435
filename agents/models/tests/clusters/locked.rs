//! Bodies with locked axes in a heap that rapier3d steps.

use crate::bodies::rigid;
use crate::table::{Table, placed, plane};
use glam::{DQuat, DVec3};
use metachron_geometry::Solid;
use metachron_models::rigid::{Restraint, RigidBody, RigidSpec};

#[test]
fn boxes_of_a_heap_that_cannot_turn_or_leave_their_plane_do_not() {
    let restraint = Restraint {
        locked_translation: [false, true, false],
        locked_rotation: [true, true, true],
        ..Restraint::default()
    };
    let boxes = (0..300).map(|k| {
        let [x, y, layer] = [k % 10, k / 10 % 10, k / 100].map(|v| v as f64);
        let place = DVec3::new(0.0605 * x, 0.0605 * y, 0.0302 + 0.0604 * layer);
        let spec = rigid(Solid::Box { half_extents_m: DVec3::splat(0.03) }, place, 0.2);
        placed(RigidBody::new(RigidSpec { restraint, velocity: DVec3::new(0.1, 0.1, 0.0), ..spec }).unwrap(), false)
    });
    let mut heap = Table::among(boxes.collect(), &[plane(DQuat::IDENTITY, 0.5)]).hurried();
    let mut last = heap.step().0;
    while heap.time.as_secs_f64() < 0.2 {
        last = heap.step().0;
    }
    assert!(last.pile_contacts > 1000, "rapier3d has it: {last:?}");
    for k in 0..300 {
        let (place, velocity) = heap.middle(k);
        let y = 0.0605 * (k / 10 % 10) as f64;
        // rapier3d counts in single precision
        assert!((place.y - y).abs() < 1e-6 && velocity.y == 0.0, "{k}: {place}, {velocity}");
    }
}
