//! What falls on something thin that lies on the floor, at rates at which it is on the floor before it hears of the thin thing.

use super::meetings::floor;
use super::*;
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use crate::rod::Tube;
use crate::rod::{Material, Section, TubeSpec};
use metachron_geometry::Solid;

/// A cloth of 4 mm on the floor.
fn cloth() -> SoftSpec {
    SoftSpec {
        matter: SoftMatter { young_pa: 1e6, poisson: 0.3, density_kg_m3: 1050.0, damping_per_s: 3.0 },
        position: DVec3::new(-0.15, -0.1, 0.003),
        gravity: G,
        friction: 0.5,
        obstacles: [floor()].into(),
        ..spec(SoftShape::Sheet { size_m: [0.3, 0.2], thickness_m: 0.004, segments: [8, 6] })
    }
}

/// A rigid cube of 6 cm, its middle so high above the floor.
fn brick(height_m: f64, mass_kg: f64) -> RigidSpec {
    let solid = Solid::Box { half_extents_m: DVec3::splat(0.03) };
    RigidSpec {
        gravity: G,
        friction: 0.5,
        obstacles: [floor()].into(),
        ..RigidSpec::free(solid, DVec3::Z * height_m, mass_kg)
    }
}

/// A soft block of 5 cm, its bottom so high above the floor.
fn block(height_m: f64) -> SoftSpec {
    SoftSpec {
        matter: SoftMatter { young_pa: 5e4, poisson: 0.3, density_kg_m3: 1050.0, damping_per_s: 3.0 },
        position: DVec3::new(-0.05, -0.05, height_m),
        gravity: G,
        friction: 0.5,
        obstacles: [floor()].into(),
        ..spec(SoftShape::Box { size_m: DVec3::new(0.1, 0.1, 0.05), segments: [4, 4, 2] })
    }
}

/// The deepest overlap and the force of the pairs that `owner` keeps.
fn pressed(stage: &Stage, owner: AgentId) -> (f64, f64) {
    let pairs = &stage.newest(owner).pairs;
    (pairs.iter().map(|p| p.penetration_m).fold(0.0, f64::max), pairs.iter().map(|p| p.force_n).sum())
}

/// It was seen to stand on the floor where what lifts it off had carried it, and each later push was taken for one before its fall.
#[test]
fn a_box_that_falls_on_a_cloth_on_the_floor_lies_on_the_cloth() {
    for rates in [(60.0, 60.0), (60.0, 240.0), (240.0, 60.0), (240.0, 240.0), (100.0, 120.0)] {
        let mut stage = Stage::new(Faults::default());
        stage.at_once = true;
        let cloth = stage.add(SoftBody::new(cloth()).unwrap(), rates.0);
        let brick = stage.add(RigidBody::new(brick(0.06, 0.3)).unwrap(), rates.1);
        stage.run(1.0, |_| {});
        let mut depth_m = 0.0_f64;
        stage.run(2.0, |stage| depth_m = depth_m.max(pressed(stage, cloth).0));
        let z = stage.settled(brick, 2.0).state.position.z;
        println!("{rates:?}: {z} {depth_m}");
        assert!((z - 0.034).abs() < 2e-4, "{rates:?}: the box is at {z}");
        assert!(depth_m < 2e-4, "{rates:?}: {depth_m} m deep");
    }
}

/// Where the clocks slip the cloth is at a time at which the box, which is ahead, has not come down on the floor yet. It saw the box lie
/// there, 4 mm deep, and left it there.
#[test]
fn a_box_whose_clock_slips_does_not_fall_through_a_cloth_on_the_floor() {
    for (rates, height_m) in
        [((60.0, 61.0), 0.0845), ((61.0, 60.0), 0.0845), ((60.0, 61.0), 0.06), ((60.0, 62.0), 0.0845)]
    {
        let mut stage = Stage::new(Faults::default());
        stage.at_once = true;
        let cloth = stage.add(SoftBody::new(cloth()).unwrap(), rates.0);
        let brick = stage.add(RigidBody::new(brick(height_m, 0.3)).unwrap(), rates.1);
        let (mut depth_m, mut tank_j) = (0.0_f64, 0.0_f64);
        stage.run(2.0, |stage| {
            depth_m = depth_m.max(pressed(stage, cloth).0);
            tank_j = stage.newest(cloth).pairs.iter().filter_map(|pair| pair.tank_j).fold(tank_j, f64::min);
        });
        let z = stage.settled(brick, 2.0).state.position.z;
        println!("{rates:?} from {height_m}: {z} {depth_m} {tank_j}");
        assert!((z - 0.034).abs() < 2e-4, "{rates:?} from {height_m}: the box is at {z}");
        assert!(depth_m < 5e-4, "{rates:?} from {height_m}: {depth_m} m deep");
        assert!(tank_j > -0.05, "{rates:?} from {height_m}: {tank_j} J");
    }
}

