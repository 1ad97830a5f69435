//! Endpoints, names and sessions of zenoh.
//!
//! In: `tcp/address:port`. Out: an open session that knows no other endpoint. Never here: messages.

use crate::error::HostsError;
use crate::gate::SESSIONS_MAX;
use crate::wire::MESSAGE_MAX;
use std::net::IpAddr;
use std::time::Duration;
use zenoh::{Config, Session, Wait};

/// An end that sends nothing for so long is silent.
pub(crate) const LEASE: Duration = Duration::from_secs(1);

/// The side of a session.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Host,
    Caller,
}

/// Opens a session that listens on the endpoint, or is connected to it, and finds nobody by itself.
///
/// # Errors
/// [`HostsError::BadEndpoint`], [`HostsError::NeedsCertificates`] and [`HostsError::Network`].
pub(crate) fn open(endpoint: &str, side: Side) -> Result<Session, HostsError> {
    check_loopback(endpoint)?;
    let failed = |reason: String| HostsError::Network { endpoint: endpoint.to_owned(), reason };
    let (mode, key) = match side {
        Side::Host => ("\"peer\"", "listen/endpoints"),
        Side::Caller => ("\"client\"", "connect/endpoints"),
    };
    let endpoints = format!("[\"{endpoint}\"]");
    let settings = [
        ("mode", mode),
        (key, &endpoints),
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/enabled", "false"),
        ("transport/unicast/max_sessions", &SESSIONS_MAX.to_string()),
        ("transport/link/tx/lease", &LEASE.as_millis().to_string()),
        ("access_control", if side == Side::Host { RIGHTS } else { "{}" }),
        ("transport/link/rx/max_message_size", &(MESSAGE_MAX + OVERHEAD).to_string()),
    ];
    let mut config = Config::default();
    for (key, value) in settings {
        config.insert_json5(key, value).map_err(|error| failed(error.to_string()))?;
    }
    zenoh::open(config).wait().map_err(|error| failed(error.to_string()))
}

/// The rights of callers: they ask, and listen. A state, an answer or a host's sign of life from one of them reaches nobody.
const RIGHTS: &str = r#"{
    enabled: true,
    default_permission: "deny",
    rules: [
        { id: "asks", messages: ["query"], flows: ["ingress"], permission: "allow", key_exprs: ["metachron/*/call/*"] },
        { id: "listens", messages: ["declare_subscriber"], flows: ["ingress"], permission: "allow", key_exprs: ["metachron/*/state"] },
        { id: "lives", messages: ["liveliness_token"], flows: ["ingress"], permission: "allow", key_exprs: ["metachron/*/caller/*"] },
        { id: "watches", messages: ["declare_liveliness_subscriber", "liveliness_query"], flows: ["ingress"], permission: "allow", key_exprs: ["metachron/*/host"] },
        { id: "says", messages: ["put", "reply", "declare_queryable", "liveliness_token"], flows: ["egress"], permission: "allow", key_exprs: ["metachron/**"] },
    ],
    subjects: [{ id: "caller" }],
    policies: [{ rules: ["asks", "listens", "lives", "watches", "says"], subjects: ["caller"] }],
}"#;

/// Bytes of keys and heads around a message.
const OVERHEAD: usize = 4096;

fn check_loopback(endpoint: &str) -> Result<(), HostsError> {
    let bad = || HostsError::BadEndpoint { endpoint: endpoint.to_owned() };
    let (protocol, address) = endpoint.split_once('/').ok_or_else(bad)?;
    let (host, port) = address.rsplit_once(':').ok_or_else(bad)?;
    if !["tcp", "udp", "tls", "quic"].contains(&protocol) || host.is_empty() || port.parse::<u16>().is_err() {
        return Err(bad());
    }
    let host = host.strip_prefix('[').and_then(|host| host.strip_suffix(']')).unwrap_or(host);
    let is_loopback = host == "localhost" || host.parse::<IpAddr>().is_ok_and(|address| address.is_loopback());
    if is_loopback && protocol == "tcp" {
        return Ok(());
    }
    if is_loopback { Err(bad()) } else { Err(HostsError::NeedsCertificates { endpoint: endpoint.to_owned() }) }
}

/// Checks the name of a world, or of a session: a part of keys.
pub(crate) fn is_name(name: &str) -> bool {
    (1..=64).contains(&name.len()) && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-".contains(&byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_loopback_needs_no_certificate() {
        for endpoint in ["tcp/127.0.0.1:7447", "tcp/localhost:1", "tcp/[::1]:7447", "tcp/127.8.0.1:0"] {
            assert!(check_loopback(endpoint).is_ok(), "{endpoint}");
        }
        for endpoint in
            ["tcp/0.0.0.0:7447", "tls/bench:7447", "tcp/10.0.0.1:7447", "tcp/[::]:7447", "tcp/localhost.evil:1"]
        {
            let refused = check_loopback(endpoint);
            assert!(matches!(refused, Err(HostsError::NeedsCertificates { .. })), "{endpoint}");
        }
        for endpoint in ["", "tcp", "tcp/127.0.0.1", "tcp/127.0.0.1:70000", "tcp/127.0.0.1:1#x=2", "smoke/127.0.0.1:1"]
        {
            assert!(matches!(check_loopback(endpoint), Err(HostsError::BadEndpoint { .. })), "{endpoint}");
        }
    }
}
