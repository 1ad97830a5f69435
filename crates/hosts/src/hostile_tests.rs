//! Bytes and numbers that no program of ours sends, at both ends: each is refused and counted, and what is good goes on.

use crate::endpoint::{LEASE, Place, Side, open};
use crate::gate::{CALLS_MAX, SESSIONS_MAX};
use crate::mirror::Mirror;
use crate::wire::{Call, MESSAGE_MAX, Moment, ObjectState, PROGRAM, Reply, Request, VERSION, Welcome, decode, encode};
use crate::{Host, Serving, connect, serve};
use glam::{DQuat, DVec3};
use metachron_core::{AgentId, Anchor, Body, CurveState, RigidState, SimSpan, SimTime, Snapshot};
use metachron_runtime::{Command, TimelineCommand};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Rigid, Scene, World, WorldCalls};
use std::net::TcpListener;
use std::sync::Arc;
use std::time::{Duration, Instant};
use zenoh::liveliness::LivelinessToken;
use zenoh::{Session, Wait};

pub(crate) fn scene() -> Scene {
    Scene::builder().add("ball", Rigid::ball(0.05).mass_kg(0.2)).build().unwrap()
}

fn serve_one() -> (World, Host, String) {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let (world, endpoint) = (World::start(&scene(), ExecutorKind::Lockstep).unwrap(), format!("tcp/127.0.0.1:{port}"));
    let host = serve(Arc::new(world.clone()), Serving::new("bench", &endpoint)).unwrap();
    (world, host, endpoint)
}

/// A sign of life, as callers show it.
fn life(session: &Session, caller: &str) -> LivelinessToken {
    session.liveliness().declare_token(format!("metachron/caller/anyone/{caller}")).wait().unwrap()
}

/// A session that is connected with a host.
fn stranger(endpoint: &str) -> Session {
    open(Place { endpoint, identity: None, insecure_lan: false }, Side::Caller).unwrap()
}

/// The answer to bytes that are sent as a call.
fn ask(session: &Session, caller: &str, bytes: Vec<u8>) -> Option<Reply> {
    let answers =
        session.get(format!("metachron/bench/call/anyone/{caller}")).payload(bytes).timeout(Duration::from_secs(5));
    let answer = answers.wait().unwrap().recv().ok()?;
    decode(&answer.result().ok()?.payload().to_bytes()).ok()
}

pub(crate) fn hello(program: &str) -> Call {
    Call::Hello { program: program.to_owned(), is_looking: false }
}

/// How often random bytes are tried: as said by `METACHRON_RUNS`, for once ten million of them, or a usual number.
fn runs(usual: u32) -> u32 {
    std::env::var("METACHRON_RUNS").map_or(usual, |runs| runs.parse().unwrap())
}

/// A sequence of numbers without a pattern (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn bytes(&mut self) -> Vec<u8> {
        let count = self.next() % 300;
        std::iter::once(VERSION).chain((0..count).map(|_| self.next() as u8)).collect()
    }
}

fn mirror() -> Mirror {
    let (world, program, scene) = ("bench".to_owned(), PROGRAM.to_owned(), String::new());
    Mirror::new(Welcome { run: 7, world, program, scene, scene_hash: 0, fixed: vec![] })
}

fn moment(sequence: u64, body: Body) -> Moment {
    let state = Arc::new(Snapshot { body, ..Snapshot::default() });
    let states = vec![ObjectState { id: AgentId(0), name: "ball".into(), state }];
    Moment { run: 7, sequence, states, time: SimTime::from_nanos(sequence), ..Moment::default() }
}

#[test]
fn random_bytes_are_no_message_or_one_that_is_checked() {
    let (mut random, mirror, mut read) = (Random(1), mirror(), 0);
    for _ in 0..runs(200_000) {
        let bytes = random.bytes();
        read += u32::from(decode::<Request>(&bytes).is_ok());
        if let Ok(Reply::Moment(moment)) = decode(&bytes) {
            mirror.take(moment);
        }
    }
    // a byte of the version, two numbers and a call without fields are a request: these are then refused by their numbers
    assert!(read < runs(200_000) / 10 && mirror.all_objects().is_empty(), "{read} were read");
}

