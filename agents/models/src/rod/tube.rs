//! The tube: one divided rod, its attachments, its radius, its rest.
//!
//! In: a [`TubeSpec`], pressures. Out: its matter, its radius, its energy. Never here: its turns (`agent.rs`), how a step is solved
//! ([`super::step`]), contact, the transfer of a state to another division ([`super::remesh`]). Theory: docs/theory/rod.md.

mod agent;

use super::anchor_springs::{NodeSpring, carry_slips, springs};
use super::check::TubeError;
use super::discretization;
use super::discretization::Discretization;
use super::member::Unknowns;
use super::pressure::pressure_at_pa;
use super::remesh::Remesher;
use super::rest::RestDetector;
use super::rest_curve::RestCurve;
use super::state::{RodMaterial, RodState};
use super::step::{Divergence, Setting, Stepper, energy};
use super::wall::{Wall, WallLaw};
use super::{Section, TubeSpec, WallModel};
use glam::DVec3;
use metachron_contact::Agent;
use metachron_core::{Resolution, SimTime, StepError};
use metachron_geometry::{CollisionShape, ShapeKind};
use std::sync::Arc;

/// The stretch past which a tube warns: sections tilt and lose their shear stiffness at EA/(EA − GA), 1.5 for soft tissue.
pub const STRETCH_WARN: f64 = 1.4;

/// A tube, cable or rod that advances by its own steps.
#[derive(Debug, Clone)]
pub struct Tube {
    pub(super) spec: TubeSpec,
    pub(super) skeleton: RestCurve,
    pub(super) material: RodMaterial,
    pub(super) division: Discretization,
    pub(super) now: RodState,
    pub(super) stepper: Stepper,
    remesher: Remesher,
    /// Numbers of attachments that no longer hold it.
    pub(super) let_go: Vec<u32>,
    /// Its sections, where they give.
    pub(super) wall: Option<Wall>,
    /// By how much its muscles alone would narrow each node in the step begun, metres.
    pub(super) squeeze_m: Vec<f64>,
    pub(super) springs: Vec<NodeSpring>,
    pub(super) rest: RestDetector,
    pub(super) at_rest: bool,
    /// The mean acceleration of its centre of mass in the last step, m/s².
    pub(super) acceleration: DVec3,
    pub(super) form: Arc<CollisionShape>,
    pub(super) resolution: Resolution,
    pub(super) time: SimTime,
    /// Own time at which its wave and its pressure start, seconds.
    pub(super) script_from_s: f64,
    /// Its unknowns in a contact cluster.
    pub(super) unknowns: Unknowns,
}

/// The outer radius under `pressure_pa` inside: r + p r² (1 − ν/2)/(E t) (docs/theory/rod.md, eq. 33).
#[must_use]
pub fn pressed_radius_m(section: &Section, pressure_pa: f64) -> f64 {
    let Section { radius_m: r, wall_m, young_pa, poisson, .. } = *section;
    r + pressure_pa * r * r * (1.0 - 0.5 * poisson) / (young_pa * wall_m)
}

impl Tube {
    /// Builds a tube at rest on its path, stress-free except for [`TubeSpec::straight`] and twist.
    ///
    /// # Errors
    /// [`TubeError`] for a path that no tube can follow and for numbers outside their range.
    pub fn new(spec: TubeSpec) -> Result<Self, TubeError> {
        spec.check()?;
        let skeleton = RestCurve::new(&spec.path_m).strained(spec.straight, spec.twist_rad);
        let resolution = spec.range.clamp(spec.resolution);
        let count = match spec.segments {
            Some(count) => discretization::limit(&skeleton, count),
            None => discretization::segments_for(&skeleton, resolution.eps_m),
        };
        let division = Discretization::first(&skeleton, count);
        let material = material_of(&spec);
        let mut now = RodState::at_rest(&division);
        let wall = match spec.wall {
            WallModel::Prescribed => None,
            WallModel::Gives => Some(Wall::round(WallLaw::of(&spec.section), division.segments() + 1)),
        };
        wall.iter().for_each(|wall| wall.soften(&mut now.softening));
        now.strain(&material, &division);
        let form = CollisionShape { traits: spec.traits, ..CollisionShape::new(ShapeKind::Chain, spec.friction) };
        let mut tube = Self {
            resolution: nearest_resolution(resolution, &skeleton, count),
            acceleration: spec.gravity,
            spec,
            skeleton,
            material,
            division,
            now,
            stepper: Stepper::default(),
            remesher: Remesher::default(),
            let_go: vec![],
            wall,
            squeeze_m: vec![],
            springs: vec![],
            rest: RestDetector::default(),
            at_rest: false,
            form: Arc::new(form),
            time: SimTime::ZERO,
            script_from_s: 0.0,
            unknowns: Unknowns::default(),
        };
        tube.lay_out_springs();
        tube.follow_pressure(SimTime::ZERO);
        tube.present_velocities();
        Ok(tube)
    }

