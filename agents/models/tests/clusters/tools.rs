//! Tools and led bodies in clusters: the press of a drive, the hold of jaws, the push of a led body.

use crate::bodies::{block, cube, rigid, sheet};
use crate::table::{GRAVITY, Table, placed, spring};
use glam::{DQuat, DVec3};
use metachron_contact::member::{
    Attachments, ClusterMember, MaterialPoint, MemberMotion, Partner, Role, SkinPoint, StepEnd,
};
use metachron_contact::solve::Side;
use metachron_contact::{Agent, AnchorSpring, Stepping};
use metachron_core::{AgentId, Anchor, Body, Snapshot, StepError, ToolState};
use metachron_geometry::{
    CollisionShape, ContactSide, ContactTraits, Place, PlacedShape, ShapeKind, ShapePose, Solid, SolidShape,
};
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::soft::{self, SoftBody, SoftSpec};
use metachron_models::tool::{Keyframe, Tool, ToolSpec};

/// A tool that points down, by the heights of its tip and the openings of its jaws.
pub fn tool(keys: &[(f64, DVec3, f64)], max_force_n: f64, graspable: Vec<AgentId>) -> Tool {
    let rotation = DQuat::from_rotation_x(std::f64::consts::PI);
    let key = |&(at_s, tip_m, jaw): &(f64, DVec3, f64)| Keyframe { at_s, tip_m, rotation, jaw };
    Tool::new(ToolSpec {
        keyframes: keys.iter().map(key).collect(),
        repeat: false,
        reach_m: 0.02,
        stiffness_n_m: 400.0,
        damping_n_s_m: 2.0,
        max_force_n,
        graspable,
        pivot_m: None,
        starts_off_m: DVec3::ZERO,
        traits: ContactTraits::default(),
    })
    .unwrap()
}

fn state(table: &Table, body: usize) -> ToolState {
    let mut snapshot = Snapshot::default();
    table.bodies[body].agent.write_snapshot(&mut snapshot);
    *snapshot.body.tool().unwrap()
}

fn up(z: f64) -> DVec3 {
    DVec3::new(0.0, 0.0, z)
}

#[test]
fn a_driven_tip_presses_a_soft_block_with_the_force_of_its_spring_and_no_more_than_its_bound() {
    // a drive of 2 N gives it at 5 mm
    for (tool_hz, cases) in [(60.0, &[(0.001, false), (0.04, true)][..]), (480.0, &[(0.04, true)])] {
        for &(below_m, bounded) in cases {
            let block_hz = 60.0;
            let end = up(0.0602 + 0.005 - below_m);
            let keys = [(0.0, up(0.075), 0.0), (0.5, end, 0.0)];
            let bodies = vec![cube(up(0.0302), 0.06), placed(tool(&keys, 2.0, vec![]), false)];
            let mut table = Table::new(bodies).at_rates(block_hz, tool_hz);
            let mut most = 0.0_f64;
            while table.time.as_secs_f64() < 1.5 {
                table.step();
                most = most.max(state(&table, 1).force_n);
            }
            let ToolState { tip, force_n, .. } = state(&table, 1);
            let wanted = if bounded { 2.0 } else { (tip.z - end.z) * 2.0 / 5e-3 };
            let rates = format!("{block_hz} : {tool_hz}, {below_m} m");
            // it still sinks in by some 1e-5 m/s, which its damping bears
            assert!((force_n - wanted).abs() < 2e-3 * wanted, "{rates}: {force_n} N instead of {wanted}");
            assert!(wanted > 0.05 && most < 2.1, "{rates}: {wanted} N, at most {most}");
            // the floor bears the block and the tip's force
            let weight_n = table.bodies[0].agent.mass_kg() * -GRAVITY.z;
            let borne = table.given_n(0, Partner::Static(0));
            let all = weight_n + wanted;
            assert!((borne - all).abs() < 2e-3 * all, "{rates}: the floor bears {borne} N of {all}");
        }
    }
}

