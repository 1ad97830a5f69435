//! Objects that may vanish, and the benefit as printed: options of a scene beyond levels.

use super::policies::{control, holes, mesh};
use super::*;
use crate::control::demand::policy::usual_sliders;
use crate::cost::benefit::Sliders;

/// Policies that choose by cost without trees.
const WITH_NULL: [Policy; 7] = [
    Policy::Greedy,
    Policy::GreedyIncremental,
    Policy::GreedyRepaired,
    Policy::MarginalStop,
    Policy::MarginalFill,
    Policy::Convex,
    Policy::Adaptive,
];

/// A thousand small meshes, of which the coarsest take 9.4 ms together, and one large one; their pixels tremble by up to 4 % either way.
fn crowd(frame: u32, may_vanish: bool) -> Vec<ObjectView> {
    let tremble = |i: u32| 1.0 + 0.04 * f64::from((i * 7919 + frame * 104_729) % 97) / 48.0 - 0.04;
    let small = |i: u32| {
        let pixels = 30.0 * (1.0 + f64::from(i % 40)) * tremble(i);
        ObjectView { may_vanish, ..mesh(i, pixels, 400) }
    };
    (0..1000).map(small).chain([mesh(1000, 1e5, 4000)]).collect()
}

#[test]
fn a_frame_that_the_coarsest_do_not_fit_is_feasible_where_objects_may_vanish() {
    for policy in WITH_NULL {
        let fixed = crowd(0, false);
        let mut control = control(policy, 100.0);
        let promise = control.plan(&fixed).promise;
        assert!(!promise.feasible && promise.holes == 0, "{policy:?}: {promise:?}");
        let views = crowd(0, true);
        let plan = control.plan(&views).clone();
        let promise = plan.promise;
        assert!(promise.feasible && promise.predicted_s <= 0.01, "{policy:?}: {promise:?}");
        assert!(promise.holes > 100, "{policy:?}: {promise:?}");
        // the objects left out are the least that makes the rest fit: 97 % of the time is spent
        assert!(promise.predicted_s > 0.97 * 0.0098, "{policy:?}: {promise:?}");
        assert_eq!(holes(&plan, &views), promise.holes as usize, "{policy:?}");
        assert!(plan.levels[1000].polygons > 0.0, "{policy:?}: what may not vanish is drawn");
    }
}

#[test]
fn members_of_a_group_vanish_where_the_policy_knows_no_groups_and_else_become_one() {
    let mut views = crowd(0, true);
    views[..1000].iter_mut().for_each(|it| it.group = Some(1001));
    let impostor = Kind::Group { radius_m: 3.0, impostors: [20, 0, 0, 0, 0, 0, 0, 0] };
    views.push(object(1001, impostor, ResolutionRange { eps_m: (1.0, 1.0), n: (0, 1) }));
    for (policy, together) in [(Policy::Greedy, false), (Policy::Hierarchical, true)] {
        let mut control = control(policy, 100.0);
        let plan = control.plan(&views);
        assert_eq!((plan.promise.holes == 0, plan.levels[1001].polygons > 0.0), (together, together), "{policy:?}");
        assert!(plan.promise.feasible, "{policy:?}");
    }
}

#[test]
fn what_may_vanish_is_drawn_where_there_is_time() {
    let views = crowd(0, true);
    for policy in WITH_NULL {
        let promise = control(policy, 10.0).plan(&views).promise;
        assert!(promise.feasible && promise.holes == 0, "{policy:?}: {promise:?}");
    }
}

#[test]
fn nothing_blinks_while_sizes_tremble() {
    for policy in WITH_NULL {
        let mut control = control(policy, 100.0);
        let (mut before, mut changes) = (Vec::new(), 0);
        for frame in 0..40 {
            let views = crowd(frame, true);
            let drawn: Vec<bool> = control.plan(&views).levels.iter().map(|level| level.polygons > 0.0).collect();
            // the first frames settle
            let changed = before.iter().zip(&drawn).filter(|(a, b)| a != b).count();
            changes += if frame < 10 { 0 } else { changed };
            before = drawn;
        }
        // at most 2 of 1000 an object and frame
        assert!(changes <= 60, "{policy:?}: {changes} times an object came or went in 30 frames");
    }
}

