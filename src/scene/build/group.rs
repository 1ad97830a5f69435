//! Groups of the file: whose members may be drawn as one mesh.
//!
//! In: `[[group]]` tables and all scenery. Out: groups, and the scenery put in order so that members stand side by side.
//! Never here: when a group is drawn as one.

use super::object::{Named, Objects};
use super::scenery::mesh_model;
use crate::scene::cast::{Group, Look, Scenery};
use crate::scene::check::{Checker, Place, allowed};
use crate::scene::format::GroupFile;
use crate::scene::source::Source;
use glam::{DQuat, DVec3};
use metachron_agents::shape::{Model, Placement, proxy};
use std::sync::Arc;

/// Most groups of a scene.
const GROUPS_MAX: usize = 1000;
/// A proxy has this share of its members' triangles where a scene does not say, within these bounds.
const PROXY_SHARE: f64 = 0.05;
const PROXY_TRIANGLES: (f64, f64) = (12.0, 2000.0);

/// Reads every group and puts the scenery in order.
pub(in crate::scene) fn groups(
    c: &mut Checker<'_, '_>,
    files: &[GroupFile],
    (objects, source): (&mut Objects, &Source),
) -> Vec<Group> {
    if files.len() > GROUPS_MAX {
        let expected = format!("expected at most {GROUPS_MAX}");
        c.wrong(&Place::new("", ""), "group", format_args!("has {} entries", files.len()), expected);
        return Vec::new();
    }
    let mut owner = vec![None; objects.scenery.len()];
    for (number, file) in files.iter().enumerate() {
        let place = Place::new(format!("group.{number}"), format!("of group `{}`", file.name));
        if objects.names.is_known(&file.name) || files[..number].iter().any(|other| other.name == file.name) {
            c.wrong(&place, "name", format_args!("`{}` is taken", file.name), "expected a name of its own");
        }
        claim(c, &place, (number, file), (objects, &mut owner));
    }
    let mut order: Vec<usize> = (0..owner.len()).collect();
    // those of no group first, the others group by group
    order.sort_by_key(|&i| owner[i].map_or(0, |group: usize| group + 1));
    objects.scenery = order.iter().map(|&i| objects.scenery[i].clone()).collect();
    let mut start = owner.iter().filter(|group| group.is_none()).count();
    let mut made = Vec::with_capacity(files.len());
    for (number, file) in files.iter().enumerate() {
        let end = start + owner.iter().filter(|group| **group == Some(number)).count();
        let place = Place::new(format!("group.{number}"), format!("of group `{}`", file.name));
        if let Some(proxy) = proxy_of(c, &place, file, (&objects.scenery[start..end], source)) {
            made.push(Group { proxy, members: start..end });
        }
        start = end;
    }
    made
}

/// Marks the members of a group as its own.
fn claim(
    c: &mut Checker<'_, '_>,
    place: &Place,
    (number, file): (usize, &GroupFile),
    (objects, owner): (&Objects, &mut [Option<usize>]),
) {
    if file.members.is_empty() {
        c.wrong(place, "members", "is empty", "expected names of meshes and trees");
    }
    for (at, wanted) in file.members.iter().enumerate() {
        let key = format!("members.{at}");
        let found: Vec<usize> = (0..owner.len()).filter(|&i| is_meant(&objects.scenery[i].name, wanted)).collect();
        let others = objects.names.only(|named| named != Named::Scenery);
        if let Some(other) = others.into_iter().find(|name| is_meant(name, wanted)) {
            let what = format_args!("names `{other}`, which is neither mesh nor tree");
            return c.wrong(place, &key, what, "expected scenery: what is simulated or fixed is drawn by itself");
        }
        if found.is_empty() {
            c.reference(place, &key, wanted, objects.names.only(|named| named == Named::Scenery));
        }
        for i in found {
            if owner[i].is_some_and(|other| other != number) {
                let what = format_args!("names `{}`, which is in another group", objects.scenery[i].name);
                return c.wrong(place, &key, what, "expected every object in one group at most");
            }
            owner[i] = Some(number);
        }
    }
}

/// Whether a member's name means this part: itself, its leaves, or all that begin as it does before its star.
fn is_meant(name: &str, wanted: &str) -> bool {
    match wanted.strip_suffix('*') {
        Some(start) => name.starts_with(start),
        None => name == wanted || name.strip_suffix(".leaves") == Some(wanted),
    }
}

fn proxy_of(
    c: &mut Checker<'_, '_>,
    place: &Place,
    file: &GroupFile,
    (members, source): (&[Scenery], &Source),
) -> Option<Scenery> {
    let first = members.first()?;
    let all: f64 = members.iter().map(|m| f64::from(m.model.range().1)).sum();
    let usual = (PROXY_SHARE * all).clamp(PROXY_TRIANGLES.0, PROXY_TRIANGLES.1).round();
    let wanted = (file.proxy_triangles.map(f64::from), usual);
    let triangles = c.number_or(place, "proxy_triangles", wanted, &allowed(1.0..=1e5, "")) as u32;
    let importance = members.iter().map(|m| m.look.importance).fold(0.0, f64::max);
    let look = Look { colour: mean_colour(members), importance, ..first.look };
    let name = file.name.clone();
    if let Some(given) = &file.proxy {
        let (tom, at) = mesh_model(c, &place.table("proxy"), given, source)?;
        return Some(Scenery { name, model: Model::Mesh(tom), at, look, texture: None });
    }
    let origin = members.iter().map(|m| m.at.position).sum::<DVec3>() / members.len() as f64;
    let parts: Vec<(Model, Placement)> = members.iter().map(|m| (m.model.clone(), m.at)).collect();
    match proxy(&parts, origin, triangles) {
        Ok(tom) => {
            let at = Placement { position: origin, rotation: DQuat::IDENTITY, scale: 1.0 };
            Some(Scenery { name, model: Model::Mesh(Arc::new(tom)), at, look, texture: None })
        }
        Err(why) => {
            c.wrong(place, "members", format_args!("cannot be drawn as one: {why}"), "expected meshes with an area");
            None
        }
    }
}

/// The members' colours, each as often as it has triangles.
fn mean_colour(members: &[Scenery]) -> [u8; 3] {
    let weight = |m: &Scenery| f64::from(m.model.range().1);
    let all: f64 = members.iter().map(weight).sum();
    std::array::from_fn(|i| {
        (members.iter().map(|m| weight(m) * f64::from(m.look.colour[i])).sum::<f64>() / all.max(1.0)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use crate::scene::{Source, load};

    /// What is said of a group of these members beside a mesh `a1` and a ball `a2` that falls.
    fn told(members: &str) -> String {
        let text = format!(
            "format = 1\n[[object]]\nname = \"a1\"\nmodel = \"mesh\"\ngenerate = \"sphere\"\n[[object]]\nname = \"a2\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nposition_m = [0, 0, 1]\n[[group]]\nname = \"g\"\nmembers = {members}\n"
        );
        let loaded = Source::memory("group", text.as_bytes()).and_then(|source| load(&source, &[]));
        loaded.err().map_or(String::new(), |problems| format!("{problems:?}"))
    }

    #[test]
    fn what_is_simulated_is_refused_as_a_member_by_its_name_and_by_a_star() {
        assert_eq!(told("[\"a1\"]"), "");
        for members in ["[\"a2\"]", "[\"a1\", \"a2\"]", "[\"a*\"]"] {
            let told = told(members);
            assert!(told.contains("names `a2`, which is neither mesh nor tree"), "{members}: {told}");
        }
        assert!(told("[\"b*\"]").contains("does not exist"));
    }
}
