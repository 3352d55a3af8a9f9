//! Streams as they come: in pieces, damaged, and of another image.

use decode::{Build, Decoded, Decoder, Image, ImageError, Level, StreamError};
use object::write::{Object, Symbol, SymbolSection};
use object::{
    Architecture, BinaryFormat, Endianness, SectionKind, SymbolFlags, SymbolKind, SymbolScope,
};
use softgrip::telemetry::frame::{Frame, SIZE};
use softgrip::telemetry::{BUILD_MARK, Record, RecordError, Snapshot};
use softgrip::units::{DacCode, Instant, Kilopascals};
use softgrip::{Command, Grip, RawFrame};

/// Indices of the messages of [`elf`].
const RECORD: u16 = 1;
const EVENT: u16 = 2;
const BUILD: u16 = 3;

/// An image that has these messages, and this build.
fn elf(record: &str, build: Option<[u8; 8]>) -> Vec<u8> {
    let mut elf = Object::new(BinaryFormat::Elf, Architecture::Arm, Endianness::Little);
    let section = elf.add_section(Vec::new(), b".defmt".to_vec(), SectionKind::ReadOnlyData);
    let mut add = |name: String, value: u16| {
        elf.add_symbol(Symbol {
            name: name.into_bytes(),
            value: value.into(),
            size: 1,
            kind: SymbolKind::Data,
            scope: SymbolScope::Linkage,
            weak: false,
            section: SymbolSection::Section(section),
            flags: SymbolFlags::None,
        });
    };
    let messages = [
        ("defmt_timestamp", "{=u64:us}", 0),
        ("defmt_info", record, RECORD),
        ("defmt_warn", "event {=u32}", EVENT),
        ("defmt_info", "{=str}{=[u8; 8]:02x}", BUILD),
    ];
    for (tag, data, index) in messages {
        let name = format!(
            r#"{{"package":"p","tag":"{tag}","data":"{data}","disambiguator":"{index}","crate_name":"c"}}"#
        );
        add(name, index);
    }
    add("_defmt_encoding_ = rzcobs".into(), 4);
    add("_defmt_version_ = 4".into(), 5);
    if let Some(build) = build {
        let note = elf.add_section(Vec::new(), b".build_id".to_vec(), SectionKind::Note);
        let mut bytes: Vec<u8> = [4u32, 8, 3]
            .into_iter()
            .flat_map(u32::to_le_bytes)
            .collect();
        bytes.extend(b"GNU\0");
        bytes.extend(build);
        elf.set_section_data(note, bytes, 4);
    }
    elf.write().expect("an ELF file")
}

const ID: [u8; 8] = [1, 0, 3, 4, 5, 6, 7, 0xfe];

fn image() -> Image {
    Image::read(&elf("record {=[u8]}", Some(ID))).expect("an image")
}

/// A message as the firmware's log packs it.
fn packed(index: u16, at_us: u64, rest: &[u8]) -> Vec<u8> {
    let mut ring = [0; SIZE];
    let mut frame = Frame::begin(0, 0);
    frame.write(&mut ring, &index.to_le_bytes());
    frame.write(&mut ring, &at_us.to_le_bytes());
    frame.write(&mut ring, rest);
    let end = frame.end(&mut ring).expect("it fits");
    ring[..end].to_vec()
}

