//! Sheets and ropes whose ε changes while they lie on others and are linked: both name points of a skin that stays.

use crate::bodies::{block, rigid, sheet};
use crate::table::{Placed, Table, placed, spring};
use glam::DVec3;
use metachron_core::{Anchor, Resolution};
use metachron_geometry::Solid;
use metachron_models::rigid::RigidBody;
use metachron_models::soft::{NodeSpacing, Side, SoftBody, SoftShape, SoftSpec};

/// The same body with nodes of this spacing, its lattice as its skin.
fn spaced(spec: SoftSpec, eps_m: f64) -> Placed {
    let held = !spec.held.is_empty();
    let nodes = Some(NodeSpacing { eps_m, range_m: (0.01, 0.2) });
    placed(SoftBody::new(SoftSpec { nodes, ..spec }).unwrap(), held)
}

fn rope(middle: DVec3, half: DVec3, radius_m: f64) -> SoftSpec {
    let path_m = vec![-half, half];
    SoftSpec { shape: SoftShape::Rope { path_m, radius_m, segments: 16 }, ..sheet(middle, 0.0, 1) }
}

#[test]
fn a_box_rests_on_ropes_on_a_cloth_while_their_spacings_change() {
    let cloth = sheet(DVec3::Z * 0.0021, 0.2, 16);
    let along = |x: f64| rope(DVec3::new(x, 0.0, 0.0105), DVec3::Y * 0.08, 0.006);
    let mut bodies = vec![spaced(cloth, 0.02)];
    bodies.extend([-0.02, 0.02].map(|x| spaced(along(x), 0.02)));
    bodies.push(block(DVec3::Z * 0.0475, DVec3::splat(0.03), 0.3, 0.0));
    let mut table = Table::new(bodies).at_rates(120.0, 120.0);
    for (round, cells) in (1..).zip([10.0, 5.0, 16.0, 7.0]) {
        for body in &mut table.bodies[..3] {
            body.agent.set_resolution(Resolution { eps_m: 0.2 / cells, n: 0 });
        }
        let findings = table.play(f64::from(round));
        assert!(findings.rest_m < 0.1e-3, "{cells} cells: {findings:?}");
        assert!((findings.weight - 1.0).abs() < 0.01, "{cells} cells: {findings:?}");
        let (middle, _) = table.middle(3);
        assert!(middle.truncate().length() < 5e-3 && (middle.z - 0.046).abs() < 2e-3, "{cells} cells: {middle}");
    }
}

#[test]
fn a_ball_hangs_from_one_vertex_of_a_rope_at_every_spacing() {
    let (mass_kg, stiffness_n_m, rest_m, vertex) = (0.05, 100.0, 0.02, Anchor::Vertex(11));
    let held = SoftSpec { held: vec![Side::Left, Side::Right], ..rope(DVec3::Z, DVec3::X * 0.2, 0.003) };
    let ball = rigid(Solid::Ball { radius_m: 0.01 }, DVec3::new(0.075, 0.0, 0.96), mass_kg);
    let mut table =
        Table::new(vec![spaced(held, 0.025), placed(RigidBody::new(ball).unwrap(), false)]).at_rates(240.0, 240.0);
    table.link([(0, vertex), (1, Anchor::Local(DVec3::ZERO))], spring(stiffness_n_m, 1.0, rest_m));
    for (round, cells) in (1..).zip([16.0, 4.0, 11.0]) {
        table.bodies[0].agent.set_resolution(Resolution { eps_m: 0.4 / cells, n: 0 });
        while table.time.as_secs_f64() < 3.0 * f64::from(round) {
            table.step();
        }
        let way = table.place(0, vertex) - table.middle(1).0;
        let wanted = rest_m + mass_kg * 9.81 / stiffness_n_m;
        assert!((way.length() - wanted).abs() < 1e-4 && way.z > 0.999 * way.length(), "{cells} cells: {way}");
    }
}
