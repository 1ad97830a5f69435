//! The time of a frame, shared among steps and levels at one price, with a bounded lag and quality beyond the finest.

use crate::play::Folder;
use metachron_lod::control;
use metachron_render::{Camera, Shading, Size, Style};
use metachron_scene::Source;
use metachron_session::{Drawing, End, Finished, Headless, Outcome, Session, play_headless};
use metachron_world::Pace;
use std::fmt::Write;

const SIZE: Size = Size { width: 640, height: 360 };

fn session(text: &str) -> Session {
    let folder = Folder::with(&format!("executor = \"lockstep\"\n{text}"));
    let source = Source::open(folder.scene()).expect("the file just written");
    let scene = metachron_scene::load(&source, &[]).unwrap_or_else(|why| panic!("{:?}", why.problems));
    Session::open(scene, Pace::RealTime).expect("agents that can run")
}

fn play(text: &str, frames: u64) -> Outcome {
    let plan = Headless {
        end: End::Frames(frames),
        size: SIZE,
        style: Style::default(),
        drawing: Drawing::Nothing,
        png: None,
        depth: None,
        film: None,
    };
    play_headless(session(text), plan, &mut |_, _| true).expect("nothing that can fail")
}

/// Tubes that swing between two nails before a camera, on a machine of so many cores that takes `unit_us` a segment and solve, and has
/// `more` to do.
fn strands(tubes: u32, cores: u32, unit_us: f64, more: &str) -> String {
    let mut text = format!(
        "[target]\nframe_hz = 60.0\npolicy = \"adaptive\"\n[camera]\neye_m = [0, -1.6, 0.3]\nlook_at_m = [0, 0, 0.2]\n\
         [machine]\ncores = {cores}\ndraw_triangle_us = 3.0\n{more}\n[machine.step.tube]\nunit_us = {unit_us}\n"
    );
    for k in 0..tubes {
        let z = 0.1 * f64::from(k);
        let _ = write!(
            text,
            "[[object]]\nname = \"strand {k}\"\nmodel = \"tube\"\npath_m = [[-0.5, 0, {z}], [0, 0.05, {z}], [0.5, 0, {z}]]\n\
             radius_m = 0.012\nwall_m = 0.003\nyoung_pa = 5.0e4\ndensity_kg_m3 = 1050.0\nself_contact = false\nsleep = false\n\
             pin = [\"start\", \"end\"]\nrate_hz = 100.0\ndt_ms = [10, 40]\neps_m = [0.005, 0.2]\npicture_eps_m = [0.002, 0.2]\n\
             n = [0, 2]\n"
        );
    }
    text
}

/// Mean ε of the agents at the end, metres, and mean triangles of the last second.
fn came_to(outcome: &Outcome) -> (f64, f64) {
    let eps = outcome.agents.iter().filter_map(|agent| agent.stats.resolution.map(|at| at.eps_m));
    let last = &outcome.frames[outcome.frames.len() - 60..];
    let triangles = last.iter().map(|row| row.triangles as f64).sum::<f64>() / 60.0;
    (eps.sum::<f64>() / outcome.agents.len() as f64, triangles)
}

#[test]
fn steps_that_get_four_times_as_dear_are_paid_for_by_steps_and_by_the_picture() {
    // next to nothing; two cores; eight: of two that draw as well. After 8 s steps and picture still give way to each other, 16 s are at rest
    let [light, dear, dearest] = [0.05, 50.0, 200.0].map(|unit_us| {
        let outcome = play(&strands(2, 2, unit_us, ""), 960);
        let triangles = || outcome.frames[900..].iter().map(|row| row.triangles);
        assert_eq!(triangles().min(), triangles().max(), "{unit_us} µs: at rest");
        came_to(&outcome)
    });
    let told = format!("{light:?} {dear:?} {dearest:?}");
    assert!((light.0 / 0.005 - 1.0).abs() < 0.01, "{told}");
    assert!(dearest.0 > 1.3 * dear.0 && dear.0 > 1.05 * light.0, "steps: {told}");
    assert!(dearest.1 < 0.95 * dear.1 && dear.1 < 0.98 * light.1, "picture: {told}");
    // neither bears it alone: steps could be forty times as coarse, and the picture gone
    assert!(dearest.0 < 20.0 * light.0 && dearest.1 > 0.2 * light.1, "{told}");
}

