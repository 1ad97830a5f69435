//! Scenes in which agents act on each other, played from the command line: joints, clusters, couplings, overlaps, the oracle.

use crate::play::{Folder, agent, lockstep, metachron, number, point, program};
use serde_json::{Value, json};

/// Two balls of 1 kg and radius 0.1 m on the x axis, without gravity; the left one moves right at 1 m/s.
fn balls(gap_m: f64, ties: &str) -> Folder {
    let ball = |name: &str, x: f64, v: f64, hz: f64| {
        format!(
            "[[object]]\nname = \"{name}\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nmass_kg = 1.0\nrestitution = 1.0\nfriction = 0.0\n\
             position_m = [{x}, 0, 0]\nvelocity_m_s = [{v}, 0, 0]\nrate_hz = {hz}\n"
        )
    };
    let text = format!(
        "{ties}\n[[probe]]\nobject = \"left\"\n[[probe]]\nobject = \"right\"\n{}{}",
        ball("left", 0.0, 1.0, 250.0),
        ball("right", 0.2 + gap_m, 0.0, 100.0)
    );
    Folder::with(&text)
}

const WEIGHTLESS: &str = "[world]\ngravity_m_s2 = [0, 0, 0]";

fn coupling<'r>(report: &'r Value, a: &str, b: &str) -> &'r Value {
    let all = report["couplings"].as_array().unwrap();
    let of = |c: &&Value| (c["a"] == a && c["b"] == b) || (c["a"] == b && c["b"] == a);
    all.iter().find(of).unwrap_or_else(|| panic!("no coupling of {a} and {b} in {all:?}"))
}

#[test]
fn a_stack_with_its_heaviest_box_on_top_stands_and_shares_one_clock() {
    let report = lockstep("stack", &["--seconds", "2"]);
    // the top's centre: nine boxes and a half of 0.1 m; a hundred times a box's weight on the lowest contact
    let top = point(&report, "/probes/1/position_m");
    assert!((top[2] - 0.95).abs() < 1e-3 && top[0].hypot(top[1]) < 1e-3, "{top:?}");
    assert_eq!(agent(&report, "anvil")["led_by"], "box-0");
    assert_eq!(coupling(&report, "box-8", "anvil")["kind"], "cluster");
}

#[test]
fn a_chain_keeps_its_length_and_gains_no_energy_while_it_swings() {
    let energy =
        |report: &Value| report["agents"].as_array().unwrap().iter().map(|a| number(a, "/energy_j")).sum::<f64>();
    // at the start all hang level at 1.25 m: m g z of 20 links of 0.04 kg and a weight of 2 kg
    let start_j = (20.0 * 0.04 + 2.0) * 9.81 * 1.25;
    for seconds in ["0.4", "1.5"] {
        let report = lockstep("chain", &["--seconds", seconds]);
        let weight = point(&report, "/probes/0/position_m");
        let from_hook = (weight[0].powi(2) + weight[1].powi(2) + (weight[2] - 1.25).powi(2)).sqrt();
        assert!(from_hook < 1.05 * 1.001, "{from_hook} m after {seconds} s");
        assert!(energy(&report) < start_j * 1.01, "{} J of {start_j} J after {seconds} s", energy(&report));
        assert_eq!(agent(&report, "weight")["led_by"], "link-0");
    }
}

#[test]
fn what_tears_is_an_event_of_the_report_and_without_one_there_is_none() {
    // a ball of 1 kg on a rope, and a hose of 62 g that hangs along its length
    let play = |share: f64| {
        let text = format!(
            "[[object]]\nname = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nmass_kg = 1\n\
             [[object]]\nname = \"hose\"\nmodel = \"tube\"\npath_m = [[1, 0, 0], [1.2, 0, 0]]\nradius_m = 0.01\nyoung_pa = 1e6\n\
             mass_per_length_kg_m = 0.31\nattach = [{{ from = 0, to = 1, stiffness_n_m2 = 3000, damping_n_s_m2 = 90, tears_above_n = {} }}]\n\
             [[joint]]\nkind = \"rope\"\na = \"ball\"\nb = \"world\"\nat_b_m = [0, 0, 1]\ntears_above_n = {}\n",
            share * 0.062 * 9.81,
            share * 9.81
        );
        Folder::with(&text).lockstep(&["--seconds", "0.5"])
    };
    let torn = play(0.9);
    let events = torn["events"].as_array().unwrap();
    let named: Vec<_> = events.iter().map(|event| (&event["attachment"], &event["a"], &event["b"])).collect();
    assert_eq!(
        named,
        [(&json!("joint.0"), &json!("ball"), &json!("world")), (&json!("attach.0"), &json!("hose"), &json!("world"))]
    );
    for (event, weight_n) in events.iter().zip([9.81, 0.062 * 9.81]) {
        assert!(event["kind"] == "tore" && number(event, "/at_s") < 0.1, "{event}");
        // the force that slows the hose down adds to its weight
        let weights = number(event, "/force_n") / weight_n;
        assert!(weights > 0.9 && weights < 1.05, "{event}");
    }
    assert!(play(1.2).get("events").is_none());
}

