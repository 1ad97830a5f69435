//! The outputs of a run, and their places.

use crate::play::{Folder, agent, metachron, number, program, report_of};
use serde_json::Value;

const BALL: &str =
    "[[object]]\nname = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nposition_m = [0, 0, 1]\n";

fn run(scene: &Folder, arguments: &[&str]) -> std::process::Output {
    let fixed = ["run", scene.scene(), "--headless", "--executor", "lockstep", "--frames", "7"];
    let done = metachron(&[&fixed[..], arguments].concat());
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    done
}

#[test]
fn the_rows_of_frames_are_one_a_frame_with_the_documented_columns() {
    let scene = Folder::with(BALL);
    let path = scene.file("frames.csv");
    run(&scene, &["--frames-csv", &path, "-q"]);
    let text = std::fs::read_to_string(path).unwrap();
    let mut rows = text.lines();
    let columns = "frame,sim_s,frame_ms,gpu_ms,interval_ms,full_ms,triangles,objects,potentially_visible,drawn,cull_ms,select_ms,draw_ms,lag_ms,\
                   predicted_ms,value_over_bound,changes,reversals,holes,passes,eps,n,render_scale,shadows,points,lines,flat,gouraud,\
                   per_pixel,textured,shadowed";
    assert_eq!(rows.next(), Some(columns));
    let rows: Vec<Vec<&str>> = rows.map(|row| row.split(',').collect()).collect();
    assert_eq!(rows.len(), 7);
    for (k, row) in rows.iter().enumerate() {
        assert_eq!((row.len(), row[0].parse(), row[22], row[23]), (31, Ok(k), "1.0", "true"));
        assert_eq!(row[3], "", "no adapter works in virtual time");
        let shown_s: f64 = row[1].parse().unwrap();
        assert!((shown_s - k as f64 / 60.0).abs() < 1e-8, "{row:?}"); // at most 7 periods, each rounded to a nanosecond
    }
}

#[test]
fn what_is_data_is_json_and_nothing_else_is_on_standard_output() {
    let scene = Folder::with(BALL);
    for arguments in [&["--json"][..], &["--json", "-q"], &["--report", "-"], &["--report", "-", "-q"]] {
        let report: Value = serde_json::from_slice(&run(&scene, arguments).stdout).unwrap();
        assert_eq!(report["frames"], 7, "{arguments:?}");
    }
    let path = scene.file("report.json");
    let quiet = run(&scene, &["-q", "--report", &path]);
    assert!(quiet.stdout.is_empty() && quiet.stderr.is_empty(), "{}", String::from_utf8_lossy(&quiet.stderr));
    let both: Value = serde_json::from_slice(&run(&scene, &["--json", "--report", &path]).stdout).unwrap();
    let file: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert!(both == file);
    let summary = String::from_utf8(run(&scene, &[]).stdout).unwrap();
    assert!(summary.contains("7 frames") && summary.contains("ball"), "{summary}");
}

#[test]
fn what_cannot_be_written_ends_with_one_and_names_the_file_once() {
    let scene = Folder::with(BALL);
    if !std::path::Path::new("/dev/full").exists() {
        return;
    }
    for flag in ["--report", "--frames-csv"] {
        let done = metachron(&[
            "run",
            scene.scene(),
            "--headless",
            "--executor",
            "lockstep",
            "--frames",
            "2",
            flag,
            "/dev/full",
        ]);
        let said = String::from_utf8(done.stderr).unwrap();
        assert_eq!((done.status.code(), said.matches("/dev/full").count()), (Some(1), 1), "{said}");
    }
}

#[test]
fn a_picture_has_the_size_that_was_asked_for() {
    let scene = Folder::with(BALL);
    let path = scene.file("last.png");
    let done = run(&scene, &["--png", &path, "--size", "97x31", "--json", "-q"]);
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    if report["adapter"].is_null() {
        let required = std::env::var("METACHRON_REQUIRE_ADAPTER").is_ok_and(|v| v == "1");
        assert!(!required, "{}", String::from_utf8_lossy(&done.stderr));
        eprintln!("picture test skipped: {}", String::from_utf8_lossy(&done.stderr));
        return;
    }
    let picture = image::open(path).unwrap().to_rgb8();
    assert_eq!(picture.dimensions(), (97, 31));
    let first = picture.get_pixel(0, 0);
    assert!(picture.pixels().any(|p| p != first), "the ball is not to be seen");
}

