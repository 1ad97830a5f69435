//! The organ of the scene `organ` under a probe and a ball: how far its surface is from that of a finer cage, and its estimate of that.

use crate::bodies::rigid;
use crate::table::{GRAVITY, Table, placed};
use crate::tools::tool;
use glam::{DQuat, DVec3};
use metachron_contact::joint::{Joint, JointKind};
use metachron_core::{AgentId, Body, Snapshot};
use metachron_drawable::{Generator, generate_surface};
use metachron_geometry::{Solid, Triangles};
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::soft::{MaterialLaw, Side, SoftBody, SoftMaterial, SoftShape, SoftSpec};
use std::sync::Arc;

/// Where the probe presses and the ball rests, above the bed, metres.
const PROBED: DVec3 = DVec3::new(0.06, -0.01, 0.042);
const BALL: DVec3 = DVec3::new(-0.04, 0.0, 0.092);
/// The finest cage of these tests, metres.
const FINEST_M: f64 = 0.01;

fn organ(eps_m: f64) -> SoftBody {
    let liver = generate_surface(Generator::Liver, 0, 4000);
    let points = liver.points.iter().map(|point| *point * 0.1).collect();
    let surface = Arc::new(Triangles { points, ..liver });
    let material = SoftMaterial {
        young_pa: 8e3,
        poisson: 0.45,
        density_kg_m3: 1060.0,
        damping_per_s: 2.0,
        damping_s: 0.004,
        law: MaterialLaw::Corotational,
    };
    SoftBody::new(SoftSpec {
        traits: metachron_geometry::ContactTraits::default(),
        shape: SoftShape::Embedded { surface, eps_m, range_m: (FINEST_M, 0.035) },
        nodes: None,
        eps_touched_m: None,
        material,
        position: DVec3::Z * 0.027,
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        held: vec![Side::Bottom],
        friction: 0.2,
        gravity: GRAVITY,
        self_contact: false,
        sleep: false,
    })
    .unwrap()
}

/// The organ after the probe has come to its place, and the ball, which slides along a vertical line, to rest.
struct Pressed {
    surface: Vec<DVec3>,
    nodes: u32,
    residual_m: f64,
}

fn pressed(eps_m: f64) -> Pressed {
    let body = organ(eps_m);
    let nodes = body.nodes();
    let keys = [(0.0, PROBED.with_z(0.08), 0.0), (0.8, PROBED, 0.0)];
    let ball = RigidSpec { gravity: GRAVITY, ..rigid(Solid::Ball { radius_m: 0.012 }, BALL, 0.018) };
    let bodies = vec![
        placed(body, false),
        placed(tool(&keys, 50.0, vec![]), false),
        placed(RigidBody::new(ball).unwrap(), false),
    ];
    let slide = JointKind::Prismatic { axis: DVec3::Z, range_m: None, motor: None };
    let joint = Joint { anchor_b_m: BALL, ..Joint::new(AgentId(2), None, slide) };
    let mut table = Table::new(bodies).at_rates(60.0, 120.0).jointed([joint]);
    while table.time.as_secs_f64() < 1.4 {
        table.step();
    }
    let mut snapshot = Snapshot::default();
    table.bodies[0].agent.write_snapshot(&mut snapshot);
    let Body::Soft(soft) = snapshot.body else { panic!("a soft body") };
    Pressed { surface: soft.positions, nodes, residual_m: snapshot.residual_m }
}

#[test]
fn what_an_organ_says_of_its_error_is_what_its_surface_is_off_by_under_a_probe_and_a_ball() {
    let fine = pressed(FINEST_M);
    // of the scene's range
    for eps_m in [0.0165, 0.0135] {
        let Pressed { surface, nodes, residual_m } = pressed(eps_m);
        assert!(nodes >= 500, "ε {eps_m}: {nodes} nodes");
        for place in [PROBED, BALL] {
            let beside = |at: &DVec3| (*at - place).truncate().length();
            // the part that is seen from above
            let above = fine.surface.iter().zip(&surface).filter(|(at, _)| at.z > 0.025);
            let (at, there) = above.min_by(|(a, _), (b, _)| beside(a).total_cmp(&beside(b))).unwrap();
            let off_m = at.distance(*there);
            assert!(off_m < 2.0 * residual_m, "ε {eps_m} at {place}: off by {off_m} m, said {residual_m} m");
            assert!(residual_m < 3e-3, "ε {eps_m}: {residual_m} m");
        }
    }
}
