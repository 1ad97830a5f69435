//! Two hosts, one of them behind a link that delays and loses packets, or that is cut for a while: each tenth of a second the bits of one process.
//!
//! The link is two devices of the kernel, each in a network of its own, and threads between them. Where the kernel refuses these, the tests say
//! so on standard error and measure nothing.
#![cfg(target_os = "linux")]

use glam::{DQuat, DVec3};
use metachron_core::SimSpan;
use metachron_geometry::{Obstacle, Solid};
use metachron_hosts::{Calling, Serving, connect, serve};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Pace, PlacedHost, PlacedWorld, Rigid, Scene, SceneBuilder, World, WorldCalls};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, OnceLock, mpsc};
use std::time::{Duration, Instant};
use std::{env, io, thread};
use tun_rs::{DeviceBuilder, SyncDevice};

/// What a process of this program does, where it is not the test itself.
const DOES: &str = "METACHRON_DOES";
/// Seconds of the scene over each link; 10 in `docs/numbers.md`.
const SECONDS: &str = "METACHRON_SECONDS";
/// How often the link is cut; 100 in `docs/numbers.md`.
const CUTS: &str = "METACHRON_CUTS";
/// What the caller says once the scene is placed.
const BEGUN: &str = "begun";

const NEAR: &str = "tcp/127.0.0.1:7447";
const FAR: &str = "tcp/10.213.0.2:7447";
const ADDRESSES: [&str; 2] = ["10.213.0.1/24", "10.213.0.2/24"];
const TENTH: SimSpan = SimSpan::from_millis(100);

fn number(name: &str, default: u64) -> u64 {
    env::var(name).map_or(default, |value| value.parse().unwrap())
}

/// Sixteen elastic balls in a pen: they never rest, and each meets all others.
fn pen() -> Scene {
    let wall = |scene: SceneBuilder, side: u32| {
        let turn = DQuat::from_rotation_z(f64::from(side) * std::f64::consts::FRAC_PI_2);
        let plane = Obstacle::new(format!("wall {side}"), Solid::Plane);
        let rotation = turn * DQuat::from_rotation_arc(DVec3::Z, DVec3::X);
        scene.obstacle(Obstacle { position: turn * -DVec3::X, rotation, friction: 0.0, restitution: 1.0, ..plane })
    };
    let ball = |scene: SceneBuilder, number: u32| {
        let (x, y) = (0.4 * f64::from(number % 4) - 0.6, 0.4 * f64::from(number / 4) - 0.6);
        let towards = [0.9 - 0.3 * f64::from(number % 5), 0.8 - 0.5 * f64::from(number % 3), 0.0];
        let ball = Rigid::ball(0.05).mass_kg(0.2).at([x, y, 0.05]).velocity_m_s(towards).friction(0.0).restitution(1.0);
        scene.add(format!("ball {number}"), ball.rate_hz([60.0, 120.0][number as usize % 2]))
    };
    let walls = (0..4).fold(Scene::builder().fixed("floor", Solid::Plane), wall);
    (0..16).fold(walls, ball).build().unwrap()
}

fn world() -> World {
    let world = World::start(&pen(), ExecutorKind::Lockstep).unwrap();
    world.set_pace(Pace::Free).unwrap();
    world
}

fn placed() -> PlacedWorld {
    let host = |(name, endpoint): (&str, &str)| {
        let begun = Instant::now();
        let world = loop {
            match connect(Calling::at(endpoint).insecure_lan()) {
                Ok(world) => break Arc::new(world),
                Err(why) => assert!(begun.elapsed() < Duration::from_secs(30), "{why}"),
            }
            thread::sleep(Duration::from_millis(100));
        };
        PlacedHost { name: name.to_owned(), world }
    };
    PlacedWorld::start(&pen(), [("near", NEAR), ("far", FAR)].map(host).into()).unwrap()
}

/// What processes in the two networks do: serve a world, play the scene for so long, or beside the clock until standard input ends.
#[test]
fn a_process_of_these_tests() {
    let Ok(does) = env::var(DOES) else { return };
    match does.as_str() {
        "near" | "far" => {
            let serving = Serving::new(&*does, if does == "near" { NEAR } else { FAR }).insecure_lan();
            let _host = serve(Arc::new(world()), serving).unwrap();
            let _ = io::stdin().read_to_end(&mut Vec::new());
        }
        "play" => play(),
        _ => play_beside_the_clock(),
    }
}

