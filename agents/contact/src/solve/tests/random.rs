//! Random problems of rigid and soft bodies: laws, passivity, and a slow method that shares data and biases with the solver.

use super::slow::gauss_seidel;
use super::{Body, Case, JointRow, Lattice, Seeded, contact, is_open, rigid, side_velocity};
use crate::solve::{Contact, Hold, Settings, Side, SideTerm, Solution, Solver, StepForm};
use glam::DVec3;

pub const COUNT: u64 = 200;

/// Two to six members of 0.03 to 30 kg, up to forty contacts, friction up to 1, a joint now and then.
pub fn random_case(seed: u64) -> Case {
    let mut numbers = Seeded::new(1000 + seed);
    let h_s = 1.0 / numbers.between(60.0, 500.0);
    let count = 2 + numbers.below(5);
    let bodies: Vec<Body> = (0..count).map(|_| random_body(&mut numbers)).collect();
    let contacts = (0..=numbers.below(40)).map(|_| random_contact(&mut numbers, &bodies)).collect();
    let rows = (0..numbers.below(3)).map(|_| {
        let sides = random_sides(&mut numbers, &bodies);
        let compliance_per_kg = Some(10.0_f64.powf(numbers.between(-5.0, -1.0)));
        let target_m_s = numbers.vector() * 0.1;
        JointRow { target_m_s, compliance_per_kg, ..JointRow::new(sides, Hold::ALL) }
    });
    let rows = rows.collect();
    Case { h_s, bodies, contacts, rows }
}

fn random_body(numbers: &mut Seeded) -> Body {
    let mass = 10.0_f64.powf(numbers.between(-1.5, 1.5));
    let mut body = if numbers.unit() < 0.5 {
        rigid(mass, DVec3::splat(0.05) + numbers.vector() * 0.03)
    } else {
        let stiffness = mass * 10.0_f64.powf(numbers.between(-2.0, 2.0));
        Lattice { side: 2, pitch: 0.05, mass, stiffness }.body()
    };
    let drift = numbers.vector() * 0.5;
    body.free.iter_mut().for_each(|v| *v = drift + numbers.vector() * 0.2);
    body
}

fn random_sides(numbers: &mut Seeded, bodies: &[Body]) -> [Side; 2] {
    let first = numbers.below(bodies.len());
    let second = numbers.below(bodies.len());
    let other = if second == first { Side::FIXED } else { random_side(numbers, second, &bodies[second]) };
    [random_side(numbers, first, &bodies[first]), other]
}

fn random_side(numbers: &mut Seeded, member: usize, body: &Body) -> Side {
    let size = body.free.len();
    if size == 2 {
        return Side::rigid(member, numbers.vector() * 0.06);
    }
    let start = numbers.below(size);
    let (a, b) = (numbers.unit(), numbers.unit());
    let weights = [a * b, a * (1.0 - b), 1.0 - a];
    let terms = [0, 1, 2].map(|i| SideTerm::weighted((start + i) % size, weights[i]));
    Side::new(member, &terms).unwrap()
}

fn random_contact(numbers: &mut Seeded, bodies: &[Body]) -> Contact {
    let sides = random_sides(numbers, bodies);
    let normal = (DVec3::Z * numbers.between(-1.0, 2.0) + numbers.vector()).normalize();
    let (gap_m, friction) = (numbers.between(0.0, 5e-4), numbers.unit());
    Contact { gap_m, friction, ..contact(sides, normal) }
}

pub fn solved(case: &Case, settings: Settings) -> Solution {
    case.with(|problem| Solver::new(settings).solve(problem).unwrap().clone())
}

pub fn velocities(case: &Case, solution: &Solution) -> Vec<Vec<DVec3>> {
    (0..case.bodies.len()).map(|member| solution.velocities(member).to_vec()).collect()
}

