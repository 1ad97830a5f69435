//! The commands `host` and `view` as two processes: a world served by one is seen by the other, frame by frame.

use assert_cmd::cargo::cargo_bin;
use metachron::hosts::{RemoteWorld, connect};
use metachron::prelude::*;
use metachron::world::WorldCalls;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, ChildStdout, Command as Process, Output, Stdio};

/// A ball falls from 400 m for as long as anything here lasts, a tetrahedron from a file lies on the floor.
const SCENE: &str = "format = 1\nexecutor = 'threads'\n[target]\nframe_hz = 50.0\n\
    [[object]]\nname = 'ball'\nmodel = 'rigid'\nshape = 'ball'\nradius_m = 0.1\nposition_m = [0, 5, 400]\n\
    [[object]]\nname = 'wedge'\nmodel = 'rigid'\nshape = 'hull'\nfile = 'meshes/wedge.obj'\nposition_m = [0, 0, 1]\n\
    [[object]]\nname = 'floor'\nmodel = 'rigid'\nshape = 'plane'\n";
const WEDGE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

/// A tray in a hand with a load of 50 g on it.
const TRAY: &str = "format = 1\nexecutor = 'threads'\n\
    [[object]]\nname = 'tray'\nmodel = 'rigid'\nshape = 'box'\nhalf_extents_m = [0.1, 0.1, 0.01]\nkinematic = true\nposition_m = [0, 0, 0.5]\n\
    [[object]]\nname = 'load'\nmodel = 'rigid'\nshape = 'box'\nhalf_extents_m = [0.02, 0.02, 0.02]\nmass_kg = 0.05\nposition_m = [0, 0, 0.531]\n";

/// A host that ends with this.
struct Host {
    process: Child,
    lines: BufReader<ChildStdout>,
    endpoint: String,
}

impl Host {
    fn of(scene: &Path, arguments: &[&str]) -> Self {
        Self::at("tcp/127.0.0.1", scene, arguments)
    }

    /// One that listens at an address.
    fn at(address: &str, scene: &Path, arguments: &[&str]) -> Self {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let endpoint = format!("{address}:{port}");
        let mut process = Process::new(cargo_bin("metachron"));
        process.arg("host").arg(scene).args(["--name", "bench", "--listen", &endpoint, "--json"]).args(arguments);
        let mut process = process.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let lines = BufReader::new(process.stdout.take().unwrap());
        let mut host = Self { process, lines, endpoint };
        host.line();
        host
    }

    /// Its next line.
    fn line(&mut self) -> serde_json::Value {
        let mut line = String::new();
        self.lines.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|_| panic!("a line of the host: {line:?}"))
    }

    fn connect(&self) -> RemoteWorld {
        connect(&self.endpoint).unwrap()
    }

    fn view(&self, arguments: &[&str]) -> Output {
        let mut process = Process::new(cargo_bin("metachron"));
        process.args(["view", &self.endpoint, "--headless"]).args(arguments).output().unwrap()
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("meshes")).unwrap();
    std::fs::write(folder.path().join("meshes/wedge.obj"), WEDGE).unwrap();
    std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    folder
}

