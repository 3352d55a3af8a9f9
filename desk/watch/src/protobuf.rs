//! Protocol Buffers on the wire, as far as recordings need them (protobuf.dev, *Encoding*).

use anyhow::{Context, bail};

/// Types of wire.
const VARINT: u32 = 0;
const FIXED_64: u32 = 1;
const BYTES: u32 = 2;
const FIXED_32: u32 = 5;

/// A message that is being written.
#[derive(Debug, Clone, Default)]
pub struct Writer(Vec<u8>);

impl Writer {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// What has been written.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    fn varint(&mut self, mut number: u64) {
        while number >= 0x80 {
            self.0.push(number as u8 | 0x80);
            number >>= 7;
        }
        self.0.push(number as u8);
    }

    fn tag(&mut self, field: u32, wire: u32) {
        self.varint(u64::from(field << 3 | wire));
    }

    /// A field of type `uint32`, `uint64`, `bool` or of an enumeration.
    pub fn whole(&mut self, field: u32, value: u64) {
        self.tag(field, VARINT);
        self.varint(value);
    }

    /// A field of type `double`.
    pub fn double(&mut self, field: u32, value: f64) {
        self.tag(field, FIXED_64);
        self.0.extend(value.to_le_bytes());
    }

    /// A field of type `float`.
    pub fn float(&mut self, field: u32, value: f32) {
        self.tag(field, FIXED_32);
        self.0.extend(value.to_le_bytes());
    }

    /// A field of type `string`.
    pub fn text(&mut self, field: u32, value: &str) {
        self.block(field, value.as_bytes());
    }

    /// A field of a message's type.
    pub fn message(&mut self, field: u32, message: &Self) {
        self.block(field, &message.0);
    }

    /// A packed field of type `sint32`.
    pub fn signed(&mut self, field: u32, values: impl Iterator<Item = i32>) {
        let mut block = Self::new();
        for value in values {
            block.varint(((value << 1) ^ (value >> 31)).cast_unsigned().into());
        }
        self.message(field, &block);
    }

    /// A packed field of type `uint32`.
    pub fn unsigned(&mut self, field: u32, values: impl Iterator<Item = u32>) {
        let mut block = Self::new();
        for value in values {
            block.varint(value.into());
        }
        if !block.0.is_empty() {
            self.message(field, &block);
        }
    }

    fn block(&mut self, field: u32, bytes: &[u8]) {
        self.tag(field, BYTES);
        self.varint(bytes.len() as u64);
        self.0.extend(bytes);
    }
}

/// A value as it is on the wire.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value<'a> {
    /// `uint32`, `uint64`, `bool` or an enumeration.
    Whole(u64),
    /// `double`.
    Double(f64),
    /// `float`.
    Float(f32),
    /// `string`, a message or a packed field.
    Bytes(&'a [u8]),
}

impl<'a> Value<'a> {
    /// A whole number.
    ///
    /// # Errors
    /// If it is something else.
    pub fn whole(self) -> anyhow::Result<u64> {
        match self {
            Self::Whole(number) => Ok(number),
            _ => bail!("a whole number is expected"),
        }
    }

    /// A number of single precision.
    ///
    /// # Errors
    /// If it is something else.
    pub fn float(self) -> anyhow::Result<f32> {
        match self {
            Self::Float(number) => Ok(number),
            _ => bail!("a float is expected"),
        }
    }

    /// A number of double precision.
    ///
    /// # Errors
    /// If it is something else.
    pub fn double(self) -> anyhow::Result<f64> {
        match self {
            Self::Double(number) => Ok(number),
            _ => bail!("a double is expected"),
        }
    }

    /// A text.
    ///
    /// # Errors
    /// If it is something else.
    pub fn text(self) -> anyhow::Result<String> {
        Ok(std::str::from_utf8(self.bytes()?)?.into())
    }

