//! What threads meet at, under one name, so that a model checker's can take its place (`models/`).
//!
//! Out: the standard library's. Never here: what is built of them.

pub(super) use std::sync::{Arc, Mutex, RwLock, atomic};
pub(super) use std::thread;
