//! The window's interface driven as a user would: by label, by key, by mouse; its requests are the ones meant.

mod fake;

use egui::accesskit::Toggled;
use egui::{Key, Modifiers, pos2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use fake::{BALL, Fake, World, asked, last_view, middle, press, window, window_of};
use metachron_core::{AgentId, SimTime};
use metachron_render::{Colouring, Hit};
use metachron_session::RewindStatus;
use metachron_viewer::ui::{
    Action, AgentRow, Forces, FrameTimes, Law, Look, MOUSE, Message, SHORTCUTS, Severity, Simulation, TurnRow,
    keys_text,
};
use std::time::Duration;

#[test]
fn transport_buttons_ask_for_what_they_say() {
    let mut harness = window();
    for (label, action) in [
        ("Pause", Action::Pause),
        ("Run", Action::Run),
        ("Step", Action::SingleStep),
        ("Reset", Action::Reset),
        ("Faster", Action::Speed(2.0)),
        ("Slower", Action::Speed(1.0)),
    ] {
        harness.get_by_label(label).click();
        assert_eq!(asked(&mut harness), [action], "{label}");
    }
}

/// A window of this size.
fn small(width: f32, height: f32) -> Harness<'static, World> {
    let mut harness = window();
    harness.set_size(egui::vec2(width, height));
    harness.run_steps(3);
    harness
}

#[test]
fn panels_give_way_to_the_picture_in_a_small_window() {
    for (width, height, side, table) in [
        (300.0, 200.0, false, false),
        (360.0, 300.0, false, false),
        (420.0, 300.0, false, false),
        (420.0, 700.0, false, true),
        (900.0, 300.0, false, false),
        (640.0, 420.0, true, true),
    ] {
        let harness = small(width, height);
        let picture = harness.get_by_label("Picture").rect();
        let told = format!("{width} × {height}: {picture:?}");
        assert!(picture.left() >= 0.0 && picture.right() <= width && picture.bottom() <= height, "{told}");
        let slider = harness.query_by_role_and_label(egui::Role::Slider, "Target rate");
        assert_eq!(slider.is_some(), side, "{told}");
        assert!(slider.is_none_or(|slider| !slider.rect().intersects(picture)), "{told}");
        // all area outside the panels is the picture's
        assert!(table || picture.height() > height - 80.0, "{told}");
        assert!(picture.height() > 100.0 && picture.width() > 200.0, "{told}");
        // the bar stands above it, and its ends do not meet
        let (pause, rate) = (harness.get_by_label("Pause").rect(), harness.get_by_label_contains("fps").rect());
        let clock = harness.query_by_label_contains("12.345 s").map_or(pause, |clock| clock.rect());
        assert!(pause.right() <= rate.left() && clock.right() <= rate.left() && rate.right() <= width, "{told}");
        assert!(rate.bottom() <= picture.top() + 0.5, "{told}");
    }
}

#[test]
fn keys_ask_for_what_the_help_says() {
    let mut harness = window();
    assert_eq!(press(&mut harness, Key::Space), [Action::Pause]);
    assert_eq!(press(&mut harness, Key::Space), [Action::Run]);
    assert_eq!(press(&mut harness, Key::ArrowRight), [Action::SingleStep]);
    assert_eq!(press(&mut harness, Key::Backspace), [Action::Reset]);
    assert_eq!(press(&mut harness, Key::Equals), [Action::Speed(2.0)]);
    assert_eq!(press(&mut harness, Key::Minus), [Action::Speed(1.0)]);
    harness.key_press_modifiers(Modifiers::COMMAND, Key::L);
    assert_eq!(asked(&mut harness), [Action::Reload]);
    press(&mut harness, Key::F12);
    assert!(harness.state().requests.screenshot);
    harness.key_press_modifiers(Modifiers::COMMAND, Key::Q);
    asked(&mut harness);
    assert!(harness.state().requests.quit);
}

#[test]
fn toggles_change_how_the_next_picture_is_drawn() {
    let mut harness = window();
    assert_eq!(last_view(&harness).style.colouring, Colouring::Material);
    harness.get_by_label("Colour by resolution").click();
    asked(&mut harness);
    assert_eq!(last_view(&harness).style.colouring, Colouring::Resolution);
    press(&mut harness, Key::A);
    assert_eq!(last_view(&harness).style.colouring, Colouring::Age);
    let resolution = harness.get_by_label("Colour by resolution");
    assert_eq!(resolution.accesskit_node().toggled(), Some(Toggled::False));
    press(&mut harness, Key::W);
    assert!(last_view(&harness).style.wireframe);
    harness.get_by_label("Wireframe").click();
    asked(&mut harness);
    assert!(!last_view(&harness).style.wireframe);
}

