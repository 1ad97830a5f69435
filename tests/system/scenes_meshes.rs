//! Solids of tetrahedra and sheets of open surfaces as users write them: the files that load, the masses, the errors.

use crate::play::{Folder, number};
use glam::DVec3;
use metachron_scene::{Source, load};
use std::fmt::Write;

/// Two cubes side by side, of edge 1, groups 7 and 9, as gmsh and VTK write them.
const MSH: &[u8] = include_bytes!("../../crates/scene/src/build/tetrahedra/samples/two.4.1.msh");
const VTU: &[u8] = include_bytes!("../../crates/scene/src/build/tetrahedra/samples/zlib.vtu");
const SCALE_SCENE: &str = "[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\n\
    [[object]]\nname = \"scale\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.2, 0.2, 0.01]\nposition_m = [0, 0, 0.01]\n";

fn solid(file: &str, keys: &str) -> String {
    format!(
        "[[object]]\nname = \"s\"\nmodel = \"solid\"\nshape = \"mesh\"\nfile = \"{file}\"\nyoung_pa = 3e4\n{keys}\n"
    )
}

#[test]
fn a_solid_of_tetrahedra_lies_on_a_scale_with_the_weight_of_its_regions() {
    for (file, bytes, law) in [("s.msh", MSH, "law = \"neo-hookean\""), ("s.vtu", VTU, "law = \"ogden\"\nexponent = 6")]
    {
        let keys = format!(
            "scale = 0.05\n{law}\nposition_m = [-0.05, -0.025, 0.021]\ndensity_kg_m3 = 1000\ndamping_per_s = 3\n\
             regions = [{{ region = 9, young_pa = 9e4, density_kg_m3 = 3000 }}]"
        );
        let folder = Folder::with(&format!("{}{SCALE_SCENE}", solid(file, &keys)));
        std::fs::write(folder.file(file), bytes).unwrap();
        let report = folder.lockstep(&["--seconds", "1.5"]);
        let pair = &report["couplings"][0];
        let weight = (1000.0 + 3000.0) * 0.05_f64.powi(3) * 9.81;
        assert!((number(pair, "/force_n") / weight - 1.0).abs() < 0.02, "{pair}: {weight} N");
    }
}

/// Half a cylinder of radius 5 cm along y, its axis at the origin, open below, in millimetres.
fn vault() -> String {
    let (along, around) = (6, 10);
    let mut text = String::new();
    for (i, j) in (0..=along).flat_map(|i| (0..=around).map(move |j| (i, j))) {
        let turn = std::f64::consts::PI * f64::from(j) / f64::from(around);
        let at = DVec3::new(-50.0 * turn.cos(), 20.0 * f64::from(i), 50.0 * turn.sin());
        writeln!(text, "v {} {} {}", at.x, at.y, at.z).unwrap();
    }
    for (i, j) in (0..along).flat_map(|i| (0..around).map(move |j| (i, j))) {
        let corner = |x: i32, y: i32| (i + x) * (around + 1) + j + y + 1;
        writeln!(text, "f {} {} {} {}", corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)).unwrap();
    }
    text
}

#[test]
fn a_sheet_of_an_open_surface_stands_as_a_vault_with_its_weight() {
    let keys = "[[object]]\nname = \"vault\"\nmodel = \"sheet\"\nfile = \"vault.obj\"\nscale = 0.001\nthickness_m = 0.002\n\
        young_pa = 4e6\nfriction = 0.8\ndamping_per_s = 4\nposition_m = [0, -0.06, 0.022]\nself_contact = false\n";
    let folder = Folder::with(&format!("{keys}{SCALE_SCENE}"));
    std::fs::write(folder.file("vault.obj"), vault()).unwrap();
    let report = folder.lockstep(&["--seconds", "2"]);
    let pair = &report["couplings"][0];
    // ten chords of a half circle
    let around = 10.0 * 2.0 * 0.05 * (std::f64::consts::PI / 20.0).sin();
    let weight = around * 0.12 * 0.002 * 1050.0 * 9.81;
    assert!((number(pair, "/force_n") / weight - 1.0).abs() < 0.03, "{pair}: {weight} N");
}

#[test]
fn what_a_mesh_cannot_be_is_said_with_its_key_and_place() {
    let refused = |file: &str, bytes: &[u8], keys: &str| {
        let folder = Folder::with(&solid(file, keys));
        std::fs::write(folder.file(file), bytes).unwrap();
        let error = load(&Source::open(folder.scene()).unwrap(), &[]).expect_err("no solid");
        format!("{}; {}", error.problems[0].message, error.problems[0].expected)
    };
    let small = "scale = 0.05\n";
    assert!(refused("s.msh", MSH, &format!("{small}eps_m = 0.02")).contains("`eps_m` of `s` does not belong to s.msh"));
    let of = |region: &str| format!("{small}regions = [{{ region = {region}, young_pa = 1e4 }}]");
    let unknown = refused("s.msh", MSH, &of("8"));
    assert!(unknown.contains("is 8, which no tetrahedron has") && unknown.contains("7, 9"), "{unknown}");
    assert!(refused("s.msh", MSH, &format!("{small}exponent = 3")).contains("expected `law = \"ogden\"` beside it"));
    assert!(refused("s.msh", MSH, &format!("{small}law = \"ogden\"")).contains("`exponent` of `s` is missing"));
    let inverted = String::from_utf8(MSH.to_vec()).unwrap().replace("\n2 0 0 0 0 \n", "\n2 3 3 3 0 \n");
    let moved = inverted.replacen("\n0 0 0\n", "\n3 3 3\n", 1);
    assert!(
        refused("s.msh", moved.as_bytes(), small).contains("is inverted"),
        "{}",
        refused("s.msh", moved.as_bytes(), small)
    );
    assert!(refused("s.msh", &MSH[..2000], small).contains("the end of the file"));
    let none = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
    assert!(refused("s.msh", none.as_bytes(), small).contains("it has no tetrahedra"));
}
