//! Published bounds of each agent, readable by all without waiting.
//!
//! In: one agent's box at a time, from the thread that makes its turns. Out: complete boxes, or none while one is being written: the reader
//! must then assume the worst case ([`Seqlock`]).
//! Never here: which agents are near each other.

use crate::lock_free::seqlock::{ReadOutcome, Seqlock};
use glam::DVec3;
use metachron_core::SimTime;

/// A box around an agent's matter at one moment, and how fast it may grow in every direction after and before it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct MovingBox {
    /// Least coordinates, metres.
    pub low: DVec3,
    /// Greatest coordinates, metres.
    pub high: DVec3,
    /// An upper bound of the speed of all its points, m/s; zero at rest.
    pub speed_m_s: f64,
    /// No step to it or from it is longer, s; a longer one is logged when it is made.
    pub step_s: f64,
    /// The moment, in the agent's own time.
    pub time: SimTime,
}

impl MovingBox {
    /// Whether matter in this box may be in the `later` one by its time, as fast as was published and after one step at most.
    pub fn leads_to(&self, later: &Self) -> bool {
        let age_s = later.time.secs_after(self.time);
        let way_m = self.speed_m_s * age_s;
        let is_inside = (self.low - way_m).cmple(later.low).all() && (self.high + way_m).cmpge(later.high).all();
        (0.0..=self.step_s).contains(&age_s) && is_inside
    }

    /// The distance between two boxes, metres; zero where they overlap.
    pub fn gap_m(&self, other: &Self) -> f64 {
        self.gap_vector(other).length()
    }

    /// Distance of the boxes along each axis, unsigned, metres; zero where they overlap.
    pub fn gap_vector(&self, other: &Self) -> DVec3 {
        (other.low - self.high).max(self.low - other.high).max(DVec3::ZERO)
    }
}

/// Result of a read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ReadBounds {
    /// Nothing was ever written.
    Unpublished,
    /// The newest complete box.
    Known(MovingBox),
    /// A writer is in the middle of a write.
    Changing,
}

/// One agent's box in shared memory: a cache line of its own, so that writers do not disturb each other's readers.
#[derive(Debug, Default)]
#[repr(align(64))]
pub(super) struct PublishedBounds(Seqlock<5>);

/// A box as it is stored.
pub(super) type BoxWords = [u64; 5];

/// Read attempts while a box is being written. A write takes 10 ns.
const TRIES: u32 = 8;

impl PublishedBounds {
    /// The last written box, for its writer.
    pub fn mine(&self) -> Option<MovingBox> {
        if let ReadBounds::Known(reach) = self.read() { Some(reach) } else { None }
    }

    /// Writes `reach`; from one thread at a time. Numbers are rounded outwards to 24 bits.
    pub fn write(&self, reach: &MovingBox) {
        self.0.write(words(reach));
    }

    /// The box, to the bit; `None` where none was ever written. Called between turns.
    pub fn words(&self) -> Option<BoxWords> {
        if let ReadOutcome::Complete(words) = self.0.read() { Some(words) } else { None }
    }

    /// Puts that in its place; called between turns.
    pub fn set_words(&self, words: Option<BoxWords>) {
        words.map_or_else(|| self.0.clear(), |words| self.0.write(words));
    }

    /// Forgets it; called between turns.
    pub fn clear(&self) {
        self.0.clear();
    }

    /// The last written box.
    pub fn read(&self) -> ReadBounds {
        for _ in 0..TRIES {
            match self.0.read() {
                ReadOutcome::Empty => return ReadBounds::Unpublished,
                ReadOutcome::Complete(words) => return ReadBounds::Known(reach(words)),
                ReadOutcome::Torn => {}
            }
        }
        ReadBounds::Changing
    }
}

fn words(reach: &MovingBox) -> BoxWords {
    let (low, high) = (reach.low, reach.high);
    [
        pair(down(low.x), down(low.y)),
        pair(down(low.z), up(high.x)),
        pair(up(high.y), up(high.z)),
        pair(up(reach.step_s), up(reach.speed_m_s)),
        reach.time.as_nanos(),
    ]
}

fn reach([a, b, c, rates, time]: BoxWords) -> MovingBox {
    let first = |word: u64| f64::from(f32::from_bits((word >> 32) as u32));
    let second = |word: u64| f64::from(f32::from_bits(word as u32));
    MovingBox {
        low: DVec3::new(first(a), second(a), first(b)),
        high: DVec3::new(second(b), first(c), second(c)),
        speed_m_s: second(rates),
        step_s: first(rates),
        time: SimTime::from_nanos(time),
    }
}

fn pair(first: f32, second: f32) -> u64 {
    (u64::from(first.to_bits()) << 32) | u64::from(second.to_bits())
}

/// The greatest number of 24 bits that is not above `x`.
fn down(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) > x { near.next_down() } else { near }
}

/// The least number of 24 bits that is not below `x`.
fn up(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) < x { near.next_up() } else { near }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicBool, Ordering};

    #[test]
    fn a_box_read_contains_the_box_written() {
        let published = PublishedBounds::default();
        assert_eq!(published.read(), ReadBounds::Unpublished);
        let third = DVec3::new(1.0 / 3.0, -1.0 / 3.0, 1e-9);
        let time = SimTime::from_nanos(u64::MAX - 1);
        let written = MovingBox { low: -third, high: third * 2.0, speed_m_s: 0.1, step_s: 0.3, time };
        published.write(&written);
        let read = published.mine().unwrap();
        assert!(read.low.cmple(written.low).all() && read.high.cmpge(written.high).all());
        assert!(read.speed_m_s >= 0.1 && read.step_s >= 0.3 && read.time == time);
        // 24 bits: half a unit in the last place of 1/3 and of 0.1
        assert!((read.low - written.low).length() < 1e-7 && read.speed_m_s < 0.1 + 1e-8);
    }

    #[test]
    fn a_reader_never_sees_half_of_a_writing() {
        let published = PublishedBounds::default();
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let reader = scope.spawn(|| {
                let (mut last, mut reads) = (0.0, 0);
                while !done.load(Ordering::Acquire) || reads == 0 {
                    let Some(seen) = published.mine() else { continue };
                    let value = seen.low.x;
                    assert_eq!((seen.low, seen.high), (DVec3::splat(value), DVec3::splat(value)), "torn");
                    assert_eq!((seen.speed_m_s, seen.time), (value, SimTime::from_nanos(value as u64)), "torn");
                    assert!(value >= last);
                    (last, reads) = (value, reads + 1);
                }
            });
            // whole numbers below 2²⁴ have 24 bits
            for k in 1..=200_000_u32 {
                let at = DVec3::splat(f64::from(k));
                let time = SimTime::from_nanos(u64::from(k));
                published.write(&MovingBox { low: at, high: at, speed_m_s: f64::from(k), step_s: 1.0, time });
            }
            done.store(true, Ordering::Release);
            reader.join().unwrap();
        });
    }
}