#[test]
fn changed_bytes_of_a_message_are_refused_or_read_without_a_panic() {
    let (mut random, mirror) = (Random(2), mirror());
    let good = encode(&Reply::Moment(moment(1, Body::Rigid(RigidState::default())))).unwrap();
    for _ in 0..runs(100_000) {
        let mut bytes = good.clone();
        let at = random.next() as usize % bytes.len();
        bytes[at] = random.next() as u8;
        if let Ok(Reply::Moment(moment)) = decode(&bytes) {
            mirror.take(moment);
        }
    }
    let frame = mirror.frame();
    assert!(frame.states.iter().all(|(_, state)| state.is_finite()) && mirror.refused() > 0);
}

#[test]
fn numbers_that_cannot_be_are_refused_and_counted() {
    let rigid = |change: fn(&mut RigidState)| {
        let mut state = RigidState::default();
        change(&mut state);
        Body::Rigid(state)
    };
    let curve = CurveState { positions: vec![DVec3::ZERO; 3], velocities: vec![DVec3::ZERO], ..CurveState::default() };
    let bad = [
        rigid(|state| state.position.x = f64::NAN),
        rigid(|state| state.velocity.y = f64::INFINITY),
        rigid(|state| state.position.z = 1e300),
        rigid(|state| state.rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0)),
        Body::Curve(curve),
    ];
    let mirror = mirror();
    for (at, body) in bad.into_iter().enumerate() {
        mirror.take(moment(1, body));
        assert_eq!((mirror.refused(), mirror.all_objects().len()), (at as u64 + 1, 0));
    }
    let mut far = moment(1, Body::Nothing);
    far.states[0].id = AgentId(u32::MAX);
    mirror.take(far);
    mirror.take(Moment { run: 8, ..moment(1, Body::Nothing) });
    assert_eq!((mirror.refused(), mirror.all_objects().len()), (7, 0));
    mirror.take(moment(2, rigid(|_| {})));
    // an old one changes nothing
    mirror.take(moment(1, rigid(|state| state.position.x = 1.0)));
    let state = mirror.latest(mirror.object("ball").unwrap()).unwrap();
    assert_eq!((state.body.probe(0.0).unwrap().0, mirror.refused(), mirror.is_stale()), (DVec3::ZERO, 7, true));
}

#[test]
fn a_length_beyond_its_message_asks_for_no_storage() {
    // a checkpoint of 2^63 bytes, and one of no bytes in a message that is too long
    let huge = [VERSION, 3, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f];
    assert!(decode::<Reply>(&huge).is_err());
    assert!(decode::<Reply>(&vec![VERSION; MESSAGE_MAX + 1]).is_err());
    assert!(encode(&Reply::Checkpoint(vec![0; MESSAGE_MAX])).is_err());
    assert!(decode::<Reply>(&[VERSION + 1, 2, 0]).is_err());
}

