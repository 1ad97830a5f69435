//! The auditorium of (FS93) in numbers: 384 seats in rising rows and 16 pieces of a stage, 87,565 polygons.
//!
//! In: nothing. Out: the scene and the path with its events: A, many large things; B, few small ones; the stage; C, half a turn
//! in six frames. The paper gives the count of polygons and the events; positions, levels and path are our own.

use super::camera::{Path, key};
use super::closed_loop::Show;
use super::common::LEVEL_PARTS;
use super::machine::Fault;
use super::scene::{BenefitModel, ObjectLevel, Scene, SceneObject};
use glam::DVec3;
use metachron_lod::cost::benefit::Shading;
use metachron_lod::cost::stages::Stages;

const ROWS: usize = 16;
const SEATS: usize = 24;
const SEAT_POLYGONS: f64 = 186.0;
/// The first piece has the polygons that are missing to 87,565.
const PIECE_POLYGONS: [f64; 2] = [1021.0, 1008.0];
const PIECES: usize = 16;
/// A polygon takes 13.5 µs (FS93, view A: 0.98 s for 72,570); the cost of a pixel is such that a polygon takes 18.9 µs at 5300 of them.
const STAGES: Stages = Stages { setup: 20.0, polygon: 12.0, vertex: 3.0, pixel: 0.012, serial: 0.0 };
/// Frames of the path.
pub(crate) const LAP: usize = 250;
/// T of the paper, microseconds.
pub(crate) const TARGET: f64 = 1e5;
/// The paper's run: its target, no logic; the time of a frame is known after `delay` frames, one in the paper.
pub(crate) fn show(fault: Fault, frames: usize, delay: usize) -> Show {
    Show { scene: scene(), path: path(), fault, target: TARGET, frames, lap: LAP, delay, logic: 0.0, overlap: 1.0 }
}

fn scene() -> Scene {
    let seats = (0..ROWS * SEATS).map(|i| {
        let (row, seat) = ((i / SEATS) as f64, (i % SEATS) as f64);
        let at = DVec3::new(2.0 + row, (seat - 11.5) * 0.6, 0.45 + 0.15 * row);
        object(at, 0.5, 0.6, SEAT_POLYGONS)
    });
    let pieces = (0..PIECES).map(|i| {
        let at = DVec3::new(-4.0 - 2.5 * (i / 8) as f64, ((i % 8) as f64 - 3.5) * 1.8, 1.5);
        object(at, 0.9, 0.7, PIECE_POLYGONS[usize::from(i > 0)])
    });
    Scene { objects: seats.chain(pieces).collect(), stages: vec![STAGES] }
}

fn object(centre_m: DVec3, radius_m: f64, fill: f64, polygons: f64) -> SceneObject {
    let form = |part: f64| ObjectLevel {
        polygons: (part * polygons).round().max(2.0),
        algorithm: 0,
        worth: BenefitModel::Shaded(Shading::Flat),
    };
    SceneObject {
        centre_m,
        radius_m,
        fill,
        importance: 1.0,
        complexity: polygons,
        forms: LEVEL_PARTS.map(form).to_vec(),
    }
}

fn path() -> Path {
    let keys = vec![
        key(0, [-0.5, -9.0, 2.2], 42.0, -8.0),
        key(60, [0.5, -9.5, 2.2], 44.0, -8.0),
        key(115, [-13.0, -14.0, 2.4], 88.0, -4.0),
        key(150, [-14.0, -14.5, 2.4], 89.0, -4.0),
        key(160, [0.8, 0.0, 1.7], 180.0, 0.0),
        key(178, [1.0, 0.0, 1.7], 180.0, 0.0),
        key(184, [1.0, 0.0, 1.9], 0.0, 5.0),
        key(250, [-0.5, 0.0, 2.1], -8.0, 3.0),
    ];
    Path { keys, fov_y_deg: 60.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hall_has_the_papers_polygons_and_its_path_the_papers_events() {
        let show = show(Fault::NONE, LAP, 1);
        let all: f64 = show.scene.objects.iter().filter_map(|t| t.forms.last()).map(|f| f.polygons).sum();
        assert_eq!(all, 87_565.0);
        let full = |frame: usize| Scene::full(&show.seen(frame).0) / TARGET;
        // the paper: 9.9 at most in A, few and small in B, little before the turn and much after it
        assert!((8.0..11.0).contains(&full(40)), "A {}", full(40));
        assert!(full(130) < 2.5, "B {}", full(130));
        assert!(full(177) < 2.0 && full(184) > 4.0, "C {} {}", full(177), full(184));
    }
}
