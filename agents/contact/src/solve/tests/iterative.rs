//! The iterative form against the direct one and against a slow method: answers, momentum, energy, products, storage.

use super::random::{COUNT, Comparison, FINE, compare_with_slow, distance, miss, random_case, solved, velocities};
use super::scenes::{Stack, momentum_gained, plate_on_soft_block};
use super::{Body, Case, Seeded, is_open};
use crate::solve::{Block, Settings, Side, Solution, Solver, StepForm};
use glam::{DMat3, DVec3};

fn iterative() -> Settings {
    Settings { form: StepForm::Iterative, ..Settings::default() }
}

/// A depth so large that compliance is the same share of the scale in both forms, whatever the load on the way.
const EQUAL: Settings = Settings { depth_m: 10.0, still_m_s: 1e-13, ..FINE };

/// How far apart velocities of both forms are, and the larger miss; `None` where either did not end or compliances are not the same.
fn apart(case: &Case) -> Option<(f64, f64)> {
    let direct = solved(case, EQUAL);
    let other = solved(case, Settings { form: StepForm::Iterative, ..EQUAL });
    assert_eq!((other.report.factors, direct.report.products), (0, 0));
    if is_open(&direct.report) || is_open(&other.report) {
        return None;
    }
    let compliances = direct.compliances_per_kg.iter().zip(&other.compliances_per_kg);
    // scales are sampled to a share in the iterative form
    if compliances.fold(0.0_f64, |off, (a, b)| off.max((a / b - 1.0).abs())) > 1e-5 {
        return None;
    }
    Some((distance(&velocities(case, &direct), &velocities(case, &other)), miss(case, &direct).max(miss(case, &other))))
}

#[test]
fn both_forms_give_the_same_velocities() {
    let mut comparison = Comparison::default();
    for seed in 0..COUNT {
        if let Some((apart, miss)) = apart(&random_case(seed)) {
            comparison.add(apart, miss);
        }
    }
    comparison.tell();
    let Comparison { compared, ambiguous, .. } = comparison;
    // the others: not ended, or a scale that is sampled too roughly for this
    assert!(compared > COUNT as usize * 3 / 4 && ambiguous <= 2, "{compared}, {ambiguous}");
}

#[test]
fn both_forms_press_a_soft_block_alike() {
    for (side, stiffness) in [(4, 4.0), (6, 0.4)] {
        let (apart, _) = apart(&plate_on_soft_block(side, stiffness)).unwrap();
        println!("block of {side}³, {stiffness}: {apart:.1e} m/s apart");
        assert!(apart < 1e-6, "{apart}"); // compliances that are off by 10⁻⁷ of 1 m/s
    }
}

#[test]
fn a_slow_method_gives_the_velocities_of_the_iterative_form() {
    let Comparison { compared, ambiguous, .. } = compare_with_slow(Settings { form: StepForm::Iterative, ..FINE });
    assert!(compared > COUNT as usize * 3 / 4 && ambiguous <= 2, "{compared}, {ambiguous}");
}

#[test]
fn stacks_and_a_slope_go_the_same_way_in_both_forms() {
    let slope = DVec3::new(4.0, 0.0, -9.0);
    for (masses, gravity) in
        [(vec![1.0; 10], DVec3::Z * -9.81), (vec![0.01, 10.0], DVec3::Z * -9.81), (vec![1.0], slope)]
    {
        let run = |form| {
            let settings = Settings { form, tolerance_m_s: 1e-9, ..Settings::default() };
            let mut stack = Stack::new(&masses).solved_by(settings);
            (stack.gravity, stack.friction) = (gravity, 0.3);
            stack.steps(60)
        };
        let (direct, other) = (run(StepForm::Direct), run(StepForm::Iterative));
        let pairs = direct.places.iter().zip(&other.places);
        let apart = pairs.map(|(a, b)| a[0].distance(b[0])).fold(0.0, f64::max);
        let Stack { factors, .. } = direct;
        println!("{} boxes: {apart:.1e} m apart, {factors} factors, {} products", masses.len(), other.products);
        assert!(other.factors == 0 && apart < 1e-8, "{apart}"); // a second at the tolerance
        let slid = 0.5 * (4.0 - 0.3 * 9.0);
        assert!(gravity.x == 0.0 || (other.places[0][0].x / slid - 61.0 / 60.0).abs() < 1e-3, "{}", other.places[0][0]);
    }
}

