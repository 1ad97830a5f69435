//! The promise to carry: a body that rests on a member gives it its weight, and stays on it, whatever the rates of both.
//!
//! In: a [`Suite`] with a [`Load`]. Out: how the promise was broken. Never here: an agent by itself ([`super::bits`], [`super::physics`]).

use super::{Make, Suite};
use crate::rigid::{RigidBody, RigidSpec};
use glam::DVec3;
use metachron_contact::detect::ClusterScene;
use metachron_contact::member::{ContactMemory, Participant};
use metachron_contact::step::{ClusterStepper, Plan};
use metachron_contact::{Agent, StepContext};
use metachron_core::{AgentId, Grip, PlainLoop, SimSpan, SimTime, Snapshot};
use metachron_geometry::Solid;

/// A cube that is put on an agent.
#[derive(Clone, Copy)]
pub struct Load<'a> {
    /// Builds the agent, at rest, so that a cube may lie on it.
    pub make: Make<'a>,
    /// Where the middle of the cube's lower face is at the start, metres: on the agent's skin.
    pub stands_m: DVec3,
    /// Half the cube's edge, metres, > 0.
    pub half_m: f64,
    /// Its mass, kg, > 0.
    pub mass_kg: f64,
    /// How long the two take to come to rest, seconds.
    pub settles_s: f64,
}

/// The step that the cube wants, in those of the agent: a member makes at most 16 steps within one of another.
const RATES: [f64; 3] = [1.0 / 16.0, 1.0, 16.0];
const GRAVITY_M_S2: f64 = 9.81;
/// The most by which the force may differ from the weight, as a share of that.
const WEIGHT_SHARE: f64 = 0.01;
/// The most that the cube moves once it rests, m/s.
const STILL_M_S: f64 = 1e-3;

/// A body that rests on a member gives it its weight.
pub(super) fn carries(suite: &Suite<'_>) -> Result<(), String> {
    let Some(load) = &suite.load else { return Ok(()) };
    let wanted_s = suite.dt.as_secs_f64();
    RATES.into_iter().try_for_each(|rate| {
        let what = |what| format!("a load that wants {rate} of its step: {what}");
        Scales::new(load)?.weigh(load, [wanted_s, rate * wanted_s]).map_err(what)
    })
}

/// The agent, the cube on it, and the cluster of the two.
struct Scales {
    agents: [Box<dyn Agent>; 2],
    scene: ClusterScene,
    stepper: ClusterStepper,
    memories: [ContactMemory; 2],
    grips: [Vec<Grip>; 2],
    time: SimTime,
}

impl Scales {
    fn new(load: &Load<'_>) -> Result<Self, String> {
        let Load { make, stands_m, half_m, mass_kg, .. } = *load;
        let mut agent = make();
        if agent.member().is_none() || agent.form().is_none() {
            return Err("nothing can lie on what has no form or is no member".to_owned());
        }
        let mut snapshot = Snapshot::default();
        agent.write_snapshot(&mut snapshot);
        let is_within =
            |low: DVec3, high: DVec3| stands_m.cmpge(low - half_m).all() && stands_m.cmple(high + half_m).all();
        if !snapshot.bounds.is_some_and(|bounds| is_within(bounds.low, bounds.high)) {
            return Err(format!("its bounds are {:?}; expected a box at {stands_m}", snapshot.bounds));
        }
        let cube = Solid::Box { half_extents_m: DVec3::splat(half_m) };
        let spec = RigidSpec {
            gravity: DVec3::Z * -GRAVITY_M_S2,
            ..RigidSpec::free(cube, stands_m + DVec3::Z * half_m, mass_kg)
        };
        let cube = RigidBody::new(spec).map_err(|error| error.to_string())?;
        Ok(Self {
            agents: [agent, Box::new(cube)],
            scene: ClusterScene::default(),
            stepper: ClusterStepper::default(),
            memories: Default::default(),
            grips: Default::default(),
            time: SimTime::ZERO,
        })
    }

    /// Lets the two come to rest and compares the force of the agent in the last quarter of the time with the cube's
    /// weight.
    fn weigh(&mut self, load: &Load<'_>, wanted_s: [f64; 2]) -> Result<(), String> {
        let (mut given_n_s, mut weighed_s) = (DVec3::ZERO, 0.0);
        while self.time.as_secs_f64() < load.settles_s {
            let step_s = self.step(wanted_s)?;
            if self.time.as_secs_f64() > 0.75 * load.settles_s {
                given_n_s += self.stepper.wrench_of(1).force_n;
                weighed_s += step_s;
            }
        }
        let (given_n, weight_n) = (given_n_s / weighed_s, DVec3::Z * (load.mass_kg * GRAVITY_M_S2));
        let speed_m_s = self.agents[1].momentum().0.length() / load.mass_kg;
        if given_n.distance(weight_n) > WEIGHT_SHARE * weight_n.z || speed_m_s > STILL_M_S {
            return Err(format!("it gives {given_n} N to what weighs {} N and moves at {speed_m_s} m/s", weight_n.z));
        }
        Ok(())
    }

    /// Makes a common step; how long it was, seconds.
    fn step(&mut self, wanted_s: [f64; 2]) -> Result<f64, String> {
        let Self {
            agents: [agent, cube],
            scene,
            stepper,
            memories: [of_agent, of_cube],
            grips: [held, held_cube],
            time,
        } = self;
        let members = [agent.member(), cube.member()];
        let [Some(member), Some(cube)] = members else { return Err("it is a member no more".to_owned()) };
        let roles = [member.role(), cube.role()];
        let plan = Plan::of(roles.into_iter().zip(wanted_s));
        let [parts, cube_parts] = [0, 1].map(|at| plan.parts_in(roles[at], wanted_s[at]));
        let [id, cube_id] = [0, 1].map(AgentId);
        let context = StepContext::alone(id, *time);
        let first = Participant {
            id,
            member: member.into(),
            context,
            laws: &[],
            memory: of_agent,
            parts,
            alone_s: wanted_s[0],
            grips: held,
        };
        let context = StepContext::alone(cube_id, *time);
        let (member, alone_s) = (cube, wanted_s[1]);
        let second = Participant {
            id: cube_id,
            member: member.into(),
            context,
            laws: &[],
            memory: of_cube,
            parts: cube_parts,
            alone_s,
            grips: held_cube,
        };
        let dt = SimSpan::from_secs_f64(plan.macro_s).ok_or("a step that is no span")?;
        stepper.step(scene, &mut [first, second], dt, &PlainLoop).map_err(|error| error.to_string())?;
        *time += dt;
        Ok(dt.as_secs_f64())
    }
}
