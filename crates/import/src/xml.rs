//! XML as a tree that knows which of its elements and attributes were read.
//!
//! In: text. Out: [`Element`]s, numbers of their attributes, and the list of elements and attributes that no reader
//! asked for. Never here: the meaning of a tag.

use crate::imported::{ImportError, LeftOut};
use crate::place::Place;
use std::cell::Cell;
use std::rc::Rc;

/// Deepest nesting of elements: readers recurse.
pub(crate) const DEPTH_MAX: usize = 200;

/// The largest damping of a scene, N·s/m or N·m·s/rad, and the largest stiffness, friction and armature.
pub(crate) const DAMPING_MAX: f64 = 1e7;
pub(crate) const STRENGTH_MAX: f64 = 1e9;
/// The largest ratio of the travels of two joints that a scene has.
pub(crate) const RATIO_MAX: f64 = 1e6;

/// An element with all that is in it.
#[derive(Debug, Clone)]
pub(crate) struct Element {
    pub(crate) tag: String,
    pub(crate) place: Place,
    attributes: Vec<Attribute>,
    children: Vec<Element>,
    is_read: Cell<bool>,
}

#[derive(Debug, Clone)]
struct Attribute {
    name: String,
    value: String,
    is_read: Cell<bool>,
}

/// The words of a kind of files that move nothing; all else that is not read may change the motion.
pub(crate) struct Harmless {
    /// Words, as all of these.
    pub(crate) elements: &'static str,
    /// Elements that are harmless if all their contents are.
    pub(crate) containers: &'static str,
    pub(crate) attributes: &'static str,
}

impl Harmless {
    fn has(&self, element: &Element) -> bool {
        Self::is_in(self.elements, &element.tag)
            || (Self::is_in(self.containers, &element.tag) && element.children.iter().all(|child| self.has(child)))
    }

    fn is_in(words: &str, word: &str) -> bool {
        words.split_whitespace().any(|one| one == word)
    }
}

/// The root element of a text: of an included `file`, or of the model's own.
///
/// # Errors
/// For text that is no XML, or nested too deep.
pub(crate) fn parse(text: &str, file: Option<&str>) -> Result<Element, ImportError> {
    let file: Option<Rc<str>> = file.map(Rc::from);
    let place = |line: u32, label: &str| Place { file: file.clone(), line, label: label.to_owned() };
    let document = roxmltree::Document::parse(text)
        .map_err(|why| place(why.pos().row, "the file").wrong(format!("is not XML: {why}")))?;
    let text = Text { lines: Lines::of(document.input_text()), file: file.clone() };
    let root = Element::of(document.root_element(), &text, None, 0)?;
    root.is_read.set(true);
    Ok(root)
}

/// The text that elements are read from.
struct Text {
    lines: Lines,
    file: Option<Rc<str>>,
}

/// Where the lines of a text end, in bytes: counted for each element from the start, they take longer than all else in a large file.
struct Lines(Vec<usize>);

impl Lines {
    fn of(text: &str) -> Self {
        Self(text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at).collect())
    }

    /// The line of a byte, from 1.
    fn at(&self, byte: usize) -> u32 {
        self.0.partition_point(|end| *end < byte) as u32 + 1
    }
}

impl Element {
    fn of(node: roxmltree::Node<'_, '_>, text: &Text, parent: Option<&str>, depth: usize) -> Result<Self, ImportError> {
        let tag = node.tag_name().name().to_owned();
        let label = match (node.attribute("name"), parent) {
            (Some(name), _) => format!("{tag} `{name}`"),
            (None, Some(parent)) => format!("{parent}, {tag}"),
            (None, None) => tag.clone(),
        };
        let line = text.lines.at(node.range().start);
        if depth > DEPTH_MAX {
            let place = Place { file: text.file.clone(), line, label: tag };
            return Err(place.wrong(format!("is nested more than {DEPTH_MAX} deep")));
        }
        let attribute = |a: roxmltree::Attribute<'_, '_>| Attribute {
            // the label says the name
            is_read: Cell::new(a.name() == "name"),
            name: a.name().to_owned(),
            value: a.value().to_owned(),
        };
        let attributes = node.attributes().map(attribute).collect();
        // the root's name is that of the model, and of no use in labels
        let inside = (depth > 0).then_some(label.as_str());
        let elements = node.children().filter(roxmltree::Node::is_element);
        let children = elements.map(|child| Self::of(child, text, inside, depth + 1)).collect::<Result<_, _>>()?;
        let place = Place { file: text.file.clone(), line, label };
        Ok(Self { tag, place, attributes, children, is_read: Cell::new(false) })
    }

