//! Bodies, and their contents.
//!
//! In: the `worldbody` of a file. Out: links, joints and solids of the world. Never here: the shapes of geoms, motors.

use super::compiler::Compiler;
use super::geoms::{Geom, Mesh};
use super::joints::StartedJoint;
use super::keyframe::Keyframe;
use crate::imported::{ImportError, LeftOut};
use crate::masses::kilograms;
use crate::meshes::Meshes;
use crate::model::{End, Fixed, Joint, Kind, Link, Look, Masks, Mass, Model, Part, Shape, Surface};
use crate::place::Place;
use crate::pose::Pose;
use crate::weight::Weight;
use crate::xml::Element;
use glam::{DMat3, DQuat, DVec3};
use std::collections::{BTreeMap, BTreeSet};

/// Reads bodies into a model.
pub(super) struct BodyReader<'a> {
    pub(super) compiler: &'a Compiler,
    pub(super) meshes: BTreeMap<String, Mesh<'a>>,
    pub(super) height_fields: BTreeMap<String, &'a Element>,
    pub(super) files: Meshes<'a>,
    pub(super) notes: &'a mut Vec<LeftOut>,
    pub(super) model: Model,
    /// The hinges and slides of the model by name; of one name the first.
    pub(super) travelling: BTreeMap<String, usize>,
    /// For each joint of the model, where the zero of its file is: from its start, radians or metres.
    pub(super) zeros: Vec<f64>,
    /// And where it starts: from the pose of the file, likewise.
    pub(super) starts: Vec<f64>,
    pub(super) sites: BTreeMap<String, Site<'a>>,
    /// `None` for a start where the file has its bodies.
    pub(super) keyframe: Option<Keyframe<'a>>,
    /// The weights of bodies that never move; `None` where that is not known.
    pub(super) static_kg: Option<f64>,
    names: BTreeSet<String>,
}

/// A point of a body.
#[derive(Debug)]
pub(super) struct Site<'a> {
    pub(super) element: &'a Element,
    pub(super) end: End,
    /// In the world, where every joint is at its `springref`, metres.
    pub(super) at_springs_m: DVec3,
}

/// The body that elements are read for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Host {
    /// `None` for the world.
    pub(super) link: Option<usize>,
    /// Its axes in the world at the start.
    pub(super) pose: Pose,
    /// The same where every joint is at its `springref`.
    at_springs: Pose,
    /// Whether it is the world, or nothing lets it move against the world.
    is_fixed: bool,
}

impl Host {
    /// The same after a joint.
    fn moved(self, joint: &StartedJoint) -> Self {
        let (pose, at_springs) = (self.pose.then(joint.motion), self.at_springs.then(joint.to_spring));
        Self { pose, at_springs, ..self }
    }
}

/// The elements of one body by kind, including the ones in its frames.
#[derive(Default)]
struct Contents<'e> {
    inertial: Option<&'e Element>,
    joints: Vec<Placed<'e>>,
    geoms: Vec<Placed<'e>>,
    bodies: Vec<Placed<'e>>,
    sites: Vec<Placed<'e>>,
}

/// An element, and the frames around it in the axes of its body.
#[derive(Clone, Copy)]
pub(super) struct Placed<'e> {
    pub(super) element: &'e Element,
    pub(super) frame: Pose,
}

impl<'e> Contents<'e> {
    fn of(element: &'e Element, compiler: &Compiler) -> Result<Self, ImportError> {
        let mut contents = Self::default();
        contents.take(element, Pose::IDENTITY, compiler)?;
        Ok(contents)
    }

    fn take(&mut self, element: &'e Element, frame: Pose, compiler: &Compiler) -> Result<(), ImportError> {
        for child in element.all() {
            let placed = Placed { element: child, frame };
            match child.tag.as_str() {
                "inertial" => self.inertial = Some(child.read()),
                "joint" | "freejoint" => self.joints.push(Placed { element: child.read(), frame }),
                "geom" => self.geoms.push(placed),
                "body" => self.bodies.push(placed),
                "site" => self.sites.push(placed),
                "frame" => self.take(child.read(), frame.then(compiler.pose(child)?), compiler)?,
                _ => {}
            }
        }
        Ok(())
    }
}

