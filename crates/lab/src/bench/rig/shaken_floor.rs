//! A floor that is led to and fro, on which a body is shaken.
//!
//! In: time. Out: a box whose top is at z = 0 and whose acceleration is 0.3 g cos ω t along x. Never here: the body on it.

use crate::chart::GRAVITY;
use glam::{DQuat, DVec3};
use metachron_contact::member::{Attachments, ClusterMember, MaterialPoint, MemberMotion, Role, SkinPoint, StepEnd};
use metachron_contact::solve::Side;
use metachron_contact::{Agent, Stepping};
use metachron_core::{Anchor, Snapshot, StepError};
use metachron_geometry::{
    CollisionShape, ContactSide, Place, PlacedShape, ShapeError, ShapeKind, ShapePose, Solid, SolidShape,
};

/// Largest acceleration, m/s².
const SHAKE_M_S2: f64 = 0.3 * GRAVITY;
/// Twice a second, rad/s.
const OMEGA_RAD_S: f64 = 2.0 * std::f64::consts::TAU;
/// Half its extent, metres.
const HALF_M: DVec3 = DVec3::new(0.5, 0.5, 0.05);

/// The floor.
pub(crate) struct ShakenFloor {
    form: CollisionShape,
    time_s: f64,
    kept_s: f64,
    /// Its velocity along x in the step begun.
    led_m_s: f64,
}

impl ShakenFloor {
    pub(crate) fn new() -> Result<Self, ShapeError> {
        let solid = SolidShape::new(Solid::Box { half_extents_m: HALF_M }, DVec3::ZERO)?;
        let form = CollisionShape::new(ShapeKind::Solid(solid), 0.5);
        Ok(Self { form, time_s: 0.0, kept_s: 0.0, led_m_s: 0.0 })
    }

    /// Its place along x at a time: at rest when it begins.
    fn place_m(time_s: f64) -> f64 {
        SHAKE_M_S2 / OMEGA_RAD_S.powi(2) * (1.0 - libm::cos(OMEGA_RAD_S * time_s))
    }

    fn middle(&self) -> DVec3 {
        DVec3::new(Self::place_m(self.time_s), 0.0, -HALF_M.z)
    }
}

impl ClusterMember for ShakenFloor {
    fn role(&self) -> Role {
        Role::Kinematic
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        self.led_m_s = (Self::place_m(self.time_s + h_s) - Self::place_m(self.time_s)) / h_s;
        Ok(())
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        let view = ShapePose::Solid { position: self.middle(), rotation: DQuat::IDENTITY };
        Some(PlacedShape { form: &self.form, view })
    }

    fn skin_point(&self, _place: &Place, _contact: ContactSide) -> SkinPoint {
        SkinPoint { led_m_s: DVec3::X * self.led_m_s, ..Side::FIXED.into() }
    }

    fn end(&mut self, &StepEnd { h_s, .. }: &StepEnd<'_>) -> Result<(), StepError> {
        self.time_s += h_s;
        Ok(())
    }

    fn keep(&mut self) {
        self.kept_s = self.time_s;
    }

    fn go_back(&mut self) {
        self.time_s = self.kept_s;
    }

    fn motion(&self) -> Option<&dyn MemberMotion> {
        Some(self)
    }

    fn attachments(&self) -> Option<&dyn Attachments> {
        Some(self)
    }
}

impl MemberMotion for ShakenFloor {
    fn speed_bound(&self, _v: &[DVec3]) -> f64 {
        self.led_m_s.abs()
    }
}

impl Attachments for ShakenFloor {
    fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint> {
        let Anchor::Local(local) = anchor else { return None };
        Some(MaterialPoint::led(self.middle() + local, DVec3::X * self.led_m_s))
    }
}

impl Agent for ShakenFloor {
    fn model(&self) -> &'static str {
        "floor"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Cluster(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.clear();
    }
}
