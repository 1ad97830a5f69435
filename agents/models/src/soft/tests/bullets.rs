//! What flies at a soft body is met by it, however far it flies in a step of the body's.

use super::*;
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use metachron_geometry::Solid;

/// A ball of 2 cm and 50 g that flies down on the origin from one metre above.
fn bullet(speed_m_s: f64) -> RigidBody {
    let solid = Solid::Ball { radius_m: 0.02 };
    let free = RigidSpec::free(solid, DVec3::Z, 0.05);
    RigidBody::new(RigidSpec { velocity: DVec3::Z * -speed_m_s, ..free }).unwrap()
}

/// A block of 30 × 30 × 10 cm that nothing holds.
fn block() -> SoftSpec {
    let shape = SoftShape::Box { size_m: DVec3::new(0.3, 0.3, 0.1), segments: [6, 6, 2] };
    SoftSpec { position: DVec3::new(-0.15, -0.15, -0.05), ..spec(shape) }
}

/// A sheet of 50 × 50 cm held at two edges.
fn target() -> SoftSpec {
    let shape = SoftShape::Sheet { size_m: [0.5, 0.5], thickness_m: 0.002, segments: [8, 8] };
    let matter = SoftMatter { young_pa: 1e6, density_kg_m3: 1050.0, ..MATTER };
    let position = DVec3::new(-0.25, -0.25, 0.0);
    SoftSpec { matter, position, held: vec![Side::Left, Side::Right], ..spec(shape) }
}

#[test]
fn a_bullet_does_not_pass_through_a_soft_body_at_any_rates() {
    for (name, made, speed_m_s) in [("block", block(), 30.0), ("sheet", target(), 50.0)] {
        for rates in [(30.0, 240.0), (240.0, 60.0), (60.0, 240.0), (240.0, 240.0), (1000.0, 1000.0)] {
            let mut stage = Stage::new(Faults::default());
            stage.add(SoftBody::new(made.clone()).unwrap(), rates.0);
            let ball = stage.add(bullet(speed_m_s), rates.1);
            let start = stage.momentum();
            let mut drift = 0.0_f64;
            stage.run(0.1, |stage| drift = drift.max((stage.momentum() - start).length() / start.length()));
            let ball = stage.settled(ball, 0.1).state;
            println!("{name} {rates:?}: at {:.3} by {:.3}, drift {drift:e}", ball.position, ball.velocity);
            assert!(ball.velocity.z > 0.0, "{name} {rates:?}: it went on to {}", ball.position);
            // the momentum of a sheet that is held is not its own
            assert!(name == "sheet" || drift < 1e-9, "{name} {rates:?}: momentum drifts by {drift}");
        }
    }
}