#[test]
fn a_tip_that_nothing_touches_is_where_its_script_is() {
    let keys = [(0.0, up(0.1), 0.0), (1.0, DVec3::new(0.2, 0.1, 0.3), 0.0)];
    let mut table = Table::new(vec![placed(tool(&keys, 5.0, vec![]), false)]);
    while table.time.as_secs_f64() < 1.1 {
        table.step();
        assert_eq!(state(&table, 0).force_n, 0.0);
        assert!(table.time.as_secs_f64() < 0.1 || table.allocations == 0);
    }
    assert!(state(&table, 0).tip.distance(keys[1].1) < 1e-9);
    assert!(state(&table, 0).is_idle);
}

#[test]
fn a_user_leads_a_tool_to_the_target_and_does_not_pull_at_it() {
    let mut table = Table::new(vec![placed(tool(&[(0.0, up(0.1), 0.0)], 5.0, vec![]), false)]);
    let target = DVec3::new(0.05, 0.02, 0.2);
    let (anchor, target_velocity) = (Anchor::Local(DVec3::ZERO), DVec3::ZERO);
    // stiffness and damping have no say
    let hand = AnchorSpring { by: None, anchor, target, target_velocity, stiffness_n_m: 1e6, damping_n_s_m: 0.0 };
    table.bodies[0].user_springs.push(hand);
    while table.time.as_secs_f64() < 0.5 {
        table.step();
        assert_eq!(state(&table, 0).force_n, 0.0);
    }
    assert!(state(&table, 0).tip.distance(target) < 1e-6);
    assert!(table.grips(0).is_empty());
}

#[test]
fn jaws_lift_a_box_and_both_are_told_its_weight() {
    let box_kg = 0.1;
    for (box_hz, tool_hz) in [(60.0, 60.0), (60.0, 500.0)] {
        // the jaws close about a corner of the box, 1 cm beside its middle
        let at = |z: f64| DVec3::new(0.01, 0.0, z);
        let keys = [(0.0, at(0.06), 1.0), (0.5, at(0.045), 1.0), (1.0, at(0.045), 0.0), (2.0, at(0.145), 0.0)];
        let held = block(up(0.02), DVec3::splat(0.02), box_kg, 0.0);
        let mut table = Table::new(vec![held, placed(tool(&keys, 20.0, vec![AgentId(0)]), false)]);
        table = table.at_rates(box_hz, tool_hz);
        while table.time.as_secs_f64() < 3.5 {
            table.step();
        }
        let mut snapshot = Snapshot::default();
        table.bodies[0].agent.write_snapshot(&mut snapshot);
        let Body::Rigid(lifted) = snapshot.body else { panic!() };
        let weight_n = box_kg * -GRAVITY.z;
        let by: Vec<_> = table.grips(0).iter().map(|grip| grip.by).collect();
        assert_eq!(by, [Some(AgentId(1))]);
        let force = table.grips(0)[0].force_n;
        assert!((force - up(weight_n)).length() < 2e-3 * weight_n, "{force} N");
        let felt = state(&table, 1).force_n;
        assert!((felt - weight_n).abs() < 2e-3 * weight_n, "the tool feels {felt} N");
        assert!((lifted.position.z - 0.12).abs() < 0.006, "it hangs at {}", lifted.position);
        // the weight turns it by θ until 400 N/m at 2 cm hold it; it is held at its top, so that turning takes the arm away
        let turned = lifted.rotation.to_scaled_axis();
        let wanted = DVec3::Y * (-weight_n * 0.01 / (400.0 * 0.02 * 0.02 + weight_n * 0.02));
        assert!(turned.distance(wanted) < 2e-4, "turned by {turned}, not {wanted}");
    }
}

