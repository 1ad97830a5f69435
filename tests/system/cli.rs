//! The command line as a user drives it.

use assert_cmd::Command;
use std::process::Output;

fn metachron(arguments: &[&str]) -> Output {
    // a user's shell variables about colours or METACHRON_ must not reach the tests
    let mut command = Command::cargo_bin("metachron").unwrap();
    command.env_clear().args(arguments).output().unwrap()
}

fn code(output: &Output) -> i32 {
    output.status.code().expect("the program ends by itself")
}

fn out(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn err(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[test]
fn help_teaches_by_examples_and_exit_codes() {
    let help = metachron(&["--help"]);
    assert_eq!(code(&help), 0);
    for word in ["metachron run yard", "check", "schema", "list", "Exit codes", "4 a goal"] {
        assert!(out(&help).contains(word), "{word}");
    }
    let help = out(&metachron(&["run", "--help"]));
    let flags = "--headless --frames --seconds --target-fps --policy --law --executor --pace --size --png --report --frames-csv --seed --oracle \
                 --fail-on --set --json --quiet --memory-limit --allow-outside METACHRON_TARGET_FPS";
    for flag in flags.split_whitespace() {
        assert!(help.contains(flag), "{flag}");
    }
}

#[test]
fn list_names_every_built_in_scene_with_what_it_shows() {
    let list = metachron(&["list"]);
    assert_eq!((code(&list), out(&list).lines().count()), (0, 18));
    assert!(out(&list).starts_with("tube        a soft tube"), "{}", out(&list));
    let rows: serde_json::Value = serde_json::from_slice(&metachron(&["list", "--json"]).stdout).unwrap();
    assert_eq!(rows[3]["name"], "overload");
}

#[test]
fn generate_writes_scenes_that_load_and_refuses_what_a_scene_does_not_have() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grove.toml");
    let file = path.to_str().unwrap();
    let done = metachron(&["generate", "grove", "--trees", "30", "--zigzag", "--seed", "5", "--out", file]);
    assert_eq!((code(&done), out(&done).as_str()), (0, ""));
    let check = metachron(&["check", "--json", file]);
    let json: serde_json::Value = serde_json::from_slice(&check.stdout).unwrap();
    assert_eq!((code(&check), json[0]["content"]["scenery"].as_u64()), (0, Some(60)));
    assert_eq!(code(&metachron(&["generate", "domes", "--trees", "30"])), 2);
    assert_eq!(code(&metachron(&["generate", "grove", "--out", folder.path().to_str().unwrap()])), 2);
    assert_eq!(out(&metachron(&["generate", "domes"])), include_str!("../../scenes/domes.toml"));
}

#[test]
fn import_writes_scenes_that_load_lists_what_is_left_out_and_refuses_broken_models() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let mass = r#"<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>"#;
    std::fs::write(path("a.urdf"), format!("<robot name=\"a\">\n<link name=\"a\">{mass}</link>\n<gazebo/></robot>"))
        .unwrap();
    let done = metachron(&["import", &path("a.urdf"), "--out", &path("a.toml")]);
    assert_eq!((code(&done), out(&done).as_str()), (0, ""));
    assert!(err(&done).contains("a.urdf: line 3: gazebo: is left out"), "{}", err(&done));
    assert_eq!(out(&metachron(&["import", &path("a.urdf")])), std::fs::read_to_string(path("a.toml")).unwrap());
    assert_eq!(code(&metachron(&["check", &path("a.toml")])), 0);
    let again = metachron(&["import", &path("a.urdf"), "--out", &path("a.toml")]);
    assert!(code(&again) == 2 && err(&again).contains("--force"), "{}", err(&again));
    std::fs::write(
        path("b.xml"),
        "<mujoco><worldbody>\n<body name=\"b\"><joint type=\"screw\"/></body></worldbody></mujoco>",
    )
    .unwrap();
    std::fs::write(path("c.xml"), "<mujoco><include file=\"b.xml\"/></mujoco>").unwrap();
    for (model, line) in [("b.xml", "line 2"), ("c.xml", "line 2 of `b.xml`")] {
        let broken = metachron(&["import", &path(model)]);
        let expected = format!("{model}: {line}: body `b`, joint: is of the type `screw`");
        assert!(code(&broken) == 2 && err(&broken).contains(&expected), "{}", err(&broken));
    }
}