#[test]
fn sliders_move_the_target_and_the_gains() {
    let mut harness = window();
    harness.get_by_role_and_label(egui::Role::Slider, "Target rate").set_value_accesskit(60.0);
    assert_eq!(asked(&mut harness), [Action::TargetFps(60.0)]);
    harness.get_by_role_and_label(egui::Role::Slider, "Gain κ").set_value_accesskit(0.8);
    assert_eq!(asked(&mut harness), [Action::Law(Law::Corrected { kappa: 0.8, lead: 0.0, margin: 0.1 })]);
    harness.get_by_label("Reset to default").click();
    assert_eq!(asked(&mut harness), [Action::Law(Law::Corrected { kappa: 0.5, lead: 0.0, margin: 0.1 })]);
    harness.get_by_label("As printed").click();
    assert_eq!(asked(&mut harness), [Action::Law(Law::Printed { alpha: 1e-4, beta: 5.0 })]);
    assert!(harness.query_by_role_and_label(egui::Role::Slider, "Gain β").is_some());
}

#[test]
fn a_window_left_alone_asks_for_nothing_whatever_the_numbers() {
    let laws = [
        Law::Printed { alpha: 0.333_333, beta: 99.9 },
        Law::Corrected { kappa: 0.123_456_7, lead: 0.0, margin: 0.777 },
    ];
    for law in laws {
        let mut simulation = Fake::new();
        (simulation.status.law, simulation.status.target_hz) = (Some(law), 239.76);
        let mut harness = window_of(simulation);
        harness.run_steps(30);
        assert_eq!(asked(&mut harness), []);
    }
}

#[test]
fn tuning_is_started_watched_and_cancelled() {
    let mut harness = window();
    harness.get_by_label("Tune").click();
    assert_eq!(asked(&mut harness), [Action::Tune]);
    assert!(harness.query_by_label("Tune").is_none(), "one search at a time");
    assert!(harness.query_by_label("drawing at many resolutions").is_some());
    let bar = harness.get_by_role_and_label(egui::Role::ProgressIndicator, "Tuning");
    assert_eq!(bar.accesskit_node().numeric_value(), Some(25.0));
    harness.get_by_label("Cancel").click();
    assert_eq!(asked(&mut harness), [Action::StopTuning]);
    assert!(harness.query_by_label("Tune").is_some() && harness.query_by_label("Cancel").is_none());
}

#[test]
fn the_policy_is_chosen_by_name() {
    let mut harness = window();
    harness.get_by_label("Policy").click();
    harness.run_steps(3);
    harness.get_by_label("full").click();
    assert_eq!(asked(&mut harness), [Action::Policy("full".to_owned())]);
}

#[test]
fn help_lists_every_key_and_both_keys_open_and_close_it() {
    let mut harness = window();
    for key in [Key::F1, Key::Questionmark] {
        press(&mut harness, key);
        for shortcut in &SHORTCUTS {
            let keys = keys_text(&harness.ctx, shortcut.command);
            assert!(harness.query_all_by_label(&keys).next().is_some(), "{keys} is not shown");
            assert!(harness.query_all_by_label(shortcut.does).next().is_some(), "{} is not shown", shortcut.does);
        }
        for (hand, _) in MOUSE {
            assert!(harness.query_by_label(hand).is_some(), "{hand} is not shown");
        }
        press(&mut harness, key);
        assert!(harness.query_by_label("Keys and mouse").is_none());
    }
}

#[test]
fn every_agent_has_a_row_and_a_press_selects_it() {
    let mut harness = window();
    assert!(harness.query_by_label_contains("intestine, tube, 239 / 240 Hz").is_some());
    assert!(harness.query_by_label_contains("parked: the path left the world").is_some());
    harness.get_by_label_contains("stone, rigid").click();
    assert_eq!(asked(&mut harness), [Action::Select(Some(BALL))]);
    assert_eq!(press(&mut harness, Key::Escape), [Action::Select(None)]);
}

