//! Reads the objects of a scene: each by its model, with names and links.

use super::common::{appearance, faults, levels, pace, refuse_tolerance, tolerance};
use super::contact::{self, GroupNames};
use super::grid::{Copies, copies};
use super::joint::WORLD;
use super::objects::{
    AGENTS_MAX, Entry, ModelContext, ModelFile, NamedObject, Names, OBSTACLES_MAX, Objects, RigidFiles, SceneContext,
    too_many,
};
use super::{rigid, scenery, soft, tool, tube};
use crate::check::{Checker, Place};
use crate::demand::Cost;
use crate::diagnostic::{Problem, did_you_mean};
use crate::format::{CommonFile, MODELS, OneOrRange, model_named};
use crate::source::Source;
use metachron_core::{AgentId, Resolution, ResolutionRange};
use metachron_geometry::Obstacle;
use metachron_models::rigid::{KinematicBody, RigidBody};
use metachron_models::rod::Tube;
use metachron_models::rod::TubeError;
use metachron_models::soft::SoftBody;
use metachron_models::synthetic::Synthetic;
use metachron_models::tool::Tool;
use metachron_world::kinds::Material;
use metachron_world::{Appearance, Member, Spec};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Default spacing of a synthetic agent, metres.
const SYNTHETIC_EPS_M: f64 = 0.01;
/// Longest name, in characters.
const NAME_MAX: usize = 64;

/// Names that an object may refer to.
struct Known<'a> {
    names: &'a Names,
    groups: &'a GroupNames,
}

/// Reads every `[[object]]`.
pub(crate) fn read_objects(c: &mut Checker<'_, '_>) -> Vec<Entry> {
    let Some(list) = c.document().root().get("object") else { return Vec::new() };
    let DeValue::Array(items) = list.get_ref() else {
        let found = format!("`object` is of type {}", list.get_ref().type_str());
        c.push(Problem::new(list.span(), found).expecting("expected tables under `[[object]]`"));
        return Vec::new();
    };
    let mut read = |(i, item)| {
        let entry = read_entry(c, i, item);
        if entry.is_none()
            && let Some(name) = item.get_ref().as_table().and_then(|table| table.get("name")?.get_ref().as_str())
        {
            c.unread(name);
        }
        entry
    };
    let mut entries: Vec<Entry> = items.iter().enumerate().filter_map(&mut read).collect();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for entry in &mut entries {
        if let ModelFile::Rigid(file) = &entry.model {
            entry.fixed = rigid::is_fixed(c, &entry.place, file);
        }
        entry.fixed |= entry.model.is_scenery();
        let (what, most) = match (entry.model.is_scenery(), entry.fixed) {
            (true, _) => ("meshes and trees", OBSTACLES_MAX),
            (_, true) => ("fixed objects", OBSTACLES_MAX),
            _ => ("agents", AGENTS_MAX),
        };
        entry.copies = copies(c, &entry.place, &entry.common, entry.model.repeats(), most);
        let count = counts.entry(what).or_insert(0);
        *count += entry.copies.len() * entry.model.parts();
        // no copies of this object and of later ones are made
        if *count > most {
            too_many(c, &entry.place.path, &format!("{count} {what}"), most);
            entry.copies = Copies::single();
            break;
        }
    }
    entries
}

/// Makes the objects of the `entries`, as far as a draft does.
pub(crate) fn make_objects(c: &mut Checker<'_, '_>, entries: &[Entry], context: &SceneContext<'_>) -> Objects {
    let names = assign_names(c, entries);
    let groups = GroupNames::of(c, entries.iter().filter_map(|e| Some((&e.place, e.common.contact.as_ref()?))));
    let (obstacles, obstacle_appearances) = fixed_objects(c, entries, context.source, &groups);
    let obstacles: Arc<[Obstacle]> = obstacles.into();
    let agents = agents(c, entries, &Known { names: &names, groups: &groups }, context);
    let scenery = scenery::read(c, entries, context.source);
    Objects { agents, obstacles, obstacle_appearances, scenery, names }
}

