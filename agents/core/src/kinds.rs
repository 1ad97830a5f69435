//! Choices by name that a scene makes: executor, priority, policy, law, states, environment, shading, material.
//!
//! In: nothing. Out: choices by name, which files, scenes, control and the renderer share. Never here: their effects.

/// How agents are run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "schema", derive(serde::Deserialize, schemars::JsonSchema), serde(rename_all = "kebab-case"))]
pub enum ExecutorKind {
    /// Threads for a few agents, the pool for many.
    #[default]
    Auto,
    /// One named OS thread per agent; at most 1000 agents.
    Threads,
    /// One worker per core for any number of agents; each agent keeps its own clock as on its own thread.
    Pool,
    /// One thread, virtual time, declared costs: bit-identical on every run.
    Lockstep,
}

/// How the operating system schedules the threads of agents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "schema", derive(serde::Deserialize, schemars::JsonSchema), serde(rename_all = "kebab-case"))]
pub enum PriorityKind {
    /// Ordinary priority.
    #[default]
    Normal,
    /// Before all threads of ordinary priority, including the frame loop, where the operating system permits that; where it does not, a
    /// note says so and agents run at ordinary priority. Agents that use all cores then leave no time for pictures.
    Realtime,
}

/// Policy that chooses levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "schema", derive(serde::Deserialize, schemars::JsonSchema), serde(rename_all = "kebab-case"))]
pub enum PolicyKind {
    /// The finest level of everything, at any cost.
    Full,
    /// The finest level whose polygons cover 1024 pixels each (FS93).
    Static,
    /// The same with a threshold that follows the time of the previous frame (FS93).
    Threshold,
    /// Levels in falling benefit per cost (FS93).
    Greedy,
    /// The same, starting from the levels of the previous frame (FS93).
    GreedyIncremental,
    /// The better of the greedy solution and the best single object.
    GreedyRepaired,
    /// Objects and groups, starting from the cut of the previous frame (MB97).
    Hierarchical,
    /// Objects and groups in falling benefit per cost (MB97).
    HierarchicalFlat,
    /// Objects and groups, always refining the most important one next (MS95).
    MacielShirley,
    /// A share of the time for every object, by its value (RH05).
    RobinHood,
    /// Any number of triangles, the exact optimum (GB99).
    Convex,
    /// Any number of triangles, by interior point (GB99).
    ConvexBarrier,
    /// Refinement steps in falling gain per cost, up to the first that does not fit.
    MarginalStop,
    /// The same, followed by every later step that still fits.
    MarginalFill,
    /// Feedback on (ε, n) from the measured frame work (GDC04).
    Feedback,
    /// Refinement steps in falling gain per cost, with costs learned from measurements, hysteresis and a certificate of optimality.
    #[default]
    Adaptive,
}

/// How `robin-hood` values an object (RH05, eq. 8 … 11): from its surface a, its depth z along the view and its distance d from the
/// eye, which is greater away from the middle of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "schema", derive(serde::Deserialize, schemars::JsonSchema), serde(rename_all = "kebab-case"))]
pub enum ValueKind {
    /// a/√z.
    Gentle,
    /// a/z.
    #[default]
    Plain,
    /// a/z².
    Steep,
    /// √(a/d²).
    Focus,
    /// √a/d².
    FocusSteep,
}

/// Feedback law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "schema", derive(serde::Deserialize, schemars::JsonSchema), serde(rename_all = "kebab-case"))]
pub enum LawKind {
    /// The logarithmic law, whose gain does not depend on the machine.
    #[default]
    Corrected,
    /// The law as the paper prints it.
    Printed,
}

/// Time at which states are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "schema", derive(serde::Deserialize, schemars::JsonSchema), serde(rename_all = "kebab-case"))]
pub enum StatesKind {
    /// Interpolated between the two newest states, slightly late.
    #[default]
    Interpolate,
    /// The newest state extrapolated to the frame's time.
    Extrapolate,
    /// The newest state as it is.
    Latest,
}

impl ExecutorKind {
    /// The name as scenes write it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Threads => "threads",
            Self::Pool => "pool",
            Self::Lockstep => "lockstep",
        }
    }
}

impl PolicyKind {
    /// All of them.
    pub const ALL: [Self; 16] = [
        Self::Full,
        Self::Static,
        Self::Threshold,
        Self::Greedy,
        Self::GreedyIncremental,
        Self::GreedyRepaired,
        Self::Hierarchical,
        Self::HierarchicalFlat,
        Self::MacielShirley,
        Self::RobinHood,
        Self::Convex,
        Self::ConvexBarrier,
        Self::MarginalStop,
        Self::MarginalFill,
        Self::Feedback,
        Self::Adaptive,
    ];

