//! Drawing costs on this adapter: measured once and stored in the user's cache.
//!
//! In: an adapter. Out: prices for control. Never here: a fit (control has it), drawing (the renderer has it).
//! A cache file that is missing, unreadable, of another version or of another adapter is silently measured anew.

use metachron_drawable::PieceKind;
use metachron_lod::control::{AREAS_PX, Areas, Measured, Misses, Prices, Shading, Stages, Stroke};
use metachron_render::{Drawn, Gpu, GpuError, RendererOptions};
use metachron_world::OutputFile;
use serde::{Deserialize, Serialize};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// Version of the cache files; changes whenever the benchmark or the renderer that it measures changes.
const VERSION: u32 = 7;

/// Kinds of cache files: finished prices, and measured pictures that are still too few for prices.
const DRAWING: &str = "drawing";
const PARTIAL: &str = "begun";

/// The version of any file of the cache.
#[derive(Deserialize)]
struct Version {
    version: u32,
}

/// A file of the cache, seconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct CachedPrices {
    version: u32,
    adapter: String,
    /// Relative errors: of half of the pictures, of 19 of 20.
    misses: [f64; 2],
    frame_s: f64,
    pixel_s: f64,
    enlarge_s: f64,
    /// Per shading: setup, polygon, vertex, pixel, and the part of the faster stage that shows.
    shading: [[f64; 5]; 4],
    /// The same of points and of lines.
    strokes: [[f64; 5]; 2],
    /// Per shading, by area: setup, and a triangle at each of [`AREAS_PX`].
    areas: Option<[(f64, [f64; AREAS_PX.len()]); 4]>,
}

/// Measured pictures that are still too few for prices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct PartialBenchmark {
    version: u32,
    adapter: String,
    /// Pixels of the picture, pixels that it was enlarged to, objects, polygons, pixels, number of the shading, number of the stroke from 1 on
    /// or 0 for none, seconds.
    pictures: Vec<[f64; 8]>,
}

/// The prices of drawing on an adapter, and how well they are known.
#[derive(Debug, Clone, PartialEq)]
pub struct PriceTable {
    /// The adapter, as [`Gpu::describe`] names it.
    pub adapter: String,
    /// The prices.
    pub prices: Prices,
    /// Relative errors by which they miss the pictures that they were fitted to.
    pub misses: Misses,
}

/// Why a file is no table of prices for this adapter.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// It is not in the format of [`PriceTable::export`].
    #[error("expected a table of prices as `metachron calibrate --export` writes it: {0}")]
    NoTable(String),
    /// It was measured by another version of the program.
    #[error(
        "the table is of version {found}, this program measures version {expected}: measure anew by `metachron calibrate --renew`"
    )]
    Version {
        /// The version in the file.
        found: u32,
        /// The version of this program.
        expected: u32,
    },
    /// It was measured on another adapter.
    #[error("the table is of the adapter `{found}`, pictures are drawn by `{expected}` here")]
    Adapter {
        /// The adapter in the file.
        found: String,
        /// The adapter here.
        expected: String,
    },
    /// A number of the table cannot be.
    #[error("`{place}` is {found}, expected {expected}")]
    BadNumber {
        /// Where it stands in the file.
        place: String,
        /// The number there.
        found: f64,
        /// The range that it must be in.
        expected: &'static str,
    },
}

/// Why something could not be stored in this user's cache.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The user has no cache.
    #[error("there is no folder for a cache: none of XDG_CACHE_HOME, HOME and LOCALAPPDATA is set")]
    NoFolder,
    /// The file could not be written.
    #[error("{path} cannot be written: {why}")]
    NotWritten {
        /// The file.
        path: String,
        /// The system's reason.
        why: std::io::Error,
    },
}

/// Why prices could not be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// The adapter failed.
    #[error(transparent)]
    Draw(#[from] GpuError),
    /// There was no time for all pictures: the measured ones are kept, and the next measurement goes on from them.
    #[error("{0:.0} % of the pictures could not be drawn within three seconds; the next run goes on with them")]
    Unfinished(f64),
    /// No prices fit the pictures; they are forgotten.
    #[error("no prices fit what was measured, which other programs may have disturbed; the next run measures anew")]
    NoFit,
}

