//! The column along the key light whose depths the shadow map holds.
//!
//! In: the box of a picture that the light falls on. Out: the column, and whether an object in it may throw a shadow. Never here: texels,
//! the GPU.

use super::environment::EnvironmentLight;
use super::picture::Picture;
use glam::DVec3;

/// Range of the shadow's depths towards the light and away from it, in radii of the focus: tool shafts are tall.
pub const REACH: (f64, f64) = (2.5, 1.5);

/// Fraction of its width by which the column may be moved to whole texels of any map.
const SNAP_SHARE: f64 = 0.01;

/// A square column along the light, around everything near the camera's target.
#[derive(Debug, Clone, Copy)]
pub struct LightColumn {
    /// Direction towards the light; normal to both sides.
    pub light: DVec3,
    /// One side of the square.
    pub right: DVec3,
    /// The other one.
    pub up: DVec3,
    /// The centre in world axes, metres: across the light that of the objects that cast, along the light that of the ball the light is
    /// fitted to.
    pub middle: DVec3,
    /// Half its width, metres.
    pub half_m: f64,
    /// Distance from the middle to its ends towards the light and away from it, metres.
    pub reach_m: (f64, f64),
}

impl LightColumn {
    /// The column of a picture.
    pub fn of(picture: &Picture) -> Self {
        let light = EnvironmentLight::of(picture.environment).toward;
        let right = DVec3::Z.cross(light).normalize_or(DVec3::X);
        let up = light.cross(right);
        let (low, high) = picture.shadowed_m;
        let (centre, extents) = (0.5 * (low + high), 0.5 * (high - low));
        let half = extents.dot(right.abs()).max(extents.dot(up.abs()));
        Self {
            light,
            right,
            up,
            middle: centre + light * (picture.focus_m - centre).dot(light),
            // in steps of a tenth, so that shadow edges do not crawl with every move
            half_m: 1.1_f64.powf((half.max(1e-3).ln() / 1.1_f64.ln()).ceil()),
            reach_m: (REACH.0 * picture.focus_radius_m, REACH.1 * picture.focus_radius_m),
        }
    }

    /// Whether any part of a ball may be in the column: nothing outside throws a shadow that is drawn.
    pub fn holds(&self, centre_m: DVec3, radius_m: f64) -> bool {
        let from = centre_m - self.middle;
        let half = self.half_m * (1.0 + SNAP_SHARE) + radius_m;
        let along = from.dot(self.light);
        from.dot(self.right).abs() <= half
            && from.dot(self.up).abs() <= half
            && along <= self.reach_m.0 + radius_m
            && -along <= self.reach_m.1 + radius_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_light_column_contains_occluders_and_excludes_objects_beside_it() {
        let picture = Picture {
            focus_m: DVec3::new(3.0, -1.0, 0.4),
            focus_radius_m: 0.7,
            shadowed_m: (DVec3::new(2.7, -1.2, 0.3), DVec3::new(3.3, -0.8, 0.5)),
            ..Picture::default()
        };
        let column = LightColumn::of(&picture);
        let at = |along: f64, across: f64| picture.focus_m + column.light * along + column.up * across;
        assert!(column.holds(at(0.0, 0.0), 0.01) && column.holds(at(1.7, 0.0), 0.01));
        assert!(!column.holds(at(2.0, 0.0), 0.01) && !column.holds(at(0.0, 0.8), 0.01));
        assert!(column.holds(at(2.0, 0.0), 0.3) && column.holds(at(0.0, 0.8), 0.5));
        for corner in [picture.shadowed_m.0, picture.shadowed_m.1] {
            assert!(column.holds(corner, 0.0));
        }
    }
}
