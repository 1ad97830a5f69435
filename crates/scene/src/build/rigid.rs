//! A rigid object of the file as a [`RigidSpec`], or as an [`Obstacle`] where it is fixed.

use super::common::{point_or_zero, rotation};
use super::inertia::inertia;
use super::mesh;
use super::mesh::Mesh;
use super::objects::ModelContext;
use super::scenery::{SurfaceSource, surface_source};
use super::{KEYFRAMES_MAX, POSITION_MAX_M, ROTATION_MAX_DEG, SPEED_MAX};
use crate::check::{Checker, Place};
use crate::demand::Cost;
use crate::format::{Axis, PartFile, Point, RIGID, RigidFile, Shape, TIMES};
use crate::source::Source;
use glam::{DQuat, DVec3};
use metachron_drawable::{Generator, generate_surface};
use metachron_geometry::{Aabb, COMPOUND_PARTS_MAX, CompoundPart, ContactTraits, Obstacle, Solid, hull_corners};
use metachron_models::rigid::{Keyframe, Led, Restraint, RigidSpec};
use metachron_models::rigid::{LIMITS, MASS};
use std::sync::Arc;

/// Density where a scene gives neither mass nor density: water's, kg/m³.
const DENSITY_DEFAULT_KG_M3: f64 = 1000.0;

/// The same where the scene does not say, metres, and at most this share of the diagonal of the box around them.
const HULL_WITHIN_M: f64 = 1e-4;
const HULL_SHARE: f64 = 1e-3;

/// Whether the object never moves; reports a plane with `fixed = false`.
pub(super) fn is_fixed(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile) -> bool {
    let plane = file.shape == Shape::Plane;
    if plane && file.fixed == Some(false) {
        c.wrong(
            place,
            "fixed",
            "is false, but the object is a plane",
            "expected `true`: a plane is infinite and cannot move",
        );
    }
    plane || file.fixed == Some(true)
}

/// Reads a fixed object.
pub(super) fn obstacle(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile, source: &Source) -> Option<Obstacle> {
    for (key, given) in [("velocity_m_s", file.velocity_m_s), ("spin_rad_s", file.spin_rad_s)] {
        if given.is_some_and(|v| v != [0.0; 3]) {
            c.wrong(place, key, "moves an object that is fixed", "expected no motion, or `fixed = false`");
        }
    }
    if file.shape == Shape::Compound {
        c.wrong(place, "shape", "is a compound, and the object is fixed", "expected fixed objects, one for each part");
        return None;
    }
    let led = [("kinematic", file.kinematic == Some(true)), ("keyframe", file.keyframe.is_some())];
    for (key, _) in led.into_iter().filter(|(_, given)| *given) {
        c.wrong(place, key, "moves an object that is fixed", "expected no motion, or `fixed = false`");
    }
    refuse_restraint(c, place, file, "an object that is fixed");
    let solid = solid(c, place, file, PartContext { source, density_kg_m3: DENSITY_DEFAULT_KG_M3, is_fixed: true })?;
    let (position, rotation) = pose(c, place, file);
    let (restitution, friction) = surface(c, place, file);
    Some(Obstacle {
        name: String::new(),
        solid,
        position,
        rotation,
        friction,
        restitution,
        traits: ContactTraits::default(),
    })
}