#[test]
fn a_soft_lattice_of_a_thousand_nodes_takes_a_bounded_count_of_products() {
    for (stiffness, most) in [(0.04, 3000), (0.4, 4000)] {
        let mut case = plate_on_soft_block(10, stiffness);
        let mut solver = Solver::new(iterative());
        let cold = case.with(|problem| solver.solve(problem).unwrap().clone());
        case.contacts.iter_mut().zip(&cold.contacts_n_s).for_each(|(c, p)| c.warm_n_s = *p);
        let warm = case.with(|problem| solver.solve(problem).unwrap().clone());
        println!("1000 nodes, {stiffness}: {:?}, again {} products", cold.report, warm.report.products);
        for report in [cold.report, warm.report] {
            assert!(!is_open(&report) && report.factors == 0 && report.miss_m_s < 5e-6, "{report:?}");
            assert!(report.products > 0 && report.products < most, "{report:?}");
        }
        let mut far = case.clone();
        far.contacts.iter_mut().for_each(|c| (c.gap_m, c.warm_n_s) = (1.0, DVec3::ZERO));
        let scales = far.with(|problem| solver.solve(problem).unwrap().report.products);
        println!("of which {scales} for the scales");
        assert!(scales < most / 2, "{scales}"); // nothing is given, so there is no step and no response
        let floor: DVec3 = cold.contacts_n_s[..100].iter().sum();
        let off = momentum_gained(&case, &cold, 1000).distance(floor);
        // the momentum that responses may leave, over a thousand nodes
        let blocks = case.bodies.iter().flat_map(|body| &body.blocks).filter(|block| block.row == block.column);
        let most = iterative().still_m_s * blocks.map(|block| block.value.x_axis.x).sum::<f64>();
        assert!(off < most, "{off} of {floor}, {most}");
    }
}

/// A x of one body.
fn product(blocks: &[Block], x: &[DVec3]) -> Vec<DVec3> {
    let mut out = vec![DVec3::ZERO; x.len()];
    for block in blocks {
        out[block.row] += block.value * x[block.column];
        if block.row != block.column {
            out[block.column] += block.value.transpose() * x[block.row];
        }
    }
    out
}

/// The most that a block would change by for the impulses that velocities do not answer, m/s, and the energy made beyond biases.
fn unanswered_and_made(case: &Case, solution: &Solution) -> [f64; 2] {
    let mut given: Vec<_> = case.bodies.iter().map(|body| vec![DVec3::ZERO; body.free.len()]).collect();
    let mut give = |sides: &[Side; 2], impulse: DVec3| {
        for (side, sign) in sides.iter().zip([1.0, -1.0]) {
            for term in side.terms() {
                given[side.member][term.block] += term.map.transpose() * impulse * sign;
            }
        }
    };
    let mut made = 0.0;
    for (c, p) in case.contacts.iter().zip(&solution.contacts_n_s) {
        give(&c.sides, *p);
        made += p.dot(c.frame() * c.bias_m_s(case.h_s));
    }
    for (r, p) in case.rows.iter().zip(&solution.rows_n_s) {
        give(&r.sides, *p);
        made -= p.dot(r.target_m_s);
    }
    let mut left = 0.0_f64;
    for (member, body) in case.bodies.iter().enumerate() {
        let after = solution.velocities(member);
        let change: Vec<_> = after.iter().zip(&body.free).map(|(v, free)| *v - *free).collect();
        for (k, gained) in product(&body.blocks, &change).iter().enumerate() {
            made += gained.dot(after[k] + body.free[k]) * 0.5;
            let diagonal = body.blocks.iter().filter(|b| (b.row, b.column) == (k, k));
            let inverse = diagonal.fold(DMat3::ZERO, |sum, b| sum + b.value).inverse();
            left = left.max((inverse * (given[member][k] - *gained)).abs().max_element());
        }
    }
    [left, made]
}

#[test]
fn velocities_answer_all_impulses_but_what_is_told() {
    let (mut products, mut open) = (0, 0);
    for seed in 0..COUNT {
        let case = random_case(seed);
        let solution = solved(&case, iterative());
        products += solution.report.products;
        open += usize::from(is_open(&solution.report));
        let [left, made] = unanswered_and_made(&case, &solution);
        // rounding of sums of joules
        assert!(left < 5.01e-8 && made < 1e-11, "seed {seed}: {left}, {made} J");
    }
    println!("{products} products, {open} not ended");
    assert_eq!(open, 0);
}

#[test]
fn inner_solves_that_are_cut_make_no_energy() {
    let (mut roughest, mut shortened) = (0.0_f64, 0);
    for (tolerance_m_s, factors_max) in [(0.1, None), (5e-6, None), (5e-6, Some(4))] {
        let settings = Settings { tolerance_m_s, factors_max, still_m_s: 1e-2, ..iterative() };
        for seed in 0..COUNT {
            let case = random_case(seed);
            let solution = solved(&case, settings);
            let [left, made] = unanswered_and_made(&case, &solution);
            // rounding of sums of joules
            assert!(left < 1.01e-2 && made < 1e-11 && solution.report.work_j < 1e-11, "seed {seed}: {left}, {made} J");
            roughest = roughest.max(left);
            shortened += usize::from(solution.report.ray < 1.0);
        }
    }
    println!("up to {roughest:.1e} unanswered, {shortened} shortened");
    assert!(roughest > 1e-3, "{roughest}: nothing was left");
}

