//! Reads the contact traits of objects.
//!
//! In: [`ContactFile`]s, the names of all groups of the scene. Out: [`ContactTraits`]; problems to the [`Checker`]. Never here: forces.

use crate::check::{Checker, Place};
use crate::format::ContactFile;
use metachron_geometry::{CollisionGroups, ContactTraits};
use std::collections::BTreeSet;

/// Most collision groups of a scene: a bit each.
const GROUPS_MAX: usize = 32;

/// The names of the collision groups of a scene.
#[derive(Debug, Default)]
pub(super) struct GroupNames {
    /// The place of a name is that of its bit.
    bits: Vec<String>,
    /// Rules for which there is none; they are reported.
    refused: BTreeSet<String>,
}

impl GroupNames {
    /// The groups that any of these objects is in.
    pub(super) fn of<'a>(c: &mut Checker<'_, '_>, objects: impl Iterator<Item = (&'a Place, &'a ContactFile)>) -> Self {
        let (mut names, mut refused) = (BTreeSet::new(), BTreeSet::new());
        for (place, file) in objects {
            let place = place.table("contact");
            for (at, name) in file.groups.iter().flatten().enumerate() {
                if name.trim().is_empty() {
                    c.wrong(&place, &format!("groups.{at}"), "has a name without characters", "expected a name");
                } else if names.len() < GROUPS_MAX || names.contains(name) {
                    names.insert(name.clone());
                } else if refused.insert(name.clone()) {
                    let what = format_args!("names `{name}`, one group more than a scene can have");
                    c.wrong(&place, &format!("groups.{at}"), what, format!("expected at most {GROUPS_MAX} groups"));
                }
            }
        }
        Self { bits: names.into_iter().collect(), refused }
    }

    /// The bits of some groups; all where no list is given.
    fn bits(&self, c: &mut Checker<'_, '_>, place: &Place, key: &str, given: Option<&Vec<String>>) -> u32 {
        let Some(given) = given else { return u32::MAX };
        let mut bits = 0;
        for (at, name) in given.iter().enumerate() {
            match self.bits.iter().position(|one| one == name) {
                Some(bit) => bits |= 1 << bit,
                None if self.refused.contains(name) => {}
                None => {
                    c.reference(place, &format!("{key}.{at}"), name, self.bits.iter().map(String::as_str));
                }
            }
        }
        bits
    }

    /// An object's contact traits.
    pub(super) fn traits(&self, c: &mut Checker<'_, '_>, place: &Place, file: Option<&ContactFile>) -> ContactTraits {
        let Some(file) = file else { return ContactTraits::default() };
        let place = place.table("contact");
        if file.groups.as_ref().is_some_and(Vec::is_empty) {
            let expected = "expected names, or no `groups`: then it is in all of them";
            c.wrong(&place, "groups", "is empty", expected);
        }
        let groups = CollisionGroups {
            member_of: self.bits(c, &place, "groups", file.groups.as_ref()),
            collides_with: self.bits(c, &place, "collides_with", file.collides_with.as_ref()),
        };
        ContactTraits {
            groups,
            is_sensor: file.sensor.unwrap_or(false),
            friction_rule: file.friction_rule,
            restitution_rule: file.restitution_rule,
            spin_radius_m: file.spin_radius_m.unwrap_or(0.0),
        }
    }
}

/// Reports `contact` of an object that nothing touches.
pub(super) fn refuse(c: &mut Checker<'_, '_>, place: &Place, file: Option<&ContactFile>) {
    if file.is_some() {
        let expected = "expected no such table: only a rigid or soft object, a tube or a tool can touch others";
        c.wrong(place, "contact", "has no effect: nothing touches this object", expected);
    }
}
