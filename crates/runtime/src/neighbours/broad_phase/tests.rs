//! The broad phase against looking at every pair.

use super::*;
use crate::cluster::Membership;
use glam::DVec3;
use proptest::prelude::*;

/// A ball that flies straight through each of its steps.
#[derive(Debug, Clone)]
struct Flyer {
    time: SimTime,
    dt: SimSpan,
    /// The lengths of its next steps, in turns.
    steps: Vec<SimSpan>,
    at: DVec3,
    velocity: DVec3,
    /// How it flew through the step that led here.
    came_with: DVec3,
    radius_m: f64,
    /// Its motion at its next turns: as before (`None`), or with this velocity from there on.
    plan: Vec<Option<[f64; 3]>>,
}

impl Flyer {
    fn bounds(&self) -> Bounds {
        let half = DVec3::splat(self.radius_m);
        Bounds { low: self.at - half, high: self.at + half, speed_m_s: self.velocity.length() }
    }

    fn step(&self) -> PlannedStep {
        PlannedStep { start: self.time, dt: self.dt }
    }

    /// Where it was in its last step, and where it will be if it keeps on.
    fn position_at(&self, time: SimTime) -> DVec3 {
        let velocity = if time < self.time { self.came_with } else { self.velocity };
        self.at + velocity * time.secs_after(self.time)
    }

    /// The distance between the boxes at `time`.
    fn gap_m(&self, other: &Self, time: SimTime) -> f64 {
        let apart = (self.position_at(time) - other.position_at(time)).abs() - self.radius_m - other.radius_m;
        apart.max(DVec3::ZERO).length()
    }
}

/// When agents look at all others.
#[derive(PartialEq)]
enum Looks {
    AsAppointed,
    AtEachTurn,
}

/// All turns in the order of their times; `check` gets the agent that has just updated its list, before each step.
fn fly(flyers: &mut [Flyer], until: SimTime, looks: Looks, mut check: impl FnMut(usize, &[Flyer], &NeighbourList)) {
    let broad_phase = BroadPhase::new(flyers.len());
    let ids = || (0..flyers.len() as u32).map(AgentId);
    let mut lists: Vec<_> = ids().map(NeighbourList::new).collect();
    for (flyer, list) in flyers.iter().zip(&mut lists) {
        list.publish(&broad_phase, Some(&flyer.bounds()), flyer.step());
    }
    let mut turn = 0;
    while let Some(at) = (0..flyers.len()).min_by_key(|k| flyers[*k].time).filter(|k| flyers[*k].time < until) {
        if looks == Looks::AtEachTurn {
            lists[at].arrive(&broad_phase);
        }
        lists[at].update(&broad_phase, flyers[at].step(), &Membership::default(), |_| true);
        check(at, flyers, &lists[at]);
        let flyer = &mut flyers[at];
        flyer.at = flyer.position_at(flyer.time + flyer.dt);
        flyer.time += flyer.dt;
        flyer.came_with = flyer.velocity;
        let news = flyer.plan[turn % flyer.plan.len()];
        flyer.velocity = news.map_or(flyer.velocity, DVec3::from_array);
        flyer.dt = flyer.steps[turn % flyer.steps.len()];
        lists[at].publish(&broad_phase, Some(&flyer.bounds()), flyer.step());
        turn += 1;
    }
}

fn flyer() -> impl Strategy<Value = Flyer> {
    let place = prop::array::uniform3(-1.0_f64..1.0);
    let speed = prop_oneof![Just(0.0), 0.0_f64..0.1, 0.0_f64..12.0];
    let velocity = (prop::array::uniform3(-1.0_f64..1.0), speed)
        .prop_map(|(towards, speed)| (DVec3::from_array(towards).normalize_or_zero() * speed).to_array());
    let news = prop_oneof![4 => Just(None), 1 => velocity.prop_map(Some)];
    let dt =
        prop::sample::select(vec![1_000_000_u64, 4_000_000, 16_666_667, 100_000_000]).prop_map(SimSpan::from_nanos);
    let steps = prop_oneof![2 => prop::collection::vec(dt.clone(), 1), 1 => prop::collection::vec(dt, 1..4)];
    (place, steps, 0.005_f64..0.1, prop::collection::vec(news, 1..40)).prop_map(|(at, steps, radius_m, plan)| Flyer {
        time: SimTime::ZERO,
        dt: steps[0],
        steps,
        at: DVec3::from_array(at),
        velocity: DVec3::ZERO,
        came_with: DVec3::ZERO,
        radius_m,
        plan,
    })
}

