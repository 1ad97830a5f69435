//! Textures: pixels and their mapping onto a mesh.
//!
//! In: pixels, or the name of a pattern. Out: a [`Texture`]. Never here: files, light, the GPU.

use std::sync::LazyLock;

/// Mapping of a texture onto a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wrap {
    /// Where the mesh's corners say ([`metachron_geometry::PrimitiveVertex::uv`]).
    Corners,
    /// Projected onto each side along the axis nearest to the normal: one repeat per this many metres, finite, > 0.
    Sides(f32),
}

/// Pixels that repeat across a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    width: u32,
    height: u32,
    /// Row by row from the top: red, green, blue (sRGB), and an unused byte.
    texels: Vec<[u8; 4]>,
    wrap: Wrap,
    /// [`Texture::loss`].
    loss: f32,
}

/// Width and height of a pattern, pixels.
const PATTERN: u32 = 256;

metachron_core::choices! {
    /// A procedural pattern that repeats without a seam.
    #[derive(Hash, PartialOrd, Ord)]
    pub enum Pattern {
        /// Four by four squares, light and dark.
        Checker = "checker",
        /// Boards next to each other, each in its own shade, with a grain.
        Planks = "planks",
        /// Four shelves of books.
        Books = "books",
    }
}

impl Pattern {
    /// The pattern, one repeat every `metres` (finite, > 0).
    #[must_use]
    pub fn texture(self, metres: f32) -> Texture {
        let of = match self {
            Self::Checker => checker,
            Self::Planks => planks,
            Self::Books => books,
        };
        let texel = |i: u32| {
            let [r, g, b] = of(i % PATTERN, i / PATTERN);
            [r, g, b, 255]
        };
        let texels = (0..PATTERN * PATTERN).map(texel).collect();
        Texture::made(PATTERN, PATTERN, texels, Wrap::Sides(metres))
    }
}

impl Texture {
    /// A texture of width × height pixels; `None` where that is zero or differs from the number of texels.
    #[must_use]
    pub fn new(width: u32, height: u32, texels: Vec<[u8; 4]>, wrap: Wrap) -> Option<Self> {
        let count = u64::from(width) * u64::from(height);
        (count > 0 && count == texels.len() as u64).then(|| Self::made(width, height, texels, wrap))
    }

    fn made(width: u32, height: u32, texels: Vec<[u8; 4]>, wrap: Wrap) -> Self {
        let mean = |of: &dyn Fn(f64) -> f64, channel: usize| {
            texels.iter().map(|texel| of(f64::from(texel[channel]) / 255.0)).sum::<f64>() / texels.len() as f64
        };
        let variance = |channel| mean(&|x| x * x, channel) - mean(&|x| x, channel) * mean(&|x| x, channel);
        // two colours by chance differ by a sixth in the mean square of a channel
        let loss = (0..3).map(variance).sum::<f64>() / 3.0 / (1.0 / 6.0);
        Self { width, height, texels, wrap, loss: loss as f32 }
    }

    /// What a surface loses that is drawn in the mean colour instead, as a part of its pixels: their mean square difference over that of two
    /// colours by chance.
    #[must_use]
    pub fn loss(&self) -> f32 {
        self.loss
    }

    /// Pixels across and down.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// The pixels, row by row from the top.
    #[must_use]
    pub fn texels(&self) -> &[[u8; 4]] {
        &self.texels
    }

    /// Its mapping onto a mesh.
    #[must_use]
    pub fn wrap(&self) -> Wrap {
        self.wrap
    }

    /// Its mean colour, sRGB, averaged in linear light.
    #[must_use]
    pub fn mean(&self) -> [u8; 3] {
        let mut sums = [0.0; 3];
        for texel in &self.texels {
            sums.iter_mut().zip(texel).for_each(|(sum, value)| *sum += light(*value));
        }
        sums.map(|sum| value(sum / self.texels.len() as f64))
    }

    /// The same at half its size, at least 1: each pixel is the mean linear light of the four it replaces.
    #[must_use]
    pub fn halved(&self) -> Self {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let at = |x: u32, y: u32| {
            let (x, y) = (x.min(self.width - 1), y.min(self.height - 1));
            self.texels[y as usize * self.width as usize + x as usize]
        };
        let mean = |i: u32| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            let four = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
            let of = |channel: usize| value(0.25 * four.iter().map(|t| light(t[channel])).sum::<f64>());
            [of(0), of(1), of(2), 255]
        };
        Self::made(width, height, (0..width * height).map(mean).collect(), self.wrap)
    }
}

