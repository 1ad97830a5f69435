//! Which agent owns a pair, and by which law the two act on each other.

use super::beside::PART_MAX_S;
use super::crowd::PART_S;
use metachron_core::{AgentId, Anchor};
use metachron_geometry::CollisionShape;
use std::cmp::Ordering;

/// How two agents act on each other where they touch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Law {
    /// Both are solved in one problem by the contact cluster that steps them: the default.
    #[default]
    Cluster,
    /// Asynchronous: one side computes the impulses and books them in a ledger, the other takes them in its next step.
    Ledger,
    /// Each side pushes itself off the other's last known state, as most engines do: for comparison.
    Penalty {
        /// Stiffness of the contact, N/m, > 0; stable below 0.55 μ/τ² (docs/theory/coupling.md).
        stiffness_n_m: f64,
        /// Damping of the contact, N·s/m, ≥ 0.
        damping_n_s_m: f64,
        /// Whether the other's state is brought forward to one's own time.
        extrapolate: bool,
    },
    /// Wave variables on a line between the two: passive whatever the delay, at the price of a mass k T².
    Tlm {
        /// Stiffness of the line, N/m, > 0.
        stiffness_n_m: f64,
        /// Damping beside it, N·s/m, ≥ 0.
        damping_n_s_m: f64,
    },
    /// No contact: the two pass through each other.
    Off,
}

impl Law {
    /// Whether the two sides keep clocks of their own, each seeing the other's newest published state.
    #[must_use]
    pub const fn is_asynchronous(self) -> bool {
        matches!(self, Self::Ledger | Self::Tlm { .. })
    }
}

/// A lasting bilateral coupling between a point of this agent and one of another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// The agent on the other side.
    pub other: AgentId,
    /// The point of this agent.
    pub here: Anchor,
    /// The point of the other.
    pub there: Anchor,
    /// Stiffness, N/m, > 0.
    pub stiffness_n_m: f64,
    /// Damping, N·s/m, ≥ 0.
    pub damping_n_s_m: f64,
    /// The distance at which it exerts no force, metres, ≥ 0.
    pub rest_m: f64,
    /// [`Law::Cluster`], [`Law::Ledger`] or [`Law::Tlm`].
    pub law: Law,
}

/// The properties of an agent that decide whether it owns a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnershipTraits {
    /// The agent.
    pub id: AgentId,
    /// Its model's name.
    pub model: &'static str,
    /// The rate its scene wants, Hz.
    pub rate_hz: f64,
    /// How many ends of a tube are held in place.
    pub held_ends: u8,
    /// Height of its start position, J/kg: see [`CollisionShape::height_j_kg`].
    pub height_j_kg: f32,
}

impl OwnershipTraits {
    /// That of the agent `id` of a `model`, whose scene wants `rate_hz`.
    #[must_use]
    pub fn new(id: AgentId, model: &'static str, rate_hz: f64, form: Option<&CollisionShape>) -> Self {
        let held_ends = form.map_or(0, CollisionShape::held_ends);
        Self { id, model, rate_hz, held_ends, height_j_kg: 0.0 + form.map_or(0.0, CollisionShape::height_j_kg) }
    }

    fn is_driven(self) -> bool {
        self.model == "tool"
    }

    fn is_tube(self) -> bool {
        self.model == "tube"
    }

    fn is_deformable(self) -> bool {
        self.is_tube() || matches!(self.model, "sheet" | "solid" | "rope")
    }

    /// The rate below which the two keep the same one beside each other, Hz.
    fn common_hz(self, other: Self, linked: bool) -> f64 {
        match (keep_step(self, other, linked), self.is_tube() && other.is_tube()) {
            (true, _) => PART_S.recip(),
            (false, true) => PART_MAX_S.recip(),
            (false, false) => 0.0,
        }
    }
}

/// Whether two agents keep step beside each other: the owner's steps are no longer than the peer's, down to those of a contact cluster
/// (docs/theory/coupling.md, eq. 7o). Two deformables do, except two tubes of which one is held, and except where a ledger link joins the two
/// (`linked`): links have clocks of their own.
#[must_use]
pub fn keep_step(a: OwnershipTraits, b: OwnershipTraits, linked: bool) -> bool {
    let held = a.held_ends > 0 || b.held_ends > 0;
    a.is_deformable() && b.is_deformable() && !linked && !(a.is_tube() && b.is_tube() && held)
}