fn with_length(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

fn told(build: [u8; 8]) -> Vec<u8> {
    let mut rest = with_length(BUILD_MARK.as_bytes());
    rest.extend(build);
    packed(BUILD, 5, &rest)
}

fn record(number: u32) -> Record {
    Record {
        number,
        longest_tick_us: 30,
        events_lost: 0,
        internal_clock: false,
        frame: RawFrame::default(),
        command: Command::Grip(Grip::Pressure(Kilopascals(80.0))),
        dac: DacCode(1_200),
        snapshot: Snapshot {
            now: Instant::from_micros(1_000 * u64::from(number)),
            state: softgrip::grasp::State::Idle,
            lost: None,
            pressure: None,
            setpoint: Kilopascals(0.0),
            residual: [None; 3],
            touching: [false; 3],
            bend: softgrip::units::Degrees(0.0),
            level: None,
            margin: None,
            noise: Default::default(),
            drift: Default::default(),
            tare_due: false,
        },
    }
}

fn sent(record: &Record) -> Vec<u8> {
    let mut bytes = [0; Record::BYTES];
    packed(RECORD, 7, &with_length(record.encode(&mut bytes)))
}

#[test]
fn records_and_lines_come_out_as_they_went_in_however_the_bytes_come() {
    let image = image();
    let event = packed(EVENT, 1_234_567, &9u32.to_le_bytes());
    let stream = [told(ID), sent(&record(1)), event, sent(&record(2))].concat();
    for piece in [1, 2, 7, stream.len()] {
        let mut decoder = Decoder::new(&image);
        let decoded: Vec<Decoded> = stream
            .chunks(piece)
            .flat_map(|bytes| decoder.take(bytes).expect("of this image"))
            .collect();
        let [
            Decoded::Line(build),
            Decoded::Record(first),
            Decoded::Line(event),
            Decoded::Record(second),
        ] = &decoded[..]
        else {
            panic!("{decoded:?}");
        };
        assert!(build.text.starts_with(BUILD_MARK), "{}", build.text);
        assert_eq!((**first, **second), (record(1), record(2)));
        assert_eq!(event.level, Some(Level::Warn));
        assert_eq!(event.at_us, Some(1_234_567));
        assert_eq!(event.text, "event 9");
        assert_eq!(decoder.malformed(), 0);
    }
}

#[test]
fn what_is_damaged_is_counted_and_the_rest_is_read() {
    let image = image();
    let mut decoder = Decoder::new(&image);
    let whole = sent(&record(1));
    let cut = &whole[whole.len() / 2..];
    let unknown = packed(77, 0, &[]);
    let endless = vec![1; 3 * SIZE];
    let stream = [cut, &unknown, &endless, &[0], &whole].concat();
    let decoded = decoder.take(&stream).expect("of this image");
    assert_eq!(decoded, [Decoded::Record(Box::new(record(1)))]);
    assert!(decoder.malformed() >= 3, "{}", decoder.malformed());
}

#[test]
fn the_elf_file_of_another_image_is_refused_by_its_build_whatever_its_indices_mean() {
    let image = image();
    let running = [9; 8];
    let mut told = told(running);
    assert_eq!(told[0], BUILD as u8);
    for index in [BUILD as u8, EVENT as u8, RECORD as u8, 0x7f] {
        told[0] = index;
        let refused = Decoder::new(&image).take(&told).expect_err("another build");
        let expected = StreamError::OtherBuild {
            file: Build(ID),
            running: Build(running),
        };
        assert_eq!(refused, expected);
        let words = refused.to_string();
        assert!(words.contains("01000304050607fe"), "{words}");
        assert!(words.contains("0909090909090909"), "{words}");
    }
}

#[test]
fn records_of_another_layout_are_refused() {
    let mut bytes = [0; Record::BYTES];
    let length = record(1).encode(&mut bytes).len();
    bytes[0] = 99;
    let message = packed(RECORD, 7, &with_length(&bytes[..length]));
    let refused = Decoder::new(&image()).take(&message);
    assert_eq!(
        refused,
        Err(StreamError::OtherLayout(RecordError::Layout(99)))
    );
}

#[test]
fn a_file_that_tells_nothing_is_refused_with_the_reason() {
    let read = |elf: &[u8]| Image::read(elf).expect_err("nothing to read by");
    assert!(matches!(read(b"text"), ImageError::NoElf(_)));
    assert!(matches!(
        read(&elf("snapshot {=u32}", Some(ID))),
        ImageError::NoRecords
    ));
    assert!(matches!(
        read(&elf("record {=[u8]}", None)),
        ImageError::NoBuild
    ));
    let empty = Object::new(BinaryFormat::Elf, Architecture::Arm, Endianness::Little);
    let empty = empty.write().expect("an ELF file");
    assert!(matches!(read(&empty), ImageError::NoMessages(_)));
}
