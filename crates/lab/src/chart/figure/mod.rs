//! A figure as data: panels with axes and layers.
//!
//! In: numbers with labels. Out: the same, for `draw` to draw. Never here: pixels, files.

mod draw;
mod font;
mod scale;

pub use draw::headings;
use draw::{png, svg};
use metachron_console::files::write_file;
use std::path::{Path, PathBuf};

/// Some panels under one title.
#[derive(Debug, Clone, Default)]
pub struct Figure {
    /// The heading.
    pub title: String,
    /// The panels, row by row.
    pub panels: Vec<Panel>,
    /// Panels per row, ≥ 1.
    pub columns: usize,
}

impl Figure {
    /// Panels under a title, so many in a row.
    pub fn new(title: impl Into<String>, columns: usize, panels: Vec<Panel>) -> Self {
        Self { title: title.into(), panels, columns }
    }

    /// A single pair of axes under a title.
    pub fn single(title: impl Into<String>, x: Axis, y: Axis, layers: impl IntoIterator<Item = Layer>) -> Self {
        Self::new(title, 1, vec![Panel::new("", x, y, layers)])
    }
}

/// Writes a figure as SVG and as PNG.
///
/// # Errors
/// Text that cannot be drawn, a file that cannot be written.
pub fn write(folder: &Path, stem: &str, figure: &Figure) -> anyhow::Result<[PathBuf; 2]> {
    let (svg, png) = (svg(figure)?, png(figure)?);
    let paths = ["svg", "png"].map(|kind| folder.join(format!("{stem}.{kind}")));
    for (path, bytes) in paths.iter().zip([svg.as_bytes(), &png]) {
        write_file(path, bytes)?;
    }
    Ok(paths)
}

/// A pair of axes with the layers drawn in it.
#[derive(Debug, Clone)]
pub struct Panel {
    /// The heading.
    pub title: String,
    /// To the right.
    pub x: Axis,
    /// Upward.
    pub y: Axis,
    /// The layers, the first at the back.
    pub layers: Vec<Layer>,
}

impl Panel {
    /// Layers in a pair of axes.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis, layers: impl IntoIterator<Item = Layer>) -> Self {
        let layers: Vec<Layer> = layers.into_iter().collect();
        let (xs, ys): (Vec<f64>, Vec<f64>) = layers.iter().flat_map(Layer::points).unzip();
        Self { title: title.into(), x: x.fitted(xs), y: y.fitted(ys), layers }
    }
}

/// An axis.
#[derive(Debug, Clone)]
pub struct Axis {
    /// The quantity, with its unit.
    pub label: &'static str,
    /// Its least value; above 0 where `log`.
    pub low: f64,
    /// Its greatest, above `low`.
    pub high: f64,
    /// Whether equal ratios are equal distances.
    pub log: bool,
}

impl Axis {
    /// Equal differences are equal distances.
    pub fn linear(label: &'static str, low: f64, high: f64) -> Self {
        Self { label, low, high, log: false }
    }

    /// Equal ratios are equal distances.
    pub fn log(label: &'static str, low: f64, high: f64) -> Self {
        Self { label, low, high, log: true }
    }

    /// Equal ratios are equal distances; the range is that of what is drawn.
    pub const fn log_fit(label: &'static str) -> Self {
        Self { label, low: f64::NAN, high: f64::NAN, log: true }
    }

    /// The same with the range of these numbers, unless it has one.
    fn fitted(self, numbers: Vec<f64>) -> Self {
        let (low, high) = if self.low.is_nan() { span(numbers, self.log) } else { (self.low, self.high) };
        Self { low, high, ..self }
    }

    /// Whether a value is below the low end (−1) or above the high end (1) of the axis by more than rounding, or on the axis (0).
    pub(super) fn beyond(&self, value: f64) -> i32 {
        let slack = 1e-9 * (self.high - self.low);
        i32::from(value > self.high + slack) - i32::from(value < self.low - slack)
    }
}

/// A mark of one colour, with a label of its own in the legend (none where it is empty).
#[derive(Debug, Clone)]
pub struct Layer {
    /// Its name.
    pub label: String,
    /// Its colour.
    pub colour: Colour,
    /// The shape.
    pub mark: Mark,
}

