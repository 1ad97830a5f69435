//! Properties of an agent for code above the models, by its spec: mass, momentum, division into elements.
//!
//! In: a [`Spec`] or a [`Member`]. Out: numbers, or the same member divided otherwise. Never here: steps, pictures.
//! A new model is added to these functions. Above this crate only scene files and pictures know models one by one: `docs/ARCHITECTURE.md`,
//! "a new model goes".

use crate::description::scene::{Member, Spec};
use glam::DVec3;
use metachron_contact::Agent;
use metachron_core::{Body, CurveState, ResolutionRange, Snapshot};
use metachron_geometry::{Aabb, ContactTraits, cage_counts};
use metachron_models::rod::{Integrator, Tube, TubeSpec};
use metachron_models::soft::{MaterialLaw, NodeSpacing, Side, SoftBody, SoftMaterial, SoftShape, SoftSpec};
use std::f64::consts::PI;

/// How an agent is divided into elements, and how its steps are integrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Division {
    /// Elements along the most divided axis; 0 for a model without elements.
    pub elements: u32,
    /// The integrator, where the model has a choice.
    pub integrator: Option<Integrator>,
}

impl Spec {
    /// Whether its model can be built; another's own is known only once it is.
    pub(crate) fn check(&self) -> Result<(), Box<dyn std::error::Error>> {
        match self {
            Self::Tube(spec) => spec.check()?,
            Self::Rigid(spec) => spec.check()?,
            Self::Soft(spec) => spec.check()?,
            Self::Tool(_) | Self::Synthetic(_) | Self::Custom(_) => {}
        }
        Ok(())
    }

    /// True where ε is the spacing of the simulated elements, which a governor may change during the run.
    #[must_use]
    pub const fn adapts_spacing(&self) -> bool {
        match self {
            Self::Tube(_) | Self::Synthetic(_) => true,
            Self::Soft(soft) => soft.nodes.is_some() || matches!(soft.shape, SoftShape::Embedded { .. }),
            Self::Rigid(_) | Self::Tool(_) | Self::Custom(_) => false,
        }
    }

    /// The power of 1/ε as which the work of a step grows: 1 of an object that is divided along its length, 2.5 of a
    /// sheet, between 2 of its elements and 3 of its factor, 3 of a solid's cage.
    #[must_use]
    pub const fn work_power(&self) -> f64 {
        match self {
            Self::Soft(soft) => match soft.shape {
                SoftShape::Rope { .. } => 1.0,
                SoftShape::Sheet { .. } => 2.5,
                SoftShape::Shell { .. } => 2.5,
                SoftShape::Box { .. }
                | SoftShape::Ball { .. }
                | SoftShape::Embedded { .. }
                | SoftShape::Tetrahedra { .. } => 3.0,
            },
            Self::Tube(_) | Self::Synthetic(_) | Self::Rigid(_) | Self::Tool(_) | Self::Custom(_) => 1.0,
        }
    }

    /// True where a rigid body moves as it is led.
    #[must_use]
    pub const fn is_kinematic(&self) -> bool {
        matches!(self, Self::Rigid(body) if body.led.is_some())
    }

    /// True where the body bends.
    #[must_use]
    pub const fn is_deformable(&self) -> bool {
        matches!(self, Self::Tube(_) | Self::Soft(_))
    }

    /// The object's contact traits.
    #[must_use]
    pub const fn traits(&self) -> ContactTraits {
        match self {
            Self::Tube(spec) => spec.traits,
            Self::Rigid(spec) => spec.traits,
            Self::Soft(spec) => spec.traits,
            Self::Tool(spec) => spec.traits,
            Self::Synthetic(_) | Self::Custom(_) => ContactTraits::NONE,
        }
    }

    /// Moves the start of a body by `by` metres; a tool stays on its path.
    pub fn shift(&mut self, by: DVec3) {
        match self {
            Self::Tube(tube) => tube.path_m.iter_mut().for_each(|at| *at += by),
            Self::Rigid(body) => body.shift(by),
            Self::Soft(soft) => soft.position += by,
            Self::Tool(_) | Self::Synthetic(_) | Self::Custom(_) => {}
        }
    }

    /// Declared mass, kilograms; `None` where it follows from a mesh (soft bodies) or the model has none.
    #[must_use]
    pub fn mass_kg(&self) -> Option<f64> {
        match self {
            Self::Tube(tube) => Some(tube.section.mass_per_length_kg_m * path_length_m(tube)),
            Self::Rigid(body) => body.led.is_none().then_some(body.mass_kg),
            Self::Soft(_) | Self::Tool(_) | Self::Synthetic(_) | Self::Custom(_) => None,
        }
    }

