//! Sheets and solids that touch themselves: layers lie on each other, a fingertip of matter on its palm.

use crate::bodies::{block, sheet, solid};
use crate::table::{Table, placed};
use glam::{DQuat, DVec3};
use metachron_core::{Body, Snapshot};
use metachron_geometry::{Triangles, near_triangle};
use metachron_models::soft::{Side, SoftBody, SoftMaterial, SoftShape, SoftSpec};
use std::sync::Arc;

const THICKNESS_M: f64 = 0.004;

/// A strip of sheet, nearly upright, that falls on its lower edge and folds.
fn strip(self_contact: bool) -> SoftSpec {
    let base = sheet(DVec3::ZERO, 0.2, 1);
    let shape = SoftShape::Sheet { size_m: [0.3, 0.05], thickness_m: THICKNESS_M, segments: [30, 5] };
    let rotation = DQuat::from_rotation_y(-1.45);
    let material = SoftMaterial { young_pa: 2e4, damping_per_s: 2.0, ..base.material };
    SoftSpec { shape, material, rotation, position: DVec3::new(0.0, -0.025, 0.003), self_contact, ..base }
}

fn skin(table: &Table, body: usize) -> Vec<DVec3> {
    let mut snapshot = Snapshot::default();
    table.bodies[body].agent.write_snapshot(&mut snapshot);
    let Body::Soft(soft) = snapshot.body else { panic!("it has no skin") };
    soft.positions
}

/// The least distance of a vertex of a body from its own triangles farther away at rest than `apart_m`, metres.
fn least_gap_m(now: &[DVec3], rest: &[DVec3], triangles: &[[u32; 3]], apart_m: f64) -> f64 {
    let mut least = f64::INFINITY;
    for (vertex, at) in now.iter().enumerate() {
        for corners in triangles {
            let far = corners.iter().all(|corner| rest[*corner as usize].distance(rest[vertex]) > apart_m);
            if far {
                let places = corners.map(|corner| now[corner as usize]);
                least = least.min(near_triangle(*at, places).distance(*at));
            }
        }
    }
    least
}

#[test]
fn a_strip_that_folds_lies_on_itself_in_layers() {
    let lattice = |spec: &SoftSpec| {
        let body = SoftBody::new(spec.clone()).unwrap();
        let form = metachron_contact::Agent::form(&body).unwrap();
        let metachron_geometry::ShapeKind::Surface(surface) = &form.kind else { panic!() };
        let Body::Soft(start) = body.start() else { panic!() };
        (start.positions, surface.triangles.to_vec())
    };
    let mut found = vec![];
    for touches_itself in [true, false] {
        let spec = strip(touches_itself);
        let (rest, triangles) = lattice(&spec);
        let mut table = Table::new(vec![placed(SoftBody::new(spec).unwrap(), false)]).at_rates(480.0, 480.0);
        let findings = table.play(1.2);
        found.push((least_gap_m(&skin(&table, 0), &rest, &triangles, 0.04), findings));
    }
    let [(own_m, findings), (through_m, _)] = found[..] else { panic!() };
    assert!(own_m > 0.95 * THICKNESS_M, "layers are {own_m} m apart");
    assert!(findings.rest_m < 0.2e-3 && (findings.weight - 1.0).abs() < 0.01, "{findings:?}");
    // without contact of its own it goes through itself
    assert!(through_m < 0.5 * THICKNESS_M, "{through_m}");
}

/// A horseshoe of matter, its lower leg held, in a cage: a plate presses its legs together. Its slot is wider than the edges of its skin:
/// places nearer than one at rest count as one.
#[test]
fn the_legs_of_a_horseshoe_meet_and_bear() {
    let surface = slotted();
    let base = solid(DVec3::ZERO, DVec3::ONE, [1; 3], 3e4);
    let material = SoftMaterial { damping_per_s: 5.0, ..base.material };
    let shape = SoftShape::Embedded { surface: Arc::new(surface.clone()), eps_m: 0.01, range_m: (0.01, 0.01) };
    let held = vec![Side::Bottom];
    let spec = SoftSpec { shape, material, position: DVec3::new(0.0, -0.02, 0.0), held, self_contact: true, ..base };
    let rest = surface.points.clone();
    let plate = block(DVec3::new(0.09, 0.0, 0.076), DVec3::new(0.03, 0.03, 0.005), 0.1, 0.0);
    let mut table = Table::new(vec![placed(SoftBody::new(spec).unwrap(), true), plate]).at_rates(480.0, 480.0);
    let findings = table.play(1.0);
    assert!(findings.rest_m < 0.05e-3, "{} m deep", findings.rest_m);
    // the legs touch: the slot of 2 cm is closed at its mouth, and none has gone through the other
    let now = skin(&table, 0);
    let mouth = |upper: bool| {
        let at = if upper { 0.05 } else { 0.03 };
        let of = |point: &DVec3| (point.z - at).abs() < 1e-9 && (point.x - 0.12).abs() < 1e-9;
        let heights: Vec<f64> = rest.iter().zip(&now).filter(|(rest, _)| of(rest)).map(|(_, now)| now.z).collect();
        heights.iter().sum::<f64>() / heights.len() as f64
    };
    let gap_m = mouth(true) - mouth(false);
    assert!(gap_m.abs() < 0.3e-3, "the mouth is {gap_m} m wide");
}

/// The boundary of the cells of 1 cm of a block of 12 × 4 × 7 but for a slot in its middle, open at its right.
fn slotted() -> Triangles {
    let whole = |cell: [i32; 3]| {
        let inside = (0..12).contains(&cell[0]) && (0..4).contains(&cell[1]) && (0..7).contains(&cell[2]);
        inside && !((3..5).contains(&cell[2]) && cell[0] >= 2)
    };
    let mut surface = Triangles { points: vec![], triangles: vec![] };
    let mut known = std::collections::BTreeMap::new();
    for cell in
        (0..12).flat_map(|i| (0..4).flat_map(move |j| (0..7).map(move |k| [i, j, k]))).filter(|cell| whole(*cell))
    {
        for axis in 0..3 {
            for side in [0, 1] {
                let mut beside = cell;
                beside[axis] += 2 * side - 1;
                if whole(beside) {
                    continue;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let corner = |du: i32, dv: i32| {
                    let mut at = cell;
                    (at[axis], at[u], at[v]) = (at[axis] + side, at[u] + du, at[v] + dv);
                    at
                };
                let mut quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                if side == 0 {
                    quad.reverse();
                }
                let quad = quad.map(|at| {
                    *known.entry(at).or_insert_with(|| {
                        surface.points.push(DVec3::from_array(at.map(f64::from)) * 0.01);
                        surface.points.len() as u32 - 1
                    })
                });
                surface.triangles.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
            }
        }
    }
    surface
}
