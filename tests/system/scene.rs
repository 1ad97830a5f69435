//! Scenes as users write them: the scenes that load, and the text of errors.

use metachron_scene::{SceneError, Source, load};
use metachron_world::Scene;
use proptest::prelude::*;

/// The least scene with a tube, for the tests to change.
pub const TUBE: &str = r#"format = 1

[[object]]
name = "intestine"
model = "tube"
path_m = [[0.0, 0.0, 0.0], [0.2, 0.05, 0.0], [0.3, 0.0, 0.1]]
radius_m = 0.015
wall_m = 0.002
young_pa = 5.0e4
density_kg_m3 = 1050.0
rate_hz = 240.0
dt_ms = [1.0, 16.0]
eps_m = [0.0005, 0.02]
n = [1, 5]
importance = 1.0
"#;

fn read(text: &str) -> Result<Scene, SceneError> {
    load(&Source::memory("test.toml", text.as_bytes())?, &[])
}

/// The only problem of a scene: line, column, text, and message with the expected value and the help.
fn problem(text: &str) -> (usize, usize, String, String) {
    let error = read(text).expect_err("the scene must be refused");
    assert_eq!(error.problems.len(), 1, "{:#?}", error.problems);
    let p = &error.problems[0];
    (p.line, p.column, p.text.clone(), format!("{}; {}; {}", p.message, p.expected, p.help.clone().unwrap_or_default()))
}

/// Asserts that `find` replaced by `put` is refused at `put`'s line with `text` underlined and all of `words` said.
fn refused(find: &str, put: &str, text: &str, words: &[&str]) {
    assert!(TUBE.contains(find), "{find}");
    let scene = TUBE.replacen(find, put, 1);
    let offset = scene.find(put).unwrap();
    let (line, column, shown, said) = problem(&scene);
    let inside = scene[offset..].find(text).map(|at| offset + at).unwrap_or(offset);
    let expected_line = scene[..inside].matches('\n').count() + 1;
    assert_eq!((line, shown.as_str()), (expected_line, text), "column {column}: {said}");
    for word in words {
        assert!(said.contains(word), "{word:?} is not said: {said}");
    }
}

#[test]
fn every_built_in_scene_loads_and_says_what_it_shows() {
    for scene in &metachron::scenes::ALL {
        metachron::scenes::provide();
        let loaded = scene.source().and_then(|s| load(&s, &[])).unwrap_or_else(|e| panic!("{e:?}"));
        assert!(!loaded.description.is_empty() && !loaded.cameras.is_empty(), "{}", scene.name);
    }
}

#[test]
fn the_scene_of_the_design_loads_with_its_ranges() {
    let scene = read(TUBE).unwrap();
    let member = &scene.agents[0];
    assert_eq!(member.pace.rate_hz, 240.0);
    assert_eq!(member.pace.dt_range.0.as_nanos(), 1_000_000);
    assert_eq!(member.pace.dt_range.1.as_nanos(), 16_000_000);
    assert_eq!(member.simulation.eps_m, (0.0005, 0.02));
    assert_eq!(member.picture.n, (1, 5));
}

#[test]
fn one_step_length_gives_the_rate() {
    let scene = read(&TUBE.replace("rate_hz = 240.0\ndt_ms = [1.0, 16.0]", "dt_ms = 10.0")).unwrap();
    let pace = scene.agents[0].pace;
    assert_eq!((pace.rate_hz, pace.dt.as_nanos(), pace.dt_range.0), (100.0, 10_000_000, pace.dt_range.1));
}

#[test]
fn syntax_errors_show_their_line() {
    refused("radius_m = 0.015", "radius_m = = 0.015", "=", &[]);
    refused("name = \"intestine\"", "name = \"intestine", "", &[]);
}

#[test]
fn an_unknown_key_is_underlined_with_the_nearest_known_one() {
    refused("radius_m", "radus_m", "radus_m", &["did you mean `radius_m`?", "path_m"]);
    refused("rate_hz = 240.0", "rate_hertz = 240.0", "rate_hertz", &["did you mean `rate_hz`?"]);
    let (line, column, text, said) = problem("format = 1\n\n[targt]\nframe_hz = 1.0\n");
    assert_eq!((line, column, text.as_str()), (3, 2, "targt"));
    assert!(said.contains("did you mean `target`?"), "{said}");
}

