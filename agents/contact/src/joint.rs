//! Joints between rigid bodies: the data a scene gives, and their checks.
//!
//! In: two bodies, two anchors and a kind. Out: a checked [`Joint`]. Never here: how a joint is solved (`constraint/`).

use crate::motion_bounds::is_within_motion;
use glam::{DQuat, DVec3};
use metachron_core::{AgentId, DisjointSets, NumberRange, OutOfRange};

/// A joint between two rigid bodies, or between one and the world. Jointed bodies are always members of one cluster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// The first body.
    pub a: AgentId,
    /// The second body; `None` is the world.
    pub b: Option<AgentId>,
    /// The degrees of freedom it leaves free.
    pub kind: JointKind,
    /// Anchor on `a`, metres, in the axes of a's shape.
    pub anchor_a_m: DVec3,
    /// Anchor on `b`, metres, in the axes of b's shape; in world axes where `b` is the world.
    pub anchor_b_m: DVec3,
    /// Rotation of b's shape relative to a's where the joint is at its zero: `a⁻¹ b` of both rotations at the start.
    pub rest: DQuat,
    /// Whether the two bodies also collide with each other; also once it has torn.
    pub collide: bool,
    /// The force above which it tears, N, > 0: the mean over a macro step of its cluster; its torque does not count.
    /// Infinite where it never does.
    pub tears_above_n: f64,
    /// The force that it gives at most, N, > 0, below that at which it tears: a greater load moves the place at which it holds, a
    /// rope's length or a spring's length at rest. Its torque is not bounded. Infinite where it never yields.
    pub yields_above_n: f64,
    /// Dry friction of a hinge or a ball in its socket, N·m, or a slide, N, ≥ 0, beside its motor; 0 of other kinds.
    pub friction: f64,
    /// Inertia about the axis of a hinge or every axis of a ball in its socket, kg·m², or along that of a slide, kg, ≥ 0: of a rotor behind a gear,
    /// which resists changes of the rate at which b moves against a and is nowhere else. 0 of other kinds.
    pub armature: f64,
    /// The joint that a hinge or slide follows; none of other kinds.
    pub mimic: Option<Mimic>,
}

/// How a hinge or slide follows another: its travel is `ratio` times that of the other joint, and `offset`. The bodies of both joints are
/// members of one cluster, and bear the reaction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mimic {
    /// The number of the joint that it follows, a hinge or slide too.
    pub joint: u32,
    /// Its travel for each radian or metre of the other, within [`Self::RATIO`].
    pub ratio: f64,
    /// Its travel where the other joint is at its zero, rad or m, within [`Self::OFFSET`].
    pub offset: f64,
}

impl Mimic {
    /// The ratios that there are.
    pub const RATIO: NumberRange = NumberRange::new(-1e6, 1e6, "");
    /// The offsets that there are, rad or m.
    pub const OFFSET: NumberRange = GOAL;
}

/// The degrees of freedom that a joint locks and leaves free. Axes of a [`Joint`] are in a's shape, of any length above zero.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum JointKind {
    /// All locked.
    Fixed,
    /// Rotation about one axis, like a hinge.
    Revolute {
        /// The hinge's axis.
        axis: DVec3,
        /// Range of b's rotation relative to a about the axis, radians about the zero of `rest`, within −π … π.
        range_rad: Option<[f64; 2]>,
        /// Its motor, in radians and newton metres.
        motor: Option<Motor>,
    },
    /// Rotation about every axis, like a ball in its socket.
    Spherical,
    /// Translation along one axis.
    Prismatic {
        /// The slide's axis.
        axis: DVec3,
        /// Range of b's anchor relative to a's along the axis, metres.
        range_m: Option<[f64; 2]>,
        /// Its motor, in metres and newtons.
        motor: Option<Motor>,
    },
    /// A spring between the anchors.
    Spring {
        /// Stiffness, N/m, ≥ 0.
        stiffness_n_m: f64,
        /// Damping along the spring, N·s/m, ≥ 0.
        damping_n_s_m: f64,
        /// Length without force, metres, ≥ 0.
        rest_m: f64,
    },
    /// The anchors are never farther apart than this.
    Rope {
        /// Length, metres, > 0.
        length_m: f64,
    },
}

impl Joint {
    /// Whether a motor can drive it: a hinge or a slide.
    #[must_use]
    pub const fn takes_motor(&self) -> bool {
        matches!(self.kind, JointKind::Revolute { .. } | JointKind::Prismatic { .. })
    }

    /// The same joint with another motor; a joint that takes none stays as it is.
    #[must_use]
    pub fn with_motor(mut self, other: Option<Motor>) -> Self {
        if let JointKind::Revolute { motor, .. } | JointKind::Prismatic { motor, .. } = &mut self.kind {
            *motor = other;
        }
        self
    }
}

