//! Sheets, solids and ropes of a scene.
//!
//! In: the dataclasses of `package/metachron/parts.py`. Out: the engine's soft bodies. Never here: defaults, which are the engine's own.

use crate::numbers::{Rotation, Vector};
use crate::object::Names;
use crate::raised;
use crate::scene::{chosen, class, field, points, set};
use metachron::models::soft::{MaterialLaw, Side};
use metachron::scene::Source;
use metachron::scene::format::LawKind;
use metachron::world::Soft;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// The soft body that a part describes; `None` of another part.
pub fn soft(part: &Bound<'_, PyAny>) -> PyResult<Option<Soft>> {
    let number = |name| field::<f64>(part, name);
    let soft = match class(part)?.as_str() {
        "Sheet" => Soft::sheet(field(part, "size")?, number("thickness")?, field(part, "segments")?),
        "SoftBox" => Soft::cuboid(field(part, "size")?, field(part, "segments")?),
        "SoftBall" => Soft::ball(number("radius")?, field(part, "segments")?),
        "SoftMesh" => {
            let surface = Source::mesh(&field::<PathBuf>(part, "file")?, number("scale")?);
            let surface = surface.map_err(|error| raised::mesh(&error))?;
            return placed(part, Soft::mesh(Arc::new(surface), field(part, "eps")?)).map(Some);
        }
        "Rope" => Soft::rope(&points(part)?, number("radius")?, field(part, "segments")?),
        _ => return Ok(None),
    };
    placed(part, set(soft, part, "eps", Soft::eps_m)?).map(Some)
}

/// Sets the fields that all soft bodies have.
fn placed(part: &Bound<'_, PyAny>, soft: Soft) -> PyResult<Soft> {
    let soft = set(soft, part, "at", |soft, Vector(at)| soft.at(at.to_array()))?;
    let soft = set(soft, part, "velocity", |soft, Vector(velocity)| soft.velocity_m_s(velocity.to_array()))?;
    let soft = set(soft, part, "rotation", |soft, Rotation(rotation)| soft.turned(rotation))?;
    let soft = set(soft, part, "young", Soft::young_pa)?;
    let soft = set(soft, part, "poisson", Soft::poisson)?;
    let soft = set(soft, part, "density", Soft::density_kg_m3)?;
    let soft = set(soft, part, "friction", Soft::friction)?;
    let soft = set(soft, part, "rate", Soft::rate_hz)?;
    let soft = set(soft, part, "damping", |soft, (motion, strain)| soft.damping(motion, strain))?;
    let soft = set(soft, part, "self_contact", Soft::self_contact)?;
    let soft = set(soft, part, "eps_touched", Soft::eps_touched_m)?;
    let soft = law(part)?.into_iter().fold(soft, Soft::law);
    let Names(hold) = field(part, "hold")?;
    Ok(soft.hold(&hold.iter().map(|name| chosen::<Side>("side", name)).collect::<PyResult<Vec<_>>>()?))
}

fn law(part: &Bound<'_, PyAny>) -> PyResult<Option<MaterialLaw>> {
    let law = field::<Option<String>>(part, "law")?.map(|name| chosen::<LawKind>("law", &name));
    Ok(match (law.transpose()?, field::<Option<f64>>(part, "exponent")?) {
        (None, None) => None,
        (Some(LawKind::Corotational), None) => Some(MaterialLaw::Corotational),
        (Some(LawKind::NeoHookean), None) => Some(MaterialLaw::NeoHookean),
        (Some(LawKind::Ogden), Some(exponent)) => Some(MaterialLaw::Ogden { exponent }),
        (Some(LawKind::Ogden), None) => return Err(PyValueError::new_err("the law \"ogden\" needs an exponent")),
        (_, Some(_)) => return Err(PyValueError::new_err("an exponent belongs to the law \"ogden\"")),
    })
}
