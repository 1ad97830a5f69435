//! The cheapest settings within a tolerance: object by object, longer steps and fewer pieces as long as the error stays within it.
//!
//! In: the options, a setting within the tolerance, a function that tries one. Out: the cheapest setting found within the tolerance. Never
//! here: the content of a trial, the measurement of its error.

/// How one object is simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// Length of a step, seconds.
    pub dt_s: f64,
    /// Number of pieces that the object's length is divided into; zero if it is not divided.
    pub pieces: u32,
    /// Number of the integrator among the allowed ones.
    pub method: usize,
}

/// The options for one object.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The longest step, seconds; the present one if it may not change.
    pub dt_max_s: f64,
    /// The fewest pieces.
    pub pieces_min: u32,
    /// The integrators, by number, that may be tried.
    pub methods: Vec<usize>,
}

/// The result of a trial.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trial {
    /// Distance from the converged answer, metres; infinite if the run failed.
    pub error_m: f64,
    /// Cost of each object, seconds of one core per simulated second.
    pub costs_s: Vec<f64>,
}

/// Tries settings of all objects; `None` if it was stopped.
pub type Try<'a> = &'a mut dyn FnMut(&[Setting]) -> Option<Trial>;

/// A search with its parameters.
pub struct Search<'a> {
    /// The options, object by object.
    pub choices: &'a [Choice],
    /// The greatest allowed error, metres.
    pub tolerance_m: f64,
    /// The greatest number of trials.
    pub trials_max: u32,
    /// The function that tries a setting.
    pub attempt: Try<'a>,
}

/// The result of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The cheapest settings within the tolerance.
    pub settings: Vec<Setting>,
    /// The trial of these settings.
    pub trial: Trial,
    /// Number of settings tried.
    pub tried: u32,
    /// Whether the search was stopped, or ran out of trials, before its end.
    pub cut_short: bool,
}

/// Factors by which steps and pieces are changed, the coarse one first.
const FACTORS: [f64; 2] = [2.0, std::f64::consts::SQRT_2];
/// A change that saves less than this share is not taken.
const SAVING_MIN: f64 = 0.02;
/// Two costs within this share of each other count as equal: the smaller error decides.
const ALIKE: f64 = 0.25;

impl Trial {
    /// Cost of all objects together.
    #[must_use]
    pub fn cost_s(&self) -> f64 {
        self.costs_s.iter().sum()
    }
}

impl Search<'_> {
    /// Finds the cheapest settings from `start`, whose result `trial` is within the tolerance.
    pub fn run(mut self, start: Vec<Setting>, trial: Trial) -> Found {
        let mut order: Vec<usize> = (0..start.len()).collect();
        order.sort_by(|a, b| trial.costs_s[*b].total_cmp(&trial.costs_s[*a]));
        let first = start.clone();
        let mut best = Found { settings: start, trial, tried: 0, cut_short: false };
        for object in order {
            self.fit(object, first[object], &mut best);
        }
        best
    }

    /// Finds the cheapest setting of one object while the others stay as they are.
    fn fit(&mut self, object: usize, start: Setting, best: &mut Found) {
        self.descend(object, best);
        let own = best.settings[object].method;
        for &method in self.choices[object].methods.iter().filter(|method| **method != own) {
            let mut settings = best.settings.clone();
            // another integrator may allow longer steps; it starts from the scene's setting
            settings[object] = Setting { method, ..start };
            let Some(trial) = self.attempt(&settings, best) else { return };
            if trial.error_m > self.tolerance_m {
                continue;
            }
            let mut other = Found { settings, trial, ..best.clone() };
            self.descend(object, &mut other);
            (best.tried, best.cut_short) = (other.tried, other.cut_short);
            if other.trial.cost_s() < (1.0 - SAVING_MIN) * best.trial.cost_s() {
                *best = other;
            }
        }
    }

    /// Takes longer steps and fewer pieces for one object as long as that is cheaper and within the tolerance.
    fn descend(&mut self, object: usize, best: &mut Found) {
        for factor in FACTORS {
            while let Some((settings, trial)) = self.coarser(object, factor, best) {
                (best.settings, best.trial) = (settings, trial);
            }
        }
    }

    /// The better of the two remaining moves of an object, if one is within the tolerance and cheaper.
    fn coarser(&mut self, object: usize, factor: f64, best: &mut Found) -> Option<(Vec<Setting>, Trial)> {
        let mut found: Option<(Vec<Setting>, Trial)> = None;
        for setting in self.choices[object].moves(best.settings[object], factor) {
            let mut settings = best.settings.clone();
            settings[object] = setting;
            let trial = self.attempt(&settings, best)?;
            let holds = trial.error_m <= self.tolerance_m;
            if !holds || trial.cost_s() > (1.0 - SAVING_MIN) * best.trial.cost_s() {
                continue;
            }
            if found.as_ref().is_none_or(|(_, other)| trial.is_better_than(other)) {
                found = Some((settings, trial));
            }
        }
        found
    }

    fn attempt(&mut self, settings: &[Setting], best: &mut Found) -> Option<Trial> {
        if best.cut_short || best.tried >= self.trials_max {
            best.cut_short = true;
            return None;
        }
        best.tried += 1;
        let trial = (self.attempt)(settings);
        best.cut_short |= trial.is_none();
        trial
    }
}

impl Trial {
    fn is_better_than(&self, other: &Self) -> bool {
        let ratio = self.cost_s() / other.cost_s();
        if (1.0 - ALIKE..=1.0 / (1.0 - ALIKE)).contains(&ratio) { self.error_m < other.error_m } else { ratio < 1.0 }
    }
}

impl Choice {
    /// The possible moves: a longer step, and fewer pieces.
    fn moves(&self, now: Setting, factor: f64) -> impl Iterator<Item = Setting> + use<> {
        let dt_s = rounded(now.dt_s * factor).min(self.dt_max_s);
        let pieces = (f64::from(now.pieces) / factor).ceil() as u32;
        let longer = (dt_s > now.dt_s * 1.01).then_some(Setting { dt_s, ..now });
        let fewer =
            (now.pieces > 0 && pieces >= self.pieces_min && pieces < now.pieces).then_some(Setting { pieces, ..now });
        longer.into_iter().chain(fewer)
    }
}

/// A step rounded to three digits, for readability.
fn rounded(dt_s: f64) -> f64 {
    let unit = 10_f64.powi(dt_s.log10().floor() as i32 - 2);
    (dt_s / unit).round() * unit
}
