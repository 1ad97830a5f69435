//! State written to bytes, and read back in place: one visitor for both ways, so that neither knows a field that the other does not.
//!
//! In: objects that show their state field by field. Out: bytes ([`Archive::writer`]), or the same objects as they were when these were
//! written ([`Archive::reader`]). The parts that an object is built from are not written: it is read into one built alike.
//! Never here: files, versions ([`metachron_world::Checkpoint`](https://docs.rs/metachron-world) has both), what an object's state is.
//!
//! ```
//! use metachron_core::{Archive, archive_values};
//!
//! let (mut steps, mut way_m) = (3_u64, vec![0.5, 0.25]);
//! let mut archive = Archive::writer();
//! archive_values!(archive, steps, way_m)?;
//! let bytes = archive.into_bytes();
//! (steps, way_m) = (9, vec![]);
//! let mut archive = Archive::reader(&bytes);
//! archive_values!(archive, steps, way_m)?;
//! archive.finish()?;
//! assert_eq!((steps, way_m), (3, vec![0.5, 0.25]));
//! # Ok::<(), metachron_core::ArchiveError>(())
//! ```

use crate::Snapshot;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::HashMap;
use std::fmt::{Debug, Display};
use std::sync::Arc;

/// Writes state to bytes, or reads it from them.
#[derive(Debug)]
pub struct Archive<'a> {
    bytes: Bytes<'a>,
    /// Published states that several objects share: each is stored once, where it is met first.
    snapshots: Vec<Arc<Snapshot>>,
    /// The place in that list of each state written, by the state's address.
    places: HashMap<usize, usize>,
}

/// Where the bytes go to or come from.
#[derive(Debug)]
enum Bytes<'a> {
    Written(Vec<u8>),
    Read { left: &'a [u8], of: usize },
}

/// Why state could not be written or read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ArchiveError {
    /// A model that has no way to save its state.
    #[error("{what} does not save its state")]
    Refused {
        /// Which one.
        what: String,
    },
    /// The bytes are not those of the value that is expected there.
    #[error("byte {at} does not begin {expected}: {reason}")]
    Malformed {
        /// Where, counted from the first byte of the state.
        at: usize,
        /// The type that was expected there.
        expected: &'static str,
        /// The decoder's error.
        reason: String,
    },
    /// The state is that of another object than the one it is read into.
    #[error("{what} is {found} in the saved state; expected {expected}")]
    Mismatch {
        /// The value that differs.
        what: &'static str,
        /// As it is saved.
        found: String,
        /// As it is in the object.
        expected: String,
    },
    /// Bytes are left behind the state.
    #[error("{left} bytes are left behind the state")]
    Left {
        /// How many.
        left: usize,
    },
    /// A model panicked while its state was written or read.
    #[error("{reason}")]
    Panicked {
        /// The message of the panic.
        reason: String,
    },
    /// An error within a part that has a name.
    #[error("{part}: {reason}")]
    Within {
        /// The part.
        part: String,
        /// The error.
        reason: Box<Self>,
    },
}

