//! The forces at which attachments yield and tear.
//!
//! In: the forces that a joint or coupling of a scene file gives. Out: the two, in order; problems to the [`Checker`].
//! Never here: their effect.

use crate::check::{Checker, Place};

/// The forces at which an attachment yields and tears, N; infinite where it never does.
#[derive(Debug, Clone, Copy)]
pub(super) struct ForceLimits {
    pub(super) tears_above_n: f64,
    pub(super) yields_above_n: f64,
}

impl ForceLimits {
    /// Reads both: an attachment yields below the force at which it tears.
    pub(super) fn read(c: &mut Checker<'_, '_>, place: &Place, [tears, yields]: [Option<f64>; 2]) -> Self {
        let [tears_above_n, yields_above_n] = [tears, yields].map(|given| given.unwrap_or(f64::INFINITY));
        if yields_above_n >= tears_above_n && yields_above_n < f64::INFINITY {
            let expected = format!("expected a force below `tears_above_n`, {tears_above_n} N");
            c.wrong(place, "yields_above_n", format_args!("is {yields_above_n}"), expected);
        }
        Self { tears_above_n, yields_above_n }
    }
}
