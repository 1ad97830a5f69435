//! Sheets, solids and ropes as users write them: the scenes that load, the text of errors, and the motion in these
//! scenes.

use crate::play::{Folder, agent, lockstep, number, point};
use metachron_drawable::{Generator, generate_surface};
use metachron_geometry::Triangles;
use metachron_models::soft::Side;
use metachron_models::soft::SoftShape;
use metachron_scene::{SceneError, Source, load};
use metachron_world::{Scene, Spec};

fn read(text: &str) -> Result<Scene, SceneError> {
    load(&Source::memory("test.toml", format!("format = 1\n{text}").as_bytes())?, &[])
}

const SHEET: &str = "name = \"s\"\nmodel = \"sheet\"\nsize_m = [0.2, 0.1]\nsegments = [4, 2]\nthickness_m = 0.001\n";
const SOLID: &str = "name = \"s\"\nmodel = \"solid\"\nyoung_pa = 1e4\nsegments = [2, 2, 2]\n";
const ROPE: &str = "name = \"s\"\nmodel = \"rope\"\nyoung_pa = 1e6\nradius_m = 0.002\nsegments = 10\n";

/// The line counted from the object's first, and the message of the only problem.
fn refusal(object: &str) -> (usize, String) {
    let error = read(&format!("[[object]]\n{object}\n")).expect_err(object);
    assert_eq!(error.problems.len(), 1, "{object}: {:#?}", error.problems);
    let p = &error.problems[0];
    (p.line - 2, format!("{}; {}", p.message, p.expected))
}

#[test]
fn a_sheet_stands_about_its_middle_and_is_held_by_its_sides() {
    let text = "young_pa = 1e5\nposition_m = [1, 0, 0]\nrotation_deg = [90, 0, 0]\nhold = [\"far\", \"left\"]";
    let scene = read(&format!("[[object]]\n{SHEET}{text}\n")).unwrap();
    let Spec::Soft(spec) = &scene.agents[0].spec else { panic!("a soft body") };
    assert_eq!(spec.held, [Side::Far, Side::Left]);
    assert!((spec.position - glam::DVec3::new(0.9, 0.0, -0.05)).length() < 1e-12, "{}", spec.position);
    assert!(matches!(spec.shape, SoftShape::Sheet { segments: [4, 2], .. }));
}

#[test]
fn what_a_soft_body_cannot_be_is_told_with_its_line_and_limit() {
    for (object, line, words) in [
        (format!("{SHEET}young_pa = 0"), 6, "`young_pa` of `s` is 0; expected a number from 1 to 100000000000 Pa"),
        (
            format!("{SHEET}young_pa = 1e5\npoisson = 0.5"),
            7,
            "`poisson` of `s` is 0.5; expected a number from 0 to 0.499",
        ),
        (format!("{SOLID}shape = \"box\""), 1, "`size_m` of `s` is missing; a box needs it"),
        (format!("{SOLID}shape = \"ball\"\nradius_m = 0.1\nhold = [\"top\"]"), 7, "a ball does not have"),
        (
            format!("{SHEET}young_pa = 1e5\nhold = [\"left\", \"top\"]"),
            7,
            "`hold` of `s` names `top`, which a flat sheet does not have; expected `left`, `right`, `near` or `far`",
        ),
        (format!("{ROPE}path_m = [[0, 0, 0]]"), 6, "`path_m` of `s` has 1 points; expected at least 2"),
        (
            format!("{ROPE}path_m = [[0, 0, 0], [0, 0, 0]]"),
            1,
            "cannot be built: the path of a rope needs at least two different points",
        ),
    ] {
        let (at, said) = refusal(&object);
        assert!(said.contains(words), "{words:?} is not said: {said}");
        assert!(at == line || line == 1, "line {at} of {object}");
    }
}

#[test]
fn a_sheet_or_a_rope_with_an_eps_has_the_lattice_of_its_finest_as_its_skin() {
    let sheet = SHEET.replace("segments = [4, 2]", "eps_m = [0.01, 0.05]");
    let rope = ROPE.replace("segments = 10", "eps_m = 0.03").replace("\"s\"", "\"r\"");
    let scene =
        read(&format!("[[object]]\n{sheet}young_pa = 1e5\n[[object]]\n{rope}path_m = [[0, 0, 1], [0.1, 0, 1]]\n"))
            .unwrap();
    let [Spec::Soft(sheet), Spec::Soft(rope)] = [&scene.agents[0].spec, &scene.agents[1].spec] else { panic!() };
    assert!(matches!(sheet.shape, SoftShape::Sheet { segments: [20, 10], .. }), "{:?}", sheet.shape);
    assert!(matches!(rope.shape, SoftShape::Rope { segments: 4, .. }), "{:?}", rope.shape);
    assert_eq!(sheet.spacing().unwrap().range_m, (0.01, 0.05));
    assert_eq!(scene.agents[0].simulation.eps_m, (0.01, 0.05));
    assert_eq!(rope.spacing().unwrap().range_m, (0.03, 0.03));
}