#[test]
fn a_wrong_type_says_which_is_right() {
    refused("0.015", "\"thick\"", "\"thick\"", &["expected a number"]);
    refused("[0.2, 0.05, 0.0]", "[0.2, 0.05]", "[0.2, 0.05]", &["3 numbers"]);
    refused("n = [1, 5]", "n = [1, 2, 3]", "[1, 2, 3]", &["[least, greatest]"]);
    refused("n = [1, 5]", "n = 1.5", "1.5", &["a whole number"]);
    for table in ["{ kind = \"threads\", workers = 2 }", "{}", "[1]"] {
        refused("format = 1", &format!("format = 1\nexecutor = {table}"), table, &["expected a word in quotes"]);
    }
}

#[test]
fn a_missing_key_is_named_at_its_table() {
    let (line, _, text, said) = problem(&TUBE.replace("radius_m = 0.015\n", ""));
    assert_eq!((line, text.as_str()), (3, "[[object]]"));
    assert!(said.contains("`radius_m` is missing"), "{said}");
    let (line, _, _, said) = problem(&TUBE.replace("format = 1", ""));
    assert_eq!(line, 1);
    assert!(said.contains("`format` is missing"), "{said}");
    let (.., said) = problem(&TUBE.replace("young_pa = 5.0e4\n", ""));
    assert!(said.contains("young_pa") && said.contains("ea_n"), "{said}");
}

#[test]
fn values_out_of_range_are_underlined_with_their_range() {
    for bad in ["-1.0", "0.0", "nan", "inf", "-inf", "1e300"] {
        let said = ["`radius_m` of `intestine` is", "from 0.000001 to 100 m"];
        refused("radius_m = 0.015", &format!("radius_m = {bad}"), bad, &said);
    }
    refused("[0.3, 0.0, 0.1]", "[0.3, inf, 0.1]", "[0.3, inf, 0.1]", &["3 numbers from"]);
    refused("0.002", "0.02", "0.02", &["`wall_m`", "at most `radius_m`, 0.015 m"]);
    refused("[0.3, 0.0, 0.1]", "[0.3, 0.0, 0.1, 2.0]", "[0.3, 0.0, 0.1, 2.0]", &["3 numbers from"]);
    refused("[1, 5]", "[1, 11]", "[1, 11]", &["2 numbers from 0 to 10"]);
    refused("importance = 1.0", "importance = 0", "0", &["`importance`"]);
    refused("importance = 1.0", "poisson = 0.6", "0.6", &["`poisson`", "0.5"]);
    refused("format = 1", "format = 2", "2", &["expected 1"]);
}

#[test]
fn ranges_run_upwards() {
    refused("[1.0, 16.0]", "[16.0, 1.0]", "[16.0, 1.0]", &["the lesser number first: [1, 16]"]);
    refused("[1, 5]", "[5, 1]", "[5, 1]", &["[1, 5]"]);
    refused("[0.0005, 0.02]", "[1e-9, 0.02]", "[1e-9, 0.02]", &["`eps_m`", "1/4096"]);
}

#[test]
fn a_rate_that_contradicts_the_step_is_a_load_error() {
    refused("rate_hz = 240.0\ndt_ms = [1.0, 16.0]", "rate_hz = 240.0\ndt_ms = 10.0", "240.0", &["expected 100 Hz"]);
    refused("240.0", "20.0", "20.0", &["from 62.5 to 1000 Hz"]);
    assert!(read(&TUBE.replace("rate_hz = 240.0\ndt_ms = [1.0, 16.0]", "rate_hz = 100\ndt_ms = 10")).is_ok());
}

#[test]
fn paths_have_two_different_points() {
    refused(
        "[[0.0, 0.0, 0.0], [0.2, 0.05, 0.0], [0.3, 0.0, 0.1]]",
        "[[0, 0, 0]]",
        "[[0, 0, 0]]",
        &["has 1 points", "2 …"],
    );
    refused("[0.2, 0.05, 0.0]", "[0.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]", &["same point twice"]);
}

