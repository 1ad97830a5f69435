//! Springs of the user on bodies in a cluster: where they lead them, the load they carry, that no stiffness throws a
//! body.

use crate::bodies::rigid;
use crate::table::{GRAVITY, Table, placed, plane};
use glam::{DQuat, DVec3};
use metachron_contact::AnchorSpring;
use metachron_core::Anchor;
use metachron_geometry::Solid;
use metachron_models::rigid::RigidBody;

const MASS_KG: f64 = 0.5;

/// A cube on the floor that a spring holds at `anchor`.
fn led(anchor: DVec3, target: DVec3, [stiffness_n_m, damping_n_s_m]: [f64; 2]) -> Table {
    let cube = rigid(Solid::Box { half_extents_m: DVec3::splat(0.1) }, DVec3::Z * 0.1, MASS_KG);
    let mut body = placed(RigidBody::new(cube).unwrap(), false);
    let anchor = Anchor::Local(anchor);
    let target_velocity = DVec3::ZERO;
    body.user_springs.push(AnchorSpring { by: None, anchor, target, target_velocity, stiffness_n_m, damping_n_s_m });
    Table::among(vec![body], &[plane(DQuat::IDENTITY, 0.5)])
}

#[test]
fn a_spring_leads_a_body_to_its_target_at_any_stiffness_and_carries_its_weight() {
    for stiffness in [10.0, 1e3, 1e6, 1e9] {
        let target = DVec3::new(1.0, 0.5, 0.8);
        let mut table = led(DVec3::ZERO, target, [stiffness, 2.0 * (stiffness * MASS_KG).sqrt()]);
        while table.time.as_secs_f64() < 6.0 {
            table.step();
        }
        let hang = GRAVITY * (MASS_KG / stiffness);
        let off_m = table.middle(0).0.distance(target + hang);
        assert!(off_m < 1e-3, "stiffness {stiffness}: {off_m} m off"); // the last of a critically damped approach
        let force = table.grips(0)[0].force_n;
        assert!((force + GRAVITY * MASS_KG).length() < 1e-2, "stiffness {stiffness}: {force}");
    }
}

#[test]
fn a_stiff_spring_on_a_corner_does_not_throw_the_body() {
    let (corner, target, stiffness) = (DVec3::splat(0.1), DVec3::new(2.0, 0.0, 1.0), 1e7);
    for damping in [0.0, 2.0 * f64::sqrt(stiffness * MASS_KG)] {
        let mut table = led(corner, target, [stiffness, damping]);
        for _ in 0..600 {
            table.step();
            // the way of 2.2 m within one step of 1/60 s, and no faster
            let m_s = table.middle(0).1.length();
            assert!(m_s < 2.5 * 60.0, "{m_s} m/s");
        }
        let off_m = table.place(0, Anchor::Local(corner)).distance(target);
        assert!(damping == 0.0 || off_m < 1e-2, "{off_m} m off"); // it hangs below its corner and swings out
    }
}
