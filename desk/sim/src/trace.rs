//! Traces: what a gripper's gauges and regulator showed over time, as CSV.

use std::path::Path;

use anyhow::{Context, bail, ensure};

use crate::run::Run;

/// The columns that a trace must have; others are ignored.
pub const COLUMNS: [&str; 6] = [
    "t_s",
    "strain1_ue",
    "strain2_ue",
    "strain3_ue",
    "pressure_kpa",
    "setpoint_kpa",
];
/// Shortest and longest time between rows, s: 10 kHz and 100 Hz, with some room for rounding.
const INTERVAL_S: (f64, f64) = (0.99e-4, 1.01e-2);

/// One row of a trace, in the order of [`COLUMNS`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Time, s.
    pub t_s: f64,
    /// Gauge strain of each finger, µε.
    pub strain_ue: [f64; 3],
    /// Measured pressure, kPa.
    pub pressure_kpa: f64,
    /// Pressure that the robot asked for, kPa.
    pub setpoint_kpa: f64,
}

/// Reads and checks a trace.
pub fn read(path: &Path) -> anyhow::Result<Vec<Row>> {
    let file = std::fs::File::open(path).with_context(|| format!("{}", path.display()))?;
    parse(file).with_context(|| format!("{}", path.display()))
}

fn parse(input: impl std::io::Read) -> anyhow::Result<Vec<Row>> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(input);
    let header = reader.headers()?.clone();
    let mut place = [0; COLUMNS.len()];
    for (place, column) in place.iter_mut().zip(COLUMNS) {
        *place = header
            .iter()
            .position(|name| name == column)
            .with_context(|| {
                format!(
                    "line 1: no column {column}; the header must name {}",
                    COLUMNS.join(",")
                )
            })?;
    }
    let mut rows: Vec<Row> = Vec::new();
    for record in reader.records() {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        let mut values = [0.0; COLUMNS.len()];
        for ((value, place), column) in values.iter_mut().zip(place).zip(COLUMNS) {
            let text = &record[place];
            *value = text
                .parse()
                .ok()
                .filter(|value: &f64| value.is_finite())
                .with_context(|| {
                    format!("line {line}: {column} = {text:?}: must be a finite number")
                })?;
        }
        let [t_s, a, b, c, pressure_kpa, setpoint_kpa] = values;
        if let Some(before) = rows.last() {
            check_interval(line, before.t_s, t_s)?;
        }
        ensure!(
            setpoint_kpa >= 0.0,
            "line {line}: setpoint_kpa = {setpoint_kpa}: must not be negative"
        );
        rows.push(Row {
            t_s,
            strain_ue: [a, b, c],
            pressure_kpa,
            setpoint_kpa,
        });
    }
    ensure!(
        rows.len() >= 2,
        "{} rows of data: a trace needs at least two",
        rows.len()
    );
    Ok(rows)
}

fn check_interval(line: u64, before: f64, now: f64) -> anyhow::Result<()> {
    let interval = now - before;
    if interval <= 0.0 {
        bail!("line {line}: t_s = {now}: time must rise, and the row before is at {before}");
    }
    let (shortest, longest) = INTERVAL_S;
    ensure!(
        (shortest..=longest).contains(&interval),
        "line {line}: t_s = {now}: {interval:.6} s after the row before, {:.0} Hz; the rate must lie within 100 Hz and 10 kHz",
        1.0 / interval
    );
    Ok(())
}

/// The trace of a sequence of runs, one after the other in time, with what only a simulation knows in
/// further columns.
pub fn of_runs(runs: &[Run]) -> anyhow::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut header = COLUMNS.to_vec();
    header.extend([
        "residual1_ue",
        "residual2_ue",
        "residual3_ue",
        "true_residual_sum_ue",
        "object_z_mm",
        "phase",
    ]);
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
mod tests {
    use super::*;

    const HEADER: &str = "t_s,strain1_ue,strain2_ue,strain3_ue,pressure_kpa,setpoint_kpa";

    fn error(text: &str) -> String {
        format!("{:#}", parse(text.as_bytes()).expect_err("a bad trace"))
    }

    #[test]
    fn columns_may_stand_in_any_order_among_others() {
        let rows = parse(
            "note,setpoint_kpa,pressure_kpa,strain3_ue,strain2_ue,strain1_ue,t_s\nx,6,5,4,3,2,0\ny,6,5,4,3,2,0.001\n"
                .as_bytes(),
        )
        .expect("a good trace");
        assert_eq!(
            rows[1],
            Row {
                t_s: 0.001,
                strain_ue: [2.0, 3.0, 4.0],
                pressure_kpa: 5.0,
                setpoint_kpa: 6.0
            }
        );
    }

    #[test]
    fn every_bad_trace_is_named_by_its_line_and_what_would_be_right() {
        for (text, expected) in [
            ("", "line 1: no column t_s"),
            (HEADER, "0 rows of data: a trace needs at least two"),
            (
                "t_s,strain1_ue,strain2_ue,pressure_kpa,setpoint_kpa\n",
                "line 1: no column strain3_ue",
            ),
            (
                &format!("{HEADER}\n0,0,0,0,0,0\n0.001,0,NaN,0,0,0\n"),
                "line 3: strain2_ue = \"NaN\": must be a finite number",
            ),
            (
                &format!("{HEADER}\n0,0,0,0,0,0\n0.001,0,,0,0,0\n"),
                "line 3: strain2_ue = \"\": must be a finite number",
            ),
            (
                &format!("{HEADER}\n0.002,0,0,0,0,0\n0.001,0,0,0,0,0\n"),
                "line 3: t_s = 0.001: time must rise, and the row before is at 0.002",
            ),
            (
                &format!("{HEADER}\n0,0,0,0,0,0\n0.1,0,0,0,0,0\n"),
                "line 3: t_s = 0.1: 0.100000 s after the row before, 10 Hz; the rate must lie within 100 Hz and 10 kHz",
            ),
            (
                &format!("{HEADER}\n0,0,0,0,0,-3\n0.001,0,0,0,0,0\n"),
                "line 2: setpoint_kpa = -3: must not be negative",
            ),
            (&format!("{HEADER}\n0,0,0,0,0,0\n0.001,0,0\n"), "line: 3"),
        ] {
            let message = error(text);
            assert!(message.contains(expected), "{message}");
        }
    }
}
