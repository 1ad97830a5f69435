//! The part of a step that one substep covers.

/// When a substep is made, in seconds since its step began.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Substep {
    /// Its start.
    pub start_s: f64,
    /// Its length, > 0.
    pub span_s: f64,
}

impl Substep {
    /// Its end.
    pub fn end_s(self) -> f64 {
        self.start_s + self.span_s
    }
}
