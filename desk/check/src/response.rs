//! How the pressure answers a step of the set-point.

use watch::Observation;

/// How a regulator has answered a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// How far the pressure comes behind the set-point, ms: the area between the two over the height of the step, which
    /// for a lag with a dead time is the sum of both, however the set-point has moved.
    pub delay_ms: f64,
    /// How far beyond where it came to rest the pressure went, kPa.
    pub overshoot_kpa: f32,
}

/// A step from one pressure at rest to another, `from` and `to`, kPa. None where it is none, or where time, pressure or
/// set-point are not told.
pub fn of(trace: &[Observation], from: f32, to: f32) -> Option<Response> {
    let first = trace.first()?.setpoint_kpa?;
    let last = trace.last()?.setpoint_kpa?;
    // A step that is not some times the pressure's error tells nothing.
    if last - first < 5.0 || to - from < 5.0 {
        return None;
    }
    let mut lags = Vec::new();
    let mut highest = to;
    for seen in trace {
        let (t_s, pressure) = (seen.t_s?, seen.pressure_kpa?);
        let told = (seen.setpoint_kpa? - first) / (last - first);
        let done = (pressure - from) / (to - from);
        lags.push((t_s, f64::from(told - done)));
        highest = highest.max(pressure);
    }
    let areas = lags.windows(2).map(|pair| match pair {
        [(t, lag), (next, later)] => 0.5 * (next - t) * (lag + later),
        _ => 0.0,
    });
    Some(Response {
        delay_ms: 1e3 * areas.sum::<f64>(),
        overshoot_kpa: highest - to,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp of the set-point in 50 ms from 20 to 40 kPa, and what a regulator makes of it, 50 times a second.
    fn trace(pressure: impl Fn(f64) -> f64) -> Vec<Observation> {
        let looks = (0..100).map(|look| 0.02 * f64::from(look));
        looks
            .map(|t_s| Observation {
                t_s: Some(t_s),
                setpoint_kpa: Some((20.0 + 400.0 * t_s).min(40.0) as f32),
                pressure_kpa: Some(pressure(t_s) as f32),
                ..Observation::default()
            })
            .collect()
    }

    /// The mean of a lag over a ramp.
    fn ramp(t_s: f64) -> f64 {
        (20.0 + 400.0 * t_s).clamp(20.0, 40.0)
    }

    #[test]
    fn a_dead_time_is_found_whatever_the_regulators_gain_and_offset() {
        for dead_s in [0.02, 0.1, 0.4] {
            let late = trace(|t_s| 1.0 + 0.97 * ramp(t_s - dead_s));
            let found = of(&late, 20.4, 39.8).expect("a step");
            let off = found.delay_ms - 1e3 * dead_s;
            assert!(off.abs() < 10.0, "{dead_s}: {found:?}");
            assert!(found.overshoot_kpa < 0.1, "{found:?}");
        }
    }

    #[test]
    fn an_overshoot_is_found() {
        let over = trace(|t_s| ramp(t_s) + if (0.1..0.2).contains(&t_s) { 4.0 } else { 0.0 });
        let found = of(&over, 20.0, 40.0).expect("a step");
        assert!((found.overshoot_kpa - 4.0).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn a_pressure_that_does_not_move_has_no_delay() {
        assert_eq!(of(&trace(|_| 20.0), 20.0, 20.0), None);
        assert_eq!(of(&[], 20.0, 40.0), None);
    }
}