#[test]
fn a_thousand_agents_play_in_virtual_time() {
    // a heap begins in one cluster, and a turn of all takes as long as a thousand
    let report = lockstep("pile", &["--seconds", "0.2"]);
    let agents = report["agents"].as_array().unwrap();
    assert_eq!(agents.len(), 1000);
    assert!(agents.iter().all(|a| a["parked"] == false && number(a, "/steps") >= 5.0));
    assert!(agents[1..].iter().all(|a| a["led_by"] == "box-0"));
    // m g z of the grid: 1000 boxes of 0.0448 kg, in the mean 0.31 m high; the first of them have landed
    let energy: f64 = agents.iter().map(|a| number(a, "/energy_j")).sum();
    assert!(energy < 44.8 * 9.81 * 0.31 * 1.01, "{energy} J");
}

#[test]
fn boxes_that_fall_onto_each_other_with_long_steps_gain_no_energy() {
    // at 60 Hz a step carries them by half of their size before they land
    for (name, grid) in [("column", "[1, 1, 10]"), ("heap", "[4, 4, 6]")] {
        let folder = Folder::with(&format!(
            "[[object]]\nname = \"box\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.02, 0.02, 0.02]\nposition_m = [0, 0, 0.04]\n\
             rotation_deg = [4, 3, 20]\ngrid = {grid}\nspacing_m = [0.054, 0.054, 0.06]\nscatter_m = 0.0025\nscatter_seed = 1\n\
             mass_kg = 0.0448\nfriction = 0.5\nrestitution = 0.1\nrate_hz = 60.0\n\
             [[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\nfriction = 0.6\n"
        ));
        let mut least = f64::INFINITY;
        for seconds in ["0.02", "0.1", "0.15", "0.2", "0.25", "0.3", "0.4", "0.6"] {
            let report = folder.lockstep(&["--seconds", seconds]);
            let energy: f64 = report["agents"].as_array().unwrap().iter().map(|a| number(a, "/energy_j")).sum();
            assert!(energy < 1.01 * least, "{name}: {energy} J at {seconds} s after {least} J");
            least = least.min(energy);
        }
    }
}

#[test]
fn a_tube_that_falls_across_another_one_hangs_on_it_at_its_own_rate() {
    let report = lockstep("crossing", &["--seconds", "2.5"]);
    let [rope, hose] = [0, 1].map(|k| point(&report, &format!("/probes/{k}/position_m")));
    // their axes cross at the sum of both radii, 25 mm, less the offset of the curved hose above the rope; the floor is
    // far below
    assert!(hose[2] - rope[2] > 0.02 && hose[2] > 0.1, "rope {rope:?}, hose {hose:?}");
    let coupling = coupling(&report, "hose", "rope");
    assert_eq!((coupling["kind"].as_str(), coupling["contacts"].as_f64() > Some(0.0)), (Some("cluster"), true));
    let cluster = &report["clusters"][0];
    let steps = |name: &str| {
        let at = cluster["members"].as_array().unwrap().iter().position(|member| member == name).unwrap();
        cluster["steps"][at].as_f64().unwrap()
    };
    assert!(steps("hose") > 5.0 * steps("rope"), "{cluster}");
}

#[test]
fn a_blow_between_unequal_rates_hands_over_the_whole_momentum_and_they_part_again() {
    let report = balls(0.1, WEIGHTLESS).lockstep(&["--seconds", "0.5"]);
    let speeds = [0, 1].map(|k| point(&report, &format!("/probes/{k}/velocity_m_s"))[0]);
    // equal masses, e = 1: they change places
    assert!(speeds[0].abs() < 0.01 && (speeds[1] - 1.0).abs() < 0.01, "{speeds:?}");
    assert!((speeds[0] + speeds[1] - 1.0).abs() < 1e-9, "{speeds:?}");
    let coupling = coupling(&report, "left", "right");
    assert_eq!(coupling["kind"], "cluster");
    assert!((number(coupling, "/impulse_n_s") - 1.0).abs() < 0.02, "{coupling}");
    assert_eq!(agent(&report, "right")["led_by"], Value::Null);
}

