//! Composes the picture: every visible object at its requested level, as flat arrays.
//!
//! In: a posed and surveyed [`SceneView`], levels, a style. Out: a [`Picture`]. Never here: the choice of levels, the GPU.
//! An object outside the view is in the picture where it may shade a visible one: for its shadow only.

use super::environment::EnvironmentLight;
use super::instances::{Framed, Solids, add_solid, add_static, kind, sort_solids};
use super::light_volume::LightColumn;
use super::picture::{
    Colouring, MeshKey, Picture, SkinSample, SolidInstance, Style, TubeRun, age_colour, detail_colour,
    resolution_colour,
};
use super::skin::{ShownSkin, SkinOptions, SkinScratch, curve_of_rope, drawn_radius_m};
use crate::seen::level::{Level, Shading};
use crate::seen::view::Camera;
use crate::states::scene_view::{Appearance, Form, Material, SceneView, StaticShape, Track};
use glam::{DQuat, DVec2, DVec3, Vec3};
use metachron_core::{AgentId, Anchor, Body, Resolution};
use metachron_drawable::SkinFrame;
use metachron_geometry::{Primitive, Rounding};
use std::f64::consts::TAU;

/// Repeats of the skin's texture around a tube; the shader uses the same number.
const TEXTURE_AROUND: f64 = 2.0;
/// Repeats of tissue's texture over the mean distance of a skin from its middle.
pub(super) const TEXTURE_ACROSS: f64 = 1.3;
/// Radius of the user spring's coil, as a fraction of the distance to the camera's target.
const SPRING_SHARE: f64 = 0.011;
/// Turns of that spring, and intervals per turn.
const SPRING_TURNS: (usize, usize) = (9, 8);
/// Force that colours a grasp fully red, newtons.
const FORCE_RED_N: f64 = 2.0;
/// Objects beyond this multiple of the depth of what is seen no longer widen the light.
const FOCUS_REACH: f64 = 4.0;

/// The user's spring on an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hand {
    /// The agent that the spring pulls.
    pub object: AgentId,
    /// The material point that it pulls at.
    pub anchor: Anchor,
    /// The other end of the spring, metres.
    pub target: DVec3,
}

/// Lists that are refilled every frame.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// The actors that the picture needs: visible ones, and actors that may throw a shadow on a visible one.
    pub shown: Vec<usize>,
    pub solids: Solids,
    tubes: Vec<(u8, usize)>,
    skins: SkinScratch,
}

/// The next greater of lengths that are a tenth apart, metres; at least a millimetre.
fn up_a_tenth(length_m: f64) -> f64 {
    1.1_f64.powf((length_m.max(1e-3).ln() / 1.1_f64.ln()).ceil())
}

impl SceneView {
    /// The picture of the last composition.
    #[must_use]
    pub fn picture(&self) -> &Picture {
        &self.picture
    }

    /// Makes the picture at `levels`, one per actor in their order (missing ones are drawn at (1 cm, 3)).
    pub fn compose(&mut self, camera: &Camera, levels: &[Level], style: Style, hand: Option<Hand>) -> &Picture {
        let mut picture = std::mem::take(&mut self.picture);
        let mut scratch = std::mem::take(&mut self.scratch);
        picture.clear();
        picture.style = style;
        scratch.solids.clear();
        self.find_focus(camera, &mut picture);
        picture.origin = picture.focus_m.round();
        self.find_shown(&picture, &mut scratch.shown);
        self.add_tubes(levels, &mut picture, &mut scratch);
        let mut allowance = self.allowance(levels, &scratch.shown);
        for &number in &scratch.shown {
            let (track, at) = (&mut self.tracks[number], level(levels, number));
            if at.triangles > 0 {
                let framed = Framed { picture: &picture, eye: self.eye };
                add_solid(track, at, framed, &mut scratch.solids, &mut allowance);
            } else {
                track.geomorph = None;
            }
        }
        let shaded = EnvironmentLight::of(picture.environment).throws_shadows().then(|| LightColumn::of(&picture));
        let is_held = |prop: &StaticShape| shaded.is_some_and(|column| column.holds(prop.position, prop.body.radius_m));
        let shades = |prop: &StaticShape| prop.throws_shadow && is_held(prop);
        for prop in self.statics.iter().filter(|prop| prop.seen || shades(prop)) {
            add_static(prop, &mut picture, &mut scratch.solids);
        }
        self.add_grasps(&picture, &mut scratch);
        if style.forces {
            self.add_forces(camera.distance_m, &mut picture, &mut scratch);
        }
        if let Some((from, to)) =
            hand.and_then(|hand| Some((self.anchor_position(hand.object, hand.anchor)?, hand.target)))
        {
            add_spring(from, to, SPRING_SHARE * camera.distance_m, &mut picture);
        }
        sort_solids(&mut scratch.solids, &mut picture);
        self.add_skins(levels, &mut picture, &mut scratch);
        self.picture = picture;
        self.scratch = scratch;
        &self.picture
    }