    /// The name as scenes write it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Static => "static",
            Self::Threshold => "threshold",
            Self::Greedy => "greedy",
            Self::GreedyIncremental => "greedy-incremental",
            Self::GreedyRepaired => "greedy-repaired",
            Self::Hierarchical => "hierarchical",
            Self::HierarchicalFlat => "hierarchical-flat",
            Self::MacielShirley => "maciel-shirley",
            Self::RobinHood => "robin-hood",
            Self::Convex => "convex",
            Self::ConvexBarrier => "convex-barrier",
            Self::MarginalStop => "marginal-stop",
            Self::MarginalFill => "marginal-fill",
            Self::Feedback => "feedback",
            Self::Adaptive => "adaptive",
        }
    }

    /// Whether the policy predicts the cost of levels.
    #[must_use]
    pub const fn predicts(self) -> bool {
        !matches!(self, Self::Full | Self::Static | Self::Threshold | Self::Feedback)
    }

    /// Whether the policy chooses between a group's impostor and its members; for the others there are members alone.
    #[must_use]
    pub const fn chooses_groups(self) -> bool {
        matches!(self, Self::Hierarchical | Self::HierarchicalFlat | Self::MacielShirley | Self::Adaptive)
    }

    /// Whether the policy weighs levels by the benefit as it is printed (FS93, §5): accuracy by samples, motion and hysteresis by level.
    #[must_use]
    pub const fn has_printed_benefit(self) -> bool {
        matches!(self, Self::Greedy | Self::GreedyIncremental | Self::GreedyRepaired)
    }

    /// Whether the slider of hysteresis changes the policy's choice.
    #[must_use]
    pub const fn has_hysteresis(self) -> bool {
        self.has_printed_benefit() || matches!(self, Self::Convex | Self::ConvexBarrier) || self.chooses_groups()
    }

    /// Whether the policy takes pixels from the picture where all else is at its coarsest: one that ignores the time of frames does not.
    #[must_use]
    pub const fn scales_pictures(self) -> bool {
        self.predicts() || matches!(self, Self::Feedback)
    }

    /// The policy of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|policy| policy.name() == name)
    }
}

impl LawKind {
    /// The name as scenes write it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Corrected => "corrected",
            Self::Printed => "printed",
        }
    }
}

impl StatesKind {
    /// The name as scenes write it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Interpolate => "interpolate",
            Self::Extrapolate => "extrapolate",
            Self::Latest => "latest",
        }
    }
}

/// The light of a scene from all around, and its background.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "schema", derive(serde::Deserialize, schemars::JsonSchema), serde(rename_all = "kebab-case"))]
pub enum EnvironmentKind {
    /// A bright room with a lamp overhead.
    #[default]
    Room,
    /// The open sky with a sun.
    Sky,
    /// A dark cavity with a light at the camera's lens.
    Endoscope,
}

/// How the light on a surface is computed: the rendering algorithm of (FS93), cheapest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Shading {
    /// One colour per triangle.
    Flat,
    /// Colours at vertices, interpolated between them.
    Gouraud,
    /// Lighting at every pixel.
    #[default]
    PerPixel,
    /// The same with the texture, or that of tissue; an object without one is drawn as [`Self::PerPixel`].
    Textured,
    /// Better than objects request: texture, soft-edged shadows, ambient occlusion at corners.
    Shadowed,
}

impl Shading {
    /// The shadings that objects request and that have prices, cheapest first.
    pub const ALL: [Self; 4] = [Self::Flat, Self::Gouraud, Self::PerPixel, Self::Textured];
}

/// Shading that a scene asks of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "schema", derive(serde::Deserialize, schemars::JsonSchema), serde(rename_all = "kebab-case"))]
pub enum ShadingKind {
    /// One colour per triangle.
    Flat,
    /// Colours at vertices, interpolated between them.
    Gouraud,
    /// Lighting at every pixel.
    PerPixel,
    /// Lighting at every pixel of a textured surface: tissue, or a mesh with a `texture`.
    Textured,
    /// Any of them, as the policy chooses; the best of them where it does not.
    #[default]
    Any,
}

/// Material of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "schema", derive(serde::Deserialize, schemars::JsonSchema), serde(rename_all = "kebab-case"))]
pub enum Material {
    /// Wet tissue.
    Tissue,
    /// Brushed metal.
    Metal,
    /// Matt plastic.
    #[default]
    Plastic,
    /// Dry skin.
    Skin,
}
