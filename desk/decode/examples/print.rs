//! Prints what the firmware sends: `… | cargo run -p softgrip-decode --example print -- ELF`, with the bytes of the RTT
//! channel on standard input.

use std::io::{Read, Write};

use decode::{Decoded, Decoder, Image};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("name the image's ELF file")?;
    let image = Image::read(&std::fs::read(&path).map_err(|error| format!("{path}: {error}"))?)?;
    let mut decoder = Decoder::new(&image);
    let (mut input, mut output) = (std::io::stdin().lock(), std::io::stdout().lock());
    let mut bytes = [0; 4096];
    loop {
        let length = input.read(&mut bytes)?;
        for decoded in decoder.take(&bytes[..length])? {
            match decoded {
                Decoded::Record(record) => writeln!(output, "{record:?}")?,
                Decoded::Line(line) => writeln!(output, "{}", line.text)?,
            }
        }
        if length == 0 {
            eprintln!("{} messages could not be read", decoder.malformed());
            return Ok(());
        }
    }
}
