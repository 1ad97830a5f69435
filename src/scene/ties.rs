//! What ties the objects of a scene to each other: joints, couplings, faults on the way between them.
//!
//! In: built by [`super::load`], checked. Out: plain data that the frame loop hands to agents and to the runtime.
//! Never here: the file's text, forces.

use glam::{DQuat, DVec3};
use metachron_agents::{AgentId, Anchor};

/// A joint between two rigid agents, or between one and the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// The first agent.
    pub a: AgentId,
    /// The second; `None` is the world.
    pub b: Option<AgentId>,
    /// What it leaves free.
    pub kind: JointKind,
    /// Where it holds `a`, metres, in the axes of its shape.
    pub anchor_a_m: DVec3,
    /// Where it holds `b`, metres, in the axes of its shape; in the world's where `b` is the world.
    pub anchor_b_m: DVec3,
    /// How b's shape is turned against a's at the start.
    pub rest: DQuat,
    /// Whether the two still touch each other.
    pub collide: bool,
}

/// What a joint leaves free. Axes are in the axes of a's shape, of length 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointKind {
    /// Nothing.
    Fixed,
    /// A turn about one axis.
    Revolute {
        /// The axis.
        axis: DVec3,
        /// How far b turns against a about it, radians from the start; `None` is without end.
        range_rad: Option<[f64; 2]>,
    },
    /// Every turn about one point.
    Spherical,
    /// A slide along one axis.
    Prismatic {
        /// The axis.
        axis: DVec3,
        /// How far b's anchor is from a's along it, metres; `None` is without end.
        range_m: Option<[f64; 2]>,
    },
    /// Everything, against a spring between the anchors.
    Spring {
        /// Stiffness, N/m, > 0.
        stiffness_n_m: f64,
        /// Damping, N·s/m, ≥ 0.
        damping_n_s_m: f64,
        /// Length at rest, metres, ≥ 0.
        rest_m: f64,
    },
    /// Everything up to a distance of the anchors.
    Rope {
        /// That distance, metres, > 0.
        length_m: f64,
    },
}

/// How two agents act on each other, where that is not contact by the ledger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// The first agent.
    pub a: AgentId,
    /// The second.
    pub b: AgentId,
    /// What of them is coupled.
    pub kind: CouplingKind,
    /// By which law.
    pub law: Law,
}

/// What of two agents is coupled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CouplingKind {
    /// Their surfaces, where they touch.
    Contact,
    /// One point of each, by a spring.
    Attach {
        /// The point of the first.
        at_a: Anchor,
        /// The point of the second.
        at_b: Anchor,
        /// Stiffness, N/m, > 0.
        stiffness_n_m: f64,
        /// Damping, N·s/m, ≥ 0.
        damping_n_s_m: f64,
        /// Length at rest, metres, ≥ 0.
        rest_m: f64,
    },
}

/// By which law two agents act on each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// By the ledger.
    Ledger,
    /// By a spring from states as old as they are.
    Penalty {
        /// Stiffness, N/m, > 0.
        stiffness_n_m: f64,
        /// Damping, N·s/m, ≥ 0.
        damping_n_s_m: f64,
        /// Whether states are carried on to the own time first.
        extrapolate: bool,
    },
    /// By a transmission line.
    Tlm {
        /// Stiffness, N/m, > 0.
        stiffness_n_m: f64,
        /// Damping, N·s/m, ≥ 0.
        damping_n_s_m: f64,
    },
    /// Not at all.
    Off,
}

/// What goes wrong on purpose on the way from an agent to the others.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Faults {
    /// Every step is longer or shorter by up to this share, 0 … 0.5.
    pub jitter: f64,
    /// Share of published states that nobody sees, 0 … 0.9.
    pub loss: f64,
    /// Seed of both.
    pub seed: u64,
}
