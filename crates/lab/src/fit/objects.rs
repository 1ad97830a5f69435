//! The objects of a scene file and their agents.
//!
//! In: a scene and its text. Out: every object that moves, with its agents. Never here: the choices for an object.

use metachron_core::AgentId;
use metachron_world::Scene;
use toml_edit::{DocumentMut, Item, Table};

/// An object of the file that moves.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Object {
    /// Its name in the file.
    pub name: String,
    /// Its agents: one, or those of its grid.
    pub agents: Vec<AgentId>,
}

/// Every object that moves, in the order of the file.
pub(super) fn of(scene: &Scene, text: &str) -> Vec<Object> {
    let grids: Vec<String> = text.parse::<DocumentMut>().map(|document| grids(&document)).unwrap_or_default();
    let mut objects: Vec<Object> = Vec::new();
    for member in &scene.agents {
        let grid = grids.iter().find(|grid| is_copy(grid, &member.name));
        let name = grid.unwrap_or(&member.name);
        match objects.iter_mut().find(|object| object.name == *name) {
            Some(object) => object.agents.push(member.id),
            None => objects.push(Object { name: name.clone(), agents: vec![member.id] }),
        }
    }
    objects
}

/// The tables of all objects.
pub(super) fn tables(document: &mut DocumentMut) -> impl Iterator<Item = &mut Table> {
    document.get_mut("object").and_then(Item::as_array_of_tables_mut).into_iter().flat_map(|list| list.iter_mut())
}

/// The name of an object's table.
pub(super) fn name(table: &Table) -> Option<&str> {
    table.get("name").and_then(Item::as_str)
}

/// Names of objects that are repeated.
fn grids(document: &DocumentMut) -> Vec<String> {
    let list = document.get("object").and_then(Item::as_array_of_tables);
    let repeated = list.into_iter().flatten().filter(|table| table.contains_key("grid"));
    repeated.filter_map(name).map(str::to_owned).collect()
}

/// Whether `name` is that of a copy of the object `grid`.
fn is_copy(grid: &str, name: &str) -> bool {
    let number = name.strip_prefix(grid).and_then(|rest| rest.strip_prefix('-'));
    number.is_some_and(|number| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
}
