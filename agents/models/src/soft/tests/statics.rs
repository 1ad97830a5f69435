//! Rest shapes against closed forms: beam theory, the stretched bar, the membrane, the catenary.

use super::*;

/// Steps until it rests, and returns where a vertex is.
fn settled(body: &mut SoftBody, dt_s: f64, steps: u32) -> SoftState {
    run(body, dt_s, steps);
    state(body)
}

fn damped(material: SoftMaterial) -> SoftMaterial {
    SoftMaterial { damping_per_s: 20.0, ..material }
}

#[test]
fn a_solid_cantilever_sags_like_a_beam() {
    let (length, side) = (0.4, 0.04);
    for segments in [[4, 1, 1], [8, 1, 1], [16, 2, 2]] {
        let shape = SoftShape::Box { size_m: DVec3::new(length, side, side), segments };
        let material = damped(SoftMaterial { young_pa: 1e7, poisson: 0.0, ..MATERIAL });
        let mut body = SoftBody::new(SoftSpec { material, gravity: G, held: vec![Side::Left], ..spec(shape) }).unwrap();
        let tip = settled(&mut body, 0.02, 400).positions.last().unwrap().z - side;
        // w L⁴/8EI + w L²/(2 κ G A), κ = 5/6, G = E/2
        let (w, i, a) = (1000.0 * 9.81 * side * side, side.powi(4) / 12.0, side * side);
        let wanted = w * length.powi(4) / (8.0 * 1e7 * i) + w * length * length / (2.0 * 5.0 / 6.0 * 5e6 * a);
        let error = -tip / wanted - 1.0;
        println!("{segments:?}: {tip} {wanted} {error}");
        assert!(error.abs() < 4e-3, "{segments:?}: {error}"); // 6 % of the length: past the theory's small angles by 2e-3
    }
}

#[test]
fn a_bar_hung_by_one_end_stretches_by_its_weight() {
    let shape = SoftShape::Box { size_m: DVec3::new(0.4, 0.04, 0.04), segments: [8, 1, 1] };
    let material = damped(SoftMaterial { poisson: 0.0, young_pa: 1e6, ..MATERIAL });
    let spec = SoftSpec { material, gravity: DVec3::X * 9.81, held: vec![Side::Left], ..spec(shape) };
    let mut body = SoftBody::new(spec).unwrap();
    let longer = settled(&mut body, 0.02, 400).positions.last().unwrap().x - 0.4;
    let wanted = 1000.0 * 9.81 * 0.16 / (2.0 * 1e6); // ρ g L²/2E
    // linear elasticity under a linear load: exact at the vertices
    assert!((longer / wanted - 1.0).abs() < 1e-9, "{longer} {wanted}");
}

#[test]
fn a_strip_of_sheet_bends_like_a_plate() {
    let (length, thickness) = (0.1, 0.002);
    for (segments, most) in [([10, 1], 0.01), ([10, 3], 0.01), ([20, 3], 0.004)] {
        let shape = SoftShape::Sheet { size_m: [length, 0.03], thickness_m: thickness, segments };
        let material = damped(SoftMaterial { young_pa: 1e8, poisson: 0.0, ..MATERIAL });
        // held along two rows: the sheet leaves the wall level
        let mut body = SoftBody::new(SoftSpec { material, gravity: G, held: vec![Side::Left], ..spec(shape) }).unwrap();
        let first = length / f64::from(segments[0]);
        for (held, rest) in body.mesh.held.iter_mut().zip(&body.mesh.rest) {
            *held |= rest.x < 1.5 * first;
        }
        body.system = body.mesh.system(&body.positions);
        let tip = settled(&mut body, 0.02, 400).positions.last().unwrap().z;
        // two rows make a wall half-way between them
        let free = length - 0.5 * first;
        let rigidity = 1e8 * thickness.powi(3) / 12.0;
        let wanted = 1000.0 * thickness * 9.81 * free.powi(4) / (8.0 * rigidity);
        let error = -tip / wanted - 1.0;
        println!("{segments:?}: {tip} {wanted} {error}");
        assert!(error.abs() < most, "{segments:?}: {error}");
    }
}