#[test]
fn what_hangs_on_a_shaft_in_a_pivot_weighs_on_its_tip_by_the_lever() {
    // 0.1 kg on the shaft at 0.1 m from the pivot, of a tip at 0.2 m from it; a drive of 20 N gives 5 mm
    let (mass_kg, tip) = (0.1, DVec3::new(0.2, 0.0, 0.5));
    let weight =
        RigidSpec { gravity: GRAVITY, ..rigid(Solid::Ball { radius_m: 0.01 }, DVec3::new(0.1, 0.0, 0.4), mass_kg) };
    let keyframes = vec![Keyframe { at_s: 0.0, tip_m: tip, rotation: DQuat::IDENTITY, jaw: 0.0 }];
    let spec = ToolSpec {
        keyframes,
        repeat: false,
        reach_m: 0.02,
        stiffness_n_m: 400.0,
        damping_n_s_m: 2.0,
        max_force_n: 20.0,
        graspable: vec![],
        pivot_m: Some(up(0.5)),
        starts_off_m: DVec3::ZERO,
        traits: ContactTraits::default(),
    };
    let bodies = vec![placed(RigidBody::new(weight).unwrap(), false), placed(Tool::new(spec).unwrap(), false)];
    let mut table = Table::new(bodies).at_rates(240.0, 240.0);
    table.link([(0, Anchor::Local(DVec3::ZERO)), (1, Anchor::Local(up(-0.1)))], spring(400.0, 8.0, 0.1));
    while table.time.as_secs_f64() < 3.0 {
        table.step();
    }
    let ToolState { tip: now, rotation, force_n, .. } = state(&table, 1);
    let felt_n = 0.5 * mass_kg * -GRAVITY.z;
    assert!((force_n - felt_n).abs() < 2e-3 * felt_n, "{force_n} N instead of {felt_n}");
    // the drive is aligned with the world, and the shaft with the pivot whatever weighs on it
    assert!((tip.z - now.z - felt_n * 5e-3 / 20.0).abs() < 1e-6, "the tip is at {now}");
    let behind = rotation.conjugate() * (up(0.5) - now);
    assert!(behind.truncate().length() < 1e-12, "the pivot is at {behind} of the tool");
}

/// A box that is led along x: it has no mass, and nothing stops it.
struct Pusher {
    form: CollisionShape,
    place: DVec3,
    kept: DVec3,
    m_s: f64,
}

impl Pusher {
    fn new(half_m: DVec3, place: DVec3, m_s: f64) -> Self {
        let solid = SolidShape::new(Solid::Box { half_extents_m: half_m }, DVec3::ZERO).unwrap();
        let form = CollisionShape::new(ShapeKind::Solid(solid), 0.5);
        Self { form, place, kept: place, m_s }
    }
}

impl ClusterMember for Pusher {
    fn role(&self) -> Role {
        Role::Kinematic
    }

    fn begin(&mut self, _h_s: f64) -> Result<(), StepError> {
        Ok(())
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        let view = ShapePose::Solid { position: self.place, rotation: DQuat::IDENTITY };
        Some(PlacedShape { form: &self.form, view })
    }

    fn skin_point(&self, _place: &Place, _contact: ContactSide) -> SkinPoint {
        SkinPoint { led_m_s: DVec3::X * self.m_s, ..Side::FIXED.into() }
    }

    fn end(&mut self, &StepEnd { h_s, .. }: &StepEnd<'_>) -> Result<(), StepError> {
        self.place.x += self.m_s * h_s;
        Ok(())
    }

    fn keep(&mut self) {
        self.kept = self.place;
    }

    fn go_back(&mut self) {
        self.place = self.kept;
    }

    fn motion(&self) -> Option<&dyn MemberMotion> {
        Some(self)
    }

    fn attachments(&self) -> Option<&dyn Attachments> {
        Some(self)
    }
}

impl MemberMotion for Pusher {
    fn speed_bound(&self, _v: &[DVec3]) -> f64 {
        self.m_s
    }
}

impl Attachments for Pusher {
    fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint> {
        let Anchor::Local(local) = anchor else { return None };
        Some(MaterialPoint::led(self.place + local, DVec3::X * self.m_s))
    }
}

impl Agent for Pusher {
    fn model(&self) -> &'static str {
        "pusher"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Cluster(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.clear();
    }
}

