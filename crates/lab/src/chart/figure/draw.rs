//! Draws a figure, as SVG text or as pixels.
//!
//! In: a [`Figure`]. Out: text, or the bytes of a PNG file. Never here: what the numbers mean, files.

use super::font::bring_font;
use super::scale::Scale;
use super::{Colour, Figure, Layer, Mark, Panel};
use anyhow::{Context, anyhow};
use image::imageops::{FilterType, resize};
use image::{ImageFormat, RgbImage};
use plotters::coord::Shift;
use plotters::prelude::*;

type Chart<'a, D> = ChartContext<'a, D, Cartesian2d<Scale, Scale>>;

/// Width and height of a panel without its legend, width of a legend, and height of the title above all panels.
const PANEL: [u32; 2] = [430, 330];
const LEGEND: u32 = 190;
const TITLE: u32 = 34;
/// Heights of letters.
const LARGE: u32 = 17;
const MIDDLE: u32 = 15;
const SMALL: u32 = 12;
const FONT: &str = "sans-serif";
/// Pixels are drawn this many times finer than units of the SVG text and then scaled down to [`SHARP`]: smooth lines.
const FINE: u32 = 4;
/// Pixels per unit: sharp on fine screens too.
const SHARP: u32 = 2;

/// The figure as SVG text; the same figure is always the same text.
///
/// # Errors
/// A figure that cannot be drawn: an axis that ends where it begins.
pub fn svg(figure: &Figure) -> anyhow::Result<String> {
    let mut text = String::new();
    let [width, height] = size(figure);
    draw(SVGBackend::with_string(&mut text, (width, height)).into_drawing_area(), figure, Pen(1))?;
    Ok(text)
}

/// The figure as the bytes of a PNG file; the same figure is always the same bytes.
///
/// # Errors
/// A figure that cannot be drawn.
pub fn png(figure: &Figure) -> anyhow::Result<Vec<u8>> {
    let [width, height] = size(figure);
    let fine = (width * FINE, height * FINE);
    let mut pixels = vec![0; fine.0 as usize * fine.1 as usize * 3];
    draw(BitMapBackend::with_buffer(&mut pixels, fine).into_drawing_area(), figure, Pen(FINE))?;
    let picture = RgbImage::from_raw(fine.0, fine.1, pixels).context("the figure has no size")?;
    let picture = resize(&picture, width * SHARP, height * SHARP, FilterType::Triangle);
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png).context("the figure cannot be written as PNG")?;
    Ok(bytes.into_inner())
}

/// Names in black on white side by side, each at the left of a column of this width and height in pixels.
///
/// # Errors
/// Names that cannot be drawn.
pub fn headings(names: &[&str], [width, height]: [u32; 2]) -> anyhow::Result<RgbImage> {
    bring_font(FONT)?;
    let all = (width * names.len() as u32, height);
    let mut pixels = vec![255; all.0 as usize * all.1 as usize * 3];
    let root = BitMapBackend::with_buffer(&mut pixels, all).into_drawing_area();
    let letters = (FONT, 3 * height / 4).into_font().color(&BLACK);
    for (column, name) in (0..).zip(names) {
        root.draw_text(name, &letters, (column * width as i32 + 8, height as i32 / 8)).map_err(undrawn)?;
    }
    root.present().map_err(undrawn)?;
    drop(root);
    RgbImage::from_raw(all.0, all.1, pixels).context("there are no names to draw")
}

fn columns(figure: &Figure) -> usize {
    figure.columns.clamp(1, figure.panels.len().max(1))
}

fn lines(figure: &Figure) -> usize {
    figure.panels.len().div_ceil(columns(figure)).max(1)
}

fn size(figure: &Figure) -> [u32; 2] {
    let widest = figure.panels.iter().map(width).max().unwrap_or(PANEL[0]);
    [widest * columns(figure) as u32, PANEL[1] * lines(figure) as u32 + TITLE]
}

/// Pixels per unit.
#[derive(Clone, Copy)]
struct Pen(u32);

impl Pen {
    fn px(self, units: u32) -> u32 {
        self.0 * units
    }

