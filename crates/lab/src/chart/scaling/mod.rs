//! `chart scaling`: how cost grows with segments, contacts, agents and sleepers, and how far it is from the limit of the machine.

pub(super) mod agents;
pub(super) mod contacts;
pub(super) mod growth;
pub(super) mod segments;
pub(super) mod sleepers;
mod tubes;
