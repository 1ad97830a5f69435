//! Contact points and forces in the picture: a ball at each point, an arrow along its normal as long as the force, one across it for friction.
//!
//! In: the newest state of each visible agent. Out: instances of a [`Picture`], and how many metres an arrow of one newton has. Never here:
//! forces of their own. A contact of two agents is drawn once, as the force on the one that publishes it.

use super::compose::{Paint, Scratch, instance};
use super::instances::kind;
use super::picture::{MeshKey, Picture};
use crate::seen::level::Shading;
use crate::states::scene_view::{Appearance, Material, SceneView};
use glam::{DQuat, DVec3, Vec3};
use metachron_core::{AgentId, Body, Wrench};
use metachron_geometry::{Primitive, Rounding, Solid, creased_mesh};
use std::f64::consts::TAU;

/// The scale of arrows is chosen so that the longest is this fraction of the camera's distance.
const LONGEST: f64 = 0.12;
/// It is chosen anew once the longest arrow is longer, or shorter, than these fractions: a scale that changes with every force says nothing.
const KEPT: (f64, f64) = (0.012, 0.3);
/// Radius of a shaft, as a fraction of the camera's distance.
const SHAFT: f64 = 0.0022;
/// Radius and length of a head, in radii of the shaft; a shorter arrow is all head.
const HEAD: (f64, f64) = (2.6, 7.0);
/// Forces below this are not drawn, newtons.
const LEAST_N: f64 = 1e-9;
/// Corners around a head.
const CORNERS: u32 = 12;
/// Level of the balls and shafts.
const LEVEL: u8 = 2;

/// The force on an agent at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ForceArrow {
    point_m: DVec3,
    force_n: DVec3,
    colour: [u8; 3],
}

const NORMAL: [u8; 3] = [244, 140, 40];
const FRICTION: [u8; 3] = [60, 150, 240];
const TOOL: [u8; 3] = [220, 60, 90];

/// The wrench on a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolForce {
    /// The tool.
    pub tool: AgentId,
    /// Its tip, metres.
    pub tip_m: DVec3,
    /// The force of the bodies that it holds and touches, N, and the torque of the bodies that it touches, N·m.
    pub wrench: Wrench,
}

impl SceneView {
    /// The wrench on every tool that holds or touches something, by the newest states.
    #[must_use]
    pub fn tool_forces(&self) -> Vec<ToolForce> {
        let tools = self.tracks.iter().filter_map(|track| match (&track.pose, &track.newest) {
            (Body::Tool(tool), Some(newest)) => Some((track.actor.id, tool.tip, newest.contact_wrench)),
            _ => None,
        });
        let mut forces: Vec<_> = tools.map(|(tool, tip_m, wrench)| ToolForce { tool, tip_m, wrench }).collect();
        if forces.is_empty() {
            return forces;
        }
        for grip in self.tracks.iter().filter_map(|track| track.newest.as_ref()).flat_map(|newest| &newest.grips) {
            if let Some(force) = forces.iter_mut().find(|force| Some(force.tool) == grip.by) {
                force.wrench.force_n -= grip.force_n;
            }
        }
        forces.retain(|force| force.wrench.force_n.length() > LEAST_N);
        forces
    }

    /// Adds points and arrows to a picture that shows forces.
    pub(super) fn add_forces(&mut self, distance_m: f64, picture: &mut Picture, scratch: &mut Scratch) {
        let mut arrows = Vec::new();
        for track in scratch.shown.iter().map(|&number| &self.tracks[number]).filter(|track| track.seen) {
            let Some(newest) = &track.newest else { continue };
            for contact in newest.contacts.iter().filter(|contact| contact.point_m.is_finite()) {
                let along = contact.normal * contact.force_n.dot(contact.normal);
                let arrow = |force_n, colour| ForceArrow { point_m: contact.point_m, force_n, colour };
                arrows.extend([arrow(along, NORMAL), arrow(contact.force_n - along, FRICTION)]);
            }
        }
        let tool = |on: ToolForce| ForceArrow { point_m: on.tip_m, force_n: on.wrench.force_n, colour: TOOL };
        arrows.extend(self.tool_forces().into_iter().map(tool));
        let longest_n = arrows.iter().map(|arrow| arrow.force_n.length()).fold(0.0, f64::max);
        self.force_scale = scale(self.force_scale, longest_n, distance_m);
        picture.force_scale = self.force_scale;
        let head = arrow_head(picture);
        let thick_m = SHAFT * distance_m;
        for arrow in arrows.iter().filter(|arrow| arrow.force_n.length() > LEAST_N) {
            let at = ArrowForm { length_m: arrow.force_n.length() * self.force_scale, thick_m, head };
            add_arrow(arrow, at, picture, scratch);
        }
    }
}

/// Metres that an arrow of one newton has: 1, 2 or 5 times a power of ten, the one before as long as its arrows can be seen.
fn scale(before: f64, longest_n: f64, distance_m: f64) -> f64 {
    let longest = before * longest_n / distance_m;
    if longest_n <= LEAST_N || (KEPT.0..=KEPT.1).contains(&longest) {
        return before;
    }
    let wanted = LONGEST * distance_m / longest_n;
    let power = 10.0_f64.powf(wanted.log10().floor());
    [5.0, 2.0].map(|round| round * power).into_iter().find(|round| *round <= wanted).unwrap_or(power)
}

#[derive(Clone, Copy)]
struct ArrowForm {
    length_m: f64,
    thick_m: f64,
    head: MeshKey,
}

