//! Cells removed while a solid runs: the rest and the removed cells are together the whole.

use super::*;
use crate::soft::NodeSpacing;
use metachron_contact::Carving;
use metachron_core::Archive;

/// A ball in a cage, a box of cells and one of tetrahedra.
fn solids() -> Vec<SoftShape> {
    let surface = Arc::new(SoftShape::Ball { radius_m: 0.1, segments: 12 }.skin().unwrap());
    let ball = SoftShape::Embedded { surface, eps_m: 0.04, range_m: (0.02, 0.08) };
    vec![ball, SoftShape::Box { size_m: DVec3::new(0.2, 0.1, 0.1), segments: [6, 3, 3] }, tetrahedral()]
}

/// A column of ten cells nearest to a line through the middle along y.
fn column(body: &SoftBody) -> Vec<usize> {
    let middle = body.positions.iter().sum::<DVec3>() / body.positions.len() as f64;
    let off = |cell: usize| {
        let to = body.cell_middle(cell).unwrap() - middle - DVec3::new(0.03, 0.0, 0.03);
        DVec3::new(to.x, 0.2 * to.y, to.z).length()
    };
    let mut all: Vec<usize> = (0..body.cells()).collect();
    all.sort_by(|a, b| off(*a).total_cmp(&off(*b)));
    all.truncate(10);
    all
}

/// A sheet, one of any shape, and one with an ε coarser than its skin.
fn sheets() -> Vec<SoftSpec> {
    let fine = SoftShape::Sheet { size_m: [0.3, 0.2], thickness_m: 0.002, segments: [18, 12] };
    let spaced = SoftSpec { nodes: Some(NodeSpacing { eps_m: 0.04, range_m: (0.01, 0.1) }), ..spec(fine) };
    vec![spec(SHEET), spec(shell()), spaced]
}

#[test]
fn mass_and_momentum_are_what_is_left_and_what_went() {
    for spec in solids().into_iter().map(spec).chain(sheets()) {
        let mut body = shaken(spec);
        run(&mut body, 0.002, 5);
        let (mass, momentum, cells, triangles) =
            (body.mass_kg(), body.linear_momentum(), body.cells(), body.form().unwrap());
        let gone = body.remove_cells(&column(&body)).unwrap();
        assert_eq!(body.cells(), cells - 10);
        assert!((body.mass_kg() + gone.mass_kg - mass).abs() < 1e-14 * mass, "{gone:?}");
        assert!(
            (body.linear_momentum() + gone.momentum - momentum).length() < 1e-13 * momentum.length().max(0.1),
            "{gone:?}"
        );
        assert!(gone.mass_kg > 0.0, "{:?} {gone:?}", triangles.kind);
        // it goes on as any other: momentum is kept, energy never rises
        let (momentum, mut energy_j) = (body.linear_momentum(), body.energy_j());
        for _ in 0..100 {
            run(&mut body, 0.002, 1);
            assert!(body.energy_j() <= energy_j * (1.0 + 1e-7), "{} {energy_j}", body.energy_j());
            energy_j = body.energy_j();
        }
        assert!((body.linear_momentum() - momentum).length() < 1e-10 * momentum.length());
        assert!(state(&body).positions.iter().all(|at| at.is_finite()));
    }
}

#[test]
fn a_bar_without_half_of_its_cells_hangs_as_much_longer_as_a_thinner_one() {
    // eight layers along x, of 2 × 2 cells: without those at one side of y a bar of half the section and half the weight
    let size_m = DVec3::new(0.4, 0.1, 0.1);
    let material = SoftMaterial { poisson: 0.0, young_pa: 1e5, damping_per_s: 20.0, ..MATERIAL };
    let longer = |shape: SoftShape, cut: bool| {
        let spec = SoftSpec { material, gravity: DVec3::X * 9.81, held: vec![Side::Left], ..spec(shape) };
        let mut body = SoftBody::new(spec).unwrap();
        if cut {
            let upper: Vec<usize> =
                (0..body.cells()).filter(|cell| body.cell_middle(*cell).unwrap().y > 0.05).collect();
            body.remove_cells(&upper).unwrap();
        }
        run(&mut body, 0.02, 300);
        state(&body).positions.iter().map(|at| at.x).fold(0.0, f64::max) - size_m.x
    };
    let whole = longer(SoftShape::Box { size_m, segments: [8, 2, 2] }, false);
    let left = longer(SoftShape::Box { size_m, segments: [8, 2, 2] }, true);
    let thin = longer(SoftShape::Box { size_m: DVec3::new(0.4, 0.05, 0.1), segments: [8, 1, 2] }, false);
    assert!((left / thin - 1.0).abs() < 1e-9 && (left / whole - 1.0).abs() < 0.01, "{left} {thin} {whole}");
}

#[test]
fn a_sheet_without_half_of_its_triangles_sags_as_a_narrower_one() {
    let sheet = |across_m: f64, segments: u32| SoftShape::Sheet {
        size_m: [0.3, across_m],
        thickness_m: 0.002,
        segments: [8, segments],
    };
    let material = SoftMaterial { young_pa: 5e6, damping_per_s: 5.0, ..MATERIAL };
    let sagged = |shape: SoftShape, cut: bool| {
        let spec = SoftSpec { material, gravity: G, held: vec![Side::Left], ..spec(shape) };
        let mut body = SoftBody::new(spec).unwrap();
        if cut {
            let outer = Carving { from_m: DVec3::new(-1.0, 0.2, 0.0), to_m: DVec3::new(1.0, 0.2, 0.0), radius_m: 0.1 };
            assert_eq!(body.carve(&outer).unwrap().cells, 32);
        }
        run(&mut body, 0.02, 50);
        state(&body).positions.iter().map(|at| at.z).fold(0.0, f64::min)
    };
    let (left, thin) = (sagged(sheet(0.2, 4), true), sagged(sheet(0.1, 2), false));
    assert!(thin < -0.01 && (left / thin - 1.0).abs() < 1e-9, "{left} {thin}");
}