/// Reads a moving object.
pub(super) fn build(c: &mut Checker<'_, '_>, file: &RigidFile, context: &ModelContext<'_>) -> Option<RigidSpec> {
    let place = context.place;
    let before = c.count();
    let density = c.optional(place, "density_kg_m3", file.density_kg_m3, RIGID).unwrap_or(DENSITY_DEFAULT_KG_M3);
    let solid = solid(c, place, file, PartContext { source: context.source, density_kg_m3: density, is_fixed: false })?;
    // a wrong shape or density gives a wrong mass: one problem is reported, not two
    let mass_kg = if c.count() == before { mass(c, place, file, &solid, density) } else { 1.0 };
    let inertia = inertia(c, place, file);
    let (position, rotation) = pose(c, place, file);
    let led = led(c, place, file, rotation);
    let start = led.as_ref().and_then(|led| led.keyframes.first());
    let (position, rotation) = start.map_or((position, rotation), |key| (key.tip_m, key.rotation));
    let (restitution, friction) = surface(c, place, file);
    let scale = c.optional(place, "gravity_scale", file.gravity_scale, RIGID).unwrap_or(1.0);
    Some(RigidSpec {
        restraint: restraint(c, place, file),
        led,
        solid,
        position,
        rotation,
        velocity: point_or_zero(c, place, "velocity_m_s", file.velocity_m_s, SPEED_MAX),
        spin: point_or_zero(c, place, "spin_rad_s", file.spin_rad_s, SPEED_MAX),
        mass_kg,
        inertia,
        restitution,
        friction,
        traits: context.traits,
        gravity: context.gravity * scale,
        sleep: context.sleep,
    })
}

/// The damping of an object, and the axes along which it cannot move.
fn restraint(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile) -> Restraint {
    let mut damping = |key: &str, given: Option<f64>| c.optional(place, key, given, LIMITS).unwrap_or(0.0);
    let locked = |axes: Option<&Vec<Axis>>| {
        [Axis::X, Axis::Y, Axis::Z].map(|axis| axes.is_some_and(|locked| locked.contains(&axis)))
    };
    Restraint {
        linear_damping_per_s: damping("linear_damping_per_s", file.linear_damping_per_s),
        angular_damping_per_s: damping("angular_damping_per_s", file.angular_damping_per_s),
        locked_translation: locked(file.lock_translation.as_ref()),
        locked_rotation: locked(file.lock_rotation.as_ref()),
    }
}

/// Reports keys that slow down, or keep from moving, an object that forces do not move anyway.
fn refuse_restraint(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile, what: &str) {
    let keys = [
        ("gravity_scale", file.gravity_scale.is_some()),
        ("linear_damping_per_s", file.linear_damping_per_s.is_some()),
        ("angular_damping_per_s", file.angular_damping_per_s.is_some()),
        ("lock_translation", file.lock_translation.is_some()),
        ("lock_rotation", file.lock_rotation.is_some()),
    ];
    for (key, _) in keys.into_iter().filter(|(_, given)| *given) {
        let expected = "expected no such key, or an object that forces move";
        c.wrong(place, key, format_args!("has no effect on {what}"), expected);
    }
}

/// How a kinematic object is led; `None` for one that forces move.
fn led(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile, rotation: DQuat) -> Option<Led> {
    let is_led = file.kinematic == Some(true);
    for (key, given) in [("keyframe", file.keyframe.is_some()), ("repeat", file.repeat.is_some())] {
        if given && !is_led {
            c.wrong(place, key, "is for objects that are led", "expected `kinematic = true`");
        }
    }
    if !is_led {
        return None;
    }
    refuse_restraint(c, place, file, "a kinematic object");
    let moved = [("velocity_m_s", file.velocity_m_s.is_some()), ("spin_rad_s", file.spin_rad_s.is_some())];
    let placed = ("position_m", file.position_m.is_some() && file.keyframe.is_some());
    for (key, _) in moved.into_iter().chain([placed]).filter(|(_, given)| *given) {
        let expected = "expected `[[object.keyframe]]` to say where it is";
        c.wrong(place, key, "has no effect on a kinematic object that keyframes or commands lead", expected);
    }
    Some(Led { keyframes: keyframes(c, place, file, rotation), repeat: file.repeat.unwrap_or(false) })
}