    /// Mass of the agent in the published state `body`, kilograms; zero where [`Self::momentum_n_s`] is.
    #[must_use]
    pub fn mass_in_kg(&self, body: &Body) -> f64 {
        match (self, body) {
            (Self::Rigid(spec), _) if spec.led.is_none() => spec.mass_kg,
            (Self::Tube(spec), Body::Curve(curve)) => {
                spec.section.mass_per_length_kg_m * curve.arc_m.last().copied().unwrap_or(0.0)
            }
            _ => 0.0,
        }
    }

    /// Linear momentum of the agent in the published state `body`, N·s; zero for models that publish too little to know it.
    #[must_use]
    pub fn momentum_n_s(&self, body: &Body) -> DVec3 {
        match (self, body) {
            (Self::Rigid(spec), Body::Rigid(state)) if spec.led.is_none() => state.velocity * spec.mass_kg,
            (Self::Tube(spec), Body::Curve(curve)) => velocity_integral(curve) * spec.section.mass_per_length_kg_m,
            _ => DVec3::ZERO,
        }
    }
}

impl Member {
    /// The present division.
    #[must_use]
    pub fn division(&self) -> Division {
        match &self.spec {
            Spec::Tube(tube) => Division { elements: self.segments(tube), integrator: Some(tube.integrator) },
            Spec::Soft(soft) => Division { elements: cells(soft).into_iter().max().unwrap_or(0), integrator: None },
            Spec::Rigid(_) | Spec::Tool(_) | Spec::Synthetic(_) | Spec::Custom(_) => {
                Division { elements: 0, integrator: None }
            }
        }
    }

    /// Divides the agent into `elements` along its most divided axis, in proportion along the others; a tube takes the integrator.
    /// A model without elements, or `elements` = 0, stays as it is.
    pub fn divide(&mut self, elements: u32, integrator: Integrator) {
        match &mut self.spec {
            Spec::Tube(tube) if elements > 0 => {
                let eps_m = path_length_m(tube) / f64::from(elements);
                let range = ResolutionRange { eps_m: (eps_m, eps_m), ..tube.range };
                (tube.segments, tube.range) = (Some(elements as usize), range);
                tube.resolution.eps_m = eps_m;
                tube.integrator = integrator;
                (self.simulation, self.start) = (range, tube.resolution);
            }
            Spec::Soft(soft) if elements > 0 => {
                set_cells(soft, elements);
                if let Some(NodeSpacing { eps_m, range_m }) = soft.spacing() {
                    (self.simulation.eps_m, self.start.eps_m) = (range_m, eps_m);
                }
            }
            _ => {}
        }
    }

    /// Cells of a soft body along each of its axes; empty for other models.
    #[must_use]
    pub fn cells(&self) -> Vec<u32> {
        if let Spec::Soft(soft) = &self.spec { cells(soft) } else { Vec::new() }
    }

    /// Replaces a tube by a rope where the tube has nothing that a rope lacks; `false`, and no change, where it is attached or shaped as
    /// no rope can be.
    pub fn replace_tube_by_rope(&mut self) -> bool {
        let Spec::Tube(tube) = &self.spec else { return false };
        let pressed = tube.pressure_pa != 0.0 || !tube.pressure_keys.is_empty();
        let plain = tube.attachments.is_empty() && tube.peristalsis.is_none() && !pressed;
        // a link attaches to a tube at its wall, but to a rope at a point
        if !plain || !self.links.is_empty() {
            return false;
        }
        let Some(rope) = rope_of(tube, self.segments(tube)) else { return false };
        self.spec = Spec::Soft(rope);
        true
    }

    fn segments(&self, tube: &TubeSpec) -> u32 {
        let by_spacing = || (path_length_m(tube) / self.start.eps_m - 1e-9).ceil() as u32;
        tube.segments.map_or_else(by_spacing, |count| count as u32)
    }
}

