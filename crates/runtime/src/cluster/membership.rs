//! Which agents step as one in a turn.
//!
//! In: their numbers. Out: whether one is among them, and the epoch of the list: it changes when one is no longer among them, so that the
//! others, which skipped it in the broad phase, search again. Never here: why they step as one.

use metachron_core::AgentId;

/// All that step as one.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub(in super::super) struct Membership {
    /// By rising numbers.
    ids: Vec<AgentId>,
    /// A bit each, by number.
    bits: Vec<u64>,
    epoch: Epoch,
}

/// The leader, and how often a member has left; `None` for an agent that never was a member.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub(in super::super) struct Epoch(Option<(AgentId, u64)>);

impl Membership {
    /// Stores the agents that step with `leader`, itself left out.
    pub fn set(&mut self, leader: AgentId, led: impl Iterator<Item = AgentId>) {
        let (before, departures) = (self.ids.len(), self.epoch.0.map_or(0, |(_, departures)| departures));
        let bits = std::mem::take(&mut self.bits);
        self.ids.clear();
        self.ids.push(leader);
        self.ids.extend(led);
        self.ids.sort_unstable();
        let is_old = |id: &&AgentId| bit(&bits, **id);
        let left = self.ids.iter().filter(is_old).count() < before;
        self.epoch = Epoch(Some((leader, departures + u64::from(left))));
        self.mark(bits);
    }

    /// Whether `id` is among them.
    pub fn has(&self, id: AgentId) -> bool {
        bit(&self.bits, id)
    }

    /// The epoch of the list.
    pub const fn epoch(&self) -> Epoch {
        self.epoch
    }

    /// Sets the bits, in the storage of the old ones.
    fn mark(&mut self, mut bits: Vec<u64>) {
        bits.clear();
        bits.resize(self.ids.last().map_or(0, |id| id.0 as usize / 64 + 1), 0);
        self.ids.iter().for_each(|id| bits[id.0 as usize / 64] |= 1 << (id.0 % 64));
        self.bits = bits;
    }
}

fn bit(bits: &[u64], id: AgentId) -> bool {
    bits.get(id.0 as usize / 64).is_some_and(|word| word >> (id.0 % 64) & 1 != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_epoch_lasts_until_a_member_leaves() {
        let mut membership = Membership::default();
        let alone = membership.epoch();
        assert!(membership.ids.is_empty() && !membership.has(AgentId(0)));
        let mut gather = |led: &[u32]| {
            membership.set(AgentId(3), led.iter().copied().map(AgentId));
            let among: Vec<_> = (0..200).filter(|id| membership.has(AgentId(*id))).collect();
            assert_eq!(among, membership.ids.iter().map(|id| id.0).collect::<Vec<_>>());
            membership.epoch()
        };
        let first = gather(&[130, 64]);
        assert_ne!(first, alone);
        assert_eq!(gather(&[130, 64, 5]), first, "one has come");
        let second = gather(&[130, 7, 8, 9]);
        assert_ne!(second, first, "two have left, though more have come");
        assert_eq!(gather(&[130, 7, 8, 9]), second);
    }
}
