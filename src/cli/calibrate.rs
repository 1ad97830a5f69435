//! `calibrate`: the cost of drawing on this machine's adapter.
//!
//! In: an adapter, a table in the user's cache or in a file. Out: the table, measured where it is not known. Never here: the measurement and
//! the fit ([`metachron_session::calibrate`]).

use super::args::CalibrateArgs;
use anyhow::Context;
use metachron_console::exit::Exit;
use metachron_console::files::{check_output_path, write_file};
use metachron_console::output::{BadInput, data, message};
use metachron_lod::control::{AREAS_PX, Prices, Shading, Stages, Stroke};
use metachron_render::Gpu;
use metachron_session::calibrate::PriceTable;
use std::fmt::Write;

/// Shows, renews, exports or imports the table.
///
/// # Errors
/// No adapter, a file that cannot be read or written or holds another table, a measurement that failed.
pub(super) fn command(args: &CalibrateArgs) -> anyhow::Result<Exit> {
    if let Some(path) = &args.export {
        check_output_path(path, "--export", args.force)?;
    }
    let gpu = Gpu::headless().context("what drawing costs cannot be measured")?;
    let table = table(args, &gpu)?;
    if let Some(path) = &args.export {
        write_file(path, table.export())?;
    }
    data(&if args.json { table.export() } else { text(&table) })?;
    Ok(Exit::Ok)
}

fn table(args: &CalibrateArgs, gpu: &Gpu) -> anyhow::Result<PriceTable> {
    let adapter = gpu.describe();
    if let Some(path) = &args.import {
        let bad = |why: String| BadInput(format!("{}: {why}", path.display()));
        let text = std::fs::read(path).map_err(|why| bad(why.to_string()))?;
        let table = PriceTable::import(&text, &adapter).map_err(|why| bad(why.to_string()))?;
        table.store().with_context(|| format!("{} is read, but it cannot be stored", path.display()))?;
        return Ok(table);
    }
    if args.renew {
        PriceTable::forget_begun(&adapter);
    }
    let measured = || PriceTable::measure(gpu, message).with_context(|| format!("{adapter} could not be measured"));
    PriceTable::known(&adapter).filter(|_| !args.renew).map_or_else(measured, Ok)
}

fn text(table: &PriceTable) -> String {
    let PriceTable { adapter, prices, misses } = table;
    let mut text = format!(
        "{adapter}\n\
         an empty picture {:.2} ms, each of its pixels {:.2} ns, each pixel enlarged to {:.2} ns\n\
         {:<10} {:>10} {:>12} {:>10} {:>9} {:>9}\n",
        1e3 * prices.frame_s,
        1e9 * prices.pixel_s,
        1e9 * prices.enlarge_s,
        "shading",
        "object µs",
        "triangle ns",
        "vertex ns",
        "pixel ns",
        "beside %"
    );
    let shadings = Shading::PRICED.map(|shading| (shading.name(), prices.of(shading)));
    let strokes = Stroke::ALL.map(Stroke::name).into_iter().zip(prices.strokes);
    for (name, stages) in shadings.into_iter().chain(strokes) {
        let Stages { setup, polygon, vertex, pixel, serial } = stages;
        let (setup_us, beside) = (1e6 * setup, 100.0 * (1.0 - serial));
        let [polygon, vertex, pixel] = [polygon, vertex, pixel].map(|seconds| 1e9 * seconds);
        let _ = writeln!(text, "{name:<10} {setup_us:>10.2} {polygon:>12.1} {vertex:>10.1} {pixel:>9.2} {beside:>9.0}");
    }
    text += &areas(prices);
    let _ = writeln!(
        text,
        "half of the pictures measured take within {:.0} % of what these prices predict, 19 of 20 within {:.0} %",
        100.0 * misses.half,
        100.0 * misses.most
    );
    text
}

/// The prices of triangles by the pixels that they cover.
fn areas(prices: &Prices) -> String {
    let Some(areas) = prices.areas else {
        return "triangles have no prices by the pixels that they cover\n".to_owned();
    };
    let mut text =
        format!("{:<10} {:>10}   a triangle, ns, by the pixels that it covers:\n{:21}", "by area", "object µs", "");
    AREAS_PX.iter().for_each(|area| {
        let _ = write!(text, " {area:>8.0}");
    });
    text.push('\n');
    for (name, of) in Shading::PRICED.map(Shading::name).into_iter().zip(areas) {
        let _ = write!(text, "{name:<10} {:>10.2}", 1e6 * of.setup);
        of.polygon.iter().for_each(|price| {
            let _ = write!(text, " {:>8.1}", 1e9 * price);
        });
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_lod::control::{Areas, Misses};

    #[test]
    fn prices_by_area_are_shown_where_they_are_known() {
        let of = |areas| {
            let prices = Prices { areas, ..Prices::default() };
            text(&PriceTable { adapter: "one".to_owned(), prices, misses: Misses::default() })
        };
        let known = of(Some([Areas { setup: 2e-6, polygon: AREAS_PX.map(|area| 1e-9 * area) }; 4]));
        let line = "textured         2.00      1.0      4.0     16.0     64.0    256.0   1024.0   4096.0";
        assert!(known.contains(line), "{known}");
        assert!(of(None).contains("no prices by the pixels"), "{}", of(None));
    }
}
