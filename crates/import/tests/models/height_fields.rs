//! Height fields of MJCF models.

use crate::play::{advance, centre, left_out, read_from, start};
use image::{DynamicImage, GrayImage, ImageBuffer, ImageFormat, Luma, Rgb, RgbImage};
use metachron_import::{Imported, mjcf};
use std::path::Path;

/// Two balls over a ground that a height field of this element makes at z = 1 m, at y = −0.7 m and 0.7 m.
fn on_ground(field: &str) -> String {
    let ball = |name: &str, y: f64| {
        format!(r#"<body name="{name}" pos="0.3 {y} 1.7"><freejoint/><geom size="0.1" density="1000"/></body>"#)
    };
    format!(
        r#"<mujoco><asset><hfield name="hill" {field} size="2 1 0.5 0.1"/></asset>
        <worldbody><geom type="hfield" hfield="hill" pos="0 0 1"/>{}{}</worldbody></mujoco>"#,
        ball("near", -0.7),
        ball("far", 0.7)
    )
}

/// The heights at which both balls rest.
fn rests(imported: &Imported) -> [f64; 2] {
    assert_eq!(left_out(imported), [""; 0]);
    let world = start(imported, &[], 500.0);
    advance(&world, 2.0);
    ["near", "far"].map(|name| centre(&world, name).z)
}

#[test]
fn balls_rest_on_the_heights_of_a_field_as_they_do_in_mujoco() {
    // MuJoCo's first row is that of the largest y, heights are from 0 to 1 (mj_ray of 4.0.0 on such a field)
    let here = on_ground(r#"nrow="4" ncol="3" elevation="7 7 7 7 7 7 3 3 3 3 3 3""#);
    let even = on_ground(r#"nrow="3" ncol="3""#);
    for (text, wanted) in [(here, [1.1, 1.6]), (even, [1.1, 1.1])] {
        let found = rests(&mjcf(&text, Path::new(".")).unwrap());
        assert!(found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-3), "{found:?}, {wanted:?}");
    }
}

#[test]
fn heights_of_a_png_are_its_grey_values_from_the_largest_y_as_in_mujoco() {
    // as `hfield_data` of 4.0.0: of colours the red counts, of 16 bits the highest 8, whatever the name of the file
    let folder = tempfile::tempdir().unwrap();
    let grey = |row: u32| if row < 2 { 200 } else { 40 };
    let wide = |row: u32| if row < 2 { 0x2800_u16 } else { 0x28ff };
    let pictures = [
        DynamicImage::from(GrayImage::from_fn(2, 4, |_, row| Luma([grey(row)]))),
        DynamicImage::from(RgbImage::from_fn(2, 4, |_, row| Rgb([grey(row), 255 - grey(row), 0]))),
        DynamicImage::from(ImageBuffer::from_fn(2, 4, |_, row| Luma([wide(row)]))),
    ];
    for (picture, wanted) in pictures.into_iter().zip([[1.1, 1.6], [1.1, 1.6], [1.1, 1.1]]) {
        picture.save_with_format(folder.path().join("hill"), ImageFormat::Png).unwrap();
        let found =
            rests(&mjcf(&on_ground(r#"file="hill" content_type="image/png""#), read_from(folder.path())).unwrap());
        assert!(found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-3), "{found:?}, {wanted:?}");
    }
}

#[test]
fn ground_on_a_body_that_moves_is_listed_at_its_element() {
    let geoms = r#"<geom type="hfield" hfield="hill"/><geom type="plane" size="1 1 1"/>"#;
    let text = |body: &str| {
        on_ground(r#"nrow="2" ncol="2" elevation="1 2 3 4""#).replace("</worldbody>", &format!("{body}</worldbody>"))
    };
    let moving = text(&format!(r#"<body name="sled"><freejoint/><geom size="0.1"/>{geoms}</body>"#));
    let listed = left_out(&mjcf(&moving, Path::new(".")).unwrap());
    let why = "line 2: body `sled`, geom: is left out: its body moves, and ground of a scene never does";
    assert_eq!(listed, [why; 2]);
    let still = text(&format!(r#"<body name="rock" pos="0 0 -5">{geoms}</body>"#));
    assert_eq!(left_out(&mjcf(&still, Path::new(".")).unwrap()), [""; 0]);
}

#[test]
fn heights_of_a_file_go_from_the_smallest_y_and_bad_ones_are_errors_at_their_element() {
    let folder = tempfile::tempdir().unwrap();
    let heights = [3.0_f32, 3.0, 3.0, 3.0, 7.0, 7.0, 7.0, 7.0];
    let counts = [4_i32, 2].map(i32::to_le_bytes);
    let bytes: Vec<u8> = counts.into_iter().chain(heights.map(f32::to_le_bytes)).flatten().collect();
    std::fs::write(folder.path().join("hill.bin"), &bytes).unwrap();
    std::fs::write(folder.path().join("short.bin"), &bytes[..20]).unwrap();
    let read = |field: &str| mjcf(&on_ground(field), read_from(folder.path()));
    let found = rests(&read(r#"file="hill.bin""#).unwrap());
    assert!((found[0] - 1.1).abs() < 1e-3 && (found[1] - 1.6).abs() < 1e-3, "{found:?}");
    let short = left_out(&read(r#"file="short.bin""#).unwrap());
    assert!(short[0].ends_with("is left out: `short.bin`: it has 4 rows and 2 columns in 20 bytes; expected two of each or more, and 4 bytes for each height after the first 8"), "{short:?}");
    for (field, why) in [
        (r#"nrow="1" ncol="3""#, "`nrow` is 1; expected a whole number, 2 to 400000"),
        (r#"nrow="2" ncol="2" elevation="1 2 3""#, "`elevation` has 3 numbers; expected 4"),
        (
            r#"nrow="9999" ncol="9999""#,
            "it has 9999 rows and 9999 columns, 200079990 triangles; expected at most 1000000",
        ),
        (
            r#"nrow="2" ncol="2" elevation="0 1e308 -1e308 3""#,
            "its heights are from -1e308 to 1e308; expected finite ones",
        ),
        (r#"file="none.png""#, "names `none.png`, and there is no such file; expected it beside the model"),
        (
            r#"nrow="2" ncol="2" size="1 1 1 1"/><hfield nrow="2" ncol="2" name="hill""#,
            "is the second hfield that is called `hill`; expected names of one each",
        ),
    ] {
        let refused = read(field).unwrap_err().to_string();
        assert!(refused.ends_with(why), "{refused}");
    }
}
