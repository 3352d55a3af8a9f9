//! Plausibility of a trace: a wrong unit or sign would look like a hold.

use anyhow::bail;
use softgrip::FINGERS;
use softgrip::condition::{Monitor, Reading};
use softgrip::estimate::Estimator;
use softgrip::settings::{GaugeSense, Settings};
use softgrip::table::{self, FingerTable};
use softgrip::units::Kilopascals;

use super::resample::resample;
use super::rows::{Row, Trace};

/// No regulator of a soft gripper gives more, kPa.
const MOST_KPA: f64 = 1_000.0;
/// A pressure that has settled, s after its set-point changed.
const SETTLED_S: f64 = 0.5;
/// Settled pressures are within this of their set-point in another unit.
const RATIO: f64 = 0.03;
/// A gauge that moves by less, µε, has felt nothing.
const FELT_UE: f64 = 30.0;
/// A signal stands out of its noise by this factor.
const DISTINCT: f64 = 10.0;
/// A contact, as the controller's settings have it, µε.
const CONTACT_UE: f64 = 500.0;
/// Between these a free finger's strain, µε, stands out of noise, and the finger has not touched yet.
const FREE_UE: (f64, f64) = (100.0, 600.0);
/// More than a blocked finger bends the wrong way, as a share of the free bend.
const BLOCKED: f64 = 0.3;
/// Below this nothing can be said of the bend, kPa.
const PRESSED_KPA: f64 = 20.0;
/// A gauge beyond this has failed, µε.
const RAIL_UE: f64 = 19_000.0;

/// Pressure units and their values in kPa.
const UNITS: [(&str, f64); 5] = [
    ("bar", 100.0),
    ("MPa", 1_000.0),
    ("psi", 6.894_757),
    ("mbar or hPa", 0.1),
    ("Pa", 0.001),
];

/// Checks units and signs of a trace. Gives a note on what is unusual without being wrong.
///
/// # Errors
/// If a unit or a sign cannot be right; the message names the column.
pub fn check(
    trace: &Trace,
    table: &FingerTable,
    settings: &Settings,
) -> anyhow::Result<Option<String>> {
    let sense = settings.finger.gauge_sense;
    let rows = &trace.rows;
    let pressures: Vec<f64> = rows.iter().map(|row| row.pressure_kpa).collect();
    let top_kpa = quantile(pressures.clone(), 0.99);
    let set_kpa = rows.iter().map(|row| row.setpoint_kpa).fold(0.0, f64::max);
    for (name, kpa) in [("pressure_kpa", top_kpa), ("setpoint_kpa", set_kpa)] {
        if kpa > MOST_KPA {
            bail!("{name} = {kpa:.0}: not in kPa, for no regulator gives as much; {NAME_IT}");
        }
    }
    if set_kpa == 0.0 && top_kpa > PRESSED_KPA && pressures[0] < 0.5 * top_kpa {
        bail!(
            "setpoint_kpa stays near zero while the pressure rises to {top_kpa:.0} kPa: MPa or bar, or no set-point; \
             {NAME_IT}"
        );
    }
    if let Some(ratio) = settled_ratio(rows) {
        let is = |x: f64| (ratio / x - 1.0).abs() < RATIO;
        let [pressure, setpoint] = [|kpa: f64| 1.0 / kpa, |kpa: f64| kpa]
            .map(|shown: fn(f64) -> f64| UNITS.iter().find(|(_, kpa)| is(shown(*kpa))));
        for (name, unit) in [("pressure_kpa", pressure), ("setpoint_kpa", setpoint)] {
            if let Some((unit, _)) = unit {
                bail!(
                    "{name}: the pressure settles at {ratio:.4} of its set-point, so {name} looks like {unit}; {NAME_IT}"
                );
            }
        }
    }
    let gauges: [GaugeResponse; FINGERS] =
        std::array::from_fn(|i| GaugeResponse::of(rows, i, top_kpa));
    check_strain(&gauges, top_kpa, noise(&pressures), table, sense)?;
    check_sign(rows, &gauges, top_kpa, table, settings)
}

