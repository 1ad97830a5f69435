//! Speed of traversal of meshes of any resolution, by resolution (GB99): the indices of a cut are found in time proportional to its
//! triangles.
//!
//! In: a mesh of 100,000 triangles. Out: triangles per second at each resolution. Never here: drawing.

use crate::chart::{Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Panel, Table, claims, table, worst};
use metachron_drawable::{Generator, ProgressiveMesh, generate};
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;
use std::time::Instant;

/// The experiment.
pub(in super::super::super) struct Traversal;

const TRIANGLES: u32 = 100_000;
/// Number of halvings of the resolution.
const HALVINGS: u32 = 10;
/// Traversals of each cut; the least time counts.
const ROUNDS: usize = 15;

/// Triangles of a cut.
#[derive(Debug, Clone, Serialize)]
pub(in super::super::super) struct Case {
    asked: u32,
}

/// A cut and its time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in super::super::super) struct Found {
    triangles: u32,
    /// The least time of some rounds, microseconds.
    micros: f64,
    /// Millions of triangles per second.
    rate: f64,
}

type Row = Measured<Case, Found>;

fn mesh() -> Option<&'static ProgressiveMesh> {
    static MESH: OnceLock<Option<ProgressiveMesh>> = OnceLock::new();
    MESH.get_or_init(|| ProgressiveMesh::new(&generate(Generator::Blob, 1, TRIANGLES)).ok()).as_ref()
}

impl Experiment for Traversal {
    type Row = Row;
    const NAME: &'static str = "traversal";
    const TITLE: &'static str = "traversal speed of a cut's triangles, by resolution";
    const ALONE: bool = true;
    const TABLE: fn(&[Row]) -> Table = table!(|r| triangles: r.triangles, micros(2): r.micros,
        million_a_second(1): r.rate);

    fn cases(_: bool) -> Vec<Case> {
        (0..=HALVINGS).rev().map(|k| Case { asked: TRIANGLES >> k }).collect()
    }

    fn measure(case: &Case) -> Option<Found> {
        let mesh = mesh()?;
        let (mut corners, mut least, mut triangles) = (Vec::new(), f64::INFINITY, 0);
        for _ in 0..ROUNDS {
            corners.clear();
            let started = Instant::now();
            let cut = mesh.cut(case.asked);
            mesh.resolve(cut, &mut corners);
            least = least.min(started.elapsed().as_secs_f64());
            triangles = cut.triangles;
        }
        Some(Found { triangles, micros: 1e6 * least, rate: 1e-6 * f64::from(triangles) / least })
    }

    fn figure(rows: &[Row]) -> Figure {
        let line = rows.iter().map(|r| (f64::from(r.triangles) / f64::from(TRIANGLES), r.rate));
        let (x, y) = (Axis::log_fit("triangles of the cut / all"), Axis::log_fit("millions of triangles per second"));
        let panel = Panel::new("the whole mesh, at 1, is a plain list", x, y, [Layer::line("", Colour::Blue, line)]);
        Figure::new("Traversal of a mesh of 100,000 triangles (GB99)", 1, vec![panel])
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        // in the full mesh no vertex is replaced by a substitute
        let cuts = || rows.iter().filter(|row| row.case.asked < TRIANGLES).map(|row| row.rate);
        let spread = worst(cuts()) / cuts().reduce(f64::min).unwrap_or(f64::NAN);
        claims!["triangles per second, fastest over slowest cut, without the full mesh" => spread, at_most 4.0]
    }
}
