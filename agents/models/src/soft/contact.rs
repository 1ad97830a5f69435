//! Contact within a soft body's own step: between its solve and its move.
//!
//! In: free velocities, the factor, static solids, neighbours. Out: velocities that keep the skins apart.
//! Never here: where two forms touch ([`metachron_geometry::narrow_phase`]). Theory: docs/theory/contact.md, eq. 5–11.

use super::company::Company;
use super::initial_overlap::PassingVertices;
use super::spec::{SoftError, SoftSpec};
use super::system::System;
use glam::DVec3;
use metachron_contact::{Contact, Owner, Problem, Search, Settings, Solver};
use metachron_core::ContactJacobian;
use metachron_geometry::narrow_phase::NarrowPhaseScratch;
use metachron_geometry::{CollisionShape, ContactSide, PlacedShape, ShapePose, StaticSolid, Touch};
use std::sync::Arc;

/// Solver settings: 10 µm/s, a tenth of the limit for rest.
const SETTINGS: Settings = Settings { iterations: 40, tolerance_m_s: 1e-5 };
/// The same for a body that peers press on a static solid: a vertex under one five hundred times as heavy takes this many.
const SQUEEZED: Settings = Settings { iterations: 300, ..SETTINGS };
/// Contacts are predicted this far beyond where they close within a substep, as a share of the mean edge.
const SLACK_SHARE: f64 = 0.02;
/// Deeper than this share of the mean edge counts as through a solid, not next to it.
const DEEP_SHARE: f64 = 0.5;
/// Shift of a static solid's number in a key, below [`WALLS_END`].
const WALL_SHIFT: u32 = 48;
/// The keys of contacts with agents start here.
const WALLS_END: u64 = 1 << 63;

/// The contacts of one soft body.
pub(super) struct Contacts {
    /// The body's own form.
    pub form: Arc<CollisionShape>,
    walls: Vec<Wall>,
    list: Vec<Contact>,
    solver: Solver,
    touches: Vec<Touch>,
    /// Scale of the inverse mass of each slot, 1/kg: the body's own first.
    pub mobilities: Vec<f64>,
    scratch: NarrowPhaseScratch,
    slack_m: f64,
}

/// A substep: where the vertices are at its start, metres, and its length.
#[derive(Clone, Copy)]
pub(super) struct Substep<'a> {
    pub positions: &'a [DVec3],
    pub h_s: f64,
}

/// A static solid at its place.
struct Wall {
    solid: StaticSolid,
    /// The vertices of the body that pass through it.
    passing: PassingVertices,
}

impl Contacts {
    /// The contacts of a body of this skin, whose edges are `edge_m` long on average.
    ///
    /// # Errors
    /// [`SoftError::Obstacle`] for an invalid static solid.
    pub fn new(spec: &SoftSpec, form: Arc<CollisionShape>, edge_m: f64) -> Result<Self, SoftError> {
        let wall = |obstacle| Ok(Wall { solid: StaticSolid::new(obstacle)?, passing: PassingVertices::default() });
        let walls = spec.obstacles.iter().map(wall).collect::<Result<_, SoftError>>()?;
        Ok(Self {
            form,
            walls,
            list: vec![],
            solver: Solver::forming(),
            touches: vec![],
            mobilities: vec![],
            scratch: NarrowPhaseScratch::default(),
            slack_m: SLACK_SHARE * edge_m,
        })
    }