const NAME_IT: &str =
    "state the unit in the column's name, as in pressure_bar or strain1_me, or in a row of units";

/// Response of one gauge to the pressure.
struct GaugeResponse {
    rest_ue: f64,
    /// Change from rest to pressure, µε.
    change_ue: f64,
    noise_ue: f64,
    /// It is at an end of its range.
    failed: bool,
}

impl GaugeResponse {
    fn of(rows: &[Row], finger: usize, top_kpa: f64) -> Self {
        let strain = |row: &Row| row.strain_ue[finger];
        let of = |is: &dyn Fn(f64) -> bool| -> Vec<f64> {
            let rows = rows.iter().filter(|row| is(row.pressure_kpa));
            rows.map(strain).filter(|ue| ue.is_finite()).collect()
        };
        let pressed = quantile(of(&|kpa| kpa > 0.8 * top_kpa), 0.5);
        let rest = quantile(of(&|kpa| kpa < 0.05 * top_kpa), 0.5);
        Self {
            rest_ue: rest,
            change_ue: pressed - rest,
            noise_ue: noise(&rows.iter().map(strain).collect::<Vec<_>>()),
            failed: !(pressed.abs() < RAIL_UE || pressed.abs() > 2.0 * RAIL_UE),
        }
    }
}

fn check_strain(
    gauges: &[GaugeResponse],
    top_kpa: f64,
    noise_kpa: f64,
    table: &FingerTable,
    sense: GaugeSense,
) -> anyhow::Result<()> {
    let mut changes: Vec<f64> = gauges.iter().map(|gauge| gauge.change_ue.abs()).collect();
    changes.sort_by(f64::total_cmp);
    // Two gauges do at least so; one may have failed.
    let two = changes[FINGERS - 2];
    if two > 2.0 * RAIL_UE {
        bail!(
            "strain1_ue to strain{FINGERS}_ue: two of them move by {two:.0}, more than gauges can show in µε; {NAME_IT}"
        );
    }
    let felt = gauges.iter().all(|gauge| {
        gauge.change_ue.abs() < FELT_UE && gauge.change_ue.abs() > DISTINCT * gauge.noise_ue
    });
    if top_kpa > PRESSED_KPA && felt {
        bail!(
            "strain1_ue to strain{FINGERS}_ue: they follow the pressure, but move by {:.4} at most at {top_kpa:.0} kPa: mε, ε \
             or %, and not µε; {NAME_IT}",
            changes[FINGERS - 1]
        );
    }
    // A monitor whose wire is off shows noise alone.
    if top_kpa < 0.02 || top_kpa < DISTINCT * noise_kpa {
        return Ok(());
    }
    let may_show = |kpa: f64| match sense {
        // Calibrated gains go up to two; a drift, and contact from outside.
        GaugeSense::Bend => 2.0 * free_strain(table, kpa) + 1_500.0,
        GaugeSense::Contact if kpa < PRESSED_KPA => 2.0 * CONTACT_UE,
        GaugeSense::Contact => f64::INFINITY,
    };
    let most_kpa = 1.1 * f64::from(table.max_pressure_kpa);
    let explains = |(_, kpa): &&(&str, f64)| {
        let shown = top_kpa * kpa;
        *kpa > 1.0 && shown < most_kpa && two < may_show(shown)
    };
    if two > may_show(top_kpa)
        && let Some((unit, _)) = UNITS.iter().find(explains)
    {
        bail!(
            "pressure_kpa: at {top_kpa:.2} kPa, the most, two gauges move by {two:.0} µε, where this finger can show \
             {:.0}: the pressure looks like {unit}; {NAME_IT}",
            may_show(top_kpa)
        );
    }
    Ok(())
}

/// Greatest strain of a free finger up to `kpa`, µε.
fn free_strain(table: &FingerTable, kpa: f64) -> f64 {
    f64::from(table::free_strain(table, Kilopascals(kpa as f32)).0.0)
}

