//! One state of a divided tube, and its elastic quantities: strains, forces, energy.
//!
//! In: positions, frames, velocities. Out: internal and gravity forces in slots, and the quantities that the matrix needs.
//! Never here: time steps, attachments, the linear system. Theory: docs/theory/rod.md, eq. 2–10.

use super::discretization::Discretization;
use super::rotation::{bend_share, director, log};
use super::wall::Softening;
use glam::{DQuat, DVec2, DVec3};

/// The material of the tube, as its solver needs it.
#[derive(Debug, Clone, Copy)]
pub struct RodMaterial {
    /// Stretch stiffness EA, N.
    pub ea: f64,
    /// Shear stiffness GA, N.
    pub ga: f64,
    /// Bend stiffness EI, N·m².
    pub ei: f64,
    /// Twist stiffness GJ, N·m².
    pub gj: f64,
    /// Mass per length μ, kg/m.
    pub mu: f64,
    /// Rotary inertia ρI per length, kg·m.
    pub rotary: f64,
    /// Mass-proportional damping, 1/s.
    pub damping: f64,
    /// Gravity, m/s².
    pub gravity: DVec3,
    /// Ends held in position and direction.
    pub clamp: [bool; 2],
    /// Ends held in position: clamped or pinned.
    pub held: [bool; 2],
}

/// A rod of a material, divided into segments.
#[derive(Debug, Clone, Copy)]
pub struct DividedRod<'a> {
    /// The material.
    pub material: &'a RodMaterial,
    /// The division.
    pub division: &'a Discretization,
}

/// The share of the shear stiffness that tension may take from the Hessian, which keeps its form above (GA − b)|δu + u × φ|².
const TENSION_SHARE: f64 = 0.9;

/// A state, and its elastic quantities, which [`RodState::strain`] fills.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub struct RodState {
    /// Node positions, metres; N + 1.
    pub x: Vec<DVec3>,
    /// Segment frames; N.
    pub q: Vec<DQuat>,
    /// Velocities in slots: node k (m/s) at 2k, segment k (rad/s) at 2k + 1; 2N + 1.
    pub u: Vec<DVec3>,
    /// Axial directors; N.
    pub t: Vec<DVec3>,
    /// Strain vectors (x_{k+1} − x_k)/l, world axes; N (eq. 2).
    pub e: Vec<DVec3>,
    /// Clamped tension b of the geometric stiffness, newtons; N (eq. 13).
    pub b: Vec<f64>,
    /// Elastic and gravity forces in slots (N and N·m); 2N + 1.
    pub force: Vec<DVec3>,
    /// How the section at each joint bends, where walls give; else empty. Steps of the rod take it as it is.
    pub softening: Vec<Softening>,
    /// Curvature beyond rest at each joint in the axes of the segment before it, 1/m, where walls give; else empty.
    pub curvature: Vec<DVec2>,
    /// Elastic energy, J.
    pub elastic_j: f64,
    /// Gravitational energy, J, zero at the origin.
    pub gravity_j: f64,
    /// Kinetic energy with consistent mass and rotary inertia, J (eq. 10).
    pub kinetic_j: f64,
    /// The largest stretch along the director, 1 at rest.
    pub stretch: f64,
}

impl RodState {
    /// The stress-free state of a division, at rest.
    pub fn at_rest(division: &Discretization) -> Self {
        let mut config = Self { x: division.place.clone(), q: division.frame.clone(), ..Self::default() };
        config.resize(division.segments());
        config
    }

    /// Whether it has as many nodes and frames as that many segments.
    pub fn is_of(&self, segments: usize) -> bool {
        let of_segments = [self.q.len(), self.t.len(), self.e.len(), self.b.len()];
        let of_slots = [self.u.len(), self.force.len()];
        self.x.len() == segments + 1
            && of_segments.iter().all(|len| *len == segments)
            && of_slots.iter().all(|len| *len == 2 * segments + 1)
    }

    /// Allocates for `segments` segments.
    pub fn resize(&mut self, segments: usize) {
        self.x.resize(segments + 1, DVec3::ZERO);
        self.q.resize(segments, DQuat::IDENTITY);
        self.u.resize(2 * segments + 1, DVec3::ZERO);
        self.t.resize(segments, DVec3::ZERO);
        self.e.resize(segments, DVec3::ZERO);
        self.b.resize(segments, 0.0);
        self.force.resize(2 * segments + 1, DVec3::ZERO);
    }

