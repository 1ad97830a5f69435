//! Three bodies that press on each other, or two and the ground, of any clocks, as users write them: they stay where they were put.
//!
//! Independent answers: heights of stacked bodies, from their sizes.

use crate::play::{Folder, number, point};
use serde_json::Value;

const FLOOR: &str =
    "[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\nfixed = true\nfriction = 0.5\n";
const SOFT: &str = "density_kg_m3 = 1050.0\ndamping_per_s = 3.0\n";
/// Outer radius of the tubes, metres.
const RADIUS_M: f64 = 0.01;

fn tube(name: &str, hz: f64, ends: [[f64; 3]; 2], more: &str) -> String {
    format!(
        "[[object]]\nname = \"{name}\"\nmodel = \"tube\"\npath_m = {ends:?}\nradius_m = {RADIUS_M}\nwall_m = 0.002\nsegments = 16\nyoung_pa = 1e6\nrate_hz = {hz:?}\n{SOFT}{more}"
    )
}

fn solid(name: &str, hz: f64, (at, half): ([f64; 3], [f64; 3]), mass_kg: f64) -> String {
    format!(
        "[[object]]\nname = \"{name}\"\nmodel = \"rigid\"\nshape = \"box\"\nposition_m = {at:?}\nhalf_extents_m = {half:?}\nmass_kg = {mass_kg:?}\nrate_hz = {hz:?}\n[[probe]]\nobject = \"{name}\"\nevery_ms = 10.0\n"
    )
}

fn rope(name: &str, ends: [[f64; 3]; 2], (radius_m, hz): (f64, f64)) -> String {
    format!(
        "[[object]]\nname = \"{name}\"\nmodel = \"rope\"\npath_m = {ends:?}\nradius_m = {radius_m}\nsegments = 8\nyoung_pa = 1e6\nrate_hz = {hz:?}\n{SOFT}"
    )
}

/// A square sheet of 4 mm, `size_m` wide, whose middle lies at `z`.
fn cloth(name: &str, hz: f64, (size_m, segments): (f64, u32), z: f64) -> String {
    format!(
        "[[object]]\nname = \"{name}\"\nmodel = \"sheet\"\nsize_m = [{size_m:?}, {size_m:?}]\nsegments = [{segments}, {segments}]\nthickness_m = 0.004\nposition_m = [0.0, 0.0, {z:?}]\nyoung_pa = 1e6\nrate_hz = {hz:?}\n{SOFT}"
    )
}

/// A soft box, whose middle lies at `z`.
fn block(name: &str, hz: f64, (size_m, segments): ([f64; 3], [u32; 3]), z: f64) -> String {
    format!(
        "[[object]]\nname = \"{name}\"\nmodel = \"solid\"\nshape = \"box\"\nsize_m = {size_m:?}\nsegments = {segments:?}\nposition_m = [0.0, 0.0, {z:?}]\nyoung_pa = 1e5\nrate_hz = {hz:?}\n{SOFT}"
    )
}

/// A slab of 25 × 25 × 5 cm on the floor.
fn slab(hz: f64) -> String {
    block("low", hz, ([0.25, 0.25, 0.05], [6, 6, 2]), 0.025)
}

/// Two strips along x on a body that is `top_m` high, ropes or, of [`RADIUS_M`], tubes; `apart_m` from its middle,
/// `above_m` above it.
fn strips(hz: f64, radius_m: f64, (top_m, apart_m, above_m): (f64, f64, f64)) -> String {
    let strip = |(name, y): (&str, f64)| {
        let z = top_m + radius_m + above_m;
        let ends = [[-0.09, y, z], [0.09, y, z]];
        if radius_m == RADIUS_M { tube(name, hz, ends, "") } else { rope(name, ends, (radius_m, hz)) }
    };
    [("left", -apart_m), ("right", apart_m)].map(strip).concat()
}

fn along_y(x: f64) -> [[f64; 3]; 2] {
    [[x, -0.1, 0.0101], [x, 0.1, 0.0101]]
}

/// The deepest overlap that any pair ever had, metres.
fn deepest_m(report: &Value) -> f64 {
    deepest(report, "/penetration_max_m")
}

