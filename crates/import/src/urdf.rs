//! URDF, as of its specification (<http://wiki.ros.org/urdf/XML>): links in their own axes, joints between them.
//!
//! In: the tree of a file. Out: a [`Model`]. Never here: TOML, links without mass (`settle` has them).
//! The axes of a link are the axes of the joint that it hangs on, so that a joint is at the origin of its child.

use crate::imported::{ImportError, LeftOut};
use crate::meshes::Meshes;
use crate::model::{Joint, Kind, Link, Look, Mass, Mimic, Model, Motor, Part, Shape};
use crate::pose::{Pose, fixed_angles};
use crate::xml::{DAMPING_MAX, Element, Harmless, RATIO_MAX, STRENGTH_MAX};
use glam::{DMat3, DVec3};
use metachron_core::DisjointSets;
use metachron_geometry::Solid;
use std::collections::BTreeMap;

/// Looks, other programs' tables, and limits of drives, which a robot has none of until a program drives it. Keys about
/// the motion of a joint that does not move have no meaning.
pub(crate) const HARMLESS: Harmless = Harmless {
    elements: "visual material color texture transmission safety_controller calibration sensor plugin ros2_control verbose \
        self_collision_checking axis limit dynamics mimic implicitSpringDamper provideFeedback selfCollide",
    containers: "gazebo",
    attributes: "effort velocity command_effort current gear_velocity version type id dont_collapse",
};

/// A joint as the file has it, between names.
struct Draft<'a> {
    element: &'a Element,
    parent: &'a str,
    child: &'a str,
    origin: Pose,
    kind: Kind,
    axis: DVec3,
    limits: Option<[f64; 2]>,
    motor: Option<Motor>,
    friction: f64,
    mimic: Option<MimicDraft<'a>>,
    /// The position where the joint that it follows leads it, or else zero, and that within its limits, where it starts.
    wanted: f64,
    start: f64,
    /// Whether the child moves freely.
    is_free: bool,
}

/// A joint that another one follows, as the file has it: multiplier · its position + offset.
#[derive(Clone, Copy)]
struct MimicDraft<'a> {
    element: &'a Element,
    joint: &'a str,
    multiplier: f64,
    offset: f64,
}

/// Reads a robot.
///
/// # Errors
/// [`ImportError`] at the first element that no scene can have.
pub(crate) fn read(root: &Element, mut meshes: Meshes<'_>, notes: &mut Vec<LeftOut>) -> Result<Model, ImportError> {
    if root.tag != "robot" {
        return Err(root.wrong("is not the root of a robot; expected `robot`"));
    }
    let colours = colours(root)?;
    let mut links = BTreeMap::new();
    for element in root.children("link") {
        let name = element.needed("name")?;
        if links.insert(name, element).is_some() {
            return Err(element.wrong("is there twice; expected names that are one link's each"));
        }
    }
    if links.is_empty() {
        return Err(root.wrong("has no `link`"));
    }
    let mut drafts = root.children("joint").map(draft).collect::<Result<Vec<_>, _>>()?;
    let leaders = drop_mimics(&mut drafts, notes);
    find_starts(&mut drafts, &leaders)?;
    for draft in &drafts {
        for (key, name) in [("parent", draft.parent), ("child", draft.child)] {
            if !links.contains_key(name) {
                return Err(draft.element.wrong(format!("has the {key} `{name}`, and there is no link of that name")));
            }
        }
    }
    let name = root.text("name").unwrap_or("robot").to_owned();
    let mut model = Model { name, fixes_massless: true, ..Model::default() };
    let order = order(root, &links, &drafts)?;
    let mut numbers: BTreeMap<&str, usize> = BTreeMap::new();
    for Placed { element, above } in order {
        let mut pose = Pose::IDENTITY;
        if let Some(draft) = above {
            let parent = numbers[draft.parent];
            note_start(draft, notes);
            let moved = draft.kind.motion(DVec3::ZERO, draft.axis, draft.start);
            pose = model.links[parent].pose.then(draft.origin).then(moved);
            if !draft.is_free {
                model.joints.push(joint(draft, parent, model.links.len()));
            }
        }
        numbers.insert(element.needed("name")?, model.links.len());
        let is_free = above.is_some_and(|draft| draft.is_free);
        model.links.push(Link { is_free, ..link(element, pose, &mut meshes, &colours, notes)? });
    }
    model.files = meshes.finish();
    Ok(model)
}

