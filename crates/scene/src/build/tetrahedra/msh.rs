//! Reads gmsh's text files, versions 2.2 and 4.1.
//!
//! In: bytes. Out: tetrahedra with the physical group of each, or the number of its volume where it has none. Never here: binary files,
//! elements without a volume. (The crate `mshio` reads 4.1 alone, without lines in its errors.)

use super::words::Words;
use super::{counted, points};
use metachron_geometry::Tetrahedra;
use std::collections::HashMap;

pub(super) fn is_msh(bytes: &[u8]) -> bool {
    bytes.trim_ascii_start().starts_with(b"$MeshFormat")
}

/// Nodes of gmsh's elements of first order, by their number.
fn nodes_of(kind: u64) -> Option<usize> {
    // point, line, triangle, quadrangle, tetrahedron; of second order: line, triangle, quadrangle
    [(15, 1), (1, 2), (2, 3), (3, 4), (4, 4), (8, 3), (9, 6), (10, 9), (16, 8)]
        .into_iter()
        .find_map(|(known, nodes)| (known == kind).then_some(nodes))
}

const TETRAHEDRON: u64 = 4;

fn no_tetrahedron(words: &Words<'_>, kind: u64) -> String {
    let name = match kind {
        5 | 12 | 17 => "a hexahedron",
        6 | 13 | 18 => "a prism",
        7 | 14 | 19 => "a pyramid",
        11 => "a tetrahedron of second order",
        _ => "of an unknown kind",
    };
    words.wrong(format_args!("an element is {name} ({kind}): expected tetrahedra of first order (4)"))
}

/// The contents read so far.
#[derive(Default)]
struct File {
    coordinates: Vec<f64>,
    /// The index of each node by its number in the file.
    index: HashMap<u64, u32>,
    mesh: Tetrahedra,
    /// The physical group of each volume.
    groups: HashMap<i64, i64>,
}

pub(super) fn read(bytes: &[u8]) -> Result<Tetrahedra, String> {
    let mut words = Words::new(bytes);
    let mut file = File::default();
    let mut version = String::new();
    while let Some(section) = words.word() {
        match (section, version.as_str()) {
            ("$MeshFormat", _) => version = format(&mut words)?,
            ("$Entities", "4.1") => file.entities(&mut words)?,
            ("$Nodes", "2.2") => file.nodes_2(&mut words)?,
            ("$Nodes", _) => file.nodes_4(&mut words)?,
            ("$Elements", "2.2") => file.elements_2(&mut words)?,
            ("$Elements", _) => file.elements_4(&mut words)?,
            _ => {}
        }
        skip(&mut words, section)?;
    }
    file.mesh.points = points(&file.coordinates);
    Ok(file.mesh)
}

/// Goes to the end of a section.
fn skip(words: &mut Words<'_>, section: &str) -> Result<(), String> {
    let end = format!("$End{}", section.trim_start_matches('$'));
    loop {
        match words.word() {
            Some(word) if word == end => return Ok(()),
            Some(_) => {}
            None => return Err(format!("it ends before `{end}`")),
        }
    }
}

fn format(words: &mut Words<'_>) -> Result<String, String> {
    let version = words.word().unwrap_or_default().to_owned();
    if !["2.2", "4.1"].contains(&version.as_str()) {
        return Err(words.wrong(format_args!("the version is `{version}`: expected 2.2 or 4.1")));
    }
    match words.number::<u8>("0 for text or 1 for binary")? {
        0 => Ok(version),
        _ => Err("it is binary: expected text (Mesh.Binary = 0)".to_owned()),
    }
}

