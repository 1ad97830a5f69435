//! Rigid bodies that share one clock while their contact lasts, or because a joint holds them.
//!
//! In: the leader's step, its companions, the joints of the scene. Out: every member's [`Motion`], and who has come apart.
//! Never here: who joins (the bodies' own `bonds`, and the runtime), free flight, how a lone body touches.
//!
//! The members' motions in double precision are the truth. They are handed over and given back bit for bit; in between one
//! of two solvers advances them all by parts of at most 1/240 s: the direct solve (`direct/`) where few contacts or a chain
//! of joints make it affordable, else a rapier3d world (`pile.rs`).

mod crew;
mod direct;
mod groups;
mod member;
mod pile;
mod pile_joints;
#[cfg(test)]
mod tests;
mod watch;

use super::motion::Motion;
use super::{Joint, RigidBody, RigidError};
use crew::Crew;
use direct::{Direct, Reach};
use glam::DVec3;
use member::{Ground, Member};
use metachron_contact::beside::may_press;
use metachron_contact::{IslandMember, StepContext};
use metachron_core::Mat6;
use metachron_core::{AgentId, SimSpan, StepError, StepReport, check_span};
use pile::Pile;
use std::sync::Arc;
use watch::Watch;

/// The shared world of a leader and its companions.
pub(super) struct Island {
    members: Vec<Member>,
    ground: Vec<Ground>,
    /// All joints of the scene.
    joints: Arc<[Joint]>,
    /// Those whose bodies are here.
    held: Vec<Held>,
    gravity: DVec3,
    solver: Solver,
    watch: Watch,
    reach: Reach,
    /// How long nobody has looked who touches whom in a pile, seconds.
    unseen_s: f64,
    /// How long everybody has been calm, seconds.
    calm_s: f64,
    before: Vec<(Motion, bool)>,
    /// The members' ids, rising: what is between them is not coupled.
    fellows: Vec<AgentId>,
}

/// A joint and the members that it holds; no second one is the world.
type Held = (usize, Option<usize>, Joint);

/// Who solves the contacts.
enum Solver {
    /// The direct solve, for few.
    Few(Box<Direct>),
    /// A rapier3d world, for many.
    Many(Box<Pile>),
}

impl Solver {
    /// Whether it knows how the member `index` answers impulses among the others.
    fn knows(&self, index: usize) -> bool {
        matches!(self, Self::Few(direct) if direct.moves(index, [DVec3::ZERO; 2]).is_some())
    }
}

/// A step is solved in parts no longer than this, seconds.
const PART_MAX_S: f64 = 1.0 / 240.0;
/// A step shorter than this share of [`PART_MAX_S`] too long is not split once more.
const SPLIT_SLACK: f64 = 1.01;
/// For jointed bodies that whirl or tremble parts are at most this much shorter.
const FINER_MAX: f64 = 64.0;
/// A body that is held and slower than this everywhere is calm, m/s.
const CALM_M_S: f64 = 2e-3;
/// An island that was calm for this long of its own time is at rest, seconds.
const REST_S: f64 = 0.5;
/// In a pile it is looked at this often who touches whom, seconds: a fifth of the cost of its step each time (measured).
const LOOK_S: f64 = 1.0 / 30.0;

