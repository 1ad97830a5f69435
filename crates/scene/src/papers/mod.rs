//! The scenes of the papers' experiments, written as scene files.
//!
//! In: which one, a seed, options. Out: its text, a few dozen lines of TOML. Never here: reading it, drawing.
//! Numbers of objects and triangles and the events of the paths are the papers'; positions, shapes and times are ours.

mod auditorium;
mod camera_path;
mod domes;
mod grove;
mod library;
mod walkthrough;

metachron_core::choices! {
    /// One of the scenes.
    pub enum Paper {
        /// 384 seats and a stage, 87,565 triangles (FS93, §8).
        Auditorium = "auditorium",
        /// Trees of three kinds (RH05, §6).
        Grove = "grove",
        /// Eight domes of 120 struts (MB97, §8).
        Domes = "domes",
        /// 200 meshes of 1.5 million triangles and a sudden turn (GB99).
        Walkthrough = "walkthrough",
        /// A room of 19,800 triangles whose shading is chosen too (FS93, fig. 11).
        Library = "library",
    }
}

/// Options of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choices {
    /// Seed of everything random; equal seeds give equal text.
    pub seed: u32,
    /// Trees of the grove, 3 … 3000.
    pub trees: u32,
    /// Whether the path through the grove is the one with two sudden turns.
    pub zigzag: bool,
    /// Whether its trees have no levels: as much of the full mesh is drawn as there is time for.
    pub prefix: bool,
}

impl Default for Choices {
    /// The options of the built-in scenes.
    fn default() -> Self {
        Self { seed: 1, trees: 600, zigzag: false, prefix: false }
    }
}

impl Paper {
    /// The scene as TOML.
    #[must_use]
    pub fn text(self, choices: &Choices) -> String {
        match self {
            Self::Auditorium => auditorium::text(choices.seed),
            Self::Grove => grove::text(choices),
            Self::Domes => domes::text(),
            Self::Walkthrough => walkthrough::text(choices.seed),
            Self::Library => library::text(),
        }
    }
}

/// The head of a file: comment, description, target, path of the camera.
fn head(comment: &str, description: &str, path: &camera_path::CameraPath) -> String {
    format!("# {comment}\nformat = 1\ndescription = \"{description}\"\n\n[target]\nframe_hz = 30.0\n\n{}", path.text())
}

/// A floor.
const FLOOR: &str = "\n[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\ncolour = \"#8d8a84\"\n";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Source, load};
    use metachron_drawable::Model;
    use metachron_world::Scene;

    fn scene(paper: Paper, choices: &Choices) -> Scene {
        let text = paper.text(choices);
        load(&Source::memory(paper.name(), text.as_bytes()).unwrap(), &[]).unwrap()
    }

    /// Fewest and most triangles of all scenery of a scene, without proxies.
    fn triangles(scene: &Scene) -> (u32, u32) {
        let ranges = scene.scenery.iter().map(|it| it.model.range());
        ranges.fold((0, 0), |(least, most), range| (least + range.0, most + range.1))
    }

    #[test]
    fn the_built_in_scenes_are_what_the_generators_write() {
        for paper in Paper::ALL {
            let file = format!("{}/../../scenes/{}.toml", env!("CARGO_MANIFEST_DIR"), paper.name());
            let kept = std::fs::read_to_string(file).unwrap();
            assert_eq!(kept, paper.text(&Choices::default()), "metachron generate {} writes it", paper.name());
        }
    }

    #[test]
    fn the_auditorium_has_the_papers_polygons_and_seats() {
        let scene = scene(Paper::Auditorium, &Choices::default());
        assert_eq!(triangles(&scene).1, 87_565);
        assert_eq!(scene.scenery.iter().filter(|it| it.name.starts_with("seat")).count(), 384);
        assert_eq!(scene.scenery.len(), 384 + 16);
    }

    #[test]
    fn the_grove_has_trees_of_the_papers_three_kinds() {
        for (trees, prefix) in [(600, false), (1000, false), (2000, true)] {
            let scene = scene(Paper::Grove, &Choices { trees, prefix, ..Choices::default() });
            let of = |most: u32| scene.scenery.iter().filter(|it| it.model.range().1 == most).count() as u32;
            let each = [620, 480, 890, 720, 1740, 1800].map(of);
            assert_eq!(each.iter().sum::<u32>(), 2 * trees);
            assert!(each.iter().all(|n| n.abs_diff(trees / 3) <= 1), "{each:?}");
            let strokes = |it: &Model| matches!(it, Model::Foliage(foliage) if !foliage.full_only());
            assert!(scene.scenery.iter().all(|it| strokes(&it.model) != prefix));
        }
    }

    #[test]
    fn the_domes_cost_the_papers_nominal_sum_at_their_coarsest() {
        let scene = scene(Paper::Domes, &Choices::default());
        // six times as much in full
        assert_eq!(triangles(&scene), (3840, 23_040));
        assert_eq!((scene.scenery.len(), scene.groups.len()), (8 * 120, 8));
        assert!(scene.groups.iter().all(|group| group.members.len() == 120 && group.proxy.model.range().1 == 20));
        // both ends of every strut are on the sphere of its dome
        for group in &scene.groups {
            for strut in &scene.scenery[group.members.clone()] {
                for end in [-1.0, 1.0] {
                    let out = strut.at.place(glam::DVec3::Z * end) - group.proxy.at.position;
                    assert!((out.length() - group.proxy.at.scale).abs() < 1e-9, "{}", strut.name);
                }
            }
        }
    }

    #[test]
    fn the_walkthrough_has_200_meshes_of_one_and_a_half_million_triangles() {
        let scene = scene(Paper::Walkthrough, &Choices::default());
        assert_eq!(scene.scenery.len(), 200);
        let all = f64::from(triangles(&scene).1);
        assert!((all / 1.5e6 - 1.0).abs() < 1e-3, "{all}");
    }

    #[test]
    fn the_library_has_the_papers_polygons_and_leaves_its_shading_to_the_policy() {
        let scene = scene(Paper::Library, &Choices::default());
        assert_eq!(triangles(&scene).1, 19_800); // the paper: 19,821
        assert!(scene.scenery.iter().all(|it| it.appearance.shading == metachron_world::kinds::ShadingKind::Any));
    }

    #[test]
    fn no_camera_path_turns_so_far_between_keyframes_that_it_looks_at_its_eye() {
        for (paper, zigzag) in Paper::ALL.map(|p| (p, false)).into_iter().chain([(Paper::Grove, true)]) {
            let camera = scene(paper, &Choices { zigzag, ..Choices::default() }).cameras.remove(0).camera;
            let length = camera.length_s().unwrap();
            for k in 0..4000 {
                let view = camera.view_at(length * f64::from(k) / 4000.0);
                assert!(view.eye_m.distance(view.look_at_m) > 2.0, "{} at {k}", paper.name());
            }
        }
    }
}
