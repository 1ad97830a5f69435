//! The impulses of many simultaneous contacts: accelerated projected gradient (MHNT15) on Signorini's and Coulomb's laws.
//!
//! In: contacts, the free velocities, and a body's response to impulses. Out: the impulses, and the velocities after them.
//! Each iteration costs one response, for any number of contacts, or none where W is formed. Theory: docs/theory/contact.md, eq. 5–11.

use super::Contact;
use super::delassus::DelassusMatrix;
use glam::DVec3;

/// The response of a body to impulses: the operator A⁻¹ of (eq. 5), symmetric and positive.
pub trait Response {
    /// Replaces impulses, one for each slot, by the changes of velocity they cause. Linear.
    fn respond(&mut self, impulses: &mut [DVec3]);
}

impl<F: FnMut(&mut [DVec3])> Response for F {
    fn respond(&mut self, impulses: &mut [DVec3]) {
        self(impulses);
    }
}

/// Stopping criteria of the iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The most responses that a solve may use, ≥ 1. Fewer leave friction creeping and piles sinking.
    pub iterations: u32,
    /// The error of velocity at which a solve is done, m/s, > 0. A millionth of a metre a step is far below what a picture shows.
    pub tolerance_m_s: f64,
}

/// One solve: all contacts of a body at one moment.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    /// The contacts, by rising keys.
    pub contacts: &'a [Contact],
    /// Differences of keys by which a contact may have been named otherwise in the last solve: a place that passes from one
    /// segment to the next takes its impulse along.
    pub related_keys: &'a [i64],
    /// The step, seconds, > 0.
    pub h_s: f64,
    /// A scale of each slot's inverse mass, 1/kg, or 1/(kg·m²) for a spin; ≥ 0. Only the speed of convergence depends on it.
    pub mobilities: &'a [f64],
    /// Stopping criteria of the iteration.
    pub settings: Settings,
}

/// Result of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SolverReport {
    /// Products with W, each a response of the body where W is not formed.
    pub iterations: u32,
    /// The largest velocity by which a contact still violates its law, m/s.
    pub residual_m_s: f64,
}

/// The state kept between solves: warm starts by key, and scratch storage (nothing is allocated once the sizes settle).
#[derive(Debug, Clone, Default)]
pub struct Solver {
    known: Vec<Known>,
    known_h: f64,
    stiffness: f64,
    /// The same three values as they were before the last solve.
    before: (Vec<Known>, f64, f64),
    scale: Vec<f64>,
    free: Vec<DVec3>,
    now: Iterate,
    ahead: Iterate,
    next: Iterate,
    response: Vec<DVec3>,
    /// Whether W may be formed: for bodies whose response is expensive compared with a product with the W of as many contacts.
    forms: bool,
    formed: DelassusMatrix,
    /// Products that the last solve took.
    products: u32,
}

/// The impulse of a contact of the last solve.
#[derive(Debug, Clone, Copy)]
struct Known {
    key: u64,
    lambda: DVec3,
    /// Whether a contact of this solve has used it.
    taken: bool,
}

/// Impulses λ, and the velocities W λ they cause at the contacts.
#[derive(Debug, Clone, Default)]
struct Iterate {
    lambda: Vec<DVec3>,
    caused: Vec<DVec3>,
}

/// Factor by which the step bound is raised past the measured need: a little, so that rounding does not raise it again.
const BOUND_MARGIN: f64 = 1.02;
/// The share of the step bound that a new solve starts from: contacts come and go, a bound that only rises slows all later ones.
const BOUND_DECAY: f64 = 0.9;
/// The least mobility, 1/kg: a contact between held nodes only has none, and any number will do.
const MOBILITY_MIN: f64 = 1e-12;
/// Where the last solve ended before its tolerance, W is formed if that costs up to this many times the allowed responses.
const COSTLY_FACTOR: usize = 3;
/// The most products with a formed W.
const FORMED_PRODUCTS: u32 = 2_000;

impl Solver {
    /// A solver that forms W where the last solve used more responses than forming it costs.
    #[must_use]
    pub fn forming() -> Self {
        Self { forms: true, ..Self::default() }
    }

    /// Drops every warm start: keys have lost their meaning (the body was divided anew).
    pub fn forget(&mut self) {
        self.known.clear();
    }

    /// Drops the history of all earlier solves, including the bound of eq. 11.
    pub fn reset(&mut self) {
        self.forget();
        self.stiffness = 1.0;
    }

    /// Undoes the last solve's effect on warm starts: its input turned out to be wrong.
    pub fn undo(&mut self) {
        std::mem::swap(&mut self.known, &mut self.before.0);
        self.known.iter_mut().for_each(|known| known.taken = false);
        (self.known_h, self.stiffness) = (self.before.1, self.before.2);
    }

