//! The difference that a viewer sees when two pictures take turns in one place: ꟻLIP (ANA20).
//!
//! In: two pictures of one size. Out: a number. Never here: high dynamic range, the map of differences.

use super::offscreen::PictureFile;
use std::f64::consts::PI;

/// Pixels of a degree: a screen of 3840 pixels and 0.7 m, seen from 0.7 m (ANA20, §5).
const PIXELS_A_DEGREE: f64 = 67.0206;
/// Sensitivity to contrast of brightness, of red against green and of blue against yellow, each two terms a √(π/b) e^(−π² x²/b) (ANA20, table 1).
const SENSITIVITY: [[(f64, f64); 2]; 3] =
    [[(1.0, 0.0047), (0.0, 1e-5)], [(1.0, 0.0053), (0.0, 1e-5)], [(34.1, 0.04), (13.5, 0.025)]];
/// The widest of them, which bounds the window of all.
const WIDEST: f64 = 0.04;
/// Exponent of the difference of colours; its part of the greatest one below which it is stretched, and to what.
const COLOUR_EXPONENT: f64 = 0.7;
const COLOUR_PART: f64 = 0.4;
const COLOUR_TO: f64 = 0.95;
/// Width of the detector of edges and points, degrees, and the exponent of their difference.
const FEATURE_DEG: f64 = 0.082;
const FEATURE_EXPONENT: f64 = 0.5;

/// Linear red, green and blue to XYZ for D65.
const TO_XYZ: [[f64; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];

/// Mean difference of `b` from `a`, from 0 for equal pictures to 1, as seen from where a pixel is 1/67 of a degree wide; `None` where sizes differ
/// or there are no pixels.
#[must_use]
pub fn flip(a: &PictureFile, b: &PictureFile) -> Option<f64> {
    if a.dimensions() != b.dimensions() || a.is_empty() {
        return None;
    }
    let width = a.width() as usize;
    let [a, b] = [a, b].map(|picture| Seen::of(picture, width));
    let most = difference(&lab([0.0, 1.0, 0.0]), &lab([0.0, 0.0, 1.0]));
    let turn = COLOUR_PART * most;
    let all = (0..a.colours.len()).map(|at| {
        let colour = difference(&a.colours[at], &b.colours[at]);
        let colour = match colour < turn {
            true => COLOUR_TO / turn * colour,
            false => COLOUR_TO + (colour - turn) / (most - turn) * (1.0 - COLOUR_TO),
        };
        let feature = (0..2).map(|k| (a.features[k][at] - b.features[k][at]).abs()).fold(0.0, f64::max);
        libm::pow(colour, 1.0 - libm::pow((feature / 2.0_f64.sqrt()).min(1.0), FEATURE_EXPONENT))
    });
    Some(all.sum::<f64>() / a.colours.len() as f64)
}

/// A picture as an eye sees it.
struct Seen {
    /// L*a*b* of every pixel as blurred by the eye, colours as faint as the light is (Hunt).
    colours: Vec<[f64; 3]>,
    /// Strength of edges and of points.
    features: [Vec<f64>; 2],
}

impl Seen {
    fn of(picture: &PictureFile, width: usize) -> Self {
        let opponent = |pixel: &image::Rgba<u8>| {
            let [r, g, b, _] = pixel.0.map(|part| linear(f64::from(part) / 255.0));
            to_opponent(xyz([r, g, b]))
        };
        let pixels: Vec<[f64; 3]> = picture.pixels().map(opponent).collect();
        let light: Vec<f64> = pixels.iter().map(|[y, ..]| (y + 16.0) / 116.0).collect();
        let [brightness, red_green, blue_yellow] = [0, 1, 2].map(|k| {
            let channel: Vec<f64> = pixels.iter().map(|pixel| pixel[k]).collect();
            blurred_by_eye(&channel, width, SENSITIVITY[k])
        });
        let inverse = inverse_of_to_xyz();
        let colour = |at: usize| {
            let rgb = times(&inverse, of_opponent([brightness[at], red_green[at], blue_yellow[at]]));
            lab(rgb.map(|part| part.clamp(0.0, 1.0)))
        };
        Self { colours: (0..pixels.len()).map(colour).collect(), features: features(&light, width) }
    }
}

/// Strength of edges and of points (ANA20, §4.2).
fn features(light: &[f64], width: usize) -> [Vec<f64>; 2] {
    let sd = 0.5 * FEATURE_DEG * PIXELS_A_DEGREE;
    let reach = libm::ceil(3.0 * sd) as i32;
    let kernel = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let plain = (-reach..=reach).map(f64::from).map(|x| of(x) * libm::exp(-x * x / (2.0 * sd * sd)));
        let plain: Vec<f64> = plain.collect();
        let sum = |sign: f64| plain.iter().map(|w| (sign * w).max(0.0)).sum::<f64>();
        let (above, below) = (sum(1.0), sum(-1.0));
        plain.into_iter().map(|w| if w > 0.0 { w / above } else { w / below.max(f64::MIN_POSITIVE) }).collect()
    };
    let smooth = kernel(&|_| 1.0);
    [kernel(&|x| -x), kernel(&|x| x * x / (sd * sd) - 1.0)].map(|of| {
        let (along, across) = (convolved(light, width, &of, &smooth), convolved(light, width, &smooth, &of));
        along.iter().zip(&across).map(|(x, y)| libm::hypot(*x, *y)).collect()
    })
}

