//! How fast do the two feedback laws bring a picture back to its target, on a declared machine?
//!
//! `cargo run -p metachron-lab --example settling` prints a table; with `-- --write` it also writes `docs/figures/settling.{csv,svg}`.
//! Nothing is measured: a frame takes setup + fill + c · triangles, so every run gives the same numbers on any computer.

use metachron_core::ResolutionRange;
use metachron_lod::control::{FrameWork, Kind, Law, ObjectView, PRIMITIVE_LEVELS, PictureControl, Policy, Status};
use plotters::prelude::*;
use plotters::style::register_font;
use std::error::Error;
use std::fs;
use std::time::Duration;

/// The costs of drawing: seconds a frame, and seconds a triangle.
#[derive(Clone, Copy)]
struct Machine {
    name: &'static str,
    frame_s: f64,
    triangle_s: f64,
}

/// Two cores with Mesa: 1.4 ms, 6 ns for each of 1280 × 720 pixels, 0.22 µs a triangle.
const SOFTWARE: Machine = Machine { name: "two-cores-software", frame_s: 1.4e-3 + 5.53e-3, triangle_s: 0.22e-6 };
/// Twenty times as fast.
const WORKSTATION: Machine = Machine { name: "workstation", frame_s: 0.347e-3, triangle_s: 0.011e-6 };

/// Frames that bring the loop to rest before it is pushed.
const REST_FRAMES: usize = 600;
/// How long a run is watched after the push, seconds.
const WATCH_S: f64 = 30.0;
/// How much of it goes into the files, seconds.
const SHOWN_S: f64 = 5.0;
/// … and at most so many frames.
const SHOWN_FRAMES: usize = 150;
/// Settled: within this part of the set point.
const BAND: f64 = 0.05;

/// One frame of a run.
#[derive(Clone, Copy)]
struct Frame {
    time_s: f64,
    work_s: f64,
    eps_mm: f64,
    n: u8,
    polygons: f64,
}

/// One run: a law at rest, pushed.
struct Run {
    law: &'static str,
    machine: &'static str,
    target_hz: f64,
    start: String,
    set_point_s: f64,
    frames: Vec<Frame>,
    status: Status,
}

/// A tube of 1.6 m, three balls and two tools, as in the demo.
fn stage() -> Vec<ObjectView> {
    let object = |id, kind, range, pixels| ObjectView { range, pixels, distance_m: 0.6, ..ObjectView::plain(id, kind) };
    let tube = Kind::Tube { length_m: 1.6, radius_m: 0.015 };
    let mut stage = vec![object(0, tube, ResolutionRange { eps_m: (5e-4, 0.04), n: (0, 5) }, 1e9)];
    let one_spacing = ResolutionRange { eps_m: (1.0, 1.0), n: (0, 6) };
    let ball = Kind::Primitive { radius_m: 0.02, triangles: std::array::from_fn(|n| 48 << n) };
    stage.extend((1..4).map(|id| object(id, ball, one_spacing, 2e4)));
    let tool = Kind::Primitive { radius_m: 0.1, triangles: [600; PRIMITIVE_LEVELS] };
    stage.extend((4..6).map(|id| object(id, tool, one_spacing, 2e4)));
    stage
}

fn draw(control: &mut PictureControl, stage: &[ObjectView], machine: Machine, time_s: f64) -> Frame {
    let plan = control.plan(stage);
    let work_s = machine.frame_s + machine.triangle_s * plan.polygons;
    let (tube, polygons) = (plan.levels[0].resolution, plan.polygons);
    let work = Duration::from_secs_f64(work_s);
    control.observe(FrameWork { work, draw: work, ..FrameWork::default() });
    Frame { time_s, work_s, eps_mm: 1e3 * tube.eps_m, n: tube.n, polygons }
}

/// Draws for `seconds` of wall time: a frame lasts as long as its work, or until the next one is due.
fn watch(control: &mut PictureControl, stage: &[ObjectView], machine: Machine, seconds: f64) -> Vec<Frame> {
    let (mut frames, mut time_s) = (Vec::new(), 0.0);
    while time_s < seconds {
        let mut frame = draw(control, stage, machine, time_s);
        time_s += frame.work_s.max(1.0 / control.target_hz());
        frame.time_s = time_s;
        frames.push(frame);
    }
    frames
}

