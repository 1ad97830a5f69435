//! Reads the mass properties that a rigid object is given in place of its shape's.
//!
//! In: a [`RigidFile`]. Out: a [`GivenInertia`], problems to the [`Checker`]. Never here: the mass, the shape.

use super::common::point;
use crate::check::{Checker, Place};
use crate::format::RigidFile;
use glam::{DMat3, DVec3};
use metachron_models::rigid::GivenInertia;

/// Mass properties that the file gives in place of the shape's.
pub(super) fn inertia(c: &mut Checker<'_, '_>, place: &Place, file: &RigidFile) -> Option<GivenInertia> {
    let before = c.count();
    let com_m = point(file.centre_of_mass_m);
    let Some([xx, yy, zz, xy, xz, yz]) = file.inertia_kg_m2 else {
        if file.centre_of_mass_m.is_some() {
            let expected = "expected `inertia_kg_m2` beside it: the moments about that point";
            c.wrong(place, "centre_of_mass_m", "has no moments of inertia", expected);
        }
        return None;
    };
    if file.mass_kg.is_none() {
        c.wrong(place, "inertia_kg_m2", "has no mass", "expected `mass_kg` beside it");
    }
    let about_com_kg_m2 = DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz));
    let given = GivenInertia { com_m, about_com_kg_m2 };
    if let (true, Err(why)) = (c.count() == before, given.check()) {
        let expected = "expected [xx, yy, zz, xy, xz, yz] of a body, in the axes of the object";
        c.wrong(place, "inertia_kg_m2", format_args!("cannot be had by a body: {why}"), expected);
    }
    Some(given)
}
