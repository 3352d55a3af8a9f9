//! The one table of all registers: what lies where, and what it means.
//!
//! `softgrip registers` prints it, and the image has addresses and items alone.

use softgrip::{FINGERS, blackbox};

/// Version of the map; a higher one may have more registers, and none that means something else.
pub const MAP_VERSION: u16 = 1;

/// Address of a setting's value by its number: two registers each from here on, IEEE 754 single precision, the upper half
/// first.
pub const SETTINGS_FROM: u16 = 0x2000;
/// Address of the black box: two registers for each of its words from here on, the upper half first.
pub const BLACK_BOX_FROM: u16 = 0x3000;
/// No setting has this number or a higher one.
pub const SETTINGS_END: u16 = 0x0800;

/// A row of one register for each finger has so many; of a gripper with two, the last is not known.
pub const FINGERS_IN_A_ROW: u16 = 3;
/// What a gripper with four fingers has of the fourth, in successive registers from here on.
pub const FOURTH_FROM: u16 = 0x1050;
/// In this order.
pub const FOURTH: [Item; 5] = [
    Item::Residual,
    Item::Noise,
    Item::Drift,
    Item::GaugeFault,
    Item::LossEvidence,
];

/// What may be done with a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// It can be read.
    Read,
    /// It can be read and written.
    ReadWrite,
}

/// One row of the map: a value, or one for each finger, in successive registers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Register {
    /// The first register.
    pub address: u16,
    /// What it holds.
    pub item: Item,
    /// Its name.
    pub name: &'static str,
    /// Its unit; empty for one without.
    pub unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
}

/// How a row's value lies in its registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Without a sign, in one register.
    Unsigned,
    /// With a sign, in one register; 0x8000 where it is not known.
    Signed,
    /// Without a sign, in two registers, the upper half first.
    Long,
    /// Without a sign, in one register for each finger.
    Fingers,
    /// With a sign, in one register for each finger; 0x8000 where it is not known.
    SignedFingers,
}

impl Shape {
    /// How many registers.
    pub const fn count(self) -> u16 {
        match self {
            Self::Unsigned | Self::Signed => 1,
            Self::Long => 2,
            Self::Fingers | Self::SignedFingers => FINGERS_IN_A_ROW,
        }
    }
}

/// What a row of the map holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Item {
    /// Compatible block: action request.
    Action,
    /// Compatible block: position request.
    Position,
    /// Compatible block: speed and force.
    SpeedForce,
    /// Compatible block: gripper status.
    Status,
    /// Compatible block: fault, position echo.
    FaultEcho,
    /// Compatible block: position, pressure.
    PositionPressure,
    /// Compatible block: nothing.
    Reserved,
    /// [`MAP_VERSION`].
    MapVersion,
    /// Version of the program.
    Version,
    /// First half of the hash of the finger's recipe.
    Table,
    /// Time since the start.
    Uptime,
    /// Highest pressure of a grip.
    MaxPressure,
    /// Bend of a free finger at the table's end.
    FullBend,
    /// Where the gripper is.
    State,
    /// The fault that is latched.
    Fault,
    /// What is so.
    Flags,
    /// The compatible block is obeyed.
    Activated,
    /// Measured pressure.
    Pressure,
    /// Set-point.
    SetPoint,
    /// Estimated bend.
    Bend,
    /// Summed residual over its plateau.
    Level,
    /// Lift beyond the payload's load.
    Margin,
    /// Fingers that touch.
    Touching,
    /// Contact residual.
    Residual,
    /// Noise of the gauges.
    Noise,
    /// Drift of the gauges.
    Drift,
    /// Failed gauges.
    GaugeFault,
    /// The latched loss.
    LossCause,
    /// When it began.
    LossOnset,
    /// When it was reported.
    LossFlagged,
    /// From the one to the other.
    LossLatency,
    /// How far each residual had fallen.
    LossEvidence,
    /// Requests carried out.
    Requests,
    /// Exceptions answered.
    Exceptions,
    /// Frames that were none.
    Damaged,
    /// Holds.
    Holds,
    /// Losses.
    Losses,
    /// Refusals.
    Refusals,
    /// Tares.
    Tares,
    /// Sweeps.
    Sweeps,
    /// Events without room.
    LostEvents,
    /// Mass of a payload.
    Mass,
    /// Acceleration of a payload.
    Acceleration,
    /// Kind of a payload.
    Kind,
    /// Pressure of a grip.
    GripPressure,
    /// What is to be done.
    Command,
    /// What the arm does.
    Motion,
    /// What has become of the last command.
    Fate,
    /// The last refusal.
    Refusal,
    /// What belongs to it.
    Detail,
    /// What has become of the settings.
    Settings,
    /// Whether something stands in the black box.
    BlackBox,
}

