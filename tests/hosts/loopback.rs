//! Two ends over loopback: a world here and the same world as it is called from elsewhere.

use glam::DVec3;
use metachron::contact::{Agent, OwnSteps, StepContext, Stepping};
use metachron::core::{Anchor, Archive, ArchiveError, Body, SimSpan, SimTime, Snapshot, StepError, StepReport};
use metachron::geometry::Solid;
use metachron::hosts::{Calling, Host, HostsError, RemoteWorld, SceneFiles, Serving, connect, serve};
use metachron::runtime::{Command, TimelineCommand};
use metachron::scene::{Source, load};
use metachron::world::kinds::ExecutorKind;
use metachron::world::{
    Custom, EventFilter, GhostWorld, Happening, Pace, PlacedHost, PlacedWorld, Rigid, Scene, SceneText, Tube, World,
    WorldCalls, WorldError,
};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::{Duration, Instant};

const SOON: Duration = Duration::from_secs(5);

fn scene() -> Scene {
    let ball = Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.5]);
    let tube = Tube::along(&[[-0.2, 1.0, 0.3], [0.2, 1.0, 0.3]]).radius_m(0.01).segments(4);
    Scene::builder().fixed("floor", Solid::Plane).add("ball", ball).add("tube", tube).build().unwrap()
}

fn free_endpoint() -> String {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    format!("tcp/127.0.0.1:{port}")
}

/// A world here, its host, and the same world as it is seen elsewhere.
fn two_ends(executor: ExecutorKind) -> (World, Host, RemoteWorld) {
    let (here, endpoint) = (World::start(&scene(), executor).unwrap(), free_endpoint());
    let host = serve(Arc::new(here.clone()), Serving::new("bench", &endpoint)).unwrap();
    let elsewhere = connect(Calling::at(&endpoint).scene(scene().mark())).unwrap();
    (here, host, elsewhere)
}

/// A world in lockstep at the free pace: one that hosts step together has its states.
fn in_lockstep(scene: &Scene) -> World {
    let world = World::start(scene, ExecutorKind::Lockstep).unwrap();
    world.set_pace(Pace::Free).unwrap();
    world
}

/// Two hosts of worlds of a scene, with their endpoints.
fn two_hosts(scene: &Scene) -> [(Host, String); 2] {
    [free_endpoint(), free_endpoint()]
        .map(|endpoint| (serve(Arc::new(in_lockstep(scene)), Serving::new("bench", &endpoint)).unwrap(), endpoint))
}

fn until(mut holds: impl FnMut() -> bool, what: &str) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < SOON, "{what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn bits(body: &Body) -> String {
    format!("{body:?}")
}

#[test]
fn a_state_elsewhere_is_the_state_here_at_the_same_step() {
    let (here, _host, elsewhere) = two_ends(ExecutorKind::Lockstep);
    for _ in 0..10 {
        elsewhere.advance(SimSpan::from_millis(30)).unwrap();
        assert_eq!(elsewhere.time(), here.time());
        for name in ["ball", "tube"] {
            let seen = elsewhere.latest(elsewhere.object(name).unwrap()).unwrap();
            let is = here.latest(here.object(name).unwrap()).unwrap();
            assert_eq!((seen.steps, bits(&seen.body)), (is.steps, bits(&is.body)), "{name}");
        }
        assert_eq!(elsewhere.hash().unwrap(), here.hash());
    }
    assert_eq!(here.time(), SimTime::from_nanos(300_000_000));
}