/// The deepest overlap of any pair now, metres: contacts rest 0.02 mm deep.
fn at_rest_m(report: &Value) -> f64 {
    deepest(report, "/penetration_m")
}

fn deepest(report: &Value, pointer: &str) -> f64 {
    let pairs = report["couplings"].as_array().unwrap();
    pairs.iter().map(|pair| number(pair, pointer)).fold(0.0, f64::max)
}

/// It rolled to and fro on them as on rollers, 14 to 20 mm deep, or off.
#[test]
fn a_box_stays_on_two_tubes_on_the_floor_whose_clocks_differ() {
    for (left, right, above) in [(60.0, 60.0, 60.0), (60.0, 61.0, 60.0), (60.0, 61.0, 240.0), (20.0, 60.0, 240.0)] {
        for mass_kg in [0.2, 2.0] {
            let tubes = [tube("left", left, along_y(-0.04), ""), tube("right", right, along_y(0.04), "")].concat();
            let above = solid("box", above, ([0.0, 0.0, 0.0405], [0.06, 0.03, 0.02]), mass_kg);
            let report = Folder::with(&format!("{FLOOR}{tubes}{above}")).lockstep(&["--seconds", "3"]);
            let told = format!("{left} + {right} Hz, {mass_kg} kg");
            let at = point(&report, "/probes/0/position_m");
            assert!((at[2] - 0.04).abs() < 5e-4 && at[0].hypot(at[1]) < 0.015, "{told}: it is at {at:?}");
            // g h² of the step before the first that is told, 2.7 mm, is no less than the depth that a landing may
            // leave
            assert!(deepest_m(&report) < 1.5e-3, "{told}: {:?}", deepest_m(&report));
        }
    }
}

/// The impulses of the tubes on the lower box must not count as an approach: it would bounce, never press, and the
/// upper one would sink through it at 68 mm/s.
#[test]
fn a_stack_with_the_usual_restitution_stands_on_two_tubes() {
    for hz in [60.0, 120.0, 240.0] {
        let tubes = [tube("left", hz, along_y(-0.03), ""), tube("right", hz, along_y(0.03), "")].concat();
        let [low, high] = [0.0525, 0.1135].map(|z| [0.0, 0.0, z]);
        let stack = solid("low", hz, (low, [0.05, 0.03, 0.03]), 0.5) + &solid("high", hz, (high, [0.03; 3]), 0.5);
        let report = Folder::with(&format!("{FLOOR}{tubes}{stack}")).lockstep(&["--seconds", "2"]);
        for (probe, z) in [(0, 0.05), (1, 0.11)] {
            let at = point(&report, &format!("/probes/{probe}/position_m"));
            assert!((at[2] - z).abs() < 1e-3 && at[0].hypot(at[1]) < 2e-3, "{hz} Hz: {at:?} where {z} high is right");
        }
        assert!(deepest_m(&report) < 2.5e-3, "{hz} Hz: {:?}", deepest_m(&report));
    }
}

/// A step late the upper tube carried the lower one 8 mm into the floor; the plate then stuck in it, and 38 J went through its tank.
#[test]
fn a_plate_on_two_crossed_tubes_rolls_off_them_and_gains_nothing() {
    for (hz, lower_first) in [(60.0, true), (120.0, false), (240.0, true), (240.0, false), (1000.0, true)] {
        let low = tube("low", hz, [[-0.1, 0.0, 0.0101], [0.1, 0.0, 0.0101]], "");
        let up = tube("up", hz, [[0.0, -0.1, 0.0305], [0.0, 0.1, 0.0305]], "");
        let tubes = if lower_first { low + &up } else { up + &low };
        let plate = solid("plate", hz, ([0.0, 0.0, 0.06], [0.06, 0.06, 0.005]), 0.4);
        let report = Folder::with(&format!("{FLOOR}{tubes}{plate}")).lockstep(&["--seconds", "2"]);
        let samples = report["probes"][0]["samples"].as_array().unwrap();
        let highest = samples.iter().map(|s| number(s, "/3")).fold(0.0, f64::max);
        assert!(highest < 0.0601, "{hz} Hz: it flew up to {highest} m");
        assert!(deepest_m(&report) < 4e-3, "{hz} Hz: {:?}", deepest_m(&report));
    }
}