/// A link and the joint that it hangs on.
struct Placed<'a> {
    element: &'a Element,
    above: Option<&'a Draft<'a>>,
}

/// The links, each after the one that it hangs on.
fn order<'a>(
    root: &Element,
    links: &BTreeMap<&str, &'a Element>,
    drafts: &'a [Draft<'a>],
) -> Result<Vec<Placed<'a>>, ImportError> {
    let mut above: BTreeMap<&str, &Draft<'_>> = BTreeMap::new();
    for draft in drafts {
        if let Some(other) = above.insert(draft.child, draft) {
            let reason = format!(
                "has the child `{}`, which {} has, too; expected a tree",
                draft.child, other.element.place.label
            );
            return Err(draft.element.wrong(reason));
        }
    }
    let in_file = || root.children("link").filter_map(|element| links.get(element.text("name")?).copied());
    let name = |element: &'a Element| element.text("name").unwrap_or_default();
    let roots = in_file().filter(|element| !above.contains_key(name(element)));
    let mut order: Vec<Placed<'a>> = roots.map(|element| Placed { element, above: None }).collect();
    let mut at = 0;
    while at < order.len() {
        let parent = name(order[at].element);
        let hanging = drafts.iter().filter(|draft| draft.parent == parent);
        order.extend(hanging.filter_map(|d| Some(Placed { element: links.get(d.child)?, above: Some(d) })));
        at += 1;
    }
    if order.len() < links.len() {
        let reached: Vec<&str> = order.iter().map(|placed| name(placed.element)).collect();
        let lost = in_file().find(|element| !reached.contains(&name(element))).unwrap_or(root);
        return Err(lost.wrong("hangs on itself through its joints; expected a tree"));
    }
    Ok(order)
}

fn draft(element: &Element) -> Result<Draft<'_>, ImportError> {
    let end =
        |tag: &'static str| element.child(tag).ok_or_else(|| element.wrong(format!("has no `{tag}`")))?.needed("link");
    let kind_name = element.needed("type")?;
    let (kind, turns_freely) = match kind_name {
        "fixed" | "floating" => (Kind::Fixed, false),
        "revolute" => (Kind::Revolute, false),
        "continuous" => (Kind::Revolute, true),
        "prismatic" => (Kind::Prismatic, false),
        "spherical" => (Kind::Spherical, false),
        other => {
            let expected = "expected fixed, revolute, continuous, prismatic, spherical or floating";
            return Err(element.wrong(format!("is of the type `{other}`; {expected}")));
        }
    };
    let moves = kind.travels();
    let mut axis = DVec3::X;
    if let Some(given) = moves.then(|| element.child("axis")).flatten() {
        axis = given.numbers("xyz")?.map_or(axis, DVec3::from_array);
        if axis.length() < 1e-9 {
            return Err(given.wrong("has no direction; expected a vector longer than 0"));
        }
    }
    let limits = if moves && !turns_freely { Some(limits(element)?) } else { None };
    let (motor, friction) = if moves { brakes(element)? } else { (None, 0.0) };
    let mimic = if moves { mimic(element)? } else { None };
    let origin = origin(element)?;
    let (parent, child, is_free) = (end("parent")?, end("child")?, kind_name == "floating");
    let (wanted, start) = (0.0, 0.0);
    Ok(Draft { element, parent, child, origin, kind, axis, limits, motor, friction, mimic, wanted, start, is_free })
}

