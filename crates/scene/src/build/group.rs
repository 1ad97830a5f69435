//! Reads the groups of a scene file: objects, and groups of them, that may be drawn as one mesh.
//!
//! In: `[[group]]` tables and all objects. Out: groups, inner ones first, and the scenery reordered so that the members of a group are
//! adjacent.
//! Never here: the mesh that replaces them, and when it is drawn.

use super::impostors::{GroupMembers, impostors};
use super::objects::{NamedObject, Objects};
use super::scenery::mesh_model;
use crate::check::{Checker, Place};
use crate::format::GroupFile;
use crate::source::Source;
use metachron_core::AgentId;
use metachron_world::{Group, Member};

/// Reads every group and reorders the scenery.
pub(crate) fn groups(
    c: &mut Checker<'_, '_>,
    files: &[GroupFile],
    objects: &mut Objects,
    source: &Source,
) -> Vec<Group> {
    if c.is_draft() {
        let proxies = files.iter().enumerate().filter_map(|(number, file)| Some((number, file.proxy.as_ref()?)));
        proxies.for_each(|(number, proxy)| {
            let place = group_place(c, number).table("proxy");
            mesh_model(c, &place, proxy, source);
        });
        return Vec::new();
    }
    let mut owners = Owners {
        scenery: vec![None; objects.scenery.len()],
        agents: vec![None; objects.agents.len()],
        groups: vec![None; files.len()],
    };
    for (number, file) in files.iter().enumerate() {
        let place = group_place(c, number);
        if objects.names.is_known(&file.name) || files[..number].iter().any(|other| other.name == file.name) {
            c.wrong(
                &place,
                "name",
                format_args!("is `{}`, the name of another object or group", file.name),
                "expected a unique name",
            );
        }
        claim(c, number, files, objects, &mut owners);
    }
    if let Some(number) = owners.in_itself() {
        let what = format_args!("put group `{}` into itself", files[number].name);
        let expected = "expected groups that contain each other in one direction";
        let place = group_place(c, number);
        c.wrong(&place, "members", what, expected);
        return Vec::new();
    }
    let order = owners.inner_first();
    let rank: Vec<usize> = (0..files.len()).map(|g| order.iter().position(|o| *o == g).unwrap_or(g)).collect();
    // scenery of no group first, then group by group, so that a group's own comes after that of the groups in it
    let key = |i: &usize| owners.scenery[*i].map_or(0, |group| rank[group] + 1);
    let mut sorted: Vec<usize> = (0..owners.scenery.len()).collect();
    sorted.sort_by_key(key);
    objects.scenery = sorted.iter().map(|&i| objects.scenery[i].clone()).collect();
    let before = |rank: usize| sorted.iter().filter(|i| key(i) <= rank).count();
    let mut made = Vec::with_capacity(files.len());
    for (at, &number) in order.iter().enumerate() {
        let first = at - order[..at].iter().filter(|&&other| owners.is_within(other, number)).count();
        let members = before(first)..before(at + 1);
        let place = group_place(c, number);
        let held = owners.agents_in(number, &objects.agents);
        let of_group = GroupMembers { scenery: &objects.scenery[members.clone()], agents: &held };
        if let Some((proxy, levels)) = impostors(c, &place, &files[number], &of_group, source) {
            let agents: Vec<AgentId> = held.iter().map(|agent| agent.id).collect();
            made.push(Group { proxy, levels, agents, members, groups: first..at });
        }
    }
    made
}

/// For every object of the scenery, for every agent and for every group the group that it is in.
struct Owners {
    scenery: Vec<Option<usize>>,
    agents: Vec<Option<usize>>,
    groups: Vec<Option<usize>>,
}

impl Owners {
    /// The groups around a group, from within; endless where one is in itself.
    fn around(&self, group: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(self.groups[group], |outer| self.groups[*outer])
    }

    /// The first group that is in itself.
    fn in_itself(&self) -> Option<usize> {
        let all = self.groups.len();
        (0..all).find(|group| self.around(*group).take(all).any(|outer| outer == *group))
    }

