//! Settings that `tune` refuses, files that it overwrites, how it is stopped and goes on.

use crate::play::{Folder, metachron, number, program};
use crate::tune::dear_ball;
use serde_json::Value;
use std::path::Path;
use std::process::Stdio;

/// Code 2 and the message.
fn refused(arguments: &[&str]) -> String {
    let done = metachron(arguments);
    let said = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(2), "{arguments:?}: {said}");
    assert!(done.stdout.is_empty());
    said
}

#[test]
fn gains_that_are_zero_or_negative_are_refused_with_what_is_expected() {
    for gains in ["α=0", "α=-1e-4", "β=0", "kappa=0", "kappa=-0.5", "law=normalised,k=-1"] {
        let said = refused(&["tune", "tube", "--analyse", gains]);
        assert!(said.contains("expected") && said.lines().count() == 1, "{gains}: {said}");
    }
}

#[test]
fn a_scene_with_nothing_to_control_is_refused() {
    let text = "[[object]]\nname = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.05\nn = [2, 2]\n";
    let folder = Folder::with(text);
    let gains = folder.file("gains.toml");
    let said = refused(&["tune", folder.scene(), "--quick", "-q", "--gains", &gains]);
    assert!(said.contains("nothing to control"), "{said}");
    assert!(!Path::new(&gains).exists());
}

#[test]
fn a_target_that_no_resolution_can_reach_is_refused_with_rates_that_can_be() {
    let folder = dear_ball();
    let gains = folder.file("gains.toml");
    let said = refused(&["tune", folder.scene(), "--quick", "-q", "--target-fps", "400", "--gains", &gains]);
    assert!(said.contains("coarsest") && said.contains("Choose a rate between"), "{said}");
    let said = refused(&["tune", folder.scene(), "--quick", "-q", "--target-fps", "5", "--gains", &gains]);
    assert!(said.contains("finest") && said.contains("Choose a rate between"), "{said}");
    assert!(!Path::new(&gains).exists());
}

#[test]
fn a_plant_that_does_not_respond_is_refused() {
    let folder = dear_ball();
    let gains = folder.file("gains.toml");
    let free = "machine.draw_triangle_us=0.0";
    let said = refused(&["tune", folder.scene(), "--quick", "-q", "--set", free, "--gains", &gains]);
    assert!(said.contains("does not depend"), "{said}");
    assert!(!Path::new(&gains).exists());
}

#[test]
fn gains_that_are_there_are_overwritten_with_force_alone() {
    let folder = dear_ball();
    let gains = folder.file("gains.toml");
    std::fs::write(&gains, "mine").unwrap();
    let out = folder.file("charts");
    let arguments = ["tune", folder.scene(), "--quick", "-q", "--gains", &gains, "--out", &out];
    let said = refused(&arguments);
    assert!(said.contains("--force"), "{said}");
    assert_eq!(std::fs::read_to_string(&gains).unwrap(), "mine");
    assert_eq!(metachron(&[&arguments[..], &["--force"]].concat()).status.code(), Some(0));
    assert!(std::fs::read_to_string(&gains).unwrap().contains("kappa"));
    let said = refused(&["tune", folder.scene(), "--quick", "-q", "--gains", &folder.file("no/gains.toml")]);
    assert!(said.contains("does not exist"), "{said}");
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_the_best_gains_so_far() {
    let folder = dear_ball();
    let (gains, out) = (folder.file("gains.toml"), folder.file("charts"));
    let mut child = program()
        .args(["tune", folder.scene(), "--json", "-q", "--gains", &gains, "--out", &out])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // the folder is made when the search begins
    while !Path::new(&out).exists() {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::yield_now();
    }
    let interrupt = format!("kill -INT {}", child.id());
    assert!(std::process::Command::new("sh").args(["-c", &interrupt]).status().unwrap().success());
    let done = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(130), "{said}");
    assert!(said.contains("best gains so far"), "{said}");
    let found: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(found["interrupted"], true);
    let fragment: toml::Table = std::fs::read_to_string(&gains).unwrap().parse().unwrap();
    assert_eq!(fragment["target"]["kappa"].as_float(), Some(number(&found, "/gains/kappa")));
}

#[test]
fn a_search_that_was_killed_goes_on_from_where_it_was_and_finds_the_same_to_the_bit() {
    let folder = dear_ball();
    let out = folder.file("charts");
    let arguments = |gains| ["tune", folder.scene(), "--quick", "--json", "-q", "--out", &out, "--gains", gains];
    let [whole, killed, other] = ["whole.toml", "killed.toml", "other.toml"].map(|name| folder.file(name));
    let told = |gains, more: &[&str]| {
        let done = metachron(&[&arguments(gains)[..], more].concat());
        let said = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(0), "{said}");
        (serde_json::from_slice::<Value>(&done.stdout).unwrap(), said)
    };
    let trials = folder.file("killed.trials");
    let mut child = program().args(arguments(&killed)).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while std::fs::read_to_string(&trials).map_or(0, |text| text.lines().count()) < 6 {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::yield_now();
    }
    child.kill().unwrap();
    child.wait().unwrap();
    std::fs::copy(&trials, folder.file("other.trials")).unwrap();
    let (found, said) = told(&killed, &[]);
    assert!(said.contains("going on after the ") && !Path::new(&trials).exists(), "{said}");
    let (straight, said) = told(&whole, &[]);
    assert_eq!(said, "");
    for key in ["gains", "objective", "laws", "tried", "agents", "checked", "plant"] {
        assert_eq!(found[key], straight[key], "{key}");
    }
    assert_eq!(std::fs::read(&killed).unwrap(), std::fs::read(&whole).unwrap());
    let (_, said) = told(&other, &["--target-fps", "50"]);
    assert!(said.contains("with these settings") && said.contains("begins anew"), "{said}");
    assert!(Path::new(&folder.file("other.trials.old")).exists(), "trials of something else are kept");
}
