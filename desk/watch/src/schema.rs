//! What the messages of a recording look like, for programs that know nothing of this one: a `FileDescriptorSet`
//! (google/protobuf/descriptor.proto).

use crate::fields::{CAUSES, FIELDS, Kind, STATES};
use crate::protobuf::Writer;

/// What all names begin with.
pub const PACKAGE: &str = "softgrip";

/// Type of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Type {
    /// `double`
    Double,
    /// `float`
    Float,
    /// `uint32`
    Whole,
    /// `uint64`
    Long,
    /// `bool`
    Flag,
    /// `string`
    Text,
    /// One of an enumeration's words.
    Choice(&'static str),
    /// `repeated sint32`, packed
    Signed,
    /// `repeated uint32`, packed
    Unsigned,
    /// `repeated` message
    Messages(&'static str),
}

/// A field: number, name and type.
pub type Field = (u32, &'static str, Type);

/// `Event`
pub const EVENT: [Field; 3] = [
    (1, "t_s", Type::Double),
    (2, "name", Type::Text),
    (3, "text", Type::Text),
];

/// `Provenance`
pub const PROVENANCE: [Field; 4] = [
    (1, "source", Type::Text),
    (2, "version", Type::Text),
    (3, "recipe", Type::Text),
    (4, "table", Type::Text),
];

/// `Settings`
pub const SETTINGS: [Field; 3] = [
    (1, "t_s", Type::Double),
    (2, "applied", Type::Flag),
    (3, "settings", Type::Messages("Setting")),
];

/// `Setting`
pub const SETTING: [Field; 3] = [
    (1, "number", Type::Whole),
    (2, "name", Type::Text),
    (3, "value", Type::Float),
];

/// `Frames`: some ticks that follow one another. Of each column the first value is the one of the first tick, and each
/// further one how much more it is than in the tick before.
pub const FRAMES: [Field; 15] = [
    (1, "number", Type::Whole),
    (2, "t_us", Type::Long),
    (3, "later_us", Type::Signed),
    (4, "gauge1", Type::Signed),
    (5, "gauge2", Type::Signed),
    (6, "gauge3", Type::Signed),
    (7, "monitor", Type::Signed),
    (8, "supply", Type::Signed),
    (9, "rail_mv", Type::Signed),
    (10, "scans", Type::Signed),
    (11, "dac", Type::Signed),
    (12, "overrun_at", Type::Unsigned),
    (13, "carried_at", Type::Unsigned),
    (14, "commands", Type::Messages("Command")),
    (15, "gauge4", Type::Signed),
];

/// `Command`: given in the tick at this place among those of its message, from 0. Every other one has none.
pub const COMMAND: [Field; 4] = [
    (1, "at", Type::Whole),
    (2, "command", Type::Choice("CommandKind")),
    (3, "first", Type::Float),
    (4, "second", Type::Float),
];

/// Commands by their numbers in a recording. They never change their meaning.
pub const COMMANDS: [&str; 16] = [
    "continue",
    "alive",
    "arm_moves",
    "arm_stands_still",
    "slew",
    "grip",
    "grip_at_kpa",
    "grip_at_deg",
    "grip_sphere_kg_m_s2",
    "grip_cylinder_kg_m_s2",
    "release",
    "halt",
    "stop",
    "acknowledge",
    "tare",
    "sweep",
];

/// The messages of all topics.
pub fn descriptors() -> Vec<u8> {
    let snapshot: Vec<Field> = FIELDS
        .iter()
        .map(|field| {
            let kind = match field.kind {
                Kind::Double => Type::Double,
                Kind::Float => Type::Float,
                Kind::Whole => Type::Whole,
                Kind::Flag => Type::Flag,
                Kind::Choice(words) if words == STATES => Type::Choice("State"),
                Kind::Choice(_) => Type::Choice("Cause"),
            };
            (field.number, field.name, kind)
        })
        .collect();
    let mut file = Writer::new();
    file.text(1, "softgrip.proto");
    file.text(2, PACKAGE);
    for (name, fields) in [
        ("Snapshot", snapshot.as_slice()),
        ("Event", &EVENT),
        ("Settings", &SETTINGS),
        ("Setting", &SETTING),
        ("Provenance", &PROVENANCE),
        ("Frames", &FRAMES),
        ("Command", &COMMAND),
    ] {
        file.message(4, &message(name, fields));
    }
    for (name, words) in [
        ("State", &STATES[..]),
        ("Cause", &CAUSES),
        ("CommandKind", &COMMANDS),
    ] {
        file.message(5, &enumeration(name, words));
    }
    let mut set = Writer::new();
    set.message(1, &file);
    set.bytes().to_vec()
}

/// `DescriptorProto`
fn message(name: &str, fields: &[Field]) -> Writer {
    let mut message = Writer::new();
    message.text(1, name);
    for (number, name, kind) in fields {
        message.message(2, &field(*number, name, *kind));
    }
    message
}

/// `FieldDescriptorProto`
fn field(number: u32, name: &str, kind: Type) -> Writer {
    const OPTIONAL: u64 = 1;
    const REPEATED: u64 = 3;
    let (label, code, of) = match kind {
        Type::Double => (OPTIONAL, 1, None),
        Type::Float => (OPTIONAL, 2, None),
        Type::Long => (OPTIONAL, 4, None),
        Type::Flag => (OPTIONAL, 8, None),
        Type::Text => (OPTIONAL, 9, None),
        Type::Messages(of) => (REPEATED, 11, Some(of)),
        Type::Whole => (OPTIONAL, 13, None),
        Type::Unsigned => (REPEATED, 13, None),
        Type::Choice(of) => (OPTIONAL, 14, Some(of)),
        Type::Signed => (REPEATED, 17, None),
    };
    let mut field = Writer::new();
    field.text(1, name);
    field.whole(3, number.into());
    field.whole(4, label);
    field.whole(5, code);
    if let Some(of) = of {
        field.text(6, &format!(".{PACKAGE}.{of}"));
    }
    if matches!(kind, Type::Signed | Type::Unsigned) {
        // Packed.
        let mut options = Writer::new();
        options.whole(2, 1);
        field.message(8, &options);
    }
    field
}

/// `EnumDescriptorProto`
fn enumeration(name: &str, words: &[&str]) -> Writer {
    let mut enumeration = Writer::new();
    enumeration.text(1, name);
    for (number, word) in (0..).zip(words) {
        let mut value = Writer::new();
        value.text(1, word);
        value.whole(2, number);
        enumeration.message(2, &value);
    }
    enumeration
}
