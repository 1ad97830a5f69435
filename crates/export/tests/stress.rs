//! The stress in a VTK series is what statics says of bodies that hang and of a cantilever.

use metachron_core::SimSpan;
use metachron_export::{MomentWriter, Moments, VtkSeries};
use metachron_models::soft::Side;
use metachron_world::{Rigid, Scene, Soft, Tube, World, kinds::ExecutorKind};
use std::f64::consts::PI;
use std::ops::Range;

const GRAVITY: f64 = 9.81;
const DENSITY_KG_M3: f64 = 1000.0;
const LENGTH_M: f64 = 0.4;
const RADIUS_M: f64 = 0.01;
const FALL_X_M: f64 = 5.0;

/// Apart along x: a bar that hangs by its upper end, the same in a cage, a rope; then a ball; and a rod held at the left.
fn scene() -> Scene {
    let soft = |soft: Soft| soft.young_pa(1e6).poisson(0.0).density_kg_m3(DENSITY_KG_M3).damping(20.0, 0.0);
    let bar =
        |x: f64| soft(Soft::cuboid([0.04, 0.04, LENGTH_M], [1, 1, 8])).at([x, 0.0, 0.5 * LENGTH_M]).hold(&[Side::Top]);
    let rope = Soft::rope(&[[3.0, 0.0, LENGTH_M], [3.0, 0.0, 0.0]], RADIUS_M, 10);
    let rod = Tube::along(&[[10.0, 0.0, 1.0], [10.0 + LENGTH_M, 0.0, 1.0]]).radius_m(RADIUS_M).wall_m(RADIUS_M);
    let rod = rod.young_pa(1e8).density_kg_m3(DENSITY_KG_M3).segments(40).clamp([true, false]).damping_per_s(20.0);
    let parts = Scene::builder().add("bar", bar(1.0)).add("caged", bar(2.0).eps_m((0.05, 0.05)));
    let parts = parts.add("rope", soft(rope).hold(&[Side::Left])).add("rod", rod);
    parts.add("ball", Rigid::ball(0.1).at([FALL_X_M, 0.0, 0.0])).build().unwrap()
}

/// An array of a file of VTK: where its declaration says, after its length.
fn numbers(bytes: &[u8], name: &str) -> Vec<f64> {
    let start = bytes.windows(2).position(|two| two == b"\n_").unwrap() + 2;
    let text = String::from_utf8_lossy(&bytes[..start]).into_owned();
    let line = text.lines().find(|line| line.contains(&format!("Name=\"{name}\""))).unwrap();
    let at = start + line.split("offset=\"").nth(1).unwrap().split('"').next().unwrap().parse::<usize>().unwrap();
    let length = u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
    let words = bytes[at + 8..at + 8 + length].chunks_exact(8);
    words.map(|word| f64::from_le_bytes(word.try_into().unwrap())).collect()
}

#[test]
fn the_stress_of_what_hangs_and_of_a_cantilever_is_that_of_statics() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, mut series) = (scene(), VtkSeries::create(folder.path(), &scene()).unwrap());
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    world.advance(SimSpan::from_millis(3000));
    series.write(&Moments::of(&world).take()).unwrap();
    let bytes = std::fs::read(folder.path().join("000000.vtu")).unwrap();
    let (points, stresses) = (numbers(&bytes, "Points"), numbers(&bytes, "von_mises_pa"));
    let near = |x_m: Range<f64>| {
        let all = points.chunks_exact(3).zip(&stresses).filter(move |(point, _)| x_m.contains(&point[0]));
        all.map(|(point, stress)| (point[0], point[2], *stress)).collect::<Vec<_>>()
    };
    for (name, x_m, most) in [("bar", 0.5..1.5, 0.01), ("caged", 1.5..2.5, 0.05), ("rope", 2.5..3.5, 0.02)] {
        let inner: Vec<_> = near(x_m).into_iter().filter(|(_, z, _)| (0.06..0.34).contains(z)).collect();
        assert!(inner.len() >= 16, "{name}");
        for (_, z, stress_pa) in inner {
            // it is longer than it was by at most ρ g L / E, 0.4 %
            let wanted_pa = DENSITY_KG_M3 * GRAVITY * z;
            assert!((stress_pa / wanted_pa - 1.0).abs() < most, "{name}: {stress_pa} of {wanted_pa} Pa at {z} m");
        }
    }
    let weight_n_m = DENSITY_KG_M3 * GRAVITY * PI * RADIUS_M.powi(2);
    let inner: Vec<_> = near(9.0..11.0).into_iter().filter(|(x, ..)| (10.0..10.3).contains(x)).collect();
    assert!(inner.len() >= 300);
    for (x, _, stress_pa) in inner {
        let moment_n_m = 0.5 * weight_n_m * (10.0 + LENGTH_M - x).powi(2);
        let wanted_pa = moment_n_m * 4.0 / (PI * RADIUS_M.powi(3));
        assert!((stress_pa / wanted_pa - 1.0).abs() < 0.03, "{stress_pa} of {wanted_pa} Pa at {x} m");
    }
    let ball = near(FALL_X_M - 0.5..FALL_X_M + 0.5);
    assert!(ball.len() > 100 && ball.iter().all(|(_, _, stress)| stress.is_nan()));
}
