//! Converts a scene into actors for the renderer and views for control; `metachron_world` makes its agents.
//!
//! In: a [`Scene`]. Out: actors and static solids for the renderer, views for control, governors of agents.
//! Never here: time passing.

use super::cpu_budget::AgentBudget;
use super::drawn_form::{form, triangles};
use super::error_control::ErrorStatus;
use super::governor::{ErrorGovernor, RateGovernor};
use glam::DVec3;
use metachron_core::{AgentId, N_MAX, ResolutionRange};
use metachron_drawable::{Model, PieceKind};
use metachron_lod::control;
use metachron_lod::control::{
    ErrorControl, ErrorLimits, GivenSliders, Kind, Law, LevelDemand, Losses, ObjectView, PRIMITIVE_LEVELS,
    PictureControl, Pieces, Prices, RateControl, RateDemand, RateGains, RateLimits, Stages, Stroke, Value,
};
use metachron_render::{Actor, Appearance, Camera, EnvironmentLight, Form, Level, SceneView, StaticObject, Visibility};
use metachron_runtime::{DrawPrice, Governor, ObjectPrice};
use metachron_world::kinds;
use metachron_world::kinds::{LawKind, ShadingKind, ValueKind};
use metachron_world::{Member, Scene, Scenery, Target, machine};
use std::sync::Arc;

/// Adds the governors of rates and errors to the agents of a scene, and keeps the data that they share with the frame
/// loop.
pub(super) struct Governors {
    share: f64,
    /// Whether agents that keep a rate begin at their coarsest.
    from_coarsest: bool,
    gains: RateGains,
    /// The shared data so far.
    pub controlled: ControlledAgents,
}

impl Governors {
    /// Of the agents of `scene`, each of which begins as the scene has it.
    pub fn of(scene: &Scene) -> Self {
        let controlled = ControlledAgents::default();
        Self { share: share(scene), from_coarsest: false, gains: rate_gains(scene), controlled }
    }

    /// Of the agents of `scene`, of which those that keep a rate begin at their coarsest.
    pub fn from_coarsest(scene: &Scene) -> Self {
        Self { from_coarsest: true, ..Self::of(scene) }
    }

    /// The governor of one agent's dt and ε; none where the scene fixes both.
    pub fn governor(&mut self, member: &Member) -> Option<Box<dyn Governor>> {
        let meshed = member.spec.adapts_spacing();
        if let Some(tolerance_m) = member.tolerance_m {
            return error_governor(member, tolerance_m, meshed, &mut self.controlled);
        }
        let limits = rate_limits(member, self.share);
        let control = match self.from_coarsest {
            true => RateControl::from_coarsest(limits, self.gains),
            false => RateControl::new(limits, self.gains, meshed.then_some(member.start.eps_m)),
        };
        if !control.steers() {
            return None;
        }
        let (least, fair) = (control.least_part(), control.share());
        let budget = Arc::new(AgentBudget::new(member.id, member.pace.rate_hz, least, fair));
        self.controlled.budgets.push(Arc::clone(&budget));
        Some(Box::new(RateGovernor(control, budget)))
    }
}

/// Data that the agents' controllers share with the frame loop.
#[derive(Debug, Default)]
pub(super) struct ControlledAgents {
    /// Controllers that keep a rate.
    pub budgets: Vec<Arc<AgentBudget>>,
    /// Controllers that hold an error.
    pub error_statuses: Vec<Arc<ErrorStatus>>,
}

/// The share of its period that one agent's work may take, so that all agents fit on `cores` next to the frame loop.
fn fair_share(cores: u32, agents: usize) -> f64 {
    (ROOM * f64::from(cores) / agents.max(1) as f64).min(SHARE_MAX)
}

/// Share of all cores that the agents together may plan with; the rest is reserved for the frame loop.
pub(super) const ROOM: f64 = 0.75;
/// Largest share of its period that an agent may take even if cores are idle: past it every hiccup makes the agent late.
pub(super) const SHARE_MAX: f64 = 0.6;

