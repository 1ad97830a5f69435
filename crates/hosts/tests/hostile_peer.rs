//! A peer that sends more at once than a message may have: its host's memory does not follow. The only test of its process, whose memory it measures.
#![cfg(target_os = "linux")]

use metachron_hosts::{Serving, connect, serve};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Rigid, Scene, World, WorldCalls};
use std::net::TcpListener;
use std::sync::Arc;
use std::time::Duration;
use zenoh::bytes::ZBytes;
use zenoh::{Config, Wait};

/// A row of `/proc/self/status`, in bytes.
fn memory(row: &str) -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with(row)).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<usize>().unwrap() << 10
}

#[test]
fn a_hundred_megabytes_in_one_message_take_no_memory_of_the_host() {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let scene = Scene::builder().add("ball", Rigid::ball(0.05).mass_kg(0.2)).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let host = serve(Arc::new(world), Serving::new("bench", &endpoint)).unwrap();
    let mut config = Config::default();
    for (key, value) in [
        ("mode", "\"client\"".to_owned()),
        ("connect/endpoints", format!("[\"{endpoint}\"]")),
        ("scouting/multicast/enabled", "false".to_owned()),
    ] {
        config.insert_json5(key, &value).unwrap();
    }
    let session = zenoh::open(config).wait().unwrap();
    // the peer's own copy is there before memory is measured
    let payload = ZBytes::from(vec![1; 100_000_000]);
    std::fs::write("/proc/self/clear_refs", "5").unwrap();
    let before = memory("VmRSS");
    let asked =
        session.get("metachron/bench/call/anyone/peer").payload(payload.clone()).timeout(Duration::from_secs(20));
    assert_eq!(asked.wait().unwrap().into_iter().filter(|answer| answer.result().is_ok()).count(), 0);
    let grown = memory("VmHWM").saturating_sub(before);
    println!("100 MB in one message: {} KiB more memory", grown >> 10);
    assert!(grown < 64 << 20, "{grown} bytes");
    assert_eq!((host.callers(), payload.len()), (0, 100_000_000));
    assert!(connect(&endpoint).unwrap().hash().is_ok(), "others are served on");
}
