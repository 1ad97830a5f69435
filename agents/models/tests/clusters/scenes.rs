//! Fifteen scenes of bodies on each other, at equal steps and at unlike ones.

use crate::bodies::{block, cloth, cube, rope, slab, solid, tube};
use crate::table::{Placed, Table, placed};
use glam::DVec3;
use metachron_models::soft::{SoftBody, SoftSpec};

/// The height of the slab's top, metres.
const TOP_M: f64 = 0.0502;
const ALONG_Y: DVec3 = DVec3::new(0.0, 0.08, 0.0);
const ALONG_X: DVec3 = DVec3::new(0.08, 0.0, 0.0);

fn at(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn small_box(x: f64, y: f64, z: f64, mass_kg: f64) -> Placed {
    block(at(x, y, z), DVec3::splat(0.03), mass_kg, 0.0)
}

fn two(of: impl Fn(f64) -> Placed) -> [Placed; 2] {
    [of(-0.02), of(0.02)]
}

pub const NAMES: [&str; 15] = [
    "box on two ropes on a slab",
    "box on two ropes on a held slab",
    "box on two tubes on a slab",
    "box on two tubes on a held slab",
    "cube on a tube on a slab",
    "cube on a tube on a held slab",
    "cube on a tube on a slab at 1 m/s",
    "cube on three cloths",
    "box between two soft blocks",
    "plate on crossed tubes",
    "two boxes on a cloth",
    "100 : 1 on a slab",
    "1000 : 1 on a slab",
    "soft plate on two ropes on a cloth",
    "ten boxes",
];

pub fn scene(name: &str) -> Table {
    let ropes = |z: f64| two(|x| rope(at(x, 0.0, z), ALONG_Y, 0.006, 1e6));
    let tubes = |z: f64| two(|x| tube(at(x, 0.0, z), ALONG_Y, 0.01));
    let mut list = vec![];
    match name {
        "box on two ropes on a slab" | "box on two ropes on a held slab" => {
            list.push(slab(name.contains("held"), 1e5));
            list.extend(ropes(TOP_M + 0.0065));
            list.push(small_box(0.0, 0.0, TOP_M + 0.0125 + 0.04, 0.3));
        }
        "box on two tubes on a slab" | "box on two tubes on a held slab" => {
            list.push(slab(name.contains("held"), 1e5));
            list.extend(tubes(TOP_M + 0.0105));
            list.push(small_box(0.0, 0.0, TOP_M + 0.0205 + 0.04, 0.3));
        }
        "cube on a tube on a slab" | "cube on a tube on a held slab" => {
            list.push(slab(name.contains("held"), 1e5));
            list.push(tube(at(0.0, 0.0, TOP_M + 0.0105), ALONG_Y, 0.01));
            list.push(cube(at(0.0, 0.0, TOP_M + 0.0205 + 0.05), 0.06));
        }
        "cube on a tube on a slab at 1 m/s" => {
            list.push(slab(false, 1e5));
            list.push(tube(at(0.0, 0.0, TOP_M + 0.0105), ALONG_Y, 0.01));
            let spec = solid(at(0.0, 0.0, TOP_M + 0.0205 + 0.034), DVec3::splat(0.06), [3; 3], 1e5);
            let spec = SoftSpec { velocity: DVec3::NEG_Z, ..spec };
            list.push(placed(SoftBody::new(spec).unwrap(), false));
        }
        "cube on three cloths" => {
            list.push(cloth(at(0.0, 0.0, 0.0022), 0.16, 8));
            list.push(cloth(at(0.004, 0.003, 0.0066), 0.16, 8));
            list.push(cloth(at(-0.003, 0.002, 0.011), 0.16, 8));
            list.push(cube(at(0.0, 0.0, 0.063), 0.06));
        }
        "box between two soft blocks" => {
            list.push(cube(at(0.0, 0.0, 0.0402), 0.08));
            list.push(small_box(0.003, 0.002, 0.1204, 0.3));
            list.push(cube(at(0.0, 0.0, 0.2204), 0.08));
        }
        "plate on crossed tubes" => {
            list.push(tube(at(0.0, 0.0, 0.0102), ALONG_X, 0.01));
            list.push(tube(at(0.0, 0.0, 0.0304), ALONG_Y, 0.01));
            list.push(block(at(0.0, 0.0, 0.0654), DVec3::new(0.06, 0.06, 0.005), 0.4, 0.0));
        }
        "two boxes on a cloth" => {
            list.push(cloth(at(0.0, 0.0, 0.0022), 0.16, 8));
            list.push(small_box(0.0, 0.0, 0.0544, 0.5));
            list.push(block(at(0.002, 0.001, 0.1244), DVec3::splat(0.03), 0.5, 0.35));
        }
        "100 : 1 on a slab" | "1000 : 1 on a slab" => {
            let heavy = name.starts_with("1000");
            list.push(slab(false, if heavy { 1e6 } else { 1e5 }));
            list.push(small_box(0.0, 0.0, TOP_M + 0.035, 0.01));
            list.push(block(at(0.0, 0.0, TOP_M + 0.1), DVec3::splat(0.03), if heavy { 10.0 } else { 1.0 }, 0.35));
        }
        "soft plate on two ropes on a cloth" => {
            list.push(cloth(at(0.0, 0.0, 0.0022), 0.16, 8));
            list.extend(ropes(0.0044 + 0.0065));
            let spec = solid(at(0.0, 0.0, 0.0309), DVec3::new(0.08, 0.08, 0.008), [5, 5, 1], 1e5);
            list.push(placed(SoftBody::new(spec).unwrap(), false));
        }
        "ten boxes" => {
            for i in 0..10 {
                let middle = at(0.001 * f64::from(i % 3), 0.0, 0.03 + 0.0605 * f64::from(i));
                list.push(block(middle, DVec3::splat(0.03), 0.5, 0.3 * f64::from(i)));
            }
        }
        _ => panic!("no scene of the name {name}"),
    }
    Table::new(list)
}

#[test]
fn scenes_at_60_hz() {
    let rates: Vec<Vec<f64>> = std::env::var("RATES").map_or(vec![vec![60.0, 60.0]], |list| {
        list.split(',').map(|pair| pair.split(':').map(|hz| hz.parse().unwrap()).collect()).collect()
    });
    for name in NAMES {
        if std::env::var("ONLY").is_ok_and(|only| !name.starts_with(&only)) {
            continue;
        }
        for pair in &rates {
            let started = std::time::Instant::now();
            let f = scene(name).at_rates(pair[0], pair[1]).play(1.5);
            println!(
                "{name:36} {:4}:{:4} land {:.4} rest {:.4} mm gain {:8.5} mJ weight {:.4} factors {:.2} at rest {:.2} cut {} contacts {} z {:.4} {:?}",
                pair[0],
                pair[1],
                f.landing_m * 1e3,
                f.rest_m * 1e3,
                f.gain_j * 1e3,
                f.weight,
                f64::from(f.factors) / f64::from(f.steps),
                f.factors_at_rest,
                f.cut,
                f.contacts,
                f.highest_m,
                started.elapsed()
            );
        }
    }
}
