//! Why a world is not served, or not reached.

use metachron_world::WorldError;

/// Why a world is not served, or not reached.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HostsError {
    /// The endpoint cannot be read.
    #[error("\"{endpoint}\" is no endpoint; expected tcp/ or tls/, an address and a port, such as tcp/127.0.0.1:7447")]
    BadEndpoint {
        /// As given.
        endpoint: String,
    },
    /// The endpoint is not on this machine, and any process of the network could listen.
    #[error(
        "\"{endpoint}\" is beyond this machine, where any process of the network could read and command the world: expected tls/ with an identity, or --insecure-lan"
    )]
    NeedsCertificates {
        /// As given.
        endpoint: String,
    },
    /// Only one of the two is given: an endpoint with certificates, an identity.
    #[error("\"{endpoint}\": tls/ and an identity belong together; {has}")]
    IdentityOrNot {
        /// As given.
        endpoint: String,
        /// What is missing.
        has: &'static str,
    },
    /// With certificates only callers are let in that are named.
    #[error("no caller is let in: with an identity they are named as operators or viewers")]
    NoCallers,
    /// A certificate or its file cannot be used.
    #[error("{file}: {reason}")]
    BadIdentity {
        /// The file, or the name of the certificate.
        file: String,
        /// Why.
        reason: String,
    },
    /// A host cannot be reached at such an address.
    #[error("\"{address}\" is no address of a host; expected a name of DNS or an IP address, without a port")]
    BadAddress {
        /// As given.
        address: String,
    },
    /// The name of a world, or of the holder of a certificate, cannot be part of a key.
    #[error("\"{name}\" cannot name a world or a caller; expected 1 to 64 of a to z, A to Z, 0 to 9, _ and -")]
    BadName {
        /// As given.
        name: String,
    },
    /// The scene is too long for the answer to a caller that draws it.
    #[error(
        "the text of the scene and its files have {bytes} bytes, and callers are sent at most {most}; the longest file is \"{longest}\""
    )]
    LongScene {
        /// All bytes.
        bytes: usize,
        /// The most that there may be.
        most: usize,
        /// The name of the longest file; of the scene where it has none.
        longest: String,
    },
    /// The endpoint could not be listened on, or connected to.
    #[error("{endpoint}: {reason}")]
    Network {
        /// As given.
        endpoint: String,
        /// The network's error.
        reason: String,
    },
    /// Nothing at the endpoint serves a world.
    #[error("{endpoint}: no world is served there")]
    NoWorld {
        /// As given.
        endpoint: String,
    },
    /// The other end is another version of the program.
    #[error("the world's host is metachron {found}; this is {expected}")]
    OtherProgram {
        /// Its version.
        found: String,
        /// The version here.
        expected: String,
    },
    /// The world is of another scene.
    #[error(
        "the world is of the scene \"{found}\" ({found_hash:016x}); expected \"{expected}\" ({expected_hash:016x})"
    )]
    OtherScene {
        /// The name of its scene.
        found: String,
        /// The hash of that.
        found_hash: u64,
        /// The name of the scene here.
        expected: String,
        /// The hash of that.
        expected_hash: u64,
    },
    /// The host refuses, or is silent.
    #[error(transparent)]
    World(#[from] WorldError),
}

impl HostsError {
    /// The network's error, without the place in its source that it adds.
    pub(crate) fn network(endpoint: &str, error: &zenoh::Error) -> Self {
        let said = error.to_string();
        let end = said.rfind(" at ").filter(|at| said[*at..].contains(".rs:")).unwrap_or(said.len());
        let reason = said[..end].trim_end_matches(['!', '.', ' ']).to_owned();
        Self::Network { endpoint: endpoint.to_owned(), reason }
    }
}
