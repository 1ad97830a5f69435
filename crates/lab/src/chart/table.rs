//! A table for people and for programs: columns, and cells of text or numbers.
//!
//! In: cells. Out: aligned text, or JSON. Never here: where it is printed.

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

impl Table {
    /// An empty table.
    pub fn new(columns: &[&str]) -> Self {
        Self { columns: columns.iter().map(|&c| c.to_owned()).collect(), rows: Vec::new() }
    }

    /// A line for each row, with the fields that `columns` names, each with its digits after the point if it is a number: `mean.3, limit`.
    /// `depth_m*1e3.2 as depth_mm` shows a multiple under another name, `measured/theory.2` a ratio of two fields.
    pub fn of<'a, R: Serialize + 'a>(rows: impl IntoIterator<Item = &'a R>, columns: &str) -> Self {
        let own = |column| str::split(column, ['.', '*', '/']).next().unwrap_or(column);
        let named = |column| str::split_once(column, " as ").unwrap_or((column, own(column)));
        let (shown, names): (Vec<&str>, Vec<&str>) = columns.split(", ").map(named).unzip();
        let line = |row: &R| {
            let fields = fields(row);
            shown.iter().map(|column| Cell::of(&fields, column)).collect()
        };
        Self { rows: rows.into_iter().map(line).collect(), ..Self::new(&names) }
    }

    /// The same with a column more of numbers, one for each row.
    pub fn with(mut self, name: &str, digits: usize, numbers: impl IntoIterator<Item = f64>) -> Self {
        self.columns.push(name.to_owned());
        self.rows.iter_mut().zip(numbers).for_each(|(row, number)| row.push(Cell::Number(number, digits)));
        self
    }

    /// Lines of cells with the names of their columns, the same in every line.
    pub fn named(lines: impl IntoIterator<Item = Vec<(&'static str, Cell)>>) -> Self {
        let mut table = Self::new(&[]);
        for line in lines {
            let (names, cells): (Vec<_>, _) = line.into_iter().unzip();
            table.columns = names.into_iter().map(str::to_owned).collect();
            table.rows.push(cells);
        }
        table
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
    /// The cell of a column, by a row's fields.
    fn of(fields: &Map<String, Value>, column: &str) -> Self {
        let (what, digits) = column.rsplit_once('.').unwrap_or((column, ""));
        let field = |name: &str| {
            debug_assert!(fields.contains_key(name), "a row has no field {name}");
            fields.get(name)
        };
        let number = |name: &str| field(name).and_then(Value::as_f64).unwrap_or(f64::NAN);
        if let Ok(digits) = digits.parse() {
            return Self::Number(
                match (what.split_once('*'), what.split_once('/')) {
                    (Some((name, factor)), _) => number(name) * factor.parse().unwrap_or(f64::NAN),
                    (None, Some((over, under))) => number(over) / number(under),
                    (None, None) => number(what),
                },
                digits,
            );
        }
        match field(column) {
            Some(Value::String(text)) if !text.is_empty() => Self::Text(text.clone()),
            Some(Value::Bool(whether)) => if *whether { "yes" } else { "no" }.into(),
            _ => "–".into(),
        }
    }

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

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<&String> for Cell {
    fn from(text: &String) -> Self {
        Self::Text(text.clone())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<(f64, usize)> for Cell {
    fn from(rounded: (f64, usize)) -> Self {
        Self::Number(rounded.0, rounded.1)
    }
}

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

    fn table() -> Table {
        let mut table = Table::new(&["law", "peak"]);
        table.rows.push(vec!["ledger".into(), (1.5, 2).into()]);
        table.rows.push(vec!["penalty".into(), (2e9, 2).into()]);
        table
    }

    #[test]
    fn text_is_left_aligned_and_numbers_right() {
        assert_eq!(table().text(), "law       peak\nledger    1.50\npenalty  2.0e9\n");
    }

    #[test]
    fn columns_show_fields_multiples_and_ratios() {
        let row = |limit_m: Option<f64>| serde_json::json!([{ "law": "ledger", "fast": true }, { "depth_m": 0.0025, "limit_m": limit_m }]);
        let columns = "law, fast, depth_m*1e3.1 as depth_mm, depth_m/limit_m.2 as share, limit_m.3";
        let table = Table::of(&[row(Some(0.005)), row(None)], columns);
        let text = "law     fast  depth_mm  share  limit_m\nledger  yes        2.5   0.50    0.005\nledger  yes        2.5      –        –\n";
        assert_eq!(table.text(), text);
    }

    #[test]
    fn markdown_has_the_rows_and_columns_that_are_asked_for() {
        let some = table().only("law", &["penalty"]).unwrap().columns(&["peak", "law"]).unwrap();
        assert_eq!(some.markdown(), "| peak | law |\n| --: | --- |\n| 2.0e9 | penalty |\n");
        assert!(table().columns(&["depth"]).unwrap_err().to_string().contains("there are: law, peak"));
    }

    #[test]
    fn json_has_numbers_under_the_column_names() {
        let json = serde_json::to_value(table()).unwrap();
        assert_eq!(json[0]["law"], "ledger");
        assert_eq!(json[1]["peak"], 2e9);
    }
}
