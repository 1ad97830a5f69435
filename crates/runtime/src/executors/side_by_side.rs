//! Threads for calls that wait for other processes, and for what goes on by itself.
//!
//! In: calls. Out: their outcomes, in their order. Never here: agents, turns.

use std::io;
use std::thread;

/// Makes a call for each of `items` at once, the first on the caller's thread; `None` of one that panicked.
pub fn side_by_side<I: Sync, T: Send>(items: &[I], call: impl Fn(&I) -> T + Sync) -> Vec<Option<T>> {
    let (call, Some((first, others))) = (&call, items.split_first()) else { return Vec::new() };
    thread::scope(|scope| {
        let others: Vec<_> = others.iter().map(|item| scope.spawn(move || call(item))).collect();
        let first = Some(call(first));
        std::iter::once(first).chain(others.into_iter().map(|other| other.join().ok())).collect()
    })
}

/// Lets `act` go on by itself on a thread of this name.
///
/// # Errors
/// The system gives no thread.
pub fn on_a_thread(name: &str, act: impl FnOnce() + Send + 'static) -> io::Result<()> {
    thread::Builder::new().name(name.to_owned()).spawn(act).map(drop)
}
