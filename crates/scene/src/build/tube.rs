//! Reads a tube of a scene file as a [`TubeSpec`].

use super::force_limits::ForceLimits;
use super::objects::ModelContext;
use crate::check::{Checker, Place};
use crate::format::{End, OneOrRange, PressureFile, TubeFile};
use glam::DVec3;
use metachron_core::{NumberRange, Resolution, ResolutionRange};
use metachron_models::rod::{
    Attachment, Integrator, Material, PressureKey, SUBSTEPS_MAX, Section, Tube, TubeSpec, WallModel,
};

/// The keys of a pressure over time.
const TIME: NumberRange = NumberRange::new(0.0, 1e6, "s");
const PRESSURE: NumberRange = NumberRange::new(0.0, 1e7, "Pa");
/// Most segments of a tube.
const SEGMENTS_MAX: u32 = 4096;
/// Default number of segments, where a scene gives neither ε nor their number.
const SEGMENTS_DEFAULT: f64 = 64.0;
/// Default finest and coarsest picture, in intervals per tube.
const PICTURE_INTERVALS: (f64, f64) = (400.0, 8.0);
/// Points nearer than this are the same point, metres.
const SAME_POINT_M: f64 = 1e-9;
/// A tube and the resolutions that its picture may take.
pub(super) struct BuiltTube {
    pub(super) spec: TubeSpec,
    pub(super) picture: ResolutionRange,
}

/// Reads a tube.
pub(super) fn build(c: &mut Checker<'_, '_>, file: &TubeFile, context: &ModelContext<'_>) -> BuiltTube {
    let place = context.place;
    let path_m = path(c, place, &file.path_m);
    let length_m = path_m.windows(2).map(|p| p[0].distance(p[1])).sum::<f64>().max(SAME_POINT_M);
    let section = section(c, place, file);
    let (resolution, range, picture) = resolutions(c, place, file, context.levels, length_m);
    let (clamp, pin) = ends(c, place, file);
    let attachments = file.attach.clone().unwrap_or_default();
    (0..).zip(&attachments).for_each(|(i, spring)| check_attachment(c, &place.entry("attach", i), spring));
    let spec = TubeSpec {
        path_m,
        straight: file.straight.unwrap_or(false),
        twist_rad: file.twist_deg.unwrap_or(0.0).to_radians(),
        section,
        resolution,
        range,
        segments: file.segments.map(|n| n as usize),
        integrator: file.integrator.unwrap_or_default(),
        substeps: file.substeps.unwrap_or(1),
        damping_per_s: file.damping_per_s.unwrap_or(0.0),
        clamp,
        pin,
        attachments,
        peristalsis: file.peristalsis,
        wall: wall(c, place, file),
        sealed: sealed(c, place, file, &section),
        pressure_pa: if let Some(PressureFile::Constant(pressure_pa)) = file.pressure_pa { pressure_pa } else { 0.0 },
        pressure_keys: pressure_keys(c, place, file),
        self_contact: file.self_contact.unwrap_or(true),
        friction: file.friction.unwrap_or(0.2),
        traits: context.traits,
        gravity: context.gravity,
        sleep: context.sleep,
    };
    BuiltTube { spec, picture }
}

/// The model of the sections; a wall that gives needs steps that take its bend as it is then.
fn wall(c: &mut Checker<'_, '_>, place: &Place, file: &TubeFile) -> WallModel {
    if file.wall != Some(WallModel::Gives) {
        return WallModel::Prescribed;
    }
    if let Some(method @ (Integrator::SymplecticEuler | Integrator::Xpbd)) = file.integrator {
        let what = format!("is \"gives\", which `{}` has no steps for", method.name());
        c.wrong(place, "wall", what, "expected `integrator` to be \"implicit-euler\", \"bdf2\" or \"energy-momentum\"");
    }
    WallModel::Gives
}

