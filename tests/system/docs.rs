//! `metachron docs`: a document is what its commands print, or the lines that differ are told.

use crate::play::metachron;
use std::path::Path;

const DOCUMENT: &str = "\
# Slopes
<!-- metachron chart stability --quick --only incline | body = tube | tan/μ, body | claims | figure -->
<!-- end -->
Scenes:
<!-- metachron list -->
<!-- end -->
";

/// Code, and messages.
fn docs(folder: &Path, document: &str, more: &[&str]) -> (Option<i32>, String) {
    let path = folder.join("slopes.md");
    std::fs::write(&path, document).unwrap();
    let out = folder.join("charts");
    let fixed = ["docs", path.to_str().unwrap(), "-q", "--out", out.to_str().unwrap()];
    let done = metachron(&[&fixed[..], more].concat());
    (done.status.code(), String::from_utf8(done.stderr).unwrap())
}

#[test]
fn a_document_is_printed_and_stays_the_same_until_a_number_in_it_is_another() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("figures")).unwrap();
    let told = |document: &str, more: &[&str]| docs(folder.path(), document, more);
    let (code, said) = told(DOCUMENT, &[]);
    assert_eq!((code, said.lines().filter(|line| line.contains("slopes.md:2: ")).count()), (Some(1), 2), "{said}");
    assert_eq!(told(DOCUMENT, &["--write"]), (Some(0), String::new()));
    let written = std::fs::read_to_string(folder.path().join("slopes.md")).unwrap();
    for line in ["| tan/μ | body |", "| 1.02 | tube |", "](figures/stability-incline.svg)", "$ metachron list"] {
        assert!(written.contains(line), "{line} is not in\n{written}");
    }
    assert!(!written.contains("| box |") && written.contains("| holds | tube: transition"), "{written}");
    assert_eq!(told(&written, &[]), (Some(0), String::new()));
    let (code, said) = told(&written.replace("| 1.02 | tube |", "| 1.03 | tube |"), &[]);
    assert!(code == Some(1) && said.contains("- | 1.03 | tube |\n  + | 1.02 | tube |"), "{said}");
}

#[test]
fn what_measures_this_machine_is_not_compared_but_dated_and_other_mistakes_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let told = |block: &str| docs(folder.path(), &format!("{block}\n<!-- end -->\n"), &[]);
    let dated = "<!-- metachron chart policies --quick --only selection -->\nMeasured on 2026-11-30, here.";
    assert_eq!(told(dated), (Some(0), String::new()));
    for (block, why) in [
        ("<!-- metachron chart policies --quick --only selection -->", "`Measured on `"),
        ("<!-- metachron chart stability --quick -->", "named by `--only`"),
        ("<!-- metachron chart stability --only inclin -->", "did you mean `incline`?"),
        ("<!-- metachron lisst -->", "list"),
        ("<!-- metachron docs slopes.md -->", "begin it again"),
        ("<!-- metachron list -->\n<!-- metachron list -->", "is not closed"),
    ] {
        let (code, said) = told(block);
        assert!(code == Some(2) && said.contains("slopes.md") && said.contains(why), "{block}: {said}");
    }
}