impl Item {
    /// How it lies in its registers.
    pub const fn shape(self) -> Shape {
        match self {
            Self::Table | Self::Uptime | Self::LossOnset | Self::LossFlagged | Self::Requests => {
                Shape::Long
            }
            Self::Pressure | Self::SetPoint | Self::Bend | Self::Level | Self::Margin => {
                Shape::Signed
            }
            Self::Residual | Self::Noise | Self::Drift | Self::LossEvidence => Shape::SignedFingers,
            Self::GaugeFault => Shape::Fingers,
            _ => Shape::Unsigned,
        }
    }

    /// What may be done with it.
    pub const fn access(self) -> Access {
        match self {
            Self::Action
            | Self::Position
            | Self::SpeedForce
            | Self::Mass
            | Self::Acceleration
            | Self::Kind
            | Self::GripPressure
            | Self::Command
            | Self::Motion => Access::ReadWrite,
            _ => Access::Read,
        }
    }
}

const fn at(
    address: u16,
    item: Item,
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
) -> Register {
    Register {
        address,
        item,
        name,
        unit,
        meaning,
    }
}

/// Every register but those of the settings, in the order of the addresses. An address that was ever released is not used
/// for something else.
#[rustfmt::skip]
pub const REGISTERS: [Register; 54] = [
    at(0x03E8, Item::Action, "action", "", "Upper byte: rACT bit 0, rGTO bit 3, rATR bit 4, rARD bit 5; lower byte: nothing"),
    at(0x03E9, Item::Position, "position request", "", "Lower byte: rPR, 0 open to 255 full bend; 12 and less release"),
    at(0x03EA, Item::SpeedForce, "speed and force", "", "Upper byte: rSP, share of the slew, 0 a tenth to 255 all; lower byte: rFR, limit of the pressure, 0 half to 255 all of the highest"),
    at(0x07D0, Item::Status, "gripper status", "", "Upper byte: gACT bit 0, gGTO bit 3, gSTA bits 4 and 5, gOBJ bits 6 and 7"),
    at(0x07D1, Item::FaultEcho, "fault and position echo", "", "Upper byte: gFLT; lower byte: gPR, which is rPR"),
    at(0x07D2, Item::PositionPressure, "position and pressure", "", "Upper byte: gPO, 3 open to 230 full bend; lower byte: gCU, measured pressure in kPa, 255 at most"),
    at(0x07D3, Item::Reserved, "–", "", "0"),
    at(0x07D4, Item::Reserved, "–", "", "0"),
    at(0x07D5, Item::Reserved, "–", "", "0"),

    at(0x1000, Item::MapVersion, "map version", "", "Version of this map; a higher one may have more registers, and none that means something else"),
    at(0x1001, Item::Version, "version", "", "Version of the program: 256 times the major number plus the minor one"),
    at(0x1002, Item::Table, "finger", "", "The finger that the program was built for: the first four bytes of its recipe's SHA-256"),
    at(0x1004, Item::Uptime, "uptime", "ms", "Time since the start; it wraps after 49 days"),
    at(0x1006, Item::MaxPressure, "highest pressure", "0.1 kPa", "No grip goes above: the setting regulator.max_pressure_kpa"),
    at(0x1007, Item::FullBend, "full bend", "0.1°", "Bend of a free finger where the table of its recipe ends: rPR 255, gPO 230"),

    at(0x1010, Item::State, "state", "", "1 idle, 2 closing, 3 holding, 4 empty, 5 releasing, 6 fault, 7 sweeping"),
    at(0x1011, Item::Fault, "fault", "", "Number of the latched fault (faults.md), 0 for none"),
    at(0x1012, Item::Flags, "flags", "", "Bit 0 something is held, bit 1 a loss is latched that no grip is accepted with, bit 2 a tare is asked for"),
    at(0x1013, Item::Pressure, "pressure", "0.1 kPa", "Measured pressure"),
    at(0x1014, Item::SetPoint, "set-point", "0.1 kPa", "Where the pressure is to be now"),
    at(0x1015, Item::Bend, "bend", "0.1°", "Estimated bend of the fingers"),
    at(0x1016, Item::Level, "level", "0.1 %", "While something is held: summed contact residual over its plateau"),
    at(0x1017, Item::Margin, "margin", "0.1 %", "While a payload is held: lift beyond its load"),
    at(0x1018, Item::Touching, "touching", "", "Bit 0: finger 1 touches, bit 1: finger 2, and so on"),
    at(0x1019, Item::Residual, "residual", "µε", "Contact residual of each finger"),
    at(0x101C, Item::Noise, "noise", "0.1 µε", "Noise of each gauge, rms"),
    at(0x101F, Item::Drift, "drift", "µε", "How far the zero of each gauge has been tracked since the last tare"),
    at(0x1022, Item::GaugeFault, "gauge fault", "", "Number of what has failed of each gauge (faults.md), 0 for nothing. One of three is no fault of the gripper"),

    at(0x1025, Item::Activated, "activated", "", "1 while the compatible block is obeyed. This block always is"),

    at(0x1030, Item::LossCause, "loss", "", "The loss that nobody has acknowledged here, by command 6 or by rACT: 0 none, 1 the residuals collapsed, 2 one finger emptied, 3 nothing was there after a change of pressure"),
    at(0x1031, Item::LossOnset, "loss began", "ms", "When its fall began, as uptime"),
    at(0x1033, Item::LossFlagged, "loss reported", "ms", "When it was reported, as uptime"),
    at(0x1035, Item::LossLatency, "loss latency", "0.1 ms", "From the one to the other"),
    at(0x1036, Item::LossEvidence, "loss evidence", "0.1 %", "How far the residual of each finger had fallen, of its plateau; less than 0 where it had risen"),

    at(0x1040, Item::Requests, "requests", "", "Valid requests since the start, broadcast ones too; it wraps, as all counters do"),
    at(0x1042, Item::Exceptions, "exceptions", "", "Requests that were answered with an exception"),
    at(0x1043, Item::Damaged, "damaged frames", "", "Frames with a wrong checksum or length"),
    at(0x1044, Item::Holds, "holds", "", "Holds that were recognised"),
    at(0x1045, Item::Losses, "losses", "", "Losses that were reported"),
    at(0x1046, Item::Refusals, "refusals", "", "Commands that were not carried out"),
    at(0x1047, Item::Tares, "tares", "", "Tares that gave new zeros"),
    at(0x1048, Item::Sweeps, "sweeps", "", "Sweeps that have learned the fingers"),
    at(0x1049, Item::LostEvents, "lost events", "", "Events that found no room in their tick"),

    at(0x1100, Item::Mass, "payload mass", "g", "For command 3"),
    at(0x1101, Item::Acceleration, "payload acceleration", "mm/s²", "For command 3: greatest acceleration of the arm, upwards"),
    at(0x1102, Item::Kind, "payload kind", "", "For command 3: 0 sphere, 1 upright cylinder, in the size of the recipe"),
    at(0x1103, Item::GripPressure, "grip pressure", "0.1 kPa", "For command 2: up to the highest pressure"),
    at(0x1104, Item::Command, "command", "", "Each write is one: 0 nothing, 1 grip at the pressure of the settings, 2 at the grip pressure, 3 for the payload, 4 release, 5 stop, 6 acknowledge, 7 tare, 8 sweep, 9 save the settings, 10 keep the pressure that is there, 11 clear the black box"),
    at(0x1105, Item::Motion, "arm", "", "0 it may move, 1 it stands still: a slip or a loss at rest is told sooner"),
    at(0x1106, Item::Fate, "result", "", "What has become of the last request with a command: 0 none yet, 1 being carried out, 2 it was being done already, 3 refused, 4 dropped for a stop or for a release by the digital inputs"),
    at(0x1107, Item::Refusal, "refusal", "", "Number of the latest refusal (below), 0 for none"),
    at(0x1108, Item::Detail, "refusal detail", "", "What belongs to it: the mass in g that would be possible, why a tare or a sweep failed"),
    at(0x1109, Item::Settings, "settings", "", "0 as stored, 1 changed and not stored"),
    at(0x110A, Item::BlackBox, "black box", "", "0 it runs, 1 something stands in it (below)"),
];

