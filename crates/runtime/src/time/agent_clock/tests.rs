//! How an agent goes on: due, late, stretched, at rest.

use super::*;

const fn ms(n: u64) -> Duration {
    Duration::from_millis(n)
}

const fn span_ms(n: u64) -> SimSpan {
    SimSpan::from_nanos(n * 1_000_000)
}

const fn pace(dt_ms: u64) -> AgentClock {
    AgentClock::new(SimTime::ZERO, span_ms(dt_ms))
}

#[test]
fn a_peer_with_news_is_waited_for_and_one_without_for_a_second() {
    let (line, mut pace, mut wall) = (Timeline::new(), pace(4), ms(0));
    for news in 0..1000 {
        assert!(pace.wait(wall, news / 100), "at {wall:?}");
        assert_eq!(pace.due(&line), Some(wall + ms(2)));
        wall += ms(2);
    }
    let since = wall - ms(200);
    while pace.wait(wall, 9) {
        wall += ms(2);
    }
    assert_eq!(wall - since, ms(1000));
    assert!(!pace.wait(wall, 9) && pace.wait(wall, 10), "there is news");
}

#[test]
fn an_agent_near_others_is_offset_and_steps_through_all_of_its_time() {
    // a step of 4 ms that takes 10 ms: peers never see time missing, and it is never late by more than the cap
    let (line, mut pace, mut wall) = (Timeline::new(), pace(4), ms(0));
    for step in 0..1000 {
        assert_eq!(pace.time(), SimTime::ZERO + span_ms(4 * step));
        pace.begin(&line, wall, true);
        pace.advance();
        wall += ms(10);
        assert!(line.sim_at(wall).since(pace.scene_time()) <= SimSpan::from_nanos(520_000_000));
    }
    assert_eq!(pace.dropped(), pace.clock_offset());
    assert!(pace.clock_offset() > span_ms(5400), "of 10 s it lived through 4");
}

#[test]
fn a_change_of_clock_offset_leaves_the_due_time() {
    let (line, mut pace) = (Timeline::new(), pace(4));
    pace.begin(&line, ms(3500), true);
    let (due, dropped) = (pace.due(&line), pace.dropped());
    assert_eq!(pace.set_clock_offset(SimSpan::ZERO), 3.0);
    assert_eq!((pace.time(), pace.clock_offset()), (SimTime::ZERO + span_ms(3000), SimSpan::ZERO));
    assert_eq!(pace.set_clock_offset(span_ms(1000)), -1.0);
    assert_eq!((pace.time(), pace.due(&line), pace.dropped()), (SimTime::ZERO + span_ms(2000), due, dropped));
}

#[test]
fn steps_that_take_longer_than_they_last_grow_until_they_keep_up_and_shrink_again() {
    let (line, mut pace, mut wall) = (Timeline::new(), pace(4), ms(0));
    let mut steps = Vec::new();
    // a step takes 6 ms for a second, then 1 ms
    while wall < ms(3000) {
        wall = wall.max(pace.due(&line).unwrap());
        assert_eq!(pace.begin(&line, wall, false).dropped, SimSpan::ZERO, "at {wall:?}");
        let step = pace.stretch(span_ms(4), &line, wall, false);
        steps.push((wall, step));
        pace.advance_by(step);
        wall += if wall < ms(1000) { ms(6) } else { ms(1) };
    }
    let during = |from: u64, to: u64| steps.iter().filter(move |(at, _)| (ms(from)..ms(to)).contains(at));
    assert!(during(100, 1000).all(|(_, step)| *step >= span_ms(5) && *step <= span_ms(10)));
    assert!(during(2000, 3000).all(|(_, step)| *step == span_ms(4)));
}

#[test]
fn an_agent_on_time_is_due_every_dt_and_drops_nothing() {
    let line = Timeline::new();
    let mut pace = pace(4);
    for k in 0..1000 {
        let due = pace.due(&line).unwrap();
        assert_eq!(due, ms(4 * k));
        assert_eq!(pace.begin(&line, due, false), Start { late: Duration::ZERO, dropped: SimSpan::ZERO });
        pace.advance();
    }
    assert_eq!(pace.dropped(), SimSpan::ZERO);
}

#[test]
fn a_hiccup_within_the_cap_is_made_up_step_by_step() {
    let line = Timeline::new();
    let mut pace = pace(4);
    for _ in 0..20 {
        pace.begin(&line, ms(80), false);
        pace.advance();
    }
    assert_eq!(pace.time(), SimTime::from_nanos(80_000_000));
    assert_eq!(pace.dropped(), SimSpan::ZERO);
}

