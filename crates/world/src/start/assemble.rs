//! From a scene to agents that can run: models built, laws and links given to both sides, the declared machine.
//!
//! In: a [`Scene`]. Out: spawns for the runtime. Never here: time passing, a law of control.

use super::ties::{Ties, faults};
use crate::description::kinds::ExecutorKind;
use crate::description::scene::{Load, ShadingCosts};
use crate::error::WorldError;
use crate::{Member, Scene, Spec};
use metachron_contact::Agent;
use metachron_contact::detect::{ClusterScene, Passage};
use metachron_core::{OutOfRange, Resolution};
use metachron_geometry::Obstacle;
use metachron_models::rigid::{KinematicBody, RigidBody};
use metachron_models::rod::Tube;
use metachron_models::soft::SoftBody;
use metachron_models::synthetic::Synthetic;
use metachron_models::tool::Tool;
use metachron_runtime::{AUTO_THREADS_MAX, AgentSpawn, Demand, Governor, Machine, StepPrice, WatchedPoint};
use std::borrow::Cow;
use std::sync::Arc;

/// Chooses the governor of an agent's step and resolution; `None` for an agent that keeps its own.
pub type Govern<'a> = &'a mut dyn FnMut(&Member) -> Option<Box<dyn Governor>>;

/// The agents of `scene`, ready to run.
///
/// # Errors
/// [`WorldError::Build`] if a model rejects its object.
pub(crate) fn spawns(
    scene: &Scene,
    surroundings: &Arc<ClusterScene>,
    executor: ExecutorKind,
    govern: Govern<'_>,
) -> Result<Vec<AgentSpawn>, WorldError> {
    let mut ties = Ties::of(scene);
    let all = scene.agents.iter();
    all.map(|member| {
        let spawn = spawn(scene, member, executor, &mut *govern, &mut ties)?;
        Ok(AgentSpawn { scene: Arc::clone(surroundings), ..spawn })
    })
    .collect()
}

/// An agent that joins a world that runs.
///
/// # Errors
/// [`WorldError::Build`] if its model rejects it.
pub(super) fn lone(
    member: &Member,
    surroundings: &Arc<ClusterScene>,
    executor: ExecutorKind,
) -> Result<AgentSpawn, WorldError> {
    let failed = |reason: String| WorldError::Build { name: member.name.clone(), reason };
    let agent = build(member, executor).map_err(|reason| failed(reason.to_string()))?;
    let alone = AgentSpawn::alone(member.name.clone(), agent, member.pace.rate_hz);
    let (dt, dt_range) = (member.pace.dt, member.pace.dt_range);
    Ok(AgentSpawn { dt, dt_range, range: Some(member.simulation), scene: Arc::clone(surroundings), ..alone })
}

/// The data that all contact clusters of a scene share: its static solids and joints.
///
/// # Errors
/// [`WorldError::Build`] for a solid or a joint that cannot be.
pub(crate) fn surroundings(scene: &Scene) -> Result<Arc<ClusterScene>, WorldError> {
    let failed = |reason: String| WorldError::Build { name: scene.name.clone(), reason };
    let rough = |solid: &Obstacle| {
        let wrong = |wrong: OutOfRange| WorldError::Build { name: solid.name.clone(), reason: wrong.to_string() };
        solid.check_surface().map_err(wrong)
    };
    scene.obstacles.iter().try_for_each(rough)?;
    let among = ClusterScene::new(&scene.obstacles).map_err(|error| failed(error.to_string()))?;
    let among = among.resting_at(scene.contact_depth_m).map_err(|error| failed(error.to_string()))?;
    let among = among.within(scene.contact_budget).map_err(|error| failed(error.to_string()))?;
    let passages = scene.held_through().map(|(body, solid)| Passage { body, solid: solid as u32 });
    let among = among.with_passages(passages);
    among.jointed(Arc::clone(&scene.joints)).map(Arc::new).map_err(|error| failed(error.to_string()))
}

/// The executor asked for; where that is left open, chosen by the number of agents.
pub(crate) fn executor(asked: ExecutorKind, agents: usize) -> ExecutorKind {
    match asked {
        ExecutorKind::Auto if agents <= AUTO_THREADS_MAX => ExecutorKind::Threads,
        ExecutorKind::Auto => ExecutorKind::Pool,
        asked => asked,
    }
}