impl<'a> Archive<'a> {
    /// An archive that writes.
    #[must_use]
    pub fn writer() -> Archive<'static> {
        Archive { bytes: Bytes::Written(Vec::new()), snapshots: Vec::new(), places: HashMap::new() }
    }

    /// An archive that reads what another one has written.
    #[must_use]
    pub fn reader(bytes: &'a [u8]) -> Self {
        let bytes = Bytes::Read { left: bytes, of: bytes.len() };
        Self { bytes, snapshots: Vec::new(), places: HashMap::new() }
    }

    /// Whether it reads: values that objects derive from their state have to be made anew then.
    #[must_use]
    pub const fn is_reading(&self) -> bool {
        matches!(self.bytes, Bytes::Read { .. })
    }

    /// Writes a plain value, or replaces it by the one that was written.
    ///
    /// # Errors
    /// [`ArchiveError::Malformed`]; the value is then as it was.
    pub fn value<T: Serialize + DeserializeOwned>(&mut self, value: &mut T) -> Result<(), ArchiveError> {
        let expected = std::any::type_name::<T>();
        match &mut self.bytes {
            Bytes::Written(bytes) => {
                let at = bytes.len();
                let longer = postcard::to_extend(value, std::mem::take(bytes));
                *bytes = longer.map_err(|e| ArchiveError::Malformed { at, expected, reason: e.to_string() })?;
            }
            Bytes::Read { left, of } => {
                let at = *of - left.len();
                let read = postcard::take_from_bytes(left);
                (*value, *left) = read.map_err(|e| ArchiveError::Malformed { at, expected, reason: e.to_string() })?;
            }
        }
        Ok(())
    }

    /// Checks that something that is fixed for an object's life is the same as when its state was written.
    ///
    /// # Errors
    /// [`ArchiveError::Mismatch`] where it differs; [`ArchiveError::Malformed`].
    pub fn fixed<T>(&mut self, what: &'static str, value: T) -> Result<(), ArchiveError>
    where
        T: Serialize + DeserializeOwned + PartialEq + Debug + Clone,
    {
        let mut saved = value.clone();
        self.value(&mut saved)?;
        if saved == value {
            return Ok(());
        }
        Err(ArchiveError::Mismatch { what, found: format!("{saved:?}"), expected: format!("{value:?}") })
    }

    /// A part that may be missing: `make` makes the one that `visit` reads into, where there is none.
    ///
    /// # Errors
    /// The errors of `visit`; [`ArchiveError::Malformed`].
    pub fn option<T>(
        &mut self,
        part: &mut Option<T>,
        make: impl FnOnce() -> T,
        visit: impl FnOnce(&mut T, &mut Self) -> Result<(), ArchiveError>,
    ) -> Result<(), ArchiveError> {
        let mut is_there = part.is_some();
        self.value(&mut is_there)?;
        if is_there {
            return visit(part.get_or_insert_with(make), self);
        }
        *part = None;
        Ok(())
    }

    /// A list of parts that `visit` reads into: the parts that are there, and as many more as `make` has to make.
    ///
    /// # Errors
    /// The errors of `visit`; [`ArchiveError::Malformed`].
    pub fn list<T>(
        &mut self,
        parts: &mut Vec<T>,
        mut make: impl FnMut() -> T,
        mut visit: impl FnMut(&mut T, &mut Self) -> Result<(), ArchiveError>,
    ) -> Result<(), ArchiveError> {
        let mut count = parts.len();
        self.value(&mut count)?;
        parts.truncate(count);
        for at in 0..count {
            // one by one: the count of a broken file asks for no storage
            if at == parts.len() {
                parts.push(make());
            }
            visit(&mut parts[at], self)?;
        }
        Ok(())
    }

    /// A published state. Places that shared one state when it was written share one again.
    ///
    /// # Errors
    /// [`ArchiveError::Malformed`].
    pub fn snapshot(&mut self, state: &mut Arc<Snapshot>) -> Result<(), ArchiveError> {
        let count = self.snapshots.len();
        let mut place = self.places.get(&(Arc::as_ptr(state) as usize)).copied().unwrap_or(count);
        self.value(&mut place)?;
        if let Some(known) = self.snapshots.get(place) {
            state.clone_from(known);
            return Ok(());
        }
        if place != count {
            return Err(ArchiveError::Mismatch {
                what: "the number of a published state",
                found: place.to_string(),
                expected: format!("at most {count}"),
            });
        }
        if self.is_reading() {
            let mut read = Snapshot::default();
            self.value(&mut read)?;
            *state = Arc::new(read);
        } else if let Bytes::Written(bytes) = &mut self.bytes {
            let at = bytes.len();
            let longer = postcard::to_extend(&**state, std::mem::take(bytes));
            let malformed =
                |e: postcard::Error| ArchiveError::Malformed { at, expected: "Snapshot", reason: e.to_string() };
            *bytes = longer.map_err(malformed)?;
            self.places.insert(Arc::as_ptr(state) as usize, count);
        }
        // held until the end: no other state can have its address
        self.snapshots.push(Arc::clone(state));
        Ok(())
    }

    /// A part with a name, which an error then says.
    ///
    /// # Errors
    /// The errors of `visit`.
    pub fn within(
        &mut self,
        part: impl Display,
        visit: impl FnOnce(&mut Self) -> Result<(), ArchiveError>,
    ) -> Result<(), ArchiveError> {
        visit(self).map_err(|reason| ArchiveError::Within { part: part.to_string(), reason: Box::new(reason) })
    }

    /// The bytes that were written; empty for an archive that reads.
    #[must_use]
    pub fn into_bytes(self) -> Vec<u8> {
        match self.bytes {
            Bytes::Written(bytes) => bytes,
            Bytes::Read { .. } => Vec::new(),
        }
    }

    /// Ends a reading.
    ///
    /// # Errors
    /// [`ArchiveError::Left`] where not all was read.
    pub fn finish(&self) -> Result<(), ArchiveError> {
        match self.bytes {
            Bytes::Read { left, .. } if !left.is_empty() => Err(ArchiveError::Left { left: left.len() }),
            _ => Ok(()),
        }
    }
}

