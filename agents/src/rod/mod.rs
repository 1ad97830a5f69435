//! The tube: a staggered Cosserat rod. Theory: `docs/theory/rod.md`.

mod spec;

pub use spec::{Attachment, Material, Peristalsis, Section, TubeSpec};
