//! A run of a scene of `bench contact`: the cost of its steps, how deep bodies get, how far they creep, the energy that
//! contacts make.
//!
//! In: a cluster or a rapier3d world, a time. Out: a [`Course`]. Never here: which scenes there are, peers' files.

use crate::bench::rig::machine::own_cpu;
use crate::bench::rig::play::Play;
use glam::DVec3;
use metachron_contact::step::ClusterReport;
use rapier3d::pipeline::PhysicsWorld;

/// The part of a run in which bodies are held to lie still, seconds before its end.
const REST_S: f64 = 0.5;

/// The results of a run.
#[derive(Debug, Clone, Default)]
pub(super) struct Course {
    pub bodies: usize,
    /// CPU milliseconds of each macro step, in their order.
    pub ms: Vec<f64>,
    /// Sums of all reports, the most contacts and the greatest depths before and within the last half second, metres.
    pub fine_steps: u32,
    pub solves: u32,
    pub factors: u32,
    pub products: u32,
    pub unfinished: u32,
    pub contacts: u32,
    pub landing_m: f64,
    pub rest_m: f64,
    /// How far bodies went in the last half second, the mean and the most, metres; NaN of shorter runs.
    pub drift_mean_m: f64,
    pub drift_most_m: f64,
    /// By how much the highest body sank from its start to the end, metres.
    pub sank_m: f64,
    /// The most energy above its least so far, and how much was lost, J.
    pub made_j: f64,
    pub lost_j: f64,
    /// The energies from which the two are found: the least so far and the first.
    pub least_j: f64,
    pub first_j: f64,
}

impl Course {
    /// Steps a cluster for some seconds.
    pub fn of_cluster(play: &mut Play, seconds: f64) -> anyhow::Result<Self> {
        let start = play.middles();
        let mut course = Self { bodies: start.len(), ..Self::begun(play.energy_j()) };
        let mut settled = None;
        // a step that rounding leaves out is none
        while play.time_s() < seconds - 1e-9 {
            if settled.is_none() && play.time_s() > seconds - REST_S {
                settled = Some(play.middles());
            }
            let from = own_cpu();
            let report = play.step()?;
            course.ms.push((own_cpu() - from).as_secs_f64() * 1e3);
            course.add(&report);
            course.note(report.depth_m, play.energy_j(), settled.is_some());
        }
        Ok(course.ended(&start, settled.as_deref(), &play.middles()))
    }

    /// Steps a rapier3d world for some seconds.
    pub fn of_plain_world(world: &mut PhysicsWorld, seconds: f64) -> Self {
        let step_s = f64::from(world.integration_parameters.dt);
        let steps = (seconds / step_s).round();
        let start = places(world);
        let mut course = Self { bodies: start.len(), ..Self::begun(energy_j(world)) };
        let mut settled = None;
        for at in 0..steps as u64 {
            if settled.is_none() && at as f64 * step_s > seconds - REST_S {
                settled = Some(places(world));
            }
            let from = own_cpu();
            world.step();
            course.ms.push((own_cpu() - from).as_secs_f64() * 1e3);
            let (contacts, depth_m) = touching(world);
            course.contacts = course.contacts.max(contacts);
            course.note(depth_m, energy_j(world), settled.is_some());
        }
        course.fine_steps = course.ms.len() as u32;
        course.ended(&start, settled.as_deref(), &places(world))
    }

    fn begun(energy_j: f64) -> Self {
        Self { least_j: energy_j, first_j: energy_j, ..Self::default() }
    }

    fn add(&mut self, report: &ClusterReport) {
        self.fine_steps += report.fine_steps;
        self.solves += report.solves;
        self.factors += report.factors;
        self.products += report.products;
        self.unfinished += report.unfinished;
        self.contacts = self.contacts.max(report.contacts);
    }

    fn note(&mut self, depth_m: f64, energy_j: f64, settled: bool) {
        let deepest_m = if settled { &mut self.rest_m } else { &mut self.landing_m };
        *deepest_m = deepest_m.max(depth_m);
        self.made_j = self.made_j.max(energy_j - self.least_j);
        self.least_j = self.least_j.min(energy_j);
    }

    fn ended(mut self, start: &[DVec3], settled: Option<&[DVec3]>, end: &[DVec3]) -> Self {
        let went = |from: &[DVec3]| from.iter().zip(end).map(|(a, b)| a.distance(*b)).collect::<Vec<_>>();
        let went = settled.map(went).unwrap_or_default();
        self.drift_mean_m = went.iter().sum::<f64>() / went.len() as f64;
        self.drift_most_m = went.iter().copied().fold(f64::NAN, f64::max);
        let highest = (0..start.len()).max_by(|a, b| start[*a].z.total_cmp(&start[*b].z));
        self.sank_m = highest.map_or(f64::NAN, |at| start[at].z - end[at].z);
        self.lost_j = self.first_j - self.least_j;
        self
    }

    /// CPU time of all steps, seconds.
    pub fn cpu_s(&self) -> f64 {
        self.ms.iter().sum::<f64>() * 1e-3
    }

    /// Milliseconds that a share of the steps does not exceed.
    pub fn ms_at(&self, share: f64) -> f64 {
        let mut sorted = self.ms.clone();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().saturating_sub(1);
        sorted.get((share * last as f64).round() as usize).copied().unwrap_or(f64::NAN)
    }
}

fn places(world: &PhysicsWorld) -> Vec<DVec3> {
    world.bodies.iter().map(|(_, body)| body.translation().as_dvec3()).collect()
}

fn energy_j(world: &PhysicsWorld) -> f64 {
    let of = |body: &rapier3d::dynamics::RigidBody| {
        let height_m = f64::from(body.translation().dot(-world.gravity));
        f64::from(body.kinetic_energy()) + f64::from(body.mass()) * height_m
    };
    world.bodies.iter().map(|(_, body)| of(body)).sum()
}

/// How many points touch, and the deepest overlap, metres.
fn touching(world: &PhysicsWorld) -> (u32, f64) {
    let points = world.contact_pairs().flat_map(|pair| pair.manifolds()).flat_map(|manifold| &manifold.points);
    points.fold((0, 0.0), |(count, deepest_m), point| (count + 1, -f64::from(point.dist).min(-deepest_m)))
}