#[test]
fn an_eps_that_a_sheet_or_a_rope_cannot_have_is_told_with_its_line() {
    let sheet = |key: &str| format!("{}young_pa = 1e5", SHEET.replace("segments = [4, 2]", key));
    let rope = |key: &str| format!("{}path_m = [[0, 0, 0], [1, 0, 0]]", ROPE.replace("segments = 10", key));
    for (object, line, words) in [
        (sheet("eps_m = 0.01\nsegments = [4, 2]"), 5, "`segments` of `s` contradicts `eps_m`; expected one of them"),
        (sheet(""), 1, "`segments` of `s` is missing; expected `segments` or `eps_m`"),
        (sheet("eps_m = [0.0005, 0.05]"), 4, "`eps_m` of `s` is too fine for its size; expected a larger finest ε"),
        (sheet("eps_m = [0.05, 0.01]"), 4, "`eps_m` of `s` runs from 0.05 down to 0.01"),
        (sheet("eps_m = -1"), 4, "`eps_m` of `s` is -1"),
        (rope("eps_m = 0.0004"), 5, "at most 10000 vertices, 2047 cells along an axis"),
        (rope("eps_m = 0.1\nsegments = 10"), 6, "`segments` of `s` contradicts `eps_m`"),
    ] {
        let (at, said) = refusal(&object);
        assert!(said.contains(words), "{words:?} is not said: {said}");
        assert!(at == line || line == 1, "line {at} of {object}");
    }
}

#[test]
fn a_coupling_by_a_law_that_soft_bodies_do_not_know_is_refused() {
    let ball =
        "[[object]]\nname = \"b\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nposition_m = [0, 0, 1]\n";
    let couple = "[[coupling]]\na = \"s\"\nb = \"b\"\nlaw = \"tlm\"\nstiffness_n_m = 10\n";
    let error = read(&format!("[[object]]\n{SHEET}young_pa = 1e5\n{ball}{couple}")).expect_err("no such law");
    assert!(error.problems[0].message.contains("sheets, solids and ropes do not support"), "{:?}", error.problems);
}

#[test]
fn the_gut_hangs_from_its_mesentery_and_the_grasper_feels_it() {
    let report = lockstep("mesentery", &["--seconds", "2.5"]);
    for name in ["gut", "mesentery"] {
        assert_eq!(agent(&report, name)["parked"], false, "{name}");
    }
    // the spacing is one of the range of the sheet
    let eps_m = number(agent(&report, "mesentery"), "/eps_m");
    assert!((0.01..=0.04).contains(&eps_m), "{eps_m}");
    // it hangs 11 to 15 cm under the wall at 22 cm, and is pulled 5 cm towards the grasper
    let gut = point(&report, "/probes/0/position_m");
    assert!(gut[2] > 0.04 && gut[2] < 0.11 && gut[1] < -0.01, "{gut:?}");
    let couplings = report["couplings"].as_array().unwrap();
    let attached = couplings.iter().find(|c| c["kind"] == "attach").unwrap_or_else(|| panic!("{couplings:?}"));
    assert!(number(attached, "/force_n") > 0.05, "{attached}");
}

#[test]
fn the_organ_gives_way_under_the_probe_and_keeps_what_is_attached() {
    let report = lockstep("organ", &["--seconds", "2.5"]);
    assert_eq!(agent(&report, "organ")["parked"], false);
    // the spacing is one of its range, and has the nodes that its surface needs; its residual is its true error
    // (`organ.rs` of the models)
    let (eps_m, nodes) = (number(agent(&report, "organ"), "/eps_m"), number(agent(&report, "organ"), "/nodes"));
    assert!((0.012..=0.03).contains(&eps_m) && nodes >= 200.0, "{eps_m} m, {nodes} nodes");
    let residual_m = number(agent(&report, "organ"), "/residual_m");
    // 2 mm at 16 mm, and with the square of the spacing
    let told_m = 2e-3 * (eps_m / 0.016).powi(2);
    assert!(residual_m > 1e-4 && residual_m < 2.0 * told_m, "{residual_m} m at {eps_m} m");
    let couplings = report["couplings"].as_array().unwrap();
    let pressed = couplings.iter().find(|c| c["a"] == "probe" || c["b"] == "probe").expect("the organ is pressed");
    assert!(number(pressed, "/force_max_n") > 0.05 && number(pressed, "/penetration_m") < 2e-3, "{pressed}");
    let held = couplings.iter().filter(|c| c["kind"] == "attach");
    assert_eq!(held.inspect(|c| assert!(number(c, "/force_n") > 0.0, "{c}")).count(), 2);
}

