//! Tables for a terminal and for HTML.

use std::fmt::Write;

use maud::{Markup, html};

/// A table with its title above and a note below.
pub struct Table {
    /// Title above the table.
    pub title: String,
    /// Column headers.
    pub head: Vec<&'static str>,
    /// Rows with one cell for each column.
    pub rows: Vec<Vec<String>>,
    /// Explanation below the table.
    pub note: String,
}

impl Table {
    /// As plain text with aligned columns.
    pub fn text(&self) -> String {
        let widths: Vec<usize> = (0..self.head.len())
            .map(|n| {
                let cells = self.rows.iter().map(|row| row[n].chars().count());
                cells.max().unwrap_or(0).max(self.head[n].chars().count())
            })
            .collect();
        let line = |cells: &[String]| {
            let mut out = String::from(" ");
            for (n, (cell, width)) in cells.iter().zip(&widths).enumerate() {
                // Writing to a String cannot fail.
                let _ = match n {
                    0 => write!(out, " {cell:<width$}"),
                    _ => write!(out, "  {cell:>width$}"),
                };
            }
            out.trim_end().to_string() + "\n"
        };
        let head: Vec<String> = self.head.iter().map(|cell| cell.to_string()).collect();
        let mut out = format!("{}\n{}", self.title, line(&head));
        for row in &self.rows {
            out += &line(row);
        }
        out
    }

    /// As an HTML table with title and note.
    pub fn html(&self) -> Markup {
        html! {
            h2 { (self.title) }
            div class="wide" {
                table {
                    tr { @for cell in &self.head { th { (cell) } } }
                    @for row in &self.rows {
                        tr { @for cell in row { td { (cell) } } }
                    }
                }
            }
            p class="note" { (self.note) }
        }
    }
}
