//! Keys that objects of every model share: time, primitive levels, appearance, points and rotations.

use crate::check::{Checker, Place};
use crate::format::{CommonFile, FaultsFile, HoldKind, OneOrRange, Point};
use glam::{DQuat, DVec3, EulerRot};
use metachron_core::{ResolutionRange, SimSpan};
use metachron_world::couplings::Faults;
use metachron_world::kinds::{Material, ShadingKind};
use metachron_world::{Appearance, PaceWish};

/// Default rate, hertz, of an object for which the scene gives neither rate nor step.
const RATE_DEFAULT_HZ: f64 = 240.0;
/// Default range of primitive levels of a picture.
const N_DEFAULT: (u8, u8) = (1, 5);
/// A rate agrees with a step when their product is 1 within this: a rate may be written with 5 digits.
const RATE_AGREES: f64 = 1e-4;

/// Rotation by angles about the world's x, then y, then z axis, in degrees; none where none is given.
pub(super) fn rotation(degrees: Option<Point>) -> DQuat {
    let turn = point(degrees) * (std::f64::consts::PI / 180.0);
    DQuat::from_euler(EulerRot::ZYX, turn.z, turn.y, turn.x)
}

/// A point, or the origin where none is given.
pub(super) fn point(given: Option<Point>) -> DVec3 {
    given.unwrap_or_default().into()
}

/// Rate and step: either gives the other; both together must agree.
pub(super) fn pace(c: &mut Checker<'_, '_>, place: &Place, file: &CommonFile) -> PaceWish {
    let Some(dt) = file.dt_ms else {
        let rate_hz = file.rate_hz.unwrap_or(RATE_DEFAULT_HZ);
        return wish(rate_hz, 1000.0 / rate_hz, None);
    };
    let (least, greatest) = dt.ends();
    let rate_hz = file.rate_hz.unwrap_or(1000.0 / least);
    let wanted_ms = 1000.0 / rate_hz;
    if least * (1.0 - RATE_AGREES) > wanted_ms || wanted_ms > greatest * (1.0 + RATE_AGREES) {
        let what = format!("is {rate_hz}, a step of {} ms, but `dt_ms` is {}", rounded(wanted_ms), shown(dt));
        let expected = match dt {
            OneOrRange::One(ms) => {
                format!("expected {} Hz, or no `rate_hz`: 1000 / `dt_ms` is its default", rounded(1000.0 / ms))
            }
            OneOrRange::Range(_) => {
                format!("expected a rate from {} to {} Hz", rounded(1000.0 / greatest), rounded(1000.0 / least))
            }
        };
        c.wrong(place, "rate_hz", what, expected);
    }
    wish(rate_hz, wanted_ms.clamp(least, greatest), Some((least, greatest)))
}

fn wish(rate_hz: f64, dt_ms: f64, range_ms: Option<(f64, f64)>) -> PaceWish {
    let span = |ms: f64| SimSpan::from_secs_f64(ms * 1e-3).unwrap_or(SimSpan::from_nanos(1_000_000));
    let (least, greatest) = range_ms.unwrap_or((dt_ms, dt_ms));
    PaceWish { rate_hz, dt: span(dt_ms), dt_range: (span(least), span(greatest)) }
}

/// The error tolerance of an object, metres, if the scene gives one; refused where `range`, the resolutions it may take, is `None`.
pub(super) fn tolerance(
    c: &mut Checker<'_, '_>,
    place: &Place,
    file: &CommonFile,
    pace: PaceWish,
    range: Option<ResolutionRange>,
) -> Option<f64> {
    let Some(tolerance_m) = file.tolerance_m else {
        if file.hold == Some(HoldKind::Error) {
            let expected = "expected `tolerance_m` beside it: the allowed error, metres";
            c.wrong(place, "hold", "is `error`, but `tolerance_m` is missing", expected);
        }
        return None;
    };
    let Some(range) = range else {
        refuse_tolerance(c, place, file);
        return None;
    };
    if file.hold == Some(HoldKind::Rate) {
        c.wrong(
            place,
            "tolerance_m",
            "contradicts `hold = \"rate\"`",
            "expected `hold = \"error\"`, or no `tolerance_m`",
        );
    }
    if pace.dt_range.0 == pace.dt_range.1 && range.eps_m.0 == range.eps_m.1 {
        let what = "cannot be held: step and spacing are both fixed";
        let expected =
            "expected `dt_ms = [least, greatest]`, or for a tube or a soft body `eps_m = [finest, coarsest]`";
        c.wrong(place, "tolerance_m", what, expected);
    }
    Some(tolerance_m)
}

