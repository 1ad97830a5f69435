//! A figure as data: panels with axes, and what lies in them.
//!
//! In: numbers with labels. Out: the same, for `draw` to draw. Never here: pixels, files.

mod draw;
mod font;
mod scale;

pub(in crate::cli) use draw::{headings, png, svg};

/// Some panels under one title.
#[derive(Debug, Clone, Default)]
pub(in crate::cli) struct Figure {
    /// What it shows.
    pub title: String,
    /// The panels, row by row.
    pub panels: Vec<Panel>,
    /// How many panels stand beside each other, ≥ 1.
    pub columns: usize,
}

/// A pair of axes with what lies between them.
#[derive(Debug, Clone)]
pub(in crate::cli) struct Panel {
    /// What it shows.
    pub title: String,
    /// To the right.
    pub x: Axis,
    /// Upward.
    pub y: Axis,
    /// What is drawn, the first at the back.
    pub layers: Vec<Layer>,
}

/// An axis.
#[derive(Debug, Clone)]
pub(in crate::cli) struct Axis {
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

    /// Whether a value lies beyond the low end (−1) or the high end (1) of the axis by more than rounding, or on it (0).
    pub(super) fn beyond(&self, value: f64) -> i32 {
        let slack = 1e-9 * (self.high - self.low);
        i32::from(value > self.high + slack) - i32::from(value < self.low - slack)
    }
}

/// Something of one colour, with a label of its own in the legend (none where it is empty).
#[derive(Debug, Clone)]
pub(in crate::cli) struct Layer {
    /// Its name.
    pub label: String,
    /// Its colour.
    pub colour: Colour,
    /// What is drawn.
    pub mark: Mark,
}

/// What a layer is made of. Values outside the axes are drawn at their edge, with an arrow that says so; those that are not finite are left out.
#[derive(Debug, Clone)]
pub(in crate::cli) enum Mark {
    /// A line through points: measured. One point alone is drawn as a dot.
    Line(Vec<(f64, f64)>),
    /// A broken line through points: theory, or a limit.
    Dashed(Vec<(f64, f64)>),
    /// Points.
    Dots(Vec<(f64, f64)>),
    /// Rectangles [x from, x to, y from, y to].
    Cells(Vec<[f64; 4]>),
}

/// Colours that people with any sight tell apart, also printed grey (Okabe and Ito's, the first two those of the other figures).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::cli) enum Colour {
    /// Blue: ours.
    Blue,
    /// Red: what it is compared with.
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
    /// Colours for lines in the order they are taken.
    pub const LINES: [Self; 6] = [Self::Blue, Self::Red, Self::Green, Self::Orange, Self::Purple, Self::Sky];

    /// The colour of number `k` of those that stand behind our own.
    pub const fn behind(k: usize) -> Self {
        match k {
            0 => Self::Grey,
            _ => Self::LINES[(Self::LINES.len() - 1) - (k - 1) % Self::LINES.len()],
        }
    }
}

/// The range that holds all numbers, with a little room; (0, 1) where there are none.
pub(in crate::cli) fn span(numbers: impl IntoIterator<Item = f64>, log: bool) -> (f64, f64) {
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
