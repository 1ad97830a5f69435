//! Shapes that become files beside the scene, and masses that follow from them.

use crate::play::{advance, body, left_out, read_from, scene, start};
use glam::{DMat3, DVec3};
use metachron_import::{Folders, Imported, Options, model};
use metachron_models::rigid::GivenInertia;
use std::f64::consts::PI;
use std::path::Path;

fn import(text: &str) -> Imported {
    model(text, Path::new("."), &Options::default()).unwrap()
}

/// The corners of a box of these half edges about a point.
fn corners(half: DVec3, at: DVec3) -> Vec<DVec3> {
    let sign = |i: i32, bit: i32| f64::from((i >> bit & 1) * 2 - 1);
    (0..8).map(|i| at + half * DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect()
}

/// The faces of that box as triangles, outward.
const FACES: [[u32; 3]; 12] = [
    [0, 2, 1],
    [1, 2, 3],
    [4, 5, 6],
    [5, 7, 6],
    [0, 1, 4],
    [1, 5, 4],
    [2, 6, 3],
    [3, 6, 7],
    [0, 4, 2],
    [2, 4, 6],
    [1, 3, 5],
    [3, 7, 5],
];

/// Moments of a box of this mass and these half edges.
fn box_moments(mass_kg: f64, half: DVec3) -> DVec3 {
    let square = half * half;
    mass_kg / 3.0 * (DVec3::splat(square.element_sum()) - square)
}

fn assert_inertia(given: Option<GivenInertia>, com_m: DVec3, moments: DVec3, within: f64) {
    let GivenInertia { com_m: com, about_com_kg_m2: tensor } = given.unwrap();
    assert!(com.distance(com_m) < within, "{com} is not {com_m}");
    let off = (tensor - DMat3::from_diagonal(moments)).to_cols_array().into_iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    assert!(off < within * moments.max_element(), "{tensor} is not {moments}");
}

/// A box of points as a binary file of MuJoCo.
fn msh(points: &[DVec3]) -> Vec<u8> {
    let counts = [points.len() as i32, 1, 1, 12].into_iter().flat_map(i32::to_le_bytes);
    let numbers = points.iter().flat_map(|point| point.to_array()).chain([0.0; 5]);
    let numbers = numbers.flat_map(|x| (x as f32).to_le_bytes());
    counts.chain(numbers).chain(FACES.iter().flatten().flat_map(|corner| corner.to_le_bytes())).collect()
}

#[test]
fn a_free_body_whose_mass_is_an_ellipsoid_has_its_mass_and_falls() {
    let imported = import(
        r#"<mujoco><worldbody><body name="egg"><freejoint/><geom type="ellipsoid" size="0.1 0.2 0.3" density="500"/>
        <geom name="eye" size="0.01" mass="0"/></body></worldbody></mujoco>"#,
    );
    assert_eq!(left_out(&imported), [""; 0]);
    let scene = scene(&imported, &[], 500.0);
    let egg = body(&scene, "egg");
    let mass_kg = 500.0 * 4.0 / 3.0 * PI * 0.006;
    assert!((egg.mass_kg - mass_kg).abs() < 1e-9 * mass_kg);
    let square = DVec3::new(0.01, 0.04, 0.09);
    assert_inertia(egg.inertia, DVec3::ZERO, mass_kg / 5.0 * (DVec3::splat(0.14) - square), 1e-9);
    let world = start(&imported, &[], 500.0);
    advance(&world, 1.0);
    let metachron_core::Body::Rigid(state) = &world.latest(world.object("egg").unwrap()).unwrap().body.clone() else {
        panic!("a rigid body")
    };
    assert!((state.position.z + 9.81 / 2.0).abs() < 0.02, "{}", state.position); // g h/2 of steps of first order
}

#[test]
fn the_hull_of_an_ellipsoid_is_within_four_thousandths_of_it() {
    let imported = import(
        r#"<mujoco><worldbody><geom type="ellipsoid" size="0.1 0.2 0.3"/><geom type="ellipsoid" size="0.1 0.2 0.3"/>
        </worldbody></mujoco>"#,
    );
    let [file] = imported.files.as_slice() else { panic!("{:?}", imported.files) };
    let hull = metachron_scene::read_surface(&file.bytes).unwrap();
    let axes = DVec3::new(0.1, 0.2, 0.3);
    assert!(hull.points.iter().all(|point| ((*point / axes).length() - 1.0).abs() < 1e-6));
    let middles = hull.triangles.iter().map(|t| t.iter().map(|i| hull.points[*i as usize]).sum::<DVec3>() / 3.0);
    let least = middles.map(|middle| (middle / axes).length()).fold(1.0, f64::min);
    assert!(least > 0.996, "{least}");
    for (axis, far) in [(DVec3::X, 0.1), (DVec3::Y, 0.2), (DVec3::Z, 0.3)] {
        let reach = hull.points.iter().map(|point| point.dot(axis)).fold(0.0, f64::max);
        assert!((reach - far).abs() < 1e-6);
    }
}

#[test]
fn a_body_that_moves_freely_without_a_mass_is_refused_and_lent_some_where_it_carries_one() {
    let text =
        |inside: &str| format!("<mujoco><worldbody><body name=\"a\"><freejoint/>{inside}</body></worldbody></mujoco>");
    let error = model(&text("<site/>"), Path::new("."), &Options::default()).unwrap_err().to_string();
    assert_eq!(error, "line 1: body `a`: has no mass, and moves freely; expected a mass above zero");
    let carried = import(&text(r#"<body name="b"><geom size="0.1" mass="2"/></body>"#));
    assert!((body(&scene(&carried, &[], 500.0), "a").mass_kg - 0.002).abs() < 1e-12);
    assert_eq!(scene(&carried, &[], 500.0).joints.len(), 1);
}

#[test]
fn meshes_of_msh_and_collada_and_mirrored_ones_become_hulls_of_the_same_points() {
    let folder = tempfile::tempdir().unwrap();
    let (half, at) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(1.0, 2.0, 3.0));
    std::fs::write(folder.path().join("a.msh"), msh(&corners(half, at))).unwrap();
    let list = |points: &[DVec3]| points.iter().map(|p| format!("{} {} {} ", p.x, p.y, p.z)).collect::<String>();
    // millimetres, in a node that turns z to -y and then moves
    let own = corners(half * 1000.0, DVec3::ZERO).into_iter().map(|p| DVec3::new(p.x, -p.z, p.y));
    let dae = format!(
        r##"<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"><asset><unit meter="0.001"/></asset>
        <library_geometries><geometry id="g"><mesh><source id="s"><float_array id="f" count="24">{}</float_array>
        <technique_common><accessor source="#f" count="8" stride="3"/></technique_common></source>
        <vertices id="v"><input semantic="POSITION" source="#s"/></vertices></mesh></geometry></library_geometries>
        <library_visual_scenes><visual_scene id="w"><node><translate>1000 2000 3000</translate>
        <node><rotate>1 0 0 90</rotate><instance_geometry url="#g"/></node></node></visual_scene>
        </library_visual_scenes></COLLADA>"##,
        list(&own.collect::<Vec<_>>())
    );
    std::fs::write(folder.path().join("b.DAE"), dae).unwrap();
    let triangle = |corners: &[u32; 3]| format!("f {} {} {}\n", corners[0] + 1, corners[1] + 1, corners[2] + 1);
    let vertices = corners(half, at * DVec3::new(1.0, -1.0, 1.0))
        .iter()
        .map(|p| format!("v {} {} {}\n", p.x, p.y, p.z))
        .collect::<String>();
    std::fs::write(folder.path().join("c.obj"), vertices + &FACES.iter().map(triangle).collect::<String>()).unwrap();
    for (mesh, scale) in [("a.msh", "1 1 1"), ("b.DAE", "1 1 1"), ("c.obj", "1 -1 1")] {
        let robot = format!(
            r#"<robot name="r"><link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
            <collision><geometry><mesh filename="{mesh}" scale="{scale}"/></geometry></collision></link></robot>"#
        );
        let imported = model(&robot, read_from(folder.path()), &Options::default()).unwrap();
        assert_eq!(left_out(&imported), [""; 0], "{mesh}");
        let metachron_geometry::Solid::Hull { points_m } = body(&scene(&imported, &[], 500.0), "a").solid else {
            panic!("a hull")
        };
        for corner in corners(half, at) {
            // points of hulls are in single precision
            assert!(points_m.iter().any(|point| point.distance(corner) < 1e-5), "{mesh}: {corner} in {points_m:?}");
        }
        assert_eq!(points_m.len(), 8, "{mesh}");
    }
    // a node that names itself
    let looped = r##"<COLLADA><visual_scene><node id="n"><instance_node url="#n"/><instance_node url="#n"/></node>
        </visual_scene></COLLADA>"##;
    std::fs::write(folder.path().join("d.dae"), looped).unwrap();
    let robot =
        r#"<mujoco><asset><mesh file="d.dae"/></asset><worldbody><geom type="mesh" mesh="d"/></worldbody></mujoco>"#;
    let noted = model(robot, read_from(folder.path()), &Options::default()).unwrap();
    assert!(left_out(&noted)[0].ends_with("`d.dae`: its nodes are too many or nested too deeply"), "{noted:?}");
    std::fs::write(folder.path().join("a.msh"), &msh(&corners(half, at))[..40]).unwrap();
    let robot =
        r#"<mujoco><asset><mesh file="a.msh"/></asset><worldbody><geom type="mesh" mesh="a"/></worldbody></mujoco>"#;
    let noted = model(robot, read_from(folder.path()), &Options::default()).unwrap();
    assert_eq!(
        left_out(&noted),
        ["line 1: worldbody, geom: is left out: `a.msh`: its counts make 276 bytes, and it has 40"]
    );
}

#[test]
fn geoms_that_touch_nothing_and_meshes_weigh_as_in_mujoco() {
    let folder = tempfile::tempdir().unwrap();
    let half = DVec3::new(0.1, 0.2, 0.3);
    std::fs::write(folder.path().join("brick.msh"), msh(&corners(half, DVec3::ZERO))).unwrap();
    // a brick of 24 kg that is only seen above a box of the same size and mass: together one of twice the height
    let text = r#"<mujoco><asset><mesh file="brick.msh"/></asset><worldbody><body name="a"><freejoint/>
        <geom type="mesh" mesh="brick" mass="24" pos="0 0 0.3" contype="0" conaffinity="0"/>
        <geom type="box" size="0.1 0.2 0.3" pos="0 0 -0.3" density="500"/></body></worldbody></mujoco>"#;
    let imported = model(text, read_from(folder.path()), &Options::default()).unwrap();
    let found = body(&scene(&imported, &[], 500.0), "a");
    assert!((found.mass_kg - 48.0).abs() < 1e-9);
    let tall = DVec3::new(0.1, 0.2, 0.6);
    assert_inertia(found.inertia, DVec3::ZERO, box_moments(48.0, tall), 1e-6); // points in single precision
    assert!(matches!(found.solid, metachron_geometry::Solid::Compound { parts } if parts.len() == 1));
}

#[test]
fn all_bodies_together_weigh_what_the_compiler_says() {
    // 3 : 1, and a post that never moves as heavy as both: mj_setTotalmass scales all but the world's own
    let text = r#"<mujoco><compiler settotalmass="16"/><worldbody><geom size="1" mass="100"/>
        <body><geom size="0.1" mass="4"/></body>
        <body name="a"><freejoint/><geom size="0.1" mass="3"/></body>
        <body name="b"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"#;
    let scene = scene(&import(text), &[], 500.0);
    assert!((body(&scene, "a").mass_kg - 6.0).abs() < 1e-9);
    let b = body(&scene, "b");
    assert!((b.mass_kg - 2.0).abs() < 1e-12);
    assert_inertia(b.inertia, DVec3::ZERO, DVec3::splat(2.0), 1e-12);
}

#[test]
fn copied_meshes_move_with_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    for place in ["left", "right"] {
        std::fs::create_dir(folder.path().join(place)).unwrap();
        let side = if place == "left" { -1.0 } else { 1.0 };
        let vertices = corners(DVec3::ONE, DVec3::X * side).into_iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z));
        std::fs::write(folder.path().join(place).join("a.obj"), vertices.collect::<String>()).unwrap();
    }
    let text = r#"<mujoco><asset><mesh name="l" file="left/a.obj"/><mesh name="r" file="right/a.obj"/></asset>
        <worldbody><geom type="mesh" mesh="l"/><geom type="mesh" mesh="r"/><geom type="mesh" mesh="l"/></worldbody></mujoco>"#;
    let options = Options { copy_meshes: true, meshes: Some("robot-meshes"), ..Options::default() };
    let folders = Folders { scene: Path::new("elsewhere"), ..read_from(folder.path()) };
    let imported = model(text, folders, &options).unwrap();
    let paths: Vec<&str> = imported.files.iter().map(|file| file.path.as_str()).collect();
    assert_eq!(paths, ["robot-meshes/a.obj", "robot-meshes/a-2.obj"]);
    assert_eq!(imported.files[1].bytes, std::fs::read(folder.path().join("right/a.obj")).unwrap());
    assert_eq!(imported.toml.matches("file = \"robot-meshes/a.obj\"").count(), 2);
    assert_eq!(scene(&imported, &[], 500.0).obstacles.len(), 3);
}
