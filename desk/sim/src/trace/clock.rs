//! The time column: units, jitter, gaps and rounded times.

use anyhow::{Context, bail, ensure};

use super::rows::GAP_S;
use crate::csv_dialect::Table;

/// The fastest rate, Hz: the mean of ten rows in a tick. A time in another unit looks like more.
const FASTEST_HZ: f64 = 10_100.0;
/// The slowest, Hz: see [`notes_on_rate`].
const SLOWEST_HZ: f64 = 9.5;
/// A step that is so much longer than most is a gap. Loggers jitter by a tenth.
const GAP: f64 = 1.5;

/// The time of every row and the median time between two rows, s; what was assumed is added to `notes`.
///
/// # Errors
/// If a time is missing or falls, or the rate is outside 10 Hz to 10 kHz; the message names the line.
pub fn times(table: &Table, notes: &mut Vec<String>) -> anyhow::Result<(Vec<f64>, f64)> {
    let lines: Vec<usize> = table.rows.iter().map(|row| row.line).collect();
    let mut times = Vec::with_capacity(lines.len());
    for (row, line) in table.rows.iter().zip(&lines) {
        let t_s = row.cells[0].with_context(|| format!("line {line}: t_s is empty"))?;
        if let Some(&before) = times.last() {
            ensure!(
                t_s >= before,
                "line {line}: t_s = {t_s}: time must rise, and the row before is at {before}"
            );
        }
        times.push(t_s);
    }
    spread(&mut times, &lines, notes)?;
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let usual = steps[steps.len() / 2];
    let hz = 1.0 / usual;
    ensure!(
        (SLOWEST_HZ..=FASTEST_HZ).contains(&hz),
        "line {}: t_s = {}: {usual:.6} s after the row before, {hz:.0} Hz; the rate must lie within 10 Hz and \
         10 kHz: is the unit of time right?",
        lines[1],
        times[1]
    );
    notes_on_gaps(&times, usual, &lines, notes)?;
    notes_on_rate(hz, notes);
    Ok((times, usual))
}

/// Spreads rows with equal times, which are rounded, evenly: over the whole trace if that agrees with every
/// time, else up to the next other time.
fn spread(times: &mut [f64], lines: &[usize], notes: &mut Vec<String>) -> anyhow::Result<()> {
    let equal: Vec<usize> = (1..times.len())
        .filter(|i| times[*i] == times[i - 1])
        .collect();
    let Some(&first_equal) = equal.first() else {
        return Ok(());
    };
    let (first, last) = (times[0], times[times.len() - 1]);
    let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
    let resolution = steps
        .filter(|step| *step > 0.0)
        .fold(f64::INFINITY, f64::min);
    if last == first {
        bail!(
            "line {}: t_s = {first}: time must rise, and is the same in every row",
            lines[1]
        );
    }
    let per_row = (last - first) / (times.len() - 1) as f64;
    let regular = |i: usize| first + i as f64 * per_row;
    let agrees = |i: usize| (times[i] - regular(i)).abs() <= 1.001 * resolution;
    if (0..times.len()).all(agrees) {
        (0..times.len()).for_each(|i| times[i] = regular(i));
    } else {
        let mut from = 0;
        while from < times.len() {
            let t_s = times[from];
            let to = (from..times.len()).find(|i| times[*i] > t_s);
            let end_s = to.map_or(t_s + resolution, |to| times[to]);
            let to = to.unwrap_or(times.len());
            // Across a gap, rows stay where they were taken.
            let room_s = (end_s - t_s).min(resolution);
            let count = (to - from) as f64;
            for (i, time) in times[from..to].iter_mut().enumerate() {
                *time = t_s + room_s * i as f64 / count;
            }
            from = to;
        }
    }
    notes.push(format!(
        "t_s: {} times as in the row before, the first in line {}: rounded to {resolution:.3} s; rows spread evenly",
        equal.len(),
        lines[first_equal]
    ));
    Ok(())
}

fn notes_on_gaps(
    times: &[f64],
    usual: f64,
    lines: &[usize],
    notes: &mut Vec<String>,
) -> anyhow::Result<()> {
    let (mut gaps, mut missing, mut longest, mut at) = (0, 0.0, 0.0, 0);
    for (i, pair) in times.windows(2).enumerate() {
        let step = pair[1] - pair[0];
        if step > GAP * usual {
            gaps += 1;
            missing += (step / usual).round() - 1.0;
            if step > longest {
                (longest, at) = (step, i + 1);
            }
        }
    }
    ensure!(
        longest <= GAP_S,
        "line {}: t_s = {}: {longest:.2} s after the row before, where rows come every {usual:.3} s; a gap of more \
         than {GAP_S} s can hide a whole grip: cut the trace in two",
        lines[at],
        times[at]
    );
    if gaps > 0 {
        notes.push(format!(
            "t_s: gaps: {gaps}, with about {missing:.0} rows missing; the longest {longest:.3} s, before line {}",
            lines[at]
        ));
    }
    Ok(())
}

/// Notes on what a trace at this rate, Hz, cannot show.
fn notes_on_rate(hz: f64, notes: &mut Vec<String>) {
    // On thinned runs of the simulated gripper a loss was told later by up to 7 ms at 100 Hz, 65 at 50, 100 at
    // 40, 320 at 20 and 600 at 10.
    let what = match hz {
        95.0.. => return,
        45.0.. => "losses are told up to 0.1 s later, and slips may be missed",
        19.0.. => "losses are told up to 0.4 s later; slips and short losses may be missed",
        _ => "whether something is held is told; losses up to 1 s later, and only if they last",
    };
    notes.push(format!("t_s: {hz:.0} Hz, less than 100: {what}"));
}