#[test]
fn a_caller_that_looks_sees_rounded_states_which_follow_what_joins_and_is_put_back() {
    let (here, endpoint) = (World::start(&scene(), ExecutorKind::Lockstep).unwrap(), free_endpoint());
    let _host = serve(Arc::new(here.clone()), Serving::new("bench", &endpoint)).unwrap();
    let elsewhere = connect(Calling::at(&endpoint).looking()).unwrap();
    let mark = here.checkpoint().unwrap();
    let mut ghosts = GhostWorld::of(&scene()).unwrap();
    for turn in 0..12 {
        match turn {
            4 => drop(elsewhere.add("second", Rigid::ball(0.05).mass_kg(0.2).at([1.0, 0.0, 0.5]).into()).unwrap()),
            8 => elsewhere.restore(&mark).unwrap(),
            _ => elsewhere.advance(SimSpan::from_millis(30)).unwrap(),
        }
        assert_eq!((elsewhere.time(), elsewhere.all_objects().len()), (here.time(), here.all_objects().count()));
        for object in here.all_objects() {
            let (seen, is) =
                (elsewhere.latest(elsewhere.object_of(object.id()).unwrap()).unwrap(), here.latest(object).unwrap());
            let probe = |body: &Body, at: f64| body.probe(at).unwrap().0;
            // half of 2⁻¹⁷ m along each axis
            assert!([0.0, 1.0].iter().all(|at| probe(&seen.body, *at).distance(probe(&is.body, *at)) < 7e-6));
            assert_eq!(seen.steps, is.steps);
        }
        ghosts.follow(&elsewhere).unwrap();
    }
    assert_eq!((elsewhere.refused(), elsewhere.is_silent()), (0, false));
}

#[test]
fn sixty_frames_a_second_of_the_cavity_are_less_than_a_megabyte_to_look_at() {
    metachron::scenes::provide();
    let scene = load(&Source::open("cavity").unwrap(), &[]).unwrap();
    let (here, endpoint) = (World::start(&scene, ExecutorKind::Lockstep).unwrap(), free_endpoint());
    let host = serve(Arc::new(here), Serving::new("bench", &endpoint)).unwrap();
    let frame = SimSpan::from_nanos(16_666_667);
    // a caller that drives would be sent whole states: both are counted by themselves
    let bytes = |calling: Calling| {
        let elsewhere = connect(calling).unwrap();
        elsewhere.advance(frame).unwrap();
        let before = host.sent();
        (0..30).for_each(|_| elsewhere.advance(frame).unwrap());
        2 * (host.sent() - before)
    };
    let (looked_at, whole) = (bytes(Calling::at(&endpoint).looking()), bytes(Calling::at(&endpoint)));
    println!("cavity at 60 Hz: {looked_at} bytes a second to look at, {whole} whole");
    assert!(looked_at <= 1_000_000 && looked_at < whole, "{looked_at} of {whole}");
}

#[test]
fn a_scene_that_no_caller_could_be_sent_is_refused_at_the_start() {
    let world = World::start(&scene(), ExecutorKind::Lockstep).unwrap();
    let files = [("small.obj".to_owned(), vec![1]), ("large.obj".to_owned(), vec![0; 17 << 20])].into();
    let serving = Serving::new("bench", free_endpoint()).scene(SceneFiles { files, ..SceneFiles::default() });
    let refused = serve(Arc::new(world), serving).unwrap_err();
    assert!(matches!(&refused, HostsError::LongScene { longest, .. } if longest == "large.obj"), "{refused}");
}

#[test]
fn a_command_from_elsewhere_acts_as_here() {
    let (here, _host, elsewhere) = two_ends(ExecutorKind::Lockstep);
    let (alone, span) = (World::start(&scene(), ExecutorKind::Lockstep).unwrap(), SimSpan::from_millis(100));
    let push = Command::force(Anchor::Local(DVec3::ZERO), DVec3::X * 3.0).key(1).for_ms(50);
    elsewhere.command(elsewhere.object("ball").unwrap(), push).unwrap();
    elsewhere.advance(span).unwrap();
    alone.command(alone.object("ball").unwrap(), push).unwrap();
    alone.advance_while(span, || true);
    assert_eq!(here.hash(), alone.hash());
    let (position, _) = here.latest(here.object("ball").unwrap()).unwrap().body.probe(0.0).unwrap();
    assert!(position.x > 0.01, "{position}");
}

