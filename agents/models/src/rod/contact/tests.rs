//! Detection against brute force, and the balance of what contacts give.

use super::*;
use glam::DQuat;
use metachron_geometry::Solid;

/// Deterministic numbers in −1 … 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

/// A crumpled chain whose nodes move every step.
struct Chain {
    positions: Vec<DVec3>,
    slots: Vec<DVec3>,
    radii_m: Vec<f64>,
    arc_m: Vec<f64>,
}

const RADIUS: f64 = 0.015;
const STEP: f64 = 0.004;

impl Chain {
    fn crumpled(segments: usize, random: &mut Random) -> Self {
        let length = 0.015;
        let mut at = DVec3::ZERO;
        let mut positions = vec![at];
        let mut way = DVec3::X;
        for _ in 0..segments {
            // drawn back to the origin, so that the chain meets itself
            way = (way + random.vector() * 0.8 - at * 4.0).normalize();
            at += way * length;
            positions.push(at);
        }
        let nodes = positions.len();
        Self {
            positions,
            slots: vec![DVec3::ZERO; 2 * nodes - 1],
            radii_m: (0..nodes).map(|_| RADIUS * (1.0 + 0.2 * random.next())).collect(),
            arc_m: (0..nodes).map(|i| i as f64 * length).collect(),
        }
    }

    fn shake(&mut self, drift: DVec3, random: &mut Random) {
        self.slots.iter_mut().for_each(|v| *v = drift + random.vector());
    }

    fn go(&mut self) {
        self.positions.iter_mut().zip(self.slots.iter().step_by(2)).for_each(|(x, v)| *x += *v * STEP);
    }

    fn skin(&self) -> Skin<'_> {
        let Self { positions, slots, radii_m, arc_m } = self;
        Skin { positions, slots, radii_m, arc_m, held: [false; 2], h_s: STEP }
    }
}

/// Keys and gaps of the contacts that a search without any memory finds.
fn found_by_full_search(skin: &Skin<'_>, obstacles: &[Obstacle], with_itself: bool) -> Vec<(u64, f64)> {
    let mut contacts = TubeContacts::new(obstacles, with_itself, 0.3).unwrap();
    contacts.find(skin);
    contacts.contacts.iter().map(|c| (c.key, c.gap_m)).collect()
}

fn found(contacts: &mut TubeContacts, skin: &Skin<'_>) -> Vec<(u64, f64)> {
    contacts.find(skin);
    contacts.contacts.iter().map(|c| (c.key, c.gap_m)).collect()
}

#[test]
fn the_grid_finds_every_pair_that_trying_all_finds() {
    let mut random = Random(1);
    for _ in 0..10 {
        let mut chain = Chain::crumpled(120, &mut random);
        chain.shake(DVec3::ZERO, &mut random);
        let skin = chain.skin();
        let mut met = Vec::new();
        Pairs::default().visit(&skin, 0.001, |m| met.push((m.segments, m.place, m.gap_m)));
        let speeds: Vec<DVec3> = chain.slots.iter().step_by(2).copied().collect();
        let mean = speeds.iter().sum::<DVec3>() / speeds.len() as f64;
        let ahead = |k: usize| STEP * speeds[k].distance(mean).max(speeds[k + 1].distance(mean));
        let mut all = Vec::new();
        for i in 0..skin.segments() {
            for j in i + 1..skin.segments() {
                let nearest = skin.chain().nearest([i as u32, j as u32]);
                let margin_m = 0.001 + ahead(i) + ahead(j);
                if nearest.gap_m <= margin_m && !skin.chain().is_neighbour([i as u32, j as u32]) {
                    skin.chain().visit_places(nearest, margin_m, &mut |m| all.push((m.segments, m.place, m.gap_m)));
                }
            }
        }
        assert!(all.len() > 20, "only {} pairs: the chain does not meet itself", all.len());
        assert_eq!(met, all);
    }
}

#[test]
fn lists_that_last_find_what_a_fresh_search_finds() {
    let mut random = Random(2);
    let mut chain = Chain::crumpled(120, &mut random);
    let mut kept = TubeContacts::new(&[], true, 0.3).unwrap();
    let mut most = 0;
    for _ in 0..200 {
        chain.shake(DVec3::new(3.0, 1.0, 0.0), &mut random);
        let now = found(&mut kept, &chain.skin());
        most = most.max(now.len());
        assert_eq!(now, found_by_full_search(&chain.skin(), &[], true));
        chain.go();
    }
    assert!(most > 20, "at most {most} contacts: nothing was tested");
}

