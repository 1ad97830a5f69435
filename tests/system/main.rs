//! The whole program as its users meet it; one binary, so that it links once.
#[path = "../../crates/render/tests/pictures/adapter.rs"]
mod adapter;
mod behind;
mod chart;
mod chart_policies;
mod cli;
mod coupling;
mod fit;
mod golden;
mod groups;
mod guide;
mod idle;
mod play;
mod run;
mod scene;
mod scene_ties;
mod scenes;
mod scenes_apart;
mod scenes_coupled;
mod scenes_crowded;
mod scenes_meshes;
mod scenes_soft;
mod shares;
mod sight;
mod system_calls;
mod throughput;
mod tune;