#[test]
fn a_drag_on_an_object_pulls_it_and_the_camera_stays() {
    let mut harness = window();
    let camera = last_view(&harness).camera;
    let at = middle(&harness);
    harness.drag_at(at);
    harness.run_steps(1);
    harness.hover_at(at + egui::vec2(60.0, 10.0));
    harness.run_steps(1);
    harness.hover_at(at + egui::vec2(120.0, 30.0));
    harness.run_steps(1);
    harness.drop_at(at + egui::vec2(120.0, 30.0));
    let asked = asked(&mut harness);
    assert!(matches!(asked[0], Action::Select(Some(BALL))), "{asked:?}");
    assert!(matches!(asked[1], Action::DragStart(Hit { object: BALL, .. })), "{asked:?}");
    let Some(Action::DragMove(target)) = asked.iter().rev().find(|a| matches!(a, Action::DragMove(_))) else {
        panic!("the hand never moved: {asked:?}");
    };
    assert!(target.dot(camera.right()) > 0.05, "{target} is not to the right");
    assert_eq!(asked.last(), Some(&Action::DragEnd));
    assert_eq!(last_view(&harness).camera, camera);
}

#[test]
fn a_drag_beside_objects_orbits_and_asks_for_nothing() {
    let mut harness = window();
    let camera = last_view(&harness).camera;
    let at = pos2(60.0, 90.0);
    harness.drag_at(at);
    harness.run_steps(1);
    harness.hover_at(at + egui::vec2(80.0, 0.0));
    harness.run_steps(1);
    harness.drop_at(at + egui::vec2(80.0, 0.0));
    assert_eq!(asked(&mut harness), []);
    let turned = last_view(&harness).camera;
    assert_ne!(turned.yaw_rad, camera.yaw_rad);
    assert_eq!(turned.target_m, camera.target_m);
}

#[test]
fn framing_brings_the_selected_object_near() {
    let mut harness = window();
    press(&mut harness, Key::F);
    let far = last_view(&harness).camera.distance_m;
    harness.get_by_label_contains("stone, rigid").click();
    asked(&mut harness);
    press(&mut harness, Key::F);
    let near = last_view(&harness).camera.distance_m;
    assert!((near * 10.0 - far).abs() < 1e-6 * far, "{near} m, {far} m"); // the balls are 0.1 m and 1 m
    press(&mut harness, Key::V);
    assert_eq!(last_view(&harness).camera, harness.state().simulation.scene_camera());
}

#[test]
fn hiding_the_panels_gives_the_picture_the_whole_window() {
    let mut harness = window();
    let whole = harness.state().inner;
    assert!(last_view(&harness).size.width < whole.width);
    press(&mut harness, Key::H);
    assert_eq!(last_view(&harness).size, whole);
    press(&mut harness, Key::H);
    assert!(harness.query_by_label("Pause").is_some());
}

#[test]
fn hidden_panels_come_back_by_a_button_and_colours_by_a_key() {
    let mut harness = window();
    assert!(harness.query_by_label("Show panels").is_none());
    press(&mut harness, Key::H);
    press(&mut harness, Key::C);
    harness.get_by_label("Show panels").click();
    asked(&mut harness);
    assert!(harness.query_by_label("Pause").is_some() && harness.query_by_label("Show panels").is_none());
    assert_ne!(harness.state().viewer.layout, metachron_viewer::ui::Layout::default(), "it is coloured by resolution");
    harness.key_press_modifiers(Modifiers::COMMAND, Key::H);
    asked(&mut harness);
    assert_eq!(harness.state().viewer.layout, metachron_viewer::ui::Layout::default());
}

#[test]
fn overlays_open_by_their_keys() {
    let mut harness = window();
    press(&mut harness, Key::F2);
    assert!(harness.query_by_label("Adapter").is_some());
    assert!(harness.query_by_label("no adapter").is_some());
    press(&mut harness, Key::F3);
    assert!(harness.query_by_label_contains("of a core in 3 agents").is_some());
    press(&mut harness, Key::F4);
    assert!(harness.query_by_label("Select an object to see its histories.").is_some());
    harness.get_by_label_contains("intestine, tube").click();
    asked(&mut harness);
    assert!(harness.query_by_label("ε, mm").is_some());
}

