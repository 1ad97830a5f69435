//! Similarity of two pictures: structural similarity (WBSS04) and the peak signal-to-noise ratio.
//!
//! In: two pictures of one size. Out: a number. Never here: the scene.

use super::offscreen::PictureFile;

/// Half the side of a window, pixels, its side, and the standard deviation of its weights (WBSS04, §III).
const HALF: usize = 5;
const SIDE: usize = 2 * HALF + 1;
const SIGMA: f64 = 1.5;
/// Constants that stabilise quotients of small numbers: (K L)², K = 0.01 and 0.03, L = 255.
const C1: f64 = 2.55 * 2.55;
const C2: f64 = 7.65 * 7.65;

/// Mean structural similarity of the pictures' luma over all windows of 11 × 11 pixels, −1 … 1, 1 for equal pictures; `None` where sizes
/// differ or there is no whole window.
#[must_use]
pub fn ssim(a: &PictureFile, b: &PictureFile) -> Option<f64> {
    let (width, height) = (a.width() as usize, a.height() as usize);
    if a.dimensions() != b.dimensions() || width < SIDE || height < SIDE {
        return None;
    }
    let (x, y) = (luma(a), luma(b));
    let product = |p: &[f64], q: &[f64]| p.iter().zip(q).map(|(p, q)| p * q).collect::<Vec<_>>();
    let mean = |of: &[f64]| blurred(of, width);
    let (mx, my) = (mean(&x), mean(&y));
    let (xx, yy, xy) = (mean(&product(&x, &x)), mean(&product(&y, &y)), mean(&product(&x, &y)));
    let all = (0..mx.len()).map(|i| {
        let (ux, uy) = (mx[i], my[i]);
        let (vx, vy, cov) = (xx[i] - ux * ux, yy[i] - uy * uy, xy[i] - ux * uy);
        (2.0 * ux * uy + C1) * (2.0 * cov + C2) / ((ux * ux + uy * uy + C1) * (vx + vy + C2))
    });
    Some(all.sum::<f64>() / mx.len() as f64)
}

/// 10 log₁₀(255² / mean square difference of red, green and blue), dB; infinite for equal pictures; `None` where sizes differ or there are
/// no pixels.
#[must_use]
pub fn psnr_db(a: &PictureFile, b: &PictureFile) -> Option<f64> {
    if a.dimensions() != b.dimensions() || a.is_empty() {
        return None;
    }
    let square = |(p, q): (&u8, &u8)| (f64::from(*p) - f64::from(*q)).powi(2);
    let sum: f64 =
        a.pixels().zip(b.pixels()).map(|(p, q)| p.0[..3].iter().zip(&q.0[..3]).map(square).sum::<f64>()).sum();
    let mean = sum / (3.0 * f64::from(a.width()) * f64::from(a.height()));
    Some(10.0 * libm::log10(255.0 * 255.0 / mean))
}

/// Luma of each pixel (BT.601, as in the authors' implementation), 0 … 255.
fn luma(picture: &PictureFile) -> Vec<f64> {
    picture
        .pixels()
        .map(|p| 0.299 * f64::from(p.0[0]) + 0.587 * f64::from(p.0[1]) + 0.114 * f64::from(p.0[2]))
        .collect()
}

fn weights() -> [f64; SIDE] {
    let plain: [f64; SIDE] = std::array::from_fn(|i| {
        let off = (i as f64 - HALF as f64) / SIGMA;
        libm::exp(-0.5 * off * off)
    });
    let sum: f64 = plain.iter().sum();
    plain.map(|w| w / sum)
}