#[test]
fn where_there_is_time_for_all_nothing_is_shared_out() {
    let [few, many] = [4, 64].map(|cores| play(&strands(2, cores, 0.25, ""), 120));
    assert_eq!(few.state_hash, many.state_hash);
    let picture = |outcome: &Outcome| outcome.frames.iter().map(|row| (row.triangles, row.changes)).collect::<Vec<_>>();
    assert_eq!(picture(&few), picture(&many));
}

/// The resolution of the first strand, which counts a hundred times as much as the others, over the mean of theirs, at the end: ε of
/// its simulation, its steps, and ε of its picture.
fn of_the_important_one(outcome: &Outcome) -> [f64; 3] {
    let all = outcome.agents.iter().map(|agent| {
        let eps_m = |at: Option<metachron_core::Resolution>| at.expect("a tube has an ε").eps_m;
        [eps_m(agent.stats.resolution), agent.stats.dt.as_secs_f64(), eps_m(agent.picture)]
    });
    let all: Vec<_> = all.collect();
    [0, 1, 2].map(|k| all[0][k] * (all.len() - 1) as f64 / all[1..].iter().map(|row| row[k]).sum::<f64>())
}

#[test]
fn what_counts_more_has_finer_eps_steps_and_picture_wherever_the_picture_is_drawn() {
    // drawn on the cores: one price; drawn by a card of its own: two, of which a scene may pay both or one
    for (card, unit_us, triangle_us) in [(false, 20.0, 3.0), (true, 25.0, 3.0), (true, 25.0, 0.003)] {
        let more = format!("graphics_card = {card}\n");
        let text = strands(8, 2, unit_us, &more)
            .replace("draw_triangle_us = 3.0", &format!("draw_triangle_us = {triangle_us:?}"));
        // the work of three and of four cores, of which ε can save two thirds
        let text = text.replace("eps_m = [0.005, 0.2]", "eps_m = [0.005, 0.015]");
        let text = text.replacen("rate_hz = 100.0", "rate_hz = 100.0\nimportance = 100.0", 1);
        let [eps, dt, picture] = of_the_important_one(&play(&text, 600));
        assert!(eps < 0.7 && dt < 0.9, "drawn by a card: {card}; ε {eps}, dt {dt} of the others'");
        assert!(
            if triangle_us > 1.0 { picture < 0.7 } else { picture == 1.0 },
            "drawn by a card: {card}; picture {picture}"
        );
    }
}

#[test]
fn what_a_frame_takes_beside_a_card_is_not_the_agents() {
    let came_to_eps = |choosing_ns: &str| {
        let more = format!("graphics_card = true\ncull_object_ns = {choosing_ns}\nchoose_object_ns = {choosing_ns}\n");
        came_to(&play(&strands(6, 1, 50.0, &more), 480)).0
    };
    // a core of which finding and choosing take nothing, or seven tenths
    let (free, busy) = (came_to_eps("0.0"), came_to_eps("1_000_000.0"));
    assert!(busy > 1.3 * free, "{busy} {free}");
}

/// Until 8 s, in every `every_s` seconds, steps take six times as long for a tenth of them.
fn bursts(every_s: f64) -> String {
    let entry = |at_s: f64, factor: f64| format!("{{ at_s = {at_s:.3}, factor = {factor:?} }}");
    let one = |k: u32| {
        let at_s = 0.01 + every_s * f64::from(k);
        [entry(at_s, 6.0), entry(at_s + 0.1 * every_s, 1.0)].join(", ")
    };
    let all: Vec<String> = (0..(8.0 / every_s) as u32).map(one).collect();
    format!("step_load = [{}]", all.join(", "))
}

