//! The manual's page about the registers. An image that does not print it is without its texts.

use core::fmt::{Display, Formatter, Result};

use crate::robot::{
    Access, BLACK_BOX_FROM, DETAILS, FOURTH, FOURTH_FROM, REFUSALS, REGISTERS, SETTINGS_FROM, Shape,
};
use softgrip::blackbox;

/// Every register and every number, as tables of Markdown.
#[derive(Debug, Clone, Copy)]
pub struct Page;

impl Display for Page {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        writeln!(
            f,
            "| address | registers | access | name | unit | meaning |"
        )?;
        writeln!(f, "| --- | --- | --- | --- | --- | --- |")?;
        for register in REGISTERS {
            let registers = match register.item.shape() {
                Shape::Unsigned => "1",
                Shape::Signed => "1, signed",
                Shape::Long => "2",
                Shape::Fingers => "3, one each finger",
                Shape::SignedFingers => "3, one each finger, signed",
            };
            let access = match register.item.access() {
                Access::Read => "read",
                Access::ReadWrite => "read, write",
            };
            let unit = if register.unit.is_empty() {
                "–"
            } else {
                register.unit
            };
            let (address, name, meaning) = (register.address, register.name, register.meaning);
            writeln!(
                f,
                "| 0x{address:04X} | {registers} | {access} | {name} | {unit} | {meaning} |"
            )?;
        }
        writeln!(
            f,
            "| 0x{FOURTH_FROM:04X} | {}, one each value | read | finger 4 | as theirs | Of a gripper with four fingers: residual, noise, drift, gauge fault and loss evidence of the fourth. Others have no such registers, and one with two leaves the third of each row above unknown |",
            FOURTH.len()
        )?;
        writeln!(
            f,
            "| 0x{SETTINGS_FROM:04X} + 2 · number | 2, float | read, write | setting | as set | The setting with this number (settings.md) |"
        )?;
        writeln!(
            f,
            "| 0x{BLACK_BOX_FROM:04X} + 2 · word | 2 | read | black box | – | Its {} words, while something stands in it (faults.md) |",
            blackbox::WORDS
        )?;
        for (title, numbers) in [
            ("refusal", &REFUSALS[..]),
            ("detail of 10 and 11", &DETAILS[..]),
        ] {
            writeln!(f, "\n| {title} | meaning |\n| ---: | --- |")?;
            for (number, meaning) in numbers {
                writeln!(f, "| {number} | {meaning} |")?;
            }
        }
        Ok(())
    }
}