/// A motor of a joint: of a hinge in radians and newton metres, of a slide in metres and newtons.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Motor {
    /// The goal to which it drives the joint.
    pub goal: MotorGoal,
    /// The most effort that it gives, N·m or N, > 0; infinite for as much as it takes.
    pub max_effort: f64,
}

/// The goal of a motor: how b moves relative to a.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum MotorGoal {
    /// A velocity, rad/s or m/s, kept as exactly as the bound of the motor allows.
    Velocity(f64),
    /// A spring and a damper: the effort stiffness · (position − travel) + damping · (velocity − rate of travel), implicit. Of a hinge the
    /// position is reached the shorter way around.
    Spring {
        /// Where the spring rests, rad or m.
        position: f64,
        /// The velocity at which the damper gives nothing, rad/s or m/s.
        velocity: f64,
        /// Stiffness, N·m/rad or N/m, ≥ 0.
        stiffness: f64,
        /// Damping, N·m·s/rad or N·s/m, ≥ 0; one of both above zero.
        damping: f64,
    },
}

impl Motor {
    /// Whether every number is in its range.
    ///
    /// # Errors
    /// [`JointError::BadNumber`] with the first that is not.
    pub fn check(&self) -> Result<(), JointError> {
        OutOfRange::unless(self.max_effort > 0.0, "motor's greatest effort", self.max_effort, "above zero")?;
        match self.goal {
            MotorGoal::Velocity(velocity) => GOAL.check("motor's velocity", velocity)?,
            MotorGoal::Spring { position, velocity, stiffness, damping } => {
                GOAL.check("motor's position", position)?;
                GOAL.check("motor's velocity", velocity)?;
                NUMBER.check("motor's stiffness", stiffness)?;
                NUMBER.check("motor's damping", damping)?;
                ABOVE_ZERO.check("motor's stiffness and damping together", stiffness + damping)?;
            }
        }
        Ok(())
    }
}

/// Why a joint is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum JointError {
    /// A body cannot be jointed to itself.
    #[error("a joint needs two different bodies; both of its ends are the same body")]
    SameBody,
    /// A number is outside its range.
    #[error("the joint's {0}")]
    BadNumber(#[from] OutOfRange),
    /// A vector is not finite, or an axis has no direction.
    #[error("the joint's {what} must be finite and of a length above zero")]
    BadVector {
        /// Which one.
        what: &'static str,
    },
    /// A joint follows one that it cannot.
    #[error(
        "the joint follows joint {joint}; expected another hinge or slide that does not follow it in turn, by its number from 0"
    )]
    BadMimic {
        /// The number that it gives.
        joint: u32,
    },
    /// A range that ends before it starts.
    #[error("the joint's range is {low} to {high}; its upper limit must not be below its lower limit")]
    EmptyRange {
        /// Where it starts.
        low: f64,
        /// Where it ends.
        high: f64,
    },
    /// The bodies start where the joint cannot hold them.
    #[error("the bodies start with the joint violated by {apart_m} m; at most {limit_m} m is accepted")]
    Apart {
        /// How far, metres.
        apart_m: f64,
        /// The most that is taken, metres.
        limit_m: f64,
    },
}

/// Largest initial violation of a joint, metres: rounding of a scene's numbers. The first step closes it.
pub const JOINT_GAP_MAX_M: f64 = 1e-3;

impl Joint {
    /// A joint of `kind` without collision between its bodies, anchored in both shapes' origins, that neither tears nor yields.
    #[must_use]
    pub fn new(a: AgentId, b: Option<AgentId>, kind: JointKind) -> Self {
        let (anchor_a_m, anchor_b_m, rest) = (DVec3::ZERO, DVec3::ZERO, DQuat::IDENTITY);
        let (tears_above_n, yields_above_n) = (f64::INFINITY, f64::INFINITY);
        let (collide, friction, armature, mimic) = (false, 0.0, 0.0, None);
        Self {
            a,
            b,
            kind,
            anchor_a_m,
            anchor_b_m,
            rest,
            collide,
            tears_above_n,
            yields_above_n,
            friction,
            armature,
            mimic,
        }
    }

    /// The same joint with its zero at the initial rotations of the two shapes: rotations to the world's axes.
    #[must_use]
    pub fn at_rest_in(self, rotation_a: DQuat, rotation_b: DQuat) -> Self {
        Self { rest: (rotation_a.conjugate() * rotation_b).normalize(), ..self }
    }