#[test]
fn an_end_is_clamped_or_pinned_not_both() {
    refused(
        "importance = 1.0",
        "clamp = [\"start\", \"end\"]\npin = [\"start\"]",
        "[\"start\"]",
        &["`clamp` holds already"],
    );
    refused("importance = 1.0", "clamp = [\"strat\"]", "\"strat\"", &["did you mean `start`?"]);
}

#[test]
fn an_integrator_that_does_not_exist_names_those_that_do() {
    refused("importance = 1.0", "integrator = \"bdf\"", "\"bdf\"", &["did you mean `bdf2`?"]);
}

#[test]
fn an_integrator_that_cannot_carry_the_step_says_how_long_a_one_it_can() {
    let words = &["stable for substeps up to", "`substeps = ", "segments"];
    refused("importance = 1.0", "integrator = \"symplectic-euler\"", "\"symplectic-euler\"", words);
}

#[test]
fn an_unknown_model_names_those_that_exist() {
    refused("\"tube\"", "\"tubes\"", "\"tubes\"", &["did you mean `tube`?", "`rigid`", "`tool`"]);
}

#[test]
fn names_are_unique_and_not_empty() {
    refused("\"intestine\"", "\" \"", "\" \"", &["is not a valid name"]);
    let twice =
        format!("{TUBE}\n[[object]]\nname = \"intestine\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\n");
    let (line, _, text, said) = problem(&twice);
    assert_eq!((line, text.as_str()), (18, "\"intestine\""));
    assert!(said.contains("the name of another object"), "{said}");
}

fn rigid(keys: &str) -> String {
    format!("format = 1\n[[object]]\nname = \"a\"\nmodel = \"rigid\"\n{keys}\n")
}

#[test]
fn a_rigid_object_takes_the_keys_of_its_shape_alone() {
    let said = |keys: &str| problem(&rigid(keys)).3;
    assert!(said("shape = \"ball\"").contains("`radius_m` of `a` is missing"));
    assert!(said("shape = \"ball\"\nradius_m = 0.1\nhalf_height_m = 1.0").contains("does not belong to a ball"));
    assert!(said("shape = \"ball\"\nradius_m = 0.1\nmass_kg = 1\ndensity_kg_m3 = 1").contains("contradicts `mass_kg`"));
    assert!(said("shape = \"plane\"\nfixed = false").contains("a plane"));
    assert!(said("shape = \"ball\"\nradius_m = 0.1\nfixed = true\nspin_rad_s = [0, 0, 1]").contains("fixed"));
    assert!(said("shape = \"blob\"").contains("`capsule`"));
    assert!(said("shape = \"mesh\"\nfile = \"a.obj\"").contains("a.obj"));
    assert!(read(&rigid("shape = \"plane\"")).unwrap().agents.is_empty());
    assert_eq!(read(&rigid("shape = \"ball\"\nradius_m = 0.1\nfixed = true")).unwrap().obstacles.len(), 1);
}

#[test]
fn references_name_what_exists() {
    let (line, _, text, said) = problem(&format!("{TUBE}\n[[probe]]\nobject = \"intestin\"\n"));
    assert_eq!((line, text.as_str()), (18, "\"intestin\""));
    assert!(said.contains("did you mean `intestine`?"), "{said}");
    let tool = "\n[[object]]\nname = \"tool\"\nmodel = \"instrument\"\ngrasps = [\"liver\"]\nkeyframe = [{ tip_m = [0, 0, 0] }]\n";
    let said = problem(&format!("{TUBE}{tool}")).3;
    assert!(said.contains("`liver`") && said.contains("`intestine`"), "{said}");
    let said = problem(&format!("{TUBE}{}", tool.replace("liver", "tool"))).3;
    assert!(said.contains("names `tool`, a tool, which jaws cannot grasp"), "{said}");
    let fixed = format!(
        "{TUBE}{}\n[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\n",
        tool.replace("liver", "floor")
    );
    let (line, _, text, said) = problem(&fixed);
    assert_eq!((line, text.as_str()), (20, "\"floor\""));
    assert!(said.contains("names `floor`, a fixed object, which jaws cannot grasp"), "{said}");
}

