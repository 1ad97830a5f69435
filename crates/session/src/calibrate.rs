//! Drawing costs on this adapter: measured once and stored in the user's cache.
//!
//! In: an adapter. Out: prices for control. Never here: a fit (control has it), drawing (the renderer has it).
//! A cache file that is missing, unreadable, of another version or of another adapter is silently measured anew.

use metachron_lod::control::{AREAS_PX, Areas, Measured, Prices, Shading, Stages};
use metachron_render::{Drawn, Gpu, RendererOptions};
use serde::{Deserialize, Serialize};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// Version of the cache files; changes whenever the benchmark or the renderer that it measures changes.
const VERSION: u32 = 5;

/// Kinds of cache files: finished prices, and measured pictures that are still too few for prices.
const DRAWING: &str = "drawing";
const PARTIAL: &str = "begun";

/// A file of the cache.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct CachedPrices {
    version: u32,
    adapter: String,
    frame_s: f64,
    pixel_s: f64,
    enlarge_s: f64,
    /// Per shading: setup, polygon, vertex, pixel, and the part of the faster stage that shows.
    shading: [[f64; 5]; 4],
    /// Per shading, by area: setup, and a triangle at each of [`AREAS_PX`].
    areas: Option<[(f64, [f64; AREAS_PX.len()]); 4]>,
}

/// Measured pictures that are still too few for prices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct PartialBenchmark {
    version: u32,
    adapter: String,
    /// Pixels of the picture, pixels that it was enlarged to, objects, polygons, pixels, number of the shading, seconds.
    pictures: Vec<[f64; 7]>,
}

/// Prices of the adapter of this name: from the cache, else measured on the device that `open` returns, and stored; `None` if there is no
/// such device or it cannot be measured. If a slow adapter leaves too few measurements for prices, the next run continues from them. `report`
/// receives a line if anything is measured.
pub(super) fn prices(adapter: &str, open: impl FnOnce() -> Option<Gpu>, report: fn(&str)) -> Option<Prices> {
    let folder = folder();
    if let Some(known) = folder.as_deref().and_then(|folder| read(folder, adapter)) {
        return Some(known);
    }
    let gpu = &open().filter(|gpu| gpu.describe() == adapter)?;
    let mut pictures = folder.as_deref().map_or_else(Vec::new, |folder| read_partial(folder, adapter));
    let left_s = LONGEST_S * metachron_render::benchmark_left(&AREAS_PX, pictures.len());
    report(&format!("measuring the drawing costs of this adapter, once (about {:.0} s)", left_s.max(1.0)));
    let options = RendererOptions::for_adapter(&gpu.info);
    let drawn = metachron_render::benchmark(gpu, options, &AREAS_PX, pictures.len()).ok()?;
    pictures.extend(drawn.iter().map(measured));
    let prices = Prices::fitted(&pictures);
    match (folder, &prices) {
        (Some(folder), Some(prices)) => {
            store(&folder, adapter, prices);
            // the partial measurement is no longer needed
            let _ = std::fs::remove_file(file(&folder, adapter, PARTIAL));
        }
        // all pictures are there and no prices fit them: measured anew next time
        (Some(folder), None) if metachron_render::benchmark_left(&AREAS_PX, pictures.len()) == 0.0 => {
            let _ = std::fs::remove_file(file(&folder, adapter, PARTIAL));
        }
        (Some(folder), None) => store_partial(&folder, adapter, &pictures),
        (None, _) => {}
    }
    prices
}

/// Longest duration of the measurement, seconds.
const LONGEST_S: f64 = 3.0;

fn measured(drawn: &Drawn) -> Measured {
    let shading = match drawn.shading {
        metachron_render::Shading::Flat => Shading::Flat,
        metachron_render::Shading::Gouraud => Shading::Gouraud,
        metachron_render::Shading::PerPixel => Shading::PerPixel,
        // the benchmark draws no soft shadows
        metachron_render::Shading::Textured | metachron_render::Shading::Shadowed => Shading::Textured,
    };
    let Drawn { picture_px, enlarged_px, polygons, pixels, seconds, .. } = *drawn;
    Measured { picture_px, enlarged_px, objects: f64::from(drawn.objects), polygons, pixels, shading, seconds }
}

/// The cache folder of this user.
fn folder() -> Option<PathBuf> {
    let named = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let home = || named("HOME").map(|home| home.join(".cache"));
    Some(named("XDG_CACHE_HOME").or_else(home).or_else(|| named("LOCALAPPDATA"))?.join("metachron"))
}

fn file(folder: &Path, adapter: &str, what: &str) -> PathBuf {
    let mut hasher = DefaultHasher::new();
    adapter.hash(&mut hasher);
    folder.join(format!("{what}-{:016x}.json", hasher.finish()))
}

fn read(folder: &Path, adapter: &str) -> Option<Prices> {
    let cached: CachedPrices = serde_json::from_slice(&std::fs::read(file(folder, adapter, DRAWING)).ok()?).ok()?;
    let CachedPrices { frame_s, pixel_s, enlarge_s, .. } = cached;
    let all = [frame_s, pixel_s, enlarge_s].into_iter().chain(cached.shading.into_iter().flatten());
    let sound = all.into_iter().all(|price| price.is_finite() && price >= 0.0);
    let stages = |[setup, polygon, vertex, pixel, serial]: [f64; 5]| Stages { setup, polygon, vertex, pixel, serial };
    let areas = cached.areas.map(|areas| areas.map(|(setup, polygon)| Areas { setup, polygon }));
    let sound = sound && areas.iter().flatten().all(Areas::is_sound);
    let prices = Prices { frame_s, pixel_s, enlarge_s, shading: cached.shading.map(stages), areas };
    (sound && cached.version == VERSION && cached.adapter == adapter).then_some(prices)
}