#[test]
fn a_refusal_comes_back_as_the_error_that_it_is_here() {
    let (here, _host, elsewhere) = two_ends(ExecutorKind::Lockstep);
    let commands = [
        ("ball", Command::force(Anchor::Arc(0.1), DVec3::X)),
        ("ball", Command::force(Anchor::Local(DVec3::ZERO), DVec3::X * f64::NAN)),
        ("ball", Command::force(Anchor::Local(DVec3::ZERO), DVec3::X).key(99)),
        ("ball", Command::pressure(1e3)),
        ("tube", Command::carve(DVec3::ZERO, DVec3::X, 0.1)),
    ];
    for (name, command) in commands {
        let there = elsewhere.command(elsewhere.object(name).unwrap(), command).unwrap_err();
        let is = here.command(here.object(name).unwrap(), command).unwrap_err();
        assert_eq!(format!("{there:?}\n{there}"), format!("{is:?}\n{is}"));
    }
    let (there, is) = (elsewhere.object("bal").unwrap_err(), here.object("bal").unwrap_err());
    assert_eq!(format!("{there:?}"), format!("{is:?}"));
    let foreign = elsewhere.command(here.object("ball").unwrap(), Command::wake());
    assert!(matches!(foreign, Err(WorldError::Foreign)));
    let same = elsewhere.add("ball", Rigid::ball(0.1).into());
    assert!(matches!(same, Err(WorldError::SameName { name }) if name == "ball"));
    let bad = elsewhere.add("bad", Rigid::ball(-0.1).into()).unwrap_err();
    assert_eq!(bad.to_string(), here.add("bad", Rigid::ball(-0.1)).unwrap_err().to_string());
    here.stop();
    assert!(matches!(elsewhere.command(elsewhere.object("ball").unwrap(), Command::wake()), Err(WorldError::Stopped)));
}

#[test]
fn an_object_is_added_and_removed_from_elsewhere() {
    let (here, _host, elsewhere) = two_ends(ExecutorKind::Lockstep);
    let second = elsewhere.add("second", Rigid::ball(0.05).mass_kg(0.2).at([1.0, 0.0, 0.5]).into()).unwrap();
    assert_eq!(here.object("second").unwrap().id(), second.id());
    assert!(elsewhere.latest(second).is_ok() && elsewhere.object("second").unwrap() == second);
    elsewhere.advance(SimSpan::from_millis(40)).unwrap();
    assert!(elsewhere.latest(second).unwrap().steps > 0);
    assert!(elsewhere.part(second).unwrap().is_some());
    assert!(elsewhere.part(elsewhere.object("ball").unwrap()).unwrap().is_none(), "it is of the scene");
    elsewhere.remove(second).unwrap();
    elsewhere.advance(SimSpan::from_millis(40)).unwrap();
    assert!(matches!(elsewhere.latest(second), Err(WorldError::Gone { name }) if name == "second"));
    assert!(matches!(elsewhere.command(second, Command::wake()), Err(WorldError::Gone { name }) if name == "second"));
    assert_eq!(elsewhere.all_objects().len(), 2);
}

#[test]
fn a_checkpoint_from_elsewhere_goes_on_to_the_bit() {
    let (here, _host, elsewhere) = two_ends(ExecutorKind::Lockstep);
    elsewhere.advance(SimSpan::from_millis(100)).unwrap();
    let mark = elsewhere.checkpoint().unwrap();
    assert_eq!(mark, here.checkpoint().unwrap());
    elsewhere.advance(SimSpan::from_millis(100)).unwrap();
    let end = here.hash();
    elsewhere.restore(&mark).unwrap();
    assert_eq!(elsewhere.time(), mark.time());
    elsewhere.advance(SimSpan::from_millis(100)).unwrap();
    assert_eq!(here.hash(), end);
}

