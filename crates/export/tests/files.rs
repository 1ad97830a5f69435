//! Files of a short run are read back: places against closed forms, volumes against the solids', a file that was cut short.

use mcap::MessageStream;
use metachron_core::{Body, SimSpan};
use metachron_export::{ExportError, McapFile, Moment, MomentWriter, Moments, Surface, VtkSeries, write_glb};
use metachron_geometry::{Solid, Triangles, is_closed};
use metachron_scene::Source;
use metachron_world::{Rigid, Scene, Soft, Tube, World, kinds::ExecutorKind};
use serde_json::Value;
use std::f64::consts::PI;

const HEIGHT_M: f64 = 2.0;

fn scene() -> Scene {
    let ball = Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, HEIGHT_M]).rate_hz(1000.0);
    let tube = Tube::along(&[[-0.2, 1.0, 0.3], [0.2, 1.0, 0.3]]).radius_m(0.01).clamp([true, true]);
    Scene::builder().fixed("floor", Solid::Plane).add("ball", ball).add("tube", tube).build().unwrap()
}

/// Plays 2.5 s at 20 moments a second into files: the ball falls for 0.63 s of it.
fn export(into: &mut dyn MomentWriter) -> Vec<Moment> {
    let world = World::start(&scene(), ExecutorKind::Lockstep).unwrap();
    let mut moments = Moments::of(&world);
    let written = (0..50).map(|_| {
        world.advance(SimSpan::from_millis(50));
        let moment = moments.take();
        into.write(&moment).unwrap();
        moment
    });
    written.collect()
}

#[test]
fn surfaces_are_closed_and_hold_the_volume_of_the_solids() {
    let folder = tempfile::tempdir().unwrap();
    let moments = export(&mut VtkSeries::create(folder.path(), &scene()).unwrap());
    let volume = |k: usize| {
        let surface = &moments[0].objects[k].surface;
        let mesh = Triangles { points: surface.points.clone(), triangles: surface.triangles.clone() };
        (is_closed(&metachron_geometry::welded(&mesh)), mesh.volume_m3())
    };
    let (ball_closed, ball) = volume(0);
    let (tube_closed, tube) = volume(1);
    assert!(ball_closed && tube_closed);
    // inscribed: a ball of 432 triangles holds 96 % of the ball, a tube of 12 sides 95.5 % of the circle
    assert!((0.94..1.0).contains(&(ball / (4.0 / 3.0 * PI * 0.05_f64.powi(3)))), "{ball}");
    let circles = PI * 0.01_f64.powi(2) * 0.4 + 4.0 / 3.0 * PI * 0.01_f64.powi(3);
    assert!((0.93..1.0).contains(&(tube / circles)), "{tube} of {circles}");
}

#[test]
fn an_mcap_file_tells_where_the_ball_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut file = McapFile::create(&path, &Surface::fixed(&scene())).unwrap();
    export(&mut file);
    file.finish().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let messages: Vec<_> = MessageStream::new(&bytes).unwrap().map(|message| message.unwrap()).collect();
    let of = |topic: &str| messages.iter().filter(|message| message.channel.topic == topic).collect::<Vec<_>>();
    assert_eq!((of("/scene").len(), of("/tf").len()), (51, 50));
    for message in of("/tf").iter().take(12) {
        let t = message.log_time as f64 * 1e-9;
        let body: Value = serde_json::from_slice(&message.data).unwrap();
        let fallen = HEIGHT_M - body["translation"]["z"].as_f64().unwrap();
        // its own time is at most a step behind the world's
        assert!((fallen - 0.5 * 9.81 * t * t).abs() < 0.007, "{fallen} m after {t} s");
    }
    // a rigid body's triangles come once, a tube's at every moment
    let sent = |name: &str| {
        let scenes = of("/scene").into_iter().map(|message| serde_json::from_slice::<Value>(&message.data).unwrap());
        scenes.flat_map(|scene| scene["entities"].as_array().unwrap().clone()).filter(|one| one["id"] == name).count()
    };
    assert_eq!((sent("fixed"), sent("ball"), sent("tube")), (1, 1, 50));
    let state: Value = serde_json::from_slice(&of("/state")[0].data).unwrap();
    assert_eq!(state["name"], "ball");
    assert!(state["snapshot"]["body"]["Rigid"]["position"].is_array());
}

