//! The window's way back, and objects that join, leave and change while it is open.

use super::super::*;
use super::{frame, plan, with_plan, with_simulation, with_tube};
use crate::ui::{AgentState, Look};
use glam::DVec3;
use metachron_render::Ray;
use metachron_world::Rigid;
use std::io::Write;

#[test]
fn a_run_that_is_put_back_goes_on_to_the_same_bits() {
    with_tube(|simulation| {
        let mut times = Vec::new();
        for _ in 0..30 {
            frame(simulation, None);
            times.push(simulation.session.sim_now());
        }
        let end = (simulation.session.world().hash(), simulation.session.sim_now(), simulation.session.frames());
        for look in [Look::At(times[12]), Look::Back, Look::Back, Look::Forward] {
            simulation.apply(Action::Look(look));
            (0..3).for_each(|_| frame(simulation, Some(Skip::Still)));
            let shown = simulation.status().rewind.unwrap().shown.unwrap();
            assert!(shown <= times[12], "{shown:?}");
            assert_eq!(simulation.session.sim_now(), shown, "the run stands there");
        }
        assert!(!simulation.status().running && simulation.session.world().hash() != end.0);
        simulation.apply(Action::Run);
        while simulation.session.frames() < end.2 {
            frame(simulation, None);
        }
        assert!(simulation.status().running && simulation.status().rewind.unwrap().shown.is_none());
        let again = (simulation.session.world().hash(), simulation.session.sim_now(), simulation.session.frames());
        assert_eq!(again, end);
        // an action in the past begins another run from there
        simulation.apply(Action::Look(Look::At(times[12])));
        simulation.apply(Action::TargetFps(17.0));
        assert!(simulation.session.rewind().unwrap().shown.is_none());
        simulation.apply(Action::Run);
        (0..5).for_each(|_| frame(simulation, None));
        assert_eq!(simulation.status().target_hz, 17.0);
        assert!(simulation.session.sim_now() > times[12]);
    });
}

#[test]
fn moments_stay_within_their_bound_of_memory() {
    with_simulation(|simulation| {
        (0..4).for_each(|_| frame(simulation, None));
        let one = simulation.session.rewind().unwrap().bytes;
        simulation.session.keep_moments(3 * one);
        for _ in 0..40 {
            frame(simulation, None);
            let Some(rewind) = simulation.session.rewind() else { continue };
            assert!(rewind.bytes <= rewind.bytes_max || rewind.moments == 1, "{rewind:?}");
        }
        let rewind = simulation.session.rewind().unwrap();
        assert!(rewind.oldest.as_secs_f64() > 0.1, "the oldest were given up: {rewind:?}");
    });
}

#[test]
fn in_real_time_the_world_runs_on_while_the_past_is_looked_at() {
    let mut plan = plan("pendulum");
    plan.overrides = vec![("executor".to_owned(), "\"pool\"".to_owned())];
    with_plan(plan, |simulation| {
        while simulation.session.rewind().is_none_or(|rewind| rewind.moments < 5) {
            frame(simulation, None);
        }
        simulation.apply(Action::Look(Look::Back));
        frame(simulation, None);
        let (shown, now) = (simulation.session.picture_time(), simulation.session.sim_now());
        assert_eq!(Some(shown), simulation.status().rewind.unwrap().shown);
        while simulation.session.sim_now() <= now {
            frame(simulation, None);
        }
        assert_eq!(simulation.session.picture_time(), shown);
        simulation.apply(Action::Look(Look::Live));
        frame(simulation, None);
        assert!(simulation.session.picture_time() > now && simulation.status().running);
    });
}

#[test]
fn an_object_that_joins_is_drawn_picked_and_listed_until_it_leaves() {
    with_simulation(|simulation| {
        (0..3).for_each(|_| frame(simulation, None));
        let world = simulation.session.world().clone();
        let (before, listed) = (simulation.session.picture().instances.len(), simulation.status().agents.len());
        let above = DVec3::new(0.0, 0.0, 7.0);
        let late = world.add("late", Rigid::ball(0.2).at(above.to_array()).gravity_scale(0.0)).unwrap();
        let ray = Ray { origin: above + 3.0 * DVec3::X, direction: -DVec3::X };
        let camera = Camera::looking(ray.origin, above, 0.8);
        let view = ViewRequest {
            size: metachron_render::Size { width: 640, height: 480 },
            camera,
            style: metachron_render::Style::default(),
        };
        let drawn = |simulation: &mut WindowSimulation<'_>| {
            for _ in 0..12 {
                simulation.compose(&view);
                simulation.measured(&FrameTimes::default());
            }
            simulation.session.picture().instances.len()
        };
        let with_it = drawn(simulation);
        assert_eq!(simulation.pick(ray).map(|hit| hit.object), Some(late.id()));
        let row = simulation.status().agents.last().unwrap();
        assert_eq!((row.name.as_str(), simulation.status().agents.len()), ("late", listed + 1));
        let there = simulation.session.rewind().unwrap().newest;
        world.remove(late).unwrap();
        let without_it = drawn(simulation);
        assert!(with_it > without_it, "{with_it} of {before} and it");
        assert_eq!(simulation.pick(ray), None);
        assert_eq!(simulation.status().agents.last().unwrap().state, AgentState::Gone);
        // the way back leads beyond joins and leaves, and on again
        let oldest = simulation.session.rewind().unwrap().oldest;
        for (look, is_there) in [(Look::At(there), true), (Look::At(oldest), false), (Look::At(there), true)] {
            simulation.apply(Action::Look(look));
            let instances = drawn(simulation);
            assert_eq!(instances, if is_there { with_it } else { without_it }, "{look:?}");
            assert_eq!((simulation.pick(ray).is_some(), world.latest(late).is_ok()), (is_there, is_there), "{look:?}");
        }
        simulation.apply(Action::Look(Look::Live));
        assert!(world.latest(late).is_err() && drawn(simulation) == without_it);
    });
}

