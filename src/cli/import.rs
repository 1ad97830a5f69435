//! `import`: a URDF robot or an MJCF model as a scene.
//!
//! In: the model's file, the files that it names, the SRDF file beside a robot. Out: TOML on standard output or in a
//! file with meshes beside it, on standard error or as JSON the parts that have no place in it. Never here: what a
//! model means.

use super::args::ImportArgs;
use anyhow::Context;
use metachron_console::exit::Exit;
use metachron_console::files::{check_output_path, check_unread, write_file};
use metachron_console::output::{BadInput, data, message, print_overlaps, rendered};
use metachron_import::{Folders, Imported, LeftOut, MeshFile, Options, Overlap};
use metachron_scene::{Limits, SCENE_BYTES_MAX, SceneError, Source, load, read_surface};
use metachron_world::Scene;
use serde_json::json;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Longest file that a model names, bytes: as of the files beside a scene.
const MESH_BYTES_MAX: u64 = 64 << 20;

/// Writes the scene.
pub(super) fn command(args: &ImportArgs) -> anyhow::Result<Exit> {
    if let Some(path) = &args.out {
        check_output_path(path, "--out", args.force)?;
    }
    let model = args.model.display();
    let folder = |path: &Path| path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    let (model_folder, out) = (folder(&args.model), args.out.as_deref().unwrap_or(&args.model));
    let scene_folder = folder(out);
    let files_read = RefCell::new(vec![args.model.clone()]);
    let read_plain = |path: &Path| {
        files_read.borrow_mut().push(path.to_owned());
        read_plain(path)
    };
    let folders =
        Folders { model: &model_folder, scene: &scene_folder, read: Some(&read_plain), surface: Some(&read_surface) };
    let text = read(&args.model).map_err(|why| BadInput(format!("{model} cannot be read: {why}")))?;
    let name = args.out.as_ref().map_or_else(|| format!("of {model}"), |path| path.display().to_string());
    let scene = |imported: &Imported| scene_of(imported, &name, &scene_folder);
    let overlaps = |draft: &Imported| scene(draft).map_or_else(|_| Vec::new(), |checked| overlaps(&checked.scene));
    let srdf = srdf(args)?;
    let stem = out.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
    let meshes = format!("{stem}-meshes");
    let options = Options {
        key: args.key.as_deref(),
        srdf: srdf.as_deref(),
        overlaps: Some(&overlaps),
        meshes: Some(&meshes),
        copy_meshes: args.copy_meshes,
        fixed_base: args.fixed_base,
    };
    let imported = metachron_import::model(&text, folders, &options);
    let imported = imported.map_err(|why| BadInput(format!("{model}: {why}")))?;
    // a model may have numbers beyond the ranges of scenes, and a mesh that is none
    let checked = scene(&imported);
    print_list(args, &imported)?;
    match checked {
        Ok(Checked { scene, files_outside }) => {
            print_overlaps(&scene);
            print_outside(args, files_outside);
        }
        Err(error) => {
            message(&rendered(&error));
            return Ok(Exit::BadInput);
        }
    }
    match &args.out {
        None if !imported.files.is_empty() => {
            let what = "meshes of the scene have to be written beside it; expected --out FILE";
            return Err(BadInput(format!("{model}: {what}")).into());
        }
        None => data(&imported.toml)?,
        Some(path) => {
            let beside = srdf.map(|_| args.srdf.clone().unwrap_or_else(|| args.model.with_extension("srdf")));
            let read: Vec<_> = files_read.into_inner().into_iter().chain(beside).collect();
            write_scene(path, &imported, &read, args.force)?;
        }
    }
    Ok(Exit::Ok)
}

/// Says how many meshes are outside of the scene's folder, if any are.
fn print_outside(args: &ImportArgs, files: usize) {
    if files > 0 {
        let (model, hint) =
            (args.model.display(), "run the scene with --allow-outside, or import it with --copy-meshes");
        message(&format!("note: {model}: meshes outside of the scene's folder: {files}; {hint}"));
    }
}

