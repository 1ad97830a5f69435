//! The impulses that a few bodies give each other, exactly: Newton's method on an augmented Lagrangian.
//!
//! In: rows of constraints, masses, free velocities. Out: velocities and impulses. Never here: where rows come from.
//!
//! With the free velocities v*, wanted are min ½ (v − v*)ᵀ M (v − v*) subject to the rows' laws. Each law is a projection
//! λ = P(λ₀ − (J v + b) / R): the gradient of a convex function of v, so that Newton's method with a line search along the
//! convex function's own slope always converges, and its matrix M + Jᵀ R⁻¹ J over the active rows is positive. R is a
//! millionth of the row's own inverse mass; what yields under R is taken back by λ₀ ← λ, a few times. Friction's
//! disc takes its radius μ λₙ from the pass before: where the passes meet, the law is Coulomb's own, without dilation. What takes
//! too many factors is left to [`super::sweep`].

use super::matrix::Matrix;
use super::row::{Law, MOBILITY_MIN, Mass, Row, Twist};
use super::sweep;
use glam::DVec3;

/// Room to work in; nothing is allocated once the sizes settle.
#[derive(Debug, Clone, Default)]
pub(super) struct Newton {
    matrix: Matrix,
    /// R of each row.
    give: Vec<f64>,
    /// λ₀ of each row; for a normal's friction the radius is in `radius`.
    start: Vec<f64>,
    radius: Vec<f64>,
    /// λ as it was given.
    warm: Vec<f64>,
    velocity: Vec<f64>,
    along: Vec<f64>,
    free: Vec<Twist>,
    gradient: Vec<f64>,
}

/// R as a share of a row's own inverse mass: small enough that three passes take the yielding back under a thousandfold
/// load, large enough that the matrix keeps six digits in double precision.
const GIVE: f64 = 1e-6;
/// A row that misses its law by no more than this is solved, m/s: a thousandth of what an hour's creep would show.
const MISS_M_S: f64 = 1e-9;
/// A gradient that would change no velocity by more than this share of the fastest is none.
const STEEP: f64 = 1e-9;
/// A pass that ends early, or where roundings let it go no farther, is flown where no body would move by more than this share under
/// what is left: velocities and impulses then belong together to six digits.
const NEAR: f64 = 1e-6;
/// Friction's disc may be wrong by this much more than a row, as a velocity.
const DISC: f64 = 1e-3;
/// The most passes of λ₀ ← λ.
const PASSES_MAX: u32 = 40;
/// The most factorisations in all.
const FACTORS_MAX: u32 = 80;

impl Newton {
    /// Solves for the velocities; `rows` get their impulses. A pass that is cut short has velocities that its impulses do not
    /// give: it is never flown, [`sweep`] has the last word then.
    pub(super) fn solve(&mut self, rows: &mut [Row], masses: &[Mass], velocities: &mut [Twist]) {
        if rows.is_empty() {
            return;
        }
        self.prepare(rows, masses, velocities);
        let mut factors = FACTORS_MAX;
        for _ in 0..PASSES_MAX {
            self.begin_pass(rows);
            if !self.minimise(rows, (masses, velocities), &mut factors) {
                rows.iter_mut().zip(&self.warm).for_each(|(row, warm)| row.lambda = *warm);
                return sweep::solve(rows, masses, &self.free, velocities);
            }
            if self.missed(rows) <= MISS_M_S || factors == 0 {
                return;
            }
        }
    }

    /// Factors how all bodies answer impulses together, as the rows of the last solve give way; whether they do.
    pub(super) fn hold(&mut self, rows: &[Row], masses: &[Mass]) -> bool {
        self.assemble(rows, masses);
        self.matrix.factor()
    }

    /// Turns impulses into the velocities they cause by that factor, six numbers a body.
    pub(super) fn respond(&mut self, impulses: &mut [f64]) {
        self.matrix.solve_again(impulses);
    }

    /// Learns whom the next solves' rows join.
    pub(super) fn link(&mut self, bodies: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) {
        self.matrix.link(bodies, pairs);
    }

    /// What a factorisation costs for those, in products.
    pub(super) fn work(&self) -> usize {
        self.matrix.work()
    }

    fn prepare(&mut self, rows: &[Row], masses: &[Mass], velocities: &[Twist]) {
        self.free.clear();
        self.free.extend_from_slice(velocities);
        self.give.clear();
        self.give.extend(rows.iter().map(|row| match row.law {
            Law::Spring(compliance) => compliance,
            _ => GIVE * row.mobility(masses).max(MOBILITY_MIN),
        }));
        self.radius.clear();
        self.radius.resize(rows.len(), 0.0);
        self.warm.clear();
        self.warm.extend(rows.iter().map(|row| row.lambda));
        for room in [&mut self.velocity, &mut self.along, &mut self.start] {
            room.clear();
            room.resize(rows.len(), 0.0);
        }
    }