#[test]
fn ghosts_have_the_states_of_the_world_and_what_joined_it() {
    let (here, _host, elsewhere) = two_ends(ExecutorKind::Lockstep);
    let mut ghosts = GhostWorld::of(&scene()).unwrap();
    elsewhere.advance(SimSpan::from_millis(60)).unwrap();
    elsewhere.add("second", Rigid::ball(0.05).mass_kg(0.2).at([1.0, 0.0, 0.5]).into()).unwrap();
    ghosts.follow(&elsewhere).unwrap();
    let shown = ghosts.world();
    assert_eq!((shown.hash(), shown.time(), shown.all_objects().count()), (here.hash(), here.time(), 3));
    assert!(elsewhere.answers().is_ok() && shown.object("second").is_ok());
}

#[test]
fn the_scene_of_a_world_is_read_elsewhere_without_its_folder() {
    let (world, endpoint) = (World::start(&scene(), ExecutorKind::Lockstep).unwrap(), free_endpoint());
    let scene = SceneText { text: "format = 1".to_owned(), folder: Some("/secret".to_owned()), ..SceneText::default() };
    let files = SceneFiles { scene, files: [("a.obj".to_owned(), vec![1, 2, 3])].into() };
    let serving = Serving::new("bench", &endpoint).scene(files.clone());
    let _host = serve(Arc::new(world), serving).unwrap();
    let read = connect(&endpoint).unwrap().scene_files().unwrap().unwrap();
    assert_eq!((read.files, read.scene.text, read.scene.folder), (files.files, files.scene.text, None));
    let (_here, _host, elsewhere) = two_ends(ExecutorKind::Lockstep);
    assert!(elsewhere.scene_files().unwrap().is_none());
}

#[test]
fn events_are_those_of_the_world() {
    let (here, _host, elsewhere) = two_ends(ExecutorKind::Lockstep);
    let (mut there, mut is) =
        (elsewhere.listen(EventFilter::contacts()), WorldCalls::listen(&here, EventFilter::contacts()));
    elsewhere.advance(SimSpan::from_millis(600)).unwrap();
    let (mut seen, expected) = (Vec::new(), is.take());
    until(
        || {
            seen.extend(there.take());
            seen.len() >= expected.len()
        },
        "events that the world has had",
    );
    let said = |event: &metachron::world::Event| event.to_string();
    assert_eq!(seen.iter().map(said).collect::<Vec<_>>(), expected.iter().map(said).collect::<Vec<_>>());
    assert!(seen.iter().any(|event| matches!(event.what, Happening::Contact(contact) if contact.begins)));
}

#[test]
fn time_that_runs_here_is_seen_and_paused_elsewhere() {
    let (here, host, elsewhere) = two_ends(ExecutorKind::Threads);
    elsewhere.drive(TimelineCommand::Run).unwrap();
    let first = elsewhere.next_frame(SimTime::ZERO, SOON).unwrap();
    let later = elsewhere.next_frame(first.time, SOON).unwrap();
    assert!(later.time > first.time && later.body(elsewhere.object("ball").unwrap()).is_some());
    elsewhere.drive(TimelineCommand::Pause).unwrap();
    let stands = here.time();
    until(|| elsewhere.time() == stands, "the time at which it stands");
    assert_eq!((here.time(), host.callers(), host.refused().total(), elsewhere.refused()), (stands, 1, 0, 0));
}

#[test]
fn another_scene_is_refused_in_one_sentence() {
    let endpoint = free_endpoint();
    let _host =
        serve(Arc::new(World::start(&scene(), ExecutorKind::Lockstep).unwrap()), Serving::new("bench", &endpoint))
            .unwrap();
    let other = Scene::builder().add("box", Rigid::ball(0.1)).build().unwrap();
    let refused = connect(Calling::at(&endpoint).scene(other.mark())).unwrap_err();
    assert!(matches!(refused, HostsError::OtherScene { .. }), "{refused}");
    let absent = connect(&free_endpoint()).unwrap_err();
    assert!(matches!(absent, HostsError::Network { .. } | HostsError::NoWorld { .. }), "{absent}");
    assert!(matches!(connect("tcp/10.0.0.1:7447"), Err(HostsError::NeedsCertificates { .. })));
}