#[test]
fn steps_whose_work_comes_in_bursts_give_way_to_its_mean_and_come_back() {
    let played = |more: &str, frames| play(&strands(2, 2, 50.0, more), frames);
    let late = |outcome: &Outcome| outcome.frames.iter().filter(|row| row.frame_ms > 1.05 * outcome.target_ms).count();
    // calm ones too move what they have between steps and picture at first; from 10 s on they do no more
    let calm = [600, 1200].map(|frames| played("", frames));
    let [rest, later] = calm.each_ref().map(came_to);
    assert_eq!(rest, later, "calm ones come to rest");
    for every_s in [0.3, 2.0] {
        let more = bursts(every_s);
        let [during, after] = [480, 1200].map(|frames| played(&more, frames));
        let told = format!("every {every_s} s: {:?}, {:?}; {rest:?}", came_to(&during), came_to(&after));
        // all work is half as much again
        assert!(came_to(&during).0 < 1.5 * rest.0, "{told}");
        // 12 s later they are where they would be without, but for 2 %, which is no change to the policy
        assert!((came_to(&after).0 / rest.0 - 1.0).abs() < 0.05, "{told}");
        assert!((came_to(&after).1 / rest.1 - 1.0).abs() < 0.05, "{told}");
        // no more frames than there are bursts
        assert!(late(&during) < late(&calm[0]) + 48, "{told}: {} of {} late", late(&during), late(&calm[0]));
        let mean_ms = during.frames[240..].iter().map(|row| row.frame_ms).sum::<f64>() / 240.0;
        assert!(mean_ms < during.target_ms, "{told}: {mean_ms}");
    }
}

/// Meshes around which a camera turns once in 4 s, with more in the target's table.
fn turning(target: &str) -> String {
    format!(
        "[target]\nframe_hz = 20.0\npolicy = \"adaptive\"\n{target}\n[camera]\neye_m = [0, -6, 2]\nperiod_s = 4.0\n\
         [machine]\ndraw_pixel_ns = 20.0\n[[object]]\nname = \"ball\"\nmodel = \"mesh\"\ngenerate = \"blob\"\ntriangles = 40000\n\
         grid = [3, 3, 1]\nspacing_m = [2, 2, 0]\n"
    )
}

#[test]
fn a_lag_that_is_bounded_is_kept() {
    let slowest =
        |target: &str| play(&turning(target), 60).frames[5..].iter().map(|row| row.lag_ms).fold(0.0, f64::max);
    let (free, bounded) = (slowest(""), slowest("lag_ms = 12.0"));
    assert!(free > 24.0 && bounded <= 12.0 && bounded > 8.0, "{free} {bounded}");
}

/// Nine balls before a camera that stands still, all of them at their finest, on a machine on which `choosing` has a price.
fn calm(target: &str, choosing: &str) -> String {
    format!(
        "[target]\nframe_hz = 10.0\npolicy = \"adaptive\"\n{target}\n[camera]\neye_m = [0, -8, 2]\n[machine]\n{choosing}\n\
         [[object]]\nname = \"ball\"\nmodel = \"mesh\"\ngenerate = \"blob\"\ntriangles = 2000\ngrid = [3, 3, 1]\n\
         spacing_m = [1, 1, 0]\n"
    )
}

#[test]
fn choosing_beside_drawing_shortens_the_lag_by_exactly_what_drawing_hides() {
    let last = |target: &str, choosing: &str| *play(&calm(target, choosing), 8).frames.last().expect("eight frames");
    let (asked, near) = ("lag_ms = 1000.0", |a: f64, b: f64| (a - b).abs() < 1e-5); // times are whole nanoseconds
    // ten objects' culling and choosing; drawing takes longer; one core alone does one after the other
    let alone = |choosing: &str| last("", &format!("cores = 1\n{choosing}"));
    let cheap = "cull_object_ns = 100_000.0\nchoose_object_ns = 200_000.0";
    let (row, beside) = (alone(cheap), last(asked, cheap));
    assert_eq!(row.triangles, beside.triangles);
    let (cull, select) = (row.cull_ms, row.select_ms);
    assert!(near(cull, 0.9) && near(select, 1.8) && row.draw_ms > 2.0 * (cull + select), "{row:?}");
    assert!(near(row.lag_ms, cull + select + row.draw_ms), "one after the other: {row:?}");
    assert!(near(beside.lag_ms, row.lag_ms - select), "{} of {}", beside.lag_ms, row.lag_ms);
    // beside drawing, the visible objects of the next frame's camera are found too
    assert!(near(beside.select_ms, cull + select) && near(beside.draw_ms, row.draw_ms), "{beside:?}");
    // drawing hides no more than it takes
    let dear = "cull_object_ns = 100_000.0\nchoose_object_ns = 900_000.0";
    let (row, beside) = (alone(dear), last(asked, dear));
    let hidden = row.draw_ms;
    assert!(row.select_ms + row.cull_ms > hidden, "{row:?}");
    assert!(near(beside.lag_ms, row.cull_ms + beside.select_ms), "{beside:?}");
}

