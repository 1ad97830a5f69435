//! Wave variables (transmission-line model): an elastic line between two agents with delayed exchange, passive for any delay.
//!
//! In: the waves that the other end has sent. Out: the wave that arrives during a step, and the wave that this end sends. Never here:
//! where the line is attached. Theory: docs/theory/coupling.md.
//!
//! An end that pushes into the line by f and moves with v sends w = f + Z v; after the delay T the other end receives c = −w and
//! has f = Z v + c. Z = k T, so the line has a mass k T² of its own. Each end publishes the time integral of the wave it sent:
//! lost readings lose nothing, double readings repeat nothing, and averages over a step only dissipate.

use glam::DVec3;
use metachron_core::{SimSpan, SimTime, Wave};
use std::collections::VecDeque;

/// One end of a link, as a row of a problem sees it during a step.
#[derive(Debug, Clone, Copy)]
pub struct LineStep {
    /// When the step begins.
    pub at: SimTime,
    /// How long it is, seconds, > 0.
    pub dt_s: f64,
    /// Velocity of the other end as far as it is known, m/s.
    pub far_m_s: DVec3,
    /// Vector from here to the other end, metres.
    pub way: DVec3,
    /// The arriving wave, N.
    pub arriving: DVec3,
    /// Rest length: the distance at which the link exerts no force, metres, ≥ 0.
    pub rest_m: f64,
    /// Damping parallel to the line, N·s/m, ≥ 0.
    pub damping_n_s_m: f64,
}

/// The law of one end during a step: the force on it is `drive_n` less `resistance_n_s_m` times its velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineLaw {
    /// The force on an end that does not move, N.
    pub drive_n: DVec3,
    /// Impedance and damping, N·s/m, ≥ 0.
    pub resistance_n_s_m: f64,
    /// The direction in which a link with a rest length acts; `None` for all.
    pub along: Option<DVec3>,
    /// The part of the arriving wave that the line reflects, N.
    pub arriving: DVec3,
}

/// One end of a line.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Line {
    stiffness_n_m: f64,
    delay_s: f64,
    /// (time, ∫ w dt) of the other end, by rising times.
    received: VecDeque<(SimTime, DVec3)>,
    /// How much of the other end's integral has arrived here.
    arrived: DVec3,
    /// The same at the end of the step in progress.
    #[serde(skip)]
    arriving: Option<DVec3>,
    sent: DVec3,
    start: DVec3,
    since: SimTime,
}

/// Whose time goes back by more than this calls it another now; less is a message that came late, seconds.
const MEETS_S: f64 = 0.1;
/// The most states of the other end that are stored: those of one delay, at a hundred times this end's rate.
const RECEIVED_MAX: usize = 256;
/// The delay is this many of the longer of both sides' steps: one for publication, one for a lost or late message.
const DELAY_STEPS: f64 = 2.0;

impl Line {
    /// An end of a line of `stiffness_n_m`, N/m, > 0, that has no delay yet.
    #[must_use]
    pub fn new(stiffness_n_m: f64) -> Self {
        Self { stiffness_n_m, ..Self::default() }
    }

    /// Stores the wave that the other end published at its time `at`. The end that `decides` chooses the delay from its own step of
    /// `dt_s` and the other's step; the other end adopts it.
    pub fn receive(&mut self, at: SimTime, wave: Option<Wave>, decides: bool, dt_s: f64) {
        let wave = wave.unwrap_or_default();
        let sane = wave.sent.is_finite() && wave.start.is_finite();
        let age_s = self.received.back().map_or(-1.0, |&(last, _)| last.secs_after(at));
        if (0.0..=MEETS_S).contains(&age_s) || !sane {
            return;
        }
        if age_s > MEETS_S {
            // not an old message: the other end has renamed its time
            self.received.clear();
        }
        if self.delay_s == 0.0 {
            let other_step_s = self.received.back().map(|&(last, _)| at.secs_after(last));
            self.delay_s = match other_step_s {
                Some(other_step_s) if decides => DELAY_STEPS * other_step_s.max(dt_s),
                _ if decides => 0.0,
                _ => wave.delay_s,
            };
            if decides {
                // by then the other end has received the delay
                self.since += SimSpan::from_secs_f64(2.0 * self.delay_s).unwrap_or(SimSpan::ZERO);
            } else {
                (self.start, self.since) = (-wave.start, wave.since);
            }
            self.received.clear();
            self.arrived = wave.sent;
        }
        if self.received.len() == RECEIVED_MAX {
            self.received.pop_front();
        }
        self.received.push_back((at, wave.sent));
    }

    /// At the end that decides: stores `way`, the vector to the other end in metres, when the line is made, in its step from `at` on.
    pub fn begin(&mut self, way: DVec3, at: SimTime) {
        if self.delay_s == 0.0 {
            (self.start, self.since) = (way, at);
        }
    }

    /// The law of one end of a link on this line.
    ///
    /// The line carries the changes since it was made; its stretch at that time acts as a constant force. Without a rest
    /// length the link is isotropic, else it acts along itself.
    #[must_use]
    pub fn law(&self, end: &LineStep) -> LineLaw {
        let axis = end.way.normalize_or_zero();
        let along = (end.rest_m > 0.0).then_some(axis);
        let part = |v: DVec3| along.map_or(v, |axis| axis * axis.dot(v));
        let acting_share = (1.0 - self.since.secs_after(end.at) / end.dt_s).clamp(0.0, 1.0);
        let stiffness = if self.delay_s > 0.0 { acting_share * self.stiffness_n_m } else { 0.0 };
        let start = if end.rest_m > 0.0 { axis * (self.start.length() - end.rest_m) } else { self.start };
        let arriving = part(end.arriving);
        LineLaw {
            drive_n: start * stiffness - arriving + part(end.far_m_s) * end.damping_n_s_m,
            resistance_n_s_m: self.impedance() + end.damping_n_s_m,
            along,
            arriving,
        }
    }