fn keyframes(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile, rotation: DQuat) -> Vec<Keyframe> {
    let files = file.keyframe.as_deref().unwrap_or_default();
    if files.len() > KEYFRAMES_MAX {
        let expected = format!("expected at most {KEYFRAMES_MAX}");
        c.wrong(place, "keyframe", format_args!("has {} entries", files.len()), expected);
        return Vec::new();
    }
    let mut keys: Vec<Keyframe> = Vec::with_capacity(files.len());
    for (i, file) in files.iter().enumerate() {
        let (place, before) = (place.entry("keyframe", i), keys.last().copied());
        let at_s = c.optional(&place, "at_s", file.at_s, TIMES).unwrap_or(0.0);
        if let Some(before) = before.filter(|before| at_s <= before.at_s) {
            let what = file.at_s.map_or("is missing".to_owned(), |at_s| format!("is {at_s}"));
            c.wrong(&place, "at_s", what, format!("expected a time after the keyframe before, {} s", before.at_s));
        }
        let start = before.map_or(rotation, |before| before.rotation);
        let turned = file.rotation_deg.map(|deg| c.point(&place, "rotation_deg", deg, ROTATION_MAX_DEG));
        let tip_m = c.point(&place, "position_m", file.position_m, POSITION_MAX_M);
        keys.push(Keyframe { at_s, tip_m, rotation: turned.map_or(start, self::rotation), jaw: 0.0 });
    }
    keys
}

fn pose(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile) -> (DVec3, DQuat) {
    let position = point_or_zero(c, place, "position_m", file.position_m, POSITION_MAX_M);
    (position, rotation(point_or_zero(c, place, "rotation_deg", file.rotation_deg, ROTATION_MAX_DEG)))
}

fn surface(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile) -> (f64, f64) {
    let restitution = c.optional(place, "restitution", file.restitution, LIMITS).unwrap_or(0.0);
    (restitution, c.optional(place, "friction", file.friction, RIGID).unwrap_or(0.5))
}

/// The keys of a shape, of an object or of a part of one.
struct ShapeKeys<'a> {
    shape: Shape,
    radius_m: Option<f64>,
    half_extents_m: Option<Point>,
    half_height_m: Option<f64>,
    file: Option<&'a str>,
    generate: Option<Generator>,
    seed: Option<u32>,
    triangles: Option<u32>,
    scale: Option<f64>,
    hull_within_m: Option<f64>,
    has_parts: bool,
}

/// The keys that a type with the keys of a shape has.
macro_rules! shape_keys {
    ($file:expr, $has_parts:expr) => {
        ShapeKeys {
            shape: $file.shape,
            radius_m: $file.radius_m,
            half_extents_m: $file.half_extents_m,
            half_height_m: $file.half_height_m,
            file: $file.file.as_deref(),
            generate: $file.generate,
            seed: $file.seed,
            triangles: $file.triangles,
            scale: $file.scale,
            hull_within_m: $file.hull_within_m,
            has_parts: $has_parts,
        }
    };
}

