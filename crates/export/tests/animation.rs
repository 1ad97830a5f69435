//! Animated binary glTF, read by another reader: keys follow closed forms, shapes the surfaces that they show.

use glam::{DVec3, Vec3};
use gltf::animation::util::ReadOutputs;
use metachron_core::SimSpan;
use metachron_export::{GlbAnimation, Moment, MomentWriter, Moments, Surface};
use metachron_geometry::Solid;
use metachron_world::{Rigid, Scene, Tube, World, kinds::ExecutorKind};

const HEIGHT_M: f64 = 3.0;
const GRAVITY: f64 = 9.81;

/// A ball that falls, a box that rests, and a tube that sags between its ends.
fn scene() -> Scene {
    let ball = Rigid::ball(0.05).at([0.0, 0.0, HEIGHT_M]).rate_hz(1000.0);
    let at_rest = Rigid::cuboid([0.1; 3]).at([1.0, 0.0, 0.1]).kinematic();
    let tube = Tube::along(&[[-0.2, 1.0, 0.3], [0.2, 1.0, 0.3]]).radius_m(0.01).young_pa(1e5).clamp([true, true]);
    let parts = Scene::builder().fixed("floor", Solid::Plane).add("ball", ball).add("box", at_rest);
    parts.add("tube", tube).build().unwrap()
}

/// So many moments, 5 ms apart.
fn moments(count: usize) -> Vec<Moment> {
    let world = World::start(&scene(), ExecutorKind::Lockstep).unwrap();
    let mut moments = Moments::of(&world);
    let taken = (0..count).map(|_| {
        world.advance(SimSpan::from_millis(5));
        moments.take()
    });
    taken.collect()
}

fn written(moments: &[Moment]) -> gltf::Gltf {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.glb");
    let mut file = GlbAnimation::create(&path, &Surface::fixed(&scene())).unwrap();
    moments.iter().for_each(|moment| file.write(moment).unwrap());
    file.finish().unwrap();
    gltf::Gltf::open(&path).unwrap() // it validates the tables
}

/// The keys of a channel: times, and numbers in one row.
fn keys(file: &gltf::Gltf, node: usize, path: gltf::animation::Property) -> Option<(Vec<f32>, Vec<f32>)> {
    let data = file.blob.as_deref();
    let animation = file.animations().next()?;
    let mut channels = animation.channels();
    let channel = channels.find(|one| one.target().node().index() == node && one.target().property() == path)?;
    let reader = channel.reader(|_| data);
    let values = match reader.read_outputs()? {
        ReadOutputs::Translations(all) => all.flatten().collect(),
        ReadOutputs::Rotations(all) => all.into_f32().flatten().collect(),
        ReadOutputs::Scales(all) => all.flatten().collect(),
        ReadOutputs::MorphTargetWeights(all) => all.into_f32().collect(),
    };
    Some((reader.read_inputs()?.collect(), values))
}

fn nodes<'a>(file: &'a gltf::Gltf, name: &str) -> Vec<gltf::Node<'a>> {
    file.nodes().filter(|node| node.name() == Some(name)).collect()
}

#[test]
fn keys_of_a_falling_ball_follow_gravity() {
    let file = written(&moments(100));
    let ball = nodes(&file, "ball")[0].index();
    let (times, places) = keys(&file, ball, gltf::animation::Property::Translation).unwrap();
    assert_eq!((times.len(), places.len()), (100, 300));
    for (time, place) in times.iter().zip(places.chunks(3)) {
        let (t, fallen) = (f64::from(*time), HEIGHT_M - f64::from(place[2]));
        // its own time is at most a step behind the world's
        assert!((fallen - 0.5 * GRAVITY * t * t).abs() < 1.1e-3 * GRAVITY * t + 1e-6, "{fallen} m after {t} s");
    }
    let inputs = file.animations().next().unwrap().samplers().next().unwrap().input();
    let ends = [inputs.min().unwrap(), inputs.max().unwrap()].map(|end| end[0].as_f64().unwrap() as f32);
    assert_eq!(ends, [times[0], times[99]]);
    // a body that stays where it is has no keys
    let at_rest = nodes(&file, "box")[0].index();
    assert!(keys(&file, at_rest, gltf::animation::Property::Translation).is_none());
}