/// A row as the image has it.
#[derive(Debug, Clone, Copy)]
struct Place {
    address: u16,
    item: Item,
}

static PLACES: [Place; REGISTERS.len()] = places();

const fn places() -> [Place; REGISTERS.len()] {
    let mut places = [Place {
        address: 0,
        item: Item::Reserved,
    }; REGISTERS.len()];
    let mut i = 0;
    while i < places.len() {
        places[i] = Place {
            address: REGISTERS[i].address,
            item: REGISTERS[i].item,
        };
        i += 1;
    }
    places
}

/// Half of a value in two registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Half {
    /// Its first register.
    Upper,
    /// Its second one.
    Lower,
}

impl Half {
    /// Of a row's register.
    pub const fn at(offset: u16) -> Self {
        match offset % 2 {
            0 => Self::Upper,
            _ => Self::Lower,
        }
    }

    /// This half of a number.
    pub const fn of(self, number: u32) -> u16 {
        match self {
            Self::Upper => (number >> 16) as u16,
            Self::Lower => number as u16,
        }
    }
}

/// The address of a register of an item's row: of that of a finger, in a row of fingers.
pub fn address(item: Item, offset: u16) -> Option<u16> {
    let is_fourth = FOURTH.contains(&item) && offset >= FINGERS_IN_A_ROW;
    let mut fourth = (FOURTH_FROM..).zip(FOURTH);
    if is_fourth {
        let found = fourth.find(|(_, other)| *other == item);
        return found.map(|(address, _)| address);
    }
    let row = REGISTERS.iter().find(|row| row.item == item)?;
    Some(row.address + offset)
}

