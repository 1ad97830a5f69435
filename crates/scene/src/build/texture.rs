//! Reads the textures of the meshes of a scene: patterns, PNG and JPEG files, and the image inside a .glb file.
//!
//! In: `texture` of a mesh, any bytes. Out: a [`Texture`], equal ones shared, or the fault of the image. Never here:
//! drawing.

use super::glb;
use super::objects::Entry;
use super::scenery::Parts;
use crate::check::Checker;
use crate::demand::{Cost, FileHead};
use crate::format::MeshFile;
use crate::source::Source;
use glam::Vec2;
#[cfg(feature = "images")]
use image::{ImageFormat, ImageReader, Limits};
use metachron_drawable::{Model, Pattern, Texture, Wrap};
use metachron_world::Appearance;
use metachron_world::kinds::ShadingKind;
use std::collections::BTreeMap;
#[cfg(feature = "images")]
use std::io::Cursor;
use std::sync::Arc;

/// Most pixels of an image along each side.
#[cfg(feature = "images")]
const SIDE_MAX: u32 = 4096;
/// Most bytes that decoding an image may allocate.
#[cfg(feature = "images")]
const BYTES_MAX: u64 = 1 << 28;

/// Textures already made: equal ones are shared.
pub(super) struct Textures<'s> {
    /// Where their files are.
    source: &'s Source,
    /// By their source and the bits of their size.
    made: BTreeMap<(String, u64), Option<Arc<Texture>>>,
}

impl<'s> Textures<'s> {
    pub(super) fn new(source: &'s Source) -> Self {
        Self { source, made: BTreeMap::new() }
    }
}

/// Applies the texture of a mesh, if it has one, to its parts.
pub(super) fn apply(
    c: &mut Checker<'_, '_>,
    entry: &Entry,
    file: &MeshFile,
    mut parts: Parts,
    textures: &mut Textures<'_>,
) -> Parts {
    let (before, found) = (c.count(), texture_of(c, entry, file, &parts, textures));
    let bare = found.is_none() && c.count() == before && !parts.is_empty();
    if bare && entry.common.shading == Some(ShadingKind::Textured) {
        c.wrong(
            &entry.place,
            "shading",
            "is `textured`, but the object has no texture",
            "expected `texture` beside it",
        );
    }
    if let Some(texture) = found {
        for (_, part) in &mut parts {
            let colour = if entry.common.colour.is_some() { part.appearance.colour } else { [255; 3] };
            part.appearance = Appearance { colour, ..part.appearance };
            part.texture = Some(Arc::clone(&texture));
        }
    }
    parts
}

fn texture_of(
    c: &mut Checker<'_, '_>,
    entry: &Entry,
    file: &MeshFile,
    parts: &Parts,
    textures: &mut Textures<'_>,
) -> Option<Arc<Texture>> {
    let place = &entry.place;
    if file.texture_m.is_some() && file.texture.is_none() {
        c.wrong(place, "texture_m", "has no effect alone", "expected `texture` beside it");
    }
    let metres = file.texture_m.unwrap_or(1.0);
    let (key, name) = match (&file.texture, &file.file) {
        (Some(name), _) => ("texture", name),
        // errors of a file that gave no mesh have been reported
        (None, Some(name)) if !parts.is_empty() => ("file", name),
        (None, _) => return None,
    };
    let wrap = match key == "file" || file.texture_m.is_none() && has_texture_coordinates(parts) {
        true => Wrap::Corners,
        false => Wrap::Sides(metres as f32),
    };
    let made_from = (name.clone(), if wrap == Wrap::Corners { 0 } else { metres.to_bits() });
    if let Some(known) = textures.made.get(&made_from) {
        return known.clone();
    }
    let source = textures.source;
    let is_pattern = key == "texture" && name.parse::<Pattern>().is_ok();
    if !is_pattern && !c.may_read(place, key, source.head(name), image_cost) {
        textures.made.insert(made_from, None);
        return None;
    }
    let made = if key == "file" {
        embedded_image(name, source)
    } else {
        pattern_or_file(name, metres, wrap, source).map(Some)
    };
    let texture = made.unwrap_or_else(|why| {
        let patterns = Pattern::ALL.map(|pattern| format!("`{}`", pattern.name())).join(", ");
        let what = format!("cannot be used as a texture: {name}: {why}");
        c.wrong(place, key, what, format!("expected {patterns} or a PNG or JPEG image beside the scene"));
        None
    });
    textures.made.entry(made_from).or_insert(texture.map(Arc::new)).clone()
}

/// A pattern, or an image file next to the scene.
fn pattern_or_file(name: &str, metres: f64, wrap: Wrap, source: &Source) -> Result<Texture, String> {
    if let Ok(pattern) = name.parse::<Pattern>() {
        return Ok(pattern.texture(metres as f32));
    }
    decode(&source.sibling(name)?, wrap)
}

/// Whether the file of a mesh has texture coordinates.
fn has_texture_coordinates(parts: &Parts) -> bool {
    let textured =
        |model: &Model| matches!(model, Model::Mesh(mesh) if mesh.vertices().iter().any(|v| v.uv != Vec2::ZERO));
    parts.iter().any(|(_, part)| textured(&part.model))
}