impl File {
    fn entities(&mut self, words: &mut Words<'_>) -> Result<(), String> {
        let mut counts = [0_u64; 4];
        for count in &mut counts {
            *count = words.number("a number of entities")?;
        }
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..counted("entities", count)? {
                let tag: i64 = words.number("the number of an entity")?;
                // a point has three coordinates, anything else a box
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    words.number::<f64>("a coordinate")?;
                }
                let groups: u64 = words.number("a number of physical groups")?;
                for at in 0..counted("groups", groups)? {
                    let group = words.number("the number of a physical group")?;
                    if dimension == 3 && at == 0 {
                        self.groups.insert(tag, group);
                    }
                }
                if dimension > 0 {
                    let bounds: u64 = words.number("a number of bounding entities")?;
                    for _ in 0..counted("bounding entities", bounds)? {
                        words.number::<i64>("the number of an entity")?;
                    }
                }
            }
        }
        Ok(())
    }

    fn node(&mut self, number: u64) -> u32 {
        let next = self.index.len() as u32;
        *self.index.entry(number).or_insert(next)
    }

    fn coordinates(&mut self, words: &mut Words<'_>) -> Result<(), String> {
        for axis in ["x", "y", "z"] {
            self.coordinates.push(words.number(format_args!("the coordinate {axis} of a node"))?);
        }
        Ok(())
    }

    fn nodes_2(&mut self, words: &mut Words<'_>) -> Result<(), String> {
        let count = words.number("the number of nodes")?;
        for _ in 0..counted("nodes", count)? {
            let number = words.number("the number of a node")?;
            self.new_node(words, number)?;
            self.coordinates(words)?;
        }
        Ok(())
    }

    fn new_node(&mut self, words: &Words<'_>, number: u64) -> Result<(), String> {
        let known = self.index.len();
        self.node(number);
        let is_new = self.index.len() > known;
        if is_new { Ok(()) } else { Err(words.wrong(format_args!("node {number} is there twice"))) }
    }

    fn nodes_4(&mut self, words: &mut Words<'_>) -> Result<(), String> {
        let blocks = words.number("the number of blocks of nodes")?;
        for what in ["the number of nodes", "the least node", "the greatest node"] {
            words.number::<u64>(what)?;
        }
        for _ in 0..counted("blocks of nodes", blocks)? {
            for what in ["a dimension", "an entity"] {
                words.number::<i64>(what)?;
            }
            if words.number::<u8>("0 or 1: whether nodes have parameters")? != 0 {
                return Err(words.wrong("nodes have parameters: expected none (Mesh.SaveParametric = 0)"));
            }
            let count = words.number("the number of nodes of a block")?;
            let count = counted("nodes", count)?;
            for _ in 0..count {
                let number = words.number("the number of a node")?;
                self.new_node(words, number)?;
            }
            for _ in 0..count {
                self.coordinates(words)?;
            }
        }
        Ok(())
    }

    /// The corners of an element, of which only tetrahedra are kept.
    fn element(&mut self, words: &mut Words<'_>, kind: u64, region: i64) -> Result<(), String> {
        let Some(nodes) = nodes_of(kind) else { return Err(no_tetrahedron(words, kind)) };
        let mut corners = [0; 4];
        for at in 0..nodes {
            let number = words.number("the number of a node")?;
            let Some(index) = self.index.get(&number) else {
                return Err(words.wrong(format_args!("node {number} does not exist")));
            };
            if let Some(corner) = corners.get_mut(at) {
                *corner = *index;
            }
        }
        if kind == TETRAHEDRON {
            self.mesh.corners.push(corners);
            self.mesh.regions.push(region);
        }
        Ok(())
    }

    fn elements_2(&mut self, words: &mut Words<'_>) -> Result<(), String> {
        let count = words.number("the number of elements")?;
        for _ in 0..counted("elements", count)? {
            words.number::<u64>("the number of an element")?;
            let kind = words.number("the kind of an element")?;
            let tags: u64 = words.number("a number of tags")?;
            let mut region = 0;
            for at in 0..counted("tags", tags)? {
                let tag = words.number("a tag")?;
                // the physical group, and where that is none the volume
                if at == 0 || (at == 1 && region == 0) {
                    region = tag;
                }
            }
            self.element(words, kind, region)?;
        }
        Ok(())
    }

    fn elements_4(&mut self, words: &mut Words<'_>) -> Result<(), String> {
        let blocks = words.number("the number of blocks of elements")?;
        for what in ["the number of elements", "the least element", "the greatest element"] {
            words.number::<u64>(what)?;
        }
        for _ in 0..counted("blocks of elements", blocks)? {
            words.number::<u64>("a dimension")?;
            let entity = words.number("an entity")?;
            let kind = words.number("the kind of the elements of a block")?;
            let region = self.groups.get(&entity).copied().unwrap_or(entity);
            let count = words.number("the number of elements of a block")?;
            for _ in 0..counted("elements", count)? {
                words.number::<u64>("the number of an element")?;
                self.element(words, kind, region)?;
            }
        }
        Ok(())
    }
}