fn read_entry(c: &mut Checker<'_, '_>, index: usize, item: &Spanned<DeValue<'_>>) -> Option<Entry> {
    let path = format!("object.{index}");
    let DeValue::Table(table) = item.get_ref() else {
        let found = format!("entry {} of `object` is of type {}", index + 1, item.get_ref().type_str());
        c.push(Problem::new(item.span(), found).expecting("expected a table: `[[object]]`"));
        return None;
    };
    let model = model_name(c, table, item.span())?;
    let place = c.place(&path);
    let mut own = table.clone();
    own.remove("model");
    // `hold` with a list of sides is a key of the soft models, not the common one
    let sides = own.remove("hold").filter(|hold| matches!(hold.get_ref(), DeValue::Array(_)));
    if let (None, Some((key, hold))) = (&sides, table.get_key_value("hold")) {
        own.insert(key.clone(), hold.clone());
    }
    let mut parts = Parts { place: &place, keys: vec!["model".to_owned()], rest: own };
    let common = parts.take::<CommonFile>(c);
    if let (Some(hold), Some((key, _))) = (sides, table.get_key_value("hold")) {
        parts.rest.insert(key.clone(), hold);
    }
    let own = match model {
        "tube" => parts.rest(c).map(ModelFile::Tube),
        "rigid" => parts.both(c).map(|(solid, body)| ModelFile::Rigid(RigidFiles { solid, body })),
        "sheet" => parts.both(c).map(|(soft, file)| ModelFile::Sheet(soft, file)),
        "solid" => parts.both(c).map(|(soft, file)| ModelFile::Solid(soft, file)),
        "rope" => parts.both(c).map(|(soft, file)| ModelFile::Rope(soft, file)),
        "tool" => parts.rest(c).map(ModelFile::Tool),
        "mesh" => parts.rest(c).map(ModelFile::Mesh),
        "tree" => parts.rest(c).map(ModelFile::Tree),
        _ => parts.both(c).map(|(spec, file)| ModelFile::Synthetic(spec, file)),
    };
    let (common, model) = (common?, own?);
    Some(Entry { place, common, model, fixed: false, copies: Copies::single() })
}

/// A table that is read as several types, each of which takes its own keys of it.
struct Parts<'a, 't> {
    place: &'a Place,
    /// Those of the types before.
    keys: Vec<String>,
    /// The keys that no type has taken yet.
    rest: DeTable<'t>,
}

impl Parts<'_, '_> {
    /// Reads the keys of `T`, which are then taken.
    fn take<T: DeserializeOwned + JsonSchema + 'static>(&mut self, c: &mut Checker<'_, '_>) -> Option<T> {
        let keys = c.keys::<T>();
        let all = std::mem::take(&mut self.rest);
        let (own, rest) = all.into_iter().partition(|(key, _)| keys.iter().any(|own| own == key.get_ref()));
        self.rest = rest;
        self.keys.extend(keys);
        c.read(self.place, own, &[])
    }

    /// Reads all that is left as `T`.
    fn rest<T: DeserializeOwned + JsonSchema + 'static>(self, c: &mut Checker<'_, '_>) -> Option<T> {
        c.read(self.place, self.rest, &self.keys.iter().map(String::as_str).collect::<Vec<_>>())
    }

    /// Reads the keys of `T`, and all others as `U`.
    fn both<T, U>(mut self, c: &mut Checker<'_, '_>) -> Option<(T, U)>
    where
        T: DeserializeOwned + JsonSchema + 'static,
        U: DeserializeOwned + JsonSchema + 'static,
    {
        let (first, rest) = (self.take(c), self.rest(c));
        first.zip(rest)
    }
}