#[test]
fn a_film_has_a_frame_for_every_tick_of_a_lockstep_run() {
    let scene = Folder::with(BALL);
    let path = scene.file("film.y4m");
    if let Err(error) = metachron_render::Gpu::headless() {
        assert!(std::env::var("METACHRON_REQUIRE_ADAPTER").is_err(), "{error}");
        return eprintln!("film test skipped: {error}");
    }
    run(&scene, &["--target-fps", "50", "--size", "32x16", "--video", &path]);
    let film = std::fs::read(&path).unwrap();
    let head = b"YUV4MPEG2 W32 H16 F50000:1000 Ip A1:1 C420jpeg\n";
    assert!(film.starts_with(head), "{}", String::from_utf8_lossy(&film[..head.len()]));
    assert_eq!(film.len(), head.len() + 7 * (b"FRAME\n".len() + 32 * 16 * 3 / 2));
    for (wrong, said) in [("film.mp4", "name one that ends in .y4m"), ("-", "would write to standard output")] {
        let refused = metachron(&["run", scene.scene(), "--headless", "--video", wrong]);
        assert!(String::from_utf8_lossy(&refused.stderr).contains(said), "{wrong}");
    }
}

#[test]
fn the_overrides_reach_the_run() {
    let scene = Folder::with(BALL);
    let report = report_of(
        scene.scene(),
        &["--executor", "lockstep", "--frames", "20", "--target-fps", "20", "--set", "object.ball.rate_hz=100"],
    );
    assert_eq!(number(&report, "/target_ms"), 50.0);
    assert_eq!(number(agent(&report, "ball"), "/wanted_hz"), 100.0);
    assert!((number(agent(&report, "ball"), "/rate_hz") - 100.0).abs() < 1e-6);
}

#[test]
fn the_environment_says_headless_as_environments_do() {
    let scene = Folder::with(BALL);
    let traces = |value: &str| {
        let mut child = program();
        child.current_dir(scene.folder()).env("METACHRON_HEADLESS", value);
        let done =
            child.args(["run", scene.scene(), "--executor", "lockstep", "--frames", "1", "-q"]).output().unwrap();
        assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
        std::fs::read_dir(scene.folder()).unwrap().count() - 1
    };
    for headless in ["1", "true", "yes", "on"] {
        assert_eq!(traces(headless), 0, "{headless}: a headless run leaves nothing behind");
    }
    for windowed in ["0", "false", "no", ""] {
        assert!(traces(windowed) > 0, "{windowed}: without a display a run leaves its report");
    }
}

#[test]
fn no_output_overwrites_the_scene_and_no_generated_scene_a_file() {
    let scene = Folder::with(BALL);
    let before = std::fs::read_to_string(scene.scene()).unwrap();
    for flag in ["--report", "--mcap", "--frames-csv"] {
        let done = metachron(&["run", scene.scene(), "--headless", flag, scene.scene()]);
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(done.status.code() == Some(2) && said.contains("which the scene is read from"), "{said}");
    }
    let generate = |more: &[&str]| metachron(&[&["generate", "domes", "--out", scene.scene()], more].concat());
    let refused = generate(&[]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8(refused.stderr).unwrap().contains("--force overwrites it"));
    assert_eq!(std::fs::read_to_string(scene.scene()).unwrap(), before);
    assert_eq!(generate(&["--force"]).status.code(), Some(0));
    assert_ne!(std::fs::read_to_string(scene.scene()).unwrap(), before);
}

/// A scene whose body is the mesh `a.obj`.
fn meshed() -> Folder {
    let scene = Folder::with("[[object]]\nname = \"a\"\nmodel = \"rigid\"\nshape = \"mesh\"\nfile = \"a.obj\"\n");
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::fs::write(scene.file("a.obj"), mesh).unwrap();
    scene
}

#[cfg(unix)]
#[test]
fn no_output_overwrites_a_file_of_the_scene_by_whatever_name() {
    let scene = meshed();
    let mesh = std::fs::read(scene.file("a.obj")).unwrap();
    std::fs::hard_link(scene.file("a.obj"), scene.file("hard.glb")).unwrap();
    std::os::unix::fs::symlink("a.obj", scene.file("soft.csv")).unwrap();
    std::fs::hard_link(scene.scene(), scene.file("scene.mcap")).unwrap();
    for (flag, name, read) in [
        ("--glb", "hard.glb", "a.obj"),
        ("--animation", "hard.glb", "a.obj"),
        ("--frames-csv", "soft.csv", "a.obj"),
        ("--mcap", "scene.mcap", scene.scene()),
        ("--record", "a.obj", "a.obj"),
    ] {
        let file = scene.file(name);
        let done = metachron(&["run", scene.scene(), "--headless", "--frames", "1", flag, &file]);
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(done.status.code() == Some(2) && said.contains(&format!("{flag} {file} would overwrite ")), "{said}");
        assert!(said.contains(&format!("{read}, which the scene is read from")), "{said}");
    }
    assert_eq!(std::fs::read(scene.file("a.obj")).unwrap(), mesh);
    // a replay reads the meshes again
    run(&scene, &["-q", "--record", &scene.file("run.rec")]);
    for (flag, file, read) in [("--glb", &*scene.file("hard.glb"), "a.obj"), ("--report", scene.scene(), scene.scene())]
    {
        let replay = metachron(&["replay", &scene.file("run.rec"), flag, file]);
        let said = String::from_utf8_lossy(&replay.stderr);
        assert!(replay.status.code() == Some(2) && said.contains(&format!("{read}, which the scene")), "{said}");
    }
    // an output that shares its bytes with a file of something else leaves those alone
    std::fs::write(scene.file("other.json"), "other").unwrap();
    std::fs::hard_link(scene.file("other.json"), scene.file("report.json")).unwrap();
    run(&scene, &["-q", "--report", &scene.file("report.json")]);
    assert_eq!(std::fs::read_to_string(scene.file("other.json")).unwrap(), "other");
    assert!(std::fs::read_to_string(scene.file("report.json")).unwrap().contains("state_hash"));
}