/// A link between a caller and a host.
#[derive(Default)]
struct BadLink {
    /// Whether it carries nothing, while its connections stay open.
    is_silent: AtomicBool,
    /// From the one to the other.
    delay: Duration,
}

impl BadLink {
    /// Carries what comes out of one end into the other.
    fn carry(self: Arc<Self>, mut from: TcpStream, mut to: TcpStream) {
        let (sends, comes) = std::sync::mpsc::channel::<(Instant, Vec<u8>)>();
        let delay = self.delay;
        std::thread::spawn(move || {
            for (sent, bytes) in comes {
                std::thread::sleep((sent + delay).saturating_duration_since(Instant::now()));
                if to.write_all(&bytes).is_err() {
                    return;
                }
            }
        });
        let mut bytes = [0; 65536];
        while let Ok(count @ 1..) = from.read(&mut bytes) {
            if !self.is_silent.load(Relaxed) && sends.send((Instant::now(), bytes[..count].to_vec())).is_err() {
                return;
            }
        }
    }

    /// The endpoint of `host` over it.
    fn to(self: &Arc<Self>, host: &str) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (host, port) = (host.trim_start_matches("tcp/").to_owned(), listener.local_addr().unwrap().port());
        let link = Arc::clone(self);
        std::thread::spawn(move || {
            for caller in listener.incoming().map_while(Result::ok) {
                let Ok(served) = TcpStream::connect(&host) else { return };
                for (from, to) in [(caller.try_clone().unwrap(), served.try_clone().unwrap()), (served, caller)] {
                    let link = Arc::clone(&link);
                    std::thread::spawn(move || link.carry(from, to));
                }
            }
        });
        format!("tcp/127.0.0.1:{port}")
    }
}

#[test]
fn two_hosts_over_links_of_20_ms_have_the_bits_of_one_process() {
    let ball = |scene: metachron::world::SceneBuilder, number: i32| {
        let (x, towards) = (0.5 * f64::from(number), 1.0 - 2.0 * f64::from(number % 2));
        let ball = Rigid::ball(0.05).mass_kg(0.2).at([x, 0.0, 0.06]).velocity_m_s([towards, 0.0, 0.0]);
        scene.add(format!("ball {number}"), ball)
    };
    let scene = (0..6).fold(Scene::builder().fixed("floor", Solid::Plane), ball).build().unwrap();
    let link = Arc::new(BadLink { delay: Duration::from_millis(20), ..BadLink::default() });
    let served = two_hosts(&scene);
    let host = |(_, endpoint): &(Host, String)| {
        let world = Arc::new(connect(&link.to(endpoint)).unwrap());
        PlacedHost { name: endpoint.clone(), world }
    };
    let placed = PlacedWorld::start(&scene, served.iter().map(host).collect()).unwrap();
    let (whole, half) = (in_lockstep(&scene), SimSpan::from_millis(500));
    for _ in 0..2 {
        let begun = Instant::now();
        placed.advance(half).unwrap();
        whole.advance(half);
        assert_eq!(placed.hash().unwrap(), whole.hash(), "{:?}", placed.loads());
        // a call and its answer are 40 ms: no window takes less
        assert!(begun.elapsed() >= 30 * 2 * link.delay, "{:?}", begun.elapsed());
    }
    assert!(placed.loads().iter().all(|load| load.objects > 0), "{:?}", placed.loads());
}

/// An agent that touches nothing, with so many numbers of its own.
struct Ballast(Vec<f64>);

impl Agent for Ballast {
    fn model(&self) -> &'static str {
        "ballast"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Own(self)
    }

    fn write_snapshot(&self, _into: &mut Snapshot) {}

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.value(&mut self.0)
    }
}

