//! A robot as both kinds of files describe it: links, joints, and which links do not collide with each other.
//!
//! In: the results of the readers. Out: plain data. Never here: XML, TOML.

use crate::imported::MeshFile;
use crate::place::Place;
use crate::pose::Pose;
use glam::{DMat3, DVec3};
use metachron_geometry::Solid;
use std::collections::BTreeSet;

/// The contents of a file.
#[derive(Debug, Default)]
pub(crate) struct Model {
    pub(crate) name: String,
    /// Gravity, m/s²; `None` for that of scenes.
    pub(crate) gravity_m_s2: Option<DVec3>,
    /// Each after the one that it hangs on.
    pub(crate) links: Vec<Link>,
    pub(crate) joints: Vec<Joint>,
    pub(crate) ties: Vec<Tie>,
    /// Pairs of links that the file lets pass through each other.
    pub(crate) excluded: Vec<[usize; 2]>,
    /// Whether links on a fixed body collide with it: as in MuJoCo, not as in URDF.
    pub(crate) collides_with_base: bool,
    /// Whether a link that has no mass and carries none is fixed where it starts: as programs that read URDF do, and
    /// MuJoCo refuses it.
    pub(crate) fixes_massless: bool,
    /// Bodies that pass through each other, including the pairs of `excluded`: `settle` finds them.
    pub(crate) apart: Vec<Apart>,
    /// Solids of the world itself, in its axes.
    pub(crate) fixed: Vec<Fixed>,
    /// Meshes that shapes name and that are not there yet.
    pub(crate) files: Vec<MeshFile>,
}

/// Two bodies of a scene, by name, that pass through each other.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Apart {
    pub(crate) a: String,
    pub(crate) b: String,
    pub(crate) why: Why,
}

/// Why two bodies pass through each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Why {
    /// The file says so, or another beside it.
    Excluded,
    /// They are next to each other, across joints that hold fast.
    Neighbours,
    /// They start this deep inside each other.
    Overlap { depth_m: f64 },
}

/// A body.
#[derive(Debug)]
pub(crate) struct Link {
    pub(crate) name: String,
    /// The link that all of its tree hangs on, by its number in the file: of two bodies with one such link both are of one robot.
    pub(crate) root: usize,
    /// Whether it moves freely although it may have no mass of its own.
    pub(crate) is_free: bool,
    pub(crate) place: Place,
    /// Its axes in the world at the start.
    pub(crate) pose: Pose,
    pub(crate) mass: Mass,
    pub(crate) parts: Vec<Part>,
    pub(crate) look: Look,
    /// Whether its mass is lent (`masses`): it stands for the one between two joints of a body.
    pub(crate) is_lent: bool,
}

/// How a body looks, with the material of its surface.
#[derive(Debug, Clone, Default)]
pub(crate) struct Look {
    pub(crate) colour: Option<[u8; 3]>,
    pub(crate) surface: Option<Surface>,
}

/// The contact properties of a part, in files that have such.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Surface {
    pub(crate) friction: f64,
    pub(crate) masks: Masks,
}

/// Bits by which two surfaces collide: where one's `types` have a bit of the other's `partners`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Masks {
    pub(crate) types: u32,
    pub(crate) partners: u32,
}

impl Masks {
    /// The masks of a file that gives none.
    pub(crate) const USUAL: Self = Self { types: 1, partners: 1 };

    pub(crate) const fn collides(self, other: Self) -> bool {
        self.types & other.partners != 0 || other.types & self.partners != 0
    }
}

/// Where the mass of a link comes from.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Mass {
    /// It has none: it is a name for axes on another link.
    None,
    /// From the densities of its parts.
    OfParts,
    /// As the file says.
    Given {
        mass_kg: f64,
        /// In the axes of the link.
        com_m: DVec3,
        /// About the centre of mass along the axes of the link; none where the file gives a mass alone.
        inertia_kg_m2: Option<DMat3>,
    },
}

/// A solid on a link.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    pub(crate) place: Place,
    pub(crate) shape: Shape,
    /// In the axes of its link.
    pub(crate) pose: Pose,
    pub(crate) density_kg_m3: Option<f64>,
    /// Whether anything touches it; otherwise it is only seen.
    pub(crate) touches: bool,
}

/// The shape of a part.
#[derive(Debug, Clone)]
pub(crate) enum Shape {
    Solid(Solid),
    /// The convex hull of a file's points, the path relative to the scene.
    Hull {
        file: String,
        scale: f64,
    },
    /// An ellipsoid, and the file of its hull.
    Ellipsoid {
        file: String,
        semi_axes_m: DVec3,
    },
    /// The closed surface of ground that stays, of a file.
    Ground {
        file: String,
    },
}

/// A solid of the world.
#[derive(Debug)]
pub(crate) struct Fixed {
    pub(crate) name: String,
    /// The root of the link that it was; `None` of the world's own.
    pub(crate) root: Option<usize>,
    /// The link that it was, by its number in the file.
    pub(crate) link: Option<usize>,
    pub(crate) part: Part,
    pub(crate) look: Look,
}

