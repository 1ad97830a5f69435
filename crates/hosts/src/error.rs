//! Why a world is not served, or not reached.

use metachron_world::WorldError;

/// Why a world is not served, or not reached.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HostsError {
    /// The endpoint cannot be read.
    #[error("\"{endpoint}\" is no endpoint; expected tcp/address:port, such as tcp/127.0.0.1:7447")]
    BadEndpoint {
        /// As given.
        endpoint: String,
    },
    /// The endpoint is not on this machine.
    #[error(
        "\"{endpoint}\" is beyond this machine, and needs certificates, which are not there yet: expected a loopback address such as tcp/127.0.0.1:7447"
    )]
    NeedsCertificates {
        /// As given.
        endpoint: String,
    },
    /// The name of a world cannot be part of a key.
    #[error("\"{name}\" cannot name a world; expected 1 to 64 of a to z, A to Z, 0 to 9, _ and -")]
    BadName {
        /// As given.
        name: String,
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
