//! Classes of defaults: every element gets the attributes that its class has and it has not.
//!
//! In: the tree of a file. Out: the same without `default` elements. Never here: the meaning of attributes.

use crate::imported::ImportError;
use crate::xml::Element;
use std::collections::BTreeMap;

/// The class of all that names no other.
const MAIN: &str = "main";
/// Ways to write a rotation, of which an element has one.
pub(super) const ROTATIONS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];

/// Elements of a class by their tags.
type Class = BTreeMap<String, Element>;

/// Gives all elements of a file the attributes of their classes.
///
/// # Errors
/// For a class that there is none of.
pub(crate) fn resolve_defaults(root: &mut Element) -> Result<(), ImportError> {
    let mut classes = BTreeMap::from([(MAIN.to_owned(), Class::new())]);
    for default in root.all().iter().filter(|child| child.tag == "default") {
        let main = classes[MAIN].clone();
        collect(default, default.text("class").unwrap_or(MAIN), main, &mut classes);
    }
    root.all_mut().retain(|child| child.tag != "default");
    for section in root.all_mut() {
        // sections have the names of elements: `tendon`, `equality`
        let inside = section.text("childclass").unwrap_or(MAIN).to_owned();
        section.all_mut().iter_mut().try_for_each(|child| give(child, &inside, &classes))?;
    }
    Ok(())
}

fn collect(default: &Element, name: &str, mut class: Class, classes: &mut BTreeMap<String, Class>) {
    for element in default.all().iter().filter(|element| element.tag != "default") {
        let mut own = element.clone();
        if let Some(outer) = class.get(&own.tag) {
            inherit(&mut own, outer);
        }
        class.insert(own.tag.clone(), own);
    }
    classes.insert(name.to_owned(), class.clone());
    for inner in default.all().iter().filter(|element| element.tag == "default") {
        collect(inner, inner.text("class").unwrap_or_default(), class.clone(), classes);
    }
}

fn inherit(element: &mut Element, from: &Element) {
    let is_turned = ROTATIONS.iter().any(|name| element.has(name));
    element.inherit(from, |name| ["name", "class"].contains(&name) || (is_turned && ROTATIONS.contains(&name)));
}

/// The name by which classes have an element: both kinds of tendons are one there.
fn kind(tag: &str) -> &str {
    if ["spatial", "fixed"].contains(&tag) { "tendon" } else { tag }
}

/// Gives an element, and all in it, the attributes of their classes; `ambient` is the class of elements that name none.
fn give(element: &mut Element, ambient: &str, classes: &BTreeMap<String, Class>) -> Result<(), ImportError> {
    let own = element.text("class").unwrap_or(ambient).to_owned();
    let inside = element.text("childclass").unwrap_or(ambient).to_owned();
    let unknown = [&own, &inside].into_iter().find(|name| !classes.contains_key(*name));
    if let Some(name) = unknown {
        return Err(element.wrong(format!("is of the class `{name}`, and there is no default of that class")));
    }
    if let Some(from) = classes[&own].get(kind(&element.tag)) {
        inherit(element, from);
    }
    element.all_mut().iter_mut().try_for_each(|child| give(child, &inside, classes))
}
