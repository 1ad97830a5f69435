//! The cost of a whole step of a cluster with its search: the mean of each of some scenes at 60 Hz while it lands and at rest.
//!
//! `cargo run --release -p metachron-models --example cluster_steps [part of a name]`

#[path = "../tests/clusters/bodies.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod bodies;
#[path = "../tests/clusters/scenes.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod scenes;
#[path = "../tests/clusters/table.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod table;

use bodies::{block, rope, solid};
use glam::DVec3;
use metachron_models::soft::{Side, SoftBody, SoftMaterial, SoftShape, SoftSpec};
use std::time::Instant;
use table::{Placed, Table, placed};

/// A scene, and how long it plays: it rests in the second half.
struct Played {
    name: &'static str,
    table: fn() -> Table,
    seconds: f64,
}

const LIST: [Played; 15] = [
    Played { name: "ten boxes", table: || scenes::scene("ten boxes"), seconds: 1.5 },
    Played { name: "box, two ropes, slab", table: || scenes::scene("box on two ropes on a slab"), seconds: 1.5 },
    Played { name: "three cloths, cube", table: || scenes::scene("cube on three cloths"), seconds: 1.5 },
    Played { name: "18 ropes", table: || ropes(6, 3), seconds: 0.5 },
    Played { name: "40 ropes", table: || ropes(10, 4), seconds: 0.5 },
    Played { name: "100 boxes", table: || pile(5, 4), seconds: 0.7 },
    Played { name: "320 boxes", table: || pile(8, 5), seconds: 0.7 },
    Played { name: "held block, ball", table: held_block, seconds: 1.5 },
    Played { name: "24 ropes, apart", table: apart, seconds: 0.5 },
    Played { name: "soft cube of 343, floor", table: || Table::new(vec![organ(6)]), seconds: 0.7 },
    Played { name: "soft cube of 729, floor", table: || Table::new(vec![organ(8)]), seconds: 0.7 },
    Played { name: "soft cube of 1331, floor", table: || Table::new(vec![organ(10)]), seconds: 0.7 },
    Played {
        name: "soft cube of 1331, plate",
        table: || Table::new(vec![organ(10), block(DVec3::Z * 0.1056, DVec3::new(0.05, 0.05, 0.005), 0.2, 0.0)]),
        seconds: 0.7,
    },
    Played {
        name: "soft cube of 1331, slides",
        table: || {
            let spec = solid(DVec3::Z * 0.0502, DVec3::splat(0.1), [10; 3], 12e3);
            let material = SoftMaterial { poisson: 0.4, density_kg_m3: 1050.0, damping_per_s: 0.2, ..spec.material };
            Table::new(vec![placed(
                SoftBody::new(SoftSpec { material, velocity: DVec3::X * 1.0, ..spec }).unwrap(),
                false,
            )])
        },
        seconds: 0.4,
    },
    Played { name: "caged bar held, ball", table: caged, seconds: 0.7 },
];

fn main() {
    println!(
        "scene                    contacts |  landing ms, factors |  at rest ms, median, factors | solves, unfinished"
    );
    let wanted = std::env::args().nth(1).unwrap_or_default();
    LIST.iter().filter(|played| played.name.contains(&wanted)).for_each(measure);
}

fn measure(played: &Played) {
    let mut table = (played.table)();
    let [mut times, mut factors] = [[vec![], vec![]], [vec![], vec![]]];
    let (mut contacts, mut solves, mut unfinished) = (0, 0, 0);
    while table.time.as_secs_f64() < played.seconds {
        let half = usize::from(table.time.as_secs_f64() > 0.5 * played.seconds);
        let started = Instant::now();
        let (report, _) = table.step();
        times[half].push(started.elapsed().as_secs_f64() * 1e3);
        factors[half].push(f64::from(report.factors));
        contacts = contacts.max(report.contacts);
        solves += report.solves;
        unfinished += report.unfinished;
    }
    let mean = |list: &[f64]| list.iter().sum::<f64>() / list.len() as f64;
    let mut sorted = times[1].clone();
    sorted.sort_by(f64::total_cmp);
    println!(
        "{:25} {contacts:7} | {:11.3}   {:6.2} | {:11.3} {:7.3}  {:6.2}  | {solves:5} {unfinished:4}",
        played.name,
        mean(&times[0]),
        mean(&factors[0]),
        mean(&times[1]),
        sorted[sorted.len() / 2],
        mean(&factors[1]),
    );
}

