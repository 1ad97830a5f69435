//! Where in which file something is.
//!
//! In: the place of an element. Out: notes and errors about it. Never here: XML, the meaning of elements.

use crate::imported::{ImportError, LeftOut};
use std::rc::Rc;

/// An element of a file, for messages.
#[derive(Debug, Clone)]
pub(crate) struct Place {
    /// The included file that it is in, as the model names it; `None` for the model's own.
    pub(crate) file: Option<Rc<str>>,
    /// From 1.
    pub(crate) line: u32,
    /// Such as ``joint `elbow` ``, or of an element without a name ``joint `elbow`, limit``.
    pub(crate) label: String,
}

impl Place {
    fn file(&self) -> Option<String> {
        self.file.as_deref().map(str::to_owned)
    }

    /// An error about this element.
    pub(crate) fn wrong(&self, reason: impl Into<String>) -> ImportError {
        ImportError { file: self.file(), line: self.line, element: self.label.clone(), reason: reason.into() }
    }

    /// A note about this element, which changes the motion.
    pub(crate) fn note(&self, what: impl Into<String>) -> LeftOut {
        let (file, line, element, what) = (self.file(), self.line, self.label.clone(), what.into());
        LeftOut { file, line, element, what, changes_motion: true }
    }
}