#[test]
fn a_host_refuses_what_it_cannot_read_and_goes_on() {
    let (world, host, endpoint) = serve_one();
    let stranger = stranger(&endpoint);
    let mut random = Random(3);
    let (mut refused, before) = (0, world.hash());
    for _ in 0..2_000 {
        match ask(&stranger, "stranger", random.bytes()) {
            Some(Reply::Refused(_)) => refused += 1,
            other => panic!("{other:?}"),
        }
    }
    assert_eq!((host.refused().total(), host.callers()), (refused, 0));
    let request = |run, sequence, call| encode(&Request { run, sequence, call }).unwrap();
    let unseen = ask(&stranger, "stranger", request(0, 1, hello(PROGRAM)));
    assert!(matches!(unseen, Some(Reply::Refused(_))), "no sign of life came: {unseen:?}");
    let _life = life(&stranger, "stranger");
    let Some(Reply::Hello(welcome)) = ask(&stranger, "stranger", request(0, 1, hello(PROGRAM))) else {
        panic!("it introduces itself")
    };
    let unlike = ask(&stranger, "other", request(0, 1, hello("0.0.0")));
    let pause = || Call::Drive(TimelineCommand::Pause);
    let old = ask(&stranger, "stranger", request(welcome.run, 1, pause()));
    let elsewhere = ask(&stranger, "stranger", request(welcome.run + 1, 9, pause()));
    let unknown = ask(&stranger, "unknown", request(welcome.run, 1, pause()));
    let long = ask(&stranger, "stranger", request(welcome.run, 2, Call::Advance(SimSpan::from_secs(2))));
    let push = Command::force(Anchor::Local(DVec3::ZERO), DVec3::splat(f64::NAN));
    let push = ask(&stranger, "stranger", request(welcome.run, 3, Call::Command(AgentId(0), push)));
    let absent = ask(&stranger, "stranger", request(welcome.run, 4, Call::Remove(AgentId(9))));
    let file = ask(&stranger, "stranger", request(welcome.run, 5, Call::Restore(vec![1; 99])));
    for answer in [unlike, old, elsewhere, unknown, long, push, absent, file] {
        assert!(matches!(answer, Some(Reply::Refused(_))), "{answer:?}");
    }
    let counted = host.refused();
    assert_eq!((counted.repeated, counted.total()), (2, refused + 5));
    assert!(matches!(ask(&stranger, "stranger", request(welcome.run, 6, pause())), Some(Reply::Done(_))));
    assert_eq!(world.hash(), before);
}

#[test]
fn a_flood_is_refused_while_another_caller_is_served() {
    let (_world, host, endpoint) = serve_one();
    let elsewhere = connect(&endpoint).unwrap();
    let flood = stranger(&endpoint);
    let begun = Instant::now();
    let mut sent = 0;
    while begun.elapsed() < Duration::from_secs(1) || sent < 2 * CALLS_MAX {
        let get = flood.get("metachron/bench/call/anyone/flood").payload(vec![VERSION, 0]).callback(|_| {});
        get.wait().unwrap();
        sent += 1;
        if sent % 5_000 == 0 {
            elsewhere.drive(TimelineCommand::Pause).unwrap();
        }
    }
    elsewhere.advance(SimSpan::from_millis(20)).unwrap();
    assert!(host.refused().total() > 0 && elsewhere.refused() == 0);
}

#[test]
fn what_another_caller_says_in_the_place_of_the_host_reaches_no_other() {
    let (world, _host, endpoint) = serve_one();
    let elsewhere = connect(&endpoint).unwrap();
    let bad = stranger(&endpoint);
    let mut random = Random(4);
    for _ in 0..1_000 {
        bad.put("metachron/bench/state", random.bytes()).wait().unwrap();
    }
    std::thread::sleep(Duration::from_millis(200));
    elsewhere.advance(SimSpan::from_millis(20)).unwrap();
    let (seen, is) = (elsewhere.latest(elsewhere.object("ball").unwrap()), world.latest(world.object("ball").unwrap()));
    assert_eq!((seen.unwrap().steps, elsewhere.refused(), elsewhere.is_silent()), (is.unwrap().steps, 0, false));
}

#[test]
fn callers_that_go_after_their_greeting_leave_their_places_to_others() {
    let (_world, host, endpoint) = serve_one();
    let aborted = stranger(&endpoint);
    for caller in 0..4 * SESSIONS_MAX {
        let greeting = encode(&Request { run: 0, sequence: 1, call: hello(PROGRAM) }).unwrap();
        let life = (caller % 2 == 0).then(|| life(&aborted, &caller.to_string()));
        let answer = ask(&aborted, &caller.to_string(), greeting);
        assert_eq!(matches!(answer, Some(Reply::Hello(_))), life.is_some(), "{answer:?}");
    }
    drop(aborted);
    let there: Vec<_> = (0..SESSIONS_MAX / 8).map(|_| connect(&endpoint).unwrap()).collect();
    assert_eq!(host.callers(), there.len());
}

