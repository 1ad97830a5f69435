//! What bounds what a tool does to others: the force of its drive, in its first touch too, and the skin of what it has pierced.

use super::pushes::{HALF, JAWS_M, TOP_M, body, cube, pose, tool};
use super::rigid::{G, down, on_floor};
use super::*;
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::soft::SoftBody;
use crate::soft::{SoftMatter, SoftShape, SoftSpec};

/// What a body gave a tool, as its pair tells.
struct Given {
    /// Time and impulse at each state of the body, seconds and N·s.
    at: Vec<(f64, f64)>,
    /// The most that the tool told, N.
    told_n: f64,
}

impl Given {
    fn new() -> Self {
        Self { at: vec![(0.0, 0.0)], told_n: 0.0 }
    }

    fn look(&mut self, stage: &Stage, body: AgentId, tool: AgentId) {
        self.told_n = self.told_n.max(pose(stage, tool).force_n);
        let (seen, last) = (stage.newest(body), self.at[self.at.len() - 1]);
        let sum = seen.pairs.iter().find(|pair| pair.with == tool).map_or(last.1, |pair| pair.impulse_n_s);
        if seen.time.as_secs_f64() > last.0 {
            self.at.push((seen.time.as_secs_f64(), sum));
        }
    }

    /// The most that was given a second in any time of `least_s` or the next longer that its states show, N.
    fn most_n(&self, least_s: f64) -> f64 {
        let mean_n = |(i, &(from_s, from)): (usize, &(f64, f64))| {
            let (to_s, to) = self.at[i..].iter().find(|(to_s, _)| to_s - from_s >= least_s)?;
            Some((to - from) / (to_s - from_s))
        };
        self.at.iter().enumerate().filter_map(mean_n).fold(0.0, f64::max)
    }
}

#[test]
fn a_tool_comes_down_on_what_stands_with_no_more_than_its_drive() {
    const LIMIT_N: f64 = 50.0;
    let rates = [(240.0, 240.0), (240.0, 120.0), (120.0, 240.0), (60.0, 60.0), (600.0, 60.0), (1000.0, 30.0)];
    for (rates, mass_kg) in rates.into_iter().chain([(30.0, 1000.0), (10.0, 1000.0)]).flat_map(|r| [(r, 1.0), (r, 0.2)])
    {
        let (mut stage, place) = (Stage::new(Faults::default()), DVec3::Z * HALF.z);
        let cube = stage.add(RigidBody::new(on_floor(cube(place, mass_kg))).unwrap(), rates.0);
        // at 0.12 m/s, to 20 mm below the top
        let key = |at_s, above_m: f64| down(at_s, DVec3::Z * (TOP_M + above_m), 0.0);
        let tool = stage.add(tool(vec![key(0.0, 0.05), key(0.6, -0.02), key(1.2, -0.02)], LIMIT_N), rates.1);
        let (mut given, mut deep_m) = (Given::new(), 0.0_f64);
        stage.run(1.5, |stage| {
            given.look(stage, cube, tool);
            deep_m = deep_m.max(TOP_M + JAWS_M - pose(stage, tool).tip.z);
        });
        let (told_n, blow_n, aside_m) = (given.told_n, given.most_n(4e-3), body(&stage, cube).position.distance(place));
        println!("{rates:?} {mass_kg} kg: told {told_n} N, {blow_n} N, {deep_m} m deep, {aside_m} m aside");
        assert!(blow_n > LIMIT_N && blow_n < 1.2 * LIMIT_N, "{rates:?} {mass_kg} kg: {blow_n} N over 4 ms");
        // beside a body of 1 kHz it tells of the millisecond in which its 0.3 kg are stopped, 37 N, too
        assert!(told_n < 1.4 * LIMIT_N, "{rates:?} {mass_kg} kg: it tells {told_n} N");
        assert!(deep_m < 1e-3 && aside_m < 2e-4, "{rates:?} {mass_kg} kg: {deep_m} m deep, {aside_m} m aside");
    }
}

#[test]
fn the_strongest_drive_presses_a_light_box_on_the_floor_and_not_into_it() {
    for rates in [(240.0, 240.0), (60.0, 60.0), (600.0, 60.0), (10.0, 1000.0)] {
        let (mut stage, place) = (Stage::new(Faults::default()), DVec3::Z * HALF.z);
        let cube = stage.add(RigidBody::new(on_floor(cube(place, 0.05))).unwrap(), rates.0);
        let key = |at_s, above_m: f64| down(at_s, DVec3::Z * (TOP_M + above_m), 0.0);
        let tool = tool(vec![key(0.0, 0.1), key(2.0, -0.02), key(3.0, -0.02), key(4.0, 0.1)], 1e3);
        stage.add(tool, rates.1);
        let mut aside_m = 0.0_f64;
        stage.run(4.5, |stage| aside_m = aside_m.max(body(stage, cube).position.distance(place)));
        println!("{rates:?}: {aside_m} m aside");
        assert!(aside_m < 1e-3, "{rates:?}: {aside_m} m aside"); // 1000 N on 0.5 N, by a tip of 6 kg
    }
}

#[test]
fn a_tool_that_has_pierced_a_solid_comes_out_without_it() {
    for (rates, depth_m) in [((240.0, 60.0), 0.02), ((60.0, 240.0), 0.035)] {
        let block = SoftSpec {
            shape: SoftShape::Box { size_m: DVec3::new(0.1, 0.1, 0.04), segments: [4, 4, 2] },
            matter: SoftMatter { young_pa: 1e4, poisson: 0.3, density_kg_m3: 1000.0, damping_per_s: 4.0 },
            position: DVec3::new(-0.05, -0.05, 0.0),
            rotation: DQuat::IDENTITY,
            velocity: DVec3::ZERO,
            held: vec![],
            friction: 0.5,
            gravity: DVec3::Z * -G,
            obstacles: on_floor(cube(DVec3::Z, 1.0)).obstacles,
            sleep: false,
        };
        let mut stage = Stage::new(Faults::default());
        let block = stage.add(SoftBody::new(block).unwrap(), rates.0);
        // a jump into it, from 40 mm above, and one out of it
        let key = |at_s, z: f64| down(at_s, DVec3::new(0.003, 0.002, z), 0.0);
        let (high_m, low_m) = (0.08, 0.04 - depth_m);
        let keys = vec![key(0.0, high_m), key(0.02, low_m), key(1.0, low_m), key(1.02, high_m), key(1.6, 0.2)];
        stage.add(tool(keys, 50.0), rates.1);
        let middle_m = |stage: &Stage| {
            let Body::Soft(soft) = &stage.newest(block).body else { panic!("a soft body") };
            soft.positions.iter().map(|at| at.z).sum::<f64>() / soft.positions.len() as f64
        };
        let mut high_m = 0.0_f64;
        stage.run(2.0, |stage| high_m = high_m.max(middle_m(stage)));
        let end_m = middle_m(&stage);
        println!("{rates:?} {depth_m} m: its middle {high_m} m high at most, {end_m} m at the end");
        // it stands 40 mm high
        assert!(high_m < 0.022 && (end_m - 0.02).abs() < 1e-3, "{rates:?} {depth_m} m: {high_m} m, {end_m} m");
    }
}
