//! The solve against problems small enough to be solved another way.

use super::*;
use glam::DVec3;
use metachron_core::ContactJacobian;

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

/// A dense symmetric positive inverse mass over slots, the same along each axis.
struct Dense(Vec<Vec<f64>>);

impl Dense {
    fn random(n: usize, random: &mut Random) -> Self {
        let b: Vec<Vec<f64>> = (0..n).map(|_| (0..n).map(|_| random.next()).collect()).collect();
        let entry = |i: usize, j: usize| {
            b[i].iter().zip(&b[j]).map(|(x, y)| x * y).sum::<f64>() + if i == j { 0.3 } else { 0.0 }
        };
        Self((0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect())
    }

    fn diagonal(inverse_masses: &[f64]) -> Self {
        let n = inverse_masses.len();
        Self((0..n).map(|i| (0..n).map(|j| if i == j { inverse_masses[i] } else { 0.0 }).collect()).collect())
    }

    fn mobilities(&self) -> Vec<f64> {
        (0..self.0.len()).map(|i| self.0[i][i]).collect()
    }
}

impl Response for Dense {
    fn respond(&mut self, impulses: &mut [DVec3]) {
        let out: Vec<DVec3> =
            self.0.iter().map(|row| row.iter().zip(impulses.iter()).map(|(a, j)| *j * *a).sum()).collect();
        impulses.copy_from_slice(&out);
    }
}

const STRICT: Settings = Settings { iterations: 5_000, tolerance_m_s: 1e-11 };

fn random_contacts(count: u32, slots: u32, friction: f64, random: &mut Random) -> Vec<Contact> {
    let mut contact = |key: u32| {
        let mut at = ContactJacobian::default();
        at.add_linear(key % slots, 0.7);
        at.add_linear((key + 1) % slots, 0.3);
        at.add_angular((key + 2) % slots, random.vector() * 0.2);
        let gap_m = random.next() * 0.01;
        Contact {
            key: u64::from(key),
            jacobian: at,
            normal: random.vector().normalize(),
            gap_m,
            friction,
            rebound_m_s: 0.0,
            back_m_s: DVec3::ZERO,
            age_s: 0.0,
        }
    };
    (0..count).map(&mut contact).collect()
}

fn after(contacts: &[Contact], free: &[DVec3], body: &mut Dense, settings: Settings) -> (Vec<DVec3>, Solver) {
    let (mut velocities, mut solver) = (free.to_vec(), Solver::default());
    let mobilities = body.mobilities();
    let problem = Problem { contacts, related_keys: &[], h_s: 0.01, mobilities: &mobilities, settings };
    solver.solve(&problem, &mut velocities, body);
    (velocities, solver)
}

/// Block Gauss–Seidel, contact by contact, thousands of times: another way to the same laws.
fn sweeps(contacts: &[Contact], free: &[DVec3], body: &mut Dense) -> Vec<DVec3> {
    let mut lambdas = vec![DVec3::ZERO; contacts.len()];
    let (mut velocities, mobilities) = (free.to_vec(), body.mobilities());
    for _ in 0..20_000 {
        for (contact, lambda) in contacts.iter().zip(&mut lambdas) {
            let slope = contact.jacobian.velocity(&velocities) + contact.normal * contact.bias_m_s(0.01);
            let next = contact.project(*lambda - slope / (3.0 * contact.jacobian.mobility(&mobilities)));
            let mut change = vec![DVec3::ZERO; velocities.len()];
            contact.jacobian.scatter(next - *lambda, &mut change);
            body.respond(&mut change);
            velocities.iter_mut().zip(&change).for_each(|(v, dv)| *v += *dv);
            *lambda = next;
        }
    }
    velocities
}

#[test]
fn the_solve_agrees_with_gauss_seidel_on_random_problems() {
    let mut random = Random(7);
    for trial in 0..20 {
        let mut body = Dense::random(6, &mut random);
        let contacts = random_contacts(5, 6, 0.3, &mut random);
        let free: Vec<DVec3> = (0..6).map(|_| random.vector()).collect();
        let (ours, _) = after(&contacts, &free, &mut body, STRICT);
        let theirs = sweeps(&contacts, &free, &mut body);
        let error = ours.iter().zip(&theirs).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
        // both stop near 1e-11 m/s; the condition of these matrices is below 1e3
        assert!(error < 1e-8, "trial {trial}: {error} m/s");
    }
}

/// A body that yields to nothing asks for impulses without end: who was taken for one is solved for anew.
#[test]
fn an_undone_solve_leaves_no_trace() {
    let mut random = Random(17);
    let (mut body, mut rigid) = (Dense::random(6, &mut random), Dense::diagonal(&[1e-9; 6]));
    let contacts = random_contacts(5, 6, 0.3, &mut random);
    let free: Vec<DVec3> = (0..6).map(|_| random.vector()).collect();
    let mobilities = body.mobilities();
    let few = Settings { iterations: 10, tolerance_m_s: 1e-11 };
    let problem = Problem { contacts: &contacts, related_keys: &[], h_s: 0.01, mobilities: &mobilities, settings: few };
    let [one, other] = [false, true].map(|strays| {
        let mut solver = Solver::default();
        solver.solve(&problem, &mut free.clone(), &mut body);
        if strays {
            solver.solve(&problem, &mut free.clone(), &mut rigid);
            solver.undo();
        }
        let mut velocities = free.clone();
        solver.solve(&problem, &mut velocities, &mut body);
        velocities
    });
    assert_eq!(one, other);
}

/// The first solve asks the body, the second one finds that W costs less.
#[test]
fn a_solve_with_a_formed_matrix_gives_the_same_impulses() {
    let mut random = Random(13);
    let mut formed = 0;
    for trial in 0..20 {
        let mut body = Dense::random(6, &mut random);
        let contacts = random_contacts(5, 6, 0.3, &mut random);
        let free: Vec<DVec3> = (0..6).map(|_| random.vector()).collect();
        let (wanted, _) = after(&contacts, &free, &mut body, STRICT);
        let mobilities = body.mobilities();
        let problem =
            Problem { contacts: &contacts, related_keys: &[], h_s: 0.01, mobilities: &mobilities, settings: STRICT };
        let (mut solver, mut asked) = (Solver::forming(), 0);
        for again in [false, true] {
            // no warm start: what the second gives is found by W alone
            solver.forget();
            asked = 0;
            let mut velocities = free.clone();
            let report = solver.solve(&problem, &mut velocities, &mut |impulses: &mut [DVec3]| {
                asked += 1;
                body.respond(impulses);
            });
            let error = velocities.iter().zip(&wanted).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
            assert!(error < 1e-9, "trial {trial}, again {again}: {error} m/s after {report:?}");
        }
        // three a contact, and the one that says what the impulses do
        formed += usize::from(asked == 16);
    }
    assert!(formed >= 10, "W was formed {formed} times");
}

#[test]
fn every_law_holds_after_the_solve() {
    let mut random = Random(11);
    for _ in 0..20 {
        let mut body = Dense::random(8, &mut random);
        let contacts = random_contacts(7, 8, 0.4, &mut random);
        let free: Vec<DVec3> = (0..8).map(|_| random.vector()).collect();
        let (velocities, solver) = after(&contacts, &free, &mut body, STRICT);
        for (contact, impulse) in contacts.iter().zip(solver.impulses()) {
            let u = contact.jacobian.velocity(&velocities);
            let opening = u.dot(contact.normal) + contact.bias_m_s(0.01);
            let push = impulse.dot(contact.normal);
            // the solve stops at 1e-11 m/s; sticking contacts share it among neighbours
            assert!(opening > -1e-9, "{opening} m/s into the other body");
            assert!(push >= 0.0);
            assert!(push * opening < 1e-8, "pushes {push} N·s while opening at {opening} m/s");
            let across = (*impulse - contact.normal * push).length();
            assert!(across <= contact.friction * push * (1.0 + 1e-12) + 1e-15);
        }
    }
}

#[test]
fn a_step_with_touching_contacts_never_adds_energy() {
    let mut random = Random(3);
    for trial in 0..50 {
        let inverse: Vec<f64> = (0..6).map(|_| 1.0 + 0.9 * random.next()).collect();
        let mut body = Dense::diagonal(&inverse);
        let mut contacts = random_contacts(8, 6, 0.5, &mut random);
        contacts.iter_mut().for_each(|c| c.gap_m = 0.0);
        let free: Vec<DVec3> = (0..6).map(|_| random.vector()).collect();
        let energy = |v: &[DVec3]| v.iter().zip(&inverse).map(|(v, w)| v.length_squared() / (2.0 * w)).sum::<f64>();
        for iterations in [1, 2, 4, 8, 16, 5_000] {
            let settings = Settings { iterations, ..STRICT };
            let (velocities, _) = after(&contacts, &free, &mut body, settings);
            let (before, now) = (energy(&free), energy(&velocities));
            assert!(now <= before * (1.0 + 1e-12), "trial {trial}, {iterations} iterations: {before} J -> {now} J");
        }
    }
}

#[test]
fn contacts_between_parts_of_one_body_keep_its_momentum() {
    let mut random = Random(5);
    let masses: Vec<f64> = (0..4).map(|_| 1.0 + 0.5 * random.next()).collect();
    let mut body = Dense::diagonal(&masses.iter().map(|m| 1.0 / m).collect::<Vec<_>>());
    let mut slots = ContactJacobian::default();
    for (slot, weight) in [(0, 0.3), (1, 0.7), (2, -0.6), (3, -0.4)] {
        slots.add_linear(slot, weight);
    }
    let contact = Contact {
        key: 1,
        jacobian: slots,
        normal: DVec3::X,
        gap_m: 0.0,
        friction: 0.4,
        rebound_m_s: 0.0,
        back_m_s: DVec3::ZERO,
        age_s: 0.0,
    };
    let free: Vec<DVec3> =
        [-1.0, -1.0, 1.0, 1.0].iter().map(|&x| DVec3::new(x, 0.1, 0.0) + random.vector() * 0.1).collect();
    let (velocities, solver) = after(&[contact], &free, &mut body, STRICT);
    assert!(solver.impulses()[0].x > 0.1);
    let momentum = |v: &[DVec3]| -> DVec3 { v.iter().zip(&masses).map(|(v, m)| *v * *m).sum() };
    let change = momentum(&velocities) - momentum(&free);
    assert!(change.length() < 1e-15, "{change}"); // 4 roundings of numbers near 1
}

/// A row of particles on an incline: how far does the middle one slide in a second?
fn slide_on_incline(slope: f64, friction: f64) -> f64 {
    const N: u32 = 5;
    let (h, gravity) = (0.005, DVec3::new(slope.sin(), 0.0, -slope.cos()) * 9.81);
    let mut body = Dense::diagonal(&[10.0; N as usize]);
    let contacts: Vec<Contact> = (0..N)
        .map(|i| {
            let mut slots = ContactJacobian::default();
            slots.add_linear(i, 1.0);
            Contact {
                key: u64::from(i),
                jacobian: slots,
                normal: DVec3::Z,
                gap_m: 0.0,
                friction,
                rebound_m_s: 0.0,
                back_m_s: DVec3::ZERO,
                age_s: 0.0,
            }
        })
        .collect();
    let (mut velocities, mut solver, mut way) = ([DVec3::ZERO; N as usize], Solver::default(), 0.0);
    let settings = Settings { iterations: 50, tolerance_m_s: 1e-9 };
    for _ in 0..200 {
        velocities.iter_mut().for_each(|v| *v += gravity * h);
        let problem =
            Problem { contacts: &contacts, related_keys: &[], h_s: h, mobilities: &[10.0; N as usize], settings };
        solver.solve(&problem, &mut velocities, &mut body);
        way += velocities[2].x * h;
    }
    way
}

#[test]
fn a_chain_on_an_incline_sticks_below_the_friction_angle_and_slides_above() {
    let friction = 0.5_f64;
    assert!(slide_on_incline((friction * 0.99).atan(), friction) < 1e-6); // 200 steps within 1e-9 m/s each
    let slope = (friction * 1.2).atan();
    let expected = 0.5 * 9.81 * (slope.sin() - friction * slope.cos());
    let way = slide_on_incline(slope, friction);
    // semi-implicit Euler is ahead by h a t / 2: 0.5 % of the way after 200 steps
    assert!((way / expected - 1.005).abs() < 1e-4, "{way} m, not {expected} m");
}

#[test]
fn a_warm_start_saves_most_of_the_responses() {
    let mut random = Random(23);
    let mut body = Dense::random(8, &mut random);
    let contacts = random_contacts(7, 8, 0.4, &mut random);
    let free: Vec<DVec3> = (0..8).map(|_| random.vector()).collect();
    let mobilities = body.mobilities();
    let settings = Settings { iterations: 500, tolerance_m_s: 1e-6 };
    let problem = Problem { contacts: &contacts, related_keys: &[], h_s: 0.01, mobilities: &mobilities, settings };
    let mut solver = Solver::default();
    let cold = solver.solve(&problem, &mut free.clone(), &mut body);
    let warm = solver.solve(&problem, &mut free.clone(), &mut body);
    assert!(cold.residual_m_s <= 1e-6 && warm.residual_m_s <= 1e-6);
    assert!(warm.iterations * 4 <= cold.iterations, "cold {}, warm {}", cold.iterations, warm.iterations);
}

#[test]
fn contacts_that_stay_open_cost_no_response() {
    let mut slots = ContactJacobian::default();
    slots.add_linear(0, 1.0);
    let contacts = [Contact {
        key: 0,
        jacobian: slots,
        normal: DVec3::Z,
        gap_m: 0.1,
        friction: 0.5,
        rebound_m_s: 0.0,
        back_m_s: DVec3::ZERO,
        age_s: 0.0,
    }];
    let problem = Problem { contacts: &contacts, related_keys: &[], h_s: 0.01, mobilities: &[1.0], settings: STRICT };
    let mut never = |_: &mut [DVec3]| unreachable!("nothing touches");
    let mut velocities = [DVec3::new(0.0, 0.0, -5.0)];
    let report = Solver::default().solve(&problem, &mut velocities, &mut never);
    assert_eq!((report.iterations, velocities[0].z), (0, -5.0));
}

#[test]
fn an_impulse_passes_to_a_related_key() {
    let mut body = Dense::diagonal(&[1.0]);
    let mut slots = ContactJacobian::default();
    slots.add_linear(0, 1.0);
    let mut solver = Solver::default();
    let mut press = |key: u64| {
        let contacts = [Contact {
            key,
            jacobian: slots,
            normal: DVec3::Z,
            gap_m: 0.0,
            friction: 0.5,
            rebound_m_s: 0.0,
            back_m_s: DVec3::ZERO,
            age_s: 0.0,
        }];
        let mut velocities = [DVec3::new(0.1, 0.0, -1.0)];
        let problem =
            Problem { contacts: &contacts, related_keys: &[-1, 1], h_s: 0.01, mobilities: &[0.3], settings: STRICT };
        solver.solve(&problem, &mut velocities, &mut body).iterations
    };
    assert!(press(7) > 1);
    assert_eq!([press(7), press(8), press(7)], [1; 3]);
    assert!(press(9) > 1); // two names away is nobody's kin
}
