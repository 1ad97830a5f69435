//! Attachments between clocks, by ledger and by transmission lines.

use super::clocks::{Clocks, GRAVITY};
use glam::DVec3;
use metachron_contact::{AnchorSpring, Law, Link};
use metachron_core::{AgentId, Anchor};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};

const MASS_KG: f64 = 0.1;
const STIFFNESS_N_M: f64 = 200.0;
const LENGTH_M: f64 = 0.1;

fn ball(height_m: f64) -> RigidBody {
    let spec = RigidSpec::free(Solid::Ball { radius_m: 0.02 }, DVec3::Z * height_m, MASS_KG);
    RigidBody::new(RigidSpec { gravity: GRAVITY, ..spec }).unwrap()
}

/// A ball on a spring of the user and one that hangs from it by a link; what law contact has does not matter, they never meet.
fn hang(law: Law, rates_hz: [f64; 2]) -> Clocks {
    let mut clocks = Clocks::new(Law::Ledger, &[]);
    let above = clocks.add(ball(1.0), rates_hz[0]);
    clocks.add(ball(1.0 - LENGTH_M), rates_hz[1]);
    clocks.all[above].hands = vec![AnchorSpring {
        by: None,
        anchor: Anchor::Local(DVec3::ZERO),
        target: DVec3::Z,
        target_velocity: DVec3::ZERO,
        stiffness_n_m: 1000.0,
        damping_n_s_m: 10.0,
    }];
    let anchor = Anchor::Local(DVec3::ZERO);
    let link = Link {
        other: AgentId(1),
        here: anchor,
        there: anchor,
        stiffness_n_m: STIFFNESS_N_M,
        damping_n_s_m: 2.0,
        rest_m: LENGTH_M,
        law,
    };
    clocks.link([0, 1], link);
    clocks
}

#[test]
fn what_hangs_by_an_asynchronous_link_stretches_it_by_its_weight() {
    let tlm = Law::Tlm { stiffness_n_m: STIFFNESS_N_M, damping_n_s_m: 2.0 };
    for law in [Law::Ledger, tlm] {
        for rates in [[240.0, 240.0], [120.0, 480.0], [480.0, 120.0], [1000.0, 60.0], [60.0, 1000.0]] {
            let mut clocks = hang(law, rates);
            clocks.play(5.0, |_, _| ());
            let [above, below] = [0, 1].map(|at| clocks.rigid(at).position.z);
            let stretch_m = above - below - LENGTH_M;
            let wanted_m = MASS_KG * 9.81 / STIFFNESS_N_M;
            let sag_m = 1.0 - above;
            println!("{law:?} {rates:?} {stretch_m} of {wanted_m}, sag {sag_m}");
        }
    }
}