impl Layer {
    /// A line through points: measurements.
    pub fn line(label: impl Into<String>, colour: Colour, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { label: label.into(), colour, mark: Mark::Line(points.into_iter().collect()) }
    }

    /// A dashed line through points: theory.
    pub fn dashed(label: impl Into<String>, colour: Colour, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { label: label.into(), colour, mark: Mark::Dashed(points.into_iter().collect()) }
    }

    /// Points.
    pub fn dots(label: impl Into<String>, colour: Colour, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { label: label.into(), colour, mark: Mark::Dots(points.into_iter().collect()) }
    }

    /// Rectangles [x from, x to, y from, y to].
    pub fn cells(label: impl Into<String>, colour: Colour, cells: impl IntoIterator<Item = [f64; 4]>) -> Self {
        Self { label: label.into(), colour, mark: Mark::Cells(cells.into_iter().collect()) }
    }

    /// Its points; of rectangles two corners.
    fn points(&self) -> Vec<(f64, f64)> {
        match &self.mark {
            Mark::Line(points) | Mark::Dashed(points) | Mark::Dots(points) => points.clone(),
            Mark::Cells(cells) => {
                cells.iter().flat_map(|&[left, right, low, high]| [(left, low), (right, high)]).collect()
            }
        }
    }

    /// A limit: a dashed grey line at a height.
    pub fn limit(label: impl Into<String>, ends: [f64; 2], at: f64) -> Self {
        Self::dashed(label, Colour::Grey, ends.map(|x| (x, at)))
    }
}

/// A line for each name, in the colours of lines.
pub fn lines<'a, P: IntoIterator<Item = (f64, f64)>>(
    names: impl IntoIterator<Item = &'a str>,
    points: impl Fn(&'a str) -> P,
) -> impl Iterator<Item = Layer> {
    names.into_iter().zip(Colour::LINES).map(move |(name, colour)| Layer::line(name, colour, points(name)))
}

/// The shape of a layer. Values outside the axes are drawn at the border, with an arrow; values that are not finite are left out.
#[derive(Debug, Clone)]
pub enum Mark {
    /// A line through points: measurements. A single point is drawn as a dot.
    Line(Vec<(f64, f64)>),
    /// A dashed line through points: theory, or a limit.
    Dashed(Vec<(f64, f64)>),
    /// Points.
    Dots(Vec<(f64, f64)>),
    /// Rectangles [x from, x to, y from, y to].
    Cells(Vec<[f64; 4]>),
}

/// Colours that are distinct for colour-blind readers and in grey print (Okabe and Ito's; the first two are those of the other figures).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// Blue: our own results.
    Blue,
    /// Red: the comparison.
    Red,
    /// Green.
    Green,
    /// Orange.
    Orange,
    /// Light blue.
    Sky,
    /// Purple.
    Purple,
    /// Grey: limits and theory.
    Grey,
}

impl Colour {
    /// Colours for lines, in order of use.
    pub const LINES: [Self; 6] = [Self::Blue, Self::Red, Self::Green, Self::Orange, Self::Purple, Self::Sky];

    /// The colour of number `k` of the layers drawn behind our own.
    pub const fn behind(k: usize) -> Self {
        match k {
            0 => Self::Grey,
            _ => Self::LINES[(Self::LINES.len() - 1) - (k - 1) % Self::LINES.len()],
        }
    }
}

/// The range that contains all numbers, with a small margin; (0, 1) where there are none.
pub fn span(numbers: impl IntoIterator<Item = f64>, log: bool) -> (f64, f64) {
    let good = |v: &f64| v.is_finite() && (!log || *v > 0.0);
    let (low, high) = numbers
        .into_iter()
        .filter(good)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    match (low <= high, log) {
        (false, true) => (0.1, 1.0),
        (false, false) => (0.0, 1.0),
        (true, true) => (low / 1.4, high * 1.4),
        (true, false) => {
            let room = (0.06 * (high - low)).max(1e-9 * high.abs().max(1e-9));
            (low - room, high + room)
        }
    }
}
