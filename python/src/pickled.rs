//! Pickles of scenes and states: bytes of a format that is numbered.
//!
//! In: a value. Out: its bytes, and back; or why they are not read. Never here: their contents.

use metachron::core::{Archive, archive_values};
use pyo3::PyResult;
use pyo3::exceptions::PyValueError;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The first bytes of a pickle.
const MAGIC: [u8; 4] = *b"mcpk";
/// The version of the format; each change of what a scene's builder, a scene's text or a state holds is a new one.
const FORMAT: u32 = 1;

/// The bytes of a value.
pub fn bytes<T: Serialize + DeserializeOwned>(mut value: T) -> PyResult<Vec<u8>> {
    let (mut archive, mut begins) = (Archive::writer(), (MAGIC, FORMAT));
    let written = archive_values!(archive, begins, value);
    written.map_err(|error| PyValueError::new_err(format!("it cannot be pickled: {error}")))?;
    Ok(archive.into_bytes())
}

/// Reads a value in the place of `value`.
pub fn read<T: Serialize + DeserializeOwned>(bytes: &[u8], value: &mut T) -> PyResult<()> {
    let (mut archive, mut begins) = (Archive::reader(bytes), ([0_u8; 4], 0_u32));
    let wrong = |error| PyValueError::new_err(format!("the pickle is not read: {error}"));
    archive.value(&mut begins).map_err(wrong)?;
    if begins != (MAGIC, FORMAT) {
        let found =
            if begins.0 == MAGIC { format!("format {}", begins.1) } else { "no format of metachron".to_owned() };
        return Err(PyValueError::new_err(format!("the pickle has {found}; this version reads format {FORMAT}")));
    }
    archive.value(value).and_then(|()| archive.finish()).map_err(wrong)
}
