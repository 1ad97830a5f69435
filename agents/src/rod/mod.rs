//! The tube: a staggered Cosserat rod. Theory: `docs/theory/rod.md`.

#[expect(dead_code, reason = "the step of the rod, which calls it, lands after it")]
mod contact;
mod spec;

pub use spec::{Attachment, Material, Peristalsis, Section, TubeSpec};
