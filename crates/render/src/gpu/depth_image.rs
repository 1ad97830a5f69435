//! A depth image: 16 bits a pixel, and how many metres one unit is.
//!
//! In: depths in metres. Out: the bytes of a PNG file. Never here: drawing, files.

use super::offscreen::GpuError;
use crate::seen::view::Size;
use image::{ImageBuffer, ImageEncoder, Luma};

/// Depths along the view, of every pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthImage {
    /// Its size.
    pub size: Size,
    /// Metres from the eye's plane, row by row from the top; infinite where there is nothing.
    pub depths_m: Vec<f32>,
}

impl DepthImage {
    /// The length that one unit of the file stands for, metres: 1, 2 or 5 times a power of ten, the least by which the farthest depth fits
    /// into 16 bits. 1 mm where nothing is seen.
    #[must_use]
    pub fn unit_m(&self) -> f64 {
        let far_m = self.depths_m.iter().copied().filter(|depth| depth.is_finite()).fold(0.0, f32::max);
        if far_m <= 0.0 {
            return 1e-3;
        }
        let least = f64::from(far_m) / f64::from(u16::MAX);
        let power = 10.0_f64.powf(least.log10().floor());
        [1.0, 2.0, 5.0].map(|round| round * power).into_iter().find(|unit| *unit >= least).unwrap_or(10.0 * power)
    }

    /// A PNG file of 16 bits: a pixel is its depth over [`DepthImage::unit_m`], rounded, 0 where there is nothing. The file says so too, in
    /// a text `Description`.
    ///
    /// # Errors
    /// [`GpuError::Encode`].
    pub fn png(&self) -> Result<Vec<u8>, GpuError> {
        let unit_m = self.unit_m();
        let unit = |depth: &f32| if depth.is_finite() { (f64::from(*depth) / unit_m).round() as u16 } else { 0 };
        let units: Vec<u16> = self.depths_m.iter().map(unit).collect();
        let Size { width, height } = self.size;
        let image = ImageBuffer::<Luma<u16>, _>::from_raw(width, height, units).unwrap_or_default();
        let mut bytes = Vec::new();
        let samples: Vec<u8> = image.iter().flat_map(|unit| unit.to_ne_bytes()).collect();
        let encoder = image::codecs::png::PngEncoder::new(&mut bytes);
        encoder.write_image(&samples, image.width(), image.height(), image::ExtendedColorType::L16)?;
        let said = format!("Description\0Depth along the view; one unit is {unit_m} m, 0 is nothing.");
        // a signature and the head of the image come first
        bytes.splice(HEAD..HEAD, text_chunk(said.as_bytes()));
        Ok(bytes)
    }
}

/// Bytes of a PNG file before the first chunk that may be a text: the signature, and the chunk IHDR.
const HEAD: usize = 8 + 25;

/// A chunk tEXt of a PNG file (ISO/IEC 15948, 11.3.3.2): length, type, contents, CRC of both.
fn text_chunk(contents: &[u8]) -> Vec<u8> {
    let typed = [b"tEXt", contents].concat();
    let crc = !typed.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { 0xEDB8_8320 ^ (crc >> 1) } else { crc >> 1 })
    });
    [&(contents.len() as u32).to_be_bytes()[..], &typed, &crc.to_be_bytes()].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_every_depth_to_half_a_unit_and_says_the_unit() {
        let size = Size { width: 3, height: 2 };
        let depths_m = vec![0.25, 1.0, 6.0, f32::INFINITY, 0.5, 0.123_45];
        let image = DepthImage { size, depths_m };
        assert_eq!(image.unit_m(), 1e-4);
        let bytes = image.png().unwrap();
        let read = image::load_from_memory(&bytes).unwrap().into_luma16();
        assert_eq!(read.into_raw(), [2500, 10_000, 60_000, 0, 5000, 1235]);
        assert!(String::from_utf8_lossy(&bytes).contains("one unit is 0.0001 m"));
    }
}