    /// Lays out the springs of the attachments that hold it.
    pub(super) fn lay_out_springs(&mut self) {
        let Self { spec, let_go, division, springs: list, .. } = self;
        let holding = (0..).zip(&spec.attachments).filter(|(number, _)| !let_go.contains(number));
        let before = list.clone();
        springs(holding, division, list);
        carry_slips(&before, list);
    }

    /// Passes all that the stepper works on to `act`, for a step of `dt` seconds.
    pub(super) fn step_by<T>(
        &mut self,
        dt: f64,
        act: impl FnOnce(&mut Stepper, &mut RodState, &Setting<'_>) -> T,
    ) -> T {
        let Self { stepper, now, material, division, springs, .. } = self;
        let substeps = self.spec.substeps;
        let integrator = self.spec.integrator;
        let longest_s = integrator.longest_substep_s(material, division).unwrap_or(f64::INFINITY);
        act(stepper, now, &Setting { material, division, springs, dt, substeps, integrator, longest_s })
    }

    /// The numbers it was built from.
    #[must_use]
    pub fn spec(&self) -> &TubeSpec {
        &self.spec
    }

    /// Rest length of the centre line, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.skeleton.length_m()
    }

    /// Present number of segments: 2 … 4096.
    #[must_use]
    pub fn segments(&self) -> usize {
        self.division.segments()
    }

    /// The largest stretch of any segment along its director, 1 at rest.
    #[must_use]
    pub fn stretch(&self) -> f64 {
        self.now.stretch
    }

    /// Mechanical energy, joules: kinetic, elastic, attachments, and gravitational, zero at the origin; of a tube whose wall gives also
    /// that of the wall and of its filling, zero in the undeformed tube.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        let rod_j = energy(&self.now, &self.springs);
        self.wall.as_ref().map_or(rod_j, |wall| rod_j + wall.energy_j(&self.division, self.filling()))
    }

    /// Takes the pressure of its keys at a time, where it has any.
    pub(super) fn follow_pressure(&mut self, time: SimTime) {
        let wanted_pa = pressure_at_pa(&self.spec.pressure_keys, time.as_secs_f64() - self.script_from_s);
        self.spec.pressure_pa = wanted_pa.unwrap_or(self.spec.pressure_pa);
    }

    /// Sets the pressure inside minus outside, Pa, while it runs, in place of a pressure that follows keys; of a sealed
    /// tube the pressure of its gas in the undeformed tube, as if more had been let in.
    ///
    /// # Errors
    /// [`TubeError::OutOfRange`] for a pressure that a new tube would not take; it then keeps the one it has.
    pub fn set_pressure_pa(&mut self, pressure_pa: f64) -> Result<(), TubeError> {
        let before = std::mem::replace(&mut self.spec.pressure_pa, pressure_pa);
        if let Err(error) = self.spec.check() {
            self.spec.pressure_pa = before;
            return Err(error);
        }
        self.spec.pressure_keys.clear();
        self.rest.wake();
        self.at_rest = false;
        Ok(())
    }

    /// The pressure inside minus outside, Pa: of a sealed tube as its gas is compressed now.
    #[must_use]
    pub fn pressure_pa(&self) -> f64 {
        let given = self.spec.pressure_pa;
        self.wall.as_ref().map_or(given, |wall| wall.pressure_pa(&self.division, self.filling()))
    }

    /// Warnings to the user about the present state: one sentence each, normally none.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut list = vec![];
        if self.now.stretch > STRETCH_WARN {
            let RodMaterial { ea, ga, .. } = self.material;
            let limit = if ea > ga { ea / (ea - ga) } else { f64::INFINITY };
            list.push(format!(
                "the tube is stretched to {:.2} times its length; the rod model is valid up to {limit:.2} (warning from {STRETCH_WARN}): use a stiffer or lighter tube",
                self.now.stretch
            ));
        }
        list
    }

    /// Outer radius at a rest arc length in metres at the tube's own time (docs/theory/rod.md, eq. 33, 34); the mean of a section that is
    /// not round.
    #[must_use]
    pub fn radius_at_m(&self, arc_m: f64) -> f64 {
        let Some(wall) = &self.wall else { return self.radius_at_time_m(arc_m, self.time) };
        let (left, share) = self.division.locate(arc_m);
        wall.mean_m(left) * (1.0 - share) + wall.mean_m(left + 1) * share
    }

    /// The prescribed radius at a time.
    pub(super) fn radius_at_time_m(&self, arc_m: f64, time: SimTime) -> f64 {
        pressed_radius_m(&self.spec.section, self.spec.pressure_pa) * (1.0 - self.contraction_at(arc_m, time))
    }

    /// By what share of the radius its wave contracts it at a time, as far as nothing resists.
    pub(super) fn contraction_at(&self, arc_m: f64, time: SimTime) -> f64 {
        let Some(wave) = self.spec.peristalsis else { return 0.0 };
        let phase = (arc_m - wave.speed_m_s * (time.as_secs_f64() - self.script_from_s)) / wave.wavelength_m;
        let lift = 0.5 * (1.0 + libm::cos(std::f64::consts::TAU * phase));
        wave.amplitude * lift
    }

    /// The largest radius that its skin can have now, metres.
    pub(super) fn widest_m(&self) -> f64 {
        let Some(wall) = &self.wall else { return pressed_radius_m(&self.spec.section, self.spec.pressure_pa) };
        (0..wall.now.shape.len()).map(|node| wall.reach_m(node)).fold(0.0, f64::max)
    }

    pub(super) fn diverged(&self, divergence: Divergence, dt_s: f64) -> StepError {
        let what = match divergence.slot {
            Some(slot) if slot % 2 == 0 => format!("the system matrix is not positive definite at node {}", slot / 2),
            Some(slot) => format!("the system matrix is not positive definite at segment {}", slot / 2),
            None => "positions or velocities are not finite".to_owned(),
        };
        StepError::Diverged { model: self.model(), dt_s, what }
    }

    /// Whether its radius changes by itself: by its wave, or by a pressure whose last key is still to come.
    fn changes_by_itself(&self) -> bool {
        let keys_end_s = self.spec.pressure_keys.last().map_or(f64::NEG_INFINITY, |key| key.at_s + self.script_from_s);
        let has_wave = self.spec.peristalsis.is_some_and(|w| w.amplitude > 0.0 && w.speed_m_s != 0.0);
        has_wave || self.time.as_secs_f64() < keys_end_s
    }

    /// Whether it has been quiet for long enough after a step of `dt` seconds, as far as it can tell by itself.
    pub(super) fn observe_rest(&mut self, dt: f64) -> bool {
        if !self.has_quiet_wall() {
            self.rest.wake();
        }
        self.spec.sleep && !self.changes_by_itself() && self.rest.observe(&self.now, dt)
    }

    /// Stops it exactly: a sleeping tube must not drift on screen.
    pub(super) fn stop(&mut self) {
        self.now.u.fill(DVec3::ZERO);
        self.now.kinetic_j = 0.0;
        self.wall.iter_mut().for_each(Wall::stop);
    }
}

