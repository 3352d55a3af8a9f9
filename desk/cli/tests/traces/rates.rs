//! Slow traces.

use super::bench::{RUN, csv, events_of, names, replay, thinned, time_of};

#[test]
fn at_100_and_125_hz_a_loss_is_told_in_time_and_no_gauge_is_stuck_whatever_the_phase() {
    let live = time_of(&events_of(&replay(csv(&RUN).as_bytes(), &[])), "lost");
    for every in [10, 8] {
        for from in 0..every {
            let events = events_of(&replay(csv(&thinned(every, from)).as_bytes(), &[]));
            let told: Vec<&str> = names(&events);
            let told: Vec<&str> = told.into_iter().filter(|name| *name != "contact").collect();
            assert_eq!(
                told,
                ["holding", "released", "holding", "slip", "lost"],
                "one of {every} from {from}"
            );
            let late = time_of(&events, "lost") - live;
            assert!(
                (-0.002..0.015).contains(&late),
                "one of {every} from {from}: {late} s"
            );
        }
    }
}

#[test]
fn below_100_hz_a_loss_is_told_later_and_what_is_less_sure_is_said() {
    let live = time_of(&events_of(&replay(csv(&RUN).as_bytes(), &[])), "lost");
    // Fingers that meet where the object was keep half of the residual, so that less evidence comes with each row.
    for (every, limit_s) in [(20, 0.1), (50, 0.5), (100, 1.0)] {
        for from in [0, every / 2] {
            let output = replay(csv(&thinned(every, from)).as_bytes(), &[]);
            assert!(String::from_utf8_lossy(&output.stderr).contains("less than 100"));
            let events = events_of(&output);
            assert!(!names(&events).contains(&"fault"), "{every}: {events:?}");
            let late = time_of(&events, "lost") - live;
            assert!((0.0..limit_s).contains(&late), "{every}: {late} s");
        }
    }
}

#[test]
fn a_gauge_that_sticks_in_a_100_hz_trace_is_found() {
    let mut rows = thinned(10, 3);
    let stuck_from = rows.iter().position(|row| row[0] > 2.0).expect("a row");
    let stuck_at = rows[stuck_from][2];
    rows[stuck_from..]
        .iter_mut()
        .for_each(|row| row[2] = stuck_at);
    let events = events_of(&replay(csv(&rows).as_bytes(), &[]));
    let fault = events
        .iter()
        .find(|e| e["event"] == "fault")
        .expect("a fault");
    assert_eq!(
        (&fault["fault"], &fault["finger"]),
        (&"GaugeStuck".into(), &2.into())
    );
    assert!(time_of(&events, "fault") < 2.2);
    assert!(time_of(&events, "lost") > 7.0);
}

#[test]
fn a_spike_of_one_row_in_a_100_hz_trace_is_nothing() {
    let mut rows = thinned(10, 0);
    let plain = events_of(&replay(csv(&rows).as_bytes(), &[]));
    let at = rows.iter().position(|row| row[0] > 2.5).expect("a row");
    rows[at][1] += 9_000.0;
    let events = events_of(&replay(csv(&rows).as_bytes(), &[]));
    assert_eq!(names(&events), names(&plain));
}

#[test]
fn a_gauge_that_gives_nothing_for_long_is_an_open_one() {
    let mut text = csv(&[]);
    for row in thinned(5, 0) {
        let [t, a, b, c, p, s] = row;
        let b = if t > 2.0 {
            String::new()
        } else {
            b.to_string()
        };
        text += &format!("{t},{a},{b},{c},{p},{s}\n");
    }
    let output = replay(text.as_bytes(), &[]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("taken for an open gauge"));
    let events = events_of(&output);
    let fault = events
        .iter()
        .find(|e| e["event"] == "fault")
        .expect("a fault");
    assert_eq!(
        (&fault["fault"], &fault["finger"]),
        (&"GaugeOpen".into(), &2.into())
    );
    assert!(time_of(&events, "lost") > 7.0);
}