    /// Copies another state except for its forces and tensions, into the existing storage.
    pub fn copy_from(&mut self, other: &Self) {
        self.x.clone_from(&other.x);
        self.q.clone_from(&other.q);
        self.u.clone_from(&other.u);
        self.t.clone_from(&other.t);
        self.e.clone_from(&other.e);
        self.softening.clone_from(&other.softening);
        self.curvature.clone_from(&other.curvature);
        let Self { elastic_j, gravity_j, kinetic_j, stretch, .. } = *other;
        (self.elastic_j, self.gravity_j, self.kinetic_j, self.stretch) = (elastic_j, gravity_j, kinetic_j, stretch);
    }

    /// Whether every position, frame and velocity is finite. Needs [`RodState::strain`].
    pub fn is_finite(&self) -> bool {
        // energies contain every position, velocity or frame in squares or products: where they are finite, all of these are
        (self.elastic_j + self.gravity_j + self.kinetic_j).is_finite()
    }

    /// Computes strains, forces and energies of this state (eq. 2–10).
    pub fn strain(&mut self, material: &RodMaterial, division: &Discretization) {
        self.elastic_j = 0.0;
        self.gravity_j = 0.0;
        self.stretch = 0.0;
        self.force[0] = DVec3::ZERO;
        self.stretch_and_shear(material, division);
        self.measure_motion(material, division);
        self.bend_and_twist(material, division);
    }

    /// Forces of every segment: n = C u − s₀ EA t on its ends, −l n × u on its frame (eq. 7, 8), and its weight.
    fn stretch_and_shear(&mut self, material: &RodMaterial, division: &Discretization) {
        let RodMaterial { ea, ga, mu, gravity, .. } = *material;
        let tension_max = TENSION_SHARE * ga.min(ea);
        let count = self.q.len();
        let (x, q, length, chord) = (&self.x[..=count], &self.q[..count], &division.length[..count], &division.chord);
        let (t, e, b, chord) = (&mut self.t[..count], &mut self.e[..count], &mut self.b[..count], &chord[..count]);
        let force = &mut self.force[..2 * count + 1];
        for k in 0..count {
            let (l, s0) = (length[k], chord[k]);
            let tk = director(q[k]);
            let u = (x[k + 1] - x[k]) * (1.0 / l);
            let (along, u2) = (tk.dot(u), u.length_squared());
            // shear and extension separately: C u − s₀ EA t without its cancellation
            let (shear, extension) = (u - tk * along, along - s0);
            let n = shear * ga + tk * (ea * extension);
            let weight = gravity * (0.5 * mu * l);
            (t[k], e[k]) = (tk, u);
            b[k] = if u2 > 0.0 { (n.dot(u) / u2).clamp(0.0, tension_max) } else { 0.0 };
            force[2 * k] += n + weight;
            force[2 * k + 1] = u.cross(n) * l;
            force[2 * k + 2] = weight - n;
            self.elastic_j += 0.5 * l * (ga * shear.length_squared() + ea * extension * extension);
            self.gravity_j -= weight.dot(x[k] + x[k + 1]);
            self.stretch = self.stretch.max(along / s0);
        }
    }

    /// Moments of every joint, and of the walls that hold clamped ends (eq. 5, 6, 9).
    fn bend_and_twist(&mut self, material: &RodMaterial, division: &Discretization) {
        if !self.softening.is_empty() {
            return self.bend_soft_sections(material, division);
        }
        let count = self.q.len();
        if material.clamp[0] {
            let joint = Joint::between(division, 0, division.wall[0], self.q[0]);
            let moment = joint.moment(material, director(division.wall[0]), &mut self.elastic_j);
            self.force[1] -= moment;
        }
        for k in 1..count {
            let joint = Joint::between(division, k, self.q[k - 1], self.q[k]);
            let moment = joint.moment(material, self.t[k - 1], &mut self.elastic_j);
            self.force[2 * k - 1] += moment;
            self.force[2 * k + 1] -= moment;
        }
        if material.clamp[1] {
            let joint = Joint::between(division, count, self.q[count - 1], division.wall[1]);
            let moment = joint.moment(material, self.t[count - 1], &mut self.elastic_j);
            self.force[2 * count - 1] += moment;
        }
    }

