//! Masses and moments of inertia that bodies can have.
//!
//! In: a [`Model`] as the file has it. Out: the same where moving links weigh something, and moments are possible for
//! bodies; every change is noted. Never here: shapes that are touched.

use crate::imported::{ImportError, LeftOut};
use crate::model::{Kind, Link, Mass, Model, Part, Shape};
use crate::pose::Pose;
use glam::{DMat3, DVec3};
use metachron_geometry::Solid;

/// Radius of the ball that stands in for a body without a shape or moments of its own, metres.
pub(crate) const STAND_IN_M: f64 = 0.01;
/// The mass of a link without mass between two joints, of the body that it carries: the solver takes a thousand to one.
const LENT: f64 = 1e-3;
/// Least mass of a body of a scene, kilograms.
const MASS_MIN_KG: f64 = 1e-9;
/// Least moment of inertia, of the sum of all three.
const LEAST: f64 = 1e-9;
/// A moment of inertia below this share of the stand-in's is none: files have products of rounding where they mean nothing.
const NOTHING: f64 = 1e-6;
/// How much of the sum the triangle inequality may be missed by: files write few digits.
const SLACK: f64 = 2e-4;
/// How often the addition to moments is doubled: from 1e-4 of the largest to far beyond it.
const DOUBLINGS: i32 = 32;

/// A mass with its mean moment of inertia.
#[derive(Debug, Clone, Copy)]
struct Weight {
    mass_kg: f64,
    moment_kg_m2: f64,
}

/// Lends moving links without mass a thousandth of the mass that they carry: files write joints about several axes as
/// joints about one each, with such links between them.
pub(crate) fn lend(model: &mut Model, notes: &mut Vec<LeftOut>) {
    let weights: Vec<Option<Weight>> = model.links.iter().map(weight).collect();
    for (at, above) in model.above().into_iter().enumerate() {
        if !matches!(model.links[at].mass, Mass::None) {
            continue;
        }
        let Some(com_m) = above
            .map(|joint| &model.joints[joint])
            .filter(|joint| joint.kind != Kind::Fixed)
            .map(|joint| joint.anchor_m)
            .or(model.links[at].is_free.then_some(DVec3::ZERO))
        else {
            continue;
        };
        let Some((carried, weight)) = carried(model, at, &weights) else { continue };
        let what = format!("has no mass, and moves: a thousandth of that of `{}` is added", model.links[carried].name);
        let link = &mut model.links[at];
        notes.push(link.place.note(what));
        let inertia_kg_m2 = Some(DMat3::from_diagonal(DVec3::splat(LENT * weight.moment_kg_m2)));
        link.mass = Mass::Given { mass_kg: (LENT * weight.mass_kg).max(MASS_MIN_KG), com_m, inertia_kg_m2 };
        link.is_lent = true;
        if link.parts.is_empty() {
            link.parts.push(ball(link, com_m, STAND_IN_M));
        }
    }
}

/// The first link with a mass that hangs on a link, through others without one.
fn carried(model: &Model, at: usize, weights: &[Option<Weight>]) -> Option<(usize, Weight)> {
    let mut open = vec![at];
    // joints that close loops reach a link by several ways
    let mut seen = vec![false; weights.len()];
    while let Some(link) = open.pop() {
        if std::mem::replace(&mut seen[link], true) {
            continue;
        }
        for joint in model.joints.iter().filter(|joint| joint.parent == Some(link)) {
            match weights[joint.child] {
                Some(weight) => return Some((joint.child, weight)),
                None => open.push(joint.child),
            }
        }
    }
    None
}

fn weight(link: &Link) -> Option<Weight> {
    let of_ball = |mass_kg: f64, radius_m: f64| Weight { mass_kg, moment_kg_m2: 0.4 * mass_kg * radius_m * radius_m };
    match link.mass {
        Mass::None => None,
        Mass::Given { mass_kg, inertia_kg_m2: Some(tensor), .. } => {
            Some(Weight { mass_kg, moment_kg_m2: tensor.diagonal().element_sum() / 3.0 })
        }
        Mass::Given { mass_kg, .. } => Some(of_ball(mass_kg, 10.0 * STAND_IN_M)),
        Mass::OfParts => {
            let solids = link.parts.iter().filter_map(|part| match &part.shape {
                Shape::Solid(solid) => Some((solid.volume_m3().ok()?, part.density_kg_m3?)),
                Shape::Hull { .. } | Shape::Ellipsoid { .. } | Shape::Ground { .. } => None,
            });
            let mut sum = Weight { mass_kg: 0.0, moment_kg_m2: 0.0 };
            for (volume_m3, density_kg_m3) in solids {
                // as of balls of the same volumes: of a thousandth, the digits do not count
                let radius_m = (0.75 * volume_m3 / std::f64::consts::PI).cbrt();
                let one = of_ball(volume_m3 * density_kg_m3, radius_m);
                sum = Weight { mass_kg: sum.mass_kg + one.mass_kg, moment_kg_m2: sum.moment_kg_m2 + one.moment_kg_m2 };
            }
            (sum.mass_kg > 0.0).then_some(sum)
        }
    }
}

/// The weight of a body; `None` where the scene alone knows a volume.
pub(crate) fn kilograms(mass: &Mass, parts: &[Part]) -> Option<f64> {
    match mass {
        Mass::None => Some(0.0),
        Mass::Given { mass_kg, .. } => Some(*mass_kg),
        Mass::OfParts => {
            let weighing = parts.iter().filter(|part| part.density_kg_m3 != Some(0.0));
            let weights = weighing.map(|part| match &part.shape {
                Shape::Solid(solid) => Some(solid.volume_m3().ok()? * part.density_kg_m3?),
                Shape::Hull { .. } | Shape::Ellipsoid { .. } | Shape::Ground { .. } => None,
            });
            weights.sum()
        }
    }
}