impl ShapeKeys<'_> {
    /// Of the keys that describe shapes, the ones that each shape takes.
    const fn takes(&self) -> &'static [&'static str] {
        match self.shape {
            Shape::Ball => &["radius_m"],
            Shape::Box => &["half_extents_m"],
            Shape::Capsule | Shape::Cylinder => &["radius_m", "half_height_m"],
            Shape::Plane => &[],
            Shape::Compound => &["part"],
            Shape::Hull => &["file", "generate", "seed", "triangles", "scale", "hull_within_m"],
            Shape::Mesh => &["file", "generate", "seed", "triangles", "scale"],
        }
    }

    /// Reports keys that belong to another shape, and required keys that are missing; returns whether none is missing.
    fn check(&self, c: &mut Checker<'_, '_>, place: &Place) -> bool {
        let takes = self.takes();
        let given = [
            ("radius_m", self.radius_m.is_some()),
            ("half_extents_m", self.half_extents_m.is_some()),
            ("half_height_m", self.half_height_m.is_some()),
            ("file", self.file.is_some()),
            ("generate", self.generate.is_some()),
            ("seed", self.seed.is_some()),
            ("triangles", self.triangles.is_some()),
            ("scale", self.scale.is_some()),
            ("hull_within_m", self.hull_within_m.is_some()),
            ("part", self.has_parts),
        ];
        let name = format!("{:?}", self.shape).to_lowercase();
        let list = takes.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(" and ");
        let expected =
            if list.is_empty() { format!("a {name} has no dimensions") } else { format!("a {name} has {list}") };
        let mut complete = true;
        for (key, is_given) in given {
            let takes = takes.contains(&key);
            if is_given && !takes {
                c.wrong(place, key, format_args!("does not belong to a {name}"), expected.clone());
            }
            // a surface has one of `file` and `generate`, which is checked where it is read
            if takes && !is_given && matches!(key, "radius_m" | "half_extents_m" | "half_height_m" | "part") {
                c.wrong(place, key, "is missing", format!("{expected}: expected `{key}` in this table"));
                complete = false;
            }
        }
        complete
    }

    /// The solid; of a compound nothing, as that has others.
    fn solid(&self, c: &mut Checker<'_, '_>, place: &Place, among: PartContext<'_>) -> Option<Solid> {
        let mut length = |key: &str, value: Option<f64>| c.number(place, key, value.unwrap_or_default(), RIGID);
        Some(match self.shape {
            Shape::Ball => Solid::Ball { radius_m: length("radius_m", self.radius_m) },
            Shape::Capsule => Solid::Capsule {
                radius_m: length("radius_m", self.radius_m),
                half_height_m: length("half_height_m", self.half_height_m),
            },
            Shape::Cylinder => Solid::Cylinder {
                radius_m: length("radius_m", self.radius_m),
                half_height_m: length("half_height_m", self.half_height_m),
            },
            Shape::Box => {
                let half = self.half_extents_m.unwrap_or_default();
                let half = std::array::from_fn(|i| length(&format!("half_extents_m.{i}"), Some(half[i])));
                Solid::Box { half_extents_m: DVec3::from_array(half) }
            }
            Shape::Plane => Solid::Plane,
            Shape::Hull => {
                let points_m = self.points(c, place, among)?;
                let given_m = c.optional(place, "hull_within_m", self.hull_within_m, RIGID);
                let Aabb { low, high } = Aabb::of(&points_m);
                let tolerance_m = given_m.unwrap_or(HULL_WITHIN_M.min(HULL_SHARE * low.distance(high)));
                let points_m = if tolerance_m > 0.0 { hull_corners(&points_m, tolerance_m).into() } else { points_m };
                self.sound(c, place, Solid::Hull { points_m })?
            }
            Shape::Mesh => {
                let (points_m, triangles) = self.surface(c, place, among)?;
                self.sound(c, place, Solid::Mesh { points_m, triangles })?
            }
            Shape::Compound => return None,
        })
    }

    /// The solid, if the physics can make a shape of it.
    fn sound(&self, c: &mut Checker<'_, '_>, place: &Place, solid: Solid) -> Option<Solid> {
        match solid.to_shared_shape() {
            Ok(_) => Some(solid),
            Err(why) => {
                let file = self.file.map_or_else(String::new, |file| format!("`{file}` "));
                let what = format_args!("{file}has no usable shape: {why}");
                c.wrong(place, "file", what, "expected the points of a solid");
                None
            }
        }
    }

    /// The points of a hull.
    fn points(&self, c: &mut Checker<'_, '_>, place: &Place, among: PartContext<'_>) -> Option<Arc<[DVec3]>> {
        let Some(name) = self.file.filter(|_| self.generate.is_none()) else {
            return Some(self.surface(c, place, among)?.0);
        };
        let scale = c.optional(place, "scale", self.scale, RIGID).unwrap_or(1.0);
        if !c.may_read(place, "file", among.source.head(name), |head| Cost::solid_of_file(head, among.is_fixed)) {
            return None;
        }
        let read = among.source.sibling(name).and_then(|bytes| mesh::hull_points(&bytes, scale));
        let points = read.map_err(|why| refuse_file(c, place, name, &why)).ok()?;
        Some(points.iter().map(|p| *p * scale).collect())
    }

    fn surface(&self, c: &mut Checker<'_, '_>, place: &Place, among: PartContext<'_>) -> Option<Surface> {
        let scale = c.optional(place, "scale", self.scale, RIGID).unwrap_or(1.0);
        let wanted = c.optional(place, "triangles", self.triangles.map(f64::from), RIGID).unwrap_or(4000.0);
        let name = match surface_source(c, place, self.file, self.generate)? {
            SurfaceSource::File(name) => name,
            SurfaceSource::Generated(kind) => {
                if !c.may_make(place, "triangles", Cost::solid(wanted as u64, among.is_fixed)) {
                    return None;
                }
                let made = generate_surface(kind, u64::from(self.seed.unwrap_or(0)), wanted as u32);
                return Some((made.points.iter().map(|p| *p * scale).collect(), made.triangles.into()));
            }
        };
        if !c.may_read(place, "file", among.source.head(name), |head| Cost::solid_of_file(head, among.is_fixed)) {
            return None;
        }
        let read = among.source.sibling(name).and_then(|bytes| mesh::read(&bytes, scale));
        match read {
            Ok(Mesh { points, triangles, .. }) => Some((points.iter().map(|p| *p * scale).collect(), triangles.into())),
            Err(why) => {
                refuse_file(c, place, name, &why);
                None
            }
        }
    }
}

