//! Brings a model to what a scene can have: links without mass become part of what they are on, and nothing is without a shape.
//!
//! In: a [`Model`] as the file has it. Out: the same where every link has a mass and a part. Never here: XML, TOML.

use crate::masses::{STAND_IN_M, ball, lend, repair};
use crate::model::{End, Fixed, Joint, Kind, Link, Look, Mass, Model, Part, TieKind};
use crate::pose::Pose;
use crate::{ImportError, LeftOut};
use glam::{DMat3, DVec3};
use metachron_geometry::COMPOUND_PARTS_MAX;

/// What a link becomes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fate {
    /// Itself.
    Itself,
    /// Part of the world.
    World,
    /// Part of another link, at a place in its axes.
    PartOf(usize, Pose),
}

/// Settles a model.
///
/// # Errors
/// For a link without mass on a joint that moves.
pub(crate) fn settle(mut model: Model, notes: &mut Vec<LeftOut>) -> Result<Model, ImportError> {
    lend(&mut model, notes);
    let mut fates: Vec<Fate> = Vec::with_capacity(model.links.len());
    for (at, link) in model.links.iter().enumerate() {
        fates.push(fate(link, model.joints.iter().find(|joint| joint.child == at), &fates, &model)?);
    }
    for (at, fate) in fates.iter().enumerate() {
        let parts = if *fate == Fate::Itself { continue } else { std::mem::take(&mut model.links[at].parts) };
        match *fate {
            Fate::PartOf(host, pose) => {
                let moved = parts.into_iter().map(|part| Part { pose: pose.then(part.pose), ..part });
                model.links[host].parts.extend(moved);
            }
            _ => {
                let (name, pose, look) =
                    (model.links[at].name.clone(), model.links[at].pose, model.links[at].look.clone());
                model.fixed.extend(parts.into_iter().enumerate().map(|(i, part)| fixed(&name, i, pose, part, &look)));
            }
        }
    }
    move_ties(&mut model, &fates, notes);
    keep(&mut model, &fates);
    let neighbours = neighbours(&model);
    model.apart.extend(neighbours);
    for link in &mut model.links {
        repair(link, notes);
        choose_parts(link, notes)?;
    }
    Ok(model)
}

fn fixed(link: &str, index: usize, pose: Pose, part: Part, look: &Look) -> Fixed {
    let name = if index == 0 { link.to_owned() } else { format!("{link}-{}", index + 1) };
    Fixed { name, part: Part { pose: pose.then(part.pose), ..part }, look: look.clone() }
}

/// What a link becomes, where those before it have their fates.
fn fate(link: &Link, joint: Option<&Joint>, before: &[Fate], model: &Model) -> Result<Fate, ImportError> {
    if !matches!(link.mass, Mass::None) {
        return Ok(Fate::Itself);
    }
    let Some(joint) = joint else { return Ok(Fate::World) };
    if joint.kind != Kind::Fixed {
        let reason = format!("has no mass, and {} lets it move; expected a mass above zero", joint.place.label);
        return Err(link.place.wrong(reason));
    }
    Ok(match joint.parent.map(|parent| (parent, before[parent])) {
        None | Some((_, Fate::World)) => Fate::World,
        Some((parent, Fate::Itself)) => Fate::PartOf(parent, model.links[parent].pose.inverse().then(link.pose)),
        Some((_, Fate::PartOf(host, _))) => Fate::PartOf(host, model.links[host].pose.inverse().then(link.pose)),
    })
}

/// How much longer than its rope a distance may be by rounding alone, metres.
const ROUNDING_M: f64 = 1e-9;

/// Brings the ends of ties to the bodies that links become; what ties a body to itself is left out, and so is a rope that is too short to start with.
fn move_ties(model: &mut Model, fates: &[Fate], notes: &mut Vec<LeftOut>) {
    let Model { links, ties, .. } = model;
    for end in ties.iter_mut().flat_map(|tie| &mut tie.ends) {
        let Some(link) = end.link else { continue };
        *end = match fates[link] {
            Fate::Itself => *end,
            Fate::PartOf(host, pose) => End { link: Some(host), at_m: pose.point(end.at_m) },
            Fate::World => End { link: None, at_m: links[link].pose.point(end.at_m) },
        };
    }
    ties.retain(|tie| {
        let [a, b] = tie.ends.map(|end| end.link.map_or(end.at_m, |link| links[link].pose.point(end.at_m)));
        let apart_m = a.distance(b);
        let why = match tie.kind {
            _ if tie.ends[0].link == tie.ends[1].link => "both of its ends are on one body".to_owned(),
            TieKind::Rope { length_m } if apart_m > length_m + ROUNDING_M => {
                format!("its ends start {apart_m:.4} m apart, and it is at most {length_m} m long")
            }
            TieKind::Rope { .. } | TieKind::Spring { .. } => return true,
        };
        notes.push(tie.place.note(format!("is left out: {why}")));
        false
    });
}

