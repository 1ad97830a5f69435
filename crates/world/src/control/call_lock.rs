//! A lock whose waiters may give up.
//!
//! In: a value that one thread has at a time, perhaps for long. Out: the same for another, or the reason why that waits no longer. Never here: which
//! reasons there are.

use std::ops::{Deref, DerefMut};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

/// How often a waiter looks whether to wait on.
const LOOK_INTERVAL: Duration = Duration::from_millis(10);

/// A value that one thread has at a time.
#[derive(Default)]
pub(crate) struct CallLock<T> {
    value: Mutex<T>,
    /// Held by waiters but while they wait: none misses that the value is free.
    gate: Mutex<()>,
    freed: Condvar,
}

/// The value, for the thread that has it.
pub(crate) struct CallGuard<'a, T> {
    /// `Some` until it is dropped.
    value: Option<MutexGuard<'a, T>>,
    lock: &'a CallLock<T>,
}

impl<T> CallLock<T> {
    pub fn new(value: T) -> Self {
        Self { value: Mutex::new(value), gate: Mutex::default(), freed: Condvar::new() }
    }

    /// The value, if no thread has it.
    pub fn try_lock(&self) -> Option<CallGuard<'_, T>> {
        let value = match self.value.try_lock() {
            Ok(value) => value,
            Err(TryLockError::Poisoned(value)) => value.into_inner(),
            Err(TryLockError::WouldBlock) => return None,
        };
        Some(CallGuard { value: Some(value), lock: self })
    }

    /// Waits for the value until `give_up`, which is asked many times a second, says why not.
    ///
    /// # Errors
    /// The reason that `give_up` says.
    pub fn lock<E>(&self, mut give_up: impl FnMut() -> Option<E>) -> Result<CallGuard<'_, T>, E> {
        if let Some(value) = self.try_lock() {
            return Ok(value);
        }
        let mut gate = self.gate.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(value) = self.try_lock() {
                return Ok(value);
            }
            let waited = self.freed.wait_timeout(gate, LOOK_INTERVAL).unwrap_or_else(PoisonError::into_inner);
            gate = waited.0;
            if waited.1.timed_out()
                && let Some(reason) = give_up()
            {
                return Err(reason);
            }
        }
    }
}

impl<T> Deref for CallGuard<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.value.as_ref().expect("dropped with the guard alone")
    }
}

impl<T> DerefMut for CallGuard<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        self.value.as_mut().expect("dropped with the guard alone")
    }
}

impl<T> Drop for CallGuard<'_, T> {
    fn drop(&mut self) {
        self.value = None;
        let _gate = self.lock.gate.lock().unwrap_or_else(PoisonError::into_inner);
        self.lock.freed.notify_one();
    }
}