#[test]
fn pairs_that_are_off_pass_through_each_other() {
    let off = format!("coupling = [{{ a = \"left\", b = \"right\", law = \"off\" }}]\n{WEIGHTLESS}");
    for ties in [off, format!("{WEIGHTLESS}\ncontacts = false")] {
        let report = balls(0.1, &ties).lockstep(&["--seconds", "0.5"]);
        let at = [0, 1].map(|k| point(&report, &format!("/probes/{k}/position_m"))[0]);
        assert!((at[0] - 0.5).abs() < 5e-3 && (at[1] - 0.3).abs() < 1e-12, "{at:?}");
        assert!(report["couplings"].as_array().unwrap().is_empty());
    }
}

#[test]
fn agents_that_start_inside_each_other_are_named_and_play() {
    let folder = balls(-0.03, WEIGHTLESS);
    let run = metachron(&["run", folder.scene(), "--headless", "--executor", "lockstep", "--seconds", "0.2", "--json"]);
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(said.contains("note: `left` and `right` overlap by 30.0"), "{said}");
    let report: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(
        (report["overlaps"][0]["a"].as_str(), report["overlaps"][0]["b"].as_str()),
        (Some("left"), Some("right"))
    );
    // shapes are compared in single precision
    assert!((number(&report, "/overlaps/0/depth_m") - 0.03).abs() < 1e-6);
    let check = metachron(&["check", folder.scene()]);
    assert_eq!(check.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&check.stderr).contains("`left` and `right` overlap"));
    let check = metachron(&["check", "--json", folder.scene()]);
    let rows: Value = serde_json::from_slice(&check.stdout).unwrap();
    assert!((number(&rows, "/0/content/overlaps/0/depth_m") - 0.03).abs() < 1e-6);
    assert!(lockstep("stack", &["--frames", "1"])["overlaps"].as_array().unwrap().is_empty());
}

#[test]
fn agents_that_start_inside_fixed_solids_are_named() {
    let fixed = |name: &str, shape: &str| {
        format!("[[object]]\nname = \"{name}\"\nmodel = \"rigid\"\nfixed = true\nshape = {shape}\n")
    };
    // the balls have a radius of 0.1 m and stand at z = 0
    let floor = fixed("floor", "\"plane\"\nposition_m = [0, 0, -0.08]");
    let post = fixed("post", "\"cylinder\"\nradius_m = 0.05\nhalf_height_m = 0.5\nposition_m = [0.39, 0, 0]");
    let folder = balls(0.1, &format!("{WEIGHTLESS}\n{floor}{post}"));
    let check = metachron(&["check", "--json", folder.scene()]);
    let rows: Value = serde_json::from_slice(&check.stdout).unwrap();
    let overlaps = rows[0]["content"]["overlaps"].as_array().unwrap();
    for (overlap, (a, b, depth_m)) in
        overlaps.iter().zip([("left", "floor", 0.02), ("right", "floor", 0.02), ("right", "post", 0.06)])
    {
        assert_eq!((overlap["a"].as_str(), overlap["b"].as_str()), (Some(a), Some(b)));
        assert!((number(overlap, "/depth_m") - depth_m).abs() < 1e-6, "{overlap}");
    }
    assert_eq!(overlaps.len(), 3);
}

#[test]
fn what_is_held_through_a_solid_is_named_and_moves_as_if_that_were_not_there() {
    let hose = r#"
        [[object]]
        name = "hose"
        model = "tube"
        path_m = [[-0.5, 0, 0.2], [0.5, 0, 0.2]]
        radius_m = 0.015
        young_pa = 1e6
        density_kg_m3 = 1050
        clamp = ["start", "end"]
        rate_hz = 240
        [[object]]
        name = "wall"
        model = "rigid"
        fixed = true
        shape = "box"
        half_extents_m = [0.1, 0.1, 0.1]
        position_m = [0.6, 0, 0.2]
    "#;
    let block = r#"
        [[object]]
        name = "block"
        model = "rigid"
        fixed = true
        shape = "box"
        half_extents_m = [0.1, 0.1, 0.1]
        position_m = [0, 0, 0.2]
    "#;
    let [through, free] = [block, ""].map(|more| Folder::with(&format!("{hose}{more}")).lockstep(&["--seconds", "1"]));
    let overlaps = through["overlaps"].as_array().unwrap();
    // half the block and the radius; held to the wall it is only beside it
    assert_eq!((overlaps.len(), overlaps[0]["b"].as_str()), (1, Some("block")), "{overlaps:?}");
    assert!((number(&through, "/overlaps/0/depth_m") - 0.115).abs() < 1e-6, "{overlaps:?}");
    let [held_j, free_j] = [&through, &free].map(|report| number(report, "/agents/0/energy_j"));
    assert!((held_j - free_j).abs() < 1e-9 * free_j, "{held_j} J, {free_j} J without the block");
}

