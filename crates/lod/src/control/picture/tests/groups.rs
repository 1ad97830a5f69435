//! Groups of several impostors: which is drawn when time is short and when it is not.

use super::policies::{control, holes, mesh};
use super::*;

const LEVELS: [u32; level::IMPOSTORS_MAX] = [20, 40, 80, 0, 0, 0, 0, 0];
const MEMBERS: usize = 15;

/// Four groups of fifteen meshes, each farther than the one before; members first, then the groups.
fn woods() -> Vec<ObjectView> {
    let sizes = [4000.0, 1000.0, 250.0, 60.0];
    let members = (0..4 * MEMBERS).map(|i| {
        let group = Some(4 * MEMBERS + i / MEMBERS);
        ObjectView { group, ..mesh(i as u32, sizes[i / MEMBERS], 2000) }
    });
    let group = |k: usize| {
        let kind = Kind::Group { radius_m: 3.0, impostors: LEVELS };
        let range = ResolutionRange { eps_m: (1.0, 1.0), n: (0, 10) };
        let pixels = 10.0 * sizes[k];
        ObjectView { pixels, ..object((4 * MEMBERS + k) as u32, kind, range) }
    };
    members.chain((0..4).map(group)).collect()
}

/// A machine without a backdrop, on which a frame may take so many milliseconds.
fn bare(policy: Policy, target_ms: f64) -> PictureControl {
    let mut control = control(policy, 1e3 / target_ms);
    control.set_prices(Prices { frame_s: 0.0, pixel_s: 0.0, ..*control.prices() });
    control.set_margin(0.02);
    control
}

/// Draws a frame that takes `times` its price.
fn frame(control: &mut PictureControl, views: &[ObjectView], times: f64) {
    let plan = control.plan(views).clone();
    let work_s = times * control.prices().objects_s(views.iter(), &plan.levels);
    control.observe(frame_work(Duration::from_secs_f64(work_s), false));
}

/// A controller that has drawn a hundred frames.
fn settled(policy: Policy, target_ms: f64, views: &[ObjectView]) -> PictureControl {
    let mut control = bare(policy, target_ms);
    (0..100).for_each(|_| frame(&mut control, views, 1.0));
    control
}

/// The level of every group: the number of its impostor, past the last where it is open.
fn levels_of(control: &PictureControl) -> Vec<u8> {
    let plan = control.last_plan();
    let groups = &plan.levels[4 * MEMBERS..];
    for (k, group) in groups.iter().enumerate() {
        let drawn = plan.levels[k * MEMBERS..(k + 1) * MEMBERS].iter().filter(|level| level.polygons > 0.0).count();
        let (closed, expected) = (group.polygons > 0.0, level::open(&woods()[4 * MEMBERS + k]));
        assert_eq!((drawn, closed), if closed { (0, true) } else { (MEMBERS, false) }, "group {k}");
        assert!(closed == (group.resolution.n < expected), "{group:?}");
        assert!(!closed || group.polygons == f64::from(LEVELS[usize::from(group.resolution.n)]), "{group:?}");
    }
    groups.iter().map(|group| group.resolution.n).collect()
}

#[test]
fn every_level_of_a_group_is_chosen_between_closed_and_open() {
    let views = woods();
    for policy in [Policy::Adaptive, Policy::Hierarchical, Policy::HierarchicalFlat] {
        let mut seen = [false; 4];
        for step in 0..27 {
            let control = settled(policy, 0.042 * 1.3_f64.powi(step), &views);
            assert_eq!(holes(control.last_plan(), &views), 0, "{policy:?}");
            let now = levels_of(&control);
            now.iter().for_each(|n| seen[usize::from(*n)] = true);
            if step == 0 {
                assert_eq!(now, [0; 4], "{policy:?}: hardly any time");
            } else if step == 26 {
                assert_eq!(now, [3; 4], "{policy:?}: time for all");
            }
        }
        assert_eq!(seen, [true; 4], "{policy:?}");
    }
}

