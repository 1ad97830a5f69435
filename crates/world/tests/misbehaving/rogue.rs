//! A model that behaves like a rigid body until it is told to misbehave, and how.

use glam::{DMat3, DVec3};
use metachron_contact::member::{
    Attachments, ClusterMember, Locked, MaterialPoint, MemberMotion, Pose, Role, SkinPoint, StepEnd, StepSystem,
};
use metachron_contact::solve::{Block, Side, SideTerm};
use metachron_contact::{Agent, Inputs, SetMotion, StepContext, Stepping};
use metachron_core::{AgentId, Anchor, Archive, ArchiveError, Body, Bounds, Snapshot, StepError};
use metachron_geometry::{CollisionShape, ContactSide, Place, PlacedShape, ShapePose, Solid};
use metachron_models::rigid::{RigidBody, RigidSpec};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering::SeqCst};
use std::time::Duration;

/// Where it misbehaves, and how: it panics where nothing else is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// Not at all.
    None,
    Begin,
    End,
    System,
    Side,
    Pose,
    Skin,
    Role,
    SpeedBound,
    Keep,
    GoBack,
    MoveTo,
    Look,
    CanSleep,
    Member,
    Snapshot,
    SetMotion,
    SetState,
    Form,
    Archive,
    Momentum,
    Resolution,
    Drop,
    /// It refuses every step.
    Diverges,
    /// Lists of a wrong length.
    ShortFree,
    LongFree,
    ShortVelocities,
    NoVelocities,
    WrongUnanswered,
    WrongBlock,
    WrongSide,
    /// Values that are no number.
    NanFree,
    NanVelocities,
    NanBlocks,
    NanSide,
    NanSkin,
    NanPose,
    NanBody,
    NanEnergy,
    NanBounds,
    /// Its step does not end before it behaves again.
    Sleeps,
    /// Its step does not end before it is told otherwise.
    Hangs,
    /// Its step takes some time, and ends.
    Slow,
}

impl Kind {
    pub const ALL: [Self; 41] = [
        Self::None,
        Self::Begin,
        Self::End,
        Self::System,
        Self::Side,
        Self::Pose,
        Self::Skin,
        Self::Role,
        Self::SpeedBound,
        Self::Keep,
        Self::GoBack,
        Self::MoveTo,
        Self::Look,
        Self::CanSleep,
        Self::Member,
        Self::Snapshot,
        Self::SetMotion,
        Self::SetState,
        Self::Form,
        Self::Archive,
        Self::Momentum,
        Self::Resolution,
        Self::Drop,
        Self::Diverges,
        Self::ShortFree,
        Self::LongFree,
        Self::ShortVelocities,
        Self::NoVelocities,
        Self::WrongUnanswered,
        Self::WrongBlock,
        Self::WrongSide,
        Self::NanFree,
        Self::NanVelocities,
        Self::NanBlocks,
        Self::NanSide,
        Self::NanSkin,
        Self::NanPose,
        Self::NanBody,
        Self::NanEnergy,
        Self::NanBounds,
        Self::Sleeps,
    ];
}

/// The fault that it is to make, and how often it made it.
#[derive(Debug, Default)]
pub struct Switch {
    kind: AtomicU8,
    pub times: AtomicU64,
}

impl Switch {
    pub fn set(&self, kind: Kind) {
        self.kind.store(kind as u8, SeqCst);
    }

    /// Whether it is to do that now; it is counted.
    fn is(&self, kind: Kind) -> bool {
        let is = self.kind.load(SeqCst) == kind as u8;
        self.times.fetch_add(u64::from(is), SeqCst);
        is
    }

    fn panics(&self, kind: Kind) {
        if self.is(kind) {
            // as a panic, but that nothing is printed
            std::panic::resume_unwind(Box::new(format!("{kind:?} on demand")));
        }
    }
}

/// The model.
pub struct Rogue {
    body: RigidBody,
    switch: Arc<Switch>,
    wrong: Vec<DVec3>,
    blocks: Vec<Block>,
}

pub const HALF_M: f64 = 0.1;