impl<'a> BodyReader<'a> {
    pub(super) fn new(compiler: &'a Compiler, files: Meshes<'a>, notes: &'a mut Vec<LeftOut>) -> Self {
        // no object of a scene can have the name of the world
        let names = BTreeSet::from(["world".to_owned()]);
        Self {
            compiler,
            meshes: BTreeMap::new(),
            height_fields: BTreeMap::new(),
            files,
            notes,
            model: Model::default(),
            travelling: BTreeMap::new(),
            zeros: Vec::new(),
            starts: Vec::new(),
            sites: BTreeMap::new(),
            keyframe: None,
            static_kg: Some(0.0),
            names,
        }
    }

    pub(super) fn finish(self) -> Model {
        Model { files: self.files.finish(), ..self.model }
    }

    /// Reads the world and all bodies in it.
    pub(super) fn world(&mut self, element: &'a Element) -> Result<(), ImportError> {
        let contents = Contents::of(element, self.compiler)?;
        for placed in &contents.geoms {
            let Some(geom) = self.geom(*placed)? else { continue };
            let name = self.unused(placed.element.text("name"), "geom");
            let look = look(std::slice::from_ref(&geom));
            self.model.fixed.push(Fixed { name, root: None, link: None, look, part: geom.part });
        }
        let world = Host { link: None, pose: Pose::IDENTITY, at_springs: Pose::IDENTITY, is_fixed: true };
        self.note_sites(&contents, world)?;
        contents.bodies.iter().try_for_each(|body| self.body(*body, world))
    }

    fn body(&mut self, placed: Placed<'a>, host: Host) -> Result<(), ImportError> {
        let element = placed.element.read();
        let contents = Contents::of(element, self.compiler)?;
        let place = element.place.clone();
        let name = self.unused(element.text("name"), "body");
        element.read_zeros(&["gravcomp"]);
        let rest = placed.frame.then(self.compiler.pose(element)?);
        let is_fixed = host.is_fixed && contents.joints.is_empty();
        let from = Host { pose: host.pose.then(rest), at_springs: host.at_springs.then(rest), ..host };
        let (last, above) = match contents.joints.split_last() {
            Some((last, outer)) => (Some(last), self.carriers(outer, from, &name, &place)?),
            None => (None, from),
        };
        let index = self.model.links.len();
        let joint = last.map(|last| self.joint(*last, above, index)).transpose()?;
        if let Some((last, true)) =
            last.zip(joint.as_ref().map(|joint| joint.between.is_none() && contents.joints.len() > 1))
        {
            return Err(free_with_others(*last));
        }
        let above = joint.as_ref().map_or(above, |joint| above.moved(joint));
        let pose = above.pose;
        let geoms = self.geoms(&contents, is_fixed)?;
        let mass =
            if is_fixed { self.static_mass(contents.inertial, &geoms)? } else { self.mass(contents.inertial, &geoms)? };
        let look = look(&geoms);
        if let Some(one) = look.surface
            && geoms.iter().any(|geom| geom.part.touches && geom.surface != one)
        {
            self.notes.push(element.note(
                "has geoms of several frictions or masks: the largest friction is that of all, and all masks together",
            ));
        }
        let parts: Vec<Part> = geoms.iter().map(|geom| density(geom, &mass)).collect();
        let is_free = joint.as_ref().is_some_and(|joint| joint.between.is_none());
        self.model.links.push(Link { is_free, mass, parts, look, ..Link::at(name, place.clone(), pose) });
        match joint {
            None => self.push_joint(StartedJoint::still(Some(Joint::weld(place, host.link, index)))),
            Some(joint) => self.push_joint(joint),
        }
        let here = Host { link: Some(index), is_fixed, ..above };
        self.note_sites(&contents, here)?;
        contents.bodies.iter().try_for_each(|body| self.body(*body, here))
    }

