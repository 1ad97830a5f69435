//! The scenes of the guide, as a reader takes them from there.

use crate::play::{Folder, lockstep};

/// The scenes that `docs/guide.md` shows: the first is whole, the others are appended to it.
fn shown() -> Vec<String> {
    let guide = include_str!("../../docs/guide.md");
    let blocks = guide.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next());
    blocks.map(str::to_owned).collect()
}

#[test]
fn every_fragment_of_the_guide_plays_appended_to_its_scene() {
    let shown = shown();
    let (scene, fragments) = shown.split_first().expect("the guide shows a scene");
    assert!(scene.starts_with("format = 1") && fragments.len() >= 2, "{} fragments", fragments.len());
    for fragment in fragments.iter().map(String::as_str).chain([""]) {
        // the folder begins a scene with its format itself
        let folder = Folder::with(&format!("{}\n{fragment}", scene.replacen("format = 1", "", 1)));
        let report = lockstep(folder.scene(), &["--seconds", "0.2"]);
        let parked = report["agents"].as_array().unwrap().iter().filter(|agent| agent["parked"] == true);
        assert_eq!(parked.count(), 0, "{fragment}\n{report}");
    }
}