fn play() {
    let (placed, whole, begun) = (placed(), world(), Instant::now());
    let (mut tenths, mut held, least) = (0, 0, 10 * number(SECONDS, 1));
    // a host that was taken for lost has its time to come back
    while tenths < least || held == 0 && tenths < least + 300 {
        tenths += 1;
        placed.advance(TENTH).unwrap();
        whole.advance(TENTH);
        assert_eq!(placed.hash().unwrap(), whole.hash(), "after {tenths} tenths: {:?}", placed.loads());
        held += u64::from(placed.loads()[1].objects > 0);
    }
    let loads = placed.loads();
    println!(
        "{:.1} s, {} objects changed hosts, {} were reborn; the far host had some in {held} of {tenths} tenths",
        begun.elapsed().as_secs_f64(),
        loads.iter().map(|load| load.moved).sum::<u64>(),
        loads.iter().map(|load| load.reborn).sum::<u64>()
    );
    assert!(held > 0, "{loads:?}");
}

fn play_beside_the_clock() {
    let (placed, whole, begun) = (placed(), world(), Instant::now());
    println!("{BEGUN}");
    let ended = Arc::new(OnceLock::new());
    let end = Arc::clone(&ended);
    thread::spawn(move || {
        let _ = io::stdin().read_to_end(&mut Vec::new());
        end.set(Instant::now()).unwrap();
    });
    // how often the far host was lost, came back, and had objects again
    let (mut lost, mut back, mut again) = (0, 0, 0);
    let (mut is_lost, mut is_idle) = (false, false);
    while ended.get().is_none() || is_lost || is_idle {
        placed.advance(TENTH).unwrap();
        whole.advance(TENTH);
        let far = placed.loads().swap_remove(1);
        assert_eq!(placed.hash().unwrap(), whole.hash(), "lost {lost} times, back {back}: {far:?}");
        let was_lost = std::mem::replace(&mut is_lost, far.lost.is_some());
        lost += u64::from(is_lost && !was_lost);
        back += u64::from(was_lost && !is_lost);
        is_idle |= is_lost;
        if is_idle && far.objects > 0 && !is_lost {
            (is_idle, again) = (false, again + 1);
        }
        let late = ended.get().map_or(Duration::ZERO, Instant::elapsed);
        assert!(late < Duration::from_secs(30), "lost {lost} times, back {back}, objects again {again}: {far:?}");
        let time = Duration::from_nanos(whole.time().as_nanos());
        thread::sleep(time.saturating_sub(begun.elapsed()));
    }
    println!("the far host was lost {lost} times, came back {back} times and had objects again {again} times");
    assert!(lost >= number(CUTS, 1) && back == lost, "{:?}", placed.loads());
}

/// What the link does to packets.
#[derive(Default)]
struct Faults {
    delay_ms: AtomicU64,
    lost_percent: AtomicU64,
    is_cut: AtomicBool,
}

/// Two networks with a link between them.
struct Link {
    networks: [String; 2],
    faults: Arc<Faults>,
}

fn ip(arguments: &str) -> io::Result<()> {
    let output = Command::new("ip").args(arguments.split(' ')).output()?;
    if output.status.success() {
        Ok(())
    } else {
        Err(io::Error::other(String::from_utf8_lossy(&output.stderr).into_owned()))
    }
}

/// Whether a packet is lost, by its number (SplitMix64).
fn is_lost(number: u64, percent: u64) -> bool {
    let mut bits = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (bits ^ (bits >> 31)) % 100 < percent
}