#[test]
fn import_writes_the_meshes_that_scenes_do_not_read_and_its_list_as_json() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let ball = |name: &str, inside: &str| {
        format!(
            "<link name=\"{name}\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial>\
             <collision><geometry>{inside}</geometry></collision></link>"
        )
    };
    let hinge = |parent: &str, child: &str| {
        format!(
            "<joint name=\"{child}\" type=\"continuous\"><parent link=\"{parent}\"/><child link=\"{child}\"/></joint>"
        )
    };
    // a tetrahedron that is mirrored, on a ball, and a ball inside that one beyond it
    std::fs::write(path("t.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n").unwrap();
    let links = [
        ball("a", "<sphere radius=\"0.1\"/>"),
        ball("b", "<mesh filename=\"t.obj\" scale=\"1 -1 1\"/>"),
        ball("c", "<sphere radius=\"0.1\"/>"),
    ];
    let robot =
        format!("<robot name=\"r\">{}{}{}<loop_joint/></robot>", links.concat(), hinge("a", "b"), hinge("b", "c"));
    std::fs::write(path("r.urdf"), robot).unwrap();
    let refused = metachron(&["import", &path("r.urdf")]);
    assert!(code(&refused) == 2 && err(&refused).contains("expected --out FILE"), "{}", err(&refused));
    let done = metachron(&["import", &path("r.urdf"), "--fixed-base", "--json", "--out", &path("scene.toml")]);
    assert_eq!(code(&done), 0, "{}", err(&done));
    let list: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(list["changes_motion"][0]["element"], "loop_joint");
    assert_eq!(
        (list["files"][0].as_str(), list["harmless"].as_array().unwrap().len()),
        (Some("scene-meshes/t.obj"), 0)
    );
    assert_eq!((list["overlaps"][0]["a"].as_str(), list["overlaps"][0]["b"].as_str()), (Some("a"), Some("c")));
    assert_eq!(code(&metachron(&["check", &path("scene.toml")])), 0);
    std::fs::write(path("r.srdf"), "<robot><disable_collisions link1=\"a\" link2=\"c\"/></robot>").unwrap();
    let done = metachron(&["import", &path("r.urdf"), "--json", "--force", "--out", &path("scene.toml")]);
    let list: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert!(code(&done) == 0 && list["overlaps"].as_array().unwrap().is_empty(), "{list}");
    // neither a mesh that is there nor the model is written over, and no link is followed
    std::fs::remove_file(path("scene.toml")).unwrap();
    let refused = |out: &str, force: &[&str], why: &str| {
        let done = metachron(&[&["import", &path("r.urdf"), "--out", &path(out)][..], force].concat());
        assert!(code(&done) == 2 && err(&done).contains(why), "{out}: {}", err(&done));
    };
    refused("scene.toml", &[], "t.obj exists already; --force overwrites it");
    refused("r.urdf", &["--force"], "r.urdf, which the model is read from; name another file");
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(path("scene-meshes"), path("other-meshes")).unwrap();
        refused("other.toml", &["--force"], "other-meshes is a link");
    }
    assert!(!std::path::Path::new(&path("scene.toml")).exists());
}

#[test]
fn a_scene_that_takes_more_memory_than_it_may_is_refused_at_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("hill.toml");
    let hill = "[[object]]\nname = \"hill\"\nmodel = \"mesh\"\ngenerate = \"terrain\"\ntriangles = 40000\n";
    std::fs::write(&scene, format!("format = 1\n{hill}")).unwrap();
    let scene = scene.to_str().unwrap();
    assert_eq!(code(&metachron(&["check", scene])), 0);
    for command in [&["check"][..], &["run", "--headless", "--frames", "1"], &["tune"], &["fit", "--tolerance", "1"]] {
        let refused = metachron(&[command, &[scene, "--memory-limit", "20MiB"]].concat());
        let said = err(&refused);
        assert_eq!(code(&refused), 2, "{command:?}: {said}");
        assert!(said.contains("hill.toml:6") && said.contains("20.0 MiB in all"), "{command:?}: {said}");
    }
    let unit = metachron(&["check", scene, "--memory-limit", "20"]);
    assert!(code(&unit) == 2 && err(&unit).contains("such as 512MiB"), "{}", err(&unit));
}