#[test]
fn a_choice_that_takes_a_hundredth_of_a_frame_is_made_beside_drawing_where_another_core_is() {
    // 200 µs and 100 µs an object of nine, of a frame of 100 ms
    let [long, short] = [200_000.0, 100_000.0].map(|ns: f64| format!("choose_object_ns = {ns:?}"));
    let lag = |cores: u32, choosing: &str| {
        let row = *play(&calm("", &format!("cores = {cores}\n{choosing}")), 8).frames.last().expect("eight frames");
        (row.lag_ms - row.draw_ms, row.select_ms)
    };
    let near = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).abs() < 1e-5 && (a.1 - b.1).abs() < 1e-5;
    for (cores, choosing, expected) in
        [(1, &long, (1.8, 1.8)), (2, &long, (0.0, 1.8)), (1, &short, (0.9, 0.9)), (2, &short, (0.9, 0.9))]
    {
        assert!(near(lag(cores, choosing), expected), "{cores}, {choosing}: {:?}", lag(cores, choosing));
    }
}

#[test]
fn what_comes_into_view_after_the_choice_is_drawn_at_its_coarsest_and_chosen_for_beside_that_drawing() {
    let wall = |name: &str, y: i32| {
        format!(
            "[[object]]\nname = \"{name}\"\nmodel = \"mesh\"\ngenerate = \"blob\"\ntriangles = 4000\nposition_m = [0, {y}, 0]\n"
        )
    };
    let (front, back) = (wall("front", 0), wall("back", -12));
    let text = format!("[target]\nframe_hz = 20.0\npolicy = \"adaptive\"\nlag_ms = 40.0\n{front}{back}");
    let mut session = session(&text);
    let eye = glam::DVec3::new(0.0, -6.0, 0.0);
    let looking = |y: f64| Camera::looking(eye, glam::DVec3::new(0.0, y, 0.0), 0.8);
    let mut frame = |y: f64| {
        let (camera, started) = (looking(y), session.now());
        let triangles = session.compose(&camera, SIZE, Style::default(), None).triangles();
        session.choose_next_frame(&camera, SIZE);
        let draw = session.spend_declared(SIZE);
        let work = session.now() - started;
        session.finish(started, Finished { work, draw, gpu: None, skip: false });
        (triangles, [0, 1].map(|at: usize| session.levels()[at].triangles))
    };
    // one of them is ever in view; while a mesh goes over to another level both are drawn as the finer one
    let before = (0..10).map(|_| frame(0.0)).last().expect("ten frames");
    assert!(before.1[0] > 1000 && before.0 > 1000, "{before:?}");
    let turned = frame(-12.0);
    assert!(
        (1..400).contains(&turned.1[1]) && (1..400).contains(&turned.0),
        "the front is gone, the back is there: {turned:?}"
    );
    let after = frame(-12.0);
    assert!(after.1[1] > 1000 && after.0 > 1000, "{after:?}");
    let again = frame(0.0);
    assert!((1..400).contains(&again.1[0]) && (1..400).contains(&again.0), "{again:?}");
}

#[test]
fn a_frame_whose_time_is_gone_before_anything_is_drawn_is_drawn_in_lowest_forms() {
    let first = |cull_ns: &str| {
        let text = calm("", &format!("cull_object_ns = {cull_ns}")).replace("frame_hz = 10.0", "frame_hz = 100.0");
        play(&text, 1).frames[0]
    };
    // nine objects in a frame of 10 ms: 0.9 and 9 ms of it
    let (in_time, late) = (first("100_000.0"), first("1_000_000.0"));
    assert!(in_time.triangles > 5 * late.triangles && late.triangles >= 9, "{in_time:?} {late:?}");
    assert!(late.frame_ms < in_time.frame_ms + 8.2, "{} {}", late.frame_ms, in_time.frame_ms);
}

