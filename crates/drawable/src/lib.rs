//! What is only drawn: generated meshes, textures, foliage, curves of tubes, meshes of any number of triangles.
//!
//! In: formulas, seeds, meshes of solids. Out: meshes, textures and curves for pictures. Never here: a shape that physics meets, a file, the GPU.
//!
//! ```
//! use metachron_drawable::{Generator, ProgressiveMesh, generate};
//!
//! let full = generate(Generator::Liver, 1, 2000);
//! let mesh = ProgressiveMesh::new(&full).unwrap();
//! let (least, most) = mesh.range();
//! let mut corners = Vec::new();
//! mesh.resolve(mesh.cut(most / 2), &mut corners);
//! assert!(corners.len() as u32 >= least && corners.len() as u32 <= most / 2); // the same mesh, half as fine
//! ```

pub mod foliage;
pub mod furniture;
pub mod generate;
pub mod geodesic;
mod likeness;
pub mod model;
pub mod motion;
pub mod progressive_mesh;
pub mod render_curve;
pub mod texture;

pub use foliage::{Foliage, FoliageCut, PieceKind, Stroke, TreeSpec, tree};
pub use generate::{Generator, generate, generate_surface};
pub use geodesic::geodesic_edges;
pub use model::{Extent, Model, Placement, proxy};
pub use motion::Motion;
pub use progressive_mesh::{Cut, ProgressiveMesh, ProgressiveMeshError};
pub use render_curve::{INTERVALS_MAX, Skeleton, SkinFrame, hermite, hermite_slope, intervals};
pub use texture::{Pattern, Texture, Wrap};