/// The pressure over time, by rising times.
fn pressure_keys(c: &mut Checker<'_, '_>, place: &Place, file: &TubeFile) -> Vec<PressureKey> {
    let Some(PressureFile::Keys(list)) = &file.pressure_pa else { return Vec::new() };
    let mut keys: Vec<PressureKey> = Vec::with_capacity(list.len());
    for (at, &(at_s, pressure_pa)) in list.iter().enumerate() {
        let [time, pressure] = [0, 1].map(|part| format!("pressure_pa.{at}.{part}"));
        let at_s = c.number(place, &time, at_s, TIME);
        let pressure_pa = c.number(place, &pressure, pressure_pa, PRESSURE);
        if let Some(before) = keys.last().filter(|before| at_s <= before.at_s) {
            let expected = format!("expected a time after the one before, {} s", before.at_s);
            c.wrong(place, &time, format_args!("is {at_s}"), expected);
        }
        keys.push(PressureKey { at_s, pressure_pa });
    }
    keys
}

/// Whether the tube is closed: a gas that is shut in needs room, and walls that give.
fn sealed(c: &mut Checker<'_, '_>, place: &Place, file: &TubeFile, section: &Section) -> bool {
    let sealed = file.sealed.unwrap_or(false);
    if sealed && (file.wall != Some(WallModel::Gives) || section.wall_m >= section.radius_m) {
        c.wrong(place, "sealed", "is true", "expected false, or `wall = \"gives\"` and a `wall_m` below `radius_m`");
    }
    sealed
}

/// Reports a longest step that is too long for the tube's integrator (docs/theory/rod.md, 13).
pub(super) fn check_step(c: &mut Checker<'_, '_>, place: &Place, tube: &Tube, longest_s: f64) {
    let TubeSpec { integrator, substeps, .. } = tube.spec();
    let Some(limit_s) = tube.longest_substep_s() else { return };
    if longest_s <= limit_s * f64::from(*substeps) {
        return;
    }
    let (name, segments) = (integrator.name(), tube.segments());
    let wanted = (longest_s / limit_s).ceil();
    let what = format!(
        "is `{name}`, which is stable for substeps up to {:.3} ms here, not of {:.3} ms",
        limit_s * 1e3,
        longest_s * 1e3 / f64::from(*substeps)
    );
    let more = if wanted <= f64::from(SUBSTEPS_MAX) { format!("`substeps = {wanted}`, ") } else { String::new() };
    let expected = format!(
        "expected {more}a step of at most {:.3} ms, fewer than {segments} segments, or an implicit integrator",
        limit_s * 1e3 * f64::from(*substeps)
    );
    c.wrong(place, "integrator", what, expected);
}

fn path(c: &mut Checker<'_, '_>, place: &Place, points: &[[f64; 3]]) -> Vec<DVec3> {
    let path: Vec<DVec3> = points.iter().map(|p| DVec3::from_array(*p)).collect();
    let same = path.windows(2).position(|p| p[0].distance(p[1]) < SAME_POINT_M);
    if let Some(same) = same {
        let key = format!("path_m.{}", same + 1);
        c.wrong(place, &key, "has the same point twice in a row", "expected a point away from the one before");
    }
    path
}

/// The section from modulus, density and dimensions; numbers that the file gives override them.
fn section(c: &mut Checker<'_, '_>, place: &Place, file: &TubeFile) -> Section {
    let radius_m = file.radius_m;
    let mut wall_m = file.wall_m.unwrap_or(radius_m);
    if wall_m > radius_m {
        let expected = format!("expected a number above 0 and at most `radius_m`, {radius_m} m");
        c.wrong(place, "wall_m", format_args!("is {wall_m}"), expected);
        wall_m = radius_m;
    }
    let unit = Material { young_pa: 1.0, poisson: 0.0, density_kg_m3: 1.0, shear_factor: 1.0 };
    let area_m2 = Section::hollow(radius_m, wall_m, unit).mass_per_length_kg_m;
    let young_pa = modulus(c, place, file, area_m2);
    let density_kg_m3 = density(c, place, file, area_m2);
    let poisson = file.poisson.unwrap_or(0.45);
    let shear_factor = file.shear_factor.unwrap_or(27.0 / 28.0);
    let material = Material { young_pa, poisson, density_kg_m3, shear_factor };
    let mut section = Section::hollow(radius_m, wall_m, material);
    for (given, into) in [
        (file.ea_n, &mut section.ea_n),
        (file.ga_n, &mut section.ga_n),
        (file.ei_n_m2, &mut section.ei_n_m2),
        (file.gj_n_m2, &mut section.gj_n_m2),
        (file.mass_per_length_kg_m, &mut section.mass_per_length_kg_m),
    ] {
        *into = given.unwrap_or(*into);
    }
    section
}