/// A channel as blurred by the eye: the sum of two Gaussians, each of which is separable.
fn blurred_by_eye(channel: &[f64], width: usize, terms: [(f64, f64); 2]) -> Vec<f64> {
    let reach = libm::ceil(3.0 * libm::sqrt(WIDEST / (2.0 * PI * PI)) * PIXELS_A_DEGREE) as i32;
    let mut sum = vec![0.0; channel.len()];
    let mut whole = 0.0;
    for (a, b) in terms.into_iter().filter(|(a, _)| *a > 0.0) {
        let at = |x: i32| {
            let deg = f64::from(x) / PIXELS_A_DEGREE;
            libm::exp(-PI * PI * deg * deg / b)
        };
        let line: Vec<f64> = (-reach..=reach).map(at).collect();
        let (height, area) = (a * libm::sqrt(PI / b), line.iter().sum::<f64>());
        whole += height * area * area;
        let blurred = convolved(channel, width, &line, &line);
        sum.iter_mut().zip(blurred).for_each(|(sum, x)| *sum += height * x);
    }
    sum.into_iter().map(|x| x / whole).collect()
}

/// Convolved along rows, then along columns; beyond an edge its pixels go on.
fn convolved(of: &[f64], width: usize, along: &[f64], across: &[f64]) -> Vec<f64> {
    let (half, height) = (along.len() / 2, of.len() / width);
    let (mut rows, mut wide) = (vec![0.0; of.len()], Vec::with_capacity(width + 2 * half));
    for (row, from) in rows.chunks_exact_mut(width).zip(of.chunks_exact(width)) {
        wide.clear();
        wide.resize(half, from[0]);
        wide.extend_from_slice(from);
        wide.resize(width + 2 * half, from[width - 1]);
        for (to, from) in row.iter_mut().zip(wide.windows(along.len())) {
            *to = along.iter().zip(from).map(|(w, x)| w * x).sum();
        }
    }
    let mut all = vec![0.0; of.len()];
    for (y, row) in all.chunks_exact_mut(width).enumerate() {
        for (k, w) in across.iter().enumerate() {
            let from = (y + k).saturating_sub(half).min(height - 1) * width;
            row.iter_mut().zip(&rows[from..from + width]).for_each(|(to, x)| *to += w * x);
        }
    }
    all
}

/// Difference of two colours (HyAB), with its exponent.
fn difference(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let [light, red, blue] = std::array::from_fn(|k| a[k] - b[k]);
    libm::pow(light.abs() + libm::hypot(red, blue), COLOUR_EXPONENT)
}