/// The share of its period that each agent of `scene` may take at the start.
fn share(scene: &Scene) -> f64 {
    fair_share(machine(scene).cores, scene.agents.len())
}

/// The gains of the agents' controllers: the scene's, or the law's own.
fn rate_gains(scene: &Scene) -> RateGains {
    let (given, own) = (&scene.target, RateGains::default());
    RateGains { refine: given.agent_refine.unwrap_or(own.refine), yielding: given.agent_yield.unwrap_or(own.yielding) }
}

/// The limits of the controller of each agent of `scene` that keeps a rate and leaves something to choose.
pub(super) fn controlled_members(scene: &Scene) -> impl Iterator<Item = (&Member, RateLimits)> {
    let share = share(scene);
    let members = scene.agents.iter().filter(|member| member.tolerance_m.is_none());
    members.map(move |member| (member, rate_limits(member, share))).filter(|(_, limits)| limits.top() > 0.0)
}

fn rate_limits(member: &Member, share: f64) -> RateLimits {
    RateLimits {
        dt_wanted_s: member.pace.dt.as_secs_f64(),
        dt_max_s: member.pace.dt_range.1.as_secs_f64(),
        eps_m: member.spec.adapts_spacing().then_some(member.simulation.eps_m),
        work_power: member.spec.work_power(),
        share,
    }
}

/// The governor of an agent with an error tolerance.
fn error_governor(
    member: &Member,
    tolerance_m: f64,
    meshed: bool,
    controlled: &mut ControlledAgents,
) -> Option<Box<dyn Governor>> {
    let (least, greatest) = member.pace.dt_range;
    let dt_s = (least.as_secs_f64(), greatest.as_secs_f64());
    let limits = ErrorLimits { tolerance_m, dt_s, eps_m: meshed.then_some(member.simulation.eps_m) };
    let now = RateDemand { dt_s: member.pace.dt.as_secs_f64(), eps_m: meshed.then_some(member.start.eps_m) };
    let control = ErrorControl::new(&limits, now);
    if !control.steers() {
        return None;
    }
    let error_status = ErrorStatus::new(member.id, tolerance_m);
    controlled.error_statuses.push(Arc::clone(&error_status));
    Some(Box::new(ErrorGovernor(control, error_status)))
}

/// All drawable objects: agents, then scenery, then the proxies of groups.
pub fn scene_view(scene: &Scene) -> SceneView {
    let agents = scene.agents.iter().map(actor);
    let still = (scene.agents.len() as u32..).zip(scenery(scene)).map(|(id, it)| {
        let form = Form::Scenery(it.model.clone(), it.at);
        Actor { id: AgentId(id), form, appearance: appearance(&it.appearance) }
    });
    let actors = agents.chain(still);
    let props = scene.obstacles.iter().zip(&scene.obstacle_appearances).enumerate();
    let props = props.map(|(at, (obstacle, wish))| StaticObject {
        obstacle: obstacle.clone(),
        appearance: appearance(wish),
        throws_shadow: !scene.walls.contains(&at),
    });
    let mut scene_view = SceneView::new(actors.collect(), props.collect());
    scene_view.set_groups(&members(scene));
    scene_view.set_cells(scene.cells.clone());
    scene_view.set_environment(scene.environment);
    for (id, it) in (scene.agents.len() as u32..).zip(scenery(scene)) {
        if let Some(texture) = &it.texture {
            scene_view.paint(AgentId(id), texture);
        }
        if let Some(motion) = it.motion {
            scene_view.set_motion(AgentId(id), motion);
        }
    }
    scene_view
}

/// Takes up an agent that joined, whose number is the next one.
pub fn join(scene: &mut Scene, scene_view: &mut SceneView, member: Member) {
    scene_view.join(actor(&member));
    scene.agents.push(member);
}

/// How an agent is drawn.
pub fn actor(member: &Member) -> Actor {
    Actor { id: member.id, form: form(&member.spec), appearance: appearance(&member.appearance) }
}

