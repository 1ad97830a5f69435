//! Files of a short run are read back: places against closed forms, volumes against the solids', a file that was cut short.

use mcap::MessageStream;
use metachron_core::{Body, SimSpan};
use metachron_export::{ExportError, McapFile, Moment, MomentWriter, Moments, Surface, VtkSeries};
use metachron_geometry::{Solid, Triangles, is_closed};
use metachron_world::{Rigid, Scene, Tube, World, kinds::ExecutorKind};
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
    let mut moments = Moments::default();
    let written = (0..50).map(|_| {
        world.advance(SimSpan::from_millis(50));
        let moment = moments.take(&world);
        into.write(&moment).unwrap();
        moment
    });
    written.collect()
}

#[test]
fn surfaces_are_closed_and_hold_the_volume_of_the_solids() {
    let folder = tempfile::tempdir().unwrap();
    let moments = export(&mut VtkSeries::create(folder.path(), &Surface::fixed(&scene())).unwrap());
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
    let fixed = Surface::fixed(&scene());
    let mut series = VtkSeries::create(folder.path(), &fixed).unwrap();
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
    assert!(matches!(VtkSeries::create(folder.path(), &fixed), Err(ExportError::Taken { .. })));
}