fn model_name(c: &mut Checker<'_, '_>, table: &DeTable<'_>, span: Range<usize>) -> Option<&'static str> {
    let list = MODELS.map(|m| format!("`{m}`")).join(", ");
    let Some(value) = table.get("model") else {
        let problem = Problem::new(span, "the key `model` is missing".to_owned());
        c.push(problem.expecting(format!("expected `model` in this table: one of {list}")));
        return None;
    };
    let found = value.get_ref().as_str();
    if let Some(model) = found.and_then(model_named) {
        return Some(model);
    }
    let message = match found {
        Some(found) => format!("`model` is `{found}`, which does not exist"),
        None => format!("`model` is of type {}", value.get_ref().type_str()),
    };
    let help = found.and_then(|found| did_you_mean(found, MODELS));
    c.push(Problem::new(value.span(), message).expecting(format!("expected one of {list}")).helped(help));
    None
}

/// Gives every object its name and every agent its id, in the order of the file.
fn assign_names(c: &mut Checker<'_, '_>, entries: &[Entry]) -> Names {
    let mut names = Names::default();
    let mut next = 0;
    for entry in entries {
        let name = &entry.common.name;
        let named = |id: AgentId| match (&entry.model, entry.fixed) {
            (ModelFile::Mesh(_) | ModelFile::Tree(_), _) => NamedObject::Scenery,
            (_, true) => NamedObject::Fixed,
            (ModelFile::Tube(_), _) => NamedObject::Tube(id),
            (ModelFile::Rigid(_), _) => NamedObject::Rigid(id),
            (ModelFile::Sheet(..) | ModelFile::Solid(..) | ModelFile::Rope(..), _) => NamedObject::Soft(id),
            (ModelFile::Tool(_), _) => NamedObject::Tool(id),
            (ModelFile::Synthetic(..), _) => NamedObject::Synthetic(id),
        };
        let first = next;
        next += if entry.fixed { 0 } else { entry.copies.len() as u32 };
        let length = name.chars().count();
        if name.trim().is_empty() || length > NAME_MAX || name.chars().any(char::is_control) {
            let expected = format!("expected 1 to {NAME_MAX} printable characters");
            c.wrong(&entry.place.unnamed(), "name", "is not a valid name", expected);
            continue;
        }
        if name == WORLD {
            let what = format!("is `{WORLD}`, the name of the fixed world in joints");
            c.wrong(&entry.place.unnamed(), "name", what, "expected another name");
        }
        let taken = (first..).zip(entry.copies.names(name)).filter_map(|(id, name)| {
            let before = names.0.insert(name.clone(), named(AgentId(id)));
            before.map(|_| name)
        });
        if let Some(name) = taken.collect::<Vec<_>>().first() {
            let what = format!("is `{name}`, the name of another object");
            c.wrong(&entry.place.unnamed(), "name", what, "expected a unique name");
        }
    }
    names
}

fn fixed_objects(
    c: &mut Checker<'_, '_>,
    entries: &[Entry],
    source: &Source,
    groups: &GroupNames,
) -> (Vec<Obstacle>, Vec<Appearance>) {
    let mut found = (Vec::new(), Vec::new());
    for entry in entries.iter().filter(|e| e.fixed) {
        let ModelFile::Rigid(file) = &entry.model else { continue };
        c.begin_object(entry.copies.len());
        // checked although not used: a fixed object has no steps, but a wrong rate is still wrong
        pace(c, &entry.place, &entry.common);
        refuse_tolerance(c, &entry.place, &entry.common);
        let appearance = appearance(c, &entry.place, &entry.common, Material::Plastic);
        let traits = groups.traits(c, &entry.place, entry.common.contact.as_ref());
        if let Some(obstacle) = rigid::obstacle(c, &entry.place, file, source) {
            let obstacle = Obstacle { traits, ..obstacle };
            for (copy, name) in entry.copies.places(&entry.common.name) {
                let (position, rotation) = (obstacle.position + copy.offset_m, copy.turned(obstacle.rotation));
                found.0.push(Obstacle { name, position, rotation, ..obstacle.clone() });
                found.1.push(appearance);
            }
        }
    }
    found
}

fn agents(c: &mut Checker<'_, '_>, entries: &[Entry], known: &Known<'_>, context: &SceneContext<'_>) -> Vec<Member> {
    let moving: Vec<&Entry> = entries.iter().filter(|e| !e.fixed).collect();
    let count = moving.iter().map(|entry| entry.copies.len()).sum();
    let mut members = Vec::with_capacity(count);
    let mut firsts = Vec::with_capacity(moving.len());
    let mut next = 0;
    for entry in moving {
        c.begin_object(entry.copies.len());
        let asks = if entry.copies.len() > 1 { "grid" } else { "model" };
        c.may_make(&entry.place, asks, Cost::AGENT);
        if let Some(member) = member(c, entry, AgentId(next), known, context) {
            firsts.push((entry, members.len()));
            if c.may_make(&entry.place, asks, Cost::division(&member.spec)) {
                members.extend(entry.copies.members(&member));
            }
        }
        next += entry.copies.len() as u32;
    }
    link(&mut members);
    if c.count() == 0 && !c.is_draft() {
        firsts.iter().for_each(|(entry, at)| check_buildable(c, &entry.place, &members[*at]));
    }
    members
}

/// Reports faults of an object that only its model can find: builds it once and drops it.
fn check_buildable(c: &mut Checker<'_, '_>, place: &Place, member: &Member) {
    let verdict = match member.spec.clone() {
        Spec::Tube(spec) => match Tube::new(spec) {
            Err(TubeError::Cusp { index, degrees }) => {
                let what = format_args!("turns back on itself at point {index}, by {degrees:.0}°");
                return c.wrong(place, &format!("path_m.{index}"), what, "expected a turn of at most 170°");
            }
            Ok(built) => {
                tube::check_step(c, place, &built, member.pace.dt_range.1.as_secs_f64());
                Ok(())
            }
            Err(e) => Err(e.to_string()),
        },
        Spec::Rigid(spec) if spec.led.is_some() => KinematicBody::new(&spec).map(drop).map_err(|e| e.to_string()),
        Spec::Rigid(spec) => RigidBody::new(spec).map(drop).map_err(|e| e.to_string()),
        Spec::Soft(spec) => SoftBody::new(spec).map(drop).map_err(|e| e.to_string()),
        Spec::Tool(spec) => Tool::new(spec).map(drop).map_err(|e| e.to_string()),
        Spec::Synthetic(spec) => {
            Synthetic::new(spec, member.simulation, member.start).map(drop).map_err(|e| e.to_string())
        }
        // no file can name one
        Spec::Custom(_) => Ok(()),
    };
    if let Err(reason) = verdict {
        let span = c.document().locate(&format!("{}.name", place.path));
        let expected = format!("expected a {} that can be built", member.spec.model());
        c.push(Problem::new(span, format!("`{}` cannot be built: {reason}", member.name)).expecting(expected));
    }
}

fn member(
    c: &mut Checker<'_, '_>,
    entry: &Entry,
    id: AgentId,
    known: &Known<'_>,
    context: &SceneContext<'_>,
) -> Option<Member> {
    let Entry { place, common, model, .. } = entry;
    let model_context = ModelContext {
        place,
        source: context.source,
        gravity: context.gravity,
        levels: levels(common),
        sleep: common.sleep.unwrap_or(true),
        traits: known.groups.traits(c, place, common.contact.as_ref()),
    };
    let pace = pace(c, place, common);
    let faults = faults(common.faults.as_ref(), context.faults);
    let material = match model {
        ModelFile::Tube(_) | ModelFile::Sheet(..) | ModelFile::Solid(..) => Material::Tissue,
        ModelFile::Tool(_) => Material::Metal,
        _ => Material::Plastic,
    };
    let appearance = appearance(c, place, common, material);
    let levels = model_context.levels;
    // a body without length has one interval: its ε has no effect
    let unit = Resolution { eps_m: 1.0, n: levels.1 };
    let flat = ResolutionRange { eps_m: (1.0, 1.0), n: levels };
    let (spec, start, simulation, picture) = match model {
        ModelFile::Tube(file) => {
            let built = tube::build(c, file, &model_context);
            let (start, range) = (built.spec.resolution, built.spec.range);
            (Spec::Tube(built.spec), start, range, built.picture)
        }
        ModelFile::Rigid(file) => (Spec::Rigid(rigid::build(c, file, &model_context)?), unit, flat, flat),
        ModelFile::Sheet(..) | ModelFile::Solid(..) | ModelFile::Rope(..) => {
            let built = match model {
                ModelFile::Sheet(shared, file) => soft::sheet(c, shared, file, &model_context)?,
                ModelFile::Solid(shared, file) => soft::solid(c, shared, file, &model_context)?,
                ModelFile::Rope(shared, file) => soft::rope(c, shared, file, &model_context),
                _ => return None,
            };
            let range = ResolutionRange { eps_m: built.eps_m.unwrap_or(flat.eps_m), n: levels };
            (Spec::Soft(built.spec), Resolution { eps_m: range.eps_m.0, n: levels.1 }, range, flat)
        }
        ModelFile::Tool(file) => (Spec::Tool(tool::build(c, file, &model_context, known.names)), unit, flat, flat),
        ModelFile::Synthetic(spec, file) => {
            contact::refuse(c, place, common.contact.as_ref());
            let eps_m = file.eps_m.map_or((SYNTHETIC_EPS_M, SYNTHETIC_EPS_M), OneOrRange::ends);
            let range = ResolutionRange { eps_m, n: levels };
            (Spec::Synthetic(*spec), Resolution { eps_m: range.eps_m.1, n: levels.1 }, range, flat)
        }
        ModelFile::Mesh(_) | ModelFile::Tree(_) => return None,
    };
    let (name, host, links) = (common.name.clone(), common.host.clone(), Vec::new());
    let range = (!matches!(spec, Spec::Tool(_))).then_some(simulation);
    let tolerance_m = tolerance(c, place, common, pace, range);
    Some(Member { id, name, spec, pace, tolerance_m, simulation, start, picture, links, appearance, host, faults })
}

/// Links each tool with the agents that it can grasp, in both directions.
fn link(members: &mut [Member]) {
    let mut pairs = Vec::new();
    for member in members.iter() {
        if let Spec::Tool(tool) = &member.spec {
            pairs.extend(tool.graspable.iter().map(|tube| (member.id, *tube)));
        }
    }
    for member in members {
        let of = |(a, b): &(AgentId, AgentId)| match member.id {
            id if id == *a => Some(*b),
            id if id == *b => Some(*a),
            _ => None,
        };
        member.links = pairs.iter().filter_map(of).collect();
    }
}