/// Prices of the adapter of this name: the known ones, else measured on the device that `open` returns; `None` if there
/// is no such device or it cannot be measured. `report` receives a line if anything is measured.
pub(super) fn prices(adapter: &str, open: impl FnOnce() -> Option<Gpu>, report: fn(&str)) -> Option<Prices> {
    if let Some(known) = PriceTable::known(adapter) {
        return Some(known.prices);
    }
    let gpu = &open().filter(|gpu| gpu.describe() == adapter)?;
    PriceTable::measure(gpu, report).ok().map(|table| table.prices)
}

impl PriceTable {
    /// The table of the adapter of this name in this user's cache.
    #[must_use]
    pub fn known(adapter: &str) -> Option<Self> {
        read(&folder()?, adapter)
    }

    /// Measures an adapter and stores the table. If a slow adapter leaves too few measurements for prices, the next call goes on from
    /// them; measurements that no prices fit are forgotten. `report` receives a line before, and one if the table could not be stored.
    ///
    /// # Errors
    /// [`CalibrateError`]; no table is stored then.
    pub fn measure(gpu: &Gpu, report: fn(&str)) -> Result<Self, CalibrateError> {
        let (folder, adapter) = (folder(), gpu.describe());
        let mut pictures = folder.as_deref().map_or_else(Vec::new, |folder| read_partial(folder, &adapter));
        let left_s = LONGEST_S * metachron_render::benchmark_left(&AREAS_PX, pictures.len());
        report(&format!("measuring the drawing costs of this adapter, once (about {:.0} s)", left_s.max(1.0)));
        let options = RendererOptions::for_adapter(&gpu.info);
        let drawn = metachron_render::benchmark(gpu, options, &AREAS_PX, pictures.len())?;
        pictures.extend(drawn.iter().map(measured));
        let left = metachron_render::benchmark_left(&AREAS_PX, pictures.len());
        let forget = || folder.as_deref().map(|folder| std::fs::remove_file(file(folder, &adapter, PARTIAL)));
        let Some(prices) = Prices::fitted(&pictures) else {
            if left == 0.0 {
                // all pictures are there and no prices fit them
                forget();
                return Err(CalibrateError::NoFit);
            }
            if let Err(why) = store_partial(folder.as_deref(), &adapter, &pictures) {
                report(&format!("what was measured cannot be kept for the next run: {why}"));
            }
            return Err(CalibrateError::Unfinished(100.0 * left));
        };
        forget();
        let table = Self { misses: prices.misses(&pictures), prices, adapter };
        if let Err(why) = table.store() {
            report(&format!("the prices cannot be kept, the next run measures anew: {why}"));
        }
        Ok(table)
    }

    /// Stores the table in this user's cache.
    ///
    /// # Errors
    /// [`StoreError`]: the adapter is measured again in the next run.
    pub fn store(&self) -> Result<(), StoreError> {
        store(folder().as_deref(), self)
    }

    /// Forgets a measurement of the adapter of this name that has begun; a table that is known stands until another
    /// takes its place.
    pub fn forget_begun(adapter: &str) {
        // a file that is not there is forgotten already
        let _ = folder().map(|folder| std::fs::remove_file(file(&folder, adapter, PARTIAL)));
    }

    /// The table as a file.
    #[must_use]
    pub fn export(&self) -> String {
        // numbers and strings alone: nothing that could not be written
        serde_json::to_string_pretty(&CachedPrices::of(self)).unwrap_or_default() + "\n"
    }

    /// The table that a file holds, for the adapter of this name.
    ///
    /// # Errors
    /// [`ImportError`].
    pub fn import(text: &[u8], adapter: &str) -> Result<Self, ImportError> {
        let no_table = |why: serde_json::Error| ImportError::NoTable(why.to_string());
        let Version { version: found } = serde_json::from_slice(text).map_err(no_table)?;
        if found != VERSION {
            return Err(ImportError::Version { found, expected: VERSION });
        }
        let cached: CachedPrices = serde_json::from_slice(text).map_err(no_table)?;
        if cached.adapter != adapter {
            return Err(ImportError::Adapter { found: cached.adapter, expected: adapter.to_owned() });
        }
        cached.table()
    }
}

