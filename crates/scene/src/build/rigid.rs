//! A rigid object of the file as a [`RigidSpec`], or as an [`Obstacle`] where it is fixed.

use super::common::{point, rotation};
use super::inertia::inertia;
use super::mesh::{self, Mesh};
use super::objects::{ModelContext, RigidFiles};
use super::scenery::{SurfaceSource, surface_source};
use crate::check::{Checker, Place};
use crate::demand::Cost;
use crate::format::{Axis, Point, RigidFile, Shape, SolidShapeFile};
use crate::source::Source;
use glam::{DQuat, DVec3};
use metachron_drawable::generate_surface;
use metachron_geometry::{Aabb, CompoundPart, ContactTraits, Obstacle, Solid, hull_corners};
use metachron_models::rigid::{Keyframe, Led, MASS, Restraint, RigidSpec};
use std::sync::Arc;

/// Density where a scene gives neither mass nor density: water's, kg/m³.
const DENSITY_DEFAULT_KG_M3: f64 = 1000.0;

/// The same where the scene does not say, metres, and at most this share of the diagonal of the box around them.
const HULL_WITHIN_M: f64 = 1e-4;
const HULL_SHARE: f64 = 1e-3;

/// The keys that lead an object that forces do not move.
const LED: [&str; 2] = ["keyframe", "repeat"];
/// The keys that slow down, or keep from moving, an object that forces move.
const RESTRAINT: [&str; 5] =
    ["gravity_scale", "linear_damping_per_s", "angular_damping_per_s", "lock_translation", "lock_rotation"];