/// Writes or reads plain values one after the other, up to the first error: `archive_values!(archive, self.steps, self.time)`.
#[macro_export]
macro_rules! archive_values {
    ($archive:expr, $($value:expr),+ $(,)?) => {
        Ok::<(), $crate::ArchiveError>(())$(.and_then(|()| $archive.value(&mut $value)))+
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn every_bit_of_a_number_comes_back() {
        let numbers = [0.0, -0.0, f64::MIN_POSITIVE / 3.0, f64::NAN, f64::NEG_INFINITY, 1.0 / 3.0];
        let mut archive = Archive::writer();
        archive.value(&mut numbers.clone()).unwrap();
        let bytes = archive.into_bytes();
        let mut read = [0.0; 6];
        Archive::reader(&bytes).value(&mut read).unwrap();
        assert_eq!(read.map(f64::to_bits), numbers.map(f64::to_bits));
    }

    #[test]
    fn states_that_are_shared_are_stored_once_and_shared_again() {
        let state = |x: f64| Arc::new(Snapshot { acceleration: DVec3::X * x, ..Snapshot::default() });
        let mut list = [state(1.0), state(2.0)];
        list = [list[0].clone(), list[1].clone()];
        let mut all = [list[0].clone(), list[1].clone(), list[0].clone()];
        let mut archive = Archive::writer();
        all.iter_mut().for_each(|one| archive.snapshot(one).unwrap());
        let bytes = archive.into_bytes();
        let mut read: [Arc<Snapshot>; 3] = std::array::from_fn(|_| Arc::default());
        let mut archive = Archive::reader(&bytes);
        read.iter_mut().for_each(|one| archive.snapshot(one).unwrap());
        archive.finish().unwrap();
        assert!(Arc::ptr_eq(&read[0], &read[2]) && !Arc::ptr_eq(&read[0], &read[1]));
        assert_eq!(read.map(|one| one.acceleration.x), [1.0, 2.0, 1.0]);
    }

    #[test]
    fn bytes_that_are_cut_short_or_too_many_are_errors() {
        let mut archive = Archive::writer();
        archive.value(&mut vec![1.0; 8]).unwrap();
        let bytes = archive.into_bytes();
        let mut into: Vec<f64> = Vec::new();
        let short = Archive::reader(&bytes[..bytes.len() - 1]).value(&mut into);
        assert!(matches!(short, Err(ArchiveError::Malformed { at: 0, .. })), "{short:?}");
        let mut archive = Archive::reader(&bytes);
        archive.value(&mut 0_u8).unwrap();
        assert_eq!(archive.finish(), Err(ArchiveError::Left { left: bytes.len() - 1 }));
        // a length that nothing follows asks for no storage
        let huge = Archive::reader(&[0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f]).value(&mut into);
        assert!(huge.is_err());
    }

    #[test]
    fn another_object_is_named() {
        let mut archive = Archive::writer();
        archive.fixed("the number of nodes", 5_usize).unwrap();
        let bytes = archive.into_bytes();
        let mut archive = Archive::reader(&bytes);
        let error =
            archive.within("agent \"gut\"", |archive| archive.fixed("the number of nodes", 6_usize)).unwrap_err();
        assert_eq!(error.to_string(), "agent \"gut\": the number of nodes is 5 in the saved state; expected 6");
    }
}
