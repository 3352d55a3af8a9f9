//! Traces as CSV: strains, pressure and set-point over time.

mod clock;
mod plausible;
pub(crate) mod resample;
mod rows;
mod setpoint;

use std::path::Path;

use anyhow::{Context, ensure};

use softgrip::FINGERS;

use crate::csv_dialect::{self, Quantity, Table, Wanted};
use crate::run::Run;

use rows::GAP_S;

pub use plausible::check;
pub use rows::{Row, Trace};

/// The columns that a trace must have; others are ignored.
pub const COLUMNS: [&str; FINGERS + 3] = columns();

const fn columns() -> [&'static str; FINGERS + 3] {
    let strains = ["strain1_ue", "strain2_ue", "strain3_ue", "strain4_ue"];
    let mut columns = ["t_s"; FINGERS + 3];
    let mut finger = 0;
    while finger < FINGERS {
        columns[1 + finger] = strains[finger];
        finger += 1;
    }
    columns[PRESSURE] = "pressure_kpa";
    columns[SETPOINT] = "setpoint_kpa";
    columns
}

/// Places in them.
const PRESSURE: usize = FINGERS + 1;
const SETPOINT: usize = FINGERS + 2;

/// Reads and checks a trace.
///
/// # Errors
/// If the file cannot be read, or a column, line or rate cannot be right; the message names it.
pub fn read(path: &Path) -> anyhow::Result<Trace> {
    let bytes = std::fs::read(path).with_context(|| format!("{}", path.display()))?;
    parse(&bytes).with_context(|| format!("{}", path.display()))
}

/// Checks the text of a trace.
///
/// # Errors
/// If a column, line or rate cannot be right; the message names it.
pub fn parse(bytes: &[u8]) -> anyhow::Result<Trace> {
    let wanted: [Wanted; COLUMNS.len()] = std::array::from_fn(|i| Wanted {
        name: COLUMNS[i],
        quantity: match i {
            0 => Quantity::Time,
            PRESSURE | SETPOINT => Quantity::Pressure,
            _ => Quantity::Strain,
        },
        required: true,
    });
    let mut table = csv_dialect::parse(bytes, &wanted)?;
    // A line with a time alone is a row that is missing.
    table
        .rows
        .retain(|row| row.cells[1..].iter().any(Option::is_some));
    ensure!(
        table.rows.len() >= 2,
        "{} rows of data: a trace needs at least two",
        table.rows.len()
    );
    let mut notes = std::mem::take(&mut table.notes);
    let (times, interval_s) = clock::times(&table, &mut notes)?;
    let mut rows = fill(&table, &times, &mut notes)?;
    let mut negative = rows
        .iter()
        .zip(&table.rows)
        .filter(|(row, _)| row.setpoint_kpa < -setpoint::NOISE_KPA);
    if let Some((row, source)) = negative.next() {
        // Some values of a noisy column may be.
        ensure!(
            negative.count() < rows.len() / 100,
            "line {}: setpoint_kpa = {}: must not be negative",
            source.line,
            row.setpoint_kpa
        );
    }
    let understood = setpoint::understand(&mut rows);
    notes.extend(understood.note);
    Ok(Trace {
        rows,
        stepped: understood.stepped,
        slew_kpa_per_s: understood.slew_kpa_per_s,
        interval_s,
        notes,
    })
}