#[test]
fn meshes_outside_of_a_scenes_folder_need_a_flag_and_the_import_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::create_dir(path("scenes")).unwrap();
    std::fs::write(path("t.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n").unwrap();
    let link = "<link name=\"a\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial>\
                <collision><geometry><mesh filename=\"t.obj\"/></geometry></collision></link>";
    std::fs::write(path("r.urdf"), format!("<robot name=\"r\">{link}</robot>")).unwrap();
    let (robot, scene) = (path("r.urdf"), path("scenes/r.toml"));
    let import = |more: &[&str]| metachron(&[&["import", &robot, "--out", &scene], more].concat());
    let outside = import(&[]);
    assert_eq!(code(&outside), 0, "{}", err(&outside));
    assert!(err(&outside).contains("meshes outside of the scene's folder: 1; run the scene with --allow-outside"));
    let refused = metachron(&["check", &scene]);
    assert!(code(&refused) == 2 && err(&refused).contains("../t.obj: it is outside"), "{}", err(&refused));
    assert_eq!(code(&metachron(&["check", &scene, "--allow-outside"])), 0);
    let copied = import(&["--copy-meshes", "--force"]);
    assert!(code(&copied) == 0 && !err(&copied).contains("outside"), "{}", err(&copied));
    assert_eq!(code(&metachron(&["check", &scene])), 0);
}

#[test]
fn the_schema_is_json_with_every_model() {
    let schema = metachron(&["schema"]);
    let json: serde_json::Value = serde_json::from_slice(&schema.stdout).unwrap();
    assert_eq!(code(&schema), 0);
    for model in ["tube", "rigid", "tool", "synthetic"] {
        assert!(json["$defs"][model]["properties"]["name"].is_object(), "{model}");
    }
}

#[test]
fn completions_and_manual_pages_are_printed() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let done = metachron(&["completions", shell]);
        assert!(code(&done) == 0 && out(&done).contains("fail-on"), "{shell}");
    }
    assert!(out(&metachron(&["man"])).contains(".TH metachron"));
    assert!(out(&metachron(&["man", "run"])).contains("fail"));
    let unknown = metachron(&["man", "fly"]);
    assert_eq!(code(&unknown), 2);
    assert!(err(&unknown).contains("fly"));
}

#[test]
fn check_accepts_the_built_in_scenes() {
    let check = metachron(&[
        "check",
        "tube",
        "pendulum",
        "yard",
        "overload",
        "stack",
        "chain",
        "pile",
        "crossing",
        "gripper",
        "mesentery",
        "organ",
        "cavity",
        "catenary",
    ]);
    assert_eq!((code(&check), out(&check).lines().count()), (0, 13), "{}", err(&check));
    assert!(metachron(&["check", "-q", "tube"]).stdout.is_empty());
}

fn written(text: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.toml");
    std::fs::write(&path, text).unwrap();
    let path = path.to_str().unwrap().to_owned();
    (folder, path)
}

const BAD: &str = "format = 1\n\n[[object]]\nname = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = -0.05\n";

#[test]
fn check_shows_file_line_column_text_and_what_was_expected() {
    let (_folder, path) = written(BAD);
    let check = metachron(&["check", &path]);
    assert_eq!(code(&check), 2);
    assert!(out(&check).is_empty());
    let said = err(&check);
    for word in ["my.toml:7:12", "radius_m = -0.05", "`radius_m` of `ball` is -0.05", "expected a number from 0.000001"]
    {
        assert!(said.contains(word), "{word} is not in:\n{said}");
    }
}

