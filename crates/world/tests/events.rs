//! Events between two looks at a world are reported all the same.

use glam::DVec3;
use metachron_core::SimSpan;
use metachron_geometry::{Obstacle, Solid};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Contact, EventFilter, Happening, Rigid, Scene, Touched, World, static_solid};

fn bouncing(restitution: f64) -> World {
    let ball = Rigid::ball(0.05).mass_kg(0.2).at([0.3, 0.0, 0.55]).restitution(restitution).rate_hz(240.0);
    // of the two coefficients the greater counts
    let floor = Obstacle { restitution: 0.0, ..static_solid("floor", Solid::Plane) };
    let scene = Scene::builder().obstacle(floor).add("ball", ball).build().unwrap();
    World::start(&scene, ExecutorKind::Lockstep).unwrap()
}

#[test]
fn every_bounce_is_told_when_it_happened() {
    let world = bouncing(0.5);
    let mut events = world.events(EventFilter::all());
    let ball = world.object("ball").unwrap();
    world.advance(SimSpan::from_millis(4000));
    let all: Vec<_> = events.drain().collect();
    assert_eq!(events.lost(), 0);
    let begins: Vec<_> = all
        .iter()
        .filter_map(|event| match event.what {
            Happening::Contact(contact) if contact.begins => Some((event.at.as_secs_f64(), contact)),
            _ => None,
        })
        .collect();
    // it falls for √(2 h/g), and each flight after is half as long as the one before: 2 e v/g
    let fall_s = (2.0 * 0.5 / 9.81_f64).sqrt();
    for (bounce, (at_s, Contact { with, point_m, normal, force_n, .. })) in begins.iter().enumerate().take(4) {
        let expected_s = fall_s + 2.0 * fall_s * (1.0 - 0.5_f64.powi(bounce as i32));
        assert!((at_s - expected_s).abs() < 2.0 / 240.0, "bounce {bounce} at {at_s}, expected at {expected_s}");
        assert_eq!(*with, Touched::Fixed(0));
        assert!((*point_m - DVec3::X * 0.3).length() < 0.02, "at {point_m}");
        assert_eq!(*normal, DVec3::Z);
        let v_m_s = 9.81 * fall_s * 0.5_f64.powi(bounce as i32);
        // the impulse m (1 + e) v, in the mean of a step
        let expected_n = 0.2 * 1.5 * v_m_s * 240.0;
        assert!((force_n.z - expected_n).abs() < 0.05 * expected_n, "bounce {bounce}: {force_n} N, not {expected_n}");
    }
    assert!(begins.len() >= 4);
    assert!(matches!(all.last().unwrap().what, Happening::Rests), "{:?}", all.last());
    assert!(all.iter().all(|event| event.object == ball));
    assert!(all.windows(2).all(|pair| pair[0].at <= pair[1].at));
    assert_eq!(events.drain().count(), 0, "each once");
}

#[test]
fn a_filter_keeps_what_it_was_asked_for() {
    let world = bouncing(0.0);
    // m v over a step of 1/240 s, as far as the first step bears it
    let loud = 0.5 * 0.2 * (2.0 * 9.81 * 0.5_f64).sqrt() * 240.0;
    let [mut loud_ones, mut contacts, mut states] =
        [EventFilter::contacts().above_n(loud), EventFilter::contacts(), EventFilter::states()]
            .map(|filter| world.events(filter));
    world.advance(SimSpan::from_millis(3000));
    let count = |events: &mut metachron_world::Events| events.drain().count();
    assert_eq!([count(&mut loud_ones), count(&mut contacts), count(&mut states)], [1, 1, 1]);
}

#[test]
fn two_that_meet_are_told_of_once() {
    let ball = |x: f64, v: f64| {
        Rigid::ball(0.05).at([x, 0.0, 0.0]).velocity_m_s([v, 0.0, 0.0]).restitution(1.0).rate_hz(100.0)
    };
    let scene = Scene::builder().gravity([0.0; 3]).add("a", ball(-0.2, 1.0)).add("b", ball(0.2, -1.0)).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let [a, b] = world.objects(["a", "b"]).unwrap();
    let mut of_b = world.events(EventFilter::contacts().of(b));
    world.advance(SimSpan::from_millis(1000));
    let told: Vec<_> = of_b.drain().collect();
    let [began, ended] = told.as_slice() else { panic!("{told:?}") };
    let (Happening::Contact(began), Happening::Contact(ended)) = (began.what, ended.what) else { panic!("{told:?}") };
    assert_eq!((told[0].object, began.with, began.begins, ended.begins), (a, Touched::Object(b), true, false));
    // 2 m v of 1 kg in a step of 10 ms, away from b
    assert!((began.force_n - DVec3::X * -200.0).length() < 1.0, "{}", began.force_n);
    assert!(began.normal.x < -0.999);
}

#[test]
fn an_event_is_a_sentence_with_the_names_of_both() {
    let world = bouncing(0.0);
    let mut events = world.events(EventFilter::all());
    world.advance(SimSpan::from_millis(3000));
    let all: Vec<_> = events.drain().collect();
    let names: Vec<_> = all.iter().map(|event| (&*event.name, event.what.name(), event.other.as_deref())).collect();
    assert_eq!(names, [("ball", "contact_began", Some("floor")), ("ball", "rests", None)]);
    let Happening::Contact(contact) = all[0].what else { panic!("{all:?}") };
    let (at_s, force_n) = (all[0].at.as_secs_f64(), contact.force_n.length());
    assert_eq!(all[0].to_string(), format!("{at_s} s: \"ball\" begins to touch \"floor\" with {force_n:.3} N"));
    assert_eq!(all[1].to_string(), format!("{} s: \"ball\" comes to rest", all[1].at.as_secs_f64()));
}
