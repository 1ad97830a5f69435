//! Synchronisation primitives under one name, so that those of a model checker can replace them (`tests/loom`).
//!
//! Out: the standard library's. Never here: what is built of them.

pub(super) use std::sync::{Arc, Mutex, RwLock, atomic};
pub(super) use std::thread;
