//! Bodies of one robot that pass through each other: pairs that the file names, neighbours, pairs that start inside
//! each other.
//!
//! In: a settled [`Model`], and which of its bodies overlap. Out: pairs by name. Never here: shapes, TOML.
//! As in `MuJoCo`'s filter of parents and the collision matrices of `MoveIt`: bodies on two sides of a joint do not
//! collide, wherever fixed joints have put them, and nor do bodies that their joints hold inside each other.

use crate::imported::Overlap;
use crate::model::{Apart, Joint, Kind, Model, Why};

impl Model {
    /// Adds the pairs of one robot that overlap; pairs of two robots, and pairs with the world's own solids, stay as
    /// they are.
    pub(crate) fn pass_overlaps(&mut self, overlaps: Vec<Overlap>) -> Vec<Overlap> {
        let root = |name: &str| {
            let fixed =
                self.fixed.iter().filter(|fixed| fixed.name == name && fixed.can_pass()).map(|fixed| fixed.root);
            self.links.iter().filter(|link| link.name == name).map(|link| Some(link.root)).chain(fixed).next().flatten()
        };
        let of_one = |pair: &Overlap| root(&pair.a).is_some_and(|one| root(&pair.b) == Some(one));
        let found: Vec<Overlap> = overlaps.into_iter().filter(of_one).collect();
        for Overlap { a, b, depth_m } in found.iter().cloned() {
            self.apart.push(Apart { a, b, why: Why::Overlap { depth_m } });
        }
        found
    }

    /// Whether a fixed solid is named in a pair: couplings are between objects that can move.
    pub(crate) fn is_apart(&self, name: &str) -> bool {
        self.apart.iter().any(|pair| pair.a == name || pair.b == name)
    }

    /// Adds pairs that are not there yet.
    pub(crate) fn let_pass(&mut self, a: &str, b: &str, why: Why) {
        let is_it = |pair: &Apart| (pair.a == a && pair.b == b) || (pair.a == b && pair.b == a);
        if a != b && !self.apart.iter().any(is_it) {
            self.apart.push(Apart { a: a.to_owned(), b: b.to_owned(), why });
        }
    }

    /// Adds the pairs that no joint connects itself, and that are on bodies which one does, or on one body: a body is
    /// all links that fixed joints connect, with the links without mass that carry it. Shapes overlap there, as shapes
    /// of connected links do. All of one robot: two that stand on the world collide.
    pub(crate) fn pass_neighbours(&mut self) {
        let above: Vec<Option<&Joint>> = self.above().into_iter().map(|joint| Some(&self.joints[joint?])).collect();
        let bodies = self.bodies(&above);
        // the body that each hangs on
        let hosts: Vec<_> =
            above.iter().map(|joint| Some((*joint)?.parent.and_then(|parent| bodies[parent]))).collect();
        let host = |body: Option<usize>| hosts[body?];
        let meets = |one: Option<usize>, other: Option<usize>| {
            one == other || host(one) == Some(other) || host(other) == Some(one)
        };
        let jointed = |a: usize, b: usize| {
            let between = |child: usize, parent: usize| above[child].is_some_and(|j| j.parent == Some(parent));
            between(a, b) || between(b, a)
        };
        let pairs = (0..self.links.len()).flat_map(|b| (0..b).map(move |a| [a, b]));
        let pairs = pairs.filter(|[a, b]| self.links[*a].root == self.links[*b].root);
        let pairs = pairs.filter(|[a, b]| meets(bodies[*a], bodies[*b]) && !jointed(*a, *b));
        let name = |link: usize| self.links[link].name.clone();
        let mut found: Vec<[String; 2]> = pairs.map(|pair| pair.map(name)).collect();
        for (at, link) in self.links.iter().enumerate().filter(|_| !self.collides_with_base) {
            let own = self.fixed.iter().filter(|fixed| fixed.root == Some(link.root) && fixed.can_pass());
            found.extend(own.filter(|_| meets(bodies[at], None)).map(|fixed| [fixed.name.clone(), link.name.clone()]));
        }
        for [a, b] in found {
            self.let_pass(&a, &b, Why::Neighbours);
        }
    }

    /// For each link the first link of its body; none is the world.
    fn bodies(&self, above: &[Option<&Joint>]) -> Vec<Option<usize>> {
        let mut bodies: Vec<Option<usize>> = Vec::with_capacity(self.links.len());
        for (link, above) in above.iter().enumerate() {
            let is_lent = |joint: &&Joint| joint.parent.is_some_and(|parent| self.links[parent].is_lent);
            let welded = above.filter(|joint| joint.kind == Kind::Fixed || is_lent(joint));
            bodies.push(welded.map_or(Some(link), |joint| joint.parent.and_then(|parent| bodies[parent])));
        }
        bodies
    }
}