/// The points of the triangles that a file shows of an object at one of its keys, in our axes.
fn shown(file: &gltf::Gltf, name: &str, time_s: f32) -> Vec<DVec3> {
    let data = file.blob.clone().unwrap();
    let mut all = Vec::new();
    for node in nodes(file, name) {
        let scales = keys(file, node.index(), gltf::animation::Property::Scale);
        let is_shown = scales.is_none_or(|(times, scales)| {
            let at = times.iter().rposition(|time| *time <= time_s).unwrap();
            scales[3 * at] == 1.0
        });
        if !is_shown {
            continue;
        }
        let part = node.mesh().unwrap().primitives().next().unwrap();
        let reader = part.reader(|_| Some(&data));
        let mut points: Vec<_> = reader.read_positions().unwrap().map(Vec3::from).collect();
        if let Some((times, weights)) = keys(file, node.index(), gltf::animation::Property::MorphTargetWeights) {
            let targets = part.morph_targets().count();
            let at = times.iter().position(|time| *time == time_s).unwrap();
            for (weight, (moved, _, _)) in weights[at * targets..].iter().zip(reader.read_morph_targets()) {
                points.iter_mut().zip(moved.unwrap()).for_each(|(point, by)| *point += Vec3::from(by) * *weight);
            }
        }
        let (translation, rotation, _) = node.transform().decomposed();
        assert_eq!((translation, rotation), ([0.0; 3], [0.0, 0.0, 0.0, 1.0]), "what bends is in the axes of the world");
        let corners = reader.read_indices().unwrap().into_u32();
        all.extend(corners.map(|corner| points[corner as usize].as_dvec3()));
    }
    all
}

#[test]
fn a_tube_is_shown_once_and_where_it_was_at_every_key() {
    let moments = moments(150);
    let file = written(&moments);
    assert!(nodes(&file, "tube").len() > 1, "a node has 64 shapes beside its own");
    for moment in &moments {
        let surface = &moment.objects[2].surface;
        let shown = shown(&file, "tube", moment.time.as_secs_f64() as f32);
        assert_eq!(shown.len(), 3 * surface.triangles.len(), "{:?}", moment.time);
        for (shown, point) in shown.iter().zip(surface.triangles.iter().flatten()) {
            assert!(shown.distance(surface.points[*point as usize]) < 1e-6, "{shown} at {:?}", moment.time);
        }
    }
}

#[test]
fn an_object_that_leaves_and_comes_is_shown_while_it_is_there() {
    let mut moments = moments(6);
    for (k, moment) in moments.iter_mut().enumerate() {
        moment.objects.retain(|object| &*object.name != "ball" || (2..4).contains(&k));
    }
    let file = written(&moments);
    let ball = nodes(&file, "ball");
    assert_eq!((ball.len(), ball[0].transform().decomposed().2), (1, [0.0; 3]));
    let (times, scales) = keys(&file, ball[0].index(), gltf::animation::Property::Scale).unwrap();
    assert_eq!(times, [0, 2, 4].map(|k| moments[k].time.as_secs_f64() as f32));
    assert_eq!(scales.iter().step_by(3).copied().collect::<Vec<_>>(), [0.0, 1.0, 0.0]);
}

#[test]
fn an_animation_goes_forward_only() {
    let folder = tempfile::tempdir().unwrap();
    let moments = moments(3);
    let mut file = GlbAnimation::create(&folder.path().join("run.glb"), &Surface::default()).unwrap();
    [1, 1, 2].iter().for_each(|k| file.write(&moments[*k]).unwrap());
    let refused = file.write(&moments[0]).unwrap_err().to_string();
    assert!(refused.ends_with("a moment at 0.005 s came after one at 0.015 s"), "{refused}");
}