    /// Corrects the free `velocities` of a substep; their number stays one for each vertex.
    pub fn solve(
        &mut self,
        substep: Substep<'_>,
        velocities: &mut Vec<DVec3>,
        system: &mut System,
        company: &mut Company,
    ) {
        let h = substep.h_s;
        let own = velocities.len();
        self.list.clear();
        if (self.walls.is_empty() && company.mates().is_empty()) || !velocities.iter().sum::<DVec3>().is_finite() {
            return;
        }
        company.mates_mut().extend(velocities, h);
        let settings = self.find(substep, velocities, company);
        if self.list.is_empty() {
            self.solver.forget();
            velocities.truncate(own);
            return;
        }
        self.list.sort_unstable_by_key(|contact| contact.key);
        company.mates().scale(&mut self.mobilities);
        let Self { list, mobilities, solver, .. } = self;
        let problem = Problem { contacts: &[], related_keys: &[], h_s: h, mobilities, settings };
        let respond = |impulses: &mut [DVec3]| system.respond(impulses);
        company.mates_mut().solve(solver, (list, problem), velocities, Owner { slots: own, respond, tips: true });
        company.mates_mut().watch(self.list.iter().zip(self.solver.impulses()), velocities);
        velocities.truncate(own);
        self.mobilities.truncate(own);
    }

    /// Finds the contacts that may close within the substep; returns the settings for their solve.
    fn find(&mut self, substep: Substep<'_>, velocities: &[DVec3], company: &mut Company) -> Settings {
        let Substep { positions, h_s: h } = substep;
        let deep_m = DEEP_SHARE * self.edge_m();
        let Self { form, walls, list, touches: places, scratch, slack_m, mobilities, .. } = self;
        let (mut stands, held) = (false, mobilities.contains(&0.0));
        let here = PlacedShape { form, view: ShapePose::Surface(positions) };
        let own = &velocities[..positions.len()];
        let speed = own.iter().map(|v| v.length_squared()).fold(0.0, f64::max).sqrt();
        for (wall, number) in walls.iter_mut().zip(0_u64..) {
            wall.solid.touches(&here, *slack_m + speed * h, scratch, places);
            wall.passing.update(places, held, deep_m);
            let friction = (form.friction * wall.solid.form.friction).sqrt();
            for place in places.iter().filter(|place| !wall.passing.contains(place)) {
                let mut slots = ContactJacobian::default();
                place.on_a.join(&mut slots, 0, DVec3::ZERO, ContactSide::first(place.normal));
                let closing = slots.velocity(velocities).dot(place.normal);
                if place.gap_m + closing * h > *slack_m {
                    continue;
                }
                stands = true;
                // held vertices need no contact to stay
                if slots.mobility(mobilities) > 0.0 {
                    let key = (number & 0x7fff) << WALL_SHIFT | place.key.packed() & ((1 << WALL_SHIFT) - 1);
                    let Touch { normal, gap_m, .. } = *place;
                    list.push(Contact {
                        key,
                        jacobian: slots,
                        normal,
                        gap_m,
                        friction,
                        rebound_m_s: 0.0,
                        back_m_s: DVec3::ZERO,
                        age_s: 0.0,
                    });
                }
            }
        }
        let fixed = list.len();
        let search = Search { h_s: h, slack_m: *slack_m, speed_m_s: speed };
        company.mates_mut().find(&here, search, velocities, (scratch, list));
        if stands && list.len() > fixed { SQUEEZED } else { SETTINGS }
    }

    /// The mean length of an edge of the skin, metres.
    pub fn edge_m(&self) -> f64 {
        self.slack_m / SLACK_SHARE
    }

    /// Feet on static solids in the last substep: the velocities that each place joins, and its normal.
    pub fn footholds(&self) -> impl Iterator<Item = (ContactJacobian, DVec3)> {
        let fixed = self.impulses().filter(|(contact, _)| contact.key < WALLS_END);
        fixed.filter(|(c, impulse)| impulse.dot(c.normal) > 0.0).map(|(c, _)| (c.jacobian, c.normal))
    }

    /// Whether a static solid pressed in the last substep.
    pub fn is_grounded(&self) -> bool {
        self.footholds().next().is_some()
    }

    /// The contacts of the last substep and their impulses, N·s.
    pub fn impulses(&self) -> impl Iterator<Item = (&Contact, &DVec3)> + Clone {
        let solved = if self.list.is_empty() { &[] } else { self.solver.impulses() };
        self.list.iter().zip(solved)
    }
}