/// Leaves the links that remain themselves, and the joints and pairs between them.
fn keep(model: &mut Model, fates: &[Fate]) {
    let mut numbers = Vec::with_capacity(fates.len());
    let mut count = 0;
    for fate in fates {
        numbers.push(count);
        count += usize::from(*fate == Fate::Itself);
    }
    let standing = |link: usize| match fates[link] {
        Fate::Itself => Some(numbers[link]),
        Fate::PartOf(host, _) => Some(numbers[host]),
        Fate::World => None,
    };
    model.joints.retain(|joint| fates[joint.child] == Fate::Itself);
    for joint in &mut model.joints {
        (joint.parent, joint.child) = (joint.parent.and_then(standing), numbers[joint.child]);
    }
    for end in model.ties.iter_mut().flat_map(|tie| &mut tie.ends) {
        end.link = end.link.and_then(standing);
    }
    let pairs = std::mem::take(&mut model.apart).into_iter();
    model.apart = pairs.filter_map(|[a, b]| Some([standing(a)?, standing(b)?])).filter(|[a, b]| a != b).collect();
    let mut at = 0;
    model.links.retain(|_| {
        at += 1;
        fates[at - 1] == Fate::Itself
    });
}

/// Links that no joint connects itself, and that are on bodies which one does, or on one body: a body is all that fixed joints make of links, with those
/// without mass that carry it.
/// Shapes overlap there, as those of connected links do.
fn neighbours(model: &Model) -> Vec<[usize; 2]> {
    let above = |link: usize| model.joints.iter().find(|joint| joint.child == link);
    // the first link of each body; none is the world
    let mut bodies: Vec<Option<usize>> = Vec::with_capacity(model.links.len());
    for link in 0..model.links.len() {
        let is_lent = |joint: &&Joint| joint.parent.is_some_and(|parent| model.links[parent].is_lent);
        let welded = above(link).filter(|joint| joint.kind == Kind::Fixed || is_lent(joint));
        bodies.push(welded.map_or(Some(link), |joint| joint.parent.and_then(|parent| bodies[parent])));
    }
    // the body that a body hangs on
    let host = |body: Option<usize>| Some(above(body?)?.parent.and_then(|parent| bodies[parent]));
    let meets = |a: usize, b: usize| {
        let [one, other] = [bodies[a], bodies[b]];
        one == other || host(one) == Some(other) || host(other) == Some(one)
    };
    let jointed = |a: usize, b: usize| {
        let between = |child: usize, parent: usize| above(child).is_some_and(|joint| joint.parent == Some(parent));
        between(a, b) || between(b, a)
    };
    let pairs = (0..model.links.len()).flat_map(|b| (0..b).map(move |a| [a, b]));
    pairs.filter(|[a, b]| meets(*a, *b) && !jointed(*a, *b) && !model.apart.contains(&[*a, *b])).collect()
}

/// Leaves a link the parts that are touched, or else those that are seen, or else a ball with its moments of inertia.
fn choose_parts(link: &mut Link, notes: &mut Vec<LeftOut>) -> Result<(), ImportError> {
    let touched = link.parts.iter().any(|part| part.touches);
    let mut left_out = |part: &Part, what: String| notes.push(part.place.note(what));
    let weighs = |part: &Part| matches!(link.mass, Mass::OfParts) && part.density_kg_m3 != Some(0.0);
    if touched {
        if let Some(part) = link.parts.iter().find(|part| !part.touches && weighs(part)) {
            let reason = "weighs something, and nothing touches it, where something touches other parts of its body; \
                          expected an inertial element in the body";
            return Err(part.place.wrong(reason));
        }
        link.parts
            .iter()
            .filter(|part| !part.touches)
            .for_each(|part| left_out(part, "is only seen: is left out".into()));
        link.parts.retain(|part| part.touches);
    }
    if link.parts.len() > COMPOUND_PARTS_MAX {
        let beyond = &link.parts[COMPOUND_PARTS_MAX..];
        if beyond.iter().any(weighs) {
            let reason = format!("has {} solids that weigh; expected at most {COMPOUND_PARTS_MAX}", link.parts.len());
            return Err(link.place.wrong(reason));
        }
        beyond.iter().for_each(|part| left_out(part, format!("is left out: it is beyond {COMPOUND_PARTS_MAX} solids")));
        link.parts.truncate(COMPOUND_PARTS_MAX);
    }
    if link.parts.is_empty() {
        link.parts.push(stand_in(link));
    }
    Ok(())
}

/// A ball at the centre of mass, as large as one of its mass and its mean moment of inertia, that nothing touches.
fn stand_in(link: &Link) -> Part {
    let (mass_kg, com_m, tensor) = match link.mass {
        Mass::Given { mass_kg, com_m, inertia_kg_m2: Some(tensor) } => (mass_kg, com_m, tensor),
        Mass::Given { com_m, inertia_kg_m2: None, .. } => (1.0, com_m, DMat3::ZERO),
        Mass::None | Mass::OfParts => (1.0, DVec3::ZERO, DMat3::ZERO),
    };
    let mean = (tensor.x_axis.x + tensor.y_axis.y + tensor.z_axis.z) / 3.0;
    // a ball has 2/5 m r²
    let radius_m = if mean > 0.0 { (2.5 * mean / mass_kg).sqrt().clamp(1e-6, 1e4) } else { STAND_IN_M };
    ball(link, com_m, radius_m)
}
