//! The coupling error of a run: the same scene once more on one very short common step, and the differences.
//!
//! In: a scene and the [`Trace`] of its run. Out: an [`ReferenceComparison`]. Never here: arguments, progress bars.
//!
//! In the second run every agent makes the same steps, a quarter of the shortest requested by any agent, in virtual time at the free pace,
//! without faults and without control of rates and resolutions. The difference of both runs is the error of different clocks, of longer
//! steps, of coarser divisions and of late frames together.
//!
//! A third run is the second one with every body's start moved by 1 µm, each in another direction: how far the two end apart says how
//! sensitive the scene is. Errors below that say nothing.

use super::coupling_record::Coupling;
use super::error::SessionError;
use super::outcome::Outcome;
use super::session::Session;
use super::trace::{Trace, TracedState, points};
use glam::DVec3;
use metachron_core::{AgentId, SimSpan, SimTime, Snapshot};
use metachron_world::couplings::Faults;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Pace, Scene};
use std::collections::BTreeMap;
use std::time::Duration;

/// Common steps per shortest step requested by any agent.
const DIVISION: f64 = 4.0;
/// Shortest common step, seconds.
const STEP_MIN_S: f64 = 2e-6;
/// How far starts are moved in the third run, metres.
const MOVED_M: f64 = 1e-6;
/// The angle between the directions of two numbers in a row, radians: the golden one, so that no two bodies move alike.
const BETWEEN_RAD: f64 = 2.399_963_229_728_653;
/// Longest common step, seconds: a scene of slow agents still has to be accurate.
const STEP_MAX_S: f64 = 2e-3;

/// Effect of different clocks.
#[derive(Debug, Clone)]
pub struct ReferenceComparison {
    /// Step of the common clock, seconds.
    pub dt_s: f64,
    /// Simulated seconds that both runs have played: the whole run, unless the comparison was ended early.
    pub sim_s: f64,
    /// States compared.
    pub states: u64,
    /// Every pair that was coupled in either run.
    pub pairs: Vec<PairError>,
    /// The greatest distance of any point from where it is with every start moved by 1 µm, metres.
    pub sensitivity_m: f64,
    /// Whether the comparison was ended early.
    pub interrupted: bool,
}

/// Effect of different clocks on two coupled agents.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairError {
    /// The first agent.
    pub a: AgentId,
    /// The second.
    pub b: AgentId,
    /// Root mean square distance of the points of both from their positions on the common clock, metres.
    pub position_rms_m: f64,
    /// Largest such distance, metres.
    pub position_max_m: f64,
    /// Largest difference of momentum of either agent, N·s.
    pub momentum_max_n_s: f64,
    /// Impulse exchanged in the run, N·s.
    pub impulse_n_s: f64,
    /// Impulse exchanged on the common clock, N·s.
    pub impulse_oracle_n_s: f64,
}

/// Distance of one agent's states from the states on the common clock.
#[derive(Debug, Clone, Copy, Default)]
struct Distance {
    points: u64,
    square_sum: f64,
    max_m: f64,
    momentum_max_n_s: f64,
}

