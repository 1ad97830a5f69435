//! Files that a model includes: the contents of their root take the place of the `include`.
//!
//! In: the tree of a model, its folder. Out: the same with all that it includes, each element knowing its file. Never
//! here: the meaning of elements.

use crate::folders::Folders;
use crate::imported::{ImportError, LeftOut};
use crate::xml::{self, DEPTH_MAX, Element};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Puts in place all that a model includes. As in MuJoCo a file is looked for beside the model, whichever file names it, and is included
/// once.
///
/// # Errors
/// For a file that cannot be read, is no XML, or is included already: by itself, too.
pub(crate) fn include(root: &mut Element, folders: Folders<'_>, notes: &mut Vec<LeftOut>) -> Result<(), ImportError> {
    Includes { folders, notes, included: BTreeSet::new() }.within(root, 0)
}

struct Includes<'a> {
    folders: Folders<'a>,
    notes: &'a mut Vec<LeftOut>,
    included: BTreeSet<PathBuf>,
}

impl Includes<'_> {
    fn within(&mut self, element: &mut Element, depth: usize) -> Result<(), ImportError> {
        if depth > DEPTH_MAX {
            return Err(element.wrong(format!("is nested more than {DEPTH_MAX} deep")));
        }
        let mut at = 0;
        while at < element.all().len() {
            if element.all()[at].tag == "include" {
                // elements that come in its place may include others
                let inside = self.of(element.all()[at].read())?;
                element.all_mut().splice(at..=at, inside);
            } else {
                self.within(&mut element.all_mut()[at], depth + 1)?;
                at += 1;
            }
        }
        Ok(())
    }

    /// The elements that an `include` brings.
    fn of(&mut self, include: &Element) -> Result<Vec<Element>, ImportError> {
        let name = include.needed("file")?;
        let file = self.folders.included(include, name)?;
        if !self.included.insert(file.path) {
            return Err(include.wrong(format!("names `{name}`, which is included already; expected each file once")));
        }
        let mut root = xml::parse(&file.text, Some(name))?;
        let inside = std::mem::take(root.all_mut());
        // neither of the two remains, nor do other attributes of theirs
        include.list_unread(&super::HARMLESS, self.notes);
        root.list_unread(&super::HARMLESS, self.notes);
        Ok(inside)
    }
}