/// By how much the answer misses the laws, as a velocity, worked out from its velocities and impulses alone.
pub fn miss(case: &Case, solution: &Solution) -> f64 {
    let all = velocities(case, solution);
    let mut worst: f64 = 0.0;
    for (k, c) in case.contacts.iter().enumerate() {
        let (impulse, r) = (solution.contacts_n_s[k], solution.compliances_per_kg[k]);
        let bias = c.frame() * c.bias_m_s(case.h_s);
        let u = side_velocity(&c.sides[0], &all) - side_velocity(&c.sides[1], &all) + bias + impulse * r;
        let split = |v: DVec3| (v.dot(c.normal), v - c.normal * v.dot(c.normal));
        let ((un, ut), (pn, pt)) = (split(u), split(impulse));
        assert!(pn >= 0.0 && pt.length() <= c.friction * pn * (1.0 + 1e-12) + 1e-15, "{impulse} is not in its cone");
        // the dual cone: u_n + μ |u_t| ≥ μ |u_t|
        worst = worst.max(-un);
        if pn > 0.0 {
            // complementarity, as the power over the impulse
            let power = impulse.dot(u) + c.friction * ut.length() * pn;
            worst = worst.max((power / impulse.length()).abs());
        }
    }
    worst
}

/// D with biases in it, J.
fn work(case: &Case, solution: &Solution) -> f64 {
    let after = velocities(case, solution);
    let before: Vec<_> = case.bodies.iter().map(|body| body.free.clone()).collect();
    let relative =
        |sides: &[Side; 2], all: &[Vec<DVec3>]| side_velocity(&sides[0], all) - side_velocity(&sides[1], all);
    let mean = |sides: &[Side; 2]| (relative(sides, &after) + relative(sides, &before)) * 0.5;
    let contacts = case.contacts.iter().zip(&solution.contacts_n_s);
    let of_contacts: f64 = contacts.map(|(c, p)| p.dot(mean(&c.sides) + c.frame() * c.bias_m_s(case.h_s))).sum();
    let rows = case.rows.iter().zip(&solution.rows_n_s);
    of_contacts + rows.map(|(r, p)| p.dot(mean(&r.sides) - r.target_m_s)).sum::<f64>()
}

