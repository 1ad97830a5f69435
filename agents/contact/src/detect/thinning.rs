//! As many contacts between a cell that carries a skin and its partner as the cell can tell apart, however fine the skin is.
//!
//! In: the contacts found of a pair, the cells that carry their places. Out: which of them are kept. Never here: how they were found.
//! Theory: docs/theory/contact.md, section 3.

use crate::detect::pair::{Judge, Owner, Pair, Round};
use crate::lists::{refill, reset};
use crate::member::memory::Partner;
use crate::solve::Contact;
use glam::DVec3;
use metachron_geometry::Touch;

/// Nodes of a cell: a patch keeps as many of the contacts that bore in the last step, and one near each node.
const NODES: usize = 8;
/// Contacts that a patch may have without being thinned.
const KEPT_MOST: usize = 2 * NODES;
/// Of two contacts whose gaps differ by less than this, metres, the one nearer to the node is taken: a flat body stands on its corners.
const EQUAL_M: f64 = 1e-6;

/// Where contacts of a pair move with the same few nodes along the same axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Patch {
    member: usize,
    partner: Partner,
    /// The cells that carry the places of both sides; `None` for a side whose places move each by itself.
    cells: [Option<u32>; 2],
    /// The axis that the normal is nearest to, and whether it points along it.
    axis: (u8, bool),
}

/// Reusable storage, and the patches thinned.
#[derive(Default)]
pub(super) struct Thinning {
    /// The patch of each contact of the pair; `None` where no cell carries it.
    patches: Vec<Option<Patch>>,
    /// The load of each contact in the last step, N.
    loads_n: Vec<f64>,
    /// The contacts with a patch, by their patches.
    order: Vec<usize>,
    /// The contacts of a patch that bore, and the deepest near each of its nodes.
    loaded: Vec<usize>,
    deepest: Vec<Deepest>,
    is_kept: Vec<bool>,
    /// The patches of this fine step that have all the contacts they can tell apart, by rising names once they are sorted.
    full: Vec<Patch>,
}

/// The deepest contact of a patch near a node.
#[derive(Debug, Clone, Copy)]
struct Deepest {
    /// The node's member, and its block.
    node: (usize, usize),
    /// Its gap, metres, less a bonus for a larger share of the node.
    gap_m: f64,
    at: usize,
}

impl Thinning {
    /// Begins a fine step.
    pub fn begin(&mut self) {
        self.full.clear();
    }

    /// Begins a pair.
    pub fn begin_pair(&mut self) {
        self.patches.clear();
        self.loads_n.clear();
    }

    /// Sorts the patches thinned in this fine step.
    pub fn sort(&mut self) {
        self.full.sort_unstable();
    }

    /// Notes the patch of the contact that is about to be taken up; whether it is needed: after the solve a patch that was thinned gets no more.
    pub fn note(&mut self, round: &Round<'_, '_>, pair: Pair<'_>, owner: &Owner, touch: &Touch) -> bool {
        let cell = |member: Option<usize>, place| member.and_then(|member| round.all[member].member.cell_of(place));
        let cells = [cell(Some(pair.member), &touch.on_a), cell(pair.other(), &touch.on_b)];
        let patch = cells.iter().any(Option::is_some).then(|| Patch {
            member: owner.member,
            partner: owner.partner,
            cells,
            axis: nearest_axis(touch.normal),
        });
        if matches!(round.judge, Judge::Solved) && patch.is_some_and(|patch| self.full.binary_search(&patch).is_ok()) {
            return false;
        }
        let load_n =
            patch.map_or(0.0, |_| round.all[owner.member].memory.recall(owner.partner, owner.key).force_n.length());
        self.loads_n.push(load_n);
        self.patches.push(patch);
        true
    }

    /// Keeps of each patch's contacts, of those from number `from` on, as many as it can tell apart; in their order.
    pub fn thin(&mut self, from: usize, contacts: &mut Vec<Contact>, owners: &mut Vec<Owner>) {
        let Self { patches, loads_n, order, loaded, deepest, is_kept, full } = self;
        refill(order, (0..patches.len()).filter(|at| patches[*at].is_some()));
        if order.len() <= KEPT_MOST {
            return;
        }
        order.sort_unstable_by_key(|at| (patches[*at], *at));
        reset(is_kept, patches.len(), true);
        for group in order.chunk_by(|a, b| patches[*a] == patches[*b]).filter(|group| group.len() > KEPT_MOST) {
            group.iter().for_each(|at| is_kept[*at] = false);
            let Some(patch) = patches[group[0]] else { continue };
            keep_loaded(group, loads_n, loaded, is_kept);
            keep_deepest(group, &contacts[from..], patch, deepest, is_kept);
            full.push(patch);
        }
        retain_from(from, owners, is_kept);
        retain_from(from, contacts, is_kept);
    }
}

/// Keeps the elements before number `from`, and the marked ones of the others.
fn retain_from<T>(from: usize, list: &mut Vec<T>, is_kept: &[bool]) {
    let mut marks = std::iter::repeat_n(&true, from).chain(is_kept);
    list.retain(|_| marks.next() == Some(&true));
}

/// Marks the contacts of a patch that bore most in the last step: which of them bear is then settled as steps go on.
fn keep_loaded(group: &[usize], loads_n: &[f64], loaded: &mut Vec<usize>, is_kept: &mut [bool]) {
    refill(loaded, group.iter().copied().filter(|at| loads_n[*at] > 0.0));
    loaded.sort_unstable_by(|a, b| loads_n[*b].total_cmp(&loads_n[*a]).then(a.cmp(b)));
    loaded.iter().take(NODES).for_each(|at| is_kept[*at] = true);
}

/// Marks the deepest of a patch's contacts for each node among the contacts that move most with it.
fn keep_deepest(group: &[usize], contacts: &[Contact], patch: Patch, deepest: &mut Vec<Deepest>, is_kept: &mut [bool]) {
    deepest.clear();
    for at in group {
        let Contact { sides, gap_m, .. } = &contacts[*at];
        for (side, _) in sides.iter().zip(patch.cells).filter(|(_, cell)| cell.is_some()) {
            let shares = side.terms().iter().map(|term| (term.block, term.map.x_axis.x));
            let Some((block, share)) = shares.max_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
            let (node, gap_m) = ((side.member, block), gap_m - EQUAL_M * share);
            match deepest.iter_mut().find(|known| known.node == node) {
                Some(known) if gap_m < known.gap_m => *known = Deepest { node, gap_m, at: *at },
                Some(_) => {}
                None => deepest.push(Deepest { node, gap_m, at: *at }),
            }
        }
    }
    deepest.iter().for_each(|one| is_kept[one.at] = true);
}

fn nearest_axis(normal: DVec3) -> (u8, bool) {
    let axis = normal.abs().max_position();
    (axis as u8, normal[axis] > 0.0)
}
