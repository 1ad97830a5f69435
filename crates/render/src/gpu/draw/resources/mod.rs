//! What shaders are bound to: uniforms, textures, buffers that grow.
//!
//! In: the frame's numbers and images. Out: the same on the GPU. Never here: draw calls, meshes.

pub mod bindings;
pub mod buffers;
pub mod globals;
pub mod textures;
mod tissue;