/// L*a*b* of linear red, green and blue, with a* and b* as faint as the light is.
fn lab(rgb: [f64; 3]) -> [f64; 3] {
    let white = xyz([1.0; 3]);
    let xyz = xyz(rgb);
    let knee = 6.0 / 29.0;
    let [x, y, z] = std::array::from_fn(|k| {
        let part = xyz[k] / white[k];
        if part > knee * knee * knee { libm::cbrt(part) } else { part / (3.0 * knee * knee) + 4.0 / 29.0 }
    });
    let light = 116.0 * y - 16.0;
    [light, 0.01 * light * 500.0 * (x - y), 0.01 * light * 200.0 * (y - z)]
}

/// The opponent colours of XYZ, linear in it, and back.
fn to_opponent(xyz_of: [f64; 3]) -> [f64; 3] {
    let white = xyz([1.0; 3]);
    let [x, y, z]: [f64; 3] = std::array::from_fn(|k| xyz_of[k] / white[k]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn of_opponent([light, red_green, blue_yellow]: [f64; 3]) -> [f64; 3] {
    let (white, y) = (xyz([1.0; 3]), (light + 16.0) / 116.0);
    let parts = [red_green / 500.0 + y, y, y - blue_yellow / 200.0];
    std::array::from_fn(|k| parts[k] * white[k])
}

fn xyz(rgb: [f64; 3]) -> [f64; 3] {
    times(&TO_XYZ, rgb)
}

fn times(matrix: &[[f64; 3]; 3], of: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * of[0] + row[1] * of[1] + row[2] * of[2])
}

fn inverse_of_to_xyz() -> [[f64; 3]; 3] {
    let matrix = glam::DMat3::from_cols_array_2d(&TO_XYZ);
    matrix.inverse().to_cols_array_2d()
}

/// A part of sRGB without its curve.
fn linear(part: f64) -> f64 {
    if part <= 0.040_45 { part / 12.92 } else { libm::pow((part + 0.055) / 1.055, 2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgba;

    fn noise(seed: u32) -> impl Fn(u32, u32) -> u8 {
        move |x, y| {
            (x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663) ^ seed).wrapping_mul(2_654_435_761).to_be_bytes()
                [0]
        }
    }

    fn coloured(seed: u32) -> PictureFile {
        let [red, green, blue] = [seed, seed + 10, seed + 20].map(noise);
        PictureFile::from_fn(31, 24, |x, y| Rgba([red(x, y), green(x, y), blue(x, y), 255]))
    }

    #[test]
    fn differences_are_those_of_the_authors_implementation() {
        let even = |colour: [u8; 3]| PictureFile::from_pixel(31, 24, Rgba([colour[0], colour[1], colour[2], 255]));
        // `flip_evaluator` 1.x, LDR at 67.0206 pixels a degree, which calculates in f32 and looks maps up
        let cases = [
            ((coloured(1), coloured(2)), 0.456_036, 2e-6),
            ((even([90; 3]), even([120; 3])), 0.331_295, 6e-5),
            ((even([0, 255, 0]), even([0, 0, 255])), 1.0, 1e-9),
        ];
        for ((a, b), wanted, within) in cases {
            let found = flip(&a, &b).unwrap();
            assert!((found - wanted).abs() < within, "{found} {wanted}");
            assert!((flip(&b, &a).unwrap() - found).abs() < 1e-12, "which of the two comes first makes no difference");
        }
    }

    #[test]
    fn a_picture_does_not_differ_from_itself_and_one_of_another_size_is_not_compared() {
        let a = coloured(3);
        assert_eq!(flip(&a, &a), Some(0.0));
        assert_eq!(
            (flip(&a, &PictureFile::new(10, 40)), flip(&PictureFile::new(0, 0), &PictureFile::new(0, 0))),
            (None, None)
        );
    }
}
