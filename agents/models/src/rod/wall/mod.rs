//! A wall that gives: how the sections of a tube widen and flatten.
//!
//! In: the division, the curvature at its nodes, the tube's filling, the tension of its muscles. Out: the linear system of a step, its
//! free answer, the sections after it, and how they bend. Never here: the centre line's own motion, contacts.
//! Unknowns are one vector for each node: the change of the outer radius, and the components of its flattening along cos 2φ and sin 2φ in the
//! axes of the segment before the node, metres. Theory: docs/theory/rod.md, section 15.

mod coupling;
mod law;
mod pentadiagonal;

pub use law::{Softening, WallLaw};

use super::discretization::Discretization;
use super::step::Divergence;
use glam::{DVec2, DVec3};
use pentadiagonal::{BandFactor, BandRow, multiply};
use std::f64::consts::PI;

/// Pressure of the air around every tube, Pa: a closed gas is compressed from it.
pub const AIR_PA: f64 = 101_325.0;
/// A closed gas is never compressed below this share of its volume at rest: its law would have no value at zero.
const VOLUME_MIN: f64 = 1e-3;
/// A section is nowhere thinner than this share of its radius at rest: loads beyond its law must not turn it inside out.
const RADIUS_MIN: f64 = 0.01;

/// The filling of a tube.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filling {
    /// Inside minus outside pressure, Pa; of a closed gas that in the undeformed tube.
    pub pressure_pa: f64,
    /// Whether it is a gas that cannot leave: p V = const from there on.
    pub sealed: bool,
}

/// The filling and the muscles' pull during a step.
#[derive(Debug, Clone, Copy)]
pub struct Drive<'a> {
    /// The filling.
    pub filling: Filling,
    /// By how much the muscles alone would narrow each node, metres.
    pub squeeze_m: &'a [f64],
}

/// The inputs of a wall's step.
#[derive(Debug, Clone, Copy)]
pub struct WallProblem<'a> {
    /// The division of the tube.
    pub division: &'a Discretization,
    /// Filling and muscles.
    pub drive: Drive<'a>,
    /// Curvature at each node in the section's axes, 1/m.
    pub curvature: &'a [DVec2],
    /// Mass-proportional damping, 1/s.
    pub damping_per_s: f64,
    /// The step, seconds.
    pub h_s: f64,
}

/// The sections of all nodes.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub struct Sections {
    /// Widening and flattening of each node, metres.
    pub shape: Vec<DVec3>,
    /// Their rates, m/s.
    pub rate: Vec<DVec3>,
}

/// A wall that gives.
#[derive(Debug, Clone)]
pub struct Wall {
    /// Its law.
    pub law: WallLaw,
    /// Its state.
    pub now: Sections,
    rows: Vec<BandRow>,
    factor: BandFactor,
    /// Rates after the step begun without contact, m/s.
    free: Vec<DVec3>,
    /// Shapes before the step begun, metres.
    kept: Vec<DVec3>,
}

/// The closed gas or the open pressure at some volume.
struct Pressure {
    pa: f64,
    /// Stiffness of the filling against widening all along, Pa over the lift.
    stiffness_pa_m2: f64,
    energy_j: f64,
}

impl Filling {
    /// The pressure in `volume_m3` of a lumen that holds `rest_m3` undeformed (eq. 61).
    fn pressure(self, volume_m3: f64, rest_m3: f64) -> Pressure {
        if !self.sealed || rest_m3 <= 0.0 {
            let energy_j = -self.pressure_pa * (volume_m3 - rest_m3);
            return Pressure { pa: self.pressure_pa, stiffness_pa_m2: 0.0, energy_j };
        }
        let volume_m3 = volume_m3.max(VOLUME_MIN * rest_m3);
        let share = rest_m3 / volume_m3;
        let gas_pa = (AIR_PA + self.pressure_pa) * share;
        let energy_j = (AIR_PA + self.pressure_pa) * rest_m3 * libm::log(share) + AIR_PA * (volume_m3 - rest_m3);
        Pressure { pa: gas_pa - AIR_PA, stiffness_pa_m2: gas_pa / volume_m3, energy_j }
    }
}

