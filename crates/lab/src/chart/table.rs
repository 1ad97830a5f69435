//! A table for people and for programs: columns, and cells of text or numbers.
//!
//! In: cells. Out: aligned text, or JSON. Never here: where it is printed.

use super::experiment::Named;
use anyhow::Context;
use serde::ser::{Serialize, SerializeMap, SerializeSeq, Serializer};
use serde_json::{Map, Value};

/// The content of a cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Text.
    Text(String),
    /// A number, and its digits after the point in text.
    Number(f64, usize),
}

/// Rows of cells under column names.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The names of the columns; keys in JSON.
    pub columns: Vec<String>,
    /// Each row has as many cells as there are columns.
    pub rows: Vec<Vec<Cell>>,
}

/// A table with a line for each of some rows: `table!(rows, |row| law: row.case.law, "depth, mm"(2): 1e3 * row.depth_m)` shows a text,
/// and a number with two digits after the point; without rows it is a function of them.
macro_rules! table {
    (|$row:pat_param| $($columns:tt)+) => {
        |rows| $crate::chart::table!(rows, |$row| $($columns)+)
    };
    ($rows:expr, |$row:pat_param| $($name:tt $(($digits:literal))?: $value:expr),+ $(,)?) => {{
        let mut table = $crate::chart::Table::new(&[$(stringify!($name).trim_matches('"')),+]);
        for $row in $rows {
            table.rows.push(vec![$($crate::chart::Shown::cell(&$value, 0 $(+ $digits)?)),+]);
        }
        table
    }};
}

pub(crate) use table;

impl Table {
    /// An empty table.
    pub fn new(columns: &[&str]) -> Self {
        Self { columns: columns.iter().map(|&c| c.to_owned()).collect(), rows: Vec::new() }
    }

    /// The same with a column more.
    pub fn with(mut self, name: &str, cells: impl Iterator<Item = Cell>) -> Self {
        self.columns.push(name.to_owned());
        self.rows.iter_mut().zip(cells).for_each(|(row, cell)| row.push(cell));
        self
    }

    /// The table as lines, columns two spaces apart.
    pub fn text(&self) -> String {
        let cells = |row: &Vec<Cell>| row.iter().map(Cell::text).collect::<Vec<_>>();
        let lines: Vec<Vec<String>> =
            std::iter::once(self.columns.clone()).chain(self.rows.iter().map(cells)).collect();
        let width = |k: usize| lines.iter().filter_map(|l| Some(l.get(k)?.chars().count())).max().unwrap_or(0);
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let mut out = String::new();
        for line in &lines {
            let padded = line.iter().zip(&widths).enumerate().map(|(k, (cell, &width))| {
                if self.is_number(k) { format!("{cell:>width$}") } else { format!("{cell:<width$}") }
            });
            out += padded.collect::<Vec<_>>().join("  ").trim_end();
            out.push('\n');
        }
        out
    }

    /// The rows with one of these values in a column.
    ///
    /// # Errors
    /// A column that there is not.
    pub fn only(&self, column: &str, values: &[&str]) -> anyhow::Result<Self> {
        let k = self.place(column)?;
        let named = |row: &&Vec<Cell>| row.get(k).is_some_and(|cell| values.contains(&cell.text().as_str()));
        Ok(Self { columns: self.columns.clone(), rows: self.rows.iter().filter(named).cloned().collect() })
    }

    /// These columns, in this order.
    ///
    /// # Errors
    /// A column that there is not.
    pub fn columns(&self, names: &[&str]) -> anyhow::Result<Self> {
        let places = names.iter().map(|name| self.place(name)).collect::<anyhow::Result<Vec<_>>>()?;
        let mut table = Self::new(names);
        table.rows.extend(self.rows.iter().map(|row| places.iter().filter_map(|&k| row.get(k).cloned()).collect()));
        Ok(table)
    }

    fn place(&self, column: &str) -> anyhow::Result<usize> {
        let place = self.columns.iter().position(|name| name == column);
        place.with_context(|| format!("there is no column `{column}` (there are: {})", self.columns.join(", ")))
    }

    /// The table in Markdown, numbers to the right.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let rule = (0..self.columns.len()).map(|k| if self.is_number(k) { "--:" } else { "---" }.to_owned());
        let cells = |row: &Vec<Cell>| line(row.iter().map(|cell| cell.text().replace('|', "\\|")).collect());
        line(self.columns.clone()) + &line(rule.collect()) + &self.rows.iter().map(cells).collect::<String>()
    }

    fn is_number(&self, column: usize) -> bool {
        self.rows.iter().any(|row| matches!(row.get(column), Some(Cell::Number(..))))
    }
}

/// A row's fields by their names; those of a case and of its measurements together.
pub fn fields(row: &impl Serialize) -> Map<String, Value> {
    match serde_json::to_value(row) {
        Ok(Value::Object(fields)) => fields,
        Ok(Value::Array(parts)) => {
            let own = |part| if let Value::Object(own) = part { own } else { Map::new() };
            parts.into_iter().flat_map(own).collect()
        }
        _ => Map::new(),
    }
}