    fn at(self, units: i32) -> i32 {
        self.0 as i32 * units
    }

    fn font(self, units: u32) -> TextStyle<'static> {
        (FONT, self.px(units)).into_font().color(&BLACK)
    }
}

/// An error of plotters as one that does not borrow the drawing area.
fn undrawn(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("the figure cannot be drawn: {error}")
}

fn draw<D: DrawingBackend>(root: DrawingArea<D, Shift>, figure: &Figure, pen: Pen) -> anyhow::Result<()> {
    bring_font(FONT)?;
    root.fill(&WHITE).map_err(undrawn)?;
    let (top, rest) = root.split_vertically(pen.px(TITLE));
    top.draw_text(&figure.title, &pen.font(LARGE), (pen.at(12), pen.at(10))).map_err(undrawn)?;
    let areas = rest.split_evenly((lines(figure), columns(figure)));
    areas.iter().zip(&figure.panels).try_for_each(|(area, panel)| draw_panel(area, panel, pen))?;
    root.present().map_err(undrawn)
}

fn draw_panel<D: DrawingBackend>(area: &DrawingArea<D, Shift>, panel: &Panel, pen: Pen) -> anyhow::Result<()> {
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, pen.font(MIDDLE))
        .margin(pen.px(10))
        .margin_right(pen.px(18 + width(panel) - PANEL[0]))
        .x_label_area_size(pen.px(40))
        .y_label_area_size(pen.px(56))
        .build_cartesian_2d(Scale(panel.x.clone()), Scale(panel.y.clone()))
        .map_err(undrawn)?;
    let mesh = &mut chart.configure_mesh();
    mesh.x_desc(panel.x.label).y_desc(panel.y.label).x_labels(9).y_labels(8).max_light_lines(1);
    mesh.light_line_style(WHITE).bold_line_style(rgb(Colour::Grey).mix(0.25).stroke_width(pen.px(1)));
    mesh.axis_style(BLACK.stroke_width(pen.px(1))).set_all_tick_mark_size(pen.px(4));
    mesh.label_style(pen.font(SMALL)).axis_desc_style(pen.font(SMALL + 1)).draw().map_err(undrawn)?;
    panel.layers.iter().try_for_each(|layer| draw_layer(&mut chart, layer, pen))?;
    panel.layers.iter().try_for_each(|layer| draw_leaving(&mut chart, panel, layer, pen))?;
    draw_legend(area, panel, pen)
}

/// Draws the legend to the right of the axes, where it hides nothing.
fn draw_legend<D: DrawingBackend>(area: &DrawingArea<D, Shift>, panel: &Panel, pen: Pen) -> anyhow::Result<()> {
    let left = pen.at((width(panel) - LEGEND) as i32);
    for (line, layer) in panel.layers.iter().filter(|l| !l.label.is_empty()).enumerate() {
        let (colour, y) = (rgb(layer.colour), pen.at(44 + 19 * line as i32));
        let thick = colour.stroke_width(pen.px(2));
        let stroke = |from: i32, to: i32| PathElement::new([(left + pen.at(from), y), (left + pen.at(to), y)], thick);
        match layer.mark {
            Mark::Line(_) => area.draw(&stroke(0, 18)),
            Mark::Dashed(_) => area.draw(&stroke(0, 5)).and_then(|()| area.draw(&stroke(11, 16))),
            Mark::Dots(_) => area.draw(&Circle::new((left + pen.at(9), y), pen.px(3), colour.filled())),
            Mark::Cells(_) => {
                let corners = [(left + pen.at(3), y - pen.at(6)), (left + pen.at(15), y + pen.at(6))];
                area.draw(&Rectangle::new(corners, colour.filled()))
            }
        }
        .map_err(undrawn)?;
        let at = (left + pen.at(24), y - pen.at(7));
        area.draw_text(&layer.label, &pen.font(SMALL), at).map_err(undrawn)?;
    }
    Ok(())
}

/// Width of a panel, including its legend if it has one.
fn width(panel: &Panel) -> u32 {
    PANEL[0] + if panel.layers.iter().any(|l| !l.label.is_empty()) { LEGEND } else { 0 }
}

