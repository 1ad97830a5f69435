//! Who shares a world with an agent in a turn.
//!
//! In: the numbers of all who do. Out: whether one is among them, and in which world: a name that changes when somebody is no
//! longer among them, so that who looked past them before looks again. Never here: why they share it.

use metachron_core::AgentId;

/// All that step as one.
#[derive(Debug, Default)]
pub(super) struct Fellows {
    /// By rising numbers.
    ids: Vec<AgentId>,
    /// A bit each, by number.
    bits: Vec<u64>,
    world: World,
}

/// The name of a world: who leads it, and how often somebody has left it. An agent that shares none has none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct World(Option<(AgentId, u64)>);

impl Fellows {
    /// Takes down who steps with `leader`, itself left out.
    pub fn gather(&mut self, leader: AgentId, led: impl Iterator<Item = AgentId>) {
        let (before, departures) = (self.ids.len(), self.world.0.map_or(0, |(_, departures)| departures));
        let bits = std::mem::take(&mut self.bits);
        self.ids.clear();
        self.ids.push(leader);
        self.ids.extend(led);
        self.ids.sort_unstable();
        let is_old = |id: &&AgentId| bit(&bits, **id);
        let left = self.ids.iter().filter(is_old).count() < before;
        self.world = World(Some((leader, departures + u64::from(left))));
        self.mark(bits);
    }

    /// Whether `id` is among them.
    pub fn has(&self, id: AgentId) -> bool {
        bit(&self.bits, id)
    }

    /// In which world.
    pub const fn world(&self) -> World {
        self.world
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
    fn a_world_keeps_its_name_until_somebody_has_left_it() {
        let mut fellows = Fellows::default();
        let alone = fellows.world();
        assert!(fellows.ids.is_empty() && !fellows.has(AgentId(0)));
        let mut gather = |led: &[u32]| {
            fellows.gather(AgentId(3), led.iter().copied().map(AgentId));
            let among: Vec<_> = (0..200).filter(|id| fellows.has(AgentId(*id))).collect();
            assert_eq!(among, fellows.ids.iter().map(|id| id.0).collect::<Vec<_>>());
            fellows.world()
        };
        let first = gather(&[130, 64]);
        assert_ne!(first, alone);
        assert_eq!(gather(&[130, 64, 5]), first, "one has come");
        let second = gather(&[130, 7, 8, 9]);
        assert_ne!(second, first, "two have left, though more have come");
        assert_eq!(gather(&[130, 7, 8, 9]), second);
    }
}
