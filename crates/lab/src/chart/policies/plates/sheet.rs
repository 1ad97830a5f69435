//! Pictures side by side under their names, half as large as they were drawn.
//!
//! In: columns of pictures. Out: one picture. Never here: drawing the pictures.

use super::super::super::figure::headings;
use metachron_render::PictureFile;

/// Factor by which differences are brightened.
const BRIGHTER: u16 = 4;
/// Height of the names above the columns, pixels.
const HEADING: u32 = 20;

/// Pictures under a name.
pub(super) struct Column {
    pub(super) name: String,
    /// From top to bottom.
    pub(super) pictures: Vec<PictureFile>,
}

/// The columns side by side; those below the first may have fewer pictures.
///
/// # Errors
/// A name that cannot be drawn.
pub(super) fn sheet(columns: &[Column]) -> anyhow::Result<PictureFile> {
    let Some(first) = columns.first().and_then(|column| column.pictures.first()) else {
        return Ok(PictureFile::new(1, 1));
    };
    let (width, height) = (first.width() / 2, first.height() / 2);
    let rows = columns.iter().map(|column| column.pictures.len()).max().unwrap_or(0) as u32;
    let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    let above = headings(&names, [width, HEADING])?;
    Ok(PictureFile::from_fn(width * columns.len() as u32, HEADING + rows * height, |x, y| {
        let Some(y) = y.checked_sub(HEADING) else {
            let [r, g, b] = above.get_pixel(x, y).0;
            return [r, g, b, 255].into();
        };
        let picture = columns[(x / width) as usize].pictures.get((y / height) as usize);
        picture.map_or([255; 4].into(), |picture| mean(picture, 2 * (x % width), 2 * (y % height)).into())
    }))
}

/// Mean colour of four pixels.
fn mean(picture: &PictureFile, x: u32, y: u32) -> [u8; 4] {
    let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
    std::array::from_fn(|i| {
        let sum: u16 =
            four.iter().filter_map(|(x, y)| picture.get_pixel_checked(*x, *y)).map(|p| u16::from(p.0[i])).sum();
        (sum / 4) as u8
    })
}

/// The difference of a picture from another one of its size, brightened.
pub(super) fn difference(picture: &PictureFile, full: &PictureFile) -> PictureFile {
    PictureFile::from_fn(picture.width(), picture.height(), |x, y| {
        let wanted = full.get_pixel_checked(x, y).map_or([0; 4], |pixel| pixel.0);
        let own = picture.get_pixel(x, y).0;
        let off = |i: usize| (BRIGHTER * u16::from(own[i].abs_diff(wanted[i]))).min(255) as u8;
        [off(0), off(1), off(2), 255].into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_has_names_above_pictures_in_columns() {
        let grey = |light: u8| PictureFile::from_pixel(160, 4, [light, 10, 10, 255].into());
        let column = |name: &str, light: u8| Column {
            name: name.to_owned(),
            pictures: vec![grey(light), difference(&grey(light), &grey(50))],
        };
        let sheet = sheet(&[column("", 50), column("greedy", 60)]).unwrap();
        assert_eq!(sheet.dimensions(), (160, HEADING + 4));
        let at = |x: u32, y: u32| sheet.get_pixel(x, HEADING + y).0;
        assert_eq!((at(0, 0)[0], at(80, 1)[0]), (50, 60));
        assert_eq!((at(0, 3), at(159, 3)), ([0, 0, 0, 255], [40, 0, 0, 255]));
        let dark = |from: u32| (from..from + 80).flat_map(|x| (0..HEADING).map(move |y| (x, y)));
        let letters = |from: u32| dark(from).filter(|(x, y)| sheet.get_pixel(*x, *y).0[0] < 128).count();
        assert!(letters(0) == 0 && letters(80) > 10, "{} {}", letters(0), letters(80));
    }
}