    /// Whether every number is in its range.
    ///
    /// # Errors
    /// [`JointError`], all but [`JointError::Apart`].
    pub fn check(&self) -> Result<(), JointError> {
        if self.b == Some(self.a) {
            return Err(JointError::SameBody);
        }
        place("anchor on a", self.anchor_a_m)?;
        place("anchor on b", self.anchor_b_m)?;
        if !(self.rest.is_finite() && self.rest.length_squared() > 0.0) {
            return Err(JointError::BadVector { what: "rest rotation" });
        }
        let [tears_n, yields_n] = [self.tears_above_n, self.yields_above_n];
        OutOfRange::unless(tears_n > 0.0, "tearing force", tears_n, "above zero")?;
        let yields_first = yields_n > 0.0 && (yields_n < tears_n || yields_n == f64::INFINITY);
        OutOfRange::unless(yields_first, "yield force", yields_n, "above zero and below the tearing force")?;
        let most = if self.takes_motor() || self.kind == JointKind::Spherical { NUMBER } else { NONE };
        most.check("friction", self.friction)?;
        most.check("armature", self.armature)?;
        if let Some(Mimic { joint, ratio, offset }) = self.mimic {
            if !self.takes_motor() {
                return Err(JointError::BadMimic { joint });
            }
            Mimic::RATIO.check("ratio to the joint that it follows", ratio)?;
            Mimic::OFFSET.check("offset from the joint that it follows", offset)?;
        }
        match self.kind {
            JointKind::Fixed | JointKind::Spherical => Ok(()),
            JointKind::Revolute { axis, range_rad, motor } => {
                direction(axis)?;
                motor.as_ref().map_or(Ok(()), Motor::check)?;
                range_rad.map_or(Ok(()), |r| range("angle range", r, ANGLE))
            }
            JointKind::Prismatic { axis, range_m, motor } => {
                direction(axis)?;
                motor.as_ref().map_or(Ok(()), Motor::check)?;
                range_m.map_or(Ok(()), |r| range("travel range", r, GOAL))
            }
            JointKind::Spring { stiffness_n_m, damping_n_s_m, rest_m } => {
                NUMBER.check("stiffness", stiffness_n_m)?;
                NUMBER.check("damping", damping_n_s_m)?;
                Ok(NUMBER.check("rest length", rest_m)?)
            }
            JointKind::Rope { length_m } => Ok(ABOVE_ZERO.check("length", length_m)?),
        }
    }

    /// Whether the joint that it follows, one of `all` of which it is number `own`, can lead it: joints that followed each other in a ring would
    /// lock, but where their ratios multiply to one. `tied` are sets of those of the joints before it that follow each other; the last joint of
    /// a ring is its error.
    ///
    /// # Errors
    /// [`JointError::BadMimic`].
    pub fn check_mimic(&self, own: u32, all: &[Self], tied: &mut DisjointSets) -> Result<(), JointError> {
        let Some(Mimic { joint, .. }) = self.mimic else { return Ok(()) };
        let leads = all.get(joint as usize).is_some_and(Self::takes_motor) && tied.join(own as usize, joint as usize);
        if leads { Ok(()) } else { Err(JointError::BadMimic { joint }) }
    }

    /// Whether bodies with this start satisfy the joint: the shapes' origins and rotations, zero for the world.
    ///
    /// # Errors
    /// [`JointError::Apart`] where the anchors are more than [`JOINT_GAP_MAX_M`] from where the joint holds them.
    pub fn check_start(&self, a: (DVec3, DQuat), b: (DVec3, DQuat)) -> Result<(), JointError> {
        let between = b.0 + b.1 * self.anchor_b_m - (a.0 + a.1 * self.anchor_a_m);
        let apart_m = match self.kind {
            JointKind::Fixed | JointKind::Revolute { .. } | JointKind::Spherical => between.length(),
            JointKind::Prismatic { axis, range_m, .. } => {
                let axis = a.1 * axis.normalize();
                let along = between.dot(axis);
                let external = range_m.map_or(0.0, |[low, high]| along - along.clamp(low, high));
                (between - axis * (along - external)).length()
            }
            JointKind::Spring { .. } => 0.0,
            JointKind::Rope { length_m } => (between.length() - length_m).max(0.0),
        };
        if apart_m <= JOINT_GAP_MAX_M { Ok(()) } else { Err(JointError::Apart { apart_m, limit_m: JOINT_GAP_MAX_M }) }
    }

    /// Whether this joint holds the body `id`.
    #[must_use]
    pub fn holds(&self, id: AgentId) -> bool {
        self.a == id || self.b == Some(id)
    }
}

