//! A settled model as the text of a scene.
//!
//! In: a [`Model`] where every link has a mass and a part. Out: TOML. Never here: the format that the model was read
//! from.

use crate::imported::LeftOut;
use crate::model::{
    Apart, End, Fixed, Joint, Kind, Link, Look, Masks, Mass, Mimic, Model, Motor, Part, Shape, Tie, TieKind, Why,
};
use crate::pose::{Pose, fixed_angles_deg};
use glam::{DMat3, DQuat, DVec3};
use metachron_geometry::Solid;
use std::collections::BTreeSet;
use std::fmt::Write;

/// Largest angle of a range of a scene, radians, and a little for rounding.
const ANGLE_MAX_RAD: f64 = std::f64::consts::PI * (1.0 + 1e-12);
/// A number this much smaller than its neighbours is rounding.
const NOTHING: f64 = 1e-12;
/// Where something is within this of the origin, metres, it is there.
const SAME_M: f64 = 1e-12;

/// The text of a scene; parts of the model that do not fit in it go to `notes`.
pub(crate) fn write(model: &Model, notes: &mut Vec<LeftOut>) -> String {
    let mut out = String::from("format = 1\n");
    put(&mut out, "description", &quoted(&format!("{}, imported", model.name)));
    if let Some(gravity) = model.gravity_m_s2 {
        out.push_str("\n[world]\n");
        put(&mut out, "gravity_m_s2", &vector(gravity));
    }
    let masks = all_masks(model);
    for fixed in &model.fixed {
        let way = if model.is_apart(&fixed.name) { "kinematic" } else { "fixed" };
        write_fixed(&mut out, fixed, way, &masks);
    }
    for link in &model.links {
        write_link(&mut out, link, &masks);
    }
    for joint in &model.joints {
        write_joint(&mut out, model, joint, notes);
    }
    for tie in &model.ties {
        write_tie(&mut out, model, tie);
    }
    for pair in &model.apart {
        write_apart(&mut out, pair);
    }
    out
}

fn write_apart(out: &mut String, Apart { a, b, why }: &Apart) {
    out.push('\n');
    match why {
        Why::Excluded => {}
        Why::Neighbours => out.push_str("# neighbours\n"),
        Why::Overlap { depth_m } => {
            writeln!(out, "# they overlap by {:.3} mm at the start", depth_m * 1e3).expect("a string takes all");
        }
    }
    out.push_str("[[coupling]]\n");
    put(out, "a", &quoted(a));
    put(out, "b", &quoted(b));
    put(out, "law", "\"off\"");
}

fn put(out: &mut String, key: &str, value: &str) {
    writeln!(out, "{key} = {value}").expect("a string takes all");
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A length or an angle: digits beyond the twelfth after the point are rounding.
fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.12}").parse().unwrap_or(value);
    // + 0.0 turns -0 into 0
    exact(rounded + 0.0)
}

/// A number with all of its digits, as TOML writes one that is no integer.
fn exact(value: f64) -> String {
    format!("{value:?}")
}

/// Whether a rotation is one only by rounding.
fn is_none(rotation: DQuat) -> bool {
    rotation.xyz().length() < NOTHING
}

fn vector(v: DVec3) -> String {
    format!("[{}, {}, {}]", number(v.x), number(v.y), number(v.z))
}

/// A solid that stays: `fixed`, or `kinematic` where something passes through it, as couplings are between objects that
/// can move.
fn write_fixed(out: &mut String, fixed: &Fixed, way: &str, masks: &BTreeSet<Masks>) {
    out.push_str("\n[[object]]\n");
    put(out, "name", &quoted(&fixed.name));
    put(out, "model", "\"rigid\"");
    put(out, way, "true");
    write_shape(out, &fixed.part.shape);
    write_pose(out, fixed.part.pose);
    write_look(out, &fixed.look, fixed.part.touches, masks);
}

/// A link: its object has the axes of the link, so that one solid elsewhere in them is a part, too.
fn write_link(out: &mut String, link: &Link, masks: &BTreeSet<Masks>) {
    out.push_str("\n[[object]]\n");
    put(out, "name", &quoted(&link.name));
    put(out, "model", "\"rigid\"");
    let simple = |part: &Part| {
        part.pose.position.length() < SAME_M && is_none(part.pose.rotation) && part.density_kg_m3.is_none()
    };
    let whole = match link.parts.as_slice() {
        [part] if simple(part) => Some(part),
        _ => None,
    };
    match whole {
        Some(part) => write_shape(out, &part.shape),
        None => put(out, "shape", "\"compound\""),
    }
    write_pose(out, link.pose);
    write_mass(out, &link.mass);
    write_look(out, &link.look, link.parts.iter().any(|part| part.touches), masks);
    for part in link.parts.iter().filter(|_| whole.is_none()) {
        out.push_str("\n[[object.part]]\n");
        write_shape(out, &part.shape);
        write_pose(out, part.pose);
        if let Some(density) = part.density_kg_m3 {
            put(out, "density_kg_m3", &exact(density.max(1e-3)));
        }
    }
}