/// Brings a loop to rest at its target, then multiplies ε by `factor`.
fn push(name: &'static str, law: Law, machine: Machine, target_hz: f64, factor: f64) -> Run {
    let stage = stage();
    let margin = 1.0 - law.set_share();
    let mut control =
        PictureControl::new(Policy::Feedback, Law::Corrected { kappa: 0.5, lead: 0.0, margin }, target_hz);
    for _ in 0..REST_FRAMES {
        draw(&mut control, &stage, machine, 0.0);
    }
    control.set_law(law);
    control.coarsen(factor);
    let start =
        if factor < 1.0 { format!("{:.0}× too fine", 1.0 / factor) } else { format!("{factor:.0}× too coarse") };
    let frames = watch(&mut control, &stage, machine, WATCH_S);
    let (set_point_s, status) = (control.set_point_s(), control.status());
    Run { law: name, machine: machine.name, target_hz, start, set_point_s, frames, status }
}

/// Rests at a target that is out of reach, then is given one that is not.
fn come_back(law: Law, out_of_reach_hz: f64, start: &str) -> (Run, Status) {
    let stage = stage();
    let mut control = PictureControl::new(Policy::Feedback, law, out_of_reach_hz);
    for _ in 0..REST_FRAMES {
        draw(&mut control, &stage, SOFTWARE, 0.0);
    }
    let rested = control.status();
    control.set_target_hz(30.0);
    let frames = watch(&mut control, &stage, SOFTWARE, WATCH_S);
    let (set_point_s, status) = (control.set_point_s(), control.status());
    let start = start.to_owned();
    (Run { law: "corrected", machine: SOFTWARE.name, target_hz: 30.0, start, set_point_s, frames, status }, rested)
}

impl Run {
    /// Seconds after which the work stays within the band; `None` if it does not.
    fn settled_s(&self) -> Option<f64> {
        let good = |f: &Frame| (f.work_s / self.set_point_s - 1.0).abs() <= BAND;
        let last_bad = self.frames.iter().rposition(|f| !good(f));
        self.frames.get(last_bad.map_or(0, |i| i + 1)).map(|f| f.time_s)
    }

    /// Smallest and largest t/T_set of the last third.
    fn spread(&self) -> (f64, f64) {
        let tail = &self.frames[self.frames.len() * 2 / 3..];
        let x = tail.iter().map(|f| f.work_s / self.set_point_s);
        (x.clone().fold(f64::INFINITY, f64::min), x.fold(0.0, f64::max))
    }

    fn print(&self) {
        let settled = self.settled_s().map_or("never".to_owned(), |s| format!("{s:.2} s"));
        let (low, high) = self.spread();
        let Self { law, machine, target_hz, start, status, .. } = self;
        println!("{law:<20} {machine:<20} {target_hz:>5.0} {start:<15} {settled:>8}  {low:.2} … {high:.2}  {status}");
    }
}

fn runs() -> Vec<Run> {
    let laws = [("corrected", Law::CORRECTED), ("printed", Law::PRINTED)];
    let mut runs = Vec::new();
    for target_hz in [20.0, 30.0, 60.0] {
        for factor in [0.25, 4.0] {
            runs.extend(laws.map(|(name, law)| push(name, law, SOFTWARE, target_hz, factor)));
        }
    }
    for factor in [0.25, 4.0] {
        let swinging = ("printed, α = 0.001", Law::Printed { alpha: 1e-3, beta: 5.0 });
        let laws = [laws[0], laws[1], swinging];
        runs.extend(laws.map(|(name, law)| push(name, law, WORKSTATION, 460.0, factor)));
    }
    runs
}

