//! An agent with declared cost and error curves and no matter, for controllers and tests.
//!
//! In: two power laws and their range of spacings. Out: work in microseconds, a residual in metres.
//! Never here: a clock. A step burns its cost in arithmetic, so its microseconds are nominal: see [`Synthetic`].

use metachron_contact::{Agent, Input, Inputs, OwnSteps, StepContext, Stepping};
use metachron_core::{
    Archive, ArchiveError, Body, Resolution, ResolutionRange, SimSpan, Snapshot, StepError, StepReport, archive_values,
    check_span,
};

/// A synthetic agent: cost per step = `cost_us · (eps_ref / ε)^cost_order`, error = `error_m · (ε / eps_ref)^error_order`,
/// with `eps_ref` the coarsest spacing of its range.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "schema", derive(serde::Deserialize, schemars::JsonSchema))]
pub struct SyntheticSpec {
    /// Cost of one step at the coarsest `eps_m`, microseconds.
    pub cost_us: f64,
    /// How the cost rises with refinement: cost · (coarsest / ε)^order. Default 1.
    #[cfg_attr(feature = "schema", serde(default = "linear"))]
    pub cost_order: f64,
    /// Error at the coarsest `eps_m`, metres. Default 0.
    #[cfg_attr(feature = "schema", serde(default))]
    pub error_m: f64,
    /// How the error falls with refinement: error · (ε / coarsest)^order. Default 2.
    #[cfg_attr(feature = "schema", serde(default = "quadratic"))]
    pub error_order: f64,
}

/// Default orders, of cost and of error.
#[cfg(feature = "schema")]
const fn linear() -> f64 {
    1.0
}

#[cfg(feature = "schema")]
const fn quadratic() -> f64 {
    2.0
}

/// Why a synthetic agent cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SyntheticError {
    /// A number of the curves is negative or not finite.
    #[error("the synthetic agent's {what} is {value}; expected finite and not negative")]
    BadNumber {
        /// Name of the number.
        what: &'static str,
        /// The value given.
        value: f64,
    },
    /// The range of spacings is empty, or its finest end is not above zero.
    #[error("the synthetic agent's spacings are {finest_m} … {coarsest_m} m; expected finite, above 0 and rising")]
    BadRange {
        /// Finest spacing given.
        finest_m: f64,
        /// Coarsest spacing given.
        coarsest_m: f64,
    },
}

/// A synthetic agent that advances by its own steps.
///
/// Its microseconds are nominal: for each of them a step does a fixed count of dependent multiplications, which take one
/// microsecond on a core near 3 GHz, more on a slower one. That keeps the agent deterministic and free of a clock.
#[derive(Debug, Clone)]
pub struct Synthetic {
    spec: SyntheticSpec,
    range: ResolutionRange,
    resolution: Resolution,
    does_work: bool,
    sink: u64,
}

/// Links of the burning chain per nominal microsecond: a 64-bit multiply and an add take 4 cycles, 3 GHz gives 750.
const LINKS_PER_US: f64 = 750.0;
/// The highest cost of a step, microseconds: past it an agent does nothing else.
const COST_MAX_US: f64 = 1e6;

impl Synthetic {
    /// An agent with the curves of `spec` over `range`, at the spacing nearest to `start`.
    ///
    /// # Errors
    /// [`SyntheticError`] for a curve with a negative or non-finite number and for an empty range.
    pub fn new(spec: SyntheticSpec, range: ResolutionRange, start: Resolution) -> Result<Self, SyntheticError> {
        let numbers = [
            ("cost", spec.cost_us),
            ("order of the cost", spec.cost_order),
            ("error", spec.error_m),
            ("order of the error", spec.error_order),
        ];
        for (what, value) in numbers {
            if !(value.is_finite() && value >= 0.0) {
                return Err(SyntheticError::BadNumber { what, value });
            }
        }
        let (finest_m, coarsest_m) = range.eps_m;
        if !(finest_m > 0.0 && finest_m <= coarsest_m && coarsest_m.is_finite()) {
            return Err(SyntheticError::BadRange { finest_m, coarsest_m });
        }
        Ok(Self { spec, range, resolution: range.clamp(start), does_work: true, sink: 0 })
    }

