//! Numeric tables (CSV) as loggers and spreadsheets write them.
//!
//! What is unambiguous is read, and every assumption is noted for the user. The rest is refused by line and
//! column.

mod text;
mod units;

use std::path::Path;

use anyhow::{Context, bail, ensure};

use units::Unit;
pub use units::{Quantity, Wanted};

/// A table: the wanted columns, in the wanted order and in the units of their names.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The columns as the file calls them; none where there is no such column.
    pub names: Vec<Option<String>>,
    /// Rows with data, in the order of the file.
    pub rows: Vec<Row>,
    /// Assumptions made while reading, for the user.
    pub notes: Vec<String>,
}

/// One row of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The line in the file, from 1.
    pub line: usize,
    /// A number, or none where the cell is empty or there is no such column.
    pub cells: Vec<Option<f64>>,
}

/// A header is looked for within so many lines: what loggers write before it is shorter.
const PREAMBLE_LINES: usize = 100;

/// A last line without end-of-line counts as truncated if this many lines have more decimals.
const CUT_AFTER: usize = 3;

/// Reads and parses a file.
///
/// # Errors
/// If the file cannot be read, or as [`parse`].
pub fn read(path: &Path, wanted: &[Wanted]) -> anyhow::Result<Table> {
    let bytes = std::fs::read(path).with_context(|| format!("{}", path.display()))?;
    parse(&bytes, wanted).with_context(|| format!("{}", path.display()))
}

/// Parses the content of a file for the wanted columns.
///
/// # Errors
/// Names line and column of what cannot be read, and what would be right.
pub fn parse(bytes: &[u8], wanted: &[Wanted]) -> anyhow::Result<Table> {
    let text = text::decode(bytes)?;
    let mut notes = Vec::new();
    let lines: Vec<(usize, &str)> = (1..).zip(text.lines()).collect();
    let header = find_header(&lines, wanted)?;
    let columns = header.columns;
    if header.skipped > 0 {
        notes.push(format!(
            "{} lines before the header left out",
            header.skipped
        ));
    }
    if header.separator != ',' {
        notes.push(format!(
            "columns separated by {}",
            text::name(header.separator)
        ));
    }
    let mut body = Body {
        separator: header.separator,
        width: header.names.len(),
        columns,
        units: Vec::new(),
        decimal: None,
    };
    let mut rest = lines
        .iter()
        .filter(|(line, text)| *line > header.line && !text::is_blank(text))
        .peekable();
    let mut stated = vec![None; wanted.len()];
    if let Some((line, text)) = rest.peek()
        && let Some(units) = body.units_row(*line, text, wanted)?
    {
        notes.push(format!("line {line} taken for units"));
        stated = units;
        rest.next();
    }
    body.settle_units(&header.names, &stated, wanted, &mut notes)?;
    let mut rest: Vec<(usize, &str)> = rest.copied().collect();
    if body.is_cut(&rest, text::has_ending(bytes))
        && let Some((line, _)) = rest.pop()
    {
        notes.push(format!("line {line}, the last, is cut off: left out"));
    }
    let mut rows = Vec::with_capacity(rest.len());
    for (line, text) in rest {
        rows.push(body.row(line, text, wanted, &header.names)?);
    }
    if body.decimal == Some(',') {
        notes.push("decimal commas".into());
    }
    notes.extend(body.empty_cells(&rows, &header.names));
    Ok(Table {
        names: body
            .columns
            .iter()
            .map(|column| column.map(|at| header.names[at].clone()))
            .collect(),
        rows,
        notes,
    })
}

/// The line that names the columns.
struct Header {
    line: usize,
    /// Lines before it that are neither blank nor comments.
    skipped: usize,
    separator: char,
    names: Vec<String>,
    /// Position of each wanted column.
    columns: Vec<Option<usize>>,
}

fn find_header(lines: &[(usize, &str)], wanted: &[Wanted]) -> anyhow::Result<Header> {
    let mut skipped = 0;
    let mut first_error = None;
    for &(line, text) in lines.iter().take(PREAMBLE_LINES) {
        if text::is_empty(text) {
            continue;
        }
        // Some programs write the header as a comment.
        let names = text.trim_start_matches(['#', '%']).trim();
        match header_of(line, names, wanted) {
            Ok(header) => return Ok(Header { skipped, ..header }),
            Err(Mismatch::Ambiguous(error)) => return Err(error),
            Err(Mismatch::Lacks(error)) if !text::is_blank(text) => {
                skipped += 1;
                first_error.get_or_insert(error);
            }
            Err(Mismatch::Lacks(_)) => {}
        }
    }
    Err(first_error.unwrap_or_else(|| lacks(1, wanted[0].name, None, wanted)))
}

