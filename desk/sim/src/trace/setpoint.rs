//! Recovers the robot's commands from the set-point column.
//!
//! The column may contain the commands, as steps. Or the set-point was read back with noise, or logged behind
//! a ramp; then each plateau is one command, given when the value left the plateau before.

use softgrip::settings::Settings;

use super::rows::Row;

/// Read back as zero: most converters' offset and noise, kPa.
pub(super) const NOISE_KPA: f64 = 2.0;
/// A set-point below this is none, kPa.
const REST_KPA: f64 = 0.5;
/// A command stands for this long, s, or it is a ramp: robots do not command as fast.
const STANDS_S: f64 = 0.05;
/// A plateau lasts this long, s, the settling time of a grip, …
const PLATEAU_S: f64 = 0.15;
/// … and this many rows, …
const PLATEAU_ROWS: usize = 3;
/// … and its noise stays within this, kPa, or so many standard deviations, whichever is more.
const PLATEAU_KPA: f64 = 2.0;
const PLATEAU_SIGMAS: f64 = 10.0;
/// Commands that differ by less are one, kPa.
const SAME_KPA: f64 = 1.0;

/// What the set-point column was found to be.
pub(super) struct Understood {
    pub stepped: bool,
    pub slew_kpa_per_s: Option<f64>,
    pub note: Option<String>,
}

/// A stretch at one set-point.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Plateau {
    from: usize,
    /// Index after its last row.
    to: usize,
    kpa: f64,
}

/// Replaces the set-points by the commands behind them.
pub(super) fn understand(rows: &mut [Row]) -> Understood {
    let mut taken_for_none = 0.0f64;
    for row in rows.iter_mut() {
        if row.setpoint_kpa <= REST_KPA {
            taken_for_none = taken_for_none.max(row.setpoint_kpa.abs());
            row.setpoint_kpa = 0.0;
        }
    }
    if is_stepped(rows) {
        return Understood {
            stepped: true,
            slew_kpa_per_s: None,
            note: (taken_for_none > 0.0)
                .then(|| format!("setpoint_kpa: within {taken_for_none} of zero taken for none")),
        };
    }
    let values: Vec<f64> = rows.iter().map(|row| row.setpoint_kpa).collect();
    let sigma = noise(&values);
    let plateaus = plateaus(rows, &values, sigma);
    let mut slopes = [Vec::new(), Vec::new()];
    let mut commands: Vec<(usize, f64)> = Vec::new();
    commands.extend(plateaus.first().map(|first| (0, first.kpa)));
    let leaves = |a: &Plateau, end: usize| {
        let band = (4.0 * sigma).max(0.1);
        // A controller's trim moves what it commands: where it has come to counts.
        let at_last = median(&values[usize::midpoint(a.from, a.to)..a.to]);
        let stays = (a.from..end)
            .rev()
            .find(|i| (values[*i] - at_last).abs() <= band);
        stays.map_or(a.to, |i| i + 1)
    };
    for pair in plateaus.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let mut from = leaves(a, b.from);
        if let Some(ramp) = ramp(rows, &values, from..b.to, a.kpa, b.kpa) {
            from = from.min(rows.partition_point(|row| row.t_s <= ramp.since_s + 1e-9));
            slopes[usize::from(b.kpa > a.kpa)].push(ramp.kpa_per_s);
        }
        commands.push((from, b.kpa));
    }
    if let Some(last) = plateaus.last()
        && let (from, Some(&end)) = (leaves(last, values.len()), values.last())
        && from < values.len()
        && (end - last.kpa).abs() > PLATEAU_KPA
    {
        // The trace ends on the way: far down is taken for a release.
        commands.push((from, if end < 0.5 * last.kpa { 0.0 } else { end }));
    }
    let mut next = 0;
    for (i, row) in rows.iter_mut().enumerate() {
        while next + 1 < commands.len() && commands[next + 1].0 <= i {
            next += 1;
        }
        row.setpoint_kpa = commands.get(next).map_or(0.0, |(_, kpa)| *kpa);
    }
    // The steepness that matters is that of the grips.
    let [falling, mut rising] = slopes;
    if rising.is_empty() {
        rising = falling;
    }
    rising.sort_by(f64::total_cmp);
    let slope = rising.get(rising.len() / 2).copied();
    let usual = f64::from(Settings::default().regulator.slew_kpa_per_s);
    let followed = slope.filter(|slope| misfit(rows, *slope) < misfit(rows, usual));
    Understood {
        stepped: false,
        slew_kpa_per_s: followed,
        note: Some(words(rows, &commands, slope, sigma)),
    }
}

/// Mean square of the pressure less what a regulator gives that takes the commands with this slew.
fn misfit(rows: &[Row], slew_kpa_per_s: f64) -> f64 {
    let lag_s = 1e-3 * f64::from(Settings::default().air.regulator_lag_ms);
    let (mut setpoint, mut expected) = (rows[0].pressure_kpa, rows[0].pressure_kpa);
    let mut sum = 0.0;
    for pair in rows.windows(2) {
        let dt = pair[1].t_s - pair[0].t_s;
        let way = slew_kpa_per_s * dt;
        setpoint += (pair[1].setpoint_kpa - setpoint).clamp(-way, way);
        expected += (setpoint - expected) * (1.0 - (-dt / lag_s).exp());
        sum += (pair[1].pressure_kpa - expected).powi(2);
    }
    sum
}