    /// Sends the response of an end that got `force` in the mean of a step of `h` seconds, newtons.
    pub fn answer(&mut self, law: &LineLaw, force: DVec3, h: f64) {
        if law.resistance_n_s_m > 0.0 {
            let velocity = (law.drive_n - force) / law.resistance_n_s_m;
            self.send(law.arriving, velocity * self.impedance() + law.arriving, h);
        }
    }

    /// Begins a step: one that was begun before and not made has received nothing.
    pub const fn open(&mut self) {
        self.arriving = None;
    }

    /// Takes over the wave that [`Self::arriving`] found, as the step is made.
    pub fn settle(&mut self) {
        self.arrived = self.arriving.take().unwrap_or(self.arrived);
    }

    /// The average of the wave that arrives in the `h` seconds from `at` on, N: c of the line. Zero before the delay is known.
    ///
    /// Where the wave of that time is not known yet, the last known value is held; the integral makes up for it later. It has arrived with
    /// [`Self::settle`].
    pub fn arriving(&mut self, at: SimTime, h: f64) -> DVec3 {
        if self.delay_s == 0.0 {
            return DVec3::ZERO;
        }
        let now = self.integral(at, h - self.delay_s);
        self.arriving = Some(now);
        (self.arrived - now) / h
    }

    /// Sends the response to `arriving`, where this end pushed into the line by `force` (N) for `h` seconds.
    pub fn send(&mut self, arriving: DVec3, force: DVec3, h: f64) {
        self.sent += (force * 2.0 - arriving) * h;
    }

    /// The data that this end publishes.
    #[must_use]
    pub const fn wave(&self) -> Wave {
        Wave { sent: self.sent, delay_s: self.delay_s, start: self.start, since: self.since }
    }

    /// Z = k T, N·s/m.
    #[must_use]
    pub const fn impedance(&self) -> f64 {
        self.stiffness_n_m * self.delay_s
    }

    /// The line's own mass, kg: k T².
    #[must_use]
    pub const fn parasitic_kg(&self) -> f64 {
        self.stiffness_n_m * self.delay_s * self.delay_s
    }

    /// The other end's ∫ w dt at `after_s` seconds after `at`, interpolated between received values.
    fn integral(&self, at: SimTime, after_s: f64) -> DVec3 {
        let Some(&(first, start)) = self.received.front() else { return self.arrived };
        let when = |t: SimTime| t.secs_after(at) - after_s; // seconds past the requested time
        if when(first) >= 0.0 || self.received.len() == 1 {
            return start;
        }
        let after = self.received.partition_point(|&(t, _)| when(t) < 0.0).min(self.received.len() - 1);
        let ((t0, w0), (t1, w1)) = (self.received[after - 1], self.received[after]);
        w0 + (w1 - w0) * (-when(t0) / t1.secs_after(t0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two bodies of 1 kg on a line, stepped at the same clock or at different ones: the stretch over time.
    fn swing(stiffness: f64, steps: [f64; 2], seconds: f64) -> Vec<(f64, f64, f64)> {
        let mut lines = [Line::new(stiffness), Line::new(stiffness)];
        let (mut x, mut v, mut t) = ([0.0, 0.0], [0.0, 0.1], [SimTime::ZERO; 2]);
        let mut shown = [(SimTime::ZERO, None); 2];
        let mut path = vec![];
        while t[0].as_secs_f64() < seconds {
            let i = usize::from(t[1] < t[0]);
            let (h, other) = (steps[i], 1 - i);
            lines[i].receive(shown[other].0, shown[other].1, i == 0, h);
            let c = lines[i].arriving(t[i], h);
            // a step that is begun again reads the same
            lines[i].open();
            assert_eq!(lines[i].arriving(t[i], h), c);
            lines[i].settle();
            let z = lines[i].impedance();
            let force = (c.x + z * v[i]) / (1.0 + z * h); // of 1 kg
            lines[i].send(c, DVec3::X * force, h);
            v[i] -= force * h;
            x[i] += v[i] * h;
            t[i] += SimSpan::from_secs_f64(h).unwrap();
            shown[i] = (t[i], Some(lines[i].wave()));
            if i == 1 {
                path.push((t[1].as_secs_f64(), x[1] - x[0], 0.5 * (v[0] * v[0] + v[1] * v[1])));
            }
        }
        path
    }

    #[test]
    fn a_line_swings_at_the_frequency_of_its_spring_and_mass() {
        // k T² = 0.004² · 100 = 1.6e-3 kg, small against 1 kg
        let path = swing(100.0, [0.002, 0.002], 1.0);
        let turned = path.windows(2).find(|w| w[1].1 < w[0].1).unwrap()[0].0;
        let quarter = std::f64::consts::FRAC_PI_2 / (2.0_f64 * 100.0).sqrt();
        assert!((turned / quarter - 1.0).abs() < 0.1, "{turned} s for {quarter} s"); // the delay enters at first order
    }

    #[test]
    fn a_line_never_gains_energy_whatever_the_steps() {
        for steps in [[0.001, 0.001], [0.001, 0.016], [0.016, 0.001], [0.003, 0.1], [0.1, 0.003]] {
            for stiffness in [1.0, 1e3, 1e6] {
                let most = swing(stiffness, steps, 5.0).iter().map(|p| p.2).fold(0.0, f64::max);
                assert!(most < 0.005 * 1.01, "{steps:?}, {stiffness} N/m: {most} J of 0.005");
            }
        }
    }
}
