//! Synchronisation primitives under one name, so that a model checker's can replace them (`tests/loom`).
//!
//! Out: the standard library's. Never here: the structures built of them.

pub(super) use std::sync::{Arc, Mutex, RwLock, atomic};
pub(super) use std::thread;