/// How the box answers changed with the line of every impulse, so the tube's solve gave next to nothing: it fell through box and floor.
#[test]
fn a_tube_that_falls_on_a_light_box_falls_through_neither_box_nor_floor() {
    for (tube_hz, box_hz) in [(500.0, 60.0), (120.0, 120.0), (240.0, 240.0)] {
        let bar = tube("tube", tube_hz, [[0.0835, -0.0326, 0.075], [-0.094, -0.0026, 0.075]], "");
        let ends = [0.0, 0.5, 1.0].map(|at| format!("[[probe]]\nobject = \"tube\"\nat = {at:?}\nevery_ms = 5.0\n"));
        let light = solid("box", box_hz, ([-0.0068, 0.0086, 0.031], [0.03; 3]), 0.05);
        let text = format!("{FLOOR}{light}{bar}{}", ends.concat());
        let report = Folder::with(&text).lockstep(&["--seconds", "1"]);
        let samples = (1..4).flat_map(|probe| report["probes"][probe]["samples"].as_array().unwrap());
        let lowest = samples.map(|s| number(s, "/3")).fold(f64::INFINITY, f64::min);
        assert!(lowest > 0.9 * RADIUS_M, "{tube_hz} : {box_hz} Hz: its axis came down to {lowest} m");
    }
}

/// Its edge on the floor, it leant through the rope: 13 mm deep.
#[test]
fn a_box_that_tips_off_a_rope_on_the_floor_leans_on_it_at_slow_clocks() {
    for hz in [60.0, 61.0] {
        let rope = rope("rope", [[-0.1, 0.0, 0.0061], [0.1, 0.0, 0.0061]], (0.006, 60.0));
        let above = solid("box", hz, ([0.0, 0.003, 0.05], [0.05, 0.03, 0.03]), 0.4);
        let report = Folder::with(&format!("{FLOOR}{rope}{above}")).lockstep(&["--seconds", "3"]);
        assert!(deepest_m(&report) < 3e-3, "60 : {hz} Hz: {:?}", deepest_m(&report));
    }
}

/// Two owners give to the second tube, and neither knows the other's load on it: the block must not be thrown off, or
/// fall between them.
#[test]
fn a_soft_block_lies_on_two_taut_tubes_that_touch() {
    for hz in [120.0, 240.0] {
        let taut = |name, y: f64| {
            let ends = [[-0.2, y, 0.2], [0.2, y, 0.2]];
            tube(name, hz, ends, "clamp = [\"start\", \"end\"]\n")
                .replace("young_pa = 1e6", "young_pa = 2e7")
                .replace("radius_m = 0.01", "radius_m = 0.015")
        };
        let block = block("block", hz, ([0.1; 3], [3; 3]), 0.27) + "[[probe]]\nobject = \"block\"\nevery_ms = 10.0\n";
        let text = [FLOOR, &taut("a", -0.0151), &taut("b", 0.0151), &block].concat();
        let report = Folder::with(&text).lockstep(&["--seconds", "2"]);
        let at = point(&report, "/probes/0/position_m");
        assert!(at[2] > 0.28, "{hz} Hz: its upper corner is at {at:?}");
        assert!(deepest_m(&report) < 2e-3, "{hz} Hz: {:?}", deepest_m(&report));
    }
}

