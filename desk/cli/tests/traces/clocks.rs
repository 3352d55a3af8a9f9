//! Clocks.

use serde_json::Value;

use super::bench::{RUN, Row, csv, events_of, names, noise, refused, replay, thinned, understood};

#[test]
fn a_times_sign_is_kept_in_every_event_and_in_a_losss_onset() {
    let shifted = |by_s: f64| -> Vec<Value> {
        let mut rows = thinned(5, 0);
        rows.iter_mut().for_each(|row| row[0] += by_s);
        events_of(&replay(csv(&rows).as_bytes(), &[]))
    };
    let (plain, early) = (shifted(0.0), shifted(-20.0));
    assert_eq!(names(&early), names(&plain));
    for (early, plain) in early.iter().zip(&plain) {
        for field in ["t_s", "onset_s"] {
            let [a, b] = [early, plain].map(|event| event[field].as_f64());
            assert_eq!(a.is_some(), b.is_some());
            let apart = b.unwrap_or(20.0) - a.unwrap_or(0.0);
            assert!((apart - 20.0).abs() < 1e-6, "{early} and {plain}");
        }
    }
}

#[test]
fn a_clock_that_jitters_loses_rows_or_is_rounded_is_read() {
    let mut noise = noise();
    let jitter: Vec<Row> = (0..RUN.len() / 10 - 1)
        .map(|i| RUN[10 * i + 1 + (noise().abs() * 2.0) as usize])
        .collect();
    understood(csv(&jitter).as_bytes(), &[]);
    let mut rows = thinned(10, 0);
    rows.remove(150);
    rows.drain(400..403);
    understood(
        csv(&rows).as_bytes(),
        &["gaps: 2, with about 4 rows missing", "0.040 s"],
    );
    let mut rows = thinned(5, 0);
    rows.iter_mut()
        .for_each(|row| row[0] = (row[0] * 100.0).round() / 100.0);
    understood(
        csv(&rows).as_bytes(),
        &["rounded to 0.010 s", "spread evenly"],
    );
}

#[test]
fn what_cannot_be_judged_is_refused_by_line() {
    let mut rows = thinned(10, 0);
    rows.drain(300..360);
    refused(
        &csv(&rows),
        &["line 302", "0.61 s after the row before", "cut the trace"],
    );
    refused(
        &csv(&thinned(200, 0)),
        &["line 3", "5 Hz", "10 Hz and 10 kHz", "unit of time"],
    );
    let mut rows = thinned(10, 0);
    rows.swap(100, 101);
    refused(&csv(&rows), &["line 103", "time must rise"]);
    let mut rows = thinned(10, 0);
    rows.iter_mut().for_each(|row| row[0] = 1.0);
    refused(&csv(&rows), &["line 3", "the same in every row"]);
}
