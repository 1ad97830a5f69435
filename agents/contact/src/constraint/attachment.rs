//! Springs between members and the world that are a member's own and yield: rows with bounds, as of links and joints.
//!
//! In: what members say of such springs. Out: rows. Never here: springs that never yield, which are a part of their member's matrix.
//! Theory: docs/theory/clusters.md, eq. 29; docs/theory/rod.md, eq. 21.

use crate::constraint::failure::SLIP_SHARE;
use crate::constraint::{ConstraintRows, FineStep, Frame, Name, Pull, Slides, SlidingRow};
use crate::member::memory::Partner;
use crate::member::{ClusterMember, OwnSpring};
use crate::solve::{Hold, JointRow, Side, Spring};
use glam::DVec3;

impl ConstraintRows {
    /// Lays out the springs to the world that are members' own and yield.
    pub fn gather_own_springs(&mut self, step: &FineStep<'_, '_>) {
        for (member, one) in step.all.iter().enumerate() {
            let springs = (0..).map_while(|place| Some((place, one.member.own_spring(place)?)));
            springs.for_each(|(place, spring)| self.own_spring(step, &Held { member, place, spring }));
        }
    }

    /// The spring at a place of a member: in all directions where it has no slack; else along the line to where it is held, and where it is
    /// taut also across that line, with the stiffness that its tension gives (rod.md, eq. 21).
    fn own_spring(&mut self, step: &FineStep<'_, '_>, held: &Held) {
        let OwnSpring { stiffness_n_m, damping_n_s_m, slack_m, yields_above_n, .. } = held.spring;
        let apart = held.spring.point.position - held.spring.place_m;
        if slack_m == 0.0 {
            let law = Spring { stiffness_n_m, damping_n_s_m, stretch_m: apart };
            let slides = Some(Slides::Point(Frame::WORLD));
            return self.own_row(step, held, OwnRow { hold: Hold::ALL, law, slides });
        }
        let Some(axis) = apart.try_normalize() else { return };
        let beyond_m = apart.length() - slack_m;
        let law = Spring { stiffness_n_m, damping_n_s_m, stretch_m: axis * beyond_m };
        self.own_row(step, held, OwnRow { hold: Hold::pushing(-axis), law, slides: Some(Slides::Length { axis }) });
        if beyond_m > 0.0 {
            let tension_n = (stiffness_n_m * beyond_m).min(yields_above_n);
            let law = Spring { stiffness_n_m: tension_n / apart.length(), damping_n_s_m: 0.0, stretch_m: DVec3::ZERO };
            self.own_row(step, held, OwnRow { hold: Hold::across(axis), law, slides: None });
        }
    }

    /// Lays out a row of such a spring.
    fn own_row(&mut self, step: &FineStep<'_, '_>, held: &Held, row: OwnRow) {
        let Held { member, place, spring } = *held;
        let OwnRow { hold, law, slides } = row;
        let sides = [spring.point.side.of_member(member), Side::FIXED];
        let row = JointRow::new(sides, hold.limited(spring.yields_above_n * step.h_s)).with_spring(law, step.h_s);
        let name = Name::lasting(member, Partner::Attachment(spring.attachment), None);
        let name = Name { tears_above_n: spring.tears_above_n, ..name };
        let key = 2 * place as u32 + u32::from(slides.is_none());
        let (Some(slides), true) = (slides, self.push(step, row, name.row(key, None))) else { return };
        let OwnSpring { stiffness_n_m, damping_n_s_m, yields_above_n, .. } = spring;
        let pull = Pull { stiffness_n_m, damping_n_s_m, rest_m: 0.0 };
        let Some(per_m_s) = pull.slips_per_m_s(step.h_s) else { return };
        let (row, free_m) = (self.rows.len() - 1, SLIP_SHARE * yields_above_n / stiffness_n_m);
        self.slides(SlidingRow { row, slides, per_m_s, free_m, yields_above_n, own: Some(place) });
    }
}

/// A spring with its member and its place among the member's.
#[derive(Clone, Copy)]
struct Held {
    member: usize,
    place: usize,
    spring: OwnSpring,
}

/// A row of a spring: of the two that it may have, one slips.
struct OwnRow {
    hold: Hold,
    law: Spring,
    slides: Option<Slides>,
}
