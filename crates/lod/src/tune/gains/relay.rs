//! Gains by a relay experiment (AH84), the classic method for a loop without a model, and Ziegler and Nichols' rule (ZN42).
//!
//! In: a plant. Out: the PI gains of the rule, for comparison with the gains of the search. Never here: a judgement.

use crate::control::{FrameWork, Law, PictureControl, Policy};
use crate::tune::loops::plant::Plant;
use metachron_core::gains;

/// The relay moves ln ε by this much to either side.
const HEIGHT: f64 = 0.2;
/// Frames of the experiment, and of its start that is ignored.
const FRAMES: usize = 240;
const WARM_UP: usize = 60;

/// The PI law that Ziegler and Nichols' rule gives for the relay's oscillation of the loop at `target_hz`, clamped to the range of the law;
/// `None` if it does not oscillate.
#[must_use]
pub fn relay_gains(plant: &Plant, target_hz: f64, margin: f64) -> Option<Law> {
    let errors = relay(plant, target_hz, margin);
    let tail = errors.get(WARM_UP..)?;
    let (low, high) = tail.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), e| (l.min(*e), h.max(*e)));
    let amplitude = 0.5 * (high - low);
    let rises = tail.windows(2).filter(|w| w[0] < 0.0 && w[1] >= 0.0).count();
    if !(amplitude > 1e-3 && rises >= 2) {
        return None;
    }
    let period = tail.len() as f64 / rises as f64;
    let ultimate = 4.0 * HEIGHT / (std::f64::consts::PI * amplitude);
    let proportional = 0.45 * ultimate;
    let kappa = gains::KAPPA.nearest(proportional * 1.2 / period);
    Some(Law::Corrected { kappa, lead: proportional.min(gains::LEAD.greatest), margin })
}

/// ln(t/T_set) of frames whose ln ε is moved against it by a relay, without noise.
fn relay(plant: &Plant, target_hz: f64, margin: f64) -> Vec<f64> {
    let mut control =
        PictureControl::new(Policy::Feedback, Law::Corrected { kappa: 0.5, lead: 0.0, margin }, target_hz);
    let set_s = control.set_point_s();
    let centre = plant.line.x_of(set_s).max(1.0);
    let (mut drawn, mut errors) = (Vec::with_capacity(FRAMES), Vec::with_capacity(FRAMES));
    let mut side = 1.0;
    for k in 0..FRAMES {
        let wanted = centre * libm::exp(-side * HEIGHT);
        let before = control.plan(plant.views(0)).polygons;
        control.coarsen(before / wanted);
        drawn.push(control.plan(plant.views(0)).polygons);
        control.observe(FrameWork { skip: true, ..FrameWork::default() });
        let error = libm::log(plant.seconds(drawn[k.saturating_sub(plant.dead_time)], 1.0) / set_s);
        side = if error >= 0.0 { 1.0 } else { -1.0 };
        errors.push(error);
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tune::loops::plant::tests::observed;

    #[test]
    fn a_relay_finds_the_ultimate_gain_of_a_late_plant() {
        for dead_time in [0, 1] {
            let plant = Plant::identify(&observed(7e-3, 0.22e-6, dead_time)).unwrap();
            let Some(Law::Corrected { kappa, lead, .. }) = relay_gains(&plant, 30.0, 0.1) else { panic!("it swings") };
            // a square wave of 2(d+1) frames and s·h: the rule gives 0.45·4/(π s), and a 1.2/Tu of it for the integral
            let s = plant.share(0.9 / 30.0, 1.0);
            let expected: f64 = 0.45 * 4.0 / (std::f64::consts::PI * s);
            assert!((lead / expected - 1.0).abs() < 0.15, "{dead_time}: {lead} and {expected}");
            let period = 2.0 * (dead_time as f64 + 1.0);
            assert!((kappa / (lead * 1.2 / period) - 1.0).abs() < 0.15, "{dead_time}: {kappa}");
        }
    }
}
