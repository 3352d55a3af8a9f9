//! Recognition of column names and of the units in them.

/// Physical quantity of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Time; base unit s.
    Time,
    /// Strain; base unit µε.
    Strain,
    /// Pressure; base unit kPa.
    Pressure,
    /// Angle; base unit degree.
    Angle,
}

/// A column that is looked for.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// Its name as this program writes it, with the unit in which the values are given.
    pub name: &'static str,
    /// Physical quantity, which decides the units that are accepted.
    pub quantity: Quantity,
    /// Refuse a table without it.
    pub required: bool,
}

/// A unit with its factor to the base unit of its quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// As messages call it.
    pub name: &'static str,
    /// As files write it, in lower case, with u for µ and e for ε.
    spellings: &'static [&'static str],
    times: f64,
    /// Dividing by 1000 is exact where multiplying by 0.001 is not.
    over: f64,
}

impl Unit {
    /// In the base unit of the quantity.
    pub fn convert(&self, value: f64) -> f64 {
        value * self.times / self.over
    }
}

const fn unit(
    name: &'static str,
    spellings: &'static [&'static str],
    times: f64,
    over: f64,
) -> Unit {
    Unit {
        name,
        spellings,
        times,
        over,
    }
}

/// Each list begins with the base unit.
const TIME: [Unit; 3] = [
    unit("s", &["s", "sec", "second", "seconds"], 1.0, 1.0),
    unit("ms", &["ms", "msec", "milliseconds"], 1.0, 1e3),
    unit("µs", &["us", "usec", "microseconds"], 1.0, 1e6),
];
const STRAIN: [Unit; 4] = [
    unit(
        "µε",
        &["ue", "ustrain", "microstrain", "um/m", "ppm"],
        1.0,
        1.0,
    ),
    unit("mε", &["me", "mstrain", "millistrain", "mm/m"], 1e3, 1.0),
    unit("%", &["%", "percent", "pct"], 1e4, 1.0),
    unit("ε", &["e", "strain", "m/m", "mm/mm"], 1e6, 1.0),
];
const PRESSURE: [Unit; 7] = [
    unit("kPa", &["kpa"], 1.0, 1.0),
    unit("Pa", &["pa"], 1.0, 1e3),
    unit("hPa", &["hpa"], 1.0, 10.0),
    unit("MPa", &["mpa"], 1e3, 1.0),
    unit("bar", &["bar"], 100.0, 1.0),
    unit("mbar", &["mbar"], 1.0, 10.0),
    unit("psi", &["psi"], 6.894_757_293_168_361, 1.0),
];
const ANGLE: [Unit; 2] = [
    unit("deg", &["deg", "degree", "degrees", "°"], 1.0, 1.0),
    unit("rad", &["rad", "radians"], 180.0, std::f64::consts::PI),
];

impl Quantity {
    fn units(self) -> &'static [Unit] {
        match self {
            Self::Time => &TIME,
            Self::Strain => &STRAIN,
            Self::Pressure => &PRESSURE,
            Self::Angle => &ANGLE,
        }
    }

    /// The unit in which values are given.
    pub(super) fn base(self) -> Unit {
        self.units()[0]
    }

    /// The unit of that name, with or without brackets.
    pub(super) fn unit(self, name: &str) -> Option<Unit> {
        let name = spelling(name.trim_matches(['[', ']', '(', ')', ' ']));
        let units = self.units().iter();
        units
            .copied()
            .find(|unit| unit.spellings.contains(&name.as_str()))
    }

    /// The units' names, for messages.
    pub fn known(self) -> String {
        let names: Vec<&str> = self.units().iter().map(|unit| unit.name).collect();
        names.join(", ")
    }
}

fn spelling(name: &str) -> String {
    // Two letters each look like µ and ε.
    let name = name.to_lowercase();
    let plain = name.chars().map(|c| match c {
        '\u{b5}' | '\u{3bc}' => 'u',
        '\u{3b5}' | '\u{3f5}' => 'e',
        other => other,
    });
    plain.collect()
}

/// Positions of a wanted column: those with its exact name, otherwise those whose name means it.
pub(super) fn places(names: &[String], wanted: &Wanted) -> Vec<usize> {
    let at = |is: &dyn Fn(&str) -> bool| -> Vec<usize> {
        (0..names.len()).filter(|i| is(&names[*i])).collect()
    };
    let own = at(&|name| name == wanted.name);
    match own.is_empty() {
        false => own,
        true => at(&|name| means(name, wanted).is_some()),
    }
}

/// The unit in a column's name.
pub(super) fn in_name(name: &str, wanted: &Wanted) -> Option<Unit> {
    means(name, wanted).flatten()
}

/// Whether a name means the wanted column, and its unit if it has one. Case and what stands between the words
/// do not matter.
fn means(name: &str, wanted: &Wanted) -> Option<Option<Unit>> {
    let stem = |text: &str| -> String {
        let letters = text.chars().filter(|c| c.is_alphanumeric());
        letters.collect::<String>().to_lowercase()
    };
    let (own, _) = wanted.name.rsplit_once('_').unwrap_or((wanted.name, ""));
    let is_own = |text: &str| {
        let text = stem(text);
        text == stem(own) || own == "t" && text == "time"
    };
    if is_own(name) {
        return Some(None);
    }
    let name = name.trim_end_matches([']', ')', ' ']);
    let mut splits = name.match_indices(['_', '[', '(', ' ', ',', '/']);
    splits.find_map(|(at, between)| {
        let unit = wanted.quantity.unit(&name[at + between.len()..])?;
        is_own(&name[..at]).then_some(Some(unit))
    })
}
