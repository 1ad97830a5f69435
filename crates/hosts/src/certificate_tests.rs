//! Certificates: a caller with a good one that the host names gets in, in its role and under its own name; no other does.

use crate::endpoint::{Place, Side, open};
use crate::gate::SESSIONS_MAX;
use crate::hostile_tests::{hello, scene};
use crate::wire::{Call, PROGRAM, Request, encode};
use crate::{Authority, Calling, Host, HostsError, Identity, RemoteWorld, Serving, connect, serve};
use metachron_core::SimSpan;
use metachron_runtime::TimelineCommand;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{World, WorldCalls, WorldError};
use std::net::TcpListener;
use std::sync::Arc;
use std::time::Duration;
use zenoh::Wait;

/// A host with a certificate for `addresses`, and its authority: `op` may command, `eye` may look.
fn served(addresses: &[String]) -> (World, Host, String, Authority) {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let (world, endpoint) = (World::start(&scene(), ExecutorKind::Lockstep).unwrap(), format!("tls/127.0.0.1:{port}"));
    let authority = Authority::new("lab").unwrap();
    let serving = Serving::new("bench", &endpoint).identity(authority.issue("bench", addresses, 1).unwrap());
    let host = serve(Arc::new(world.clone()), serving.operators(["op"]).viewers(["eye", "op"])).unwrap();
    (world, host, endpoint, authority)
}

fn here() -> Vec<String> {
    vec!["127.0.0.1".to_owned()]
}

fn called(endpoint: &str, identity: Identity) -> Result<RemoteWorld, HostsError> {
    connect(Calling::at(endpoint).identity(identity))
}

#[test]
fn an_operator_commands_and_a_viewer_reads() {
    let (world, host, endpoint, authority) = served(&here());
    let [op, eye] = ["op", "eye"].map(|name| called(&endpoint, authority.issue(name, &[], 1).unwrap()).unwrap());
    op.advance(SimSpan::from_millis(100)).unwrap();
    assert_eq!((eye.hash().unwrap(), host.callers()), (world.hash(), 2));
    assert!(eye.latest(eye.object("ball").unwrap()).is_ok());
    for forbidden in [
        eye.drive(TimelineCommand::Run),
        eye.advance(SimSpan::from_millis(20)),
        eye.remove(eye.object("ball").unwrap()),
        eye.checkpoint().map(drop).map_err(|error| WorldError::Elsewhere(error.to_string())),
    ] {
        assert!(forbidden.unwrap_err().to_string().contains("\"eye\" may read the world"));
    }
    assert_eq!((host.refused().forbidden, host.refused().total()), (4, 4));
    assert_eq!(host.take_refused().into_iter().map(|(peer, _)| peer).collect::<Vec<_>>(), ["eye"]);
    assert_eq!(world.time(), op.time());
}

#[test]
fn foreign_expired_and_unnamed_certificates_and_none_are_let_in_nowhere() {
    let (world, host, endpoint, authority) = served(&here());
    let foreign = Authority::new("lab").unwrap();
    for stranger in [
        foreign.issue("op", &[], 1).unwrap(),
        authority.issue("op", &[], -2).unwrap(),
        authority.issue("unnamed", &[], 1).unwrap(),
    ] {
        let refused = called(&endpoint, stranger).unwrap_err();
        assert!(matches!(refused, HostsError::Network { .. } | HostsError::NoWorld { .. }), "{refused}");
    }
    let bare = connect(&endpoint.replace("tls/", "tcp/")).unwrap_err();
    assert!(matches!(bare, HostsError::Network { .. }), "{bare}");
    assert!(matches!(connect(&endpoint), Err(HostsError::IdentityOrNot { .. })));
    let serving = |at: &str| Serving::new("bench", at);
    let without = serve(Arc::new(world.clone()), serving("tcp/127.0.0.1:0").viewers(["eye"]));
    assert!(matches!(without, Err(HostsError::IdentityOrNot { .. })), "names without certificates");
    let unnamed = serving("tls/127.0.0.1:0").identity(authority.issue("bench", &[], 1).unwrap());
    assert!(matches!(serve(Arc::new(world.clone()), unnamed), Err(HostsError::NoCallers)));
    assert_eq!((host.callers(), host.refused().total(), world.time().as_nanos()), (0, 0, 0));
    called(&endpoint, authority.issue("op", &[], 1).unwrap()).unwrap();
}

#[test]
fn a_host_whose_certificate_names_another_address_is_not_believed() {
    let (_world, _host, endpoint, authority) = served(&["10.0.0.1".to_owned()]);
    let refused = called(&endpoint, authority.issue("op", &[], 1).unwrap()).unwrap_err();
    assert!(matches!(refused, HostsError::Network { .. }), "{refused}");
}