/// How far the eye of the picture is from where the eye is when the picture is finished, metres, in the mean.
fn eye_error_m(target: &str) -> f64 {
    let mut session = session(&turning(target));
    let (mut sum, mut due) = (0.0, std::time::Duration::ZERO);
    for frame in 0..40 {
        session.wait_until(due);
        let started = session.now();
        let read: Camera = session.scene_camera();
        let camera = session.predict_camera(read);
        session.compose(&camera, SIZE, Style::default(), None);
        session.spend_declared(SIZE);
        let done = session.now() - started;
        if frame >= 10 {
            sum += camera.eye().distance(session.scene_camera().eye()) / 30.0;
        }
        session.finish(started, Finished { work: done, draw: done, gpu: None, skip: false });
        due = (due + session.period()).max(session.now());
    }
    sum
}

#[test]
fn a_camera_is_drawn_where_it_will_be_when_the_picture_is_finished() {
    let (read, ahead) = (eye_error_m(""), eye_error_m("lag_ms = 1000.0"));
    // 6 m about the vertical in 4 s: 9 m/s for as long as a frame takes; the lag is that of the frames before, which differs by a tenth
    assert!(read > 0.1 && ahead < 0.1 * read, "{read} {ahead}");
}

#[test]
fn time_that_stays_unspent_goes_into_quality_where_the_scene_says_so() {
    let [plain, raised] = ["", "raise = true"].map(|target| {
        let text = format!(
            "[target]\nframe_hz = 30.0\npolicy = \"adaptive\"\n{target}\n[camera]\neye_m = [0, -4, 1]\n[machine.shading]\n\
             per-pixel.pixel_ns = 100.0\ntextured.pixel_ns = 100.0\n[[object]]\nname = \"ball\"\nmodel = \"mesh\"\n\
             generate = \"sphere\"\ntriangles = 2000\n"
        );
        play(&text, 90)
    });
    let ends = [&plain, &raised].map(|outcome| outcome.frames[89].frame_ms);
    assert!(ends[1] > 1.2 * ends[0] && ends[1] <= plain.target_ms, "{ends:?}");
    assert_eq!(plain.frames[10].frame_ms, raised.frames[10].frame_ms, "not at once");
}

/// A scene with `set` after 30 frames in lockstep of where its path is after `at_s`, at `frame_hz` and in all pixels, and milliseconds of the last frame.
fn thirty_frames(scene: &str, at_s: f64, frame_hz: f64, set: &[(&str, &str)]) -> (Session, f64) {
    let frame_hz = format!("{frame_hz:?}");
    let own = [("executor", "\"lockstep\""), ("target.frame_hz", &frame_hz), ("target.render_scale", "[1.0, 1.0]")];
    let source =
        Source::open(&format!("{}/scenes/{scene}.toml", env!("CARGO_MANIFEST_DIR"))).expect("a built-in scene");
    let set: Vec<_> = own.iter().chain(set).map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    let scene = metachron_scene::load(&source, &set).unwrap_or_else(|why| panic!("{:?}", why.problems));
    let mut session = Session::open(scene, Pace::RealTime).expect("a scene");
    let (camera, mut frame_ms) = (session.camera_at(at_s), 0.0);
    for _ in 0..30 {
        let started = session.now();
        session.compose(&camera, SIZE, Style::default(), None);
        let draw = session.spend_declared(SIZE);
        let work = session.now() - started;
        frame_ms = session.finish(started, Finished { work, draw, gpu: None, skip: false }).frame_ms;
    }
    (session, frame_ms)
}

/// The objects of the library that have a texture and are in view halfway along its path.
struct Library {
    /// Milliseconds of the 30th frame.
    frame_ms: f64,
    /// How many are drawn with theirs: of planks, which differ little from their mean colour, and of books.
    textured: [usize; 2],
    triangles: f64,
}

/// The library drawn on the machine whose prices were measured, at `frame_hz`.
fn library(policy: &str, frame_hz: f64) -> Library {
    let set = [("target.policy", &*format!("\"{policy}\"")), ("machine.preset", "\"llvmpipe\"")];
    let (session, frame_ms) = thirty_frames("library", 3.0, frame_hz, &set);
    let seen = session.views().iter().zip(session.levels()).filter(|(view, _)| view.visible && !view.is_group());
    let textured: Vec<_> = seen.filter(|(view, _)| view.shading.1 == control::Shading::Textured).collect();
    let are_books = |view: &control::ObjectView| view.losses.expect("measured").texture > 0.1;
    let with_it = textured.iter().filter(|(_, level)| level.shading == Shading::Textured);
    let books = with_it.clone().filter(|(view, _)| are_books(view)).count();
    let triangles = textured.iter().map(|(_, level)| f64::from(level.triangles)).sum();
    Library { frame_ms, textured: [with_it.count() - books, books], triangles }
}