/// Writes a scene with its meshes, over none of the files that were `read`.
fn write_scene(path: &Path, imported: &Imported, read: &[PathBuf], force: bool) -> anyhow::Result<()> {
    let is_new = |path: &Path| check_unread("--out", path, "the model", read.iter().map(PathBuf::as_path));
    is_new(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    write_meshes(&imported.files, folder, |path| {
        is_new(path)?;
        check_mesh(path, force)
    })?;
    write(path, imported.toml.as_bytes())?;
    message(&format!("scene: {}", path.display()));
    Ok(())
}

/// Writes the meshes of a scene into its folder, if each of them may be.
fn write_meshes(files: &[MeshFile], folder: &Path, check: impl Fn(&Path) -> anyhow::Result<()>) -> anyhow::Result<()> {
    files.iter().try_for_each(|file| check(&folder.join(&file.path)))?;
    files.iter().try_for_each(|file| write(&folder.join(&file.path), &file.bytes))
}

/// A scene that was imported, and how many of its meshes are outside of its folder.
struct Checked {
    scene: Scene,
    files_outside: usize,
}

/// The scene of an imported text and its meshes.
fn scene_of(imported: &Imported, name: &str, folder: &Path) -> Result<Checked, SceneError> {
    let files = imported.files.iter().map(|file| (file.path.clone(), file.bytes.clone()));
    let source = Source::recorded(name, &imported.toml, Some(folder))?.with_files(files.collect());
    // the model's meshes are where its author has put them
    let source = source.within(Limits { allow_outside: true, ..Limits::default() });
    Ok(Checked { scene: load(&source, &[])?, files_outside: source.files_outside().len() })
}

/// Refuses a mesh where a link leads elsewhere, or where a file is that may not be written over.
fn check_mesh(path: &Path, force: bool) -> anyhow::Result<()> {
    let refuse = |path: &Path, what: &str| Err(BadInput(format!("{} {what}", path.display())).into());
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(link) = folder.into_iter().chain([path]).find(|path| path.is_symlink()) {
        return refuse(link, "is a link; expected a folder or file of its own for meshes");
    }
    match std::fs::symlink_metadata(path) {
        Ok(_) if !force => refuse(path, "exists already; --force overwrites it, --out FILE names another scene"),
        Ok(about) if !about.is_file() => refuse(path, "is no plain file"),
        _ => Ok(()),
    }
}

/// Writes a file, and the folder that it is in where there is none.
fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let made = folder.map_or(Ok(()), std::fs::create_dir_all);
    made.with_context(|| format!("{} cannot be made", folder.unwrap_or(path).display()))?;
    write_file(path, bytes)
}

fn overlaps(scene: &Scene) -> Vec<Overlap> {
    let overlap =
        |found: &metachron_world::Overlap| Overlap { a: found.a.clone(), b: found.b.clone(), depth_m: found.depth_m };
    scene.overlaps.iter().map(overlap).collect()
}

/// The text of the SRDF file that is named, or else of one beside the model with its name.
fn srdf(args: &ImportArgs) -> anyhow::Result<Option<String>> {
    let beside = args.model.with_extension("srdf");
    let Some(path) = args.srdf.clone().or_else(|| beside.is_file().then_some(beside)) else { return Ok(None) };
    let text = read(&path).map_err(|why| BadInput(format!("{} cannot be read: {why}", path.display())))?;
    Ok(Some(text))
}

/// Prints the parts that the scene has otherwise than the model: as JSON, or in two lists, of equal entries the first
/// with their number.
fn print_list(args: &ImportArgs, imported: &Imported) -> anyhow::Result<()> {
    let (moving, harmless): (Vec<_>, Vec<_>) = imported.left_out.iter().partition(|entry| entry.changes_motion);
    if args.json {
        let overlap = |Overlap { a, b, depth_m }: &Overlap| json!({ "a": a, "b": b, "depth_m": depth_m });
        let list = json!({
            "changes_motion": moving.into_iter().map(entry).collect::<Vec<_>>(),
            "harmless": harmless.into_iter().map(entry).collect::<Vec<_>>(),
            "files": imported.files.iter().map(|file| &file.path).collect::<Vec<_>>(),
            "overlaps": imported.overlaps.iter().map(overlap).collect::<Vec<_>>(),
        });
        return data(&format!("{}\n", serde_json::to_string_pretty(&list)?));
    }
    let model = args.model.display();
    for (title, entries) in [("change the motion", moving), ("change no motion", harmless)] {
        if !entries.is_empty() {
            message(&format!("{model}: {title}: {}", entries.len()));
        }
        let mut counts: BTreeMap<(String, &str), (usize, &LeftOut)> = BTreeMap::new();
        for entry in entries {
            counts.entry((kind(&entry.element), &entry.what)).or_insert((0, entry)).0 += 1;
        }
        let mut counts: Vec<_> = counts.into_values().collect();
        counts.sort_by_key(|(_, first)| (&first.file, first.line));
        for (count, first) in counts {
            let more = if count > 1 { format!(" (and {} more of that kind)", count - 1) } else { String::new() };
            message(&format!("{model}: {first}{more}"));
        }
    }
    for Overlap { a, b, depth_m } in &imported.overlaps {
        let what = "start inside each other and pass through each other";
        message(&format!("{model}: `{a}` and `{b}` {what}: {:.3} mm deep", depth_m * 1e3));
    }
    Ok(())
}

fn entry(LeftOut { file, line, element, what, .. }: &LeftOut) -> serde_json::Value {
    json!({ "file": file, "line": line, "element": element, "what": what })
}

/// The kind of an element: its text without the names in it.
fn kind(element: &str) -> String {
    element.split('`').step_by(2).collect()
}

/// A file that the model names: only the caller of the program may make it wait for a stream.
fn read_plain(path: &Path) -> std::io::Result<Vec<u8>> {
    let about = std::fs::metadata(path)?;
    match about.is_file() {
        true if about.len() > MESH_BYTES_MAX => {
            Err(std::io::Error::other(format!("it has {} bytes, more than {MESH_BYTES_MAX}", about.len())))
        }
        true => std::fs::read(path),
        false => Err(std::io::Error::other("it is no plain file")),
    }
}

fn read(path: &Path) -> std::io::Result<String> {
    let size = std::fs::metadata(path)?.len();
    if size > SCENE_BYTES_MAX {
        return Err(std::io::Error::other(format!("it has {size} bytes, more than {SCENE_BYTES_MAX}")));
    }
    std::fs::read_to_string(path)
}