/// The share of the tube that each node stands for, metres.
fn dual_m(division: &Discretization, node: usize) -> f64 {
    let half = |segment: Option<&f64>| segment.map_or(0.0, |l| 0.5 * l);
    half(node.checked_sub(1).and_then(|before| division.length.get(before))) + half(division.length.get(node))
}

/// The second derivative along the tube at an inner node: weights of the node before, itself and the next, 1/m².
fn second_derivative(division: &Discretization, node: usize) -> [f64; 3] {
    let (before, after) = (division.length[node - 1], division.length[node]);
    let dual = 0.5 * (before + after);
    let (a, c) = (1.0 / (before * dual), 1.0 / (after * dual));
    [a, -(a + c), c]
}

impl Wall {
    /// The round wall of a tube of `nodes` nodes.
    pub fn round(law: WallLaw, nodes: usize) -> Self {
        let now = Sections { shape: vec![DVec3::ZERO; nodes], rate: vec![DVec3::ZERO; nodes] };
        Self { law, now, rows: vec![], factor: BandFactor::default(), free: vec![], kept: vec![] }
    }

    /// The rates that the step begun leads to without contact.
    pub fn free(&self) -> &[DVec3] {
        &self.free
    }

    /// The factor of the step begun.
    pub fn factor(&self) -> &BandFactor {
        &self.factor
    }