/// The image inside a mesh's .glb file. Other errors of that file are reported where its triangles are read.
fn embedded_image(name: &str, source: &Source) -> Result<Option<Texture>, String> {
    let Ok(bytes) = source.sibling(name) else { return Ok(None) };
    if !bytes.starts_with(glb::MAGIC) {
        return Ok(None);
    }
    glb::image(&bytes)?.map(|image| decode(image, Wrap::Corners)).transpose()
}

/// The memory of an image; one whose head does not say its size takes nothing, and is refused when it is read.
fn image_cost(head: &FileHead) -> Cost {
    let pixels = size_of(&head.start).map_or(0, |[width, height]| u64::from(width) * u64::from(height));
    Cost::image(pixels)
}

/// This build reads no image.
#[cfg(not(feature = "images"))]
fn size_of(_: &[u8]) -> Option<[u32; 2]> {
    None
}

/// Width and height of a PNG or JPEG image that begins so, pixels.
#[cfg(feature = "images")]
fn size_of(start: &[u8]) -> Option<[u32; 2]> {
    let reader = ImageReader::new(Cursor::new(start)).with_guessed_format().ok()?;
    let (width, height) = reader.into_dimensions().ok()?;
    (width.max(height) <= SIDE_MAX).then_some([width, height])
}

/// Refuses every image: this build has no decoder.
#[cfg(not(feature = "images"))]
fn decode(_: &[u8], _: Wrap) -> Result<Texture, String> {
    Err("this build cannot read images: it lacks the feature `images` of metachron-scene".to_owned())
}

/// The pixels of a PNG or JPEG image.
#[cfg(feature = "images")]
fn decode(bytes: &[u8], wrap: Wrap) -> Result<Texture, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|why| why.to_string())?;
    match reader.format() {
        Some(ImageFormat::Png | ImageFormat::Jpeg) => {}
        Some(other) => return Err(format!("its image format is {other:?}; PNG and JPEG are supported")),
        None => return Err("its image format is unknown; PNG and JPEG are supported".to_owned()),
    }
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(SIDE_MAX), Some(SIDE_MAX));
    limits.max_alloc = Some(BYTES_MAX);
    reader.limits(limits);
    let pixels = reader.decode().map_err(|why| why.to_string())?.to_rgba8();
    let texels = pixels.pixels().map(|pixel| pixel.0).collect();
    let (width, height) = pixels.dimensions();
    Texture::new(width, height, texels, wrap).ok_or_else(|| "its image has no pixels".to_owned())
}

#[cfg(all(test, feature = "images"))]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn png(width: u32, height: u32) -> Vec<u8> {
        let image = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba([x as u8, y as u8, 7, 255]));
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn a_png_is_read_pixel_by_pixel() {
        let texture = decode(&png(5, 3), Wrap::Corners).unwrap();
        assert_eq!(texture.size(), (5, 3));
        assert_eq!(texture.texels()[2 * 5 + 4], [4, 2, 7, 255]);
    }

    #[test]
    fn a_jpeg_is_read_up_to_what_its_kind_loses() {
        let grey = image::RgbImage::from_fn(16, 8, |x, _| image::Rgb([16 * x as u8; 3]));
        let mut bytes = Cursor::new(Vec::new());
        grey.write_to(&mut bytes, ImageFormat::Jpeg).unwrap();
        let texture = decode(&bytes.into_inner(), Wrap::Corners).unwrap();
        assert_eq!(texture.size(), (16, 8));
        for (i, texel) in texture.texels().iter().enumerate() {
            assert!(texel[0].abs_diff(16 * (i % 16) as u8) <= 8, "{i}: {texel:?}");
        }
    }

    #[test]
    fn a_file_that_is_no_image_or_too_large_is_refused_with_its_reason() {
        for (bytes, message) in [
            (&b""[..], "PNG and JPEG are supported"),
            (b"hello there, this is no image", "PNG and JPEG are supported"),
            (b"GIF89a\x01\x00\x01\x00", "Gif"),
            (b"\xff\xd8\xff\xe0\x00\x10JFIF\x00", ""),
        ] {
            let why = decode(bytes, Wrap::Corners).unwrap_err();
            assert!(why.contains(message), "{why}");
        }
        assert!(decode(&png(SIDE_MAX + 1, 1), Wrap::Corners).is_err());
        // a header that declares far more pixels than there are
        let mut hostile = png(4, 4);
        hostile[16..24].copy_from_slice(&[0, 0, 0x0f, 0xff, 0, 0, 0x0f, 0xff]);
        assert!(decode(&hostile, Wrap::Corners).is_err());
    }

    proptest! {
        #[test]
        fn no_damage_makes_the_reader_panic(at in 0..120_usize, with in proptest::collection::vec(any::<u8>(), 0..5)) {
            let mut bytes = png(7, 4);
            let at = at % bytes.len();
            let end = (at + with.len()).min(bytes.len());
            bytes.splice(at..end, with);
            let _ = decode(&bytes, Wrap::Corners);
        }
    }
}