/// Lets `flyers` fly for a while, each looking at the others as one does, and looks at all pairs beside it.
fn no_near_agent_is_missed(mut flyers: Vec<Flyer>) {
    let mut seen = 0;
    fly(&mut flyers, SimTime::from_nanos(400_000_000), Looks::AsAppointed, |at, all, list| {
        let me = &all[at];
        for (k, other) in all.iter().enumerate().filter(|(k, _)| *k != at) {
            let times = (0..=4).map(|q| me.time + SimSpan::from_nanos(me.dt.as_nanos() * q / 4));
            let near = times.clone().any(|time| me.gap_m(other, time) <= 0.0);
            let listed = list.near().contains(&AgentId(k as u32));
            assert!(listed || !near, "{at} misses {k} at {:?}", me.time);
            seen += u32::from(listed);
        }
        assert!(list.near().is_sorted());
    });
}

proptest! {
    #[test]
    fn every_agent_that_could_touch_within_a_step_is_listed(flyers in prop::collection::vec(flyer(), 2..9)) {
        no_near_agent_is_missed(flyers);
    }
}

/// Each turn with the agents that are near then.
fn near_at_each_turn(flyers: &[Flyer], looks: Looks) -> Vec<(usize, SimTime, Vec<AgentId>)> {
    let mut near = Vec::new();
    fly(&mut flyers.to_vec(), SimTime::from_nanos(400_000_000), looks, |at, all, list| {
        near.push((at, all[at].time, list.near().to_vec()));
    });
    near
}

