//! Many agents on four hosts of half a core each, beside one such host, and on a host of a whole core, beside a world in one process: how many more
//! turns a second. Hosts are processes of this program, held to half a core by the kernel's control groups; where these are refused, the test says
//! so and does not measure them.
#![cfg(target_os = "linux")]

use metachron_contact::{Agent, OwnSteps, StepContext, Stepping};
use metachron_core::{Archive, ArchiveError, SimSpan, Snapshot, StepError, StepReport};
use metachron_hosts::{Serving, connect, serve};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Custom, Pace, PlacedHost, PlacedWorld, Scene, World, WorldCalls};
use std::io::Read;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};
use std::{env, fs, io};

/// The endpoint of a host, for the process that is one.
const SERVES: &str = "METACHRON_SERVES";
/// How many agents there are; 100,000 in `docs/numbers.md`.
const AGENTS: &str = "METACHRON_AGENTS";

/// An agent that touches nothing: its step is some hundred multiplications.
struct Mill {
    sum: f64,
}

impl Agent for Mill {
    fn model(&self) -> &'static str {
        "mill"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Own(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.energy_j = self.sum;
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.value(&mut self.sum)
    }
}

impl OwnSteps for Mill {
    fn step(&mut self, dt: SimSpan, _context: &StepContext<'_>) -> Result<StepReport, StepError> {
        self.sum = (0..400).fold(self.sum + dt.as_secs_f64(), |sum, _| sum.mul_add(0.999, 1e-3));
        Ok(StepReport { work: 1.0, substeps: 1, at_rest: false })
    }
}

fn count() -> usize {
    env::var(AGENTS).ok().and_then(|count| count.parse().ok()).unwrap_or(4000)
}

fn scene() -> Scene {
    let add = |scene: metachron_world::SceneBuilder, number: usize| {
        scene.add(format!("mill {number}"), Custom::made_by(|_| Box::new(Mill { sum: 0.0 })).rate_hz(60.0))
    };
    (0..count()).fold(Scene::builder(), add).build().unwrap()
}

/// A world of the scene in lockstep, at the free pace.
fn world() -> World {
    let world = World::start(&scene(), ExecutorKind::Lockstep).unwrap();
    world.set_pace(Pace::Free).unwrap();
    world
}

/// The process of a host, which ends with its standard input.
#[test]
fn a_host_of_the_measurement() {
    let Ok(endpoint) = env::var(SERVES) else { return };
    let _host = serve(Arc::new(world()), Serving::new("mills", &endpoint)).unwrap();
    let _ = io::stdin().read_to_end(&mut Vec::new());
}

/// A control group that gives half a core.
struct HalfCore(PathBuf);

impl HalfCore {
    fn new(number: usize) -> io::Result<Self> {
        let name = format!("metachron-{}-{number}", std::process::id());
        let root = Path::new("/sys/fs/cgroup");
        let (group, file, half) = match root.join("cgroup.controllers").exists() {
            true => (root.join(name), "cpu.max", "50000 100000"),
            false => (root.join("cpu").join(name), "cpu.cfs_quota_us", "50000"),
        };
        fs::create_dir(&group)?;
        let group = Self(group);
        fs::write(group.0.join(file), half)?;
        Ok(group)
    }

    fn hold(&self, process: &Child) -> io::Result<()> {
        fs::write(self.0.join("cgroup.procs"), process.id().to_string())
    }
}

impl Drop for HalfCore {
    fn drop(&mut self) {
        let _ = fs::remove_dir(&self.0);
    }
}

struct HostProcess {
    process: Child,
    endpoint: String,
}

impl HostProcess {
    fn start() -> Self {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let endpoint = format!("tcp/127.0.0.1:{port}");
        let mut process = Command::new(env::current_exe().unwrap());
        process.args(["--exact", "a_host_of_the_measurement"]).env(SERVES, &endpoint);
        let process = process.stdin(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
        Self { process, endpoint }
    }

    fn connect(&self) -> Arc<dyn WorldCalls> {
        for _ in 0..600 {
            match connect(&self.endpoint) {
                Ok(world) => return Arc::new(world),
                Err(_) => std::thread::sleep(Duration::from_millis(100)),
            }
        }
        panic!("no world at {}", self.endpoint)
    }
}

impl Drop for HostProcess {
    fn drop(&mut self) {
        drop(self.process.stdin.take());
        let _ = self.process.wait();
    }
}

/// How it went.
struct Measured {
    turns_per_s: f64,
    hash: u64,
}

impl Measured {
    /// Half a second, in which objects are placed, and then two that are measured.
    fn of(world: &dyn WorldCalls) -> Self {
        world.advance(SimSpan::from_millis(500)).unwrap();
        let begun = Instant::now();
        world.advance(SimSpan::from_millis(2000)).unwrap();
        let turns_per_s = count() as f64 * 60.0 * 2.0 / begun.elapsed().as_secs_f64();
        Self { turns_per_s, hash: world.hash().unwrap() }
    }
}

/// On so many hosts, of half a core each where they are `held`.
fn measured(hosts: usize, held: bool) -> io::Result<Measured> {
    let groups = (0..hosts).filter(|_| held).map(HalfCore::new).collect::<io::Result<Vec<_>>>()?;
    let processes: Vec<_> = (0..hosts).map(|_| HostProcess::start()).collect();
    // they begin with all that the machine has
    let worlds: Vec<_> = processes.iter().map(HostProcess::connect).collect();
    for (group, host) in groups.iter().zip(&processes) {
        group.hold(&host.process)?;
    }
    let host = |(number, world)| PlacedHost { name: format!("host{number}"), world };
    let placed = PlacedWorld::start(&scene(), worlds.into_iter().enumerate().map(host).collect()).unwrap();
    let measured = Measured::of(&placed);
    for load in placed.loads() {
        println!("  {}: {} agents, CPU {:.2?}, waited {:.2?}", load.name, load.objects, load.cpu, load.waited);
    }
    drop(placed);
    drop(processes);
    Ok(measured)
}

#[test]
fn four_hosts_of_half_a_core_make_the_turns_of_nearly_four() {
    if env::var(SERVES).is_ok() {
        return;
    }
    let (whole, alone) = (Measured::of(&world()), measured(1, false).unwrap());
    let share = alone.turns_per_s / whole.turns_per_s;
    println!(
        "{} agents: {:.0} turns/s in one process, {share:.2} of that on a host of its own",
        count(),
        whole.turns_per_s
    );
    assert_eq!(alone.hash, whole.hash);
    let (one, four) = match (measured(1, true), measured(4, true)) {
        (Ok(one), Ok(four)) => (one, four),
        (Err(why), _) | (_, Err(why)) => return println!("not measured: no control group gives half a core: {why}"),
    };
    let times = four.turns_per_s / one.turns_per_s;
    println!("{:.0} turns/s on one host of half a core, {times:.2} times that on four", one.turns_per_s);
    assert_eq!([one.hash, four.hash], [whole.hash; 2]);
    assert!(times > 1.5, "{times}");
}