    /// The text of an attribute; it counts as read.
    pub(crate) fn text(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|a| a.name == name)?;
        found.is_read.set(true);
        Some(&found.value)
    }

    /// The text of an attribute that has to be there.
    pub(crate) fn needed(&self, name: &str) -> Result<&str, ImportError> {
        self.text(name).ok_or_else(|| self.wrong(format!("has no `{name}`")))
    }

    /// The numbers of an attribute.
    pub(crate) fn list(&self, name: &str) -> Result<Option<Vec<f64>>, ImportError> {
        let Some(text) = self.text(name) else { return Ok(None) };
        let number = |word: &str| word.parse::<f64>().ok().filter(|value| value.is_finite());
        let all: Option<Vec<f64>> = text.split_whitespace().map(number).collect();
        all.map(Some).ok_or_else(|| self.wrong(format!("`{name}` is `{text}`; expected finite numbers")))
    }

    /// The numbers of an attribute that has `N` of them.
    pub(crate) fn numbers<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>, ImportError> {
        let Some(all) = self.list(name)? else { return Ok(None) };
        let found = all.len();
        let wrong = |_| self.wrong(format!("`{name}` has {found} numbers; expected {N}"));
        all.try_into().map(Some).map_err(wrong)
    }

    /// The numbers of an attribute that has `N` of them at most; for those that are missing the `usual` ones.
    pub(crate) fn numbers_or<const N: usize>(&self, name: &str, usual: [f64; N]) -> Result<[f64; N], ImportError> {
        let mut all = self.list(name)?.unwrap_or_default();
        if all.len() > N {
            return Err(self.wrong(format!("`{name}` has {} numbers; expected {N} at most", all.len())));
        }
        all.extend_from_slice(&usual[all.len()..]);
        Ok(all.try_into().unwrap_or(usual))
    }

    pub(crate) fn number(&self, name: &str) -> Result<Option<f64>, ImportError> {
        Ok(self.numbers::<1>(name)?.map(|[value]| value))
    }

    /// A number from zero to `most`, the largest that scenes have of its kind; 0 where there is none.
    pub(crate) fn up_to(&self, most: f64, name: &str) -> Result<f64, ImportError> {
        let value = self.number(name)?.unwrap_or(0.0);
        let wrong = || self.wrong(format!("`{name}` is {value}; expected 0 to {most}"));
        (0.0..=most).contains(&value).then_some(value).ok_or_else(wrong)
    }

    /// A number that has to be there.
    pub(crate) fn needed_number(&self, name: &str) -> Result<f64, ImportError> {
        self.needed(name)?;
        Ok(self.number(name)?.unwrap_or_default())
    }

    /// A number that has to be there, and above zero.
    pub(crate) fn positive(&self, name: &str) -> Result<f64, ImportError> {
        let value = self.needed_number(name)?;
        if value > 0.0 { Ok(value) } else { Err(self.wrong(format!("`{name}` is {value}; expected more than zero"))) }
    }

    /// The elements in this one, whether or not they have been read.
    pub(crate) fn all(&self) -> &[Element] {
        &self.children
    }

    pub(crate) fn all_mut(&mut self) -> &mut Vec<Element> {
        &mut self.children
    }

    /// The elements with a tag in this one; they count as read.
    pub(crate) fn children(&self, tag: &'static str) -> impl Iterator<Item = &Element> {
        self.children.iter().filter(move |child| child.tag == tag).inspect(|child| child.is_read.set(true))
    }

    /// The first element with a tag in this one; it counts as read.
    pub(crate) fn child(&self, tag: &'static str) -> Option<&Element> {
        self.children(tag).next()
    }

    /// Counts the element as read, though not its contents.
    pub(crate) fn read(&self) -> &Self {
        self.is_read.set(true);
        self
    }

    /// Counts the element and all in it as read: its values have no meaning where it is.
    pub(crate) fn read_all_within(&self) {
        self.is_read.set(true);
        self.attributes.iter().for_each(|attribute| attribute.is_read.set(true));
        self.children.iter().for_each(Self::read_all_within);
    }

    /// Whether the element has an attribute, which does not count as read.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.attributes.iter().any(|a| a.name == name)
    }

    /// Gives the element the attributes of `other` for which it has none, except the ones that `skip` names.
    pub(crate) fn inherit(&mut self, other: &Element, skip: impl Fn(&str) -> bool) {
        for attribute in &other.attributes {
            if !self.has(&attribute.name) && !skip(&attribute.name) {
                self.attributes.push(attribute.clone());
            }
        }
    }

    /// An error about this element.
    pub(crate) fn wrong(&self, reason: impl Into<String>) -> ImportError {
        self.place.wrong(reason)
    }

    /// A note about this element, which changes the motion.
    pub(crate) fn note(&self, what: impl Into<String>) -> LeftOut {
        self.place.note(what)
    }

    /// Counts attributes as read: they have no meaning where they are.
    pub(crate) fn read_all(&self, names: &[&str]) {
        for name in names {
            self.text(name);
        }
    }

    /// Counts an attribute as read where its value is the usual one, which is also meant without it.
    pub(crate) fn read_if(&self, name: &str, usual: &str) {
        for attribute in self.attributes.iter().filter(|attribute| attribute.name == name && attribute.value == usual) {
            attribute.is_read.set(true);
        }
    }

    /// Counts those of these attributes as read that are zero, or several zeros: they mean the same where they are
    /// missing.
    pub(crate) fn read_zeros(&self, names: &[&str]) {
        for attribute in self.attributes.iter().filter(|attribute| names.contains(&attribute.name.as_str())) {
            if attribute.value.split_whitespace().all(|word| word.parse() == Ok(0.0)) {
                attribute.is_read.set(true);
            }
        }
    }

    /// Lists every element and attribute that nothing has read.
    pub(crate) fn list_unread(&self, harmless: &Harmless, into: &mut Vec<LeftOut>) {
        let note = |what: String, is_harmless: bool| {
            let note = self.note(what);
            if is_harmless { note.harmless() } else { note }
        };
        if !self.is_read.get() {
            into.push(note("is left out".to_owned(), harmless.has(self)));
            return;
        }
        for Attribute { name, .. } in self.attributes.iter().filter(|a| !a.is_read.get()) {
            into.push(note(format!("`{name}` is left out"), Harmless::is_in(harmless.attributes, name)));
        }
        for child in &self.children {
            child.list_unread(harmless, into);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::RATIO_MAX;
    use metachron_models::rigid::Mimic;

    #[test]
    fn the_ratios_that_are_read_are_those_of_scenes() {
        assert_eq!([Mimic::RATIO.least, Mimic::RATIO.greatest], [-RATIO_MAX, RATIO_MAX]);
    }
}
