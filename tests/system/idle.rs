//! Nothing for nothing: an object at rest takes no steps and no time, changes nothing for others and is read by no
//! frame; parts that a scene does not have are not set up.

#[cfg(all(target_os = "linux", target_env = "gnu"))]
use crate::play::{Folder, program};
use glam::DVec3;
use metachron_core::AgentId;
use metachron_geometry::Solid;
use metachron_models::rigid::RigidBody;
use metachron_models::rigid::RigidSpec;
use metachron_runtime::{
    AgentHandle, AgentSpawn, AgentState, Command, Lockstep, Machine, Pool, Priority, Reader, Run, SystemClock, Threads,
    TimelineCommand, state_hash,
};
use std::sync::Arc;
use std::time::Duration;

const FRAME: Duration = Duration::from_millis(16);
const AWAKE: usize = 10;

/// A ball without weight at a place of a lattice of metres; one that may sleep stands still, the others turn where they are.
fn ball(number: usize, sleeps: bool) -> AgentSpawn {
    let place = |k: usize| DVec3::new((k % 10) as f64, (k / 10 % 10) as f64, (k / 100) as f64);
    let free = RigidSpec::free(Solid::Ball { radius_m: 0.1 }, place(number), 1.0);
    let spin = if sleeps { DVec3::ZERO } else { DVec3::new(1.0, 2.0, 3.0) };
    let spec = RigidSpec { spin, sleep: sleeps, ..free };
    AgentSpawn::alone(format!("ball {number}"), Box::new(RigidBody::new(spec).unwrap()), 100.0)
}

/// Ten that turn, and so many that rest after half a second.
fn company(asleep: usize) -> Vec<AgentSpawn> {
    (0..AWAKE + asleep).map(|number| ball(number, number >= AWAKE)).collect()
}

fn rests(agent: &AgentHandle) -> bool {
    agent.state() == AgentState::Resting
}

/// Steps, work and CPU seconds of all that may sleep.
fn spent(run: &dyn Run) -> Vec<(u64, f64, f64)> {
    let of = |agent: &AgentHandle| (agent.steps(), agent.stats().work, agent.cpu_s());
    run.agents().iter().skip(AWAKE).map(of).collect()
}

/// Goes on frame by frame until `done`; a minute only ends a test that hangs.
fn play_until(run: &mut dyn Run, done: impl Fn(&dyn Run) -> bool) {
    let end = run.now() + Duration::from_secs(60);
    while !done(run) {
        assert!(run.now() < end, "never happened");
        run.wait_until(run.now() + FRAME);
    }
}

#[test]
fn a_thousand_that_rest_leave_ten_as_they_are_and_no_frame_reads_them() {
    let [alone, beside] = [0, 1000].map(|asleep| {
        // nobody waits for a core
        let machine = Machine { cores: 2048, ..Machine::default() };
        let mut run = Lockstep::start(company(asleep), machine).unwrap();
        let mut reader = Reader::new(run.agents());
        let mut frame = |run: &mut Lockstep| {
            let mut reads = 0;
            run.wait_until(run.now() + FRAME);
            reader.read(run.agents(), run.sim_now(), |_, _, _| reads += 1);
            reads
        };
        // a second: all that may rest do
        for _ in 0..64 {
            frame(&mut run);
        }
        assert!(run.agents().iter().skip(AWAKE).all(rests));
        let before = spent(&run);
        let reads: Vec<u32> = (0..600).map(|_| frame(&mut run)).collect();
        assert_eq!(spent(&run), before, "no step, no work, no time");
        let ten = || run.agents().iter().take(AWAKE);
        let made: Vec<_> = ten().map(|agent| (agent.steps(), agent.stats().work)).collect();
        (reads, made, state_hash(ten()))
    });
    assert!(alone.0.iter().all(|reads| *reads <= 10) && alone.0.iter().sum::<u32>() > 5000);
    assert!(alone == beside);
}

#[test]
fn who_rests_takes_no_step_and_no_time_of_any_thread_until_it_is_woken() {
    let clock = || Arc::new(SystemClock::new());
    let runs: [Box<dyn Run>; 2] = [
        Box::new(Pool::start(company(1000), clock(), Priority::Normal).unwrap()),
        Box::new(Threads::start(company(40), clock(), Priority::Normal).unwrap()),
    ];
    for mut run in runs {
        run.drive(TimelineCommand::Run);
        play_until(&mut *run, |run| run.agents().iter().skip(AWAKE).all(rests));
        let steps = |run: &dyn Run| run.agents().iter().take(AWAKE).map(AgentHandle::steps).min().unwrap_or(0);
        // the last turn of each is accounted for by then
        let then = steps(&*run) + 20;
        play_until(&mut *run, |run| steps(run) >= then);
        let before = spent(&*run);
        play_until(&mut *run, |run| steps(run) >= then + 50);
        assert_eq!(spent(&*run), before, "no step, no work, no time");
        run.send(AgentId(AWAKE as u32), Command::wake()).unwrap();
        play_until(&mut *run, |run| spent(run)[0].0 > before[0].0);
        assert_eq!(spent(&*run)[1..], before[1..], "the others sleep on");
    }
}

/// The lines of the system's loader about the libraries that are opened by a headless run with these arguments.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn loaded(scene: &Folder, arguments: &[&str]) -> String {
    let mut child = program();
    child.args(["run", scene.scene(), "--headless", "-q", "--executor", "lockstep", "--frames", "3"]).args(arguments);
    let done = child.env("LD_DEBUG", "files").output().unwrap();
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8_lossy(&done.stderr).into_owned()
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[test]
fn nothing_that_draws_is_loaded_where_no_picture_is_wanted() {
    let scene = Folder::with("[[object]]\nname = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\n");
    let picture = scene.file("last.png");
    let draws = |said: &str| ["libvulkan", "libEGL", "libwayland", "libX11", "libxcb"].iter().any(|l| said.contains(l));
    assert!(draws(&loaded(&scene, &["--png", &picture, "--size", "16x16"])), "a picture is looked for somewhere");
    assert!(!draws(&loaded(&scene, &[])));
}
