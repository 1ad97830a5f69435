//! Human-readable numbers: three figures and a fitting unit.
//!
//! In: seconds, metres, hertz. Out: short texts. Never here: layout.

/// A time such as `4.21 ms`, `13.0 µs` or `2.50 s`.
#[must_use]
pub fn seconds(value: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    match value.abs() {
        0.0 => "0 ms".to_owned(),
        size if size < 1e-3 => format!("{} µs", figures(value * 1e6)),
        size if size < 1.0 => format!("{} ms", figures(value * 1e3)),
        _ => format!("{} s", figures(value)),
    }
}

/// A length such as `3.20 mm` or `1.50 m`.
#[must_use]
pub fn metres(value: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    match value.abs() {
        0.0 => "0 mm".to_owned(),
        size if size < 1e-3 => format!("{} µm", figures(value * 1e6)),
        size if size < 1.0 => format!("{} mm", figures(value * 1e3)),
        _ => format!("{} m", figures(value)),
    }
}

/// A mass such as `3.20 g` or `1.50 kg`; an infinite one is that of a driven body.
#[must_use]
pub fn kilograms(value: f64) -> String {
    if !value.is_finite() {
        return "immovable".to_owned();
    }
    match value.abs() {
        size if size < 1e-3 => format!("{} mg", figures(value * 1e6)),
        size if size < 1.0 => format!("{} g", figures(value * 1e3)),
        _ => format!("{} kg", figures(value)),
    }
}

/// Three figures: `0`, `0.123`, `1.23`, `12.3`, `123`, `1234`.
#[must_use]
pub fn figures(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if size < 0.9995 => format!("{value:.3}"),
        size if size < 9.995 => format!("{value:.2}"),
        size if size < 99.95 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

/// A mark on an axis, without trailing zeros: `0`, `0.5`, `20`.
#[must_use]
pub fn plain(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A count in groups of three digits: `12 345`.
#[must_use]
pub fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut out = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}

/// A speed such as `1×`, `0.05×`.
#[must_use]
pub fn speed(value: f64) -> String {
    let text = format!("{value:.2}");
    format!("{}×", text.trim_end_matches('0').trim_end_matches('.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_gets_three_figures_and_the_unit_that_fits() {
        assert_eq!(seconds(0.004_213), "4.21 ms");
        assert_eq!(seconds(13e-6), "13.0 µs");
        assert_eq!(seconds(2.5), "2.50 s");
        assert_eq!(metres(0.0032), "3.20 mm");
        assert_eq!(metres(1.5), "1.50 m");
        assert_eq!(
            (kilograms(0.0125), kilograms(2.0), kilograms(2e-5)),
            ("12.5 g".to_owned(), "2.00 kg".to_owned(), "20.0 mg".to_owned())
        );
        assert_eq!(figures(9.996), "10.0");
        assert_eq!(count(1_234_567), "1 234 567");
        assert_eq!((plain(20.0), plain(0.5), plain(0.0)), ("20".to_owned(), "0.5".to_owned(), "0".to_owned()));
        assert_eq!(speed(1.0), "1×");
        assert_eq!(speed(0.05), "0.05×");
    }

    #[test]
    fn a_value_that_is_not_finite_is_a_dash() {
        assert_eq!(seconds(f64::NAN), "–");
        assert_eq!(metres(f64::INFINITY), "–");
    }
}
