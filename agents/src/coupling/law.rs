//! Who owns a pair of agents, and by which law the two act on each other.

use super::Form;
use super::beside::PART_MAX_S;
use crate::{AgentId, Anchor};
use std::cmp::Ordering;

/// How two agents act on each other where they touch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Law {
    /// Impulses by the owner, booked in a ledger: the default.
    #[default]
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
    /// They pass through each other.
    Off,
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
    /// The distance at which it pulls nothing, metres, ≥ 0.
    pub rest_m: f64,
    /// [`Law::Ledger`] or [`Law::Tlm`].
    pub law: Law,
}

/// What decides who owns a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// Its number.
    pub id: AgentId,
    /// Its model's name.
    pub model: &'static str,
    /// The rate its scene wants, Hz.
    pub rate_hz: f64,
    /// How many ends of a tube are held in place.
    pub held_ends: u8,
    /// How high it starts, J/kg: see [`Form::height_j_kg`].
    pub height_j_kg: f32,
}

impl Standing {
    /// That of the agent `id` of a `model`, whose scene wants `rate_hz`.
    #[must_use]
    pub fn new(id: AgentId, model: &'static str, rate_hz: f64, form: Option<&Form>) -> Self {
        let held_ends = form.map_or(0, Form::held_ends);
        Self { id, model, rate_hz, held_ends, height_j_kg: 0.0 + form.map_or(0.0, Form::height_j_kg) }
    }
}

/// Whether `me` owns the pair with `other`: a soft body does before a tube, a tube before a rigid body, of two tubes the faster, of two
/// that keep the same rate beside each other (60 Hz at least) the one with fewer held ends; of two soft bodies, two tubes that are held
/// alike and two rigid bodies the faster, of two soft ones and of two loose tubes as fast the higher (docs/decisions/0019), of equals the
/// lower number. A tool is led and owns nothing.
///
/// How a rigid body answers impulses is known exactly, however long the step; how a tube or a soft body does is not, least of
/// all how far one falls that nothing holds (docs/decisions/0012, 0013).
#[must_use]
pub fn owns(me: Standing, other: Standing) -> bool {
    let led = |s: Standing| s.model == "instrument";
    let tube = |s: Standing| s.model == "tube";
    if led(me) || led(other) {
        return led(other) && !led(me);
    }
    let soft = |s: Standing| matches!(s.model, "sheet" | "solid" | "rope");
    if soft(me) != soft(other) {
        return soft(me);
    }
    // two tubes beside each other step no slower than this
    let slowest = if tube(me) && tube(other) { PART_MAX_S.recip() } else { 0.0 };
    let rate = |s: Standing| s.rate_hz.max(slowest);
    let faster = rate(me).total_cmp(&rate(other));
    // a tube that is held lies on its hold
    let held = me.held_ends > 0 || other.held_ends > 0;
    let higher = if held { Ordering::Equal } else { me.height_j_kg.total_cmp(&other.height_j_kg) };
    let freer = if rate(me) == rate(other) { other.held_ends.cmp(&me.held_ends) } else { Ordering::Equal };
    tube(me).cmp(&tube(other)).then(freer).then(faster).then(higher).then(other.id.cmp(&me.id)).is_gt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_every_pair_exactly_one_owns_unless_both_are_led() {
        let all = ["tube", "rigid", "instrument", "sheet"]
            .into_iter()
            .flat_map(|model| [60.0, 1000.0].map(|rate_hz| (model, rate_hz)));
        let all: Vec<_> =
            all.zip(0..).map(|((model, rate_hz), id)| Standing::new(AgentId(id), model, rate_hz, None)).collect();
        for a in &all {
            for b in all.iter().filter(|b| b.id != a.id) {
                let both_led = a.model == "instrument" && b.model == "instrument";
                assert_eq!(u32::from(owns(*a, *b)) + u32::from(owns(*b, *a)), u32::from(!both_led), "{a:?} {b:?}");
            }
        }
        assert!(owns(all[1], all[0]), "the faster");
        assert!(owns(all[0], all[2]) && owns(all[0], all[3]), "the tube, however slow");
        let held = Standing { held_ends: 2, ..all[1] };
        assert!(owns(held, all[0]) && owns(all[1], Standing { held_ends: 2, ..all[0] }), "the faster");
        assert!(owns(all[1], held) && !owns(held, all[1]), "the one that falls, of equals");
        let slow = |rate_hz| Standing { rate_hz, ..all[0] };
        assert!(owns(slow(5.0), Standing { held_ends: 1, ..slow(60.0) }), "beside each other both keep 60 Hz");
        assert!(owns(all[6], all[1]) && owns(all[6], all[3]), "the sheet, though it is slower");
        let higher = Standing { id: AgentId(9), height_j_kg: 1.0, ..all[6] };
        assert!(owns(higher, all[6]) && owns(all[7], higher), "the higher of two as fast");
        let upper = Standing { id: AgentId(9), height_j_kg: 1.0, ..all[0] };
        assert!(owns(upper, all[0]) && owns(all[1], upper), "tubes too");
        let held = |s| Standing { held_ends: 2, ..s };
        assert!(owns(held(all[0]), held(upper)), "but not those that are held");
    }
}
