//! The whole program as its users meet it; one binary, so that it links once.
mod chart;
mod chart_policies;
mod cli;
mod coupling;
mod painting;
mod picture;
mod play;
mod run;
mod scene;
mod scene_ties;
mod scenery;
mod scenes;
mod scenes_coupled;
mod scenes_soft;
mod throughput;
mod tune;
mod viewer;