/// One step of `leader` and everybody it leads. `apart`: one number a companion, zero stays, equal ones leave together.
///
/// # Errors
/// [`StepError::BadSpan`] and [`StepError::Alone`] leave everybody untouched, [`StepError::Diverged`] as they were before.
pub(super) fn lead(
    leader: &mut RigidBody,
    dt: SimSpan,
    around: &StepContext<'_>,
    others: &mut [IslandMember<'_>],
    apart: &mut Vec<u32>,
) -> Result<StepReport, StepError> {
    let dt_s = check_span(dt)?;
    let mut island = match leader.island.take() {
        Some(island) => island,
        None => Box::new(Island::new(leader).map_err(|e| diverged(dt_s, e.to_string()))?),
    };
    let report = Crew::new(leader, around, others).and_then(|mut crew| island.run(&mut crew, dt_s, apart));
    leader.island = Some(island);
    report
}

/// The sum of two resistances.
fn both(one: Option<Mat6>, other: Option<Mat6>) -> Option<Mat6> {
    match (one, other) {
        (Some(mut sum), Some(other)) => {
            sum.add(&other, 1.0);
            Some(sum)
        }
        (one, other) => one.or(other),
    }
}

/// Shows every pair of members that is near enough to touch by turning alone.
fn near_pairs(members: &[Member], mut pair: impl FnMut(u32, u32)) {
    for (a, member) in members.iter().enumerate() {
        for b in (a + 1..members.len()).filter(|&b| member.is_near(&members[b])) {
            pair(a as u32, b as u32);
        }
    }
}

fn diverged(dt_s: f64, what: String) -> StepError {
    StepError::Diverged { model: "rigid", dt_s, what }
}

impl Island {
    fn new(leader: &RigidBody) -> Result<Self, RigidError> {
        Ok(Self {
            members: Vec::new(),
            ground: leader.scenery.0.iter().map(Ground::new).collect::<Result<Vec<_>, _>>()?,
            joints: leader.scenery.1.clone(),
            held: Vec::new(),
            gravity: leader.gravity,
            solver: Solver::Few(Box::default()),
            watch: Watch::default(),
            reach: Reach::default(),
            unseen_s: LOOK_S,
            calm_s: 0.0,
            before: Vec::new(),
            fellows: Vec::new(),
        })
    }

    /// Advances everybody: muster, parts of pulling and solving, then who came apart and who rests.
    fn run(&mut self, crew: &mut Crew<'_, '_>, dt_s: f64, apart: &mut Vec<u32>) -> Result<StepReport, StepError> {
        self.muster(crew);
        self.begin(crew, dt_s);
        let (mut left, mut parts) = (dt_s, 0);
        while left > 0.0 {
            let count = (left / self.span_s()).ceil().max(1.0);
            let at_once = if self.goes_on() { count } else { 1.0 };
            if let Err(what) = self.parts(crew, left / count, at_once as u32) {
                self.undo(crew);
                return Err(diverged(dt_s, what.to_owned()));
            }
            left = if count > at_once { left - at_once * left / count } else { 0.0 };
            parts += at_once as u32;
        }
        self.watch(dt_s, apart);
        let at_rest = self.rest(crew, dt_s);
        self.end(crew, at_rest, dt_s);
        Ok(StepReport { work: self.members.len() as f64, substeps: parts, at_rest })
    }

    /// Takes in who has come and lets go who has left.
    fn muster(&mut self, crew: &mut Crew<'_, '_>) {
        let same = |member: &Member| member.seat < crew.len() && member.id == crew.id(member.seat);
        if crew.len() == self.members.len() && self.members.iter().all(same) {
            return;
        }
        let mut seats: Vec<_> = (0..crew.len()).map(|seat| (crew.id(seat), seat)).collect();
        seats.sort_unstable();
        for index in (0..self.members.len()).rev() {
            match seats.binary_search_by_key(&self.members[index].id, |s| s.0) {
                Ok(found) => self.members[index].seat = seats.remove(found).1,
                Err(_) => {
                    self.members.remove(index);
                    if let Solver::Many(pile) = &mut self.solver {
                        pile.remove(index);
                    }
                }
            }
        }
        for (id, seat) in seats {
            let member = Member::new(id, seat, crew.body(seat).0);
            if let Solver::Many(pile) = &mut self.solver {
                pile.insert(&member);
            }
            self.members.push(member);
        }
        self.fellows.clear();
        self.fellows.extend(self.members.iter().map(|m| m.id));
        self.fellows.sort_unstable();
        self.hold();
        self.settle();
        self.watch.start(self.members.len());
        self.unseen_s = LOOK_S;
    }

    /// Finds the joints whose bodies are all here.
    fn hold(&mut self) {
        let place = |id| self.members.iter().position(|m| m.id == id);
        self.held.clear();
        for joint in self.joints.iter() {
            let b = joint.b.map(place);
            if let (Some(a), Some(b)) = (place(joint.a), b.map_or(Some(None), |found| found.map(Some))) {
                self.held.push((a, b, *joint));
            }
        }
    }

    /// Chooses who solves, and lets it know who is here.
    fn settle(&mut self) {
        let many = self.held.is_empty() && !direct::may_suit(self.members.len());
        match &mut self.solver {
            Solver::Few(_) if many => self.go_many(),
            Solver::Few(direct) => direct.settle(&self.members, &self.ground, &self.held),
            Solver::Many(pile) => {
                pile.hold(&self.members, &self.held);
                pile.settle(&self.members);
            }
        }
    }

    /// Hands everybody to a rapier3d world.
    fn go_many(&mut self) {
        let mut pile = Pile::new(&self.ground, self.members[0].motion.position);
        self.members.iter().for_each(|member| pile.insert(member));
        pile.hold(&self.members, &self.held);
        pile.settle(&self.members);
        self.solver = Solver::Many(Box::new(pile));
    }

    /// Hands everybody to the direct solve.
    fn go_few(&mut self) {
        let mut direct = Direct::default();
        direct.settle(&self.members, &self.ground, &self.held);
        self.solver = Solver::Few(Box::new(direct));
    }

    /// Everybody takes what it was given since its last step. What that has carried it by goes through nobody here.
    fn begin(&mut self, crew: &mut Crew<'_, '_>, dt_s: f64) {
        let mut given = false;
        self.before.clear();
        for index in 0..self.members.len() {
            let (body, around) = crew.body(self.members[index].seat);
            let before = body.motion;
            self.before.push((before, body.touching));
            body.begin(around, &self.fellows, dt_s);
            self.members[index].received = body.received;
            if let Some(carried) = body.late.filter(|_| !self.solver.knows(index)) {
                body.shift(carried);
                body.late = None;
            }
            if body.motion.position != before.position || body.motion.rotation != before.rotation {
                body.scale_displacement(&before, self.free_share(index, &body.motion));
            }
            body.transmit_to_ground();
            let member = &mut self.members[index];
            (member.motion, member.gravity, member.springs) = (body.motion, body.gravity, None);
            member.alone = body.ties.is_empty() && body.company.guests().is_empty();
            member.asked = around.neighbours.iter().any(may_press);
            given |= member.asked && body.received != [DVec3::ZERO; 2];
        }
        self.carry(crew);
        self.ask(given);
    }

    /// Asks how members answer what bends, where something was `given` to one: only then does it press.
    fn ask(&mut self, given: bool) {
        let Solver::Few(direct) = &mut self.solver else { return };
        if given {
            direct.ask();
        } else if !self.members.iter().any(|member| member.asked) {
            direct.forget(&mut self.members);
        }
    }

    /// Moves everybody by how far what came late has carried one of them: contact and joints take the others along.
    fn carry(&mut self, crew: &mut Crew<'_, '_>) {
        for index in 0..self.members.len() {
            let Some(carried) = crew.body(self.members[index].seat).0.late.take() else { continue };
            let Solver::Few(direct) = &self.solver else { continue };
            let moves = direct.moves(index, [carried.linear, carried.angular]);
            for (member, way) in self.members.iter_mut().zip(moves.into_iter().flatten()) {
                let body = crew.body(member.seat).0;
                body.displace_by(way);
                member.motion = body.motion;
            }
        }
    }

    /// The share of the way from where the member `index` is to `there` that it gets without touching another.
    fn free_share(&self, index: usize, there: &Motion) -> f64 {
        let member = &self.members[index];
        let others = self.members.iter().enumerate().filter(|(other, _)| *other != index);
        others.map(|(_, other)| member.free_share(there, other)).fold(1.0, f64::min)
    }

    /// The longest part that may come next, seconds.
    fn span_s(&self) -> f64 {
        let longest = PART_MAX_S * SPLIT_SLACK;
        match &self.solver {
            Solver::Few(direct) => direct.span_s(&self.members).clamp(PART_MAX_S / FINER_MAX, longest),
            Solver::Many(_) => longest,
        }
    }

    /// Whether a pile may go on part after part: nothing else moves anybody meanwhile.
    fn goes_on(&self) -> bool {
        matches!(self.solver, Solver::Many(_)) && self.members.iter().all(|m| m.alone)
    }

    /// Advances everybody by so many `parts` of `h` seconds, one where not all are alone: springs pull, then all contacts and
    /// joints are solved at once.
    fn parts(&mut self, crew: &mut Crew<'_, '_>, h: f64, parts: u32) -> Result<(), &'static str> {
        for member in self.members.iter_mut().filter(|m| !m.alone) {
            let body = crew.body(member.seat).0;
            body.motion = member.motion;
            let pulled = body.pull(h)?;
            let pressed = body.meet(h);
            member.motion = body.motion;
            // the springs' solution has the gravity of this part in its velocity already
            member.gravity = if pulled.is_some() { DVec3::ZERO } else { body.gravity };
            member.springs = both(pulled, pressed);
        }
        self.solve(crew, h, parts)?;
        let met = self.members.iter().filter(|m| !m.alone);
        met.for_each(|member| crew.body(member.seat).0.company.go_on(h));
        Ok(())
    }

    /// Solves all contacts and joints of so many `parts`.
    fn solve(&mut self, crew: &mut Crew<'_, '_>, h: f64, parts: u32) -> Result<(), &'static str> {
        if let Solver::Few(direct) = &mut self.solver {
            if direct.advance((&mut self.members, &self.ground), &self.held, h)? {
                for member in self.members.iter().filter(|m| m.springs.is_some()) {
                    crew.body(member.seat).0.react_to_change(member.bent, h);
                }
                return Ok(());
            }
            self.go_many();
        }
        let Solver::Many(pile) = &mut self.solver else { return Ok(()) };
        pile.advance((&mut self.members, &self.ground), self.gravity, (h, parts))
    }

    /// Everybody is as before the step.
    fn undo(&mut self, crew: &mut Crew<'_, '_>) {
        for (member, &(motion, touching)) in self.members.iter_mut().zip(&self.before) {
            let body = crew.body(member.seat).0;
            (body.motion, body.touching, member.motion) = (motion, touching, motion);
            body.grips.clear();
        }
    }

    /// Notes who touches whom; every [`APART_S`] tells who has come apart. Who is merely near stays too: it comes back, and until it
    /// has moved in again the others know it no better than anybody; a heap that parts gathers again at once.
    fn watch(&mut self, dt_s: f64, apart: &mut Vec<u32>) {
        let Self { watch, reach, members, held, solver, unseen_s, .. } = self;
        *unseen_s += dt_s;
        let shrunk = match solver {
            Solver::Few(direct) => {
                direct.touches(members, |a, b| watch.join(a, b));
                near_pairs(members, |a, b| watch.join(a, b));
                false
            }
            Solver::Many(pile) if *unseen_s >= LOOK_S => {
                *unseen_s = 0.0;
                reach.clear();
                let contacts = pile.touches(members, |a, b, touch| {
                    watch.join(a, b);
                    if touch {
                        reach.note(a, b);
                    }
                });
                reach.suits(members.len(), contacts)
            }
            Solver::Many(_) => false,
        };
        held.iter().filter_map(|(a, b, _)| Some((*a, (*b)?))).for_each(|(a, b)| watch.join(a as u32, b as u32));
        watch.pass(members, dt_s, apart);
        if shrunk {
            self.go_few();
        }
    }

    /// Whether everybody has been calm long enough.
    fn rest(&mut self, crew: &mut Crew<'_, '_>, dt_s: f64) -> bool {
        let jointed = !self.held.is_empty();
        let calm = self.members.iter().all(|member| {
            let still = member.motion.velocity == DVec3::ZERO && member.motion.angular == DVec3::ZERO;
            let held = (member.touching || jointed) && member.speed_m_s() < CALM_M_S;
            // the bodies are asked last: most heaps are not calm, and a look at every one of them is dear
            (held || (still && self.gravity == DVec3::ZERO)) && {
                let body = crew.body(member.seat).0;
                body.may_sleep && body.ties.is_empty() && body.company.is_calm(CALM_M_S)
            }
        });
        self.calm_s = if calm { self.calm_s + dt_s } else { 0.0 };
        self.calm_s >= REST_S
    }

    /// Gives everybody its motion back, at a stop where the island rests.
    fn end(&mut self, crew: &mut Crew<'_, '_>, at_rest: bool, dt_s: f64) {
        for member in &mut self.members {
            if at_rest {
                (member.motion.velocity, member.motion.angular) = (DVec3::ZERO, DVec3::ZERO);
            }
            let (body, around) = crew.body(member.seat);
            (body.motion, body.at_rest, body.within) = (member.motion, at_rest, member.answer);
            body.finish_island_step(around, dt_s, member.touching, member.depth_m);
        }
    }
}
