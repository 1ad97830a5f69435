//! Goals on a report's numbers: `missed_share>0.01` fails a run in which more than 1 % of the frames were late.
//!
//! In: an expression `PATH OPERATOR NUMBER`; a report. Out: whether the run failed it. Never here: exit codes.

use super::Report;
use serde_json::Value;
use std::fmt;
use std::str::FromStr;

/// A condition under which a run fails.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    path: String,
    operator: Operator,
    limit: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Operator {
    GreaterEqual,
    LessEqual,
    Equal,
    NotEqual,
    Greater,
    Less,
}

/// The longer signs first: `>=` begins with `>`.
const OPERATORS: [(&str, Operator); 6] = [
    (">=", Operator::GreaterEqual),
    ("<=", Operator::LessEqual),
    ("==", Operator::Equal),
    ("!=", Operator::NotEqual),
    (">", Operator::Greater),
    ("<", Operator::Less),
];

/// Reasons why an expression is not a goal.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GoalError {
    /// There is no operator.
    #[error(
        "`{0}` is not a condition; expected FIELD OPERATOR NUMBER, such as missed_share>0.01 (operators: > >= < <= == !=)"
    )]
    NoOperator(String),
    /// The limit is not a number.
    #[error("`{0}` is not a finite number; expected one to compare with")]
    NoNumber(String),
    /// The report has no such field.
    #[error("the report has no field `{path}`{hint}; fields here: {known}")]
    UnknownField {
        /// The given path.
        path: String,
        /// A suggestion, or nothing.
        hint: String,
        /// The fields that exist there.
        known: String,
    },
    /// The field exists but is not a number.
    #[error("the field `{0}` is not a number")]
    NotANumber(String),
}

/// The verdict of a report on a goal.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The condition does not hold: the run is good.
    Kept,
    /// The condition holds, with this value.
    Missed(f64),
    /// The number was not measured in this run; this counts as missed.
    NotMeasured,
}

impl FromStr for Goal {
    type Err = GoalError;

    fn from_str(text: &str) -> Result<Self, GoalError> {
        let first = text.find(['>', '<', '=', '!']);
        let split = first.and_then(|at| {
            let (sign, operator) = OPERATORS.into_iter().find(|(sign, _)| text[at..].starts_with(sign))?;
            Some((text[..at].trim(), operator, text[at + sign.len()..].trim()))
        });
        let Some((path, operator, number)) = split.filter(|(path, ..)| !path.is_empty()) else {
            return Err(GoalError::NoOperator(text.to_owned()));
        };
        let limit = number.parse().ok().filter(|n: &f64| n.is_finite());
        let goal = Self {
            path: path.to_owned(),
            operator,
            limit: limit.ok_or_else(|| GoalError::NoNumber(number.to_owned()))?,
        };
        goal.check_field()?;
        Ok(goal)
    }
}

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = OPERATORS.iter().find(|(_, o)| *o == self.operator).map_or("", |(sign, _)| sign);
        write!(f, "{}{sign}{}", self.path, self.limit)
    }
}

impl Goal {
    /// Checks, before anything runs, that reports have this field and that it is a number.
    fn check_field(&self) -> Result<(), GoalError> {
        let template = serde_json::to_value(Report::template()).unwrap_or_default();
        match find(&template, &self.path, true)? {
            Value::Number(_) | Value::Null | Value::Bool(_) => Ok(()),
            _ => Err(GoalError::NotANumber(self.path.clone())),
        }
    }

    /// Judges this goal by `report`.
    ///
    /// # Errors
    /// [`GoalError::UnknownField`] for an agent or probe that the run did not have.
    pub fn judge(&self, report: &Report) -> Result<Verdict, GoalError> {
        let json = serde_json::to_value(report).unwrap_or_default();
        let value = match find(&json, &self.path, false)? {
            Value::Bool(yes) => f64::from(u8::from(*yes)),
            Value::Null => return Ok(Verdict::NotMeasured),
            value => value.as_f64().ok_or_else(|| GoalError::NotANumber(self.path.clone()))?,
        };
        let holds = match self.operator {
            Operator::GreaterEqual => value >= self.limit,
            Operator::LessEqual => value <= self.limit,
            Operator::Equal => value == self.limit,
            Operator::NotEqual => value != self.limit,
            Operator::Greater => value > self.limit,
            Operator::Less => value < self.limit,
        };
        Ok(if holds { Verdict::Missed(value) } else { Verdict::Kept })
    }
}