/// Whether the object never moves; reports a plane with `fixed = false`.
pub(super) fn is_fixed(c: &mut Checker<'_, '_>, place: &Place, files: &RigidFiles) -> bool {
    let (file, plane) = (&files.body, files.solid.shape == Shape::Plane);
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
pub(super) fn obstacle(
    c: &mut Checker<'_, '_>,
    place: &Place,
    files: &RigidFiles,
    source: &Source,
) -> Option<Obstacle> {
    let RigidFiles { solid: shape, body: file } = files;
    let moves = |given: Option<Point>| given.is_some_and(|v| v != [0.0; 3]);
    let moved = [
        ("velocity_m_s", moves(file.velocity_m_s)),
        ("spin_rad_s", moves(file.spin_rad_s)),
        ("kinematic", file.kinematic == Some(true)),
        ("keyframe", file.keyframe.is_some()),
    ];
    for (key, _) in moved.into_iter().filter(|(_, given)| *given) {
        c.wrong(place, key, "moves an object that is fixed", "expected no motion, or `fixed = false`");
    }
    if shape.shape == Shape::Compound {
        c.wrong(place, "shape", "is a compound, and the object is fixed", "expected fixed objects, one for each part");
        return None;
    }
    refuse_restraint(c, place, "an object that is fixed");
    let solid = solid(c, place, files, PartContext { source, density_kg_m3: DENSITY_DEFAULT_KG_M3, is_fixed: true })?;
    Some(Obstacle {
        name: String::new(),
        solid,
        position: point(shape.position_m),
        rotation: rotation(shape.rotation_deg),
        friction: file.friction.unwrap_or(0.5),
        restitution: file.restitution.unwrap_or(0.0),
        traits: ContactTraits::default(),
    })
}

/// Reads a moving object.
pub(super) fn build(c: &mut Checker<'_, '_>, files: &RigidFiles, context: &ModelContext<'_>) -> Option<RigidSpec> {
    let (place, RigidFiles { solid: shape, body: file }) = (context.place, files);
    let before = c.count();
    let density = shape.density_kg_m3.unwrap_or(DENSITY_DEFAULT_KG_M3);
    let solid =
        solid(c, place, files, PartContext { source: context.source, density_kg_m3: density, is_fixed: false })?;
    // a wrong shape gives a wrong mass: one problem is reported, not two
    let mass_kg = if c.count() == before { mass(c, place, files, &solid) } else { 1.0 };
    let inertia = inertia(c, place, file);
    let (position, rotation) = (point(shape.position_m), rotation(shape.rotation_deg));
    let led = led(c, place, file, rotation);
    let start = led.as_ref().and_then(|led| led.keyframes.first());
    let (position, rotation) = start.map_or((position, rotation), |key| (key.tip_m, key.rotation));
    Some(RigidSpec {
        restraint: restraint(file),
        led,
        solid,
        position,
        rotation,
        velocity: point(file.velocity_m_s),
        spin: point(file.spin_rad_s),
        mass_kg,
        inertia,
        restitution: file.restitution.unwrap_or(0.0),
        friction: file.friction.unwrap_or(0.5),
        traits: context.traits,
        gravity: context.gravity * file.gravity_scale.unwrap_or(1.0),
        sleep: context.sleep,
    })
}

/// The damping of an object, and the axes along which it cannot move.
fn restraint(file: &RigidFile) -> Restraint {
    let locked = |axes: &Option<Vec<Axis>>| {
        [Axis::X, Axis::Y, Axis::Z].map(|axis| axes.as_ref().is_some_and(|locked| locked.contains(&axis)))
    };
    Restraint {
        linear_damping_per_s: file.linear_damping_per_s.unwrap_or(0.0),
        angular_damping_per_s: file.angular_damping_per_s.unwrap_or(0.0),
        locked_translation: locked(&file.lock_translation),
        locked_rotation: locked(&file.lock_rotation),
    }
}

fn refuse_restraint(c: &mut Checker<'_, '_>, place: &Place, what: &str) {
    let expected = "expected no such key, or an object that forces move";
    c.refuse(place, &RESTRAINT, format_args!("has no effect on {what}"), expected);
}

/// How a kinematic object is led; `None` for one that forces move.
fn led(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile, rotation: DQuat) -> Option<Led> {
    if file.kinematic != Some(true) {
        c.refuse(place, &LED, "is for objects that are led", "expected `kinematic = true`");
        return None;
    }
    refuse_restraint(c, place, "a kinematic object");
    let moved = ["velocity_m_s", "spin_rad_s", "position_m"];
    let moved = if file.keyframe.is_some() { &moved[..] } else { &moved[..2] };
    let what = "has no effect on a kinematic object that keyframes or commands lead";
    c.refuse(place, moved, what, "expected `[[object.keyframe]]` to say where it is");
    Some(Led { keyframes: keyframes(c, place, file, rotation), repeat: file.repeat.unwrap_or(false) })
}

fn keyframes(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile, rotation: DQuat) -> Vec<Keyframe> {
    let mut keys: Vec<Keyframe> = Vec::new();
    for (i, file) in file.keyframe.iter().flatten().enumerate() {
        let (place, before) = (place.entry("keyframe", i), keys.last().copied());
        let at_s = file.at_s.unwrap_or(0.0);
        if let Some(before) = before.filter(|before| at_s <= before.at_s) {
            let what = file.at_s.map_or("is missing".to_owned(), |at_s| format!("is {at_s}"));
            c.wrong(&place, "at_s", what, format!("expected a time after the keyframe before, {} s", before.at_s));
        }
        let start = before.map_or(rotation, |before| before.rotation);
        let turned = file.rotation_deg.map_or(start, |turn| self::rotation(Some(turn)));
        keys.push(Keyframe { at_s, tip_m: file.position_m.into(), rotation: turned, jaw: 0.0 });
    }
    keys
}

impl SolidShapeFile {
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
        // a surface has one of `file` and `generate`, which is checked where it is read
        const NEEDED: [&str; 4] = ["radius_m", "half_extents_m", "half_height_m", "part"];
        const OTHERS: [&str; 6] = ["file", "generate", "seed", "triangles", "scale", "hull_within_m"];
        let name = format!("{:?}", self.shape).to_lowercase();
        let list = self.takes().iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(" and ");
        let expected =
            if list.is_empty() { format!("a {name} has no dimensions") } else { format!("a {name} has {list}") };
        let foreign: Vec<_> = NEEDED.into_iter().chain(OTHERS).filter(|key| !self.takes().contains(key)).collect();
        c.refuse(place, &foreign, format_args!("does not belong to a {name}"), &expected);
        let missing = |key: &&str| self.takes().contains(key) && c.given(place, &[key]).is_empty();
        let missing: Vec<_> = NEEDED.into_iter().filter(missing).collect();
        for key in &missing {
            c.wrong(place, key, "is missing", format!("{expected}: expected `{key}` in this table"));
        }
        missing.is_empty()
    }

    /// The solid; of a compound nothing, as that has others.
    fn solid(&self, c: &mut Checker<'_, '_>, place: &Place, among: PartContext<'_>) -> Option<Solid> {
        let (radius_m, half_height_m) = (self.radius_m.unwrap_or_default(), self.half_height_m.unwrap_or_default());
        Some(match self.shape {
            Shape::Ball => Solid::Ball { radius_m },
            Shape::Capsule => Solid::Capsule { radius_m, half_height_m },
            Shape::Cylinder => Solid::Cylinder { radius_m, half_height_m },
            Shape::Box => Solid::Box { half_extents_m: point(self.half_extents_m) },
            Shape::Plane => Solid::Plane,
            Shape::Hull => {
                let points_m = self.points(c, place, among)?;
                let Aabb { low, high } = Aabb::of(&points_m);
                let tolerance_m = self.hull_within_m.unwrap_or(HULL_WITHIN_M.min(HULL_SHARE * low.distance(high)));
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
                let file = self.file.as_ref().map_or_else(String::new, |file| format!("`{file}` "));
                let what = format_args!("{file}has no usable shape: {why}");
                c.wrong(place, "file", what, "expected the points of a solid");
                None
            }
        }
    }

    /// The points of a hull.
    fn points(&self, c: &mut Checker<'_, '_>, place: &Place, among: PartContext<'_>) -> Option<Arc<[DVec3]>> {
        if self.file.is_none() || self.generate.is_some() {
            return Some(self.surface(c, place, among)?.0);
        }
        let points = self.read_file(c, place, among, mesh::hull_points)?;
        Some(self.scaled(&points))
    }

    fn scaled(&self, points: &[DVec3]) -> Arc<[DVec3]> {
        points.iter().map(|p| *p * self.scale.unwrap_or(1.0)).collect()
    }

    fn surface(&self, c: &mut Checker<'_, '_>, place: &Place, among: PartContext<'_>) -> Option<Surface> {
        if let SurfaceSource::Generated(kind) = surface_source(c, place, self.file.as_deref(), self.generate)? {
            let wanted = self.triangles.unwrap_or(4000);
            if !c.may_make(place, "triangles", Cost::solid(u64::from(wanted), among.is_fixed)) {
                return None;
            }
            let made = generate_surface(kind, u64::from(self.seed.unwrap_or(0)), wanted);
            return Some((self.scaled(&made.points), made.triangles.into()));
        }
        let Mesh { points, triangles, .. } = self.read_file(c, place, among, mesh::read)?;
        Some((self.scaled(&points), triangles.into()))
    }

    /// The content of its file.
    fn read_file<T>(
        &self,
        c: &mut Checker<'_, '_>,
        place: &Place,
        among: PartContext<'_>,
        read: fn(&[u8], f64) -> Result<T, String>,
    ) -> Option<T> {
        let name = self.file.as_deref()?;
        if !c.may_read(place, "file", among.source.head(name), |head| Cost::solid_of_file(head, among.is_fixed)) {
            return None;
        }
        let found = among.source.sibling(name).and_then(|bytes| read(&bytes, self.scale.unwrap_or(1.0)));
        let expected = "expected a .glb, STL or OBJ file beside the scene";
        found.map_err(|why| c.wrong(place, "file", format_args!("cannot be used: {name}: {why}"), expected)).ok()
    }
}

fn solid(c: &mut Checker<'_, '_>, place: &Place, files: &RigidFiles, among: PartContext<'_>) -> Option<Solid> {
    let RigidFiles { solid: shape, body: file } = files;
    if !shape.check(c, place) {
        return None;
    }
    let Some(parts) = file.part.as_ref().filter(|_| shape.shape == Shape::Compound) else {
        return shape.solid(c, place, among);
    };
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
fn part(c: &mut Checker<'_, '_>, place: &Place, file: &SolidShapeFile, among: PartContext<'_>) -> Option<CompoundPart> {
    if matches!(file.shape, Shape::Plane | Shape::Compound) {
        c.wrong(place, "shape", "cannot be a part", "expected a solid that is neither a plane nor a compound");
        return None;
    }
    if !file.check(c, place) {
        return None;
    }
    let solid = file.solid(c, place, among)?;
    let density = file.density_kg_m3.unwrap_or(among.density_kg_m3) / among.density_kg_m3;
    Some(CompoundPart { density, ..CompoundPart::new(solid, point(file.position_m), rotation(file.rotation_deg)) })
}

/// Points of a mesh, metres, and its triangles.
type Surface = (Arc<[DVec3]>, Arc<[[u32; 3]]>);

/// Its mass: that of the file, or that of `solid` of its density.
fn mass(c: &mut Checker<'_, '_>, place: &Place, files: &RigidFiles, solid: &Solid) -> f64 {
    let RigidFiles { solid: shape, body: file } = files;
    if let Some(mass) = file.mass_kg {
        if shape.density_kg_m3.is_some() && file.part.is_none() {
            let expected = "expected `mass_kg` or `density_kg_m3`, not both";
            c.wrong(place, "density_kg_m3", "contradicts `mass_kg`", expected);
        }
        return mass;
    }
    let volume = weighted_m3(solid);
    if is_flat(solid, volume) {
        let what =
            format!("encloses only {volume:.1e} m³, which gives no mass: its triangles are in one plane or not closed");
        c.wrong(place, "file", what, "expected a closed surface, or `mass_kg`, or `fixed = true`");
        return 1.0;
    }
    let mass = shape.density_kg_m3.unwrap_or(DENSITY_DEFAULT_KG_M3) * volume;
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
        let turned = rotation(Some([90.0, 0.0, 90.0])) * DVec3::Z;
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
