//! The engine as the Python module `metachron._metachron`: scenes that start, worlds that run, states that are read.
//!
//! In: Python's numbers, numpy arrays, parts as the dataclasses of `package/metachron/parts.py`. Out: objects of Python, errors as its exceptions.
//! Never here: physics, a lock that Python waits for while a world runs.

mod all_states;
mod calls;
#[cfg_attr(not(feature = "view"), expect(dead_code, reason = "what a picture is asked for is read by what draws it"))]
mod camera;
mod checkpoint;
mod command;
mod elsewhere;
mod events;
mod export;
mod home;
mod joints;
#[cfg_attr(not(feature = "hosts"), path = "no_link.rs")]
mod link;
mod numbers;
mod object;
mod pickled;
mod queries;
mod raised;
mod recording;
mod rollout;
mod scene;
mod sensor;
mod soft;
mod start;
mod state;
#[cfg_attr(not(feature = "view"), path = "no_view.rs")]
mod view;
mod world;

/// The items that the package re-exports; `_metachron.pyi` has their arguments.
#[pyo3::pymodule]
mod _metachron {
    #[pymodule_export]
    use crate::all_states::States;
    #[pymodule_export]
    use crate::calls::WorldCalls;
    #[pymodule_export]
    use crate::checkpoint::Checkpoint;
    #[pymodule_export]
    use crate::elsewhere::{RemoteWorld, connect};
    #[pymodule_export]
    use crate::events::{Event, Events};
    #[pymodule_export]
    use crate::export::Export;
    #[pymodule_export]
    use crate::joints::{Joint, Joints};
    #[pymodule_export]
    use crate::object::Object;
    #[pymodule_export]
    use crate::queries::{Contact, Hit};
    #[pymodule_export]
    use crate::recording::replay;
    #[pymodule_export]
    use crate::rollout::{Rollout, rollout};
    #[pymodule_export]
    use crate::scene::Scene;
    #[pymodule_export]
    use crate::state::State;
    #[pymodule_export]
    use crate::world::World;

    #[pymodule_init]
    fn init(module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        use pyo3::types::PyModuleMethods as _;
        metachron::scenes::provide();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
