//! What the benchmarks are made with: bodies, bare steps, the machine's resources, other engines' results.
//!
//! In: a scene as data. Out: what its steps take. Never here: a subject of `bench`.

pub mod bare;
pub mod cast;
pub mod machine;
pub mod peers;
pub mod plain_world;
pub mod play;
pub mod shaken_floor;