/// The files in the folder of a scene that are not whole yet.
fn partial(scene: &Folder) -> usize {
    let entries = std::fs::read_dir(scene.folder()).unwrap();
    entries.filter(|entry| entry.as_ref().unwrap().file_name().to_string_lossy().ends_with(".partial")).count()
}

#[test]
fn a_run_that_is_killed_leaves_what_an_earlier_one_wrote_but_for_files_that_grow() {
    let scene = Folder::with(BALL);
    let (animation, glb, mcap) = (scene.file("run.glb"), scene.file("last.glb"), scene.file("run.mcap"));
    [&animation, &glb, &mcap].into_iter().for_each(|path| std::fs::write(path, "old").unwrap());
    let arguments = ["run", scene.scene(), "--headless", "--executor", "lockstep", "--seconds", "1e6", "-q"];
    let mut child = program();
    child.args(arguments).args(["--animation", &animation, "--glb", &glb, "--mcap", &mcap]);
    let mut child = child.spawn().unwrap();
    while std::fs::read(&mcap).unwrap().len() < 1000 {
        assert!(child.try_wait().unwrap().is_none(), "the run has ended");
        std::thread::yield_now();
    }
    assert_eq!(partial(&scene), 1, "the animation");
    child.kill().unwrap();
    child.wait().unwrap();
    for path in [animation, glb] {
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old", "{path}");
    }
    assert!(std::fs::read(mcap).unwrap().starts_with(b"\x89MCAP"));
}

/// A file may have one block, of half a kB or one: it is as if the disk were full.
#[cfg(unix)]
#[test]
fn what_does_not_fit_on_a_disk_leaves_what_was_there() {
    let scene = Folder::with(BALL);
    for (flag, name) in [("--animation", "run.glb"), ("--glb", "last.glb"), ("--report", "report.json")] {
        let path = scene.file(name);
        std::fs::write(&path, "old").unwrap();
        let run = "ulimit -f 1; exec \"$@\"";
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", run, "sh", env!("CARGO_BIN_EXE_metachron"), "run", scene.scene(), "--headless"]);
        let done = shell.args(["--executor", "lockstep", "--frames", "3", flag, &path]).output().unwrap();
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(done.status.code() == Some(1) && said.contains(&format!("{path} cannot be written")), "{said}");
        assert_eq!((std::fs::read_to_string(&path).unwrap().as_str(), partial(&scene)), ("old", 0), "{name}");
    }
}

/// The program where no adapter can be found.
fn blind(arguments: &[&str]) -> std::process::Output {
    let mut command = program();
    command
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("WGPU_BACKEND", "vulkan");
    command.args(arguments).output().unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn without_an_adapter_a_picture_is_refused_and_frame_times_are_not_judged() {
    let scene = Folder::with(BALL);
    let path = scene.file("last.png");
    let fixed = ["run", scene.scene(), "--headless", "--frames", "3"];
    let done = blind(&[&fixed[..], &["--png", &path]].concat());
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.code() == Some(1) && said.contains("cannot be drawn"), "{said}");
    assert!(said.find("Mesa").unwrap() < said.find("No suitable").unwrap(), "advice first: {said}");
    assert!(!std::path::Path::new(&path).exists());
    assert_eq!(blind(&fixed).status.code(), Some(0), "without a picture none is needed");
    for goal in ["frame_ms.p99>1000", "missed_share>0.5", "gpu_ms.max>1000"] {
        let done = blind(&[&fixed[..], &["--fail-on", goal]].concat());
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(done.status.code() == Some(4) && said.contains("was not measured"), "{goal}: {said}");
    }
}

#[test]
fn a_run_begins_when_its_first_picture_is_there() {
    let scene = Folder::with(BALL);
    // far shorter than pipelines take to be made, where there is an adapter
    let report = report_of(scene.scene(), &["--seconds", "0.02"]);
    assert!(report["frames"].as_u64().unwrap() >= 1 && number(&report, "/sim_s") >= 0.02, "{report}");
}

#[test]
fn virtual_time_that_waits_for_a_window_passes_without_one() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["run", "stack", "--executor", "lockstep", "--seconds", "0.2", "--report", "report.json", "-q"];
    let done = program().args(arguments).current_dir(folder.path()).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let text = std::fs::read_to_string(folder.path().join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(number(&report, "/agents/0/steps") > 40.0, "{}", report["agents"][0]);
}
