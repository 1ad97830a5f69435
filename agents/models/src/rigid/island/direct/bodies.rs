//! Members as the direct solve sees them: masses, velocities, and contacts as rows.
//!
//! In: members, contacts. Out: [`Mass`]es, [`Twist`]s, [`Row`]s. Never here: which impulses they need.

use super::super::member::Member;
use super::near::Contact;
use super::row::{Law, Mass, NOBODY, Row, Twist};
use glam::{DMat3, DVec3};
use metachron_core::Mat6;

/// A spring softer than this, as ω²h² of what it pulls, is a force at both ends of the part: it then keeps its energy.
const SOFT: f64 = 0.1;

/// Masses and velocities of all members where they are now.
pub(super) fn weigh(members: &[Member], masses: &mut Vec<Mass>, velocities: &mut Vec<Twist>) {
    masses.clear();
    velocities.clear();
    for member in members {
        let axes = DMat3::from_quat(member.motion.rotation * member.spread.axes);
        let about = |moments: DVec3| axes * DMat3::from_diagonal(moments) * axes.transpose();
        masses.push(Mass {
            mass_kg: member.spread.mass_kg,
            inertia: about(member.spread.moments),
            inverse: about(member.spread.moments.recip()),
        });
        velocities.push([member.motion.velocity, member.motion.spin(&member.spread)]);
    }
}

/// The energy of motion, joules.
pub(super) fn energy_j(masses: &[Mass], velocities: &[Twist]) -> f64 {
    let of = |(mass, [v, w]): (&Mass, &Twist)| 0.5 * (mass.mass_kg * v.length_squared() + w.dot(mass.inertia * *w));
    masses.iter().zip(velocities).map(of).sum()
}

/// Whether a spring may act as a force at both ends of a part: slow against it, damping included.
pub(super) fn is_soft(row: &Row, (k, c): (f64, f64), h: f64, masses: &[Mass]) -> bool {
    h * (h * k + c) * row.mobility(masses) < SOFT
}

/// Gives an impulse along a row.
pub(super) fn push(members: &mut [Member], row: &Row, impulse: f64) {
    let sides = [(row.a, impulse, row.turn_a), (row.b, -impulse, row.turn_b)];
    for (body, impulse, turn) in sides.into_iter().filter(|side| side.0 != NOBODY) {
        let member = &mut members[body as usize];
        member.motion.velocity += row.lin * (impulse / member.spread.mass_kg);
        member.motion.angular += turn * impulse;
    }
}

/// Appends what springs from outside do against every change of the velocities `free` that they left: R = L Lᵀ, a row for each
/// column of L.
pub(super) fn spring_rows(members: &[Member], free: &[Twist], into: &mut Vec<Row>) {
    for (index, (member, free)) in members.iter().zip(free).enumerate() {
        for [lin, turn] in member.springs.iter().flat_map(Mat6::roots) {
            let bias = -lin.dot(free[0]) - turn.dot(free[1]);
            let law = Law::Spring(1.0);
            let a = index as u32;
            into.push(Row { a, b: NOBODY, lin, turn_a: turn, turn_b: DVec3::ZERO, law, bias, lambda: 0.0 });
        }
    }
}

/// The middle one of three numbers.
pub(super) fn middle(of: DVec3) -> f64 {
    of.element_sum() - of.max_element() - of.min_element()
}

/// The arms of a contact in world axes.
fn arms(contact: &Contact, members: &[Member]) -> (DVec3, DVec3) {
    let arm = |body: u32, on: DVec3| members[body as usize].motion.rotation * on;
    let of_b = if contact.b == NOBODY { DVec3::ZERO } else { arm(contact.b, contact.on_b) };
    (arm(contact.a, contact.on_a), of_b)
}

/// The gap where the bodies are now, along the normal of the part's start, metres.
pub(super) fn gap_now(contact: &Contact, members: &[Member]) -> f64 {
    let (arm_a, arm_b) = arms(contact, members);
    let on_a = members[contact.a as usize].motion.position + arm_a;
    let on_b = if contact.b == NOBODY { contact.on_b } else { members[contact.b as usize].motion.position + arm_b };
    contact.gap_m + contact.normal.dot(on_a - on_b)
}

/// Appends a contact's normal and its two tangents, starting from an impulse.
pub(super) fn contact_rows(contact: &Contact, members: &[Member], warm: DVec3, into: &mut Vec<Row>) {
    let (arm_a, arm_b) = arms(contact, members);
    let (first, second) = contact.normal.any_orthonormal_pair();
    for (axis, law) in [(contact.normal, Law::Normal(contact.friction)), (first, Law::Tangent), (second, Law::Tangent)]
    {
        into.push(Row {
            a: contact.a,
            b: contact.b,
            lin: axis,
            turn_a: arm_a.cross(axis),
            turn_b: arm_b.cross(axis),
            law,
            bias: 0.0,
            lambda: warm.dot(axis),
        });
    }
}