#[test]
fn viewers_that_take_every_place_keep_no_operator_out() {
    let (_world, host, endpoint, authority) = served(&here());
    let eye = authority.issue("eye", &[], 1).unwrap();
    let spy = open(Place { endpoint: &endpoint, identity: Some(&eye), insecure_lan: false }, Side::Caller).unwrap();
    let lives = (0..2 * SESSIONS_MAX).map(|session| format!("metachron/caller/eye/{session}"));
    let _lives: Vec<_> = lives.map(|life| spy.liveliness().declare_token(life).wait().unwrap()).collect();
    let full = called(&endpoint, eye).unwrap_err().to_string();
    assert!(full.contains("32 callers of \"eye\" already"), "{full}");
    let op = called(&endpoint, authority.issue("op", &[], 1).unwrap()).unwrap();
    op.advance(SimSpan::from_millis(20)).unwrap();
    assert_eq!(host.callers(), 1);
}

#[test]
fn a_call_under_the_name_of_another_certificate_reaches_no_other() {
    let (world, host, endpoint, authority) = served(&here());
    let op = called(&endpoint, authority.issue("op", &[], 1).unwrap()).unwrap();
    let eye = authority.issue("eye", &[], 1).unwrap();
    let place = Place { endpoint: &endpoint, identity: Some(&eye), insecure_lan: false };
    let spy = open(place, Side::Caller).unwrap();
    let answers = |key: &str, call: Call| {
        let bytes = encode(&Request { run: 0, sequence: 1, call }).unwrap();
        let get = spy.get(key).payload(bytes).timeout(Duration::from_secs(2)).wait().unwrap();
        get.into_iter().filter(|answer| answer.result().is_ok()).count()
    };
    let _life = spy.liveliness().declare_token("metachron/caller/eye/1").wait().unwrap();
    assert_eq!(answers("metachron/bench/call/eye/1", hello(PROGRAM)), 1);
    for spoofed in
        ["metachron/bench/call/op/1", "metachron/bench/call/*/1", "metachron/**", "metachron/bench/call/eye/x/1"]
    {
        assert_eq!(answers(spoofed, hello(PROGRAM)), 0, "{spoofed}");
    }
    // a state, and another caller's or the host's end of life
    spy.put("metachron/bench/state", vec![1, 2, 3]).wait().unwrap();
    for sign in ["metachron/caller/op/1", &format!("metachron/bench/host/{}", op.run())] {
        spy.liveliness().declare_token(sign).wait().unwrap().undeclare().wait().unwrap();
    }
    op.advance(SimSpan::from_millis(20)).unwrap();
    assert_eq!((op.refused(), op.is_silent(), host.refused().total(), world.time()), (0, false, 0, op.time()));
}

#[test]
fn an_identity_is_read_back_from_its_file_which_no_other_user_may_read() {
    let folder = tempfile::tempdir().unwrap();
    let [file, of_authority] = ["bench.pem", "lab.pem"].map(|name| folder.path().join(name));
    let authority = Authority::new("lab").unwrap();
    authority.write(&of_authority).unwrap();
    let authority = Authority::from_file(&of_authority).unwrap();
    let issued = authority.issue("bench", &here(), 1).unwrap();
    issued.write(&file).unwrap();
    assert_eq!((Identity::from_file(&file).unwrap().in_base64(), issued.name()), (issued.in_base64(), "bench"));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        assert_eq!(std::fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
    }
    assert!(issued.write(&file).is_err(), "it is not written over");
    let bad = [
        Identity::from_file(&of_authority).map(drop),
        Authority::from_file(&file).map(drop),
        Identity::from_file(folder.path().join("none.pem")).map(drop),
        authority.issue("a b", &[], 1).map(drop),
        authority.issue("a", &["ä".to_owned()], 1).map(drop),
    ];
    bad.into_iter().for_each(|bad| assert!(bad.is_err()));
    for address in ["", "10.0.0.256", "10.0.0.5:7447", "a b", "lab..example", "-lab", "tls/bench", "[::1]"] {
        let bad = authority.issue("a", &[address.to_owned()], 1).unwrap_err();
        assert!(matches!(bad, HostsError::BadAddress { .. }), "{bad}");
    }
    let good = ["10.0.0.5", "::1", "lab_2", "bench.lab.example", "2.lab"].map(str::to_owned);
    assert!(authority.issue("a", &good, 1).is_ok());
    for days in [i64::MAX, i64::MIN, 3_000_000, -5_000_000] {
        assert!(authority.issue("a", &[], days).unwrap_err().to_string().contains("days from now"), "{days}");
    }
    let over = folder.path().join("over.pem");
    authority.issue("bench", &[], -2).unwrap().write(&over).unwrap();
    assert!(Identity::from_file(&over).unwrap_err().to_string().contains("ended on"));
    assert!(!format!("{issued:?}").contains("PRIVATE"));
}