/// Stiffness, damping and lengths at rest; [`ABOVE_ZERO`] is that of lengths of ropes, [`GOAL`] that of goals of motors.
const NUMBER: NumberRange = NumberRange::new(0.0, 1e9, "");
/// The friction and armature of a joint that is neither hinge, slide nor ball.
const NONE: NumberRange = NumberRange::new(0.0, 0.0, "");
const ABOVE_ZERO: NumberRange = NumberRange { least: 1e-9, ..NUMBER };
const GOAL: NumberRange = NumberRange { least: -1e9, ..NUMBER };
const ANGLE: NumberRange = NumberRange::new(-std::f64::consts::PI, std::f64::consts::PI, "rad");

fn range(what: &'static str, [low, high]: [f64; 2], within: NumberRange) -> Result<(), JointError> {
    [low, high].into_iter().try_for_each(|value| within.check(what, value))?;
    if low <= high { Ok(()) } else { Err(JointError::EmptyRange { low, high }) }
}

fn place(what: &'static str, value: DVec3) -> Result<(), JointError> {
    if is_within_motion(value) { Ok(()) } else { Err(JointError::BadVector { what }) }
}

fn direction(axis: DVec3) -> Result<(), JointError> {
    if axis.try_normalize().is_some() { Ok(()) } else { Err(JointError::BadVector { what: "axis" }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rope(length_m: f64) -> Joint {
        Joint::new(AgentId(0), None, JointKind::Rope { length_m })
    }

    #[test]
    fn a_joint_with_an_impossible_number_is_refused() {
        assert_eq!(rope(1.0).check(), Ok(()));
        for length_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(rope(length_m).check(), Err(JointError::BadNumber(_))), "{length_m}");
        }
        for tears_above_n in [0.0, -1.0, f64::NAN] {
            let joint = Joint { tears_above_n, ..rope(1.0) };
            assert!(matches!(joint.check(), Err(JointError::BadNumber(_))), "{tears_above_n}");
        }
        for yields_above_n in [0.0, -1.0, f64::NAN, 2.0, 3.0] {
            let joint = Joint { yields_above_n, tears_above_n: 2.0, ..rope(1.0) };
            assert!(matches!(joint.check(), Err(JointError::BadNumber(_))), "{yields_above_n}");
        }
        assert_eq!(Joint { yields_above_n: 1.9, tears_above_n: 2.0, ..rope(1.0) }.check(), Ok(()));
        let to_itself = Joint { b: Some(AgentId(0)), ..rope(1.0) };
        assert_eq!(to_itself.check(), Err(JointError::SameBody));
        let hinge = |axis, range_rad| Joint { kind: JointKind::Revolute { axis, range_rad, motor: None }, ..rope(1.0) };
        assert!(matches!(hinge(DVec3::ZERO, None).check(), Err(JointError::BadVector { .. })));
        assert!(matches!(hinge(DVec3::X, Some([4.0, 5.0])).check(), Err(JointError::BadNumber(_))));
        assert!(matches!(hinge(DVec3::X, Some([1.0, 0.5])).check(), Err(JointError::EmptyRange { .. })));
        assert_eq!(hinge(DVec3::X * 3.0, Some([-1.0, 0.5])).check(), Ok(()));
        let resisted = |joint: Joint, value| [Joint { friction: value, ..joint }, Joint { armature: value, ..joint }];
        for joint in [(rope(1.0), 1.0), (hinge(DVec3::X, None), -1.0), (hinge(DVec3::X, None), f64::NAN)] {
            let refused = |joint: &Joint| matches!(joint.check(), Err(JointError::BadNumber(_)));
            assert!(resisted(joint.0, joint.1).iter().all(refused), "{joint:?}");
        }
        assert!(resisted(hinge(DVec3::X, None), 2.0).iter().all(|joint| joint.check().is_ok()));
    }

    #[test]
    fn bodies_that_start_out_of_a_joints_reach_are_refused() {
        let at = |x: f64| (DVec3::X * x, DQuat::IDENTITY);
        assert_eq!(rope(1.0).check_start(at(0.5), at(0.0)), Ok(()));
        assert!(matches!(rope(1.0).check_start(at(1.5), at(0.0)), Err(JointError::Apart { .. })));
        let socket = Joint { kind: JointKind::Spherical, anchor_a_m: DVec3::X, ..rope(1.0) };
        assert_eq!(socket.check_start(at(0.0), at(1.0)), Ok(()));
        assert!(matches!(socket.check_start(at(0.0), at(0.9)), Err(JointError::Apart { .. })));
        let slide = JointKind::Prismatic { axis: DVec3::X, range_m: Some([0.0, 2.0]), motor: None };
        let slide = Joint { kind: slide, ..rope(1.0) };
        assert_eq!(slide.check_start(at(0.0), at(1.5)), Ok(()));
        assert!(matches!(slide.check_start(at(0.0), at(2.5)), Err(JointError::Apart { .. })));
    }
}