fn write_shape(out: &mut String, shape: &Shape) {
    let (name, keys) = match shape {
        Shape::Solid(Solid::Ball { radius_m }) => ("ball", vec![("radius_m", number(*radius_m))]),
        Shape::Solid(Solid::Box { half_extents_m }) => ("box", vec![("half_extents_m", vector(*half_extents_m))]),
        Shape::Solid(Solid::Capsule { radius_m, half_height_m }) => {
            ("capsule", vec![("radius_m", number(*radius_m)), ("half_height_m", number(*half_height_m))])
        }
        Shape::Solid(Solid::Cylinder { radius_m, half_height_m }) => {
            ("cylinder", vec![("radius_m", number(*radius_m)), ("half_height_m", number(*half_height_m))])
        }
        Shape::Solid(_) => ("plane", Vec::new()),
        Shape::Hull { file, scale } => {
            let scale = (*scale != 1.0).then(|| ("scale", exact(*scale)));
            ("hull", std::iter::once(("file", quoted(file))).chain(scale).collect())
        }
        Shape::Ellipsoid { file, .. } => ("hull", vec![("file", quoted(file))]),
        Shape::Ground { file } => ("mesh", vec![("file", quoted(file))]),
    };
    put(out, "shape", &quoted(name));
    for (key, value) in keys {
        put(out, key, &value);
    }
}

fn write_pose(out: &mut String, pose: Pose) {
    if pose.position.length() >= SAME_M {
        put(out, "position_m", &vector(pose.position));
    }
    if !is_none(pose.rotation) {
        put(out, "rotation_deg", &vector(fixed_angles_deg(pose.rotation)));
    }
}

fn write_mass(out: &mut String, mass: &Mass) {
    let Mass::Given { mass_kg, com_m, inertia_kg_m2 } = mass else { return };
    put(out, "mass_kg", &exact(*mass_kg));
    let Some(DMat3 { x_axis, y_axis, z_axis }) = inertia_kg_m2 else { return };
    let least = NOTHING * x_axis.x.max(y_axis.y).max(z_axis.z);
    let all = [x_axis.x, y_axis.y, z_axis.z, y_axis.x, z_axis.x, z_axis.y];
    let all = all.map(|value| if value.abs() < least { exact(0.0) } else { exact(value) });
    put(out, "centre_of_mass_m", &vector(*com_m));
    put(out, "inertia_kg_m2", &format!("[{}]", all.join(", ")));
}

fn write_look(out: &mut String, look: &Look, touches: bool, all: &BTreeSet<Masks>) {
    if let Some([r, g, b]) = look.colour {
        put(out, "colour", &quoted(&format!("#{r:02x}{g:02x}{b:02x}")));
    }
    match look.surface {
        _ if !touches => put(out, "contact", "{ collides_with = [] }"),
        Some(surface) => {
            put(out, "friction", &exact(surface.friction));
            put(out, "restitution", "0.0");
            put(out, "contact", &format!("{{ {}friction_rule = \"max\" }}", groups(surface.masks, all)));
        }
        None => {}
    }
}

/// The masks of all surfaces that have some.
fn all_masks(model: &Model) -> BTreeSet<Masks> {
    let fixed = model.fixed.iter().filter(|fixed| fixed.part.touches).map(|fixed| &fixed.look);
    let links = model.links.iter().filter(|link| link.parts.iter().any(|part| part.touches)).map(|link| &link.look);
    fixed.chain(links).filter_map(|look| Some(look.surface?.masks)).collect()
}

/// The groups of a surface: each pair of masks is a group, which collides with the groups that it should. None where
/// all have the usual masks.
fn groups(masks: Masks, all: &BTreeSet<Masks>) -> String {
    if all.iter().all(|masks| *masks == Masks::USUAL) {
        return String::new();
    }
    let name = |masks: &Masks| quoted(&format!("{:x}-{:x}", masks.types, masks.partners));
    let partners: Vec<String> = all.iter().filter(|other| masks.collides(**other)).map(name).collect();
    format!("groups = [{}], collides_with = [{}], ", name(&masks), partners.join(", "))
}