    /// λ₀ ← λ, and friction's discs from the normals.
    fn begin_pass(&mut self, rows: &[Row]) {
        for (i, row) in rows.iter().enumerate() {
            self.start[i] = if matches!(row.law, Law::Spring(_)) { 0.0 } else { row.lambda };
            if let Law::Normal(friction) = row.law {
                self.radius[i] = friction * row.lambda;
            }
        }
    }

    /// One pass: Newton's method on the convex function; `false` where that ended before its velocities are what its impulses give.
    fn minimise(&mut self, rows: &mut [Row], state: (&[Mass], &mut [Twist]), factors: &mut u32) -> bool {
        let (masses, velocities) = state;
        self.velocity.iter_mut().zip(rows.iter()).for_each(|(u, row)| *u = row.velocity(velocities));
        self.project(rows, 0.0);
        while self.steep(rows, masses, velocities, STEEP) {
            if *factors == 0 {
                return !self.steep(rows, masses, velocities, NEAR);
            }
            *factors -= 1;
            let slope = self.descend(rows, masses);
            if slope.is_nan() || slope >= 0.0 {
                return !self.steep(rows, masses, velocities, NEAR);
            }
            let share = self.search(rows, (masses, velocities), slope);
            for (twist, step) in velocities.iter_mut().zip(self.gradient.chunks_exact(6)) {
                twist[0] += DVec3::from_slice(&step[..3]) * share;
                twist[1] += DVec3::from_slice(&step[3..]) * share;
            }
            // anew from the bodies, so that roundings do not add up
            self.velocity.iter_mut().zip(rows.iter()).for_each(|(u, row)| *u = row.velocity(velocities));
            self.project(rows, 0.0);
        }
        true
    }

    /// Writes the gradient; whether any body would still move under it, by more than this share of the fastest.
    fn steep(&mut self, rows: &[Row], masses: &[Mass], velocities: &[Twist], limit: f64) -> bool {
        self.gradient.clear();
        let mut fastest = 1.0_f64;
        for ((mass, now), free) in masses.iter().zip(velocities).zip(&self.free) {
            let linear = (now[0] - free[0]) * mass.mass_kg;
            let angular = mass.inertia * (now[1] - free[1]);
            self.gradient.extend(linear.to_array().into_iter().chain(angular.to_array()));
            fastest = fastest.max(now[0].abs().max_element()).max(now[1].abs().max_element());
        }
        for row in rows {
            row.scatter(-row.lambda, &mut self.gradient);
        }
        masses.iter().zip(self.gradient.chunks_exact(6)).any(|(mass, g)| {
            let linear = DVec3::from_slice(&g[..3]) / mass.mass_kg;
            let angular = mass.inverse * DVec3::from_slice(&g[3..]);
            linear.abs().max_element().max(angular.abs().max_element()) > limit * fastest
        })
    }

    /// λ = P(λ₀ − (u + share·du + b) / R) for all rows.
    fn project(&self, rows: &mut [Row], share: f64) {
        let mut i = 0;
        while i < rows.len() {
            let wanted = |row: &Row, i: usize| {
                self.start[i] - (self.velocity[i] + share * self.along[i] + row.bias) / self.give[i]
            };
            let raw = wanted(&rows[i], i);
            rows[i].lambda = match rows[i].law {
                Law::Equal | Law::Spring(_) | Law::Tangent => raw,
                Law::AtLeast | Law::Normal(_) => raw.max(0.0),
            };
            if let Law::Normal(_) = rows[i].law {
                let (s, t) = (wanted(&rows[i + 1], i + 1), wanted(&rows[i + 2], i + 2));
                let size = libm::hypot(s, t);
                let cut = if size > self.radius[i] { self.radius[i] / size } else { 1.0 };
                (rows[i + 1].lambda, rows[i + 2].lambda) = (s * cut, t * cut);
                i += 2;
            }
            i += 1;
        }
    }

