//! A closed system: three balls and two tubes in a ring of springs, five clocks, nothing from outside.

use super::super::reference_spec;
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use crate::rod::Tube;
use crate::rod::TubeSpec;
use glam::{DQuat, DVec3};
use metachron_contact::audit::{Audit, Member, audit, settled};
use metachron_contact::{Law, Link};
use metachron_core::{AgentId, Anchor, Body, SimTime};
use metachron_geometry::Solid;

const RATES_HZ: [f64; 5] = [1000.0, 500.0, 240.0, 120.0, 60.0];
const TUBE_M: f64 = 0.4;
/// Stiffness and length at rest of the springs.
const SPRING: (f64, f64) = (4.0, 0.05);
/// Clocks agree to within this, seconds: sixtieths are not whole nanoseconds.
const SAME_S: f64 = 1e-5;

struct Ring {
    stage: Stage,
    ids: [AgentId; 5],
    links: Vec<(AgentId, Link)>,
    /// Mass per length and rotary inertia of the tubes.
    weight: (f64, f64),
}

/// Ball, tube, ball, tube, ball, each on a spring to the next; the balls fly inwards. Clocks are handed on by `turn` places.
fn ring(turn: usize) -> Ring {
    let mut stage = Stage::new(Faults::default());
    let rate = |i: usize| RATES_HZ[(i + turn) % RATES_HZ.len()];
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / 5.0;
    let at = |i: usize| DVec3::new(libm::cos(angle(i)), libm::sin(angle(i)), 0.1 * (i as f64 - 2.0)) * 0.3;
    let along = |i: usize| DVec3::new(-libm::sin(angle(i)), libm::cos(angle(i)), 0.2).normalize();
    let base = TubeSpec { friction: 0.3, ..reference_spec(1e6, 12) };
    let weight = (base.section.mass_per_length_kg_m, base.section.rotary_kg_m);
    let ids = [0, 1, 2, 3, 4].map(|i| {
        if i % 2 == 1 {
            let half = along(i) * (0.5 * TUBE_M);
            let path_m = vec![at(i) - half, at(i) + half];
            return stage.add(Tube::new(TubeSpec { path_m, ..base.clone() }).unwrap(), rate(i));
        }
        let k = (i / 2) as f64;
        stage.add(RigidBody::new(ball(at(i), k)).unwrap(), rate(i))
    });
    let (ball, start, end) = (Anchor::Local(DVec3::ZERO), Anchor::Arc(0.0), Anchor::Arc(TUBE_M));
    let ties = [(0, ball, 1, start), (1, end, 2, ball), (2, ball, 3, start), (3, end, 4, ball), (4, ball, 0, ball)];
    let (stiffness_n_m, rest_m) = SPRING;
    let links = ties.map(|(a, here, b, there)| {
        let other = ids[b];
        (ids[a], Link { other, here, there, stiffness_n_m, damping_n_s_m: 0.0, rest_m, law: Law::Cluster })
    });
    links.iter().for_each(|(of, link)| stage.link(*of, *link));
    Ring { stage, ids, links: links.to_vec(), weight }
}

fn ball(at: DVec3, k: f64) -> RigidSpec {
    RigidSpec {
        solid: Solid::Ball { radius_m: 0.05 },
        position: at,
        rotation: DQuat::IDENTITY,
        velocity: at * -1.5 + DVec3::new(0.1, -0.05, 0.2) * (k - 1.0),
        spin: DVec3::new(2.0, 1.0, -1.0) * k,
        mass_kg: [1.0, 0.5, 0.2][k as usize],
        restitution: 0.7,
        friction: 0.3,
        gravity: DVec3::ZERO,
        obstacles: [].into(),
        joints: [].into(),
        sleep: false,
    }
}

impl Ring {
    /// Sums at the time `at`, everything delivered, the springs' energy with them.
    fn common(stage: &Stage, ids: [AgentId; 5], links: &[(AgentId, Link)], weight: (f64, f64), at: SimTime) -> Audit {
        let (mass_per_length_kg_m, rotary_kg_m) = weight;
        let members = ids.map(|id| Member { id, snapshot: stage.newest(id), mass_per_length_kg_m, rotary_kg_m });
        let mut sum = audit(&members, at, &mut |_, _| 0.0);
        let point = |id: AgentId, anchor| {
            let member = &members[id.0 as usize];
            let body = settled(member, &members, at).map_or(member.snapshot.body.clone(), Body::Rigid);
            body.point(anchor).expect("a point of it").0
        };
        for (of, link) in links {
            let stretch = point(*of, link.here).distance(point(link.other, link.there)) - link.rest_m;
            sum.energy_j += 0.5 * link.stiffness_n_m * stretch * stretch;
        }
        sum
    }
}

/// Momentum with everything delivered stays to rounding, so that as told it strays no farther than what is on its way, and
/// energy at a common time never rises by more than a hundredth.
#[test]
fn a_closed_system_of_five_clocks_keeps_its_momentum_and_gains_no_energy() {
    for turn in 0..5 {
        let Ring { mut stage, ids, links, weight } = ring(turn);
        let start = Ring::common(&stage, ids, &links, weight, SimTime::ZERO);
        let size = 0.45 * (1.0 + 0.5 + 0.2); // kg·m/s, of the balls
        let (mut drift, mut peak, mut looks) = (0.0_f64, 0.0_f64, 0);
        stage.run(6.0, |stage| {
            drift = drift.max((stage.momentum() - start.momentum).length() / size);
            let times = ids.map(|id| stage.newest(id).time);
            let (first, last) = (*times.iter().min().unwrap(), *times.iter().max().unwrap());
            if last.secs_after(first) < SAME_S {
                let sum = Ring::common(stage, ids, &links, weight, first);
                drift = drift.max(sum.momentum.distance(start.momentum) / size);
                peak = peak.max(sum.energy_j / start.energy_j);
                looks += 1;
            }
        });
        println!("turn {turn}: drift {drift:e}, peak {peak}, {looks} looks");
        // sums of a hundred terms through factors of condition 1e4, ten thousand times
        assert!(looks > 100 && drift < 1e-10, "turn {turn}: momentum drifts by {drift:e} of {size} kg m/s");
        assert!(peak < 1.01, "turn {turn}: energy rises to {peak} of the start");
    }
}