#[test]
fn what_falls_on_a_light_box_comes_to_lie_on_it_at_any_rates() {
    let fall = |[light_kg, heavy_kg]: [f64; 2], [light_hz, heavy_hz]: [f64; 2]| {
        let cube = |name: &str, half: f64, z: f64, kg: f64, hz: f64| {
            format!(
                "[[object]]\nname = \"{name}\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [{half}, {half}, {half}]\n\
                 mass_kg = {kg}\nposition_m = [0, 0, {z}]\nrate_hz = {hz}\n[[probe]]\nobject = \"{name}\"\n"
            )
        };
        let ground = "[[object]]\nname = \"ground\"\nmodel = \"rigid\"\nshape = \"plane\"\n";
        let boxes =
            [cube("light", 0.1, 0.1, light_kg, light_hz), cube("heavy", 0.2, 0.42, heavy_kg, heavy_hz)].concat();
        Folder::with(&format!("{ground}{boxes}")).lockstep(&["--seconds", "1"])
    };
    for masses in [[1.0, 1.0], [0.1, 10.0], [0.1, 100.0]] {
        for rates in [[240.0, 240.0], [60.0, 240.0], [30.0, 480.0], [10.0, 1000.0], [1000.0, 10.0]] {
            let report = fall(masses, rates);
            for (k, height) in [0.1, 0.4].into_iter().enumerate() {
                let at = point(&report, &format!("/probes/{k}/position_m"));
                let off = (at[2] - height).abs().max(at[0].hypot(at[1]));
                assert!(off < 1e-3, "{masses:?} kg, {rates:?} Hz: probe {k} at {at:?}");
            }
        }
    }
}

#[test]
fn the_oracle_tells_what_different_clocks_changed() {
    let report = balls(0.1, WEIGHTLESS).lockstep(&["--seconds", "0.5", "--oracle"]);
    let oracle = &report["oracle"];
    // a quarter of the shorter step, 4 ms
    assert_eq!((number(oracle, "/dt_ms"), number(oracle, "/couplings/0/impulse_oracle_n_s").round()), (1.0, 1.0));
    assert!(number(oracle, "/states") > 40.0);
    // a blow is seen at most a step of 10 ms late, at 1 m/s
    let (rms, most) = (number(oracle, "/couplings/0/position_rms_m"), number(oracle, "/couplings/0/position_max_m"));
    assert!(rms > 0.0 && rms <= most && most < 0.011, "{oracle}");
    let apart = balls(9.0, WEIGHTLESS).lockstep(&["--seconds", "0.2", "--oracle"]);
    assert!(apart["oracle"]["couplings"].as_array().unwrap().is_empty());
}

#[test]
fn the_oracle_is_not_asked_where_there_is_a_window() {
    let refused = program().args(["run", "stack", "--oracle"]).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(said.contains("--oracle") && said.contains("--headless"), "{said}");
}

#[test]
fn faults_on_purpose_shake_the_steps_and_are_the_same_on_every_run() {
    // they act on asynchronous pairs alone
    let ties = "[[coupling]]\na = \"left\"\nb = \"right\"\nlaw = \"ledger\"\n";
    let world = |faults: &str| balls(0.1, &format!("{WEIGHTLESS}\n{faults}{ties}")).lockstep(&["--seconds", "0.5"]);
    let faults = "faults = { jitter = 0.2, loss = 0.1, seed = 5 }\n";
    let [one, two, plain] = [faults, faults, ""].map(world);
    assert_eq!(one["state_hash"], two["state_hash"]);
    assert_ne!(one["state_hash"], plain["state_hash"]);
    let speeds = [0, 1].map(|k| point(&one, &format!("/probes/{k}/velocity_m_s"))[0]);
    assert!((speeds[0] + speeds[1] - 1.0).abs() < 1e-9, "{speeds:?}");
}