/// Takes packets from one device to another.
fn carry(from: &Arc<SyncDevice>, to: &Arc<SyncDevice>, faults: &Arc<Faults>) {
    let (send, sent) = mpsc::channel::<(Instant, Vec<u8>)>();
    let (from, to, faults) = (Arc::clone(from), Arc::clone(to), Arc::clone(faults));
    thread::spawn(move || {
        let mut packet = vec![0; 1 << 16];
        for count in 0_u64.. {
            let Ok(bytes) = from.recv(&mut packet) else { return };
            if faults.is_cut.load(Relaxed) || is_lost(count, faults.lost_percent.load(Relaxed)) {
                continue;
            }
            let due = Instant::now() + Duration::from_millis(faults.delay_ms.load(Relaxed));
            let _ = send.send((due, packet[..bytes].to_vec()));
        }
    });
    thread::spawn(move || {
        for (due, packet) in sent {
            thread::sleep(due.saturating_duration_since(Instant::now()));
            let _ = to.send(&packet);
        }
    });
}

impl Link {
    fn new(name: &str) -> io::Result<Self> {
        let id = std::process::id();
        let link = Self { networks: ["a", "b"].map(|end| format!("mc{id}{name}{end}")), faults: Arc::default() };
        let mut ends = Vec::new();
        for (network, address) in link.networks.iter().zip(ADDRESSES) {
            ip(&format!("netns add {network}"))?;
            ends.push(Arc::new(DeviceBuilder::new().name(network).build_sync()?));
            ip(&format!("link set {network} netns {network}"))?;
            ip(&format!("-n {network} addr add {address} dev {network}"))?;
            ip(&format!("-n {network} link set {network} up"))?;
            ip(&format!("-n {network} link set lo up"))?;
        }
        carry(&ends[0], &ends[1], &link.faults);
        carry(&ends[1], &ends[0], &link.faults);
        Ok(link)
    }

    /// A process of this program at one end, which ends with its standard input or by itself.
    fn process(&self, end: usize, does: &str) -> Process {
        let mut process = Command::new("ip");
        process.args(["netns", "exec", &self.networks[end]]).arg(env::current_exe().unwrap());
        process.args(["--exact", "a_process_of_these_tests", "--nocapture"]).env(DOES, does);
        let mut process = process.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let says = BufReader::new(process.stdout.take().unwrap());
        Process { process, says }
    }

    fn hosts(&self) -> [Process; 2] {
        [self.process(0, "near"), self.process(1, "far")]
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.networks.iter().for_each(|network| drop(ip(&format!("netns del {network}"))));
    }
}

struct Process {
    process: Child,
    says: BufReader<ChildStdout>,
}

impl Process {
    /// Waits until it says this.
    fn says(&mut self, word: &str) {
        assert!(self.says.by_ref().lines().any(|line| line.unwrap() == word), "it has ended");
    }

    /// What it says at its end.
    fn end(&mut self) -> String {
        drop(self.process.stdin.take());
        let mut said = String::new();
        self.says.read_to_string(&mut said).unwrap();
        assert!(self.process.wait().unwrap().success(), "{said}");
        said.lines().filter(|line| line.contains("the far host")).collect()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The link; none where the kernel makes no network here, which standard error is told.
fn link(name: &str) -> Option<Link> {
    // what a passing test prints is not seen
    let refused = |why: &io::Error| {
        let line = format!("not measured, as there is no network of its own here: {why}\n");
        io::stderr().write_all(line.as_bytes()).unwrap();
    };
    Link::new(name).inspect_err(refused).ok()
}

#[test]
fn delays_and_losses_change_no_bit() {
    let Some(link) = link("l") else { return };
    for delay_ms in [0, 20, 50] {
        for lost_percent in [0, 2, 10] {
            link.faults.delay_ms.store(delay_ms, Relaxed);
            link.faults.lost_percent.store(lost_percent, Relaxed);
            let _hosts = link.hosts();
            println!("{delay_ms} ms each way, {lost_percent} % lost: {}", link.process(0, "play").end());
        }
    }
}

#[test]
fn a_link_that_is_cut_for_12_s_changes_no_bit_and_the_host_comes_back() {
    let Some(link) = link("c") else { return };
    let _hosts = link.hosts();
    let mut caller = link.process(0, "beside the clock");
    caller.says(BEGUN);
    for _ in 0..number(CUTS, 1) {
        for (is_cut, seconds) in [(false, 6), (true, 12)] {
            link.faults.is_cut.store(is_cut, Relaxed);
            thread::sleep(Duration::from_secs(seconds));
        }
    }
    link.faults.is_cut.store(false, Relaxed);
    thread::sleep(Duration::from_secs(6));
    println!("{}", caller.end());
}
