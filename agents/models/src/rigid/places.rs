//! Where a body touches or may touch within a part: the contacts of a solve.
//!
//! In: the body and everything around it, laid out in slots. Out: contacts, each with whom it is. Never here: their solution
//! ([`super::meeting`]).

use super::advance::TOUCH_S;
use super::company::{Company, Guest, placed};
use super::footing::FEET_M;
use super::meeting::{Found, Me, Meeting, Strike};
use glam::DVec3;
use metachron_contact::tank::RESERVE_M_S;
use metachron_contact::{Contact, PUSH_OUT_SHARE};
use metachron_core::ContactJacobian;
use metachron_geometry::narrow_phase::touches;
use metachron_geometry::{ContactSide, Place, StaticSolid, Touch};

/// A contact farther than this from closing within the part is left out, metres.
const SLACK_M: f64 = 1e-5;
/// What comes to a fixed solid more slowly than this does not bounce, m/s: else nothing would ever lie.
const BOUNCE_M_S: f64 = 0.01;
/// What has more restitution bounces on what presses it, too.
const LIVELY: f64 = 0.5;
/// How far past the skin a blow looks for places, as a share of the body's size: what a bound on a gap may be short by. And as far
/// as a body flies in [`TOUCH_S`]: at a thousand metres a second that is more than the skin.
const BOUND_SHARE: f64 = 2e-5;

impl Meeting {
    /// Places within the skin of everything that takes part, for a blow.
    pub(super) fn find_blows(&mut self, me: &Me<'_>, company: &mut Company, fixed: &[StaticSolid], strike: Strike) {
        let span = company.span;
        let (guests, _, pairs, room, form) = company.split();
        let mine = placed(form, me.motion);
        let speed_m_s = me.motion.velocity.length() + self.before[1].length() * me.mover.swing_m;
        let past = BOUND_SHARE * me.mover.radius_m + TOUCH_S * speed_m_s;
        for (i, guest) in
            guests.iter().enumerate().filter(|(_, guest)| strike.met && guest.touchable && !guest.is_chain())
        {
            let Some(it) = guest.other.placed() else { continue };
            touches(&mine, &it, 2.0 * guest.skin_m + past, room, &mut self.touches);
            let owed_j = guest.other.id().and_then(|id| pairs.get(id)).map_or(0.0, |pair| pair.owed_j());
            let owed = 2.0 * owed_j / guest.reduced_kg(me.spread.mass_kg);
            let law = (guest.friction, |closing_m_s| guest.restitution_at(closing_m_s, &span), owed);
            self.take_up(me, Some((i, guest)), law);
        }
        // who stands and is struck down on one foot would turn over it, and be thrown up from the next
        let past = if strike.stood { past + FEET_M } else { past };
        for solid in fixed {
            solid.touches(&mine, 2.0 * me.mover.skin_m() + past, room, &mut self.touches);
            let skin = &solid.form;
            let (friction, restitution) =
                ((form.friction * skin.friction).sqrt(), form.restitution.max(skin.restitution));
            let from = self.found.len();
            self.take_up(me, None, (friction, still, 0.0));
            for found in &mut self.found[from..] {
                let pressed_m_s = -found.contact.jacobian.velocity(&strike.pressed).dot(found.contact.normal);
                // a hop that gravity and what presses would end within the step is none; what hardly loses anything hops on
                let hop_m_s = 2.0 * restitution * found.approach_m_s;
                let is_short = hop_m_s < span.gravity.length() * span.dt_s + pressed_m_s;
                let stays = strike.stood || (restitution <= LIVELY && is_short);
                let thrown_m_s = found.approach_m_s - if stays { pressed_m_s.max(0.0) } else { 0.0 };
                let bounces = thrown_m_s > BOUNCE_M_S;
                found.contact.rebound_m_s = if bounces { restitution * thrown_m_s } else { 0.0 };
            }
        }
        for found in &mut self.found {
            (found.contact.gap_m, found.contact.age_s) = (0.0, 0.0);
        }
    }

