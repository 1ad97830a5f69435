//! Soft bodies fall on rigid ones that stand on the floor, and are pushed out of each other.

use super::meetings::floor;
use super::*;
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use glam::EulerRot;
use metachron_geometry::{Obstacle, Solid};

/// A box of 10 cm and `mass_kg` that stands on the floor, and a block of 25 × 25 × 10 cm in so many cells that falls on it from
/// `drop_m`.
struct Fall {
    rates: (f64, f64),
    drop_m: f64,
    mass_kg: f64,
    segments: [u32; 3],
}

impl Fall {
    /// Plays 1.5 s: where the middles of block and box then are, and the lowest point of the block at any time.
    fn play(&self) -> (DVec3, DVec3, f64) {
        let block = SoftSpec {
            matter: SoftMatter { young_pa: 2.5e5, damping_per_s: 1.0, ..MATTER },
            position: DVec3::new(-0.125, -0.125, 0.1 + self.drop_m),
            gravity: G,
            friction: 0.3,
            obstacles: [floor()].into(),
            ..spec(SoftShape::Box { size_m: DVec3::new(0.25, 0.25, 0.1), segments: self.segments })
        };
        let solid = Solid::Box { half_extents_m: DVec3::splat(0.05) };
        let low = RigidSpec {
            gravity: G,
            friction: 0.3,
            obstacles: [floor()].into(),
            ..RigidSpec::free(solid, DVec3::Z * 0.05, self.mass_kg)
        };
        let mut stage = Stage::new(Faults::default());
        let low = stage.add(RigidBody::new(low).unwrap(), self.rates.0);
        let block = stage.add(SoftBody::new(block).unwrap(), self.rates.1);
        let mut lowest = f64::INFINITY;
        stage.run(1.5, |stage| {
            lowest = stage.newest(block).bounds.map_or(lowest, |bounds| lowest.min(bounds.low.z));
        });
        let Body::Soft(soft) = &stage.newest(block).body else { panic!("a soft body") };
        let middle = soft.positions.iter().sum::<DVec3>() / soft.positions.len() as f64;
        (middle, stage.settled(low, 1.5).state.position, lowest)
    }
}

#[test]
fn a_block_that_falls_on_a_box_stays_on_it_at_any_rates() {
    let fall = |rates, drop_m, mass_kg, segments| Fall { rates, drop_m, mass_kg, segments };
    for fall in [
        fall((240.0, 240.0), 0.2, 6.0, [4, 4, 2]),
        fall((100.0, 10.0), 0.55, 34.0, [4, 4, 2]),
        fall((240.0, 240.0), 0.2, 6.0, [8, 8, 3]),
        fall((1000.0, 1000.0), 0.2, 6.0, [4, 4, 2]),
    ] {
        let (block, low, lowest) = fall.play();
        let Fall { rates, drop_m, segments, .. } = fall;
        println!("{rates:?} {drop_m} {segments:?}: {block:.4} box {low:.4} lowest {lowest:.4}");
        // it bends down by 1 to 4 mm where nothing carries it, and the corners hang farthest when it lands
        assert!((0.146..0.15).contains(&block.z), "{rates:?} {drop_m} {segments:?}: at {block}");
        assert!(block.truncate().length() < 0.025, "{rates:?} {drop_m} {segments:?}: thrown aside to {block}");
        assert!((low.z - 0.05).abs() < 1e-3, "{rates:?} {drop_m} {segments:?}: the box is at {low}");
        assert!(lowest > 0.06, "{rates:?} {drop_m} {segments:?}: it came down to {lowest}");
    }
}

