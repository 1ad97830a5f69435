//! Many worlds at once, each in lockstep on a thread of its own: how hard a ball may be thrown at a box without pushing it off a table.
//!
//! `cargo run --no-default-features --example farm`

use metachron::prelude::*;

fn main() {
    let speeds_m_s: Vec<f64> = (1..=8).map(f64::from).collect();
    let ends: Vec<_> = std::thread::scope(|scope| {
        let worlds: Vec<_> = speeds_m_s.iter().map(|speed| scope.spawn(|| throw(*speed))).collect();
        worlds.into_iter().map(|world| world.join().expect("a world ends by itself")).collect()
    });
    for (speed, end) in speeds_m_s.iter().zip(ends) {
        match end {
            Ok(height_m) => println!("{speed} m/s: the box ends {height_m:.3} m high"),
            Err(error) => println!("{speed} m/s: {error}"),
        }
    }
}

/// How high the box is two seconds after the throw, metres.
fn throw(speed_m_s: f64) -> Result<f64, String> {
    let block = Rigid::cuboid([0.05; 3]).mass_kg(0.5).at([0.3, 0.0, 1.05]);
    let ball = Rigid::ball(0.04).mass_kg(0.3).at([-0.3, 0.0, 1.08]).velocity_m_s([speed_m_s, 0.0, 0.0]);
    let table = Solid::Box { half_extents_m: DVec3::new(0.5, 0.5, 0.5) };
    let scene = Scene::builder()
        .fixed("floor", Solid::Plane)
        .fixed_at("table", table, [0.0, 0.0, 0.5], DQuat::IDENTITY)
        .add("block", block)
        .add("ball", ball)
        .build()
        .map_err(|error| error.to_string())?;
    let world = World::start(&scene, ExecutorKind::Lockstep).map_err(|error| error.to_string())?;
    world.advance(SimSpan::from_millis(2000));
    let block = world.object("block").map_err(|error| error.to_string())?;
    let middle = world.frame().point(block, Anchor::Local(DVec3::ZERO)).map_err(|error| error.to_string())?;
    Ok(middle.z)
}
