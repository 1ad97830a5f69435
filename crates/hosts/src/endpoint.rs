//! Endpoints, and sessions of zenoh with the rights of callers.
//!
//! In: `tcp/address:port` or `tls/address:port`, an identity. Out: an open session that knows no other endpoint. Never here: messages.

use crate::error::HostsError;
use crate::gate::SESSIONS_MAX;
use crate::identity::Identity;
use crate::wire::MESSAGE_MAX;
use std::fmt::Write;
use std::net::IpAddr;
use std::time::Duration;
use zenoh::{Config, Session, Wait};

/// An end that sends nothing for so long is silent.
pub(crate) const LEASE: Duration = Duration::from_secs(1);
/// The most links of a host: more than there are places, so that a few links of callers without one keep no other out.
const LINKS_MAX: usize = 4 * SESSIONS_MAX;

/// The side of a session.
#[derive(Clone, Copy)]
pub(crate) enum Side<'a> {
    /// With the names of its callers.
    Host(&'a [&'a str]),
    Caller,
}

/// Where a session is opened, and as whom.
#[derive(Clone, Copy)]
pub(crate) struct Place<'a> {
    pub endpoint: &'a str,
    pub identity: Option<&'a Identity>,
    pub insecure_lan: bool,
}

/// Opens a session that listens on the endpoint, or is connected to it, and finds no other by itself.
///
/// # Errors
/// [`HostsError::BadEndpoint`], [`HostsError::NeedsCertificates`], [`HostsError::IdentityOrNot`] and [`HostsError::Network`].
pub(crate) fn open(place: Place<'_>, side: Side<'_>) -> Result<Session, HostsError> {
    check(place)?;
    let endpoint = place.endpoint;
    let failed = |error: zenoh::Error| HostsError::network(endpoint, &error);
    let (mode, key, rights) = match side {
        Side::Host(callers) => ("\"peer\"", "listen/endpoints", rights(callers, place.identity.is_some())),
        Side::Caller => ("\"client\"", "connect/endpoints", "{}".to_owned()),
    };
    let mut settings = vec![
        ("mode", mode.to_owned()),
        (key, format!("[\"{endpoint}\"]")),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
        ("transport/unicast/max_sessions", LINKS_MAX.to_string()),
        ("transport/link/tx/lease", LEASE.as_millis().to_string()),
        ("access_control", rights),
        ("transport/link/rx/max_message_size", (MESSAGE_MAX + OVERHEAD).to_string()),
    ];
    if let Some(identity) = place.identity {
        settings.extend(tls(identity, side));
    }
    let mut config = Config::default();
    for (key, value) in settings {
        config.insert_json5(key, &value).map_err(&failed)?;
    }
    zenoh::open(config).wait().map_err(failed)
}

/// Both ends show a certificate of the same authority, and a link ends with the certificate.
fn tls(identity: &Identity, side: Side<'_>) -> Vec<(&'static str, String)> {
    let [certificate, key, authority] = identity.in_base64().map(|base64| format!("\"{base64}\""));
    let (own_certificate, own_key) = match side {
        Side::Host(_) => {
            ("transport/link/tls/listen_certificate_base64", "transport/link/tls/listen_private_key_base64")
        }
        Side::Caller => {
            ("transport/link/tls/connect_certificate_base64", "transport/link/tls/connect_private_key_base64")
        }
    };
    vec![
        ("transport/link/tls/root_ca_certificate_base64", authority),
        (own_certificate, certificate),
        (own_key, key),
        ("transport/link/tls/enable_mtls", "true".to_owned()),
        ("transport/link/tls/verify_name_on_connect", "true".to_owned()),
        ("transport/link/tls/close_link_on_expiration", "true".to_owned()),
    ]
}

