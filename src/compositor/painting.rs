//! What is painted on scenery: which texture, and what is seen of it where it is not drawn.
//!
//! In: textures and who has them. Out: numbers of textures, colours. Never here: pixels on the GPU.

use super::compose::Paint;
use super::gather::Stage;
use super::level::Shading;
use metachron_core::AgentId;
use metachron_geometry::{Texture, Wrap};
use std::sync::Arc;

/// The texture of one actor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Painting {
    /// Its number among the picture's, from 1.
    number: u32,
    /// Repeats a metre where it lies on sides, else 0.
    wrap: f32,
    /// Its mean, sRGB.
    mean: [u8; 3],
}

impl Stage {
    /// Paints an actor that is scenery: from [`Shading::Textured`] on the texture times the actor's colour is drawn, by cheaper shadings its mean.
    /// An actor that is not there is none the worse for it.
    pub fn paint(&mut self, id: AgentId, texture: &Arc<Texture>) {
        let known = &self.picture.textures;
        let number = known.iter().position(|other| Arc::ptr_eq(other, texture)).unwrap_or(known.len());
        if number == known.len() {
            self.picture.textures = known.iter().chain([texture]).cloned().collect();
        }
        let wrap = match texture.wrap() {
            Wrap::Corners => 0.0,
            Wrap::Sides(metres) => 1.0 / metres,
        };
        if let Some(track) = self.tracks.iter_mut().find(|track| track.actor.id == id) {
            track.painting = Some(Painting { number: number as u32 + 1, wrap, mean: texture.mean() });
        }
    }
}

impl Painting {
    /// The texture's number and its repeats a metre where the shading draws it; else the paint gets its mean.
    pub fn lies(&self, paint: &mut Paint, shading: Shading) -> Option<(u32, f32)> {
        if shading >= Shading::Textured {
            return Some((self.number, self.wrap));
        }
        let of = |(own, mean): (u8, u8)| (u16::from(own) * u16::from(mean) / 255) as u8;
        paint.colour = std::array::from_fn(|i| of((paint.colour[i], self.mean[i])));
        None
    }
}
