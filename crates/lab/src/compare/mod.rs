//! `compare`: a page on which people say which of two films is better, and what their votes say.
//!
//! In: films as `run --video` writes them, or votes as the page saves them. Out: one HTML file with the films in it, a table on standard
//! output. Never here: how strengths follow from votes ([`votes`]), the format of films ([`film`]).

mod film;
mod votes;

use super::args::CompareArgs;
use super::chart::table;
use film::Film;
use metachron_console::exit::Exit;
use metachron_console::files::{check_unread, write_file};
use metachron_console::output::{BadInput, data, message};
use metachron_render::{PictureFile, flip, ssim};
use std::path::{Path, PathBuf};

/// The page; its films stand where it says so.
const PAGE: &str = include_str!("page.html");
const FILMS: &str = "/* films */";
/// Most pictures of two films whose likeness is measured, spread evenly.
const COMPARED: usize = 50;

/// Writes the page of films, or evaluates votes.
///
/// # Errors
/// A file that cannot be read or written, films of different sizes, votes that do not link all films.
pub fn command(args: &CompareArgs) -> anyhow::Result<Exit> {
    if !args.votes.is_empty() {
        let votes = args.votes.iter().map(|path| votes::read(path)).collect::<anyhow::Result<Vec<_>>>()?.concat();
        let strengths = votes::strengths(&votes).map_err(BadInput)?;
        let table = table!(&strengths, |one| film: one.film, votes: one.votes, better(3): one.better,
            strength(3): one.strength, low(3): one.low, high(3): one.high);
        data(&table.text())?;
        return Ok(Exit::Ok);
    }
    check_unread("--out", &args.out, "the page", args.films.iter().map(PathBuf::as_path))?;
    let films = args.films.iter().map(|path| Film::read(path)).collect::<anyhow::Result<Vec<_>>>()?;
    let (first, rest) = films.split_first().filter(|(_, rest)| !rest.is_empty()).ok_or_else(too_few)?;
    for film in rest {
        if film.size != first.size {
            let [(w, h), (v, g)] = [first.size, film.size];
            let sizes =
                format!("{} is {w} × {h} and {} {v} × {g} pixels; expected films of one size", first.name, film.name);
            return Err(BadInput(sizes).into());
        }
        if films.iter().filter(|other| other.name == film.name).count() > 1 {
            return Err(BadInput(format!("two films are called {}; expected names of their own", film.name)).into());
        }
    }
    let pairs = (0..films.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
    let pairs = pairs.map(|(a, b)| (&films[a], &films[b]));
    let likeness =
        table!(pairs, |(a, b)| left: a.name, right: b.name, ssim(4): mean_of(a, b, ssim), flip(4): mean_of(a, b, flip));
    write_page(&films, &args.out)?;
    data(&likeness.text())?;
    message(&format!(
        "{} asks which is better; `metachron compare --votes FILE` evaluates what it saves",
        args.out.display()
    ));
    Ok(Exit::Ok)
}

fn too_few() -> BadInput {
    BadInput("there are fewer than two films; expected at least two, or --votes".to_owned())
}

/// Likeness or difference of two films, the mean over some of their frames.
fn mean_of(a: &Film, b: &Film, of: fn(&PictureFile, &PictureFile) -> Option<f64>) -> f64 {
    let count = a.frames.len().min(b.frames.len());
    let at = (0..count).step_by(count.div_ceil(COMPARED).max(1));
    let values: Vec<f64> = at.filter_map(|k| of(&a.picture(k), &b.picture(k))).collect();
    values.iter().sum::<f64>() / values.len() as f64
}

fn write_page(films: &[Film], path: &Path) -> anyhow::Result<()> {
    let films = films.iter().map(Film::packed).collect::<anyhow::Result<Vec<_>>>()?;
    // a name may have characters that would end the script
    let listed = serde_json::to_string(&films)?.replace('<', "\\u003c");
    write_file(path, PAGE.replacen(FILMS, &listed, 1))
}
