//! The memory that a scene asks for, from its numbers alone: added up before anything of it is made.
//!
//! In: counts of triangles, nodes and copies, heads of files. Out: bytes, and the line that asks for most of them.
//! Never here: the data itself.
//! Bytes a piece are measured on 64-bit Linux, of a scene whose world has started; `tests/memory.rs` holds them to a fifth.

use super::diagnostic::Problem;
use metachron_models::soft::{SoftShape, VERTICES_MAX};
use metachron_world::Spec;
use std::ops::Range;

/// The beginning of a file, which says its contents, and its whole length.
pub(super) struct FileHead {
    pub(super) start: Vec<u8>,
    pub(super) bytes: u64,
}

/// Memory that one thing takes, bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Cost {
    /// As long as the scene is there, once for all copies of an object.
    kept_bytes: u64,
    /// As long as the scene is there, for each copy.
    copy_bytes: u64,
    /// Beyond that while it is made: things are made one after the other.
    making_bytes: u64,
}

impl Cost {
    /// A mesh that is drawn.
    pub(super) const fn mesh(triangles: u64) -> Self {
        Self { kept_bytes: 60 * triangles, copy_bytes: 0, making_bytes: 390 * triangles }
    }

    /// A mesh that is drawn, from a file.
    pub(super) fn mesh_of_file(head: &FileHead) -> Self {
        Self::mesh(triangles_of(head)).with_file(head)
    }

    /// The boughs and leaves of a tree.
    pub(super) const fn tree(boughs: u64, leaves: u64) -> Self {
        Self { kept_bytes: 480 * boughs + 200 * leaves, copy_bytes: 0, making_bytes: 100 * boughs + 60 * leaves }
    }

    /// An image of so many pixels.
    pub(super) const fn image(pixels: u64) -> Self {
        Self { kept_bytes: 4 * pixels, copy_bytes: 0, making_bytes: 8 * pixels }
    }

    /// A solid of triangles; each fixed copy has a tree of them of its own.
    pub(super) const fn solid(triangles: u64, is_fixed: bool) -> Self {
        let (copy, making) = if is_fixed { (470, 200) } else { (115, 640) };
        Self { kept_bytes: 40 * triangles, copy_bytes: copy * triangles, making_bytes: making * triangles }
    }

    /// The same from a file.
    pub(super) fn solid_of_file(head: &FileHead, is_fixed: bool) -> Self {
        Self::solid(triangles_of(head), is_fixed).with_file(head)
    }

    /// The skin of a soft body and the cage of so many nodes that carries it.
    pub(super) const fn skin(triangles: u64, nodes: u64) -> Self {
        let Self { copy_bytes, making_bytes, .. } = Self::soft(nodes);
        Self { kept_bytes: 0, copy_bytes: copy_bytes + 150 * triangles, making_bytes: making_bytes + 90 * triangles }
    }

    /// A soft body from a file: its points are vertices, or a skin in a cage of some number of nodes that the file does not tell.
    pub(super) fn soft_of_file(head: &FileHead) -> Self {
        let triangles = triangles_of(head);
        Self::skin(triangles, (triangles / 2).min(VERTICES_MAX)).with_file(head)
    }

    /// A sheet from a file.
    pub(super) fn sheet_of_file(head: &FileHead) -> Self {
        Self::sheet((triangles_of(head) / 2).min(VERTICES_MAX)).with_file(head)
    }

    const fn sheet(vertices: u64) -> Self {
        Self { kept_bytes: 0, copy_bytes: 18_000 * vertices, making_bytes: 5000 * vertices }
    }

    /// A soft body of so many vertices; bodies of few are factored, which takes as much again while it is done.
    const fn soft(vertices: u64) -> Self {
        let (copy, making) = if vertices <= 3000 { (3300, 3500) } else { (4700, 0) };
        Self { kept_bytes: 0, copy_bytes: copy * vertices, making_bytes: making * vertices }
    }

    /// The memory of every object that moves, whatever it is: its clock, its snapshots, its place in the broad phase.
    pub(super) const AGENT: Self = Self { kept_bytes: 0, copy_bytes: 23_000, making_bytes: 0 };