#[test]
fn a_body_that_lost_cells_is_read_back_and_goes_on_to_the_bit() {
    for spec in solids().into_iter().map(spec).chain(sheets()) {
        let mut body = shaken(spec.clone());
        run(&mut body, 0.002, 3);
        for _ in 0..2 {
            body.remove_cells(&column(&body)[..5]).unwrap();
            run(&mut body, 0.002, 3);
        }
        let mut archive = Archive::writer();
        body.archive(&mut archive).unwrap();
        let bytes = archive.into_bytes();
        let mut other = SoftBody::new(spec).unwrap();
        let whole = other.form().unwrap();
        for _ in 0..2 {
            other.archive(&mut Archive::reader(&bytes)).unwrap();
            other.follow();
            run(&mut other, 0.002, 3);
        }
        other.archive(&mut Archive::reader(&bytes)).unwrap();
        [&mut body, &mut other].into_iter().for_each(|body| run(body, 0.002, 20));
        assert!(state(&body).positions == state(&other).positions, "{}", body.model());
        assert_eq!((body.mass_kg(), body.removed), (other.mass_kg(), other.removed));
        let triangles = |form: &metachron_geometry::CollisionShape| match &form.kind {
            ShapeKind::Surface(skin) => skin.triangles.clone(),
            _ => panic!("a skin"),
        };
        assert_eq!(triangles(&body.form), triangles(&other.form));
        assert_ne!(triangles(&whole), triangles(&other.form));
    }
}

#[test]
fn what_is_cut_in_two_parts_falls_apart_and_is_where_its_parts_are() {
    // a free beam that turns about its middle: without the cells there both halves go their ways
    let mut body =
        SoftBody::new(spec(SoftShape::Box { size_m: DVec3::new(0.3, 0.1, 0.1), segments: [6, 2, 2] })).unwrap();
    let middle = DVec3::new(0.15, 0.05, 0.05);
    body.velocities.iter_mut().zip(&body.positions).for_each(|(v, x)| *v = (*x - middle) * 4.0);
    let gone = body.carve(&Carving { from_m: middle, to_m: middle, radius_m: 0.06 }).unwrap();
    assert_eq!(gone.cells, 8);
    // 4 of its sides were seen, each 2 × 2 squares; the two that are seen now have as many each
    assert_eq!(gone.triangles, 2 * (4 - 2) * 4);
    assert!((gone.mass_kg - 0.1 * 0.1 * 0.1 * MATERIAL.density_kg_m3).abs() < 1e-12 && gone.momentum.length() < 1e-14);
    run(&mut body, 0.005, 100);
    let bounds = body.bounds();
    assert!(bounds.low.x < -0.05 && bounds.high.x > 0.35, "{bounds:?}");
    let beside = Carving { from_m: DVec3::splat(9.0), to_m: DVec3::splat(9.0), radius_m: 1.0 };
    assert_eq!((body.carve(&beside), body.removed), (None, gone));
}

#[test]
fn the_skin_loses_the_triangles_of_the_cells_and_closes_over_what_was_inside() {
    let [ball, block, mesh] = <[SoftShape; 3]>::try_from(solids()).unwrap();
    for (shape, is_closed) in [(ball, false), (block, true), (mesh, true)] {
        let mut body = SoftBody::new(spec(shape)).unwrap();
        // the cell farthest along x is at the skin
        let along = |cell: &usize| body.cell_middle(*cell).unwrap().x;
        let last = (0..body.cells()).max_by(|a, b| along(a).total_cmp(&along(b))).unwrap();
        let before = body.skin_triangles() as i32;
        let gone = body.remove_cells(&[last]).unwrap();
        assert_eq!(gone.triangles, before - body.skin_triangles() as i32);
        let form = body.form().unwrap();
        let ShapeKind::Surface(skin) = &form.kind else { panic!("a skin") };
        let surface = Triangles { points: state(&body).positions, triangles: skin.triangles.to_vec() };
        assert_eq!(metachron_geometry::is_closed(&surface), is_closed);
        let volume = body.mass_kg() / MATERIAL.density_kg_m3;
        if is_closed && body.spec.shape.model() == "solid" && body.mesh.laws.is_empty() {
            assert!((surface.volume_m3() / volume - 1.0).abs() < 1e-12, "{} {volume}", surface.volume_m3());
        }
        assert!(is_closed || gone.triangles > 0);
    }
}

#[test]
fn a_number_without_a_cell_and_all_cells_are_refused_and_nothing_changes() {
    let mut body = SoftBody::new(spec(solid())).unwrap();
    let cells = body.cells();
    let why = |result: Result<_, SoftError>| result.map(|_| ()).unwrap_err().to_string();
    assert_eq!(why(body.remove_cells(&[0, cells])), format!("there is no cell {cells}: the body has {cells}"));
    assert_eq!(why(body.remove_cells(&(0..cells).collect::<Vec<_>>())), "no cell would be left");
    assert_eq!(body.cells(), cells);
}
