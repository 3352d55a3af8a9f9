//! What was measured on a free finger: tip angle or gauge strain against pressure, as CSV.

use std::path::Path;

use anyhow::{Context, ensure};
use finger::chain::Chain;

/// Below this pressure, kPa, a free finger hardly bends: measurements there alone say nothing.
const TELLING_KPA: f64 = 20.0;

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

    /// Its column in a file.
    pub fn column(self) -> &'static str {
        match self {
            Self::TipAngle => "tip_angle_deg",
            Self::Strain => "strain_ue",
        }
    }

    /// Its name for a person.
    pub fn name(self) -> &'static str {
        match self {
            Self::TipAngle => "tip angle, deg",
            Self::Strain => "strain, µε",
        }
    }

    /// Decimals worth showing.
    pub fn decimals(self) -> usize {
        match self {
            Self::TipAngle => 2,
            Self::Strain => 0,
        }
    }

    /// What the model says, in the column's unit.
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
    /// Of a tip angle, degrees.
    pub tip_angle_deg: f64,
    /// Of a gauge strain, µε.
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
    /// In the unit of the quantity's column.
    pub fn of(&self, quantity: Quantity) -> f64 {
        match quantity {
            Quantity::TipAngle => self.tip_angle_deg,
            Quantity::Strain => self.strain_ue,
        }
    }
}

/// One measured value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Pressure, kPa.
    pub pressure_kpa: f64,
    /// What was measured.
    pub quantity: Quantity,
    /// The value, in the unit of the quantity's column.
    pub value: f64,
}

/// Reads and checks measurements up to the recipe's highest pressure, kPa.
pub fn read(path: &Path, max_pressure_kpa: f64) -> anyhow::Result<Vec<Point>> {
    let file = std::fs::File::open(path).with_context(|| format!("{}", path.display()))?;
    parse(file, max_pressure_kpa).with_context(|| format!("{}", path.display()))
}

fn parse(input: impl std::io::Read, max_pressure_kpa: f64) -> anyhow::Result<Vec<Point>> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(input);
    let header = reader.headers()?.clone();
    let place = |column: &str| header.iter().position(|name| name == column);
    let expected = "the header must name pressure_kpa, and tip_angle_deg or strain_ue or both";
    let at_pressure = place("pressure_kpa")
        .with_context(|| format!("line 1: no column pressure_kpa; {expected}"))?;
    let columns: Vec<(Quantity, usize)> = Quantity::ALL
        .into_iter()
        .filter_map(|quantity| Some((quantity, place(quantity.column())?)))
        .collect();
    ensure!(
        !columns.is_empty(),
        "line 1: no column tip_angle_deg or strain_ue; {expected}"
    );
    let mut points: Vec<Point> = Vec::new();
    for record in reader.records() {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |place: usize, max: f64, limit: &str| {
            let (column, text) = (&header[place], &record[place]);
            let value: f64 = text
                .parse()
                .ok()
                .filter(|value: &f64| value.is_finite())
                .with_context(|| {
                    format!("line {line}: {column} = {text:?}: must be a finite number")
                })?;
            ensure!(
                (0.0..=max).contains(&value),
                "line {line}: {column} = {value}: must lie within 0 and {max}{limit}"
            );
            Ok(value)
        };
        let limit = ", the recipe's max_pressure_kpa";
        let pressure_kpa = number(at_pressure, max_pressure_kpa, limit)?;
        if let Some(before) = points.last().map(|point| point.pressure_kpa) {
            ensure!(
                pressure_kpa > before,
                "line {line}: pressure_kpa = {pressure_kpa}: pressure must rise, and the row before is at {before}"
            );
        }
        for &(quantity, place) in &columns {
            points.push(Point {
                pressure_kpa,
                quantity,
                value: number(place, quantity.largest(), "")?,
            });
        }
    }
    ensure!(
        points.iter().any(|point| point.pressure_kpa >= TELLING_KPA),
        "no row at {TELLING_KPA} kPa or more: a free finger hardly bends below"
    );
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_quantities_may_stand_in_any_order_among_others() {
        let text = "note,strain_ue,pressure_kpa,tip_angle_deg\nx,2000,60,11.5\ny,4300,80,24\n";
        let points = parse(text.as_bytes(), 160.0).expect("good measurements");
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
                "line 1: no column tip_angle_deg or strain_ue",
            ),
            (
                "pressure_kpa,tip_angle_deg\n60,NaN\n",
                "line 2: tip_angle_deg = \"NaN\": must be a finite number",
            ),
            (
                "pressure_kpa,tip_angle_deg\n60,\n",
                "line 2: tip_angle_deg = \"\"",
            ),
            (
                "pressure_kpa,tip_angle_deg\n60,11\n60,12\n",
                "line 3: pressure_kpa = 60: pressure must rise, and the row before is at 60",
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
            ("pressure_kpa,tip_angle_deg\n60\n", "line: 2"),
        ] {
            let error = parse(text.as_bytes(), 160.0).expect_err("bad measurements");
            let message = format!("{error:#}");
            assert!(message.contains(expected), "{message}");
        }
    }
}