impl Cell {
    fn text(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Number(value, digits) => readable(*value, *digits),
        }
    }
}

/// A number as text: a value too large or too small for `digits` after the point is written as a power of ten, NaN
/// as a dash.
fn readable(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "–".to_owned();
    }
    let least = libm::exp10(-(digits as f64));
    if value == 0.0 || (least..1e6).contains(&value.abs()) || !value.is_finite() {
        format!("{value:.digits$}")
    } else {
        format!("{value:.1e}")
    }
}

/// A value that a cell shows, of a number so many digits after the point.
pub trait Shown {
    fn cell(&self, digits: usize) -> Cell;
}

impl<T: Shown + ?Sized> Shown for &T {
    fn cell(&self, digits: usize) -> Cell {
        (**self).cell(digits)
    }
}

impl Shown for Cell {
    fn cell(&self, _: usize) -> Cell {
        self.clone()
    }
}

impl Shown for str {
    fn cell(&self, _: usize) -> Cell {
        Cell::Text(if self.is_empty() { "–" } else { self }.to_owned())
    }
}

impl Shown for String {
    fn cell(&self, digits: usize) -> Cell {
        self.as_str().cell(digits)
    }
}

impl<T> Shown for Named<T> {
    fn cell(&self, digits: usize) -> Cell {
        self.0.cell(digits)
    }
}

impl Shown for bool {
    fn cell(&self, digits: usize) -> Cell {
        if *self { "yes" } else { "no" }.cell(digits)
    }
}

impl Shown for Option<bool> {
    fn cell(&self, digits: usize) -> Cell {
        self.map_or_else(|| "–".cell(digits), |whether| whether.cell(digits))
    }
}

impl Shown for Option<f64> {
    fn cell(&self, digits: usize) -> Cell {
        self.unwrap_or(f64::NAN).cell(digits)
    }
}

/// Numbers of some types are shown as they are.
macro_rules! shown_numbers {
    ($($number:ty),+) => {
        $(impl Shown for $number {
            fn cell(&self, digits: usize) -> Cell {
                Cell::Number(*self as f64, digits)
            }
        })+
    };
}

shown_numbers!(f64, i64, u32, u64, usize);

impl Serialize for Cell {
    fn serialize<S: Serializer>(&self, out: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Text(text) => out.serialize_str(text),
            Self::Number(value, _) => out.serialize_f64(*value),
        }
    }
}

/// One row: the columns' names with its cells.
struct Entries<'a>(&'a [String], &'a [Cell]);

impl Serialize for Entries<'_> {
    fn serialize<S: Serializer>(&self, out: S) -> Result<S::Ok, S::Error> {
        let mut map = out.serialize_map(Some(self.0.len()))?;
        for (name, cell) in self.0.iter().zip(self.1) {
            map.serialize_entry(name, cell)?;
        }
        map.end()
    }
}

impl Serialize for Table {
    fn serialize<S: Serializer>(&self, out: S) -> Result<S::Ok, S::Error> {
        let mut list = out.serialize_seq(Some(self.rows.len()))?;
        for row in &self.rows {
            list.serialize_element(&Entries(&self.columns, row))?;
        }
        list.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laws() -> Table {
        table!([("ledger", 1.5), ("penalty", 2e9)], |(law, peak)| law: law, peak(2): peak)
    }

    #[test]
    fn text_is_left_aligned_and_numbers_right() {
        assert_eq!(laws().text(), "law       peak\nledger    1.50\npenalty  2.0e9\n");
    }

    #[test]
    fn columns_show_texts_numbers_and_what_is_not_known() {
        let rows = [("ledger", true, Some(0.005)), ("", false, None)];
        let mm = |limit_m: Option<f64>| limit_m.map(|limit_m| 1e3 * limit_m);
        let table = table!(rows, |row| law: row.0, fast: row.1, "limit, mm"(1): mm(row.2), of: 7_usize);
        assert_eq!(
            table.text(),
            "law     fast  limit, mm  of\nledger  yes         5.0   7\n–       no            –   7\n"
        );
    }

    #[test]
    fn markdown_has_the_rows_and_columns_that_are_asked_for() {
        let some = laws().only("law", &["penalty"]).unwrap().columns(&["peak", "law"]).unwrap();
        assert_eq!(some.markdown(), "| peak | law |\n| --: | --- |\n| 2.0e9 | penalty |\n");
        assert!(laws().columns(&["depth"]).unwrap_err().to_string().contains("there are: law, peak"));
    }

    #[test]
    fn json_has_numbers_under_the_column_names() {
        let json = serde_json::to_value(laws()).unwrap();
        assert_eq!(json[0]["law"], "ledger");
        assert_eq!(json[1]["peak"], 2e9);
    }
}
