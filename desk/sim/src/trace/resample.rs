//! Resampling of a trace to the control tick.

use softgrip::TICK_US;

use super::rows::Row;

/// The trace at every control tick: the mean of the rows since the last tick, or the straight line
/// between two rows that are further apart, which is nothing measured. The set-point is a step, so it keeps
/// its last value.
pub fn resample(rows: &[Row]) -> Vec<Row> {
    let tick_s = TICK_US as f64 * 1e-6;
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return Vec::new();
    };
    // A tick whose row is late by the rounding of its decimals still finds it.
    let slack_s = 1e-9;
    let ticks = ((last.t_s - first.t_s + slack_s) / tick_s) as usize;
    let mut next = 0;
    (0..=ticks)
        .map(|tick| {
            let t_s = first.t_s + tick as f64 * tick_s;
            let from = next;
            while next < rows.len() && rows[next].t_s <= t_s + slack_s {
                next += 1;
            }
            let mut row = match &rows[from..next] {
                [] => between(&rows[next - 1], &rows[next.min(rows.len() - 1)], t_s),
                fresh => mean(fresh),
            };
            row.t_s = t_s;
            row.setpoint_kpa = rows[next - 1].setpoint_kpa;
            row
        })
        .collect()
}

fn mean(rows: &[Row]) -> Row {
    let n = rows.len() as f64;
    let mean = |value: &dyn Fn(&Row) -> f64| rows.iter().map(value).sum::<f64>() / n;
    Row {
        strain_ue: std::array::from_fn(|i| mean(&|row: &Row| row.strain_ue[i])),
        pressure_kpa: mean(&|row: &Row| row.pressure_kpa),
        measured: rows.iter().any(|row| row.measured),
        ..rows[0]
    }
}

fn between(low: &Row, high: &Row, t_s: f64) -> Row {
    let share = if high.t_s > low.t_s {
        (t_s - low.t_s) / (high.t_s - low.t_s)
    } else {
        0.0
    };
    let mix = |a: f64, b: f64| a + share * (b - a);
    // A jump that no finger makes is not on a line: the gauge has failed, or a spike comes.
    let way_ue = SWING_UE_PER_S * (high.t_s - low.t_s - NEAR_S).max(0.0);
    let strain = |a: f64, b: f64| match (b - a).abs() > JUMP_UE + way_ue {
        true => a,
        false => mix(a, b),
    };
    Row {
        strain_ue: std::array::from_fn(|i| strain(low.strain_ue[i], high.strain_ue[i])),
        pressure_kpa: mix(low.pressure_kpa, high.pressure_kpa),
        measured: false,
        ..*low
    }
}

/// A gauge that changes by more from one row to the next has jumped, as the controller has it, µε; rows that are
/// further apart than this, s, leave a finger the time for more, µε/s.
const JUMP_UE: f64 = 4_000.0;
const NEAR_S: f64 = 0.010;
const SWING_UE_PER_S: f64 = 270_000.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(hz: f64, n: usize) -> Vec<Row> {
        (0..n)
            .map(|i| {
                let t_s = 5.0 + i as f64 / hz;
                Row {
                    t_s,
                    strain_ue: [1_000.0 * t_s; 3],
                    pressure_kpa: 10.0 * t_s,
                    setpoint_kpa: if i < n / 2 { 0.0 } else { 100.0 },
                    measured: true,
                }
            })
            .collect()
    }

    #[test]
    fn every_rate_becomes_the_same_ramp_at_the_tick() {
        for (hz, n) in [(100.0, 11), (250.0, 26), (1_000.0, 101), (10_000.0, 1_001)] {
            let ticks = resample(&rows(hz, n));
            assert_eq!(ticks.len(), 101, "{hz} Hz");
            for (i, row) in ticks.iter().enumerate() {
                assert!((row.t_s - (5.0 + 1e-3 * i as f64)).abs() < 1e-9);
                // The mean of a fast trace lags by half a tick.
                let lag_s = row.t_s - row.strain_ue[0] * 1e-3;
                assert!((-1e-9..=0.5e-3).contains(&lag_s), "{hz} Hz: {lag_s}");
            }
        }
    }

    #[test]
    fn the_set_point_stays_a_step() {
        for row in resample(&rows(100.0, 11)) {
            assert!(row.setpoint_kpa == 0.0 || row.setpoint_kpa == 100.0);
        }
    }
}
