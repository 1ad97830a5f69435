//! Contact clusters of real bodies: what rests on what, how deep, and what it weighs. Reference: exact weights, energy, docs/theory/clusters.md.

mod bodies;
mod joints;
mod links;
mod own_model;
mod rebounds;
mod scenes;
mod stacks;
mod table;
mod tools;
