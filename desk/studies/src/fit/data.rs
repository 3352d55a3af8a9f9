//! Measurements of a free finger: tip angle or gauge strain over pressure, as CSV.

use std::path::Path;

use anyhow::{Context, ensure};
use finger::chain::Chain;
use sim::csv_dialect::{self, Wanted};

/// Below this pressure, kPa, a free finger hardly bends: measurements there alone say nothing.
const TELLING_KPA: f64 = 20.0;
/// A pressure that is read as zero may be below it by this, kPa: 1 % of a regulator's 200 kPa, and no more.
const ZERO_KPA: f64 = 2.0;
/// A zero may be below it by so many standard deviations of its noise: a photograph's reference is off too.
const ZERO_SIGMAS: f64 = 6.0;

/// A quantity of the free finger.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Angle of the finger's tip to the unbent finger, degrees.
    TipAngle,
    /// Strain of the gauge, less that of the unbent finger, µε.
    Strain,
}

impl Quantity {
    /// Every quantity, in the order of the rows' columns.
    pub const ALL: [Self; 2] = [Self::TipAngle, Self::Strain];

    /// Name of its column in a file.
    pub fn column(self) -> &'static str {
        match self {
            Self::TipAngle => "tip_angle_deg",
            Self::Strain => "strain_ue",
        }
    }

    /// Name in text output.
    pub fn name(self) -> &'static str {
        match self {
            Self::TipAngle => "tip angle, deg",
            Self::Strain => "strain, µε",
        }
    }

    /// Number of decimals to print.
    pub fn decimals(self) -> usize {
        match self {
            Self::TipAngle => 2,
            Self::Strain => 0,
        }
    }

    /// The model's value at a pressure, in the column's unit.
    pub fn of(self, chain: &Chain, pressure_kpa: f64) -> f64 {
        match self {
            Self::TipAngle => chain.tip_angle_rad(pressure_kpa).to_degrees(),
            Self::Strain => chain.free_strain_ue(pressure_kpa),
        }
    }

    /// The largest value that a finger can show: one whole turn, or rubber at a fifth.
    fn largest(self) -> f64 {
        match self {
            Self::TipAngle => 360.0,
            Self::Strain => 200_000.0,
        }
    }
}

/// Standard deviation of what is measured, from all causes that differ between points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation of a tip angle, degrees.
    pub tip_angle_deg: f64,
    /// Standard deviation of a gauge strain, µε.
    pub strain_ue: f64,
}

impl Default for Noise {
    /// An angle read off a photograph; a gauge that creeps by about half a percent of a full bend.
    fn default() -> Self {
        Self {
            tip_angle_deg: 0.5,
            strain_ue: 100.0,
        }
    }
}

impl Noise {
    /// The standard deviation for a quantity, in the unit of its column.
    pub fn of(&self, quantity: Quantity) -> f64 {
        match quantity {
            Quantity::TipAngle => self.tip_angle_deg,
            Quantity::Strain => self.strain_ue,
        }
    }
}

/// One measured value at one pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Measured pressure, kPa.
    pub pressure_kpa: f64,
    /// Quantity of the value.
    pub quantity: Quantity,
    /// The value, in the unit of the quantity's column.
    pub value: f64,
}

/// Parsed measurements with notes on them.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurements {
    /// Measured points by rising pressure; a pressure may occur several times.
    pub points: Vec<Point>,
    /// Hysteresis of each quantity that was also measured while unloading.
    pub hysteresis: Vec<Hysteresis>,
    /// Assumptions made while reading, for the user.
    pub notes: Vec<String>,
}

/// Greatest difference between unloading and loading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis {
    /// The measured quantity.
    pub quantity: Quantity,
    /// The difference, in the unit of the quantity's column.
    pub most: f64,
    /// Pressure of the greatest difference, kPa.
    pub pressure_kpa: f64,
    /// The difference in percent of the largest value.
    pub percent: f64,
}

