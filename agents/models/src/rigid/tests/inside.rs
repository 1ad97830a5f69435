//! Rigid bodies that start inside fixed solids come out of them, and stay where they come out.

use super::*;

#[test]
fn a_body_that_starts_inside_the_ground_comes_out_without_a_jump() {
    let block = Obstacle { solid: Solid::Box { half_extents_m: DVec3::ONE }, position: -UP, ..floor(0.5) };
    for ground in [floor(0.5), block] {
        for height in [0.09, 0.05, 0.0, -0.05, -0.15] {
            for solid in [Solid::Ball { radius_m: 0.1 }, cube(0.1, UP).solid] {
                let start = RigidSpec { obstacles: [ground.clone()].into(), ..spec(solid, UP * height) };
                let mut body = RigidBody::new(start).unwrap();
                let (mut highest, mut fastest) = (0.0_f64, 0.0_f64);
                for _ in 0..480 {
                    step(&mut body, 1.0 / 240.0);
                    let RigidState { position, velocity, .. } = state(&body);
                    (highest, fastest) = (highest.max(position.z), fastest.max(velocity.length()));
                }
                let case = format!("{:?} from {height} m: up to {highest} m at {fastest} m/s", ground.solid);
                assert!(snapshot(&body).at_rest && (state(&body).position.z - 0.1).abs() < 1e-4, "{case}");
                // 0.2 m/s would carry it 2 mm up
                assert!(highest < 0.102 && fastest < 0.2, "{case}");
            }
        }
    }
}
