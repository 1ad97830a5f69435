//! `[[coupling]]` and `faults`: interactions of two objects other than the default contact, and injected faults.

use super::Point;
use schemars::JsonSchema;
use serde::Deserialize;

/// Interaction of two moving objects, other than the default contact.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CouplingFile {
    /// Name of a moving object.
    pub a: String,
    /// Name of another moving object.
    pub b: String,
    /// Kind of the coupling. Default `contact`.
    pub kind: Option<CouplingKind>,
    /// Law of the coupling. By default the two are solved as one problem with all that they touch.
    pub law: Option<CouplingLaw>,
    /// Point of `a` that an `attach` holds: 0 start … 1 end of a tube's or rope's rest length; or `[x, y, z]`, metres, in the axes of a
    /// rigid object's shape, of a tool's tip, or of a sheet or solid from its middle (the nearest vertex).
    pub at_a: Option<Spot>,
    /// Point of `b` that an `attach` holds, as `at_a`.
    pub at_b: Option<Spot>,
    /// Stiffness of an `attach`, or of a contact by `tlm`, N/m.
    pub stiffness_n_m: Option<f64>,
    /// Damping of the same spring, N·s/m. Default 0.
    pub damping_n_s_m: Option<f64>,
    /// Rest length of an `attach`, metres. Default 0.
    pub rest_m: Option<f64>,
    /// Force above which an `attach` without a `law` tears, N: the mean over a common step of the two. It is gone then for
    /// good, and the report has it under `events`. Default: never.
    pub tears_above_n: Option<f64>,
    /// Greatest force that an `attach` without a `law` gives, N; below `tears_above_n`: a greater load
    /// moves the place at which it holds, or lengthens one with a `rest_m`, for good. The report has the first time
    /// under `events`. Default: as much as it takes.
    pub yields_above_n: Option<f64>,
}

/// Parts of two objects that are coupled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CouplingKind {
    /// Their surfaces, where they are in contact.
    #[default]
    Contact,
    /// One point of each, joined by a spring.
    Attach,
}

/// Law by which two objects interact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CouplingLaw {
    /// Asynchronous: the object with the shorter wanted step, at equal steps the first of the file, computes every impulse; the other takes
    /// it in its next step from a ledger. Momentum is conserved for any clocks.
    Ledger,
    /// Refused: penalty laws stay in the laboratory.
    #[schemars(skip)]
    Penalty,
    /// Refused: penalty laws stay in the laboratory.
    #[schemars(skip)]
    PenaltyExtrapolated,
    /// Asynchronous by transmission line modelling: passive for any delay, at the cost of a parasitic mass.
    Tlm,
    /// No interaction: the two pass through each other.
    Off,
}

/// A material point of an object: a share of the length of a tube or rope, or a point in the object's axes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number from 0 to 1 along a tube, or [x, y, z] in an object's axes")]
#[schemars(inline)]
pub enum Spot {
    /// 0 start … 1 end of the rest length of a tube or rope.
    Share(f64),
    /// `[x, y, z]` in the object's axes, metres.
    Point(Point),
}

/// Faults injected into the clock and the messages of an object, for tests of couplings.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultsFile {
    /// Every step is longer or shorter by a random share up to this. Default 0.
    pub jitter: Option<f64>,
    /// Share of published states that no other object receives. Default 0.
    pub loss: Option<f64>,
    /// Seed of the random numbers of both. Default 0.
    pub seed: Option<u32>,
}