#[test]
fn a_sheet_between_two_walls_sags_like_a_string() {
    for (segments, most) in [([8, 2], 0.015), ([16, 4], 0.004)] {
        let shape = SoftShape::Sheet { size_m: [0.4, 0.1], thickness_m: 0.001, segments };
        let material = damped(SoftMaterial { young_pa: 1e6, poisson: 0.0, ..MATERIAL });
        let held = vec![Side::Left, Side::Right];
        let mut body = SoftBody::new(SoftSpec { material, gravity: G, held, ..spec(shape) }).unwrap();
        let lowest = settled(&mut body, 0.02, 600).positions.iter().map(|x| x.z).fold(0.0, f64::min);
        // a shallow parabola: H = w L²/8s, and the strain 8/3 (s/L)² makes H/(E t): s³ = 3 w L⁴/(64 E t)
        let (w, l) = (1000.0 * 0.001 * 9.81, 0.4_f64);
        let wanted = (3.0 * w * l.powi(4) / (64.0 * 1e6 * 0.001)).cbrt();
        let error = -lowest / wanted - 1.0;
        println!("{segments:?}: {lowest} {wanted} {error}");
        assert!(error.abs() < most, "{segments:?}: {error}");
    }
}

#[test]
fn a_rope_hangs_in_a_catenary() {
    // /tests/reference/catenary.json, inextensible: span 0.5 L sags 0.39819418 L, span 0.8 L sags 0.26543751 L
    for (span, sag) in [(0.5, 0.398_194_177_9), (0.8, 0.265_437_509_1)] {
        for (segments, most) in [(20, 3e-3), (80, 3e-4)] {
            // a V of length 1 that just reaches the other end
            let low = DVec3::new(0.5 * span, 0.0, -0.5 * libm::sqrt(1.0 - span * span));
            let path_m = vec![DVec3::ZERO, low, DVec3::X * span];
            let shape = SoftShape::Rope { path_m, radius_m: 0.005, segments };
            let material = damped(SoftMaterial { young_pa: 1e8, ..MATERIAL });
            let held = vec![Side::Left, Side::Right];
            let mut body = SoftBody::new(SoftSpec { material, gravity: G, held, ..spec(shape) }).unwrap();
            let lowest = settled(&mut body, 0.02, 1000).positions.iter().map(|x| x.z).fold(0.0, f64::min);
            let error = -lowest / sag - 1.0;
            println!("{span} {segments}: {lowest} {sag} {error}");
            assert!(error.abs() < most, "{span} {segments}: {error}");
        }
    }
}

#[test]
fn a_nearly_incompressible_cantilever_does_not_lock() {
    // refined: 64 × 4 × 4 cells sag 23.01 mm, 32 × 8 × 8 cells 22.71 mm; Timoshenko's beam, whose wall leaves the section free to contract, 23.83
    let (length, side, refined) = (0.4, 0.04, 0.0231);
    for (segments, most) in [([16, 1, 1], 0.01), ([16, 2, 2], 0.05), ([16, 4, 4], 0.05)] {
        let shape = SoftShape::Box { size_m: DVec3::new(length, side, side), segments };
        let material = damped(SoftMaterial { young_pa: 1e7, poisson: 0.499, ..MATERIAL });
        let mut body = SoftBody::new(SoftSpec { material, gravity: G, held: vec![Side::Left], ..spec(shape) }).unwrap();
        let tip = settled(&mut body, 0.02, 400).positions.last().unwrap().z - side;
        let error = -tip / refined - 1.0;
        println!("{segments:?}: {tip} {error}");
        assert!(error.abs() < most, "{segments:?}: {error}");
    }
}

#[test]
fn a_bar_that_swings_along_itself_fades_as_rayleigh_says() {
    let (length, young, density) = (0.4, 1e6, 1000.0);
    for damping_s in [0.0, 5e-4, 2e-3] {
        let shape = SoftShape::Box { size_m: DVec3::new(length, 0.04, 0.04), segments: [40, 1, 1] };
        let material = SoftMaterial { young_pa: young, poisson: 0.0, damping_s, ..MATERIAL };
        let mut body = SoftBody::new(SoftSpec { material, held: vec![Side::Left], ..spec(shape) }).unwrap();
        let wave = std::f64::consts::FRAC_PI_2 / length;
        for (v, x) in body.velocities.iter_mut().zip(&body.mesh.rest) {
            *v = DVec3::X * (1e-3 * (wave * x.x).sin());
        }
        // whole periods: within one, damping works where it moves fastest
        let (h, steps) = (2e-5, 2530);
        let before = body.energy_j();
        run(&mut body, h, steps);
        let rate = (before / body.energy_j()).ln() / (h * f64::from(steps));
        // implicit Euler itself fades like a damping of one step
        let squared = wave * wave * young / density;
        let wanted = (damping_s + h) * squared;
        assert!((rate / wanted - 1.0).abs() < 0.05, "{damping_s}: {rate} 1/s, {wanted} wanted");
    }
}
