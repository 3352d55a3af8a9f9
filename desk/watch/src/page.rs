//! The table of all values, for the manual.

use std::fmt::{Display, Formatter, Result};

use bus::robot::{Item, REGISTERS};

use crate::fields::{FIELDS, Kind, Origin};

/// Markdown, as `docs/telemetry.md` ends.
pub struct Page;

impl Display for Page {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        writeln!(f, "| number | name | unit | type | register | meaning |")?;
        writeln!(f, "| ---: | --- | --- | --- | --- | --- |")?;
        for field in &FIELDS {
            let kind = match field.kind {
                Kind::Double => "double".into(),
                Kind::Float => "float".into(),
                Kind::Whole => "uint32".into(),
                Kind::Flag => "bool".into(),
                Kind::Choice(words) => words.join(", "),
            };
            let register = match field.register {
                Origin::Nowhere => "–".into(),
                Origin::Register { item, offset, .. } => {
                    format!("0x{:04X}", address(item) + offset)
                }
                Origin::Bit { item, bit } => format!("0x{:04X}, bit {bit}", address(item)),
            };
            let unit = match field.unit {
                "" => "–",
                unit => unit,
            };
            let (number, name, meaning) = (field.number, field.name, field.meaning);
            writeln!(
                f,
                "| {number} | `{name}` | {unit} | {kind} | {register} | {meaning} |"
            )?;
        }
        Ok(())
    }
}

/// The first register of a row of the map.
fn address(item: Item) -> u16 {
    let mut rows = REGISTERS.iter();
    rows.find(|row| row.item == item)
        .map_or(0, |row| row.address)
}
