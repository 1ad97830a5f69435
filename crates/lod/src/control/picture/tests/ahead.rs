//! Choosing for the next frame while this one is drawn.

use super::*;

/// Meshes of which the ones from `first` on are in view.
fn meshes(first: u32) -> Vec<ObjectView> {
    let kind = Kind::Counted { radius_m: 0.1, least: 20, most: 40_000 };
    let range = ResolutionRange { eps_m: (1.0, 1.0), n: (0, 6) };
    let shading = (Shading::Flat, Shading::PerPixel);
    (0..6).map(|id| ObjectView { shading, visible: id >= first, ..object(id, kind, range) }).collect()
}

/// The time of the plan, seconds, on a machine on which objects take 1.5 times their price and the backdrop takes its
/// price.
fn took_s(control: &PictureControl, objects: &[ObjectView]) -> f64 {
    let prices = control.prices();
    1.5 * prices.objects_s(objects.iter(), &control.last_plan().levels) + prices.backdrop_s(Backdrop::default())
}

#[test]
fn a_choice_made_ahead_is_drawn_in_the_next_frame() {
    let mut control = PictureControl::new(Policy::Adaptive, Law::CORRECTED, 60.0);
    let objects = meshes(0);
    assert!(!control.take_up(&objects), "nothing was chosen yet");
    let first = control.plan(&objects).clone();
    control.plan_ahead(&objects);
    assert_eq!(*control.last_plan(), first, "this frame is drawn as it was chosen");
    assert!(control.take_up(&objects) && !control.take_up(&objects), "once");
    control.plan_ahead(&objects);
    assert!(!control.take_up(&objects[..4]), "for others nothing was chosen");
    control.plan_ahead(&objects);
    control.set_policy(Policy::Greedy);
    assert!(!control.take_up(&objects), "another policy chooses for itself");
}

#[test]
fn an_object_that_comes_into_view_is_drawn_coarsely_and_prices_are_learnt_from_the_choice() {
    let mut control = PictureControl::new(Policy::Adaptive, Law::CORRECTED, 60.0);
    let (all, late) = (meshes(0), meshes(2));
    control.plan(&late);
    for frame in 0..90 {
        // two of six come into view and go again, each time between the choice and the picture
        let (before, now) = if frame % 2 == 0 { (&late, &all) } else { (&all, &late) };
        control.plan_ahead(before);
        assert!(control.take_up(now));
        if frame % 2 == 0 {
            let new = control.last_plan().levels[0];
            assert_eq!((new.polygons, new.shading), (20.0, Shading::Flat));
            assert!(control.last_plan().levels[2].polygons > 20.0);
        }
        let took = took_s(&control, now);
        if frame >= 60 {
            let predicted = control.last_plan().promise.predicted_s;
            assert!((predicted / took - 1.0).abs() < 0.05, "frame {frame}: {predicted} of {took}");
        }
        control.observe(frame_work(Duration::from_secs_f64(took), false));
    }
    let slowness = control.last_plan().promise.predicted_s / took_s(&control, &late);
    assert!((slowness - 1.0).abs() < 0.05, "{slowness}");
}
