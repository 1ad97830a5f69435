//! How a skin takes part in contact beside its friction and restitution: its collision groups, the rules by which a pair shares coefficients,
//! and whether it is a sensor.
//!
//! In: the traits that a scene gives an object. Out: the same of a pair. Never here: where skins touch, impulses.
//! Theory: docs/theory/contact.md, section 5.

use metachron_core::NumberRange;

/// Range of Coulomb friction coefficients of skins.
pub const FRICTION: NumberRange = NumberRange::new(0.0, 1e3, "");
/// Range of coefficients of restitution.
pub const RESTITUTION: NumberRange = NumberRange::new(0.0, 1.0, "");

/// The contact traits of a skin, the same for bodies and static solids.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ContactTraits {
    /// The groups that it is in and collides with.
    pub groups: CollisionGroups,
    /// Whether it is a sensor: its touches are reported, and no force acts.
    pub is_sensor: bool,
    /// How a pair with it shares frictions; `None` leaves that to the other side.
    pub friction_rule: Option<CombineRule>,
    /// How a pair with it shares restitutions; `None` leaves that to the other side.
    pub restitution_rule: Option<CombineRule>,
    /// The radius r of the patch by which its contacts resist spin about their normals, metres, ≥ 0: with a torque up to μ r times the push.
    /// A pair takes the larger.
    pub spin_radius_m: f64,
}

/// The groups that an object is in, and the groups that it collides with: a bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct CollisionGroups {
    /// The groups that it is in.
    pub member_of: u32,
    /// The groups that it collides with.
    pub collides_with: u32,
}

metachron_core::choices! {
    /// How two coefficients become that of a pair. Of two sides with different rules the later one of this list counts, as in Rapier.
    #[derive(PartialOrd, Ord)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum CombineRule {
        /// Half of their sum.
        Average = "average",
        /// The smaller one.
        Min = "min",
        /// Their product.
        Multiply = "multiply",
        /// The larger one.
        Max = "max",
        /// The square root of their product.
        GeometricMean = "geometric-mean",
    }
}

impl Default for CollisionGroups {
    /// [`Self::ALL`].
    fn default() -> Self {
        Self::ALL
    }
}

impl Default for ContactTraits {
    /// [`Self::NONE`].
    fn default() -> Self {
        Self::NONE
    }
}

impl ContactTraits {
    /// The traits of a skin for which a scene gives none.
    pub const NONE: Self = Self {
        groups: CollisionGroups::ALL,
        is_sensor: false,
        friction_rule: None,
        restitution_rule: None,
        spin_radius_m: 0.0,
    };
}

impl CollisionGroups {
    /// In every group, and collides with every group.
    pub const ALL: Self = Self { member_of: u32::MAX, collides_with: u32::MAX };

    /// Whether two objects collide: each with a group that the other is in.
    #[must_use]
    pub const fn meet(self, other: Self) -> bool {
        self.collides_with & other.member_of != 0 && other.collides_with & self.member_of != 0
    }
}

impl CombineRule {
    /// The rule of a pair: the later one of its sides' rules, `default` where neither has one.
    #[must_use]
    pub fn of_pair(sides: [Option<Self>; 2], default: Self) -> Self {
        sides.into_iter().flatten().max().unwrap_or(default)
    }

    /// The coefficient of a pair; both ≥ 0.
    #[must_use]
    pub fn combine(self, [a, b]: [f64; 2]) -> f64 {
        match self {
            Self::Average => 0.5 * (a + b),
            Self::Min => a.min(b),
            Self::Multiply => a * b,
            Self::Max => a.max(b),
            Self::GeometricMean => (a * b).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_collide_where_each_collides_with_a_group_of_the_other() {
        let of = |member_of, collides_with| CollisionGroups { member_of, collides_with };
        let anyone = CollisionGroups::default();
        let (tool, tissue) = (of(0b01, 0b10), of(0b10, u32::MAX));
        assert!(tool.meet(tissue) && tissue.meet(tool), "the tool names the tissue, which collides with all");
        assert!(!tool.meet(tool), "tools pass through each other");
        assert!(tissue.meet(tissue) && anyone.meet(tissue) && anyone.meet(tool));
        assert!(!of(0b10, 0).meet(tool) && !of(0b10, 0).meet(anyone), "what collides with no group meets nothing");
    }

    #[test]
    fn of_two_rules_the_later_one_counts_and_the_default_only_where_neither_side_gives_one() {
        use CombineRule::{Average, GeometricMean, Max, Min, Multiply};
        let pair = [0.2, 0.8];
        let expected = [(Average, 0.5), (Min, 0.2), (Multiply, 0.16), (Max, 0.8), (GeometricMean, 0.4)];
        for (at, (rule, value)) in expected.into_iter().enumerate() {
            assert!((rule.combine(pair) - value).abs() < 1e-15, "{rule:?}"); // an ulp
            assert_eq!(CombineRule::of_pair([None, Some(rule)], GeometricMean), rule);
            for (later, _) in &expected[at..] {
                assert_eq!(CombineRule::of_pair([Some(*later), Some(rule)], Max), *later);
            }
        }
        assert_eq!(CombineRule::of_pair([None; 2], Max), Max);
    }
}