#[test]
fn a_world_that_a_host_serves_is_seen_elsewhere_with_the_files_of_its_scene() {
    let folder = folder();
    let mut host = Host::of(&folder.path().join("scene.toml"), &[]);
    // where it is seen there are none of its files
    std::fs::remove_dir_all(folder.path()).unwrap();
    let said = host.line();
    assert_eq!((said["agents"].as_u64(), said["callers"].as_u64()), (Some(2), Some(0)), "{said}");
    let none = serde_json::json!({ "malformed": 0, "flooded": 0, "repeated": 0, "strangers": 0, "forbidden": 0 });
    assert_eq!((&said["refused"], &said["insecure_lan"]), (&none, &serde_json::json!(false)));
    let world = host.connect();
    let before_s = world.time().as_secs_f64();
    let seen = host.view(&["--seconds", "1", "--report", "-", "-q"]);
    let report: serde_json::Value = serde_json::from_slice(&seen.stdout)
        .unwrap_or_else(|_| panic!("no report: {}", String::from_utf8_lossy(&seen.stderr)));
    assert!(seen.status.success() && report["frames"].as_u64().unwrap() > 5, "{report}");
    let ball = &report["agents"][0];
    assert_eq!((ball["name"].as_str(), ball["state"].as_str()), (Some("ball"), Some("running")), "{ball}");
    assert!(ball["steps"].as_u64().unwrap() > 50 && report["sim_s"].as_f64().unwrap() > before_s + 1.0, "{report}");
    // 400 m of fall last nine seconds; g t²/2 at the time of the state
    let state = world.latest(world.object("ball").unwrap()).unwrap();
    let (place, time_s) = (state.body.probe(0.0).unwrap().0, state.time.as_secs_f64());
    assert!(time_s > 1.0 && (400.0 - place.z - 0.5 * 9.81 * time_s * time_s).abs() < 1e-3, "{place} at {time_s} s");
}

#[test]
#[cfg(unix)]
fn a_host_whose_time_stands_lets_callers_drive_it_and_ends_with_its_signal() {
    use nix::sys::signal::{Signal, kill};
    let folder = folder();
    let mut host = Host::of(&folder.path().join("scene.toml"), &["--paused"]);
    let world = host.connect();
    assert_eq!(world.time(), SimTime::ZERO);
    world.advance(SimSpan::from_millis(100)).unwrap();
    assert_eq!(world.time(), SimTime::ZERO + SimSpan::from_millis(100));
    while host.line()["callers"] != 1 {}
    kill(nix::unistd::Pid::from_raw(host.process.id() as i32), Signal::SIGINT).unwrap();
    assert_eq!(host.process.wait().unwrap().code(), Some(0));
}

#[test]
fn certificates_that_the_command_makes_let_a_viewer_in_and_an_open_world_says_so() {
    let folder = folder();
    let issue = |name: &str, more: &[&str]| {
        let new = ["identity", "new", name, "--authority", "lab.pem", "--address", "127.0.0.1"];
        Process::new(cargo_bin("metachron")).args(new).args(more).current_dir(&folder).output().unwrap()
    };
    let mistyped = issue("bench", &[]);
    assert!(String::from_utf8_lossy(&mistyped.stderr).contains("lab.pem: no authority is there"), "{mistyped:?}");
    assert!(issue("bench", &["--new-authority"]).status.success());
    for name in ["screen", "unnamed"] {
        assert!(issue(name, &[]).status.success());
    }
    assert_eq!(issue("bench", &[]).status.code(), Some(2), "a file that is there stays");
    assert_eq!(issue("other", &["--new-authority"]).status.code(), Some(2), "and so does an authority");
    assert_eq!(issue("other", &["--address", "10.0.0.256"]).status.code(), Some(2));
    let pem = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (bench, screen, unnamed) = (pem("bench.pem"), pem("screen.pem"), pem("unnamed.pem"));
    let scene = folder.path().join("scene.toml");
    let host = Host::at("tls/127.0.0.1", &scene, &["--identity", &bench, "--viewers", "screen"]);
    let view = |identity: &str| host.view(&["--identity", identity, "--frames", "3", "--report", "-", "-q"]);
    assert!(view(&screen).status.success());
    assert_eq!(view(&unnamed).status.code(), Some(1));
    drop(host);
    let mut open = Host::at("tcp/0.0.0.0", &scene, &["--insecure-lan"]);
    assert_eq!(open.line()["insecure_lan"], true);
    let seen = open.view(&["--insecure-lan", "--frames", "3", "--report", "-", "-q"]);
    let report: serde_json::Value = serde_json::from_slice(&seen.stdout).unwrap();
    assert!(report["notes"][0].as_str().unwrap().contains("any process of the network"), "{report}");
}

