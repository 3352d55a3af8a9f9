//! Modbus RTU, the side of a slave: bytes with time stamps → requests, and replies → bytes. It knows no register's
//! meaning.
//!
//! After the Modbus Application Protocol 1.1b3 and Modbus over Serial Line 1.02. Functions: 03 and 04 read, 06 and 16
//! write, 23 writes and then reads.

mod crc;
mod line;
mod reply;
mod request;

pub use crc::crc;
pub use line::{Frame, Receiver, STALE_US, Timing};
pub use reply::{LONGEST, Reply};
pub use request::{Exception, Function, MOST_READ, Range, Request, Values};
