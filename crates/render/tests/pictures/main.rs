//! Pictures drawn on the adapter present, compared with the pictures that they must be.
mod adapter;
mod depth;
mod light;
mod painting;
mod reduced;
mod scenery;
mod stage;
mod still_life;
mod tissue;
