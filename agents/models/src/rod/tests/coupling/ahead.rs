//! Tubes that press on each other while the clocks of those that own the pairs are ahead of the others'.

use super::meetings::GRAVITY;
use crate::harness::{Faults, Stage};
use crate::rod::Tube;
use crate::rod::{Material, Section, TubeSpec};
use glam::DVec3;
use metachron_core::Resolution;
use metachron_core::ResolutionRange;

/// A soft strand that swings between two points, this finely divided; a wish may change that.
fn strand(path_m: Vec<DVec3>, eps_m: f64) -> TubeSpec {
    let material = Material { young_pa: 5e4, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let section = Section::hollow(0.012, 0.003, material);
    TubeSpec {
        pin: [true; 2],
        segments: None,
        friction: 0.4,
        damping_per_s: 0.05,
        gravity: GRAVITY,
        resolution: Resolution { eps_m, n: 3 },
        range: ResolutionRange { eps_m: (8e-4, 0.08), n: (0, 5) },
        sleep: false,
        ..TubeSpec::free(path_m, section, 8)
    }
}

/// Eight strands side by side, a tenth of a metre apart, each drawn aside and up by an angle of its own: the middle of the path, and
/// what lies between it and the ends.
const BOWS: [[[f64; 2]; 3]; 8] = [
    [[-0.55, 0.75], [-0.3874, 0.5178], [-0.3332, 0.4404]],
    [[-0.45, 0.75], [-0.1804, 0.6624], [-0.0905, 0.6332]],
    [[-0.35, 0.75], [-0.107, 0.604], [-0.026, 0.5553]],
    [[-0.25, 0.75], [-0.0461, 0.5531], [0.0219, 0.4874]],
    [[-0.15, 0.75], [0.1314, 0.7155], [0.2252, 0.7039]],
    [[-0.05, 0.75], [0.2164, 0.653], [0.3052, 0.6207]],
    [[0.05, 0.75], [0.2878, 0.5956], [0.367, 0.5441]],
    [[0.15, 0.75], [0.3469, 0.5461], [0.4126, 0.4781]],
];

/// By how much the energy of all comes to lie above that of the start, joules, while every other one is ahead by `lead_s`; `retuned`
/// are divided anew four times a second.
fn rise_j((rate_hz, lead_s): (f64, f64), retuned: bool) -> f64 {
    let mut stage = Stage::new(Faults::default());
    stage.at_once = true;
    let ids = BOWS.map(|bow| {
        let point = |i: usize| {
            let [y, z] = bow[if i > 2 { 4 - i } else { i }];
            DVec3::new(0.2 * i as f64 - 0.4, y, z)
        };
        stage.add(Tube::new(strand((0..5).map(point).collect(), 0.04)).unwrap(), rate_hz)
    });
    ids.iter().step_by(2).for_each(|id| stage.lead(*id, lead_s));
    let energy_j = |stage: &Stage| ids.iter().map(|id| stage.newest(*id).energy_j).sum::<f64>();
    let (first_j, mut most_j) = (energy_j(&stage), f64::MIN);
    for quarter in 1..=11 {
        let eps_m = if quarter % 4 < 2 { 0.08 } else { 0.02 };
        ids.iter().filter(|_| retuned).for_each(|id| stage.agent_mut(*id).set_resolution(Resolution { eps_m, n: 3 }));
        // the first touch comes after a second
        stage.run(0.25 * f64::from(quarter), |stage| most_j = most_j.max(energy_j(stage)));
    }
    let pressed = ids.iter().any(|id| stage.newest(*id).given.iter().any(|ledger| !ledger.pages.is_empty()));
    assert!(pressed, "nobody touched anybody");
    most_j - first_j
}

#[test]
fn tubes_whose_owner_is_ahead_of_them_gain_no_energy() {
    for when in [(500.0, 0.01), (500.0, 0.02), (200.0, 0.02)] {
        let rise = rise_j(when, false);
        println!("{when:?}: {rise} J");
        // 11.9 J at the start; they only lose
        assert!(rise < 0.01, "{when:?}: {rise} J");
    }
}

#[test]
fn tubes_that_are_divided_anew_while_they_press_on_each_other_gain_no_energy() {
    for when in [(500.0, 0.0), (500.0, 0.02)] {
        let rise = rise_j(when, true);
        println!("{when:?}: {rise} J");
        assert!(rise < 0.01, "{when:?}: {rise} J");
    }
}