#[test]
fn a_led_body_pushes_a_box_at_exactly_its_speed() {
    for (rates, rough) in [((60.0, 60.0), 0.5), ((240.0, 60.0), 0.5), ((60.0, 60.0), 0.0), ((240.0, 60.0), 0.0)] {
        let half_m = DVec3::splat(0.03);
        let pushed = rigid(Solid::Box { half_extents_m: half_m }, up(0.03), 0.3);
        let pushed = placed(RigidBody::new(pushed).unwrap(), false);
        let mut pusher = Pusher::new(half_m, DVec3::new(-0.1, 0.0, 0.031), 0.2);
        pusher.form.friction = rough;
        let pusher = placed(pusher, false);
        let mut table = Table::new(vec![pushed, pusher]).at_rates(rates.0, rates.1);
        while table.time.as_secs_f64() < 1.0 {
            table.step();
        }
        let (place, velocity) = table.middle(0);
        assert!((velocity.x - 0.2).abs() < 1e-5, "{rates:?}: {velocity}");
        // Coulomb against the floor: it lies as deep in the pusher as contacts do
        let gap = place.x - (-0.1 + 0.2 * table.time.as_secs_f64()) - 0.06;
        assert!((-3e-5..1e-6).contains(&gap), "{rates:?}: a gap of {gap:e} m");
        let friction = -table.given_n_along(0, Partner::Static(0), DVec3::X);
        let [pressure, held] = [Partner::Static(0), Partner::Agent(AgentId(1))].map(|by| table.given_n(0, by));
        let weight = 0.3 * -GRAVITY.z;
        // where it sticks to the pusher that may bear a part of the weight, or press it down: the impact decides
        assert!((pressure + held - weight).abs() < 2e-3 * weight, "{rates:?}: {pressure} N and {held} N of {weight} N");
        assert!(
            (friction - 0.5 * pressure).abs() < 2e-3 * weight,
            "{rates:?}: {friction} N of friction for {pressure} N"
        );
        if rough == 0.0 {
            let wanted = 0.5 * weight;
            assert!((friction - wanted).abs() < 5e-3 * wanted, "{rates:?}: {friction} N of friction, not {wanted}");
        }
    }
}

#[test]
fn a_spring_to_a_led_body_takes_what_it_holds_along() {
    let free = RigidSpec { gravity: DVec3::ZERO, ..rigid(Solid::Ball { radius_m: 0.02 }, up(1.0), 0.1) };
    let ball = placed(RigidBody::new(free).unwrap(), false);
    let pusher = placed(Pusher::new(DVec3::splat(0.01), DVec3::new(0.1, 0.0, 1.0), 0.2), false);
    let mut table = Table::new(vec![ball, pusher]);
    let centre = Anchor::Local(DVec3::ZERO);
    table.link([(0, centre), (1, centre)], crate::table::spring(50.0, 1.0, 0.1));
    while table.time.as_secs_f64() < 4.0 {
        table.step();
    }
    let (place, velocity) = table.middle(0);
    assert!(velocity.distance(DVec3::X * 0.2) < 1e-4, "{velocity}");
    let wanted = 0.2 * table.time.as_secs_f64();
    assert!((place.x - wanted).abs() < 1e-4, "{} is not {wanted}", place.x);
}

#[test]
fn a_tip_that_jumps_does_not_pass_through_what_is_in_its_way() {
    for rates in [(60.0, 60.0), (60.0, 1000.0), (240.0, 60.0)] {
        let keys = [(0.0, up(0.03), 0.0), (0.1, up(0.03), 0.0), (0.101, up(-0.02), 0.0)];
        let held = SoftSpec { held: vec![soft::Side::Left, soft::Side::Right], ..sheet(DVec3::ZERO, 0.2, 8) };
        let bodies = vec![placed(SoftBody::new(held).unwrap(), true), placed(tool(&keys, 2.0, vec![]), false)];
        let mut table = Table::among(bodies, &[]).at_rates(rates.0, rates.1);
        let mut least = f64::INFINITY;
        while table.time.as_secs_f64() < 1.0 {
            table.step();
            let lowest = table.place(0, Anchor::Vertex(40)).z;
            least = least.min(state(&table, 1).tip.z - lowest);
        }
        let force_n = state(&table, 1).force_n;
        assert!(least > 0.0, "{rates:?}: the tip was {least} m above the middle of the sheet");
        assert!(force_n > 0.5, "{rates:?}: it presses with {force_n} N");
    }
}
