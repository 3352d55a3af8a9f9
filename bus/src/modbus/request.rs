//! What a master asks for, from function code and data.

/// Registers that one request may read …
pub const MOST_READ: u16 = 125;
/// … and write, with function 16 and with function 23 (Application Protocol, 6.12 and 6.17).
const MOST_WRITTEN: u16 = 123;
const MOST_WRITTEN_BEFORE_READ: u16 = 121;

/// Why a request is not carried out; the numbers are the protocol's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exception {
    /// There is no such function.
    IllegalFunction = 1,
    /// There is no such register, or not for that.
    IllegalAddress = 2,
    /// A count or a value is out of its range.
    IllegalValue = 3,
    /// It cannot be done here: something has failed.
    DeviceFailure = 4,
    /// It cannot be done now.
    Busy = 6,
}

/// A function code that is known here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Function {
    /// Read holding registers.
    ReadHolding = 3,
    /// Read input registers: the same ones here.
    ReadInput = 4,
    /// Write one register.
    WriteOne = 6,
    /// Write several registers.
    WriteMany = 16,
    /// Write several registers, then read.
    ReadWrite = 23,
}

impl Function {
    /// The function of this code; none if it is not known here.
    pub const fn of(code: u8) -> Option<Self> {
        Some(match code {
            3 => Self::ReadHolding,
            4 => Self::ReadInput,
            6 => Self::WriteOne,
            16 => Self::WriteMany,
            23 => Self::ReadWrite,
            _ => return None,
        })
    }
}

/// Values of successive registers, as they lie in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Values<'a>(&'a [[u8; 2]]);

impl Values<'_> {
    /// None.
    pub const NONE: Self = Self(&[]);

    /// How many.
    pub fn count(&self) -> u16 {
        self.0.len() as u16
    }

    /// The values in their order.
    pub fn iter(&self) -> impl Iterator<Item = u16> + '_ {
        self.0.iter().map(|bytes| u16::from_be_bytes(*bytes))
    }
}

/// A range of registers to read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Range {
    /// The first.
    pub address: u16,
    /// How many; no register lies beyond 0xFFFF.
    pub count: u16,
}

impl Range {
    /// The addresses in their order.
    pub fn addresses(self) -> impl Iterator<Item = u16> {
        (0..self.count).map(move |place| self.address.wrapping_add(place))
    }
}

/// A well-formed request: what is to be written, before what is to be read. Either may be empty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request<'a> {
    /// Its function.
    pub function: Function,
    /// The first register to be written.
    pub write_address: u16,
    /// What is to be written there and behind.
    pub values: Values<'a>,
    /// What is to be read after that.
    pub read: Range,
}

impl<'a> Request<'a> {
    /// What is to be written, with its addresses.
    pub fn written(&self) -> impl Iterator<Item = (u16, u16)> + '_ {
        let range = Range {
            address: self.write_address,
            count: self.values.count(),
        };
        range.addresses().zip(self.values.iter())
    }

    /// The request of a function code and its data, without id and checksum.
    ///
    /// # Errors
    /// The exception that is to be answered: an unknown function, a count outside the protocol's limits or one that
    /// does not agree with the number of bytes, registers beyond 0xFFFF.
    pub fn decode(code: u8, data: &'a [u8]) -> Result<Self, Exception> {
        let function = Function::of(code).ok_or(Exception::IllegalFunction)?;
        let (words, odd) = data.as_chunks::<2>();
        let read = |words: &[[u8; 2]]| match *words {
            [address, count, ..] => range(address, count, MOST_READ),
            _ => Err(Exception::IllegalValue),
        };
        let none = Range::default();
        let (written, read) = match (function, words, odd) {
            (Function::ReadHolding | Function::ReadInput, [_, _], []) => {
                ((none, Values::NONE), read(words)?)
            }
            (Function::WriteOne, [address, _], []) => {
                let one = Range {
                    address: u16::from_be_bytes(*address),
                    count: 1,
                };
                ((one, Values(words.get(1..).unwrap_or_default())), none)
            }
            (Function::WriteMany, ..) => (written(data, MOST_WRITTEN)?, none),
            (Function::ReadWrite, [_, _, ..], _) => {
                let behind = data.get(4..).unwrap_or_default();
                (written(behind, MOST_WRITTEN_BEFORE_READ)?, read(words)?)
            }
            _ => return Err(Exception::IllegalValue),
        };
        Ok(Self {
            function,
            write_address: written.0.address,
            values: written.1,
            read,
        })
    }
}

fn range(address: [u8; 2], count: [u8; 2], most: u16) -> Result<Range, Exception> {
    let (address, count) = (u16::from_be_bytes(address), u16::from_be_bytes(count));
    if count == 0 || count > most {
        return Err(Exception::IllegalValue);
    }
    match address.checked_add(count - 1) {
        Some(_) => Ok(Range { address, count }),
        None => Err(Exception::IllegalAddress),
    }
}

/// Address, count, number of bytes and values, to the end of the data.
fn written(data: &[u8], most: u16) -> Result<(Range, Values<'_>), Exception> {
    let [a, b, c, d, bytes, values @ ..] = data else {
        return Err(Exception::IllegalValue);
    };
    let range = range([*a, *b], [*c, *d], most)?;
    let (values, odd) = values.as_chunks::<2>();
    let agree = usize::from(*bytes) == 2 * values.len() && usize::from(range.count) == values.len();
    match (agree, odd) {
        (true, []) => Ok((range, Values(values))),
        _ => Err(Exception::IllegalValue),
    }
}
