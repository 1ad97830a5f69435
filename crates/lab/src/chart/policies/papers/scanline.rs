//! The intensity along a scan line of a cylinder: ideal, and drawn as prisms that are flat or Gouraud shaded (FS93, §5, fig. 5).
//!
//! A diffuse cylinder under one directional light, in an orthographic projection: the meaning of the printed accuracy of a level.

use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Named, Panel, Table, claims, number_of, table,
};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// The experiment.
pub(crate) struct Scanline;

/// Direction of the light, from the direction to the viewer, radians: a third of the cylinder is dark.
const LIGHT_RAD: f64 = PI / 6.0;
/// Pixels across the cylinder.
const PIXELS: u32 = 400;

/// How the cylinder is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shading {
    /// Exactly.
    Ideal,
    /// As a prism of so many sides with a colour for each.
    Flat(u32),
    /// As a prism with colours at its edges.
    Gouraud(u32),
}

const PICTURES: [Named<Shading>; 4] = [
    Named("ideal", Shading::Ideal),
    Named("flat, 8 faces", Shading::Flat(8)),
    Named("flat, 16 faces", Shading::Flat(16)),
    Named("Gouraud, 16 faces", Shading::Gouraud(16)),
];

/// A picture.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    picture: Named<Shading>,
}

/// Error of a picture.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Found {
    /// Distinct intensities among the pixels.
    colours: usize,
    /// Root mean square and greatest difference from the ideal intensity, of which the brightest is 1.
    rms: f64,
    greatest: f64,
}

/// Intensity of a surface whose normal has this angle to the direction of view.
fn lit(angle: f64) -> f64 {
    libm::cos(angle - LIGHT_RAD).max(0.0)
}

impl Shading {
    /// Intensity at `x`, −1 … 1 from the left border of the cylinder to the right one.
    fn intensity(self, x: f64) -> f64 {
        let at = |sides: u32| {
            // edges are at ± a right angle and at equal angles between
            let step = 2.0 * PI / f64::from(sides);
            let edge = |k: f64| -0.5 * PI + k * step;
            let faces = f64::from(sides / 2);
            let face = (0..sides / 2).map(f64::from).find(|k| x < libm::sin(edge(k + 1.0)));
            let k = face.unwrap_or(faces - 1.0);
            (edge(k), edge(k + 1.0))
        };
        match self {
            Self::Ideal => lit(libm::asin(x)),
            Self::Flat(sides) => {
                let (left, right) = at(sides);
                lit(0.5 * (left + right))
            }
            Self::Gouraud(sides) => {
                let (left, right) = at(sides);
                let part = (x - libm::sin(left)) / (libm::sin(right) - libm::sin(left));
                lit(left) + (lit(right) - lit(left)) * part
            }
        }
    }

    /// Position and intensity of every pixel.
    fn line(self) -> Vec<(f64, f64)> {
        let x = |k: u32| (2.0 * f64::from(k) + 1.0) / f64::from(PIXELS) - 1.0;
        (0..PIXELS).map(x).map(|x| (x, self.intensity(x))).collect()
    }
}

type Row = Measured<Case, Found>;

impl Experiment for Scanline {
    type Row = Row;
    const NAME: &'static str = "scanline";
    const TITLE: &'static str = "intensity along a scan line of a cylinder: flat and Gouraud shaded prisms";
    const TABLE: fn(&[Row]) -> Table = table!(|r| picture: r.case.picture, colours: r.colours, "rms error"(4): r.rms,
        "greatest error"(4): r.greatest);

    fn cases(_: bool) -> Vec<Case> {
        PICTURES.map(|picture| Case { picture }).to_vec()
    }

    fn measure(case: &Case) -> Option<Found> {
        let line = case.picture.1.line();
        let off: Vec<f64> =
            line.iter().map(|(x, intensity)| (intensity - Shading::Ideal.intensity(*x)).abs()).collect();
        let mut colours: Vec<u64> = line.iter().map(|(_, intensity)| (intensity * 1e9).round() as u64).collect();
        colours.sort_unstable();
        colours.dedup();
        let rms = (off.iter().map(|d| d * d).sum::<f64>() / f64::from(PIXELS)).sqrt();
        let greatest = off.iter().copied().fold(0.0, f64::max);
        Some(Found { colours: colours.len(), rms, greatest })
    }

    fn figure(_: &[Row]) -> Figure {
        let panel = |Named(name, shading): Named<Shading>| {
            let ideal = Layer::dashed("ideal", Colour::Grey, Shading::Ideal.line());
            let beside = (shading != Shading::Ideal).then_some(ideal);
            let layers = beside.into_iter().chain([Layer::line("", Colour::Blue, shading.line())]);
            let (x, y) =
                (Axis::linear("position across the cylinder", -1.0, 1.0), Axis::linear("intensity", 0.0, 1.05));
            Panel::new(name, x, y, layers)
        };
        Figure::new("A scan line of a cylinder (FS93, fig. 5)", 2, PICTURES.map(panel).to_vec())
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of = |k: usize, what: fn(&Row) -> f64| number_of(rows, |r| r.case.picture == PICTURES[k], what);
        let rms = |k: usize| of(k, |r| r.rms);
        claims![
            "colours of the flat prism of 8 faces" => of(1, |r| r.colours as f64), at_most 4.0;
            "colours of the flat prism of 16 faces" => of(2, |r| r.colours as f64), at_most 8.0;
            "error of 16 flat faces over that of 8, accuracy 1 − ½/samples" => rms(2) / rms(1), at_most 0.6;
            "error of 16 Gouraud faces over that of 8 flat ones" => rms(3) / rms(1), at_most 0.2;
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_fall_as_the_order_of_interpolation_says() {
        let rms = |shading: Shading| {
            let off = shading.line().into_iter().map(|(x, y)| (y - Shading::Ideal.intensity(x)).powi(2));
            (off.sum::<f64>() / f64::from(PIXELS)).sqrt()
        };
        // twice the faces: half the error of constants, a quarter of that of lines, but for the rim, where sin x has no slope
        let flat = rms(Shading::Flat(16)) / rms(Shading::Flat(32));
        let gouraud = rms(Shading::Gouraud(16)) / rms(Shading::Gouraud(32));
        assert!((1.8..2.2).contains(&flat) && (2.5..4.5).contains(&gouraud), "{flat} {gouraud}");
    }

    #[test]
    fn a_gouraud_shaded_prism_is_exact_at_its_edges() {
        for k in 0..9 {
            let x = libm::sin(-0.5 * PI + f64::from(k) * PI / 8.0);
            let off = Shading::Gouraud(16).intensity(x) - Shading::Ideal.intensity(x.clamp(-1.0, 1.0));
            assert!(off.abs() < 1e-9, "edge {k}: {off}");
        }
    }
}
