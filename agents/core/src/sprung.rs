//! A rigid body that springs on led points hold, as others expect it.
//!
//! In: what such a body published, a horizon. Out: how it answers impulses and how it goes on, with its springs. Never here:
//! who holds it, contacts. Theory: docs/theory/coupling.md, eq. 7b–7d.
//!
//! A constant acceleration carried on through a stiff spring's period would blow up; a linear model taken implicitly over the
//! horizon cannot, and in a balance of spring and contact it is exact.

use super::spatial::{InverseMass, Mat6, Twist};
use glam::DVec3;

/// What a body on springs publishes beside its mass: forces, and how they change, about its centre of mass in world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sprung {
    /// Springs' force (N) and torque (N·m) on the published state, gravity with them, couplings left out.
    pub force: Twist,
    /// How fast these change because the springs' far ends are led elsewhere, N/s and N·m/s.
    pub rising: Twist,
    /// Stiffness K of all springs together.
    pub stiffness: Mat6,
    /// Damping C of all springs together.
    pub damping: Mat6,
    /// The acceleration of the step that led to this state, what couplings gave left out, m/s² and rad/s².
    pub past: Twist,
    /// The step by which the body goes on, seconds: it takes impulses as (M + h C + h² K)⁻¹ of that step.
    pub span_s: f64,
    /// The most that the springs give, newtons; past it their far ends are held back. Infinite where they give any force.
    pub limit_n: f64,
}

impl Sprung {
    /// (M + h C + h² K)⁻¹: the answer to an impulse of a body whose springs are implicit over `h` seconds (eq. 7b).
    #[must_use]
    pub fn response(&self, inertia: InverseMass, h: f64) -> Mat6 {
        self.resistance(inertia, h).inverse()
    }

    /// M + h C + h² K.
    fn resistance(&self, inertia: InverseMass, h: f64) -> Mat6 {
        let mut whole = Mat6::mass(inertia.linear_per_kg.recip(), inertia.angular_per_kg_m2.inverse());
        whole.add(&self.damping, h);
        whole.add(&self.stiffness, h * h);
        whole
    }

    /// How far a body comes in `h` seconds, and its velocities then, with what is on its way to it: how much that changes
    /// its velocities, and how far it has carried it by now.
    #[must_use]
    pub fn settled(&self, inertia: InverseMass, velocity: Twist, way: [Twist; 2], h: f64) -> [Twist; 2] {
        let mut prediction = SprungPrediction::new(*self, inertia, velocity);
        let [change, carried] = way.map(|impulse| prediction.respond(impulse));
        prediction.deliver(change, carried);
        let way = prediction.go_on(h);
        [[0, 1].map(|i| carried[i] + way[i]), prediction.velocity()]
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let lists = [self.force, self.rising, self.past];
        lists.iter().flatten().all(|v| v.is_finite()) && self.stiffness.is_finite() && self.damping.is_finite()
    }
}

/// A step ends this share of itself early in others' eyes: clocks count whole nanoseconds.
const STEP_SLACK: f64 = 1e-4;

/// A body on springs at a neighbour's own time: how far it is from what it published.
#[derive(Debug, Clone, Copy)]
pub struct SprungPrediction {
    sprung: Sprung,
    inertia: InverseMass,
    /// The horizon of `response`, seconds.
    horizon_s: f64,
    response: Mat6,
    /// How long until the published state, seconds; below zero it is past.
    until_published_s: f64,
    velocity: Twist,
    /// By how much place and velocity differ from the published ones, or, before those are reached, from the way to them.
    displacement: Twist,
    velocity_change: Twist,
    /// What impulses that last have just added to the velocity: as long as the next stretch does, so they carry half as far.
    fresh: Twist,
    /// The acceleration with which the body makes its next step, and how long after the published state that ends, seconds.
    steady: Option<(Twist, f64)>,
    /// Whether a blow meets it: in no time a drive of limited force gives nothing, and its mass alone answers.
    in_impact: bool,
}

impl SprungPrediction {
    /// A body that is where it said to be.
    pub fn new(sprung: Sprung, inertia: InverseMass, velocity: Twist) -> Self {
        let none = [DVec3::ZERO; 2];
        let (horizon_s, response) = (sprung.span_s, sprung.response(inertia, sprung.span_s));
        Self {
            sprung,
            inertia,
            horizon_s,
            response,
            until_published_s: 0.0,
            velocity,
            displacement: none,
            velocity_change: none,
            fresh: none,
            steady: None,
            in_impact: false,
        }
    }

    /// A blow begins or ends (eq. 9h).
    pub fn strike(&mut self, in_impact: bool) {
        self.in_impact = in_impact && self.sprung.limit_n.is_finite();
    }

    /// Takes impulses that last for `h` seconds, or for the body's own step where that is longer, from now on.
    pub fn foresee(&mut self, h: f64) {
        let h = h.max(self.sprung.span_s);
        self.limit_force(h);
        if h != self.horizon_s {
            (self.horizon_s, self.response) = (h, self.sprung.response(self.inertia, h));
        }
    }

    /// Springs that would have to give more than they can in the next `h` seconds give that and no more, however far the body goes
    /// (eq. 9f).
    fn limit_force(&mut self, h: f64) {
        let limit_n = self.sprung.limit_n;
        let pull = if limit_n.is_finite() { self.pull(h)[0] } else { DVec3::ZERO };
        if pull.length() <= limit_n {
            return;
        }
        let none = [DVec3::ZERO; 2];
        self.sprung.force = [pull.clamp_length_max(limit_n), DVec3::ZERO];
        (self.sprung.rising, self.sprung.stiffness) = (none, Mat6::ZERO);
        (self.displacement, self.velocity_change, self.fresh, self.steady) = (none, none, none, None);
        (self.horizon_s, self.response) = (h, self.sprung.response(self.inertia, h));
    }