fn spawn(
    scene: &Scene,
    member: &Member,
    executor: ExecutorKind,
    govern: Govern<'_>,
    ties: &mut Ties,
) -> Result<AgentSpawn, WorldError> {
    let mut agent = build(member, executor)
        .map_err(|reason| WorldError::Build { name: member.name.clone(), reason: reason.to_string() })?;
    let watches = scene.probes.iter().filter(|probe| probe.agent == member.id);
    let watches = watches.filter_map(|probe| Some(WatchedPoint { at: probe.at, every: probe.every? }));
    let governor = govern(member);
    let Demand { dt, resolution } = governor.as_ref().map_or_else(Demand::default, |governor| governor.begins_with());
    if let Some(Resolution { eps_m, .. }) = resolution {
        agent.set_resolution(member.simulation.clamp(Resolution { eps_m, n: member.start.n }));
    }
    Ok(AgentSpawn {
        name: member.name.clone(),
        agent,
        rate_hz: member.pace.rate_hz,
        dt: dt.unwrap_or(member.pace.dt),
        dt_range: member.pace.dt_range,
        range: Some(member.simulation),
        links: member.links.clone(),
        laws: ties.laws(member.id),
        attached: ties.attached(member.id),
        scene: Arc::default(),
        faults: faults(member.faults),
        watches: watches.collect(),
        governor,
    })
}

fn build(member: &Member, executor: ExecutorKind) -> Result<Box<dyn Agent>, Box<dyn std::error::Error>> {
    Ok(match member.spec.clone() {
        Spec::Tube(tube) => Box::new(Tube::new(tube)?),
        Spec::Rigid(body) if body.led.is_some() => Box::new(KinematicBody::new(&body)?),
        Spec::Rigid(body) => Box::new(RigidBody::new(body)?),
        Spec::Soft(soft) => Box::new(SoftBody::new(soft)?),
        Spec::Tool(tool) => Box::new(Tool::new(tool)?),
        Spec::Custom(custom) => custom.build(member.id),
        Spec::Synthetic(synthetic) => {
            let agent = Synthetic::new(synthetic, member.simulation, member.start)?;
            // lockstep charges declared costs, so no CPU time has to be burnt
            Box::new(if executor == ExecutorKind::Lockstep { agent.declared_only() } else { agent })
        }
    })
}

/// The machine declared by `scene`.
#[must_use]
pub fn machine(scene: &Scene) -> Machine {
    let wish = &scene.machine;
    let mut machine = Machine::preset(&wish.preset).unwrap_or_else(Machine::two_cores_software);
    machine.cores = wish.cores.unwrap_or(machine.cores);
    for (model, cost) in &wish.step {
        let known = machine.steps.iter().position(|price| price.model == *model);
        let at = known.unwrap_or_else(|| {
            machine.steps.push(StepPrice { model: Cow::Owned(model.clone()), base_us: 0.0, unit_us: 0.0 });
            machine.steps.len() - 1
        });
        let price = &mut machine.steps[at];
        price.base_us = cost.base_us.unwrap_or(price.base_us);
        price.unit_us = cost.unit_us.unwrap_or(price.unit_us);
    }
    let draw = &mut machine.draw;
    draw.setup_ms = wish.draw_setup_ms.unwrap_or(draw.setup_ms);
    draw.pixel_ns = wish.draw_pixel_ns.unwrap_or(draw.pixel_ns);
    draw.serial = wish.draw_serial.unwrap_or(draw.serial);
    draw.enlarge_ns = wish.draw_enlarge_ns.unwrap_or(draw.enlarge_ns);
    let ShadingCosts { flat, gouraud, per_pixel, textured, points, lines } = wish.shading;
    let strokes = draw.strokes.iter_mut().zip([points, lines]);
    for (price, own) in draw.objects.iter_mut().zip([flat, gouraud, per_pixel, textured]).chain(strokes) {
        price.setup_us = own.object_us.or(wish.draw_object_us).unwrap_or(price.setup_us);
        price.triangle_us = own.triangle_us.or(wish.draw_triangle_us).unwrap_or(price.triangle_us);
        price.vertex_us = own.vertex_us.unwrap_or(price.vertex_us);
        price.pixel_ns = own.pixel_ns.unwrap_or(price.pixel_ns);
    }
    machine.graphics_card = wish.graphics_card.unwrap_or(machine.graphics_card);
    machine.choice_ns = (wish.cull_object_ns.unwrap_or(0.0), wish.choose_object_ns.unwrap_or(0.0));
    machine.noise_sd = wish.noise.unwrap_or(machine.noise_sd);
    machine.wander_sd = wish.wander.unwrap_or(machine.wander_sd);
    machine.spikes = wish.spikes.unwrap_or(machine.spikes);
    let load = |entries: &[Load]| entries.iter().map(|entry| (entry.at_s, entry.factor)).collect();
    (machine.load, machine.step_load) = (load(&wish.load), load(&wish.step_load));
    machine.seed = wish.seed.map_or(machine.seed, u64::from);
    machine
}