    /// The impulse of each contact of the last solve, N·s, in the order the contacts were given.
    #[must_use]
    pub fn impulses(&self) -> &[DVec3] {
        &self.now.lambda
    }

    /// Finds the impulses and adds the changes they cause to `velocities`, one entry for each slot (eq. 5–8).
    pub fn solve(&mut self, problem: &Problem<'_>, velocities: &mut [DVec3], body: &mut impl Response) -> SolverReport {
        if problem.contacts.is_empty() {
            self.now.lambda.clear();
            self.forget();
            return SolverReport::default();
        }
        self.prepare(problem, velocities);
        let report = self.iterate(problem, body, velocities.len());
        velocities.iter_mut().zip(&self.response).for_each(|(v, dv)| *v += *dv);
        self.remember(problem);
        report
    }

    /// Free velocities b (eq. 6), scales (eq. 9) and warm starts of all contacts.
    fn prepare(&mut self, problem: &Problem<'_>, velocities: &[DVec3]) {
        let Problem { contacts, h_s: h, mobilities, .. } = *problem;
        self.free.clear();
        self.free
            .extend(contacts.iter().map(|c| c.jacobian.velocity(velocities) + c.normal * c.bias_m_s(h) + c.back_m_s));
        self.scale.clear();
        self.scale.extend(contacts.iter().map(|c| c.jacobian.mobility(mobilities).max(MOBILITY_MIN)));
        (self.before.1, self.before.2) = (self.known_h, self.stiffness);
        self.start(problem);
        self.stiffness = (self.stiffness * BOUND_DECAY).max(1.0);
    }

    /// Starts from the impulses of the last solve: those with the same key, then those with a related key (`related_keys`) that no longer exist.
    fn start(&mut self, problem: &Problem<'_>) {
        let Self { known, known_h, now, .. } = self;
        let longer = if *known_h > 0.0 { problem.h_s / *known_h } else { 0.0 };
        let mut at = 0;
        now.lambda.clear();
        now.lambda.extend(problem.contacts.iter().map(|c| {
            at += known[at..].iter().take_while(|k| k.key < c.key).count();
            let same = known.get_mut(at).filter(|k| k.key == c.key);
            same.map_or(DVec3::NAN, |k| {
                k.taken = true;
                k.lambda
            })
        }));
        for (contact, lambda) in problem.contacts.iter().zip(&mut now.lambda) {
            if lambda.is_nan() {
                *lambda = DVec3::ZERO;
                for offset in problem.related_keys {
                    let key = contact.key.wrapping_add_signed(*offset);
                    let Ok(found) = known.binary_search_by_key(&key, |k| k.key) else { continue };
                    if !known[found].taken {
                        known[found].taken = true;
                        *lambda += known[found].lambda;
                    }
                }
            }
            *lambda = contact.project(*lambda * longer);
        }
    }

    fn remember(&mut self, problem: &Problem<'_>) {
        let Self { known, now, .. } = self;
        std::mem::swap(known, &mut self.before.0);
        let named = problem.contacts.iter().zip(&now.lambda);
        known.clear();
        known.extend(named.map(|(c, &lambda)| Known { key: c.key, lambda, taken: false }));
        self.known_h = problem.h_s;
    }

    /// The iteration (eq. 10, 11). Leaves λ in `now` and A⁻¹ Jᵀ λ in `response`.
    fn iterate(&mut self, problem: &Problem<'_>, body: &mut impl Response, slots: usize) -> SolverReport {
        let Problem { contacts, settings, .. } = *problem;
        self.response.clear();
        self.response.resize(slots, DVec3::ZERO);
        let limit = self.form(problem, body);
        let mut report = SolverReport::default();
        if self.now.lambda.iter().any(|l| *l != DVec3::ZERO) {
            self.now.apply_delassus(contacts, &self.formed, body, &mut self.response);
            report.iterations += 1;
        } else {
            self.now.caused.clear();
            self.now.caused.resize(contacts.len(), DVec3::ZERO);
        }
        self.ahead.clone_from(&self.now);
        let (mut momentum, mut taken) = (1.0, true);
        loop {
            self.descend(contacts);
            report.residual_m_s = self.residual();
            // `response` must belong to `now`: no stop between a rejected move and the next one
            if taken && (report.residual_m_s <= settings.tolerance_m_s || report.iterations >= limit) {
                break;
            }
            self.next.apply_delassus(contacts, &self.formed, body, &mut self.response);
            report.iterations += 1;
            taken = self.bound_holds() || report.iterations >= limit;
            if taken {
                momentum = self.advance(momentum);
            }
        }
        if self.formed.is_known() {
            self.formed.forget();
            self.now.apply_delassus(contacts, &self.formed, body, &mut self.response);
        }
        self.products = report.iterations;
        report
    }

