//! Which objects belong to which group, and what the groups' proxies are worth.
//!
//! In: objects of which some are groups. Out: a forest. Never here: which group is opened.

use super::ask::Ask;
use super::plan::Seen;
use super::view::Kind;

/// What a proxy is worth of what its members are worth in their lowest forms.
const PROXY_WORTH: f64 = 0.5;

/// The groups among the objects, members before their groups.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Groups {
    /// For each object the number of its group.
    parent: Vec<Option<usize>>,
    /// Numbers of the groups, rising.
    groups: Vec<usize>,
}

impl Groups {
    /// Reads the groups anew. An object belongs to the first group that names it; what stands after its group belongs to none.
    pub fn update(&mut self, views: &[Seen]) {
        self.parent.clear();
        self.parent.resize(views.len(), None);
        self.groups.clear();
        for (at, (view, _)) in views.iter().enumerate() {
            let Kind::Group { members: (first, count), .. } = view.kind else { continue };
            self.groups.push(at);
            let end = first.saturating_add(count).min(at);
            let free = self.parent[first.min(end)..end].iter_mut().filter(|parent| parent.is_none());
            free.for_each(|parent| *parent = Some(at));
        }
    }

    /// Numbers of the groups, each after its members.
    pub fn all(&self) -> &[usize] {
        &self.groups
    }

    /// The group of an object.
    pub fn parent(&self, at: usize) -> Option<usize> {
        self.parent[at]
    }

    /// Whether an object belongs to a group of which `closed` says yes, or to a group in such a group.
    pub fn is_within(&self, at: usize, closed: impl Fn(usize) -> bool) -> bool {
        std::iter::successors(self.parent(at), |group| self.parent(*group)).any(closed)
    }

    /// What each object is worth in its lowest form, a group by its proxy: half of its members; 0 for what is out of view.
    pub fn lowest_worth(&self, ask: &Ask<'_>, worth: &mut Vec<f64>) {
        worth.clear();
        worth.resize(ask.views.len(), 0.0);
        for at in ask.drawable() {
            worth[at] = ask.weight(at) * ask.ladders.of(at).rungs[0].accuracy;
        }
        for at in 0..ask.views.len() {
            if let Some(group) = self.parent(at) {
                worth[group] += PROXY_WORTH * worth[at];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::level::Span;
    use super::super::view::ObjectView;
    use super::*;
    use metachron_agents::{AgentId, Resolution, ResolutionRange};

    fn object(id: usize, kind: Kind) -> Seen {
        let range = ResolutionRange::fixed(Resolution { eps_m: 1.0, n: 0 });
        let view = ObjectView {
            id: AgentId(id as u32),
            kind,
            range,
            shading: Default::default(),
            pixels: 100.0,
            distance_m: 1.0,
            speed_px_s: 0.0,
            importance: 1.0,
            off_centre: 0.0,
            from_focus_m: 0.0,
            visible: true,
        };
        (view, Span::of(&view))
    }

    #[test]
    fn groups_hold_what_stands_before_them_and_nothing_twice() {
        let leaf = Kind::Counted { radius_m: 0.1, least: 4, most: 100 };
        let group = |members| Kind::Group { radius_m: 1.0, members, proxy_triangles: 12 };
        let kinds = [leaf, leaf, group((0, 2)), leaf, group((1, 9)), group((usize::MAX, usize::MAX)), group((6, 3))];
        let views: Vec<_> = kinds.into_iter().enumerate().map(|(id, kind)| object(id, kind)).collect();
        let mut groups = Groups::default();
        groups.update(&views);
        assert_eq!(groups.all(), [2, 4, 5, 6]);
        assert_eq!(groups.parent, [Some(2), Some(2), Some(4), Some(4), None, None, None]);
        assert!(groups.is_within(0, |group| group == 4) && !groups.is_within(4, |_| true));
    }
}
