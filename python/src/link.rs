//! Connections with hosts.
//!
//! In: an endpoint. Out: the calls of the world there, or an exception. Never here: the calls themselves.

use crate::elsewhere::Wanted;
use crate::raised;
use metachron::hosts::{Calling, HostsError, Identity, connect as reach};
use metachron::world::WorldCalls;
use pyo3::exceptions::{PyConnectionError, PyValueError};
use pyo3::prelude::*;
use std::sync::Arc;

/// The world that is served at an endpoint; of that scene, if one is expected, as the identity in that file.
pub fn connect(wanted: Wanted) -> PyResult<Arc<dyn WorldCalls>> {
    let Wanted { endpoint, scene, identity, insecure_lan } = wanted;
    let reached = || {
        let calling = scene.into_iter().fold(Calling::at(endpoint), Calling::scene);
        let calling = if insecure_lan { calling.insecure_lan() } else { calling };
        let identity = identity.map(Identity::from_file).transpose()?;
        reach(identity.into_iter().fold(calling, Calling::identity))
    };
    match reached() {
        Ok(world) => Ok(Arc::new(world)),
        Err(HostsError::World(error)) => Err(raised::world(error)),
        Err(error @ (HostsError::Network { .. } | HostsError::NoWorld { .. })) => {
            Err(PyConnectionError::new_err(error.to_string()))
        }
        Err(error) => Err(PyValueError::new_err(error.to_string())),
    }
}