/// A rope along the centre line of a tube at rest, with its radius, stretch stiffness and mass; `None` where the model refuses it.
fn rope_of(tube: &TubeSpec, segments: u32) -> Option<SoftSpec> {
    let radius_m = tube.section.radius_m;
    let area_m2 = PI * radius_m * radius_m;
    let held = [Side::Left, Side::Right].into_iter().zip([0, 1]);
    let spec = SoftSpec {
        shape: SoftShape::Rope { path_m: centre_line(tube)?, radius_m, segments },
        nodes: None,
        eps_touched_m: None,
        material: SoftMaterial {
            young_pa: tube.section.ea_n / area_m2,
            poisson: 0.3,
            density_kg_m3: tube.section.mass_per_length_kg_m / area_m2,
            damping_per_s: tube.damping_per_s,
            damping_s: 0.0,
            law: MaterialLaw::Corotational,
        },
        position: DVec3::ZERO,
        rotation: glam::DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        held: held.filter(|(_, end)| tube.clamp[*end] || tube.pin[*end]).map(|(side, _)| side).collect(),
        friction: tube.friction,
        traits: tube.traits,
        gravity: tube.gravity,
        self_contact: false,
        sleep: tube.sleep,
    };
    SoftBody::new(spec.clone()).is_ok().then_some(spec)
}

/// The points of a tube's smooth centre line at rest.
fn centre_line(tube: &TubeSpec) -> Option<Vec<DVec3>> {
    let mut snapshot = Snapshot::default();
    Tube::new(tube.clone()).ok()?.write_snapshot(&mut snapshot);
    if let Body::Curve(curve) = snapshot.body { Some(curve.positions) } else { None }
}

fn path_length_m(tube: &TubeSpec) -> f64 {
    tube.path_m.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
}

/// Velocity summed along the rest length, m²/s: exact for a velocity that is linear between nodes.
fn velocity_integral(curve: &CurveState) -> DVec3 {
    let pairs = curve.arc_m.windows(2).zip(curve.velocities.windows(2));
    pairs.map(|(arc, velocity)| 0.5 * (arc[1] - arc[0]) * (velocity[0] + velocity[1])).sum()
}

/// Cells of a soft body along each of its axes; of one whose ε may change, the cells at the start.
fn cells(soft: &SoftSpec) -> Vec<u32> {
    let divided = soft.nodes.and_then(|nodes| soft.shape.divided_by(nodes.eps_m));
    match divided.as_ref().unwrap_or(&soft.shape) {
        SoftShape::Sheet { segments, .. } => segments.to_vec(),
        SoftShape::Box { segments, .. } => segments.to_vec(),
        SoftShape::Ball { segments, .. } | SoftShape::Rope { segments, .. } => vec![*segments],
        SoftShape::Embedded { surface, eps_m, .. } => cage_counts(surface, *eps_m).map(|count| count as u32).to_vec(),
        SoftShape::Tetrahedra { .. } | SoftShape::Shell { .. } => Vec::new(),
    }
}

/// Divides a body into `most` cells along its most divided axis, and in proportion along the others; a skin of its own stays.
fn set_cells(soft: &mut SoftSpec, most: u32) {
    let greatest = cells(soft).into_iter().max().unwrap_or(1).max(1);
    let scaled = |count: u32| (f64::from(count * most) / f64::from(greatest)).round().max(1.0) as u32;
    let fixed = |extent_m: f64| {
        let eps_m = extent_m / f64::from(most.max(1));
        NodeSpacing { eps_m, range_m: (eps_m, eps_m) }
    };
    match (&mut soft.shape, &mut soft.nodes) {
        (SoftShape::Sheet { size_m, .. }, Some(nodes)) => *nodes = fixed(size_m[0].max(size_m[1])),
        (SoftShape::Rope { path_m, .. }, Some(nodes)) => {
            *nodes = fixed(path_m.windows(2).map(|pair| pair[0].distance(pair[1])).sum());
        }
        (SoftShape::Sheet { segments, .. }, None) => *segments = segments.map(scaled),
        (SoftShape::Box { segments, .. }, _) => *segments = segments.map(scaled),
        (SoftShape::Ball { segments, .. } | SoftShape::Rope { segments, .. }, _) => *segments = scaled(*segments),
        (SoftShape::Embedded { surface, eps_m, range_m }, _) => {
            let Aabb { low, high } = Aabb::of(&surface.points);
            NodeSpacing { eps_m: *eps_m, range_m: *range_m } = fixed((high - low).max_element());
        }
        // a mesh is taken as it is
        (SoftShape::Tetrahedra { .. } | SoftShape::Shell { .. }, _) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_velocity_integral_of_a_turning_line_is_length_times_mean_velocity() {
        let arc_m = vec![0.0, 0.1, 0.3, 1.0];
        let velocities = arc_m.iter().map(|s| DVec3::Y * (2.0 * s)).collect();
        let integral = velocity_integral(&CurveState { arc_m, velocities, ..CurveState::default() });
        assert!((integral - DVec3::Y).length() < 1e-15, "{integral}"); // 1 m at a mean of 1 m/s
    }
}
