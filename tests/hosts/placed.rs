//! `run --hosts`: scenes that several processes step together, and processes that die meanwhile.

use assert_cmd::cargo::cargo_bin;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::Duration;

/// A host that waits for work, and ends with this.
struct Waiting {
    process: Child,
    wish: String,
}

impl Waiting {
    fn named(name: &str) -> Self {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let endpoint = format!("tcp/127.0.0.1:{port}");
        let mut process = Command::new(cargo_bin("metachron"));
        process.args(["host", "--name", name, "--listen", &endpoint, "--json"]);
        let mut process = process.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut lines = BufReader::new(process.stdout.take().unwrap());
        lines.read_line(&mut String::new()).unwrap();
        // it goes on writing
        thread::spawn(move || lines.lines().for_each(drop));
        Self { process, wish: format!("{name}={endpoint}") }
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Twelve balls in each other's ways on a floor.
fn balls(folder: &Path) -> String {
    let ball = |number: i32| {
        let (x, y, towards) = (f64::from(number % 4), 0.6 * f64::from(number / 4), 1.5 - 2.5 * f64::from(number % 2));
        format!(
            "[[object]]\nname = 'ball{number}'\nmodel = 'rigid'\nshape = 'ball'\nradius_m = 0.05\nmass_kg = 0.2\n\
             position_m = [{x}, {y}, 0.06]\nvelocity_m_s = [{towards}, 0.1, 0]\n"
        )
    };
    let floor = "[[object]]\nname = 'floor'\nmodel = 'rigid'\nshape = 'plane'\n";
    let path = folder.join("balls.toml");
    std::fs::write(&path, format!("format = 1\n{floor}{}", (0..12).map(ball).collect::<String>())).unwrap();
    path.to_string_lossy().into_owned()
}

const FREE: [&str; 6] = ["--headless", "--pace", "free", "--report", "-", "-q"];

fn run(scene: &str, seconds: &str, more: &[&str]) -> Output {
    let mut process = Command::new(cargo_bin("metachron"));
    process.args(["run", scene, "--seconds", seconds]).args(FREE).args(more).output().unwrap()
}

/// A run that lasts as long as the time that passes in it.
fn beside_the_clock(scene: &str, seconds: &str, hosts: &str) -> Child {
    let mut process = Command::new(cargo_bin("metachron"));
    process.args(["run", scene, "--seconds", seconds, "--headless", "--report", "-", "-q", "--hosts", hosts]);
    process.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Stops a process in three seconds, for longer than a link lasts.
#[cfg(unix)]
fn suspend(process: u32) {
    use nix::sys::signal::{Signal, kill};
    let send = |signal: Signal| kill(nix::unistd::Pid::from_raw(process as i32), signal).unwrap();
    thread::sleep(Duration::from_millis(3000));
    send(Signal::SIGSTOP);
    thread::sleep(Duration::from_millis(3500));
    send(Signal::SIGCONT);
}

fn report(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|_| panic!("no report: {}", String::from_utf8_lossy(&output.stderr)))
}

#[test]
fn a_scene_has_the_same_bits_on_one_and_two_hosts_and_in_one_process() {
    let folder = tempfile::tempdir().unwrap();
    let scene = balls(folder.path());
    // one whose steps are divided where it meets others
    let slow = std::fs::read_to_string(&scene).unwrap().replace("'ball5'\n", "'ball5'\nrate_hz = 60\n");
    std::fs::write(&scene, slow).unwrap();
    let whole = report(&run(&scene, "2", &["--executor", "lockstep"]));
    let hosts = ["bench", "lab2"].map(Waiting::named);
    let both = format!("{},{}", hosts[0].wish, hosts[1].wish);
    // the hosts wait for work again each time
    for wish in [&hosts[0].wish, &both, &both] {
        let placed = report(&run(&scene, "2", &["--hosts", wish]));
        assert_eq!(placed["state_hash"], whole["state_hash"], "{wish}: {}", placed["hosts"]);
        assert_eq!(placed["sim_s"], whole["sim_s"]);
        let agents: u64 = placed["hosts"].as_array().unwrap().iter().map(|host| host["agents"].as_u64().unwrap()).sum();
        assert_eq!(agents, 12);
        let steps = |report: &serde_json::Value| -> Vec<_> {
            report["agents"].as_array().unwrap().iter().map(|agent| agent["steps"].clone()).collect()
        };
        assert_eq!(steps(&placed), steps(&whole));
    }
}

#[test]
fn a_run_ends_with_a_whole_frame_at_any_rate() {
    let folder = tempfile::tempdir().unwrap();
    let scene = balls(folder.path());
    let host = Waiting::named("bench");
    for fps in ["30", "45.5", "60"] {
        let ended = |more: [&str; 2]| report(&run(&scene, "0.1", &["--target-fps", fps, more[0], more[1]]));
        let [placed, whole] = [ended(["--hosts", &host.wish]), ended(["--executor", "lockstep"])];
        for key in ["sim_s", "state_hash"] {
            assert_eq!(placed[key], whole[key], "{key} at {fps}");
        }
    }
}

#[test]
fn a_pinned_object_is_on_its_host() {
    let folder = tempfile::tempdir().unwrap();
    let scene = balls(folder.path());
    let hosts = ["bench", "lab2"].map(Waiting::named);
    let both = format!("{},{}", hosts[0].wish, hosts[1].wish);
    // all that a ball in the middle meets is with it: lab2 has the most
    let placed = report(&run(&scene, "1", &["--hosts", &both, "--host-of", "ball5=lab2"]));
    let whole = report(&run(&scene, "1", &["--executor", "lockstep"]));
    assert_eq!(placed["state_hash"], whole["state_hash"], "{}", placed["hosts"]);
    let agents = placed["agents"].as_array().unwrap();
    let ball = agents.iter().find(|agent| agent["name"] == "ball5").unwrap();
    assert_eq!(ball["host"], "lab2", "{}", placed["hosts"]);
    let wrong = run(&scene, "1", &["--hosts", &both, "--host-of", "ball5=lab3"]);
    let said = String::from_utf8_lossy(&wrong.stderr).into_owned();
    assert!(
        wrong.status.code() == Some(2)
            && said.contains("object \"ball5\" is \"lab3\": expected one of the hosts bench, lab2"),
        "{said}"
    );
}

#[test]
fn a_host_that_is_killed_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let scene = balls(folder.path());
    let whole = report(&run(&scene, "4", &["--executor", "lockstep"]));
    let (stays, mut dies) = (Waiting::named("bench"), Waiting::named("lab2"));
    let both = format!("{},{}", stays.wish, dies.wish);
    let process = beside_the_clock(&scene, "4", &both);
    thread::sleep(Duration::from_millis(3000));
    dies.process.kill().unwrap();
    let placed = report(&process.wait_with_output().unwrap());
    assert_eq!(placed["state_hash"], whole["state_hash"], "{}", placed["hosts"]);
    let [first, second] = [0, 1].map(|host| &placed["hosts"][host]);
    assert!(first["agents"] == 12 && first["reborn"].as_u64().unwrap() > 0, "{first}");
    assert!(second["agents"] == 0 && second["lost"].is_string(), "{second}");
}

#[test]
#[cfg(unix)]
fn a_run_that_is_suspended_goes_on_with_its_hosts() {
    let folder = tempfile::tempdir().unwrap();
    let scene = balls(folder.path());
    let whole = report(&run(&scene, "4", &["--executor", "lockstep"]));
    let hosts = ["bench", "lab2"].map(Waiting::named);
    let both = format!("{},{}", hosts[0].wish, hosts[1].wish);
    let process = beside_the_clock(&scene, "4", &both);
    suspend(process.id());
    let placed = report(&process.wait_with_output().unwrap());
    assert_eq!(placed["state_hash"], whole["state_hash"], "{}", placed["hosts"]);
    assert!(placed["hosts"].as_array().unwrap().iter().any(|host| host["lost"].is_null()), "{}", placed["hosts"]);
}

#[test]
fn hosts_that_cannot_be_are_told_in_a_sentence() {
    let serves = Waiting::named("bench");
    let twice = format!("{},{}", serves.wish, serves.wish);
    for (wish, what) in [
        (&*twice, "\"bench\" is empty or there twice"),
        ("bench=tcp/127.0.0.1:9", "Unable to connect"),
        ("a=b", "is no endpoint"),
    ] {
        let ended = run("pendulum", "1", &["--hosts", wish]);
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert!(!ended.status.success() && said.contains(what), "{wish}: {said}");
    }
}

#[test]
#[cfg(unix)]
fn a_host_that_comes_back_late_is_told_and_steps_again() {
    let folder = tempfile::tempdir().unwrap();
    let scene = balls(folder.path());
    let whole = report(&run(&scene, "8", &["--executor", "lockstep"]));
    let (stays, sleeps) = (Waiting::named("bench"), Waiting::named("lab2"));
    let both = format!("{},{}", stays.wish, sleeps.wish);
    let process = beside_the_clock(&scene, "8", &both);
    suspend(sleeps.process.id());
    let placed = report(&process.wait_with_output().unwrap());
    assert_eq!(placed["state_hash"], whole["state_hash"], "{}", placed["hosts"]);
    let [first, second] = [0, 1].map(|host| &placed["hosts"][host]);
    assert!(first["reborn"].as_u64().unwrap() > 0, "{first}");
    assert!(second["lost"].is_null() && second["agents"].as_u64().unwrap() > 0, "{second}");
}