/// Whether `me` owns the pair with `other`; `linked` where a ledger link joins the two.
///
/// A tool is driven and owns nothing. A deformable owns before a rigid body, whose response to impulses is known exactly, however long the
/// step (docs/decisions/0012, 0013).
/// Of two deformables the faster owns, and of two that can keep step the higher: it solves its load in one problem with their contact
/// (docs/decisions/0019). But a soft body owns before a tube to which it is linked, or which does not rest on it; and of two tubes of which
/// one is held, the one with fewer held ends owns before the faster. Ties are broken by the rates that the scene wants, then by the
/// lower number.
#[must_use]
pub fn owns(me: OwnershipTraits, other: OwnershipTraits, linked: bool) -> bool {
    if me.is_driven() || other.is_driven() {
        return other.is_driven() && !me.is_driven();
    }
    if me.is_deformable() != other.is_deformable() {
        return me.is_deformable();
    }
    let common_hz = me.common_hz(other, linked);
    let rate = |s: OwnershipTraits| s.rate_hz.max(common_hz);
    let rests_on = |tube: OwnershipTraits, soft: OwnershipTraits| {
        !linked && tube.height_j_kg > soft.height_j_kg && rate(tube) >= rate(soft)
    };
    if me.is_tube() != other.is_tube() {
        return if me.is_tube() { rests_on(me, other) } else { !rests_on(other, me) };
    }
    let faster = rate(me).total_cmp(&rate(other));
    let order = if me.held_ends > 0 || other.held_ends > 0 {
        let freer = if faster.is_eq() { other.held_ends.cmp(&me.held_ends) } else { Ordering::Equal };
        freer.then(faster)
    } else {
        faster.then(me.height_j_kg.total_cmp(&other.height_j_kg)).then(me.rate_hz.total_cmp(&other.rate_hz))
    };
    order.then(other.id.cmp(&me.id)).is_gt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn traits(id: u32, model: &'static str, rate_hz: f64) -> OwnershipTraits {
        OwnershipTraits::new(AgentId(id), model, rate_hz, None)
    }

    fn above(s: OwnershipTraits) -> OwnershipTraits {
        OwnershipTraits { id: AgentId(9), height_j_kg: 1.0, ..s }
    }

    #[test]
    fn every_pair_has_one_owner_unless_both_are_driven() {
        let mut all = vec![];
        for model in ["tube", "rigid", "tool", "sheet"] {
            for (rate_hz, held_ends, height_j_kg) in
                [(60.0, 0, 0.0), (100.0, 0, 1.0), (1000.0, 0, 2.0), (1000.0, 1, 1.0)]
            {
                all.push(OwnershipTraits { held_ends, height_j_kg, ..traits(all.len() as u32, model, rate_hz) });
            }
        }
        for a in &all {
            for b in all.iter().filter(|b| b.id != a.id) {
                let both_driven = a.model == "tool" && b.model == "tool";
                for linked in [false, true] {
                    let owners = u32::from(owns(*a, *b, linked)) + u32::from(owns(*b, *a, linked));
                    assert_eq!(owners, u32::from(!both_driven), "{a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn a_deformable_owns_before_a_rigid_body_and_a_tool_owns_nothing() {
        let [slow, fast] = [60.0, 1000.0];
        for model in ["tube", "sheet"] {
            assert!(owns(traits(1, model, slow), traits(0, "rigid", fast), false));
        }
        assert!(owns(traits(1, "rigid", fast), traits(0, "rigid", slow), false), "the faster");
        assert!(owns(traits(1, "rigid", slow), traits(0, "tool", fast), false));
    }

    #[test]
    fn the_upper_of_two_deformables_owns_where_they_keep_step() {
        for (upper, lower) in [("sheet", "sheet"), ("tube", "tube"), ("tube", "sheet"), ("sheet", "tube")] {
            for (upper_hz, lower_hz) in [(60.0, 60.0), (60.0, 240.0), (240.0, 60.0), (1000.0, 240.0)] {
                let [upper, lower] = [above(traits(0, upper, upper_hz)), traits(1, lower, lower_hz)];
                assert!(owns(upper, lower, false), "{upper:?} on {lower:?}");
            }
        }
        assert!(owns(traits(1, "sheet", 1000.0), above(traits(0, "sheet", 60.0)), false), "the faster");
        assert!(owns(traits(1, "sheet", 1000.0), above(traits(0, "tube", 60.0)), false), "the soft one");
        assert!(owns(above(traits(0, "sheet", 60.0)), traits(1, "tube", 1000.0), false), "the soft one, however slow");
        assert!(owns(traits(2, "sheet", 240.0), traits(1, "sheet", 60.0), false), "as high, the faster");
        assert!(owns(traits(0, "sheet", 60.0), traits(1, "sheet", 60.0), false), "of equals the lower number");
    }

    #[test]
    fn linked_and_held_pairs_are_owned_regardless_of_height() {
        let (sheet, tube) = (traits(1, "sheet", 60.0), traits(2, "tube", 60.0));
        assert!(owns(sheet, above(tube), true), "the soft one");
        assert!(owns(OwnershipTraits { rate_hz: 61.0, ..sheet }, above(traits(0, "sheet", 60.0)), true), "the faster");
        let held = |held_ends, s| OwnershipTraits { held_ends, ..s };
        assert!(owns(tube, held(1, above(tube)), false), "the one that falls");
        assert!(owns(traits(2, "tube", 5.0), held(1, above(tube)), false), "beside each other both keep 60 Hz");
        assert!(owns(held(2, traits(2, "tube", 1000.0)), above(tube), false), "the faster");
        assert!(owns(held(2, tube), held(2, above(tube)), false), "the lower number of those that are held alike");
        assert!(!keep_step(tube, held(1, above(tube)), false), "a held tube lies on its hold");
        assert!(keep_step(sheet, held(1, above(tube)), false) && keep_step(tube, above(tube), false));
        assert!(!keep_step(sheet, above(tube), true), "links have clocks of their own");
        assert!(!keep_step(sheet, above(traits(0, "rigid", 60.0)), false), "what does not bend too");
    }
}
