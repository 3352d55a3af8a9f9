//! Columns of the results of a sweep.

use sim::setup;

use super::spec::Spec;

/// Type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Whole numbers, in every row.
    Integer,
    /// Numbers; empty where there is none.
    Number,
    /// Words; empty where there are none.
    Text,
}

/// A column of the results.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Name in the header.
    pub name: String,
    /// Type of its values.
    pub kind: Kind,
}

/// The columns of the results of a sweep.
pub fn columns(spec: &Spec) -> Vec<Column> {
    let column = |name: &str, kind| Column {
        name: name.to_string(),
        kind,
    };
    let mut columns = vec![column("run", Kind::Integer)];
    columns.extend(spec.names().map(|name| match name {
        setup::OBJECT => column(name, Kind::Text),
        _ => column(name, Kind::Number),
    }));
    columns.extend([
        column("outcome", Kind::Text),
        column("slid_at_s", Kind::Number),
        column("collapse_at_s", Kind::Number),
        column("flagged_at_s", Kind::Number),
        column("latency_ms", Kind::Number),
        column("lost_reports", Kind::Integer),
        column("controller", Kind::Text),
    ]);
    columns
}