impl Rogue {
    pub fn new(switch: &Arc<Switch>, at: DVec3) -> Self {
        let solid = Solid::Box { half_extents_m: DVec3::splat(HALF_M) };
        Self::of(RigidSpec::free(solid, at, 4.0), switch)
    }

    /// One without weight.
    pub fn floating(switch: &Arc<Switch>, at: DVec3) -> Self {
        let solid = Solid::Box { half_extents_m: DVec3::splat(HALF_M) };
        Self::of(RigidSpec { gravity: DVec3::ZERO, ..RigidSpec::free(solid, at, 4.0) }, switch)
    }

    fn of(spec: RigidSpec, switch: &Arc<Switch>) -> Self {
        let body = RigidBody::new(spec).unwrap();
        Self { body, switch: Arc::clone(switch), wrong: Vec::new(), blocks: Vec::new() }
    }

    /// Its velocities are of another number then.
    fn is_short(&self) -> bool {
        !self.wrong.is_empty()
    }
}

impl Drop for Rogue {
    fn drop(&mut self) {
        self.switch.panics(Kind::Drop);
    }
}

impl Agent for Rogue {
    fn model(&self) -> &'static str {
        "rogue"
    }

    fn resolution(&self) -> Option<metachron_core::Resolution> {
        self.switch.panics(Kind::Resolution);
        None
    }

    fn inputs(&self) -> Inputs {
        self.body.inputs()
    }

    fn set_motion(&mut self, motion: &SetMotion) -> bool {
        self.switch.panics(Kind::SetMotion);
        self.body.set_motion(motion)
    }

    fn set_state(&mut self, state: &Body) -> Result<(), String> {
        self.switch.panics(Kind::SetState);
        self.body.set_state(state)
    }

    fn stepping(&mut self) -> Stepping<'_> {
        self.switch.panics(Kind::Member);
        Stepping::Cluster(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        self.switch.panics(Kind::Snapshot);
        self.body.write_snapshot(into);
        if self.switch.is(Kind::NanEnergy) {
            into.energy_j = f64::NAN;
        }
        if self.switch.is(Kind::NanBounds) {
            into.bounds = Some(Bounds { low: DVec3::NAN, high: DVec3::NAN, speed_m_s: 0.0 });
        }
        if self.switch.is(Kind::NanBody)
            && let Body::Rigid(state) = &mut into.body
        {
            state.position.z = f64::NAN;
        }
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        if !archive.is_reading() {
            self.switch.panics(Kind::Archive);
        }
        self.body.archive(archive)
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        self.switch.panics(Kind::Momentum);
        self.body.momentum()
    }

    fn mass_kg(&self) -> f64 {
        self.body.mass_kg()
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        self.switch.panics(Kind::Form);
        self.body.form()
    }
}

impl ClusterMember for Rogue {
    fn role(&self) -> Role {
        self.switch.panics(Kind::Role);
        self.body.role()
    }

    fn look(&mut self, context: &StepContext<'_>, dt_s: f64) {
        self.switch.panics(Kind::Look);
        self.body.look(context, dt_s);
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        self.switch.panics(Kind::Begin);
        if self.switch.is(Kind::Diverges) {
            return Err(StepError::Diverged { model: "rogue", dt_s: h_s, what: "on demand".to_owned() });
        }
        if self.switch.is(Kind::Sleeps) {
            std::thread::sleep(Duration::from_millis(700));
            self.switch.set(Kind::None);
        }
        if self.switch.is(Kind::Slow) {
            std::thread::sleep(Duration::from_millis(10));
        }
        while self.switch.is(Kind::Hangs) {
            std::thread::sleep(Duration::from_millis(1));
        }
        self.body.begin(h_s)?;
        let (free, nan) = (self.body.system().free.to_vec(), DVec3::NAN);
        self.wrong = if self.switch.is(Kind::ShortFree) || self.switch.is(Kind::ShortVelocities) {
            free[..1].to_vec()
        } else if self.switch.is(Kind::LongFree) {
            [&free[..], &free[..]].concat()
        } else if self.switch.is(Kind::NanFree) || self.switch.is(Kind::NanVelocities) {
            vec![nan; free.len()]
        } else {
            Vec::new()
        };
        let blocks = self.body.system().blocks;
        self.blocks = if self.switch.is(Kind::WrongBlock) {
            vec![Block { row: 7, ..blocks[0] }]
        } else if self.switch.is(Kind::NanBlocks) {
            blocks.iter().map(|block| Block { value: DMat3::NAN, ..*block }).collect()
        } else {
            Vec::new()
        };
        Ok(())
    }

