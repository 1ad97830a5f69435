//! A renderer of one's own: the triangles of all objects at one moment, drawn here as letters, seen from the front.
//!
//! `cargo run --no-default-features --features export --example custom_renderer`

use metachron::export::{Moments, Surface};
use metachron::glam::{DVec2, Vec3Swizzles};
use metachron::prelude::*;
use std::error::Error;

const COLUMNS: usize = 78;
const ROWS: usize = 26;
/// Left and lower edge of the visible part, and the width of a letter, metres.
const LEFT_M: f64 = -0.35;
const LOW_M: f64 = -0.02;
const LETTER_M: f64 = 0.009;
const SHADES: &[u8] = b".:-=+*#%@";

fn main() -> Result<(), Box<dyn Error>> {
    let hose = Tube::along(&[[-0.3, 0.0, 0.3], [0.3, 0.0, 0.3]]).radius_m(0.02).young_pa(3e5).clamp([true, true]);
    let block = Rigid::cuboid([0.05; 3]).mass_kg(0.2).at([0.05, 0.0, 0.42]);
    let jelly = Soft::ball(0.06, 5).young_pa(2e4).at([-0.2, 0.0, 0.1]);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("hose", hose).add("block", block).add("jelly", jelly);
    let world = World::start(&scene.build()?, ExecutorKind::Lockstep)?;
    let mut moments = Moments::of(&world);
    for _ in 0..3 {
        world.advance(SimSpan::from_millis(300));
        let mut picture = Picture { letters: [[b' '; COLUMNS]; ROWS], depths: [[f64::INFINITY; COLUMNS]; ROWS] };
        moments.take().objects.iter().for_each(|object| picture.draw(&object.surface));
        picture.letters.iter().for_each(|row| println!("{}", String::from_utf8_lossy(row)));
    }
    Ok(())
}

/// Letters, and how far away the surfaces that they show are, metres.
struct Picture {
    letters: [[u8; COLUMNS]; ROWS],
    depths: [[f64; COLUMNS]; ROWS],
}

impl Picture {
    fn draw(&mut self, surface: &Surface) {
        for triangle in &surface.triangles {
            let [a, b, c] = triangle.map(|point| surface.points[point as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let shade = (normal.dot(DVec3::new(-0.4, -0.7, 0.6)).max(0.0) * SHADES.len() as f64) as usize;
            // seen along +y: the barycentric coordinates of each letter's middle; letters are twice as high as wide
            let (ab, ac) = ((b - a).xz(), (c - a).xz());
            for (row, column) in (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column))) {
                let (right, up) = (column as f64 + 0.5, 2.0 * (ROWS - row) as f64 - 1.0);
                let p = DVec2::new(LEFT_M + right * LETTER_M, LOW_M + up * LETTER_M) - a.xz();
                let (v, w) = (p.perp_dot(ac) / ab.perp_dot(ac), ab.perp_dot(p) / ab.perp_dot(ac));
                let depth = a.y + v * (b.y - a.y) + w * (c.y - a.y);
                if v >= 0.0 && w >= 0.0 && v + w <= 1.0 && depth < self.depths[row][column] {
                    self.depths[row][column] = depth;
                    self.letters[row][column] = SHADES[shade.min(SHADES.len() - 1)];
                }
            }
        }
    }
}
