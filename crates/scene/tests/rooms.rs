//! Cells, portals and the walls of cells, as scene files ask for them.

use metachron_geometry::Solid;
use metachron_scene::{Source, load};
use metachron_world::Scene;

const ROOMS: &str = r##"format = 1
[[cell]]
name = "room"
from_m = [0, 0, 0]
to_m = [4, 3, 2.5]
walls_m = 0.1
without = ["floor"]
[[cell]]
name = "corridor"
from_m = [4, 0, 0]
to_m = [6, 3, 2.5]
[[portal]]
between = ["room", "corridor"]
from_m = [4, 1, 0]
to_m = [4, 2, 2]
"##;

/// The rooms with a text replaced; or the fault, and its place.
fn rooms(from: &str, to: &str) -> Result<Scene, String> {
    assert!(ROOMS.contains(from), "{from}");
    let text = ROOMS.replacen(from, to, 1);
    let source = Source::memory("rooms", text.as_bytes()).map_err(|error| format!("{:?}", error.problems))?;
    let told = |problem: &metachron_scene::SceneProblem| {
        format!("{} {}: {} [{}]", problem.line, problem.text, problem.message, problem.expected)
    };
    load(&source, &[]).map_err(|error| error.problems.iter().map(told).collect::<Vec<_>>().join("\n"))
}

#[test]
fn walls_are_fixed_boxes_with_the_portals_left_open() {
    let scene = rooms("format", "format").unwrap();
    assert_eq!((scene.cells.all().len(), scene.cells.portals().len()), (2, 1));
    let volume = |solid: &Solid| match solid {
        Solid::Box { half_extents_m } => 8.0 * half_extents_m.element_product(),
        other => panic!("a wall is a box, not {other:?}"),
    };
    let built: f64 = scene.obstacles.iter().map(|wall| volume(&wall.solid)).sum();
    // ceiling and four walls under it, without a door of 1 × 2 m
    let expected = 0.1 * (4.0 * 3.0 + 2.0 * 3.0 * 2.4 + 2.0 * 3.8 * 2.4 - 2.0);
    assert!((built - expected).abs() < 1e-9, "{built} {expected}");
    assert!(scene.obstacles.iter().all(|wall| wall.name == "room.walls"));
    assert_eq!(scene.obstacles.len(), scene.obstacle_appearances.len());
    assert!(rooms("walls_m = 0.1\nwithout = [\"floor\"]\n", "").unwrap().obstacles.is_empty());
}

#[test]
fn what_is_wrong_with_rooms_is_said_where_it_stands() {
    for (from, to, line, words) in [
        ("from_m = [4, 0, 0]", "from_m = [3.9, 0, 0]", 10, &["cell `corridor`", "within cell `room`"][..]),
        ("to_m = [6, 3, 2.5]", "to_m = [4, 3, 2.5]", 11, &["no volume"]),
        ("\"corridor\"\nfrom", "\"outside\"\nfrom", 9, &["what is in no cell"]),
        ("\"corridor\"\nfrom", "\"room\"\nfrom", 9, &["the name of another cell"]),
        ("[\"room\", \"corridor\"]", "[\"room\", \"coridor\"]", 13, &["`coridor`, which does not exist", "`outside`"]),
        ("[\"room\", \"corridor\"]", "[\"room\", \"room\"]", 13, &["names one cell twice"]),
        ("[\"room\", \"corridor\"]", "[\"room\", \"outside\"]", 13, &["cell `corridor` is behind the portal"]),
        ("from_m = [4, 1, 0]\nto_m = [4, 2, 2]", "from_m = [0, 1, 0]\nto_m = [0, 2, 2]", 14, &["cell `corridor`"]),
        (
            "from_m = [4, 1, 0]\nto_m = [4, 2, 2]",
            "from_m = [4, 1, 0]\nto_m = [4, 4, 2]",
            14,
            &["a side of cell `room`"],
        ),
        ("to_m = [4, 2, 2]", "to_m = [5, 2, 2]", 15, &["shares no coordinate"]),
        ("from_m = [4, 1, 0]\nto_m = [4, 2, 2]", "", 13, &["has no opening", "`corners_m`"]),
        (
            "from_m = [4, 1, 0]\nto_m = [4, 2, 2]",
            "corners_m = [[4, 1, 0], [4, 2, 0], [4, 1, 1], [4, 2, 1]]",
            14,
            &["is not a convex polygon"],
        ),
        (
            "from_m = [4, 1, 0]\nto_m = [4, 2, 2]",
            "corners_m = [[4, 1, 0], [4, 2, 0], [4, 1.5, 1]]",
            14,
            &["not a rectangle", "without `walls_m`"],
        ),
        ("walls_m = 0.1", "walls_m = 1.3", 6, &["nothing is left between the walls"]),
        ("walls_m = 0.1\n", "", 6, &["has no effect alone", "`walls_m`"]),
        ("without = [\"floor\"]", "without = [\"roof\"]", 7, &["roof", "ceiling"]),
    ] {
        let told = rooms(from, to).map(|_| to).unwrap_err();
        assert!(told.starts_with(&format!("{line} ")), "{to}: {told}");
        words.iter().for_each(|word| assert!(told.contains(word), "{to}: {word} is not in {told}"));
    }
}

#[test]
fn objects_and_scenes_may_allow_objects_to_vanish() {
    let scene = |target: &str, object: &str| {
        let ball = "name = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nmass_kg = 1\n";
        let text = format!("format = 1\n[target]\n{target}\n[[object]]\n{ball}{object}\n");
        load(&Source::memory("ball", text.as_bytes()).unwrap(), &[]).map_err(|error| format!("{:?}", error.problems))
    };
    let asked = scene("may_vanish = true\nfocus = 0.5", "may_vanish = false").unwrap();
    assert!(asked.target.may_vanish && asked.agents[0].appearance.may_vanish == Some(false));
    assert_eq!((asked.target.focus, asked.target.motion), (Some(0.5), None));
    let usual = scene("", "").unwrap();
    assert!(!usual.target.may_vanish && usual.agents[0].appearance.may_vanish.is_none());
    assert!(scene("hysteresis = 1.5", "").unwrap_err().contains("hysteresis"));
    for ignored in [
        "policy = \"robin-hood\"\nfocus = 0.5",
        "policy = \"feedback\"\nmotion = 1.0",
        "policy = \"marginal-stop\"\nhysteresis = 0.1",
    ] {
        assert!(scene(ignored, "").unwrap_err().contains("has no effect under"), "{ignored}");
    }
    assert!(scene("policy = \"convex\"\nfocus = 0.5\nhysteresis = 0.1", "").is_ok());
}