#[test]
fn a_ball_that_starts_in_the_skin_of_a_block_comes_out_where_it_is_nearer() {
    for (depth_m, rates) in
        [(0.03, (240.0, 60.0)), (0.03, (60.0, 240.0)), (0.02, (240.0, 60.0)), (0.029, (240.0, 240.0))]
    {
        let cushion = SoftSpec {
            matter: SoftMatter { young_pa: 5e4, damping_per_s: 1.0, ..MATTER },
            position: DVec3::new(-0.125, -0.125, -0.1),
            held: vec![Side::Bottom],
            gravity: G,
            ..spec(SoftShape::Box { size_m: DVec3::new(0.25, 0.25, 0.1), segments: [4, 4, 2] })
        };
        let solid = Solid::Ball { radius_m: 0.03 };
        let ball = RigidSpec { gravity: G, ..RigidSpec::free(solid, DVec3::Z * (0.03 - depth_m), 0.3) };
        let mut stage = Stage::new(Faults::default());
        stage.add(SoftBody::new(cushion).unwrap(), rates.0);
        let ball = stage.add(RigidBody::new(ball).unwrap(), rates.1);
        stage.run(0.5, |_| {});
        let at = stage.settled(ball, 0.5).state.position;
        println!("{depth_m} {rates:?}: {at:.4}");
        assert!((0.015..0.04).contains(&at.z), "{depth_m} m deep at {rates:?}: it is at {at}");
    }
}

/// Pushed out on all sides of the post the sheet would hold a hundred joules.
#[test]
fn a_sheet_that_is_held_around_a_post_hangs_as_if_it_were_bored() {
    let post = |half_m: f64| Obstacle {
        name: String::new(),
        solid: Solid::Box { half_extents_m: DVec3::new(half_m, half_m, 0.1) },
        position: DVec3::new(0.2, 0.2, 0.0),
        rotation: DQuat::IDENTITY,
        friction: 0.5,
        restitution: 0.0,
    };
    let shape = SoftShape::Sheet { size_m: [0.4, 0.4], thickness_m: 0.002, segments: [8, 8] };
    let held =
        |obstacles| SoftSpec { held: vec![Side::Left, Side::Right], gravity: G, obstacles, ..spec(shape.clone()) };
    let mut lonely = SoftBody::new(held([].into())).unwrap();
    let mut through = SoftBody::new(held([post(0.08)].into())).unwrap();
    let total_j = |body: &SoftBody| {
        let at = state(body).positions;
        let mass_kg = 1000.0 * 0.4 * 0.4 * 0.002;
        body.energy_j() + mass_kg * 9.81 * at.iter().map(|x| x.z).sum::<f64>() / at.len() as f64
    };
    for body in [&mut lonely, &mut through] {
        run(body, 0.004, 10);
    }
    assert_eq!(state(&lonely).positions, state(&through).positions);
    for _ in 0..100 {
        run(&mut through, 0.004, 2);
        assert!(total_j(&through) < 1e-2, "0 J -> {} J", total_j(&through));
    }
}

/// What was on its way to the ball was given at once to the first of the parts of its step: it went through, or flew with 59 mJ more.
#[test]
fn a_soft_ball_that_falls_on_a_soft_slab_comes_to_lie_on_it() {
    let matter = SoftMatter { density_kg_m3: 1050.0, damping_per_s: 3.0, ..MATTER };
    let made = |shape, young_pa, position, speed_m_s: f64| SoftSpec {
        matter: SoftMatter { young_pa, ..matter },
        gravity: G,
        position,
        velocity: DVec3::NEG_Z * speed_m_s,
        obstacles: [floor()].into(),
        ..spec(shape)
    };
    let rates = [(60.0, 60.0), (120.0, 60.0), (240.0, 60.0), (1000.0, 60.0), (60.0, 120.0), (60.0, 1000.0)];
    for (rates, speed_m_s) in rates.into_iter().flat_map(|rates| [0.7, 3.0].map(|v| (rates, v))) {
        let slab = SoftShape::Box { size_m: DVec3::new(0.3, 0.3, 0.1), segments: [3, 4, 2] };
        let slab = made(slab, 1e5, DVec3::new(-0.15, -0.15, 0.0), 0.0);
        let ball = SoftShape::Ball { radius_m: 0.05, segments: 4 };
        let ball = made(ball, 5e4, DVec3::new(-0.041, 0.0416, 0.175), speed_m_s);
        let mut stage = Stage::new(Faults::default());
        let slab = stage.add(SoftBody::new(slab).unwrap(), rates.0);
        let ball = stage.add(SoftBody::new(ball).unwrap(), rates.1);
        let energy_j = |stage: &Stage| stage.newest(slab).energy_j + stage.newest(ball).energy_j;
        let (start_j, mut most_j) = (energy_j(&stage), f64::NEG_INFINITY);
        stage.run(1.2, |stage| most_j = most_j.max(energy_j(stage) - start_j));
        let owner = stage.owner([slab, ball]);
        let deep_m = stage.newest(owner).pairs[0].penetration_m;
        let low_m = stage.newest(ball).bounds.unwrap().low.z;
        println!("{rates:?}, {speed_m_s} m/s: {deep_m:.1e} m deep, bottom at {low_m}, {most_j} J");
        assert!(most_j < 1e-3 * start_j, "{rates:?}, {speed_m_s} m/s: it gained {most_j} of {start_j} J");
        // it presses the slab in by 1 to 5 mm
        assert!(deep_m < 1e-3 && low_m > 0.092, "{rates:?}, {speed_m_s} m/s: {deep_m} m deep, at {low_m}");
    }
}

