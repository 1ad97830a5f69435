//! Height fields: grids of heights on the ground (`hfield`), as closed surfaces.
//!
//! In: the `hfield` of a file, and its data. Out: its surface. Never here: the file that it becomes.

use crate::imported::ImportError;
use crate::xml::Element;
use glam::DVec3;
use image::codecs::png::PngDecoder;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat};
use metachron_geometry::{Solid, Triangles};
use std::io::Cursor;

/// The most rows or columns of a grid, and the most triangles of its surface: those of a mesh.
const SIDE_MAX: usize = 400_000;
const TRIANGLES_MAX: usize = 1_000_000;

/// The heights of a grid over its base, row by row from its lowest y, each row from its lowest x.
pub(super) struct Heights {
    rows: usize,
    columns: usize,
    /// From 0 to 1; none where all are equal.
    of_points: Vec<f64>,
}

/// The shape of a height field about the middle of its base.
pub(super) enum Ground {
    Uneven(Triangles),
    /// A box whose centre is so far below.
    Even {
        solid: Solid,
        below_m: f64,
    },
}

impl Heights {
    /// The heights that the file has in place, from its highest y to its lowest; zero where there are none.
    pub(super) fn here(element: &Element) -> Result<Self, ImportError> {
        let count = |name: &str| {
            let count = element.needed_number(name)?;
            let is_count = count.fract() == 0.0 && (2.0..=SIDE_MAX as f64).contains(&count);
            let expected = || element.wrong(format!("`{name}` is {count}; expected a whole number, 2 to {SIDE_MAX}"));
            if is_count { Ok(count as usize) } else { Err(expected()) }
        };
        let [rows, columns] = [count("nrow")?, count("ncol")?];
        let all = element.list("elevation")?.unwrap_or_default();
        if !all.is_empty() && all.len() != rows * columns {
            let wanted = rows * columns;
            return Err(element.wrong(format!("`elevation` has {} numbers; expected {wanted}", all.len())));
        }
        let of_points = all.chunks(columns).rev().flatten().copied().collect();
        Self::new(rows, columns, of_points).map_err(|why| element.wrong(why))
    }

    /// The heights of a file: a PNG, or MuJoCo's binary file, which has rows and columns as whole numbers of 32 bits, then single-precision
    /// heights.
    pub(super) fn read(bytes: &[u8]) -> Result<Self, String> {
        if matches!(image::guess_format(bytes), Ok(ImageFormat::Png)) {
            return Self::of_png(bytes);
        }
        let words = bytes.as_chunks::<4>().0;
        let count = |at: usize| words.get(at).and_then(|word| usize::try_from(i32::from_le_bytes(*word)).ok());
        let (Some(rows), Some(columns)) = (count(0), count(1)) else {
            return Err(
                "expected a PNG, or the counts of its rows and columns first, whole numbers of 32 bits".to_owned()
            );
        };
        let wanted = rows.checked_mul(columns).and_then(|points| points.checked_add(2)?.checked_mul(4));
        if wanted != Some(bytes.len()) {
            let found = format!("it has {rows} rows and {columns} columns in {} bytes", bytes.len());
            return Err(format!(
                "{found}; expected two of each or more, and 4 bytes for each height after the first 8"
            ));
        }
        let of_points = words[2..].iter().map(|word| f64::from(f32::from_le_bytes(*word))).collect();
        Self::new(rows, columns, of_points)
    }

    /// The heights of a picture, from its highest y to its lowest: of its grey values, or of one in colours the red ones,
    /// the highest 8 bits, as in MuJoCo.
    fn of_png(bytes: &[u8]) -> Result<Self, String> {
        let why = |error: ImageError| error.to_string();
        let picture = PngDecoder::new(Cursor::new(bytes)).map_err(why)?;
        let (columns, rows) = picture.dimensions();
        let (rows, columns) = (rows as usize, columns as usize);
        check_size(rows, columns)?;
        let points = DynamicImage::from_decoder(picture).map_err(why)?.into_rgb16();
        let of_points = points.rows().rev().flatten().map(|point| f64::from(point.0[0] >> 8)).collect();
        Self::new(rows, columns, of_points)
    }