#[test]
fn what_bends_is_sent_once_while_it_stands_still_and_to_a_micrometre() {
    let scene = scene();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    world.advance(SimSpan::from_millis(50));
    let moment = Moments::of(&world).take();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut file = McapFile::create(&path, &Surface::fixed(&scene)).unwrap();
    (0..5).for_each(|_| file.write(&moment).unwrap());
    file.finish().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let scenes = MessageStream::new(&bytes).unwrap().map(Result::unwrap).filter(|one| one.channel.topic == "/scene");
    let scenes = scenes.map(|one| serde_json::from_slice::<Value>(&one.data).unwrap());
    let entities: Vec<_> = scenes.flat_map(|scene| scene["entities"].as_array().unwrap().clone()).collect();
    let tubes: Vec<_> = entities.iter().filter(|one| one["id"] == "tube").collect();
    assert_eq!(tubes.len(), 1);
    let points = tubes[0]["triangles"][0]["points"].as_array().unwrap();
    for (point, ours) in points.iter().zip(&moment.objects[1].surface.points) {
        let shown = ["x", "y", "z"].map(|axis| point[axis].as_f64().unwrap());
        assert!((glam::DVec3::from_array(shown) - *ours).abs().max_element() <= 0.5001e-6, "{shown:?}: {ours}");
        assert!(shown.iter().all(|x| x.to_string().len() <= 10), "{shown:?}");
    }
}

#[test]
fn an_mcap_file_that_was_cut_short_opens_up_to_its_last_second() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut file = McapFile::create(&path, &Surface::fixed(&scene())).unwrap();
    export(&mut file);
    std::mem::forget(file); // nothing is completed
    let bytes = std::fs::read(&path).unwrap();
    let options = mcap::read::Options::IgnoreEndMagic;
    let stream = MessageStream::new_with_options(&bytes, options.into()).unwrap();
    let last = stream.map_while(Result::ok).map(|message| message.log_time).max().unwrap();
    assert!(last as f64 * 1e-9 >= 1.5, "{last} ns of 2.5 s");
}

#[test]
fn a_vtk_series_lists_its_moments_and_holds_their_points() {
    let folder = tempfile::tempdir().unwrap();
    let mut series = VtkSeries::create(folder.path(), &scene()).unwrap();
    let moments = export(&mut series);
    series.finish().unwrap();
    let index = std::fs::read_to_string(folder.path().join("series.pvd")).unwrap();
    assert_eq!(index.matches("<DataSet").count(), moments.len());
    assert!(index.trim_end().ends_with("</VTKFile>"));
    let bytes = std::fs::read(folder.path().join("000049.vtu")).unwrap();
    // the first array is that of the points, after `_` and its length
    let head = bytes.windows(25).position(|window| window == b"<AppendedData encoding=\"r").unwrap();
    let start = head + bytes[head..].iter().position(|byte| *byte == b'_').unwrap() + 1;
    let number = |at: usize| <[u8; 8]>::try_from(&bytes[at..at + 8]).unwrap();
    let points: Vec<_> = moments[49].objects.iter().flat_map(|object| object.surface.points.clone()).collect();
    assert_eq!(u64::from_le_bytes(number(start)), 24 * points.len() as u64);
    for (k, point) in points.iter().flat_map(|p| p.to_array()).enumerate() {
        assert_eq!(f64::from_le_bytes(number(start + 8 + 8 * k)), point);
    }
    let Body::Rigid(ball) = &moments[49].objects[0].state.body else { panic!("a ball is rigid") };
    assert!((ball.position.z - 0.05).abs() < 1e-3);
    assert_eq!(
        std::fs::read_to_string(folder.path().join("objects.csv")).unwrap(),
        "object,name\n0,\"ball\"\n1,\"tube\"\n"
    );
    // whatever it would overwrite is asked for, not the index alone
    for name in VtkSeries::FILES {
        std::fs::remove_file(folder.path().join(name)).unwrap();
    }
    let taken = VtkSeries::create(folder.path(), &scene()).err();
    assert!(matches!(&taken, Some(ExportError::Taken { path }) if path.extension().unwrap() == "vtu"), "{taken:?}");
    let plain = folder.path().join("other");
    std::fs::create_dir(&plain).unwrap();
    std::fs::write(plain.join("tissue.vtu"), "a mesh").unwrap();
    VtkSeries::check(&plain).unwrap();
    std::fs::write(plain.join("fixed.vtu"), "a mesh").unwrap();
    let said = VtkSeries::check(&plain).unwrap_err().to_string();
    assert!(said.contains("fixed.vtu") && !said.contains("series.pvd"), "{said}");
}