/// For every group the actors in it and in its groups: agents, then scenery.
pub fn members(scene: &Scene) -> Vec<Vec<usize>> {
    let of = |group: &metachron_world::Group| {
        let agents = group.agents.iter().map(|id| id.0 as usize);
        agents.chain(group.members.clone().map(|at| scene.agents.len() + at)).collect()
    };
    scene.groups.iter().map(of).collect()
}

/// The part of control's description of an actor that is the same in every frame, until one joins.
#[derive(Debug, Clone, Copy, Default)]
pub struct FixedPart {
    /// The actor of the innermost group that it is in.
    pub group: Option<usize>,
    /// Triangles at every level, of an agent that is one mesh per level.
    pub triangles: [u32; PRIMITIVE_LEVELS],
    /// What coarser forms lose, of scenery and of what stands for a group.
    pub losses: Option<Losses>,
}

/// That of every actor: agents, then scenery, then groups.
pub fn fixed_parts(scene: &Scene) -> Vec<FixedPart> {
    let first = scene.agents.len() + scene.scenery.len();
    let agents = scene.agents.iter();
    let agents = agents.map(|member| FixedPart { triangles: triangles(&member.spec), ..FixedPart::default() });
    let still = scenery(scene).map(|it| FixedPart { losses: Some(losses(it)), ..FixedPart::default() });
    let mut all: Vec<FixedPart> = agents.chain(still).collect();
    // inner groups come first
    for (at, (group, members)) in scene.groups.iter().zip(members(scene)).enumerate() {
        for member in members.into_iter().chain(group.groups.clone().map(|inner| first + inner)) {
            all[member].group = all[member].group.or(Some(first + at));
        }
    }
    all
}

fn losses(it: &Scenery) -> Losses {
    let texture = it.texture.as_ref().map_or(0.0, |texture| texture.loss());
    Losses { forms: it.model.losses(), range: it.model.range(), texture }
}

/// All scenery in the order of its actors.
fn scenery(scene: &Scene) -> impl Iterator<Item = &Scenery> {
    scene.scenery.iter().chain(scene.groups.iter().map(|group| &group.proxy))
}

const fn appearance(wish: &metachron_world::Appearance) -> Appearance {
    Appearance { colour: wish.colour, material: wish.material }
}

/// The picture controller configured by `scene`.
pub fn picture_control(scene: &Scene) -> PictureControl {
    let target = &scene.target;
    let mut control = PictureControl::new(target.policy, law(target), target.frame_hz);
    control.set_value(value(target.value));
    let Target { focus, motion, hysteresis, .. } = *target;
    control.set_sliders(GivenSliders { focus, motion, hysteresis, ..GivenSliders::default() });
    control.set_raise(target.raise);
    control.set_render_scale(target.render_scale.ends());
    control.set_throws_shadows(EnvironmentLight::of(scene.environment).throws_shadows());
    if let Some((lag_s, share)) = target.lag() {
        control.set_lag(lag_s, share);
    }
    control.set_prices(prices(&machine(scene).draw).with_serial(0.0));
    if let Some(margin) = target.margin {
        control.set_margin(margin);
    }
    control
}

const fn value(kind: ValueKind) -> Value {
    match kind {
        ValueKind::Gentle => Value::Gentle,
        ValueKind::Plain => Value::Plain,
        ValueKind::Steep => Value::Steep,
        ValueKind::Focus => Value::Focus,
        ValueKind::FocusSteep => Value::FocusSteep,
    }
}

/// The declared drawing prices in control's units.
pub fn prices(draw: &DrawPrice) -> Prices {
    let object = |price: &ObjectPrice| Stages {
        setup: price.setup_us * 1e-6,
        polygon: price.triangle_us * 1e-6,
        vertex: price.vertex_us * 1e-6,
        pixel: price.pixel_ns * 1e-9,
        serial: draw.serial,
    };
    Prices {
        frame_s: draw.setup_ms * 1e-3,
        pixel_s: draw.pixel_ns * 1e-9,
        enlarge_s: draw.enlarge_ns * 1e-9,
        shading: draw.objects.each_ref().map(object),
        strokes: draw.strokes.each_ref().map(object),
        areas: None,
    }
}