enum Mismatch {
    Lacks(anyhow::Error),
    Ambiguous(anyhow::Error),
}

/// The header in a line, with the separator that makes most of the wanted columns appear.
fn header_of(line: usize, text: &str, wanted: &[Wanted]) -> Result<Header, Mismatch> {
    let tries = text::SEPARATORS.map(|separator| {
        let mut names = text::split(text, separator);
        // Spreadsheets keep columns that have been emptied.
        while names.pop_if(|name| name.is_empty()).is_some() {}
        let found: Vec<Vec<usize>> = wanted
            .iter()
            .map(|wanted| units::places(&names, wanted))
            .collect();
        let count = found.iter().filter(|places| !places.is_empty()).count();
        (count, separator, names, found)
    });
    let most = tries.iter().map(|(count, ..)| *count).max().unwrap_or(0);
    let best = tries.into_iter().find(|(count, ..)| *count == most);
    let Some((count, separator, names, found)) = best else {
        return Err(Mismatch::Lacks(lacks(line, wanted[0].name, None, wanted)));
    };
    let lone = (count > 0 || names.len() > 1).then_some(separator);
    for (wanted_column, places) in wanted.iter().zip(&found) {
        if places.is_empty() && wanted_column.required {
            return Err(Mismatch::Lacks(lacks(
                line,
                wanted_column.name,
                lone,
                wanted,
            )));
        }
        if places.len() > 1 {
            let these: Vec<&str> = places.iter().map(|at| names[*at].as_str()).collect();
            return Err(Mismatch::Ambiguous(anyhow::anyhow!(
                "line {line}: {} could each be {}: name one of them so, and the others differently",
                these.join(" and "),
                wanted_column.name
            )));
        }
    }
    if count == 0 {
        return Err(Mismatch::Lacks(lacks(line, wanted[0].name, lone, wanted)));
    }
    Ok(Header {
        line,
        skipped: 0,
        separator,
        columns: found.iter().map(|places| places.first().copied()).collect(),
        names,
    })
}

fn lacks(line: usize, name: &str, separator: Option<char>, wanted: &[Wanted]) -> anyhow::Error {
    let names: Vec<&str> = wanted.iter().map(|wanted| wanted.name).collect();
    let names = names.join(",");
    match separator {
        Some(separator) => anyhow::anyhow!(
            "line {line}: no column {name} between its {}s; the header must name {names}",
            text::name(separator)
        ),
        None => anyhow::anyhow!(
            "line {line}: no column {name}; the header must name {names}, separated by commas, semicolons, tabs or blanks"
        ),
    }
}

/// How the lines below the header are parsed.
struct Body {
    separator: char,
    width: usize,
    columns: Vec<Option<usize>>,
    /// Of each wanted column.
    units: Vec<Unit>,
    /// The sign before decimals that has been seen.
    decimal: Option<char>,
}

impl Body {
    /// The units that a line states, if it is such a line: none of its wanted cells is a number.
    fn units_row(
        &self,
        line: usize,
        text: &str,
        wanted: &[Wanted],
    ) -> anyhow::Result<Option<Vec<Option<Unit>>>> {
        let fields = text::split(text, self.separator);
        let cell = |column: Option<usize>| Some(fields.get(column?)?.as_str());
        let mut cells = self.columns.iter().filter_map(|column| cell(*column));
        let is_word = |cell: &str| {
            let number = cell.starts_with(|c: char| c.is_ascii_digit() || "+-.,".contains(c));
            !(number || ["nan", "inf", "null", "na"].contains(&cell.to_lowercase().as_str()))
        };
        let known = |(wanted, column): (&Wanted, &Option<usize>)| {
            cell(*column).is_some_and(|cell| wanted.quantity.unit(cell).is_some())
        };
        if !cells.all(is_word) || !wanted.iter().zip(&self.columns).any(known) {
            return Ok(None);
        }
        let mut units = Vec::with_capacity(wanted.len());
        for (wanted, column) in wanted.iter().zip(&self.columns) {
            units.push(match cell(*column) {
                None | Some("") => None,
                Some(cell) => Some(wanted.quantity.unit(cell).with_context(|| {
                    format!(
                        "line {line}: {}: unit {cell:?} must be one of {}",
                        wanted.name,
                        wanted.quantity.known()
                    )
                })?),
            });
        }
        Ok(Some(units))
    }