/// Reads and checks measurements up to the recipe's highest pressure, kPa.
///
/// # Errors
/// If the file cannot be read or a value cannot be right; the message names the line.
pub fn read(path: &Path, max_pressure_kpa: f64, noise: Noise) -> anyhow::Result<Measurements> {
    let bytes = std::fs::read(path).with_context(|| format!("{}", path.display()))?;
    parse(&bytes, max_pressure_kpa, noise).with_context(|| format!("{}", path.display()))
}

fn parse(bytes: &[u8], max_pressure_kpa: f64, noise: Noise) -> anyhow::Result<Measurements> {
    let wanted = |name, quantity, required| Wanted {
        name,
        quantity,
        required,
    };
    let table = csv_dialect::parse(
        bytes,
        &[
            wanted("pressure_kpa", csv_dialect::Quantity::Pressure, true),
            wanted("tip_angle_deg", csv_dialect::Quantity::Angle, false),
            wanted("strain_ue", csv_dialect::Quantity::Strain, false),
        ],
    )?;
    ensure!(
        table.names[1..].iter().any(Option::is_some),
        "no column tip_angle_deg or strain_ue; the header must name pressure_kpa, and tip_angle_deg or strain_ue or both"
    );
    let mut points: Vec<Point> = Vec::new();
    for row in &table.rows {
        let line = row.line;
        let within = |column: &str, value: f64, least: f64, most: f64, limit: &str| {
            ensure!(
                (least..=most).contains(&value),
                "line {line}: {column} = {value}: must lie within 0 and {most}{limit}"
            );
            Ok(value)
        };
        if row.cells[1..].iter().all(Option::is_none) {
            continue;
        }
        let pressure =
            row.cells[0].with_context(|| format!("line {line}: pressure_kpa is empty"))?;
        let limit = ", the recipe's max_pressure_kpa";
        let pressure = within("pressure_kpa", pressure, -ZERO_KPA, max_pressure_kpa, limit)?;
        let pressure_kpa = pressure.max(0.0);
        for (quantity, cell) in Quantity::ALL.into_iter().zip(&row.cells[1..]) {
            let Some(value) = *cell else {
                continue;
            };
            // Where the finger hardly bends, noise may take it below zero.
            let least = match pressure_kpa < TELLING_KPA {
                true => -ZERO_SIGMAS * noise.of(quantity),
                false => 0.0,
            };
            points.push(Point {
                pressure_kpa,
                quantity,
                value: within(quantity.column(), value, least, quantity.largest(), "")?,
            });
        }
    }
    ensure!(
        points.iter().any(|point| point.pressure_kpa >= TELLING_KPA),
        "no row at {TELLING_KPA} kPa or more: a free finger hardly bends below"
    );
    let hysteresis = Quantity::ALL
        .into_iter()
        .filter_map(|quantity| hysteresis(&points, quantity))
        .collect();
    points.sort_by(|a, b| a.pressure_kpa.total_cmp(&b.pressure_kpa));
    Ok(Measurements {
        points,
        hysteresis,
        notes: table.notes,
    })
}

/// From points in the order in which they were measured.
fn hysteresis(points: &[Point], quantity: Quantity) -> Option<Hysteresis> {
    let points: Vec<&Point> = points.iter().filter(|p| p.quantity == quantity).collect();
    let mut branches: [Vec<(f64, f64)>; 2] = Default::default();
    let (mut falls, mut turns) = (false, 0);
    for (i, point) in points.iter().enumerate() {
        let before = points[..i].iter().rev();
        let mut before = before
            .map(|p| p.pressure_kpa)
            .filter(|kpa| *kpa != point.pressure_kpa);
        let fell = before.next().is_some_and(|kpa| kpa > point.pressure_kpa);
        if fell != falls {
            turns += 1;
            if fell && i > 0 {
                // Unloading begins at the last of loading.
                branches[1].push((points[i - 1].pressure_kpa, points[i - 1].value));
            }
        }
        falls = fell;
        branches[usize::from(falls)].push((point.pressure_kpa, point.value));
    }
    // Points in no order are on no branch.
    if turns == 0 || turns > points.len() / 3 {
        return None;
    }
    let [loading, unloading] = branches.map(curve);
    let largest = points.iter().map(|p| p.value).fold(0.0, f64::max);
    unloading
        .iter()
        .filter_map(|&(kpa, value)| Some((kpa, value - at(&loading, kpa)?)))
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
        .map(|(pressure_kpa, most)| Hysteresis {
            quantity,
            most,
            pressure_kpa,
            percent: 100.0 * most / largest,
        })
}

