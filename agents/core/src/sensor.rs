//! How often a body has touched something that it senses, or that senses it, as its state publishes it.
//!
//! In: whether the two touch. Out: counts. Never here: where they touch, forces: there are none.

use crate::{ContactPartner, SimTime};

/// A pair of which one side only senses. It is published by the agent, of two by that of the lower number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct SensorTouch {
    /// The other side.
    pub with: ContactPartner,
    /// Whether the two touch.
    pub touching: bool,
    /// How often they have begun to touch.
    pub begins: u32,
    /// How often they have ceased to.
    pub ends: u32,
    /// When they last began or ceased to, in the agent's time: the start of the fine step within which that was seen.
    pub changed: SimTime,
}

impl SensorTouch {
    /// A pair that has never touched.
    #[must_use]
    pub const fn new(with: ContactPartner) -> Self {
        Self { with, touching: false, begins: 0, ends: 0, changed: SimTime::ZERO }
    }

    /// Takes in whether the two touch `at` this time.
    pub const fn note(&mut self, touching: bool, at: SimTime) {
        if touching == self.touching {
            return;
        }
        (self.touching, self.changed) = (touching, at);
        let count = if touching { &mut self.begins } else { &mut self.ends };
        *count = count.saturating_add(1);
    }
}