#[test]
fn a_tool_and_the_tubes_it_can_hold_see_each_other() {
    let tool = "\n[[object]]\nname = \"tool\"\nmodel = \"instrument\"\nkeyframe = [{ tip_m = [0, 0, 0] }]\n";
    let scene = read(&format!("{TUBE}{tool}")).unwrap();
    assert_eq!(scene.agents[0].links, [scene.agents[1].id]);
    assert_eq!(scene.agents[1].links, [scene.agents[0].id]);
}

#[test]
fn a_drive_without_force_or_with_more_than_a_kilonewton_is_refused_with_its_line() {
    for wrong in ["0", "-1", "inf", "nan", "1001"] {
        let tool = format!(
            "format = 1\n[[object]]\nname = \"t\"\nmodel = \"instrument\"\nmax_force_n = {wrong}\nkeyframe = [{{ tip_m = [0, 0, 0] }}]\n"
        );
        let (line, _, text, said) = problem(&tool);
        assert_eq!((line, text.as_str()), (5, wrong));
        assert!(said.contains("`max_force_n`") && said.contains("1000 N"), "{said}");
    }
}

#[test]
fn keyframes_follow_in_time() {
    let tool = "format = 1\n[[object]]\nname = \"t\"\nmodel = \"instrument\"\n[[object.keyframe]]\nat_s = 1\ntip_m = [0, 0, 0]\n[[object.keyframe]]\nat_s = 1\ntip_m = [0, 0, 0]\n";
    let (line, _, _, said) = problem(tool);
    assert_eq!(line, 9);
    assert!(said.contains("after the keyframe before"), "{said}");
    let said = problem(&tool.replacen("at_s = 1\ntip_m = [0, 0, 0]\n", "tip_m = [0, 0, 0]\njaw = 2\n", 1)).3;
    assert!(said.contains("`jaw`"), "{said}");
}

#[test]
fn all_problems_are_told_at_once_in_the_order_of_the_text() {
    let bad =
        TUBE.replace("0.015", "-1.0").replace("0.002", "-2.0").replace("5.0e4", "0.0").replace("[1, 5]", "[9, 1]");
    let error = read(&bad).unwrap_err();
    let lines: Vec<_> = error.problems.iter().map(|p| p.line).collect();
    assert_eq!(lines, [7, 8, 9, 14]);
}

#[test]
fn all_keys_of_a_table_that_have_the_wrong_type_are_told_at_once() {
    let bad = "format = 1\n[target]\nframe_hz = \"x\"\npolicy = \"best\"\n[camera]\neye_m = 3\n[[probe]]\nobject = 1\n\
               [[object]]\nname = 4\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = \"a\"\nrate_hz = true\nmas_kg = 1\n";
    let error = read(bad).unwrap_err();
    let lines: Vec<_> = error.problems.iter().map(|p| p.line).collect();
    // a key that is told to be wrong is not told to be missing as well
    assert_eq!(lines, [3, 4, 6, 8, 10, 13, 14, 15], "{:#?}", error.problems);
}

#[test]
fn the_range_of_the_pictures_scale_is_read_checked_and_has_a_default() {
    let scales =
        |key: &str| read(&format!("format = 1\n[target]\n{key}\n")).map(|scene| scene.target.render_scale.ends());
    assert_eq!(scales("").unwrap(), (0.35, 1.0));
    assert_eq!(scales("render_scale = [0.5, 0.9]").unwrap(), (0.5, 0.9));
    assert_eq!(scales("render_scale = 1.0").unwrap(), (1.0, 1.0));
    for (bad, expected) in [("[0.2, 1.0]", "0.35"), ("1.5", "0.35"), ("[0.9, 0.5]", "[0.5, 0.9]"), ("nan", "0.35")] {
        let (line, _, _, said) = problem(&format!("format = 1\n[target]\nrender_scale = {bad}\n"));
        assert!(line == 3 && said.contains("render_scale") && said.contains(expected), "{said}");
    }
}