/// Weighted means of all whole windows, row by row: along rows, then along columns.
fn blurred(of: &[f64], width: usize) -> Vec<f64> {
    let (weights, inner) = (weights(), width - 2 * HALF);
    let along: Vec<f64> = of
        .chunks_exact(width)
        .flat_map(|row| row.windows(SIDE).map(|w| w.iter().zip(&weights).map(|(x, k)| x * k).sum::<f64>()))
        .collect();
    let rows = along.len() / inner - 2 * HALF;
    let at = |i: usize| (0..SIDE).map(|k| along[i + k * inner] * weights[k]).sum::<f64>();
    (0..rows * inner).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgba;

    fn picture(of: impl Fn(u32, u32) -> u8) -> PictureFile {
        PictureFile::from_fn(31, 24, |x, y| Rgba([of(x, y), of(x, y), of(x, y), 255]))
    }

    fn noise(seed: u32) -> impl Fn(u32, u32) -> u8 {
        move |x, y| {
            (x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663) ^ seed).wrapping_mul(2_654_435_761).to_be_bytes()
                [0]
        }
    }

    #[test]
    fn a_picture_is_like_itself() {
        let a = picture(noise(1));
        assert!((ssim(&a, &a).unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(psnr_db(&a, &a), Some(f64::INFINITY));
    }

    #[test]
    fn even_pictures_differ_by_their_light_alone() {
        let (a, b) = (picture(|_, _| 90), picture(|_, _| 120));
        let wanted = (2.0 * 90.0 * 120.0 + C1) / (90.0_f64.powi(2) + 120.0_f64.powi(2) + C1);
        assert!((ssim(&a, &b).unwrap() - wanted).abs() < 1e-9);
        // 20 log₁₀ (255/30)
        assert!((psnr_db(&a, &b).unwrap() - 18.588_378_514_285_854).abs() < 1e-9);
    }

    #[test]
    fn a_negative_has_the_opposite_structure() {
        // ± 60 about 100 in a fine chequer, whose weighted mean in a window is the centre to 1e-3 of the amplitude
        let chequer = |sign: i32| picture(move |x, y| (100 + sign * if (x + y) % 2 == 0 { 60 } else { -60 }) as u8);
        let wanted = (C2 - 2.0 * 3600.0) / (C2 + 2.0 * 3600.0);
        assert!((ssim(&chequer(1), &chequer(-1)).unwrap() - wanted).abs() < 1e-3);
    }

    /// The sum over the 121 weights of every window, as in the paper.
    fn brute(a: &PictureFile, b: &PictureFile) -> f64 {
        let (x, y, w) = (luma(a), luma(b), weights());
        let (width, height) = (a.width() as usize, a.height() as usize);
        let (mut sum, mut count) = (0.0, 0.0);
        for (row, column) in (0..height - 10).flat_map(|r| (0..width - 10).map(move |c| (r, c))) {
            let all: Vec<_> = (0..121)
                .map(|k| {
                    let at = (row + k / 11) * width + column + k % 11;
                    (w[k / 11] * w[k % 11], x[at], y[at])
                })
                .collect();
            let mx: f64 = all.iter().map(|(w, x, _)| w * x).sum();
            let my: f64 = all.iter().map(|(w, _, y)| w * y).sum();
            let vx: f64 = all.iter().map(|(w, x, _)| w * (x - mx).powi(2)).sum();
            let vy: f64 = all.iter().map(|(w, _, y)| w * (y - my).powi(2)).sum();
            let cov: f64 = all.iter().map(|(w, x, y)| w * (x - mx) * (y - my)).sum();
            sum += (2.0 * mx * my + C1) * (2.0 * cov + C2) / ((mx * mx + my * my + C1) * (vx + vy + C2));
            count += 1.0;
        }
        sum / count
    }

    #[test]
    fn rows_then_columns_give_what_whole_windows_give() {
        let (a, b) = (picture(noise(1)), picture(|x, y| noise(1)(x, y) / 2 + noise(2)(x, y) / 4));
        assert!((ssim(&a, &b).unwrap() - brute(&a, &b)).abs() < 1e-9); // cancellation of 255² in f64
    }

    #[test]
    fn pictures_of_other_sizes_are_not_compared() {
        let small = PictureFile::new(10, 40);
        assert_eq!((ssim(&small, &small), psnr_db(&small, &picture(noise(1)))), (None, None));
        assert_eq!(psnr_db(&PictureFile::new(0, 0), &PictureFile::new(0, 0)), None);
    }
}
