//! The cost of a solve of a cluster, as medians for tubes, a solid and piles of boxes: first, cold, at rest, and for
//! each factor.
//!
//! `cargo run --release -p metachron-contact --example cluster_cost [part of a name]`
//!
//! First: a new solver, which orders and lays out the matrix. Cold: the same solver again, no impulses of a last step. Rest: again,
//! from the impulses found. A factor: the cold solve less the one at rest, over its factors, with all else that a Newton step takes.

use glam::{DMat3, DVec3};
use metachron_contact::solve::{Block, Contact, Member, Problem, Side, SideTerm, Solver};
use metachron_core::PlainLoop;
use std::time::{Duration, Instant};

const H_S: f64 = 1.0 / 240.0;
const ROUNDS: usize = 15;

/// A member that owns its data.
#[derive(Default)]
struct Body {
    blocks: Vec<Block>,
    free: Vec<DVec3>,
}

struct Scene {
    name: String,
    bodies: Vec<Body>,
    contacts: Vec<Contact>,
}

fn main() {
    println!("scene                        blocks contacts | first ms  cold ms  rest ms | factors  ms a factor");
    let wanted = std::env::args().nth(1).unwrap_or_default();
    let scenes = [tube(100, 120), tube(400, 700), solid(8), boxes(100), boxes(320)];
    for scene in scenes.into_iter().filter(|scene| scene.name.contains(&wanted)) {
        measure(scene);
    }
}

fn measure(mut scene: Scene) {
    let mut solver = Solver::default();
    let mut first = Vec::new();
    let mut cold = Vec::new();
    let mut rest = Vec::new();
    for _ in 0..ROUNDS {
        let mut fresh = Solver::default();
        first.push(timed(&scene, &mut fresh));
        cold.push(timed(&scene, &mut solver));
    }
    let report = solve(&scene, &mut solver, |solution| solution.report);
    let impulses = solve(&scene, &mut solver, |solution| solution.contacts_n_s.clone());
    scene.contacts.iter_mut().zip(impulses).for_each(|(contact, impulse)| contact.warm_n_s = impulse);
    let resting = solve(&scene, &mut solver, |solution| solution.report);
    (0..ROUNDS).for_each(|_| rest.push(timed(&scene, &mut solver)));
    let [first, cold, rest] = [first, cold, rest].map(median);
    let each = (cold - rest) / (report.factors.saturating_sub(resting.factors)).max(1) as f64;
    let blocks: usize = scene.bodies.iter().map(|body| body.free.len()).sum();
    println!(
        "{:28} {blocks:6} {:8} | {first:8.2} {cold:8.2} {rest:8.2} | {:3}, {:2} {each:11.3}{}",
        scene.name,
        scene.contacts.len(),
        report.factors,
        resting.factors,
        if report.miss_m_s < 5e-6 { "" } else { " (unfinished)" },
    );
}

fn solve<T>(scene: &Scene, solver: &mut Solver, of: impl FnOnce(&metachron_contact::solve::Solution) -> T) -> T {
    let members: Vec<_> = scene
        .bodies
        .iter()
        .map(|body| Member {
            blocks: &body.blocks,
            free: &body.free,
            unanswered: &[],
            now: &[],
            share: 1.0,
            response: None,
        })
        .collect();
    let (members, contacts) = (&members, &scene.contacts);
    let problem = Problem { h_s: H_S, members, contacts, rows: &[], threads: &PlainLoop };
    of(solver.solve(&problem).expect("a problem"))
}

fn timed(scene: &Scene, solver: &mut Solver) -> Duration {
    let start = Instant::now();
    solve(scene, solver, |_| ());
    start.elapsed()
}

/// Milliseconds.
fn median(mut times: Vec<Duration>) -> f64 {
    times.sort();
    times[times.len() / 2].as_secs_f64() * 1e3
}

fn touch(sides: [Side; 2], normal: DVec3) -> Contact {
    let first = normal.any_orthonormal_vector();
    Contact {
        sides,
        normal,
        tangents: [first, normal.cross(first)],
        gap_m: 0.0,
        friction: 0.3,
        parting_m_s: 0.0,
        surface_m_s: DVec3::ZERO,
        owed_slip_m: DVec3::ZERO,
        warm_n_s: DVec3::ZERO,
        load_n_s: 0.0,
        overlap_m: 0.0,
    }
}

impl Body {
    fn add(&mut self, row: usize, column: usize, value: DMat3) {
        self.blocks.push(Block { row, column, value });
    }

    /// A spring between two blocks along a direction, and a softer one across it.
    fn spring(&mut self, low: usize, high: usize, stiffness: DMat3) {
        self.add(low, low, stiffness);
        self.add(high, high, stiffness);
        self.add(high, low, stiffness * -1.0);
    }
}

fn along(d: DVec3, stiff: f64, across: f64) -> DMat3 {
    DMat3::from_cols(d * d.x, d * d.y, d * d.z) * (stiff - across) + DMat3::from_diagonal(DVec3::splat(across))
}