/// The plate took each rope for one that nothing holds up, and pressed it through the cloth, which flew off.
#[test]
fn a_soft_plate_on_two_ropes_presses_the_cloth_under_them_with_the_weight_of_all() {
    for hz in [60.0, 120.0, 240.0] {
        let cloth = cloth("cloth", hz, (0.24, 6), 0.0021);
        let ropes = [("left", -0.04), ("right", 0.04)]
            .map(|(name, y)| rope(name, [[-0.09, y, 0.0102], [0.09, y, 0.0102]], (0.006, hz)));
        let plate = block("plate", hz, ([0.12, 0.12, 0.02], [4, 4, 1]), 0.0265);
        let text = [FLOOR, &cloth, &ropes.concat(), &plate].concat();
        let report = Folder::with(&text).lockstep(&["--seconds", "2"]);
        assert!(deepest_m(&report) < 1e-3, "{hz} Hz: {:?}", deepest_m(&report));
        let pairs = report["couplings"].as_array().unwrap();
        let on_cloth = pairs.iter().filter(|pair| pair["a"] == "cloth" || pair["b"] == "cloth");
        let pressed_n: f64 = on_cloth.map(|pair| number(pair, "/force_n")).sum();
        let volume_m3 = 0.12 * 0.12 * 0.02 + 2.0 * 0.18 * std::f64::consts::PI * 0.006 * 0.006;
        let weight_n = 1050.0 * 9.81 * volume_m3;
        // within the sway of the step that is told
        assert!((pressed_n - weight_n).abs() < 0.06 * weight_n, "{hz} Hz: {pressed_n} N for {weight_n}");
    }
}

/// The rope took the upper tube for one that nothing holds up, and pressed it 5 to 6 mm into the lower one for good.
#[test]
fn a_rope_on_two_crossed_tubes_presses_neither_into_the_other() {
    for hz in [60.0, 120.0, 240.0] {
        let low = tube("low", hz, [[-0.1, 0.0, 0.0101], [0.1, 0.0, 0.0101]], "");
        let up = tube("up", hz, [[0.0, -0.1, 0.0305], [0.0, 0.1, 0.0305]], "");
        let above = rope("rope", [[-0.07, -0.07, 0.06], [0.07, 0.07, 0.06]], (0.006, hz));
        let report = Folder::with(&[FLOOR, &low, &up, &above].concat()).lockstep(&["--seconds", "2"]);
        assert!(deepest_m(&report) < 2.5e-3, "{hz} Hz: {:?}", deepest_m(&report));
    }
}

/// The middle one, pressed through a faster one below it and onto the floor, was held for carried there, and shot off 1 to 11 m.
#[test]
fn a_slow_cloth_between_two_faster_ones_under_a_block_is_not_shot_off() {
    for (hz, apart_m) in [([120.0, 60.0, 60.0], 7e-4), ([100.0, 50.0, 75.0], 3e-4)] {
        let cloth = |(name, hz, z): (&str, f64, f64)| {
            cloth(name, hz, (0.3, 6), z) + &format!("[[probe]]\nobject = \"{name}\"\nevery_ms = 5.0\n")
        };
        let heights = [0.0021, 0.0065 + apart_m, 0.011 + 2.0 * apart_m];
        let cloths =
            [("low", hz[0], heights[0]), ("middle", hz[1], heights[1]), ("high", hz[2], heights[2])].map(cloth);
        let block = block("block", hz[0], ([0.06; 3], [3; 3]), 0.047 + 2.0 * apart_m);
        let text = [FLOOR, &cloths.concat(), &block].concat();
        let report = Folder::with(&text).lockstep(&["--seconds", "0.45"]);
        let samples = report["probes"][1]["samples"].as_array().unwrap();
        let highest = samples.iter().map(|s| number(s, "/3")).fold(0.0, f64::max);
        assert!(highest < 0.02, "{hz:?} Hz: {highest} m high, {:?}", deepest_m(&report));
    }
}

