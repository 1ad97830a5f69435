//! Meshes of a model as the hulls of a scene: scenes name .glb, STL and OBJ files, and all else becomes an OBJ file beside the scene.
//!
//! In: names of files with their scale, points, ellipsoids. Out: shapes, and the files that the scene needs. Never
//! here: files that are opened or written (the caller does), the bodies of meshes.

use crate::folders::{Folders, extension, plain};
use crate::imported::{ImportError, MeshFile};
use crate::model::Shape;
use crate::xml::Element;
use crate::{dae, msh};
use glam::DVec3;
use metachron_geometry::{Triangles, hull_triangles};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Farthest coordinate of a mesh, metres: that of scenes.
const FAR_M: f64 = 1e5;
/// How often an edge of an octahedron is divided for an ellipsoid: its hull is within 0.4 % of it.
const ELLIPSOID_DIVISIONS: i32 = 16;

/// Where new files go, and which there are.
#[derive(Debug)]
pub(crate) struct Meshes<'a> {
    folders: Folders<'a>,
    /// The folder of new files, from that of the scene.
    folder: &'a str,
    /// Whether files that the scene could name where they are become new ones, too.
    copies: bool,
    files: Vec<MeshFile>,
    /// The files that the model names, from the folder of the scene: no new one is written over them.
    named: BTreeSet<String>,
    /// The new files by their sources.
    made: BTreeMap<String, String>,
    /// The surfaces of new files, by their paths.
    surfaces: BTreeMap<String, Triangles>,
    /// The contents of files, or why they cannot be read: parts that name one file read it once.
    read: RefCell<BTreeMap<PathBuf, Result<Triangles, String>>>,
}

impl<'a> Meshes<'a> {
    pub(crate) fn new(folders: Folders<'a>, folder: &'a str, copies: bool) -> Self {
        let (files, made, surfaces) = (Vec::new(), BTreeMap::new(), BTreeMap::new());
        Self { folders, folder, copies, files, named: BTreeSet::new(), made, surfaces, read: RefCell::default() }
    }

    pub(crate) fn finish(self) -> Vec<MeshFile> {
        self.files
    }

    /// The hull of a file that `element` names, or why the scene cannot have it.
    ///
    /// # Errors
    /// Where there is no such file.
    pub(crate) fn hull(
        &mut self,
        element: &Element,
        name: &str,
        scale: [f64; 3],
    ) -> Result<Result<Shape, String>, ImportError> {
        let kind = extension(name);
        let is_scenes = ["glb", "obj", "stl"].contains(&kind.as_str());
        if !is_scenes && !["dae", "msh"].contains(&kind.as_str()) {
            return Ok(Err("expected a .glb, .stl, .obj, .dae or MuJoCo's .msh".to_owned()));
        }
        let path = self.folders.find(element, name)?;
        self.named.extend(self.folders.relative(&path));
        let [x, y, z] = scale;
        if is_scenes && x > 0.0 && x == y && y == z {
            let file = if self.copies { self.copy(&path) } else { self.in_place(element, name, &path)? };
            return Ok(file.map(|file| Shape::Hull { file, scale: x }));
        }
        let key = format!("{} {scale:?}", plain(&path).as_ref().unwrap_or(&path).display());
        if let Some(file) = self.made.get(&key) {
            return Ok(Ok(Shape::Hull { file: file.clone(), scale: 1.0 }));
        }
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or("mesh");
        let surface = self.read(&path).map(|surface| scaled(surface, DVec3::from_array(scale)));
        Ok(surface.and_then(|surface| self.add(key, stem, surface)))
    }

    /// The hull of the points that a model has of a mesh.
    pub(crate) fn hull_of(&mut self, name: &str, points: Vec<DVec3>) -> Result<Shape, String> {
        self.add(format!("points of {name}"), name, Triangles { points, triangles: Vec::new() })
    }

    pub(crate) fn ellipsoid(&mut self, semi_axes_m: DVec3) -> Result<Shape, String> {
        let n = ELLIPSOID_DIVISIONS;
        let lattice = (-n..=n).flat_map(|x| (-n..=n).flat_map(move |y| [-1, 1].map(|side| (x, y, side))));
        let points = lattice.filter_map(|(x, y, side)| {
            let z = n - x.abs() - y.abs();
            let on = DVec3::new(f64::from(x), f64::from(y), f64::from(side * z));
            (z > 0 || (z == 0 && side > 0)).then(|| on.normalize() * semi_axes_m)
        });
        let surface = Triangles { points: points.collect(), triangles: Vec::new() };
        match self.add(format!("ellipsoid {semi_axes_m:?}"), "ellipsoid", surface)? {
            Shape::Hull { file, .. } => Ok(Shape::Ellipsoid { file, semi_axes_m }),
            other => Ok(other),
        }
    }

    /// The closed surface of ground, which is no hull.
    pub(crate) fn ground(&mut self, name: &str, surface: Triangles) -> Result<Shape, String> {
        let key = format!("ground {name}");
        let file = match self.made.get(&key) {
            Some(file) => file.clone(),
            None => {
                check_far(&surface)?;
                self.write(key, name, &surface)
            }
        };
        Ok(Shape::Ground { file })
    }

    /// The bytes of a file that `element` names, or why they cannot be read.
    ///
    /// # Errors
    /// Where there is no such file.
    pub(crate) fn bytes(&self, element: &Element, name: &str) -> Result<Result<Vec<u8>, String>, ImportError> {
        Ok(self.bytes_at(&self.folders.find(element, name)?))
    }