/// A plate of 1 cm comes down tilted, a corner first, on a soft block and the floor, and turns into the block by more than its thickness
/// in a step of 60 Hz: the block's vertices were then pushed out on both of its sides, and both flew off with kilojoules.
#[test]
fn a_thin_plate_that_cuts_into_a_soft_block_gains_nothing() {
    // (rates of block and plate, how far beside the middle, the order of its turns)
    let falls = [
        ((60.0, 61.0), 0.0, EulerRot::XYZ),
        ((60.0, 61.0), 0.045, EulerRot::ZYX),
        ((120.0, 60.0), 0.045, EulerRot::XYZ),
        ((120.0, 60.0), 0.045, EulerRot::ZYX),
    ];
    for (rates, x, order) in falls {
        let block = SoftSpec {
            matter: SoftMatter { young_pa: 1e5, damping_per_s: 2.0, ..MATTER },
            position: DVec3::new(-0.03, -0.03, 0.0),
            gravity: G,
            friction: 0.5,
            obstacles: [floor()].into(),
            ..spec(SoftShape::Box { size_m: DVec3::new(0.06, 0.06, 0.04), segments: [3, 3, 2] })
        };
        let start = DVec3::new(x, 0.003, 0.145);
        let free = RigidSpec::free(Solid::Box { half_extents_m: DVec3::new(0.08, 0.06, 0.005) }, start, 0.4);
        let turn = [10.0_f64, 20.0, 30.0].map(f64::to_radians);
        let [a, b, c] = turn;
        let (a, c) = if matches!(order, EulerRot::XYZ) { (a, c) } else { (c, a) };
        let rotation = DQuat::from_euler(order, a, b, c);
        let plate = RigidSpec { rotation, gravity: G, friction: 0.5, obstacles: [floor()].into(), ..free };
        let mut stage = Stage::new(Faults::default());
        let block = stage.add(SoftBody::new(block).unwrap(), rates.0);
        let plate = stage.add(RigidBody::new(plate).unwrap(), rates.1);
        let (mut highest, mut tank_j) = (f64::NEG_INFINITY, 0.0_f64);
        stage.run(1.5, |stage| {
            let bounds = |id| stage.newest(id).bounds.map_or(0.0, |bounds| bounds.high.z);
            highest = highest.max(bounds(block)).max(bounds(plate));
            tank_j = stage.newest(block).pairs.iter().filter_map(|pair| pair.tank_j).fold(tank_j, f64::min);
        });
        let end = stage.settled(plate, 1.5).state.position;
        println!("{rates:?} {x} {order:?}: highest {highest}, tank {tank_j} J, in the end at {end}");
        // no point of the plate is farther than 10 cm from its middle
        assert!(highest < start.z + 0.11 && end.length() < 0.3, "{rates:?} {x}: highest {highest}, at {end}");
        // it has 0.57 J to lose; what pushes it out of where it came by its landing the tank counts too
        assert!(tank_j > -3.0, "{rates:?} {x}: {tank_j} J");
    }
}
