//! Which files of a crate use which: every path of a crate's code, followed through re-exports to the file that defines
//! its item.
//!
//! In: the text of a crate's source files. Out: for each file the files of the same crate whose items it uses, and the
//! rings that these make.
//! Never here: arrows between crates, tests.

use super::{files_below, is_test, relative, root};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

/// A module by its path from the crate's root, such as `["rod", "step"]`.
type ModulePath = Vec<String>;

/// The source files of a crate.
pub struct CrateFiles {
    modules: BTreeMap<ModulePath, Module>,
}

struct Module {
    file: String,
    /// Its text without comments, tests and `use` lines.
    code: String,
    imports: Vec<Import>,
}

/// A name that a `use` line brings in.
#[derive(Debug, PartialEq)]
struct Import {
    path: Vec<String>,
    name: String,
    /// Others reach its items through this module.
    is_exported: bool,
}

/// Longer chains of re-exports are rings of their own.
const HOPS_MAX: u32 = 8;

impl CrateFiles {
    /// The files of the crate in `folder`, its tests left out.
    pub fn read(folder: &str) -> Self {
        let src = root().join(folder).join("src");
        let files = files_below(&src, "rs").into_iter().filter(|file| !is_test(&relative(file)));
        let modules = files.map(|file| {
            let inside = file.strip_prefix(&src).unwrap().with_extension("");
            let mut path: ModulePath = inside.iter().map(|part| part.to_string_lossy().into_owned()).collect();
            path.pop_if(|last| ["mod", "lib", "main"].contains(&last.as_str()));
            (path, Module::new(relative(&file), &fs::read_to_string(&file).unwrap()))
        });
        Self { modules: modules.collect() }
    }

    /// For each file the files whose items it uses.
    pub fn arrows(&self) -> BTreeMap<&str, BTreeSet<&str>> {
        self.modules.iter().map(|(path, module)| (module.file.as_str(), self.used_by(path, module))).collect()
    }

    fn used_by(&self, here: &ModulePath, module: &Module) -> BTreeSet<&str> {
        // an exported name is not used for that
        let is_used = |import: &&Import| !import.is_exported || has_word(&module.code, &import.name);
        let imported = module.imports.iter().filter(is_used).map(|import| import.path.clone());
        let named = imported.chain(paths(&module.code));
        named.filter_map(|path| self.definer(here, &path, HOPS_MAX)).filter(|file| *file != module.file).collect()
    }

    /// The file that defines the item which `path` names in the module `here`; `None` of other crates' items, and of modules.
    fn definer(&self, here: &ModulePath, path: &[String], hops: u32) -> Option<&str> {
        let mut at = here.clone();
        let mut rest = path;
        while let Some((head, tail)) = rest.split_first() {
            match head.as_str() {
                "crate" => at.clear(),
                "self" => {}
                "super" => drop(at.pop()),
                _ => break,
            }
            rest = tail;
        }
        let is_relative = rest.len() == path.len();
        for (step, name) in rest.iter().enumerate() {
            at.push(name.clone());
            if self.modules.contains_key(&at) {
                continue;
            }
            at.pop();
            let module = self.modules.get(&at)?;
            if let Some(import) = module.imports.iter().find(|import| import.name == *name) {
                let further: Vec<String> = import.path.iter().chain(&rest[step + 1..]).cloned().collect();
                return if hops == 0 { None } else { self.definer(&at, &further, hops - 1) };
            }
            // a name that is neither a module here nor brought in is another crate's
            return (!is_relative || step > 0).then_some(module.file.as_str());
        }
        None
    }
}

impl Module {
    fn new(file: String, text: &str) -> Self {
        let text = text.split("\nmod tests {").next().unwrap();
        let kept: Vec<_> = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
        let (mut code, mut imports) = (String::new(), Vec::new());
        for statement in kept.join("\n").split_inclusive(';') {
            match use_tree(statement) {
                Some((before, tree, is_exported)) => {
                    code.push_str(before);
                    imports.extend(names(tree, is_exported));
                }
                None => code.push_str(statement),
            }
        }
        Self { file, code, imports }
    }
}