    fn bytes_at(&self, path: &Path) -> Result<Vec<u8>, String> {
        self.folders.read.ok_or("no file is read here")?(path).map_err(|why| why.to_string())
    }

    /// The surface that a hull was made of, in metres; `None` where it cannot be read.
    pub(crate) fn surface(&self, file: &str, scale: f64) -> Option<Triangles> {
        match self.surfaces.get(file) {
            Some(made) => Some(scaled(made.clone(), DVec3::splat(scale))),
            None => Some(scaled(self.read(&self.folders.scene.join(file)).ok()?, DVec3::splat(scale))),
        }
    }

    fn read(&self, path: &Path) -> Result<Triangles, String> {
        let key = plain(path).unwrap_or_else(|| path.to_owned());
        self.read.borrow_mut().entry(key).or_insert_with(|| self.read_anew(path)).clone()
    }

    fn read_anew(&self, path: &Path) -> Result<Triangles, String> {
        let bytes = self.bytes_at(path)?;
        let surface = match extension(&path.to_string_lossy()).as_str() {
            "dae" => {
                let text = std::str::from_utf8(&bytes).map_err(|why| why.to_string())?;
                Triangles { points: dae::read(text)?, triangles: Vec::new() }
            }
            "msh" => msh::read(&bytes)?,
            _ => self.folders.surface.ok_or("no mesh is read here")?(&bytes)?,
        };
        match surface.points.iter().position(|point| !point.is_finite()) {
            Some(bad) => Err(format!("point {} is not finite", bad + 1)),
            None => Ok(surface),
        }
    }

    /// The path of a file that the scene names where it is, or why it cannot.
    fn in_place(&self, element: &Element, name: &str, path: &Path) -> Result<Result<String, String>, ImportError> {
        let file = self.folders.in_scene(element, name, path)?;
        if self.files.iter().any(|new| new.path.eq_ignore_ascii_case(&file)) {
            return Ok(Err("a new mesh would be written over it; expected it in another folder".to_owned()));
        }
        Ok(Ok(file))
    }

    /// A new file with the bytes of another.
    fn copy(&mut self, path: &Path) -> Result<String, String> {
        let key = plain(path).as_deref().unwrap_or(path).display().to_string();
        if let Some(file) = self.made.get(&key) {
            return Ok(file.clone());
        }
        let bytes = self.bytes_at(path)?;
        let name = path.file_name().and_then(|name| name.to_str()).ok_or("its name is no text")?;
        let (stem, kind) = name.rsplit_once('.').unwrap_or((name, "obj"));
        let file = self.unused(stem, kind);
        if let Ok(surface) = self.read(path) {
            self.surfaces.insert(file.clone(), surface);
        }
        Ok(self.push(key, file, bytes))
    }

    /// A new OBJ file with the hull of a surface.
    fn add(&mut self, key: String, stem: &str, surface: Triangles) -> Result<Shape, String> {
        if let Some(file) = self.made.get(&key) {
            return Ok(Shape::Hull { file: file.clone(), scale: 1.0 });
        }
        check_far(&surface)?;
        let hull = hull_triangles(&surface.points).map_err(|why| why.to_string())?;
        let file = self.write(key, stem, &hull);
        self.surfaces.insert(file.clone(), surface);
        Ok(Shape::Hull { file, scale: 1.0 })
    }

    /// Adds an OBJ file, and returns its path.
    fn write(&mut self, key: String, stem: &str, surface: &Triangles) -> String {
        let mut text = String::new();
        for point in &surface.points {
            writeln!(text, "v {} {} {}", point.x, point.y, point.z).expect("a string takes all");
        }
        for [a, b, c] in surface.triangles.iter().map(|corners| corners.map(|corner| corner + 1)) {
            writeln!(text, "f {a} {b} {c}").expect("a string takes all");
        }
        let file = self.unused(stem, "obj");
        self.push(key, file, text.into_bytes())
    }

    fn push(&mut self, key: String, path: String, bytes: Vec<u8>) -> String {
        self.made.insert(key, path.clone());
        self.files.push(MeshFile { path: path.clone(), bytes });
        path
    }

    /// A path that no new file has yet, in small letters or capitals: some systems tell them apart and others do not.
    fn unused(&self, stem: &str, kind: &str) -> String {
        let stem = stem.replace(['/', '\\'], "-");
        let more = (2..).map(|i| format!("{}/{stem}-{i}.{kind}", self.folder));
        let taken = || self.files.iter().map(|file| &file.path).chain(&self.named);
        let is_new = |path: &String| !taken().any(|file| file.eq_ignore_ascii_case(path));
        let first = format!("{}/{stem}.{kind}", self.folder);
        std::iter::once(first.clone()).chain(more).find(is_new).unwrap_or(first)
    }
}

/// Checks that a surface is no larger than scenes are.
fn check_far(surface: &Triangles) -> Result<(), String> {
    match surface.points.iter().position(|point| point.abs().max_element() > FAR_M) {
        Some(bad) => Err(format!("point {} is more than {FAR_M:.0} m from its origin", bad + 1)),
        None => Ok(()),
    }
}

/// A surface stretched along its axes; a mirrored one is turned inside out again.
fn scaled(mut surface: Triangles, scale: DVec3) -> Triangles {
    surface.points.iter_mut().for_each(|point| *point *= scale);
    if scale.element_product() < 0.0 {
        surface.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    }
    surface
}
