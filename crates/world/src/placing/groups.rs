//! Which objects have to be stepped by one host, and by which.
//!
//! In: where objects are, pairs of objects that are tied, what each costs. Out: groups of objects that cannot meet each other within a window of
//! time, a host for each. Never here: calls of hosts.

use glam::DVec3;
use metachron_core::{AgentId, DisjointSets, SimSpan};
use metachron_runtime::Reach;
use std::collections::BTreeMap;

/// Speed may change by so much, m/s², before an object leaves its box: twice free fall.
const ACCELERATION_M_S2: f64 = 20.0;

/// So much room is left in a box for objects that are hit within the window, m/s.
const SPEED_LEAST_M_S: f64 = 1.0;

/// A host with no more than this times the mean load keeps what it has; one with more keeps the mean.
const EVEN: f64 = 1.15;

/// The boxes that objects at these `reaches` may not leave within `window`, with `room` for more speed than they have.
pub(super) fn fences(reaches: &[Reach], window: SimSpan, room: f64) -> Vec<Reach> {
    let span_s = window.as_secs_f64();
    let way_m = |reach: &Reach| (reach.speed_m_s.max(SPEED_LEAST_M_S) + ACCELERATION_M_S2 * span_s) * span_s;
    reaches.iter().map(|reach| reach.wider(room * way_m(reach))).collect()
}

/// Gives each object the greatest speed in its group: what it meets may give it its own.
pub(super) fn share_speeds(reaches: &mut [Reach], groups: &[Vec<AgentId>]) {
    let members = (0..).zip(groups).flat_map(|(number, group)| group.iter().map(move |id| (*id, number)));
    let numbers: BTreeMap<AgentId, usize> = members.collect();
    let mut fastest = vec![0.0_f64; groups.len()];
    for reach in &*reaches {
        numbers.get(&reach.id).iter().for_each(|at| fastest[**at] = fastest[**at].max(reach.speed_m_s));
    }
    for reach in reaches {
        reach.speed_m_s = numbers.get(&reach.id).map_or(reach.speed_m_s, |at| fastest[*at]);
    }
}

/// The groups of `objects` whose boxes meet or that are tied: each by rising numbers, and the groups by their first ones.
pub(super) fn groups(objects: &[AgentId], fences: &[Reach], ties: &[[AgentId; 2]]) -> Vec<Vec<AgentId>> {
    let place = |id: AgentId| objects.binary_search(&id).ok();
    let mut sets = DisjointSets::default();
    sets.reset(objects.len());
    let mut join = |one: AgentId, other: AgentId| {
        if let (Some(one), Some(other)) = (place(one), place(other)) {
            sets.join(one, other);
        }
    };
    ties.iter().for_each(|[one, other]| join(*one, *other));
    // sweep and prune along the axis on which they are spread most
    let spread = fences.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], fence| {
        [low.min(fence.low_m), high.max(fence.low_m)]
    });
    let axis = (spread[1] - spread[0]).max_position();
    let mut sorted: Vec<&Reach> = fences.iter().collect();
    sorted.sort_unstable_by(|one, other| one.low_m[axis].total_cmp(&other.low_m[axis]).then(one.id.cmp(&other.id)));
    let mut open: Vec<&Reach> = Vec::new();
    for fence in sorted {
        open.retain(|other| other.high_m[axis] >= fence.low_m[axis]);
        open.iter().filter(|other| other.meets(fence)).for_each(|other| join(other.id, fence.id));
        open.push(fence);
    }
    let mut groups: Vec<Vec<AgentId>> = vec![Vec::new(); objects.len()];
    for (at, id) in objects.iter().enumerate() {
        groups[sets.lowest(at)].push(*id);
    }
    groups.retain(|group| !group.is_empty());
    groups
}

/// A group, the host that steps most of it, or that it is pinned to, and its cost.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PlacedGroup {
    pub objects: Vec<AgentId>,
    pub host: Option<usize>,
    pub is_pinned: bool,
    pub cost: f64,
}

/// Gives each group to a host that `lives`: to the one that has it, unless it has none or `evens` loads that are too unlike. Those that are pinned
/// first, then the dearest, each to the host with the least load (Gra69).
pub(super) fn place(groups: &mut [PlacedGroup], lives: &[bool], evens: bool) {
    let mut loads: Vec<Option<f64>> = lives.iter().map(|lives| lives.then_some(0.0)).collect();
    let hosts = lives.iter().filter(|lives| **lives).count() as f64;
    let mean = groups.iter().map(|group| group.cost).sum::<f64>() / hosts;
    let mut held = vec![0.0; lives.len()];
    groups.iter().filter_map(|group| Some((group.host?, group.cost))).for_each(|(host, cost)| held[host] += cost);
    let mut dearest: Vec<&mut PlacedGroup> = groups.iter_mut().collect();
    dearest.sort_by(|one, other| other.is_pinned.cmp(&one.is_pinned).then(other.cost.total_cmp(&one.cost)));
    for group in &mut dearest {
        group.host = group.host.filter(|host| {
            let load = loads[*host].get_or_insert(0.0);
            let has_more = evens && held[*host] > EVEN * mean;
            let stays = lives[*host] && (!has_more || group.is_pinned || *load + group.cost <= mean || *load == 0.0);
            if stays {
                *load += group.cost;
            }
            stays
        });
    }
    for group in dearest.into_iter().filter(|group| group.host.is_none()) {
        let there = loads.iter().enumerate().filter(|(host, _)| lives[*host]);
        let least =
            there.filter_map(|(host, load)| Some((host, (*load)?))).min_by(|one, other| one.1.total_cmp(&other.1));
        if let Some((host, load)) = least {
            (group.host, loads[host]) = (Some(host), Some(load + group.cost));
        }
    }
}