pub fn distance(a: &[Vec<DVec3>], b: &[Vec<DVec3>]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

/// Fine enough that answers may be compared.
pub const FINE: Settings =
    Settings { tolerance_m_s: 1e-9, depth_m: 20e-6, form: StepForm::Direct, still_m_s: 1e-12, factors_max: None };

#[test]
fn the_laws_hold_in_random_problems_and_no_answer_makes_energy() {
    let (mut factors, mut most, mut worst) = (0, 0, 0.0_f64);
    for seed in 0..2 * COUNT {
        let case = random_case(seed);
        let solution = solved(&case, Settings::default());
        let report = solution.report;
        factors += report.factors;
        most = most.max(report.factors);
        assert!(!is_open(&report), "seed {seed}: {report:?}");
        let (miss, work) = (miss(&case, &solution), work(&case, &solution));
        // twice the tolerance of the solve: impulses obey the laws, and their velocities may differ by as much again
        assert!(miss < 1e-5, "seed {seed} misses by {miss}: {report:?}");
        worst = worst.max(miss);
        // rounding of sums of joules
        assert!(work < 1e-11 && report.work_j < 1e-11, "seed {seed} makes {work} J");
    }
    println!("{factors} factors, most {most}, worst miss {worst:.1e} m/s");
}

#[test]
fn a_finer_tolerance_is_met_as_finely() {
    let mut worst = 0.0_f64;
    for seed in 0..COUNT {
        let case = random_case(seed);
        let solution = solved(&case, FINE);
        worst = worst.max(if is_open(&solution.report) { 0.0 } else { miss(&case, &solution) });
    }
    println!("worst miss {worst:.1e} m/s");
    assert!(worst < 1e-6, "{worst}"); // 40 times finer than above at a tolerance 5000 times finer: rounding at 1e7 of compliances
}

/// How far two answers are apart, over many problems.
#[derive(Default)]
pub struct Comparison {
    pub compared: usize,
    /// The greatest distance of two answers that agree.
    worst_m_s: f64,
    /// Problems with two answers that both obey the laws.
    pub ambiguous: usize,
}

/// Velocities that are further apart are those of two answers, m/s: the laws hold to 10⁻⁹ m/s, and a deformable or
/// light body moves by some thousand times that.
const AGREE_M_S: f64 = 1e-6;

impl Comparison {
    pub fn add(&mut self, apart: f64, other_miss: f64) {
        self.compared += 1;
        if apart < AGREE_M_S {
            self.worst_m_s = self.worst_m_s.max(apart);
        } else {
            // Coulomb's law has more than one answer where bodies jam; each must obey it
            assert!(other_miss < 1e-6, "{apart} m/s apart from an answer that misses by {other_miss}");
            self.ambiguous += 1;
        }
    }

    pub fn tell(&self) {
        let Self { compared, worst_m_s, ambiguous } = self;
        println!("{compared} compared, {worst_m_s:.1e} m/s apart at most; {ambiguous} with two answers");
    }
}

/// Compares answers with those of the slow method at the same compliances.
pub fn compare_with_slow(settings: Settings) -> Comparison {
    let mut comparison = Comparison::default();
    for seed in 0..COUNT {
        let case = random_case(seed);
        let solution = solved(&case, settings);
        let slow = gauss_seidel(&case, &solution.compliances_per_kg, 4000, 1e-9);
        if is_open(&solution.report) || slow.change_m_s > 1e-9 {
            continue;
        }
        comparison.add(distance(&velocities(&case, &solution), &slow.velocities), miss(&case, &solution));
    }
    comparison.tell();
    comparison
}

#[test]
fn a_slow_method_gives_the_same_velocities() {
    let Comparison { compared, ambiguous, .. } = compare_with_slow(FINE);
    // the others: sweeps do not end, or the solve did not end
    assert!(compared > COUNT as usize * 3 / 4 && ambiguous <= 2, "{compared}, {ambiguous}");
}

#[test]
fn a_problem_solved_again_from_its_own_impulses_takes_few_factors() {
    let mut factors = [0; 4];
    for seed in 0..COUNT {
        let mut case = random_case(seed);
        for sum in &mut factors {
            let solution = solved(&case, Settings::default());
            *sum += solution.report.factors;
            case.contacts.iter_mut().zip(&solution.contacts_n_s).for_each(|(c, p)| c.warm_n_s = *p);
            case.rows.iter_mut().zip(&solution.rows_n_s).for_each(|(r, p)| r.warm_n_s = *p);
        }
    }
    println!("factors of {COUNT} problems solved four times: {factors:?}");
    assert!(factors[3] < factors[0] / 3, "{factors:?}");
}

#[test]
fn of_eight_hundred_more_problems_all_but_one_come_to_their_end() {
    let (mut factors, mut most, mut open) = (0, 0, 0);
    for seed in COUNT..1000 {
        let case = random_case(seed);
        let solution = solved(&case, Settings::default());
        let report = solution.report;
        let (is_open, miss) = (is_open(&report), miss(&case, &solution));
        assert!(if is_open { report.miss_m_s < 1e-3 } else { miss < 2e-4 }, "{seed}: {miss} m/s, {report:?}");
        if is_open {
            println!("{seed} is open: {miss} m/s, {report:?}");
        }
        open += usize::from(is_open);
        factors += report.factors;
        most = most.max(report.factors);
    }
    println!("{factors} factors, {most} at most, {open} open");
    assert!(open <= 1, "{open}"); // one turns in a circle between edges
    // 10 in the mean measured
    assert!(factors < 12 * 800, "{factors}");
}