#[test]
fn deep_nesting_and_many_problems_stay_readable() {
    for open in ["[", "{a="] {
        let said = problem(&format!("format = 1\nx = {}\n", open.repeat(100_000))).3;
        assert!(said.contains("recurs"), "{said}");
    }
    let objects: String = (0..200).map(|i| format!("[[object]]\nname = \"{i}\"\nmodel = \"x\"\n")).collect();
    let error = read(&format!("format = 1\n{objects}")).unwrap_err();
    assert_eq!(error.problems.len() + error.hidden, 200);
    assert!(error.problems.len() <= 50 && error.to_string().contains("200 problems"), "{error}");
}

#[test]
fn more_agents_than_a_scene_can_carry_are_refused() {
    let balls =
        "[[object]]\nname = \"b\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nspacing_m = [1, 1, 1]\n";
    let many = |n| format!("format = 1\n{balls}grid = [100, {n}, 1]\n");
    assert!(read(&many(100)).is_ok());
    assert!(problem(&many(101)).3.contains("at most 10000"));
    let threads = |n| format!("format = 1\nexecutor = \"threads\"\n{balls}grid = [100, {n}, 1]\n");
    assert!(read(&threads(10)).is_ok());
    assert!(problem(&threads(11)).3.contains("at most 1000 agents have a thread each"));
}

#[test]
fn overrides_reach_any_key_and_the_last_one_counts() {
    let source = Source::memory("test.toml", TUBE.as_bytes()).unwrap();
    let set = |pairs: &[(&str, &str)]| {
        load(&source, &pairs.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>())
    };
    let scene = set(&[("target.frame_hz", "90"), ("target.frame_hz", "30"), ("target.policy", "full")]).unwrap();
    assert_eq!(scene.target.frame_hz, 30.0);
    let scene = set(&[("object.intestine.rate_hz", "120"), ("object.0.n", "[2, 3]")]).unwrap();
    assert_eq!((scene.agents[0].pace.rate_hz, scene.agents[0].picture.n), (120.0, (2, 3)));
    let error = set(&[("object.intestine.radius_m", "-3")]).unwrap_err();
    assert_eq!(error.problems[0].text, "-3");
    for bad in ["object.liver.rate_hz", "format.x", "a..b", "", "object.rate_hz", "targt.frame_hz"] {
        assert!(set(&[(bad, "1")]).is_err(), "{bad}");
    }
}

#[test]
fn an_override_cannot_smuggle_in_other_keys() {
    let source = Source::memory("test.toml", TUBE.as_bytes()).unwrap();
    let scene = load(&source, &[("description".to_owned(), "1\n[target]\nframe_hz = 5".to_owned())]).unwrap();
    assert_eq!((scene.description.as_str(), scene.target.frame_hz), ("1\n[target]\nframe_hz = 5", 60.0));
}

#[test]
fn files_beside_a_scene_are_read_and_named_when_they_are_bad() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("s.toml"), rigid("shape = \"mesh\"\nfile = \"m.obj\"")).unwrap();
    std::fs::write(at("m.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n").unwrap();
    let open = || load(&Source::open(at("s.toml").to_str().unwrap()).unwrap(), &[]);
    assert_eq!(open().unwrap().agents.len(), 1);
    std::fs::write(at("m.obj"), "f 1 2 3\n").unwrap();
    let error = open().unwrap_err();
    assert!(error.problems[0].message.contains("m.obj"), "{:?}", error.problems);
}

#[test]
fn a_mesh_that_no_scene_can_hold_is_refused_by_name_whether_it_is_touched_or_seen() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let seen = "format = 1\n[[object]]\nname = \"seen\"\nmodel = \"mesh\"\nfile = \"m.obj\"\n";
    for (file, why) in [
        (format!("{tetrahedron}v 1 1 1\nf 1 2 5\n"), "line 10: it is not manifold: 3 triangles share the edge"),
        (tetrahedron.trim_end_matches(" 4\n").to_owned(), "line 8: a face has 2 corners"),
        (tetrahedron.replace("v 1 0 0", "v 1e38 0 0"), "it extends 1.000e38 m"),
        ("\u{0}\u{1}\u{2}".to_owned(), "neither a .glb file"),
    ] {
        std::fs::write(at("m.obj"), file).unwrap();
        for scene in [seen, &rigid("shape = \"mesh\"\nfixed = true\nfile = \"m.obj\"")] {
            std::fs::write(at("s.toml"), scene).unwrap();
            let error = load(&Source::open(at("s.toml").to_str().unwrap()).unwrap(), &[]).unwrap_err();
            let message = &error.problems[0].message;
            assert!(error.problems.len() == 1 && message.contains("m.obj") && message.contains(why), "{message}");
        }
    }
    // a mesh that is sound in its own unit and huge in the scene's
    std::fs::write(at("m.obj"), tetrahedron).unwrap();
    std::fs::write(at("s.toml"), format!("{seen}{}", seen[10..].replace("seen\"", "far\"\nscale = 2e5"))).unwrap();
    let error = load(&Source::open(at("s.toml").to_str().unwrap()).unwrap(), &[]).unwrap_err();
    assert!(error.problems[0].message.contains("`scale` of `far` makes it too large"), "{:?}", error.problems);
}