fn modulus(c: &mut Checker<'_, '_>, place: &Place, file: &TubeFile, area_m2: f64) -> f64 {
    match (file.young_pa, file.ea_n) {
        (Some(young), _) => young,
        (None, Some(ea)) => ea / area_m2,
        (None, None) => {
            c.wrong(
                place,
                "young_pa",
                "is missing",
                "expected `young_pa` (or `ea_n`, from which it follows) in this table",
            );
            1.0
        }
    }
}

fn density(c: &mut Checker<'_, '_>, place: &Place, file: &TubeFile, area_m2: f64) -> f64 {
    match (file.density_kg_m3, file.mass_per_length_kg_m) {
        (Some(density), _) => density,
        (None, Some(mass)) => mass / area_m2,
        (None, None) => {
            let expected = "expected `density_kg_m3` (or `mass_per_length_kg_m`, from which it follows) in this table";
            c.wrong(place, "density_kg_m3", "is missing", expected);
            1.0
        }
    }
}

/// The simulation's resolution at the start, its range, and the picture's range.
fn resolutions(
    c: &mut Checker<'_, '_>,
    place: &Place,
    file: &TubeFile,
    levels: (u8, u8),
    length_m: f64,
) -> (Resolution, ResolutionRange, ResolutionRange) {
    let finest = length_m / f64::from(SEGMENTS_MAX);
    // an ε as long as the tube is one interval; longer ones mean the same and are accepted up to ten lengths
    let spacing = NumberRange::new(rounded_up(finest), length_m * 10.0, "m (1/4096 … 10 times its length)");
    let mut ends = |key: &str, given: Option<OneOrRange<f64>>| {
        let ends = given?.ends();
        let bad = [ends.0, ends.1].into_iter().find(|end| !spacing.contains(*end));
        bad.iter()
            .for_each(|bad| c.wrong(place, key, format_args!("has the value {bad}"), format!("expected {spacing}")));
        bad.is_none().then_some(ends)
    };
    let (eps, picture) = (ends("eps_m", file.eps_m), ends("picture_eps_m", file.picture_eps_m));
    let usual = length_m / SEGMENTS_DEFAULT;
    let simulation = match file.segments {
        Some(n) => (length_m / f64::from(n), length_m / f64::from(n)),
        None => eps.unwrap_or((usual, usual)),
    };
    let picture = picture.or(eps).unwrap_or((length_m / PICTURE_INTERVALS.0, length_m / PICTURE_INTERVALS.1));
    // starts at the finest: the controller coarsens it where the machine is too slow
    let start = Resolution { eps_m: simulation.0, n: levels.1 };
    (start, ResolutionRange { eps_m: simulation, n: levels }, ResolutionRange { eps_m: picture, n: levels })
}

/// The limit rounded down to four digits, so that a message can show it.
fn rounded_up(value: f64) -> f64 {
    let digits = 10f64.powi(3 - value.log10().floor() as i32);
    (value * digits).floor() / digits
}

fn ends(c: &mut Checker<'_, '_>, place: &Place, file: &TubeFile) -> ([bool; 2], [bool; 2]) {
    let has = |list: &Option<Vec<End>>, end| list.as_ref().is_some_and(|l| l.contains(&end));
    let clamp = [has(&file.clamp, End::Start), has(&file.clamp, End::End)];
    let pin = [has(&file.pin, End::Start), has(&file.pin, End::End)];
    for (i, name) in ["start", "end"].into_iter().enumerate() {
        if clamp[i] && pin[i] {
            let what = format!("holds the {name}, which `clamp` holds already");
            c.wrong(place, "pin", what, format!("expected \"{name}\" in `clamp` or in `pin`, not in both"));
        }
    }
    (clamp, pin)
}

/// Whether an attachment is along a part of the tube, and yields before it tears.
fn check_attachment(c: &mut Checker<'_, '_>, place: &Place, spring: &Attachment) {
    let Attachment { from, to, tears_above_n, yields_above_n, .. } = *spring;
    if from >= to {
        c.wrong(place, "to", format_args!("is {to}"), format!("expected a number above `from`, {from}"));
    }
    ForceLimits::read(c, place, [Some(tears_above_n), Some(yields_above_n)]);
}
