//! Groups with levels of their own, from the scene file to the picture.

use crate::adapter::gpu;
use metachron_lod::control::{LevelDemand, Policy};
use metachron_render::{Offscreen, PictureFile, RendererOptions, Size};
use metachron_scene::Source;
use metachron_session::{Drawing, FlyThrough};

const SIZE: Size = Size { width: 320, height: 240 };
const OPTIONS: RendererOptions = RendererOptions { samples: 1, shadow_px: 512, shadow_taps: 1, lean: false };

/// Five woods of 25 balls, one behind the other. The eye goes back from the first, and the others come into view before it. A ball of 60
/// triangles is nearly round, so that woods stay open as long as the time suffices for that: three may, for all five take 23 ms.
const WOODS: usize = 5;
const BALLS: usize = 25;
const LEVELS: usize = 3;

fn woods() -> String {
    let mut text = String::from(
        "format = 1\nexecutor = \"lockstep\"\n[target]\nframe_hz = 60.0\n\
         [machine]\ncores = 1\ndraw_setup_ms = 1.0\ndraw_pixel_ns = 0.0\ndraw_object_us = 5.0\ndraw_triangle_us = 3.0\nnoise = 0.0\n\
         [camera]\nfov_deg = 40.0\neven = true\nkeyframe = [\n\
         { at_s = 0.0, eye_m = [0, -16, 7], look_at_m = [0, 24, 2] },\n\
         { at_s = 10.0, eye_m = [0, -210, 7], look_at_m = [0, -170, 2] },\n]\n",
    );
    for wood in 0..WOODS {
        let y = -40 * wood as i32 - 6;
        text += &format!(
            "[[object]]\nname = \"ball-{wood}\"\nmodel = \"mesh\"\ngenerate = \"sphere\"\ntriangles = 600\nleast_triangles = 60\nscale = 0.9\n\
             colour = \"#d02818\"\nposition_m = [-6, {y}, 0.9]\ngrid = [5, 5, 1]\nspacing_m = [3, 3, 0]\n\
             [[group]]\nname = \"wood-{wood}\"\nmembers = [\"ball-{wood}-*\"]\nlevels = [50, 100, 200]\n"
        );
    }
    text
}

struct Wood {
    /// Its impostor's number; past the last it is drawn as its balls.
    level: u8,
    triangles: f64,
}

/// The levels that a frame draws each wood with; every ball of it once, by itself or by the impostor of its wood.
fn drawn(levels: &[LevelDemand]) -> Vec<Wood> {
    let (balls, groups) = levels.split_at(WOODS * BALLS);
    let wood = |(balls, group): (&[LevelDemand], &LevelDemand)| {
        let shown = balls.iter().filter(|ball| ball.polygons > 0.0).count();
        let closed = group.polygons > 0.0;
        assert_eq!(shown, if closed { 0 } else { BALLS }, "{group:?}");
        let triangles = group.polygons + balls.iter().map(|ball| ball.polygons).sum::<f64>();
        Wood { level: group.resolution.n, triangles }
    };
    balls.chunks(BALLS).zip(groups).map(wood).collect()
}

fn walk(drawing: Drawing) -> FlyThrough {
    let source = Source::memory("woods", woods().as_bytes()).expect("short and UTF-8");
    let scene = metachron_scene::load(&source, &[]).unwrap_or_else(|why| panic!("{:?}", why.problems));
    FlyThrough::open(scene, drawing, SIZE).expect("scenery alone")
}

#[test]
fn a_wood_that_is_walked_away_from_is_drawn_open_then_fine_then_coarse_within_the_time() {
    const FRAMES: usize = 300;
    let mut walk = walk(Drawing::Nothing);
    let (mut levels, mut first) = (Vec::new(), Vec::<Wood>::new());
    for frame in 0..FRAMES {
        let record = walk.step(frame as f64 / FRAMES as f64).expect("nothing is drawn");
        let wood = drawn(&walk.session().control().last_plan().levels).swap_remove(0);
        assert_eq!(record.holes, 0);
        // the first frames learn the machine; past 1.05 T a frame is a miss
        assert!(frame < 30 || record.frame_ms <= 1.05e3 / 60.0, "frame {frame}: {} ms", record.frame_ms);
        levels.push(f64::from(wood.level));
        if first.iter().all(|seen| seen.level != wood.level) {
            first.push(wood);
        }
    }
    assert_eq!(first.iter().map(|wood| wood.level).collect::<Vec<_>>(), [3, 2, 1, 0], "each has its turn");
    assert!(first.windows(2).all(|pair| pair[0].triangles > pair[1].triangles));
    // a wood that comes into view makes time dearer for all and then goes farther away too: levels fall as a whole, not in every frame
    let thirds: Vec<f64> =
        levels.chunks(FRAMES / 3).map(|third| third.iter().sum::<f64>() / third.len() as f64).collect();
    assert!(thirds[0] > thirds[1] + 0.3 && thirds[1] > thirds[2] + 0.3, "{thirds:?}");
}

/// Pixels of the balls' colour.
fn red(picture: &PictureFile) -> f64 {
    let reddish = |pixel: &[u8]| pixel[0] > 60 && u32::from(pixel[0]) > 2 * u32::from(pixel[1]);
    picture.pixels().filter(|pixel| reddish(&pixel.0)).count() as f64
}

#[test]
fn an_impostor_covers_about_what_its_wood_does() {
    let Some(gpu) = gpu() else { return };
    let screen = || Drawing::Last(Box::new(Offscreen::new(gpu.clone(), SIZE, OPTIONS).expect("a small target")));
    let (mut full, mut ours) = (walk(screen()), walk(screen()));
    full.session().control().set_policy(Policy::Full);
    let mut closed = 0;
    for frame in 0..=90 {
        let part = f64::from(frame) / 90.0;
        full.step(part).expect("a frame");
        ours.step(part).expect("a frame");
        let woods = drawn(&ours.session().control().last_plan().levels);
        if frame % 15 == 0 {
            let pictures = [&mut full, &mut ours].map(|walk| walk.picture().expect("drawn").expect("an adapter"));
            let [whole, drawn] = pictures.each_ref().map(red);
            closed += woods.iter().filter(|wood| usize::from(wood.level) < LEVELS).count();
            assert!(whole > 300.0 && (0.7..1.4).contains(&(drawn / whole)), "frame {frame}: {drawn} of {whole}");
        }
    }
    assert!(closed > 3, "woods that are drawn by an impostor: {closed}");
}