/// Plays `scene` on one very short common step and compares it with the run that left `outcome`. `go_on` receives the share that is done, 0
/// … 1; if it returns `false` the comparison ends.
///
/// # Errors
/// As [`Session::open`].
pub fn compare_with_reference(
    scene: &Scene,
    outcome: &Outcome,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<ReferenceComparison, SessionError> {
    compare_runs(scene, outcome, &mut Vec::new(), go_on)
}

fn compare_runs(
    scene: &Scene,
    outcome: &Outcome,
    distances: &mut Vec<Distance>,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<ReferenceComparison, SessionError> {
    let common = common_clock(scene);
    let dt_s = common.agents.first().map_or(STEP_MAX_S, |member| member.pace.dt.as_secs_f64());
    let mut moved = Session::open(moved(&common), Pace::Free)?;
    let mut session = Session::open(common, Pace::Free)?;
    let mut sensitivity_m = 0.0_f64;
    let empty = Trace::default();
    let trace = outcome.trace.as_ref().unwrap_or(&empty);
    let mut states: Vec<&TracedState> = trace.states.iter().collect();
    states.sort_by_key(|state| (state.moment, state.agent));
    distances.resize(scene.agents.len(), Distance::default());
    let mut cut = None;
    let mut updated = Duration::ZERO;
    for (at, state) in states.iter().enumerate() {
        let moment = Duration::from_nanos(state.moment.as_nanos());
        session.wait_until(moment);
        moved.wait_until(moment);
        compare(&session, state, distances);
        sensitivity_m = sensitivity_m.max(apart_m([&session, &moved], state.agent));
        // couplings are published for a second after they end: reading every frame misses none
        if session.now() >= updated {
            session.read_states();
            updated = session.now() + session.period();
            if !go_on(at as f64 / states.len() as f64) {
                cut = Some(state.moment);
                break;
            }
        }
    }
    session.read_states();
    // a shorter run has exchanged less: compare up to the same time
    let run = cut.map(|time| trace.couplings_by(time, &outcome.couplings));
    let pairs = pairs(run.as_ref().unwrap_or(&outcome.couplings), session.couplings(), distances);
    let sim_s = cut.map_or(outcome.sim_s, SimTime::as_secs_f64);
    let states = distances.iter().map(|d| d.points).sum();
    Ok(ReferenceComparison { dt_s, sim_s, states, pairs, sensitivity_m, interrupted: cut.is_some() })
}

/// The same scene with one clock for all agents, free pictures and no faults.
fn common_clock(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let shortest = scene.agents.iter().map(|m| m.pace.dt.as_secs_f64()).fold(f64::INFINITY, f64::min);
    let dt_s = (shortest / DIVISION).clamp(STEP_MIN_S, STEP_MAX_S);
    let dt = SimSpan::from_secs_f64(dt_s).unwrap_or(SimSpan::from_nanos(1_000_000));
    for member in &mut scene.agents {
        member.pace.rate_hz = 1.0 / dt.as_secs_f64();
        (member.pace.dt, member.pace.dt_range) = (dt, (dt, dt));
        member.simulation.eps_m = (member.start.eps_m, member.start.eps_m);
        member.faults = Faults::default();
    }
    scene.executor = ExecutorKind::Lockstep;
    let machine = &mut scene.machine;
    (machine.draw_setup_ms, machine.draw_object_us) = (Some(0.0), Some(0.0));
    (machine.draw_triangle_us, machine.draw_pixel_ns) = (Some(0.0), Some(0.0));
    (machine.cull_object_ns, machine.choose_object_ns) = (Some(0.0), Some(0.0));
    machine.noise = Some(0.0);
    scene
}

/// The same scene with every body's start moved.
fn moved(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    for (number, member) in (0..).zip(&mut scene.agents) {
        let angle = BETWEEN_RAD * f64::from(number);
        member.spec.shift(DVec3::new(angle.cos(), angle.sin(), 0.0) * MOVED_M);
    }
    scene
}

/// The greatest distance between the points of an agent in two runs, metres.
fn apart_m(runs: [&Session; 2], agent: AgentId) -> f64 {
    let [a, b] = runs.map(|run| run.agents().get(agent.0 as usize).map(|agent| agent.latest()));
    let (Some(a), Some(b)) = (a, b) else { return 0.0 };
    let apart = points(&a.body).zip(points(&b.body)).map(|((a, _), (b, _))| a.distance(b));
    apart.fold(0.0, f64::max)
}

/// Adds the distance of an agent on the common clock from its position in the run at the same time.
fn compare(session: &Session, state: &TracedState, distances: &mut [Distance]) {
    let at = state.agent.0 as usize;
    let (Some(agent), Some(distance)) = (session.agents().get(at), distances.get_mut(at)) else { return };
    let snapshot: &Snapshot = &agent.latest();
    // the newest state is at most one tick away from that time
    let ahead_s = state.moment.secs_after(snapshot.moment());
    for ((there, velocity), here) in points(&snapshot.body).zip(&state.points_m) {
        let apart = here.distance(there + velocity * ahead_s);
        distance.points += 1;
        distance.square_sum += apart * apart;
        distance.max_m = distance.max_m.max(apart);
    }
    let spec = &session.scene().agents[at].spec;
    let there = spec.momentum_n_s(&snapshot.body) + snapshot.acceleration * (spec.mass_in_kg(&snapshot.body) * ahead_s);
    distance.momentum_max_n_s = distance.momentum_max_n_s.max((there - state.momentum).length());
}

/// Every pair that was coupled in either run, with its differences.
fn pairs(run: &[Coupling], common: &[Coupling], distances: &[Distance]) -> Vec<PairError> {
    let (run, common) = (impulses(run), impulses(common));
    let mut all: Vec<_> = run.keys().chain(common.keys()).copied().collect();
    all.sort_unstable();
    all.dedup();
    let of = |id: AgentId| distances.get(id.0 as usize).copied().unwrap_or_default();
    let pair = |(a, b): (AgentId, AgentId)| {
        let (one, two) = (of(a), of(b));
        let points = (one.points + two.points).max(1) as f64;
        PairError {
            a,
            b,
            position_rms_m: ((one.square_sum + two.square_sum) / points).sqrt(),
            position_max_m: one.max_m.max(two.max_m),
            momentum_max_n_s: one.momentum_max_n_s.max(two.momentum_max_n_s),
            impulse_n_s: run.get(&(a, b)).copied().unwrap_or(0.0),
            impulse_oracle_n_s: common.get(&(a, b)).copied().unwrap_or(0.0),
        }
    };
    all.into_iter().map(pair).collect()
}

/// The impulse that every pair exchanged, summed over the kinds of coupling.
fn impulses(couplings: &[Coupling]) -> BTreeMap<(AgentId, AgentId), f64> {
    let mut sums = BTreeMap::new();
    for coupling in couplings {
        let pair = (coupling.a.min(coupling.b), coupling.a.max(coupling.b));
        *sums.entry(pair).or_insert(0.0) += coupling.impulse_n_s;
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_scene::{Source, load};

    /// Two balls that fall side by side at different rates, far from everything.
    const FALL: &str = "format = 1\nexecutor = \"lockstep\"\n[target]\nframe_hz = 50.0\nobject = []\n";

    fn falling() -> Scene {
        let ball = |name: &str, x: f64, hz: f64| {
            format!(
                "[[object]]\nname = \"{name}\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nposition_m = [{x}, 0, 0]\nrate_hz = {hz}\nfaults = {{ jitter = 0.2, loss = 0.1 }}\n"
            )
        };
        let text =
            format!("{}{}{}", FALL.replace("object = []\n", ""), ball("slow", 0.0, 40.0), ball("fast", 5.0, 500.0));
        Source::memory("fall", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap()
    }

    #[test]
    fn the_common_clock_is_a_quarter_of_the_shortest_step_and_has_no_faults() {
        let common = common_clock(&falling());
        assert!(common.agents.iter().all(|m| m.pace.dt.as_nanos() == 500_000 && m.faults == Faults::default()));
        assert_eq!(common.executor, ExecutorKind::Lockstep);
    }

    #[test]
    fn impulses_of_all_kinds_are_summed() {
        let coupling =
            |a, b, kind, impulse_n_s| Coupling { impulse_n_s, ..Coupling::new(AgentId(a), AgentId(b), kind) };
        let sums =
            impulses(&[coupling(1, 0, "cluster", 2.0), coupling(0, 1, "attach", 3.0), coupling(1, 2, "cluster", 1.0)]);
        let sum = |a, b| sums[&(AgentId(a), AgentId(b))];
        assert_eq!((sum(0, 1), sum(1, 2)), (5.0, 1.0));
    }

    /// Two pairs of balls, one of which meets after 0.1 s and the other after 0.6 s.
    fn two_blows() -> Scene {
        let ball = |name: &str, [x, y]: [f64; 2], v: f64| {
            format!(
                "[[object]]\nname = \"{name}\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nmass_kg = 1.0\nrestitution = 1.0\n\
                 position_m = [{x}, {y}, 0]\nvelocity_m_s = [{v}, 0, 0]\n"
            )
        };
        let early = ball("a", [0.0, 0.0], 1.0) + &ball("b", [0.3, 0.0], 0.0);
        let late = ball("c", [0.0, 5.0], 1.0) + &ball("d", [0.8, 5.0], 0.0);
        let text = format!("format = 1\nexecutor = \"lockstep\"\n[world]\ngravity_m_s2 = [0, 0, 0]\n{early}{late}");
        Source::memory("blows", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap()
    }

    #[test]
    fn an_interrupted_comparison_covers_the_time_that_both_runs_played() {
        let scene = two_blows();
        let outcome = played(&scene, 60);
        let until = |share: f64| {
            compare_with_reference(&scene, &outcome, &mut |done| done < share)
                .map(|o| (o.sim_s, o.interrupted, o.pairs, o.sensitivity_m))
                .unwrap()
        };
        let (sim_s, interrupted, pairs, _) = until(0.4);
        assert!(interrupted && (0.3..0.5).contains(&sim_s), "{sim_s} s");
        let [pair] = &pairs[..] else { panic!("only one pair has met: {pairs:?}") };
        // equal masses that bounce without loss exchange their 1 m/s; a solve is done at 5e-6 m/s
        let exchanged = [pair.impulse_n_s, pair.impulse_oracle_n_s];
        assert!(
            (pair.a, pair.b) == (AgentId(0), AgentId(1)) && exchanged.iter().all(|j| (j - 1.0).abs() < 5e-6),
            "{pair:?}"
        );
        let (sim_s, interrupted, pairs, sensitivity_m) = until(2.0);
        assert!(!interrupted && (sim_s, pairs.len()) == (outcome.sim_s, 2), "{sim_s} s, {pairs:?}");
        // a ball that is met off its middle by up to 2 µm goes on aside, by up to that over its radius for each metre
        assert!((MOVED_M..4.0 * MOVED_M / 0.1).contains(&sensitivity_m), "{sensitivity_m} m");
    }

    /// `frames` frames of `scene`, with a trace.
    fn played(scene: &Scene, frames: u32) -> Outcome {
        let mut session = Session::open(scene.clone(), Pace::RealTime).unwrap();
        session.keep_trace();
        session.begin();
        for frame in 0..frames {
            session.wait_until(session.period() * frame);
            session.read_states();
        }
        session.end(None, false)
    }

    #[test]
    fn states_of_free_fall_are_compared_at_their_own_times() {
        let scene = falling();
        let outcome = played(&scene, 30);
        let mut calls = 0;
        let mut distances = Vec::new();
        let oracle = compare_runs(&scene, &outcome, &mut distances, &mut |_| {
            calls += 1;
            true
        });
        // free flight is exact at any step; between ticks of 0.5 ms it is interpolated linearly: g dt²/2 = 1.2 µm
        let oracle = oracle.unwrap();
        let states = oracle.states;
        // an agent that nothing touches stays as far from where it was as its start was moved
        assert!((oracle.sensitivity_m / MOVED_M - 1.0).abs() < 1e-6, "{} m", oracle.sensitivity_m);
        assert!(states > 40 && calls > 5 && !distances.is_empty(), "{states} states, told {calls} times");
        for distance in distances {
            assert!(distance.max_m < 2e-6 && distance.momentum_max_n_s < 1e-6, "{distance:?}");
        }
    }
}
