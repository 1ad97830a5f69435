//! Pickles of scenes and states: bytes that the same version of the engine reads.
//!
//! In: a value. Out: its bytes, and back; or why they are not read. Never here: their contents.

use metachron::core::{Archive, archive_values};
use pyo3::PyResult;
use pyo3::exceptions::PyValueError;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The version that writes, and the only one that reads.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The bytes of a value.
pub fn bytes<T: Serialize + DeserializeOwned>(mut value: T) -> PyResult<Vec<u8>> {
    let (mut archive, mut version) = (Archive::writer(), VERSION.to_owned());
    let written = archive_values!(archive, version, value);
    written.map_err(|error| PyValueError::new_err(format!("it cannot be pickled: {error}")))?;
    Ok(archive.into_bytes())
}

/// Reads a value in the place of `value`.
pub fn read<T: Serialize + DeserializeOwned>(bytes: &[u8], value: &mut T) -> PyResult<()> {
    let (mut archive, mut version) = (Archive::reader(bytes), String::new());
    let wrong = |error| PyValueError::new_err(format!("the pickle is not read: {error}"));
    archive.value(&mut version).map_err(wrong)?;
    if version != VERSION {
        let message = format!("the pickle is of metachron {version}; expected one of {VERSION}");
        return Err(PyValueError::new_err(message));
    }
    archive.value(value).and_then(|()| archive.finish()).map_err(wrong)
}
