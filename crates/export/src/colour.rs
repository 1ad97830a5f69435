//! The colour that stands for an object in files of other programs.
//!
//! In: its name. Out: red, green and blue. Never here: textures, the colours in pictures of a scene.

/// Static solids: grey.
pub(super) const OF_FIXED: [f64; 3] = [0.6, 0.6, 0.6];

/// A colour that goes with a name: a hue from its bytes; each part 0.35 … 0.9, as a screen has it (sRGB).
pub(super) fn of_name(name: &str) -> [f64; 3] {
    let hash = name.bytes().fold(0_u32, |hash, byte| hash.wrapping_mul(31).wrapping_add(u32::from(byte)));
    let hue = f64::from(hash % 360) / 60.0;
    [0.0, 4.0, 2.0].map(|shift| 0.35 + 0.55 * (((hue + shift) % 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0))
}
