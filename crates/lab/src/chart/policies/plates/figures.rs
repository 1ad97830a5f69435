//! The papers' figures of pictures, as data: scene, place, policies and limits of each.

use super::super::played::still::{Above, Approach, Sight};
use metachron_lod::control::Policy;
use metachron_lod::control::Policy::{Adaptive, Full, Greedy, Hierarchical, RobinHood, Static, Threshold};
use metachron_scene::papers::{Choices, Paper};

/// A figure of a paper: pictures side by side.
#[derive(Debug)]
pub(super) struct Plate {
    /// Its name for `--only`.
    pub(super) name: &'static str,
    pub(super) title: &'static str,
    pub(super) paper: Paper,
    pub(super) choices: Choices,
    /// Changes to the scene, for all panels.
    pub(super) changes: Changes,
    /// The part of the path that leads to the place; frames in full and in the quick run.
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) frames: [usize; 2],
    pub(super) panels: &'static [Panel],
    /// The pictures of each panel, from top to bottom.
    pub(super) sights: &'static [Sight],
}

/// Keys of a scene and their values.
pub(super) type Changes = &'static [(&'static str, &'static str)];

/// One column of a figure.
#[derive(Debug)]
pub(super) struct Panel {
    pub(super) label: &'static str,
    pub(super) policy: Policy,
    pub(super) limit: Limit,
    pub(super) changes: Changes,
    /// Polygons that the paper says of it.
    pub(super) polygons: Option<u32>,
}

/// The target time of a frame.
#[derive(Debug, Clone, Copy)]
pub(super) enum Limit {
    /// Time of full detail at the same place over the target: on the declared machine, and on the present adapter, whose frames have a
    /// larger part that no choice shortens.
    TimesOver([f64; 2]),
    /// So many triangles, where triangles are all that costs.
    Triangles(f64),
}

/// A walk without zigzag among 600 trees.
const PLAIN: Choices = Choices { seed: 1, trees: 600, zigzag: false, prefix: false };
/// Trees without levels (RH05, §7.1).
const WHOLE_TREES: Choices = Choices { prefix: true, ..PLAIN };
/// View A of (FS93, fig. 6), on the way to it nothing matters.
const VIEW_A: f64 = 40.0 / 250.0;
/// A frame costs a microsecond a triangle and nothing else: the cost of (MB97, §8) depends on the impostors alone.
const TRIANGLES_COST: Changes = &[
    ("machine.draw_setup_ms", "0.0"),
    ("machine.draw_pixel_ns", "0.0"),
    ("machine.draw_object_us", "0.0"),
    ("machine.draw_triangle_us", "1.0"),
    ("machine.shading.flat.triangle_us", "1.0"),
    ("machine.shading.flat.pixel_ns", "0.0"),
    ("machine.shading.gouraud.triangle_us", "1.0"),
    ("machine.shading.gouraud.pixel_ns", "0.0"),
    ("machine.choose_object_ns", "0.0"),
    ("machine.noise", "0.0"),
    ("machine.wander", "0.0"),
];
/// Objects may be left out: the null impostor of (MB97, §8).
const NULL: Changes = &[("target.may_vanish", "true")];

const fn panel(label: &'static str, policy: Policy, times_over: f64) -> Panel {
    Panel { label, policy, limit: Limit::TimesOver([times_over; 2]), changes: &[], polygons: None }
}

impl Panel {
    const fn live(self, times_over: f64) -> Self {
        let limit = match self.limit {
            Limit::TimesOver([declared, _]) => Limit::TimesOver([declared, times_over]),
            other => other,
        };
        Self { limit, ..self }
    }

    const fn polygons(self, polygons: u32) -> Self {
        Self { polygons: Some(polygons), ..self }
    }

    const fn with(self, changes: Changes) -> Self {
        Self { changes, ..self }
    }

    const fn triangles(self, triangles: f64) -> Self {
        Self { limit: Limit::Triangles(triangles), ..self }
    }
}

/// Settings that most plates share: the middle of the path through the grove.
const MIDDLE: Plate = Plate {
    name: "",
    title: "",
    paper: Paper::Grove,
    choices: PLAIN,
    changes: &[],
    from: 0.5,
    to: 0.5,
    frames: [20, 4],
    panels: &[],
    sights: &[Sight::Eye],
};
/// View A of the auditorium.
const AT_VIEW_A: Plate = Plate { paper: Paper::Auditorium, from: VIEW_A, to: VIEW_A, frames: [40, 12], ..MIDDLE };

