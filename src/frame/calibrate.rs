//! What drawing costs on this adapter: measured once, and kept in the user's cache.
//!
//! In: an adapter. Out: prices for control. Never here: a fit (control has it), drawing (the compositor has it).
//! A file that cannot be read, is of another version, another adapter or no file at all is measured anew and says nothing.

use crate::compositor::{self, Drawn, Gpu, RendererOptions};
use crate::control::{AREAS_PX, Areas, Measured, Prices, Shading, Stages};
use serde::{Deserialize, Serialize};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// Another number wherever the benchmark or what it draws with changes.
const VERSION: u32 = 4;

/// A file of the cache.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Kept {
    version: u32,
    adapter: String,
    frame_s: f64,
    pixel_s: f64,
    /// Of each shading: setup, polygon, vertex, pixel.
    shading: [[f64; 4]; 4],
    /// Of each shading by area: setup, and a triangle at every one of [`AREAS_PX`].
    areas: Option<[(f64, [f64; AREAS_PX.len()]); 4]>,
}

/// Prices of the adapter of this name: from the cache, else measured on the device that `open` gives, and put there; `None` where
/// there is no such device or it cannot be measured.
pub(super) fn prices(adapter: &str, open: impl FnOnce() -> Option<Gpu>) -> Option<Prices> {
    let folder = folder();
    if let Some(known) = folder.as_deref().and_then(|folder| read(folder, adapter)) {
        return Some(known);
    }
    let gpu = &open().filter(|gpu| gpu.describe() == adapter)?;
    let drawn = compositor::benchmark(gpu, RendererOptions::for_adapter(&gpu.info), &AREAS_PX).ok()?;
    let prices = Prices::fitted(&drawn.iter().map(measured).collect::<Vec<_>>())?;
    if let Some(folder) = folder {
        keep(&folder, adapter, &prices);
    }
    Some(prices)
}

fn measured(drawn: &Drawn) -> Measured {
    let shading = match drawn.shading {
        compositor::Shading::Flat => Shading::Flat,
        compositor::Shading::Gouraud => Shading::Gouraud,
        compositor::Shading::PerPixel => Shading::PerPixel,
        // nothing is measured in soft shadow
        compositor::Shading::Textured | compositor::Shading::Shadowed => Shading::Textured,
    };
    let Drawn { picture_px, polygons, pixels, seconds, .. } = *drawn;
    Measured { picture_px, objects: f64::from(drawn.objects), polygons, pixels, shading, seconds }
}

/// Where caches of this user are.
fn folder() -> Option<PathBuf> {
    let named = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let home = || named("HOME").map(|home| home.join(".cache"));
    Some(named("XDG_CACHE_HOME").or_else(home).or_else(|| named("LOCALAPPDATA"))?.join("metachron"))
}

fn file(folder: &Path, adapter: &str) -> PathBuf {
    let mut hasher = DefaultHasher::new();
    adapter.hash(&mut hasher);
    folder.join(format!("drawing-{:016x}.json", hasher.finish()))
}

fn read(folder: &Path, adapter: &str) -> Option<Prices> {
    let kept: Kept = serde_json::from_slice(&std::fs::read(file(folder, adapter)).ok()?).ok()?;
    let all = [kept.frame_s, kept.pixel_s].into_iter().chain(kept.shading.into_iter().flatten());
    let sound = all.into_iter().all(|price| price.is_finite() && price >= 0.0);
    let stages = |[setup, polygon, vertex, pixel]: [f64; 4]| Stages { setup, polygon, vertex, pixel };
    let areas = kept.areas.map(|areas| areas.map(|(setup, polygon)| Areas { setup, polygon }));
    let sound = sound && areas.iter().flatten().all(Areas::is_sound);
    let prices = Prices { frame_s: kept.frame_s, pixel_s: kept.pixel_s, shading: kept.shading.map(stages), areas };
    (sound && kept.version == VERSION && kept.adapter == adapter).then_some(prices)
}

/// Writes the file in one go, so that nobody reads half of it; where that fails it is measured again the next time.
fn keep(folder: &Path, adapter: &str, prices: &Prices) {
    let stages = |s: Stages| [s.setup, s.polygon, s.vertex, s.pixel];
    let Prices { frame_s, pixel_s, shading, areas } = *prices;
    let (adapter_name, shading) = (adapter.to_owned(), shading.map(stages));
    let areas = areas.map(|areas| areas.map(|a| (a.setup, a.polygon)));
    let kept = Kept { version: VERSION, adapter: adapter_name, frame_s, pixel_s, shading, areas };
    let (path, Ok(text)) = (file(folder, adapter), serde_json::to_vec_pretty(&kept)) else { return };
    let unfinished = path.with_extension(format!("{}.tmp", std::process::id()));
    let written = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&unfinished, text));
    let _ = written.and_then(|()| std::fs::rename(&unfinished, path));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prices_come_back_as_they_were_kept_and_nothing_else_does() {
        let folder = tempfile::tempdir().unwrap();
        let mut prices = Prices::default();
        prices.shading[1].vertex = 1.25e-7;
        prices.areas = Some([Areas { setup: 2e-6, polygon: AREAS_PX.map(|area| 1e-7 + 3e-9 * area) }; 4]);
        assert_eq!(read(folder.path(), "one"), None);
        keep(folder.path(), "one", &prices);
        assert_eq!(read(folder.path(), "one"), Some(prices));
        assert_eq!(read(folder.path(), "two"), None);
        // another adapter's file under this one's name
        std::fs::copy(file(folder.path(), "one"), file(folder.path(), "two")).unwrap();
        assert_eq!(read(folder.path(), "two"), None);
        for text in ["", "{", "[1, 2]", "{\"version\": 1}", "\u{0}\u{1}"] {
            std::fs::write(file(folder.path(), "one"), text).unwrap();
            assert_eq!(read(folder.path(), "one"), None, "{text}");
        }
        keep(folder.path(), "one", &Prices { frame_s: -1.0, ..prices });
        assert_eq!(read(folder.path(), "one"), None, "a price below nothing");
        let areas = prices.areas.map(|areas| areas.map(|a| Areas { setup: -1.0, ..a }));
        keep(folder.path(), "one", &Prices { areas, ..prices });
        assert_eq!(read(folder.path(), "one"), None, "one by area below nothing");
    }
}