/// By rising pressure, with the mean of repeats.
fn curve(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let repeats = points.chunk_by(|a, b| a.0 == b.0);
    let mean = |same: &[(f64, f64)]| {
        let sum: f64 = same.iter().map(|point| point.1).sum();
        (same[0].0, sum / same.len() as f64)
    };
    repeats.map(mean).collect()
}

/// The curve's value between its ends.
fn at(curve: &[(f64, f64)], kpa: f64) -> Option<f64> {
    if let Some((_, value)) = curve.iter().find(|point| point.0 == kpa) {
        return Some(*value);
    }
    let next = curve
        .windows(2)
        .find(|pair| (pair[0].0..pair[1].0).contains(&kpa))?;
    let [(a, low), (b, high)] = [next[0], next[1]];
    Some(low + (kpa - a) / (b - a) * (high - low))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_quantities_may_stand_in_any_order_among_others() {
        let text = "note,strain_ue,pressure_kpa,tip_angle_deg\nx,2000,60,11.5\ny,4300,80,24\n";
        let points = parse(text.as_bytes(), 160.0, Noise::default())
            .expect("good measurements")
            .points;
        let angle = Point {
            pressure_kpa: 80.0,
            quantity: Quantity::TipAngle,
            value: 24.0,
        };
        let strain = Point {
            quantity: Quantity::Strain,
            value: 4300.0,
            ..angle
        };
        assert_eq!(points[2..], [angle, strain]);
    }

    #[test]
    fn every_bad_file_is_named_by_its_line_and_what_would_be_right() {
        for (text, expected) in [
            ("", "line 1: no column pressure_kpa; the header must name"),
            (
                "pressure_kpa,angle\n60,11\n",
                "no column tip_angle_deg or strain_ue",
            ),
            (
                "pressure_kpa,tip_angle_deg\n60,NaN\n",
                "line 2: tip_angle_deg = \"NaN\": must be a finite number",
            ),
            (
                "pressure_kpa,tip_angle_deg\n60,\n",
                "no row at 20 kPa or more",
            ),
            (
                "pressure_kpa,tip_angle_deg\n,11\n60,12\n",
                "line 2: pressure_kpa is empty",
            ),
            (
                "pressure_kpa,tip_angle_deg\n0,-4\n60,12\n",
                "line 2: tip_angle_deg = -4: must lie within 0 and 360",
            ),
            (
                "pressure_kpa,tip_angle_deg\n60,-11\n",
                "line 2: tip_angle_deg = -11: must lie within 0 and 360",
            ),
            (
                "pressure_kpa,strain_ue\n60,2e6\n",
                "line 2: strain_ue = 2000000: must lie within 0 and 200000",
            ),
            (
                "pressure_kpa,tip_angle_deg\n60,11\n170,95\n",
                "line 3: pressure_kpa = 170: must lie within 0 and 160, the recipe's max_pressure_kpa",
            ),
            ("pressure_kpa,tip_angle_deg\n", "no row at 20 kPa or more"),
            (
                "pressure_kpa,tip_angle_deg\n10,0.1\n",
                "no row at 20 kPa or more",
            ),
            ("pressure_kpa,tip_angle_deg\n60\n70,12\n", "line 2: 1 cells"),
        ] {
            let error =
                parse(text.as_bytes(), 160.0, Noise::default()).expect_err("bad measurements");
            let message = format!("{error:#}");
            assert!(message.contains(expected), "{message}");
        }
    }
}
