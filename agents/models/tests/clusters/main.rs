//! Contact clusters of real bodies: what rests on what, how deep, and what it weighs. Reference: exact weights, energy, docs/theory/clusters.md.

mod alike;
mod bodies;
mod errors;
mod grasp;
mod hands;
mod heaps;
mod joints;
mod large;
mod links;
mod own_model;
mod own_skin;
mod passing;
mod rebounds;
mod scenes;
mod sets;
mod shapes;
mod slope;
mod spaced;
mod stacks;
mod steps;
mod table;
mod tearing;
mod tools;
mod tubes;
mod walls;
mod yielding;