/// A rope of 6 mm on the floor.
fn rope() -> SoftSpec {
    SoftSpec {
        matter: SoftMatter { young_pa: 1e6, poisson: 0.3, density_kg_m3: 1050.0, damping_per_s: 3.0 },
        gravity: G,
        friction: 0.5,
        obstacles: [floor()].into(),
        ..spec(SoftShape::Rope {
            path_m: vec![DVec3::new(-0.15, 0.0, 0.0065), DVec3::new(0.15, 0.0, 0.0065)],
            radius_m: 0.006,
            segments: 8,
        })
    }
}

/// The deepest overlap of two while `upper` comes down on `lower` and in the end, and the last height of the middle of `upper`.
fn comes_down(lower: impl Agent + 'static, upper: impl Agent + 'static, rates: (f64, f64)) -> ([f64; 2], f64) {
    let mut stage = Stage::new(Faults::default());
    stage.at_once = true;
    let [lower, upper] = [stage.add(lower, rates.0), stage.add(upper, rates.1)];
    let deep = |stage: &Stage| pressed(stage, lower).0.max(pressed(stage, upper).0);
    let mut depth_m = 0.0_f64;
    stage.run(2.0, |stage| depth_m = depth_m.max(deep(stage)));
    let bounds = stage.newest(upper).bounds.unwrap();
    ([depth_m, deep(&stage)], 0.5 * (bounds.low + bounds.high).z)
}

/// It lies on the floor before it hears of what lies under it, and was then expected to stick there: it was shot off by 1 km.
#[test]
fn a_tube_that_falls_on_something_thin_on_the_floor_lies_on_it() {
    let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    for (name, thin, thick_m) in [("cloth", cloth(), 0.004), ("rope", rope(), 0.012)] {
        for rates in [(60.0, 60.0), (240.0, 60.0), (60.0, 240.0), (60.0, 61.0), (100.0, 120.0)] {
            let path_m = vec![DVec3::new(0.0, -0.08, 0.07), DVec3::new(0.0, 0.08, 0.07)];
            let tube = TubeSpec {
                friction: 0.5,
                damping_per_s: 3.0,
                gravity: G,
                obstacles: [floor()].into(),
                ..TubeSpec::free(path_m, Section::hollow(0.01, 0.0025, material), 8)
            };
            let ([_, depth_m], z) = comes_down(SoftBody::new(thin.clone()).unwrap(), Tube::new(tube).unwrap(), rates);
            println!("{name} {rates:?}: at {z}, {depth_m} deep");
            // across a rope one end may lie on the floor
            assert!(z > 0.5 * thick_m + 0.009 && z < thick_m + 0.0105, "{name} {rates:?}: its middle is at {z}");
            assert!(depth_m < 1e-3, "{name} {rates:?}: {depth_m} m deep");
        }
    }
}