    /// Displayed position of a material point of an agent, metres.
    #[must_use]
    pub fn anchor_position(&self, id: AgentId, anchor: Anchor) -> Option<DVec3> {
        let track = self.tracks.iter().find(|track| track.actor.id == id)?;
        track.pose.point(anchor).map(|(position, _)| position)
    }

    /// Finds the ball that the light is fitted to and the box that the shadow map is fitted to, around everything near what is seen.
    /// Where the camera's target stands along its view does not matter, except where no object is seen.
    fn find_focus(&self, camera: &Camera, picture: &mut Picture) {
        let depth_m = self.seen_depth_m().unwrap_or(camera.distance_m);
        let (middle, reach) = (camera.eye() + camera.forward() * depth_m, FOCUS_REACH * depth_m);
        let near = |c: DVec3, r: f64| r > 0.0 && r.is_finite() && c.distance(middle) + r < reach;
        let moving = self.tracks.iter().filter(|t| !matches!(t.actor.form, Form::Unseen | Form::Tool(_)));
        let moving = moving.map(|t| (t.bounds.centre, t.bounds.radius_m, t.bounds.half_m));
        let fixed = self.statics.iter().filter(|p| p.throws_shadow);
        let fixed = fixed.map(|p| (p.position, p.body.radius_m, p.half_extents()));
        let (mut ball, mut tight) = ([DVec3::INFINITY, DVec3::NEG_INFINITY], [DVec3::INFINITY, DVec3::NEG_INFINITY]);
        for (centre, radius, half) in moving.chain(fixed).filter(|(c, r, _)| near(*c, *r)) {
            ball = [ball[0].min(centre - radius), ball[1].max(centre + radius)];
            tight = [tight[0].min(centre - half), tight[1].max(centre + half)];
        }
        let found = ball.iter().chain(&tight).all(|corner| corner.is_finite());
        let around = |c: DVec3, r: f64| (c - r, c + r);
        let [low, high] = ball;
        picture.focus_m = if found { 0.5 * (low + high) } else { camera.target_m };
        let radius = if found { 0.5 * low.distance(high) } else { camera.distance_m };
        // in steps of a tenth, so that shadow edges do not crawl with every move
        picture.focus_radius_m = up_a_tenth(radius);
        picture.shadowed_m = if found { (tight[0], tight[1]) } else { around(picture.focus_m, picture.focus_radius_m) };
    }

    /// Depth of what the last survey saw, tools apart, along its view: the mean over pixels; `None` where it saw nothing.
    fn seen_depth_m(&self) -> Option<f64> {
        let seen = self.tracks.iter().zip(&self.found).filter(|(track, it)| {
            it.visible && it.depth_m.is_finite() && !matches!(track.actor.form, Form::Unseen | Form::Tool(_))
        });
        let (pixels, sum) = seen.fold((0.0, 0.0), |(n, sum), (_, it)| (n + it.pixels, sum + it.pixels * it.depth_m));
        (pixels > 0.0).then(|| up_a_tenth(sum / pixels))
    }