#[test]
fn the_palette_runs_the_command_that_was_typed() {
    let mut harness = window();
    harness.key_press_modifiers(Modifiers::COMMAND, Key::P);
    harness.run_steps(3);
    harness.get_by_label("Command").type_text("reset");
    harness.run_steps(2);
    assert_eq!(press(&mut harness, Key::Enter), [Action::Reset]);
    assert!(harness.query_by_label("Command").is_none());
}

#[test]
fn letters_typed_into_a_field_toggle_nothing() {
    let mut harness = window();
    harness.key_press_modifiers(Modifiers::COMMAND, Key::P);
    harness.run_steps(3);
    press(&mut harness, Key::W);
    assert_eq!(press(&mut harness, Key::Space), []);
    assert!(!last_view(&harness).style.wireframe);
}

#[test]
fn an_overloaded_scene_leaves_the_interface_alive() {
    let mut simulation = Fake::new();
    simulation.status.real_time_factor = 0.1;
    simulation.status.clamp = Some("rests on the coarsest resolution".to_owned());
    simulation
        .status
        .messages
        .push(Message { severity: Severity::Warning, text: "the scene needs more than it gets".to_owned() });
    let mut harness = window_of(simulation);
    for frame in 0..100 {
        let times = FrameTimes {
            work: Duration::from_millis(900),
            interval: Duration::from_millis(1000 + frame),
            ..FrameTimes::default()
        };
        harness.state_mut().viewer.measured(&times);
    }
    harness.run_steps(3);
    assert!(harness.query_by_label("rests on the coarsest resolution").is_some());
    assert!(harness.query_by_label("the scene needs more than it gets").is_some());
    // the newest second holds the last frame alone: 1.099 s
    assert!(harness.query_by_label("0.9 of 30 fps").is_some());
    harness.get_by_label("Pause").click();
    assert_eq!(asked(&mut harness), [Action::Pause]);
}

#[test]
fn thousands_of_agents_do_not_hold_the_interface_up() {
    let mut simulation = Fake::new();
    simulation.status.agents = (0..5000).map(|i| AgentRow::new(AgentId(i), format!("object {i}"), "rigid")).collect();
    let mut harness = window_of(simulation);
    harness.run_steps(3);
    let rows = harness.query_all_by_label_contains("object ").count();
    assert!((1..40).contains(&rows), "{rows} rows were laid out"); // only what fits into the table
}

#[test]
fn the_layout_comes_back_from_its_stored_form() {
    let mut harness = window();
    press(&mut harness, Key::H);
    press(&mut harness, Key::C);
    let layout = harness.state().viewer.layout;
    let stored = serde_json::to_string(&layout).unwrap();
    assert_eq!(serde_json::from_str::<metachron_viewer::ui::Layout>(&stored).unwrap(), layout);
    let older: metachron_viewer::ui::Layout = serde_json::from_str("{}").unwrap();
    assert!(older.panels);
}

#[test]
fn the_theme_changes_and_changes_back() {
    let mut harness = window();
    let before = harness.ctx.theme();
    for expected_same in [false, true] {
        harness.key_press_modifiers(Modifiers::COMMAND, Key::T);
        asked(&mut harness);
        assert_eq!(harness.ctx.theme() == before, expected_same);
    }
}

#[test]
fn a_narrow_window_keeps_every_digit_of_the_table() {
    let mut harness = window();
    harness.set_size(egui::vec2(640.0, 420.0));
    harness.run_steps(3);
    let row = harness.get_by_label_contains("intestine, tube").rect();
    assert!(row.width() > 900.0, "{} points", row.width()); // wider than the window: it scrolls
    harness.get_by_label("Pause").click();
    assert_eq!(asked(&mut harness), [Action::Pause]);
}