#[test]
fn the_fingers_of_the_gripper_lift_the_tube_by_friction_and_set_it_down() {
    let middle = |seconds: &str| point(&lockstep("gripper", &["--seconds", seconds]), "/probes/0/position_m");
    // by the script the hands are 12.2 cm up from 3.2 s to 4.2 s, and down again at 6 s
    let (lifted, down) = (middle("4"), middle("7"));
    assert!((lifted[2] - 0.1375).abs() < 5e-3 && lifted[0].abs() < 5e-3, "{lifted:?}");
    // a tube of 15 mm radius lies on the floor
    assert!((down[2] - 0.015).abs() < 2e-3, "{down:?}");
}

#[test]
fn a_tool_at_the_very_middle_of_a_box_lets_it_lie() {
    // all ways out are alike: rounding tears the hull that looks for the shortest
    let folder = Folder::with(
        "[[object]]\nname = \"box\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.1, 0.1, 0.1]\nposition_m = [0, 0, 0.1]\n\
         mass_kg = 8.0\nfriction = 0.5\nrestitution = 0.0\nrate_hz = 240.0\n\
         [[object]]\nname = \"tool\"\nmodel = \"instrument\"\ngrasps = []\nrate_hz = 120.0\n\
         keyframe = [{ at_s = 0.0, tip_m = [0, 0, 0.1], jaw = 0.0, rotation_deg = [180, 0, 0] }]\n\
         [[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\nfriction = 0.5\n[[probe]]\nobject = \"box\"\n",
    );
    let report = folder.lockstep(&["--seconds", "0.5"]);
    let at = point(&report, "/probes/0/position_m");
    assert!((at[2] - 0.1).abs() < 1e-3 && at[0].hypot(at[1]) < 1e-3, "{at:?}");
}

/// A tool that is led to 20 mm below the top of a box of `mass_kg` on the floor and held there for ever, by a drive of 20 N.
fn pressed(mass_kg: f64, rates_hz: [f64; 2]) -> Folder {
    let [box_hz, tool_hz] = rates_hz;
    Folder::with(&format!(
        r#"
[[object]]
name = "floor"
model = "rigid"
shape = "plane"
friction = 0.5
[[object]]
name = "box"
model = "rigid"
shape = "box"
half_extents_m = [0.05, 0.05, 0.05]
position_m = [0, 0, 0.05]
mass_kg = {mass_kg:?}
rate_hz = {box_hz:?}
[[object]]
name = "tool"
model = "instrument"
rate_hz = {tool_hz:?}
max_force_n = 20.0
grasps = []
keyframe = [
    {{ at_s = 0.0, tip_m = [0.0, 0.0, 0.3], rotation_deg = [180.0, 0.0, 0.0], jaw = 0.0 }},
    {{ at_s = 2.0, tip_m = [0.0, 0.0, 0.08] }},
    {{ at_s = 30.0, tip_m = [0.0, 0.0, 0.08] }},
]
[[probe]]
object = "tool"
"#
    ))
}

#[test]
fn nobody_falls_asleep_under_a_tool_that_presses() {
    for (mass_kg, rates_hz) in [(1.0, [240.0, 240.0]), (0.5, [60.0, 60.0]), (0.5, [120.0, 120.0]), (0.5, [60.0, 120.0])]
    {
        let folder = pressed(mass_kg, rates_hz);
        // it dipped 7 mm in and hopped 13 mm up about once a second
        for seconds in ["3.2", "4.1", "4.6", "5.3"] {
            let report = folder.lockstep(&["--seconds", seconds]);
            let tip_m = point(&report, "/probes/0/position_m")[2];
            let rested_ms = number(agent(&report, "box"), "/rested_ms");
            assert!(rested_ms < 2000.0, "{rates_hz:?}: {rested_ms} ms, and not only before the tool came");
            assert!((tip_m - 0.105).abs() < 1e-3, "{rates_hz:?}: {tip_m} m at {seconds} s");
        }
    }
}

/// In the last of the solves of a step no more contacts are added: an unsolved contact has no impulse to remember.
#[test]
fn eight_boxes_in_one_place_come_apart() {
    let floor = "[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\nfixed = true\n".to_owned();
    let cube = |k: u32| {
        format!(
            "[[object]]\nname = \"b{k}\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.05, 0.05, 0.05]\n\
             position_m = [0.0, 0.0, {}]\nmass_kg = 1.0\n",
            0.05 + 0.001 * f64::from(k)
        )
    };
    let scene = Folder::with(&(0..8).map(cube).fold(floor, |text, more| text + &more));
    let done =
        metachron(&["run", scene.scene(), "--headless", "--executor", "lockstep", "--seconds", "1", "--json", "-q"]);
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success() && !said.contains("panicked"), "{said}");
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert!(report["agents"].as_array().unwrap().iter().all(|agent| agent["parked"] == false), "{}", report["agents"]);
}
