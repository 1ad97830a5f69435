//! Scenes with one camera or several.

use metachron_scene::{Source, load};

fn names(text: &str) -> Result<Vec<String>, String> {
    let source = Source::memory("cameras", format!("format = 1\n{text}").as_bytes()).unwrap();
    let scene = load(&source, &[]).map_err(|error| error.problems[0].to_string())?;
    Ok(scene.cameras.into_iter().map(|camera| camera.name).collect())
}

#[test]
fn a_scene_has_one_camera_as_before_or_several_by_name() {
    let eye = "eye_m = [0, -1, 1]\n";
    assert_eq!(names("").unwrap(), [""; 0]);
    assert_eq!(names(&format!("[camera]\n{eye}")).unwrap(), ["camera"]);
    let several = format!("[[camera]]\nname = \"above\"\n{eye}[[camera]]\n{eye}period_s = 9\n");
    assert_eq!(names(&several).unwrap(), ["above", "camera 2"]);
    let twice = format!("[[camera]]\nname = \"above\"\n{eye}[[camera]]\nname = \"above\"\n{eye}");
    assert!(names(&twice).unwrap_err().contains("twice"));
    // the fault is in the second
    let wrong = format!("[[camera]]\n{eye}[[camera]]\n{eye}fov_deg = 400\n");
    assert!(names(&wrong).unwrap_err().contains("400"));
    assert!(names(&format!("[camera]\n{eye}eyes = 3\n")).unwrap_err().contains("eyes"));
}
