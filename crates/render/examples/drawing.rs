//! The cost of drawing a frame, over (ε, n). Fits set-up, price a triangle and price a pixel on this machine's adapter.
//!
//! `cargo run --release -p metachron-render --example drawing [-- FILE.png [EPS_M N [WIDTH HEIGHT [SAMPLES]]]]`; with a file name it draws one picture instead.

#[path = "../tests/pictures/stage.rs"]
mod stage;

use cpu_time::ProcessTime;
use metachron_render::{Colouring, Gpu, GpuError, Offscreen, RendererOptions, Size, Style};
use std::path::Path;
use std::time::Instant;

const HD: Size = Size { width: 1280, height: 720 };

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let gpu = Gpu::headless()?;
    println!("{}", gpu.describe());
    match arguments.first() {
        Some(path) => draw(gpu, Path::new(path), &arguments[1..]),
        None => Ok(measure(&gpu)?),
    }
}

fn draw(gpu: Gpu, path: &Path, numbers: &[String]) -> Result<(), Box<dyn std::error::Error>> {
    let number = |i: usize, default: f64| numbers.get(i).map_or(Ok(default), |text| text.parse());
    let (eps_m, n) = (number(0, 0.006)?, number(1, 5.0)? as u8);
    let size = Size { width: number(2, 1280.0)? as u32, height: number(3, 720.0)? as u32 };
    let options = RendererOptions { samples: number(4, 4.0)? as u32, ..RendererOptions::STILL };
    let style = match numbers.get(5).map(String::as_str) {
        Some("resolution") => Style { colouring: Colouring::Resolution, wireframe: true, ..Style::default() },
        Some("age") => Style { colouring: Colouring::Age, ..Style::default() },
        _ => Style::default(),
    };
    let (mut stage, camera) = stage::still_life();
    stage.survey(&camera, size);
    let mut offscreen = Offscreen::new(gpu, size, options)?;
    let times = offscreen.render(stage.compose(&camera, &stage::level(eps_m, n), style, None), &camera)?;
    std::fs::write(path, offscreen.png()?)?;
    println!("{times:?}");
    Ok(())
}

/// The cost of one frame.
#[derive(Clone, Copy)]
struct Cost {
    /// Wall time of the least of 15 frames, milliseconds: the undisturbed work.
    wall_ms: f64,
    /// Processor time of all threads in the least of 15 frames, milliseconds: a driver in software draws with these.
    cpu_ms: f64,
    triangles: u64,
}

fn cost(gpu: &Gpu, size: Size, eps_m: f64, n: u8) -> Result<Cost, GpuError> {
    let (mut stage, camera) = stage::still_life();
    let options = RendererOptions::for_adapter(&gpu.info);
    let mut offscreen = Offscreen::new(gpu.clone(), size, options)?;
    let levels = stage::level(eps_m, n);
    let mut least = Cost { wall_ms: f64::INFINITY, cpu_ms: f64::INFINITY, triangles: 0 };
    for _ in 0..15 {
        let (start, work) = (Instant::now(), ProcessTime::now());
        stage.survey(&camera, size);
        let picture = stage.compose(&camera, &levels, Style::default(), None);
        least.triangles = offscreen.render(picture, &camera)?.triangles;
        least.wall_ms = least.wall_ms.min(start.elapsed().as_secs_f64() * 1e3);
        least.cpu_ms = least.cpu_ms.min(work.elapsed().as_secs_f64() * 1e3);
    }
    Ok(least)
}

fn measure(gpu: &Gpu) -> Result<(), GpuError> {
    println!("{:>8} {:>3} {:>10} {:>9} {:>9}", "eps_m", "n", "triangles", "wall_ms", "cpu_ms");
    let mut points = Vec::new();
    for (eps_m, n) in [(0.1, 0), (0.04, 1), (0.02, 2), (0.02, 3), (0.01, 3), (0.01, 4), (0.005, 4), (0.005, 5)] {
        let Cost { wall_ms, cpu_ms, triangles } = cost(gpu, HD, eps_m, n)?;
        println!("{eps_m:>8} {n:>3} {triangles:>10} {wall_ms:>9.2} {cpu_ms:>9.2}");
        points.push(Cost { wall_ms, cpu_ms, triangles });
    }
    let small = Size { width: 64, height: 36 };
    let (few, many) = (cost(gpu, small, 0.1, 0)?, cost(gpu, small, 0.005, 4)?);
    report("wall", &points, few, many, |cost| cost.wall_ms);
    report("cpu", &points, few, many, |cost| cost.cpu_ms);
    Ok(())
}

/// Prints the cost of a frame, a triangle and a pixel in one kind of time; `few` and `many` are pictures of few pixels,
/// with few and many triangles.
fn report(name: &str, points: &[Cost], few: Cost, many: Cost, ms: fn(&Cost) -> f64) {
    let pairs: Vec<_> = points.iter().map(|cost| (cost.triangles as f64, ms(cost))).collect();
    let (base, slope) = line(&pairs);
    let triangle_ms = (ms(&many) - ms(&few)) / (many.triangles - few.triangles) as f64;
    let setup = ms(&few) - triangle_ms * few.triangles as f64;
    let pixel_ns = (base - setup) * 1e6 / HD.pixels();
    println!("{name}: at 1280 x 720 {base:.2} ms + {:.3} us a triangle;", slope * 1e3);
    println!("  at 64 x 36 {setup:.2} ms + {:.3} us a triangle; a pixel {pixel_ns:.2} ns", triangle_ms * 1e3);
}

/// Least squares: offset and slope.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
        / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
    (my - slope * mx, slope)
}
