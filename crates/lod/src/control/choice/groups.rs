//! Membership of objects in groups, and the useful impostors of a group with their benefits.
//!
//! In: objects of which some are groups. Out: a forest, and [`Impostors`]. Never here: the choice of the groups to open.
//! Theory: `docs/theory/budget.md`, section 4 (MB97, §3).

use crate::control::demand::plan::SizedView;
use crate::control::demand::query::FrameQuery;
use crate::control::prices::ladder::Rung;

/// Benefit of a group's finest impostor relative to its members in their lowest forms: less than any form of the members, as (MB97, §3)
/// assumes.
const IMPOSTOR_WORTH: f64 = 0.5;

/// The groups among the objects, members before their groups.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Groups {
    /// For each object the number of its group.
    parent: Vec<Option<usize>>,
    /// Numbers of the groups, ascending.
    groups: Vec<usize>,
}

impl Groups {
    /// Reads the groups anew. An object that is given after its group, or whose group is none, belongs to none.
    pub fn update(&mut self, views: &[SizedView]) {
        let is_group = |at: usize| views.get(at).is_some_and(|seen| seen.view.is_group());
        let parent = |(at, seen): (usize, &SizedView)| seen.view.group.filter(|group| *group > at && is_group(*group));
        self.parent.clear();
        self.parent.extend(views.iter().enumerate().map(parent));
        self.groups.clear();
        self.groups.extend((0..views.len()).filter(|at| is_group(*at)));
    }

    /// Numbers of the groups, each after its members.
    pub fn all(&self) -> &[usize] {
        &self.groups
    }

    /// The group of an object.
    pub fn parent(&self, at: usize) -> Option<usize> {
        self.parent.get(at).copied().flatten()
    }

    /// Whether `closed` holds for a group of the object at any level above it.
    pub fn is_within(&self, at: usize, closed: impl Fn(usize) -> bool) -> bool {
        self.above(at).any(closed)
    }

    /// The group of an object, the group of that, and so on.
    pub fn above(&self, at: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(self.parent(at), |group| self.parent(*group))
    }
}

/// Benefit and cost of the members of groups in their lowest forms, and so which impostors cost less.
#[derive(Debug, Clone, Default)]
pub(super) struct Impostors {
    /// For a group the benefit of its finest impostor, for others the benefit of their lowest form; 0 out of view.
    worth: Vec<f64>,
    /// For a group the cost of its members in their lowest forms, for others their own lowest cost, seconds.
    least_s: Vec<f64>,
}

impl Impostors {
    /// Recomputes the sums: the objects in view and their sizes change in every frame.
    pub fn update(&mut self, query: &FrameQuery<'_>, groups: &Groups) {
        for sums in [&mut self.worth, &mut self.least_s] {
            sums.clear();
            sums.resize(query.views.len(), 0.0);
        }
        for at in query.drawable() {
            let lowest = &query.ladders.of(at).rungs[0];
            (self.worth[at], self.least_s[at]) = (query.weight(at) * lowest.accuracy, lowest.cost_s);
        }
        for at in 0..query.views.len() {
            let Some(group) = groups.parent(at) else { continue };
            let (worth, least_s) = self.lowest(query, at);
            self.worth[group] += IMPOSTOR_WORTH * worth;
            self.least_s[group] += least_s;
        }
    }

    /// Benefit and cost of an object in its lowest form: a group by its coarsest impostor, or its members if it has no cheaper impostor.
    fn lowest(&self, query: &FrameQuery<'_>, at: usize) -> (f64, f64) {
        if !query.views[at].view.is_group() {
            return (self.worth[at], self.least_s[at]);
        }
        let coarsest = self.rungs(query, at).first();
        coarsest.map_or((self.members_worth(at), self.least_s[at]), |it| (self.worth[at] * it.accuracy, it.cost_s))
    }

    /// The impostors of a group that cost less than its members in their lowest forms: a more expensive one is pointless, since the members
    /// have a greater benefit. Empty for a group out of view.
    pub fn rungs<'a>(&self, query: &FrameQuery<'a>, group: usize) -> &'a [Rung] {
        let rungs = &query.ladders.of(group).rungs;
        let cheaper = rungs.iter().take_while(|rung| rung.cost_s < self.least_s[group]).count();
        if self.is_in_view(group) { &rungs[..cheaper] } else { &[] }
    }

    /// Benefit of a group's finest impostor.
    pub fn worth(&self, group: usize) -> f64 {
        self.worth[group]
    }

    /// Benefit of a group's members in their lowest forms.
    pub fn members_worth(&self, group: usize) -> f64 {
        self.worth[group] / IMPOSTOR_WORTH
    }

    /// Whether anything of a group is in view and has a benefit.
    pub fn is_in_view(&self, group: usize) -> bool {
        self.worth[group] > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::demand::view::{Kind, ObjectView};

    #[test]
    fn objects_are_in_groups_after_them_and_in_nothing_else() {
        let leaf = Kind::Counted { radius_m: 0.1, least: 4, most: 100 };
        let group = Kind::Group { radius_m: 1.0, impostors: [12, 0, 0, 0, 0, 0, 0, 0] };
        let given = [
            (leaf, Some(2)),
            (leaf, Some(2)),
            (group, Some(4)),
            (leaf, Some(4)),
            (group, Some(4)),
            (group, Some(usize::MAX)),
            (group, Some(2)),
            (leaf, Some(3)),
        ];
        let view = |(id, (kind, group)): (usize, (Kind, Option<usize>))| {
            SizedView::of(ObjectView { group, ..ObjectView::plain(id as u32, kind) })
        };
        let views: Vec<_> = given.into_iter().enumerate().map(view).collect();
        let mut groups = Groups::default();
        groups.update(&views);
        assert_eq!(groups.all(), [2, 4, 5, 6]);
        assert_eq!(groups.parent, [Some(2), Some(2), Some(4), Some(4), None, None, None, None]);
        assert!(groups.is_within(0, |group| group == 4) && !groups.is_within(4, |_| true));
    }
}