fn solids() -> Vec<Obstacle> {
    let half = DVec3::new(0.05, 0.02, 0.01);
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let corners: Vec<DVec3> = (0..8).map(|i| half * DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect();
    let solids = [
        Solid::Plane,
        Solid::Box { half_extents_m: half },
        Solid::Cylinder { radius_m: 0.02, half_height_m: 0.05 },
        Solid::Hull { points_m: corners.into() },
    ];
    (0..4)
        .zip(solids)
        .map(|(i, solid)| Obstacle {
            name: format!("solid {i}"),
            solid,
            position: DVec3::new(0.04 * f64::from(i), 0.0, -0.08),
            rotation: DQuat::from_rotation_x(0.3 * f64::from(i)),
            friction: 0.5,
            restitution: 0.0,
        })
        .collect()
}

#[test]
fn cached_distances_hide_no_wall() {
    let mut random = Random(3);
    let mut chain = Chain::crumpled(60, &mut random);
    chain.positions.iter_mut().for_each(|x| x.z += 0.3);
    let obstacles = solids();
    let mut kept = TubeContacts::new(&obstacles, false, 0.3).unwrap();
    let mut most = 0;
    for _ in 0..150 {
        chain.shake(DVec3::new(0.1, 0.0, -0.6), &mut random);
        let now = found(&mut kept, &chain.skin());
        most = most.max(now.len());
        assert_eq!(now, found_by_full_search(&chain.skin(), &obstacles, false));
        chain.go();
    }
    assert!(most > 50, "at most {most} contacts: nothing was tested");
}

#[test]
fn self_contact_gives_no_net_force_and_no_net_torque() {
    let mut random = Random(4);
    let chain = Chain::crumpled(120, &mut random);
    let mut contacts = TubeContacts::new(&[], true, 0.3).unwrap();
    assert!(contacts.find(&chain.skin()) > 10);
    for contact in &contacts.contacts {
        let impulse = random.vector();
        let mut slots = vec![DVec3::ZERO; 2 * chain.positions.len()];
        contact.jacobian.scatter(impulse, &mut slots);
        let force: DVec3 = (0..chain.positions.len()).map(|i| slots[node_slot(i)]).sum();
        let torque: DVec3 = (0..chain.positions.len())
            .map(|i| chain.positions[i].cross(slots[node_slot(i)]) + slots[segment_slot(i)])
            .sum();
        // a few roundings of numbers below 1
        assert!(force.length() < 1e-15 && torque.length() < 1e-15, "{force}, {torque}");
    }
}

#[test]
fn keys_are_unique_and_rise() {
    let mut random = Random(5);
    let mut chain = Chain::crumpled(100, &mut random);
    chain.positions.iter_mut().for_each(|x| x.z -= 0.08);
    let mut contacts = TubeContacts::new(&solids(), true, 0.3).unwrap();
    assert!(contacts.find(&chain.skin()) > 50);
    assert!(contacts.contacts.windows(2).all(|pair| pair[0].key < pair[1].key));
}

#[test]
fn a_straight_tube_has_no_contact_with_itself() {
    for length in [0.002, 0.01, 0.05] {
        let nodes = 101;
        let chain = Chain {
            positions: (0..nodes).map(|i| DVec3::X * (i as f64 * length)).collect(),
            slots: vec![DVec3::ZERO; 2 * nodes - 1],
            radii_m: vec![RADIUS; nodes],
            arc_m: (0..nodes).map(|i| i as f64 * length).collect(),
        };
        assert_eq!(found_by_full_search(&chain.skin(), &[], true), []);
    }
}

#[test]
fn a_ball_that_flies_past_a_ball_is_not_stopped() {
    let ball = Obstacle {
        name: String::new(),
        solid: Solid::Ball { radius_m: 0.05 },
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        friction: 0.0,
        restitution: 0.0,
    };
    let pass = |height: f64| {
        let chain = Chain {
            positions: vec![DVec3::new(-0.2, 0.0, height), DVec3::new(-0.2, 0.01, height)],
            slots: vec![DVec3::X * 100.0; 3],
            radii_m: vec![0.01; 2],
            arc_m: vec![0.0, 0.01],
        };
        found_by_full_search(&chain.skin(), std::slice::from_ref(&ball), false).len()
    };
    assert_eq!(pass(0.08), 0); // clears the ball by 2 cm on its way of 40 cm
    assert!(pass(0.04) > 0); // hits it, though it ends far behind it
}

/// A chain through a wall, whose last part is then drawn out of it and laid against it.
#[test]
fn a_tube_that_has_left_a_solid_it_started_in_touches_it_again() {
    let wall = Obstacle {
        name: String::new(),
        solid: Solid::Box { half_extents_m: DVec3::new(0.1, 1.0, 0.1) },
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        friction: 0.0,
        restitution: 0.0,
    };
    let arc_m: Vec<f64> = (0..=12).map(|i| 0.05 * f64::from(i)).collect();
    let along = |height: f64| arc_m.iter().map(|at| DVec3::new(at - 0.3, 0.0, height)).collect::<Vec<_>>();
    let mut chain =
        Chain { positions: along(0.0), slots: vec![DVec3::ZERO; 25], radii_m: vec![0.01; 13], arc_m: arc_m.clone() };
    let mut contacts = TubeContacts::new(std::slice::from_ref(&wall), false, 0.0).unwrap();
    let mut count = |chain: &Chain| found(&mut contacts, &Skin { held: [true, false], ..chain.skin() }).len();
    assert_eq!(count(&chain), 0);
    // out of it but for two nodes of its middle: of three that are a millimetre deep on the top two are at the mouths
    let mut raised = along(0.109);
    raised[6..=7].iter_mut().for_each(|at| at.z = 0.05);
    chain.positions = raised;
    assert_eq!(count(&chain), 1);
    chain.positions = along(0.109);
    assert_eq!(count(&chain), 5);
    // and no more is let through again
    chain.positions = along(0.0);
    assert!(count(&chain) > 3);
}
