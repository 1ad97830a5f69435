//! `import`: a URDF robot or an MJCF model as a scene.
//!
//! In: the model's file, and those that it includes. Out: TOML on standard output or in a file, on standard error what has no place in it. Never here: what a model means.

use super::args::ImportArgs;
use metachron_console::exit::Exit;
use metachron_console::gains::check_output_path;
use metachron_console::output::{BadInput, data, message, rendered};
use metachron_import::{Folders, Imported};
use metachron_scene::{SCENE_BYTES_MAX, Source, load};
use std::path::{Path, PathBuf};

/// Writes the scene.
pub(super) fn command(args: &ImportArgs) -> anyhow::Result<Exit> {
    if let Some(path) = &args.out {
        check_output_path(path, "--out", args.force)?;
    }
    let model = args.model.display();
    let folder = |path: &Path| path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    let (model_folder, out) = (folder(&args.model), args.out.as_deref().unwrap_or(&args.model));
    let scene_folder = folder(out);
    let folders = Folders { model: &model_folder, scene: &scene_folder, read: Some(&read_included) };
    let text = read(&args.model).map_err(|why| BadInput(format!("{model} cannot be read: {why}")))?;
    let imported = match &args.key {
        Some(key) => metachron_import::mjcf_at_key(&text, folders, key),
        None => metachron_import::model(&text, folders),
    };
    let imported = imported.map_err(|why| BadInput(format!("{model}: {why}")))?;
    let Imported { toml, left_out } = imported;
    for entry in left_out {
        message(&format!("{model}: {entry}"));
    }
    // a model may have numbers that are beyond those of scenes, and a mesh that is none
    let name = args.out.as_ref().map_or_else(|| format!("of {model}"), |path| path.display().to_string());
    let checked = Source::recorded(&name, &toml, Some(&scene_folder)).and_then(|source| load(&source, &[]));
    if let Err(error) = checked {
        message(&rendered(&error));
        return Ok(Exit::BadInput);
    }
    match &args.out {
        None => data(&toml)?,
        Some(path) => {
            let refused = |why: std::io::Error| BadInput(format!("{} cannot be written: {why}", path.display()));
            std::fs::write(path, toml).map_err(refused)?;
            message(&format!("scene: {}", path.display()));
        }
    }
    Ok(Exit::Ok)
}

/// The text of a file that the model includes: only the caller of the program may make it wait for a stream.
fn read_included(path: &Path) -> std::io::Result<String> {
    match std::fs::metadata(path)?.is_file() {
        true => read(path),
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
