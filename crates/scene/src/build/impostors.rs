//! Builds the impostor of a group: one mesh, and the levels that it is cut to.
//!
//! In: a `[[group]]` table, the objects that it names. Out: the mesh as scenery, and the triangles of each level.
//! Never here: membership of groups, choice of the level drawn. Theory: `docs/theory/multiresolution.md`, section 2.

use super::scenery::mesh_model;
use crate::check::{Checker, Place};
use crate::format::GroupFile;
use crate::source::Source;
use glam::{DQuat, DVec3};
use metachron_drawable::{Model, Placement, ProgressiveMesh, proxy};
use metachron_world::{Appearance, GROUP_LEVELS_MAX, Member, Scenery};
use std::sync::Arc;

/// By default the finest level has this share of its members' triangles, within these bounds.
const SHARE: f64 = 0.05;
const TRIANGLES: (u32, u32) = (12, 2000);
/// Triangles of a simulated member in the mean colour of its group.
const AGENT_TRIANGLES: f64 = 320.0;
/// Each coarser level has this many times fewer triangles.
const COARSER: u32 = 4;

/// The objects of a group.
pub(super) struct GroupMembers<'a> {
    /// Meshes and trees.
    pub(super) scenery: &'a [Scenery],
    /// Simulated objects.
    pub(super) agents: &'a [&'a Member],
}

impl GroupMembers<'_> {
    /// Looks of all of them, each with its part in their mean: its triangles, or a ball's for a simulated object.
    fn appearances(&self) -> impl Iterator<Item = (&Appearance, f64)> {
        let scenery = self.scenery.iter().map(|it| (&it.appearance, f64::from(it.model.range().1)));
        scenery.chain(self.agents.iter().map(|it| (&it.appearance, AGENT_TRIANGLES)))
    }
}

/// The mesh of a group and its levels; `None` where something is wrong, which is reported.
pub(super) fn impostors(
    c: &mut Checker<'_, '_>,
    place: &Place,
    file: &GroupFile,
    members: &GroupMembers<'_>,
    source: &Source,
) -> Option<(Scenery, Vec<u32>)> {
    let before = c.count();
    let wanted = file.levels.as_deref();
    if let Some(levels) = wanted {
        check(c, place, levels);
    }
    let (first, _) = members.appearances().next()?;
    let first = *first;
    let (mesh, at) = match &file.proxy {
        Some(given) => {
            let (mesh, at) = mesh_model(c, &place.table("proxy"), given, source)?;
            let has = mesh.range().1.max(given.triangles.unwrap_or(0));
            if let Some((key, count)) = wanted.and_then(|levels| first_past(levels, has)) {
                let what = format_args!("has {count} triangles where `proxy` has {has}");
                c.wrong(place, &key, what, format!("expected at most {has}"));
            }
            (mesh, at)
        }
        None if c.count() > before => return None,
        None if !members.agents.is_empty() => {
            let what = format_args!("is missing, and member `{}` is simulated", members.agents[0].name);
            c.wrong(place, "proxy", what, "expected a mesh, such as `proxy = { generate = \"sphere\" }`");
            return None;
        }
        None => merged_mesh(c, place, members.scenery, wanted)?,
    };
    if c.count() > before {
        return None;
    }
    let levels = match wanted {
        Some(levels) => cuts(c, place, levels, &mesh)?,
        None => default_levels(&mesh),
    };
    let importance = members.appearances().map(|(look, _)| look.importance).fold(0.0, f64::max);
    let appearance = Appearance { colour: mean_colour(members), importance, ..first };
    let (name, model) = (file.name.clone(), Model::Mesh(mesh));
    Some((Scenery { name, model, at, appearance, texture: None, motion: None }, levels))
}

/// Reports levels that are wrong whatever mesh they are cut from.
fn check(c: &mut Checker<'_, '_>, place: &Place, levels: &[u32]) {
    for (at, count) in levels.iter().enumerate() {
        let key = format!("levels.{at}");
        if let Some(before) = at.checked_sub(1).map(|at| levels[at]).filter(|before| before >= count) {
            let expected = "expected rising numbers, the coarsest level first";
            c.wrong(place, &key, format_args!("goes from {before} to {count}"), expected);
        }
    }
}

/// The first level with more triangles than `has`, and its key.
fn first_past(levels: &[u32], has: u32) -> Option<(String, u32)> {
    levels.iter().enumerate().find(|(_, count)| **count > has).map(|(at, count)| (format!("levels.{at}"), *count))
}

/// One mesh made of all members.
fn merged_mesh(
    c: &mut Checker<'_, '_>,
    place: &Place,
    members: &[Scenery],
    wanted: Option<&[u32]>,
) -> Option<(Arc<ProgressiveMesh>, Placement)> {
    let all: f64 = members.iter().map(|m| f64::from(m.model.range().1)).sum();
    let usual = (SHARE * all).round().clamp(f64::from(TRIANGLES.0), f64::from(TRIANGLES.1)) as u32;
    let finest = wanted.and_then(<[u32]>::last).copied().unwrap_or(usual);
    let origin = members.iter().map(|m| m.at.position).sum::<DVec3>() / members.len() as f64;
    let parts: Vec<(Model, Placement)> = members.iter().map(|m| (m.model.clone(), m.at)).collect();
    match proxy(&parts, origin, finest) {
        Ok(mesh) => Some((Arc::new(mesh), Placement { position: origin, rotation: DQuat::IDENTITY, scale: 1.0 })),
        Err(why) => {
            c.wrong(
                place,
                "members",
                format_args!("cannot be merged into one mesh: {why}"),
                "expected meshes with an area",
            );
            None
        }
    }
}