#[test]
fn a_lag_past_the_cap_is_dropped_and_counted() {
    let line = Timeline::new();
    let mut pace = pace(4);
    let start = pace.begin(&line, ms(500), false);
    assert_eq!(start, Start { late: ms(500), dropped: span_ms(500) });
    assert_eq!(pace.due(&line), Some(ms(500)));
    assert_eq!(pace.dropped(), span_ms(500));
}

#[test]
fn overload_does_not_accumulate_lag() {
    // a step of 4 ms that takes 40 ms: own time + dropped time is always the wall's, and the lag stays capped
    let line = Timeline::new();
    let mut pace = pace(4);
    let mut wall = Duration::ZERO;
    for _ in 0..1000 {
        let start = pace.begin(&line, wall, false);
        assert!(start.late <= LAG_CAP + ms(40), "late {:?}", start.late);
        wall += ms(40);
        pace.advance();
    }
    let stepped = span_ms(4 * 1000);
    assert_eq!(pace.time().since(SimTime::ZERO), stepped + pace.dropped());
    assert!(wall.as_nanos() as u64 - pace.time().as_nanos() <= 140_000_000);
}

proptest::proptest! {
    #[test]
    fn the_lag_stays_capped_and_every_nanosecond_is_stepped_or_dropped_at_any_cost(
        dt_us in 500_u64..200_000,
        costs_us in proptest::collection::vec(0_u64..500_000, 1..200),
    ) {
        let line = Timeline::new();
        let dt = SimSpan::from_nanos(dt_us * 1000);
        let mut pace = AgentClock::new(SimTime::ZERO, dt);
        let cap = LAG_CAP.max(Duration::from_micros(2 * dt_us));
        let (mut wall, mut steps) = (Duration::ZERO, 0);
        for cost in costs_us.iter().copied().map(Duration::from_micros) {
            wall = wall.max(pace.due(&line).unwrap());
            let start = pace.begin(&line, wall, false);
            assert!(start.late - Duration::from_nanos(start.dropped.as_nanos()) <= cap);
            wall += cost;
            pace.advance();
            steps += 1;
        }
        assert_eq!(pace.time().as_nanos(), steps * dt.as_nanos() + pace.dropped().as_nanos());
    }
}

#[test]
fn a_slow_agent_is_not_late_before_two_of_its_steps() {
    let line = Timeline::new();
    let mut pace = pace(200);
    assert_eq!(pace.begin(&line, ms(390), false).dropped, SimSpan::ZERO);
    assert_eq!(pace.begin(&line, ms(401), false).dropped, span_ms(401));
}

#[test]
fn a_shorter_step_than_is_wanted_is_the_step_until_the_next() {
    let mut pace = pace(16);
    pace.shorten(span_ms(16), span_ms(4));
    assert_eq!((pace.dt(), pace.wanted()), (span_ms(4), span_ms(16)));
    pace.set_dt(span_ms(2));
    assert_eq!(pace.dt(), span_ms(2), "who wants less gets less");
    pace.shorten(span_ms(2), span_ms(2));
    pace.set_dt(span_ms(16));
    assert_eq!(pace.dt(), span_ms(16));
}

#[test]
fn time_at_rest_is_not_dropped() {
    let line = Timeline::new();
    let mut pace = pace(4);
    pace.wake(line.wakes_at(ms(900)));
    assert_eq!((pace.rested(), pace.dropped()), (span_ms(900), SimSpan::ZERO));
    assert_eq!(pace.due(&line), Some(ms(900)));
}

#[test]
fn who_wakes_in_a_span_that_waits_for_agents_takes_part_from_its_start() {
    let line =
        Timeline::new().after(ms(100), TimelineCommand::Pause).after(ms(150), TimelineCommand::Leap(span_ms(10)));
    let mut pace = pace(4);
    pace.wake(line.wakes_at(ms(200)));
    assert_eq!(pace.time(), SimTime::from_nanos(100_000_000));
    assert!(pace.due(&line).is_some(), "it steps through the span");
}

#[test]
fn waking_never_turns_an_agent_back() {
    let line = Timeline::new();
    let mut pace = AgentClock::new(SimTime::from_nanos(7_000_000), span_ms(4));
    pace.wake(line.wakes_at(ms(5)));
    assert_eq!(pace.time(), SimTime::from_nanos(7_000_000));
}
