//! `chart coupling`: the difference of a coupled scene with separate clocks and the same scene under one very fine common clock.

pub(super) mod error;