#[test]
fn a_scene_of_one_long_line_is_shown_around_what_is_wrong_and_huge_numbers_are_short() {
    let ball = |name: u32, radius: &str| {
        format!(
            "{{ name = \"b{name}\", model = \"rigid\", shape = \"ball\", radius_m = {radius}, position_m = [{name}, 0, 0] }}"
        )
    };
    let balls: Vec<_> = (0..2500).map(|k| ball(k, "0.1")).chain([ball(2500, "1e308")]).collect();
    let (_folder, path) =
        written(&format!("format = 1\nobject = [{}]\nx = \"{}\"\n", balls.join(", "), "a".repeat(200_000)));
    let check = metachron(&["check", &path]);
    let said = err(&check);
    assert_eq!(code(&check), 2, "{said}");
    assert!(said.contains("is 1e308") && said.contains("radius_m = 1e308, position_m"), "{said}");
    let widest = said.lines().map(|line| line.chars().count()).max();
    assert!(widest < Some(160), "a line of {widest:?}");
}

#[test]
fn check_as_json_says_the_same_to_programs() {
    let (_folder, path) = written(BAD);
    let check = metachron(&["check", "--json", "tube", &path]);
    let rows: serde_json::Value = serde_json::from_slice(&check.stdout).unwrap();
    assert_eq!((code(&check), rows[0]["ok"].as_bool(), rows[1]["ok"].as_bool()), (2, Some(true), Some(false)));
    let problem = &rows[1]["problems"][0];
    assert_eq!(
        (problem["line"].as_u64(), problem["column"].as_u64(), problem["text"].as_str()),
        (Some(7), Some(12), Some("-0.05"))
    );
    assert!(check.stderr.is_empty());
}

#[test]
fn a_scene_that_does_not_exist_is_bad_input_with_a_suggestion() {
    for arguments in [&["check", "tubee"][..], &["run", "tubee", "--headless"]] {
        let done = metachron(arguments);
        assert_eq!(code(&done), 2);
        assert!(err(&done).contains("did you mean `tube`?"), "{}", err(&done));
    }
    let done = metachron(&["run", "no/such.toml", "--headless"]);
    assert_eq!(code(&done), 2);
    assert!(err(&done).contains("no/such.toml") && err(&done).contains("pendulum"), "{}", err(&done));
}

#[test]
fn wrong_usage_ends_with_two_and_says_what_is_right() {
    for (arguments, word) in [
        (&["fly"][..], "fly"),
        (&["run", "--policy", "best"], "feedback"),
        (&["run", "--executor", "poll"], "lockstep"),
        (&["run", "--size", "big"], "1280x720"),
        (&["run", "--frames", "0"], "0"),
        (&["run", "--seconds", "-1"], "seconds"),
        (&["run", "--frames", "1", "--seconds", "1"], "--seconds"),
        (&["run", "--target-fps", "nan"], "1000"),
        (&["run", "--fail-on", "mised_share>1"], "did you mean `missed_share`?"),
        (&["run", "--fail-on", "missed_share"], "missed_share>0.01"),
        (&["run", "--set", "nothing"], "KEY=VALUE"),
        (&["run", "--headless", "--report", "no/such/folder.json"], "does not exist"),
        (&["run", "--headless", "--json", "--report", "-"], "choose one"),
        (&["run", "--headless", "--png", "-"], "--png -"),
        (&["run", "--headless", "--frames-csv", "-"], "name a file"),
        (&["run", "--headless", "--report", "a.png", "--png", "./a.png"], "--png ./a.png would overwrite --report"),
        (&["run", "--headless", "--png", "a.png", "--frames-csv", "a.png"], "would overwrite --png"),
        (&["run", "--headless", "--png", "a.jpg"], "ends in .png"),
        (&["run", "--headless", "--animation", "run.gltf"], "ends in .glb"),
        (&["run", "--headless", "--animation", "a.glb", "--glb", "a.glb"], "would overwrite --glb"),
        (&["run", "--headless", "--vtk", "-"], "--vtk -"),
        (&["run", "--headless", "--vtk", "Cargo.toml/series"], "expects a folder"),
        (&["run", "--headless", "--vtk", "a", "--frames-csv", "a/objects.csv"], "the folder of a/objects.csv"),
        (&["run", "--device", "simulated=a", "--device", "simulated=a"], "leads `a` twice"),
        (&["run", "--png", "a.png"], "add --headless"),
        (&["run", "--pace", "free"], "add --headless"),
        (&["run", "--pace", "slow"], "real-time"),
        (&["run", "--headless", "--pace", "free", "--device", "simulated=a"], "leave one of the two out"),
        (&["bench", "agents", "--agents", "0", "--out", "target"], "no case"),
        (&["check"], "SCENE"),
    ] {
        let done = metachron(arguments);
        assert_eq!(code(&done), 2, "{arguments:?}: {}", err(&done));
        assert!(err(&done).contains(word), "{arguments:?}: {word} is not in\n{}", err(&done));
    }
}