/// The block expected it to give way into the floor: 21 mm deep under a cube, and 9 mm for good.
#[test]
fn a_soft_block_that_falls_on_a_soft_body_on_the_floor_does_not_press_it_into_the_floor() {
    let matter = SoftMatter { young_pa: 1e5, poisson: 0.3, density_kg_m3: 1050.0, damping_per_s: 3.0 };
    let slab = SoftShape::Box { size_m: DVec3::new(0.1, 0.1, 0.03), segments: [4, 4, 1] };
    let slab = SoftSpec { position: DVec3::new(-0.05, -0.05, 0.001), ..spec(slab) };
    let slab = SoftSpec { matter, gravity: G, obstacles: [floor()].into(), ..slab };
    for (name, thin, top_m) in [("cloth", cloth(), 0.005), ("rope", rope(), 0.0125), ("slab", slab, 0.031)] {
        for rates in [(60.0, 60.0), (60.0, 61.0), (61.0, 60.0), (60.0, 240.0), (100.0, 101.0)] {
            let block = SoftSpec {
                matter,
                position: DVec3::new(-0.04, -0.04, top_m + 0.02),
                gravity: G,
                obstacles: [floor()].into(),
                ..spec(SoftShape::Box { size_m: DVec3::splat(0.08), segments: [3; 3] })
            };
            let ([most_m, depth_m], z) =
                comes_down(SoftBody::new(thin.clone()).unwrap(), SoftBody::new(block).unwrap(), rates);
            println!("{name} {rates:?}: {most_m} deep, in the end {depth_m}, at {z}");
            assert!(most_m < 3e-3, "{name} {rates:?}: {most_m} m deep");
            assert!(depth_m < 1e-3, "{name} {rates:?}: {depth_m} m deep in the end");
        }
    }
}

/// The block expected the tube to give way into the floor, and the tube was carried there by what it was given late.
#[test]
fn a_soft_block_that_falls_on_a_tube_on_the_floor_does_not_swallow_it() {
    let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    for rates in [(60.0, 60.0), (240.0, 240.0), (60.0, 240.0)] {
        let path_m = vec![DVec3::new(0.0, -0.12, 0.0101), DVec3::new(0.0, 0.12, 0.0101)];
        let tube = TubeSpec {
            friction: 0.5,
            damping_per_s: 3.0,
            gravity: G,
            obstacles: [floor()].into(),
            ..TubeSpec::free(path_m, Section::hollow(0.01, 0.0025, material), 12)
        };
        let block = SoftSpec {
            matter: SoftMatter { young_pa: 1e5, poisson: 0.3, density_kg_m3: 1050.0, damping_per_s: 3.0 },
            position: DVec3::new(-0.05, -0.05, 0.04),
            gravity: G,
            friction: 0.5,
            obstacles: [floor()].into(),
            ..spec(SoftShape::Box { size_m: DVec3::new(0.1, 0.1, 0.06), segments: [4, 4, 2] })
        };
        let mut stage = Stage::new(Faults::default());
        stage.at_once = true;
        let tube = stage.add(Tube::new(tube).unwrap(), rates.0);
        let block = stage.add(SoftBody::new(block).unwrap(), rates.1);
        let (mut depth_m, mut lowest_m) = (0.0_f64, f64::INFINITY);
        stage.run(1.5, |stage| {
            depth_m = depth_m.max(pressed(stage, block).0);
            lowest_m = stage.newest(tube).bounds.map_or(lowest_m, |bounds| lowest_m.min(bounds.low.z));
        });
        println!("{rates:?}: {depth_m} lowest {lowest_m}");
        // a fifth of the radius where it lands; 25 to 30 mm before
        assert!(depth_m < 2e-3, "{rates:?}: {depth_m} m deep");
        assert!(lowest_m > -1e-3, "{rates:?}: the tube is pressed into the floor by {lowest_m} m");
    }
}