    /// The lower half of the matrix of the step begun: (row, column, the diagonal of their block).
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize, DVec3)> + '_ {
        self.rows.iter().enumerate().flat_map(|(at, row)| {
            let part = move |back: usize, value: DVec3| (back <= at).then(|| (at, at - back, value));
            [part(0, row.diag), part(1, row.near), part(2, row.far)].into_iter().flatten()
        })
    }

    /// Largest reach of the section at a node from the centre line, metres.
    pub fn reach_m(&self, node: usize) -> f64 {
        let shape = self.now.shape[node];
        self.floored_m(self.law.outer_m + shape.x + (shape.y * shape.y + shape.z * shape.z).sqrt())
    }

    /// Outer radius of a node in the direction `across` of the section's axes, of length 1, metres.
    pub fn radius_m(&self, node: usize, across: DVec2) -> f64 {
        let shape = self.now.shape[node];
        let (cos, sin) = (across.x * across.x - across.y * across.y, 2.0 * across.x * across.y);
        self.floored_m(self.law.outer_m + shape.x + shape.y * cos + shape.z * sin)
    }

    /// Mean outer radius of a node, metres.
    pub fn mean_m(&self, node: usize) -> f64 {
        self.floored_m(self.law.outer_m + self.now.shape[node].x)
    }

    /// The two components of a node's flattening, metres: no more than leaves the section its least radius.
    pub fn flattening_m(&self, node: usize) -> DVec2 {
        let shape = self.now.shape[node];
        DVec2::new(shape.y, shape.z).clamp_length_max(self.mean_m(node) - RADIUS_MIN * self.law.outer_m)
    }

    /// Not less than a section keeps.
    pub fn floored_m(&self, radius_m: f64) -> f64 {
        radius_m.max(RADIUS_MIN * self.law.outer_m)
    }

    /// Volume of the lumen over the rest length, m³, and that of the undeformed one.
    fn volumes_m3(&self, division: &Discretization) -> [f64; 2] {
        let of = |(node, shape): (usize, &DVec3)| dual_m(division, node) * self.law.lumen_m2(*shape);
        let volume = self.now.shape.iter().enumerate().map(of).sum();
        [volume, division.total_m() * self.law.lumen_m2(DVec3::ZERO)]
    }

    /// Pressure inside minus outside, Pa.
    pub fn pressure_pa(&self, division: &Discretization, filling: Filling) -> f64 {
        let [volume, rest] = self.volumes_m3(division);
        filling.pressure(volume, rest).pa
    }

    /// Kinetic and elastic energy of the wall and the potential of its filling, J, without that of its muscles (eq. 55).
    pub fn energy_j(&self, division: &Discretization, filling: Filling) -> f64 {
        let Self { law, now, .. } = self;
        let mut sum = 0.0;
        for (node, (shape, rate)) in now.shape.iter().zip(&now.rate).enumerate() {
            let met = law.met_m(*shape).max(0.0);
            let own = (law.stiffness * *shape).dot(*shape) + (law.inertia * *rate).dot(*rate);
            sum += 0.5 * dual_m(division, node) * (own + law.closed * met * met);
        }
        for node in 1..now.shape.len() - 1 {
            let [a, b, c] = second_derivative(division, node);
            let bent = now.shape[node - 1] * a + now.shape[node] * b + now.shape[node + 1] * c;
            sum += 0.5 * dual_m(division, node) * (law.along * bent).dot(bent);
        }
        let [volume, rest] = self.volumes_m3(division);
        sum + filling.pressure(volume, rest).energy_j
    }

    /// The rounding of the filling's energy, which is that of a small difference of volumes, J.
    pub fn rounding_j(&self, division: &Discretization, filling: Filling) -> f64 {
        let air_pa = if filling.sealed { AIR_PA } else { 0.0 };
        let rest_m3 = division.total_m() * self.law.lumen_m2(DVec3::ZERO);
        64.0 * f64::EPSILON * (air_pa + filling.pressure_pa.abs()) * rest_m3
    }

    /// The potential of the muscles' tension, J (docs/theory/rod.md, section 15).
    pub fn muscle_j(&self, division: &Discretization, squeeze_m: &[f64]) -> f64 {
        let of = |(node, (shape, squeeze_m)): (usize, (&DVec3, &f64))| dual_m(division, node) * shape.x * squeeze_m;
        self.law.stiffness.x * self.now.shape.iter().zip(squeeze_m).enumerate().map(of).sum::<f64>()
    }

    /// Builds and solves the step without contact (eq. 65).
    ///
    /// # Errors
    /// [`Divergence`] where the matrix has no factor.
    pub fn begin(&mut self, problem: &WallProblem<'_>) -> Result<(), Divergence> {
        self.assemble(problem);
        self.factor.factor(&self.rows).map_err(|node| Divergence { slot: Some(2 * node) })?;
        self.factor.solve(&mut self.free);
        Ok(())
    }

    /// Fills the matrix, and the right side in `free`.
    fn assemble(&mut self, problem: &WallProblem<'_>) {
        let WallProblem { division, drive, curvature, damping_per_s, h_s } = *problem;
        let [volume, rest] = self.volumes_m3(division);
        let pressure = drive.filling.pressure(volume, rest);
        let Self { law, now, rows, free, .. } = self;
        let gas = pressure.stiffness_pa_m2 * division.total_m();
        rows.clear();
        rows.resize(now.shape.len(), BandRow::ZERO);
        free.clear();
        for (node, (&shape, &rate)) in now.shape.iter().zip(&now.rate).enumerate() {
            let brazier = law.brazier(shape, curvature[node]);
            let flat2 = shape.y * shape.y + shape.z * shape.z;
            let slope = DVec2::new(law.lift_m, 3.0 * PI * flat2.sqrt());
            let filled = slope * slope * gas;
            let blown = filled.y + 3.0 * PI * pressure.pa.max(0.0) + brazier.stiffness;
            let mut stiffness = law.stiffness + DVec3::new(filled.x, blown, blown);
            let flattening = DVec3::new(0.0, brazier.force.x, brazier.force.y);
            let mut force = flattening - law.stiffness * shape;
            force.x += pressure.pa * law.lift_m - law.stiffness.x * drive.squeeze_m[node];
            force -= DVec3::new(0.0, shape.y, shape.z) * (3.0 * PI * pressure.pa);
            // opposite walls are felt where the section is bound for, as slack springs are (eq. 22)
            let ahead = rate * h_s;
            let met = law.met_m(shape + ahead);
            if law.closed > 0.0 && met > 0.0 {
                let there = DVec2::new(shape.y + ahead.y, shape.z + ahead.z).normalize_or_zero();
                let bound = DVec3::splat(2.0 * law.closed);
                force += DVec3::new(1.0, -there.x, -there.y) * (law.closed * met) + bound * ahead;
                stiffness += bound;
            }
            let dual = dual_m(division, node);
            rows[node].diag = (law.inertia * (1.0 + h_s * damping_per_s) + stiffness * (h_s * h_s)) * dual;
            free.push((law.inertia * rate + force * h_s) * dual);
        }
        self.join(division, h_s);
    }

    /// Adds the coupling of a node to its neighbours (eq. 58).
    fn join(&mut self, division: &Discretization, h_s: f64) {
        let Self { law, now, rows, free, .. } = self;
        for node in 1..now.shape.len() - 1 {
            let [a, b, c] = second_derivative(division, node);
            let stiff = law.along * dual_m(division, node);
            let bent = now.shape[node - 1] * a + now.shape[node] * b + now.shape[node + 1] * c;
            let (pull, stiff) = (stiff * bent * h_s, stiff * (h_s * h_s));
            free[node - 1] -= pull * a;
            free[node] -= pull * b;
            free[node + 1] -= pull * c;
            rows[node - 1].diag += stiff * (a * a);
            rows[node].diag += stiff * (b * b);
            rows[node].near += stiff * (a * b);
            rows[node + 1].diag += stiff * (c * c);
            rows[node + 1].near += stiff * (b * c);
            rows[node + 1].far += stiff * (a * c);
        }
    }

    /// The work that changes the rates of the step begun to `rates`, J: (v − free)ᵀ A v.
    pub fn work_j(&self, rates: &[DVec3]) -> f64 {
        let of = |(at, v): (usize, &DVec3)| (*v - self.free[at]).dot(multiply(&self.rows, rates, at));
        rates.iter().enumerate().map(of).sum()
    }

    /// Whether all sections would be finite after `h_s` seconds at these rates.
    pub fn stays_finite(&self, rates: &[DVec3], h_s: f64) -> bool {
        self.now.shape.iter().zip(rates).all(|(shape, rate)| (*shape + *rate * h_s).is_finite())
    }

    /// Keeps the sections as they are, for [`Self::advance`].
    pub fn keep(&mut self) {
        self.kept.clone_from(&self.now.shape);
    }

    /// Moves the sections kept for `h_s` seconds at a share of these rates.
    pub fn advance(&mut self, rates: &[DVec3], share: f64, h_s: f64) {
        let Self { now: Sections { shape, rate }, kept, .. } = self;
        rate.copy_from_slice(rates);
        rate.iter_mut().for_each(|rate| *rate *= share);
        shape.iter_mut().zip(&*rate).zip(&*kept).for_each(|((shape, rate), kept)| *shape = *kept + *rate * h_s);
    }

    /// Takes `excess_j` of kinetic energy from the wall; whether there is as much.
    pub fn slow(&mut self, excess_j: f64, division: &Discretization) -> bool {
        let Self { law, now, .. } = self;
        let of = |(node, rate): (usize, &DVec3)| 0.5 * dual_m(division, node) * (law.inertia * *rate).dot(*rate);
        let kinetic_j: f64 = now.rate.iter().enumerate().map(of).sum();
        let enough = excess_j <= kinetic_j;
        if enough && kinetic_j > 0.0 {
            let share = (1.0 - excess_j / kinetic_j).sqrt();
            now.rate.iter_mut().for_each(|rate| *rate *= share);
        }
        enough
    }

    /// Stops it.
    pub fn stop(&mut self) {
        self.now.rate.fill(DVec3::ZERO);
    }

    /// The fastest rate of any section, m/s.
    pub fn fastest_m_s(&self) -> f64 {
        self.now.rate.iter().map(|rate| rate.length_squared()).fold(0.0, f64::max).sqrt()
    }

    /// Takes over the sections of division `old` on division `new`, by interpolation.
    pub fn transfer(&mut self, old: &Discretization, new: &Discretization) {
        let from = std::mem::take(&mut self.now);
        for &arc_m in &new.arc_m {
            let (left, share) = old.locate(arc_m);
            self.now.shape.push(from.shape[left].lerp(from.shape[left + 1], share));
            self.now.rate.push(from.rate[left].lerp(from.rate[left + 1], share));
        }
    }

    /// How each node bends.
    pub fn soften(&self, into: &mut Vec<Softening>) {
        into.clear();
        into.extend(self.now.shape.iter().map(|shape| self.law.softening(*shape)));
    }
}

impl Sections {
    /// Becomes equal to another, in the storage that is there.
    pub fn copy_from(&mut self, other: &Self) {
        self.shape.clone_from(&other.shape);
        self.rate.clone_from(&other.rate);
    }
}