#[test]
fn objects_called_as_ours_are_have_frames_of_their_own() {
    let ball = |x: f64| Rigid::ball(0.05).at([x, 0.0, 1.0]);
    let parts = Scene::builder().fixed("floor", Solid::Plane).add("fixed", ball(0.0)).add("fixed_", ball(1.0));
    let world = World::start(&parts.add("world", ball(2.0)).build().unwrap(), ExecutorKind::Lockstep).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut file = McapFile::create(&path, &Surface::fixed(&scene())).unwrap();
    file.write(&Moments::of(&world).take()).unwrap();
    file.finish().unwrap();
    let (mut frames, mut entities) = (Vec::new(), Vec::new());
    for message in MessageStream::new(&std::fs::read(&path).unwrap()).unwrap().map(Result::unwrap) {
        let body: Value = serde_json::from_slice(&message.data).unwrap();
        let text = |value: &Value| value.as_str().unwrap().to_owned();
        match message.channel.topic.as_str() {
            "/tf" => frames.push(text(&body["child_frame_id"])),
            "/scene" => entities.extend(body["entities"].as_array().unwrap().iter().map(|one| text(&one["id"]))),
            _ => {}
        }
    }
    assert_eq!(frames, ["fixed_", "fixed__", "world_"]);
    assert_eq!(entities, ["fixed", "fixed_", "fixed__", "world_"]);
}

/// A moment of a scene with everything that has a surface, the ball above the floor.
fn moment_of_all() -> (Moment, Surface) {
    let sheet = Soft::sheet([0.2, 0.1], 0.002, [4, 2]).at([0.0, -1.0, 0.5]);
    let box_ = Rigid::cuboid([0.1, 0.2, 0.3]).at([1.0, 0.0, 1.0]).turned(glam::DQuat::from_rotation_x(0.4));
    let ball = Rigid::ball(0.05).at([0.0, 0.0, HEIGHT_M]);
    let tube = Tube::along(&[[-0.2, 1.0, 0.3], [0.2, 1.0, 0.3]]).radius_m(0.01).clamp([true, true]);
    let parts = Scene::builder().fixed("floor", Solid::Plane).add("ball", ball).add("box", box_);
    let scene = parts.add("tube", tube).add("sheet", sheet).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    world.advance(SimSpan::from_millis(100));
    (Moments::of(&world).take(), Surface::fixed(&scene))
}

fn area_m2(mesh: &Triangles) -> f64 {
    let corners = mesh.triangles.iter().map(|t| t.map(|p| mesh.points[p as usize]));
    corners.map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
}

/// All surfaces of a moment as one.
fn joined<'a>(surfaces: impl Iterator<Item = &'a Surface>) -> Triangles {
    let mut all = Triangles { points: vec![], triangles: vec![] };
    for surface in surfaces {
        let first = all.points.len() as u32;
        all.points.extend(&surface.points);
        all.triangles.extend(surface.triangles.iter().map(|t| t.map(|p| p + first)));
    }
    all
}

