//! Reads films as raw video (YUV4MPEG2), and packs their pictures for a page.
//!
//! In: a file as `run --video` writes it: 8 bits, 4:2:0. Out: pictures, or JPEG as text. Never here: comparing.

use anyhow::Context;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, Rgba};
use metachron_console::output::BadInput;
use metachron_render::PictureFile;
use serde::Serialize;
use std::path::Path;

/// Quality of the page's pictures, of 100: differences of levels are larger than what that loses.
const QUALITY: u8 = 92;
/// Greatest width and height, pixels.
const SIDE_MAX: u32 = 8192;

/// A film.
#[derive(Debug)]
pub(super) struct Film {
    /// The name of its file without its ending.
    pub name: String,
    /// Width and height, pixels.
    pub size: (u32, u32),
    hz: f64,
    /// Luma and both chromas of each picture.
    pub frames: Vec<Vec<u8>>,
}

/// A film as the page has it.
#[derive(Debug, Serialize)]
pub(super) struct PackedFilm<'a> {
    name: &'a str,
    hz: f64,
    /// Pictures as JPEG in base 64.
    frames: Vec<String>,
}

impl Film {
    /// Reads a file.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("{} cannot be read", path.display()))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Self::parse(name, &bytes).map_err(|why| BadInput(format!("{}: {why}", path.display())).into())
    }

    fn parse(name: String, bytes: &[u8]) -> Result<Self, String> {
        let (head, mut rest) = line(bytes).ok_or("has no first line; expected YUV4MPEG2")?;
        let mut words = head.split(' ');
        if words.next() != Some("YUV4MPEG2") {
            return Err("is no raw video; expected a first line that begins with YUV4MPEG2".to_owned());
        }
        let of = |key: char| words.clone().find_map(|word| word.strip_prefix(key));
        let side = |key| of(key).and_then(|text| text.parse().ok()).filter(|n| (1..=SIDE_MAX).contains(n));
        let sides = format!("has no size; expected W and H of 1 to {SIDE_MAX}");
        let size @ (width, height) = side('W').zip(side('H')).ok_or(sides)?;
        let rate = of('F').and_then(|text| text.split_once(':')).and_then(|(n, d)| {
            let hz = n.parse::<f64>().ok()? / d.parse::<f64>().ok()?;
            (hz.is_finite() && hz > 0.0).then_some(hz)
        });
        let hz = rate.ok_or("has no rate; expected F and a fraction above zero, such as F30:1")?;
        if let Some(other) = of('C').filter(|kind| !["420", "420jpeg", "420mpeg2", "420paldv"].contains(kind)) {
            return Err(format!("has pixels of kind C{other}; expected 8 bits and 4:2:0"));
        }
        let chroma = width.div_ceil(2) as usize * height.div_ceil(2) as usize;
        let length = width as usize * height as usize + 2 * chroma;
        let mut frames = Vec::new();
        while !rest.is_empty() {
            let number = frames.len() + 1;
            let begun = line(rest).filter(|(mark, _)| mark.starts_with("FRAME"));
            let (_, after) = begun.ok_or_else(|| format!("picture {number} does not begin with FRAME"))?;
            let planes =
                after.get(..length).ok_or_else(|| format!("picture {number} is cut off; expected {length} bytes"))?;
            frames.push(planes.to_vec());
            rest = &after[length..];
        }
        if frames.is_empty() { Err("has no picture".to_owned()) } else { Ok(Self { name, size, hz, frames }) }
    }

    /// Picture `at`, from 0.
    pub fn picture(&self, at: usize) -> PictureFile {
        let (width, height) = self.size;
        let (luma, chroma) = self.frames[at].split_at(width as usize * height as usize);
        let (blue, red) = chroma.split_at(chroma.len() / 2);
        PictureFile::from_fn(width, height, |x, y| {
            let quarter = (y / 2 * width.div_ceil(2) + x / 2) as usize;
            let y = 1.164_384 * (f64::from(luma[(y * width + x) as usize]) - 16.0);
            let [b, r] = [blue[quarter], red[quarter]].map(|c| f64::from(c) - 128.0);
            // ITU-R BT.601, 16 … 235; a cast of floats saturates
            let colour = [y + 1.596_027 * r, y - 0.391_762 * b - 0.812_968 * r, y + 2.017_232 * b];
            let [r, g, b] = colour.map(|c| c.round() as u8);
            Rgba([r, g, b, 255])
        })
    }

    /// The film for a page.
    pub fn packed(&self) -> anyhow::Result<PackedFilm<'_>> {
        let packed = |at| {
            let mut jpeg = Vec::new();
            let picture = DynamicImage::ImageRgba8(self.picture(at)).into_rgb8();
            JpegEncoder::new_with_quality(&mut jpeg, QUALITY).encode_image(&picture)?;
            Ok(STANDARD.encode(jpeg))
        };
        let frames = (0..self.frames.len()).map(packed).collect::<anyhow::Result<_>>()?;
        Ok(PackedFilm { name: &self.name, hz: self.hz, frames })
    }
}

/// The first line without its end, and what follows; `None` where there is no end, or no text before it.
fn line(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    Some((std::str::from_utf8(&bytes[..end]).ok()?, &bytes[end + 1..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_of_plain_colours_has_them_again() {
        // BT.601: white is 235, 128, 128; red is 81, 90, 240; black is 16, 128, 128
        for (yuv, rgb) in [([235, 128, 128], [255; 3]), ([81, 90, 240], [255, 0, 0]), ([16, 128, 128], [0; 3])] {
            let mut file = b"YUV4MPEG2 W3 H3 F30000:1001 Ip A1:1 C420jpeg\nFRAME\n".to_vec();
            file.extend([vec![yuv[0]; 9], vec![yuv[1]; 4], vec![yuv[2]; 4]].concat());
            let film = Film::parse("a".to_owned(), &file).unwrap();
            assert_eq!((film.size, film.frames.len()), ((3, 3), 1));
            assert!((film.hz - 29.97).abs() < 1e-3);
            for pixel in film.picture(0).pixels() {
                // eight bits of luma and chroma are 1.2 and 2 steps of a colour
                assert!((0..3).all(|i| pixel.0[i].abs_diff(rgb[i]) <= 2), "{:?} for {rgb:?}", pixel.0);
            }
        }
    }

    #[test]
    fn wrong_files_are_refused_with_their_reason() {
        for (file, why) in [
            (&b"RIFF"[..], "first line"),
            (b"JPEG W2 H2\n", "YUV4MPEG2"),
            (b"YUV4MPEG2 W0 H2 F1:1\n", "size"),
            (b"YUV4MPEG2 W2 H2 F1:0\n", "rate"),
            (b"YUV4MPEG2 W2 H2 F1:1 C444\n", "C444"),
            (b"YUV4MPEG2 W2 H2 F1:1\n", "no picture"),
            (b"YUV4MPEG2 W2 H2 F1:1\nFRAME\n12345", "cut off"),
            (b"YUV4MPEG2 W2 H2 F1:1\nframe\n123456", "FRAME"),
        ] {
            let told = Film::parse(String::new(), file).unwrap_err();
            assert!(told.contains(why), "{told}");
        }
    }
}
