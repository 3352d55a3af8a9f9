//! The checksum of a frame: CRC-16/MODBUS.

/// The checksum; on the wire its low byte comes first. Over a frame with its checksum it is zero.
// Bit by bit: a table would take 512 bytes of flash, and a longest frame takes 20 000 instructions outside the tick.
pub fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xffff, |sum, &byte| {
        (0..8).fold(sum ^ u16::from(byte), |sum, _| match sum & 1 {
            0 => sum >> 1,
            _ => sum >> 1 ^ 0xa001,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::crc;

    #[test]
    fn the_checksum_is_that_of_the_catalogue() {
        // CRC RevEng catalogue, CRC-16/MODBUS: check and residue.
        assert_eq!(crc(b"123456789"), 0x4b37);
        assert_eq!(crc(b"123456789\x37\x4b"), 0);
    }
}
