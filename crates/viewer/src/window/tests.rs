//! The window without its surface: the effect of its buttons on the run, frame by frame.
//!
//! In virtual time, which passes a frame a picture, so that every number is the same each time.

mod past_tests;

use super::*;
use metachron_render::{Size, Style};
use metachron_world::Pace;
use std::path::Path;

fn plan(scene: &str) -> WindowPlan {
    let overrides = vec![("executor".to_owned(), "\"lockstep\"".to_owned())];
    let file = format!("{}/../../scenes/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
    let source = Source::open(&file).unwrap();
    WindowPlan {
        source,
        overrides,
        size: None,
        reset: false,
        screenshots: PathBuf::from("."),
        seconds: None,
        frames: None,
    }
}

fn with_simulation(check: impl FnOnce(&mut WindowSimulation<'_>)) {
    with_scene("pendulum", check);
}

/// A scene whose picture has something to control.
fn with_tube(check: impl FnOnce(&mut WindowSimulation<'_>)) {
    with_scene("tube", check);
}

fn with_scene(scene: &str, check: impl FnOnce(&mut WindowSimulation<'_>)) {
    with_plan(plan(scene), check);
}

fn with_plan(plan: WindowPlan, check: impl FnOnce(&mut WindowSimulation<'_>)) {
    let session = Session::open(metachron_scene::load(&plan.source, &plan.overrides).unwrap(), Pace::RealTime).unwrap();
    let mut go_on = |_: &FrameRecord, _: Option<f64>| true;
    check(&mut WindowSimulation::new(session, plan, &mut go_on));
}

/// One picture and its account.
fn frame(simulation: &mut WindowSimulation<'_>, skip: Option<Skip>) {
    let view = ViewRequest {
        size: Size { width: 1280, height: 720 },
        camera: simulation.scene_camera(),
        style: Style::default(),
    };
    simulation.compose(&view);
    simulation.measured(&FrameTimes { skip, ..FrameTimes::default() });
}

fn steps(simulation: &WindowSimulation<'_>) -> u64 {
    simulation.session.agents().iter().map(|agent| agent.stats().steps).sum()
}

#[test]
fn time_begins_after_the_first_picture_and_passes_a_frame_a_picture() {
    with_simulation(|simulation| {
        frame(simulation, None);
        assert_eq!((simulation.session.sim_now().as_nanos(), steps(simulation)), (0, 0));
        (0..4).for_each(|_| frame(simulation, None));
        let passed = simulation.session.sim_now().as_secs_f64();
        assert!(passed >= 3.0 * simulation.session.period().as_secs_f64(), "{passed} s");
        assert!(steps(simulation) > 0);
        assert_eq!(simulation.session.frames(), 5);
    });
}

#[test]
fn a_single_step_advances_one_frame_and_paused_pictures_are_not_counted() {
    with_simulation(|simulation| {
        (0..5).for_each(|_| frame(simulation, None));
        simulation.apply(Action::Pause);
        let (before, counted) = (simulation.session.sim_now(), simulation.session.frames());
        let eps = simulation.session.control().eps_hat();
        simulation.apply(Action::SingleStep);
        (0..5).for_each(|_| frame(simulation, Some(Skip::Still)));
        let frame_s = simulation.session.period().as_secs_f64();
        let passed = simulation.session.sim_now().since(before).as_secs_f64();
        assert!((passed - frame_s).abs() < 1e-9, "{passed} s"); // whole nanoseconds
        assert_eq!((simulation.session.frames(), simulation.session.control().eps_hat()), (counted, eps));
        assert!(!simulation.status().running);
    });
}

#[test]
fn reset_and_reload_start_the_agents_again_and_reset_keeps_the_target() {
    with_simulation(|simulation| {
        (0..8).for_each(|_| frame(simulation, None));
        let lived = steps(simulation);
        assert!(lived > 0);
        simulation.apply(Action::TargetFps(17.0));
        simulation.apply(Action::Reset);
        assert_eq!(
            (steps(simulation), simulation.session.sim_now().as_nanos(), simulation.status().target_hz),
            (0, 0, 17.0)
        );
        (0..8).for_each(|_| frame(simulation, None));
        assert!(steps(simulation) > 0);
        simulation.apply(Action::Reload);
        assert_eq!((steps(simulation), simulation.status().target_hz), (0, simulation.session.scene().target.frame_hz));
        assert!(simulation.status.messages.is_empty());
    });
}

#[test]
fn a_scene_that_cannot_be_opened_is_a_message_and_the_run_goes_on() {
    with_simulation(|simulation| {
        (0..4).for_each(|_| frame(simulation, None));
        let before = simulation.session.sim_now();
        simulation.apply(Action::OpenScene(Path::new("/nowhere/at all.toml").to_owned()));
        frame(simulation, None);
        let [message] = &simulation.status().messages[..] else {
            panic!("one message: {:?}", simulation.status().messages)
        };
        assert_eq!(message.severity, Severity::Failure);
        assert!(message.text.contains("at all.toml"), "{}", message.text);
        assert!(simulation.session.sim_now() > before);
        simulation.apply(Action::Reload);
        assert!(simulation.session.scene().name.ends_with("pendulum.toml"));
    });
}

#[test]
fn tuning_runs_its_experiment_then_searches_in_the_background_and_applies_the_result() {
    with_tube(|simulation| {
        let before = simulation.session.control().law();
        simulation.apply(Action::Tune);
        (0..160).for_each(|_| frame(simulation, None));
        let tuning = simulation.status().tuning.clone().expect("it is under way");
        assert!((0.39..=1.0).contains(&tuning.done), "{tuning:?}");
        assert_eq!(simulation.session.control().law(), before, "until gains are found the old ones hold the picture");
        let frames = (0..6000).take_while(|_| {
            frame(simulation, None);
            std::thread::sleep(Duration::from_millis(10)); // the search has a thread of its own
            simulation.tuning.is_some()
        });
        assert!(frames.count() < 6000, "it ends");
        frame(simulation, None);
        assert_eq!(simulation.status().tuning, None);
        assert_ne!(simulation.session.control().law(), before);
        let [message] = &simulation.status().messages[..] else {
            panic!("one message: {:?}", simulation.status().messages)
        };
        assert!(message.severity == Severity::Note && message.text.starts_with("tuned: κ"), "{}", message.text);
    });
}

#[test]
fn tuning_that_is_cancelled_leaves_everything_as_it_was() {
    for in_search in [false, true] {
        with_tube(|simulation| {
            let held = |simulation: &mut WindowSimulation<'_>| {
                (simulation.session.control().policy(), simulation.session.control().law())
            };
            simulation.session.set_policy("adaptive");
            let before = held(simulation);
            simulation.apply(Action::Tune);
            (0..20).for_each(|_| frame(simulation, None));
            // gains that are found are taken by the next frame: no frame is drawn between the search's start and its end
            while in_search && simulation.tuning.as_ref().is_some_and(Tuning::draws) {
                frame(simulation, None);
            }
            simulation.apply(Action::StopTuning);
            frame(simulation, None);
            assert_eq!((held(simulation), simulation.status().tuning.clone()), (before, None));
            assert!(simulation.status().messages.is_empty(), "{:?}", simulation.status().messages);
        });
    }
}

#[test]
fn a_scene_that_cannot_be_tuned_gives_the_reason() {
    with_tube(|simulation| {
        simulation.apply(Action::TargetFps(1000.0));
        simulation.apply(Action::Tune);
        for _ in 0..2000 {
            frame(simulation, None);
            if simulation.tuning.is_none() {
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let [message] = &simulation.status().messages[..] else {
            panic!("one message: {:?}", simulation.status().messages)
        };
        assert!(message.severity == Severity::Warning && message.text.contains("coarsest"), "{}", message.text);
    });
}

#[test]
fn a_run_without_an_end_forgets_its_oldest_frames() {
    with_simulation(|simulation| {
        simulation.session.keep_frames(10);
        (0..45).for_each(|_| frame(simulation, None));
        let other = Session::open(simulation.session.scene().clone(), Pace::RealTime).unwrap();
        let session = std::mem::replace(&mut simulation.session, other);
        let outcome = session.end(None, false);
        assert_eq!((outcome.finished, outcome.frames.last().unwrap().frame), (45, 44));
        assert!((10..20).contains(&outcome.frames.len()), "{} frames", outcome.frames.len());
    });
}

#[test]
fn dropped_time_lowers_the_real_time_factor() {
    let mut prompt = plan("pendulum");
    // which draws its first frames coarse and in time
    prompt.overrides.push(("target.policy".to_owned(), "\"feedback\"".to_owned()));
    with_plan(prompt, |simulation| {
        (0..60).for_each(|_| frame(simulation, None));
        let on_time = simulation.status().real_time_factor;
        // the first of sixty pictures is drawn before time begins
        assert!((on_time - 1.0).abs() < 0.02, "{on_time}");
    });
    let mut plan = plan("pendulum");
    // a step that becomes 1/60 s long at most, as the tube swings past the ball, takes twice that
    plan.overrides.push(("machine.step.tube.base_us".to_owned(), "33000".to_owned()));
    let session = Session::open(metachron_scene::load(&plan.source, &plan.overrides).unwrap(), Pace::RealTime).unwrap();
    let mut go_on = |_: &FrameRecord, _: Option<f64>| true;
    let simulation = &mut WindowSimulation::new(session, plan, &mut go_on);
    let mut sum = 0.0;
    for _ in 0..240 {
        frame(simulation, None);
        sum += simulation.status().real_time_factor;
    }
    let Status { speed, agents, .. } = simulation.status();
    let mean = sum / 240.0;
    assert!((0.3..0.7).contains(&mean) && *speed == 1.0, "{mean}");
    let dropped: Vec<f64> = agents.iter().map(|agent| agent.dropped_s).collect();
    assert!(dropped[0] > 1.0, "{dropped:?}");
}

#[test]
fn the_pressure_of_a_tube_follows_its_slider() {
    with_tube(|simulation| {
        let row = simulation.status().agents.iter().find(|row| row.filled.is_some()).unwrap().clone();
        let pressure_pa = 0.5 * row.filled.unwrap().most_pa;
        let widest_m = |simulation: &WindowSimulation<'_>| {
            let state = simulation.session.agents()[row.id.0 as usize].latest();
            let metachron_core::Body::Curve(curve) = &state.body else { panic!("a tube is a curve") };
            curve.radii_m.iter().copied().fold(0.0, f64::max)
        };
        (0..4).for_each(|_| frame(simulation, None));
        let before_m = widest_m(simulation);
        simulation.apply(Action::Pressure { agent: row.id, pressure_pa });
        (0..8).for_each(|_| frame(simulation, None));
        assert_eq!(simulation.status().agents[row.id.0 as usize].filled.unwrap().pressure_pa, pressure_pa);
        assert!(widest_m(simulation) > 1.1 * before_m, "{} m of {before_m} m", widest_m(simulation));
    });
}

#[test]
fn a_window_on_a_world_elsewhere_shows_its_time_drives_it_and_leaves_its_scene_alone() {
    let plan = plan("pendulum");
    let scene = metachron_scene::load(&plan.source, &plan.overrides).unwrap();
    let world = metachron_world::World::start(&scene, scene.executor).unwrap();
    let session = Session::open_elsewhere(scene, std::sync::Arc::new(world.clone())).unwrap();
    let mut go_on = |_: &FrameRecord, _: Option<f64>| true;
    let simulation = &mut WindowSimulation::new(session, plan, &mut go_on);
    assert!(world.timeline().runs_at(world.now()), "a window leaves time elsewhere as it is");
    for _ in 0..3 {
        world.advance(SimSpan::from_millis(20));
        frame(simulation, None);
    }
    // a frame says the time at its begin
    frame(simulation, None);
    assert_eq!(simulation.status().sim_time, world.time());
    assert_eq!(steps(simulation), world.agents().iter().map(|agent| agent.stats().steps).sum::<u64>());
    for action in [Action::Reset, Action::Reload, Action::OpenScene(PathBuf::from("other.toml"))] {
        simulation.apply(action);
    }
    frame(simulation, None);
    assert_eq!((simulation.status().messages.len(), simulation.session.is_elsewhere()), (1, true));
    simulation.apply(Action::Pause);
    assert!(!world.timeline().runs_at(world.now()));
}