/// All plates; first the ones that are drawn on the present adapter too.
pub(super) const PLATES: [Plate; 8] = [
    Plate {
        name: "fs93-10",
        title: "view A in full detail and within a tenth of its time (FS93, fig. 10)",
        panels: &[
            panel("a", Full, 1.0).polygons(72_570),
            panel("b", Greedy, 9.8).live(5.0).polygons(5_300),
            panel("b, default", Adaptive, 9.8).live(5.0).polygons(5_300),
        ],
        sights: &[Sight::Eye, Sight::Difference],
        ..AT_VIEW_A
    },
    Plate {
        name: "fs93-11",
        title: "the library in full detail and under two targets (FS93, fig. 11)",
        paper: Paper::Library,
        // the prices of an adapter, on which pixels and textures cost as they did on the paper's machine
        changes: &[("machine.preset", "\"llvmpipe\"")],
        frames: [40, 12],
        panels: &[
            panel("a", Full, 1.0).polygons(19_821),
            panel("b", Greedy, 1.6).live(1.5).polygons(4_217),
            panel("c", Greedy, 2.5).live(2.0).polygons(1_389),
            panel("b, default", Adaptive, 1.6).live(1.5).polygons(4_217),
            panel("c, default", Adaptive, 2.5).live(2.0).polygons(1_389),
        ],
        sights: &[Sight::Eye, Sight::Levels, Sight::Difference],
        ..MIDDLE
    },
    Plate {
        name: "fs93-8",
        title: "levels at view A by size and by benefit (FS93, fig. 8)",
        panels: &[panel("a", Static, 9.8), panel("b", Greedy, 9.8), panel("b, default", Adaptive, 9.8)],
        sights: &[Sight::Eye, Sight::Levels, Sight::Above(Above { height_m: 6.6, ahead_m: 9.0 })],
        ..AT_VIEW_A
    },
    Plate {
        name: "fs93-9",
        title: "levels at view C, just after the turn, by the last frame's time and by benefit (FS93, fig. 9)",
        paper: Paper::Auditorium,
        // from the stage in view to the seats that the turn brings into view
        from: 0.64,
        to: 0.728,
        frames: [22, 22],
        // the target of view A, where full detail takes three times as long
        panels: &[panel("a", Threshold, 3.2), panel("b", Greedy, 3.2), panel("b, default", Adaptive, 3.2)],
        sights: &[Sight::Eye, Sight::Levels],
        ..MIDDLE
    },
    Plate {
        name: "rh05-1",
        title: "three value functions from above and from the path (RH05, fig. 1)",
        choices: WHOLE_TREES,
        panels: &[
            panel("a/√z", RobinHood, 8.0).with(&[("target.value", "\"gentle\"")]),
            panel("a/z", RobinHood, 8.0).with(&[("target.value", "\"plain\"")]),
            panel("a/z²", RobinHood, 8.0).with(&[("target.value", "\"steep\"")]),
        ],
        sights: &[Sight::Above(Above { height_m: 110.0, ahead_m: 120.0 }), Sight::Eye],
        ..MIDDLE
    },
    Plate {
        name: "rh05-5",
        title: "the middle of the path under five targets, trees without levels (RH05, fig. 5)",
        choices: WHOLE_TREES,
        // at a sixth of full detail every tree has a triangle a pixel, past which no policy goes
        panels: &[
            panel("T", RobinHood, 96.0),
            panel("2 T", RobinHood, 48.0),
            panel("4 T", RobinHood, 24.0),
            panel("8 T", RobinHood, 12.0),
            panel("16 T", RobinHood, 6.0),
        ],
        ..MIDDLE
    },
    Plate {
        name: "rh05-8",
        title: "the middle of the path with lines and points, and without restriction (RH05, fig. 8)",
        panels: &[
            panel("with levels", RobinHood, 10.0).with(&[("target.value", "\"focus\"")]),
            panel("without restriction", Full, 1.0),
        ],
        sights: &[Sight::Eye, Sight::Difference],
        ..MIDDLE
    },
    Plate {
        name: "mb97-7",
        title: "domes at half and at twice their nominal cost, with groups and without (MB97, fig. 7)",
        paper: Paper::Domes,
        changes: TRIANGLES_COST,
        // the camera is near some domes and far from others, and sees all of them
        from: 0.2,
        to: 0.2,
        frames: [40, 12],
        panels: &[
            panel("a: hierarchical, 1920", Hierarchical, 1.0).triangles(1920.0),
            panel("b: flat, 1920", Greedy, 1.0).triangles(1920.0).with(NULL),
            panel("c: hierarchical, 7680", Hierarchical, 1.0).triangles(7680.0),
            panel("d: flat, 7680", Greedy, 1.0).triangles(7680.0).with(NULL),
        ],
        ..MIDDLE
    },
];

impl Plate {
    pub(super) const fn approach(&self, quick: bool) -> Approach {
        Approach { from: self.from, to: self.to, frames: self.frames[quick as usize] }
    }
}