#[test]
fn textures_of_the_library_go_before_its_shapes_do_where_time_is_tighter() {
    // (FS93, fig. 11): at the tighter targets textures are gone and the triangles that remain are more than the fewest
    let full = library("full", 30.0);
    let all = full.textured;
    assert_eq!(all, [42, 96], "as docs/theory/budget.md says, section 8");
    let at = |times_over: f64| library("adaptive", 1e3 * times_over / full.frame_ms);
    let times_over = [1.0, 1.3, 1.6, 2.0, 2.2, 2.5, 2.7];
    let drawn = times_over.map(at);
    for (over, it) in times_over.iter().zip(&drawn) {
        assert!(over * it.frame_ms <= full.frame_ms, "{over}: {} of {} ms", it.frame_ms, full.frame_ms);
        // pixels are as dear on both, and without its texture a book loses twelve times what a plank does
        assert!(it.textured[0] == 0 || it.textured[1] == all[1], "{over}: {:?}", it.textured);
    }
    for pair in drawn.windows(2) {
        let [one, tighter] = [&pair[0], &pair[1]].map(|it| it.textured);
        assert!((0..2).all(|kind| tighter[kind] <= one[kind]), "{one:?} {tighter:?}");
        assert!(pair[1].triangles < pair[0].triangles, "{} {}", pair[0].triangles, pair[1].triangles);
    }
    let textured = drawn.each_ref().map(|it| it.textured);
    assert!(textured[1] == all && textured[6] == [0, 0], "{textured:?}");
    let (triangles, fewest) = (drawn[6].triangles, at(5.0).triangles);
    assert!(triangles > 1.2 * fewest, "{triangles} {fewest}");
}

#[test]
fn importance_buys_an_object_most_of_the_triangles_that_there_is_time_for() {
    // time for some 800 triangles on 20 meshes in view
    let triangles = |importance: &str| {
        let (session, ms) = thirty_frames("walkthrough", 1.0, 320.0, &[("object.ahead-8.importance", importance)]);
        assert!(ms <= 1e3 / 320.0, "{ms} ms");
        session.levels().iter().map(|level| f64::from(level.triangles)).collect::<Vec<_>>()
    };
    let (plain, important) = (triangles("1"), triangles("100"));
    let [all, all_with_important] = [&plain, &important].map(|of| of.iter().sum::<f64>());
    assert!((all_with_important / all - 1.0).abs() < 0.1, "the same time buys as much: {all}, {all_with_important}");
    let more = plain.iter().zip(&important).filter(|(plain, important)| **important > 2.5 * **plain).count();
    assert!((1..=2).contains(&more), "the two spheres, as far as they are in view: {plain:?} {important:?}");
}

#[test]
fn a_machine_that_hides_no_triangles_behind_pixels_is_kept_in_time_by_prices_that_think_so() {
    let frames = |policy: &str, serial: &str, frame_hz: f64| {
        let policy = format!("\"{policy}\"");
        let set = [("machine.preset", "\"llvmpipe\""), ("machine.draw_serial", serial), ("target.policy", &*policy)];
        thirty_frames("library", 3.0, frame_hz, &set)
    };
    // a little less than full detail where pixels hide triangles
    let frame_hz = 1e3 * 1.1 / frames("full", "0", 30.0).1;
    let ((one, hidden_ms), (other, shown_ms)) = (frames("adaptive", "0", frame_hz), frames("adaptive", "1", frame_hz));
    let triangles = |session: &Session| session.levels().iter().map(|level| level.triangles).sum::<u32>();
    assert!(hidden_ms.max(shown_ms) <= 1e3 / frame_hz, "{frame_hz} {hidden_ms} {shown_ms}");
    assert!(triangles(&one) > triangles(&other), "{} {}", triangles(&one), triangles(&other));
}
