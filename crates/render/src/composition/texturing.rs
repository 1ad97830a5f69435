//! Textures of scenery: which texture an actor has, and its mean colour for shadings that do not draw it.
//!
//! In: textures and their actors. Out: texture numbers, colours. Never here: pixels on the GPU.

use super::compose::Paint;
use crate::seen::level::Shading;
use crate::states::scene_view::SceneView;
use metachron_core::AgentId;
use metachron_drawable::{Texture, Wrap};
use std::sync::Arc;

/// The texture of one actor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Painting {
    /// Its number in the picture's list, from 1.
    number: u32,
    /// Repeats per metre where it is projected on sides, else 0.
    wrap: f32,
    /// Its mean colour, sRGB.
    mean: [u8; 3],
}

impl SceneView {
    /// Sets the texture of an actor that is scenery: from [`Shading::Textured`] on, texture times the actor's colour is drawn; cheaper
    /// shadings use the texture's mean. An unknown actor is ignored.
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
    /// The texture's number and its repeats per metre where the shading draws it; else multiplies the paint's colour by the texture's mean.
    pub fn apply(&self, paint: &mut Paint, shading: Shading) -> Option<(u32, f32)> {
        if shading >= Shading::Textured {
            return Some((self.number, self.wrap));
        }
        let of = |(own, mean): (u8, u8)| (u16::from(own) * u16::from(mean) / 255) as u8;
        paint.colour = std::array::from_fn(|i| of((paint.colour[i], self.mean[i])));
        None
    }
}
