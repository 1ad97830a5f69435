//! Reads the groups of a scene file: scenery that may be drawn as one mesh.
//!
//! In: `[[group]]` tables and all scenery. Out: groups, and the scenery reordered so that the members of a group are adjacent.
//! Never here: the mesh that replaces them, and when it is drawn.

use super::impostors::impostors;
use super::object::{NamedObject, Objects};
use crate::check::{Checker, Place};
use crate::format::GroupFile;
use crate::source::Source;
use metachron_world::Group;

/// Most groups of a scene.
const GROUPS_MAX: usize = 1000;

/// Reads every group and reorders the scenery.
pub(crate) fn groups(
    c: &mut Checker<'_, '_>,
    files: &[GroupFile],
    objects: &mut Objects,
    source: &Source,
) -> Vec<Group> {
    if files.len() > GROUPS_MAX {
        let expected = format!("expected at most {GROUPS_MAX}");
        c.wrong(&Place::new("", ""), "group", format_args!("has {} entries", files.len()), expected);
        return Vec::new();
    }
    let mut owner = vec![None; objects.scenery.len()];
    for (number, file) in files.iter().enumerate() {
        let place = group_place(number, file);
        if objects.names.is_known(&file.name) || files[..number].iter().any(|other| other.name == file.name) {
            c.wrong(
                &place,
                "name",
                format_args!("is `{}`, the name of another object or group", file.name),
                "expected a unique name",
            );
        }
        claim(c, number, file, objects, &mut owner);
    }
    let mut order: Vec<usize> = (0..owner.len()).collect();
    // scenery of no group first, then group by group
    order.sort_by_key(|&i| owner[i].map_or(0, |group: usize| group + 1));
    objects.scenery = order.iter().map(|&i| objects.scenery[i].clone()).collect();
    let mut start = owner.iter().filter(|group| group.is_none()).count();
    let mut made = Vec::with_capacity(files.len());
    for (number, file) in files.iter().enumerate() {
        let end = start + owner.iter().filter(|group| **group == Some(number)).count();
        let place = group_place(number, file);
        if let Some((proxy, levels)) = impostors(c, &place, file, &objects.scenery[start..end], source) {
            made.push(Group { proxy, levels, members: start..end });
        }
        start = end;
    }
    made
}

/// The place of group `number` in the scene file.
fn group_place(number: usize, file: &GroupFile) -> Place {
    Place::new(format!("group.{number}"), format!("of group `{}`", file.name))
}

/// Assigns its members to group `number`; `owner` holds the group of every object of the scenery.
fn claim(c: &mut Checker<'_, '_>, number: usize, file: &GroupFile, objects: &Objects, owner: &mut [Option<usize>]) {
    let place = &group_place(number, file);
    if file.members.is_empty() {
        c.wrong(place, "members", "is empty", "expected names of meshes and trees");
    }
    for (at, wanted) in file.members.iter().enumerate() {
        let key = format!("members.{at}");
        let found: Vec<usize> = (0..owner.len()).filter(|&i| is_meant(&objects.scenery[i].name, wanted)).collect();
        let others = objects.names.only(|named| named != NamedObject::Scenery);
        if let Some(other) = others.into_iter().find(|name| is_meant(name, wanted)) {
            let what = format_args!("names `{other}`, which is neither mesh nor tree");
            return c.wrong(
                place,
                &key,
                what,
                "expected scenery: simulated and fixed objects cannot be members of a group",
            );
        }
        if found.is_empty() {
            c.reference(place, &key, wanted, objects.names.only(|named| named == NamedObject::Scenery));
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

/// Whether `wanted` selects `name`: the same name, a tree's leaves, or with a final `*` every name with that prefix.
fn is_meant(name: &str, wanted: &str) -> bool {
    match wanted.strip_suffix('*') {
        Some(start) => name.starts_with(start),
        None => name == wanted || name.strip_suffix(".leaves") == Some(wanted),
    }
}

#[cfg(test)]
mod tests {
    use crate::{Source, load};

    /// The problems of a scene with a group of these members, a mesh `a1` and a falling ball `a2`; empty if there are none.
    fn message(members: &str) -> String {
        let text = format!(
            "format = 1\n[[object]]\nname = \"a1\"\nmodel = \"mesh\"\ngenerate = \"sphere\"\n[[object]]\nname = \"a2\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nposition_m = [0, 0, 1]\n[[group]]\nname = \"g\"\nmembers = {members}\n"
        );
        let loaded = Source::memory("group", text.as_bytes()).and_then(|source| load(&source, &[]));
        loaded.err().map_or(String::new(), |problems| format!("{problems:?}"))
    }

    #[test]
    fn a_simulated_object_is_refused_as_a_group_member_by_name_and_by_star() {
        assert_eq!(message("[\"a1\"]"), "");
        for members in ["[\"a2\"]", "[\"a1\", \"a2\"]", "[\"a*\"]"] {
            let message = message(members);
            assert!(message.contains("names `a2`, which is neither mesh nor tree"), "{members}: {message}");
        }
        assert!(message("[\"b*\"]").contains("does not exist"));
    }
}