fn refuse_file(c: &mut Checker<'_, '_>, place: &Place, name: &str, why: &str) {
    let expected = "expected a .glb, STL or OBJ file beside the scene";
    c.wrong(place, "file", format_args!("cannot be used: {name}: {why}"), expected);
}

fn solid(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile, among: PartContext<'_>) -> Option<Solid> {
    let keys = shape_keys!(file, file.part.is_some());
    if !keys.check(c, place) {
        return None;
    }
    let Some(parts) = file.part.as_ref().filter(|_| file.shape == Shape::Compound) else {
        return keys.solid(c, place, among);
    };
    if !(1..=COMPOUND_PARTS_MAX).contains(&parts.len()) {
        let expected = format!("expected 1 … {COMPOUND_PARTS_MAX}");
        c.wrong(place, "part", format_args!("has {} entries", parts.len()), expected);
        return None;
    }
    let parts = parts.iter().enumerate().map(|(i, file)| part(c, &place.entry("part", i), file, among));
    Some(Solid::Compound { parts: parts.collect::<Option<Vec<_>>>()?.into() })
}

/// The settings that the solid of an object, or the parts of a compound, share.
#[derive(Clone, Copy)]
struct PartContext<'a> {
    source: &'a Source,
    /// Of parts that have none of their own.
    density_kg_m3: f64,
    is_fixed: bool,
}

/// A part of a compound, with its density against that of others.
fn part(c: &mut Checker<'_, '_>, place: &Place, file: &PartFile, among: PartContext<'_>) -> Option<CompoundPart> {
    if matches!(file.shape, Shape::Plane | Shape::Compound) {
        c.wrong(place, "shape", "cannot be a part", "expected a solid that is neither a plane nor a compound");
        return None;
    }
    let keys = shape_keys!(file, false);
    if !keys.check(c, place) {
        return None;
    }
    let default = among.density_kg_m3;
    let solid = keys.solid(c, place, among)?;
    let position_m = point_or_zero(c, place, "position_m", file.position_m, POSITION_MAX_M);
    let rotation = rotation(point_or_zero(c, place, "rotation_deg", file.rotation_deg, ROTATION_MAX_DEG));
    let density = c.optional(place, "density_kg_m3", file.density_kg_m3, RIGID).unwrap_or(default) / default;
    Some(CompoundPart { density, ..CompoundPart::new(solid, position_m, rotation) })
}

/// Points of a mesh, metres, and its triangles.
type Surface = (Arc<[DVec3]>, Arc<[[u32; 3]]>);

