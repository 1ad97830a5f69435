//! MJCF, as of MuJoCo's XML reference: bodies in bodies, joints and geoms in them.
//!
//! In: the tree of a file. Out: a [`Model`]. Never here: TOML, bodies without mass (`settle` has them).
//! As in MuJoCo, a body on which nothing moves is part of the world, and a body's mass is that of its geoms where it has no `inertial`.

mod actuators;
mod bodies;
mod compiler;
mod defaults;
mod equality;
mod geoms;
mod height_fields;
mod include;
mod joints;
mod keyframe;
mod tendons;

pub(crate) use defaults::resolve_defaults;
pub(crate) use include::include;

use crate::imported::{ImportError, LeftOut};
use crate::masses::rescale;
use crate::meshes::Meshes;
use crate::model::Model;
use crate::xml::{Element, Harmless};
use bodies::BodyReader;
use compiler::Compiler;
use glam::DVec3;
use keyframe::Keyframe;
use std::collections::BTreeMap;

/// Looks, sensors, numbers of solvers and of programs.
pub(crate) const HARMLESS: Harmless = Harmless {
    elements: "visual statistic size custom texture material skin mesh hfield light camera site sensor keyframe key extension",
    containers: "asset default worldbody",
    attributes: "rgba material group user class childclass width texturedir strippath discardvisual usethread timestep \
        integrator solver iterations tolerance ls_iterations ls_tolerance noslip_iterations noslip_tolerance \
        mpr_iterations mpr_tolerance ccd_iterations ccd_tolerance sdf_iterations sdf_initpoints jacobian apirate magnetic \
        energy fwdinv sensor sensornoise multiccd warmstart island fluidshape fluidcoef maxhullvert content_type \
        smoothnormal refpos refquat model",
};

/// Reads a model, which starts from the keyframe `key`.
///
/// # Errors
/// [`ImportError`] at the first element that no scene can have.
pub(crate) fn read(
    root: &Element,
    key: Option<&str>,
    meshes: Meshes<'_>,
    notes: &mut Vec<LeftOut>,
) -> Result<Model, ImportError> {
    if root.tag != "mujoco" {
        return Err(root.wrong("is not the root of a model; expected `mujoco`"));
    }
    let mut compiler = Compiler::read(root)?;
    compiler.has_limits = !is_off(root, "limit");
    let mut reader = BodyReader::new(&compiler, meshes, notes);
    reader.meshes = geoms::meshes(root, &compiler)?;
    reader.height_fields = geoms::assets(root, "hfield")?;
    reader.keyframe = key.map(|name| Keyframe::find(root, name)).transpose()?;
    for body in root.children("worldbody") {
        reader.world(body)?;
    }
    actuators::read(root, &mut reader)?;
    tendons::read(root, &mut reader)?;
    match is_off(root, "equality") {
        true => root.children("equality").for_each(Element::read_all_within),
        false => equality::read(root, &mut reader)?,
    }
    let static_kg = reader.static_kg;
    let mut model = reader.finish();
    if let Some(total_kg) = compiler.total_kg
        && !rescale(&mut model, static_kg, total_kg)
    {
        let what = "`settotalmass` is left out: a mesh that weighs cannot be read here";
        notes.extend(root.child("compiler").map(|compiler| compiler.note(what)));
    }
    model.name = root.text("model").unwrap_or("model").to_owned();
    read_options(root, &mut model, notes)?;
    let names: BTreeMap<String, usize> = model.links.iter().enumerate().map(|(i, l)| (l.name.clone(), i)).collect();
    for exclude in root.children("contact").flat_map(|contact| contact.children("exclude")) {
        if ["body1", "body2"].iter().any(|key| exclude.text(key) == Some("world")) {
            notes.push(exclude.note("is left out: scenes exclude bodies from each other, not from the world"));
            continue;
        }
        let find = |key: &'static str| {
            let name = exclude.needed(key)?;
            names.get(name).copied().ok_or_else(|| exclude.wrong(format!("names `{name}`, and there is no such body")))
        };
        model.excluded.push([find("body1")?, find("body2")?]);
    }
    model.collides_with_base = true;
    Ok(model)
}

/// Gravity, whether anything touches anything, and the medium around the bodies.
fn read_options(root: &Element, model: &mut Model, notes: &mut Vec<LeftOut>) -> Result<(), ImportError> {
    for option in root.children("option") {
        if let Some(gravity) = option.numbers("gravity")? {
            model.gravity_m_s2 = Some(DVec3::from_array(gravity));
        }
        for name in ["density", "viscosity"] {
            if option.number(name)?.is_some_and(|value| value != 0.0) {
                notes.push(option.note(format!("`{name}` is left out: nothing surrounds the bodies of a scene")));
            }
        }
    }
    if is_off(root, "gravity") {
        model.gravity_m_s2 = Some(DVec3::ZERO);
    }
    if is_off(root, "contact") {
        let parts = model.links.iter_mut().flat_map(|link| &mut link.parts);
        parts.chain(model.fixed.iter_mut().map(|fixed| &mut fixed.part)).for_each(|part| part.touches = false);
    }
    if is_off(root, "frictionloss") {
        model.joints.iter_mut().for_each(|joint| joint.friction = 0.0);
    }
    Ok(())
}

/// Whether a flag of the file is off; `constraint` is all that bounds or holds.
fn is_off(root: &Element, name: &str) -> bool {
    let mut flags = root.children("option").flat_map(|option| option.children("flag"));
    let constrains = ["contact", "limit", "equality", "frictionloss"].contains(&name);
    flags.any(|flag| {
        let [own, all] = [name, "constraint"].map(|name| flag.text(name) == Some("disable"));
        own || (constrains && all)
    })
}