#[test]
fn the_timeline_goes_back_by_scrubber_button_and_key_and_returns() {
    let mut simulation = Fake::new();
    let at = |s: u64| SimTime::from_nanos(s * 1_000_000_000);
    simulation.status.rewind = Some(RewindStatus {
        oldest: at(2),
        newest: at(12),
        shown: None,
        moments: 600,
        bytes: 3 << 20,
        bytes_max: 128 << 20,
        cost_s: 1e-4,
        restores: true,
    });
    let mut harness = window_of(simulation);
    assert!(harness.query_by_label_contains("600 moments, 3.00 of 128 MiB").is_some());
    harness.get_by_label("Back").click();
    assert_eq!(asked(&mut harness), [Action::Look(Look::Back)]);
    assert_eq!(press(&mut harness, Key::ArrowLeft), [Action::Look(Look::Back)]);
    harness.get_by_role_and_label(egui::Role::Slider, "Moment").set_value_accesskit(7.0);
    assert_eq!(asked(&mut harness), [Action::Look(Look::At(at(7)))]);
    harness.state_mut().simulation.status.rewind.as_mut().unwrap().shown = Some(at(7));
    harness.run_steps(2);
    assert_eq!(press(&mut harness, Key::ArrowRight), [Action::Look(Look::Forward)]);
    harness.get_by_label("Live").click();
    assert_eq!(asked(&mut harness), [Action::Look(Look::Live)]);
    press(&mut harness, Key::F5);
    assert!(harness.query_by_label("Live").is_none());
}

#[test]
fn lanes_of_a_thousand_agents_are_laid_out_as_far_as_they_fit_and_tell_of_turns() {
    let mut simulation = Fake::new();
    simulation.status.agents = (0..1000).map(|i| AgentRow::new(AgentId(i), format!("box {i}"), "rigid")).collect();
    simulation.status.agents[1].leader = Some(AgentId(0));
    let mut harness = window_of(simulation);
    harness.run_steps(4);
    assert!(harness.state().simulation.asked_turns.is_empty(), "nothing is recorded for lanes that are not shown");
    press(&mut harness, Key::L);
    harness.run_steps(2);
    // a wait of 30 ms, and the step after it, which is a quarter of the lane
    let turn = |begun_s: f64, ended_s: f64| TurnRow {
        begun_s,
        ended_s,
        time: SimTime::from_nanos(7_250_000_000),
        dt_s: 4e-3,
        eps_m: Some(0.02),
        leader: AgentId(0),
        late_s: 9e-3,
        dropped_s: 0.0,
    };
    let turns = [TurnRow { dt_s: 0.0, ..turn(9.0, 9.03) }, turn(9.03, 9.53)];
    harness.state_mut().simulation.turns.insert(AgentId(1), turns.to_vec());
    harness.run_steps(8);
    let listened = harness.state().simulation.asked_turns.clone();
    let lanes = harness.query_all_by_label_contains("Lane of box ").count();
    assert!((2..40).contains(&lanes), "{lanes} lanes were laid out");
    assert!(listened.len() <= lanes, "{} agents were asked for {lanes} lanes", listened.len());
    let lane = harness.get_by_label("Lane of box 1").rect();
    harness.hover_at(lane.right_center() - egui::vec2(18.0, 0.0));
    harness.run_steps(60);
    let tooltip = harness.query_by_label_contains("begun at 9.0300 s").expect("a tooltip");
    let tooltip = tooltip.accesskit_node().label().or(tooltip.accesskit_node().value()).unwrap_or_default();
    let numbers =
        ["7.2500 s", "took 500 ms", "late 9.00 ms", "dt 4.00 ms", "waited 30.0 ms", "20.0 mm", "cluster of box 0"];
    assert!(numbers.iter().all(|what| tooltip.contains(what)), "{tooltip}");
    harness.get_by_label("Lane of box 1").click();
    assert_eq!(asked(&mut harness), [Action::Select(Some(AgentId(1)))]);
}

#[test]
fn forces_depths_and_cameras_are_chosen_by_key_and_by_label() {
    let mut simulation = Fake::new();
    simulation.status.cameras = vec!["side".to_owned(), "above".to_owned()];
    simulation.status.forces = Some(Forces { scale_m_per_n: 0.02, tools: Vec::new() });
    let mut harness = window_of(simulation);
    press(&mut harness, Key::N);
    assert!(last_view(&harness).style.forces);
    harness.get_by_label("Contact forces").click_accesskit();
    asked(&mut harness);
    assert!(!last_view(&harness).style.forces);
    press(&mut harness, Key::Z);
    assert_eq!(last_view(&harness).style.colouring, Colouring::Depth);
    press(&mut harness, Key::C);
    assert_eq!(last_view(&harness).style.colouring, Colouring::Resolution);
    assert_eq!(press(&mut harness, Key::V), [Action::Camera(1)]);
    harness.get_by_role_and_label(egui::Role::ComboBox, "Camera").click();
    harness.run_steps(3);
    harness.get_by_label("above").click();
    assert_eq!(asked(&mut harness), [Action::Camera(1)]);
}