    /// The agents of a group and of the groups in it.
    fn agents_in<'a>(&self, group: usize, agents: &'a [Member]) -> Vec<&'a Member> {
        let is_in = |owner: &Option<usize>| owner.is_some_and(|inner| inner == group || self.is_within(inner, group));
        agents.iter().zip(&self.agents).filter(|(_, owner)| is_in(owner)).map(|(agent, _)| agent).collect()
    }

    fn is_within(&self, inner: usize, outer: usize) -> bool {
        self.around(inner).any(|group| group == outer)
    }

    /// All groups, each after the groups in it, which come directly before it.
    fn inner_first(&self) -> Vec<usize> {
        let mut order = Vec::with_capacity(self.groups.len());
        self.push_within(None, &mut order);
        order
    }

    fn push_within(&self, outer: Option<usize>, order: &mut Vec<usize>) {
        for group in (0..self.groups.len()).filter(|group| self.groups[*group] == outer) {
            self.push_within(Some(group), order);
            order.push(group);
        }
    }
}

/// The place of group `number` in the scene file.
fn group_place(c: &Checker<'_, '_>, number: usize) -> Place {
    c.place(&format!("group.{number}"))
}

/// Assigns its members to group `number`.
fn claim(c: &mut Checker<'_, '_>, number: usize, files: &[GroupFile], objects: &Objects, owners: &mut Owners) {
    let place = &group_place(c, number);
    for (at, wanted) in files[number].members.iter().enumerate() {
        let key = format!("members.{at}");
        let others = objects.names.only(|named| matches!(named, NamedObject::Fixed | NamedObject::Synthetic(_)));
        if let Some(other) = others.into_iter().find(|name| is_meant(name, wanted)) {
            let what = format_args!("names `{other}`, which is fixed or never drawn");
            let expected = "expected meshes, trees, groups, and simulated objects with a shape";
            return c.wrong(place, &key, what, expected);
        }
        let scenery = objects.scenery.iter().map(|it| &it.name).zip(&mut owners.scenery);
        let agents = objects.agents.iter().map(|it| &it.name).zip(&mut owners.agents);
        // a pattern that many names match does not mean the group that has it
        let itself = &files[number].name;
        let groups = files.iter().map(|file| &file.name).zip(&mut owners.groups);
        let groups = groups.filter(|(name, _)| *name != itself || *name == wanted);
        let mut found = 0;
        let scene_looks = || objects.scenery.iter().map(|it| (&it.name, &it.appearance));
        let looks = || scene_looks().chain(objects.agents.iter().map(|it| (&it.name, &it.appearance)));
        let vanishes = |name: &str| looks().any(|(known, look)| known == name && look.may_vanish == Some(true));
        for (name, owner) in scenery.chain(agents).chain(groups).filter(|(name, _)| is_meant(name, wanted)) {
            if vanishes(name) {
                let what = format_args!("names `{name}`, whose `may_vanish = true` has no effect in a group");
                return c.wrong(
                    place,
                    &key,
                    what,
                    "expected members without it: where time is short, the group's mesh is drawn",
                );
            }
            if owner.is_some_and(|other| other != number) {
                let what = format_args!("names `{name}`, which is in another group");
                return c.wrong(place, &key, what, "expected every object in one group at most");
            }
            *owner = Some(number);
            found += 1;
        }
        if found == 0 {
            let groups = files.iter().map(|file| file.name.as_str()).filter(|name| *name != itself);
            let drawn = |named| !matches!(named, NamedObject::Fixed | NamedObject::Synthetic(_));
            let known = objects.names.only(drawn).chain(groups);
            c.reference(place, &key, wanted, known);
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
    use metachron_world::Scene;

    /// A scene of a mesh `a1`, a falling ball `a2` and a fixed ball `c`, and a group with these keys.
    fn mixed(keys: &str) -> Result<Scene, String> {
        let ball = |name: &str, more: &str| {
            format!("[[object]]\nname = \"{name}\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\n{more}\n")
        };
        let text = format!(
            "format = 1\n[[object]]\nname = \"a1\"\nmodel = \"mesh\"\ngenerate = \"sphere\"\n{}{}[[group]]\nname = \"g\"\n{keys}\n",
            ball("a2", "position_m = [0, 0, 1]"),
            ball("c", "fixed = true"),
        );
        let loaded = Source::memory("group", text.as_bytes()).and_then(|source| load(&source, &[]));
        loaded.map_err(|problems| format!("{problems:?}"))
    }

    #[test]
    fn a_group_holds_simulated_objects_if_it_has_a_proxy_and_nothing_fixed() {
        let proxy = "proxy = { generate = \"sphere\", triangles = 20 }";
        for (members, agents) in [("[\"a1\"]", 0), ("[\"a2\"]", 1), ("[\"a*\"]", 1)] {
            let scene = mixed(&format!("members = {members}\n{proxy}")).unwrap();
            assert_eq!((scene.groups[0].agents.len(), scene.groups[0].levels.len()), (agents, 1), "{members}");
        }
        let message = mixed("members = [\"a*\"]").unwrap_err();
        assert!(message.contains("`proxy` of group `g` is missing, and member `a2` is simulated"), "{message}");
        let message = mixed(&format!("members = [\"a1\", \"c\"]\n{proxy}")).unwrap_err();
        assert!(message.contains("names `c`, which is fixed or never drawn"), "{message}");
        let message = mixed("members = [\"a1\"]\nproxy = { generate = \"sphere\", motion = { swing_m = [1, 0, 0] } }");
        assert!(message.unwrap_err().contains("moves a proxy by itself"));
        assert!(mixed("members = [\"b*\"]").unwrap_err().contains("does not exist"));
    }

    /// Four meshes and these groups of name and members.
    fn nested(groups: &[(&str, &str)]) -> Result<Scene, String> {
        let mesh = "format = 1\n[[object]]\nname = \"b\"\nmodel = \"mesh\"\ngenerate = \"sphere\"\ntriangles = 200\ngrid = [4, 1, 1]\nspacing_m = [3, 3, 0]\n";
        let group = |(name, members): &(&str, &str)| format!("[[group]]\nname = \"{name}\"\nmembers = [{members}]\n");
        let text = mesh.to_owned() + &groups.iter().map(group).collect::<String>();
        let loaded = Source::memory("nested", text.as_bytes()).and_then(|source| load(&source, &[]));
        loaded.map_err(|problems| format!("{problems:?}"))
    }

    #[test]
    fn a_group_of_groups_holds_all_that_is_in_them_and_comes_after_them() {
        let scene =
            nested(&[("all", "\"left\", \"b-3\", \"right\""), ("right", "\"b-2\""), ("left", "\"b-0\", \"b-1\"")])
                .unwrap();
        let of = |name: &str| scene.groups.iter().position(|group| group.proxy.name == name).unwrap();
        let all = &scene.groups[of("all")];
        assert_eq!((of("all"), all.groups.clone(), all.members.len()), (2, 0..2, 4));
        for (name, members) in [("left", vec!["b-0", "b-1"]), ("right", vec!["b-2"])] {
            let group = &scene.groups[of(name)];
            let names: Vec<_> = scene.scenery[group.members.clone()].iter().map(|it| it.name.as_str()).collect();
            assert_eq!((names, group.groups.len()), (members, 0));
        }
        // the impostor of all of them spans the four of them
        let extent = all.proxy.model.extent();
        assert!(extent.radius > 4.5, "{extent:?}");
    }

    #[test]
    fn a_misspelt_member_is_answered_by_the_name_that_is_near() {
        let object = nested(&[("g", "\"b_1\"")]).unwrap_err();
        assert!(object.contains("did you mean `b-1`?"), "{object}");
        let group = nested(&[("left", "\"b-0\""), ("all", "\"lefft\", \"b-1\"")]).unwrap_err();
        assert!(group.contains("names `lefft`, which does not exist") && group.contains("did you mean `left`?"));
    }

    #[test]
    fn a_member_that_is_said_to_vanish_is_refused() {
        let text = |of: &str| {
            format!(
                "format = 1\n[[object]]\nname = \"b\"\nmodel = \"mesh\"\ngenerate = \"sphere\"\n{of}[[group]]\nname = \"g\"\nmembers = [\"b\"]\n"
            )
        };
        let refused = |of: &str| {
            let text = text(of);
            let loaded = Source::memory("vanish", text.as_bytes()).and_then(|source| load(&source, &[]));
            loaded.err().map(|error| (error.problems[0].message.clone(), error.problems[0].text.clone()))
        };
        let (message, text) = refused("may_vanish = true\n").unwrap();
        assert_eq!(message, "`members` of group `g` names `b`, whose `may_vanish = true` has no effect in a group");
        assert_eq!(text, "\"b\"");
        assert_eq!((refused("may_vanish = false\n"), refused("")), (None, None));
    }

    #[test]
    fn a_group_in_itself_is_refused_with_its_name() {
        let direct = nested(&[("g", "\"b-0\", \"g\"")]).unwrap_err();
        assert!(direct.contains("put group `g` into itself"), "{direct}");
        let round = nested(&[("g", "\"b-0\", \"h\""), ("h", "\"b-1\", \"g\"")]).unwrap_err();
        assert!(round.contains("put group `g` into itself"), "{round}");
        let twice = nested(&[("g", "\"b-0\""), ("h", "\"g\""), ("k", "\"g\"")]).unwrap_err();
        assert!(twice.contains("names `g`, which is in another group"), "{twice}");
    }
}
