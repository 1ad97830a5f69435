//! Chains that carry a heavy end.

use super::*;

/// Twenty capsules of 0.2 m on ball joints, the last one heavier by `ratio`, hung from the origin along `along`.
fn chain(ratio: f64, along: DVec3) -> Party {
    let turn = DQuat::from_rotation_arc(DVec3::NEG_Z, along);
    let solid = Solid::Capsule { radius_m: 0.03, half_height_m: 0.06 };
    let links = (0..20).map(|i| RigidSpec {
        rotation: turn,
        mass_kg: if i == 19 { ratio } else { 1.0 },
        ..spec(solid.clone(), along * (0.1 + 0.2 * f64::from(i)))
    });
    let joints = (0..20_u32).map(|i| Joint {
        anchor_a_m: DVec3::Z * 0.1,
        anchor_b_m: if i == 0 { DVec3::ZERO } else { DVec3::Z * -0.1 },
        ..Joint::new(AgentId(i), i.checked_sub(1).map(AgentId), JointKind::Spherical)
    });
    Party::jointed(links, joints)
}

/// The widest gap of a joint, metres.
fn stretch(party: &Party) -> f64 {
    let (mut widest, mut end) = (0.0_f64, DVec3::ZERO);
    for i in 0..party.bodies.len() {
        let state = party.state(i);
        widest = widest.max((state.position + state.rotation * DVec3::Z * 0.1).distance(end));
        end = state.position - state.rotation * DVec3::Z * 0.1;
    }
    widest
}

#[test]
fn a_chain_that_hangs_or_swings_does_not_stretch_whatever_its_end_weighs() {
    for along in [DVec3::NEG_Z, DVec3::X] {
        for ratio in [1.0, 100.0, 1000.0] {
            for dt in [1.0 / 60.0, 1.0 / 240.0] {
                let mut party = chain(ratio, along);
                let (before, scale) = (party.energy_j(), (190.0 * 0.2 + 20.0 * 0.2 * ratio) * G);
                let mut worst = 0.0_f64;
                for _ in 0..(3.0_f64 / dt).round() as u32 {
                    party.step(dt);
                    worst = worst.max(stretch(&party));
                }
                // a thousandth is what a reader sees; the corrections leave far less even where the end whips
                assert!(worst < 1e-4, "ratio {ratio} along {along}, dt {dt}: stretched by {worst:e} m");
                let gained = (party.energy_j() - before) / scale;
                assert!(gained < 1e-3, "ratio {ratio} along {along}, dt {dt}: gained {gained:e} of the fall");
            }
        }
    }
}