/// The triangles that the mesh has at each level; `None` where two levels are equal or one is below its coarsest, which is reported.
fn cuts(c: &mut Checker<'_, '_>, place: &Place, levels: &[u32], mesh: &ProgressiveMesh) -> Option<Vec<u32>> {
    let (least, most) = mesh.range();
    let mut made: Vec<u32> = Vec::with_capacity(levels.len());
    for (at, count) in levels.iter().enumerate() {
        let cut = mesh.cut(*count).triangles;
        if *count < least || made.last().is_some_and(|before| *before >= cut) {
            let what = format_args!(
                "requests {count} triangles, which gives {cut}, the same as the level before it or below the coarsest"
            );
            let expected = format!("expected levels from {least} to {most} triangles, the range of its mesh");
            c.wrong(place, &format!("levels.{at}"), what, expected);
            return None;
        }
        made.push(cut);
    }
    Some(made)
}

/// Default levels: all triangles of the mesh, then coarser levels as long as they have enough triangles to show a shape.
fn default_levels(mesh: &ProgressiveMesh) -> Vec<u32> {
    let (least, most) = mesh.range();
    let coarser = |count: &u32| Some(count / COARSER).filter(|count| *count >= TRIANGLES.0.max(least));
    let mut levels: Vec<u32> = std::iter::successors(Some(most), coarser).take(GROUP_LEVELS_MAX).collect();
    levels.reverse();
    let mut levels: Vec<u32> = levels.into_iter().map(|count| mesh.cut(count).triangles).collect();
    levels.dedup();
    levels
}

/// Mean colour of the members, weighted by their triangles.
fn mean_colour(members: &GroupMembers<'_>) -> [u8; 3] {
    let all: f64 = members.appearances().map(|(_, weight)| weight).sum();
    std::array::from_fn(|i| {
        let sum: f64 = members.appearances().map(|(look, weight)| weight * f64::from(look.colour[i])).sum();
        (sum / all.max(1.0)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use crate::{SceneError, Source, load};
    use metachron_world::Scene;

    /// A forest of 25 balls of 200 triangles as a group with these keys in addition to its name and members.
    fn wood(keys: &str) -> Result<Scene, SceneError> {
        let text = format!(
            "format = 1\n[[object]]\nname = \"b\"\nmodel = \"mesh\"\ngenerate = \"sphere\"\ntriangles = 200\ngrid = [5, 5, 1]\nspacing_m = [3, 3, 0]\n[[group]]\nname = \"g\"\nmembers = [\"b-*\"]\n{keys}\n"
        );
        Source::memory("group", text.as_bytes()).and_then(|source| load(&source, &[]))
    }

    fn levels(keys: &str) -> Vec<u32> {
        wood(keys).unwrap().groups[0].levels.clone()
    }

    fn message(keys: &str) -> String {
        let problems = wood(keys).expect_err(keys).problems;
        problems.iter().map(|p| format!("{}; {}; {}\n", p.message, p.expected, p.text)).collect()
    }

    #[test]
    fn levels_are_cuts_of_one_mesh_with_the_triangles_asked_for() {
        let made = levels("levels = [20, 80, 320]");
        assert_eq!(made.len(), 3, "{made:?}");
        // removing a vertex removes two triangles, in a chain of substitutes a few more
        assert!(made.iter().zip([20, 80, 320]).all(|(cut, asked)| *cut <= asked && cut + 6 > asked), "{made:?}");
        let sphere = "proxy = { generate = \"sphere\", triangles = 320, scale = 8 }";
        assert_eq!(levels(&format!("{sphere}\nlevels = [20, 320]")).len(), 2);
        assert_eq!(levels("levels = [64]").len(), 1);
    }

    #[test]
    fn default_levels_start_at_a_twentieth_of_the_members_and_fall_by_quarters() {
        let made = levels("");
        // 25 balls of about 200 triangles: 250, 62, 15
        assert_eq!(made.len(), 3, "{made:?}");
        assert!(made[2].abs_diff(250) <= 8 && made[1].abs_diff(62) <= 6 && made[0].abs_diff(15) <= 4, "{made:?}");
        assert_eq!(levels("proxy = { generate = \"sphere\", triangles = 20, scale = 8 }"), [20]);
    }

    #[test]
    fn wrong_levels_are_refused_at_their_position() {
        let small = "proxy = { generate = \"sphere\", triangles = 100, scale = 8 }\nlevels = [20, 320]";
        let cases = [
            ("levels = []", "`levels` of group `g` has 0 entries; expected 1 … 8"),
            ("levels = [1, 2, 3, 4, 5, 6, 7, 8, 9]", "has 9 entries"),
            ("levels = [80, 20]", "goes from 80 to 20; expected rising"),
            ("levels = [80, 80]", "goes from 80 to 80"),
            ("levels = [0, 20]", "is 0; expected a number from 1 to 100000"),
            ("levels = [20, 200000]", "is 200000"),
            ("levels = [-4]", "integer `-4`"),
            ("levels = [nan]", "floating point"),
            ("levels = [20.5]", "floating point"),
            ("levels = [\"few\"]", "string"),
            ("levels = 20", "integer `20`"),
            ("levels = [20, 21]", "as the level before it"),
            ("levels = [1]", "expected levels from"),
            (small, "has 320 triangles where `proxy` has 100; expected at most 100"),
            ("proxy_triangles = 20", "proxy_triangles"),
        ];
        for (keys, expected) in cases {
            let message = message(keys);
            assert!(message.contains(expected), "{keys}\n{message}");
        }
    }
}
