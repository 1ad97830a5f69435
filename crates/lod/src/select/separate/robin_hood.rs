//! The distribution of time of Robin Hood (RH05): every instance gets its share by value, and returns the part it does not need.
//!
//! In: a time, and instances with a value and the times of their forms. Out: a form for each. One pass, no bound.
//! Never here: the value of an instance ([`crate::cost::value`]) or the time of a frame left for drawing ([`crate::cost::overlap`]).
//! Theory: `docs/theory/budget.md`, eq. 26 … 28.

use alloc::vec::Vec;

/// A visible instance.
#[derive(Debug, Clone, PartialEq)]
pub struct Instance {
    /// Breaks ties between instances of the same complexity.
    pub id: u64,
    /// Time of the best form of the instance's type at one fixed area: the order of the visit.
    pub complexity: f64,
    /// Value of the instance; NaN and negative values count as 0.
    pub value: f64,
    /// Times of the forms, best first; one that is not finite or below 0 is never chosen.
    pub forms: Vec<f64>,
    /// The rule where its time does not pay for its cheapest form.
    pub too_little: TooLittle,
}

/// The rule for an instance whose share of the time does not pay for its cheapest form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TooLittle {
    /// The instance is not drawn (RH05, §1).
    Nothing,
    /// The part of the cheapest form that the time pays for (RH05, §7.2).
    Part,
}

/// A form for every instance, in the order given.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    /// The instances in the order in which they were visited.
    pub order: Vec<usize>,
    /// The time that each was offered.
    pub offered: Vec<f64>,
    /// The form of each; `None` where it is not drawn.
    pub form: Vec<Option<u32>>,
    /// How much of its form is drawn, `0..=1`.
    pub part: Vec<f64>,
    /// The time that no instance took, ≥ 0.
    pub leftover: f64,
}

/// Distributes `time`: visited in rising complexity, each instance is offered t = v · (time left)/(value left) and takes its most expensive
/// form that costs no more (RH05, eq. 1 … 4).
#[must_use]
pub fn distribute(time: f64, instances: &[Instance]) -> Distribution {
    let mut order: Vec<_> = (0..instances.len()).collect();
    order.sort_by(|&a, &b| {
        let key = |i: usize| &instances[i];
        key(a).complexity.total_cmp(&key(b).complexity).then(key(a).id.cmp(&key(b).id)).then(a.cmp(&b))
    });
    let mut left = if time > 0.0 { time } else { 0.0 };
    let mut value_left: f64 = order.iter().map(|&i| sound(instances[i].value)).sum();
    let n = instances.len();
    let (mut offered, mut form, mut part) = (alloc::vec![0.0; n], alloc::vec![None; n], alloc::vec![0.0; n]);
    for &i in &order {
        let value = sound(instances[i].value);
        // by rounding the value left can reach 0 before the last instance
        let offer = match (value > 0.0, value_left > 0.0) {
            (false, _) => 0.0,
            (true, true) => (value * left / value_left).min(left),
            (true, false) => left,
        };
        value_left -= value;
        offered[i] = offer;
        let (taken, chosen, drawn) = take(&instances[i], offer);
        (form[i], part[i]) = (chosen, drawn);
        left = (left - taken).max(0.0);
    }
    Distribution { order, offered, form, part, leftover: left }
}

fn sound(value: f64) -> f64 {
    if value > 0.0 && value.is_finite() { value } else { 0.0 }
}

/// Time taken, form, and how much of it is drawn.
fn take(instance: &Instance, offer: f64) -> (f64, Option<u32>, f64) {
    let usable = || (0_u32..).zip(&instance.forms).filter(|(_, t)| t.is_finite() && **t >= 0.0);
    if offer <= 0.0 {
        return (0.0, None, 0.0);
    }
    let dearest = usable().filter(|(_, t)| **t <= offer).max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(&a.0)));
    if let Some((form, &time)) = dearest {
        return (time, Some(form), 1.0);
    }
    let cheapest = usable().min_by(|a, b| a.1.total_cmp(b.1).then(a.0.cmp(&b.0)));
    match (instance.too_little, cheapest) {
        (TooLittle::Part, Some((form, &time))) => (offer, Some(form), offer / time),
        _ => (0.0, None, 0.0),
    }
}