    /// The velocities that an impulse causes.
    pub fn respond(&self, impulse: Twist) -> Twist {
        if self.in_impact {
            [impulse[0] * self.inertia.linear_per_kg, self.inertia.angular_per_kg_m2 * impulse[1]]
        } else {
            self.response.times(impulse)
        }
    }

    /// The inverse mass (1/kg) and the mean inverse inertia (1/(kg·m²)) with which it answers.
    pub fn mobility(&self) -> [f64; 2] {
        if self.in_impact {
            let turning = self.inertia.angular_per_kg_m2;
            return [self.inertia.linear_per_kg, (turning.x_axis.x + turning.y_axis.y + turning.z_axis.z) / 3.0];
        }
        let a = &self.response.0;
        [(a[0][0] + a[1][1] + a[2][2]) / 3.0, (a[3][3] + a[4][4] + a[5][5]) / 3.0]
    }

    /// The mean acceleration of the next `h` seconds (eq. 7c).
    pub fn acceleration(&self, h: f64) -> Twist {
        if self.is_behind(h) {
            return self.sprung.past;
        }
        let ahead = self.ahead(h);
        if self.until_published_s <= 0.0 {
            return ahead;
        }
        // the force of the step that is under way, answered like any other over this horizon
        let force = self.sprung.resistance(self.inertia, self.sprung.span_s).times(self.sprung.past);
        let (behind, share) = (self.response.times(force), self.until_published_s / h);
        [0, 1].map(|i| behind[i] * share + ahead[i] * (1.0 - share))
    }

    /// Whether the published state is still to come after `h` seconds.
    fn is_behind(&self, h: f64) -> bool {
        self.until_published_s > 0.0 && self.until_published_s >= h
    }

    /// The mean acceleration past the published state.
    fn ahead(&self, h: f64) -> Twist {
        let since = (-self.until_published_s).max(0.0);
        if let Some((a, _)) = self.steady.filter(|(_, until)| since < *until && self.horizon_s <= self.sprung.span_s) {
            return a;
        }
        self.response.times(self.pull(h))
    }

    /// The force of the springs at the end of the next `h` seconds, had nothing else changed the velocities by then.
    fn pull(&self, h: f64) -> Twist {
        let Self { sprung, displacement, .. } = self;
        let since = (-self.until_published_s).max(0.0);
        // what the body took ahead will have been given by the time of its state
        let there = if self.until_published_s > 0.0 { 0.0 } else { 1.0 };
        let without = |all: &Twist| [0, 1].map(|i| all[i] - self.fresh[i]);
        let pulled = sprung.stiffness.times(displacement.map(|x| x * there));
        let damped = sprung.damping.times(without(&self.velocity_change).map(|v| v * there));
        let falling = sprung.stiffness.times(without(&self.velocity));
        let late = h.max(self.horizon_s);
        let force =
            |i: usize| sprung.force[i] + sprung.rising[i] * (since + late) - pulled[i] - damped[i] - falling[i] * late;
        [0, 1].map(force)
    }

    /// Adds to its velocities what an impulse has caused, which `lasts` through the next stretch or was a blow.
    pub fn push(&mut self, change: Twist, lasts: bool) {
        add(&mut self.velocity, change, 1.0);
        add(&mut self.velocity_change, change, 1.0);
        add(&mut self.fresh, change, if lasts { 1.0 } else { 0.0 });
    }

    /// Adds what impulses on their way have done meanwhile.
    pub fn deliver(&mut self, change: Twist, way: Twist) {
        add(&mut self.velocity, change, 1.0);
        add(&mut self.velocity_change, change, 1.0);
        add(&mut self.displacement, way, 1.0);
    }

    /// Lets `h` seconds pass, back where `h` is below zero: how far it comes (eq. 7d).
    pub fn go_on(&mut self, h: f64) -> Twist {
        if h > self.horizon_s {
            self.foresee(h);
        }
        let past = h < 0.0 || self.is_behind(h);
        let a = if h < 0.0 { self.sprung.past } else { self.acceleration(h) };
        self.keep_acceleration(a, h);
        let mut way = [DVec3::ZERO; 2];
        add(&mut way, self.velocity, h);
        add(&mut way, self.fresh, -0.5 * h);
        add(&mut way, a, 0.5 * h * h);
        if past {
            add(&mut self.displacement, self.velocity_change, h);
            add(&mut self.displacement, self.fresh, -0.5 * h);
        } else {
            add(&mut self.displacement, way, 1.0);
            add(&mut self.velocity_change, a, h);
        }
        add(&mut self.velocity, a, h);
        self.until_published_s -= h;
        self.fresh = [DVec3::ZERO; 2];
        way
    }

    /// Past the published state the body itself keeps one acceleration for a whole step.
    fn keep_acceleration(&mut self, a: Twist, h: f64) {
        let since = -self.until_published_s;
        let over = self.steady.is_none_or(|(_, until)| since >= until);
        if h > 0.0 && since >= 0.0 && over {
            self.steady = Some((a, since + (1.0 - STEP_SLACK) * self.sprung.span_s));
        }
    }

    /// Its own step, seconds.
    pub fn span_s(&self) -> f64 {
        self.sprung.span_s
    }

    /// Its velocity and spin.
    pub fn velocity(&self) -> Twist {
        self.velocity
    }
}

/// Adds `what` times `factor`.
fn add(to: &mut Twist, what: Twist, factor: f64) {
    to.iter_mut().zip(what).for_each(|(sum, x)| *sum += x * factor);
}