/// The feedback law configured by a target.
pub fn law(target: &Target) -> Law {
    match target.law {
        LawKind::Printed => {
            let Law::Printed { alpha, beta } = Law::PRINTED else { return Law::PRINTED };
            Law::Printed { alpha: target.alpha.unwrap_or(alpha), beta: target.beta.unwrap_or(beta) }
        }
        LawKind::Corrected => {
            let Law::Corrected { kappa, lead, margin } = Law::CORRECTED else { return Law::CORRECTED };
            Law::Corrected {
                kappa: target.kappa.unwrap_or(kappa),
                lead: target.lead.unwrap_or(lead),
                margin: target.margin.unwrap_or(margin),
            }
        }
    }
}

/// A scene and the fixed part of every actor's description.
#[derive(Clone, Copy)]
pub struct Actors<'a> {
    pub scene: &'a Scene,
    pub fixed_parts: &'a [FixedPart],
}

/// Updates `views`, control's description of every object of the scene view in the order of its actors, for the objects in `updated`.
pub fn update_views(views: &mut Vec<ObjectView>, seen: &[Visibility], updated: &[usize], of: Actors<'_>) {
    let view = |at: usize| {
        let fixed = of.fixed_parts.get(at).copied().unwrap_or_default();
        ObjectView { group: fixed.group, losses: fixed.losses, ..view_at(at, &seen[at], of.scene, fixed.triangles) }
    };
    if views.len() != seen.len() {
        views.clear();
        views.extend((0..seen.len()).map(view));
        return;
    }
    for &at in updated {
        views[at] = view(at);
    }
}

/// Actors are agents, then scenery, then groups.
fn view_at(at: usize, seen: &Visibility, scene: &Scene, triangles: [u32; PRIMITIVE_LEVELS]) -> ObjectView {
    let (view, appearance) = view_and_appearance(at, seen, scene, triangles);
    ObjectView { may_vanish: appearance.may_vanish.unwrap_or(scene.target.may_vanish), ..view }
}

fn view_and_appearance<'a>(
    at: usize,
    seen: &Visibility,
    scene: &'a Scene,
    triangles: [u32; PRIMITIVE_LEVELS],
) -> (ObjectView, &'a metachron_world::Appearance) {
    let (agents, members) = (scene.agents.len(), scene.scenery.len());
    if let Some(member) = scene.agents.get(at) {
        return (view(seen, member, triangles), &member.appearance);
    }
    if let Some(it) = scene.scenery.get(at - agents) {
        let (least, most) = it.model.range();
        let kind = Kind::Counted { radius_m: seen.radius_m, least, most };
        let view = ObjectView { pieces: pieces(&it.model), ..still_view(seen, it, kind) };
        return (view, &it.appearance);
    }
    let group = &scene.groups[at - agents - members];
    let impostors = std::array::from_fn(|n| group.levels.get(n).copied().unwrap_or(0));
    let kind = Kind::Group { radius_m: seen.radius_m, impostors };
    (still_view(seen, &group.proxy, kind), &group.proxy.appearance)
}

/// The pieces of foliage that may be drawn as strokes.
fn pieces(model: &Model) -> Option<Pieces> {
    let Model::Foliage(foliage) = model else { return None };
    if foliage.full_only() {
        return None;
    }
    let stroke = match foliage.kind() {
        PieceKind::Leaf => Stroke::Point,
        PieceKind::Bough => Stroke::Line,
    };
    let [least, full] = [foliage.kind().stroke_triangles(), foliage.kind().full_triangles()];
    Some(Pieces { stroke, count: foliage.strokes().len() as u32, least, full })
}