    /// Turns the gradient into Newton's direction and writes the rows' velocities along it; the slope along it.
    fn descend(&mut self, rows: &[Row], masses: &[Mass]) -> f64 {
        self.assemble(rows, masses);
        let mut slope = 0.0;
        self.along.clear();
        self.along.extend_from_slice(&self.gradient);
        self.gradient.iter_mut().for_each(|g| *g = -*g);
        if !self.matrix.solve(&mut self.gradient) {
            return 0.0;
        }
        self.along.iter().zip(&self.gradient).for_each(|(g, d)| slope += g * d);
        self.along.clear();
        let step = &self.gradient;
        self.along.extend(rows.iter().map(|row| {
            row.velocity_of(|body| {
                let at = 6 * body as usize;
                [DVec3::from_slice(&step[at..]), DVec3::from_slice(&step[at + 3..])]
            })
        }));
        slope
    }

    /// M + Jᵀ R⁻¹ J over the active rows.
    fn assemble(&mut self, rows: &[Row], masses: &[Mass]) {
        self.matrix.start(masses);
        let mut i = 0;
        while i < rows.len() {
            let stiff = 1.0 / self.give[i];
            match rows[i].law {
                Law::Equal | Law::Spring(_) => self.matrix.stiffen(&rows[i], stiff),
                Law::AtLeast if rows[i].lambda > 0.0 => self.matrix.stiffen(&rows[i], stiff),
                Law::Normal(_) => {
                    if rows[i].lambda > 0.0 {
                        self.matrix.stiffen(&rows[i], stiff);
                    }
                    self.stiffen_friction(&rows[i + 1], &rows[i + 2], i);
                    i += 2;
                }
                Law::AtLeast | Law::Tangent => {}
            }
            i += 1;
        }
    }

    /// Sticking resists both ways; slipping resists only a change of its direction.
    fn stiffen_friction(&mut self, first: &Row, second: &Row, normal: usize) {
        let wanted = |row: &Row, i: usize| self.start[i] - (self.velocity[i] + row.bias) / self.give[i];
        let (s, t) = (wanted(first, normal + 1), wanted(second, normal + 2));
        let (size, radius) = (libm::hypot(s, t), self.radius[normal]);
        if size <= radius {
            self.matrix.stiffen(first, 1.0 / self.give[normal + 1]);
            self.matrix.stiffen(second, 1.0 / self.give[normal + 2]);
        } else if radius > 0.0 {
            let (cos, sin) = (s / size, t / size);
            let across = Row {
                lin: second.lin * cos - first.lin * sin,
                turn_a: second.turn_a * cos - first.turn_a * sin,
                turn_b: second.turn_b * cos - first.turn_b * sin,
                ..*first
            };
            self.matrix.stiffen(&across, radius / (size * self.give[normal + 1]));
        }
    }

    /// How far to go along the direction: to where the convex function's slope has all but gone.
    fn search(&self, rows: &mut [Row], state: (&[Mass], &[Twist]), slope: f64) -> f64 {
        /// The slope that is left, of the first one.
        const LEFT: f64 = 0.1;
        const HALVINGS: u32 = 30;
        let (masses, velocities) = state;
        let (mut linear, mut square) = (0.0, 0.0);
        for (((mass, now), free), step) in
            masses.iter().zip(velocities).zip(&self.free).zip(self.gradient.chunks_exact(6))
        {
            let (v, w) = (DVec3::from_slice(&step[..3]), DVec3::from_slice(&step[3..]));
            linear += mass.mass_kg * v.dot(now[0] - free[0]) + w.dot(mass.inertia * (now[1] - free[1]));
            square += mass.mass_kg * v.length_squared() + w.dot(mass.inertia * w);
        }
        let mut slope_at = |share: f64| {
            self.project(rows, share);
            let caught: f64 = rows.iter().zip(&self.along).map(|(row, du)| row.lambda * du).sum();
            linear + share * square - caught
        };
        if slope_at(1.0) <= LEFT * slope.abs() {
            return 1.0;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let there = slope_at(middle);
            if there.abs() <= LEFT * slope.abs() {
                return middle;
            }
            if there > 0.0 { high = middle } else { low = middle }
        }
        low
    }

    /// The velocity by which the worst row misses its law: what λ₀ ← λ moves, and what friction's disc does.
    fn missed(&self, rows: &[Row]) -> f64 {
        let mut worst = 0.0_f64;
        for (i, row) in rows.iter().enumerate() {
            if matches!(row.law, Law::Spring(_)) {
                continue;
            }
            worst = worst.max((row.lambda - self.start[i]).abs() * self.give[i]);
            if let Law::Normal(friction) = row.law {
                let radius = (friction * row.lambda - self.radius[i]).abs();
                let edge = libm::hypot(rows[i + 1].lambda, rows[i + 2].lambda) >= 0.999 * self.radius[i];
                // a disc that is not reached may have any size
                worst = worst.max(if edge { DISC * radius * self.give[i] / GIVE } else { 0.0 });
            }
        }
        worst
    }
}