    /// A message, or a packed field.
    ///
    /// # Errors
    /// If it is something else.
    pub fn bytes(self) -> anyhow::Result<&'a [u8]> {
        match self {
            Self::Bytes(bytes) => Ok(bytes),
            _ => bail!("a message, a text or a packed field is expected"),
        }
    }

    /// The numbers of a packed field of type `sint32`.
    ///
    /// # Errors
    /// If it is something else.
    pub fn signed(self) -> anyhow::Result<Vec<i32>> {
        let numbers = self.unsigned()?;
        let back = |number: u32| (number >> 1).cast_signed() ^ -(number & 1).cast_signed();
        Ok(numbers.into_iter().map(back).collect())
    }

    /// The numbers of a packed field of type `uint32`.
    ///
    /// # Errors
    /// If it is something else.
    pub fn unsigned(self) -> anyhow::Result<Vec<u32>> {
        let mut rest = self.bytes()?;
        let mut numbers = Vec::new();
        while !rest.is_empty() {
            numbers.push(varint(&mut rest)? as u32);
        }
        Ok(numbers)
    }
}

/// Reads a message: every field with its number.
///
/// # Errors
/// If it is cut off, or none.
pub fn fields(message: &[u8]) -> anyhow::Result<Vec<(u32, Value<'_>)>> {
    let mut rest = message;
    let mut fields = Vec::new();
    while !rest.is_empty() {
        let tag = varint(&mut rest)? as u32;
        let value = match tag & 7 {
            VARINT => Value::Whole(varint(&mut rest)?),
            FIXED_64 => Value::Double(f64::from_le_bytes(array(&mut rest)?)),
            FIXED_32 => Value::Float(f32::from_le_bytes(array(&mut rest)?)),
            BYTES => {
                let length = varint(&mut rest)? as usize;
                let (bytes, after) = rest.split_at_checked(length).context(CUT)?;
                rest = after;
                Value::Bytes(bytes)
            }
            wire => bail!("wire type {wire} of field {} is unknown", tag >> 3),
        };
        fields.push((tag >> 3, value));
    }
    Ok(fields)
}

const CUT: &str = "a message is cut off";

fn array<const N: usize>(rest: &mut &[u8]) -> anyhow::Result<[u8; N]> {
    let (bytes, after) = rest.split_first_chunk::<N>().context(CUT)?;
    *rest = after;
    Ok(*bytes)
}

fn varint(rest: &mut &[u8]) -> anyhow::Result<u64> {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let (&byte, after) = rest.split_first().context(CUT)?;
        *rest = after;
        number |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Ok(number);
        }
    }
    bail!("a number has more than 64 bits")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_in_the_documentation_of_the_encoding() {
        let mut message = Writer::new();
        message.whole(1, 150);
        assert_eq!(message.bytes(), [0x08, 0x96, 0x01]);
        let mut message = Writer::new();
        message.text(2, "testing");
        assert_eq!(message.bytes(), b"\x12\x07testing");
        let mut message = Writer::new();
        message.unsigned(6, [3, 270, 86_942].into_iter());
        assert_eq!(message.bytes(), b"\x32\x06\x03\x8e\x02\x9e\xa7\x05");
        let mut message = Writer::new();
        message.signed(1, [0, -1, 1, -2, i32::MAX, i32::MIN].into_iter());
        let end = b"\x00\x01\x02\x03\xfe\xff\xff\xff\x0f\xff\xff\xff\xff\x0f";
        assert_eq!(message.bytes()[2..], *end);
    }

    #[test]
    fn what_is_written_is_read() {
        let mut message = Writer::new();
        message.double(1, -0.1);
        message.float(2, f32::MIN_POSITIVE);
        message.signed(3, [i32::MIN, -1, 0, 7, i32::MAX].into_iter());
        message.whole(4, u64::MAX);
        let fields = fields(message.bytes()).expect("a message");
        assert_eq!(fields[0], (1, Value::Double(-0.1)));
        assert_eq!(fields[1], (2, Value::Float(f32::MIN_POSITIVE)));
        let signed = fields[2].1.signed().expect("numbers");
        assert_eq!(signed, [i32::MIN, -1, 0, 7, i32::MAX]);
        assert_eq!(fields[3], (4, Value::Whole(u64::MAX)));
    }

    #[test]
    fn a_message_that_is_cut_off_is_none() {
        let mut message = Writer::new();
        message.double(1, 1.0);
        message.text(2, "text");
        for end in 1..message.bytes().len() {
            let is_whole = end == 9;
            assert_eq!(fields(&message.bytes()[..end]).is_ok(), is_whole, "{end}");
        }
        assert!(fields(&[0xff; 11]).is_err());
        assert!(fields(&[0x0b]).is_err());
    }
}