/// The table's rows with every empty cell filled: on the straight line between its neighbours, or, for the
/// set-point, as before.
fn fill(table: &Table, times: &[f64], notes: &mut Vec<String>) -> anyhow::Result<Vec<Row>> {
    let mut columns: [Vec<f64>; COLUMNS.len()] = std::array::from_fn(|_| Vec::new());
    columns[0] = times.to_vec();
    for (i, column) in columns.iter_mut().enumerate().skip(1) {
        let name = COLUMNS[i];
        let cell = |row: usize| table.rows[row].cells[i];
        let mut before = None;
        while column.len() < times.len() {
            let at = column.len();
            if let Some(value) = cell(at) {
                column.push(value);
                before = Some(at);
                continue;
            }
            let end = (at..times.len()).find(|row| cell(*row).is_some());
            let run = at..end.unwrap_or(times.len());
            let (from, to) = (before.unwrap_or(0), run.end.min(times.len() - 1));
            let low = before.or(end).and_then(cell);
            let low = low.with_context(|| {
                let why = match (1..=FINGERS).contains(&i) {
                    true => ": what is read over the bus has residuals, and no strains",
                    false => "",
                };
                format!("{name}: every cell is empty{why}")
            })?;
            let high = end.and_then(cell).unwrap_or(low);
            let is_long = times[to] - times[from] > GAP_S;
            let (is_gauge, is_setpoint) = ((1..=FINGERS).contains(&i), i == SETPOINT);
            let line = table.rows[at].line;
            ensure!(
                !is_long || is_gauge || is_setpoint,
                "line {line}: {name} is empty for {:.1} s from here; for more than {GAP_S} s it is not made up",
                times[to] - times[from]
            );
            if is_long && is_gauge {
                notes.push(format!(
                    "{name}: empty for {:.1} s from line {line} on: taken for an open gauge",
                    times[to] - times[from]
                ));
            }
            column.extend(run.map(|row| {
                let share = (times[row] - times[from]) / (times[to] - times[from]).max(1e-9);
                match (is_long && is_gauge, is_setpoint) {
                    (true, _) => f64::INFINITY,
                    (false, true) => low,
                    (false, false) => low + share * (high - low),
                }
            }));
        }
    }
    let row = |i: usize| Row {
        t_s: columns[0][i],
        strain_ue: std::array::from_fn(|finger| columns[1 + finger][i]),
        pressure_kpa: columns[PRESSURE][i],
        setpoint_kpa: columns[SETPOINT][i],
        measured: (1..=FINGERS).all(|gauge| {
            let is_open = columns[gauge][i].is_infinite();
            is_open || table.rows[i].cells[gauge].is_some()
        }),
    };
    Ok((0..times.len()).map(row).collect())
}

/// The trace of a sequence of runs, one after the other in time, with what only a simulation knows in
/// further columns.
///
/// # Errors
/// If a row cannot be formatted.
pub fn of_runs(runs: &[Run]) -> anyhow::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut header = COLUMNS.to_vec();
    let residuals = [
        "residual1_ue",
        "residual2_ue",
        "residual3_ue",
        "residual4_ue",
    ];
    header.extend(&residuals[..FINGERS]);
    header.extend(["true_residual_sum_ue", "object_z_mm", "phase"]);
    writer.write_record(&header)?;
    let mut start_s = 0.0;
    for run in runs {
        for sample in &run.samples {
            let number = |value: f64, decimals: usize| format!("{value:.decimals$}");
            let mut record = vec![number(start_s + sample.truth.t_s, 3)];
            record.extend(sample.strain_ue.map(|ue| number(ue.into(), 1)));
            let pressure = sample.seen.pressure.map_or(0.0, |p| p.0);
            record.push(number(pressure.into(), 3));
            record.push(number(sample.asked_kpa, 3));
            // A gauge that gave nothing leaves its field empty.
            record.extend(
                sample
                    .seen
                    .residual
                    .map(|residual| residual.map_or(String::new(), |r| number(r.0.into(), 1))),
            );
            record.push(number(sample.truth.residual_ue.iter().sum(), 1));
            record.push(number(1e3 * sample.truth.object_m[2], 3));
            record.push(format!("{:?}", sample.truth.arm.phase).to_lowercase());
            writer.write_record(&record)?;
        }
        start_s += run.samples.last().map_or(0.0, |sample| sample.truth.t_s);
    }
    Ok(writer.into_inner()?)
}

#[cfg(test)]
mod tests;
