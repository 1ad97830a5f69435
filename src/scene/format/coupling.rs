//! `[[coupling]]` and `faults`: how two objects act on each other, and what goes wrong on the way on purpose.

use super::Point;
use schemars::JsonSchema;
use serde::Deserialize;

/// How two objects that move act on each other, where that is not the usual contact.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CouplingFile {
    /// Name of an object that moves.
    pub a: String,
    /// Name of another.
    pub b: String,
    /// What is coupled. Default `contact`.
    pub kind: Option<CouplingKind>,
    /// By which law. Default `ledger`.
    pub law: Option<CouplingLaw>,
    /// Where an `attach` holds `a`: 0 start … 1 end of a tube's or rope's rest length, or `[x, y, z]` in the axes of a rigid
    /// object's shape, of an instrument's tip, or of a sheet or solid from its middle (the nearest vertex), metres.
    pub at_a: Option<Spot>,
    /// Where an `attach` holds `b`, as `at_a`.
    pub at_b: Option<Spot>,
    /// Stiffness of an `attach`, or of a contact by `penalty` or `tlm`, N/m, 1e-6 … 1e9.
    pub stiffness_n_m: Option<f64>,
    /// Its damping, N·s/m, 0 … 1e7. Default 0.
    pub damping_n_s_m: Option<f64>,
    /// Length of an `attach` at rest, metres, 0 … 1e4. Default 0.
    pub rest_m: Option<f64>,
}

/// What of two objects is coupled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CouplingKind {
    /// Their surfaces, where they touch.
    #[default]
    Contact,
    /// One point of each, by a spring.
    Attach,
}

/// By which law two objects act on each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CouplingLaw {
    /// One owner computes every impulse, the other reads it from a ledger: momentum is conserved whatever the clocks.
    #[default]
    Ledger,
    /// A spring from the newest states, as old as they are: for comparison. It blows up when it is stiffer than 0.55 μ/τ².
    Penalty,
    /// A spring from the newest states carried on to the own time: for comparison.
    PenaltyExtrapolated,
    /// Transmission line modelling: passive for any delay, at the price of a parasitic mass.
    Tlm,
    /// Nothing: the two pass through each other.
    Off,
}

impl CouplingLaw {
    /// The name as scenes write it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ledger => "ledger",
            Self::Penalty => "penalty",
            Self::PenaltyExtrapolated => "penalty-extrapolated",
            Self::Tlm => "tlm",
            Self::Off => "off",
        }
    }
}

/// A point of an object's matter: a share of a tube's length, or a point in the object's axes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number from 0 to 1 along a tube, or [x, y, z] in an object's axes")]
pub enum Spot {
    /// 0 start … 1 end of a tube's rest length.
    Share(f64),
    /// `[x, y, z]` in the object's axes, metres.
    Point(Point),
}

/// What goes wrong on purpose on the way from one object to the others, for tests of couplings.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultsFile {
    /// Every step is longer or shorter by up to this share, 0 … 0.5. Default 0.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub jitter: Option<f64>,
    /// Share of published states that nobody sees, 0 … 0.9. Default 0.
    #[schemars(range(min = 0.0, max = 0.9))]
    pub loss: Option<f64>,
    /// Seed of both. Default 0.
    pub seed: Option<u32>,
}