#[test]
fn a_scene_file_that_changes_is_read_again_and_a_broken_one_leaves_the_old_scene_running() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.toml");
    let write = |text: &str| std::fs::File::create(&path).unwrap().write_all(text.as_bytes()).unwrap();
    let object = |name: &str| format!("[[object]]\nname = '{name}'\nmodel = 'rigid'\nshape = 'ball'\nradius_m = 0.1\n");
    let whole = format!("format = 1\nexecutor = 'lockstep'\n{}", object("one"));
    write(&whole);
    let source = Source::open(path.to_str().unwrap()).unwrap();
    with_plan(WindowPlan { source, overrides: Vec::new(), ..plan("pendulum") }, |simulation| {
        let look = |simulation: &mut WindowSimulation<'_>| {
            simulation.follow_files_every(Duration::ZERO);
            (0..3).for_each(|_| frame(simulation, None));
        };
        look(simulation);
        write(&format!("{whole}colour = "));
        look(simulation);
        let before = simulation.session.sim_now();
        look(simulation);
        let [message] = &simulation.status().messages[..] else { panic!("{:?}", simulation.status().messages) };
        assert!(message.severity == Severity::Failure && message.text.contains("line 8"), "{}", message.text);
        assert!(simulation.session.sim_now() > before, "the old one runs on");
        write(&format!("{whole}{}", object("other")));
        look(simulation);
        assert_eq!((simulation.status().agents.len(), simulation.status().messages.len()), (2, 0));
    });
}

#[test]
fn a_mesh_that_is_saved_is_read_again_and_one_that_was_wrong_once_it_is_right() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    // a tetrahedron with edges of this length along the axes: its volume is length³/6
    let mesh = |length: f64| {
        let corners = format!("v 0 0 0\nv {length} 0 0\nv 0 {length} 0\nv 0 0 {length}\n");
        corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    };
    let hull = |file: &str| {
        let object = "[[object]]\nname = 'one'\nmodel = 'rigid'\nshape = 'hull'\ndensity_kg_m3 = 600.0\n";
        format!("format = 1\nexecutor = 'lockstep'\n{object}file = '{file}'\n")
    };
    write("first.obj", &mesh(1.0));
    write("scene.toml", &hull("first.obj"));
    let source = Source::open(folder.path().join("scene.toml").to_str().unwrap()).unwrap();
    with_plan(WindowPlan { source, overrides: Vec::new(), ..plan("pendulum") }, |simulation| {
        let look = |simulation: &mut WindowSimulation<'_>| {
            simulation.follow_files_every(Duration::ZERO);
            (0..3).for_each(|_| frame(simulation, None));
            let metachron_world::Spec::Rigid(body) = &simulation.session.scene().agents[0].spec else { panic!() };
            (body.mass_kg, simulation.status().messages.clone())
        };
        let is = |seen: (f64, Vec<Message>), mass_kg: f64| {
            // corners are of single precision
            assert!((seen.0 / mass_kg - 1.0).abs() < 1e-6 && seen.1.is_empty(), "{seen:?}");
        };
        is(look(simulation), 100.0);
        write("first.obj", &mesh(2.5));
        is(look(simulation), 1562.5);
        // a mesh that the scene had not named before, and that is none yet
        write("second.obj", "v 0 0 0\n");
        write("scene.toml", &hull("second.obj"));
        let (mass_kg, messages) = look(simulation);
        assert!((mass_kg / 1562.5 - 1.0).abs() < 1e-6 && messages[0].text.contains("second.obj"), "{messages:?}");
        write("second.obj", &mesh(0.5));
        is(look(simulation), 12.5);
    });
}
