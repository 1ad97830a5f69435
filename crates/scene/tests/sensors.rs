//! Sensors and names of joints as scene files write them.

use glam::DVec3;
use metachron_core::{AgentId, ContactPartner};
use metachron_scene::{Source, load};
use metachron_world::{Scene, SensorKind, Site};

const SCENE: &str = "format = 1
object = [
    { name = \"floor\", model = \"rigid\", shape = \"plane\" },
    { name = \"base\", model = \"rigid\", shape = \"ball\", radius_m = 0.1, position_m = [0, 0, 1] },
    { name = \"arm\", model = \"rigid\", shape = \"ball\", radius_m = 0.1, position_m = [0.3, 0, 1] },
]
joint = [{ name = \"elbow\", kind = \"revolute\", a = \"base\", b = \"arm\", axis = [0, 1, 0] }]
";

fn scene(sensor: &str) -> Result<Scene, String> {
    let text = format!("{SCENE}[[sensor]]\n{sensor}");
    let source = Source::memory("sensors", text.as_bytes()).map_err(|error| format!("{:?}", error.problems))?;
    load(&source, &[]).map_err(|error| {
        let said = error.problems.iter().map(|p| format!("line {}: {}; {}", p.line, p.message, p.expected));
        said.collect::<Vec<_>>().join("\n")
    })
}

#[test]
fn sensors_are_on_what_they_name() {
    let kind = |text: &str| scene(&format!("name = \"s\"\n{text}")).unwrap().sensors[0].kind;
    assert_eq!(scene("name = \"s\"\nkind = \"imu\"\nobject = \"arm\"\n").unwrap().joint_names, ["elbow"]);
    assert_eq!(kind("kind = \"joint-position\"\njoint = \"elbow\"\n"), SensorKind::JointPosition(0));
    let (object, with) = (AgentId(1), Some(ContactPartner::Static(0)));
    let on_floor = kind("kind = \"contact-force\"\nobject = \"arm\"\nwith = \"floor\"\n");
    assert_eq!(on_floor, SensorKind::ContactForce { object, with });
    let imu = |keys: &str| match kind(&format!("kind = \"imu\"\nobject = \"arm\"\n{keys}")) {
        SensorKind::Imu { site, .. } => site,
        other => panic!("{other:?}"),
    };
    assert_eq!(imu(""), Site::default());
    let Site { at_m, rotation } = imu("at_m = [0.05, 0, 0]\nrotation_deg = [0, 0, 90]\n");
    assert_eq!(at_m, Some(DVec3::X * 0.05));
    assert!((rotation * DVec3::X).distance(DVec3::Y) < 1e-15, "{rotation}");
}

#[test]
fn what_no_sensor_can_be_on_is_refused_with_its_place() {
    for (sensor, why) in [
        ("kind = \"joint-position\"\njoint = \"elbw\"\n", "elbow"),
        ("kind = \"joint-position\"\nobject = \"arm\"\n", "`object`"),
        ("kind = \"imu\"\nobject = \"floor\"\n", "is fixed"),
        ("kind = \"contact-force\"\nobject = \"arm\"\nwith = \"flor\"\n", "flor"),
        ("kind = \"contact-force\"\nobject = \"arm\"\nat_m = [0, 0, 0]\n", "does not belong"),
        ("kind = \"pose\"\nobject = \"arm\"\nrotation_deg = [0, 0, 9]\n", "does not belong"),
        ("kind = \"imu\"\nobject = \"arm\"\nat_m = [0, 0, nan]\n", "`at_m`"),
    ] {
        let said = scene(&format!("name = \"s\"\n{sensor}")).expect_err(sensor);
        assert!(said.contains("line 1") && said.contains(why), "{sensor}: {said}");
    }
    let said = scene("name = \"\"\nkind = \"imu\"\nobject = \"arm\"\n").unwrap_err();
    assert!(said.contains("is not a valid name"), "{said}");
}
