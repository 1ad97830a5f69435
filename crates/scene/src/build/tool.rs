//! Reads a tool of a scene file as a [`ToolSpec`].

use super::common::rotation;
use super::common::rounded;
use super::objects::{ModelContext, NamedObject, Names};
use crate::check::{Checker, Place};
use crate::format::{KeyframeFile, Point, ToolFile};
use glam::{DQuat, DVec3};
use metachron_core::AgentId;
use metachron_models::tool::{Keyframe, ToolSpec};

/// Default reach of the jaws, metres.
const REACH_DEFAULT_M: f64 = 0.02;
/// Default limit of the force of a tool's drive, newtons: an arm holds against it without effort.
const FORCE_DEFAULT_N: f64 = 50.0;
/// Reads a tool.
pub(super) fn build(c: &mut Checker<'_, '_>, file: &ToolFile, context: &ModelContext<'_>, names: &Names) -> ToolSpec {
    let place = context.place;
    let keyframes = keyframes(c, place, &file.keyframe);
    ToolSpec {
        pivot_m: file.pivot_m.and_then(|pivot| pivot_of(c, place, pivot, &keyframes)),
        keyframes,
        repeat: file.repeat.unwrap_or(false),
        reach_m: file.reach_m.unwrap_or(REACH_DEFAULT_M),
        stiffness_n_m: file.stiffness_n_m.unwrap_or(200.0),
        damping_n_s_m: file.damping_n_s_m.unwrap_or(1.0),
        max_force_n: file.max_force_n.unwrap_or(FORCE_DEFAULT_N),
        graspable: graspable(c, place, file, names),
        starts_off_m: DVec3::ZERO,
        traits: context.traits,
    }
}

/// The pivot, where the shaft passes through it in every keyframe.
fn pivot_of(c: &mut Checker<'_, '_>, place: &Place, file: Point, keyframes: &[Keyframe]) -> Option<DVec3> {
    let pivot = DVec3::from(file);
    let reached = ToolSpec::insertion_m();
    let far = keyframes.iter().enumerate().find(|(_, key)| !reached.contains(&key.tip_m.distance(pivot)));
    let Some((number, key)) = far else { return Some(pivot) };
    let depth_m = key.tip_m.distance(pivot);
    let what = format!("is {} m from the tip of keyframe {}", rounded(depth_m), number + 1);
    let (least, most) = (rounded(*reached.start()), rounded(*reached.end()));
    c.wrong(
        place,
        "pivot_m",
        what,
        format!("expected {least} … {most} m: the pivot is a point of the shaft, behind the jaws"),
    );
    None
}

fn graspable(c: &mut Checker<'_, '_>, place: &Place, file: &ToolFile, names: &Names) -> Vec<AgentId> {
    let Some(wanted) = &file.grasps else { return names.tubes().map(|(_, id)| id).collect() };
    let mut found = Vec::with_capacity(wanted.len().min(names.len()));
    for (i, name) in wanted.iter().enumerate() {
        let key = format!("grasps.{i}");
        let named = names.get(name);
        if let Some(what) = named.and_then(ungraspable) {
            let expected = "expected the name of a tube, sheet, solid, rope or rigid object that moves";
            c.wrong(place, &key, format_args!("names `{name}`, {what}, which jaws cannot grasp"), expected);
        } else if c.reference(place, &key, name, names.only(|named| named.graspable().is_some())) {
            found.extend(named.and_then(NamedObject::graspable).filter(|id| !found.contains(id)));
        }
    }
    found
}

/// Description of an object that jaws cannot hold; `None` for one that they can.
const fn ungraspable(named: NamedObject) -> Option<&'static str> {
    match named {
        NamedObject::Fixed => Some("a fixed object"),
        NamedObject::Scenery => Some("a mesh or tree without matter"),
        NamedObject::Tool(_) => Some("a tool"),
        NamedObject::Synthetic(_) => Some("an agent without matter"),
        NamedObject::Rigid(_) | NamedObject::Tube(_) | NamedObject::Soft(_) => None,
    }
}

fn keyframes(c: &mut Checker<'_, '_>, place: &Place, files: &[KeyframeFile]) -> Vec<Keyframe> {
    let still = Keyframe { at_s: 0.0, tip_m: DVec3::ZERO, rotation: DQuat::IDENTITY, jaw: 1.0 };
    let mut out: Vec<Keyframe> = Vec::with_capacity(files.len());
    for (i, file) in files.iter().enumerate() {
        let before = out.last().copied();
        let key = keyframe(file, before.unwrap_or(still));
        if let (None, Some(before)) = (file.at_s, before) {
            let expected = format!("expected `at_s` above {} in this table", before.at_s);
            c.wrong(&place.entry("keyframe", i), "at_s", "is missing", expected);
        } else if before.is_some_and(|b| key.at_s <= b.at_s) {
            let expected = format!("expected a time after the keyframe before, {} s", out[i - 1].at_s);
            c.wrong(&place.entry("keyframe", i), "at_s", format_args!("is {}", key.at_s), expected);
        }
        out.push(key);
    }
    out
}

fn keyframe(file: &KeyframeFile, before: Keyframe) -> Keyframe {
    Keyframe {
        at_s: file.at_s.unwrap_or(0.0),
        tip_m: file.tip_m.into(),
        rotation: file.rotation_deg.map_or(before.rotation, |deg| rotation(Some(deg))),
        jaw: file.jaw.unwrap_or(before.jaw),
    }
}