fn draw_layer<D: DrawingBackend>(chart: &mut Chart<'_, D>, layer: &Layer, pen: Pen) -> anyhow::Result<()> {
    let colour = rgb(layer.colour);
    let line = colour.stroke_width(pen.px(2));
    let dot = pen.px(3);
    let mark = match &layer.mark {
        Mark::Line(points) | Mark::Dashed(points) if finite(points).len() == 1 => &Mark::Dots(points.clone()),
        mark => mark,
    };
    match mark {
        Mark::Line(points) => chart.draw_series(LineSeries::new(finite(points), line)).map_err(undrawn)?,
        Mark::Dashed(points) => {
            let dashes = DashedLineSeries::new(finite(points), pen.px(5), pen.px(4), line);
            chart.draw_series(dashes).map_err(undrawn)?
        }
        Mark::Dots(points) => {
            let dots = finite(points).into_iter().map(|at| Circle::new(at, dot, colour.filled()));
            chart.draw_series(dots).map_err(undrawn)?
        }
        Mark::Cells(cells) => {
            let boxes = cells.iter().map(|&[a, b, c, d]| Rectangle::new([(a, c), (b, d)], colour.filled()));
            chart.draw_series(boxes).map_err(undrawn)?
        }
    };
    Ok(())
}

/// Draws an arrow at the border wherever a layer leaves the axes: the values there are farther out.
fn draw_leaving<D: DrawingBackend>(
    chart: &mut Chart<'_, D>,
    panel: &Panel,
    layer: &Layer,
    pen: Pen,
) -> anyhow::Result<()> {
    let (Mark::Line(points) | Mark::Dashed(points) | Mark::Dots(points)) = &layer.mark else { return Ok(()) };
    let (long, half) = (pen.at(9), pen.at(4));
    let arrows = border_crossings(points, panel).into_iter().map(|(at, [right, up])| {
        // on the screen y points down; the tip is at the border
        let corner = |along: i32, across: i32| (-right * along + up * across, up * along + right * across);
        EmptyElement::at(at)
            + Polygon::new(vec![(0, 0), corner(long, half), corner(long, -half)], rgb(layer.colour).filled())
    });
    chart.draw_series(arrows).map_err(undrawn)?;
    Ok(())
}

/// The points where a layer leaves the axes, once for each run beyond one border, and the direction: (right, up) of −1, 0, 1.
fn border_crossings(points: &[(f64, f64)], panel: &Panel) -> Vec<((f64, f64), [i32; 2])> {
    let mut before = [0, 0];
    let mut all = Vec::new();
    for (x, y) in finite(points) {
        let way = [panel.x.beyond(x), panel.y.beyond(y)];
        // a point beyond both borders is marked at the one above or below
        let side = if way[1] != 0 { [0, way[1]] } else { way };
        if side != [0, 0] && side != before {
            all.push(((x.clamp(panel.x.low, panel.x.high), y.clamp(panel.y.low, panel.y.high)), side));
        }
        before = side;
    }
    all
}

/// The points with finite coordinates.
fn finite(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
}