/// The limits of a joint; of one that the file says nothing about both are zero, as in the specification.
fn limits(element: &Element) -> Result<[f64; 2], ImportError> {
    let given =
        element.child("limit").ok_or_else(|| element.wrong("has no `limit`; expected its `lower` and `upper`"))?;
    let [lower, upper] = [given.number("lower")?.unwrap_or(0.0), given.number("upper")?.unwrap_or(0.0)];
    if lower > upper {
        return Err(given.wrong(format!("has the `lower` {lower} above its `upper` {upper}")));
    }
    Ok([lower, upper])
}

/// The damper of a joint and its dry friction.
fn brakes(element: &Element) -> Result<(Option<Motor>, f64), ImportError> {
    let Some(given) = element.child("dynamics") else { return Ok((None, 0.0)) };
    given.read_zeros(&["spring_stiffness", "spring_reference"]);
    let (damping, friction) = (given.up_to(DAMPING_MAX, "damping")?, given.up_to(STRENGTH_MAX, "friction")?);
    Ok(((damping > 0.0).then_some(Motor::Damper { velocity: 0.0, damping, max_effort: None }), friction))
}

/// The joint that a joint follows.
fn mimic(element: &Element) -> Result<Option<MimicDraft<'_>>, ImportError> {
    let Some(given) = element.child("mimic") else { return Ok(None) };
    let [multiplier, offset] = [given.number("multiplier")?.unwrap_or(1.0), given.number("offset")?.unwrap_or(0.0)];
    if multiplier.abs() > RATIO_MAX {
        return Err(given.wrong(format!("`multiplier` is {multiplier}; expected -{RATIO_MAX} to {RATIO_MAX}")));
    }
    Ok(Some(MimicDraft { element: given, joint: given.needed("joint")?, multiplier, offset }))
}