/// Every value stands for a while, as commands do.
fn is_stepped(rows: &[Row]) -> bool {
    let runs: Vec<&[Row]> = rows
        .chunk_by(|a, b| a.setpoint_kpa == b.setpoint_kpa)
        .collect();
    // The first and the last may go on outside.
    let inner = runs.get(1..runs.len() - 1).unwrap_or_default();
    let mut from = runs[0].len();
    inner.iter().all(|run| {
        let stands_s = rows[from + run.len()].t_s - rows[from].t_s;
        from += run.len();
        run.len() > 1 && stands_s >= STANDS_S - 1e-9
    })
}

/// A way from one plateau to the next.
struct Ramp {
    since_s: f64,
    kpa_per_s: f64,
}

/// The line between 10 and 90 % of the way, if that is longer than a step's one or two rows.
fn ramp(
    rows: &[Row],
    values: &[f64],
    range: std::ops::Range<usize>,
    from_kpa: f64,
    to_kpa: f64,
) -> Option<Ramp> {
    let share = |i: usize| (values[i] - from_kpa) / (to_kpa - from_kpa);
    let first = range.clone().find(|i| share(*i) > 0.1)?;
    let last = range.clone().find(|i| share(*i) > 0.9)?;
    let way = share(last) - share(first);
    let takes_s = rows[last].t_s - rows[first].t_s;
    (last > first + 1).then(|| Ramp {
        since_s: rows[first].t_s - share(first) / way * takes_s,
        kpa_per_s: way * (to_kpa - from_kpa).abs() / takes_s,
    })
}

/// Standard deviation of the noise above rest, from the median bend between three rows: a ramp has none.
fn noise(values: &[f64]) -> f64 {
    let mut bends: Vec<f64> = values
        .windows(3)
        .filter(|three| three.iter().all(|kpa| *kpa > 0.0))
        .map(|three| (three[2] - 2.0 * three[1] + three[0]).abs())
        .collect();
    bends.sort_by(f64::total_cmp);
    // Of a normal distribution the median deviation is 0.674 standard deviations; such a sum has √6 of one's.
    let median = bends.get(bends.len() / 2);
    median.map_or(0.0, |bend| bend / 0.674 / 6f64.sqrt())
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or_default()
}

fn plateaus(rows: &[Row], values: &[f64], sigma: f64) -> Vec<Plateau> {
    let width = PLATEAU_KPA.max(PLATEAU_SIGMAS * sigma);
    let mut found: Vec<Plateau> = Vec::new();
    let mut from = 0;
    while from < values.len() {
        let (mut low, mut high) = (values[from], values[from]);
        let mut to = from;
        while to < values.len() && high.max(values[to]) - low.min(values[to]) <= width {
            (low, high) = (low.min(values[to]), high.max(values[to]));
            to += 1;
        }
        let lasts_s = rows[to - 1].t_s - rows[from].t_s;
        if lasts_s < PLATEAU_S && from > 0 || to - from < PLATEAU_ROWS {
            from += 1;
            continue;
        }
        let kpa = match median(&values[from..to]) {
            kpa if kpa < 2.0 * REST_KPA => 0.0,
            kpa => kpa,
        };
        match found.last_mut() {
            Some(last) if (last.kpa - kpa).abs() < SAME_KPA => last.to = to,
            _ => found.push(Plateau { from, to, kpa }),
        }
        from = to;
    }
    found
}

fn words(rows: &[Row], commands: &[(usize, f64)], slope: Option<f64>, sigma: f64) -> String {
    let mut words = Vec::new();
    if let Some(slope) = slope {
        words.push(format!("ramps of {slope:.0} kPa/s"));
    }
    if sigma >= 0.005 {
        words.push(format!("read back with ±{sigma:.2} kPa"));
    }
    let mut asked = 0.0;
    let mut parts = Vec::new();
    for &(at, kpa) in commands {
        let what = match (asked > 0.0, kpa > 0.0) {
            (false, true) => format!("a grip to {kpa:.1} kPa"),
            (true, true) => format!("a change to {kpa:.1} kPa"),
            (true, false) => "a release".into(),
            (false, false) => continue,
        };
        parts.push(format!("{what} at {:.3} s", rows[at].t_s));
        asked = kpa;
    }
    if parts.is_empty() {
        parts.push("no grip".into());
    }
    const SHOWN: usize = 6;
    let more = parts.len().saturating_sub(SHOWN);
    parts.truncate(SHOWN);
    let more = if more > 0 {
        format!(", and {more} more")
    } else {
        String::new()
    };
    let how = match words.is_empty() {
        true => String::new(),
        false => format!("{}: ", words.join(", ")),
    };
    format!("setpoint_kpa: {how}{}{more}", parts.join(", "))
}