    /// Finds the actors that are visible or may shade a visible one.
    fn find_shown(&self, picture: &Picture, shown: &mut Vec<usize>) {
        let column = LightColumn::of(picture);
        let shaded = EnvironmentLight::of(picture.environment).throws_shadows();
        let needed = |track: &Track| track.seen || shaded && column.holds(track.bounds.centre, track.bounds.radius_m);
        shown.clear();
        shown.extend(self.tracks.iter().enumerate().filter(|(_, track)| needed(track)).map(|(number, _)| number));
    }

    /// Cuts every tube into its intervals; tubes of one level are stored consecutively.
    fn add_tubes(&mut self, levels: &[Level], picture: &mut Picture, scratch: &mut Scratch) {
        scratch.tubes.clear();
        let long = |form: &Form| matches!(form, Form::Tube | Form::Rope { .. });
        let tracks = &self.tracks;
        let tubes = scratch.shown.iter().filter(|&&number| long(&tracks[number].actor.form));
        let drawn = tubes.map(|&number| (level(levels, number), number)).filter(|(at, _)| at.triangles > 0);
        scratch.tubes.extend(drawn.map(|(at, number)| (at.resolution.n, number)));
        scratch.tubes.sort_unstable();
        for &(n, number) in &scratch.tubes {
            let track = &mut self.tracks[number];
            let asked = level(levels, number);
            let Level { resolution: mut at, shading, .. } = asked;
            let curve = match (&track.pose, &track.actor.form) {
                (Body::Curve(curve), _) => curve,
                (Body::Soft(soft), Form::Rope { radius_m }) => {
                    curve_of_rope(soft, *radius_m, &mut track.rope);
                    // a rope is drawn with its own segments
                    at.eps_m = track.rope.arc_m.last().copied().unwrap_or(1.0) / track.rope.frames.len().max(1) as f64;
                    &track.rope
                }
                _ => continue,
            };
            if track.cut_m.replace(at.eps_m) != Some(at.eps_m) {
                track.skeleton.rebuild(curve, at.eps_m);
            }
            let frames = track.skeleton.frames();
            let Some(last) = frames.len().checked_sub(1) else { continue };
            let paint = Paint::of(track.actor.appearance, tint(picture.style, asked, track.age_s));
            let mean = curve.radii_m.iter().sum::<f64>() / curve.radii_m.len() as f64;
            let texture_per_m = TEXTURE_AROUND / (TAU * mean.max(1e-6));
            let (first, origin) = (picture.samples.len() as u32, picture.origin);
            picture.samples.extend(frames.iter().map(|f| sample(f, origin, texture_per_m as f32, paint)));
            let tissue = track.actor.appearance.material == Material::Tissue;
            picture.tubes.push(TubeRun { first, intervals: last as u32, n, tissue, shading, shown: track.seen });
            for end in [&frames[0], &frames[last]] {
                let size = Rounding { extents: Vec3::ZERO, radius_m: end.radius_m as f32 };
                let ball = instance(end.position - origin, DQuat::IDENTITY, size, paint);
                scratch.solids.push((kind(shading, MeshKey::Primitive(Primitive::Ball, n)), ball));
            }
        }
    }

    /// The skins of soft bodies, each with its own instance for its colour.
    fn add_skins(&self, levels: &[Level], picture: &mut Picture, Scratch { shown, skins: room, .. }: &mut Scratch) {
        for &number in &*shown {
            let track = &self.tracks[number];
            let (Form::Skin(form), Body::Soft(soft)) = (&track.actor.form, &track.pose) else { continue };
            let at = level(levels, number);
            if at.triangles == 0 {
                continue;
            }
            let paint = Paint::of(track.actor.appearance, tint(picture.style, at, track.age_s));
            let size = Rounding { extents: Vec3::ONE, radius_m: drawn_radius_m(&form.surface) as f32 };
            let number = picture.instances.len() as u32;
            let tissue = track.actor.appearance.material == Material::Tissue && form.rest.len() == soft.positions.len();
            let repeats_per_m = TEXTURE_ACROSS / form.mean_radius_m;
            let skin = instance(DVec3::ZERO, DQuat::IDENTITY, size, paint);
            picture.instances.push(SolidInstance { wrap: [repeats_per_m as f32, 0.0], ..skin });
            let Picture { skins, origin, style, .. } = picture;
            let options = SkinOptions {
                origin: *origin,
                instance: number,
                shading: at.shading,
                edges: style.wireframe,
                n: at.resolution.n,
                tissue,
            };
            skins.add(ShownSkin { form, soft }, options, room);
        }
    }

