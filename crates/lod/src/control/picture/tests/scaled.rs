//! Pictures of which pixels and shadows are taken, and light that throws none, on a machine that is exactly as fast as its prices.

use super::policies::{control, mesh};
use super::*;

/// A backdrop of 720p with solids of its own.
fn backdrop(scale: f64) -> Backdrop {
    let pixels = 921_600.0;
    Backdrop { pixels: scale * scale * pixels, enlarged: if scale < 1.0 { pixels } else { 0.0 }, triangles: 8000.0 }
}

/// Draws a frame with `beside` of logic that drawing hides.
fn frame(control: &mut PictureControl, views: &[ObjectView], beside: Duration) {
    let backdrop = backdrop(control.render_scale());
    control.set_backdrop(backdrop);
    let prices = control.prices().with_shadows(control.shadows());
    let levels = &control.plan(views).levels;
    let work = Duration::from_secs_f64(prices.backdrop_s(backdrop) + prices.objects_s(views.iter(), levels));
    control.observe(FrameWork { work, draw: work, beside, skip: false });
}

#[test]
fn a_frame_is_compared_with_the_prices_that_it_was_drawn_by_when_shadows_are_taken_after_it() {
    // 14.1 ms of objects at their coarsest are late for 60 Hz without shadows only
    let views: Vec<_> = (0..1500).map(|i| mesh(i, 100.0, 400)).collect();
    let mut control = control(Policy::Greedy, 60.0);
    control.set_render_scale((0.35, 1.0));
    let mut shadowed = Vec::new();
    for at in 0..120 {
        shadowed.push(control.shadows());
        frame(&mut control, &views, Duration::from_millis(4));
        // the miss of a price that is too low looks like logic that drawing does not hide
        let lost_s = control.logic.lost_s(16e-3);
        assert!(lost_s < 1e-6, "frame {at}: {lost_s}");
    }
    assert!(shadowed[0] && shadowed.contains(&false), "shadows are taken");
}

#[test]
fn a_backdrop_without_shadows_is_drawn_once_and_is_no_logic_beside_the_drawing() {
    let views: Vec<_> = (0..40).map(|i| mesh(i, 1e4, 4000)).collect();
    let mut control = control(Policy::Greedy, 60.0);
    control.set_throws_shadows(false);
    (0..60).for_each(|_| frame(&mut control, &views, Duration::from_millis(4)));
    let lost_s = control.logic.lost_s(16e-3);
    assert!(lost_s < 1e-6, "{lost_s}");
}

#[test]
fn frames_in_time_that_take_from_a_reserve_are_not_called_late() {
    // 12.5 ms at the coarsest, of 16.7 and of 10
    let views: Vec<_> = (0..400).map(|i| mesh(i, 100.0, 400)).collect();
    let mut control = control(Policy::Adaptive, 60.0);
    control.set_reserve(6e-3);
    (0..60).for_each(|_| frame(&mut control, &views, Duration::ZERO));
    assert_eq!(control.status(), Status::Reserved);
    control.set_target_hz(100.0);
    (0..60).for_each(|_| frame(&mut control, &views, Duration::ZERO));
    assert_eq!(control.status(), Status::Clamped(Bound::Coarsest));
}