/// Access for tests.
#[cfg(test)]
impl Tube {
    pub(super) fn material(&self) -> &RodMaterial {
        &self.material
    }

    pub(super) fn division(&self) -> &Discretization {
        &self.division
    }

    pub(super) fn state(&self) -> &RodState {
        &self.now
    }

    /// Replaces the state, for violent starts; its strains are recomputed.
    pub(super) fn set_state(&mut self, mut state: RodState) {
        self.wall.iter().for_each(|wall| wall.soften(&mut state.softening));
        state.strain(&self.material, &self.division);
        self.now = state;
    }
}

impl Tube {
    /// Begins from a state that it was set to, or divided anew: the history of steps before is of another.
    pub(super) fn begin_anew(&mut self) {
        self.stepper.forget();
        self.present_velocities();
        self.rest.wake();
        self.at_rest = false;
    }
}

fn material_of(spec: &TubeSpec) -> RodMaterial {
    let s = &spec.section;
    RodMaterial {
        ea: s.ea_n,
        ga: s.ga_n,
        ei: s.ei_n_m2,
        gj: s.gj_n_m2,
        mu: s.mass_per_length_kg_m,
        rotary: s.rotary_kg_m,
        damping: spec.damping_per_s,
        gravity: spec.gravity,
        clamp: spec.clamp,
        held: [0, 1].map(|end| spec.clamp[end] || spec.pin[end]),
    }
}

/// The resolution of `count` segments: the request where it gave that count, else the mean spacing.
fn nearest_resolution(wanted: Resolution, skeleton: &RestCurve, count: usize) -> Resolution {
    let kept = discretization::segments_for(skeleton, wanted.eps_m) == count;
    let exact = libm::ceil(skeleton.length_m() / wanted.eps_m - 1e-9) == count as f64;
    if kept && exact { wanted } else { Resolution { eps_m: skeleton.length_m() / count as f64, n: wanted.n } }
}