/// Longest duration of the measurement, seconds.
const LONGEST_S: f64 = 3.0;

fn measured(drawn: &Drawn) -> Measured {
    // the benchmark draws no soft shadows
    let shading = drawn.shading.min(Shading::Textured);
    let stroke = drawn.strokes.map(|kind| match kind {
        PieceKind::Leaf => Stroke::Point,
        PieceKind::Bough => Stroke::Line,
    });
    let Drawn { picture_px, enlarged_px, polygons, pixels, seconds, .. } = *drawn;
    Measured { picture_px, enlarged_px, objects: f64::from(drawn.objects), polygons, pixels, shading, stroke, seconds }
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

fn read(folder: &Path, adapter: &str) -> Option<PriceTable> {
    PriceTable::import(&std::fs::read(file(folder, adapter, DRAWING)).ok()?, adapter).ok()
}

fn store(folder: Option<&Path>, table: &PriceTable) -> Result<(), StoreError> {
    let folder = folder.ok_or(StoreError::NoFolder)?;
    write(&file(folder, &table.adapter, DRAWING), &CachedPrices::of(table))
}

impl CachedPrices {
    fn of(table: &PriceTable) -> Self {
        let stages = |s: Stages| [s.setup, s.polygon, s.vertex, s.pixel, s.serial];
        let PriceTable { adapter, misses: Misses { half, most }, prices } = table;
        let Prices { frame_s, pixel_s, enlarge_s, shading, strokes, areas } = *prices;
        let areas = areas.map(|areas| areas.map(|a| (a.setup, a.polygon)));
        let (adapter, misses) = (adapter.clone(), [*half, *most]);
        let (shading, strokes) = (shading.map(stages), strokes.map(stages));
        Self { version: VERSION, adapter, misses, frame_s, pixel_s, enlarge_s, shading, strokes, areas }
    }

    /// The table, unless a number of it cannot be.
    fn table(self) -> Result<PriceTable, ImportError> {
        self.check()?;
        let Self { frame_s, pixel_s, enlarge_s, misses: [half, most], .. } = self;
        let stages =
            |[setup, polygon, vertex, pixel, serial]: [f64; 5]| Stages { setup, polygon, vertex, pixel, serial };
        let areas = self.areas.map(|areas| areas.map(|(setup, polygon)| Areas { setup, polygon }));
        let (shading, strokes) = (self.shading.map(stages), self.strokes.map(stages));
        let prices = Prices { frame_s, pixel_s, enlarge_s, shading, strokes, areas };
        Ok(PriceTable { adapter: self.adapter, prices, misses: Misses { half, most } })
    }

    /// Finds the first number that cannot be.
    fn check(&self) -> Result<(), ImportError> {
        let bad = |place: String, found: f64, expected| Err(ImportError::BadNumber { place, found, expected });
        let not_negative = |place: String, found: f64| match found.is_finite() && found >= 0.0 {
            true => Ok(()),
            false => bad(place, found, "a finite number of at least 0"),
        };
        for (name, price) in [("frame_s", self.frame_s), ("pixel_s", self.pixel_s), ("enlarge_s", self.enlarge_s)] {
            not_negative(name.to_owned(), price)?;
        }
        for (k, miss) in self.misses.into_iter().enumerate() {
            not_negative(format!("misses[{k}]"), miss)?;
        }
        let shadings = self.shading.iter().enumerate().map(|(at, stages)| (format!("shading[{at}]"), stages));
        let strokes = self.strokes.iter().enumerate().map(|(at, stages)| (format!("strokes[{at}]"), stages));
        for (at, stages) in shadings.chain(strokes) {
            for (k, number) in stages.iter().enumerate() {
                not_negative(format!("{at}[{k}]"), *number)?;
            }
            if stages[4] > 1.0 {
                return bad(format!("{at}[4]"), stages[4], "a part, 0 to 1");
            }
        }
        for (at, (setup, polygon)) in self.areas.iter().flatten().enumerate() {
            not_negative(format!("areas[{at}][0]"), *setup)?;
            for (k, price) in polygon.iter().enumerate() {
                not_negative(format!("areas[{at}][1][{k}]"), *price)?;
                if k > 0 && *price < polygon[k - 1] {
                    return bad(format!("areas[{at}][1][{k}]"), *price, "no less than for the smaller area before it");
                }
            }
        }
        Ok(())
    }
}

/// The pictures measured so far, up to the first invalid one.
fn read_partial(folder: &Path, adapter: &str) -> Vec<Measured> {
    let text = std::fs::read(file(folder, adapter, PARTIAL)).unwrap_or_default();
    let Ok(partial) = serde_json::from_slice::<PartialBenchmark>(&text) else { return Vec::new() };
    let picture = |[picture_px, enlarged_px, objects, polygons, pixels, shading, stroke, seconds]: [f64; 8]| {
        let sound =
            [picture_px, enlarged_px, objects, polygons, pixels, seconds].iter().all(|x| x.is_finite() && *x >= 0.0);
        let shading = Shading::PRICED.into_iter().find(|known| f64::from(*known as u8) == shading).filter(|_| sound)?;
        let stroke = match Stroke::ALL.into_iter().find(|known| f64::from(*known as u8 + 1) == stroke) {
            None if stroke != 0.0 => return None,
            stroke => stroke,
        };
        Some(Measured { picture_px, enlarged_px, objects, polygons, pixels, shading, stroke, seconds })
    };
    let ours = partial.version == VERSION && partial.adapter == adapter;
    partial.pictures.into_iter().map_while(picture).filter(|_| ours).collect()
}

fn store_partial(folder: Option<&Path>, adapter: &str, pictures: &[Measured]) -> Result<(), StoreError> {
    let row = |p: &Measured| {
        let Measured { picture_px, enlarged_px, objects, polygons, pixels, shading, stroke, seconds } = *p;
        let stroke = stroke.map_or(0, |stroke| stroke as u8 + 1);
        [picture_px, enlarged_px, objects, polygons, pixels, f64::from(shading as u8), f64::from(stroke), seconds]
    };
    let pictures = pictures.iter().map(row).collect();
    let partial = PartialBenchmark { version: VERSION, adapter: adapter.to_owned(), pictures };
    write(&file(folder.ok_or(StoreError::NoFolder)?, adapter, PARTIAL), &partial)
}

/// Writes a file atomically, so that no reader sees half of it.
fn write(path: &Path, what: &impl Serialize) -> Result<(), StoreError> {
    let written = || {
        let text = serde_json::to_vec_pretty(what)?;
        path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
        OutputFile::write(path, text)
    };
    written().map_err(|why| StoreError::NotWritten { path: path.display().to_string(), why })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_that_cannot_be_stored_says_where_and_why() {
        let folder = tempfile::tempdir().unwrap();
        let occupied = folder.path().join("file");
        std::fs::write(&occupied, "").unwrap();
        let table = PriceTable { adapter: "one".to_owned(), prices: Prices::default(), misses: Misses::default() };
        let failed = |folder| store(folder, &table).unwrap_err().to_string();
        assert!(failed(None).contains("HOME"));
        let said = failed(Some(&occupied.join("cache")));
        assert!(said.contains(&occupied.display().to_string()) && said.contains("cannot be written"), "{said}");
    }

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
            stroke: None,
            seconds,
        };
        let textured = Measured { shading: Shading::Textured, objects: 0.0, ..at(2e-3) };
        let pictures = [at(1e-3), textured, Measured { stroke: Some(Stroke::Line), ..at(3e-3) }];
        assert_eq!(read_partial(folder.path(), "one"), []);
        store_partial(Some(folder.path()), "one", &pictures).unwrap();
        assert_eq!(read_partial(folder.path(), "one"), pictures);
        assert_eq!(read_partial(folder.path(), "two"), []);
        // pictures after an invalid one are measured anew
        store_partial(Some(folder.path()), "one", &[at(1e-3), at(-1.0), at(3e-3)]).unwrap();
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
        let table = PriceTable { adapter: "one".to_owned(), prices, misses: Misses { half: 0.03, most: 0.2 } };
        let stored = |table: &PriceTable| {
            store(Some(folder.path()), table).unwrap();
            read(folder.path(), "one")
        };
        assert_eq!(read(folder.path(), "one"), None);
        assert_eq!(stored(&table), Some(table.clone()));
        assert_eq!(read(folder.path(), "two"), None);
        // another adapter's file under this one's name
        std::fs::copy(file(folder.path(), "one", DRAWING), file(folder.path(), "two", DRAWING)).unwrap();
        assert_eq!(read(folder.path(), "two"), None);
        for text in ["", "{", "[1, 2]", "{\"version\": 1}", "\u{0}\u{1}"] {
            std::fs::write(file(folder.path(), "one", DRAWING), text).unwrap();
            assert_eq!(read(folder.path(), "one"), None, "{text}");
        }
        let with = |prices: Prices| PriceTable { prices, ..table.clone() };
        assert_eq!(stored(&with(Prices { frame_s: -1.0, ..prices })), None, "a price below nothing");
        let areas = prices.areas.map(|areas| areas.map(|a| Areas { setup: -1.0, ..a }));
        assert_eq!(stored(&with(Prices { areas, ..prices })), None, "one by area below nothing");
    }

    #[test]
    fn a_table_is_taken_on_its_own_adapter_and_by_its_own_version_alone() {
        let areas = Some([Areas { setup: 2e-6, polygon: AREAS_PX.map(|area| 1e-7 + 3e-9 * area) }; 4]);
        let prices = Prices { areas, ..Prices::default() };
        let table = PriceTable { adapter: "one".to_owned(), prices, misses: Misses::default() };
        let text = table.export();
        assert_eq!(PriceTable::import(text.as_bytes(), "one"), Ok(table.clone()));
        let refused = |text: &str, adapter: &str| PriceTable::import(text.as_bytes(), adapter).unwrap_err().to_string();
        assert!(refused(&text, "two").contains("of the adapter `one`, pictures are drawn by `two`"));
        // a table of before points and lines had prices of their own: asked to be measured anew, not called malformed
        let mut older: serde_json::Value = serde_json::from_str(&text).unwrap();
        older["version"] = (VERSION - 1).into();
        older.as_object_mut().unwrap().remove("strokes");
        let said = refused(&older.to_string(), "one");
        assert!(said.contains("version 6") && said.contains("--renew"), "{said}");
        let with = |change: &dyn Fn(&mut Prices)| {
            let mut table = table.clone();
            change(&mut table.prices);
            refused(&table.export(), "one")
        };
        let least = "expected a finite number of at least 0";
        assert_eq!(with(&|prices| prices.frame_s = -0.0014), format!("`frame_s` is -0.0014, {least}"));
        assert_eq!(with(&|prices| prices.shading[2].pixel = -1.0), format!("`shading[2][3]` is -1, {least}"));
        assert_eq!(with(&|prices| prices.strokes[1].pixel = -1.0), format!("`strokes[1][3]` is -1, {least}"));
        assert_eq!(with(&|prices| prices.shading[0].serial = 1.5), "`shading[0][4]` is 1.5, expected a part, 0 to 1");
        let first = |prices: &mut Prices, of: fn(&mut Areas)| prices.areas.iter_mut().flatten().take(1).for_each(of);
        assert_eq!(with(&|prices| first(prices, |a| a.setup = -1.0)), format!("`areas[0][0]` is -1, {least}"));
        let falling = with(&|prices| first(prices, |a| a.polygon[3] = 0.0));
        assert_eq!(falling, "`areas[0][1][3]` is 0, expected no less than for the smaller area before it");
        // no number is written as null, and read at its line
        assert!(with(&|prices| prices.pixel_s = f64::NAN).contains("invalid type: null, expected f64 at line"));
        for text in ["", "[]", "{}", &text[..text.len() / 2]] {
            assert!(refused(text, "one").contains("expected a table of prices"), "{text}");
        }
    }
}
