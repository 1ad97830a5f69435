//! Piles of boxes of any masses and rates, played from the command line.

use crate::play::{Folder, number, point};

/// A box of a pile.
#[derive(Debug)]
struct Cube {
    half_m: f64,
    mass_kg: f64,
    rate_hz: f64,
    restitution: f64,
    start_m: [f64; 3],
}

const fn cube(half_m: f64, mass_kg: f64, rate_hz: f64, restitution: f64, start_m: [f64; 3]) -> Cube {
    Cube { half_m, mass_kg, rate_hz, restitution, start_m }
}

/// Piles that once flew, fell through the floor or through each other.
const PILES: [&[Cube]; 17] = [
    &[
        cube(0.08, 0.27, 20.0, 0.5, [-0.0052, -0.0052, 0.1667]),
        cube(0.08, 0.11, 1000.0, 0.2, [-0.0099, 0.0056, 0.3986]),
        cube(0.05, 64.32, 10.0, 0.0, [-0.0014, 0.0016, 0.5633]),
    ],
    &[
        cube(0.1, 0.10, 20.0, 0.5, [0.0010, 0.0068, 0.1170]),
        cube(0.1, 0.63, 500.0, 0.2, [-0.0097, -0.0095, 0.3517]),
        cube(0.1, 0.44, 240.0, 0.0, [-0.0025, 0.0096, 0.6113]),
    ],
    &[
        cube(0.1, 0.12, 30.0, 0.0, [-0.0098, -0.0005, 0.1856]),
        cube(0.05, 0.65, 60.0, 0.5, [0.0039, 0.0061, 0.3449]),
        cube(0.1, 13.07, 20.0, 0.0, [0.0039, -0.0037, 0.5870]),
        cube(0.05, 0.32, 120.0, 0.0, [0.0073, -0.0053, 0.7847]),
    ],
    &[
        cube(0.08, 0.30, 20.0, 0.2, [0.0027, 0.0032, 0.1242]),
        cube(0.1, 94.27, 120.0, 0.5, [-0.0052, -0.0035, 0.3415]),
        cube(0.08, 0.15, 30.0, 0.2, [0.0015, 0.0051, 0.5800]),
        cube(0.1, 3.55, 20.0, 0.0, [-0.0061, 0.0077, 0.7943]),
    ],
    &[
        cube(0.08, 0.62, 30.0, 0.2, [-0.0006, -0.0018, 0.1254]),
        cube(0.1, 1.39, 1000.0, 0.2, [0.0047, 0.0030, 0.3202]),
        cube(0.08, 0.22, 10.0, 0.5, [0.0044, 0.0087, 0.5685]),
    ],
    &[cube(0.1, 0.11, 10.0, 0.0, [0.0015, -0.0072, 0.1533]), cube(0.1, 27.59, 500.0, 0.2, [0.0022, -0.0078, 0.3583])],
    &[
        cube(0.08, 1.38, 60.0, 0.0, [-0.0033, 0.0054, 0.1796]),
        cube(0.05, 0.73, 500.0, 0.5, [-0.0097, 0.0088, 0.3660]),
        cube(0.08, 19.15, 240.0, 0.2, [0.0094, -0.0048, 0.5103]),
    ],
    &[
        cube(0.1, 0.40, 10.0, 0.5, [0.0058, -0.0016, 0.1811]),
        cube(0.05, 0.52, 20.0, 0.0, [0.0061, -0.0029, 0.4267]),
        cube(0.1, 13.82, 60.0, 0.0, [0.0044, 0.0021, 0.6702]),
    ],
    &[
        cube(0.1, 0.27, 10.0, 0.2, [-0.0050, 0.0035, 0.1164]),
        cube(0.05, 36.64, 1000.0, 0.0, [0.0014, -0.0065, 0.2777]),
        cube(0.08, 0.47, 10.0, 0.0, [0.0012, 0.0005, 0.4758]),
    ],
    &[
        cube(0.08, 0.33, 10.0, 0.5, [-0.0009, 0.0025, 0.1768]),
        cube(0.08, 15.69, 30.0, 0.2, [0.0012, 0.0099, 0.3664]),
        cube(0.05, 39.31, 240.0, 0.2, [0.0071, 0.0024, 0.5436]),
        cube(0.05, 12.98, 500.0, 0.5, [-0.0046, 0.0008, 0.7417]),
    ],
    &[
        cube(0.08, 58.63, 30.0, 0.2, [0.0029, 0.0059, 0.1701]),
        cube(0.08, 0.26, 10.0, 0.5, [-0.0066, 0.0039, 0.3539]),
        cube(0.08, 11.75, 10.0, 0.2, [0.0016, 0.0015, 0.5735]),
        cube(0.08, 0.24, 500.0, 0.0, [0.0056, -0.0076, 0.7461]),
    ],
    &[cube(0.08, 0.13, 60.0, 0.0, [-0.0004, 0.0043, 0.1732]), cube(0.05, 2.47, 240.0, 0.2, [0.0094, -0.0060, 0.3840])],
    &[
        cube(0.08, 4.86, 20.0, 0.5, [-0.0092, -0.0052, 0.1733]),
        cube(0.05, 53.76, 120.0, 0.2, [-0.0008, 0.0009, 0.3960]),
        cube(0.08, 5.36, 30.0, 0.5, [0.0064, -0.0015, 0.5902]),
    ],
    &[
        cube(0.05, 1.91, 10.0, 0.0, [0.0068, -0.0089, 0.1469]),
        cube(0.08, 2.20, 500.0, 0.2, [0.0016, 0.0080, 0.2789]),
        cube(0.05, 0.18, 10.0, 0.5, [0.0000, 0.0062, 0.4435]),
        cube(0.08, 1.03, 60.0, 0.0, [-0.0043, -0.0001, 0.5955]),
    ],
    &[
        cube(0.08, 0.28, 20.0, 0.2, [-0.0019, -0.0014, 0.1432]),
        cube(0.05, 4.66, 10.0, 0.5, [0.0052, 0.0025, 0.3425]),
        cube(0.08, 81.55, 20.0, 0.0, [0.0044, -0.0091, 0.4846]),
    ],
    &[
        cube(0.1, 93.55, 10.0, 0.2, [0.0004, 0.0065, 0.1521]),
        cube(0.08, 0.41, 10.0, 0.0, [-0.0067, 0.0068, 0.4085]),
        cube(0.1, 1.87, 30.0, 0.2, [0.0009, 0.0095, 0.6804]),
    ],
    &[
        cube(0.08, 0.30, 10.0, 0.2, [-0.0028, -0.0005, 0.0975]),
        cube(0.1, 0.14, 240.0, 0.2, [0.0062, 0.0025, 0.3707]),
        cube(0.1, 0.15, 20.0, 0.5, [-0.0024, -0.0091, 0.5998]),
        cube(0.1, 3.35, 30.0, 0.2, [0.0096, 0.0008, 0.8600]),
    ],
];