#[test]
fn a_view_of_a_world_whose_time_stands_ends_and_says_so() {
    let folder = folder();
    let host = Host::of(&folder.path().join("scene.toml"), &["--paused"]);
    let seen = host.view(&["--seconds", "0.5", "--report", "-", "-q"]);
    let said = String::from_utf8_lossy(&seen.stderr).into_owned();
    assert_eq!(seen.status.code(), Some(1), "{said}");
    assert!(said.contains("the time of the world has stood at 0 s for 0."), "{said}");
    let report: serde_json::Value = serde_json::from_slice(&seen.stdout).unwrap();
    assert!(report["frames"].as_u64().unwrap() > 1, "{report}");
}

#[test]
fn a_device_of_one_process_leads_an_object_of_another_and_feels_what_lies_on_it() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("tray.toml");
    std::fs::write(&scene, TRAY).unwrap();
    let host = Host::of(&scene, &[]);
    let tool = |leads: &str, seconds: &str| {
        let mut process = Process::new(cargo_bin("metachron"));
        process.args(["tool", "--device", "simulated", "--leads", leads, "--connect", &host.endpoint]);
        process.args(["--seconds", seconds, "--json"]);
        process
    };
    let served = tool("tray", "3").output().unwrap();
    let said = String::from_utf8_lossy(&served.stdout).into_owned();
    assert!(served.status.success(), "{said} {}", String::from_utf8_lossy(&served.stderr));
    let report: serde_json::Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    let number = |key: &str| report[key].as_f64().unwrap();
    assert!(number("ticks") > 500.0 && number("failures") == 0.0, "{report}");
    // the load weighs 0.49 N; a machine that is busy lets some of the force fade
    assert!(number("force_mean_n") > 0.1 && number("energy_out_j") <= number("tank_j"), "{report}");
    // the hand's spring of 150 N/m gives way to that
    let world = host.connect();
    let tray = world.latest(world.object("tray").unwrap()).unwrap();
    assert!((-0.02..-1e-4).contains(&(tray.body.probe(0.0).unwrap().0.z - 0.5)), "{:?}", tray.body);
    for (leads, what) in
        [("none", "--leads: the world has no moving object"), ("load", "a device leads kinematic bodies and tools")]
    {
        let ended = tool(leads, "3").output().unwrap();
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert!(ended.status.code() == Some(2) && said.contains(what), "{said}");
    }
    // a host that falls silent ends it with an error, behind the device's last line
    let mut longer = tool("tray", "60").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(longer.stdout.take().unwrap()).lines();
    assert!(lines.next().is_some());
    drop(host);
    let last = lines.last().unwrap().unwrap();
    let report: serde_json::Value = serde_json::from_str(&last).unwrap();
    assert!(report["ticks"].as_u64().unwrap() > 0, "{last}");
    let ended = longer.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert!(ended.status.code() == Some(1) && said.contains("silent"), "{said}");
}

#[test]
fn an_endpoint_that_cannot_be_is_bad_input_in_one_sentence() {
    for (arguments, what) in [
        (["host", "pendulum", "--listen", "tcp/10.0.0.1"], "is no endpoint"),
        (["host", "pendulum", "--listen", "tcp/10.0.0.1:7447"], "expected tls/ with an identity, or --insecure-lan"),
        (["host", "pendulum", "--listen", "tls/127.0.0.1:7447"], "there is no identity"),
        (["host", "pendulum", "--identity", "none.pem"], "none.pem"),
        (["host", "pendulum", "--name", "a b"], "cannot name a world"),
        (["view", "smoke/127.0.0.1:1", "--headless", "-q"], "is no endpoint"),
    ] {
        let ended = Process::new(cargo_bin("metachron")).args(arguments).output().unwrap();
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert_eq!(ended.status.code(), Some(2), "{said}");
        assert!(said.contains(what), "{said}");
    }
}