#[test]
fn a_tool_may_be_called_an_instrument_as_it_was_before() {
    let text = |model: &str| {
        format!(
            "format = 1\n[[object]]\nname = \"t\"\nmodel = \"{model}\"\nkeyframe = [{{ tip_m = [0, 0, 0] }}]\n[machine.step.{model}]\nbase_us = 7\n"
        )
    };
    let read = |model: &str| load(&Source::memory("t", text(model).as_bytes()).unwrap(), &[]).unwrap();
    for scene in [read("instrument"), read("tool")] {
        assert_eq!(scene.agents[0].spec.model(), "tool");
        assert_eq!(scene.machine.step["tool"].base_us, Some(7.0));
    }
}

#[test]
fn a_scene_that_does_not_exist_lists_the_built_in_ones() {
    metachron::scenes::provide();
    let error = Source::open("tubee").unwrap_err();
    let help = error.problems[0].help.clone().unwrap();
    assert!(help.contains("did you mean `tube`?") && help.contains("overload"), "{help}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, ..ProptestConfig::default() })]

    #[test]
    fn no_bytes_make_the_loader_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = Source::memory("bytes", &bytes).and_then(|s| load(&s, &[])).map_err(|e| format!("{:?}", miette::Report::new(e)));
    }

    #[test]
    fn no_damaged_scene_makes_the_loader_panic(
        // a damaged count may be a mesh of a million triangles; the walk is full of them, and its text has nothing else
        scene in prop::sample::select(metachron::scenes::ALL.iter().filter(|s| s.name != "walkthrough").collect::<Vec<_>>()),
        cuts in proptest::collection::vec((any::<prop::sample::Index>(), 0..30_usize, "[ -~\nλ\\[\\]{}=\"'.]{0,8}"), 1..4),
    ) {
        let mut text: Vec<char> = scene.text.chars().collect();
        for (at, gone, put) in cuts {
            let at = at.index(text.len());
            let end = (at + gone).min(text.len());
            text.splice(at..end, put.chars());
        }
        let text: String = text.into_iter().collect();
        let _ = read(&text).map_err(|e| format!("{:?}", miette::Report::new(e)));
    }

    #[test]
    fn no_number_makes_the_loader_panic(value in any::<f64>(), key in 0..9_usize) {
        let keys = ["radius_m", "wall_m", "young_pa", "density_kg_m3", "rate_hz", "dt_ms", "eps_m", "importance", "n"];
        let source = Source::memory("test.toml", TUBE.as_bytes()).unwrap();
        let shown = toml::Value::Float(value).to_string();
        let _ = load(&source, &[(format!("object.intestine.{}", keys[key]), shown)]);
    }
}

#[test]
fn the_machines_and_models_that_scenes_can_name_are_those_that_exist() {
    for preset in metachron_runtime::PRESETS {
        assert!(read(&format!("{TUBE}\n[machine]\npreset = \"{preset}\"\n")).is_ok(), "{preset}");
    }
    let said = problem(&format!("{TUBE}\n[machine]\npreset = \"laptop\"\n")).3;
    assert!(metachron_runtime::PRESETS.iter().all(|p| said.contains(p)), "{said}");
    let said = problem(&format!("{TUBE}\n[machine.step.tub]\nunit_us = 0.1\n")).3;
    assert!(said.contains("did you mean `tube`?"), "{said}");
}