/// The linear light of an sRGB value, 0 … 1: there are 256 of them, and a texture asks for millions.
fn light(value: u8) -> f64 {
    static LIGHTS: LazyLock<[f64; 256]> = LazyLock::new(|| {
        std::array::from_fn(|value| {
            let c = value as f64 / 255.0;
            if c <= 0.04045 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) }
        })
    });
    LIGHTS[usize::from(value)]
}

/// The sRGB value of a linear light.
fn value(light: f64) -> u8 {
    let c = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * libm::pow(light, 1.0 / 2.4) - 0.055 };
    // a cast of floats saturates
    libm::round(255.0 * c) as u8
}

fn checker(x: u32, y: u32) -> [u8; 3] {
    if (x / 64 + y / 64).is_multiple_of(2) { [226, 222, 214] } else { [74, 78, 86] }
}

fn planks(x: u32, y: u32) -> [u8; 3] {
    let board = y / 32;
    if y.is_multiple_of(32) || (x + 96 * board).is_multiple_of(PATTERN) {
        return [58, 38, 24];
    }
    let shade = 0.82 + 0.18 * chance(board, 7);
    // a grain of long streaks: constant over eight pixels along the board
    let grain = 0.92 + 0.08 * chance(y, x / 8);
    [172.0, 122.0, 78.0].map(|c: f64| (c * shade * grain) as u8)
}

fn books(x: u32, y: u32) -> [u8; 3] {
    const BINDINGS: [[u8; 3]; 6] =
        [[122, 38, 34], [38, 68, 96], [52, 84, 52], [150, 116, 64], [88, 60, 96], [180, 172, 152]];
    let (shelf, height) = (y / 64, 63 - y % 64);
    let book = x / 8;
    let tall = 40 + (16.0 * chance(book, shelf)) as u32;
    match height {
        0..=5 => [104, 72, 44],
        h if h > tall => [24, 18, 14],
        _ if x.is_multiple_of(8) => [20, 16, 14],
        h if h == tall - 8 || h == tall - 10 => [206, 178, 96],
        _ => BINDINGS[(6.0 * chance(book, 31 + shelf)) as usize % BINDINGS.len()],
    }
}

/// A number in 0 … 1 from two integers, by the finaliser of splitmix.
fn chance(a: u32, b: u32) -> f64 {
    let mut h = (u64::from(a) << 32 | u64::from(b)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((h ^ (h >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pattern_has_its_name_and_more_than_one_colour() {
        for pattern in Pattern::ALL {
            let texture = pattern.texture(1.0);
            let first = texture.texels()[300];
            assert!(texture.texels().iter().any(|texel| *texel != first), "{}", pattern.name());
            assert_eq!(texture.texels().len(), 256 * 256);
        }
    }

    #[test]
    fn mean_is_of_light_and_not_of_values() {
        let two = Texture::new(2, 1, vec![[0, 0, 0, 0], [255, 255, 255, 0]], Wrap::Corners).unwrap();
        // half of all light is the sRGB value 188, not 128
        assert_eq!(two.mean(), [188; 3]);
        assert_eq!(two.halved().texels(), [[188, 188, 188, 255]]);
    }

    #[test]
    fn halving_keeps_the_mean_down_to_one_pixel() {
        let mut texture = Pattern::Books.texture(1.0);
        let mean = texture.mean();
        while texture.size() != (1, 1) {
            texture = texture.halved();
        }
        // eight halvings, each rounded by half a step
        assert!(texture.mean().iter().zip(mean).all(|(a, b)| a.abs_diff(b) <= 4), "{:?} and {mean:?}", texture.mean());
        let odd = Texture::new(3, 1, vec![[9; 4]; 3], Wrap::Corners).unwrap();
        assert_eq!(odd.halved().size(), (1, 1));
    }

    #[test]
    fn a_texture_with_missing_pixels_is_refused() {
        assert!(Texture::new(2, 2, vec![[0; 4]; 3], Wrap::Corners).is_none());
        assert!(Texture::new(0, 9, Vec::new(), Wrap::Corners).is_none());
    }
}
