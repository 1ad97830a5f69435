//! The points of a Collada file (.dae), for the hull of a collision mesh.
//!
//! In: text. Out: the points of all geometries that its scene has, in metres. Never here: faces, materials, skeletons.
//! The axis that a file calls up is as it stands, as where robots are shown: their meshes have the axes of their links.

use glam::{DMat4, DQuat, DVec3};
use roxmltree::{Document, Node};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Deepest nesting of nodes, also of nodes that others name.
const DEPTH_MAX: usize = 64;
/// Most elements of a file, each as often as others name it.
const ELEMENTS_MAX: usize = 1_000_000;
/// Most points of a file, each as often as others name it.
const POINTS_MAX: usize = 3_000_000;

/// Reads a file.
pub(crate) fn read(text: &str) -> Result<Vec<DVec3>, String> {
    let document = Document::parse(text).map_err(|why| format!("it is no XML: {why}"))?;
    let named = document.descendants().filter_map(|node| Some((node.attribute("id")?, node)));
    let mut reader =
        Reader { named: named.collect(), points: Vec::new(), sources: BTreeMap::new(), elements: 0, read: 0 };
    let unit = document.descendants().find(|node| is(node, "unit"));
    let metres = unit.and_then(|unit| unit.attribute("meter")?.parse().ok()).unwrap_or(1.0);
    let scale = DMat4::from_scale(DVec3::splat(metres));
    for scene in document.descendants().filter(|node| is(node, "visual_scene")) {
        reader.node(scene, scale, 0)?;
    }
    // a file without a scene is its geometries
    if reader.points.is_empty() {
        for geometry in document.descendants().filter(|node| is(node, "geometry")) {
            reader.geometry(geometry, scale)?;
        }
    }
    Ok(reader.points)
}

/// Whether an element has this tag, of any namespace.
fn is(node: &Node<'_, '_>, tag: &str) -> bool {
    node.tag_name().name() == tag
}

struct Reader<'a, 'i> {
    named: BTreeMap<&'a str, Node<'a, 'i>>,
    points: Vec<DVec3>,
    /// The points of sources that have been read, by the numbers of their elements.
    sources: BTreeMap<usize, Rc<[DVec3]>>,
    /// How many elements have been looked at.
    elements: usize,
    /// How many points have been read.
    read: usize,
}

impl<'a, 'i> Reader<'a, 'i> {
    fn named(&self, node: Node<'a, 'i>, key: &str) -> Option<Node<'a, 'i>> {
        self.named.get(node.attribute(key)?.strip_prefix('#')?).copied()
    }

    /// A node: its motions in their order, then its contents.
    fn node(&mut self, node: Node<'a, 'i>, above: DMat4, depth: usize) -> Result<(), String> {
        self.elements += node.children().count() + 1;
        if depth > DEPTH_MAX || self.elements > ELEMENTS_MAX {
            return Err("its nodes are too many or nested too deeply".to_owned());
        }
        let children = || node.children().filter(Node::is_element);
        let mut place = above;
        for child in children() {
            place *= motion(child)?;
        }
        for child in children() {
            let url = self.named(child, "url");
            match (child.tag_name().name(), url) {
                ("node", _) => self.node(child, place, depth + 1)?,
                ("instance_node", Some(named)) => self.node(named, place, depth + 1)?,
                ("instance_geometry", Some(geometry)) => self.geometry(geometry, place)?,
                ("instance_controller", Some(controller)) => {
                    let skin = controller.children().find(Node::is_element);
                    if let Some(geometry) = skin.and_then(|skin| self.named(skin, "source")) {
                        self.geometry(geometry, place)?;
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// The points of a geometry that its `vertices` name as positions.
    fn geometry(&mut self, geometry: Node<'a, 'i>, place: DMat4) -> Result<(), String> {
        self.elements += geometry.descendants().count();
        if self.elements > ELEMENTS_MAX {
            return Err("its geometries are too many".to_owned());
        }
        let vertices = geometry.descendants().filter(|node| is(node, "vertices"));
        let inputs = vertices.flat_map(|vertices| vertices.children());
        for input in inputs.filter(|input| input.attribute("semantic") == Some("POSITION")) {
            let source = self.named(input, "source").ok_or("its positions are of a source that there is none of")?;
            let points = self.source(source)?;
            if self.points.len() + points.len() > POINTS_MAX {
                return Err(format!("it has more than {POINTS_MAX} points"));
            }
            self.points.extend(points.iter().map(|point| place.transform_point3(*point)));
        }
        Ok(())
    }

    /// The points of a source, which is read once.
    fn source(&mut self, source: Node<'a, 'i>) -> Result<Rc<[DVec3]>, String> {
        if let Some(known) = self.sources.get(&source.id().get_usize()) {
            return Ok(known.clone());
        }
        let points: Rc<[DVec3]> = points_of(source)?.into();
        self.read += points.len();
        if self.read > POINTS_MAX {
            return Err(format!("it has more than {POINTS_MAX} points"));
        }
        self.sources.insert(source.id().get_usize(), points.clone());
        Ok(points)
    }
}

/// The points that a source has, as its accessor counts them.
fn points_of(source: Node<'_, '_>) -> Result<Vec<DVec3>, String> {
    let part = |name: &str| source.descendants().find(|node| is(node, name));
    let all = numbers(part("float_array").ok_or("a source of positions has no numbers")?)?;
    let accessor = part("accessor");
    let number = |key: &str| accessor.and_then(|a| a.attribute(key)?.parse::<usize>().ok());
    let (stride, offset) = (number("stride").unwrap_or(3), number("offset").unwrap_or(0));
    let wrong = || format!("its positions from {offset} by {stride} are not in {} numbers", all.len());
    let own = all.get(offset..).filter(|_| stride >= 3).ok_or_else(wrong)?;
    let count = number("count").unwrap_or(own.len() / stride);
    let last = count.checked_sub(1).map(|last| last.checked_mul(stride).and_then(|at| at.checked_add(3)));
    if last.is_some_and(|end| end.is_none_or(|end| end > own.len())) {
        return Err(wrong());
    }
    Ok(own.chunks(stride).take(count).map(|p| DVec3::new(p[0], p[1], p[2])).collect())
}

/// The motion that an element of a node is.
fn motion(element: Node<'_, '_>) -> Result<DMat4, String> {
    let tag = element.tag_name().name();
    if !["matrix", "translate", "rotate", "scale"].contains(&tag) {
        return Ok(DMat4::IDENTITY);
    }
    Ok(match (tag, numbers(element)?.as_slice()) {
        ("translate", &[x, y, z]) => DMat4::from_translation(DVec3::new(x, y, z)),
        ("scale", &[x, y, z]) => DMat4::from_scale(DVec3::new(x, y, z)),
        ("rotate", &[x, y, z, angle]) => {
            let axis = DVec3::new(x, y, z).try_normalize().ok_or("a rotation of it has no axis")?;
            DMat4::from_quat(DQuat::from_axis_angle(axis, angle.to_radians()))
        }
        // row by row
        ("matrix", all) if all.len() == 16 => DMat4::from_cols_slice(all).transpose(),
        (tag, all) => return Err(format!("a `{tag}` of it has {} numbers", all.len())),
    })
}

fn numbers(element: Node<'_, '_>) -> Result<Vec<f64>, String> {
    let text = element.text().unwrap_or_default();
    let number = |word: &str| word.parse::<f64>().map_err(|_| format!("`{word}` in it is no number"));
    text.split_whitespace().map(number).collect()
}
