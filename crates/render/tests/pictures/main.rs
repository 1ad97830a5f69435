//! Pictures drawn on the adapter present, compared with what they must show.
mod adapter;
mod depth;
mod light;
mod painting;
mod reduced;
mod scenery;
mod stage;
mod still_life;
mod tissue;
