//! A plate of one's own on a bare table: a ball and a tube lie on it.

use crate::bodies::{rigid, tube};
use crate::plate::Plate;
use crate::table::{GRAVITY, Table, placed};
use glam::DVec3;
use metachron_contact::member::Partner;
use metachron_core::AgentId;
use metachron_geometry::Solid;
use metachron_models::rigid::RigidBody;

#[test]
fn a_plate_of_ones_own_carries_a_ball_and_a_tube_and_feels_their_weight() {
    const WEIGHT_N: f64 = 3.05;
    const PLATE_KG: f64 = 0.5;
    for plate_hz in [60.0, 240.0, 1000.0] {
        let half_m = DVec3::new(0.1, 0.1, 0.005);
        let lying = tube(DVec3::new(-0.05, 0.0, 0.0152), DVec3::Y * 0.08, 0.01);
        let ball_kg = WEIGHT_N / -GRAVITY.z - lying.agent.mass_kg();
        let ball = rigid(Solid::Ball { radius_m: 0.02 }, DVec3::new(0.05, 0.0, 0.0252), ball_kg);
        let others = [placed(RigidBody::new(ball).unwrap(), false), lying];
        let mut bodies = vec![placed(Plate::new(half_m, PLATE_KG), false)];
        bodies.extend(others);
        let mut table = Table::among(bodies, &[]).at_rates(plate_hz, 240.0);
        let findings = table.play(2.5);
        let felt_n = Plate::felt_n(table.middle(0).0.z, PLATE_KG);
        assert!((felt_n - WEIGHT_N).abs() < 0.01 * WEIGHT_N, "{plate_hz} Hz: it feels {felt_n} N");
        assert!(findings.rest_m < 1e-4, "{plate_hz} Hz: they rest {} m deep", findings.rest_m);
        let given: f64 = [1, 2].map(|body| table.given_n(0, Partner::Agent(AgentId(body)))).iter().sum();
        assert!((given + WEIGHT_N).abs() < 0.01 * WEIGHT_N, "{plate_hz} Hz: they press by {given} N");
        for body in [1, 2] {
            let (place, velocity) = table.middle(body);
            assert!(velocity.length() < 1e-3 && place.z > -0.05, "{plate_hz} Hz: body {body} at {place}, {velocity}");
        }
    }
}