fn rgb(colour: Colour) -> RGBColor {
    match colour {
        Colour::Blue => RGBColor(0x1f, 0x5f, 0xa8),
        Colour::Red => RGBColor(0xc0, 0x4a, 0x3a),
        Colour::Green => RGBColor(0x00, 0x9e, 0x73),
        Colour::Orange => RGBColor(0xe6, 0x9f, 0x00),
        Colour::Sky => RGBColor(0x56, 0xb4, 0xe9),
        Colour::Purple => RGBColor(0xcc, 0x79, 0xa7),
        Colour::Grey => RGBColor(0x70, 0x70, 0x70),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Axis;
    use super::*;

    fn dark_pixels(title: &str) -> usize {
        let axis = || Axis::linear("", 0.0, 1.0);
        let panel = Panel { title: String::new(), x: axis(), y: axis(), layers: vec![] };
        let figure = Figure { title: title.to_owned(), panels: vec![panel], columns: 1 };
        let picture = image::load_from_memory(&png(&figure).unwrap()).unwrap().to_luma8();
        assert_eq!(picture.dimensions(), (2 * PANEL[0], 2 * (PANEL[1] + TITLE)));
        picture.rows().take(2 * TITLE as usize).flatten().filter(|p| p.0[0] < 128).count()
    }

    #[test]
    fn text_is_drawn_with_the_built_in_font() {
        assert_eq!(dark_pixels(""), 0);
        // Greek and signs that the charts' labels need: each draws a glyph of its own, not an empty one
        let counts = ["μ", "φ", "π", "²", "×", "≤", "Δ", "τ", "₁"].map(dark_pixels);
        assert!(counts.iter().all(|c| *c > 4), "{counts:?}");
    }

    #[test]
    fn points_beyond_the_axes_are_marked_once_per_run_at_the_border() {
        let panel = |points: &[(f64, f64)]| {
            let layers = vec![Layer { label: String::new(), colour: Colour::Red, mark: Mark::Line(points.to_vec()) }];
            Panel { title: String::new(), x: Axis::linear("", 0.0, 1.0), y: Axis::log("", 0.1, 10.0), layers }
        };
        let points =
            [(0.0, 1.0), (0.1, 20.0), (0.2, 90.0), (0.3, 10.0), (0.4, 0.01), (0.5, 11.0), (1.5, 1.0), (0.6, f64::NAN)];
        let marks = border_crossings(&points, &panel(&points));
        let wanted = [((0.1, 10.0), [0, 1]), ((0.4, 0.1), [0, -1]), ((0.5, 10.0), [0, 1]), ((1.0, 1.0), [1, 0])];
        assert_eq!(marks, wanted);
        assert_eq!(border_crossings(&[(0.0, 10.0 * (1.0 + 1e-12)), (1.0, 0.1)], &panel(&[])), [], "rounding");
        let polygons = |points: &[(f64, f64)]| {
            let figure = Figure { title: String::new(), panels: vec![panel(points)], columns: 1 };
            svg(&figure).unwrap().matches("<polygon").count()
        };
        assert_eq!((polygons(&points), polygons(&[(0.0, 1.0), (1.0, 2.0)])), (4, 0));
    }

    #[test]
    fn a_figure_is_written_as_svg_and_as_png() {
        let dots = Layer {
            label: "dots".to_owned(),
            colour: Colour::Blue,
            mark: Mark::Dots(vec![(0.5, 0.5), (f64::NAN, 0.1)]),
        };
        let axis = |label| Axis::linear(label, 0.0, 1.0);
        let panel =
            Panel { title: "panel".to_owned(), x: axis("to the right, m"), y: axis("up, s"), layers: vec![dots] };
        let figure = Figure { title: "figure".to_owned(), panels: vec![panel], columns: 1 };
        let text = svg(&figure).unwrap();
        for word in ["figure", "panel", "to the right, m", "up, s", "dots", "<circle"] {
            assert!(text.contains(word), "{word} is not in\n{text}");
        }
        assert_eq!(text.matches("<circle").count(), 2, "one dot that is a number, one in the legend");
        let picture = image::load_from_memory(&png(&figure).unwrap()).unwrap().to_rgb8();
        assert!(picture.pixels().any(|p| p.0 == [0x1f, 0x5f, 0xa8]));
    }

    #[test]
    fn a_line_of_one_point_is_drawn_as_a_dot() {
        let drawn = |points: &[(f64, f64)]| {
            let layers = [Mark::Line(points.to_vec()), Mark::Dashed(points.to_vec())].map(|mark| Layer {
                label: String::new(),
                colour: Colour::Blue,
                mark,
            });
            let axis = || Axis::linear("", 0.0, 1.0);
            let panel = Panel { title: String::new(), x: axis(), y: axis(), layers: layers.into() };
            let figure = Figure { title: String::new(), panels: vec![panel], columns: 1 };
            svg(&figure).unwrap().matches("<circle").count()
        };
        assert_eq!(drawn(&[(0.5, 0.5), (f64::NAN, 0.1)]), 2, "what is no number is no second point");
        assert_eq!(drawn(&[(0.5, 0.5), (0.7, 0.1)]), 0);
    }
}