    /// Places that may close within `h` seconds: with tubes, and with the rest where `solids` take part.
    pub(super) fn find_presses(
        &mut self,
        me: &Me<'_>,
        company: &mut Company,
        (h, gravity): (f64, DVec3),
        solids: bool,
    ) {
        let after_s = company.after_s;
        let (guests, _, pairs, room, form) = company.split();
        let mine = placed(form, me.motion);
        for (i, guest) in guests.iter().enumerate().filter(|(_, g)| g.touchable && (solids || g.is_chain())) {
            let Some(it) = guest.other.placed() else { continue };
            let pull = (gravity - guest.other.acceleration()).length();
            let swing = self.before[1].length() * me.mover.swing_m;
            let closing = guest.approach_m_s(me.motion.velocity) + swing + pull * h;
            touches(&mine, &it, closing * h + SLACK_M, room, &mut self.touches);
            let from = self.found.len();
            self.take_up(me, Some((i, guest)), (guest.friction, still, 0.0));
            self.keep_closing(from, h);
            let pair = guest.other.id().and_then(|id| pairs.get(id));
            let pushed_m_s = pair.map_or(RESERVE_M_S, |pair| pair.push_out_m_s());
            let age_s = guest.other.age_s().abs().max(guest.other.answers_within_s()) + after_s;
            for found in &mut self.found[from..] {
                found.contact.age_s = age_s;
                found.contact.gap_m = found.contact.gap_m.max(-pushed_m_s * h.max(age_s) / PUSH_OUT_SHARE);
            }
        }
    }

    /// Places with fixed solids that may close within `h` seconds.
    pub(super) fn find_fixed(
        &mut self,
        me: &Me<'_>,
        company: &mut Company,
        fixed: &[StaticSolid],
        (h, gravity): (f64, DVec3),
    ) {
        let (_, _, _, room, form) = company.split();
        let mine = placed(form, me.motion);
        let swing = self.before[1].length() * me.mover.swing_m;
        let reach = (me.motion.velocity.length() + swing + gravity.length() * h) * h + SLACK_M;
        for solid in fixed {
            solid.touches(&mine, reach, room, &mut self.touches);
            let from = self.found.len();
            self.take_up(me, None, ((form.friction * solid.form.friction).sqrt(), still, 0.0));
            self.keep_closing(from, h);
        }
    }

    /// Turns the places that were found into contacts: with this friction, with the restitution of an approach at so many m/s, and
    /// with what a bounce has to pay back, m²/s² of its speed.
    fn take_up(
        &mut self,
        me: &Me<'_>,
        guest: Option<(usize, &Guest)>,
        (friction, restitution, owed): (f64, impl Fn(f64) -> f64, f64),
    ) {
        for touch in &self.touches {
            let mut slots = ContactJacobian::default();
            let (mine, theirs) = halfway(touch);
            mine.join(&mut slots, 0, me.motion.position, ContactSide::first(touch.normal));
            if let Some((i, guest)) = guest {
                guest.other.join(&mut slots, self.bases[i], &theirs, ContactSide::second(touch.normal));
            }
            let approach_m_s = -slots.velocity(&self.velocities).dot(touch.normal);
            let rebound = restitution(approach_m_s) * approach_m_s.max(0.0);
            let rebound_m_s = (rebound * rebound - owed).max(0.0).sqrt();
            let with = guest.and_then(|(_, g)| g.other.id()).map_or(u64::MAX, |id| u64::from(id.0));
            let key = mixed(touch.key.packed() ^ mixed(with));
            let (normal, gap_m) = (touch.normal, touch.gap_m);
            let contact = Contact {
                key,
                jacobian: slots,
                normal,
                gap_m,
                friction,
                rebound_m_s,
                back_m_s: DVec3::ZERO,
                age_s: 0.0,
            };
            self.found.push(Found { contact, guest: guest.map(|(i, _)| i), approach_m_s });
        }
    }

    /// Drops what was found since `from` and cannot close within `h` seconds.
    fn keep_closing(&mut self, from: usize, h: f64) {
        let mut at = 0;
        self.found.retain(|found| {
            at += 1;
            at <= from || found.contact.gap_m - found.approach_m_s * h < SLACK_M
        });
    }
}

/// The restitution of what presses.
const fn still(_: f64) -> f64 {
    0.0
}

/// Both sides' places, brought to the middle of the gap: force and torque then balance exactly.
pub(super) fn halfway(touch: &Touch) -> (Place, Place) {
    let half = 0.5 * touch.gap_m;
    match (touch.on_a, touch.on_b) {
        (Place::Point(a), Place::Point(b)) => (Place::Point(0.5 * (a + b)), Place::Point(0.5 * (a + b))),
        (Place::Point(a), Place::Chain { segment, share, radius_m }) => {
            (Place::Point(a - touch.normal * half), Place::Chain { segment, share, radius_m: radius_m + half })
        }
        places => places,
    }
}

/// Mixes the bits of a name (SplitMix64), so that names of many pairs do not collide.
const fn mixed(name: u64) -> u64 {
    let name = name.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let name = (name ^ (name >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let name = (name ^ (name >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    name ^ (name >> 31)
}
