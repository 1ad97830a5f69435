//! A box that tips over a tube on the floor and then leans on it, one edge on the floor.
//!
//! Independent answer: both the edge and the tube are on one face of the box, so friction along that has no moment about the edge, and
//! the tube presses with m g a/b, where the edge is a beside the centre of mass and b from the tube along the face.

use super::bodies::floor;
use super::bridge::laid;
use super::meetings::GRAVITY;
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use crate::rod::Tube;
use glam::DVec3;
use metachron_core::{AgentId, Body};
use metachron_geometry::Solid;

const HALF: DVec3 = DVec3::new(0.05, 0.04, 0.02);
const FRICTION: f64 = 0.5;
const TUBE: AgentId = AgentId(0);

/// How a box leans in the end.
#[derive(Debug)]
struct Leaning {
    /// The force of the tube on it in the last half second, and what its moment about the edge asks for, newtons.
    force_n: f64,
    wanted_n: f64,
    /// The deepest overlap since the start and at the end, metres, and the least in the tank, joules.
    depth_m: f64,
    end_m: f64,
    tank_j: f64,
}

/// A box of `mass_kg` laid on a tube on the floor that is `x` beside its middle, for 2 s.
fn lean([tube_hz, box_hz]: [f64; 2], x: f64, mass_kg: f64) -> Leaning {
    let mut stage = Stage::new(Faults::default());
    stage.add(Tube::new(laid(x)).unwrap(), tube_hz);
    let free = RigidSpec::free(Solid::Box { half_extents_m: HALF }, DVec3::Z * 0.04, mass_kg);
    let spec = RigidSpec { gravity: GRAVITY, friction: FRICTION, obstacles: [floor()].into(), ..free };
    let id = stage.add(RigidBody::new(spec).unwrap(), box_hz);
    let mut leaning = Leaning { force_n: 0.0, wanted_n: 0.0, depth_m: 0.0, end_m: 0.0, tank_j: 0.0 };
    let mut steps = 0.0;
    stage.run(2.0, |stage| {
        let tube = stage.newest(TUBE);
        let Some(pair) = tube.pairs.first() else { return };
        leaning.end_m = pair.penetration_m;
        leaning.depth_m = leaning.depth_m.max(pair.penetration_m);
        leaning.tank_j = leaning.tank_j.min(pair.tank_j.unwrap_or(0.0));
        if let (Body::Curve(curve), Body::Rigid(body)) = (&tube.body, &stage.newest(id).body)
            && tube.time.as_secs_f64() > 1.5
        {
            let edge = body.position + body.rotation * DVec3::new(-HALF.x, 0.0, -HALF.z);
            let middle = curve.positions[curve.positions.len() / 2];
            let along = (middle - edge).dot(body.rotation * DVec3::X);
            leaning.wanted_n += mass_kg * GRAVITY.length() * (body.position - edge).x / along;
            leaning.force_n += pair.force_n;
            steps += 1.0;
        }
    });
    Leaning { force_n: leaning.force_n / steps, wanted_n: leaning.wanted_n / steps, ..leaning }
}

/// The floor takes no part in the owner's solve: the box was told free there, and a floor that holds its edge took what the tube gave it
/// back for in place of its own blow. It came 8 to 25 mm deep at all of these rates, and the tube was shot off.
#[test]
fn a_box_that_tips_over_a_tube_leans_on_it() {
    let rates = [[1000.0, 60.0], [240.0, 240.0], [240.0, 60.0], [120.0, 60.0], [60.0, 240.0], [60.0, 60.0]];
    for [tube_hz, box_hz] in rates {
        // nearer to the middle the tube alone would lift the edge, which the weight presses: it is taken for free there, and hops
        for (x, mass_kg, within) in [(0.02, 0.5, 0.2), (0.04, 0.5, 0.04), (0.04, 10.0, 0.04)] {
            let leaning = lean([tube_hz, box_hz], x, mass_kg);
            println!("{tube_hz} : {box_hz} Hz, {mass_kg} kg at {x} m: {leaning:?}");
            let Leaning { force_n, wanted_n, depth_m, end_m, tank_j } = leaning;
            // what friction gives along the face adds 1 − cos of its angle
            let error = (force_n / wanted_n - 1.0).abs();
            assert!(error < within, "{tube_hz} : {box_hz} Hz, {mass_kg} kg at {x} m: {leaning:?}");
            // until who owns the contact hears that the edge has landed, the box falls on
            let slower_s = 1.0 / f64::min(tube_hz, box_hz);
            let late_m = 5e-4 + 1.5 * GRAVITY.length() * slower_s * slower_s;
            assert!(depth_m < late_m && end_m < 5e-3, "{tube_hz} : {box_hz} Hz, {mass_kg} kg at {x} m: {leaning:?}");
            assert!(tank_j > -0.2 * mass_kg, "{tube_hz} : {box_hz} Hz, {mass_kg} kg at {x} m: {leaning:?}");
        }
    }
}
