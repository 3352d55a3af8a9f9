//! Set-points that are not steps.

use super::bench::{Row, csv, events_of, names, noise, replay, thinned, time_of, understood};

/// The set-point as a ramp of so many kPa/s.
fn ramped(mut rows: Vec<Row>, slew: f64) -> Vec<Row> {
    let mut setpoint = 0.0;
    let mut before_s = rows[0][0];
    for row in &mut rows {
        let way = slew * (row[0] - before_s);
        before_s = row[0];
        setpoint += (row[5] - setpoint).clamp(-way, way);
        row[5] = setpoint;
    }
    rows
}

#[test]
fn a_set_point_that_was_read_back_or_ramped_is_the_commands_behind_it() {
    let grip = "a grip to 140";
    for size in [0.05, 0.3, 0.8] {
        let mut noise = noise();
        let mut rows = thinned(5, 0);
        rows.iter_mut().for_each(|row| row[5] += size * noise());
        understood(
            csv(&rows).as_bytes(),
            &["read back with", grip, "a release at"],
        );
        let mut rows = ramped(rows, 400.0);
        rows.iter_mut().for_each(|row| row[5] += size * noise());
        understood(csv(&rows).as_bytes(), &["ramps of 4", grip]);
    }
    understood(
        csv(&ramped(thinned(5, 0), 400.0)).as_bytes(),
        &["ramps of 400 kPa/s: a grip"],
    );
    let mut rows = thinned(5, 0);
    rows.iter_mut()
        .filter(|row| row[5] == 0.0)
        .for_each(|row| row[5] = -0.02);
    understood(csv(&rows).as_bytes(), &["within 0.02 of zero"]);
}

#[test]
fn a_falling_ramp_acknowledges_no_loss_and_the_next_grip_does() {
    let twice = |rows: &[Row]| -> Vec<Row> {
        let end_s = rows[rows.len() - 1][0] + 0.005;
        let again = rows.iter().map(|row| {
            let mut row = *row;
            row[0] += end_s;
            row
        });
        rows.iter().copied().chain(again).collect()
    };
    let steps = twice(&thinned(5, 0));
    for rows in [ramped(steps.clone(), 400.0), steps] {
        let events = events_of(&replay(csv(&rows).as_bytes(), &[]));
        let told = names(&events);
        let acknowledged = told.iter().filter(|name| **name == "acknowledged");
        assert_eq!(acknowledged.count(), 1, "{told:?}");
        let at_s = time_of(&events, "acknowledged");
        let grip = rows
            .iter()
            .find(|row| row[0] > 9.0 && row[5] > 0.0)
            .expect("a grip");
        assert!((at_s - grip[0]).abs() < 0.011, "{at_s} and {}", grip[0]);
        assert!(!told.contains(&"refused"), "{told:?}");
    }
}