/// The value at a dotted path. In a list the next part is a number or the entry's name; `any` takes the first entry for every name.
fn find<'v>(root: &'v Value, path: &str, any: bool) -> Result<&'v Value, GoalError> {
    let mut here = root;
    for part in path.split('.') {
        let next = match here {
            // the whole table was not measured
            Value::Null if !any => return Ok(here),
            Value::Object(table) => table.get(part),
            Value::Array(list) if any => list.first(),
            Value::Array(list) => {
                list.iter().find(|e| is_named(e, part)).or_else(|| list.get(part.parse::<usize>().ok()?))
            }
            _ => None,
        };
        here = next.ok_or_else(|| unknown_field(path, part, here))?;
    }
    Ok(here)
}

fn is_named(entry: &Value, name: &str) -> bool {
    ["name", "object", "a"].iter().any(|key| entry.get(key).and_then(Value::as_str) == Some(name))
}

fn unknown_field(path: &str, part: &str, here: &Value) -> GoalError {
    let known: Vec<&str> = match here {
        Value::Object(table) => table.keys().map(String::as_str).collect(),
        Value::Array(list) => {
            list.iter().filter_map(|e| ["name", "object", "a"].iter().find_map(|k| e.get(k)?.as_str())).collect()
        }
        _ => Vec::new(),
    };
    let near = known.iter().map(|k| (strsim::jaro_winkler(part, k), k)).max_by(|a, b| a.0.total_cmp(&b.0));
    let hint =
        near.filter(|(score, _)| *score > 0.75).map_or_else(String::new, |(_, k)| format!("; did you mean `{k}`?"));
    let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
    GoalError::UnknownField { path: path.to_owned(), hint, known }
}

#[cfg(test)]
mod tests {
    use super::super::{Statistics, summarise, summarise_choices};
    use super::*;
    use proptest::prelude::*;

    fn report() -> Report {
        let mut report = Report::template();
        report.summary.missed_share = Some(0.02);
        report.summary.frame_ms = Some(Statistics { p99: 40.0, ..Statistics::default() });
        report.agents[0].name = "intestine".to_owned();
        report.agents[0].rate_hz = 200.0;
        report
    }

    fn judge(text: &str) -> Verdict {
        text.parse::<Goal>().unwrap().judge(&report()).unwrap()
    }

    #[test]
    fn a_goal_is_missed_when_its_condition_holds() {
        assert_eq!(judge("missed_share>0.01"), Verdict::Missed(0.02));
        assert_eq!(judge("missed_share > 0.02"), Verdict::Kept);
        assert_eq!(judge("frame_ms.p99>=40"), Verdict::Missed(40.0));
        assert_eq!(judge("frame_ms.p99<40"), Verdict::Kept);
        assert_eq!(judge("agents.intestine.rate_hz<240"), Verdict::Missed(200.0));
        assert_eq!(judge("agents.0.parked==1"), Verdict::Kept);
    }

    #[test]
    fn a_goal_on_an_unmeasured_number_is_not_kept() {
        assert_eq!(judge("binding_stddev>0.035"), Verdict::NotMeasured);
    }

    #[test]
    fn no_goal_on_frames_is_kept_by_a_run_without_any() {
        let mut report = report();
        report.summary = summarise(&[], 1.0);
        report.budget.choices = summarise_choices(&[]);
        let paths = ["frame_ms.p99", "interval_ms.max", "missed_share", "gpu_ms.p99", "settle_frames", "avg_err"];
        let choices =
            ["level_changes", "reversals", "holes", "cull_ms.max", "draw_ms.p99"].map(|p| format!("budget.{p}"));
        for path in paths.map(str::to_owned).iter().chain(&choices) {
            let goal: Goal = format!("{path}>1").parse().unwrap();
            assert_eq!(goal.judge(&report), Ok(Verdict::NotMeasured), "{path}");
        }
    }

    #[test]
    fn an_unknown_field_is_refused_with_the_nearest_name() {
        let error = "mised_share>0".parse::<Goal>().unwrap_err().to_string();
        assert!(error.contains("did you mean `missed_share`?"), "{error}");
        let error = "frame_ms.p98>0".parse::<Goal>().unwrap_err().to_string();
        assert!(error.contains("p95"), "{error}");
        assert_eq!("scene>0".parse::<Goal>(), Err(GoalError::NotANumber("scene".to_owned())));
        assert!("agents.liver.rate_hz<1".parse::<Goal>().unwrap().judge(&report()).is_err());
    }

    #[test]
    fn an_expression_that_is_not_a_condition_is_refused() {
        for bad in ["", "missed_share", ">1", "missed_share>", "missed_share>x", "missed_share>nan", "missed_share=1"] {
            assert!(bad.parse::<Goal>().is_err(), "{bad}");
        }
    }

    proptest! {
        #[test]
        fn no_text_makes_the_parser_panic(text in "\\PC{0,30}") {
            let _ = text.parse::<Goal>();
        }
    }
}