    /// A small ball at every grasped point, from white to red by the force.
    fn add_grasps(&self, picture: &Picture, Scratch { shown, solids, .. }: &mut Scratch) {
        for track in shown.iter().map(|&number| &self.tracks[number]) {
            let (Body::Tool(tool), Form::Tool(shape)) = (&track.pose, &track.actor.form) else { continue };
            let Some(grasp) = tool.grasp else { continue };
            let Some(point) = self.anchor_position(grasp.target, grasp.anchor) else { continue };
            let heat = (tool.force_n / FORCE_RED_N).clamp(0.0, 1.0);
            let cool = (235.0 * (1.0 - heat)) as u8;
            let colour = [235, cool, (f64::from(cool) * 0.8) as u8];
            let size = Rounding { extents: Vec3::ZERO, radius_m: (0.9 * shape.shaft_radius_m) as f32 };
            let paint = Paint { colour, material: Material::Plastic, tint: [colour[0], colour[1], colour[2], 200] };
            let ball = instance(point - picture.origin, DQuat::IDENTITY, size, paint);
            solids.push((kind(Shading::PerPixel, MeshKey::Primitive(Primitive::Ball, 2)), ball));
        }
    }
}

/// Colour, material and tint of an object.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Paint {
    pub colour: [u8; 3],
    material: Material,
    tint: [u8; 4],
}

impl Paint {
    pub fn of(appearance: Appearance, tint: [u8; 4]) -> Self {
        Self { colour: appearance.colour, material: appearance.material, tint }
    }

    fn packed(self) -> [u8; 4] {
        let [r, g, b] = self.colour;
        [r, g, b, self.material as u8]
    }
}

/// The level requested for an actor, clamped to its valid range.
pub(crate) fn level(levels: &[Level], number: usize) -> Level {
    let usual = Resolution { eps_m: 0.01, n: 3 };
    levels.get(number).copied().unwrap_or_else(|| usual.into()).safe()
}

pub(super) fn tint(style: Style, at: Level, age_s: f64) -> [u8; 4] {
    let with = |[r, g, b]: [u8; 3], share: u8| [r, g, b, share];
    match style.colouring {
        Colouring::Material | Colouring::Depth => [0; 4],
        Colouring::Resolution => with(resolution_colour(at.resolution), 220),
        Colouring::Detail => with(detail_colour(at.detail), 235),
        Colouring::Age => with(age_colour(age_s), 190),
    }
}

fn sample(f: &SkinFrame, origin: DVec3, texture_per_m: f32, paint: Paint) -> SkinSample {
    SkinSample {
        position: (f.position - origin).as_vec3().to_array(),
        radius_m: f.radius_m as f32,
        slope: f.slope.as_vec3().to_array(),
        radius_slope: f.radius_slope as f32,
        normal: f.normal.as_vec3().to_array(),
        twist_rad: f.twist_rad as f32,
        arc_m: f.arc_m as f32,
        texture_per_m,
        colour: paint.packed(),
        tint: paint.tint,
        flattening_m: f.flattening_m.as_vec2().to_array(),
    }
}