/// A joint. Its first object is the parent, or the child where the parent is the world, which scenes write second: the
/// two change sides then, and so does the axis.
fn write_joint(out: &mut String, model: &Model, joint: &Joint, notes: &mut Vec<LeftOut>) {
    let child = &model.links[joint.child];
    let (a, b, from, sign) = match joint.parent.map(|parent| &model.links[parent]) {
        Some(parent) => (&parent.name, child.name.as_str(), parent.pose.inverse().then(child.pose), 1.0),
        None => (&child.name, "world", Pose::IDENTITY, -1.0),
    };
    let kind = match joint.kind {
        Kind::Fixed => "fixed",
        Kind::Revolute => "revolute",
        Kind::Spherical => "spherical",
        Kind::Prismatic => "prismatic",
    };
    out.push_str("\n[[joint]]\n");
    if !joint.name.is_empty() {
        put(out, "name", &quoted(&joint.name));
    }
    put(out, "kind", &quoted(kind));
    put(out, "a", &quoted(a));
    put(out, "b", &quoted(b));
    let at = from.point(joint.anchor_m);
    if at.length() >= SAME_M {
        put(out, "at_a_m", &vector(at));
    }
    let Some(unit) = Unit::of(joint.kind) else { return };
    for (key, value) in [(unit.friction, joint.friction), (unit.armature, joint.armature)] {
        if value > 0.0 {
            put(out, key, &exact(value));
        }
    }
    if joint.kind == Kind::Spherical {
        return;
    }
    put(out, "axis", &vector(from.rotation * joint.axis.normalize() * sign));
    match joint.range {
        Some(range) if unit.is_angle && range.iter().any(|end| end.abs() > ANGLE_MAX_RAD) => {
            let what = "its limits are left out: they are more than half a turn from the start";
            notes.push(joint.place.note(what));
        }
        Some(range) => put(out, unit.range, &format!("[{}, {}]", unit.position(range[0]), unit.position(range[1]))),
        None => {}
    }
    if let Some(motor) = joint.motor {
        put(out, "motor", &unit.motor(within(motor, joint, notes)));
    }
    if let Some(Mimic { joint, ratio }) = &joint.mimic {
        put(out, "mimic", &format!("{{ joint = {}, ratio = {} }}", quoted(joint), exact(*ratio)));
    }
}

/// A rope or spring, whose first object is no world.
fn write_tie(out: &mut String, model: &Model, tie: &Tie) {
    let [a, b] = tie.ends;
    let [a, b] = if a.link.is_none() { [b, a] } else { [a, b] };
    let name = |end: End| end.link.map_or("world", |link| model.links[link].name.as_str());
    out.push_str("\n[[joint]]\n");
    let (kind, keys) = match tie.kind {
        TieKind::Rope { length_m } => ("rope", vec![("length_m", length_m)]),
        TieKind::Spring { stiffness_n_m, damping_n_s_m, rest_m } => {
            ("spring", vec![("stiffness_n_m", stiffness_n_m), ("damping_n_s_m", damping_n_s_m), ("rest_m", rest_m)])
        }
    };
    put(out, "kind", &quoted(kind));
    put(out, "a", &quoted(name(a)));
    put(out, "b", &quoted(name(b)));
    put(out, "at_a_m", &vector(a.at_m));
    put(out, "at_b_m", &vector(b.at_m));
    for (key, value) in keys {
        put(out, key, &exact(value));
    }
}

/// A motor that rests where its joint may be.
fn within(motor: Motor, joint: &Joint, notes: &mut Vec<LeftOut>) -> Motor {
    let (Motor::Spring { position, stiffness, damping, max_effort }, Some([least, greatest])) = (motor, joint.range)
    else {
        return motor;
    };
    if !(least..=greatest).contains(&position) {
        let what = "its spring or servo rests at the end of its range, where the file has it beyond";
        notes.push(joint.place.note(what));
    }
    Motor::Spring { position: position.clamp(least, greatest), stiffness, damping, max_effort }
}

/// The names in scenes of the values of a joint that turns, or slides; of a ball those of its friction and armature.
struct Unit {
    is_angle: bool,
    range: &'static str,
    position: &'static str,
    velocity: &'static str,
    effort: &'static str,
    stiffness: &'static str,
    damping: &'static str,
    friction: &'static str,
    armature: &'static str,
}

impl Unit {
    const fn of(kind: Kind) -> Option<Self> {
        match kind {
            Kind::Revolute | Kind::Spherical => Some(Self {
                is_angle: true,
                range: "range_deg",
                position: "position_deg",
                velocity: "velocity_rad_s",
                effort: "max_torque_n_m",
                stiffness: "stiffness_n_m_rad",
                damping: "damping_n_m_s_rad",
                friction: "friction_n_m",
                armature: "armature_kg_m2",
            }),
            Kind::Prismatic => Some(Self {
                is_angle: false,
                range: "range_m",
                position: "position_m",
                velocity: "velocity_m_s",
                effort: "max_force_n",
                stiffness: "stiffness_n_m",
                damping: "damping_n_s_m",
                friction: "friction_n",
                armature: "armature_kg",
            }),
            Kind::Fixed => None,
        }
    }

    fn position(&self, value: f64) -> String {
        number(if self.is_angle { value.to_degrees().clamp(-180.0, 180.0) } else { value })
    }

    fn motor(&self, motor: Motor) -> String {
        let (goal, max_effort) = match motor {
            Motor::Spring { position, stiffness, damping, max_effort } => {
                let goal =
                    format!("{} = {}, {} = {stiffness:?}", self.position, self.position(position), self.stiffness);
                let damper = if damping > 0.0 { format!(", {} = {damping:?}", self.damping) } else { String::new() };
                (goal + &damper, max_effort)
            }
            Motor::Damper { velocity, damping, max_effort } => {
                (format!("{} = {}, {} = {damping:?}", self.velocity, number(velocity), self.damping), max_effort)
            }
        };
        let most = max_effort.map_or(String::new(), |most| format!(", {} = {most:?}", self.effort));
        format!("{{ {goal}{most} }}")
    }
}