fn still_view(seen: &Visibility, it: &Scenery, kind: Kind) -> ObjectView {
    let range = ResolutionRange { eps_m: (1.0, 1.0), n: (0, N_MAX) };
    let view = view_of(seen, kind, range, &it.appearance);
    match (it.appearance.shading, &it.texture) {
        (ShadingKind::Any, Some(_)) => ObjectView { shading: (view.shading.0, control::Shading::Textured), ..view },
        _ => view,
    }
}

/// The cheapest and the best allowed shading of an object without a picture on it; tissue has a texture of its own.
fn shading(appearance: &metachron_world::Appearance) -> (control::Shading, control::Shading) {
    use control::Shading::{Flat, Gouraud, PerPixel, Textured};
    match appearance.shading {
        ShadingKind::Flat => (Flat, Flat),
        ShadingKind::Gouraud => (Gouraud, Gouraud),
        ShadingKind::PerPixel => (PerPixel, PerPixel),
        ShadingKind::Textured => (Textured, Textured),
        ShadingKind::Any if appearance.material == kinds::Material::Tissue => (Flat, Textured),
        ShadingKind::Any => (Flat, PerPixel),
    }
}

fn view(seen: &Visibility, member: &Member, triangles: [u32; PRIMITIVE_LEVELS]) -> ObjectView {
    let kind = match seen.tube_m {
        Some((length_m, radius_m)) => Kind::Tube { length_m, radius_m },
        None => Kind::Primitive { radius_m: seen.radius_m, triangles },
    };
    view_of(seen, kind, member.picture, &member.appearance)
}

fn view_of(
    seen: &Visibility,
    kind: Kind,
    range: ResolutionRange,
    appearance: &metachron_world::Appearance,
) -> ObjectView {
    ObjectView {
        id: seen.id,
        kind,
        group: None,
        range,
        shading: shading(appearance),
        pixels: seen.pixels,
        distance_m: seen.distance_m,
        speed_px_s: seen.speed_px_s,
        own_speed_px_s: seen.own_speed_px_s,
        importance: appearance.importance,
        off_centre: seen.off_centre,
        depth_m: seen.depth_m,
        visible: seen.visible,
        may_vanish: false,
        pieces: None,
        losses: None,
    }
}

/// Converts control's demand to the renderer's type.
pub fn level(view: &ObjectView, demand: &LevelDemand) -> Level {
    // a cast of floats saturates; the detail sets the colour of visible objects
    let detail = if view.visible { control::detail(view, demand) as f32 } else { 0.0 };
    Level { resolution: demand.resolution, triangles: demand.polygons as u32, shading: demand.shading, detail }
}

/// A camera of the scene `seconds` after the start; if the scene has none of that number, a camera in front that sees everything.
pub fn camera(scene: &Scene, at: usize, scene_view: &SceneView, seconds: f64) -> Camera {
    match scene.cameras.get(at) {
        Some(named) => {
            let view = named.camera.view_at(seconds);
            Camera::looking(view.eye_m, view.look_at_m, view.fov_deg.to_radians())
        }
        None => overview(scene_view),
    }
}

/// Vertical angle of view of the default camera, radians.
const OVERVIEW_FOV_RAD: f64 = 0.7;

fn overview(scene_view: &SceneView) -> Camera {
    let (centre, radius_m) = scene_view.bounds(None).unwrap_or((DVec3::ZERO, 1.0));
    let distance = 1.1 * radius_m / libm::sin(0.5 * OVERVIEW_FOV_RAD);
    let towards = DVec3::new(0.35, -1.0, 0.55).normalize();
    Camera::looking(centre + towards * distance, centre, OVERVIEW_FOV_RAD)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_may_ask_for_as_many_threads_as_the_runtime_gives() {
        assert_eq!(metachron_scene::THREADED_MAX, metachron_runtime::THREADS_MAX);
    }

    #[test]
    fn a_group_may_have_as_many_levels_as_control_chooses_among() {
        assert_eq!(metachron_world::GROUP_LEVELS_MAX, control::IMPOSTORS_MAX);
    }
}
