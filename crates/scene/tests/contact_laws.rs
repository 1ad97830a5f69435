//! Laws between agents and the islands in which they begin, as scene files ask for them.

use metachron_contact::Law;
use metachron_core::AgentId;
use metachron_scene::{Source, load};
use metachron_world::Scene;
use metachron_world::contact_laws::{Ties, contact_laws, leaders};

fn balls(ties: &str) -> Scene {
    let text = format!(
        "format = 1\n{ties}\n[[object]]\nname = \"b\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\ngrid = [6, 1, 1]\nspacing_m = [1, 1, 1]\n"
    );
    Source::memory("balls", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap()
}

#[test]
fn jointed_agents_start_in_the_island_of_the_lowest_id() {
    let joint = |a, b| format!("{{ kind = \"fixed\", a = \"b-{a}\", b = \"b-{b}\" }}");
    let scene = balls(&format!("joint = [{}, {}, {}]", joint(5, 3), joint(2, 1), joint(3, 2)));
    let ties = Ties::of(&scene);
    let together: Vec<_> = (0..6).map(|id| ties.together(AgentId(id)).map(|leader| leader.0)).collect();
    assert_eq!(together, [None, None, Some(1), Some(1), None, Some(1)]);
}

#[test]
fn touching_bodies_start_in_one_island_unless_their_law_is_another() {
    let row = |x: f64, more: &str| {
        format!(
            "{{ name = \"{x}\", model = \"rigid\", shape = \"ball\", radius_m = 0.5, position_m = [{x}, 0, 0]{more} }},\n"
        )
    };
    let still =
        [row(0.0, ""), row(1.0, ""), row(2.01, ""), row(3.01, ""), row(4.01, ", velocity_m_s = [1, 0, 0]")].concat();
    let leaders = |ties: &str| {
        let text = format!("format = 1\n{ties}\nobject = [\n{still}]\n");
        let scene = Source::memory("row", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap();
        leaders(&scene).iter().map(|id| id.0).collect::<Vec<_>>()
    };
    assert_eq!(leaders(""), [0, 0, 2, 2, 4]);
    assert_eq!(leaders("coupling = [{ a = \"0\", b = \"1\", law = \"off\" }]"), [0, 1, 2, 2, 4]);
    assert_eq!(leaders("world = { contacts = false }"), [0, 1, 2, 3, 4]);
}

#[test]
fn a_heap_starts_in_one_island_and_a_smaller_or_sparser_one_does_not() {
    let worlds = |grid: &str, spacing: &str, more: &str| {
        let text = format!(
            "format = 1\n{more}\n[[object]]\nname = \"b\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.1, 0.1, 0.1]\nrate_hz = 60.0\ngrid = {grid}\nspacing_m = {spacing}\n"
        );
        let scene = Source::memory("heap", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap();
        leaders(&scene).into_iter().collect::<std::collections::BTreeSet<_>>().len()
    };
    let near = "[0.3, 0.4, 0.4]"; // rows along x: the ball around a box is 0.35 m thick
    assert_eq!(worlds("[129, 2, 1]", near, ""), 2);
    assert_eq!(worlds("[128, 2, 1]", near, ""), 256, "too small");
    assert_eq!(worlds("[129, 2, 1]", "[0.4, 0.4, 0.4]", ""), 258, "too sparse");
    assert_eq!(worlds("[129, 2, 1]", near, "[world]\ncontacts = false"), 258, "nothing touches");
}

#[test]
fn a_world_without_contacts_turns_every_pair_off_except_those_it_names() {
    let coupling = "coupling = [{ a = \"b-4\", b = \"b-1\", law = \"ledger\" }]\n[world]\ncontacts = false";
    let laws = contact_laws(&balls(coupling));
    assert_eq!(laws.len(), 15);
    let on: Vec<_> = laws.iter().filter(|(.., law)| *law != Law::Off).map(|(a, b, _)| (a.0, b.0)).collect();
    assert_eq!(on, [(1, 4)]);
    assert!(contact_laws(&balls("")).is_empty());
}