/// A gauge that is the wrong way round. Under a blocked finger strain may go below zero, down to a seventh of
/// the free bend; but what bends freely before it touches bends the right way.
fn check_sign(
    rows: &[Row],
    gauges: &[GaugeResponse],
    top_kpa: f64,
    table: &FingerTable,
    settings: &Settings,
) -> anyhow::Result<Option<String>> {
    if top_kpa < PRESSED_KPA {
        return Ok(None);
    }
    let free_ue = free_strain(table, top_kpa);
    let sense = settings.finger.gauge_sense;
    let shares = approach(rows, gauges, table, settings)?;
    let is_wrong = |i: usize| match (sense, shares) {
        (GaugeSense::Contact, _) => gauges[i].change_ue < -CONTACT_UE,
        (GaugeSense::Bend, Some(shares)) => shares[i] < -0.5 && gauges[i].change_ue < 0.0,
        (GaugeSense::Bend, None) => gauges[i].change_ue < -BLOCKED * free_ue,
    };
    let wrong: Vec<usize> = (0..gauges.len())
        .filter(|i| !gauges[*i].failed && is_wrong(*i))
        .collect();
    let names: Vec<String> = wrong
        .iter()
        .map(|i| format!("strain{}_ue", i + 1))
        .collect();
    let falls = wrong.first().map_or(0.0, |i| -gauges[*i].change_ue);
    let is_sure = sense == GaugeSense::Bend && shares.is_some();
    match wrong.len() {
        0 => Ok(None),
        1 if !is_sure => Ok(Some(format!(
            "{} falls by {falls:.0} µε under pressure, unlike the others: is its bridge the wrong way round?",
            names[0]
        ))),
        _ => bail!(
            "{}: falls by {falls:.0} µε under pressure; bending must count as positive: change the sign",
            names.join(", ")
        ),
    }
}

/// Strain of each gauge over that of a free finger while the first grip closes, if the trace shows that.
fn approach(
    rows: &[Row],
    gauges: &[GaugeResponse],
    table: &FingerTable,
    settings: &Settings,
) -> anyhow::Result<Option<[f64; FINGERS]>> {
    let active = settings
        .validate(table)
        .map_err(|error| anyhow::anyhow!("settings: {error}"))?;
    let mut estimator = Estimator::new();
    let (mut products, mut squares) = ([0.0; FINGERS], 0.0);
    for row in resample(rows) {
        let reading = Reading {
            gauges: [softgrip::condition::Gauge::Missing; FINGERS],
            noise_variance: [0.0; FINGERS],
            monitor: Monitor::Valid(Kilopascals(row.pressure_kpa as f32)),
            supply: None,
            rail_is_off: false,
            stale_ticks: 0,
            overrun: false,
        };
        let free = f64::from(estimator.step(&reading, table, active.finger()).free.0);
        if free > FREE_UE.1 {
            break;
        }
        if free > FREE_UE.0 && row.strain_ue.iter().all(|ue| ue.is_finite()) {
            squares += free * free;
            for (product, (ue, gauge)) in products.iter_mut().zip(row.strain_ue.iter().zip(gauges))
            {
                *product += free * (ue - gauge.rest_ue);
            }
        }
    }
    Ok((squares > 0.0).then(|| products.map(|product| product / squares)))
}

/// Pressure over set-point where that has stood for long.
fn settled_ratio(rows: &[Row]) -> Option<f64> {
    let mut since = 0;
    let mut ratios = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        if row.setpoint_kpa != rows[since].setpoint_kpa {
            since = i;
        }
        if row.setpoint_kpa > 0.0 && row.t_s - rows[since].t_s > SETTLED_S {
            ratios.push(row.pressure_kpa / row.setpoint_kpa);
        }
    }
    (!ratios.is_empty()).then(|| quantile(ratios, 0.5))
}

/// Median step from row to row.
fn noise(values: &[f64]) -> f64 {
    let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    quantile(steps.filter(|step| step.is_finite()).collect(), 0.5)
}

/// The `share`-quantile of values; 0 if there are none.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = (share * values.len().saturating_sub(1) as f64).round() as usize;
    values.get(at).copied().unwrap_or(0.0)
}