/// Lets joints that follow themselves, a joint that does not move, or none, move by themselves; the joint that each of the others follows.
fn drop_mimics(drafts: &mut [Draft<'_>], notes: &mut Vec<LeftOut>) -> Vec<Option<usize>> {
    // of joints of one name the first
    let named = drafts.iter().enumerate().rev().filter_map(|(at, draft)| Some((draft.element.text("name")?, at)));
    let named: BTreeMap<&str, usize> = named.collect();
    let mut leaders = vec![None; drafts.len()];
    let mut tied = DisjointSets::of(drafts.len());
    for at in 0..drafts.len() {
        let Some(mimic) = drafts[at].mimic else { continue };
        let why = match named.get(mimic.joint).copied() {
            None => "there is no joint of that name",
            Some(leads) if !drafts[leads].kind.travels() => "that joint does not move",
            Some(leads) if !tied.join(at, leads) => "it follows itself",
            found => {
                leaders[at] = found;
                continue;
            }
        };
        notes.push(mimic.element.note(format!("is left out: it names `{}`, and {why}", mimic.joint)));
        drafts[at].mimic = None;
    }
    leaders
}

/// Finds the positions at which joints start: each after the one that it follows.
fn find_starts(drafts: &mut [Draft<'_>], leaders: &[Option<usize>]) -> Result<(), ImportError> {
    let mut is_found = vec![false; drafts.len()];
    for at in 0..drafts.len() {
        let mut chain: Vec<usize> =
            std::iter::successors(Some(at), |joint| leaders[*joint].filter(|above| !is_found[*above])).collect();
        while let Some(at) = chain.pop() {
            let led = drafts[at].mimic.zip(leaders[at]);
            let wanted = led.map_or(0.0, |(mimic, leads)| mimic.multiplier * drafts[leads].start + mimic.offset);
            let draft = &mut drafts[at];
            if wanted.abs() > RATIO_MAX {
                let what = format!(
                    "would start at {wanted:e}, where the joint that it follows leads it; expected {RATIO_MAX} at most"
                );
                return Err(draft.element.wrong(what));
            }
            draft.wanted = wanted;
            draft.start = draft.limits.map_or(wanted, |[lower, upper]| wanted.clamp(lower, upper));
            is_found[at] = true;
        }
    }
    Ok(())
}

/// Lists a joint that starts elsewhere than it wants to.
fn note_start(draft: &Draft<'_>, notes: &mut Vec<LeftOut>) {
    let Draft { start, wanted, .. } = *draft;
    if start == wanted {
        return;
    }
    notes.push(match draft.mimic {
        Some(MimicDraft { joint, .. }) => {
            let what = format!("starts at {start} and follows `{joint}` from there: its limits end before {wanted}");
            draft.element.note(what)
        }
        None => {
            let what = format!("starts at {start}, the end of its limits that is nearest to zero");
            draft.element.note(what).harmless()
        }
    });
}

fn joint(draft: &Draft<'_>, parent: usize, child: usize) -> Joint {
    Joint {
        name: draft.element.text("name").unwrap_or_default().to_owned(),
        kind: draft.kind,
        axis: draft.axis,
        range: draft.limits.map(|limits| limits.map(|end| end - draft.start)),
        motor: draft.motor,
        friction: draft.friction,
        mimic: draft.mimic.map(|mimic| Mimic { joint: mimic.joint.to_owned(), ratio: mimic.multiplier }),
        ..Joint::weld(draft.element.place.clone(), Some(parent), child)
    }
}

/// The pose of an element's `origin`.
fn origin(element: &Element) -> Result<Pose, ImportError> {
    let Some(origin) = element.child("origin") else { return Ok(Pose::IDENTITY) };
    let position = origin.numbers("xyz")?.map_or(DVec3::ZERO, DVec3::from_array);
    let [roll, pitch, yaw] = origin.numbers("rpy")?.unwrap_or_default();
    Ok(Pose { position, rotation: fixed_angles(roll, pitch, yaw) })
}

fn link(
    element: &Element,
    pose: Pose,
    meshes: &mut Meshes<'_>,
    colours: &BTreeMap<&str, [u8; 3]>,
    notes: &mut Vec<LeftOut>,
) -> Result<Link, ImportError> {
    // visual shapes stand in where there is no collision shape; otherwise they stay unread, and are listed
    let touches = element.all().iter().any(|child| child.tag == "collision");
    let (mut parts, first) = (Vec::new(), notes.len());
    for geometry in element.children(if touches { "collision" } else { "visual" }) {
        let Some(shape) = shape(geometry, meshes, notes)? else { continue };
        let pose = origin(geometry)?;
        parts.push(Part { place: geometry.place.clone(), shape, pose, density_kg_m3: None, touches });
    }
    if !touches {
        notes[first..].iter_mut().for_each(|note| note.changes_motion = false);
    }
    let look = Look { colour: colour(element, touches, colours)?, surface: None };
    let name = element.needed("name")?.to_owned();
    Ok(Link { mass: mass(element)?, parts, look, ..Link::at(name, element.place.clone(), pose) })
}

fn mass(element: &Element) -> Result<Mass, ImportError> {
    let Some(inertial) = element.child("inertial") else { return Ok(Mass::None) };
    let mass = inertial.child("mass").ok_or_else(|| inertial.wrong("has no `mass`"))?;
    let mass_kg = mass.needed_number("value")?;
    if mass_kg < 0.0 {
        return Err(mass.wrong(format!("`value` is {mass_kg}; expected zero or more")));
    }
    if mass_kg == 0.0 {
        inertial.read_all_within();
        return Ok(Mass::None);
    }
    let at = origin(inertial)?;
    let tensor = inertial.child("inertia").ok_or_else(|| inertial.wrong("has no `inertia`"))?;
    let moment = |name: &str| tensor.needed_number(name);
    let [xx, yy, zz] = [moment("ixx")?, moment("iyy")?, moment("izz")?];
    let product = |name: &str| Ok::<_, ImportError>(tensor.number(name)?.unwrap_or(0.0));
    let [xy, xz, yz] = [product("ixy")?, product("ixz")?, product("iyz")?];
    let own = DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz));
    let turn = DMat3::from_quat(at.rotation);
    Ok(Mass::Given { mass_kg, com_m: at.position, inertia_kg_m2: Some(turn * own * turn.transpose()) })
}

