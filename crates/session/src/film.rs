//! The film of a run: the picture on the screen at every tick of the target rate, as raw video (YUV4MPEG2).
//!
//! In: pictures, each with the time at which it was finished. Out: a file of one frame a tick; a late picture leaves the one before it on the
//! screen. Never here: drawing, clocks.

use super::error::SessionError;
use metachron_render::{PictureFile, Size};
use metachron_world::OutputFile;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A film being written.
pub(super) struct Film {
    file: BufWriter<OutputFile>,
    path: PathBuf,
    period: Duration,
    /// When the film begins; its first frame is the picture on the screen a tick later.
    begun: Duration,
    shown: Option<PictureFile>,
    written: u32,
}

impl Film {
    /// Begins a film of pictures of this size, one for each `period` from `begun` on.
    pub fn create(path: &Path, size: Size, period: Duration, begun: Duration) -> Result<Self, SessionError> {
        let rate_mhz = (1e3 / period.as_secs_f64()).round();
        let Size { width, height } = size;
        let head = format!("YUV4MPEG2 W{width} H{height} F{rate_mhz}:1000 Ip A1:1 C420jpeg\n");
        let open = || {
            let mut file = BufWriter::new(OutputFile::growing(path)?);
            file.write_all(head.as_bytes())?;
            Ok(file)
        };
        let file = open().map_err(|error| SessionError::File { path: path.to_owned(), error })?;
        Ok(Self { file, path: path.to_owned(), period, begun, shown: None, written: 0 })
    }

    /// A picture that was finished at the time `at`.
    pub fn push(&mut self, at: Duration, picture: PictureFile) -> Result<(), SessionError> {
        self.run_until(|tick| tick < at)?;
        self.shown = Some(picture);
        Ok(())
    }

    /// Ends the film at the time `at`.
    pub fn finish(mut self, at: Duration) -> Result<(), SessionError> {
        self.run_until(|tick| tick <= at)?;
        self.file.flush().map_err(|error| SessionError::File { path: self.path, error })
    }

    /// Writes the picture on the screen at the ticks that `are_past`, as soon as there is one.
    fn run_until(&mut self, are_past: impl Fn(Duration) -> bool) -> Result<(), SessionError> {
        let Some(picture) = &self.shown else { return Ok(()) };
        let planes = planes(picture);
        while are_past(self.begun + self.period * (self.written + 1)) {
            let frame = self.file.write_all(b"FRAME\n").and_then(|()| self.file.write_all(&planes));
            frame.map_err(|error| SessionError::File { path: self.path.clone(), error })?;
            self.written += 1;
        }
        Ok(())
    }
}

/// Luma of every pixel, then the two chromas of every four (ITU-R BT.601, 16 … 235 and 16 … 240).
fn planes(picture: &PictureFile) -> Vec<u8> {
    let (width, height) = picture.dimensions();
    let colour = |x: u32, y: u32| picture.get_pixel(x.min(width - 1), y.min(height - 1)).0.map(f64::from);
    let luma = |[r, g, b, _]: [f64; 4]| (16.0 + 0.256_788 * r + 0.504_129 * g + 0.097_906 * b).round() as u8;
    let mut planes: Vec<u8> = picture.pixels().map(|pixel| luma(pixel.0.map(f64::from))).collect();
    let blue = |[r, g, b]: [f64; 3]| 128.0 - 0.148_223 * r - 0.290_993 * g + 0.439_216 * b;
    let red = |[r, g, b]: [f64; 3]| 128.0 + 0.439_216 * r - 0.367_788 * g - 0.071_427 * b;
    let quarters = || (0..height.div_ceil(2)).flat_map(|y| (0..width.div_ceil(2)).map(move |x| (2 * x, 2 * y)));
    let mean = |(x, y): (u32, u32)| {
        let four = [colour(x, y), colour(x + 1, y), colour(x, y + 1), colour(x + 1, y + 1)];
        [0, 1, 2].map(|i| four.iter().map(|one| one[i]).sum::<f64>() / 4.0)
    };
    let means: Vec<[f64; 3]> = quarters().map(mean).collect();
    planes.extend(means.iter().map(|of| blue(*of).round() as u8));
    planes.extend(means.iter().map(|of| red(*of).round() as u8));
    planes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_shows_at_every_tick_the_newest_picture_that_was_finished() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film.y4m");
        let ms = Duration::from_millis;
        let mut film = Film::create(&path, Size { width: 3, height: 2 }, ms(20), ms(100)).unwrap();
        let grey = |light: u8| PictureFile::from_pixel(3, 2, [light, light, light, 255].into());
        // in time, late by one tick, in time again; the run ends with the fifth tick
        for (at, light) in [(105, 0), (145, 100), (165, 255)] {
            film.push(ms(at), grey(light)).unwrap();
        }
        film.finish(ms(200)).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let head = b"YUV4MPEG2 W3 H2 F50000:1000 Ip A1:1 C420jpeg\n";
        assert_eq!(&bytes[..head.len()], head);
        let frames: Vec<_> = bytes[head.len()..].chunks(6 + 6 + 4).collect();
        assert!(frames.iter().all(|frame| frame.starts_with(b"FRAME\n") && frame[12..] == [128; 4]), "{frames:?}");
        let lights: Vec<u8> = frames.iter().map(|frame| frame[6]).collect();
        assert_eq!(lights, [16, 16, 102, 235, 235]);
    }

    #[test]
    fn colours_become_those_of_the_standard() {
        let of = |colour: [u8; 3]| {
            let [r, g, b] = colour;
            let planes = planes(&PictureFile::from_pixel(1, 1, [r, g, b, 255].into()));
            [planes[0], planes[1], planes[2]]
        };
        // the primaries of colour bars (ITU-R BT.601)
        assert_eq!([of([255, 0, 0]), of([0, 255, 0]), of([0, 0, 255])], [[81, 90, 240], [145, 54, 34], [41, 240, 110]]);
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let missing = Path::new("/nowhere/at/all.y4m");
        let error =
            Film::create(missing, Size { width: 2, height: 2 }, Duration::from_millis(20), Duration::ZERO).err();
        assert!(error.unwrap().to_string().contains("/nowhere/at/all.y4m"));
    }
}