    /// Whether a body is part of the world.
    pub(super) fn is_static(&self, link: usize) -> bool {
        let mut above = self.model.joints.iter().find(|joint| joint.child == link);
        while let Some(joint) = above.filter(|joint| joint.kind == Kind::Fixed && joint.parent.is_some()) {
            above = self.model.joints.iter().find(|one| Some(one.child) == joint.parent);
        }
        above.is_some_and(|joint| joint.kind == Kind::Fixed && joint.parent.is_none())
    }

    /// Links without mass, one for each joint of a body but its last, as the joints follow each other; the last of them.
    fn carriers(&mut self, joints: &[Placed<'_>], from: Host, body: &str, place: &Place) -> Result<Host, ImportError> {
        let mut at = from;
        for placed in joints {
            let link = self.model.links.len();
            let joint = self.joint(*placed, at, link)?;
            at = Host { link: Some(link), ..at.moved(&joint) };
            if joint.between.is_none() {
                return Err(free_with_others(*placed));
            }
            let name = self.unused(None, &format!("{body}-{}", placed.element.text("name").unwrap_or("joint")));
            self.model.links.push(Link::at(name, place.clone(), at.pose));
            self.push_joint(joint);
        }
        Ok(at)
    }

    /// Keeps a joint, unless its body is free.
    fn push_joint(&mut self, StartedJoint { between, zero, start, .. }: StartedJoint) {
        let Some(joint) = between else { return };
        if joint.kind.travels() {
            self.travelling.entry(joint.name.clone()).or_insert(self.model.joints.len());
        }
        self.model.joints.push(joint);
        self.zeros.push(zero);
        self.starts.push(start);
    }

    /// Keeps where the sites of a body are; sites that nothing names are not read.
    fn note_sites(&mut self, contents: &Contents<'a>, host: Host) -> Result<(), ImportError> {
        for Placed { element, frame } in &contents.sites {
            let Some(name) = element.text("name") else { continue };
            let at_m = frame.then(self.compiler.pose(element)?).position;
            let (end, at_springs_m) = (End { link: host.link, at_m }, host.at_springs.point(at_m));
            self.sites.insert(name.to_owned(), Site { element, end, at_springs_m });
        }
        Ok(())
    }

    /// The geoms of a body; ground on one that moves is noted.
    fn geoms(&mut self, contents: &Contents<'_>, is_fixed: bool) -> Result<Vec<Geom>, ImportError> {
        let mut geoms = Vec::new();
        for placed in &contents.geoms {
            geoms.extend(self.geom(*placed)?);
        }
        let moved = geoms.extract_if(.., |geom| geom.stays && !is_fixed);
        self.notes.extend(
            moved.map(|geom| geom.part.place.note("is left out: its body moves, and ground of a scene never does")),
        );
        Ok(geoms)
    }

    fn mass(&self, inertial: Option<&Element>, geoms: &[Geom]) -> Result<Mass, ImportError> {
        if let Some(inertial) = inertial.filter(|_| !self.compiler.mass_from_geoms) {
            return self.given_mass(inertial);
        }
        let weighing: Vec<&Geom> = geoms.iter().filter(|geom| geom.density_kg_m3 != Some(0.0)).collect();
        if weighing.is_empty() {
            return Ok(Mass::None);
        }
        // a scene takes the mass of solids that are all touched, or none, from their densities
        let is_seen_alone = geoms.iter().all(|geom| !geom.part.touches);
        if weighing.iter().all(|g| matches!(g.part.shape, Shape::Solid(_)) && (g.part.touches || is_seen_alone)) {
            return Ok(Mass::OfParts);
        }
        if let Some(all) = weighing.iter().map(|geom| self.weight(geom)).collect::<Option<Vec<_>>>() {
            return Ok(Weight::together(&all));
        }
        // of a mesh that cannot be read here the scene alone knows the volume
        match weighing.as_slice() {
            [Geom { density_kg_m3: None, mass_kg: Some(mass_kg), .. }] => {
                Ok(Mass::Given { mass_kg: *mass_kg, com_m: DVec3::ZERO, inertia_kg_m2: None })
            }
            _ => match weighing.iter().find(|geom| geom.density_kg_m3.is_none()) {
                Some(geom) => {
                    let reason = "is a mesh with a `mass` beside other geoms; expected an `inertial` in its body";
                    Err(geom.part.place.wrong(reason))
                }
                None => Ok(Mass::OfParts),
            },
        }
    }

    /// None: a body that never moves weighs only in the sum of all.
    fn static_mass(&mut self, inertial: Option<&Element>, geoms: &[Geom]) -> Result<Mass, ImportError> {
        inertial.inspect(|inertial| inertial.read_all_within());
        if self.compiler.total_kg.is_some() {
            let mass = self.mass(inertial, geoms)?;
            let parts: Vec<Part> = geoms.iter().map(|geom| density(geom, &mass)).collect();
            self.static_kg = self.static_kg.zip(kilograms(&mass, &parts)).map(|(sum, more)| sum + more);
        }
        Ok(Mass::None)
    }

    fn given_mass(&self, inertial: &Element) -> Result<Mass, ImportError> {
        let mass_kg = inertial.positive("mass")?;
        let Pose { position: com_m, rotation } = self.compiler.pose(inertial)?;
        let own = match (inertial.numbers("fullinertia")?, inertial.numbers("diaginertia")?) {
            (Some([xx, yy, zz, xy, xz, yz]), _) => {
                DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz))
            }
            (None, Some(moments)) => DMat3::from_diagonal(DVec3::from_array(moments)),
            (None, None) => return Err(inertial.wrong("has neither `diaginertia` nor `fullinertia`")),
        };
        let turn = DMat3::from_quat(rotation);
        Ok(Mass::Given { mass_kg, com_m, inertia_kg_m2: Some(turn * own * turn.transpose()) })
    }

    /// A name that nothing has yet: the given one, or one made of `kind`.
    fn unused(&mut self, given: Option<&str>, kind: &str) -> String {
        let first = given.unwrap_or(kind).to_owned();
        let more = (2..).map(|i| format!("{first}-{i}"));
        let name = std::iter::once(first.clone()).chain(more).find(|name| !self.names.contains(name));
        let name = name.unwrap_or(first);
        self.names.insert(name.clone());
        name
    }
}

fn free_with_others(joint: Placed<'_>) -> ImportError {
    joint.element.wrong("lets its body move freely, which has other joints; expected one joint")
}

/// The part of a geom, with its density where the body's mass comes from that.
fn density(geom: &Geom, mass: &Mass) -> Part {
    let density_kg_m3 = geom.density_kg_m3.filter(|_| matches!(mass, Mass::OfParts));
    Part { density_kg_m3, ..geom.part.clone() }
}

/// The look of a body: the colour of its first coloured geom, the friction of its roughest, the masks of all.
fn look(geoms: &[Geom]) -> Look {
    let touched = geoms.iter().filter(|geom| geom.part.touches).map(|geom| geom.surface);
    let both = |a: Surface, b: Surface| Surface {
        friction: a.friction.max(b.friction),
        masks: Masks { types: a.masks.types | b.masks.types, partners: a.masks.partners | b.masks.partners },
    };
    Look { colour: geoms.iter().find_map(|geom| geom.colour), surface: touched.reduce(both) }
}

/// A rotation that brings z to a direction.
pub(super) fn z_to(direction: DVec3) -> DQuat {
    DQuat::from_rotation_arc(DVec3::Z, direction)
}