impl OwnSteps for Ballast {
    fn step(&mut self, _dt: SimSpan, _context: &StepContext<'_>) -> Result<StepReport, StepError> {
        Ok(StepReport { work: 1.0, substeps: 1, at_rest: false })
    }
}

#[test]
fn objects_that_fill_more_than_a_message_change_hosts() {
    // small ones first: by them the bytes of a pack are reckoned
    let add = |scene: metachron::world::SceneBuilder, number: usize| {
        let numbers = if number < 300 { 1 } else { 40_000 };
        let ballast = Custom::made_by(move |_| Box::new(Ballast(vec![1.0; numbers])));
        scene.add(format!("ballast {number}"), ballast.rate_hz(60.0))
    };
    let scene = (0..420).fold(Scene::builder(), add).build().unwrap();
    let served = two_hosts(&scene);
    let host = |(_, endpoint): &(Host, String)| PlacedHost {
        name: endpoint.clone(),
        world: Arc::new(connect(endpoint).unwrap()),
    };
    let placed = PlacedWorld::start(&scene, served.iter().map(host).collect()).unwrap();
    let whole = in_lockstep(&scene);
    placed.advance(SimSpan::from_millis(100)).unwrap();
    whole.advance(SimSpan::from_millis(100));
    assert_eq!(placed.hash().unwrap(), whole.hash(), "{:?}", placed.loads());
    assert!(placed.loads().iter().all(|load| load.lost.is_none() && load.objects > 100), "{:?}", placed.loads());
}

#[test]
fn a_caller_that_joins_late_sees_no_state_from_before_its_call() {
    let (here, endpoint) = (World::start(&scene(), ExecutorKind::Threads).unwrap(), free_endpoint());
    let _host = serve(Arc::new(here.clone()), Serving::new("bench", &endpoint)).unwrap();
    WorldCalls::drive(&here, TimelineCommand::Run).unwrap();
    let runs = std::env::var("METACHRON_RUNS").map_or(20, |runs| runs.parse().unwrap());
    let mut longest = Duration::ZERO;
    for _ in 0..runs {
        let (begun, before) = (Instant::now(), here.time());
        let late = connect(&endpoint).unwrap();
        assert!(late.time() >= before, "{:?} {before:?}", late.time());
        longest = longest.max(begun.elapsed());
    }
    println!("{runs} late callers: each sees all within {longest:?}");
}

#[test]
fn a_host_that_goes_silent_is_noticed_and_may_come_back() {
    let (here, endpoint) = (World::start(&scene(), ExecutorKind::Threads).unwrap(), free_endpoint());
    let host = serve(Arc::new(here), Serving::new("bench", &endpoint)).unwrap();
    let link = Arc::new(BadLink::default());
    let elsewhere = connect(&link.to(&endpoint)).unwrap();
    let ball = elsewhere.object("ball").unwrap();
    until(|| elsewhere.command(ball, Command::wake()).is_ok(), "a host that answers");
    link.is_silent.store(true, Relaxed);
    let begun = Instant::now();
    until(|| elsewhere.is_silent(), "a silent host that is noticed");
    // the lease is 1 s
    assert!(begun.elapsed() < Duration::from_millis(1500), "{:?}", begun.elapsed());
    let refused = elsewhere.command(ball, Command::wake());
    assert!(matches!(refused, Err(WorldError::Silent { world, .. }) if world == "bench"));
    assert!(elsewhere.latest(ball).is_ok(), "it stays as it was last seen");
    link.is_silent.store(false, Relaxed);
    let begun = Instant::now();
    while elsewhere.command(ball, Command::wake()).is_err() {
        assert!(begun.elapsed() < Duration::from_secs(15), "a host that lives again");
        std::thread::sleep(Duration::from_millis(20));
    }
    drop(host);
    until(|| elsewhere.is_silent(), "a host that ended");
}