/// Reports `tolerance_m` and `hold = "error"` on an object that makes no error of its own.
pub(super) fn refuse_tolerance(c: &mut Checker<'_, '_>, place: &Place, file: &CommonFile) {
    let asked = [("tolerance_m", file.tolerance_m.is_some()), ("hold", file.hold == Some(HoldKind::Error))];
    if let Some((key, _)) = asked.iter().find(|(_, there)| *there) {
        c.wrong(place, key, "has no effect: this model has no error of its own", "expected no such key");
    }
}

fn shown(dt: OneOrRange<f64>) -> String {
    match dt {
        OneOrRange::One(ms) => ms.to_string(),
        OneOrRange::Range([least, greatest]) => format!("[{least}, {greatest}]"),
    }
}

/// A number with at most four decimals, for messages.
pub(super) fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// Injected faults: the object's own, and the world's for the keys that the object leaves out.
pub(super) fn faults(own: Option<&FaultsFile>, world: Option<&FaultsFile>) -> Faults {
    let none = FaultsFile::default();
    let (own, world) = (own.unwrap_or(&none), world.unwrap_or(&none));
    Faults {
        jitter: own.jitter.or(world.jitter).unwrap_or(0.0),
        loss: own.loss.or(world.loss).unwrap_or(0.0),
        seed: u64::from(own.seed.or(world.seed).unwrap_or(0)),
    }
}

/// The levels of the drawn primitive.
pub(super) fn levels(file: &CommonFile) -> (u8, u8) {
    file.n.map_or(N_DEFAULT, OneOrRange::ends)
}

/// Colour and material of an object without a texture; `default` is the material of the model.
pub(super) fn appearance(c: &mut Checker<'_, '_>, place: &Place, file: &CommonFile, default: Material) -> Appearance {
    let appearance = painted_appearance(c, place, file, default);
    if file.shading == Some(ShadingKind::Textured) && appearance.material != Material::Tissue {
        c.wrong(
            place,
            "shading",
            "is `textured`, but the object has no texture",
            "expected `texture` beside it, which only a mesh can have, or `material = \"tissue\"`",
        );
    }
    appearance
}

/// The same for an object that may have a texture.
pub(super) fn painted_appearance(
    c: &mut Checker<'_, '_>,
    place: &Place,
    file: &CommonFile,
    default: Material,
) -> Appearance {
    let material = file.material.unwrap_or(default);
    let colour = match &file.colour {
        None => colour_of(material),
        Some(text) => parse_colour(text).unwrap_or_else(|| {
            c.wrong(place, "colour", format_args!("is `{text}`"), "expected `#rrggbb`, such as `#c9776b`");
            colour_of(material)
        }),
    };
    let importance = file.importance.unwrap_or(1.0);
    let shading = file.shading.unwrap_or_default();
    Appearance { colour, material, importance, may_vanish: file.may_vanish, shading }
}

fn colour_of(material: Material) -> [u8; 3] {
    match material {
        Material::Tissue => [0xc9, 0x77, 0x6b],
        Material::Metal => [0xb8, 0xbc, 0xc2],
        Material::Plastic => [0x6f, 0x8f, 0xaf],
        Material::Skin => [0xd8, 0xa0, 0x88],
    }
}

pub(super) fn parse_colour(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let value = u32::from_str_radix(digits, 16).ok()?;
    let [_, r, g, b] = value.to_be_bytes();
    Some([r, g, b])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_is_six_hexadecimal_digits_after_a_hash() {
        assert_eq!(parse_colour("#C9776b"), Some([0xc9, 0x77, 0x6b]));
        for bad in ["c9776b", "#c9776", "#c9776bb", "#g9776b", "#+12345", "", "#", "#ééé"] {
            assert_eq!(parse_colour(bad), None, "{bad}");
        }
    }
}