fn write_csv(path: &str, runs: &[Run]) -> Result<(), Box<dyn Error>> {
    let mut rows = csv::Writer::from_path(path)?;
    rows.write_record([
        "law",
        "machine",
        "target_hz",
        "start",
        "time_s",
        "work_ms",
        "set_ms",
        "eps_mm",
        "n",
        "polygons",
    ])?;
    for run in runs {
        for f in run.frames.iter().take_while(|f| f.time_s <= SHOWN_S).take(SHOWN_FRAMES) {
            let numbers = [1e3 * f.work_s, 1e3 * run.set_point_s, f.eps_mm].map(|x| format!("{x:.3}"));
            let head = [run.law, run.machine, &run.target_hz.to_string(), &run.start, &format!("{:.4}", f.time_s)];
            let tail = [&f.n.to_string(), &f.polygons.to_string()];
            let row = head.into_iter().chain(numbers.iter().map(String::as_str)).chain(tail.map(String::as_str));
            rows.write_record(row)?;
        }
    }
    Ok(rows.flush()?)
}

const BLUE_LINE: RGBColor = RGBColor(0x1f, 0x5f, 0xa8);
const RED_LINE: RGBColor = RGBColor(0xc0, 0x4a, 0x3a);
const GREY: RGBColor = RGBColor(0x88, 0x88, 0x88);

/// The widths of words are those of the font that the window's panels are written in.
fn bring_font() -> Result<(), Box<dyn Error>> {
    register_font("sans-serif", FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
        .map_err(|_| "the font of the panels cannot be read".into())
}

/// A panel a target: t/T_set over time, both laws from both sides.
fn write_svg(path: &str, runs: &[Run]) -> Result<(), Box<dyn Error>> {
    bring_font()?;
    let root = SVGBackend::new(path, (1080, 380)).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, target_hz) in root.split_evenly((1, 3)).iter().zip([20.0, 30.0, 60.0]) {
        let caption = (format!("{target_hz:.0} frames/s"), ("sans-serif", 17));
        let mut chart = ChartBuilder::on(area)
            .caption(caption.0, caption.1)
            .margin(10)
            .x_label_area_size(38)
            .y_label_area_size(46)
            .build_cartesian_2d(0.0..SHOWN_S, 0.0..4.2)?;
        let mesh = &mut chart.configure_mesh();
        mesh.x_desc("seconds after the push").y_desc("work / set point").x_labels(6).y_labels(5);
        mesh.light_line_style(WHITE).bold_line_style(GREY.mix(0.25)).label_style(("sans-serif", 13)).draw()?;
        for edge in [1.0 - BAND, 1.0 + BAND] {
            chart.draw_series(LineSeries::new([(0.0, edge), (SHOWN_S, edge)], GREY.stroke_width(1)))?;
        }
        for (law, colour) in [("printed", RED_LINE), ("corrected", BLUE_LINE)] {
            let here = runs.iter().filter(|r| r.target_hz == target_hz && r.law == law);
            for (k, run) in here.enumerate() {
                let shown = run.frames.iter().take_while(|f| f.time_s <= SHOWN_S);
                let line = shown.map(|f| (f.time_s, f.work_s / run.set_point_s));
                let series = chart.draw_series(LineSeries::new(line, colour.stroke_width(2)))?;
                if k == 0 {
                    series
                        .label(law)
                        .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
                }
            }
        }
        let legend = &mut chart.configure_series_labels();
        legend.position(SeriesLabelPosition::UpperRight).label_font(("sans-serif", 13));
        legend.background_style(WHITE.mix(0.8)).draw()?;
    }
    Ok(root.present()?)
}

fn main() -> Result<(), Box<dyn Error>> {
    println!(
        "{:<20} {:<20} {:>5} {:<15} {:>8}  {:<11}  at the end",
        "law", "machine", "Hz", "ε at the start", "±5 %", "t/T_set"
    );
    let runs = runs();
    runs.iter().for_each(Run::print);
    println!("\nA target out of reach, then 30 frames/s:");
    for (hz, start) in [(300.0, "from 300 Hz"), (2.0, "from 2 Hz")] {
        let (run, rested) = come_back(Law::CORRECTED, hz, start);
        println!("at {hz:.0} Hz: {rested}");
        run.print();
    }
    if std::env::args().any(|a| a == "--write") {
        fs::create_dir_all("docs/figures")?;
        write_csv("docs/figures/settling.csv", &runs)?;
        write_svg("docs/figures/settling.svg", &runs)?;
        println!("\ndocs/figures/settling.csv and settling.svg are written");
    }
    Ok(())
}