pub(crate) fn instance(position: DVec3, rotation: DQuat, size: Rounding, paint: Paint) -> SolidInstance {
    SolidInstance {
        rotation: rotation.as_quat().to_array(),
        position: position.as_vec3().to_array(),
        radius_m: size.radius_m,
        extents: size.extents.to_array(),
        geomorph: 0.0,
        colour: paint.packed(),
        tint: paint.tint,
        wrap: [0.0; 2],
    }
}

/// The user's spring as a coil of wire between two points.
fn add_spring(from: DVec3, to: DVec3, radius_m: f64, picture: &mut Picture) {
    let axis = to - from;
    let Some(along) = axis.try_normalize() else { return };
    let (x, count) = (along.any_orthonormal_vector(), SPRING_TURNS.0 * SPRING_TURNS.1);
    let y = along.cross(x);
    let paint = Paint { colour: [250, 190, 60], material: Material::Metal, tint: [255, 190, 60, 120] };
    let first = picture.samples.len() as u32;
    for i in 0..=count {
        let t = i as f64 / count as f64;
        // the radius tapers to zero at both ends, so that the coil meets both points
        let swell = (t * (1.0 - t) * 12.0).min(1.0);
        let rate = if swell < 1.0 { 12.0 * (1.0 - 2.0 * t) } else { 0.0 };
        let (sin, cos) = (TAU * t * SPRING_TURNS.0 as f64).sin_cos();
        let (out, side) = (x * cos + y * sin, y * cos - x * sin);
        let turn = TAU * SPRING_TURNS.0 as f64;
        let frame = SkinFrame {
            arc_m: t,
            position: from + axis * t + out * (radius_m * swell),
            slope: axis + out * (radius_m * rate) + side * (radius_m * swell * turn),
            normal: out,
            twist_rad: 0.0,
            radius_m: 0.2 * radius_m,
            radius_slope: 0.0,
            flattening_m: DVec2::ZERO,
        };
        picture.samples.push(sample(&frame, picture.origin, 0.0, paint));
    }
    picture.tubes.push(TubeRun {
        first,
        intervals: count as u32,
        n: 1,
        tissue: false,
        shading: Shading::PerPixel,
        shown: true,
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seen::view::Size;
    use crate::states::scene_view::{Actor, States};
    use metachron_core::{CurveState, SimTime, Snapshot};
    use std::sync::Arc;

    const SIZE: Size = Size { width: 640, height: 360 };

    fn tube_at(ms: u64) -> Arc<Snapshot> {
        let arc_m: Vec<f64> = (0..=40).map(|i| f64::from(i) * 0.01).collect();
        let height = 0.001 * ms as f64;
        let body = Body::Curve(CurveState {
            positions: arc_m.iter().map(|&s| DVec3::new(s, 0.1 * (9.0 * s).sin(), height)).collect(),
            velocities: vec![DVec3::Z; 41],
            frames: vec![DQuat::from_rotation_arc(DVec3::Z, DVec3::X); 40],
            radii_m: vec![0.01; 41],
            flattening_m: vec![],
            arc_m,
        });
        Arc::new(Snapshot { time: SimTime::from_nanos(ms * 1_000_000), steps: ms, body, ..Snapshot::default() })
    }

    fn scene_view() -> (SceneView, Camera) {
        let appearance = Appearance { colour: [220, 120, 110], material: Material::Tissue };
        let scene_view = SceneView::new(vec![Actor { id: AgentId(0), form: Form::Tube, appearance }], vec![]);
        (scene_view, Camera::looking(DVec3::new(0.2, -1.0, 0.5), DVec3::new(0.2, 0.0, 0.0), 0.7))
    }

    #[test]
    fn composing_reuses_storage_after_the_first_frames() {
        let (mut scene_view, camera) = scene_view();
        let mut places = Vec::new();
        let levels = [Resolution { eps_m: 0.005, n: 4 }.into()];
        for frame in 0..6 {
            scene_view.set_snapshot(AgentId(0), &tube_at(10 * frame), true);
            scene_view.pose(SimTime::from_nanos(10_000_000 * frame + 500_000), States::Interpolate);
            scene_view.survey(&camera, SIZE);
            let picture = scene_view.compose(&camera, &levels, Style::default(), None);
            let buffers = [picture.samples.as_ptr().addr(), picture.instances.as_ptr().addr()];
            let seen = scene_view.seen().as_ptr().addr();
            let Some((Body::Curve(curve), _)) = scene_view.shown(AgentId(0)) else { panic!("a curve was seen") };
            places.push((buffers, curve.positions.as_ptr().addr(), seen));
        }
        assert!(places[1..].iter().all(|p| *p == places[1]), "{places:?}");
    }

    #[test]
    fn a_tube_gets_the_intervals_and_triangles_of_its_level() {
        let (mut scene_view, camera) = scene_view();
        scene_view.set_snapshot(AgentId(0), &tube_at(0), true);
        scene_view.pose(SimTime::ZERO, States::Latest);
        for (eps_m, n, intervals) in [(0.1, 0, 4), (0.005, 3, 80)] {
            let picture = scene_view.compose(&camera, &[Resolution { eps_m, n }.into()], Style::default(), None);
            assert_eq!((picture.tubes[0].intervals, picture.samples.len()), (intervals, intervals as usize + 1));
            let caps = 2 * u64::from(Primitive::Ball.triangles(n));
            assert_eq!(picture.triangles(), u64::from(intervals) * (12 << n) + caps);
        }
    }

    #[test]
    fn objects_without_triangles_are_left_out_of_the_picture() {
        let (mut scene_view, camera) = scene_view();
        scene_view.set_snapshot(AgentId(0), &tube_at(0), true);
        scene_view.pose(SimTime::ZERO, States::Latest);
        let gone = Level { triangles: 0, ..Resolution { eps_m: 0.005, n: 3 }.into() };
        let picture = scene_view.compose(&camera, &[gone], Style::default(), None);
        assert!(picture.tubes.is_empty() && picture.instances.is_empty());
    }

    #[test]
    fn ground_and_shadows_are_the_same_wherever_the_target_stands_on_the_view() {
        let (mut scene_view, camera) = scene_view();
        scene_view.set_snapshot(AgentId(0), &tube_at(0), true);
        scene_view.pose(SimTime::ZERO, States::Latest);
        let [near, far] = [0.05, 40.0].map(|away_m| {
            let camera = Camera::looking(camera.eye(), camera.eye() + camera.forward() * away_m, camera.fov_y_rad);
            scene_view.survey(&camera, SIZE);
            let picture = scene_view.compose(&camera, &[], Style::default(), None);
            (picture.focus_radius_m, picture.focus_m, picture.shadowed_m, picture.origin)
        });
        // the eye is found from target and distance: 40 m cost it some ulp
        assert_eq!((near.0, near.3), (far.0, far.3));
        assert!(
            near.1.distance(far.1) < 1e-9 && near.2.0.distance(far.2.0) < 1e-9 && near.2.1.distance(far.2.1) < 1e-9
        );
        assert!(near.0 < 1.0, "the light is about the tube, {} m", near.0);
    }

    #[test]
    fn a_tube_out_of_sight_is_kept_for_its_shadow_only() {
        let (mut scene_view, camera) = scene_view();
        scene_view.set_snapshot(AgentId(0), &tube_at(0), true);
        scene_view.pose(SimTime::ZERO, States::Latest);
        let away = Camera::looking(camera.eye(), camera.eye() - camera.forward(), camera.fov_y_rad);
        scene_view.survey(&away, SIZE);
        let picture = scene_view.compose(&away, &[], Style::default(), None);
        assert!(!picture.tubes[0].shown);
        let aside = camera.eye() + camera.right() * 50.0;
        let far = Camera::looking(aside, aside - camera.forward(), camera.fov_y_rad);
        scene_view.survey(&far, SIZE);
        let picture = scene_view.compose(&far, &[], Style::default(), None);
        assert!(picture.tubes.is_empty() && picture.instances.is_empty(), "its shadow falls on nothing that is seen");
    }
}
