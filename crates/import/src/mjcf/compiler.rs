//! The settings of a file: units of angles, folders of meshes, where masses come from.
//!
//! In: `compiler` elements. Out: poses and angles as the file means them. Never here: bodies.

use super::defaults::ROTATIONS;
use crate::imported::ImportError;
use crate::pose::Pose;
use crate::xml::Element;
use glam::{DMat3, DQuat, DVec3};

/// Settings of a file.
#[derive(Debug)]
pub(super) struct Compiler {
    /// Radians in the file's unit of angles.
    pub(super) angle_rad: f64,
    /// The axes of Euler angles; capitals are axes of the frame outside.
    euler_axes: String,
    /// Whether a range alone makes a limit.
    pub(super) auto_limits: bool,
    /// Whether ranges are limits at all.
    pub(super) has_limits: bool,
    pub(super) mesh_folder: String,
    /// Whether geoms give masses even where a body says its own.
    pub(super) mass_from_geoms: bool,
    /// The mass of all bodies together; `None` to keep their own masses.
    pub(super) total_kg: Option<f64>,
}

impl Compiler {
    pub(super) fn read(root: &Element) -> Result<Self, ImportError> {
        let mut settings = Self {
            angle_rad: 1.0_f64.to_radians(),
            euler_axes: "xyz".to_owned(),
            auto_limits: true,
            has_limits: true,
            mesh_folder: String::new(),
            mass_from_geoms: false,
            total_kg: None,
        };
        for compiler in root.children("compiler") {
            if let Some(unit) = compiler.text("angle") {
                settings.angle_rad = if unit == "radian" { 1.0 } else { 1.0_f64.to_radians() };
            }
            if let Some(axes) = compiler.text("eulerseq") {
                if axes.len() != 3 || !axes.chars().all(|c| "xyzXYZ".contains(c)) {
                    return Err(compiler.wrong(format!("`eulerseq` is `{axes}`; expected three of x, y, z, X, Y, Z")));
                }
                settings.euler_axes = axes.to_owned();
            }
            if let Some(given) = compiler.text("autolimits") {
                settings.auto_limits = given == "true";
            }
            compiler.read_if("coordinate", "local");
            settings.total_kg = compiler.number("settotalmass")?.filter(|total| *total > 0.0).or(settings.total_kg);
            if let Some(given) = compiler.text("inertiafromgeom") {
                settings.mass_from_geoms = given == "true";
            }
            if let Some(folder) = compiler.text("meshdir").or_else(|| compiler.text("assetdir")) {
                settings.mesh_folder = folder.to_owned();
            }
        }
        Ok(settings)
    }

    /// The path of a mesh or height field that an element names.
    pub(super) fn in_mesh_folder(&self, file: &str) -> String {
        let folder = self.mesh_folder.trim_end_matches('/');
        if folder.is_empty() { file.to_owned() } else { format!("{folder}/{file}") }
    }

    /// The pose that an element's `pos` and rotation give it.
    pub(super) fn pose(&self, element: &Element) -> Result<Pose, ImportError> {
        let position = element.numbers("pos")?.map_or(DVec3::ZERO, DVec3::from_array);
        let given: Vec<&str> = ROTATIONS.into_iter().filter(|name| element.has(name)).collect();
        let rotation = match given.as_slice() {
            [] => DQuat::IDENTITY,
            [name] => self.rotation(element, name)?,
            more => return Err(element.wrong(format!("has the rotations {}; expected one", more.join(" and ")))),
        };
        Ok(Pose { position, rotation })
    }

    fn rotation(&self, element: &Element, name: &str) -> Result<DQuat, ImportError> {
        let wrong = || element.wrong(format!("`{name}` has no direction"));
        let unit = |v: DVec3| v.try_normalize().ok_or_else(wrong);
        let rotation = match name {
            "quat" => {
                let [w, x, y, z] = element.numbers(name)?.unwrap_or_default();
                let quat = DQuat::from_xyzw(x, y, z, w);
                if quat.length() < 1e-9 {
                    return Err(wrong());
                }
                quat
            }
            "axisangle" => {
                let [x, y, z, angle] = element.numbers(name)?.unwrap_or_default();
                DQuat::from_axis_angle(unit(DVec3::new(x, y, z))?, angle * self.angle_rad)
            }
            "euler" => self.euler(element.numbers(name)?.unwrap_or_default()),
            "xyaxes" => {
                let [a, b, c, d, e, f] = element.numbers(name)?.unwrap_or_default();
                let x = unit(DVec3::new(a, b, c))?;
                let y = unit(DVec3::new(d, e, f).reject_from_normalized(x))?;
                DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y)))
            }
            _ => {
                let z = unit(DVec3::from_array(element.numbers(name)?.unwrap_or_default()))?;
                DQuat::from_rotation_arc(DVec3::Z, z)
            }
        };
        Ok(rotation.normalize())
    }

    fn euler(&self, angles: [f64; 3]) -> DQuat {
        let mut rotation = DQuat::IDENTITY;
        for (axis, angle) in self.euler_axes.chars().zip(angles) {
            let unit = match axis.to_ascii_lowercase() {
                'x' => DVec3::X,
                'y' => DVec3::Y,
                _ => DVec3::Z,
            };
            let turn = DQuat::from_axis_angle(unit, angle * self.angle_rad);
            rotation = if axis.is_lowercase() { rotation * turn } else { turn * rotation };
        }
        rotation
    }
}