/// A closed surface as an STL file, text or binary, in millimetres.
fn stl(surface: &Triangles, text: bool) -> Vec<u8> {
    let corners = surface.triangles.iter().map(|t| t.map(|corner| surface.points[corner as usize] * 1000.0));
    if text {
        let vertex = |p: &glam::DVec3| format!("vertex {} {} {}\n", p.x as f32, p.y as f32, p.z as f32);
        let facet = |t: [glam::DVec3; 3]| {
            let vertices: String = t.iter().map(vertex).collect();
            format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
        };
        return format!("solid made\n{}endsolid made\n", corners.map(facet).collect::<String>()).into_bytes();
    }
    let mut bytes = vec![0; 80];
    bytes.extend((surface.triangles.len() as u32).to_le_bytes());
    for t in corners {
        bytes.extend([0; 12]);
        bytes.extend(t.iter().flat_map(|p| p.as_vec3().to_array()).flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

const STL: &str = "[[object]]\nname = \"s\"\nmodel = \"solid\"\nshape = \"mesh\"\nfile = \"s.stl\"\n";

#[test]
fn a_solid_from_an_stl_file_in_millimetres_lies_on_a_scale_with_its_weight() {
    let surface = generate_surface(Generator::Sphere, 0, 1200);
    let small = Triangles { points: surface.points.iter().map(|p| *p * 0.05).collect(), triangles: surface.triangles };
    let floor = "[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\n\
        [[object]]\nname = \"scale\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.1, 0.1, 0.01]\nposition_m = [0, 0, 0.01]\n";
    for text in [true, false] {
        let keys = "scale = 0.001\neps_m = 0.02\nyoung_pa = 3e4\ndamping_per_s = 3\nposition_m = [0, 0, 0.071]\n";
        let folder = Folder::with(&format!("{STL}{keys}{floor}"));
        std::fs::write(folder.file("s.stl"), stl(&small, text)).unwrap();
        let report = folder.lockstep(&["--seconds", "2"]);
        let body = agent(&report, "s");
        // 20 mm cells fit a ball of 0.1 m: five of 2 cm across
        assert!((number(body, "/eps_m") - 0.02).abs() < 1e-6, "{body}");
        let pair = &report["couplings"][0];
        let weight = small.volume_m3() * 1050.0 * 9.81;
        assert!((number(pair, "/force_n") / weight - 1.0).abs() < 0.02, "{pair}: {weight} N");
    }
}

#[test]
fn a_surface_that_is_no_solid_is_refused_by_triangle_and_reason() {
    let refused = |surface: &Triangles, keys: &str| {
        let folder = Folder::with(&format!("{STL}young_pa = 1e4\n{keys}"));
        std::fs::write(folder.file("s.stl"), stl(surface, false)).unwrap();
        let error = load(&Source::open(folder.scene()).unwrap(), &[]).expect_err("no solid");
        format!("{:?} {:?}", error.problems[0].message, error.problems[0].expected)
    };
    let whole = generate_surface(Generator::Sphere, 0, 100);
    let small =
        |triangles: Vec<[u32; 3]>| Triangles { points: whole.points.iter().map(|p| *p * 0.05).collect(), triangles };
    let eps = "scale = 0.001\neps_m = 0.02";
    assert!(refused(&small(whole.triangles[1..].to_vec()), eps).contains("it is not closed: triangle "));
    let inwards = whole.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    assert!(refused(&small(inwards), eps).contains("face inwards"));
    let mut twice = small(whole.triangles.clone());
    let count = twice.points.len() as u32;
    twice.points.extend(twice.points.clone().iter().map(|p| *p + glam::DVec3::X));
    twice.triangles.extend(whole.triangles.iter().map(|t| t.map(|corner| corner + count)));
    assert!(refused(&twice, eps).contains("2 separate pieces"));
    let mut branched = small(whole.triangles.clone());
    branched.triangles.push([whole.triangles[0][0], whole.triangles[0][1], whole.triangles[50][2]]);
    assert!(refused(&branched, eps).contains("not manifold"));
    let sound = small(whole.triangles.clone());
    assert!(refused(&sound, "eps_m = 20.0").contains("scale = 0.001"), "millimetres");
    assert!(refused(&sound, "scale = 0.001").contains("`eps_m` of `s` is missing"));
    assert!(refused(&sound, "scale = 0.001\neps_m = 0.0005").contains("10000 vertices"));
    assert!(refused(&sound, "scale = 0.001\neps_m = [0.03, 0.02]").contains("the lesser number first"));
    assert!(refused(&sound, "scale = 0.001\neps_m = 0.02\nsegments = [1, 1, 1]").contains("does not belong to a mesh"));
}

#[test]
fn the_rope_hangs_in_a_catenary_and_the_rod_keeps_some_of_its_bend() {
    let report = lockstep("catenary", &["--seconds", "1.2"]);
    let (rope, rod) = (point(&report, "/probes/0/position_m"), point(&report, "/probes/1/position_m"));
    // span 0.2 m of 0.2973 m: sinh u/u = 1.4865, sag (cosh u - 1) 0.2/2u = 98.85 mm; it stretches by half a millimetre
    assert!((rope[2] - (0.2 - 0.09885)).abs() < 1.5e-3, "{rope:?}");
    // the rod was made as a V, 11 cm deep, and would be one again
    assert!(rod[2] > 0.088 && rod[2] < rope[2] - 3e-3, "{rod:?}");
}

#[test]
fn in_the_cavity_a_grasper_lifts_the_gut_while_a_probe_presses_the_liver() {
    let report = lockstep("cavity", &["--seconds", "2.6"]);
    let (gut, tip) = (point(&report, "/probes/0/position_m"), point(&report, "/probes/2/position_m"));
    // it lies 26 mm high, and the tip has lifted it by 30 mm of its 41
    assert!(gut[2] > 0.045 && gut[2] < tip[2], "the gut at {gut:?}, the tip at {tip:?}");
    let force = |a: &str, b: &str| {
        let all = report["couplings"].as_array().unwrap();
        let pair = all.iter().find(|c| c["a"] == a && c["b"] == b);
        pair.map_or(0.0, |pair| number(pair, "/force_n"))
    };
    // more than a third of the gut's 0.4 N, with the load on the mesentery, and less than the force of the jaws'
    // springs at 2 cm
    assert!((0.15..1.2).contains(&force("grasper", "gut")), "{report}");
    assert!(force("liver", "probe") > 0.1, "{report}");
}

/// A sleeping owner of the pair must see a falling deformable come, which else falls through to the floor.
#[test]
fn a_soft_body_that_sleeps_wakes_for_what_bends_and_falls_on_it() {
    let soft = "young_pa = 1e5\ndensity_kg_m3 = 1050.0\ndamping_per_s = 3.0\nrate_hz = 240.0\n";
    let floor = "[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\nfixed = true\n";
    let slab = format!(
        "[[object]]\nname = \"slab\"\nmodel = \"solid\"\nshape = \"box\"\nsize_m = [0.2, 0.2, 0.04]\nsegments = [5, 5, 1]\nposition_m = [0, 0, 0.02]\n{soft}"
    );
    let falls = [
        "model = \"solid\"\nshape = \"box\"\nsize_m = [0.08, 0.08, 0.08]\nsegments = [3, 3, 3]\nposition_m = [0, 0, 2.08]\n",
        "model = \"sheet\"\nsize_m = [0.12, 0.1]\nsegments = [4, 4]\nthickness_m = 0.004\nposition_m = [0, 0, 2.042]\n",
        "model = \"rope\"\npath_m = [[-0.06, 0, 2.046], [0.06, 0, 2.046]]\nradius_m = 0.006\nsegments = 6\n",
    ];
    for faller in falls {
        let probe = "[[probe]]\nobject = \"faller\"\nevery_ms = 10.0\n";
        let text = format!("{floor}{slab}[[object]]\nname = \"faller\"\n{faller}{soft}{probe}");
        let report = Folder::with(&text).lockstep(&["--seconds", "1.5"]);
        let at = point(&report, "/probes/0/position_m");
        // two metres take 0.64 s, and it sleeps after half a second
        assert!(at[2] > 0.03, "{faller}: it is at {at:?}, the top at 0.04");
    }
}

/// Its steps of a millisecond take longer than that, while the body that pushes it is 18 ms ahead: it must not fly off.
#[test]
fn a_soft_ball_that_falls_a_metre_on_a_soft_block_of_its_rate_lies_on_it() {
    let soft = "young_pa = 1e5\ndensity_kg_m3 = 1050.0\ndamping_per_s = 3.0\n";
    let floor = "[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\nfixed = true\nfriction = 0.5\n";
    let block = "[[object]]\nname = \"block\"\nmodel = \"solid\"\nshape = \"box\"\nsize_m = [0.2, 0.2, 0.1]\nsegments = [4, 4, 2]\nposition_m = [0, 0, 0.0505]\n";
    let ball = "[[object]]\nname = \"ball\"\nmodel = \"solid\"\nshape = \"ball\"\nradius_m = 0.035\nsegments = [4, 4, 4]\nposition_m = [0, 0, 1.14]\n";
    for rate_hz in [60.0, 240.0] {
        let text = format!("{floor}{block}{soft}rate_hz = {rate_hz:?}\n{ball}{soft}rate_hz = {rate_hz:?}\n");
        let report = Folder::with(&text).lockstep(&["--seconds", "3"]);
        let pair = &report["couplings"][0];
        // four cells across hold 0.9349 of a sphere
        let weight_n = 0.9349 * 1050.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.035_f64.powi(3) * 9.81;
        let force_n = number(pair, "/force_n");
        assert!((force_n / weight_n - 1.0).abs() < 0.01, "{rate_hz} Hz: {force_n} N of {weight_n}");
        assert!(number(pair, "/penetration_m") < 1e-3, "{rate_hz} Hz: {pair}");
        // a blow at 4.4 m/s between matter of 1e5 Pa
        assert!(number(pair, "/penetration_max_m") < 3e-3, "{rate_hz} Hz: {pair}");
    }
}

/// The slab must bear the whole stack: where it gives as if the lowest box were alone, this sinks 13 mm deep at 240 Hz,
/// and through at 60.
#[test]
fn a_stack_of_boxes_stands_on_a_soft_slab_at_equal_and_unequal_rates() {
    let floor = "[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\nfixed = true\n";
    let slab = "[[object]]\nname = \"slab\"\nmodel = \"solid\"\nshape = \"box\"\nsize_m = [0.2, 0.2, 0.05]\nsegments = [4, 4, 2]\nposition_m = [0, 0, 0.026]\nyoung_pa = 1e5\ndensity_kg_m3 = 1050.0\ndamping_per_s = 3.0\n";
    let cube = |name: &str, z: f64, hz: f64| {
        format!(
            "[[object]]\nname = \"{name}\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.03, 0.03, 0.03]\nposition_m = [0, 0, {z}]\nmass_kg = 0.5\nrestitution = 0.0\nrate_hz = {hz:?}\n[[probe]]\nobject = \"{name}\"\nevery_ms = 10.0\n"
        )
    };
    for [slab_hz, box_hz] in [[240.0, 240.0], [60.0, 60.0], [120.0, 240.0], [240.0, 60.0]] {
        let (low, high) = (cube("low", 0.082, box_hz), cube("high", 0.1425, box_hz));
        let report =
            Folder::with(&format!("{floor}{slab}rate_hz = {slab_hz:?}\n{low}{high}")).lockstep(&["--seconds", "3"]);
        let what = format!("{slab_hz} : {box_hz} Hz");
        let [low, high] = [0, 1].map(|probe| point(&report, &format!("/probes/{probe}/position_m")));
        let pairs = report["couplings"].as_array().unwrap();
        let pair =
            pairs.iter().find(|pair| pair["a"] == "slab").unwrap_or_else(|| panic!("{what}: nobody on the slab"));
        let carried = number(pair, "/force_n") / (2.0 * 0.5 * 9.81);
        println!("{what}: {} deep, {carried} of the weight, at {low:?} and {high:?}", number(pair, "/penetration_m"));
        assert!(number(pair, "/penetration_m") < 1e-3, "{what}: {pair}");
        assert!((carried - 1.0).abs() < 0.05, "{what}: {carried} of the weight of both");
        assert!((high[2] - low[2] - 0.06).abs() < 5e-4, "{what}: {low:?} and {high:?}");
        assert!(low[2] > 0.074, "{what}: it is at {low:?}, the slab's top at 0.05");
    }
}
