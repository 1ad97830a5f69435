//! One mesh as gmsh 4.15, meshio 5.3 and VTK 9.7 write it: two cubes side by side, groups 7 and 9.

use super::*;
use proptest::prelude::*;

const SAMPLES: [(&str, &[u8]); 14] = [
    ("gmsh 2.2", include_bytes!("samples/two.2.2.msh")),
    ("gmsh 4.1", include_bytes!("samples/two.4.1.msh")),
    ("gmsh 4.1 with surfaces", include_bytes!("samples/all.4.1.msh")),
    ("legacy 4.2 text", include_bytes!("samples/vtk42.text.vtk")),
    ("legacy 4.2 binary", include_bytes!("samples/vtk42.binary.vtk")),
    ("legacy 5.1 text", include_bytes!("samples/vtk51.text.vtk")),
    ("legacy 5.1 binary", include_bytes!("samples/vtk51.binary.vtk")),
    ("meshio legacy binary", include_bytes!("samples/meshio.binary.vtk")),
    ("XML text", include_bytes!("samples/text.vtu")),
    ("XML base64", include_bytes!("samples/base64.vtu")),
    ("XML base64 zlib", include_bytes!("samples/zlib.vtu")),
    ("XML appended raw zlib", include_bytes!("samples/appended.raw.vtu")),
    ("XML appended base64 zlib", include_bytes!("samples/appended.base64.vtu")),
    ("XML big-endian", include_bytes!("samples/big.vtu")),
];

#[test]
fn every_format_gives_the_same_two_cubes() {
    let meshio: (&str, &[u8]) = ("meshio XML", include_bytes!("samples/meshio.vtu"));
    for (name, bytes) in SAMPLES.into_iter().chain([meshio]) {
        assert!(is_volume("mesh", bytes), "{name}");
        let mesh = read(bytes).unwrap_or_else(|why| panic!("{name}: {why}"));
        assert_eq!(mesh.check(), Ok(()), "{name}");
        let volume = |region: i64| -> f64 {
            (0..mesh.corners.len()).filter(|at| mesh.regions[*at] == region).map(|at| mesh.volume_m3(at)).sum()
        };
        assert_eq!((mesh.points.len(), mesh.corners.len()), (23, 48), "{name}");
        assert!((volume(7) - 1.0).abs() < 1e-12 && (volume(9) - 1.0).abs() < 1e-12, "{name}");
        assert!((mesh.surface().volume_m3() - 2.0).abs() < 1e-12, "{name}");
    }
}

#[test]
fn what_cannot_be_read_is_named_with_what_would_be() {
    let why = |bytes: &[u8]| read(bytes).unwrap_err();
    assert!(why(include_bytes!("samples/binary.msh")).contains("it is binary: expected text (Mesh.Binary = 0)"));
    assert!(why(include_bytes!("samples/lz4.vtu")).contains("vtkLZ4DataCompressor: expected vtkZLibDataCompressor"));
    let text = str::from_utf8(SAMPLES[0].1).unwrap();
    assert!(
        why(text.replace("\n2 0 0 0\n", "\n2 0 zero 0\n").as_bytes())
            .contains("line 12: expected the coordinate y of a node, found `zero`")
    );
    assert!(why(text.replace("2.2 0 8", "3 0 8").as_bytes()).contains("expected 2.2 or 4.1"));
    assert!(why(&text.as_bytes()[..text.len() - 40]).contains("the end of the file"));
    let hexahedron = text.replace(" 4 2 7 ", " 5 2 7 ");
    assert!(why(hexahedron.as_bytes()).contains("a hexahedron (5): expected tetrahedra of first order (4)"));
    let polydata = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\n";
    assert!(why(polydata.as_bytes()).contains("line 4: the data set is POLYDATA: expected UNSTRUCTURED_GRID"));
    let legacy = str::from_utf8(SAMPLES[3].1).unwrap();
    let cells = legacy.find("CELLS ").unwrap();
    let (before, after) = legacy.split_at(cells + legacy[cells..].find('\n').unwrap() + 1);
    for (count, said) in
        [("1e300", "expected a whole number"), ("-4", "expected a whole number"), ("240", "has not as many points")]
    {
        let damaged = format!("{before}{count}{}", &after[1..]);
        assert!(why(damaged.as_bytes()).contains(said), "{count}: {}", why(damaged.as_bytes()));
    }
    let xml = str::from_utf8(SAMPLES[8].1).unwrap();
    let open = &xml[..xml.find("\"connectivity\"").unwrap() + 60];
    assert!(why(open.as_bytes()).contains("it is no XML: "), "{}", why(open.as_bytes()));
    assert!(why(xml.replace("NumberOfCells=\"48\"", "NumberOfCells=\"47\"").as_bytes()).contains("cells of 47"));
    let wide = xml.replacen("Name=\"region\"", "Name=\"region\" NumberOfComponents=\"3\"", 1);
    assert!(why(wide.as_bytes()).contains("its `region` has 48 numbers, 3 a cell"), "{}", why(wide.as_bytes()));
    let huge = xml.replace("NumberOfPoints=\"23\"", "NumberOfPoints=\"99999999999\"");
    assert!(why(huge.as_bytes()).contains("it says that it has 99999999999 points"));
    assert_eq!(why(b""), "it is empty");
    assert!(why(b"hello").contains("it begins neither as a gmsh file"));
    // VTK's information about an array changes nothing
    let annotated = xml.replacen("<CellData>", "<CellData><DataArray type=\"Int8\" Name=\"more\" format=\"ascii\">1 <InformationKey name=\"a\"><Value>7</Value></InformationKey></DataArray>", 1);
    assert_eq!(read(annotated.as_bytes()).unwrap().regions, read(SAMPLES[8].1).unwrap().regions);
    let cut = &SAMPLES[6].1[..900];
    assert!(why(cut).contains("it ends within a block of"), "{}", why(cut));
}

proptest! {
    #[test]
    fn no_damaged_file_makes_a_reader_panic(which in 0..SAMPLES.len(), at in 0.0..1.0, with in prop::collection::vec(any::<u8>(), 0..6), cut in any::<bool>()) {
        let bytes = SAMPLES[which].1;
        let at = (at * bytes.len() as f64) as usize;
        let rest = if cut { &[] } else { &bytes[(at + with.len()).min(bytes.len())..] };
        let damaged = [&bytes[..at], &with, rest].concat();
        if let Ok(mesh) = read(&damaged) {
            let _ = mesh.check();
        }
    }
}