fn add_arrow(arrow: &ForceArrow, at: ArrowForm, picture: &Picture, scratch: &mut Scratch) {
    let [r, g, b] = arrow.colour;
    let appearance = Appearance { colour: arrow.colour, material: Material::Plastic };
    let paint = Paint::of(appearance, [r, g, b, 170]);
    let way = arrow.force_n.normalize_or(DVec3::Z);
    let rotation = DQuat::from_rotation_arc(DVec3::Z, way);
    let from = arrow.point_m - picture.origin;
    let head_m = (HEAD.1 * at.thick_m).min(at.length_m);
    let shaft_m = at.length_m - head_m;
    let mut add = |mesh, place, size| {
        let kind = super::picture::SolidKind { shadowless: true, ..kind(Shading::PerPixel, mesh) };
        scratch.solids.push((kind, instance(place, rotation, size, paint)));
    };
    let ball = Rounding { extents: Vec3::ZERO, radius_m: (1.6 * at.thick_m) as f32 };
    add(MeshKey::Primitive(Primitive::Ball, LEVEL), from, ball);
    let shaft = Solid::Cylinder { radius_m: at.thick_m, half_height_m: 0.5 * shaft_m };
    if let Some((primitive, size)) = Primitive::of(&shaft, LEVEL).filter(|_| shaft_m > 0.0) {
        add(MeshKey::Primitive(primitive, LEVEL), from + way * (0.5 * shaft_m), size);
    }
    let wide_m = HEAD.0 * at.thick_m * (head_m / (HEAD.1 * at.thick_m));
    let extents = DVec3::new(wide_m, wide_m, head_m).as_vec3();
    add(at.head, from + way * shaft_m, Rounding { extents, radius_m: 0.0 });
}

/// The mesh of heads: a cone along z from 0 to 1 of radius 1, the last of the picture's meshes once it is there.
fn arrow_head(picture: &mut Picture) -> MeshKey {
    if let Some(number) = picture.arrow_head {
        return MeshKey::Custom(number);
    }
    let number = picture.meshes.len() as u32;
    let ring = (0..CORNERS).map(|k| {
        let (sin, cos) = (TAU * f64::from(k) / f64::from(CORNERS)).sin_cos();
        DVec3::new(cos, sin, 0.0)
    });
    let points: Vec<DVec3> = ring.chain([DVec3::Z, DVec3::ZERO]).collect();
    let (tip, base) = (CORNERS, CORNERS + 1);
    let sides = (0..CORNERS).map(|k| (k, (k + 1) % CORNERS)).flat_map(|(a, b)| [[a, b, tip], [b, a, base]]);
    let cone = creased_mesh(&points, &sides.collect::<Vec<_>>());
    picture.meshes = picture.meshes.iter().cloned().chain([cone]).collect();
    picture.arrow_head = Some(number);
    MeshKey::Custom(number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::states::scene_view::{Actor, Form, States};
    use crate::{Camera, Level, Size, Style};
    use metachron_core::{ContactPartner, ContactState, Resolution, RigidState, SimTime, Snapshot};
    use std::sync::Arc;

    #[test]
    fn a_contact_is_a_ball_and_an_arrow_of_the_stated_length() {
        let appearance = Appearance { colour: [200; 3], material: Material::Plastic };
        let form = Form::Solid(Solid::Ball { radius_m: 0.1 });
        let mut view = SceneView::new(vec![Actor { id: AgentId(0), form, appearance }], vec![]);
        let contact = ContactState {
            with: ContactPartner::Static(0),
            since: SimTime::ZERO,
            places: 1,
            point_m: -0.1 * DVec3::Z,
            normal: DVec3::Z,
            force_n: 40.0 * DVec3::Z,
            greatest_n: 40.0 * DVec3::Z,
            reported_n: 0.0,
            depth_m: 0.0,
            stiffness_n_m: 0.0,
        };
        let body = Body::Rigid(RigidState::default());
        let state = Snapshot { body, contacts: vec![contact], ..Snapshot::default() };
        view.set_snapshot(AgentId(0), &Arc::new(state), true);
        view.pose(SimTime::ZERO, States::Latest);
        let camera = Camera::looking(DVec3::new(0.0, -2.0, 0.0), DVec3::ZERO, 0.7);
        view.survey(&camera, Size { width: 100, height: 100 });
        let levels: [Level; 1] = [Resolution { eps_m: 1.0, n: 2 }.into()];
        let count = view.compose(&camera, &levels, Style::default(), None).instances.len();
        let picture = view.compose(&camera, &levels, Style { forces: true, ..Style::default() }, None);
        assert_eq!(picture.instances.len(), count + 3, "a point, a shaft, a head; no friction");
        // 0.24 m at most for 40 N: 5 mm for each
        assert_eq!(picture.force_scale, 5e-3);
        let head = picture.solids.iter().find(|run| run.kind.mesh == MeshKey::Custom(0)).unwrap();
        let head = &picture.instances[head.first as usize];
        let tip_m = f64::from(head.position[2] + head.extents[2]);
        assert!((tip_m - (-0.1 + 40.0 * 5e-3)).abs() < 1e-6, "{tip_m} m");
    }

    #[test]
    fn a_scale_is_round_and_stays_while_its_arrows_can_be_seen() {
        assert_eq!(scale(0.0, 40.0, 2.0), 5e-3);
        assert_eq!(scale(5e-3, 100.0, 2.0), 5e-3);
        assert_eq!(scale(5e-3, 1000.0, 2.0), 2e-4);
        assert_eq!(scale(5e-3, 0.0, 2.0), 5e-3, "nothing is drawn");
    }
}