    fn new(rows: usize, columns: usize, mut of_points: Vec<f64>) -> Result<Self, String> {
        check_size(rows, columns)?;
        let low = of_points.iter().copied().fold(f64::INFINITY, f64::min);
        let high = of_points.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if !of_points.is_empty() && !(high - low).is_finite() {
            return Err(format!("its heights are from {low:e} to {high:e}; expected finite ones"));
        }
        of_points.iter_mut().for_each(|height| *height = (*height - low) / (high - low));
        if high <= low {
            of_points.clear();
        }
        Ok(Self { rows, columns, of_points })
    }

    /// The ground over a base of `size`: half of its length along x and y, its greatest height, and its depth, metres.
    pub(super) fn ground(&self, [half_x, half_y, height_m, depth_m]: [f64; 4]) -> Ground {
        let Self { rows, columns, of_points } = self;
        if of_points.is_empty() {
            let half_extents_m = DVec3::new(half_x, half_y, 0.5 * depth_m);
            return Ground::Even { solid: Solid::Box { half_extents_m }, below_m: 0.5 * depth_m };
        }
        let place = |row: usize, column: usize, z: f64| {
            let share = |at: usize, of: usize| 2.0 * at as f64 / (of - 1) as f64 - 1.0;
            DVec3::new(half_x * share(column, *columns), half_y * share(row, *rows), z)
        };
        let at = |row: usize, column: usize| row * columns + column;
        let grid = (0..*rows).flat_map(|row| (0..*columns).map(move |column| (row, column)));
        let mut points: Vec<DVec3> =
            grid.map(|(row, column)| place(row, column, height_m * of_points[at(row, column)])).collect();
        let mut triangles = Vec::new();
        let mut quad = |[a, b, c, d]: [usize; 4]| {
            triangles.extend([[a, b, c], [a, c, d]].map(|corners| corners.map(|corner| corner as u32)));
        };
        for (row, column) in (1..*rows).flat_map(|row| (1..*columns).map(move |column| (row, column))) {
            quad([at(row - 1, column - 1), at(row - 1, column), at(row, column), at(row, column - 1)]);
        }
        // its rim, round counterclockwise, and the same below it
        let (last_row, last_column) = (rows - 1, columns - 1);
        let near = (0..last_column).map(|column| (0, column));
        let right = (0..last_row).map(|row| (row, last_column));
        let far = (1..=last_column).rev().map(|column| (last_row, column));
        let left = (1..=last_row).rev().map(|row| (row, 0));
        let rim: Vec<_> = near.chain(right).chain(far).chain(left).collect();
        let below = points.len();
        points.extend(rim.iter().map(|(row, column)| place(*row, *column, -depth_m)));
        for (side, (row, column)) in rim.iter().enumerate() {
            let next = (side + 1) % rim.len();
            let (next_row, next_column) = rim[next];
            quad([at(*row, *column), below + side, below + next, at(next_row, next_column)]);
        }
        let middle = points.len();
        points.push(DVec3::NEG_Z * depth_m);
        for side in 0..rim.len() {
            let next = (side + 1) % rim.len();
            triangles.push([middle, below + next, below + side].map(|corner| corner as u32));
        }
        Ground::Uneven(Triangles { points, triangles })
    }
}

/// Checks that a grid has a cell, and that its surface is no larger than meshes are.
fn check_size(rows: usize, columns: usize) -> Result<(), String> {
    // two for each cell of the grid, and three for each side of its rim
    let triangles = rows.saturating_mul(columns).saturating_mul(2) + 6 * (rows + columns);
    let has = format!("it has {rows} rows and {columns} columns");
    match triangles {
        _ if rows < 2 || columns < 2 => Err(format!("{has}; expected two of each or more")),
        ..=TRIANGLES_MAX => Ok(()),
        _ => Err(format!("{has}, {triangles} triangles; expected at most {TRIANGLES_MAX}")),
    }
}