#[test]
fn a_groups_level_rises_with_a_falling_price_and_skips_none() {
    // the last wood alone, and a mesh of fine steps that asks for all the time: by it the price falls smoothly
    let mut views: Vec<_> =
        (0..MEMBERS).map(|i| ObjectView { group: Some(MEMBERS), ..mesh(i as u32, 250.0, 2000) }).collect();
    let kind = Kind::Group { radius_m: 3.0, impostors: LEVELS };
    views.push(ObjectView { pixels: 2500.0, ..object(MEMBERS as u32, kind, views[0].range) });
    views.push(mesh(MEMBERS as u32 + 1, 3e5, 200_000));
    let level = |step: i32| {
        let control = settled(Policy::Adaptive, 0.1 * 1.04_f64.powi(step), &views);
        control.last_plan().levels[MEMBERS].resolution.n
    };
    let mut levels: Vec<u8> = (0..60).map(level).collect();
    levels.dedup();
    assert_eq!(levels, [0, 1, 2, 3]);
}

#[test]
fn a_still_picture_of_closed_and_open_groups_does_not_change() {
    let views = woods();
    // the machine trembles by two parts in a hundred, as a quiet one does
    let tremble = |k: u32| 1.0 + 0.02 * f64::from(k * 7919 % 101) / 100.0;
    let mut states = Vec::new();
    for target_ms in [0.1, 0.3, 0.8, 1.3, 2.0, 4.0] {
        let mut control = bare(Policy::Adaptive, target_ms);
        for k in 0..300 {
            frame(&mut control, &views, tremble(k));
            let plan = control.last_plan();
            assert!(k < 100 || (plan.changes, plan.reversals) == (0, 0), "{target_ms} ms, frame {k}");
        }
        states.extend(levels_of(&control));
    }
    assert!(states.contains(&3) && states.iter().any(|level| *level < 3), "open and closed: {states:?}");
}

#[test]
fn a_late_frame_draws_closed_groups_by_their_coarsest_impostor() {
    let views = woods();
    let mut control = settled(Policy::Adaptive, 0.4, &views);
    let before = control.last_plan().levels.clone();
    control.hurry();
    let plan = control.last_plan();
    let closed = |levels: &[LevelDemand]| levels[4 * MEMBERS..].iter().map(|level| level.polygons).collect::<Vec<_>>();
    let (then, now) = (closed(&before), closed(&plan.levels));
    assert!(then.iter().any(|polygons| *polygons > 20.0), "{then:?}");
    assert!(then.iter().zip(&now).all(|(then, now)| *now == then.min(20.0)), "{then:?} to {now:?}");
    assert_eq!(holes(plan, &views), 0);
}

#[test]
fn the_detail_of_a_group_is_its_level_over_its_number_of_levels() {
    let views = woods();
    let group = &views[4 * MEMBERS];
    let of = |n| {
        let resolution = Resolution { eps_m: 1.0, n };
        let level = LevelDemand { id: group.id, resolution, polygons: 20.0, shading: group.shading.1 };
        crate::control::detail(group, &level)
    };
    assert_eq!([of(0), of(1), of(2), of(3)], [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0]);
}

/// Two groups of eight meshes, and, where it is `nested`, a third around both.
fn two_groups(nested: bool) -> Vec<ObjectView> {
    let meshes = (0..16).map(|i| ObjectView { group: Some(16 + i / 8), ..mesh(i as u32, 4000.0, 2000) });
    let group = |number: u32, around: Option<usize>| {
        let kind = Kind::Group { radius_m: 3.0, impostors: [80, 0, 0, 0, 0, 0, 0, 0] };
        let range = ResolutionRange { eps_m: (1.0, 1.0), n: (0, 10) };
        ObjectView { pixels: 40_000.0, group: around, ..object(number, kind, range) }
    };
    let inner = (16..18).map(|number| group(number, nested.then_some(18)));
    let outer = nested.then(|| group(18, None));
    meshes.chain(inner).chain(outer).collect()
}

#[test]
fn a_group_around_others_costs_no_triangles_at_the_same_target() {
    let drawn = |views: &[ObjectView], control: &PictureControl| {
        let levels = &control.last_plan().levels;
        assert_eq!(levels.len(), views.len());
        levels.iter().map(|level| level.polygons).sum::<f64>()
    };
    let [flat, nested] = [two_groups(false), two_groups(true)];
    // from enough for both impostors to enough for all meshes
    for target_ms in (0..28).map(|k| 0.1 * 1.15_f64.powi(k)) {
        let [of_flat, of_nested] = [&flat, &nested].map(|views| {
            let mut control = bare(Policy::Adaptive, target_ms);
            (0..300).for_each(|_| frame(&mut control, views, 1.0));
            drawn(views, &control)
        });
        assert!(of_nested >= 0.95 * of_flat, "{target_ms} ms: {of_nested} triangles, without the group {of_flat}");
    }
}
