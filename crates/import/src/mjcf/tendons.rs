//! Tendons between two sites: ropes where their length is limited, springs where they have a stiffness.
//!
//! In: `tendon` elements. Out: ties of the model. Never here: tendons over several sites or around geoms, and fixed ones, which couple joints
//! (they are listed: scenes have neither), actuators on tendons.

use super::bodies::BodyReader;
use crate::imported::ImportError;
use crate::model::{End, Tie, TieKind};
use crate::xml::{DAMPING_MAX, Element, STRENGTH_MAX};

/// Reads the tendons.
///
/// # Errors
/// For one on a site that there is none of, and numbers that no tendon has.
pub(super) fn read(root: &Element, reader: &mut BodyReader<'_>) -> Result<(), ImportError> {
    for element in root.children("tendon").flat_map(Element::all) {
        let why = match (element.tag.as_str(), element.all()) {
            ("spatial", [a, b]) if [a, b].iter().all(|end| end.tag == "site") => {
                tie(element.read(), [a, b], reader)?;
                continue;
            }
            ("spatial", _) => "is left out: scenes have ropes and springs between two points alone",
            ("fixed", _) => "is left out: it couples joints, and scenes have no such coupling",
            _ => continue,
        };
        element.read_all_within();
        reader.notes.push(element.note(why));
    }
    Ok(())
}

/// The ends of a tendon, and its length where every joint is at its `springref`, metres.
struct Ends {
    ends: [End; 2],
    at_springs_m: f64,
}

/// A tendon between two sites.
fn tie(element: &Element, sites: [&Element; 2], reader: &mut BodyReader<'_>) -> Result<(), ImportError> {
    let Ends { ends, at_springs_m } = ends(sites, reader)?;
    let (stiffness_n_m, damping_n_s_m) =
        (element.up_to(STRENGTH_MAX, "stiffness")?, element.up_to(DAMPING_MAX, "damping")?);
    let limits = limits(element, reader.compiler.auto_limits)?.filter(|_| reader.compiler.has_limits);
    let mut push = |kind: TieKind| reader.model.ties.push(Tie { place: element.place.clone(), ends, kind });
    if let Some([least, greatest]) = limits {
        push(TieKind::Rope { length_m: greatest });
        if least > 0.0 {
            reader.notes.push(element.note("has no least length: a rope of a scene has a greatest alone"));
        }
    }
    let rest = element.list("springlength")?.unwrap_or_else(|| vec![-1.0]);
    let why = match rest.as_slice() {
        _ if stiffness_n_m == 0.0 && damping_n_s_m == 0.0 => {
            limits.is_none().then_some("is left out: nothing acts along it but actuators")
        }
        _ if stiffness_n_m == 0.0 => Some("has no damping: scenes have no damper alone"),
        [rest_m] | [rest_m, _] if rest.iter().all(|end| end == rest_m) => {
            let rest_m = if *rest_m < 0.0 { at_springs_m } else { *rest_m };
            push(TieKind::Spring { stiffness_n_m, damping_n_s_m, rest_m });
            None
        }
        [_, _] => Some("has no spring: one that gives nothing between two lengths is in no scene"),
        all => return Err(element.wrong(format!("`springlength` has {} numbers; expected 1 or 2", all.len()))),
    };
    reader.notes.extend(why.map(|why| element.note(why)));
    Ok(())
}

fn ends(sites: [&Element; 2], reader: &BodyReader<'_>) -> Result<Ends, ImportError> {
    let find = |end: &Element| {
        let name = end.needed("site")?;
        let site = reader.sites.get(name);
        let site = site.ok_or_else(|| end.wrong(format!("names the site `{name}`, and there is none of that name")))?;
        // how sites look has no meaning here
        [end, site.element].into_iter().for_each(Element::read_all_within);
        Ok(site)
    };
    let (a, b) = (find(sites[0])?, find(sites[1])?);
    Ok(Ends { ends: [a.end, b.end], at_springs_m: a.at_springs_m.distance(b.at_springs_m) })
}

/// The least and greatest length of a tendon, metres, where it is limited.
fn limits(element: &Element, auto: bool) -> Result<Option<[f64; 2]>, ImportError> {
    let Some([least, greatest]) = element.numbers("range")? else { return Ok(None) };
    let limited = match element.text("limited").unwrap_or("auto") {
        "auto" => auto,
        given => given == "true",
    };
    if limited && (greatest <= 0.0 || least > greatest) {
        let what = format!("has the `range` {least} {greatest}; expected the lesser first and the greater above zero");
        return Err(element.wrong(what));
    }
    Ok(limited.then_some([least, greatest]))
}