    /// The memory that an object takes beyond that for its division.
    pub(super) fn division(spec: &Spec) -> Self {
        match spec {
            Spec::Tube(tube) => {
                let length_m: f64 = tube.path_m.windows(2).map(|ends| ends[0].distance(ends[1])).sum();
                let segments = tube.segments.unwrap_or((length_m / tube.range.eps_m.0).ceil() as usize);
                let copy_bytes = 24 * tube.path_m.len() as u64 + 2800 * segments as u64;
                Self { kept_bytes: 0, copy_bytes, making_bytes: 0 }
            }
            Spec::Soft(soft) => match &soft.shape {
                SoftShape::Sheet { .. } => Self::sheet(soft.shape.vertices()),
                shape => Self::soft(shape.vertices()),
            },
            Spec::Rigid(_) | Spec::Tool(_) | Spec::Synthetic(_) | Spec::Custom(_) => Self::default(),
        }
    }

    /// The same from a file, which is in memory while it is read.
    const fn with_file(self, head: &FileHead) -> Self {
        Self { making_bytes: self.making_bytes.saturating_add(head.bytes), ..self }
    }
}

/// The memory of a program with a scene of nothing, bytes.
pub(super) const PROGRAM_BYTES: u64 = 9 << 20;

/// Bytes of the header of a binary STL file, and of each triangle of it.
const STL_BYTES: (u64, u64) = (84, 50);
/// Bytes of a triangle of any other file: half a point, and its corners.
const TRIANGLE_BYTES: u64 = 36;

/// How many triangles a file of this length and beginning has: of a binary STL file exactly.
fn triangles_of(head: &FileHead) -> u64 {
    let binary = head.start.get(80..84).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes).map(u64::from);
    match binary {
        Some(count) if head.bytes == STL_BYTES.0 + STL_BYTES.1 * count => count,
        _ => head.bytes / TRIANGLE_BYTES,
    }
}

/// The memory that one line of a scene asks for.
#[derive(Debug)]
struct Demand {
    span: Range<usize>,
    /// The key and its owner, for messages.
    named: String,
    kept_bytes: u64,
    making_bytes: u64,
}

/// All that the lines of a scene ask for.
#[derive(Debug, Default)]
pub(super) struct Demands {
    all: Vec<Demand>,
    /// Copies of the object that is read.
    copies: u64,
}

impl Demands {
    /// An object of so many copies is read.
    pub(super) fn begin(&mut self, copies: u64) {
        self.copies = copies;
    }

    pub(super) fn add(&mut self, span: Range<usize>, named: String, cost: Cost) {
        let kept_bytes = cost.kept_bytes.saturating_add(cost.copy_bytes.saturating_mul(self.copies));
        self.all.push(Demand { span, named, kept_bytes, making_bytes: cost.making_bytes });
    }

    /// The most that is taken at once, bytes.
    pub(super) fn bytes(&self) -> u64 {
        let kept = self.all.iter().fold(0_u64, |sum, demand| sum.saturating_add(demand.kept_bytes));
        let kept = kept.saturating_add(PROGRAM_BYTES);
        kept.saturating_add(self.all.iter().map(|demand| demand.making_bytes).max().unwrap_or(0))
    }

    /// The problem of a scene that asks for more than `limit_bytes`, at the line that asks for most.
    pub(super) fn beyond(&self, limit_bytes: u64) -> Option<Problem> {
        let all_bytes = self.bytes();
        if all_bytes <= limit_bytes {
            return None;
        }
        let of = |demand: &Demand| demand.kept_bytes.saturating_add(demand.making_bytes);
        let most = self.all.iter().max_by_key(|demand| of(demand))?;
        let found = format!("{} takes {}, of {} that the scene takes", most.named, shown(of(most)), shown(all_bytes));
        let expected = format!("expected at most {} in all, the limit of memory", shown(limit_bytes));
        Some(Problem::new(most.span.clone(), found).expecting(expected))
    }
}

/// Bytes as people read them.
fn shown(bytes: u64) -> String {
    const MIB: f64 = 1_048_576.0;
    let mib = bytes as f64 / MIB;
    if mib < 1024.0 { format!("{mib:.1} MiB") } else { format!("{:.1} GiB", mib / 1024.0) }
}
