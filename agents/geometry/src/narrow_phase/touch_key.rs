//! Names of contacts from step to step: which features of two shapes meet.
//!
//! In: numbers of features. Out: keys that are equal only where all of them are. Never here: where the features are.

/// The name of a contact among those of a pair of shapes. It holds whole numbers of features: no two features share a name, however many
/// there are. Keys rise by pieces, kind, parts, features and place.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub struct TouchKey {
    /// The pieces of both shapes that meet: a tool has six, all else one.
    pub pieces: [u8; 2],
    /// The kind of features that meet.
    pub kind: TouchKind,
    /// The convex parts of both sides, or the triangle of a static mesh and the part on it; zero for all else.
    pub parts: [u32; 2],
    /// The features of both sides, as the kind numbers them.
    pub features: [u32; 2],
    /// The number among the places of these features.
    pub place: u32,
}

/// The kinds of features that meet in a contact.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub enum TouchKind {
    /// Corners, edges or faces of convex parts, as parry packs them.
    #[default]
    Convex,
    /// Corners, edges or faces of a triangle of a static mesh and of a convex part.
    MeshTriangle,
    /// Spans of two chains, or of one with itself.
    Spans,
    /// A node or span of a chain with a solid; the second feature is zero.
    SpanOnSolid,
    /// A vertex of a soft body's skin with anything; the second feature is zero.
    Vertex,
    /// An edge of a skin with an edge of another or of its own, with a span or with a solid.
    Edge,
    /// A triangle of a skin with a node or with a corner of a solid.
    Triangle,
    /// A vertex of the second of two skins with the first; the second feature is zero.
    SecondVertex,
}

impl TouchKey {
    /// The key of a contact of this kind between two features.
    #[must_use]
    pub fn new(kind: TouchKind, features: [u32; 2]) -> Self {
        Self { kind, features, ..Self::default() }
    }

    /// The keys of the same contact between chains after it has passed to a neighbouring span of either; those before the first span and
    /// after the last one exist nowhere.
    #[must_use]
    pub fn beside(self) -> [Self; 4] {
        let [first, second] = self.features;
        let to = |features: [u32; 2]| Self { features, ..self };
        [
            to([first, second.wrapping_add(1)]),
            to([first, second.wrapping_sub(1)]),
            to([first.wrapping_add(1), second]),
            to([first.wrapping_sub(1), second]),
        ]
    }

    /// The same without the triangle on which it is: a corner, a node or a part's feature that slides over a skin or a static mesh keeps this name
    /// from triangle to triangle. Over a border two contacts may have one.
    #[must_use]
    pub fn anywhere(self) -> Self {
        let Self { parts: [_, part], features: [_, second], .. } = self;
        match self.kind {
            TouchKind::Triangle => Self { features: [0, second], place: 0, ..self },
            TouchKind::MeshTriangle => Self { parts: [0, part], features: [0, second], place: 0, ..self },
            _ => self,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_a_power_of_two_apart_have_different_keys() {
        for kind in [TouchKind::Convex, TouchKind::Spans, TouchKind::Vertex, TouchKind::Edge, TouchKind::Triangle] {
            for bit in 0..32 {
                let far = 1_u32 << bit;
                let keys = [[0, 0], [far, 0], [0, far], [far, far]].map(|features| TouchKey::new(kind, features));
                for (i, one) in keys.iter().enumerate() {
                    assert!(keys[..i].iter().all(|other| other != one), "{kind:?}, 2^{bit}");
                }
            }
        }
    }
}