    /// The unit of each column, from its name or from the units row, which must not disagree.
    fn settle_units(
        &mut self,
        names: &[String],
        stated: &[Option<Unit>],
        wanted: &[Wanted],
        notes: &mut Vec<String>,
    ) -> anyhow::Result<()> {
        for ((wanted, column), stated) in wanted.iter().zip(&self.columns).zip(stated) {
            let own = wanted.quantity.base();
            let Some(at) = *column else {
                self.units.push(own);
                continue;
            };
            let name = &names[at];
            let unit = match (units::in_name(name, wanted), *stated) {
                (Some(named), Some(stated)) if named != stated => bail!(
                    "{name}: the header says {}, but the units row {}",
                    named.name,
                    stated.name
                ),
                (Some(unit), _) | (None, Some(unit)) => unit,
                (None, None) => bail!(
                    "{name}: no unit: call it {}, or state one of {} in its name or in a row of units",
                    wanted.name,
                    wanted.quantity.known()
                ),
            };
            if unit != own {
                notes.push(format!("{name}: {} read as {}", unit.name, own.name));
            }
            self.units.push(unit);
        }
        Ok(())
    }

    fn row(
        &mut self,
        line: usize,
        text: &str,
        wanted: &[Wanted],
        names: &[String],
    ) -> anyhow::Result<Row> {
        let mut fields = text::split(text, self.separator);
        while fields.len() > self.width && fields.last().is_some_and(String::is_empty) {
            fields.pop();
        }
        let hint = match fields.len() {
            1 if self.width > 1 => ": is it separated as the header is?",
            // A decimal comma in every cell makes nearly twice as many.
            n if n > self.width && self.separator == ',' => {
                ": a decimal comma cannot be told from a separating one; separate by semicolons"
            }
            _ => "",
        };
        ensure!(
            fields.len() == self.width,
            "line {line}: {} cells between {}s, but the header has {}{hint}",
            fields.len(),
            text::name(self.separator),
            self.width
        );
        let mut cells = Vec::with_capacity(wanted.len());
        for i in 0..wanted.len() {
            let Some(at) = self.columns[i] else {
                cells.push(None);
                continue;
            };
            let (cell, name) = (fields[at].as_str(), &names[at]);
            if cell.is_empty() {
                cells.push(None);
                continue;
            }
            let value = self
                .number(cell)
                .with_context(|| format!("line {line}: {name} = {cell:?}"))?;
            cells.push(Some(self.units[i].convert(value)));
        }
        Ok(Row { line, cells })
    }

    fn number(&mut self, cell: &str) -> anyhow::Result<f64> {
        let sign = match (cell.contains(','), cell.contains('.')) {
            (true, true) => bail!("must not have separators between thousands"),
            (true, false) => Some(','),
            (false, true) => Some('.'),
            (false, false) => None,
        };
        if let Some(sign) = sign {
            let seen = *self.decimal.get_or_insert(sign);
            ensure!(
                seen == sign,
                "must have the decimal {:?} of the cells before",
                seen
            );
        }
        // Spreadsheets write a typographic minus.
        let plain = cell.replace(',', ".").replace('\u{2212}', "-");
        let number = plain.parse().ok().filter(|value: &f64| value.is_finite());
        number.context("must be a finite number, or empty where there is none")
    }

    /// Counts them, by column.
    fn empty_cells(&self, rows: &[Row], names: &[String]) -> Vec<String> {
        let column = |(i, at): (usize, &Option<usize>)| {
            let name = &names[(*at)?];
            let mut empty = rows.iter().filter(|row| row.cells[i].is_none());
            let first = empty.next()?.line;
            let count = 1 + empty.count();
            Some(format!("{name}: {count} empty, the first in line {first}"))
        };
        let columns = self.columns.iter().enumerate();
        columns.filter_map(column).collect()
    }

    /// Whether the last line has been cut off: it has too few cells; or no end of line, and its last cell
    /// fewer decimals than all before.
    fn is_cut(&self, lines: &[(usize, &str)], has_ending: bool) -> bool {
        let Some(((_, last), before)) = lines.split_last() else {
            return false;
        };
        let cells = text::split(last, self.separator).len();
        if cells < self.width {
            return cells > 1 || !has_ending;
        }
        let decimals = |text: &str| {
            let cell = text::split(text, self.separator).pop().unwrap_or_default();
            cell.len() - cell.find(['.', ',']).unwrap_or(cell.len())
        };
        let own = decimals(last);
        let fewer = |(_, text): &(usize, &str)| own < decimals(text);
        !has_ending && before.len() >= CUT_AFTER && before.iter().all(fewer)
    }
}