    /// Forms W where that costs less than the last solve did; returns the most products allowed.
    fn form(&mut self, problem: &Problem<'_>, body: &mut impl Response) -> u32 {
        let Problem { contacts, settings, .. } = *problem;
        let (columns, taken) = (3 * contacts.len(), self.products as usize);
        let gave_up = self.products >= settings.iterations && columns <= COSTLY_FACTOR * settings.iterations as usize;
        if !self.forms || !(taken > columns || gave_up) {
            return settings.iterations;
        }
        self.formed.form(contacts, body, &mut self.response);
        FORMED_PRODUCTS
    }

    /// next ← P(ahead − (W ahead + b) / (L d)) (eq. 10).
    fn descend(&mut self, contacts: &[Contact]) {
        let Self { ahead, next, free, scale, stiffness, .. } = self;
        next.lambda.clear();
        next.lambda.extend(contacts.iter().enumerate().map(|(i, c)| {
            let slope = ahead.caused[i] + free[i];
            c.project(ahead.lambda[i] - slope / (*stiffness * scale[i]))
        }));
    }

    /// The largest move of a contact in velocity: zero exactly where every law holds.
    fn residual(&self) -> f64 {
        let moves = self.next.lambda.iter().zip(&self.ahead.lambda).zip(&self.scale);
        moves.map(|((next, ahead), d)| (*next - *ahead).length() * d * self.stiffness).fold(0.0, f64::max)
    }

    /// Whether L is an upper bound along the move just made; if not it is raised to one (eq. 11).
    fn bound_holds(&mut self) -> bool {
        let (mut curve, mut size) = (0.0, 0.0);
        for i in 0..self.next.lambda.len() {
            let step = self.next.lambda[i] - self.ahead.lambda[i];
            curve += step.dot(self.next.caused[i] - self.ahead.caused[i]);
            size += self.scale[i] * step.length_squared();
        }
        let holds = curve <= self.stiffness * size * (1.0 + 1e-9);
        if !holds {
            self.stiffness = BOUND_MARGIN * curve / size;
        }
        holds
    }

    /// Accepts the move and extrapolates; restarts the momentum where the extrapolation went uphill.
    fn advance(&mut self, momentum: f64) -> f64 {
        let uphill: f64 = (0..self.next.lambda.len())
            .map(|i| {
                let (ahead, next, now) = (self.ahead.lambda[i], self.next.lambda[i], self.now.lambda[i]);
                (ahead - next).dot(next - now) * self.scale[i]
            })
            .sum();
        let momentum = if uphill > 0.0 { 1.0 } else { momentum };
        let grown = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
        let beta = if uphill > 0.0 { 0.0 } else { (momentum - 1.0) / grown };
        for i in 0..self.next.lambda.len() {
            self.ahead.lambda[i] = self.next.lambda[i] + (self.next.lambda[i] - self.now.lambda[i]) * beta;
            self.ahead.caused[i] = self.next.caused[i] + (self.next.caused[i] - self.now.caused[i]) * beta;
        }
        std::mem::swap(&mut self.now, &mut self.next);
        grown
    }
}

/// The inverse masses of both sides of a contact along its normal, 1/kg: n·J A⁻¹ Jᵀ n over the slots before `own`, and over those from
/// there on, of `slots` in all. One response; nothing is allocated once `scratch` has its size.
pub fn inverse_mass(
    contact: &Contact,
    own: usize,
    slots: usize,
    body: &mut impl Response,
    scratch: &mut Vec<DVec3>,
) -> [f64; 2] {
    let Contact { jacobian: at, normal, .. } = contact;
    scratch.clear();
    scratch.resize(slots, DVec3::ZERO);
    at.scatter(*normal, scratch);
    body.respond(scratch);
    let both = at.velocity(scratch).dot(*normal);
    scratch[..own].fill(DVec3::ZERO);
    let other = at.velocity(scratch).dot(*normal);
    [both - other, other]
}

impl Iterate {
    /// The velocities W λ at the contacts; `response` holds A⁻¹ Jᵀ λ afterwards, where W is not formed.
    fn apply_delassus(
        &mut self,
        contacts: &[Contact],
        formed: &DelassusMatrix,
        body: &mut impl Response,
        response: &mut [DVec3],
    ) {
        if formed.is_known() {
            return formed.times(&self.lambda, &mut self.caused);
        }
        response.fill(DVec3::ZERO);
        contacts.iter().zip(&self.lambda).for_each(|(c, lambda)| c.jacobian.scatter(*lambda, response));
        body.respond(response);
        self.caused.clear();
        self.caused.extend(contacts.iter().map(|c| c.jacobian.velocity(response)));
    }
}
