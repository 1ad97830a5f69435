//! The window without its surface: what its buttons do to the run, frame by frame.
//!
//! In virtual time, which passes a frame a picture, so that every number is the same each time.

use super::*;
use metachron_render::{Size, Style};
use std::path::Path;

fn plan(scene: &str) -> WindowPlan {
    let overrides = vec![("executor".to_owned(), "\"lockstep\"".to_owned())];
    let file = format!("{}/../../scenes/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
    let source = Source::open(&file).unwrap();
    WindowPlan { source, overrides, size: None, screenshots: PathBuf::from("."), seconds: None, frames: None }
}

fn with_show(check: impl FnOnce(&mut WindowShow<'_>)) {
    with_scene("pendulum", check);
}

/// A scene whose picture has something to control.
fn with_tube(check: impl FnOnce(&mut WindowShow<'_>)) {
    with_scene("tube", check);
}

fn with_scene(scene: &str, check: impl FnOnce(&mut WindowShow<'_>)) {
    let plan = plan(scene);
    let session = Session::open(metachron_scene::load(&plan.source, &plan.overrides).unwrap()).unwrap();
    let mut go_on = |_: &FrameRecord, _: Option<f64>| true;
    check(&mut WindowShow::new(session, plan, &mut go_on));
}

/// One picture and its account.
fn frame(show: &mut WindowShow<'_>, skip: Option<Skip>) {
    let view =
        ViewRequest { size: Size { width: 1280, height: 720 }, camera: show.scene_camera(), style: Style::default() };
    show.compose(&view);
    show.measured(&FrameTimes { skip, ..FrameTimes::default() });
}

fn steps(show: &WindowShow<'_>) -> u64 {
    show.session.agents().iter().map(|agent| agent.stats().steps).sum()
}

#[test]
fn time_begins_after_the_first_picture_and_passes_a_frame_a_picture() {
    with_show(|show| {
        frame(show, None);
        assert_eq!((show.session.sim_now().as_nanos(), steps(show)), (0, 0));
        (0..4).for_each(|_| frame(show, None));
        let passed = show.session.sim_now().as_secs_f64();
        assert!(passed >= 3.0 * show.session.period().as_secs_f64(), "{passed} s");
        assert!(steps(show) > 0);
        assert_eq!(show.session.frames(), 5);
    });
}

#[test]
fn a_single_step_advances_one_frame_and_paused_pictures_are_not_counted() {
    with_show(|show| {
        (0..5).for_each(|_| frame(show, None));
        show.apply(Action::Pause);
        let (before, counted) = (show.session.sim_now(), show.session.frames());
        let eps = show.session.control().eps_hat();
        show.apply(Action::SingleStep);
        (0..5).for_each(|_| frame(show, Some(Skip::Still)));
        let frame_s = show.session.period().as_secs_f64();
        let passed = show.session.sim_now().since(before).as_secs_f64();
        assert!((passed - frame_s).abs() < 1e-9, "{passed} s"); // whole nanoseconds
        assert_eq!((show.session.frames(), show.session.control().eps_hat()), (counted, eps));
        assert!(!show.status().running);
    });
}

#[test]
fn reset_and_reload_start_the_agents_again_and_reset_keeps_the_target() {
    with_show(|show| {
        (0..8).for_each(|_| frame(show, None));
        let lived = steps(show);
        assert!(lived > 0);
        show.apply(Action::TargetFps(17.0));
        show.apply(Action::Reset);
        assert_eq!((steps(show), show.session.sim_now().as_nanos(), show.status().target_hz), (0, 0, 17.0));
        (0..8).for_each(|_| frame(show, None));
        assert!(steps(show) > 0);
        show.apply(Action::Reload);
        assert_eq!((steps(show), show.status().target_hz), (0, show.session.scene().target.frame_hz));
        assert!(show.status.messages.is_empty());
    });
}

#[test]
fn a_scene_that_cannot_be_opened_is_a_message_and_the_run_goes_on() {
    with_show(|show| {
        (0..4).for_each(|_| frame(show, None));
        let before = show.session.sim_now();
        show.apply(Action::OpenScene(Path::new("/nowhere/at all.toml").to_owned()));
        frame(show, None);
        let [message] = &show.status().messages[..] else { panic!("one message: {:?}", show.status().messages) };
        assert_eq!(message.severity, Severity::Failure);
        assert!(message.text.contains("at all.toml"), "{}", message.text);
        assert!(show.session.sim_now() > before);
        show.apply(Action::Reload);
        assert!(show.session.scene().name.ends_with("pendulum.toml"));
    });
}

#[test]
fn tuning_runs_its_experiment_then_searches_in_the_background_and_applies_the_result() {
    with_tube(|show| {
        let before = show.session.control().law();
        show.apply(Action::Tune);
        (0..160).for_each(|_| frame(show, None));
        let tuning = show.status().tuning.clone().expect("it is under way");
        assert!((0.39..=1.0).contains(&tuning.done), "{tuning:?}");
        assert_eq!(show.session.control().law(), before, "until gains are found the old ones hold the picture");
        let frames = (0..6000).take_while(|_| {
            frame(show, None);
            std::thread::sleep(Duration::from_millis(10)); // the search has a thread of its own
            show.tuning.is_some()
        });
        assert!(frames.count() < 6000, "it ends");
        frame(show, None);
        assert_eq!(show.status().tuning, None);
        assert_ne!(show.session.control().law(), before);
        let [message] = &show.status().messages[..] else { panic!("one message: {:?}", show.status().messages) };
        assert!(message.severity == Severity::Note && message.text.starts_with("tuned: κ"), "{}", message.text);
    });
}

#[test]
fn tuning_that_is_cancelled_leaves_everything_as_it_was() {
    for frames in [20, 170] {
        with_tube(|show| {
            let held = |show: &mut WindowShow<'_>| (show.session.control().policy(), show.session.control().law());
            show.session.set_policy("adaptive");
            let before = held(show);
            show.apply(Action::Tune);
            (0..frames).for_each(|_| frame(show, None));
            show.apply(Action::StopTuning);
            frame(show, None);
            assert_eq!((held(show), show.status().tuning.clone()), (before, None));
            assert!(show.status().messages.is_empty(), "{:?}", show.status().messages);
        });
    }
}

#[test]
fn a_scene_that_cannot_be_tuned_gives_the_reason() {
    with_tube(|show| {
        show.apply(Action::TargetFps(1000.0));
        show.apply(Action::Tune);
        for _ in 0..2000 {
            frame(show, None);
            if show.tuning.is_none() {
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let [message] = &show.status().messages[..] else { panic!("one message: {:?}", show.status().messages) };
        assert!(message.severity == Severity::Warning && message.text.contains("coarsest"), "{}", message.text);
    });
}

#[test]
fn a_run_without_an_end_forgets_its_oldest_frames() {
    with_show(|show| {
        show.session.keep_frames(10);
        (0..45).for_each(|_| frame(show, None));
        let other = Session::open(show.session.scene().clone()).unwrap();
        let session = std::mem::replace(&mut show.session, other);
        let outcome = session.end(None, false);
        assert_eq!((outcome.finished, outcome.frames.last().unwrap().frame), (45, 44));
        assert!((10..20).contains(&outcome.frames.len()), "{} frames", outcome.frames.len());
    });
}

#[test]
fn dropped_time_lowers_the_real_time_factor() {
    with_show(|show| {
        (0..60).for_each(|_| frame(show, None));
        let on_time = show.status().real_time_factor;
        // the first of sixty pictures is drawn before time begins
        assert!((on_time - 1.0).abs() < 0.02, "{on_time}");
    });
    let mut plan = plan("pendulum");
    // a step that becomes 50 ms long at most takes 100
    plan.overrides.push(("machine.step.tube.base_us".to_owned(), "100000".to_owned()));
    let session = Session::open(metachron_scene::load(&plan.source, &plan.overrides).unwrap()).unwrap();
    let mut go_on = |_: &FrameRecord, _: Option<f64>| true;
    let show = &mut WindowShow::new(session, plan, &mut go_on);
    (0..240).for_each(|_| frame(show, None));
    let Status { real_time_factor, speed, agents, .. } = show.status();
    assert!((0.3..0.7).contains(real_time_factor) && *speed == 1.0, "{real_time_factor}");
    let dropped: Vec<f64> = agents.iter().map(|agent| agent.dropped_s).collect();
    assert!(dropped[0] > 1.0 && dropped[1] == 0.0, "{dropped:?}");
}
