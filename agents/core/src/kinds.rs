//! Choices by name that a scene makes: executor, priority, policy, law, states, environment, shading, material.
//!
//! In: nothing. Out: choices by name, which files, scenes, control and the renderer share. Never here: their effects.

crate::choices! {
    /// How agents are run.
    #[derive(Default)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum ExecutorKind {
        /// Threads for a few agents, the pool for many.
        #[default]
        Auto = "auto",
        /// One named OS thread per agent; at most 1000 agents.
        Threads = "threads",
        /// One worker per core for any number of agents; each agent keeps its own clock as on its own thread.
        Pool = "pool",
        /// One thread, virtual time, declared costs: bit-identical on every run.
        Lockstep = "lockstep",
    }

    /// How the operating system schedules the threads of agents.
    #[derive(Default)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum PriorityKind {
        /// Ordinary priority.
        #[default]
        Normal = "normal",
        /// Before all threads of ordinary priority, including the frame loop, where the operating system permits that; where it does not, a
        /// note says so and agents run at ordinary priority. Agents that use all cores then leave no time for pictures.
        Realtime = "realtime",
    }

    /// Policy that chooses levels.
    #[derive(Default)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum PolicyKind {
        /// The finest level of everything, at any cost.
        Full = "full",
        /// The finest level whose polygons cover 1024 pixels each (FS93).
        Static = "static",
        /// The same with a threshold that follows the time of the previous frame (FS93).
        Threshold = "threshold",
        /// Levels in falling benefit per cost (FS93).
        Greedy = "greedy",
        /// The same, starting from the levels of the previous frame (FS93).
        GreedyIncremental = "greedy-incremental",
        /// The better of the greedy solution and the best single object.
        GreedyRepaired = "greedy-repaired",
        /// Objects and groups, starting from the cut of the previous frame (MB97).
        Hierarchical = "hierarchical",
        /// Objects and groups in falling benefit per cost (MB97).
        HierarchicalFlat = "hierarchical-flat",
        /// Objects and groups, always refining the most important one next (MS95).
        MacielShirley = "maciel-shirley",
        /// A share of the time for every object, by its value (RH05).
        RobinHood = "robin-hood",
        /// Any number of triangles, the exact optimum (GB99).
        Convex = "convex",
        /// Any number of triangles, by interior point (GB99).
        ConvexBarrier = "convex-barrier",
        /// Refinement steps in falling gain per cost, up to the first that does not fit.
        MarginalStop = "marginal-stop",
        /// The same, followed by every later step that still fits.
        MarginalFill = "marginal-fill",
        /// Feedback on (ε, n) from the measured frame work (GDC04).
        Feedback = "feedback",
        /// Refinement steps in falling gain per cost, with costs learned from measurements, hysteresis and a certificate of optimality.
        #[default]
        Adaptive = "adaptive",
    }

    /// How `robin-hood` values an object (RH05, eq. 8 … 11): from its surface a, its depth z along the view and its distance d from the
    /// eye, which is greater away from the middle of the picture.
    #[derive(Default)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum ValueKind {
        /// a/√z.
        Gentle = "gentle",
        /// a/z.
        #[default]
        Plain = "plain",
        /// a/z².
        Steep = "steep",
        /// √(a/d²).
        Focus = "focus",
        /// √a/d².
        FocusSteep = "focus-steep",
    }

    /// Feedback law.
    #[derive(Default)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum LawKind {
        /// The logarithmic law, whose gain does not depend on the machine.
        #[default]
        Corrected = "corrected",
        /// The law as the paper prints it.
        Printed = "printed",
    }

    /// Time at which states are drawn.
    #[derive(Default)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum StatesKind {
        /// Interpolated between the two newest states, slightly late.
        #[default]
        Interpolate = "interpolate",
        /// The newest state extrapolated to the frame's time.
        Extrapolate = "extrapolate",
        /// The newest state as it is.
        Latest = "latest",
    }

    /// The light of a scene from all around, and its background.
    #[derive(Default)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum EnvironmentKind {
        /// A bright room with a lamp overhead.
        #[default]
        Room = "room",
        /// The open sky with a sun.
        Sky = "sky",
        /// A dark cavity with a light at the camera's lens.
        Endoscope = "endoscope",
    }

    /// How the light on a surface is computed: the rendering algorithm of (FS93), cheapest first.
    #[derive(PartialOrd, Ord, Default)]
    pub enum Shading {
        /// One colour per triangle.
        Flat = "flat",
        /// Colours at vertices, interpolated between them.
        Gouraud = "gouraud",
        /// Lighting at every pixel.
        #[default]
        PerPixel = "per-pixel",
        /// The same with the texture, or that of tissue; an object without one is drawn as [`Self::PerPixel`].
        Textured = "textured",
        /// Better than objects request: texture, soft-edged shadows, ambient occlusion at corners.
        Shadowed = "shadowed",
    }

    /// Shading that a scene asks of a surface.
    #[derive(Default)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum ShadingKind {
        /// One colour per triangle.
        Flat = "flat",
        /// Colours at vertices, interpolated between them.
        Gouraud = "gouraud",
        /// Lighting at every pixel.
        PerPixel = "per-pixel",
        /// Lighting at every pixel of a textured surface: tissue, or a mesh with a `texture`.
        Textured = "textured",
        /// Any of them, as the policy chooses; the best of them where it does not.
        #[default]
        Any = "any",
    }

    /// Material of a surface.
    #[derive(PartialOrd, Ord, Default)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum Material {
        /// Wet tissue.
        Tissue = "tissue",
        /// Brushed metal.
        Metal = "metal",
        /// Matt plastic.
        #[default]
        Plastic = "plastic",
        /// Dry skin.
        Skin = "skin",
    }
}

impl PolicyKind {
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
}

impl Shading {
    /// Shadings that objects request and that have prices, cheapest first.
    pub const PRICED: [Self; 4] = [Self::Flat, Self::Gouraud, Self::PerPixel, Self::Textured];
}
