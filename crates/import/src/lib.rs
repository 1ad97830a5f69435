//! URDF robots and MJCF models as scene files.
//!
//! In: the text of a model and its folder. Out: the text of a scene, and a list of all that has no place in one ([`Imported`]).
//! Never here: files that are opened (the caller reads included files, [`ReadFile`]), running a scene, checking the
//! scene that comes out (`metachron-scene` does).
//!
//! Links become rigid objects whose axes are the link's, joints `[[joint]]` tables, collision geometries shapes and
//! parts.
//! Everything in the file that no line of this crate has read is in the list: an element or attribute cannot be dropped unseen.

mod apart;
mod dae;
mod folders;
mod imported;
mod masses;
mod meshes;
mod mjcf;
mod model;
mod msh;
mod place;
mod pose;
mod scene_text;
mod settle;
mod srdf;
mod urdf;
mod weight;
mod xml;

pub use folders::{Folders, ReadFile, ReadSurface};
pub use imported::{ImportError, Imported, LeftOut, MeshFile, Overlap};

use meshes::Meshes;

/// The page of the crate: its code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;

/// Finds the objects of a scene that start inside each other: the caller reads scenes. Where it finds none because the scene cannot be read, the
/// caller finds so again.
pub type FindOverlaps<'a> = &'a dyn Fn(&Imported) -> Vec<Overlap>;

/// How a model is read.
#[derive(Clone, Copy, Default)]
pub struct Options<'a> {
    /// The keyframe that an MJCF model starts from: joints at its `qpos`, servos at its `ctrl`. Default: where the file has its bodies.
    pub key: Option<&'a str>,
    /// The text of the SRDF file of a URDF robot: its `disable_collisions` are pairs that pass through each other. Default: none.
    pub srdf: Option<&'a str>,
    /// The function that finds bodies which start inside each other: bodies of one robot pass through each other then.
    /// Default: they collide.
    pub overlaps: Option<FindOverlaps<'a>>,
    /// The folder of new mesh files, from that of the scene. Default: `meshes`.
    pub meshes: Option<&'a str>,
    /// Whether meshes that the scene could name where they are become new files, too: the scene can be moved with its folder then. Default false.
    pub copy_meshes: bool,
    /// Whether bodies that move freely and that others hang on are fixed where they start, and the root of a robot. Default false.
    pub fixed_base: bool,
}

impl<'a> Options<'a> {
    fn meshes(&self, folders: Folders<'a>) -> Meshes<'a> {
        Meshes::new(folders, self.meshes.unwrap_or("meshes"), self.copy_meshes)
    }
}

impl std::fmt::Debug for Options<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Options").field("key", &self.key).field("srdf", &self.srdf).finish_non_exhaustive()
    }
}

/// Reads a model of the kind that its root element says: a robot as [`urdf`], an MJCF model as [`mjcf`].
///
/// # Errors
/// As of these two, for another root, and where an MJCF model has no such keyframe or it has other numbers than the
/// model has coordinates.
pub fn model<'a>(text: &str, folders: impl Into<Folders<'a>>, options: &Options<'_>) -> Result<Imported, ImportError> {
    let root = xml::parse(text, None)?;
    match root.tag.as_str() {
        "robot" => of_urdf(&root, folders.into(), options),
        "mujoco" => of_mjcf(root, folders.into(), options),
        _ => Err(root.wrong("is the root of no model that is known here; expected `robot` (URDF) or `mujoco` (MJCF)")),
    }
}

/// Reads a URDF robot. Meshes are looked for in the folder of the model and, for `package://` paths, in the folders around it.
///
/// A root link without mass is the world, one with mass moves freely. A joint that may not be at zero starts as near to zero as it may.
///
/// # Errors
/// [`ImportError`] at the first element that no scene can have: text that is no XML, a missing mesh, a mass that is not above zero, links that
/// are no tree.
pub fn urdf<'a>(text: &str, folders: impl Into<Folders<'a>>) -> Result<Imported, ImportError> {
    of_urdf(&xml::parse(text, None)?, folders.into(), &Options::default())
}

/// Reads an MJCF model, its classes of defaults and frames resolved. Meshes and included files are looked for in the
/// folder of the model; included files come by [`Folders::read`].
///
/// # Errors
/// [`ImportError`] at the first element that no scene can have, as [`urdf`].
pub fn mjcf<'a>(text: &str, folders: impl Into<Folders<'a>>) -> Result<Imported, ImportError> {
    of_mjcf(xml::parse(text, None)?, folders.into(), &Options::default())
}

fn of_urdf<'a>(root: &xml::Element, folders: Folders<'a>, options: &Options<'a>) -> Result<Imported, ImportError> {
    let mut notes = Vec::new();
    let mut model = urdf::read(root, options.meshes(folders), &mut notes)?;
    if let Some(srdf) = options.srdf {
        srdf::read(srdf, &mut model, &mut notes)?;
    }
    root.list_unread(&urdf::HARMLESS, &mut notes);
    imported(model, options, notes)
}

fn of_mjcf<'a>(mut root: xml::Element, folders: Folders<'a>, options: &Options<'a>) -> Result<Imported, ImportError> {
    let mut notes = Vec::new();
    if options.srdf.is_some() {
        notes.push(root.note("the SRDF file is not read: it is one of a URDF robot").harmless());
    }
    mjcf::include(&mut root, folders, &mut notes)?;
    mjcf::resolve_defaults(&mut root)?;
    let model = mjcf::read(&root, options.key, options.meshes(folders), &mut notes)?;
    root.list_unread(&mjcf::HARMLESS, &mut notes);
    imported(model, options, notes)
}

fn imported(model: model::Model, options: &Options<'_>, mut notes: Vec<LeftOut>) -> Result<Imported, ImportError> {
    let mut settled = settle::settle(model, options.fixed_base, &mut notes)?;
    let toml = scene_text::write(&settled, &mut notes);
    notes.sort_by(|a, b| (!a.changes_motion, &a.file, a.line).cmp(&(!b.changes_motion, &b.file, b.line)));
    let files = std::mem::take(&mut settled.files);
    let mut imported = Imported { toml, left_out: notes, overlaps: Vec::new(), files };
    if let Some(find) = options.overlaps {
        imported.overlaps = settled.pass_overlaps(find(&imported));
        // the text has the pairs now; the list of what it leaves out stays
        imported.toml = scene_text::write(&settled, &mut Vec::new());
    }
    Ok(imported)
}
