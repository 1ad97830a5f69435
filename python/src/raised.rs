//! The engine's errors as Python's exceptions, with the engine's own sentences.
//!
//! In: errors of scenes and worlds. Out: `KeyError` for a name that there is not, `ValueError` for wrong arguments,
//! `RuntimeError` for a world or an object that cannot do it any more, `ConnectionError` for a host that is silent. Never here: a sentence about physics.

use metachron::export::ExportError;
#[cfg(feature = "view")]
use metachron::render::{DrawError, GpuError};
use metachron::scene::{SceneError, SceneProblem};
#[cfg(feature = "view")]
use metachron::session::SessionError;
use metachron::world::{CheckpointError, RecordError, SceneBuildError, WorldError};
use pyo3::exceptions::{PyConnectionError, PyKeyError, PyOSError, PyOverflowError, PyRuntimeError, PyValueError};
use pyo3::{PyErr, Python};

/// An error of a world.
pub fn world(error: WorldError) -> PyErr {
    exception(&error, error.to_string())
}

/// An error of one world of many.
pub fn in_world(number: usize, error: &WorldError) -> PyErr {
    exception(error, format!("world {number}: {error}"))
}

fn exception(error: &WorldError, message: String) -> PyErr {
    match error {
        WorldError::NoObject { .. }
        | WorldError::NoAgent(_)
        | WorldError::NoSensor { .. }
        | WorldError::NoJoint { .. } => PyKeyError::new_err(message),
        WorldError::Silent { .. } => PyConnectionError::new_err(message),
        WorldError::Foreign
        | WorldError::Elsewhere(_)
        | WorldError::Gone { .. }
        | WorldError::Stopped
        | WorldError::Stalled { .. }
        | WorldError::Run(_) => PyRuntimeError::new_err(message),
        _ => PyValueError::new_err(message),
    }
}

/// Why a file of moments cannot be written.
pub fn export(error: ExportError) -> PyErr {
    match error {
        ExportError::File { .. } => PyOSError::new_err(error.to_string()),
        ExportError::Taken { .. } | ExportError::Earlier { .. } | ExportError::TooLong { .. } => {
            PyValueError::new_err(error.to_string())
        }
    }
}

/// Why a scene has no such camera.
#[cfg(feature = "view")]
pub fn camera(error: &SessionError) -> PyErr {
    PyKeyError::new_err(error.to_string())
}

/// Why a picture cannot be drawn.
#[cfg(feature = "view")]
pub fn drawing(error: &GpuError) -> PyErr {
    match error {
        GpuError::Draw(DrawError::TooLarge { .. }) => PyValueError::new_err(error.to_string()),
        _ => PyRuntimeError::new_err(error.to_string()),
    }
}

/// Why a state cannot be saved, read or put back.
pub fn checkpoint(error: CheckpointError) -> PyErr {
    let message = error.to_string();
    match error {
        CheckpointError::File { .. } => PyOSError::new_err(message),
        CheckpointError::BadFile { .. } | CheckpointError::OtherScene { .. } => PyValueError::new_err(message),
        CheckpointError::Start(error) => exception(&error, message),
        _ => PyRuntimeError::new_err(message),
    }
}

/// Why a world is not recorded, or a recording cannot be read.
pub fn record(error: RecordError) -> PyErr {
    let message = error.to_string();
    match error {
        RecordError::File { .. } | RecordError::Write(_) => PyOSError::new_err(message),
        RecordError::BadFile { .. } => PyValueError::new_err(message),
        _ => PyRuntimeError::new_err(message),
    }
}

/// An error of one argument of a call or one field of a part, with its name.
pub fn of_argument(py: Python<'_>, what: &str, error: &PyErr) -> PyErr {
    // a number that an integer of the engine cannot hold is wrong as any other is
    if error.is_instance_of::<PyOverflowError>(py) {
        return PyValueError::new_err(format!("{what}: the number is out of range"));
    }
    PyErr::from_type(error.get_type(py), format!("{what}: {}", error.value(py)))
}

/// Why a scene cannot be built.
pub fn build(error: &SceneBuildError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A scene file's problems, a line each: the place, the problem, the expected value.
pub fn scene(error: &SceneError) -> PyErr {
    let hidden = (error.hidden > 0).then(|| format!("and {} more", error.hidden));
    let lines = [error.to_string()].into_iter().chain(error.problems.iter().map(problem)).chain(hidden);
    PyValueError::new_err(lines.collect::<Vec<_>>().join("\n"))
}

/// Why a file is no mesh.
pub fn mesh(error: &SceneError) -> PyErr {
    let why = error.problems.iter().map(problem).collect::<Vec<_>>().join("\n");
    PyValueError::new_err(format!("{}: {why}", error.name))
}

fn problem(problem: &SceneProblem) -> String {
    let SceneProblem { message, expected, help, line, column, .. } = problem;
    let place = if *line > 0 { format!("line {line}, column {column}: ") } else { String::new() };
    let further = [Some(expected), help.as_ref()].into_iter().flatten().filter(|text| !text.is_empty());
    further.fold(format!("{place}{message}"), |text, more| format!("{text}; {more}"))
}