#[test]
fn an_override_that_is_wrong_is_shown_like_a_line_of_the_scene() {
    let done = metachron(&["run", "pendulum", "--headless", "--set", "object.ball.radius_m=-1"]);
    assert_eq!(code(&done), 2);
    assert!(err(&done).contains("object.ball.radius_m\" = -1"), "{}", err(&done));
    let done = metachron(&["check", "pendulum", "--set", "object.ball.radius_m=x"]);
    let said = err(&done);
    assert!(said.contains("expected a number") && !said.contains("does not exist"), "{said}");
    let done = metachron(&["check", "pendulum", "--set", "object.ball.n=-1"]);
    assert!(err(&done).contains("a whole number from 0 to 10"), "{}", err(&done));
    let done = metachron(&["check", "pendulum", "--set", "object.ball.radius_m=99999999999999999999"]);
    assert!(code(&done) == 2 && !err(&done).contains("i128"), "{}", err(&done));
    let done = metachron(&["check", "pendulum", "--set", "object.bell.radius_m=1"]);
    assert!(err(&done).contains("`object` has no entry `bell`"), "{}", err(&done));
}

/// Interrupts a benchmark as soon as its folder is there, which is after Ctrl-C can be caught.
#[cfg(unix)]
#[test]
fn an_interrupted_benchmark_keeps_the_rows_that_are_finished() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("rod");
    let arguments = ["bench", "rod", "--quick", "-q", "--out", out.to_str().unwrap()];
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_metachron"))
        .args(arguments)
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    while !out.is_dir() {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::yield_now();
    }
    let interrupt = format!("kill -INT {}", child.id());
    assert!(std::process::Command::new("sh").args(["-c", &interrupt]).status().unwrap().success());
    let done = child.wait_with_output().unwrap();
    assert_eq!(code(&done), 130, "{}", err(&done));
    let kept = std::fs::read_to_string(out.join("rod.csv")).map_or(0, |text| text.lines().count() - 1);
    let words = if kept == 0 { "nothing was written" } else { "the finished rows are written" };
    assert!(kept < 12 && err(&done).contains(words), "{kept} rows: {}", err(&done));
}

/// Hash and time of the last state in the report that a command has printed.
fn hash(output: &Output) -> (serde_json::Value, f64) {
    assert_eq!(code(output), 0, "{output:?}");
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    (report["state_hash"].clone(), report["sim_s"].as_f64().unwrap())
}

