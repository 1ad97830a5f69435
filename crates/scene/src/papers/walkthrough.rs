//! The walk of (GB99): 200 meshes of 1.5 million triangles, which leave the view one by one until a sudden turn shows nearly all.
//!
//! In: a seed. Out: the scene's text. The paper's counts are lost; these are ours: ten sizes, log-normal, twenty copies of each.

use super::camera_path::{CameraPath, stop};
use super::{FLOOR, head};

const TRIANGLES: f64 = 1.5e6;
/// A box over which copies of every mesh are scattered.
struct Region {
    name: &'static str,
    /// Copies of each mesh.
    copies: u32,
    /// Middle along x, metres.
    middle_m: f64,
    /// Half sizes along x and y, metres.
    half_m: [f64; 2],
}

/// The region in front of the camera, and the one behind it.
const AHEAD: Region = Region { name: "ahead", copies: 2, middle_m: -17.0, half_m: [13.0, 5.0] };
const BEHIND: Region = Region { name: "behind", copies: 18, middle_m: 32.0, half_m: [28.0, 18.0] };
/// Quantiles of the normal distribution at 0.05, 0.15, … 0.95: sizes are proportional to their exponentials.
const NORMAL: [f64; 10] = [-1.6449, -1.0364, -0.6745, -0.3853, -0.1257, 0.1257, 0.3853, 0.6745, 1.0364, 1.6449];
const KINDS: [&str; 3] = ["blob", "torus", "sphere"];
const COLOURS: [&str; 5] = ["#b07a5a", "#6f8faf", "#8fa35e", "#a887b5", "#c2a65a"];

pub(super) fn text(seed: u32) -> String {
    let mut text = head(
        "200 meshes of 1.5 million triangles; a few lie ahead, and after a sudden turn nearly all (GB99).",
        "a walk among 200 meshes of 1.5 million triangles with a sudden turn",
        &path(),
    );
    let sizes = NORMAL.map(libm::exp);
    let unit = TRIANGLES / (f64::from(AHEAD.copies + BEHIND.copies) * sizes.iter().sum::<f64>());
    for (number, size) in (0_u32..).zip(sizes) {
        let triangles = 2.0 * (0.5 * unit * size).round();
        text += &meshes(seed, number, triangles, &AHEAD);
        text += &meshes(seed, number, triangles, &BEHIND);
    }
    text + FLOOR
}

/// The copies of one mesh in a region.
fn meshes(seed: u32, number: u32, triangles: f64, region: &Region) -> String {
    let Region { name, copies, middle_m, half_m: [along, aside] } = region;
    let (kind, colour) = (KINDS[number as usize % KINDS.len()], COLOURS[number as usize % COLOURS.len()]);
    let scatter_seed = 100 * seed + 10 * u32::from(*name == AHEAD.name) + number;
    // a torus and a sphere do not depend on the seed
    let shape_seed = if kind == "blob" { format!("\nseed = {}", seed + number) } else { String::new() };
    format!(
        r##"
[[object]]
name = "{name}-{number}"
model = "mesh"
generate = "{kind}"{shape_seed}
triangles = {triangles}
position_m = [{middle_m:?}, 0.0, 1.0]
grid = [{copies}, 1, 1]
spacing_m = [0.0, 0.0, 0.0]
scatter_m = [{along:?}, {aside:?}, 0.0]
scatter_seed = {scatter_seed}
colour = "{colour}"
"##
    )
}

fn path() -> CameraPath {
    let stops = vec![
        stop(0.0, [3.0, 0.0, 1.6], 180.0, 0.0),
        stop(35.0, [-14.0, 0.0, 1.6], 180.0, 0.0),
        stop(35.5, [-14.0, 0.0, 1.6], 360.0, 0.0),
        stop(50.0, [-10.0, 2.0, 1.6], 365.0, 0.0),
    ];
    CameraPath { stops, fov_deg: 50.0 }
}