impl Fixed {
    /// Whether it can be let through: couplings are between objects that can move, and a plane never does.
    pub(crate) const fn can_pass(&self) -> bool {
        self.part.touches && !matches!(self.part.shape, Shape::Solid(Solid::Plane))
    }
}

/// A joint: the motion that it leaves to `child`.
#[derive(Debug, Clone)]
pub(crate) struct Joint {
    /// Empty for one that the file does not name.
    pub(crate) name: String,
    pub(crate) place: Place,
    /// `None` for the world.
    pub(crate) parent: Option<usize>,
    pub(crate) child: usize,
    pub(crate) kind: Kind,
    /// Where it is, in the axes of the child.
    pub(crate) anchor_m: DVec3,
    /// Axis in the axes of the child; no meaning for a joint without one.
    pub(crate) axis: DVec3,
    /// From the position at the start, radians or metres.
    pub(crate) range: Option<[f64; 2]>,
    pub(crate) motor: Option<Motor>,
    /// Dry friction and the inertia about or along the axis, of a hinge in N·m and kg·m², of a slide in N and kg.
    pub(crate) friction: f64,
    pub(crate) armature: f64,
    /// The joint that a hinge or slide follows from where both start.
    pub(crate) mimic: Option<Mimic>,
}

/// A joint that another one follows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Mimic {
    pub(crate) joint: String,
    /// Radians or metres for each radian or metre of that joint.
    pub(crate) ratio: f64,
}

/// A rope or spring between two points.
#[derive(Debug, Clone)]
pub(crate) struct Tie {
    pub(crate) place: Place,
    pub(crate) ends: [End; 2],
    pub(crate) kind: TieKind,
}

/// An end of a tie.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct End {
    /// `None` for the world.
    pub(crate) link: Option<usize>,
    /// In the axes of the link, or the world's.
    pub(crate) at_m: DVec3,
}

/// The constraint between the ends of a tie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum TieKind {
    /// Nothing up to a length that is the greatest.
    Rope {
        length_m: f64,
    },
    Spring {
        stiffness_n_m: f64,
        damping_n_s_m: f64,
        rest_m: f64,
    },
}

/// The motion that a joint leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Fixed,
    Revolute,
    Spherical,
    Prismatic,
}

/// The motor of a joint, in radians or metres from its position at the start, newtons and newton metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Motor {
    /// A spring to a position, with a damper.
    Spring { position: f64, stiffness: f64, damping: f64, max_effort: Option<f64> },
    /// A damper against a velocity.
    Damper { velocity: f64, damping: f64, max_effort: Option<f64> },
}

impl Model {
    /// For each link the joint that it hangs on, by number: the first of the joints that hold it, as others close
    /// loops.
    pub(crate) fn above(&self) -> Vec<Option<usize>> {
        let mut above = vec![None; self.links.len()];
        for (at, joint) in self.joints.iter().enumerate().rev() {
            above[joint.child] = Some(at);
        }
        above
    }

    /// Drops the meshes that no part names.
    pub(crate) fn drop_unnamed_files(&mut self) {
        let parts = self.links.iter().flat_map(|link| &link.parts).chain(self.fixed.iter().map(|fixed| &fixed.part));
        let named: BTreeSet<&str> = parts.filter_map(|part| part.shape.file()).collect();
        self.files.retain(|file| named.contains(file.path.as_str()));
    }
}

impl Shape {
    /// The file that it names.
    fn file(&self) -> Option<&str> {
        match self {
            Self::Solid(_) => None,
            Self::Hull { file, .. } | Self::Ellipsoid { file, .. } | Self::Ground { file } => Some(file),
        }
    }
}

impl Kind {
    /// Whether it leaves one way to go.
    pub(crate) const fn travels(self) -> bool {
        matches!(self, Self::Revolute | Self::Prismatic)
    }

    /// The motion from the position at zero, of a joint with this axis at this place.
    pub(crate) fn motion(self, anchor_m: DVec3, axis: DVec3, position: f64) -> Pose {
        let axis = axis.normalize_or_zero();
        match self {
            Self::Revolute => {
                let rotation = glam::DQuat::from_scaled_axis(axis * position);
                Pose { position: anchor_m - rotation * anchor_m, rotation }
            }
            Self::Prismatic => Pose { position: axis * position, ..Pose::IDENTITY },
            Self::Fixed | Self::Spherical => Pose::IDENTITY,
        }
    }
}

impl Link {
    /// A body without mass, solids and look, which hangs on nothing.
    pub(crate) fn at(name: String, place: Place, pose: Pose) -> Self {
        let (mass, parts, look) = (Mass::None, Vec::new(), Look::default());
        Self { name, root: 0, is_free: false, place, pose, mass, parts, look, is_lent: false }
    }
}

impl Joint {
    /// A joint that lets nothing move.
    pub(crate) fn weld(place: Place, parent: Option<usize>, child: usize) -> Self {
        Self {
            name: String::new(),
            place,
            parent,
            child,
            kind: Kind::Fixed,
            anchor_m: DVec3::ZERO,
            axis: DVec3::Z,
            range: None,
            motor: None,
            friction: 0.0,
            armature: 0.0,
            mimic: None,
        }
    }
}
