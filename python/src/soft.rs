//! Sheets, solids and ropes of a scene.
//!
//! In: the dataclasses of `package/metachron/parts.py`. Out: the engine's soft bodies. Never here: defaults, which are the engine's own.

use crate::numbers::{Rotation, Vector};
use crate::object::Names;
use crate::raised;
use crate::scene::{class, field};
use metachron::models::soft::{MaterialLaw, Side};
use metachron::scene::Source;
use metachron::world::Soft;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

const SIDES: [Side; 6] = [Side::Left, Side::Right, Side::Near, Side::Far, Side::Bottom, Side::Top];

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
        "Rope" => {
            let points: Vec<_> =
                field::<Vec<Vector>>(part, "points")?.iter().map(|Vector(point)| point.to_array()).collect();
            Soft::rope(&points, number("radius")?, field(part, "segments")?)
        }
        _ => return Ok(None),
    };
    let eps = field::<Option<(f64, f64)>>(part, "eps")?;
    placed(part, eps.into_iter().fold(soft, Soft::eps_m)).map(Some)
}

/// Sets the fields that all soft bodies have.
fn placed(part: &Bound<'_, PyAny>, soft: Soft) -> PyResult<Soft> {
    let vector = |name| field::<Option<Vector>>(part, name).map(Option::into_iter);
    let number = |name| field::<Option<f64>>(part, name).map(Option::into_iter);
    let soft = vector("at")?.fold(soft, |soft, Vector(at)| soft.at(at.to_array()));
    let soft = vector("velocity")?.fold(soft, |soft, Vector(velocity)| soft.velocity_m_s(velocity.to_array()));
    let rotation = field::<Option<Rotation>>(part, "rotation")?;
    let soft = rotation.into_iter().fold(soft, |soft, Rotation(rotation)| soft.turned(rotation));
    let soft = number("young")?.fold(soft, Soft::young_pa);
    let soft = number("poisson")?.fold(soft, Soft::poisson);
    let soft = number("density")?.fold(soft, Soft::density_kg_m3);
    let soft = number("friction")?.fold(soft, Soft::friction);
    let soft = number("rate")?.fold(soft, Soft::rate_hz);
    let damping = field::<Option<(f64, f64)>>(part, "damping")?;
    let soft = damping.into_iter().fold(soft, |soft, (motion, strain)| soft.damping(motion, strain));
    let soft = field::<Option<bool>>(part, "self_contact")?.into_iter().fold(soft, Soft::self_contact);
    let soft = law(part)?.into_iter().fold(soft, Soft::law);
    let Names(hold) = field(part, "hold")?;
    Ok(soft.hold(&hold.iter().map(|name| side(name)).collect::<PyResult<Vec<_>>>()?))
}

fn side(name: &str) -> PyResult<Side> {
    SIDES.into_iter().find(|side| side.name() == name).ok_or_else(|| {
        let known = SIDES.map(Side::name).join(", ");
        PyValueError::new_err(format!("there is no side {name:?} to hold; expected one of {known}"))
    })
}

fn law(part: &Bound<'_, PyAny>) -> PyResult<Option<MaterialLaw>> {
    let (law, exponent) = (field::<Option<String>>(part, "law")?, field::<Option<f64>>(part, "exponent")?);
    let law = match (law.as_deref(), exponent) {
        (None, None) => return Ok(None),
        (Some("corotational"), None) => MaterialLaw::Corotational,
        (Some("neo-hookean"), None) => MaterialLaw::NeoHookean,
        (Some("ogden"), Some(exponent)) => MaterialLaw::Ogden { exponent },
        (Some("ogden"), None) => return Err(PyValueError::new_err("the law \"ogden\" needs an exponent")),
        (None | Some("corotational" | "neo-hookean"), Some(_)) => {
            return Err(PyValueError::new_err("an exponent belongs to the law \"ogden\""));
        }
        (Some(other), _) => {
            let known = "corotational, neo-hookean, ogden";
            return Err(PyValueError::new_err(format!("there is no law {other:?}; expected one of {known}")));
        }
    };
    Ok(Some(law))
}