#[test]
fn a_recorded_run_is_repeated_to_the_same_state_and_a_cut_file_as_far_as_it_goes() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (record, cut) = (file("run.rec"), file("cut.rec"));
    let run =
        ["run", "pendulum", "--headless", "--executor", "lockstep", "--seconds", "3", "--set", "target.frame_hz=50"];
    let recorded = metachron(&[&run[..], &["--record", &record, "--report", "-", "--quiet"]].concat());
    let repeated = metachron(&["replay", &record, "--report", "-", "--quiet"]);
    assert_eq!(hash(&repeated).0, hash(&recorded).0);
    let (_, until_s) = hash(&metachron(&["replay", &record, "--until", "1.5", "--report", "-", "--quiet"]));
    assert!((until_s - 1.5).abs() < 1e-6, "{until_s} s");
    let bytes = std::fs::read(&record).unwrap();
    std::fs::write(&cut, &bytes[..bytes.len() - 5]).unwrap();
    let shorter = metachron(&["replay", &cut, "--report", "-"]);
    let (_, cut_s) = hash(&shorter);
    assert!(cut_s > 0.0 && cut_s < 3.0 && err(&shorter).contains("cut short"), "{cut_s} s: {}", err(&shorter));
    let mut damaged = bytes;
    *damaged.last_mut().unwrap() ^= 1;
    std::fs::write(&cut, damaged).unwrap();
    let damaged = metachron(&["replay", &cut, "--quiet"]);
    let said = err(&damaged);
    assert!(said.starts_with("warning: ") && said.contains("is damaged") && !said.contains("cut short"), "{said}");
    assert_eq!(code(&damaged), 0, "what is whole was repeated");
    std::fs::write(&cut, b"something else").unwrap();
    assert_eq!(code(&metachron(&["replay", &cut])), 2);
}

#[test]
fn the_replay_of_a_run_in_real_time_ends_in_the_state_that_its_report_has() {
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("run.rec").to_string_lossy().into_owned();
    // a step of theirs is in progress wherever a run ends
    for (scene, executor) in [("tube", "threads"), ("cavity", "threads"), ("tube", "pool"), ("cavity", "pool")] {
        let run = ["run", scene, "--headless", "--executor", executor, "--seconds", "0.2", "--size", "64x36"];
        let reported = hash(&metachron(&[&run[..], &["--record", &record, "--report", "-", "--quiet"]].concat()));
        let repeated = hash(&metachron(&["replay", &record, "--size", "64x36", "--report", "-", "--quiet"]));
        assert_eq!(repeated.0, reported.0, "{scene}, {executor}");
    }
}

/// A file may have 400 blocks, some 200 or 400 kB: it is as if the disk were full where it would have more.
#[cfg(unix)]
#[test]
fn a_disk_that_is_full_ends_the_run_which_is_reported_up_to_there() {
    let folder = tempfile::tempdir().unwrap();
    let run = "ulimit -f 400; exec \"$0\" run pendulum --headless --executor lockstep --seconds 600 \
               --mcap run.mcap --report report.json --frames-csv frames.csv";
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", run, env!("CARGO_BIN_EXE_metachron")]).current_dir(folder.path());
    let done = shell.output().unwrap();
    let said = err(&done);
    assert_eq!((code(&done), said.matches("os error").count()), (1, 1), "{said}");
    assert!(said.contains("run.mcap cannot be written"), "{said}");
    let report = std::fs::read_to_string(folder.path().join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let frames = report["frames"].as_u64().unwrap();
    assert!(frames > 0 && frames < 1000, "{frames}");
    let rows = std::fs::read_to_string(folder.path().join("frames.csv")).unwrap();
    assert_eq!(rows.lines().count() as u64, 1 + frames);
}

#[test]
fn a_replay_finds_the_meshes_of_its_scene_from_any_folder() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "format = 1\nexecutor = \"lockstep\"\nobject = [{ name = \"a\", model = \"rigid\", shape = \"mesh\", file = \"a.obj\" }]\n";
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    for (name, text) in [("a.toml", scene), ("a.obj", mesh)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let arguments = ["run", "a.toml", "--headless", "--frames", "3", "--record", "a.rec", "--quiet"];
    let mut run = std::process::Command::new(env!("CARGO_BIN_EXE_metachron"));
    let recorded = run.args(arguments).current_dir(folder.path()).output().unwrap();
    assert_eq!(code(&recorded), 0, "{}", err(&recorded));
    let again = metachron(&["replay", folder.path().join("a.rec").to_str().unwrap(), "--quiet"]);
    assert_eq!(code(&again), 0, "{}", err(&again));
}
