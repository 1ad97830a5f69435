//! The texture of wet tissue: mottling, veins and folds, generated from noise when the first renderer starts.
//!
//! In: nothing. Out: one repeating texture with its mipmaps: red = mottling, green = veins, blue and alpha = slopes of the folds along and
//! around. Never here: colours, which are the object's own.

use std::sync::LazyLock;

/// Texels across.
pub const TEXELS: u32 = 512;

/// Every mipmap level, from the finest to 1 × 1, RGBA of 8 bits, one after another.
pub static LEVELS: LazyLock<Vec<u8>> = LazyLock::new(levels);

fn levels() -> Vec<u8> {
    let mut level = finest();
    let mut all = level.clone();
    let mut size = TEXELS as usize;
    while size > 1 {
        level = halved(&level, size);
        size /= 2;
        all.extend_from_slice(&level);
    }
    all
}

fn finest() -> Vec<u8> {
    let n = TEXELS as usize;
    let folds: Vec<f32> = cells(n).map(|(x, y)| fold_height(x, y)).collect();
    let height = |x: usize, y: usize| folds[(y % n) * n + x % n];
    let mut texels = Vec::with_capacity(4 * n * n);
    for (i, (x, y)) in cells(n).enumerate() {
        let (column, row) = (i % n, i / n);
        let slope = |ahead: f32, behind: f32| 0.5 + 0.5 * ((ahead - behind) * 9.0).clamp(-1.0, 1.0);
        let along = slope(height(column + 1, row), height(column + n - 1, row));
        let around = slope(height(column, row + 1), height(column, row + n - 1));
        let mottle = 0.5 + 0.34 * layers(x, y, 4, 3) + 0.16 * layers(x, y, 24, 2);
        texels.extend([mottle, veins(x, y), along, around].map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8));
    }
    texels
}

/// Texel centres in 0 … 1, row by row.
fn cells(n: usize) -> impl Iterator<Item = (f32, f32)> {
    (0..n * n).map(move |i| (((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32))
}

/// Rings of fine folds around the tube, bent and broken by noise.
fn fold_height(x: f32, y: f32) -> f32 {
    let bent = x + 0.06 * layers(x, y, 3, 2);
    let rings = (bent * std::f32::consts::TAU * 9.0).sin();
    0.10 * rings * (0.6 + 0.4 * layers(x, y, 5, 1)) + 0.22 * layers(x, y, 10, 2) + 0.04 * layers(x, y, 48, 1)
}

/// Thin dark lines where warped noise passes through zero: wide ones, and finer ones between.
fn veins(x: f32, y: f32) -> f32 {
    let (wx, wy) = (x + 0.05 * layers(x, y, 6, 2), y + 0.05 * layers(y, x, 6, 2));
    let line = |cells: u32, width: f32| {
        let v = layers(wx, wy, cells, 1).abs() / width;
        (1.0 - v * v).max(0.0)
    };
    let patch = (0.5 + 0.9 * layers(x, y, 3, 1)).clamp(0.0, 1.0);
    (line(3, 0.028) * 0.9).max(line(8, 0.05) * 0.5 * patch)
}

/// Noise of about −1 … 1 that repeats every unit: `octaves` layers, the first with `cells` cells.
fn layers(x: f32, y: f32, cells: u32, octaves: u32) -> f32 {
    let layer = |o: u32| noise(x, y, cells << o) / (1 << o) as f32;
    (0..octaves).map(layer).sum()
}

/// Gradient noise with `cells` cells in a unit, repeating.
fn noise(x: f32, y: f32, cells: u32) -> f32 {
    let (u, v) = (x * cells as f32, y * cells as f32);
    let (i, j) = (u.floor(), v.floor());
    let (fu, fv) = (u - i, v - j);
    let corner = |di: u32, dj: u32| {
        let wrap = |c: f32, d: u32| (c as i64 + i64::from(d)).rem_euclid(i64::from(cells)) as u32;
        let angle = hash(wrap(i, di), wrap(j, dj), cells) * std::f32::consts::TAU;
        angle.cos() * (fu - di as f32) + angle.sin() * (fv - dj as f32)
    };
    let ease = |t: f32| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (eu, ev) = (ease(fu), ease(fv));
    let top = corner(0, 0) + (corner(1, 0) - corner(0, 0)) * eu;
    let bottom = corner(0, 1) + (corner(1, 1) - corner(0, 1)) * eu;
    1.6 * (top + (bottom - top) * ev)
}

/// A number in 0 … 1 from three integers, by the finaliser of splitmix.
fn hash(x: u32, y: u32, seed: u32) -> f32 {
    let mut h = (u64::from(x) << 40) ^ (u64::from(y) << 20) ^ u64::from(seed) ^ 0x9e37_79b9_7f4a_7c15;
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((h ^ (h >> 31)) >> 40) as f32 / (1 << 24) as f32
}

/// The texture at half its size: means of four texels.
fn halved(texels: &[u8], size: usize) -> Vec<u8> {
    let half = size / 2;
    let mean = |i: usize| {
        let (channel, x, y) = (i % 4, i / 4 % half, i / 4 / half);
        let at = |dx: usize, dy: usize| u32::from(texels[4 * ((2 * y + dy) * size + 2 * x + dx) + channel]);
        ((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4) as u8
    };
    (0..4 * half * half).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_repeats_without_a_seam() {
        for i in 0..20 {
            let y = i as f32 / 20.0;
            // one cell is 1/6; across the seam the same polynomial is evaluated from its other end
            assert!((noise(0.0, y, 6) - noise(1.0, y, 6)).abs() < 1e-5);
        }
    }

    #[test]
    fn smaller_copies_keep_the_mean() {
        let n = 16;
        let texels: Vec<u8> = (0..4 * n * n).map(|i| (i * 7 % 251) as u8).collect();
        let mean = |t: &[u8]| t.iter().map(|&v| f64::from(v)).sum::<f64>() / t.len() as f64;
        // each texel is rounded once: off by half a step at most
        assert!((mean(&texels) - mean(&halved(&texels, n))).abs() <= 0.5);
    }
}