#[test]
fn piles_of_any_masses_and_rates_neither_fly_nor_fall_through_the_floor_or_each_other() {
    for pile in PILES {
        let table = |(i, cube): (usize, &Cube)| {
            let Cube { half_m, mass_kg, rate_hz, restitution, start_m } = cube;
            format!(
                "[[object]]\nname = \"b{i}\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [{half_m}, {half_m}, {half_m}]\n\
                 mass_kg = {mass_kg}\nposition_m = {start_m:?}\nrate_hz = {rate_hz}\nrestitution = {restitution}\n\
                 [[probe]]\nobject = \"b{i}\"\n"
            )
        };
        let ground = "[[object]]\nname = \"ground\"\nmodel = \"rigid\"\nshape = \"plane\"\n";
        let boxes: String = pile.iter().enumerate().map(table).collect();
        let folder = Folder::with(&format!("{ground}{boxes}"));
        let start_j: f64 = pile.iter().map(|cube| cube.mass_kg * 9.81 * cube.start_m[2]).sum();
        for seconds in ["0.5", "2"] {
            let report = folder.lockstep(&["--seconds", seconds]);
            let energy_j: f64 = report["agents"].as_array().unwrap().iter().map(|a| number(a, "/energy_j")).sum();
            assert!(energy_j < start_j, "{energy_j} J of {start_j} J after {seconds} s: {pile:?}");
            let at = |k: usize| point(&report, &format!("/probes/{k}/position_m"));
            for (k, Cube { half_m, .. }) in pile.iter().enumerate() {
                assert!(at(k)[2] > half_m - 2e-3, "b{k} lies at {} m after {seconds} s: {pile:?}", at(k)[2]);
                for (below, other) in pile[..k].iter().enumerate() {
                    let aside_m = (0..2).map(|axis| (at(k)[axis] - at(below)[axis]).abs()).fold(0.0, f64::max);
                    let swapped = aside_m < half_m.min(other.half_m) && at(k)[2] < at(below)[2];
                    assert!(!swapped, "b{k} lies under b{below} after {seconds} s: {pile:?}");
                }
            }
        }
    }
}
