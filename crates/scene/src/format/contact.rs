//! `contact` of an object: the groups that it collides with, how a pair shares its coefficients, whether it only
//! senses.

use metachron_geometry::CombineRule;
use schemars::JsonSchema;
use serde::Deserialize;

/// The contact traits of an object.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactFile {
    /// Names of the collision groups that it is in; at most 32 in a scene. Default: all of them.
    pub groups: Option<Vec<String>>,
    /// Names of the collision groups that it collides with. Two objects collide where each collides with a group that the other is in.
    /// Default: all of them; an empty list is none.
    pub collides_with: Option<Vec<String>>,
    /// Whether it only senses: objects that touch it are reported under `sensors`, and no force acts. Default false.
    pub sensor: Option<bool>,
    /// How a pair with it shares both frictions. Of two different rules the later one counts: `average`, `min`, `multiply`, `max`,
    /// `geometric-mean`. Default: the other object's rule; where neither has one `geometric-mean`.
    pub friction_rule: Option<CombineRule>,
    /// How a pair with it shares both restitutions, as `friction_rule`. Default: the other object's rule; where neither has one `max`.
    pub restitution_rule: Option<CombineRule>,
    /// Radius r of the patch by which each of its contacts resists spin about its normal, metres: with a torque up to friction · r ·
    /// push. A pair takes the larger one. It acts between objects that turn as a whole, and static solids. Default 0.
    pub spin_radius_m: Option<f64>,
}