/// The rights of callers: they ask and live under their own names, and listen. A state, an answer or a host's sign of life from one of them
/// reaches no other process, and neither does a call under the name of another certificate.
fn rights(callers: &[&str], is_certified: bool) -> String {
    let (mut rules, mut subjects, mut policies) = (RULES.to_owned(), String::new(), String::new());
    for name in callers {
        let certificate = if is_certified { format!(", cert_common_names: [\"{name}\"]") } else { String::new() };
        // writing to a string does not fail
        let _ = write!(
            rules,
            r#"{{ id: "asks {name}", messages: ["query"], flows: ["ingress"], permission: "allow", key_exprs: ["metachron/*/call/{name}/*"] }},
            {{ id: "lives {name}", messages: ["liveliness_token"], flows: ["ingress"], permission: "allow", key_exprs: ["metachron/caller/{name}/*"] }},"#
        );
        let _ = write!(subjects, r#"{{ id: "{name}"{certificate} }},"#);
        let _ = write!(
            policies,
            r#"{{ rules: ["asks {name}", "lives {name}", "listens", "watches", "says"], subjects: ["{name}"] }},"#
        );
    }
    format!(
        r#"{{ enabled: true, default_permission: "deny", rules: [{rules}], subjects: [{subjects}], policies: [{policies}] }}"#
    )
}

/// The rights that all callers have.
const RULES: &str = r#"
    { id: "listens", messages: ["declare_subscriber"], flows: ["ingress"], permission: "allow", key_exprs: ["metachron/*/state", "metachron/*/seen"] },
    { id: "watches", messages: ["declare_liveliness_subscriber", "liveliness_query"], flows: ["ingress"], permission: "allow", key_exprs: ["metachron/*/host/*"] },
    { id: "says", messages: ["put", "reply", "declare_queryable", "liveliness_token"], flows: ["egress"], permission: "allow", key_exprs: ["metachron/**"] },
"#;

/// Bytes of keys and heads around a message.
const OVERHEAD: usize = 4096;

/// Whether the endpoint is one, and the processes that could listen there are known or meant.
fn check(Place { endpoint, identity, insecure_lan }: Place<'_>) -> Result<(), HostsError> {
    let bad = || HostsError::BadEndpoint { endpoint: endpoint.to_owned() };
    let (protocol, address) = endpoint.split_once('/').ok_or_else(bad)?;
    let (host, port) = address.rsplit_once(':').ok_or_else(bad)?;
    let is_host = |byte: u8| byte.is_ascii_alphanumeric() || b".-_[]:".contains(&byte);
    if !["tcp", "tls"].contains(&protocol)
        || host.is_empty()
        || !host.bytes().all(is_host)
        || port.parse::<u16>().is_err()
    {
        return Err(bad());
    }
    let unlike = |has| Err(HostsError::IdentityOrNot { endpoint: endpoint.to_owned(), has });
    match (protocol, identity) {
        ("tls", None) => return unlike("there is no identity"),
        ("tls", Some(_)) => return Ok(()),
        (_, Some(_)) => return unlike("the endpoint is without certificates"),
        (_, None) => {}
    }
    if is_loopback(host) || insecure_lan {
        return Ok(());
    }
    Err(HostsError::NeedsCertificates { endpoint: endpoint.to_owned() })
}

fn is_loopback(host: &str) -> bool {
    let host = host.strip_prefix('[').and_then(|host| host.strip_suffix(']')).unwrap_or(host);
    host == "localhost" || host.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

/// Whether any process of a network may listen at an endpoint that was opened.
pub(crate) fn is_open_to_all(endpoint: &str) -> bool {
    let host = endpoint.strip_prefix("tcp/").and_then(|address| address.rsplit_once(':'));
    host.is_some_and(|(host, _)| !is_loopback(host))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(endpoint: &str) -> Result<(), HostsError> {
        check(Place { endpoint, identity: None, insecure_lan: false })
    }

    #[test]
    fn only_loopback_needs_no_certificate() {
        for endpoint in ["tcp/127.0.0.1:7447", "tcp/localhost:1", "tcp/[::1]:7447", "tcp/127.8.0.1:0"] {
            assert!(checked(endpoint).is_ok() && !is_open_to_all(endpoint), "{endpoint}");
        }
        for endpoint in
            ["tcp/0.0.0.0:7447", "tcp/10.0.0.1:7447", "tcp/[::]:7447", "tcp/localhost.evil:1", "tcp/bench:1"]
        {
            assert!(matches!(checked(endpoint), Err(HostsError::NeedsCertificates { .. })), "{endpoint}");
            assert!(check(Place { endpoint, identity: None, insecure_lan: true }).is_ok() && is_open_to_all(endpoint));
        }
        for endpoint in ["tls/bench:7447", "tls/127.0.0.1:1"] {
            assert!(matches!(checked(endpoint), Err(HostsError::IdentityOrNot { .. })), "{endpoint}");
        }
        let bad = [
            "",
            "tcp",
            "tcp/127.0.0.1",
            "tcp/127.0.0.1:70000",
            "tcp/127.0.0.1:1#x=2",
            "smoke/127.0.0.1:1",
            "tcp/a\"]:1",
            "udp/127.0.0.1:1",
        ];
        for endpoint in bad {
            assert!(matches!(checked(endpoint), Err(HostsError::BadEndpoint { .. })), "{endpoint}");
        }
    }
}