/// Stores the prices; if that fails they are measured again in the next run.
fn store(folder: &Path, adapter: &str, prices: &Prices) {
    let stages = |s: Stages| [s.setup, s.polygon, s.vertex, s.pixel, s.serial];
    let Prices { frame_s, pixel_s, enlarge_s, shading, areas } = *prices;
    let (adapter_name, shading) = (adapter.to_owned(), shading.map(stages));
    let areas = areas.map(|areas| areas.map(|a| (a.setup, a.polygon)));
    let cached = CachedPrices { version: VERSION, adapter: adapter_name, frame_s, pixel_s, enlarge_s, shading, areas };
    write(&file(folder, adapter, DRAWING), &cached);
}

/// The pictures measured so far, up to the first invalid one.
fn read_partial(folder: &Path, adapter: &str) -> Vec<Measured> {
    let text = std::fs::read(file(folder, adapter, PARTIAL)).unwrap_or_default();
    let Ok(partial) = serde_json::from_slice::<PartialBenchmark>(&text) else { return Vec::new() };
    let picture = |[picture_px, enlarged_px, objects, polygons, pixels, shading, seconds]: [f64; 7]| {
        let sound =
            [picture_px, enlarged_px, objects, polygons, pixels, seconds].iter().all(|x| x.is_finite() && *x >= 0.0);
        let shading = Shading::ALL.into_iter().find(|known| f64::from(*known as u8) == shading).filter(|_| sound)?;
        Some(Measured { picture_px, enlarged_px, objects, polygons, pixels, shading, seconds })
    };
    let ours = partial.version == VERSION && partial.adapter == adapter;
    partial.pictures.into_iter().map_while(picture).filter(|_| ours).collect()
}

fn store_partial(folder: &Path, adapter: &str, pictures: &[Measured]) {
    let row = |p: &Measured| {
        let Measured { picture_px, enlarged_px, objects, polygons, pixels, shading, seconds } = *p;
        [picture_px, enlarged_px, objects, polygons, pixels, f64::from(shading as u8), seconds]
    };
    let pictures = pictures.iter().map(row).collect();
    write(
        &file(folder, adapter, PARTIAL),
        &PartialBenchmark { version: VERSION, adapter: adapter.to_owned(), pictures },
    );
}

/// Writes a file atomically, so that no reader sees half of it.
fn write(path: &Path, what: &impl Serialize) {
    let (Some(folder), Ok(text)) = (path.parent(), serde_json::to_vec_pretty(what)) else { return };
    let unfinished = path.with_extension(format!("{}.tmp", std::process::id()));
    let written = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&unfinished, text));
    let _ = written.and_then(|()| std::fs::rename(&unfinished, path));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_partial_benchmark_is_continued() {
        let folder = tempfile::tempdir().unwrap();
        let at = |seconds| Measured {
            picture_px: 57_600.0,
            enlarged_px: 0.0,
            objects: 4.0,
            polygons: 32.0,
            pixels: 900.0,
            shading: Shading::Gouraud,
            seconds,
        };
        let pictures = [at(1e-3), Measured { shading: Shading::Textured, objects: 0.0, ..at(2e-3) }];
        assert_eq!(read_partial(folder.path(), "one"), []);
        store_partial(folder.path(), "one", &pictures);
        assert_eq!(read_partial(folder.path(), "one"), pictures);
        assert_eq!(read_partial(folder.path(), "two"), []);
        // pictures after an invalid one are measured anew
        store_partial(folder.path(), "one", &[at(1e-3), at(-1.0), at(3e-3)]);
        assert_eq!(read_partial(folder.path(), "one"), [at(1e-3)]);
        std::fs::write(file(folder.path(), "one", PARTIAL), "{").unwrap();
        assert_eq!(read_partial(folder.path(), "one"), []);
    }

    #[test]
    fn cached_prices_are_read_back_and_invalid_files_are_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let mut prices = Prices::default();
        prices.shading[1].vertex = 1.25e-7;
        prices.areas = Some([Areas { setup: 2e-6, polygon: AREAS_PX.map(|area| 1e-7 + 3e-9 * area) }; 4]);
        assert_eq!(read(folder.path(), "one"), None);
        store(folder.path(), "one", &prices);
        assert_eq!(read(folder.path(), "one"), Some(prices));
        assert_eq!(read(folder.path(), "two"), None);
        // another adapter's file under this one's name
        std::fs::copy(file(folder.path(), "one", DRAWING), file(folder.path(), "two", DRAWING)).unwrap();
        assert_eq!(read(folder.path(), "two"), None);
        for text in ["", "{", "[1, 2]", "{\"version\": 1}", "\u{0}\u{1}"] {
            std::fs::write(file(folder.path(), "one", DRAWING), text).unwrap();
            assert_eq!(read(folder.path(), "one"), None, "{text}");
        }
        store(folder.path(), "one", &Prices { frame_s: -1.0, ..prices });
        assert_eq!(read(folder.path(), "one"), None, "a price below nothing");
        let areas = prices.areas.map(|areas| areas.map(|a| Areas { setup: -1.0, ..a }));
        store(folder.path(), "one", &Prices { areas, ..prices });
        assert_eq!(read(folder.path(), "one"), None, "one by area below nothing");
    }
}
