//! How fast are the triangles of a multiresolution mesh found, against how many there are? Prints CSV.
//!
//! `cargo run --release -p metachron-drawable --example mesh_rate [triangles]`

use metachron_drawable::{Generator, ProgressiveMesh, generate};
use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let full = std::env::args().nth(1).map_or(Ok(100_000), |text| text.parse())?;
    println!("mesh,triangles,build_s,overhead,count,error_m,cut_us,resolve_us,triangles_per_s");
    for kind in Generator::ALL {
        let mesh = generate(kind, 1, full);
        let start = Instant::now();
        let tom = ProgressiveMesh::new(&mesh)?;
        let build_s = start.elapsed().as_secs_f64();
        let (own, plain) = tom.bytes();
        let (least, most) = tom.range();
        let mut corners = Vec::with_capacity(most as usize);
        for doubling in 0..=most.ilog2() {
            let asked = (most >> doubling).max(least);
            let repeats = (2_000_000 / asked).clamp(3, 2000);
            let start = Instant::now();
            for _ in 0..repeats {
                let _ = black_box(tom.cut(black_box(asked)));
            }
            let cut_us = start.elapsed().as_secs_f64() * 1e6 / f64::from(repeats);
            let cut = tom.cut(asked);
            let start = Instant::now();
            for _ in 0..repeats {
                corners.clear();
                tom.resolve(black_box(cut), &mut corners);
            }
            let resolve_us = start.elapsed().as_secs_f64() * 1e6 / f64::from(repeats);
            let (name, rate) = (kind.name(), f64::from(cut.triangles) / resolve_us * 1e6);
            let overhead = own as f64 / plain as f64 - 1.0;
            println!(
                "{name},{most},{build_s:.2},{overhead:.4},{},{:.3e},{cut_us:.2},{resolve_us:.2},{rate:.3e}",
                cut.triangles,
                tom.error_m(cut.triangles)
            );
            if asked == least {
                break;
            }
        }
    }
    Ok(())
}
