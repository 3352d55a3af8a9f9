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
    /// How many.
    pub fn count(&self) -> u16 {
        self.0.len() as u16
    }

    /// The values in their order.
    pub fn iter(&self) -> impl Iterator<Item = u16> + '_ {
        self.0.iter().map(|bytes| u16::from_be_bytes(*bytes))
    }
}

/// Successive registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Range {
    /// The first.
    pub address: u16,
    /// How many.
    pub count: u16,
}

impl Range {
    /// None.
    pub const NONE: Self = Self {
        address: 0,
        count: 0,
    };

    /// Address and count, of which there are at most so many.
    fn of([a, b, c, d]: [u8; 4], most: u16) -> Result<Self, Exception> {
        let range = Self {
            address: u16::from_be_bytes([a, b]),
            count: u16::from_be_bytes([c, d]),
        };
        match (1..=most).contains(&range.count) {
            true => Ok(range),
            false => Err(Exception::IllegalValue),
        }
    }

    /// The addresses in their order. After the last one of all comes 0, where no register lies.
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
    /// does not agree with the number of bytes. Whether there are such registers is for others to find.
    pub fn decode(code: u8, data: &'a [u8]) -> Result<Self, Exception> {
        let function = Function::of(code).ok_or(Exception::IllegalFunction)?;
        let (read, rest) = match function {
            Function::ReadHolding | Function::ReadInput | Function::ReadWrite => {
                let head = data.split_first_chunk::<4>();
                let (head, rest) = head.ok_or(Exception::IllegalValue)?;
                (Range::of(*head, MOST_READ)?, rest)
            }
            Function::WriteOne | Function::WriteMany => (Range::NONE, data),
        };
        let (write_address, values) = match (function, rest) {
            (Function::ReadHolding | Function::ReadInput, []) => (0, rest),
            (Function::WriteOne, [a, b, values @ ..]) if values.len() == 2 => {
                (u16::from_be_bytes([*a, *b]), values)
            }
            (Function::WriteMany | Function::ReadWrite, [a, b, c, d, bytes, values @ ..]) => {
                let most = match function {
                    Function::ReadWrite => MOST_WRITTEN_BEFORE_READ,
                    _ => MOST_WRITTEN,
                };
                let range = Range::of([*a, *b, *c, *d], most)?;
                let stated = [usize::from(*bytes), usize::from(range.count) << 1];
                if stated != [values.len(); 2] {
                    return Err(Exception::IllegalValue);
                }
                (range.address, values)
            }
            _ => return Err(Exception::IllegalValue),
        };
        Ok(Self {
            function,
            write_address,
            values: Values(values.as_chunks().0),
            read,
        })
    }
}