/// The shape of a `visual` or `collision`; a mesh that scenes cannot have is noted.
fn shape(element: &Element, meshes: &mut Meshes<'_>, notes: &mut Vec<LeftOut>) -> Result<Option<Shape>, ImportError> {
    let geometry = element.child("geometry").ok_or_else(|| element.wrong("has no `geometry`"))?;
    let Some(kind) = geometry.all().first() else { return Err(geometry.wrong("is empty; expected a shape")) };
    Ok(match kind.tag.as_str() {
        "sphere" => Some(Shape::Solid(Solid::Ball { radius_m: kind.read().positive("radius")? })),
        "box" => {
            let size = kind.read().numbers::<3>("size")?.ok_or_else(|| kind.wrong("has no `size`"))?;
            if size.iter().any(|edge| *edge <= 0.0) {
                return Err(kind.wrong(format!("`size` is {size:?}; expected three edges above zero")));
            }
            Some(Shape::Solid(Solid::Box { half_extents_m: DVec3::from_array(size) / 2.0 }))
        }
        "cylinder" | "capsule" => {
            let (radius_m, half_height_m) = (kind.read().positive("radius")?, kind.positive("length")? / 2.0);
            Some(Shape::Solid(if kind.tag == "cylinder" {
                Solid::Cylinder { radius_m, half_height_m }
            } else {
                Solid::Capsule { radius_m, half_height_m }
            }))
        }
        "mesh" => mesh(kind, meshes, notes)?,
        _ => {
            notes.push(kind.read().note("is left out: it is no shape of a scene"));
            None
        }
    })
}

fn mesh(kind: &Element, meshes: &mut Meshes<'_>, notes: &mut Vec<LeftOut>) -> Result<Option<Shape>, ImportError> {
    let name = kind.read().needed("filename")?;
    let scale = kind.numbers("scale")?.unwrap_or([1.0; 3]);
    match meshes.hull(kind, name, scale)? {
        Ok(hull) => Ok(Some(hull)),
        Err(why) => {
            notes.push(kind.note(format!("`{name}` is left out: {why}")));
            Ok(None)
        }
    }
}

/// The colours of a robot's materials by name.
fn colours(root: &Element) -> Result<BTreeMap<&str, [u8; 3]>, ImportError> {
    let mut found = BTreeMap::new();
    let links = root.all().iter().filter(|element| element.tag == "link");
    let of_links = links.flat_map(Element::all).flat_map(Element::all).filter(|element| element.tag == "material");
    for material in root.children("material").chain(of_links) {
        if let (Some(name), Some(colour)) = (material.text("name"), own_colour(material)?) {
            found.insert(name, colour);
        }
    }
    Ok(found)
}

fn own_colour(material: &Element) -> Result<Option<[u8; 3]>, ImportError> {
    let Some(colour) = material.child("color") else { return Ok(None) };
    Ok(colour.numbers::<4>("rgba")?.map(|[r, g, b, _]| [r, g, b].map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)))
}

/// The colour of a link: that of the first thing that is seen of it.
fn colour(element: &Element, touches: bool, colours: &BTreeMap<&str, [u8; 3]>) -> Result<Option<[u8; 3]>, ImportError> {
    let visual = element.all().iter().find(|child| child.tag == "visual");
    let Some(material) = visual.and_then(|v| v.all().iter().find(|child| child.tag == "material")) else {
        return Ok(None);
    };
    if !touches {
        material.read();
    }
    let named = material.text("name").and_then(|name| colours.get(name).copied());
    Ok(own_colour(material)?.or(named))
}
