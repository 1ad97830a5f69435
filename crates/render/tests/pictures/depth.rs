//! Depths of drawn objects.

use crate::adapter::gpu;
use glam::DVec3;
use metachron_core::{AgentId, Body, RigidState, SimTime, Snapshot};
use metachron_geometry::Solid;
use metachron_render::{
    Actor, Appearance, Camera, Colouring, Form, Level, Material, Offscreen, RendererOptions, SceneView, Size, States,
    Style,
};
use std::sync::Arc;

const SIZE: Size = Size { width: 65, height: 49 };

#[test]
fn the_depth_of_a_ball_is_its_distance_and_beside_it_is_nothing() {
    let Some(gpu) = gpu() else { return };
    let appearance = Appearance { colour: [200; 3], material: Material::Plastic };
    let form = Form::Solid(Solid::Ball { radius_m: 0.2 });
    let mut view = SceneView::new(vec![Actor { id: AgentId(0), form, appearance }], vec![]);
    let state = Snapshot { body: Body::Rigid(RigidState::default()), ..Snapshot::default() };
    view.set_snapshot(AgentId(0), &Arc::new(state), true);
    view.pose(SimTime::ZERO, States::Latest);
    let camera = Camera::looking(DVec3::new(0.0, -2.0, 0.0), DVec3::ZERO, 0.5);
    view.survey(&camera, SIZE);
    let style = Style { colouring: Colouring::Depth, ..Style::default() };
    let levels: [Level; 1] = [metachron_core::Resolution { eps_m: 1.0, n: 5 }.into()];
    let picture = view.compose(&camera, &levels, style, None);
    let mut screen = Offscreen::new(gpu, SIZE, RendererOptions::STILL).expect("a small target");
    let depths = screen.depths(picture, &camera).expect("depths");
    let middle = depths.depths_m[(SIZE.width * (SIZE.height / 2) + SIZE.width / 2) as usize];
    // a ball of 12 · 32² triangles is flatter than a ball by less than a thousandth of its radius
    assert!((middle - 1.8).abs() < 1e-3, "{middle} m");
    assert!(depths.depths_m[0].is_infinite());
    // shown, nearer is lighter than the target, which is middle grey
    screen.render(picture, &camera).expect("a picture");
    let shown = screen.read_back().expect("pixels");
    let [near, nothing] = [(SIZE.width / 2, SIZE.height / 2), (0, 0)].map(|(x, y)| shown.get_pixel(x, y).0[0]);
    let expected = 255.0 * (2.0 / 1.8) / (1.0 + 2.0 / 1.8);
    assert!((f64::from(near) - expected).abs() <= 1.0 && nothing == 0, "{near} of {expected}, {nothing}");
}
