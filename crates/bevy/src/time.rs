//! The world's time beside the app's.
//!
//! In: Bevy's virtual time. Out: in lockstep a world that has lived as long as the frame, on threads and in a pool one that is paused and as
//! fast as it. Never here: waiting for objects in real time.

use super::MetachronWorld;
use super::messages::Refused;
use bevy_ecs::prelude::*;
use bevy_time::{Time, Virtual};
use metachron_core::SimSpan;
use metachron_runtime::TimelineCommand;
use metachron_world::{Pace, kinds::ExecutorKind};

/// How time flows in the app.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Flow {
    stands: bool,
    speed: f64,
}

/// Lets time pass.
pub(super) fn pass(
    world: Res<'_, MetachronWorld>,
    time: Res<'_, Time<Virtual>>,
    mut before: Local<'_, Option<Flow>>,
    mut refused: MessageWriter<'_, Refused>,
) {
    if world.executor() == ExecutorKind::Lockstep {
        let span = u64::try_from(time.delta().as_nanos()).unwrap_or(u64::MAX);
        return world.advance(SimSpan::from_nanos(span));
    }
    let speed = time.relative_speed_f64();
    let now = Flow { stands: time.is_paused() || speed == 0.0, speed };
    if before.replace(now) == Some(now) {
        return;
    }
    if !now.stands
        && let Err(error) = world.set_pace(Pace::Factor(speed))
    {
        refused.write(Refused { entity: None, error });
    }
    world.drive(if now.stands { TimelineCommand::Pause } else { TimelineCommand::Run });
}