/// A coil of a tube on the floor: nodes and the spins of segments by turns, each coupled with the two before it.
fn tube(segments: usize, count: usize) -> Scene {
    let (size, turn) = (2 * segments + 1, 24);
    let mut body = Body::default();
    for block in 0..size {
        let mass = if block % 2 == 0 { 1e-3 } else { 1e-7 };
        body.add(block, block, DMat3::from_diagonal(DVec3::splat(mass)));
        let d = DVec3::new((block as f64 * 0.13).cos(), (block as f64 * 0.13).sin(), 0.0);
        if block >= 2 {
            let stiffness = if block % 2 == 0 { along(d, 0.1, 0.01) } else { along(d, 1e-6, 2e-6) };
            body.spring(block - 2, block, stiffness);
        }
        if block >= 1 {
            body.spring(block - 1, block, along(d, 1e-8, 1e-7));
        }
        body.free.push(DVec3::new(0.1 * d.y, -0.1 * d.x, -0.3 - 0.1 * d.x) * f64::from(u32::from(block % 2 == 0)));
    }
    let at = |segment: usize, weight: f64, arm: DVec3| {
        let k = 2 * segment;
        let terms =
            [SideTerm::weighted(k, 1.0 - weight), SideTerm::weighted(k + 2, weight), SideTerm::spin(k + 1, arm)];
        Side::new(0, &terms).expect("three terms")
    };
    let contacts = (0..count).map(|k| {
        let segment = k * 7 % segments;
        let weight = (k as f64 * 0.618).fract();
        if k % 2 == 0 || segment + turn >= segments {
            return touch([at(segment, weight, DVec3::Z * -0.005), Side::FIXED], DVec3::Z);
        }
        let sides = [at(segment + turn, weight, DVec3::Z * -0.005), at(segment, 1.0 - weight, DVec3::Z * 0.005)];
        touch(sides, DVec3::new(0.3, 0.1, 1.0).normalize())
    });
    Scene { name: format!("tube of {segments} segments"), contacts: contacts.collect(), bodies: vec![body] }
}

/// A cube of so many nodes along an edge, with springs to all neighbours, on the floor.
fn solid(side: usize) -> Scene {
    let place = |i: usize| [i % side, i / side % side, i / side / side].map(|v| v as f64);
    let mut body = Body::default();
    for high in 0..side.pow(3) {
        body.add(high, high, DMat3::from_diagonal(DVec3::splat(2e-3)));
        for low in 0..high {
            let way = DVec3::from_array(place(high)) - DVec3::from_array(place(low));
            if way.length() < 1.8 {
                body.spring(low, high, along(way.normalize(), 2e-3, 0.0));
            }
        }
        body.free.push(DVec3::new(0.1, 0.05, -0.2));
    }
    let contacts = (0..side * side).map(|node| touch([Side::node(0, node), Side::FIXED], DVec3::Z));
    Scene { name: format!("solid of {} nodes", side.pow(3)), contacts: contacts.collect(), bodies: vec![body] }
}

/// Boxes in layers of a wall, each on two of the layer below and beside two of its own.
fn boxes(count: usize) -> Scene {
    let (wide, half) = (20, DVec3::splat(0.05));
    let mut contacts = Vec::new();
    let body = |k: usize| {
        let mut body = Body::default();
        body.add(0, 0, DMat3::from_diagonal(DVec3::splat(0.5)));
        body.add(1, 1, DMat3::from_diagonal(DVec3::splat(0.5 * 0.01 / 6.0)));
        body.free = vec![DVec3::new(0.02 * (k as f64).sin(), 0.01 * (k as f64).cos(), -0.1), DVec3::ZERO];
        body
    };
    let bodies: Vec<_> = (0..count).map(body).collect();
    for k in 0..count {
        let (layer, place) = (k / wide, k % wide);
        for y in [-half.y, half.y] {
            if layer == 0 {
                for x in [-half.x, half.x] {
                    touch_floor(&mut contacts, k, DVec3::new(x, y, -half.z));
                }
                continue;
            }
            // odd layers stand half a box to the right
            let right = layer % 2;
            for (below, middle) in [(place + right, 0.5 * half.x), (place + right, 0.5 * half.x + 0.04)] {
                for (neighbour, sign) in [(below.wrapping_sub(1), -1.0), (below, 1.0)] {
                    if neighbour < wide {
                        let upper = DVec3::new(sign * (middle - 0.02), y, -half.z);
                        let lower = DVec3::new(upper.x - sign * half.x, y, half.z);
                        let sides = [Side::rigid(k, upper), Side::rigid((layer - 1) * wide + neighbour, lower)];
                        contacts.push(touch(sides, DVec3::Z));
                    }
                }
            }
            if place > 0 {
                let arm = DVec3::new(half.x, y, 0.0);
                let sides = [Side::rigid(k, DVec3::new(-half.x, y, 0.0)), Side::rigid(k - 1, arm)];
                contacts.push(touch(sides, DVec3::X));
            }
        }
    }
    Scene { name: format!("{count} boxes"), bodies, contacts }
}

fn touch_floor(contacts: &mut Vec<Contact>, body: usize, arm: DVec3) {
    contacts.push(touch([Side::rigid(body, arm), Side::FIXED], DVec3::Z));
}