/// The same problem from free velocities that are off by up to 0.1 m/s, which say so.
fn unfinished(case: &Case, seed: u64) -> Case {
    let mut rough = case.clone();
    let mut random = Seeded::new(seed);
    for body in &mut rough.bodies {
        let off: Vec<_> = body.free.iter().map(|_| random.vector() * 0.1).collect();
        body.unanswered = product(&body.blocks, &off);
        body.free.iter_mut().zip(&off).for_each(|(free, off)| *free -= *off);
    }
    rough
}

#[test]
fn free_velocities_that_are_not_finished_are_finished_with_the_contacts() {
    let mut comparison = Comparison::default();
    for seed in 0..COUNT {
        let case = random_case(seed);
        let rough = unfinished(&case, seed);
        for form in [StepForm::Direct, StepForm::Iterative] {
            let [exact, other] = [&case, &rough].map(|case| solved(case, Settings { form, ..EQUAL }));
            if !is_open(&exact.report) && !is_open(&other.report) {
                let apart = distance(&velocities(&case, &exact), &velocities(&rough, &other));
                comparison.add(apart, miss(&case, &exact).max(miss(&case, &other)));
            }
        }
    }
    comparison.tell();
    let Comparison { compared, ambiguous, .. } = comparison;
    assert!(compared > COUNT as usize * 3 / 2 && ambiguous <= 4, "{compared}, {ambiguous}");
}

#[test]
fn what_is_not_finished_makes_no_energy() {
    for (still_m_s, factors_max) in [(1e-2, None), (1e-2, Some(4)), (5e-8, None)] {
        let settings = Settings { factors_max, still_m_s, ..iterative() };
        for seed in 0..COUNT {
            let case = random_case(seed);
            let solution = solved(&unfinished(&case, seed), settings);
            let [left, made] = unanswered_and_made(&case, &solution);
            // rounding of sums of joules
            assert!(left < 1.01 * still_m_s && made < 1e-11, "seed {seed}: {left}, {made} J");
        }
    }
}

#[test]
fn a_matrix_that_is_none_of_a_body_is_told_and_makes_no_energy() {
    // positive on its diagonal alone
    let mut case = plate_on_soft_block(2, 4.0);
    case.bodies[0].blocks.push(Block { row: 7, column: 0, value: DMat3::IDENTITY * 1e3 });
    assert!(case.with(|problem| Solver::default().solve(problem).is_err()));
    for factors_max in [None, Some(4)] {
        let solution = solved(&case, Settings { factors_max, ..iterative() });
        assert!(is_open(&solution.report) && solution.report.work_j < 1e-11, "{:?}", solution.report);
    }
}

#[test]
fn a_block_that_is_negative_is_refused_and_a_motion_that_cannot_be_found_is_told() {
    let lone = |value: f64, coupling: f64| {
        let block = |row, column, value| Block { row, column, value: DMat3::IDENTITY * value };
        let body = Body {
            blocks: vec![block(0, 0, 1.0), block(1, 0, coupling), block(1, 1, value)],
            free: vec![DVec3::ZERO; 2],
            unanswered: vec![DVec3::X, DVec3::NEG_X],
        };
        let case = Case { h_s: 0.01, bodies: vec![body], contacts: vec![], rows: vec![] };
        case.with(|problem| Solver::new(iterative()).solve(problem).map(|solution| is_open(&solution.report)))
    };
    assert_eq!(lone(1.0, 0.5), Ok(false));
    assert!(lone(-1.0, 0.5).is_err(), "its diagonal is negative");
    assert_eq!(lone(1.0, 3.0), Ok(true), "positive on its diagonal alone");
}

#[test]
fn a_whole_solve_allocates_nothing_once_warm() {
    let case = plate_on_soft_block(4, 4.0);
    for settings in [Settings::default(), iterative()] {
        for factors_max in [None, Some(4)] {
            let mut solver = Solver::new(Settings { factors_max, ..settings });
            let first = case.with(|problem| solver.solve(problem).unwrap().clone());
            let info = case.with(|problem| {
                allocation_counter::measure(|| {
                    solver.solve(problem).unwrap();
                })
            });
            assert_eq!(info.count_total, 0, "{settings:?}, {factors_max:?}");
            let again = case.with(|problem| solver.solve(problem).unwrap().clone());
            assert_eq!(first, again);
        }
    }
}
