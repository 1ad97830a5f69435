//! Members that lend their own factor: the same answers as of members that do not, in both forms.

use super::random::{COUNT, FINE, distance, random_case, velocities};
use super::slow::Dense;
use super::{Body, Case, is_open};
use crate::solve::{Member, Problem, Response, Settings, Solution, Solver, StepForm};
use glam::DVec3;
use metachron_core::PlainLoop;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A dense factor that counts how often it is asked.
#[derive(Debug)]
struct Lent {
    factor: Dense,
    asked: AtomicUsize,
}

impl Response for Lent {
    fn respond(&self, impulses: &mut [DVec3]) {
        self.asked.fetch_add(1, Ordering::Relaxed);
        let mut x: Vec<_> = impulses.iter().flat_map(|v| v.to_array()).collect();
        self.factor.solve(&mut x);
        impulses.iter_mut().zip(x.chunks_exact(3)).for_each(|(v, x)| *v = DVec3::from_slice(x));
    }
}

impl Lent {
    fn new(body: &Body) -> Self {
        Self { factor: Dense::of(body).factored(), asked: AtomicUsize::new(0) }
    }
}

/// The answer where every second member lends its factor, and how often they were asked.
fn solved(case: &Case, settings: Settings, lends: bool) -> (Solution, usize) {
    let lent: Vec<_> = case.bodies.iter().map(Lent::new).collect();
    let response = |k: usize| (lends && k.is_multiple_of(2)).then(|| &lent[k] as &dyn Response);
    let bodies = case.bodies.iter().enumerate();
    let members: Vec<_> = bodies
        .map(|(k, body)| Member {
            blocks: &body.blocks,
            free: &body.free,
            unanswered: &[],
            now: &[],
            share: 1.5,
            response: response(k),
        })
        .collect();
    let (contacts, rows) = (&case.contacts, &case.rows);
    let problem = Problem { h_s: case.h_s, members: &members, contacts, rows, threads: &PlainLoop };
    let solution = Solver::new(settings).solve(&problem).unwrap().clone();
    (solution, lent.iter().map(|lent| lent.asked.load(Ordering::Relaxed)).sum())
}

#[test]
fn members_that_lend_a_factor_get_the_velocities_of_those_that_do_not() {
    for form in [StepForm::Direct, StepForm::Iterative] {
        // a depth so large that compliance is the same share of the scale, whatever the load on the way
        let settings = Settings { form, depth_m: 10.0, still_m_s: 1e-13, ..FINE };
        let (mut compared, mut asked) = (0, 0);
        for seed in 0..COUNT / 4 {
            let case = random_case(seed);
            let ((own, _), (lent, times)) = (solved(&case, settings, false), solved(&case, settings, true));
            asked += times;
            let compliances = own.compliances_per_kg.iter().zip(&lent.compliances_per_kg);
            let same = compliances.fold(0.0_f64, |off, (a, b)| off.max((a / b - 1.0).abs())) < 1e-5;
            if is_open(&own.report) || is_open(&lent.report) || !same {
                continue;
            }
            let apart = distance(&velocities(&case, &own), &velocities(&case, &lent));
            // as far as the forms are apart from each other; where bodies jam there may be two answers
            compared += usize::from(apart < 1e-6);
        }
        println!("{form:?}: {compared} compared, asked {asked} times");
        assert!(compared > COUNT as usize / 5 && asked > 0);
    }
}