#[test]
fn focus_motion_and_hysteresis_are_off_with_the_benefit_as_printed_and_count_where_asked_for() {
    let base = || (0..40).map(|i| mesh(i, 4000.0, 4000));
    let aside = |view: ObjectView| ObjectView { off_centre: 0.9, ..view };
    let fast = |view: ObjectView| ObjectView { speed_px_s: 600.0, ..view };
    let half = |of: &dyn Fn(ObjectView) -> ObjectView| -> Vec<_> {
        base().enumerate().map(|(i, view)| if i % 2 == 0 { of(view) } else { view }).collect()
    };
    let polygons = |policy: Policy, views: &[ObjectView], sliders: Option<Sliders>| {
        let mut control = control(policy, 60.0);
        sliders.into_iter().for_each(|sliders| control.set_sliders(sliders));
        let levels = &control.plan(views).levels;
        let sum = |odd: usize| levels.iter().skip(odd).step_by(2).map(|level| level.polygons).sum::<f64>();
        [sum(0), sum(1)]
    };
    for policy in [Policy::Greedy, Policy::GreedyIncremental] {
        let usual = usual_sliders(policy);
        let plain: Vec<_> = base().collect();
        let none = polygons(policy, &plain, None);
        for (views, sliders) in
            [(half(&aside), Sliders { focus: 1.0, ..usual }), (half(&fast), Sliders { motion: 1.0, ..usual })]
        {
            assert_eq!(polygons(policy, &views, None), none, "{policy:?}: off");
            let [marked, others] = polygons(policy, &views, Some(sliders));
            assert!(marked < 0.8 * others, "{policy:?}: {marked} {others}");
        }
    }
}

#[test]
fn sliders_that_are_not_set_follow_the_policy() {
    let mut control = control(Policy::Adaptive, 60.0);
    control.set_sliders(GivenSliders { focus: Some(0.7), ..GivenSliders::default() });
    assert_eq!((control.sliders().focus, control.sliders().motion), (0.7, 0.5));
    control.set_policy(Policy::Greedy);
    assert_eq!((control.sliders().focus, control.sliders().motion), (0.7, 0.0), "as printed");
    // the window moves one of them
    let moved = Sliders { importance: 0.2, ..control.sliders() };
    control.set_sliders(control.given_sliders().moved(control.sliders(), moved));
    control.set_policy(Policy::Adaptive);
    assert_eq!(control.sliders(), Sliders { importance: 0.2, focus: 0.7, ..usual_sliders(Policy::Adaptive) });
}

#[test]
fn ladders_are_made_anew_where_another_policy_counts_otherwise() {
    let fast: Vec<_> =
        (0..40).map(|i| ObjectView { speed_px_s: 600.0 * f64::from(i % 2), ..mesh(i, 4000.0, 4000) }).collect();
    let mut fresh = control(Policy::MarginalStop, 60.0);
    let mut changed = control(Policy::Greedy, 60.0);
    changed.plan(&fast);
    changed.set_policy(Policy::MarginalStop);
    assert_eq!(changed.plan(&fast).levels, fresh.plan(&fast).levels);
}

#[test]
fn hysteresis_as_printed_makes_levels_change_less() {
    for policy in [Policy::Greedy, Policy::GreedyIncremental] {
        let changes = |hysteresis: f64| {
            let mut control = control(policy, 40.0);
            control.set_sliders(Sliders { hysteresis, ..usual_sliders(policy) });
            (0..40).map(|frame| control.plan(&crowd(frame, false)).changes).skip(10).sum::<u32>()
        };
        let [without, with] = [0.0, 1.0].map(changes);
        assert!(with < without / 2, "{policy:?}: {with} changes of levels, {without} without");
    }
}

#[test]
fn accuracy_as_printed_counts_polygons_for_flat_and_vertices_for_gouraud_shading() {
    // 84 polygons of 44 vertices flat: ½/84; Gouraud: ½/44², so a flat picture of the same worth needs 1936 polygons
    let one = |shading: Shading| ObjectView { shading: (shading, shading), ..mesh(0, 1e5, 84) };
    let value = |shading: Shading| control(Policy::Greedy, 30.0).plan(&[one(shading)]).promise.value / 4096.0 / 1e5;
    assert!((value(Shading::Flat) - (1.0 - 0.5 / 84.0)).abs() < 1e-4, "{}", value(Shading::Flat));
    assert!((value(Shading::Gouraud) - (1.0 - 0.5 / 1936.0)).abs() < 1e-5, "{}", value(Shading::Gouraud));
    assert!(value(Shading::PerPixel) > value(Shading::Gouraud));
}