/// What lies at an address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum At {
    /// A register of the map: which of its row's.
    Item(Item, u16),
    /// Half of the value of a setting, if there is one of this number.
    Setting(u16, Half),
    /// Half of a word of the black box.
    BlackBox(usize, Half),
}

/// What lies at an address; none if nothing does.
pub fn find(address: u16) -> Option<At> {
    if let Some(offset) = address.checked_sub(BLACK_BOX_FROM) {
        let word = usize::from(offset / 2);
        return (word < blackbox::WORDS).then_some(At::BlackBox(word, Half::at(offset)));
    }
    if let Some(offset) = address.checked_sub(SETTINGS_FROM) {
        let number = offset / 2;
        return (number < SETTINGS_END).then_some(At::Setting(number, Half::at(offset)));
    }
    if FINGERS > usize::from(FINGERS_IN_A_ROW)
        && let Some(offset) = address.checked_sub(FOURTH_FROM)
        && let Some(item) = FOURTH.get(usize::from(offset))
    {
        return Some(At::Item(*item, FINGERS_IN_A_ROW));
    }
    // The last row that begins there or before.
    let mut rows = PLACES.iter().rev();
    let row = rows.find(|row| row.address <= address)?;
    let offset = address.wrapping_sub(row.address);
    (offset < row.item.shape().count()).then_some(At::Item(row.item, offset))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_follow_one_another_and_none_overlaps() {
        for pair in REGISTERS.windows(2) {
            let end = pair[0].address + pair[0].item.shape().count();
            assert!(end <= pair[1].address, "{:?}", pair[1]);
        }
        let last = REGISTERS.last().expect("some");
        assert!(last.address < SETTINGS_FROM);
    }

    #[test]
    fn every_register_of_a_row_is_found_and_no_other() {
        let mut found = 0;
        for address in 0..SETTINGS_FROM {
            let row = REGISTERS.iter().find(|row| {
                (row.address..row.address + row.item.shape().count()).contains(&address)
            });
            let of_fourth = usize::from(address.wrapping_sub(FOURTH_FROM));
            let fourth = FOURTH.get(of_fourth).filter(|_| FINGERS > 3);
            let expected = row
                .map(|row| At::Item(row.item, address - row.address))
                .or(fourth.map(|item| At::Item(*item, 3)));
            assert_eq!(find(address), expected, "{address:#06x}");
            found += u32::from(expected.is_some());
        }
        assert!(found > 60);
        assert_eq!(find(0x2000 + 201), Some(At::Setting(100, Half::Lower)));
        assert_eq!(
            find(0x2000 + 2 * 0x7ff),
            Some(At::Setting(0x7ff, Half::Upper))
        );
        assert_eq!(find(0x3000), Some(At::BlackBox(0, Half::Upper)));
        let last = 0x3000 + 2 * blackbox::WORDS as u16 - 1;
        let word = blackbox::WORDS - 1;
        assert_eq!(find(last), Some(At::BlackBox(word, Half::Lower)));
        assert_eq!(find(last + 1), None);
    }
}