    fn system(&self) -> StepSystem<'_> {
        self.switch.panics(Kind::System);
        let mut system = self.body.system();
        let is_any = |kinds: &[Kind]| kinds.iter().any(|kind| self.switch.is(*kind));
        if !self.blocks.is_empty() {
            system.blocks = &self.blocks;
        }
        if is_any(&[Kind::ShortFree, Kind::LongFree, Kind::NanFree]) && self.is_short() {
            system.free = &self.wrong;
        }
        if is_any(&[Kind::ShortVelocities, Kind::NanVelocities]) && self.is_short() {
            system.velocities = &self.wrong;
        }
        if is_any(&[Kind::WrongUnanswered]) {
            system.unanswered = &[DVec3::ZERO; 5];
        }
        if is_any(&[Kind::NoVelocities]) {
            system.velocities = &[];
        }
        system
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        self.switch.panics(Kind::Skin);
        let skin = self.body.skin()?;
        let ShapePose::Solid { rotation, .. } = skin.view else { return Some(skin) };
        let view = ShapePose::Solid { position: DVec3::NAN, rotation };
        Some(if self.switch.is(Kind::NanSkin) { PlacedShape { view, ..skin } } else { skin })
    }

    fn skin_point(&self, place: &Place, contact: ContactSide) -> SkinPoint {
        self.switch.panics(Kind::Side);
        let of = |block, map| Side::new(0, &[SideTerm { block, map }]).unwrap();
        if self.switch.is(Kind::WrongSide) {
            return of(9, DMat3::IDENTITY).into();
        }
        if self.switch.is(Kind::NanSide) {
            return of(0, DMat3::NAN).into();
        }
        self.body.skin_point(place, contact)
    }

    fn carry(&mut self, impulses_n_s2: &[DVec3]) {
        self.body.carry(impulses_n_s2);
    }

    fn keep(&mut self) {
        self.switch.panics(Kind::Keep);
        self.body.keep();
    }

    fn go_back(&mut self) {
        self.switch.panics(Kind::GoBack);
        self.body.go_back();
    }

    fn move_to(&mut self, v: &[DVec3], t_s: f64) {
        self.switch.panics(Kind::MoveTo);
        self.body.move_to(v, t_s);
    }

    fn end(&mut self, step: &StepEnd<'_>) -> Result<(), StepError> {
        self.switch.panics(Kind::End);
        self.body.end(step)
    }

    fn can_sleep(&self) -> bool {
        self.switch.panics(Kind::CanSleep);
        false
    }

    fn motion(&self) -> Option<&dyn MemberMotion> {
        Some(self)
    }

    fn attachments(&self) -> Option<&dyn Attachments> {
        Some(self)
    }
}

impl MemberMotion for Rogue {
    fn pose(&self, v: &[DVec3], t_s: f64) -> Option<Pose> {
        self.switch.panics(Kind::Pose);
        let pose = self.body.pose(v, t_s)?;
        Some(if self.switch.is(Kind::NanPose) { Pose { centre_m: DVec3::NAN, ..pose } } else { pose })
    }

    fn locked(&self) -> Option<Locked> {
        self.body.locked()
    }

    fn skin_after<'a>(&'a self, v: &[DVec3], t_s: f64, nodes: &'a mut Vec<DVec3>) -> Option<PlacedShape<'a>> {
        self.body.skin_after(v, t_s, nodes)
    }

    fn speed_bound(&self, v: &[DVec3]) -> f64 {
        self.switch.panics(Kind::SpeedBound);
        self.body.speed_bound(v)
    }

    fn passes_through(&self, other: AgentId) -> bool {
        self.body.passes_through(other)
    }
}

impl Attachments for Rogue {
    fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint> {
        self.body.anchor(anchor)
    }

    fn turn(&self, anchor: Anchor) -> Option<Side> {
        self.body.turn(anchor)
    }
}