#[test]
fn a_glb_file_has_what_another_reader_finds_where_it_was() {
    let (moment, fixed) = moment_of_all();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("moment.glb");
    write_glb(&path, &moment, &fixed).unwrap();
    let file = gltf::Gltf::open(&path).unwrap(); // it validates the tables
    let data = file.blob.clone().unwrap();
    let root = file.scenes().next().unwrap().nodes().next().unwrap();
    assert_eq!(file.nodes().len(), 6);
    for (node, (name, surface)) in root
        .children()
        .zip([("fixed", &fixed)].into_iter().chain(moment.objects.iter().map(|one| (&*one.name, &one.surface))))
    {
        assert_eq!(node.name(), Some(name));
        let upright = glam::DMat4::from_cols_array_2d(&root.transform().matrix().map(|c| c.map(f64::from)));
        let place = upright * glam::DMat4::from_cols_array_2d(&node.transform().matrix().map(|c| c.map(f64::from)));
        let part = node.mesh().unwrap().primitives().next().unwrap();
        let reader = part.reader(|_| Some(&data));
        let points: Vec<_> = reader.read_positions().unwrap().map(|p| glam::Vec3::from(p).as_dvec3()).collect();
        let normals: Vec<_> = reader.read_normals().unwrap().map(|n| glam::Vec3::from(n).as_dvec3()).collect();
        let indices: Vec<_> = reader.read_indices().unwrap().into_u32().collect();
        assert_eq!(indices.len(), 3 * surface.triangles.len(), "{name}");
        for (corner, point) in indices.iter().zip(surface.triangles.iter().flatten()) {
            let at = place.transform_point3(points[*corner as usize]);
            let ours = surface.points[*point as usize];
            assert!(at.distance(glam::DVec3::new(ours.x, ours.z, -ours.y)) < 1e-6, "{name}: {at} {ours}");
        }
        for triangle in indices.chunks(3) {
            let [a, b, c] = [0, 1, 2].map(|k| points[triangle[k] as usize]);
            let side = (b - a).cross(c - a).normalize();
            let least = triangle.iter().map(|p| normals[*p as usize].dot(side)).fold(1.0, f64::min);
            assert!(least > 0.6, "{name}: a normal and its triangle, cosine {least}");
        }
        assert!(normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-6));
        let [r, g, b, _] = part.material().pbr_metallic_roughness().base_color_factor();
        assert!([r, g, b].iter().all(|part| (0.05..0.9).contains(part)));
    }
}

#[test]
fn a_glb_file_read_as_a_mesh_has_the_same_triangles() {
    let (moment, fixed) = moment_of_all();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("moment.glb");
    write_glb(&path, &moment, &fixed).unwrap();
    let read = Source::mesh(&path, 1.0).unwrap();
    let ours = joined([&fixed].into_iter().chain(moment.objects.iter().map(|object| &object.surface)));
    assert_eq!(read.triangles.len(), ours.triangles.len());
    assert!((area_m2(&read) / area_m2(&ours) - 1.0).abs() < 1e-6);
    let bounds = |mesh: &Triangles| {
        let low = mesh.points.iter().copied().reduce(glam::DVec3::min).unwrap();
        (low, mesh.points.iter().copied().reduce(glam::DVec3::max).unwrap())
    };
    let ((low, high), (our_low, our_high)) = (bounds(&read), bounds(&ours));
    assert!(low.distance(our_low) < 1e-6 && high.distance(our_high) < 1e-6, "{low} {high}: {our_low} {our_high}");
}

#[test]
fn a_glb_file_of_nothing_is_one() {
    let scene = Scene::builder().build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let bytes = metachron_export::glb(&Moments::of(&world).take(), &Surface::fixed(&scene)).unwrap();
    assert_eq!(gltf::Gltf::from_slice(&bytes).unwrap().nodes().len(), 1);
}
