//! What the firmware sends to a debugger: from bytes to records and log lines.
//!
//! Path `desk/decode`, package `softgrip-decode`, library `decode`. The bytes come from an RTT channel, a pipe or a socket; the image's ELF file tells what its messages mean.
//!
//! ```no_run
//! use decode::{Decoded, Decoder, Image};
//!
//! let image = Image::read(&std::fs::read("softgrip-fw")?)?;
//! let mut decoder = Decoder::new(&image);
//! for decoded in decoder.take(b"bytes as they come")? {
//!     match decoded {
//!         Decoded::Record(record) => println!("{record:?}"),
//!         Decoded::Line(line) => println!("{}", line.text),
//!     }
//! }
//! eprintln!("{} messages could not be read", decoder.malformed());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod channel;
mod image;
mod stream;

pub use channel::{Channel, ChannelError, Memory};
pub use image::{Build, Image, ImageError};
pub use stream::{Decoded, Decoder, Level, Line, StreamError};