/// Its mass: that of the file, or that of `solid` of `density`, kg/m³.
fn mass(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile, solid: &Solid, density: f64) -> f64 {
    if let Some(mass) = file.mass_kg {
        if file.density_kg_m3.is_some() && file.part.is_none() {
            let expected = "expected `mass_kg` or `density_kg_m3`, not both";
            c.wrong(place, "density_kg_m3", "contradicts `mass_kg`", expected);
        }
        return c.number(place, "mass_kg", mass, LIMITS);
    }
    let volume = weighted_m3(solid);
    if is_flat(solid, volume) {
        let what =
            format!("encloses only {volume:.1e} m³, which gives no mass: its triangles are in one plane or not closed");
        c.wrong(place, "file", what, "expected a closed surface, or `mass_kg`, or `fixed = true`");
        return 1.0;
    }
    let mass = density * volume;
    if !MASS.contains(mass) {
        let what = format!("gives a mass of {mass:.3e} kg");
        c.wrong(place, "density_kg_m3", what, format!("expected a density that gives {MASS}; or set `mass_kg`"));
        return 1.0;
    }
    mass
}

/// Whether triangles enclose next to nothing of the box around them: volumes are computed in single precision.
fn is_flat(solid: &Solid, volume: f64) -> bool {
    let (Solid::Hull { points_m } | Solid::Mesh { points_m, .. }) = solid else { return false };
    let corners = points_m.iter().copied().reduce(DVec3::min).zip(points_m.iter().copied().reduce(DVec3::max));
    corners.is_none_or(|(low, high)| volume < 1e-7 * low.distance(high).powi(3))
}

/// Its volume, of parts each times its relative density.
fn weighted_m3(solid: &Solid) -> f64 {
    match solid {
        Solid::Compound { parts } => parts.iter().map(|part| volume_m3(&part.solid) * part.density).sum(),
        solid => volume_m3(solid),
    }
}

/// The volume a solid encloses; zero of one whose surface is none, as of an open mesh.
fn volume_m3(solid: &Solid) -> f64 {
    match solid {
        Solid::Mesh { .. } => {
            solid.to_shared_shape().map_or(0.0, |shape| f64::from(shape.mass_properties(1.0).mass()).abs())
        }
        solid => solid.volume_m3().unwrap_or(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_turn_about_the_worlds_axes_in_turn() {
        // about x, z goes to -y; about z, -y goes to x
        let turned = rotation(DVec3::new(90.0, 0.0, 90.0)) * DVec3::Z;
        assert!(turned.distance(DVec3::X) < 1e-15, "{turned}"); // two rotations, one ulp each
    }

    #[test]
    fn triangles_in_one_plane_enclose_nothing_and_a_thin_plate_does() {
        let plate = |height: f64| {
            let corner = |i: i32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), height * f64::from(i >> 2));
            let corners: Vec<DVec3> = (0..8).map(corner).collect();
            let faces = [
                [0, 2, 1],
                [1, 2, 3],
                [4, 5, 6],
                [5, 7, 6],
                [0, 1, 4],
                [1, 5, 4],
                [2, 6, 3],
                [3, 6, 7],
                [0, 4, 2],
                [2, 4, 6],
                [1, 3, 5],
                [3, 7, 5],
            ];
            Solid::Mesh { points_m: corners.into(), triangles: faces.to_vec().into() }
        };
        let sheet = Solid::Mesh {
            points_m: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y].into(),
            triangles: vec![[0, 1, 2], [1, 3, 2]].into(),
        };
        assert!(is_flat(&sheet, volume_m3(&sheet)));
        let thin = plate(1e-3);
        assert!(!is_flat(&thin, volume_m3(&thin)), "{}", volume_m3(&thin));
        assert!(!is_flat(&Solid::Plane, 0.0));
    }

    #[test]
    fn volumes_are_those_of_the_formulas() {
        let cube: Vec<DVec3> =
            (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect();
        let hull = volume_m3(&Solid::Hull { points_m: cube.into() });
        assert!((hull - 1.0).abs() < 1e-5, "{hull}"); // parry computes in f32
        let capsule = volume_m3(&Solid::Capsule { radius_m: 1.0, half_height_m: 0.5 });
        assert!((capsule - std::f64::consts::PI * (7.0 / 3.0)).abs() < 1e-14);
    }
}
