//! How a beam in a cage bends as its cells get finer: the first bending frequency of a free one, against Timoshenko's.

use super::*;

const LENGTH_M: f64 = 0.4;
const HEIGHT_M: f64 = 0.1;
const BENT: SoftMaterial = SoftMaterial { young_pa: 1e6, ..MATERIAL };
/// Length of a step, seconds: some five hundred in a period.
const STEP_S: f64 = 1e-4;
/// How many cells are across the beam, from the coarsest on.
const ACROSS: [u32; 5] = [2, 3, 4, 5, 6];

/// The turn of the beam in its own axes: its surface cuts cells of its cage.
fn turn() -> DQuat {
    DQuat::from_rotation_z(0.5)
}

fn beam(across: u32) -> SoftBody {
    let size_m = DVec3::new(LENGTH_M, HEIGHT_M, HEIGHT_M);
    let skin = SoftShape::Box { size_m, segments: [16, 4, 4] }.skin().unwrap();
    let points = skin.points.iter().map(|point| turn() * *point).collect();
    let eps_m = HEIGHT_M / f64::from(across);
    let surface = Arc::new(Triangles { points, ..skin });
    let shape = SoftShape::Embedded { surface, eps_m, range_m: (eps_m, eps_m) };
    SoftBody::new(SoftSpec { material: BENT, ..spec(shape) }).unwrap()
}

/// The frequency of the first bending mode, Hz: after half a period its share comes back through where it was.
fn frequency(across: u32) -> f64 {
    let mut body = beam(across);
    let along = |x: DVec3| (turn().inverse() * x).x / LENGTH_M - 0.5;
    // nearly the mode
    let shape: Vec<f64> = body.positions.iter().map(|x| 12.0 * along(*x).powi(2) - 1.0).collect();
    body.velocities.iter_mut().zip(&shape).for_each(|(v, shape)| *v = DVec3::Z * (0.01 * shape));
    let momentum = body.linear_momentum() / body.mass_kg();
    body.velocities.iter_mut().for_each(|v| *v -= momentum);
    let start = body.positions.clone();
    let mut above = f64::NEG_INFINITY;
    for step in 1..1000 {
        run(&mut body, STEP_S, 1);
        // other modes have next to nothing of it
        let moved = body.positions.iter().zip(&start).map(|(x, start)| x.z - start.z);
        let share: f64 = moved.zip(&body.mesh.mass_kg).zip(&shape).map(|((z, mass), shape)| z * mass * shape).sum();
        if share < 0.0 && above > 0.0 {
            return 0.5 / ((f64::from(step) - share / (share - above)) * STEP_S);
        }
        above = share;
    }
    panic!("{across} cells across: it does not swing back");
}

#[test]
fn a_beam_of_cut_cells_bends_with_second_order() {
    let exact = timoshenko_free_hz(LENGTH_M, HEIGHT_M, BENT.young_pa, BENT.poisson, BENT.density_kg_m3);
    let errors = ACROSS.map(|across| (frequency(across) / exact - 1.0).abs());
    let order = order_of(errors);
    assert!(order >= 1.9, "order {order} of {errors:?}");
    assert!(errors[4] < 0.01, "{errors:?}");
}

/// The order of errors in ε: the slope of the line that fits their logarithms best.
fn order_of(errors: [f64; 5]) -> f64 {
    let points: Vec<[f64; 2]> =
        ACROSS.iter().zip(errors).map(|(across, error)| [f64::from(*across).ln(), error.ln()]).collect();
    let mean = |of: usize| points.iter().map(|point| point[of]).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(0), mean(1));
    let slope = |of: usize, m: f64| points.iter().map(|point| (point[0] - x) * (point[of] - m)).sum::<f64>();
    -slope(1, y) / slope(0, x)
}

/// The first bending frequency of a free square beam, Hz: the lowest root of Timoshenko's equation for symmetric modes.
fn timoshenko_free_hz(length_m: f64, height_m: f64, young_pa: f64, poisson: f64, density: f64) -> f64 {
    let area = height_m * height_m;
    let inertia = height_m.powi(4) / 12.0;
    // Cowper's shear coefficient of a square section
    let kappa = 10.0 * (1.0 + poisson) / (12.0 + 11.0 * poisson);
    let kga = kappa * young_pa / (2.0 * (1.0 + poisson)) * area;
    let (mass, rotary, rigid) = (density * area, density * inertia, young_pa * inertia);
    // deflection cosh(a x) and cos(b x), about the middle; moment and shear vanish at the ends
    let residue = |w: f64| {
        let w2 = w * w;
        let p = w2 * (mass / kga + rotary / rigid);
        let q = w2 * mass / rigid * (w2 * rotary / kga - 1.0);
        let root = (0.25 * p * p - q).sqrt();
        let (a, b) = ((root - 0.5 * p).sqrt(), (root + 0.5 * p).sqrt());
        // turn of the section over the slope of each: ψ' from the balance of shear, kga (w'' − ψ') = −mass w² w
        let of_cosh = (kga * a * a + mass * w2) / (kga * a);
        let of_cos = (kga * b * b - mass * w2) / (kga * b);
        let h = 0.5 * length_m;
        // moment: ψ'; shear: w' − ψ
        let moment = [of_cosh * a * (a * h).cosh(), -of_cos * b * (b * h).cos()];
        let shear = [(a - of_cosh) * (a * h).sinh(), -(b - of_cos) * (b * h).sin()];
        moment[0] * shear[1] - moment[1] * shear[0]
    };
    let euler = 22.3733 / (length_m * length_m) * (rigid / mass).sqrt();
    let (mut low, mut high) = (0.3 * euler, 1.05 * euler);
    let sign = residue(low).signum();
    assert!(residue(high).signum() != sign);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if residue(middle).signum() == sign { low = middle } else { high = middle }
    }
    low / std::f64::consts::TAU
}