proptest! {
    #[test]
    fn which_agents_are_near_does_not_depend_on_when_others_are_looked_at(flyers in prop::collection::vec(flyer(), 2..40)) {
        let [appointed, each] = [Looks::AsAppointed, Looks::AtEachTurn].map(|looks| near_at_each_turn(&flyers, looks));
        for (one, other) in appointed.iter().zip(&each) {
            prop_assert_eq!(one, other);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]
    #[test]
    fn every_near_agent_is_listed_among_more_than_the_list_holds(flyers in prop::collection::vec(flyer(), 50..70)) {
        no_near_agent_is_missed(flyers);
    }
}

#[test]
fn memory_per_agent_does_not_grow_with_the_number_of_agents() {
    let dt = SimSpan::from_nanos(4_000_000);
    let held = |count: u32| {
        let broad_phase = BroadPhase::new(count as usize);
        let mut lists: Vec<_> = (0..count).map(AgentId).map(NeighbourList::new).collect();
        let measured = allocation_counter::measure(|| {
            for turn in 0..3_u64 {
                let now = SimTime::from_nanos(turn * dt.as_nanos());
                for (k, list) in lists.iter_mut().enumerate() {
                    // a square of balls that fly at different speeds, six of them near each
                    let at = DVec3::new((k % 40) as f64, (k / 40) as f64, 0.0);
                    let speed_m_s = 1.0 + (k % 7) as f64;
                    list.publish(
                        &broad_phase,
                        Some(&Bounds { low: at, high: at + 0.99, speed_m_s }),
                        PlannedStep { start: now, dt },
                    );
                }
                for list in &mut lists {
                    list.update(&broad_phase, PlannedStep { start: now, dt }, &Membership::default(), |_| true);
                }
            }
        });
        assert!(lists.iter().all(|list| (3..=8).contains(&list.near().len())));
        measured.bytes_current / i64::from(count)
    };
    let [few, many] = [200, 1600].map(held);
    assert!(many <= 1024 && many <= few + 64, "{few} and {many} bytes an agent");
}

#[test]
fn a_longer_step_is_checked_ahead_at_once() {
    let broad_phase = BroadPhase::new(2);
    let ball = |x: f64| Bounds { low: DVec3::X * x, high: DVec3::X * (x + 1.0), speed_m_s: 1.0 };
    let mut list = NeighbourList::new(AgentId(0));
    let step = |start_ns, dt_ns| PlannedStep { start: SimTime::from_nanos(start_ns), dt: SimSpan::from_nanos(dt_ns) };
    list.publish(&broad_phase, Some(&ball(0.0)), step(0, 4_000_000));
    broad_phase.publish(AgentId(1), &ball(2.0), step(0, 4_000_000));
    // a metre at 2 · 2 m/s: a quarter of a second
    list.update(&broad_phase, step(0, 4_000_000), &Membership::default(), |_| true);
    assert!(list.near().is_empty());
    list.update(&broad_phase, step(4_000_000, 250_000_000), &Membership::default(), |_| true);
    assert_eq!(list.near(), [AgentId(1)]);
}

#[test]
fn an_agent_that_is_put_elsewhere_is_found_there_at_once() {
    let broad_phase = BroadPhase::new(2);
    let ball = |x: f64| Bounds { low: DVec3::X * x, high: DVec3::X * (x + 1.0), speed_m_s: 0.5 };
    let mut lists = [0, 1].map(|id| NeighbourList::new(AgentId(id)));
    let dt = SimSpan::from_nanos(4_000_000);
    let step = PlannedStep { start: SimTime::ZERO, dt };
    for (list, x) in lists.iter_mut().zip([0.0, 50.0]) {
        list.publish(&broad_phase, Some(&ball(x)), step);
    }
    for list in &mut lists {
        list.update(&broad_phase, step, &Membership::default(), |_| true);
        assert!(list.near().is_empty());
    }
    // between two steps, as fast as before
    lists[1].publish(&broad_phase, Some(&ball(1.001)), step);
    for list in &mut lists {
        list.update(&broad_phase, step, &Membership::default(), |_| true);
        assert_eq!(list.near().len(), 1);
    }
}

#[test]
fn a_distant_agent_is_never_checked_and_an_approaching_one_is() {
    let lattice = |k: u32| DVec3::new(f64::from(k % 10), f64::from(k / 10 % 10), f64::from(k / 100)) * 10.0;
    let count = 1000;
    let broad_phase = BroadPhase::new(count);
    let ids = || (0..count as u32).map(AgentId);
    let bounds = |at: DVec3, speed_m_s| Bounds { low: at - DVec3::ONE, high: at + DVec3::ONE, speed_m_s };
    let mut lists: Vec<_> = ids().map(NeighbourList::new).collect();
    let dt = SimSpan::from_nanos(4_000_000);
    for (k, list) in lists.iter_mut().enumerate() {
        list.publish(&broad_phase, Some(&bounds(lattice(k as u32), 0.04)), PlannedStep { start: SimTime::ZERO, dt });
    }
    let checks = |lists: &mut [NeighbourList], now: SimTime| -> usize {
        lists
            .iter_mut()
            .map(|list| list.update(&broad_phase, PlannedStep { start: now, dt }, &Membership::default(), |_| true))
            .sum()
    };
    assert_eq!(checks(&mut lists, SimTime::ZERO), count * (count - 1), "all agents at first");
    // 8 m at 2 · 0.0625 m/s is a minute
    for turn in 1..=250_u64 {
        let now = SimTime::from_nanos(turn * dt.as_nanos());
        for (k, list) in lists.iter_mut().enumerate() {
            list.publish(&broad_phase, Some(&bounds(lattice(k as u32), 0.04)), PlannedStep { start: now, dt });
        }
        assert_eq!(checks(&mut lists, now), 0, "turn {turn}");
    }
    let now = SimTime::from_nanos(1_004_000_000);
    lists[0].publish(&broad_phase, Some(&bounds(lattice(1) - DVec3::X * 2.0, 30.0)), PlannedStep { start: now, dt });
    // all agents check the one that has become fast, and it checks all agents
    assert_eq!(checks(&mut lists, now), 2 * (count - 1));
    assert_eq!((lists[1].near(), lists[0].near()), (&[AgentId(0)][..], &[AgentId(1)][..]));
}

#[test]
fn ten_moving_agents_seldom_check_a_thousand_resting_ones() {
    let (dt, count) = (SimSpan::from_nanos(5_000_000), 1010);
    let broad_phase = BroadPhase::new(count);
    let mut lists: Vec<_> = (0..count as u32).map(AgentId).map(NeighbourList::new).collect();
    let half = DVec3::splat(0.25);
    // a floor of flyers, half a metre apart, a metre below the swinging ones
    for (k, list) in lists.iter_mut().enumerate().skip(10) {
        let at = DVec3::new(0.5 * (k % 40) as f64, 0.5 * (k / 40) as f64, -1.5) - half;
        list.publish(
            &broad_phase,
            Some(&Bounds { low: at, high: at + 0.1, speed_m_s: 0.0 }),
            PlannedStep { start: SimTime::ZERO, dt },
        );
        broad_phase.publish_rest(AgentId(k as u32));
    }
    let mut checks = 0;
    for turn in 0..2000_u64 {
        let now = SimTime::from_nanos(turn * dt.as_nanos());
        for (k, list) in lists[..10].iter_mut().enumerate() {
            // a second to and fro, at 2 m/s in the middle
            let phase = std::f64::consts::TAU * now.as_secs_f64() + k as f64;
            let at = DVec3::new(0.315 * libm::sin(phase) + 2.0 * k as f64, 5.0, 0.0);
            let speed_m_s = 0.315 * std::f64::consts::TAU * libm::cos(phase).abs();
            list.publish(
                &broad_phase,
                Some(&Bounds { low: at - half, high: at + half, speed_m_s }),
                PlannedStep { start: now, dt },
            );
            checks += list.update(&broad_phase, PlannedStep { start: now, dt }, &Membership::default(), |_| true);
        }
    }
    // each agent once in 33 turns
    let each = checks as f64 / 20_000.0;
    assert!(each < 40.0, "{each} looks a turn");
}

#[test]
fn an_overrun_log_makes_all_agents_be_checked() {
    let broad_phase = BroadPhase::new(3);
    let mut list = NeighbourList::new(AgentId(0));
    let at = |x: f64, speed_m_s| Bounds { low: DVec3::X * x, high: DVec3::X * (x + 1.0), speed_m_s };
    let dt = SimSpan::from_nanos(1_000_000);
    let step = PlannedStep { start: SimTime::ZERO, dt };
    list.publish(&broad_phase, Some(&at(0.0, 0.0)), step);
    broad_phase.publish(AgentId(1), &at(50.0, 0.0), step);
    list.update(&broad_phase, step, &Membership::default(), |_| true);
    assert!(list.near().is_empty());
    broad_phase.publish(AgentId(1), &at(1.0, 1.0), step);
    for round in 0..LOG_LENGTH {
        // faster and slower again, more than the log holds
        broad_phase.publish(AgentId(2), &at(90.0, if round % 2 == 0 { 64.0 } else { 0.0 }), step);
    }
    list.update(&broad_phase, step, &Membership::default(), |_| true);
    assert_eq!(list.near(), [AgentId(1)]);
}

#[test]
fn a_reported_impulse_is_delivered_once() {
    let broad_phase = BroadPhase::new(200);
    [130, 3, 64, 3].into_iter().for_each(|from| broad_phase.call(AgentId(7), AgentId(from)));
    let visited = |id| {
        let mut visited = Vec::new();
        broad_phase.take_callers(AgentId(id), |caller| visited.push(caller.0));
        visited
    };
    assert!(visited(8).is_empty());
    assert_eq!(visited(7), [3, 64, 130]);
    assert!(visited(7).is_empty());
}

#[test]
fn a_published_speed_is_never_too_small_and_seldom_changes() {
    let (mut published, mut changes) = (0.0, 0);
    // up to 20 m/s and back in small steps
    for k in 0..4000_u32 {
        let speed = f64::from(k.min(4000 - k)) * 0.01;
        let now = published_speed(speed, published);
        assert!(now >= speed && now <= 10.0 * speed.max(SPEED_LEAST_M_S), "{now} for {speed}");
        changes += u32::from(now != published);
        published = now;
    }
    assert!(changes <= 20, "{changes}");
}