/// Cloth and block both own their pair with the box: each expected the other's last push to go on, and the cloth answered each blow a step
/// late, by then 2 to 13 mm deep. The box was shot off.
#[test]
fn a_soft_block_that_falls_on_a_box_on_a_cloth_lies_on_the_box() {
    for rates in [(240.0, 240.0, 240.0), (120.0, 120.0, 120.0), (60.0, 60.0, 60.0), (240.0, 60.0, 120.0)] {
        let mut stage = Stage::new(Faults::default());
        stage.at_once = true;
        let cloth = stage.add(SoftBody::new(cloth()).unwrap(), rates.0);
        let brick = stage.add(RigidBody::new(brick(0.05, 0.5)).unwrap(), rates.1);
        let block = stage.add(SoftBody::new(block(0.135)).unwrap(), rates.2);
        let (mut highest_m, mut tank_j) = (0.0_f64, 0.0_f64);
        stage.run(1.0, |stage| {
            highest_m = highest_m.max(stage.newest(block).bounds.map_or(0.0, |bounds| bounds.high.z));
            tank_j = stage.newest(block).pairs.iter().filter_map(|pair| pair.tank_j).fold(tank_j, f64::min);
        });
        let passed = |stage: &Stage, by| stage.newest(by).pairs.iter().map(|pair| pair.impulse_n_s).sum::<f64>();
        let before = [cloth, block].map(|by| passed(&stage, by));
        let mut depth_m = 0.0_f64;
        stage.run(2.0, |stage| depth_m = depth_m.max(pressed(stage, cloth).0).max(pressed(stage, block).0));
        let bears = [passed(&stage, cloth) - before[0], passed(&stage, block) - before[1]];
        let at = stage.settled(brick, 2.0).state.position;
        println!("{rates:?}: {at} {depth_m} {bears:?} {tank_j} {highest_m}");
        assert!(depth_m < 2e-4, "{rates:?}: {depth_m} m deep");
        assert!(at.truncate().length() < 5e-4, "{rates:?}: the box has gone to {at}");
        // it falls through a step of its own before it reads what bears it
        let step_m = 9.81 / (rates.1 * rates.1);
        assert!((at.z - 0.034).abs() < 2e-4 + step_m, "{rates:?}: the box is at {at}");
        let weighs = [0.5 + stage.mass_kg(block), stage.mass_kg(block)].map(|mass_kg| mass_kg * 9.81);
        for (bears, weighs) in bears.into_iter().zip(weighs) {
            assert!((bears / weighs - 1.0).abs() < 0.02, "{rates:?}: {bears} N s in a second of {weighs} N");
        }
        assert!(tank_j > -0.05 && highest_m < 0.186, "{rates:?}: {tank_j} J, {highest_m} m high");
    }
}

/// Three on the floor of which two bend and the third is rigid and on top.
fn three(stage: &mut Stage, what: &str, hz: f64) -> [AgentId; 3] {
    let lifted = |spec: SoftSpec, up_m: f64| SoftSpec { position: spec.position + DVec3::Z * up_m, ..spec };
    let (low, middle, top) = match what {
        "cloths" => (cloth(), lifted(cloth(), 0.005), 0.038 + 1e-3),
        "block on a cloth" => (cloth(), block(0.006), 0.086 + 1e-3),
        _ => {
            let across = SoftShape::Rope {
                path_m: vec![DVec3::new(0.0, -0.15, 0.019), DVec3::new(0.0, 0.15, 0.019)],
                radius_m: 0.006,
                segments: 8,
            };
            (rope(), SoftSpec { shape: across, ..rope() }, 0.0255 + 0.03)
        }
    };
    let soft = [low, middle].map(|spec| stage.add(SoftBody::new(spec).unwrap(), hz));
    let brick = RigidBody::new(brick(top, 0.3)).unwrap();
    [soft[0], soft[1], stage.add(brick, hz)]
}

/// The lower of the two that bend once owned their contact: what it gave the upper one, which the box held down, knew nothing of the box,
/// and the box went through two cloths and was shot off a block and off two ropes.
#[test]
fn a_box_lies_on_two_that_bend_on_each_other() {
    for (what, hz) in
        ["cloths", "block on a cloth", "ropes"].into_iter().flat_map(|what| [240.0, 120.0].map(|hz| (what, hz)))
    {
        let mut stage = Stage::new(Faults::default());
        stage.at_once = true;
        let all = three(&mut stage, what, hz);
        let (mut depth_m, mut tank_j) = (0.0_f64, 0.0_f64);
        stage.run(1.5, |stage| {
            let pairs = || all.iter().flat_map(|id| &stage.newest(*id).pairs);
            depth_m = pairs().map(|pair| pair.penetration_m).fold(depth_m, f64::max);
            tank_j = pairs().filter_map(|pair| pair.tank_j).fold(tank_j, f64::min);
        });
        let end_m = all.iter().map(|id| pressed(&stage, *id).0).fold(0.0, f64::max);
        println!(
            "{what}, {hz} Hz: at {}, {depth_m} and then {end_m} m deep, {tank_j} J",
            stage.settled(all[2], 1.5).state.position
        );
        assert!(stage.owner([all[0], all[1]]) == all[1], "{what}: the upper one owns");
        assert!(depth_m < 3e-3 && end_m < 5e-4, "{what}, {hz} Hz: {depth_m} and then {end_m} m deep");
        assert!(tank_j > -0.1, "{what}, {hz} Hz: {tank_j} J");
    }
}