/// Makes all bodies heavier or lighter, so that they weigh `total_kg` together with `static_kg` that never move; returns whether their masses are
/// known here.
pub(crate) fn rescale(model: &mut Model, static_kg: Option<f64>, total_kg: f64) -> bool {
    let all = model.links.iter().map(|link| kilograms(&link.mass, &link.parts)).chain([static_kg]).sum::<Option<f64>>();
    let Some(factor) = all.filter(|all| *all > 0.0).map(|all| total_kg / all) else { return false };
    for link in &mut model.links {
        if let Mass::Given { mass_kg, inertia_kg_m2, .. } = &mut link.mass {
            *mass_kg *= factor;
            *inertia_kg_m2 = inertia_kg_m2.map(|tensor| tensor * factor);
        }
        link.parts.iter_mut().filter_map(|part| part.density_kg_m3.as_mut()).for_each(|density| *density *= factor);
    }
    true
}

/// A ball on a link that nothing touches.
pub(crate) fn ball(link: &Link, at_m: DVec3, radius_m: f64) -> Part {
    Part {
        place: link.place.clone(),
        shape: Shape::Solid(Solid::Ball { radius_m }),
        pose: Pose { position: at_m, ..Pose::IDENTITY },
        density_kg_m3: None,
        touches: false,
    }
}

/// Adds to all three moments of inertia of a link as little as makes them possible for a body.
///
/// # Errors
/// For moments that no addition makes possible: they or their sum are not finite.
pub(crate) fn repair(link: &mut Link, notes: &mut Vec<LeftOut>) -> Result<(), ImportError> {
    let Mass::Given { mass_kg, inertia_kg_m2: Some(tensor), .. } = &mut link.mass else { return Ok(()) };
    let stand_in = 0.4 * *mass_kg * STAND_IN_M * STAND_IN_M;
    let scale = tensor.to_cols_array().iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let is_none = scale < NOTHING * stand_in;
    if is_of_a_body(*tensor) && !is_none {
        return Ok(());
    }
    let least = if is_none { stand_in } else { 1e-4 * scale };
    let raised = |by: f64| *tensor + DMat3::from_diagonal(DVec3::splat(by));
    let Some(added) = (0..DOUBLINGS).map(|i| least * 2.0_f64.powi(i)).find(|by| is_of_a_body(raised(*by))) else {
        return Err(link.place.wrong("has moments of inertia that no body can have; expected some with a finite sum"));
    };
    *tensor = raised(added);
    let what = format!("has moments of inertia that no body has: {added:.3e} kg·m² is added to each");
    notes.push(link.place.note(what));
    Ok(())
}

/// Whether all principal moments are above zero, and none is larger than the sum of the others.
fn is_of_a_body(tensor: DMat3) -> bool {
    let sum = tensor.diagonal().element_sum();
    if !(sum > 0.0 && sum.is_finite()) {
        return false;
    }
    // products of large or small moments would be beyond all numbers
    let (tensor, sum) = (tensor * sum.recip(), 1.0);
    let shifted = |by: f64| DMat3::from_diagonal(DVec3::splat(by));
    is_positive(tensor - shifted(LEAST * sum)) && is_positive(shifted(0.5 * sum * (1.0 + SLACK)) - tensor)
}

/// Whether a symmetric matrix has eigenvalues above zero alone (Sylvester's criterion).
fn is_positive(m: DMat3) -> bool {
    m.x_axis.x > 0.0 && m.x_axis.x * m.y_axis.y - m.x_axis.y * m.y_axis.x > 0.0 && m.determinant() > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::Place;

    fn repaired(moments: [f64; 3]) -> (DVec3, usize) {
        let inertia_kg_m2 = Some(DMat3::from_diagonal(DVec3::from_array(moments)));
        let mut link = Link {
            mass: Mass::Given { mass_kg: 2.0, com_m: DVec3::ZERO, inertia_kg_m2 },
            ..Link::at(String::new(), Place { file: None, line: 1, label: String::new() }, Pose::IDENTITY)
        };
        let mut notes = Vec::new();
        repair(&mut link, &mut notes).unwrap();
        let Mass::Given { inertia_kg_m2: Some(tensor), .. } = link.mass else { panic!("the mass is gone") };
        (tensor.diagonal(), notes.len())
    }

    #[test]
    fn moments_that_no_body_has_are_raised_and_others_stay() {
        assert_eq!(repaired([1.0, 2.0, 3.0]), (DVec3::new(1.0, 2.0, 3.0), 0)); // a flat plate
        // a body of 2 kg that turns as easily as one of a nanometre has none that are meant
        assert_eq!(repaired([2e-18; 3]), (DVec3::splat(2e-18 + 0.4 * 2.0 * 1e-4), 1));
        for moments in [[1.0, 1.0, 3.0], [1.0, 1.0, 0.0], [0.0; 3], [-1.0, 1.0, 1.0]] {
            let (raised, notes) = repaired(moments);
            let (most, sum) = (raised.max_element(), raised.element_sum());
            assert!(
                raised.min_element() > 0.0 && 2.0 * most <= sum * (1.0 + 1e-3) && notes == 1,
                "{moments:?}: {raised}"
            );
        }
    }
}