    /// The same where walls give: a section that is flat bends more easily across its flat sides (eq. 62).
    fn bend_soft_sections(&mut self, material: &RodMaterial, division: &Discretization) {
        let count = self.q.len();
        self.curvature.clear();
        self.curvature.resize(count + 1, DVec2::ZERO);
        let first = usize::from(!material.clamp[0]);
        let last = if material.clamp[1] { count } else { count - 1 };
        for k in first..=last {
            let before = if k == 0 { division.wall[0] } else { self.q[k - 1] };
            let after = if k == count { division.wall[1] } else { self.q[k] };
            let joint = Joint::between(division, k, before, after);
            let (moment, curvature) = joint.soft_moment(material, before, &self.softening[k], &mut self.elastic_j);
            self.curvature[k] = curvature;
            if k > 0 {
                self.force[2 * k - 1] += moment;
            }
            if k < count {
                self.force[2 * k + 1] -= moment;
            }
        }
    }

    /// Recomputes the kinetic energy from the velocities (eq. 10). Needs directors.
    pub fn measure_motion(&mut self, material: &RodMaterial, division: &Discretization) {
        let (mut linear, mut rotary, mut a) = (0.0, 0.0, self.u[0]);
        for ((pair, t), &l) in self.u[1..].chunks_exact(2).zip(&self.t).zip(&division.length) {
            let (w, b) = (pair[0], pair[1]);
            linear += l * (a.dot(a + b) + b.length_squared());
            let about = t.dot(w);
            rotary += l * (w.length_squared() + about * about);
            a = b;
        }
        self.kinetic_j = material.mu * linear / 6.0 + 0.5 * material.rotary * rotary;
    }

    /// Linear momentum, kg·m/s, and angular momentum about the origin, kg·m²/s. Needs directors.
    pub fn momentum(&self, material: &RodMaterial, division: &Discretization) -> (DVec3, DVec3) {
        let (mut linear, mut angular) = (DVec3::ZERO, DVec3::ZERO);
        for (k, &l) in division.length.iter().enumerate() {
            let (va, w, vb) = (self.u[2 * k], self.u[2 * k + 1], self.u[2 * k + 2]);
            let (xa, xb, m) = (self.x[k], self.x[k + 1], material.mu * l);
            linear += (va + vb) * (0.5 * m);
            angular += (xa.cross(va * 2.0 + vb) + xb.cross(vb * 2.0 + va)) * (m / 6.0);
            angular += (w + self.t[k] * self.t[k].dot(w)) * (material.rotary * l);
        }
        (linear, angular)
    }
}

/// The relative rotation across a joint, against the stress-free one.
pub struct Joint {
    /// Rotation vector, world axes (eq. 5).
    pub theta: DVec3,
    /// The part of it that is strain, world axes.
    pub strain: DVec3,
    /// 1/l̄, 1/m.
    inverse: f64,
}

impl Joint {
    /// Joint `index` of the division, between these frames.
    #[inline(always)]
    pub fn between(division: &Discretization, index: usize, before: DQuat, after: DQuat) -> Self {
        let theta = log(after * before.conjugate());
        let strain = theta - before * division.bend[index];
        Self { theta, strain, inverse: division.joint[index] }
    }

    /// Bending and twist beyond rest, world axes, 1/m.
    pub fn curvature(&self) -> DVec3 {
        self.strain * self.inverse
    }

    /// The moment that turns the segment before the joint forward and the one after it back (eq. 6, 9).
    #[inline(always)]
    fn moment(&self, material: &RodMaterial, axis: DVec3, energy_j: &mut f64) -> DVec3 {
        let Self { strain, inverse, .. } = *self;
        let m = (strain * material.ei + axis * ((material.gj - material.ei) * axis.dot(strain))) * inverse;
        *energy_j += 0.5 * strain.dot(m);
        self.carried(m)
    }

    /// The same of a section that bends by `softening` in the axes of the segment `before`, and the curvature there, 1/m (eq. 62).
    #[inline(always)]
    fn soft_moment(
        &self,
        material: &RodMaterial,
        before: DQuat,
        softening: &Softening,
        energy_j: &mut f64,
    ) -> (DVec3, DVec2) {
        let own = before.conjugate() * self.strain * self.inverse;
        let m = before * (softening.of(own.truncate()) * material.ei).extend(material.gj * own.z);
        *energy_j += 0.5 * self.strain.dot(m);
        (self.carried(m), own.truncate())
    }

    /// J⁻ᵀ m (eq. 6).
    #[inline(always)]
    fn carried(&self, m: DVec3) -> DVec3 {
        let across = self.theta.cross(m);
        m + across * 0.5 + self.theta.cross(across) * bend_share(self.theta.length_squared())
    }
}