/// Layers of ropes, each across the one below.
fn ropes(count: usize, layers: usize) -> Table {
    let half_m = 0.015 * count as f64 + 0.02;
    let mut list = vec![];
    for layer in 0..layers {
        for at in 0..count {
            let place_m = (at as f64 - 0.5 * (count - 1) as f64) * 0.03;
            let height = DVec3::Z * (0.0061 + 0.0121 * layer as f64);
            let (along, across) = if layer % 2 == 0 { (DVec3::X, DVec3::Y) } else { (DVec3::Y, DVec3::X) };
            list.push(long_rope(height + across * place_m, along * half_m, 2 * count as u32 + 2));
        }
    }
    Table::new(list)
}

/// Ropes of ten segments side by side: they touch the floor alone.
fn apart() -> Table {
    Table::new(
        (0..24).map(|k| rope(DVec3::new(0.03 * f64::from(k), 0.0, 0.0061), DVec3::Y * 0.1, 0.006, 1e6)).collect(),
    )
}

fn long_rope(middle: DVec3, half: DVec3, segments: u32) -> Placed {
    let shape = SoftShape::Rope { path_m: vec![-half, half], radius_m: 0.006, segments };
    let spec = SoftSpec { shape, ..solid(middle, DVec3::ONE, [1; 3], 1e6) };
    placed(SoftBody::new(SoftSpec { position: middle, ..spec }).unwrap(), false)
}

/// Layers of boxes, each box on four of the layer below.
fn pile(wide: usize, layers: usize) -> Table {
    let mut list = vec![];
    for k in 0..wide * wide * layers {
        let [x, y, layer] = [k % wide, k / wide % wide, k / wide / wide].map(|v| v as f64);
        let shift = 0.03 * (layer % 2.0);
        let middle = DVec3::new(0.065 * x + shift, 0.065 * y + shift, 0.0302 + 0.0604 * layer);
        list.push(block(middle, DVec3::splat(0.03), 0.5, 0.05 * (12.9898 * (k + 1) as f64).sin()));
    }
    Table::new(list)
}

/// A cube of 0.1 m of so many cells along each edge, of the stuff of an organ, on the floor.
fn organ(cells: u32) -> Placed {
    let spec = solid(DVec3::Z * 0.0502, DVec3::splat(0.1), [cells; 3], 12e3);
    let material = SoftMaterial { poisson: 0.4, density_kg_m3: 1050.0, damping_per_s: 0.2, ..spec.material };
    placed(SoftBody::new(SoftSpec { material, ..spec }).unwrap(), false)
}

/// The inside of a fine skin, in a cage of 800 vertices, grown to its bed, under a ball.
fn caged() -> Table {
    let spec = solid(DVec3::new(0.0, 0.0, 0.03), DVec3::new(0.18, 0.12, 0.06), [18, 12, 6], 1.2e4);
    let surface = std::sync::Arc::new(spec.shape.skin().unwrap());
    let shape = SoftShape::Embedded { surface, eps_m: 0.013, range_m: (0.013, 0.013) };
    let held = placed(SoftBody::new(SoftSpec { shape, held: vec![Side::Bottom], ..spec }).unwrap(), true);
    Table::new(vec![held, block(DVec3::new(0.01, 0.0, 0.07), DVec3::new(0.02, 0.02, 0.008), 0.03, 0.1)])
}

/// A block of 280 vertices, grown to its bed, under a ball.
fn held_block() -> Table {
    let spec = solid(DVec3::new(0.0, 0.0, 0.03), DVec3::new(0.18, 0.12, 0.06), [9, 6, 3], 1.2e4);
    let held = placed(SoftBody::new(SoftSpec { held: vec![Side::Bottom], ..spec }).unwrap(), true);
    Table::new(vec![held, block(DVec3::new(0.01, 0.0, 0.07), DVec3::new(0.02, 0.02, 0.008), 0.03, 0.1)])
}