#[test]
fn an_answer_that_was_lost_is_asked_for_again() {
    let (_world, host, endpoint) = serve_one();
    let session = stranger(&endpoint);
    let _life = life(&session, "again");
    for sequence in 1..4 {
        let greeting = encode(&Request { run: 0, sequence, call: hello(PROGRAM) }).unwrap();
        assert!(matches!(ask(&session, "again", greeting), Some(Reply::Hello(_))));
    }
    assert_eq!((host.callers(), host.refused().total()), (1, 0));
}

#[test]
fn calls_of_others_are_answered_while_one_peer_has_all_waiting_places() {
    let (_world, host, endpoint) = serve_one();
    let calm = connect(&endpoint).unwrap();
    let flood = stranger(&endpoint);
    let _life = life(&flood, "flood");
    let call = |sequence, call| encode(&Request { run: 0, sequence, call }).unwrap();
    let Some(Reply::Hello(Welcome { run, .. })) = ask(&flood, "flood", call(1, hello(PROGRAM))) else {
        panic!("it introduces itself")
    };
    for sequence in 2..2_000 {
        // a call that takes its time, and so leaves the others waiting
        let advance = Request { run, sequence, call: Call::Advance(SimSpan::from_millis(100)) };
        let get = flood.get("metachron/bench/call/anyone/flood").payload(encode(&advance).unwrap()).callback(|_| {});
        get.wait().unwrap();
        if sequence % 100 == 0 {
            calm.drive(TimelineCommand::Pause).unwrap();
        }
    }
    assert!(host.refused().flooded > 0, "the test floods: {:?}", host.refused());
    assert!(host.take_refused().iter().all(|(peer, _)| peer == "anyone/flood"));
}

#[test]
fn a_posted_call_that_is_answered_too_late_is_counted_and_is_the_newest_round_trip() {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let (world, endpoint) = (World::start(&scene(), ExecutorKind::Threads).unwrap(), format!("tcp/127.0.0.1:{port}"));
    let _host = serve(Arc::new(world), Serving::new("bench", &endpoint)).unwrap();
    let (calm, slow) = (connect(&endpoint).unwrap(), stranger(&endpoint));
    // names behind that of the other caller, which is a number in base 16
    let callers = ["x", "y", "z"];
    let _lives = callers.map(|caller| life(&slow, caller));
    let runs = callers.map(|caller| {
        let greeting = encode(&Request { run: 0, sequence: 1, call: hello(PROGRAM) }).unwrap();
        let Some(Reply::Hello(Welcome { run, .. })) = ask(&slow, caller, greeting) else { panic!("it greets") };
        run
    });
    for (caller, run) in callers.into_iter().zip(runs) {
        let advance = Request { run, sequence: 2, call: Call::Advance(SimSpan::from_millis(1000)) };
        let get = slow.get(format!("metachron/bench/call/anyone/{caller}")).payload(encode(&advance).unwrap());
        get.callback(|_| {}).wait().unwrap();
    }
    // each of the three lets a second pass before the turn of the next comes; the first has begun
    while calm.time() == SimTime::ZERO {
        std::thread::yield_now();
    }
    calm.post(calm.object("ball").unwrap(), Command::wake()).unwrap();
    assert_eq!(calm.lost(), 0);
    let begun = Instant::now();
    while calm.lost() == 0 && begun.elapsed() < 5 * LEASE {
        std::thread::yield_now();
    }
    assert!(calm.lost() == 1 && calm.link().unwrap().round_trip >= LEASE, "{:?}", calm.link());
}