    /// The same agent, declaring its cost without burning it: for lockstep, where only declared costs matter.
    #[must_use]
    pub fn declared_only(self) -> Self {
        Self { does_work: false, ..self }
    }

    /// Cost of a step at the present spacing, microseconds, at most 1e6.
    #[must_use]
    pub fn cost_us(&self) -> f64 {
        let finer = self.range.eps_m.1 / self.resolution.eps_m;
        (self.spec.cost_us * libm::pow(finer, self.spec.cost_order)).min(COST_MAX_US)
    }

    /// Error at the present spacing, metres.
    #[must_use]
    pub fn error_m(&self) -> f64 {
        self.spec.error_m * libm::pow(self.resolution.eps_m / self.range.eps_m.1, self.spec.error_order)
    }

    /// A chain of multiplications, each dependent on the one before.
    fn do_work(&mut self) {
        let links = (self.cost_us() * LINKS_PER_US) as u64;
        for _ in 0..links {
            self.sink = std::hint::black_box(self.sink.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1));
        }
    }
}

impl Agent for Synthetic {
    fn model(&self) -> &'static str {
        "synthetic"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Own(self)
    }

    fn resolution(&self) -> Option<Resolution> {
        Some(self.resolution)
    }

    fn inputs(&self) -> Inputs {
        Inputs::of(&[Input::Resolution])
    }

    fn set_resolution(&mut self, wanted: Resolution) {
        self.resolution = self.range.clamp(wanted);
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.resolution = Some(self.resolution);
        into.body = Body::Nothing;
        into.energy_j = 0.0;
        into.residual_m = self.error_m();
        into.touches.clear();
        into.grips.clear();
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.resolution, self.sink)
    }
}

impl OwnSteps for Synthetic {
    /// Burns its cost and counts the step.
    fn step(&mut self, dt: SimSpan, _context: &StepContext<'_>) -> Result<StepReport, StepError> {
        check_span(dt)?;
        if self.does_work {
            self.do_work();
        }
        Ok(StepReport { work: self.cost_us(), substeps: 1, at_rest: false })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_core::{AgentId, SimTime};

    const SPEC: SyntheticSpec = SyntheticSpec { cost_us: 10.0, cost_order: 1.0, error_m: 1e-3, error_order: 2.0 };
    const RANGE: ResolutionRange = ResolutionRange { eps_m: (0.01, 0.04), n: (0, 3) };

    fn at(eps_m: f64) -> Resolution {
        Resolution { eps_m, n: 1 }
    }

    #[test]
    fn refining_fourfold_costs_fourfold_and_errs_a_sixteenth() {
        let mut agent = Synthetic::new(SPEC, RANGE, at(1.0)).unwrap();
        assert_eq!((agent.cost_us(), agent.error_m()), (10.0, 1e-3));
        agent.set_resolution(at(0.01));
        let report = agent.step(SimSpan::from_nanos(1), &StepContext::alone(AgentId(0), SimTime::ZERO)).unwrap();
        assert_eq!((report.work, agent.error_m()), (40.0, 1e-3 / 16.0));
        assert_eq!(agent.resolution(), Some(at(0.01)));
    }

    #[test]
    fn an_absurd_refinement_is_capped_at_a_second_a_step() {
        let steep = SyntheticSpec { cost_order: 400.0, ..SPEC };
        let agent = Synthetic::new(steep, RANGE, at(0.01)).unwrap().declared_only();
        assert_eq!(agent.cost_us(), 1e6);
    }

    #[test]
    fn invalid_curves_and_ranges_are_refused() {
        for bad in [-1.0, f64::NAN, f64::INFINITY] {
            let error = Synthetic::new(SyntheticSpec { cost_us: bad, ..SPEC }, RANGE, at(0.01)).unwrap_err();
            assert!(matches!(error, SyntheticError::BadNumber { what: "cost", .. }), "{error}");
        }
        for eps_m in [(0.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0)] {
            let error = Synthetic::new(SPEC, ResolutionRange { eps_m, ..RANGE }, at(0.01)).unwrap_err();
            assert!(matches!(error, SyntheticError::BadRange { .. }), "{error}");
        }
    }
}
