//! Tests of the solver of a cluster: laws with closed forms, random problems against a slow method, the factor, promises.

mod cone;
mod constraints;
mod factor;
mod iterative;
mod lent;
mod promises;
mod random;
mod rebounds;
mod scenes;
mod sliding;
mod slow;

use super::{Block, Contact, JointRow, Member, Problem, Report, Side, SideTerm};
use glam::{DMat3, DVec3};
use metachron_core::{PlainLoop, SolveLevel};

/// Numbers of a fixed seed: xorshift.
pub struct Seeded(u64);

impl Seeded {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// Between 0 and 1.
    pub fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub fn below(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count - 1)
    }

    /// Each axis between −1 and 1.
    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }
}

/// A member that owns its data.
#[derive(Clone)]
pub struct Body {
    pub blocks: Vec<Block>,
    pub free: Vec<DVec3>,
    /// The momentum that these leave unanswered; empty for none.
    pub unanswered: Vec<DVec3>,
}

/// A problem that owns its data.
#[derive(Clone)]
pub struct Case {
    pub h_s: f64,
    pub bodies: Vec<Body>,
    pub contacts: Vec<Contact>,
    pub rows: Vec<JointRow>,
}

impl Case {
    /// Hands the problem to `work`.
    pub fn with<T>(&self, work: impl FnOnce(&Problem<'_>) -> T) -> T {
        let members: Vec<_> = self
            .bodies
            .iter()
            .map(|b| Member {
                blocks: &b.blocks,
                free: &b.free,
                unanswered: &b.unanswered,
                now: &[],
                share: 1.0,
                response: None,
            })
            .collect();
        work(&Problem {
            h_s: self.h_s,
            members: &members,
            contacts: &self.contacts,
            rows: &self.rows,
            threads: &PlainLoop,
        })
    }
}

pub fn diagonal(block: usize, value: DVec3) -> Block {
    Block { row: block, column: block, value: DMat3::from_diagonal(value) }
}

/// A rigid box by its mass and half its edges, with a spin.
pub fn rigid(mass: f64, half: DVec3) -> Body {
    let (x, y, z) = (half.x * half.x, half.y * half.y, half.z * half.z);
    let inertia = DVec3::new(y + z, z + x, x + y) * (mass / 3.0);
    Body {
        blocks: vec![diagonal(0, DVec3::splat(mass)), diagonal(1, inertia)],
        free: vec![DVec3::ZERO; 2],
        unanswered: Vec::new(),
    }
}

/// A lattice of points with springs to all neighbours, as implicit Euler sees it: A = M + h² K.
pub struct Lattice {
    pub side: usize,
    pub pitch: f64,
    pub mass: f64,
    /// Stiffness of a spring times h².
    pub stiffness: f64,
}

impl Lattice {
    pub fn places(&self) -> Vec<DVec3> {
        let n = self.side;
        (0..n * n * n)
            .map(|i| DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64) * self.pitch)
            .collect()
    }

    pub fn body(&self) -> Body {
        let places = self.places();
        let each = self.mass / places.len() as f64;
        let mut blocks: Vec<_> = (0..places.len()).map(|i| diagonal(i, DVec3::splat(each))).collect();
        for row in 0..places.len() {
            for column in 0..row {
                let along = places[row] - places[column];
                if along.length() < 1.8 * self.pitch {
                    let d = along.normalize();
                    let value = DMat3::from_cols(d * d.x, d * d.y, d * d.z) * self.stiffness;
                    blocks.push(Block { row, column, value: value * -1.0 });
                    blocks.push(Block { row, column: row, value });
                    blocks.push(Block { row: column, column, value });
                }
            }
        }
        Body { blocks, free: vec![DVec3::ZERO; places.len()], unanswered: Vec::new() }
    }
}

/// Whether a solve ended before all laws held.
pub fn is_open(report: &Report) -> bool {
    report.level == SolveLevel::Interior || report.miss_m_s > 1e-5
}

/// A contact of two sides along a normal, with tangents of its own.
pub fn contact(sides: [Side; 2], normal: DVec3) -> Contact {
    let first = normal.any_orthonormal_vector();
    Contact {
        sides,
        normal,
        tangents: [first, normal.cross(first)],
        gap_m: 0.0,
        friction: 0.5,
        parting_m_s: 0.0,
        surface_m_s: DVec3::ZERO,
        owed_slip_m: DVec3::ZERO,
        warm_n_s: DVec3::ZERO,
        load_n_s: 0.0,
        overlap_m: 0.0,
    }
}

/// The velocity of a side, in the tests' own words.
pub fn side_velocity(side: &Side, velocities: &[Vec<DVec3>]) -> DVec3 {
    side.terms().iter().map(|SideTerm { block, map }| *map * velocities[side.member][*block]).sum()
}