/// The ropes or tubes lie between two owners. Where each undoes a step late the other's impulses, the box sinks through
/// tubes on anything soft, and through ropes on a held or faster body, 10 to 17 mm.
#[test]
fn what_lies_on_something_soft_bears_a_box_at_any_clocks() {
    const WEIGHT_N: f64 = 0.3 * 9.81;
    for hz in [[60.0, 60.0, 60.0], [240.0, 240.0, 240.0], [240.0, 60.0, 60.0], [60.0, 61.0, 240.0]] {
        // how far each may sag: the slab is pressed by 3 N on a tenth of its 6 dm², the sheet hangs from its edges, 30 cm apart
        for (lower, sag_m) in [
            (slab(hz[0]), 2e-3),
            (slab(hz[0]) + "hold = [\"bottom\"]\n", 2e-3),
            (cloth("low", hz[0], (0.3, 8), 0.048) + "hold = [\"left\", \"right\", \"near\", \"far\"]\n", 0.02),
        ] {
            for radius_m in [0.006, RADIUS_M] {
                let strips = strips(hz[1], radius_m, (0.05, 0.03, 1e-4));
                let top_m = 0.05 + 2.0 * radius_m;
                let above = solid("box", hz[2], ([0.0, 0.0, top_m + 3e-4 + 0.02], [0.06, 0.05, 0.02]), 0.3);
                let report = Folder::with(&[FLOOR, &lower, &strips, &above].concat()).lockstep(&["--seconds", "1"]);
                let told = format!("{hz:?} Hz, radius {radius_m}, {lower}");
                let sunk_m = top_m + 0.02 - point(&report, "/probes/0/position_m")[2];
                assert!((-1e-4..sag_m).contains(&sunk_m), "{told}: the box is {sunk_m} m down");
                assert!(at_rest_m(&report) < 5e-5, "{told}: {} m deep", at_rest_m(&report));
                // where the edge of a box lands on a rope that sags, first seen where it has landed
                assert!(deepest_m(&report) < 1.5e-3, "{told}: {} m deep", deepest_m(&report));
                let pairs = report["couplings"].as_array().unwrap();
                let borne_n: f64 =
                    pairs.iter().filter(|pair| pair["b"] == "box").map(|pair| number(pair, "/force_n")).sum();
                assert!((borne_n - WEIGHT_N).abs() < 0.05 * WEIGHT_N, "{told}: {borne_n} N for {WEIGHT_N}");
            }
        }
    }
}

/// The cube took each of them for one that nothing holds up, as a held slab stands on nothing, and pressed it 10 to 16 mm into that for good.
#[test]
fn a_soft_cube_lies_on_what_lies_on_a_held_slab() {
    for hz in [60.0, 240.0] {
        for radius_m in [0.006, RADIUS_M] {
            let slab = slab(hz) + "hold = [\"bottom\"]\n";
            let strips = strips(hz, radius_m, (0.05, 0.02, 2e-4));
            let cube = block("cube", hz, ([0.06; 3], [4; 3]), 0.05 + 2.0 * radius_m + 8e-4 + 0.03);
            let report = Folder::with(&[FLOOR, &slab, &strips, &cube].concat()).lockstep(&["--seconds", "1"]);
            assert!(deepest_m(&report) < 3e-3, "{hz} Hz, {radius_m}: {:?}", deepest_m(&report));
            let pairs = report["couplings"].as_array().unwrap();
            let on_slab = pairs.iter().filter(|pair| pair["a"] == "low" || pair["b"] == "low");
            let pressed_n: f64 = on_slab.map(|pair| number(pair, "/force_n")).sum();
            let area_m2 = std::f64::consts::PI
                * if radius_m == RADIUS_M { 0.01_f64.powi(2) - 0.008_f64.powi(2) } else { 0.006_f64.powi(2) };
            let weight_n = 1050.0 * 9.81 * (0.06_f64.powi(3) + 2.0 * 0.18 * area_m2);
            assert!((pressed_n - weight_n).abs() < 0.1 * weight_n, "{hz} Hz, {radius_m}: {pressed_n} N for {weight_n}");
        }
    }
}

/// The slower of two that lay on a faster cloth yielded to it as a free body, and the tube on it came 10 mm deep for good.
#[test]
fn a_tube_crosses_a_slower_rope_on_a_faster_cloth() {
    for hz in [[100.0, 30.0, 100.0], [240.0, 60.0, 60.0]] {
        let cloth = cloth("cloth", hz[0], (0.2, 5), 0.003);
        let low = rope("rope", [[0.0, -0.09, 0.0102], [0.0, 0.09, 0.0102]], (0.006, hz[1]));
        let up = tube("tube", hz[2], [[-0.09, 0.0, 0.0283], [0.09, 0.0, 0.0283]], "");
        let report = Folder::with(&[FLOOR, &cloth, &low, &up].concat()).lockstep(&["--seconds", "2"]);
        assert!(deepest_m(&report) < 1e-3, "{hz:?} Hz: {:?}", deepest_m(&report));
    }
}
