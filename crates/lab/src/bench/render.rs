//! `bench render`: the time of a picture on this machine's adapter, by triangles, pixels and shading.
//!
//! In: an adapter. Out: rows of wall time per picture, the least of a few drawings. Never here: a fit of costs to them.

use super::super::args::BenchArgs;
use super::subject::{Progress, Subject};
use crate::chart::{Axis, Colour, Figure, Layer, Panel, Table, table};
use anyhow::Context;
use metachron_drawable::PieceKind;
use metachron_lod::control::AREAS_PX;
use metachron_render::{Drawn, Gpu, RendererOptions, Shading, benchmark};
use serde::{Deserialize, Serialize};

/// The subject.
pub(super) struct Render;

/// One picture of equal balls.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    pub adapter: String,
    pub picture_px: f64,
    pub objects: u32,
    pub shading: String,
    /// In the whole picture.
    pub triangles: f64,
    /// Covered by objects.
    pub pixels: f64,
    pub picture_ms: f64,
    pub ns_per_triangle: f64,
}

impl Subject for Render {
    type Row = Row;
    const NAME: &'static str = "render";
    const TABLE: fn(&[Row]) -> Table = table!(|r| picture_px: r.picture_px, objects: r.objects, shading: r.shading,
        triangles: r.triangles, pixels: r.pixels, picture_ms(3): r.picture_ms, ns_per_triangle(1): r.ns_per_triangle);

    fn measure(_args: &BenchArgs, progress: &Progress) -> anyhow::Result<Vec<Row>> {
        let gpu = Gpu::headless().context("what drawing costs cannot be measured")?;
        if !progress.continues(0.0, gpu.describe()) {
            return Ok(Vec::new());
        }
        let drawn = benchmark(&gpu, RendererOptions::for_adapter(&gpu.info), &AREAS_PX, 0)?;
        let plain = drawn.iter().filter(|drawn| drawn.enlarged_px == 0.0);
        Ok(plain.map(|drawn| row(&gpu.describe(), drawn)).collect())
    }

    fn figure(rows: &[Row]) -> Figure {
        let drawn: Vec<&Row> = rows.iter().filter(|row| row.objects > 0).collect();
        let names = Shading::PRICED.map(Shading::name).into_iter().chain([POINTS, LINES]);
        let layers = names.zip(Colour::LINES).map(|(name, colour)| {
            let here = drawn.iter().filter(|row| row.shading == name);
            Layer::dots(name, colour, here.map(|row| (row.triangles, row.picture_ms)))
        });
        let (x, y) = (Axis::log_fit("triangles"), Axis::log_fit("ms per picture"));
        let adapter = rows.first().map_or("", |row| &row.adapter);
        Figure::new("Drawing time of pictures", 1, vec![Panel::new(adapter, x, y, layers)])
    }
}

/// Names of the strokes.
const POINTS: &str = "points";
const LINES: &str = "lines";

/// The name of the primitive that the objects of a picture are drawn as.
const fn drawn_as(drawn: &Drawn) -> &'static str {
    match drawn.strokes {
        Some(PieceKind::Leaf) => POINTS,
        Some(PieceKind::Bough) => LINES,
        None => drawn.shading.name(),
    }
}

fn row(adapter: &str, drawn: &Drawn) -> Row {
    let objects = f64::from(drawn.objects);
    let triangles = objects * drawn.polygons;
    Row {
        adapter: adapter.to_owned(),
        picture_px: drawn.picture_px,
        objects: drawn.objects,
        shading: drawn_as(drawn).to_owned(),
        triangles,
        pixels: objects * drawn.pixels,
        picture_ms: 1e3 * drawn.seconds,
        ns_per_triangle: if triangles > 0.0 { 1e9 * drawn.seconds / triangles } else { f64::NAN },
    }
}
