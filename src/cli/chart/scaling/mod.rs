//! `chart scaling`: how cost grows with segments, contacts, agents and what sleeps, and how far it is from what the machine could do.

pub(super) mod agents;
pub(super) mod contacts;
pub(super) mod growth;
pub(super) mod segments;
pub(super) mod sleepers;
mod tubes;