/// The text before the `use` in a statement that ends with one, its tree, and whether it is exported.
fn use_tree(statement: &str) -> Option<(&str, &str, bool)> {
    let is_visibility =
        |word: &str| word.is_empty() || word == "pub" || (word.starts_with("pub(") && word.ends_with(')'));
    statement.rmatch_indices("use ").find_map(|(at, _)| {
        let start = statement[..at].rfind('\n').map_or(0, |end| end + 1);
        let visibility = statement[start..at].trim();
        let tree = statement[at + 4..].trim_end_matches(';');
        // a string may have the word, too
        let is_tree = tree.chars().all(|c| is_of_name(c) || c.is_whitespace() || ":{},*".contains(c));
        (is_visibility(visibility) && is_tree).then_some((&statement[..start], tree, !visibility.is_empty()))
    })
}

/// The names that a tree of a `use` line brings in.
fn names(tree: &str, is_exported: bool) -> Vec<Import> {
    let tree = tree.trim();
    if let Some(open) = tree.find('{') {
        let head = segments(&tree[..open]);
        let inner = &tree[open + 1..tree.rfind('}').unwrap_or(tree.len())];
        let below = parts(inner).into_iter().flat_map(|part| names(part, is_exported));
        return below.map(|import| Import { path: [head.clone(), import.path].concat(), ..import }).collect();
    }
    let (path, alias) = tree.split_once(" as ").map_or((tree, None), |(path, alias)| (path, Some(alias.trim())));
    let path = segments(path);
    let last = path.last().cloned().unwrap_or_default();
    vec![Import { name: alias.map_or(last, str::to_owned), path, is_exported }]
}

fn segments(path: &str) -> Vec<String> {
    path.split("::").map(|part| part.trim().to_owned()).filter(|part| !part.is_empty()).collect()
}

/// The texts between the commas that are in no braces.
fn parts(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut found) = (0_u32, 0, Vec::new());
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                found.push(&list[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    found.push(&list[start..]);
    found.retain(|part| !part.trim().is_empty());
    found
}

const fn is_of_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// Every path of at least two segments in `code`.
fn paths(code: &str) -> Vec<Vec<String>> {
    let pieces = code.split(|c: char| !is_of_name(c) && c != ':');
    pieces.filter(|piece| piece.contains("::")).map(segments).filter(|path| path.len() > 1).collect()
}

fn has_word(code: &str, word: &str) -> bool {
    code.split(|c: char| !is_of_name(c)).any(|found| found == word)
}

/// The files from which `from` can be reached and that can be reached from it.
pub fn ring<'a>(from: &'a str, arrows: &BTreeMap<&'a str, BTreeSet<&'a str>>) -> BTreeSet<&'a str> {
    let reach = |start: &'a str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(file) = open.pop() {
            for next in arrows.get(file).into_iter().flatten().copied() {
                if seen.insert(next) {
                    open.push(next);
                }
            }
        }
        seen
    };
    reach(from).into_iter().filter(|file| reach(file).contains(from)).collect()
}

#[test]
fn names_are_followed_through_re_exports() {
    let module = |file: &str, text: &str| Module::new(file.to_owned(), text);
    let of = |path: &str| segments(path);
    let modules = BTreeMap::from([
        (of(""), module("lib.rs", "mod a;\nmod b;\npub use a::{Deep, inner::Shown as Seen};\nfn own() {}")),
        (of("a"), module("a/mod.rs", "pub mod inner;\npub struct Deep;\npub(crate) use inner::Hidden;")),
        (of("a::inner"), module("a/inner.rs", "use super::Deep;\npub struct Shown;\npub struct Hidden;")),
        (
            of("b"),
            module("b.rs", "use crate::Seen;\nuse std::fs;\nfn f() { super::own(); fs::read(); crate::a::Hidden; }"),
        ),
    ]);
    let files = CrateFiles { modules };
    let arrows = files.arrows();
    assert_eq!(arrows["b.rs"], BTreeSet::from(["a/inner.rs", "lib.rs"]));
    assert_eq!(arrows["a/inner.rs"], BTreeSet::from(["a/mod.rs"]));
    assert!(arrows["lib.rs"].is_empty() && arrows["a/mod.rs"].is_empty(), "what is passed on is not used: {arrows:?}");
    assert!(ring("a/inner.rs", &arrows).is_empty());
}
